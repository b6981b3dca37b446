"""Neighbours of a sweep's grid are compared: a case on another branch is seen, named and no longer called good."""

import csv
import json
from types import SimpleNamespace

import numpy as np
import pytest

from compare.cli import DONE, main
from compare.page.page import read_page
from compare.sweep.branches import branches, others

SCENE = """title = "arch"
[strip]
length = 1.0
width = 0.03
thickness = 3e-4
poisson = 0.3
gamma = 3.5
[gravity]
up = [0.0, 1.0, 0.0]
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [0.0, 0.0, 1.0]
normal = [0.0, 1.0, 0.0]
[clamp.end]
position = [0.0, 0.0, 0.8]
tangent = [0.0, 0.0, 1.0]
normal = [0.0, 1.0, 0.0]
[seed]
curvature = [-5.6, 5.6, 5.6, -5.6]
"""
SWEEP = """scene = "arch.toml"
[[axis]]
keys = ["strip.gamma", "seed.curvature"]
values = [
  {lines},
]
"""
UP, DOWN = "[-5.6, 5.6, 5.6, -5.6]", "[5.6, -5.6, -5.6, 5.6]"


def arch(height: float, stable: bool = True) -> dict:
    """The row of an arch of this height."""
    return {
        "status": "converged", "stable": stable, "quarters": [[0.0, 0.5 * height, 0.2], [0.0, 0.5 * height, 0.6]],
        **{f"middle.{axis}": v for axis, v in zip("xyz", (0.0, height, 0.4), strict=True)},
        **{f"end.{axis}": v for axis, v in zip("xyz", (0.0, 0.0, 0.8), strict=True)},
    }  # fmt: skip


def finished(heights):
    """A sweep whose cases are arches of these heights; nan: one that failed."""
    heights = np.asarray(heights, dtype=float)
    axes = tuple(SimpleNamespace(values=tuple((k,) for k in range(count))) for count in heights.shape)
    cases = tuple(
        SimpleNamespace(point=SimpleNamespace(number=n), record={"rows": [arch(h)] if np.isfinite(h) else []})
        for n, h in enumerate(heights.ravel())
    )
    return SimpleNamespace(sweep=SimpleNamespace(axes=axes), cases=cases, part=False)


def labels(heights):
    return [one[0] if one else None for one in branches(finished(heights))]


GRID = 0.25 + 0.004 * np.arange(20)[:, None] + 0.002 * np.arange(20)[None, :]


@pytest.mark.parametrize("flipped", [[30], [37], [51, 52], [0], [399], [30, 37, 325, 366, 386], [19, 20]])
def test_cases_on_the_other_side_are_seen(flipped):
    heights = GRID.copy()
    heights.ravel()[flipped] *= -1.0
    found = labels(heights)
    assert [n for n, label in enumerate(found) if label != 1] == flipped
    assert {number for number, _ in others(finished(heights))} == set(flipped)


def test_a_smooth_grid_is_one_branch_however_far_it_goes():
    assert labels(GRID) == [1] * 400
    assert labels(np.linspace(0.0, 0.5, 5)) == [1] * 5  # a coarse one, each step as large as the others
    assert labels(0.4 * np.tanh(np.linspace(-3.0, 3.0, 30))) == [1] * 30


def test_a_snap_divides_a_line_in_two():
    heights = np.concatenate([np.linspace(0.3, 0.25, 12), np.linspace(-0.3, -0.35, 8)])
    assert labels(heights) == [1] * 12 + [2] * 8


def test_what_failed_has_no_branch_and_divides_none():
    heights = GRID[0].copy()
    heights[7] = np.nan
    assert labels(heights) == [1] * 7 + [None] + [1] * 12


@pytest.fixture(scope="module")
def flipped(tmp_path_factory):
    """A sweep of seven weights of which the fourth has its seed to the other side; its folder."""
    folder = tmp_path_factory.mktemp("branch")
    (folder / "arch.toml").write_text(SCENE)
    seeds = [UP, UP, UP, DOWN, UP, UP, UP]
    lines = ", ".join(f"[{3.0 + 0.1 * k:.1f}, {seed}]" for k, seed in enumerate(seeds))
    (folder / "s.toml").write_text(SWEEP.format(lines=lines))
    assert main(["sweep", str(folder / "s.toml"), "--out", str(folder / "o"), "--workers", "1", "--quiet"]) == DONE
    return folder / "o"


def test_the_headline_says_that_one_case_lies_on_another_branch(flipped):
    with (flipped / "cases.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert [row["branch"] for row in rows] == ["1", "1", "1", "2", "1", "1", "1"]
    assert {row["side"] for row in rows} == {"own"}
    assert float(rows[3]["middle.y"]) < 0.0 < float(rows[2]["middle.y"])
    assert json.loads((flipped / "result.json").read_text())["other_branches"] == [{"case": 3, "branch": 2}]
    page = read_page(flipped)
    assert page.verdict.grade != "good"
    assert "one lies on another branch" in page.verdict.text


def test_a_sweep_on_one_branch_is_good(tmp_path):
    (tmp_path / "arch.toml").write_text(SCENE)
    command = ["sweep", str(tmp_path / "arch.toml"), "--vary", "strip.gamma=3,3.2,3.4,3.6", "--workers", "1"]
    assert main([*command, "--out", str(tmp_path / "o"), "--quiet"]) == DONE
    page = read_page(tmp_path / "o")
    assert page.verdict.grade == "good"
    assert json.loads((tmp_path / "o" / "result.json").read_text())["other_branches"] == []
