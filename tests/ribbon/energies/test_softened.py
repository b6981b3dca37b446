"""The softened ribbon: derivatives in every formulation, its limits, against the shell."""

from __future__ import annotations

import numpy as np
import pytest

from compare.models import solve as solve_scene
from compare.scene.scene import load
from ribbon.find.softened import soften, softened
from ribbon.notes import Note

SCENE = load("limits_7_3").replace(
    {"clamp.start.ruling": "straight", "shell.clamp": "edge", "model.elements": 12, "model.grading": "clamp"}
)


def equilibrium(formulation="chained", **keys):
    return solve_scene(SCENE.replace({"model.formulation": formulation, **keys}), "ribbon").native


def dense(problem, x):
    """The Hessian of the energy alone, symmetric."""
    if problem.rows is None:
        return problem.hessian(x)
    rows, columns = problem.hessian_structure()
    entries = problem.hessian(x, np.zeros(problem.constraint_bounds()[0].size))
    found = np.zeros((x.size, x.size))
    np.add.at(found, (rows, columns), entries)
    return found + found.T - np.diag(np.diag(found))


@pytest.mark.parametrize("formulation", ["chained", "mixed"])
@pytest.mark.parametrize("curvature", [0.0, 3.0])
def test_derivatives(formulation, curvature):
    found = equilibrium(formulation, **{"strip.natural_curvature": curvature})
    problem, x = softened(found.problem, 1e-3), found.x
    rng = np.random.default_rng(0)
    path, step = 1e-2 * rng.standard_normal(x.size), 1e-4
    slope = (problem.value(x + step * path) - problem.value(x - step * path)) / (2 * step)
    assert slope == pytest.approx(problem.gradient(x) @ path, rel=1e-7, abs=1e-8)
    turn = (problem.gradient(x + step * path) - problem.gradient(x - step * path)) / (2 * step)
    assert turn.shape == x.shape
    np.testing.assert_allclose(turn, dense(problem, x) @ path, rtol=1e-6, atol=1e-7)


def test_the_inner_problem_is_still_there():
    found = equilibrium()
    problem = softened(found.problem, 1e-3)
    assert problem.size == found.problem.size
    assert problem.rows is None
    assert problem.value(found.x) < found.problem.value(found.x)  # it gains


def test_both_formulations_soften_alike():
    chained, mixed = (soften(equilibrium(f), 1e-3) for f in ("chained", "mixed"))
    assert chained is not None
    assert mixed is not None
    np.testing.assert_allclose(chained.end.position, mixed.end.position, atol=1e-6)


@pytest.mark.parametrize("formulation", ["chained", "mixed"])
def test_a_softened_state_tells_its_own_numbers(formulation):
    """Energies of the ribbon at the softened shape, above its own minimum, and no stability that was not judged."""
    found = equilibrium(formulation)
    there = soften(found, 1e-3)
    assert there is not None
    assert there.energy.total == pytest.approx(found.problem.value(there.x), rel=1e-12)
    assert there.energy.total > found.energy.total + 1e-6
    assert there.stable is None
    assert np.isnan(there.lowest_eigenvalue)
    assert there.notes == (Note.SOFTENED,)
    assert there.problem is found.problem


def test_a_thin_strip_is_not_softened():
    found = equilibrium()
    moved = [float(np.linalg.norm(soften(found, h).end.position - found.end.position)) for h in (1e-3, 1e-5, 1e-7)]
    assert moved[0] > 1e-2
    assert moved[2] < 2e-4
    # the layers' gain is about 1 / z, z ~ h^(-1/2): a factor of ten for each two decades
    assert moved[0] / moved[1] == pytest.approx(10.0, rel=0.35)
    assert moved[1] / moved[2] == pytest.approx(10.0, rel=0.35)


def test_what_cannot_be_softened():
    assert soften(equilibrium("matrix"), 1e-3) is None


def test_a_narrow_strip_becomes_a_kirchhoff_rod_in_bending():
    """kappa is a rod's: w -> 0 at h fixed over w; a planar cantilever then bends with (1 - nu^2) less stiffness."""
    scene = load("cantilever").replace(
        {"strip.poisson": 0.3, "strip.width": 1e-3, "shell.width_to_thickness": 2.0, "strip.gamma": 0.1}
    )
    stiff = solve_scene(scene, "ribbon").native
    soft = soften(stiff, scene.width / 2.0)
    assert soft is not None
    up = scene.up
    assert up is not None
    drop = [float((e.end.position - scene.position) @ up) for e in (stiff, soft)]
    assert drop[1] / drop[0] == pytest.approx(1.0 / (1.0 - 0.3**2), rel=1e-3)
