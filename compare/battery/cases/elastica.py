"""The planar elastica: great weight, S-shapes, branches; judged by `compare.battery.planar`, not by its solver."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from scipy.integrate import simpson

from compare.battery.case import Case, Check, Rung, holds, near
from compare.battery.planar import all_equilibria, judged

ELEMENTS, DEGREE = 40, 3
"""Of every solve here, unless a case says otherwise."""

GREENHILL = 7.83734744
"""Weight Gamma at which a strip that stands on its clamp buckles: (3 j / 2)^2 with j the first zero of J_(-1/3)
(A. G. Greenhill, Proc. Camb. Phil. Soc. 4 (1881), 65)."""


def _solved(problem: object, elements: int = ELEMENTS, error: bool = False):  # type: ignore[no-untyped-def]
    from ribbonbench.errors import Missing

    try:
        from shellref.elastica.solve import solve
    except ImportError as missing:
        raise Missing(str(missing), "pip install 'ribbonbench[elastica]'") from None
    return solve(problem, elements, DEGREE, estimate_error=error)  # type: ignore[arg-type]


def _problem(**keys: object):  # type: ignore[no-untyped-def]
    from shellref.elastica.problem import ElasticaProblem

    return ElasticaProblem(**keys)  # type: ignore[arg-type]


def _checked(problem, elements: int = ELEMENTS, shape: float = 1e-5) -> Iterator[Check]:  # type: ignore[no-untyped-def]
    """Solved stable, and as the collocation has it."""
    found = _solved(problem, elements)
    yield holds("status converged", found.status.value == "converged", found.message)
    scale = max(1.0, math.sqrt(problem.load), *(abs(k) for k in problem.curvature))
    yield Check("residual over the largest of 1, |K| and sqrt(load)", found.residual / scale, 1e-11)
    force = np.asarray(found.forces.end) - np.asarray(problem.force)
    lever = np.asarray(found.position([1.0])[0])
    weight = problem.gamma * np.asarray(problem.up)
    s = np.linspace(0.0, 1.0, 20_001)
    centre = simpson(found.position(s), x=s, axis=0)
    balance = np.asarray(found.forces.start) + np.asarray(found.forces.end) - weight
    total = max(1.0, float(np.linalg.norm(found.forces.start)), float(np.linalg.norm(weight)))
    yield Check("forces against the weight (relative)", float(np.linalg.norm(balance)) / total, 1e-12)
    turning = found.forces.start_moment + found.forces.end_moment
    turning += lever[0] * found.forces.end[1] - lever[1] * found.forces.end[0]
    turning -= centre[0] * weight[1] - centre[1] * weight[0]
    yield Check("moments about the clamp (over the forces times l)", abs(turning) / total, 1e-5)
    yield from judged(
        problem, found, found.nodes, (found.energy.bending, found.energy.gravity), found.lowest_eigenvalue,
        (float(force[0]), float(force[1])), shape,
    )  # fmt: skip


def _weight(rung: Rung) -> Iterator[Check]:
    return _checked(_problem(gamma=float(rung)))


def _weight_curled(rung: Rung) -> Iterator[Check]:
    return _checked(_problem(gamma=float(rung), curvature=(10.0, 10.0)))


def _standing(rung: Rung) -> Iterator[Check]:
    found = _solved(_problem(gamma=GREENHILL * float(rung), up=(1.0, 0.0)))
    stable = float(rung) < 1.0
    yield holds("stable below the critical weight, and only there", found.stable is stable, found.message)
    yield Check("turned by (rad)", float(np.abs(found.theta).max()), 1e-12)
    yield near(
        "lowest eigenvalue changes sign at the critical weight",
        found.lowest_eigenvalue,
        0.0,
        5.0 * abs(1.0 - float(rung)) + 1e-6,
    )


def _chain(rung: Rung) -> Iterator[Check]:
    return _checked(_problem(gamma=float(rung), end=(0.5, 0.0), end_angle=0.0))


def _taut(rung: Rung) -> Iterator[Check]:
    slack = float(rung)
    if slack < 1e-11:
        try:
            _solved(_problem(end=(1.0 - slack, 0.0), end_angle=0.0))
        except ValueError as error:
            yield holds("refused as taut, by name", "taut" in str(error), str(error))
            return
        yield holds("refused as taut, by name", False, "it was solved")
        return
    found = _solved(_problem(end=(1.0 - slack, 0.0), end_angle=0.0))
    yield holds("status converged", found.status.value == "converged", found.message)
    bound = 2.0 * slack + 1e-4 * 1e-11 / slack + 1e-12 / slack
    yield Check("energy over 4 pi^2 slack, less 1", abs(found.energy.total / (4.0 * math.pi**2 * slack) - 1.0), bound)
    force = -found.forces.end[0] / (4.0 * math.pi**2)
    yield Check("thrust over 4 pi^2, less 1", abs(force - 1.0), 2.0 * slack + 1e-6)


def _pushed(rung: Rung) -> Iterator[Check]:
    elements = ELEMENTS if abs(float(rung)) < 0.85 else 2 * ELEMENTS
    return _checked(_problem(end=(float(rung), 0.0), end_angle=0.0), elements, shape=3e-5)


def _s_shape(rung: Rung) -> Iterator[Check]:
    offset = float(rung)
    problem = _problem(end=(0.5, offset), end_angle=0.0)
    yield from _checked(problem)
    found = _solved(problem)
    off = float(np.linalg.norm(found.position([0.5])[0] - (0.25, 0.5 * offset)))
    if offset > 0.7:
        yield Check("point-symmetric: its middle is the middle of its ends (l)", off, 1e-7)
    else:
        yield holds("not point-symmetric: the lower one leans", off > 0.05, f"{off:.3g} l")
    lowest = min(_energies(problem))
    yield Check("energy above the lowest that deflation finds (D w / l)", found.energy.total - lowest, 1e-3)


def _energies(problem) -> list[float]:  # type: ignore[no-untyped-def]
    """Energies of the equilibria that deflation finds from arcs, S-shapes and waves."""
    from shellref.elastica.branches import equilibria
    from shellref.elastica.problem import LoadPath
    from shellref.elastica.system import System

    system = System(np.linspace(0.0, 1.0, 21), DEGREE, LoadPath(problem, problem))
    s = system.discrete.s
    guesses = []
    for shape in (np.sin(2.0 * math.pi * s), np.sin(math.pi * s), np.sin(3.0 * math.pi * s)):
        for size in (1.0, -1.0):
            z = np.zeros(system.size)
            z[: system.count] = system.discrete.projected(size * shape)
            guesses.append(z)
    points = equilibria(system, 1.0, guesses)
    return [sum(system.discrete.energies(p.z[: system.count], problem)) for p in points]


def _turns(rung: Rung) -> Iterator[Check]:
    return _checked(_problem(end=(0.3, 0.0), end_angle=2.0 * math.pi * float(rung)), shape=3e-5)


def _curl(rung: Rung) -> Iterator[Check]:
    curl = float(rung)
    return _checked(_problem(gamma=curl, curvature=(curl, curl)), elements=max(ELEMENTS, round(curl)))


def _branches(rung: Rung) -> Iterator[Check]:
    from shellref.elastica.branches import equilibria
    from shellref.elastica.problem import LoadPath
    from shellref.elastica.system import System

    load = float(rung) * math.pi**2 / 4.0
    problem = _problem(force=(-load, 0.0))
    shot = all_equilibria(problem, 2.0 * math.sqrt(load) + 0.1, 400)  # with 200 a close pair is missed
    expected = 1 + 2 * sum(1 for n in range(20) if (2 * n + 1) ** 2 < float(rung))
    yield near("equilibria by shooting", len(shot), expected, 0.0)
    system = System(np.linspace(0.0, 1.0, 41), DEGREE, LoadPath(_problem(), problem))
    straight = system.discrete.natural_shape(system.way.at(0.0))
    bent = [system.discrete.projected(a * np.sin((n + 0.5) * math.pi * system.discrete.s))
            for n in range(5) for a in (1.0, -1.0, 2.5, -2.5)]  # fmt: skip
    found = equilibria(system, 1.0, [straight, *bent])
    yield near("equilibria by deflation", len(found), expected, 0.0)
    ends = np.array([system.discrete.reach(point.z) for point in found])
    apart = max(float(np.min(np.linalg.norm(ends - end[2:], axis=1))) for _, end in shot)
    yield Check("end of every shot beside that of a deflated one (l)", apart, 1e-6)
    stable = sum(point.stable is True for point in found)
    yield near("stable ones", stable, 2 if float(rung) > 1.0 else 1, 0.0)


def _last_digit(rung: Rung) -> Iterator[Check]:
    """Seeds [6, -12, c] that have neither mean curvature nor slope but for the last digits of c: a bow to one side."""
    from compare.models import solve
    from compare.scene.scene import loads

    text = """
    [strip]
    length = 1.0
    width = 0.05
    poisson = 0.3
    gamma = 0.0
    [clamp.start]
    position = [0.0, 0.0, 0.0]
    tangent = [0.0, 0.0, 1.0]
    normal = [0.0, 1.0, 0.0]
    [clamp.end]
    position = [0.0, 0.0, 0.8]
    tangent = [0.0, 0.0, 1.0]
    normal = [0.0, 1.0, 0.0]
    [model]
    energy = "elastica"
    """

    def bent(side: float, nearly: float):  # type: ignore[no-untyped-def]
        seed = [side * 6.0, side * -12.0, side * 6.0 * (1.0 + nearly)]
        return solve(loads(text).replace({"seed.curvature": seed}), "elastica")

    exact, found, mirrored = bent(1.0, 0.0), bent(1.0, float(rung)), bent(-1.0, float(rung))
    ends = [one.shape.centreline(np.array([0.5]))[0] for one in (exact, found, mirrored)]
    yield holds("all converged", all(one.word == "converged" for one in (exact, found, mirrored)))
    yield holds("a bow, not a taut strip", abs(ends[0][1]) > 0.2, f"{ends[0][1]:.3g} l")
    yield Check("its middle where that of the exact seed is (l)", float(np.linalg.norm(ends[1] - ends[0])), 1e-9)
    yield Check("the mirrored seed's in the mirror (l)", float(np.linalg.norm(ends[2] - ends[0] * (1, -1, 1))), 1e-9)


CASES = (
    Case(
        "elastica/last digit",
        "a seed without mean curvature and slope: the way's bow had the sign of a sum of rounding errors",
        "the bow is on the seed's side of its chord, whatever its last digits are", "last digits of the seed",
        _last_digit, (1e-13,), (-1e-13, 1e-9, -1e-9),
    ),
    Case(
        "elastica/weight",
        "a level clamp and great weight: layers of width Gamma^(-1/2) at the clamp",
        "40 graded elements hold the shape, the energy and the lowest eigenvalue of the collocation; no snap",
        "Gamma", _weight, (1e5,), (10.0, 1e3, 1e7),
    ),
    Case(
        "elastica/curled and heavy",
        "natural curvature K = 10 beside the weight: a second layer of width Gamma^(-1/3) at the tip",
        "as above", "Gamma", _weight_curled, (1e3,), (10.0, 1e5, 1e7),
    ),
    Case(
        "elastica/standing",
        "a strip that stands on its clamp near the weight under which it buckles",
        "straight and an equilibrium at any weight; stable below Greenhill's weight, unstable above it, and said so",
        "Gamma over Greenhill's", _standing, (0.99, 1.01), (0.5, 0.9, 0.999, 0.9999, 1.0001, 1.001, 2.0),
    ),
    Case(
        "elastica/chain",
        "a heavy strip clamped at both ends, whose layers are at both: 2.2e-3 l off without elements at its end",
        "the collocation's shape, energy and forces", "Gamma", _chain, (1e5,), (10.0, 1e3, 1e7),
    ),
    Case(
        "elastica/nearly taut",
        "both ends clamped, nearly l apart: the sag is 2 sqrt(slack), the thrust that of a column",
        "energy 4 pi^2 slack and thrust 4 pi^2 to first order; below a slack of 1e-11 l refused as taut, not lost",
        "slack / l", _taut, (1e-4, 1e-12), (1e-1, 1e-2, 1e-6, 1e-8, 1e-10),
    ),
    Case(
        "elastica/pushed together",
        "both ends clamped along x and pushed together, past each other: loops, limit points",
        "a stable equilibrium with the collocation's shape, energy and thrust", "end x / l", _pushed, (0.5,),
        (0.2, -0.5, -0.8, -0.9),
    ),
    Case(
        "elastica/S-shape",
        "clamps level but offset: with a small offset a hump that leans, with a large one a point-symmetric S",
        "the collocation's shape; the lowest of those that deflation finds", "offset / l", _s_shape, (),
        (0.1, 0.3, 0.5, 0.6, 0.8),
    ),
    Case(
        "elastica/turns",
        "an end turned by whole turns against the start",
        "the collocation's shape with so many turns, stable", "turns", _turns, (1,), (2, 3),
    ),
    Case(
        "elastica/strong curl",
        "natural curvature K under the weight Gamma = K: many coils, and snaps on the way",
        "with an element for every radian the collocation's shape", "K l", _curl, (20.0,), (50.0, 100.0, 200.0),
    ),
    Case(
        "elastica/all branches",
        "a column under a dead load above several of its critical loads: equilibria come in pairs at 1, 9, 25, 49",
        "deflation finds all that a scan of the clamp's moment finds, as many as Euler says; two are stable",
        "load over the first critical one", _branches, (4.0,), (0.5, 12.0, 26.0, 60.0),
    ),
)  # fmt: skip
