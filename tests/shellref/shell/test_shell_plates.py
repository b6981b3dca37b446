"""The Reissner-Mindlin plate: small deflections against series and closed forms with shear; symmetry planes."""

import numpy as np
import pytest

from shellref import ShellOptions, ShellStatus
from shellref.shell.body import Body, Control, Stage, Supports, line_force
from shellref.shell.director import HELD
from shellref.shell.grid import Grid
from shellref.shell.midsurface import Cylinder

pytest.importorskip("dolfinx")
pytestmark = pytest.mark.shell

from shellref.path.arc import Point  # noqa: E402
from shellref.path.newton import Equilibrium  # noqa: E402
from shellref.path.walk import Walk, Walker  # noqa: E402
from shellref.shell.naghdi import NaghdiModel  # noqa: E402

NU = 0.3
END = Control(1.0, 1.0, 1.0, 0.0)
TINY = 1e-9


def walked(body: Body, options: ShellOptions, stages=None):
    """(model, walk, verdict) of a body from its reference through the stages (by default all loads from nothing)."""
    stages = stages or (Stage("load", Control(1.0, 0.0, 0.0, 0.0), END),)
    model = NaghdiModel(body, options.stabilisation)
    walker = Walker(Equilibrium(model, options), stages, options)
    walk = Walk(Point(0.0, model.reference.copy(), model.stress(model.reference)))
    walker.start(walk)
    walker.run(walk)
    return model, walk, walker.verdict(walk)


def settled(body: Body):
    """(nodes, displacements) at the full load, to linear accuracy."""
    model, walk, verdict = walked(body, ShellOptions(tolerance=1e-12, first_step=1.0, max_step=1.0))
    assert verdict[0] is ShellStatus.CONVERGED
    return model.nodes, (walk.point.state - model.reference)[:, :3]


def navier(nu: float, h: float) -> float:
    """w_max D / (q a^4) of a simply supported square plate: Navier's series, with Mindlin's shear w_s = M / (k G h).

    Hard supports: w_M = w_K + (M_x + M_y) / (1 + nu) / (k G h) (Wang 1995), and D = 1 makes k G h = 5 (1 - nu) / h^2.
    """
    m = np.arange(1, 200, 2)
    a, b = np.meshgrid(m, m)
    sign = np.sin(a * np.pi / 2) * np.sin(b * np.pi / 2)
    bend = 16 / np.pi**6 * np.sum(sign / (a * b * (a**2 + b**2) ** 2))
    moment = 16 / np.pi**4 * np.sum(sign / (a * b * (a**2 + b**2)))
    return bend + moment * h**2 / (5 * (1 - nu))


def square(n: int, h: float, q: float) -> Body:
    """A quarter of a simply supported unit square under q per area along -y; symmetry planes x = 0 and z = 0."""

    def supports(grid, nodes):
        s, v = nodes.T
        none = Supports.none(len(nodes)).hold(s < TINY, "z", 2).hold(v < TINY, "x", 0)
        return none.hold(s > 0.5 - TINY, "y", 0).hold(v > 0.5 - TINY, "y", 2)

    knots = np.linspace(0.0, 0.5, n + 1)
    return Body(Cylinder(), Grid(knots, knots), h, NU, supports, weight=(0.0, -q, 0.0))


def test_the_series_is_the_known_one():
    assert navier(NU, 0.0) == pytest.approx(0.00406235, rel=1e-5)
    assert navier(NU, 0.2) / navier(NU, 0.0) == pytest.approx(1.2073, rel=1e-3)  # 0.004904: Reismann's tables


@pytest.mark.parametrize("h", [0.2, 0.1, 1e-2, 1e-3])
def test_simply_supported_square_plate(h):
    """Shear counts for 21 % at h / a = 0.2 and for nothing at 1e-3, where the element must not lock."""
    q = 1e-3 * h
    errors = []
    for n in (2, 4, 8):
        nodes, displacement = settled(square(n, h, q))
        centre = np.argmin(np.hypot(*nodes.T))
        errors.append(abs(-displacement[centre, 1] / q / navier(NU, h) - 1.0))
    assert errors[-1] < 2e-4, errors
    assert errors[0] < 2e-2
    assert errors[0] > 2.5 * errors[1] > 6.0 * errors[2]


def strip(width: float, h: float, supports, **loads) -> Body:
    grid = Grid(np.linspace(0.0, 1.0, 17), np.linspace(0.0, width, 3))
    return Body(Cylinder(), grid, h, NU, supports, normaliser=width, **loads)


