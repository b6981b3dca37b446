"""Gradients of equilibria against central differences of equilibria solved again, and refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
from scipy.spatial.transform import Rotation

from ribbon import Clamp, Closure, Gravity, NotDifferentiable, RibbonInputError, Strip, Wall, gradients, solve
from ribbon.find.continuation import anchored
from ribbon.find.solve import build, solve_from
from ribbon.sensitivity.gradients import energy_slopes

HALF = 2**-0.5
S = np.array([0.0, 0.13, 0.5, 0.77, 1.0])
TIGHT = {"tol": 1e-13}
#: Steps of central differences that lose as little to curvature as to rounding.
STEPS = {
    "natural_curvature": 1e-3, "gamma": 2e-3, "poisson": 1e-4, "width": 2e-5, "thickness": 1e-5, "position": 2e-5,
    "rotation": 2e-5, "offset": 2e-5,
}  # fmt: skip


def turned(clamp, rotation):
    if clamp is None or not clamp.holds_frame:
        return clamp
    frame = Rotation.from_rotvec(rotation).as_matrix() @ clamp.frame
    return replace(clamp, tangent=frame[:, 2], normal=frame[:, 1])


def changed(arguments, name, component, step):
    """Keywords of `build` with one number of a parameter moved by `step`."""
    new = dict(arguments)
    part, _, what = name.rpartition(".")
    unit = np.zeros(3)
    if part:
        unit[component or 0] = step
    if not part:
        value = getattr(new["strip"], name)
        if isinstance(value, tuple):
            value = tuple(v + step * (i == component) for i, v in enumerate(value))
        else:
            value += step
        new["strip"] = replace(new["strip"], **{name: value})
    elif what == "offset":
        walls = list(new["walls"])
        k = int(part.split(".")[1])
        walls[k] = replace(walls[k], point=np.asarray(walls[k].point) + step * np.asarray(walls[k].normal))
        new["walls"] = walls
    else:
        key = {"start": "clamp", "end": "end"}[part]
        if what == "position":
            new[key] = replace(new[key], position=np.asarray(new[key].position) + unit)
        else:
            new[key] = turned(new[key], unit)
    return new


def again(arguments, near):
    """The equilibrium of changed arguments next to `near`, to the last digits."""
    problem = build(**arguments)
    if not problem.row_count:
        return solve_from(problem, near.x, options=TIGHT, check=False)
    problem = anchored(problem, near).with_changes(touching=near.problem.touching)
    return solve_from(problem, near.x, warm=(near.rows, near.multipliers), options=TIGHT, check=False)


def outputs(e):
    found = {
        "energy": np.array(e.energy.total), "position": e.position(S), "frame": e.frame(S), "omega": e.omega(S),
        "eta": e.eta(S), "start_force": e.start.force, "start_moment": e.start.moment,
    }  # fmt: skip
    if e.end_support is not None:
        found |= {"end_force": e.end_support.force, "end_moment": e.end_support.moment}
    return found | {f"wall_{k}": wall.force for k, wall in enumerate(e.walls)}


def derivatives(g, e, name):
    """The same outputs, differentiated; the parameter's components last."""
    found = {key: getattr(g, key)()[name] for key in ("energy", "start_force", "start_moment")}
    found |= {key: getattr(g, key)(S)[name] for key in ("position", "omega", "eta")}
    if e.end_support is not None:
        found |= {key: getattr(g, key)()[name] for key in ("end_force", "end_moment")}
    found |= {f"wall_{k}": g.wall_force(k)[name] for k in range(len(e.walls))}
    spins = g.rotation(S)[name].reshape(len(S), 3, -1)
    frames = np.stack([np.cross(spin.T, e.frame(S)[:, :, c][i]) for i, spin in enumerate(spins) for c in range(3)])
    # (k * 3 columns, parameters, 3 rows) -> (k, rows, columns, parameters)
    found["frame"] = frames.reshape(len(S), 3, -1, 3).transpose(0, 3, 1, 2)
    return {
        key: value if key == "frame" or value.ndim > outputs(e)[key].ndim else value[..., None]
        for key, value in found.items()
    }  # fmt: skip


