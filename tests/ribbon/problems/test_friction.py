"""What friction adds to the energy: particles and their derivatives, Coulomb's law of the term."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse

from compare.measure.friction import missed
from ribbon import Clamp, Gravity, Strip, Wall
from ribbon.find.solve import build
from ribbon.problems.friction import term
from ribbon.problems.friction.particles import Rub
from ribbon.problems.mixed import MixedProblem
from ribbon.surface import centreline, ruling_foot

#: Foot, side and particle beside it, of three places: in a segment, at a joint, at the end.
PLACES = ((0.3, 1.0, 0.32), (0.25, -1.0, 0.27), (1.0, 1.0, 0.98))


def _problem(energy: str, bound: float, random: np.random.Generator) -> tuple[MixedProblem, np.ndarray]:
    """A bent and twisted strip with rubs at `PLACES`, on a plane that is oblique to it."""
    thickness = 2e-3 if energy == "kirchhoff" else None
    strip = Strip(1.0, 0.1, gamma=5.0, thickness=thickness)
    problem = build(
        strip, Clamp(), Gravity((0.0, 1.0, 0.0)), walls=[Wall((0.0, -0.3, 0.0), (0.0, 1.0, 0.0), friction=0.3)],
        energy=energy, segments=4, formulation="mixed",
    )  # fmt: skip
    assert isinstance(problem, MixedProblem)
    x = problem.state(random.normal(size=5), 0.3 * random.normal(size=5))
    normal = np.array([0.2, 1.0, 0.1]) / np.linalg.norm([0.2, 1.0, 0.1])
    rubs = tuple(
        Rub(
            0, s, side, particle, tuple(normal), tuple(random.normal(size=3)), bound, tuple(random.normal(size=3)), 10.0
        )
        for s, side, particle in PLACES
    )
    return problem.with_changes(rubs=rubs), x


@pytest.mark.parametrize("energy", ["wunderlich", "kirchhoff"])
@pytest.mark.parametrize("bound", [1e-3, 1e9])
def test_gradient_and_hessian(energy: str, bound: float) -> None:
    """Central differences of the value and of the gradient, of what slips and of what sticks."""
    random = np.random.default_rng(0)
    problem, x = _problem(energy, bound, random)
    friction = problem.friction
    assert friction is not None

    def gradient(at: np.ndarray) -> np.ndarray:
        out = np.zeros(at.size)
        friction.add_gradient(at, out)
        return out

    way, h = random.normal(size=x.size), 1e-5
    by_value = (friction.value(x + h * way) - friction.value(x - h * way)) / (2.0 * h)
    assert gradient(x) @ way == pytest.approx(by_value, rel=1e-6)
    rows, columns = friction.hessian_structure()
    lower = scipy.sparse.csr_matrix((friction.hessian(x), (rows, columns)), shape=(x.size, x.size)).toarray()
    both = lower + np.tril(lower, -1).T
    by_gradient = (gradient(x + h * way) - gradient(x - h * way)) / (2.0 * h)
    np.testing.assert_allclose(both @ way, by_gradient, atol=1e-6 * np.abs(by_gradient).max())


def test_the_particles_are_those_of_the_surface() -> None:
    """A particle's place by the rows is that of the surface, by its own search for the ruling through it."""
    problem, x = _problem("wunderlich", 1.0, np.random.default_rng(1))
    material = np.array([[particle, side * problem.half_width] for _, side, particle in PLACES])
    assert problem.friction is not None
    q = problem.parameters(x)
    foot = ruling_foot(q, problem.lengths, material)
    points, frames = problem.joints(x)
    r, frame, _, eta = centreline(q, problem.lengths, points, frames, foot, problem.exponent_limit)
    there = r + material[:, 1:] * (frame[:, :, 0] + eta[:, None] * frame[:, :, 2])
    own = problem.friction.points(x)
    inside = np.array(
        [problem.segment_at(s) == problem.segment_at(f) for (s, _, _), f in zip(PLACES, foot, strict=True)]
    )
    assert inside.any()
    np.testing.assert_allclose(own[inside], there[inside], atol=1e-12)


def test_the_term_obeys_the_law() -> None:
    """|T| <= b always; T = L + r u where that is within, else b along it."""
    random = np.random.default_rng(2)
    trial, bound = random.normal(size=(200, 2)), np.abs(random.normal(size=200))
    _, force, _ = term.rubbed(trial, bound, np.full(200, 3.0))
    size, own = np.linalg.norm(force, axis=1), np.linalg.norm(trial, axis=1)
    assert np.all(size <= bound * (1.0 + 1e-14))
    sticks = own <= bound
    assert sticks.any()
    assert (~sticks).any()
    np.testing.assert_array_equal(force[sticks], trial[sticks])
    np.testing.assert_allclose(force * own[:, None], trial * size[:, None], atol=1e-14)


def test_the_judge_sees_what_is_wrong() -> None:
    """Friction outside the cone, along the slip, or of a place that slips with less than all: each is told."""
    normals = np.array([[0.0, 1.0, 0.0]])

    def most(force: float, slip: float) -> float:
        return missed(
            [{"push": 2.0, "friction": np.array([0.0, 0.0, force]), "slip": np.array([0.0, 0.0, slip])}], 0.5, normals
        ).most

    assert most(-1.0, 0.1) < 1e-15
    assert most(0.3, 0.0) < 1e-15
    assert most(-1.1, 0.1) > 0.05
    assert most(1.0, 0.1) > 0.1
    assert most(-0.5, 0.1) > 0.04
