"""The comparison of frozen behaviour: what it must see, and what it must not."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.corpus import compare, main

DOCUMENT = {
    "status": "converged",
    "iterations": 7,
    "energy": {"total": -3.25},
    "seconds": {"warm": 0.002},
    "end": [1.0],
}


def frozen(root: Path, place: str = "arc/solve", document=DOCUMENT, said: str = "off by 1.5 mm in 20 ms\n") -> Path:
    """A frozen command in a folder of its own."""
    folder = root / place
    (folder / "out").mkdir(parents=True)
    (folder / "code").write_text("0\n")
    (folder / "stdout").write_text(said)
    (folder / "out" / "result.json").write_text(json.dumps(document))
    (folder / "out" / "table.csv").write_text("gamma,force,seconds_warm\n1,2.5,0.1\n")
    return root


def test_clocks_and_rounding_are_no_difference(tmp_path):
    before = frozen(tmp_path / "a")
    after = frozen(tmp_path / "b", document={**DOCUMENT, "seconds": {"warm": 9.0}}, said="off by 1.5 mm in 7 ms\n")
    (after / "arc/solve/out/table.csv").write_text("gamma,force,seconds_warm\n1,2.5000000000000004,0.9\n")
    assert list(compare(before, after, 1e-12)) == []
    assert main(["compare", str(before), str(after)]) == 0


@pytest.mark.parametrize(
    ("change", "where"),
    [
        ({"iterations": 8}, "iterations"),
        ({"energy": {"total": -3.25001}}, "energy.total"),
        ({"status": "saddle"}, "status"),
        ({"end": [1.0, 2.0]}, "end[1]"),
        ({"stable": True}, "stable"),
    ],
)
def test_numbers_words_and_keys_are(tmp_path, change, where):
    before, after = frozen(tmp_path / "a"), frozen(tmp_path / "b", document={**DOCUMENT, **change})
    (line,) = compare(before, after, 1e-6)
    assert where in line
    assert main(["compare", str(before), str(after)]) == 1


def test_of_printed_text_codes_and_files_too(tmp_path):
    before, after = frozen(tmp_path / "a"), frozen(tmp_path / "b", said="off by 1.6 mm in 20 ms\n")
    (after / "arc/solve/code").write_text("1\n")
    (after / "arc/solve/out/table.csv").unlink()
    places = [line.split(":")[0] for line in compare(before, after, 1e-12)]
    assert places == ["arc/solve/out/table.csv", "arc/solve/code", "arc/solve/stdout"]


def test_of_explain_words_alone(tmp_path):
    before = frozen(tmp_path / "a", "arc/explain", said="gravity 17 % of it\n")
    after = frozen(tmp_path / "b", "arc/explain", said="gravity 15 % of it\n")
    assert list(compare(before, after, 1e-12)) == []
    (after / "arc/explain/stdout").write_text("clamps 15 % of it\n")
    assert len(list(compare(before, after, 1e-12))) == 1


def test_what_only_one_has_run_is_said(tmp_path):
    before, after = frozen(tmp_path / "a"), frozen(tmp_path / "b", "arc/limits")
    assert len(list(compare(before, after, 1e-12))) == 2