def compare(arguments, e, names, tolerance=1e-6, skip=()):
    g = gradients(e, wrt=names)
    for name, slope in energy_slopes(e, names).items():  # without the response: the envelope theorem
        np.testing.assert_allclose(slope, g.energy()[name], rtol=1e-7, atol=1e-7)
    for name in names:
        d = derivatives(g, e, name)
        for component in range(d["energy"].shape[-1]):
            step = STEPS[name.rpartition(".")[2]]
            # two central differences: what is left of the third derivative is of the sixth order's size
            values = [
                outputs(again(changed(arguments, name, component, k * step), e)) for k in (1.0, -1.0, 2.0, -2.0)
            ]  # fmt: skip
            for key in set(values[0]) - set(skip):
                a, b, c, f = (v[key] for v in values)
                exact = (8.0 * (a - b) - (c - f)) / (12.0 * step)
                scale = max(np.abs(exact).max(), 1e-2 * max(1.0, np.abs(values[0][key]).max()))
                worst = np.abs(d[key][..., component] - exact).max() / scale
                assert worst < tolerance, (name, component, key, worst)
    return g


def solved(arguments, **keywords):
    e = solve(arguments["strip"], options=TIGHT, **{k: v for k, v in arguments.items() if k != "strip"}, **keywords)
    assert e.ok, e.message
    return e


@pytest.mark.parametrize("formulation", ["chained", "mixed"])
@pytest.mark.parametrize("energy", ["sadowsky", "wunderlich"])
def test_one_clamp_under_weight(energy, formulation):
    arguments = {
        "strip": Strip(2.0, 0.2, 0.4, (1.5, -1.0), gamma=20.0, thickness=0.01),
        "clamp": Clamp((0.1, 0.2, 0.3), normal=(-HALF, HALF, 0), ruling="straight"),
        "gravity": Gravity((1, 0, 0)), "energy": energy, "segments": 6, "formulation": formulation,
    }  # fmt: skip
    names = ["natural_curvature", "gamma", "poisson", "width", "thickness", "start.position", "start.rotation"]
    g = compare(arguments, solved(arguments), names)
    assert g.condition < 1e6


def test_two_clamps_and_weight_of_the_surface():
    arguments = {
        "strip": Strip(1.0, 0.1, 0.3, (0.5, 0.0), gamma=5.0),
        "clamp": Clamp(ruling="straight"), "end": Clamp((0.1, 0.15, 0.7), ruling="straight"),
        "gravity": Gravity((0, 1, 0), exact=True), "segments": 8,
    }  # fmt: skip
    e = solved(arguments, seed_curvature=(-3, 3, 3, -3))
    names = ["natural_curvature", "gamma", "poisson", "width"]
    names += ["start.position", "start.rotation", "end.position", "end.rotation"]
    compare(arguments, e, names)


def test_held_by_constraints_is_the_same():
    arguments = {
        "strip": Strip(1.0, 0.1, 0.3, (0.5, 0.0), gamma=5.0), "clamp": Clamp(), "end": Clamp((0.1, 0.15, 0.7)),
        "gravity": Gravity((0, 1, 0)), "segments": 8,
    }  # fmt: skip
    names = ["start.position", "start.rotation", "end.rotation", "gamma"]
    found = []
    for held_by in ("elimination", "constraints"):
        e = solved(arguments, seed_curvature=(-3, 3, 3, -3), held_by=held_by)
        g = gradients(e, names)
        found.append({name: (g.position(S)[name], g.start_moment()[name], g.end_force()[name]) for name in names})
    for name in names:
        for one, other in zip(found[0][name], found[1][name], strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-7, atol=1e-7)


def test_a_law_of_natural_curvature_joint_by_joint():
    """dq/dK(s): the joints' derivatives add up to those of the ends, and their density integrates to the same."""
    strip = Strip(2.0, 0.2, 0.4, (1.5, -1.0), gamma=20.0)
    clamp = Clamp(normal=(-HALF, HALF, 0))
    e = solve(strip, clamp, Gravity((1, 0, 0)), segments=6)
    g = gradients(e, ["natural_curvature", "natural_curvature(s)"])
    s = np.linspace(0, 1, 7)
    ends = np.column_stack([1 - s, s])
    for of in (g.position([0.3, 1.0]), g.energy(), g.start_moment(), g.eta(0.4)):
        assert of["natural_curvature(s)"].shape[-1] == 7
        np.testing.assert_allclose(of["natural_curvature(s)"] @ ends, of["natural_curvature"], rtol=1e-9, atol=1e-12)
    nodes, weights = np.polynomial.legendre.leggauss(4)
    at = (s[:-1, None] + (nodes + 1) / 12).ravel()
    density = g.natural_density(at).position(1.0)["natural_curvature(s)"]
    total = density * np.tile(weights / 12, 6)
    np.testing.assert_allclose(total.sum(axis=-1), g.position(1.0)["natural_curvature"].sum(axis=-1), rtol=1e-9)


