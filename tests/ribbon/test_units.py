"""One rule for units: what is given is in the strip's own unit of length, what is told is in l and D w, `si` is SI.

A derivative is what is told per what is given; with a material Young's modulus, density and g are held.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ribbon import Clamp, Closure, Gravity, RibbonInputError, Session, Strip, gradients, solve
from ribbon.find.solve import build, solve_from

LENGTH = 0.4
STEEL = {"length": LENGTH, "width": 0.02, "thickness": 2e-4, "young": 2.1e11, "density": 7850.0, "poisson": 0.3}
CLAMP = Clamp((0, 0, 0), tangent=(1, 0, 0), normal=(0, 0, 1))
UP = Gravity((0, 0, 1))
TIGHT = {"tol": 1e-13}


@pytest.fixture(scope="module")
def hanging():
    return solve(Strip.from_material(**STEEL), CLAMP, UP, segments=8, options=TIGHT)


@pytest.fixture(scope="module")
def arch():
    return Session(
        Strip.from_material(**STEEL), Clamp(), UP, end=Clamp((0.01, 0.02, 0.32)), segments=8,
        seed_curvature=(-7, 7, 7, -7),
    )  # fmt: skip


# -- where ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["position", "frame", "omega", "eta", "tau", "in_plane", "pose"])
@pytest.mark.parametrize("s", [-1e-6, 1.001, 400.0, np.nan, np.inf])
def test_beyond_the_ends_is_an_error(hanging, name, s):
    with pytest.raises(RibbonInputError) as failed:
        getattr(hanging, name)(s)
    assert failed.value.key == "s"
    if name != "pose":
        with pytest.raises(RibbonInputError):
            getattr(hanging, name)([0.5, s])
    rounded = getattr(hanging, name)(1.0 + 1e-13)
    end = getattr(hanging, name)(1.0)
    np.testing.assert_array_equal(*(getattr(x, "position", x) for x in (rounded, end)))


@pytest.mark.parametrize("name", ["position", "rotation", "omega", "eta"])
def test_derivatives_have_ends_too(hanging, name):
    with pytest.raises(RibbonInputError):
        getattr(gradients(hanging, ["gamma"]), name)([0.5, 1.1])


@pytest.mark.parametrize("name", ["position", "frame", "omega", "eta", "tau", "in_plane"])
def test_in_si_abscissae_are_in_metres(hanging, name):
    s = np.array([0.0, 0.1, LENGTH])
    unit = {"position": LENGTH, "omega": 1 / LENGTH, "tau": 1 / LENGTH, "in_plane": 1 / LENGTH}.get(name, 1.0)
    told = getattr(hanging, name)(s / LENGTH)
    np.testing.assert_allclose(getattr(hanging.si, name)(s), unit * told, rtol=1e-14, atol=1e-15)
    for beyond in (LENGTH + 1e-4, 1.0, -1e-4):
        with pytest.raises(RibbonInputError) as failed:
            getattr(hanging.si, name)(beyond)
        assert failed.value.key == "s"


def test_a_band_has_no_ends():
    band = solve(Strip(2.0, 0.1, bending_stiffness=1.0), closure=Closure("circle"), segments=6)
    np.testing.assert_allclose(band.position(1.2), band.position(0.2), atol=1e-12)
    np.testing.assert_allclose(band.si.position(2.4), band.si.position(0.4), atol=1e-12)
    np.testing.assert_allclose(band.in_plane([1.2, -0.3]), band.in_plane([0.2, 0.7]), atol=1e-12)
    with pytest.raises(RibbonInputError):
        band.position([0.5, np.nan])


def test_an_open_strip_goes_on_where_that_is_asked_for(hanging):
    """With the end's own curvature: an arc of it, whose turn is curvature times length."""
    _, frames, omega, _ = hanging.continued([1.0, 1.02])
    assert omega[1] == omega[0]
    turn = np.arccos(np.clip((np.trace(frames[0].T @ frames[1]) - 1.0) / 2.0, -1.0, 1.0))
    assert turn == pytest.approx(0.02 * abs(omega[0]), abs=1e-7)


