"""A grid of limits as a map."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from compare.cli import main
from compare.pages import limits


def finding(width, gamma, level, distance):
    scene = SimpleNamespace(shell=SimpleNamespace(clamp="edge"))
    return SimpleNamespace(
        values={"strip.width": width, "strip.gamma": gamma}, scene=scene, width_to_thickness=100.0, level=level,
        distance=distance,
    )  # fmt: skip


def test_two_keys_make_a_map_and_one_none():
    grid = [
        finding(0.1, 1.0, "good", 0.004), finding(0.1, 9.0, "fair", 0.02), finding(0.2, 1.0, "poor", 0.08),
        finding(0.2, 9.0, None, None),
    ]  # fmt: skip
    found = limits.grid_map(grid)
    assert found.keys == ("case", "gamma = 1", "gamma = 9")
    assert found.rows == (
        ("width = 0.1", "good 0.4 %", "fair 2 %"), ("width = 0.2", "poor 8 %", "unknown"),
    )  # fmt: skip
    assert limits.grid_map(grid[:2]) is None


def test_a_grid_is_told_by_its_worst_and_its_map(tmp_path, capsys):
    arguments = ["limits", "curl_4_3", "--quick", "--set", "strip.natural_curvature=2.0", "--out", str(tmp_path)]
    assert main([*arguments, "--vary", "strip.gamma=1,5", "--vary", "shell.width_to_thickness=20,100"]) == 0
    said = capsys.readouterr().out
    assert "over the grid" in said
    assert said.count("moves") < 8
    assert sum("case" in line for line in said.splitlines()) >= 1
    with pytest.raises(SystemExit):
        main(["limits", "--help"])