def test_closed_band():
    """A circle with a natural curvature that is not constant, where nothing holds it: what no motion changes."""
    arguments = {
        "strip": Strip(1.0, 0.05, 0.3, (3.0, 9.0)), "closure": Closure("circle", ruling="straight"), "segments": 12,
        "clamp": None,
    }  # fmt: skip
    e = solved(arguments)
    compare(arguments, e, ["natural_curvature", "poisson"], skip=("start_force", "start_moment"), tolerance=2e-6)


def test_walls_that_are_touched():
    arguments = {
        "strip": Strip(1.0, 0.05, 0.4, 0.0, gamma=60.0), "clamp": Clamp(ruling="straight"),
        "gravity": Gravity((0, 1, 0)), "walls": [Wall((0, -0.15, 0), (0, 1, 0))], "segments": 8,
    }  # fmt: skip
    e = solved(arguments)
    assert e.walls[0].contacts.size
    compare(arguments, e, ["gamma", "wall.0.offset", "start.rotation"], skip=("eta",))
    g = gradients(e, ["start.position", "wall.0.offset"])
    # the wall up or the clamp down is one relative motion
    np.testing.assert_allclose(g.wall_force(0)["wall.0.offset"], -g.wall_force(0)["start.position"][:, 1], rtol=1e-7)


def test_a_clamp_that_stands_on_a_wall():
    """The wall touches where nothing can move: it takes no part."""
    strip, floor = Strip(1.0, 0.05, 0.4, 3.0, gamma=1.0), Wall((0, 0, 0), (0, 1, 0))
    bare = solve(strip, Clamp(), Gravity((0, 1, 0)), segments=5, formulation="mixed")
    side = 1.0 if bare.position(0.5)[0][1] > 0 else -1.0
    clamp = Clamp(normal=(0, side, 0))
    found = []
    for walls in ([], [floor]):
        e = solve(strip, clamp, Gravity((0, 1, 0)), walls=walls, segments=5, formulation="mixed", options=TIGHT)
        assert e.ok
        assert not walls or e.joints[0][1:, 1].min() > 1e-3
        found.append(gradients(e, ["gamma"]).position(S)["gamma"])
    np.testing.assert_allclose(found[0], found[1], atol=1e-9)


def test_a_straight_strip_bends_in_its_plane():
    """K = 0 without weight: every ruling is as good; the derivative is that of the plane arc."""
    e = solve(Strip(1.0, 0.05, 0.4), segments=6)
    g = gradients(e, ["natural_curvature"])
    np.testing.assert_allclose(g.omega(S)["natural_curvature"].sum(axis=-1), 1.0, rtol=1e-12)
    np.testing.assert_allclose(np.abs(g.position(1.0)["natural_curvature"].sum(axis=-1)), [0, 0.5, 0], atol=1e-12)


def test_refusals():
    held = solve(Strip(1.0, 0.05), Clamp(), Gravity((0, 1, 0)), segments=4)
    with pytest.raises(RibbonInputError, match=r"natural_curvature, .*gamma"):
        gradients(held, ["curvature"])
    for name in ("end.position", "wall.0.offset", "thickness"):
        with pytest.raises(RibbonInputError):
            gradients(held, [name])
    with pytest.raises(NotDifferentiable) as failed:
        gradients(replace(held, status=type(held.status).NOT_CONVERGED), ["gamma"])
    assert failed.value.reason == "not_converged"


def test_no_derivative_at_buckling():
    """A heavy column (Greenhill 1881: 7.837) has no derivative at its critical weight; a saddle only when asked for."""
    strip, up = Strip(1.0, 0.05, 0.0), Gravity((0, 0, 1))

    def column(gamma):
        problem = build(replace(strip, gamma=gamma), Clamp(ruling="straight"), up, segments=8)
        return solve_from(problem, np.zeros(problem.size), near=True)

    def stiffness(gamma):
        """Of the plane modes, omega at s = 0 and its slopes."""
        straight = column(gamma)
        bending = straight.problem.layout.bending
        return straight.problem.hessian(straight.x)[bending, bending]

    weightless, weight = stiffness(0.0), stiffness(1.0) - stiffness(0.0)
    critical = 1.0 / scipy.linalg.eigh(-weight, weightless, eigvals_only=True)[-1]
    assert critical == pytest.approx(7.837, abs=0.01)
    assert gradients(column(7.0), ["start.rotation"], unstable=True).condition < 1e6
    with pytest.raises(NotDifferentiable) as failed:
        gradients(column(critical), ["start.rotation"], unstable=True)
    assert failed.value.reason == "singular"
    with pytest.raises(NotDifferentiable) as failed:
        gradients(column(8.5), ["start.rotation"])
    assert failed.value.reason == "saddle"