# -- derivatives ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("energy", ["wunderlich", "finite"])
@pytest.mark.parametrize("name", ["thickness", "young", "density", "poisson", "width"])
def test_a_strip_of_a_material_keeps_it(name, energy):
    """Against strips made anew of the same material: D and Gamma move with the thickness."""
    given, held = {**STEEL, "natural_curvature": 2.0}, replace(CLAMP, normal=(0, 0.6, 0.8))

    def ended(factor):
        strip = Strip.from_material(**{**given, name: given[name] * factor})
        problem = build(strip, held, UP, segments=8, energy=energy)
        first = solve(Strip.from_material(**given), held, UP, segments=8, energy=energy, options=TIGHT)
        assert first.ok
        found = solve_from(problem, first.x, warm=(first.rows, first.multipliers), options=TIGHT, check=False)
        return first, np.append(found.end.position, found.energy.total)

    h = 1e-3
    a, b, c, d = (ended(1.0 + k * h)[1] for k in (1, -1, 2, -2))
    exact = (8.0 * (a - b) - (c - d)) / (12.0 * h * given[name])
    first, _ = ended(1.0)
    g = gradients(first, [name])
    found = np.append(g.position(1.0)[name], g.energy()[name])
    assert np.abs(exact).max() > 0.0
    np.testing.assert_allclose(found, exact, rtol=1e-5, atol=1e-6 * np.abs(exact).max())


def test_gamma_given_by_hand_is_held():
    """No material, or one that the strip's numbers no longer follow: the inextensible ribbon feels no thickness."""
    steel = Strip.from_material(**STEEL)
    assert steel.material is not None
    assert replace(steel, natural_curvature=1.0).material == steel.material
    for strip in (replace(steel, gamma=2.0 * steel.gamma), replace(steel, thickness=3e-4), replace(steel, length=0.5)):
        assert strip.material is None
        found = solve(strip, CLAMP, UP, segments=8)
        assert not gradients(found, ["thickness"]).position(1.0)["thickness"].any()
        with pytest.raises(RibbonInputError):
            gradients(found, ["young"])


def test_a_weightless_strip_of_a_material():
    """Nothing weighs: the thickness moves nothing, and that is no error."""
    found = solve(Strip.from_material(**STEEL, natural_curvature=3.0), CLAMP, segments=6)
    g = gradients(found, ["thickness", "young", "density"])
    assert not any(g.position(1.0)[name].any() for name in g.names)


# -- stiffness --------------------------------------------------------------------------------------------------------


def test_stiffness_and_gradients_are_one_quantity(arch):
    g = gradients(arch.state, ["end.position", "end.rotation"])
    np.testing.assert_allclose(arch.stiffness[:3, :3], g.end_force()["end.position"], rtol=1e-10)
    np.testing.assert_allclose(arch.stiffness[3:, :3], g.end_moment()["end.position"], rtol=1e-10, atol=1e-9)
    np.testing.assert_allclose(arch.stiffness[:3, 3:], g.end_force()["end.rotation"], rtol=1e-10, atol=1e-9)


def test_stiffness_in_newtons_per_metre(arch):
    """Clamps moved in metres, forces in newtons; symmetric but for the moments by turns."""
    step, found = 2e-6, np.empty((6, 3))
    end = arch.state.problem.end
    for c in range(3):
        wrench = []
        for sign in (1.0, -1.0):
            place = np.array(end.position)
            place[c] += sign * step
            moved = arch.move(end=replace(end, position=place), steps=1)
            wrench.append(np.concatenate([arch.si.forces["end"].force, arch.si.forces["end"].moment]))
            arch.back(len(moved.states))
        found[:, c] = (wrench[0] - wrench[1]) / (2.0 * step)
    stiffness = arch.si.stiffness
    np.testing.assert_allclose(stiffness[:3, :3], found[:3], rtol=1e-4, atol=1e-4 * np.abs(found[:3]).max())
    np.testing.assert_allclose(stiffness[3:, :3], found[3:], rtol=1e-4, atol=1e-4 * np.abs(found[3:]).max())
    np.testing.assert_allclose(stiffness[:3, :3], stiffness[:3, :3].T, rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(stiffness[3:, :3], stiffness[:3, 3:].T, rtol=1e-8, atol=1e-9)


def test_forces_in_newtons(arch):
    weight = 7850.0 * 9.81 * LENGTH * 0.02 * 2e-4
    total = arch.si.forces["start"].force + arch.si.forces["end"].force
    np.testing.assert_allclose(total, [0.0, 0.0, weight], atol=1e-7 * weight)
    with pytest.raises(RibbonInputError):
        _ = Session(Strip(1.0, 0.05), Clamp(), end=Clamp((0, 0.1, 0.8)), segments=6).si
