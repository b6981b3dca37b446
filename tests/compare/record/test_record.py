"""The record: what is made from a declaration, and that a column takes one line in one file."""

from __future__ import annotations

import csv
import json
import os
import shutil
import subprocess
import sys

import numpy as np
import pytest

from compare.page.csv import as_csv
from compare.page.pair import PAIR
from compare.page.state import STATE
from compare.page.table import Table
from compare.record.quantity import ABSENT, DATA, Part, Quantity, first, joined, pick, plainly
from compare.record.views import cells, columns_of, document, in_si, row_of, unit_of
from compare.registry import BUILT_IN, model
from compare.scene.units import Units
from compare.sweep.record import RUN
from tests.compare.scene.held_scenes import STEEL
from tests.test_setup import ROOT

#: One number, one vector in a pose, one mapping, one that only some items have, and one of files alone.
RECORD = (
    Quantity("size", "size", "l", "digits:3", rank=1, legend="how large", of=lambda item: item["size"]),
    Quantity("end", unit="l", kind="digits", parts=(Part("position.x", "end.x"), Part("position.z", "end.z")),
             of=lambda item: {"position": np.array([1.0, 2.0, 3.0]), "frame": np.eye(3)}),
    Quantity("deep.energy", unit="D w / l", kind="digits:2", parts=("elastic", "tip"),
             of=lambda item: {"elastic": item["size"] ** 2}),
    Quantity("tip", unit="D w / l^2", kind="digits", of=lambda item: item.get("tip", ABSENT)),
    Quantity("story", kind=DATA, of=lambda item: ["once", {"upon": 1.0}]),
)  # fmt: skip
ITEM = {"size": 0.5}
SI = Units(2.0, 0.1, 3.0)


def test_a_document_is_nested_by_dots_without_what_is_absent():
    found = document(RECORD, ITEM)
    assert list(found) == ["size", "end", "deep", "story"]
    assert found["deep"] == {"energy": {"elastic": 0.25}}
    assert document(RECORD, {"size": 1.0, "tip": None})["tip"] is None  # not known is not absent


def test_its_numbers_in_si():
    si = in_si(RECORD, document(RECORD, {**ITEM, "tip": 4.0}), SI)
    assert si == {
        "size": 1.0, "end": {"position": [2.0, 4.0, 6.0]}, "deep": {"energy": {"elastic": 0.25 * 3.0 / 2.0}},
        "tip": 4.0 * 3.0 / 4.0,
    }  # fmt: skip
    assert in_si(RECORD, document(RECORD, ITEM), Units()) is None


def test_its_columns_and_cells():
    keys = ["size", "end.x", "end.z", "deep.energy.elastic", "deep.energy.tip", "tip"]
    assert [column.key for column in columns_of(RECORD)] == keys
    assert [column.unit for column in columns_of(RECORD)] == ["l", "l", "l", "D w / l", "D w / l", "D w / l^2"]
    assert row_of(RECORD, ITEM) == {"size": 0.5, "end.x": 1.0, "end.z": 3.0, "deep.energy.elastic": 0.25}
    assert as_csv(Table.of("T", RECORD, [ITEM])) == ",".join(keys) + "\n0.5,1.0,3.0,0.25,,\n"


def test_units_and_paths():
    assert unit_of(RECORD, "deep.energy.elastic") == "D w / l"
    assert unit_of(RECORD, "deep") == unit_of(RECORD, "sizes") == ""
    found = {"a": {"b": 1.0, "v": [1.0, 2.0]}, "log": [{"x": 1}], "many": [1.0, 2.0, 3.0, 4.0], "word": "so"}
    assert dict(cells(found)) == {"a.b": 1.0, "a.v": (1.0, 2.0), "word": "so"}


def test_one_takes_the_place_of_another():
    own = Quantity("end", kind=DATA, of=lambda item: "own"), Quantity("more", kind=DATA, of=lambda item: 1)
    both = joined(RECORD, own)
    assert [quantity.key for quantity in both] == ["size", "end", "deep.energy", "tip", "story", "more"]
    assert document(both, ITEM)["end"] == "own"
    assert [quantity.key for quantity in first(RECORD, "tip")][:2] == ["tip", "size"]
    none = joined(RECORD, [Quantity("size", kind=DATA, of=lambda item: ABSENT)])
    assert document(none, ITEM)["size"] == 0.5  # what every item has
    with pytest.raises(KeyError):
        pick(RECORD, "nothing")
    (plain,) = plainly(pick(RECORD, "size"), "digits:5")
    assert (plain.columns[0].kind, plain.columns[0].heading, plain.columns[0].legend) == ("digits:5", "size", "")
    assert plain.notes == ("how large",)


