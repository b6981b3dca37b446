"""Points of a grid that are put together are those that are read."""

from __future__ import annotations

import pytest

from compare.scene.scene import load
from compare.studies.axes import Axis, Grid, parse_axis
from compare.sweep.large.quick import Quick

SCENES = ("cantilever", "curled_end", "two_clamps_5_3_2", "moebius_6_1", "ring_twisted", "arc_5_1", "roll_up")


def grid_of(name: str, *axes: str) -> Grid:
    return Grid(load(name), tuple(map(parse_axis, axes)))


@pytest.mark.parametrize("name", SCENES)
def test_points_put_together_are_those_that_are_read(name):
    """Also where the scene says Young's modulus, which a weight replaces, or a table of curvatures."""
    grid = grid_of(name, "strip.gamma=0,3.5,40", "strip.natural_curvature=-2,0,1.5")
    found = Quick(grid).points(range(9))
    assert found is not None
    for point in found:
        strict = grid.point(point.number)
        assert point.values == strict.values
        assert point.scene == strict.scene
        assert point.scene.own_keys == strict.scene.own_keys
        assert point.scene.canonical() == strict.scene.canonical()
        assert point.scene.to_toml() == strict.scene.to_toml()


@pytest.mark.parametrize(
    "axes",
    [["strip.width=0.02,0.05"], ["strip.gamma=1,2", "model.elements=8,12"], ["strip.natural_curvature=[0,1],[1,2]"]],
)
def test_what_others_are_read_by_is_read_each_time(axes):
    assert Quick(grid_of("cantilever", *axes)).points([0, 1]) is None
    both = Grid(load("cantilever"), (Axis(("strip.gamma", "strip.width"), ((1.0, 0.05), (2.0, 0.06))),))
    assert Quick(both).points([0, 1]) is None


def test_a_point_that_would_differ_is_noticed(monkeypatch):
    grid = grid_of("cantilever", "strip.gamma=1,2,3")
    quick = Quick(grid)
    wrong = grid.point(0).scene
    monkeypatch.setattr(quick, "_scene", lambda values: wrong)
    assert quick.points([0, 1, 2]) is None
