"""The compiled elements against dolfinx's forms: random states, every body and option that they know."""

import dataclasses

import numpy as np
import pytest

from shellref import Pose, ShellOptions, ShellProblem
from shellref.shell import director

pytest.importorskip("dolfinx")
pytestmark = pytest.mark.shell

from shellref.fenics import petsc_api as petsc  # noqa: E402
from shellref.path.linear import CellsLinear, FormsLinear  # noqa: E402
from shellref.path.newton import Equilibrium  # noqa: E402
from shellref.path.solve import solve  # noqa: E402
from shellref.shell.body import Body, Control, Supports  # noqa: E402
from shellref.shell.grid import Grid  # noqa: E402
from shellref.shell.midsurface import Annulus, Cylinder  # noqa: E402
from shellref.shell.naghdi import NaghdiModel  # noqa: E402
from shellref.shell.strip import build_strip  # noqa: E402

RNG = np.random.default_rng(7)
BASE = ShellProblem(
    width=0.3, thickness=0.02, poisson=0.3, natural_curvature=(2.0, -1.0), gamma=7.0, up=(0.6, 0.8, 0.0),
    elements=(4, 2), grading=(0.4, 0.5),
)  # fmt: skip
END = Pose((0.0, 0.1, 0.9), ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)))
STRIPS = {
    "Q2": {},
    "Q3": {"degree": 3},
    "Q4": {"degree": 4, "elements": (3, 1)},
    "thin": {"thickness": 3e-4},
    "corners": {"clamp": "corners", "elements": (6, 4)},
    "both ends": {"end": END},
    "tip": {"tip": (0.3, -0.2, 1.0)},
    "free": {"clamp": "free", "gamma": 0.0},
    "tape": {"transverse_curvature": 2.0, "clamp": "edge"},
}


def _ring(degree):
    """A piece of a flat ring, held at one side, pulled and twisted at nodes."""

    def supports(grid, nodes):
        held = np.abs(nodes[:, 0]) < 1e-9
        return Supports.none(len(nodes)).hold(held, "xyz", director.HELD).hold(nodes[:, 1] > 1.9, "y", 1)

    def pull(grid, nodes):
        return np.where(nodes[:, :1] > 0.9, [0.1, 0.2, 0.3], 0.0)

    grid = Grid(np.array([0.0, 0.3, 0.6, 1.0]), np.array([1.0, 1.4, 2.0]), degree)
    return Body(surface=Annulus(), grid=grid, thickness=0.05, poisson=0.2, supports=supports, forces=pull, couples=pull)


def bodies():
    """Every strip of STRIPS, rings, and a cylinder curved along."""
    found = {
        name: build_strip(dataclasses.replace(BASE, **change), ShellOptions()).body for name, change in STRIPS.items()
    }
    found |= {f"ring Q{k}": _ring(k) for k in (2, 3)}
    found["arch"] = dataclasses.replace(found["Q2"], surface=Cylinder(curvature_along=3.0))
    return found


BODIES = bodies()
#: Forms of degree 4 take a minute to compile.
NAMES = [pytest.param(name, marks=[pytest.mark.validate] * (name == "Q4")) for name in BODIES]


def pair(name, stabilisation=0.3):
    """The same body with kernels and with forms, and a random state with a stress that is not its own."""
    kernels, forms = (NaghdiModel(BODIES[name], stabilisation, engine=engine) for engine in ("kernels", "forms"))
    control = Control(natural=0.7, weight=0.6, load=0.4)
    kernels.set_control(control)
    forms.set_control(control)
    state = director.retract(forms.reference, 0.1 * RNG.standard_normal(forms.reference.shape))
    return kernels, forms, state, 0.1 * RNG.standard_normal(state.shape)


def same(found, expected, tolerance=1e-12):
    """Largest difference over the largest entry."""
    assert np.max(np.abs(found - expected)) <= tolerance * np.max(np.abs(expected))


@pytest.mark.parametrize("name", NAMES)
def test_strains_forces_energies(name):
    kernels, forms, state, step = pair(name)
    assert kernels.cells is not None
    assert forms.cells is None
    for found, expected in zip(kernels.strains(state, step), forms.strains(state, step), strict=True):
        same(found, expected)
    stress = forms.stress(state, step)
    same(kernels.stress(state, step).full, stress.full)
    same(kernels.internal(state, stress), forms.internal(state, stress))
    same(kernels.nodal_areas, forms.nodal_areas)
    same(kernels.residual(state), forms.residual(state))
    rate = Control(natural=0.3, weight=-0.5, load=2.0)
    same(kernels.residual_rate(state, rate), forms.residual_rate(state, rate))
    found, expected = kernels.energies(state), forms.energies(state)
    assert found.total == pytest.approx(expected.total, rel=1e-12)
    assert found.stabilisation == pytest.approx(expected.stabilisation, rel=1e-11)


@pytest.mark.parametrize("name", NAMES)
def test_reduced_tangent(name):
    """P^T K P, the curvature of |d| = 1 and a shift: entry by entry, inertia, solution, and K itself on a step."""
    kernels, forms, state, step = pair(name)
    stress = forms.stress(state, step)
    force = forms.force(state, stress)
    sides = [Equilibrium(model, ShellOptions()) for model in (kernels, forms)]
    bases = [side.factor(state, stress, force, 0.3) for side in sides]
    assert isinstance(sides[0].linear, FormsLinear if name == "tape" else CellsLinear)
    assert isinstance(sides[1].linear, FormsLinear)
    found, expected = (petsc.to_scipy(side.matrix).toarray() for side in sides)
    same(found, expected)
    assert sides[0].factors.inertia() == sides[1].factors.inertia()
    same(sides[0].linear.stiff(step), sides[1].linear.stiff(step))
    right = sides[1].increments.reduce(force, bases[1])
    same(sides[0].factors.solve(right), np.linalg.solve(expected, right), 1e-9)


def test_edges_with_unknowns_take_the_forms():
    """What the kernels do not know goes the way of the forms, with strains and forces of the kernels."""
    problem = dataclasses.replace(BASE, end=END, guided=True)
    model = NaghdiModel(build_strip(problem, ShellOptions()).body)
    assert model.cells is not None
    assert isinstance(Equilibrium(model, ShellOptions()).linear, FormsLinear)


@pytest.mark.parametrize("change", [{}, {"degree": 3}, {"end": END}])
def test_a_walk_ends_in_the_same_state(change):
    problem = dataclasses.replace(BASE, **change)
    found, expected = (solve(problem, ShellOptions(engine=engine)) for engine in ("kernels", "forms"))
    assert found.status == expected.status
    assert found.negative_eigenvalues == expected.negative_eigenvalues
    assert np.max(np.abs(found.surface.points - expected.surface.points)) < 1e-10
    assert np.max(np.abs(found.surface.directors - expected.surface.directors)) < 1e-9
    assert found.energy["total"] == pytest.approx(expected.energy["total"], rel=1e-9)
    assert found.lowest_eigenvalue == pytest.approx(expected.lowest_eigenvalue, rel=1e-6)
    assert found.newton_iterations == expected.newton_iterations