def test_a_kind_that_no_column_has_is_refused():
    with pytest.raises(ValueError, match="roman"):
        Quantity("year", kind="roman", of=lambda item: item)


@pytest.mark.parametrize("entry", BUILT_IN, ids=lambda entry: entry.name)
def test_no_key_and_no_column_is_declared_twice(entry):
    own = getattr(model(entry.name), "quantities", ())
    for record in (STATE, PAIR, RUN, own):
        names = [column.key for column in columns_of(record)]
        assert len(set(names)) == len(names)
    for record in (STATE, PAIR, own):
        keys = [quantity.key for quantity in record]
        assert len(set(keys)) == len(keys)


HEIGHT = """
    Quantity("height", unit="l", kind="digits:6", note="planted: of the middle",
             of=lambda a: a.state.middle.position[2]),
"""
GAP = """
    Quantity("gap", "gap", "l", "digits:6", note="planted: twice the distance", of=lambda r: 2.0 * r.hausdorff),
"""
OF_A_ROW = """
import numpy as np
from compare.page.csv import as_csv
from compare.page.pair import Row, Times
from compare.page.si import with_si
from compare.page.table import Table
from compare.pages import comparison
from compare.pages.result import row_result
from compare.scene.scene import load
from docs import tables
scene = load("steel.toml")
row = Row(100.0, "converged", True, "", 2e-3, None, 1e-5, 1e-4, True, None, None, None, None,
          Times(1.0, 2.0), (1, 1), 1, False, True, "", warm=True, searched=False)
found = row_result(row, scene)
print(found["gap"], found["si"]["gap"])
table = Table.of("T", comparison.TABLE, [row])
head, cells = (line.split(",") for line in as_csv(table).splitlines())
print(cells[head.index("gap")])
page = tables.rendered(tables.PAGE.read_text())
print(page.count("| `gap` | l | planted: twice the distance |"))
print(page.count("| `height` | l | planted: of the middle |"), page.count("| `height` | l | m |"))
"""


def planted(text: str, before: str, line: str) -> str:
    assert text.count(before) == 1
    return text.replace(before, line.lstrip("\n") + before)


def test_a_column_touches_one_file(tmp_path):
    """A line in the record of a state, and one in that of a row: result.json, SI, CSV of sweeps and of comparisons, the
    terminal and docs/tables.md have them, each in its unit."""
    for name in ("compare", "ribbonbench", "ribbon", "shellref", "docs"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__", "*.png"))
    (tmp_path / "steel.toml").write_text(STEEL)
    state, pair = tmp_path / "compare/page/state.py", tmp_path / "compare/page/pair.py"
    state.write_text(planted(state.read_text(), '    Quantity("max_abs_eta", kind', HEIGHT))
    pair.write_text(planted(pair.read_text(), '    Quantity("centreline", "centreline"', GAP))
    environment = {**os.environ, "PYTHONPATH": str(tmp_path), "COLUMNS": "80"}

    def run(*arguments: str) -> str:
        done = subprocess.run(
            [sys.executable, *arguments], cwd=tmp_path, env=environment, capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    said = run("-m", "ribbonbench", "solve", "steel.toml", "--set", "model.elements=6", "--wide", "--out", "one")
    result = json.loads((tmp_path / "one/result.json").read_text())
    height = result["height"]
    assert height == result["middle"]["position"][2]
    assert height < -1e-3
    assert result["si"]["height"] == pytest.approx(0.3 * height)
    line = next(line for line in said.splitlines() if "height" in line)
    assert f"{height:g}" in line
    assert " l " in line
    run("-m", "ribbonbench", "sweep", "steel.toml", "--set", "model.elements=6", "--vary", "strip.young=1e11,2.1e11",
        "--workers", "1", "--quiet", "--out", "many")  # fmt: skip
    rows = list(csv.DictReader((tmp_path / "many/cases.csv").open()))
    assert float(rows[1]["height"]) == pytest.approx(height, rel=1e-6)
    assert float(rows[1]["height_m"]) == pytest.approx(0.3 * height, rel=1e-6)
    of_row = run("-c", OF_A_ROW).splitlines()
    assert [float(number) for number in " ".join(of_row[:2]).split()] == pytest.approx([4e-3, 1.2e-3, 4e-3])
    assert of_row[2:] == ["2", "1 1"]  # table.csv and cases.csv; cases.csv and result.json
