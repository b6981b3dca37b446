"""The shell's equations over all their unknowns: the tangent is their derivative, problems move what they should."""

from dataclasses import replace

import numpy as np
import pytest

from shellref.inputs import ShellInputError
from shellref.shell.options import ShellOptions
from shellref.shell.problem import Pose, ShellProblem

pytest.importorskip("dolfinx")
pytestmark = pytest.mark.shell

from shellref.follow.equations import Equations  # noqa: E402
from shellref.path.solve import solve  # noqa: E402

TILTED = ((1.0, 0.0, 0.0), (0.0, 0.8, -0.6), (0.0, 0.6, 0.8))
HANGING = ShellProblem(
    width=0.2, thickness=0.01, poisson=0.3, gamma=5.0, up=(0.0, 1.0, 0.0), natural_curvature=(0.5, 0.5), elements=(6, 2)
)
CLAMPED = replace(HANGING, end=Pose((0.0, -0.3, 0.85), TILTED), gamma=0.0)


def bent(equations):
    """z of a smooth shape that is no equilibrium, with the stress that belongs to it."""
    s, v = equations.model.nodes.T
    state = np.hstack(equations.model.body.surface.place(s, v))
    state[:, 1] -= 0.05 * s**2
    state[:, 0] += 0.03 * s * s
    state[:, 3:] += np.stack([0.1 * v, 0.0 * s, 0.1 * s], axis=1)
    state[:, 3:] /= np.linalg.norm(state[:, 3:], axis=1)[:, None]
    return equations.own(equations.joined(state, equations.model.no_stress()))


@pytest.fixture(scope="module", params=[HANGING, CLAMPED], ids=["hanging", "clamped"])
def found(request):
    """Equations, an equilibrium's z and its problem."""
    options = ShellOptions()
    result = solve(request.param, options)
    equations = Equations(request.param, options)
    surface = result.surface
    u = np.concatenate([surface.points, surface.directors], axis=-1)
    return equations, equations.own(equations.at_rest(u)), result


def test_what_the_solver_finds_is_an_equilibrium_here(found):
    equations, z, result = found
    left = equations.residual(z)
    assert np.linalg.norm(left[: 6 * equations.nodes]) < 1e-5
    assert np.abs(left[6 * equations.nodes :]).max() == 0.0
    assert equations.factor(z) == result.negative_eigenvalues == 0
    assert equations.energy(z) == pytest.approx(result.energy["total"], rel=1e-9)


def test_the_tangent_is_the_derivative(found):
    equations, z, _ = found
    rng = np.random.default_rng(3)
    smooth = np.sin(3.0 * np.arange(equations.size)) * rng.uniform(0.5, 1.0, equations.size)
    step = 1e-7
    moved = (equations.residual(z + step * smooth) - equations.residual(z - step * smooth)) / (2.0 * step)
    equations.factor(z)
    back = equations.solve(moved)
    nodal, stress = np.split(back - smooth, [6 * equations.nodes])
    assert np.abs(nodal).max() < 2e-6
    assert np.abs(stress).max() < 1e-6 * np.abs(moved).max()


def test_the_transposed_tangent_is_its_transpose(found):
    equations, z, _ = found
    b, c = np.random.default_rng(4).normal(size=(2, equations.size))
    equations.factor(z)
    one, other = float(c @ equations.solve(b)), float(b @ equations.solve_transposed(c))
    scale = np.linalg.norm(c) * np.linalg.norm(equations.solve(b))
    assert one == pytest.approx(other, abs=1e-10 * scale)


def test_newton_with_stresses_comes_back_from_far_in_few_steps():
    """A thin shell without its stress: the rows of stresses make the way as long as a thick shell's."""
    thin = replace(HANGING, thickness=1e-3, natural_curvature=(0.0, 0.0))
    equations = Equations(thin, ShellOptions())
    z = bent(equations)
    z[6 * equations.nodes :] = 0.0
    for _ in range(12):
        equations.factor(z)
        z = equations.stepped(z, -equations.solve(equations.residual(z)))
    assert np.linalg.norm(equations.residual(z)[: 6 * equations.nodes]) < 100.0 * equations.noise()


def changed(field, value):
    return lambda p: replace(p, **{field: value})


@pytest.mark.parametrize(
    "change",
    [
        changed("gamma", 7.0),
        changed("natural_curvature", (1.0, -1.0)),
        changed("thickness", 0.02),
        changed("width", 0.3),
        changed("poisson", 0.1),
        changed("clamp_frame", TILTED),
        changed("tip", (0.0, -1.0, 0.5)),
    ],
    ids=["gamma", "natural", "thickness", "width", "poisson", "clamp", "tip"],
)
def test_another_problem_is_that_of_equations_made_for_it(change):
    other = change(HANGING)
    moved, made = (Equations(p, ShellOptions()) for p in (HANGING, other))
    z = bent(made)
    before = moved.residual(z)
    moved.set_problem(other)
    assert np.allclose(moved.residual(z), made.residual(z), rtol=1e-12, atol=1e-9 * np.abs(before).max())
    assert np.abs(moved.residual(z) - before).max() > 1e-4
    moved.set_problem(HANGING)
    assert np.allclose(moved.residual(z), before, rtol=0.0, atol=1e-9 * np.abs(before).max())


@pytest.mark.parametrize(
    "problem",
    [
        replace(CLAMPED, slide=(None, (0.0, 0.0, 1.0))),
        replace(CLAMPED, guided=True),
        replace(HANGING, transverse_curvature=1.0, natural_curvature=(0.0, 0.0)),
        replace(HANGING, clamp="free", gamma=0.0),
    ],
)
def test_what_is_not_known_is_refused(problem):
    with pytest.raises(ShellInputError):
        Equations(problem, ShellOptions())
