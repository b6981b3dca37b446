"""Centrelines of a sweep, where they are asked for: those that `solve` finds, in the order of the table."""

from __future__ import annotations

import csv
import json
import shutil

import numpy as np
import pytest

from compare.cli import BAD_INPUT, DONE, NOT_CONVERGED, main
from compare.models import solve
from compare.scene.scene import load
from compare.sweep import shapes
from tests.compare.sweep.test_large import needs_arrow, run_in

POINTS = 9
#: Six hanging strips, for two of which the budget is too short, unless they begin at a neighbour's state.
SWEEP = (
    "sweep", "hanging_5_3_1", "--vary", "strip.gamma=1,30", "--vary", "model.budget=60,1e-9,50", "--set",
    "model.elements=8", "--workers", "1", "--quiet", "--shapes", str(POINTS),
)  # fmt: skip
READ = """
import sys
import numpy as np
from pyarrow import parquet
table = parquet.read_table(sys.argv[1], use_threads=False)
print(table["case"].to_pylist(), table["shape"].null_count, table.schema.field("shape").metadata[b"unit"].decode())
kept = table.filter(table["shape"].is_valid())["shape"].combine_chunks()
np.save(sys.argv[2], kept.flatten().to_numpy().reshape(-1, int(sys.argv[3]), 3))
"""


@pytest.fixture(scope="module")
def known():
    """The centrelines (6, 9, 3) of the cases with time enough."""
    base = load("hanging_5_3_1").replace({"model.elements": 8})
    states = [solve(base.replace({"strip.gamma": gamma})) for gamma in (1.0, 30.0) for _ in range(3)]
    return np.array([state.shape.centreline(np.linspace(0.0, 1.0, POINTS)) for state in states])


@pytest.fixture(scope="module")
def beside(tmp_path_factory):
    """The sweep with its table in CSV."""
    out = tmp_path_factory.mktemp("csv")
    assert main([*SWEEP, "--out", str(out)]) == DONE
    return out


def test_an_array_stands_beside_the_table_in_its_order(beside, known):
    lines = np.load(beside / "shapes.npy")
    assert (lines.dtype, lines.shape) == (np.float32, (6, POINTS, 3))
    assert np.abs(lines - known).max() < 1e-7
    with (beside / "cases.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    for row, line in zip(rows, lines, strict=True):
        told = [float(row[f"end.{axis}"] or "nan") for axis in "xyz"]
        np.testing.assert_allclose(line[-1], told, atol=1e-7)
    assert "shapes.npy" in json.loads((beside / "page.json").read_text())["files"]


def test_what_is_no_equilibrium_has_none(tmp_path):
    record = {"rows": [], "status": "crashed"}, {"rows": [{}, {}], "shapes": [None, None]}
    shapes.write(tmp_path, record, POINTS)
    assert np.isnan(np.load(tmp_path / "shapes.npy")).all()
    assert np.load(tmp_path / "shapes.npy").shape == (3, POINTS, 3)


def test_what_is_finished_is_found_with_its_shape_and_not_without_one(beside, known, tmp_path):
    shutil.copytree(beside, tmp_path / "again")
    (tmp_path / "again" / "shapes.npy").unlink()
    assert main([*SWEEP, "--out", str(tmp_path / "again")]) == DONE
    assert (tmp_path / "again" / "shapes.npy").read_bytes() == (beside / "shapes.npy").read_bytes()
    cases = json.loads((tmp_path / "again" / "cases.json").read_text())["cases"]
    assert [case["reused"] for case in cases] == [True] * 6
    assert main([*SWEEP[:-2], "--out", str(tmp_path / "without")]) == DONE
    assert not (tmp_path / "without" / "shapes.npy").exists()
    theirs = {case["key"] for case in json.loads((tmp_path / "without" / "cases.json").read_text())["cases"]}
    assert theirs.isdisjoint(case["key"] for case in cases)


@needs_arrow
def test_parts_have_them_too_and_shards_joined_are_one_run(beside, known, tmp_path):
    parts = (*SWEEP, "--table", "parquet")
    assert main([*parts, "--out", str(tmp_path / "one")]) == NOT_CONVERGED
    part = tmp_path / "one" / "shapes" / "part-000000.parquet"
    said = run_in(READ, part, tmp_path / "lines.npy", POINTS)
    assert said.split("\n")[0] == "[0, 1, 2, 3, 4, 5] 2 l"
    lines = np.load(tmp_path / "lines.npy")
    assert np.abs(lines - known[[0, 2, 3, 5]]).max() < 1e-7
    folders = [str(tmp_path / f"p{k}") for k in (2, 1)]
    for k, folder in zip((2, 1), folders, strict=True):
        assert main([*parts, "--shard", f"{k}/2", "--out", folder]) in (DONE, NOT_CONVERGED)
    assert main([*parts, "--join", *folders, "--out", str(tmp_path / "joined")]) == NOT_CONVERGED
    joined = tmp_path / "joined" / "shapes" / "part-000000.parquet"
    assert joined.read_bytes() == part.read_bytes()
    # a part without its centrelines is made again
    part.unlink()
    assert main([*parts, "--out", str(tmp_path / "one")]) == NOT_CONVERGED
    assert part.read_bytes() == joined.read_bytes()


@pytest.mark.parametrize(
    ("words", "remedy"), [(("--shapes", "1"), "give 2 to 1001"), (("--solver", "compare"), "choose a --solver")]
)
def test_what_has_no_centreline_to_keep_is_refused(words, remedy, tmp_path, capsys):
    assert main([*SWEEP, *words, "--out", str(tmp_path / "o")]) == BAD_INPUT
    assert remedy in capsys.readouterr().err
    assert not (tmp_path / "o" / "cases.csv").exists()
