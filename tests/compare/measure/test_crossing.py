"""A strip through itself: closed forms of curves that cross, a dense test of triangles, and the verdict of scenes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import optimize, special

from compare.measure.crossing import MEETS, Crossing, crossing
from compare.measure.grades import GOOD, POOR
from compare.measure.grid import triangles
from compare.models import solve
from compare.models.base import Size
from compare.pages.result import state_result
from compare.pages.solve import answer
from compare.scene.scene import load
from compare.studies.checks import crossing as check_of
from compare.studies.checks import of_state

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Made:
    """A strip of straight sections: a line and the direction across, of length 1, by functions of s (k,)."""

    line: Callable[[FloatArray], FloatArray]
    across: Callable[[FloatArray], FloatArray]

    def points(self, s: FloatArray, v: FloatArray) -> FloatArray:
        return np.asarray(self.line(s)[:, None] + v[None, :, None] * self.across(s)[:, None])


def flat(line: Callable[[FloatArray], FloatArray]) -> Made:
    """A strip that stands upright on a line in the plane."""
    return Made(line, lambda s: np.broadcast_to([1.0, 0.0, 0.0], (s.size, 3)))


# -- the planar elastica of Euler, its ends pinned, by elliptic functions ----------------------------------------------


def elastica(degrees: float) -> Callable[[FloatArray], FloatArray]:
    """The line of an elastica of length 1 whose ends are turned by this against the chord, the middle at x = 0."""
    m = np.sin(np.radians(degrees) / 2.0) ** 2
    whole = special.ellipk(m)

    def line(s: FloatArray) -> FloatArray:
        u = (2.0 * s - 1.0) * whole
        amplitude = special.ellipj(u, m)[3]
        x = (2.0 * special.ellipeinc(amplitude, m) - u) / (2.0 * whole)
        y = np.sqrt(m) * special.ellipj(u, m)[1] / whole
        return np.stack([np.zeros_like(s), y, x], axis=1)

    return line


TOUCHES = float(
    np.degrees(
        2.0 * np.arcsin(np.sqrt(optimize.brentq(lambda m: 2.0 * special.ellipe(m) - special.ellipk(m), 0.7, 0.9)))
    )
)


def test_the_ends_of_the_elastica_meet_where_its_integrals_say():
    assert pytest.approx(130.7099, abs=1e-4) == TOUCHES


@pytest.mark.parametrize("degrees", [131.0, 135.0, 150.0])
def test_beyond_the_figure_of_eight_it_crosses_itself_where_the_closed_form_does(degrees):
    line = elastica(degrees)
    found = crossing(flat(line), 0.04)
    assert found is not None
    assert len(found.places) >= 1
    own = optimize.brentq(lambda s: line(np.array([s]))[0, 2], 1e-6, 0.4)  # symmetric: it crosses on its axis
    for place in found.places:
        assert place.s == pytest.approx(own, abs=1e-7)
        assert place.s_other == pytest.approx(1.0 - own, abs=1e-7)
        assert place.v == pytest.approx(place.v_other, abs=1e-8)


@pytest.mark.parametrize("degrees", [60.0, 120.0, 130.0, 130.6])
def test_up_to_it_the_elastica_is_clear_of_itself(degrees):
    assert crossing(flat(elastica(degrees)), 0.04).places == ()


@pytest.mark.parametrize("beyond", [-3e-3, 3e-3])
def test_it_touches_at_130_7_degrees(beyond):
    found = crossing(flat(elastica(TOUCHES + beyond)), 0.04)
    assert found.within is None
    assert (len(found.places) > 0) == (beyond > 0.0)


# -- made to measure ---------------------------------------------------------------------------------------------------


def loop(gap: float) -> Made:
    """A strip under itself at (0, 0): there it is arched below and sags above, 3 (x^2 + y^2) + `gap` apart. Both
    branches are a polynomial of degree 3 in x and y each, joined by a wide turn."""
    angle = 1.5 * np.pi  # between the branches, outside

    def line(s: FloatArray) -> FloatArray:
        t = 6.0 * s - 3.0  # branches: t < -1 along x, t > 1 along y
        turned = np.clip((t + 1.0) / 2.0, 0.0, 1.0)
        a = -0.5 * np.pi + angle * turned
        near, far = -1.0 - t, t - 1.0
        x = np.where(t < -1.0, 0.1 * (1.0 - near), np.where(t > 1.0, 0.0, 0.1 + 0.1 * np.cos(a)))
        y = np.where(t < -1.0, 0.0, np.where(t > 1.0, 0.1 * (1.0 - far), 0.1 + 0.1 * np.sin(a)))
        z = np.where(t < -1.0, -3.0 * x**2, np.where(t > 1.0, gap + 3.0 * y**2, -0.03 + (0.06 + gap) * turned))
        return np.stack([x, y, z], axis=1)

    def across(s: FloatArray) -> FloatArray:
        a = angle * np.clip((6.0 * s - 2.0) / 2.0, 0.0, 1.0)
        return np.stack([-np.sin(a), np.cos(a), np.zeros_like(s)], axis=1)

    return Made(line, across)


@pytest.mark.parametrize("depth", [1e-3, 1e-5, 1e-7])
def test_arches_that_cross_inside_the_strip_are_seen_and_no_edge_is_there(depth):
    """Two arches, one across the other, meet on a small closed curve: no edge of either goes through the other."""
    found = crossing(loop(-depth), 0.06)
    assert found.places
    for place in found.places:
        x, y = 0.1 * (6.0 * place.s - 1.0), 0.1 * (5.0 - 6.0 * place.s_other)
        assert 3.0 * (x**2 + y**2) == pytest.approx(depth, abs=1e-8)
        assert max(abs(place.v), abs(place.v_other)) < 0.5 * 0.06


@pytest.mark.parametrize("gap", [1e-3, 1e-5, 1e-7])
def test_and_are_told_apart_where_they_do_not(gap):
    assert crossing(loop(gap), 0.06).places == ()
    assert crossing(loop(gap), 0.06).within is None


def test_a_cylinder_rolled_twice_meets_itself_and_one_that_opens_does_not():
    def roll(pitch: float) -> Made:
        return flat(
            lambda s: np.stack(
                [0.0 * s, (0.05 + pitch * s) * np.cos(40.0 * s), (0.05 + pitch * s) * np.sin(40.0 * s)], axis=1
            )
        )

    assert crossing(roll(0.0), 0.1).places
    assert crossing(roll(1e-3), 0.1) == crossing(roll(1e-1), 0.1) == Crossing()
    near = crossing(roll(1e-6), 0.1)  # layers 1.6e-7 apart: too many pairs to tell
    assert near.places == ()
    assert near.within is None or near.within > 1e-7


def test_a_seam_is_no_crossing():
    def ring(half_turns: int) -> Made:
        def radial(s: FloatArray) -> FloatArray:
            return np.stack([np.zeros_like(s), np.cos(2 * np.pi * s), np.sin(2 * np.pi * s)], axis=1)

        def across(s: FloatArray) -> FloatArray:
            a = half_turns * np.pi * s[:, None]
            return np.asarray(np.cos(a) * np.array([[1.0, 0.0, 0.0]]) + np.sin(a) * radial(s))

        return Made(lambda s: radial(s) / (2 * np.pi), across)

    for half_turns in (0, 1, 2, 3):
        assert crossing(ring(half_turns), 0.08).places == ()


def test_a_teardrop_whose_ends_are_held_together_is_clear():
    """The ends of an elastica that just meet are one place because they are held there."""
    found = crossing(flat(elastica(TOUCHES)), 0.04)
    assert found.places == ()
    assert found.within is None


# -- against triangles -------------------------------------------------------------------------------------------------


def crosses(points: FloatArray, least: int) -> bool:
    """Whether edges of some triangles of a grid go through others that are `least` lines away: all with all."""
    along, across = points.shape[:2]
    corners = triangles(along, across)
    line = corners.min(axis=1) // across
    flat_points = points.reshape(-1, 3)
    a, e1, e2 = (flat_points[corners[:, k]] - (k > 0) * flat_points[corners[:, 0]] for k in range(3))
    for one in range(3):
        begin, step = (flat_points[corners[:, k]] for k in (one, (one + 1) % 3))
        step = step - begin
        for k in range(len(begin)):  # against all triangles at once (T. Moeller and B. Trumbore 1997)
            p = np.cross(step[k], e2)
            det = np.einsum("ki,ki->k", p, e1)
            with np.errstate(all="ignore"):
                t = begin[k] - a
                u = np.einsum("ki,ki->k", p, t) / det
                q = np.cross(t, e1)
                v = q @ step[k] / det
                at = np.einsum("ki,ki->k", q, e2) / det
                through = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (at >= 0.0) & (at <= 1.0)
            if (through & (np.abs(line - line[k]) >= least)).any():
                return True
    return False


SHOWN = {
    "curl_4_4_short": True, "coil_40_1200": True, "curl_4_4_long": False, "curl_4_3": False, "coil_10_100": False,
    "jfig_5_2": False,
}  # fmt: skip


@pytest.fixture(scope="module")
def states():
    found = {name: load(name) for name in SHOWN}
    return {name: (scene, solve(scene, size=None)) for name, scene in found.items()}


@pytest.mark.parametrize("name", sorted(SHOWN))
def test_shipped_scenes_as_all_triangles_say(states, name):
    scene, state = states[name]
    found = crossing(state.shape, scene.width)
    s, v = np.linspace(0.0, 1.0, 301), scene.width * np.linspace(-0.5, 0.5, 3)
    assert crosses(state.shape.points(s, v), 12) == SHOWN[name]
    assert bool(found.places) == SHOWN[name]
    for place in found.places:
        one = state.shape.points(np.array([place.s]), np.array([place.v]))
        other = state.shape.points(np.array([place.s_other]), np.array([place.v_other]))
        assert np.linalg.norm(one - other) < 2.0 * MEETS
        assert place.s_other - place.s > 0.02


# -- what is said ------------------------------------------------------------------------------------------------------


def test_a_shape_through_itself_is_not_what_one_sees(states):
    for name in ("coil_40_1200", "curl_4_3"):
        scene, state = states[name]
        (found,) = [check for check in of_state(scene, state) if check.name == "crossing"]
        told = answer(scene, state)
        data = state_result(scene, state)
        assert found == check_of(scene, state)
        if SHOWN[name]:
            assert (found.grade, told.grade) == (POOR, POOR)
            s, _, other, _ = state.crossing(scene.width).places[0]
            assert f"crosses itself at s = {s:.4g}, s' = {other:.4g}" in told.text
            assert "add [contact] with itself = true" in told.text
            assert data["crossings"][0][0][0] == s
            assert data["crossings"][0][1][0] == other
        else:
            assert found.grade == GOOD
            assert "crosses itself" not in told.text
            assert data["crossings"] == []


@pytest.mark.parametrize("name", ["moebius_6_1", "ring_twisted"])
def test_closed_scenes(name):
    scene = load(name)
    state = solve(scene, size=Size("mixed", (16.0,)) if name == "moebius_6_1" else None)
    assert state.is_equilibrium
    assert crossing(state.shape, scene.width).places == ()
