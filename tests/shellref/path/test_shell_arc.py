"""Arc length past limit points: the hinged cylindrical roof of Sze, Liu & Lo (2004), 3.8, on a coarse mesh."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from shellref import ShellOptions, ShellStatus
from shellref.shell.body import Body, Control, Stage, Supports, point_force
from shellref.shell.grid import Grid
from shellref.shell.midsurface import Cylinder
from tests.reference import sze2004

pytest.importorskip("dolfinx")
pytestmark = pytest.mark.shell

from shellref.path.arc import Point, _extremum  # noqa: E402
from shellref.path.newton import Equilibrium  # noqa: E402
from shellref.path.walk import Walk, Walker  # noqa: E402
from shellref.shell.naghdi import NaghdiModel  # noqa: E402

ROOFS = {"thick": sze2004.HINGED_ROOF_THICK, "thin": sze2004.HINGED_ROOF_THIN}
LIMITS = {"thick": sze2004.LIMIT_POINTS_THICK, "thin": sze2004.LIMIT_POINTS_THIN}


def roof(data, n=4) -> Body:
    """A quarter of the roof: S along the straight edges from mid-length, v along the arc from the crown; D = 1."""
    half, arc = 0.5 * data.length, data.radius * data.half_angle
    stiffness = data.young * data.thickness**3 / 12 / (1 - data.poisson**2)

    def supports(grid, nodes):
        s, v = nodes.T
        return Supports.none(len(nodes)).hold(s < 1e-6, "z", 2).hold(v < 1e-6, "x", 0).hold(v > arc - 1e-6, "xyz")

    return Body(
        Cylinder(curvature_across=1 / data.radius),
        Grid(np.linspace(0, half, n + 1), np.linspace(0, arc, n + 1)),
        data.thickness,
        data.poisson,
        supports,
        forces=point_force((0, 0), (0.0, -data.p_max * data.load_share / stiffness, 0.0)),
    )


def loaded(load: float) -> Control:
    return Control(1.0, 1.0, load, 0.0)


@lru_cache
def walked(name, options=None, load=1.0, back=None):
    """(walk, verdict) up to `load` times p_max, then in a second stage to `back` times."""
    options = options or ShellOptions(arc_length="always")
    model = NaghdiModel(roof(ROOFS[name]), options.stabilisation)
    crown = int(np.argmin(np.abs(model.nodes).sum(axis=1)))
    stages = [Stage("load", loaded(0.0), loaded(load))]
    if back is not None:
        stages.append(Stage("unload", loaded(load), loaded(back)))

    def observe(state):
        return {"w": float(model.reference[crown, 1] - state[crown, 1])}

    walker = Walker(Equilibrium(model, options), tuple(stages), options, observe=observe)
    walk = Walk(Point(0.0, model.reference.copy(), model.stress(model.reference)))
    walker.start(walk)
    walker.run(walk)
    return walk, walker.verdict(walk)


def path(walk) -> np.ndarray:
    """(points, 2) of load and deflection of the accepted steps of the path."""
    return np.array([(s.load, s.values["w"]) for s in walk.steps if s.accepted and s.method in ("arc", "load")])


def limits(walk) -> np.ndarray:
    """Loads of the limit points in the log."""
    notes = [s.note for s in walk.steps if s.note.startswith("limit point at")]
    return np.array([float(note.rsplit(maxsplit=1)[1]) for note in notes])


@pytest.mark.parametrize("name", ["thick", "thin"])
def test_the_path_goes_through_both_limit_points(name):
    """4 x 4 elements: limit loads to 1.2 % of the largest, the path to 2 % of the ranges of load and deflection."""
    data, exact = ROOFS[name], LIMITS[name]
    walk, verdict = walked(name)
    assert verdict[0] is ShellStatus.CONVERGED
    assert verdict[2] == 0
    assert limits(walk) == pytest.approx(exact[:, 0], abs=0.012 * exact[0, 0])
    # away from the limit points the state is unstable between them, and stable before and after
    inertia = [s.negative for s in walk.steps if s.accepted and s.method == "arc"]
    assert inertia[0] == inertia[-1] == 0
    assert 1 in inertia
    table = np.column_stack([data.column("P/Pmax"), data.column("-W_C")])
    scale = np.ptp(table, axis=0)
    a, b = table[:-1] / scale, table[1:] / scale
    for point in path(walk) / scale:
        t = np.clip(np.sum((point - a) * (b - a), axis=1) / np.sum((b - a) ** 2, axis=1), 0, 1)
        assert np.min(np.linalg.norm(point - a - t[:, None] * (b - a), axis=1)) < 0.02, point * scale


@pytest.mark.parametrize("name", ["thick", "thin"])
def test_limit_loads_do_not_depend_on_the_steps(name):
    """They are located on the path, to `event_tolerance` of the load, whatever the steps that pass them."""
    options = ShellOptions(arc_length="always", event_tolerance=1e-5)
    coarse, fine = (walked(name, replace(options, max_arc=size)) for size in (0.05, 2e-3))
    assert len(fine[0].steps) > 1.5 * len(coarse[0].steps)
    assert limits(coarse[0]) == pytest.approx(limits(fine[0]), abs=3e-5)
    np.testing.assert_allclose(coarse[0].point.state, fine[0].point.state, atol=1e-6)


def test_load_steps_go_over_to_arc_length_where_they_fail():
    auto, always = walked("thin", ShellOptions()), walked("thin")
    methods = [s.method for s in auto[0].steps]
    assert methods[1] == "load"
    assert "arc" in methods
    assert auto[1][0] is ShellStatus.CONVERGED
    np.testing.assert_allclose(auto[0].point.state, always[0].point.state, atol=1e-6)
    assert limits(auto[0]) == pytest.approx(limits(always[0]), abs=1.5e-3)


def test_load_steps_alone_stop_below_the_limit_load():
    walk, (status, message, *_) = walked("thick", ShellOptions(arc_length="never"))
    assert status is ShellStatus.NOT_CONVERGED
    assert "limit point" in message
    highest = limits(walked("thick")[0])[0]
    assert highest - 2e-3 < walk.point.load < highest + 1e-6
    assert walk.point.negative == 0


def test_before_the_limit_arc_length_and_load_steps_give_the_same_state():
    arc, steps = (walked("thick", ShellOptions(arc_length=kind), 0.7) for kind in ("always", "never"))
    assert arc[1][0] is steps[1][0] is ShellStatus.CONVERGED
    np.testing.assert_allclose(arc[0].point.state, steps[0].point.state, atol=1e-6)


def test_a_load_beyond_collapse_names_the_highest_load_and_keeps_the_last_point():
    walk, (status, message, *_) = walked("thick", ShellOptions(arc_length="always", max_steps=7))
    assert status is ShellStatus.LIMIT_POINT
    highest = limits(walk)[0]
    assert f"{highest:.2f}" in message
    assert 0.0 < walk.point.load < highest
    assert f"{walk.point.load:.6g}" in message
    assert walk.steps[-1].values["w"] > LIMITS["thick"][0, 1]


def test_the_state_beyond_both_limits_is_unloaded_along_its_own_branch():
    """From full load back to 0.5: the inverted roof, not the state at the same load on the way up."""
    walk, verdict = walked("thick", ShellOptions(), back=0.5)
    assert verdict[0] is ShellStatus.CONVERGED
    w = walk.steps[-1].values["w"]
    table = ROOFS["thick"].table
    assert w == pytest.approx(np.interp(0.5, table[-8:, 0], table[-8:, 1]), rel=0.02)
    assert w > 2 * np.interp(0.5, table[:9, 0], table[:9, 1])


def test_extremum_of_a_cubic():
    share, value = _extremum((0.0, 0.0), (1.0, -1.0))
    assert (share, value) == pytest.approx((0.5, 0.25))
    t = np.linspace(0, 1, 100001)
    c = np.array([-3.0, 1.0, 1.0, 2.0])
    ends, slopes = np.polyval(c, [0.0, 1.0]), np.polyval(np.polyder(c), [0.0, 1.0])
    share, value = _extremum(tuple(ends), tuple(slopes))
    assert share == pytest.approx(t[np.argmax(np.polyval(c, t))], abs=1e-4)
    assert value == pytest.approx(np.max(np.polyval(c, t)), rel=1e-8)