@pytest.mark.parametrize("h", [0.1, 1e-3])
def test_a_plate_strip_bends_as_a_cylinder_with_shear(h):
    """Symmetry planes along both long edges: w = P l^3 / 3 D + P l / (k G h) at the tip, whatever nu."""

    def supports(grid, nodes):
        s, v = nodes.T
        sides = Supports.none(len(nodes)).hold((v < TINY) | (v > 0.2 - TINY), "x", 0)
        return sides.hold(s < TINY, "xyz", HELD)

    p = 1e-3 * h
    nodes, displacement = settled(strip(0.2, h, supports, forces=line_force(0, 1.0, (0.0, -p, 0.0))))
    tip = nodes[:, 0] > 1 - TINY
    np.testing.assert_allclose(-displacement[tip, 1] / p, 1 / 3 + h**2 / (5 * (1 - NU)), rtol=1e-5)


def test_an_end_couple_bends_to_an_arc_of_the_plate_or_the_beam():
    """kappa = M / D between symmetry planes; M / (D (1 - nu^2)) where the section may bend the other way."""

    def clamped(grid, nodes):
        return Supports.none(len(nodes)).hold(nodes[:, 0] < TINY, "xyz", HELD)

    def symmetric(grid, nodes):
        sides = (nodes[:, 1] < TINY) | (nodes[:, 1] > 0.02 - TINY)
        return clamped(grid, nodes).hold(sides, "x", 0)

    def pinned(grid, nodes):  # the section at S = 0 may bend: held is what keeps the strip from moving as a whole
        at = nodes[:, 0] < TINY
        middle = at & (np.abs(nodes[:, 1] - 0.01) < TINY)
        return Supports.none(len(nodes)).hold(at, "z", 2).hold(middle, "xyz", HELD)

    m, found = 1e-5, {}
    couples = line_force(0, 1.0, (m, 0.0, 0.0))
    for supports in (symmetric, pinned):
        nodes, displacement = settled(strip(0.02, 1e-2, supports, couples=couples))
        middle = np.argmin(np.hypot(nodes[:, 0] - 1.0, nodes[:, 1] - 0.01))
        found[supports.__name__] = abs(displacement[middle, 1]) / (0.5 * m)
    assert found["symmetric"] == pytest.approx(1.0, rel=1e-5)
    assert found["pinned"] == pytest.approx(1 / (1 - NU**2), rel=1e-5)


def bent(body: Body) -> dict[tuple[float, float], np.ndarray]:
    """The state at the full load by material point, through large displacements."""
    model, walk, verdict = walked(body, ShellOptions())
    assert verdict[0] is ShellStatus.CONVERGED
    return {(round(s, 9), round(v, 9)): x for (s, v), x in zip(model.nodes, walk.point.state, strict=True)}


def test_half_a_model_with_a_symmetry_plane_is_half_the_whole():
    """Cantilever under its weight, nu = 0.4, curved across by Poisson's effect: v >= 0 alone."""
    w, loads = 0.3, {"weight": (0.0, -4.0, -2.0)}

    def clamped(grid, nodes):
        return Supports.none(len(nodes)).hold(nodes[:, 0] < TINY, "xyz", HELD)

    def half(grid, nodes):
        return clamped(grid, nodes).hold(np.abs(nodes[:, 1]) < TINY, "x", 0)

    s = np.linspace(0.0, 1.0, 9) ** 1.3
    whole_knots = np.linspace(-0.5 * w, 0.5 * w, 5)
    whole = bent(Body(Cylinder(), Grid(s, whole_knots), 0.01, 0.4, clamped, **loads))
    part = bent(Body(Cylinder(), Grid(s, whole_knots[2:]), 0.01, 0.4, half, **loads))
    assert len(part) == 17 * 5
    assert abs(whole[1.0, 0.0][1]) > 0.3  # a large deflection
    assert abs(whole[1.0, 0.15][1] - whole[1.0, 0.0][1]) > 1e-4  # and not a planar one
    for place, state in part.items():
        np.testing.assert_allclose(state, whole[place], atol=1e-9)


def test_held_translations_alone_leave_the_directors_free():
    """A strip on two hinges (positions held) under its weight: director tilts at the hinge, w = 5 q l^4 / 384 D."""
    q, h, width = 1e-5, 0.01, 0.1

    def hinged(grid, nodes):
        s, v = nodes.T
        ends = (s < TINY) | (s > 1 - TINY)
        sides = Supports.none(len(nodes)).hold((v < TINY) | (v > width - TINY), "x", 0)
        return sides.hold(ends, "y").hold(s < TINY, "z")

    model, walk, verdict = walked(
        strip(width, h, hinged, weight=(0.0, -q, 0.0)), ShellOptions(tolerance=1e-12, first_step=1.0, max_step=1.0)
    )
    assert verdict[0] is ShellStatus.CONVERGED
    change = walk.point.state - model.reference
    at = np.abs(model.nodes[:, 0] - 0.5) < TINY
    np.testing.assert_allclose(-change[at, 1] / q, 5 / 384 + h**2 / (8 * 5 * (1 - NU)), rtol=1e-4)
    np.testing.assert_allclose(np.abs(change[model.nodes[:, 0] < TINY, 5]) / q, 1 / 24, rtol=1e-4)
