"""Errors of forces, moments and energies: they cover what is left, and contact leaves a symmetric scene symmetric."""

from __future__ import annotations

import numpy as np
import pytest

from compare.battery.motions import end_for_end, moved, rotation
from compare.models import solve as solve_scene
from compare.models.base import Options, State
from compare.pages.result import state_result
from compare.scene.scene import load, loads
from tests.validation.ribbon.roman import line_contact

#: A heavy strip that is clamped above its table.
TABLE = loads(
    """
[strip]
length = 1.0
width = 0.05
poisson = 0.3
gamma = 300.0
[gravity]
up = [0.0, 1.0, 0.0]
[clamp.start]
tangent = [0.0, 0.0, 1.0]
normal = [0.0, 1.0, 0.0]
[[wall]]
point = [0.0, -0.05, 0.0]
normal = [0.0, 1.0, 0.0]
""",
    "table.toml",
)
#: Of equal segments with a joint in the middle, and without.
SEGMENTS = (20, 40, 61, 120)


@pytest.fixture(scope="module")
def roof() -> dict[int, State]:
    """Roman's strip under a roof, mirror symmetric."""
    scene = load("roman_6_2")
    return {
        p: solve_scene(scene.replace({"model.elements": p}), "ribbon", options=Options(error=True)) for p in SEGMENTS
    }


@pytest.mark.parametrize("segments", SEGMENTS)
def test_a_symmetric_scene_has_equal_and_opposite_moments(roof, segments):
    held = roof[segments].supports
    assert held.start.moment[0] == pytest.approx(-held.end.moment[0], abs=1e-7)
    assert held.start.force[1] == pytest.approx(held.end.force[1], rel=1e-5)
    assert roof[segments].middle.position[1] == pytest.approx(0.185, abs=1e-9)
    assert roof[segments].native.walls[1].contacts == pytest.approx([0.5], abs=1e-6)


@pytest.mark.parametrize("segments", SEGMENTS)
def test_errors_cover_the_elastica(roof, segments):
    """The exact strip, by shooting: moments at the clamps, thrust, the roof's force."""
    exact = line_contact(0.185, 0.1, 10.0)
    state = roof[segments]
    errors, held = state.errors, state.supports
    assert abs(held.start.moment[0] - exact.low) <= errors["moments"]["start"]
    assert abs(held.end.moment[0] + exact.low) <= errors["moments"]["end"]
    assert abs(held.start.force[2] - exact.thrust) <= errors["forces"]["start"]
    assert abs(-held.walls[1]["force"][1] - exact.force) <= errors["forces"]["walls"][1]


def test_errors_fall_with_an_order_and_not_by_chance(roof):
    for name in ("moments", "forces"):
        falls = [roof[p].errors[name]["start"] for p in (20, 40)]
        assert 2.0 < falls[0] / falls[1] < 64.0
        assert roof[120].errors[name]["start"] < falls[1] / 8.0
    assert roof[61].errors["moments"]["start"] < 2e-3


def test_the_point_of_contact_moves_in_the_second_variation(roof):
    """Held at a fixed point the strip would be called a saddle; the eigenvalue is that of the limit, to its error."""
    values = {p: roof[p].lowest_eigenvalue for p in SEGMENTS}
    assert min(values.values()) > 0.05
    limit = 0.1173  # of 480 and 960 segments, by their order
    for p in (20, 40, 120):
        assert abs(values[p] - limit) <= roof[p].errors["lowest_eigenvalue"]


@pytest.mark.parametrize("name", ["cantilever", "roman_6_2", "two_clamps_5_3_2", "moebius_6_1", "figure_4_1"])
def test_no_force_without_an_error(name):
    """In the result that is written, beside each number and in SI where the scene is."""
    scene = load(name)
    state = solve_scene(scene, "ribbon", options=Options(error=True))
    told = state_result(scene, state)
    for kind in ("forces", "moments"):
        for end in ("start", "end"):
            assert (told[kind][end] is None) == (told[f"{kind}_error"][end] is None)
    assert len(told["forces_error"]["walls"]) == len(told["forces"]["walls"])
    assert None not in told["forces_error"]["walls"]
    for part in ("elastic", "gravity", "total"):
        assert told["energy_error"][part] >= 0.0
    assert told["lowest_eigenvalue_error"] is not None
    if told["si"] is not None:
        assert set(told["si"]["forces_error"]) == set(told["forces_error"])


@pytest.mark.parametrize(("name", "segments"), [("two_clamps_5_3_2", 10), ("cantilever", 10)])
def test_errors_cover_what_finer_segments_change(name, segments):
    scene = load(name).replace({"model.tolerance": None, "model.elements": segments})
    state = solve_scene(scene, "ribbon", options=Options(error=True))
    finest = solve_scene(scene.replace({"model.elements": 32 * segments}), "ribbon")
    for end in ("start", "end"):
        mine, theirs = getattr(state.supports, end), getattr(finest.supports, end)
        if mine is None:
            continue
        for kind in ("force", "moment"):
            change = float(np.linalg.norm(getattr(mine, kind) - getattr(theirs, kind)))
            assert change <= 1.1 * state.errors[f"{kind}s"][end] + 1e-8
    for part in ("elastic", "gravity", "total"):
        change = abs(getattr(state.energy, part) - getattr(finest.energy, part))
        assert change <= 1.1 * state.errors["energy"][part] + 1e-8


def test_what_was_not_asked_for_is_said():
    scene = load("cantilever")
    told = state_result(scene, solve_scene(scene, "ribbon"))
    assert told["forces_error"]["start"] is None
    assert told["errors_why"] == "not asked for"


@pytest.mark.parametrize("name", ["roman_6_2", pytest.param("roman_folds", marks=pytest.mark.validate)])
def test_a_roof_does_not_hang_on_rounding(name):
    """The same scene turned and shifted, and end for end: one state."""
    scene = load(name)
    turned = moved(scene, rotation(np.array([0.3, -0.5, 0.7])), np.array([0.1, 0.2, 0.3]))
    own, *others = (solve_scene(one, "ribbon") for one in (scene, turned, end_for_end(scene)))
    for other in others:
        assert other.energy.elastic == pytest.approx(own.energy.elastic, rel=1e-9)
        assert other.lowest_eigenvalue == pytest.approx(own.lowest_eigenvalue, rel=1e-7)
        for kind in ("force", "moment"):
            sizes = [
                sorted(np.linalg.norm(getattr(held, kind)) for held in (state.supports.start, state.supports.end))
                for state in (own, other)
            ]
            assert sizes[1] == pytest.approx(sizes[0], rel=1e-6)


@pytest.mark.parametrize("segments", [10, 20])
def test_the_ends_of_a_line_of_contact_have_an_error_that_covers_them(segments):
    """A heavy strip, clamped above its table, lies on it up to its free end: where it comes down, against the same
    on 80 segments, which leave 0.0125 l open; and no error is less than a segment."""

    def table(segments: int) -> dict[str, object]:
        state = solve_scene(TABLE.replace({"model.elements": segments}), "ribbon", options=Options(error=segments < 80))
        (wall,) = state_result(TABLE, state)["walls"]
        return wall

    wall, fine = table(segments), table(80)
    ((first, last),), ((exact, end),) = wall["lines"], fine["lines"]
    assert 0.2 < exact < 0.5
    assert [last, end] == pytest.approx([1.0, 1.0])
    assert abs(first - exact) <= wall["lines_error"] + 1.0 / 80
    assert 0.99 / segments < wall["lines_error"] < 0.2
    assert fine["lines_error"] is None
    assert fine["lines_error_why"] == "not asked for"
