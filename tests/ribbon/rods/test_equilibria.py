"""Equilibria of the curve-angle rod against closed forms, its own balance of forces, and the curvature elements."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ribbon.rods.result import RodShape
from ribbon.rods.rod import Rod, RodEnd, marched, rotation, transported
from ribbon.rods.solve import newton, solve
from ribbon.rods.start import from_frames, from_strains

EYE = np.eye(3)


def even(n: int) -> np.ndarray:
    return np.full(n, 1.0 / n)


def solved(rod: Rod, strains: np.ndarray | None = None) -> RodShape:
    """From the shape at rest, or of constant strains (3,)."""
    start = rod.at_rest(rod.middles) if strains is None else np.tile(strains, (rod.edges + 1, 1))
    assert rod.start.position is not None
    assert rod.start.frame is not None
    found = solve(*from_strains(rod, rod.start.position, rod.start.frame, start))
    assert found.ok, found.message
    return RodShape(found)


def orders(misses: list[float]) -> np.ndarray:
    """Orders of errors of sizes that double."""
    return np.log2(np.array(misses[:-1]) / np.array(misses[1:]))


def test_planar_cantilever_under_a_force():
    """The elastica by an independent quadrature of theta'' = -F cos(theta) (shooting on a fine grid), order 2."""
    load = 4.0

    def shot(bend: float) -> np.ndarray:
        def slope(_: float, z: np.ndarray) -> list[float]:
            return [z[1], -load * math.cos(z[0]), math.cos(z[0]), math.sin(z[0])]

        return solve_ivp(slope, (0.0, 1.0), [0.0, bend, 0.0, 0.0], rtol=1e-12, atol=1e-13).y[:, -1]

    low, high = 0.0, load
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if shot(middle)[1] < 0.0 else (low, middle)
    exact = shot(low)
    misses = []
    for n in (40, 80, 160):
        # kappa_1 > 0 turns d3 towards -d2; the force pulls that way
        rod = Rod(even(n), (1.0, 30.0, 0.8), start=RodEnd(np.zeros(3), EYE), force=np.array([0.0, -load, 0.0]))
        found = solved(rod)
        assert found.reactions[0][0] == pytest.approx([0.0, load, 0.0], abs=1e-7)
        misses.append(math.hypot(-found.vertices[-1, 1] - exact[3], found.vertices[-1, 2] - exact[2]))
        assert -found.reactions[0][1] == pytest.approx([low, 0.0, 0.0], rel=0.4 / n)
    assert orders(misses) == pytest.approx(2.0, abs=0.1)
    assert misses[-1] < 1e-5


def helix(n: int) -> tuple[Rod, np.ndarray, np.ndarray]:
    """A rod whose helix of constant strains balances an end force and moment; its shape at rest is another."""
    stiffness, strain = np.array([1.0, 3.0, 0.7]), np.array([2.5, 0.8, 1.6])
    frame = rotation(np.array([0.4, -0.2, 0.9]))
    darboux = frame @ strain  # constant in space along a helix
    axis = darboux / np.linalg.norm(darboux)
    # a moment that is constant in the material frame has M' = darboux x M; M' + t x F = 0 with F = p darboux asks for
    # M = c darboux + p t: c and p are chosen, the shape at rest follows
    pull, c = 1.7, 0.9
    moment = c * strain + pull / np.linalg.norm(darboux) * np.array([0.0, 0.0, 1.0])
    rest = strain - moment / stiffness
    laws = tuple((float(value), float(value)) for value in rest)
    force = pull / np.linalg.norm(darboux) * darboux
    _, frames = marched(Rod(even(4000), (1.0, 1.0, 1.0)), np.zeros(3), frame, np.tile(strain, (4001, 1)))
    last = frames[-1] @ rotation(strain / 8000.0)
    rod = Rod(
        even(n), tuple(stiffness), laws, RodEnd(np.zeros(3), frame), force=force, moment=last @ moment,
    )  # fmt: skip
    assert np.cross(axis, force) == pytest.approx(np.zeros(3), abs=1e-12)
    return rod, strain, last


def test_helix_under_a_wrench():
    """Constant kappa_1, kappa_2, tau under a force along the axis and a moment: an equilibrium, met to order 2."""
    misses = []
    rod, strain, last = helix(4)
    fine = marched(replace(rod, lengths=even(8000)), np.zeros(3), rod.start.frame, np.tile(strain, (8001, 1)))[0]
    for n in (20, 40, 80):
        rod = replace(rod, lengths=even(n))
        found = RodShape(newton(*from_strains(rod, np.zeros(3), rod.start.frame, np.tile(strain, (n + 1, 1)))))
        assert found.found.ok
        misses.append(np.abs(found.vertices[-1] - fine[-1]).max())
        assert found.strains[3:-3] == pytest.approx(np.tile(strain, (n - 5, 1)), abs=20.0 / n**2)
        assert found.forces == pytest.approx(np.tile(rod.force, (n, 1)), abs=1e-6)
        assert found.ends[1] == pytest.approx(last, abs=20.0 / n**2)
    assert orders(misses) == pytest.approx(2.0, abs=0.1)


def wrung(n: int) -> RodShape:
    """A rod in space with all that it can have: between two clamps that are turned, with weight and a rest shape."""
    end = rotation(np.array([0.0, 0.0, 1.2])) @ rotation(np.array([0.4, 0.0, 0.0]))
    rod = Rod(
        even(n), (1.0, 4.0, 0.8), ((1.0, 2.0), (0.3, -0.3), (0.5, 0.5)), RodEnd(np.zeros(3), EYE),
        RodEnd(np.array([0.1, -0.1, 0.85]), end), weight=np.array([0.0, 5.0, 3.0]),
    )  # fmt: skip
    return solved(rod, np.array([1.0, 0.2, 0.5]))


def test_forces_and_moments_balance():
    """Every edge: M_(i+1) - M_i + e x T = 0, T changes by the weight alone; what the ends exert carries the weight."""
    found = wrung(40)
    edges = np.diff(found.vertices, axis=0)
    assert np.diff(found.moments, axis=0) + np.cross(edges, found.forces) == pytest.approx(0.0 * edges, abs=1e-7)
    assert np.diff(found.forces, axis=0) == pytest.approx(-found.problem.loads[1:-1], abs=1e-7)
    (force_0, moment_0), (force_1, moment_1) = found.reactions
    assert force_0 + force_1 == pytest.approx([0.0, 5.0, 3.0], abs=1e-7)
    weight = np.cross(found.vertices, found.problem.loads).sum(axis=0)
    whole = moment_0 + moment_1 + np.cross(found.vertices[-1], force_1) + weight
    assert whole == pytest.approx(np.zeros(3), abs=1e-7)


def by_formulas(found: RodShape) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """At the inner edges: T by (4.68), N from the multipliers, and m by (4.69), central differences; those of found."""
    rod, n = found.rod, found.rod.edges
    stress = (found.strains - rod.at_rest(rod.middles)) * np.array(rod.stiffness)
    joints = found.frames(rod.vertices)
    bending = np.einsum("kij,kj->ki", joints[:, :, :2], stress[:, :2])
    t, h = found.edges[:, :, 2], rod.lengths[:, None]
    middle = 0.5 * (found.strains[1:] + found.strains[:-1])
    kb = np.einsum("kij,kj->ki", found.edges[:, :, :2], middle[:, :2])
    q = 0.5 * (stress[1:, 2] + stress[:-1, 2])
    shear = np.cross(t, np.diff(bending, axis=0) / h) + q[:, None] * kb
    whole = shear + found.found.rows[:n, None] * t
    between = 0.5 * (bending[1:] + bending[:-1])
    turning = np.diff(stress[:, 2]) / h[:, 0] - np.einsum("ij,ij->i", kb, np.cross(t, between))
    inner = slice(2, -2)
    return whole[inner], found.forces[inner], turning[inner]


def test_formulas_of_forces_and_of_the_twisting_moment():
    """(4.68) with the tension and (4.69) = 0 against what the vertices transmit: order 2."""
    misses = []
    for n in (80, 160):
        formula, transmitted, turning = by_formulas(wrung(n))
        misses.append((np.abs(formula - transmitted).max(), np.abs(turning).max()))
    assert misses[-1][0] < 0.01 * np.abs(transmitted).max()
    for column in zip(*misses, strict=True):
        assert orders(list(column)) == pytest.approx(2.0, abs=0.2)


def test_tension_is_the_multiplier():
    """A straight rod pulled at its end."""
    rod = Rod(even(10), (1.0, 2.0, 0.5), start=RodEnd(np.zeros(3), EYE), force=np.array([0.0, 0.0, 3.0]))
    assert solved(rod).found.rows == pytest.approx(np.full(10, 3.0), abs=1e-8)


def test_holonomy_of_a_loop():
    """A frame carried along a loop of tangents at the angle b comes back turned by the solid angle 2 pi (1 - cos b)."""
    slope = 0.7  # the tangent's polar angle
    misses = []
    for n in (40, 80, 160):
        turn = 2.0 * math.pi * (np.arange(n) + 0.5) / n
        around = math.sin(slope) * np.array([np.cos(turn), np.sin(turn)])
        t = np.column_stack([*around, np.full(n, math.cos(slope))])
        first = np.array([math.sin(slope), 0.0, math.cos(slope)])
        frame = np.column_stack([np.cross([0.0, 1.0, 0.0], first), [0.0, 1.0, 0.0], first])
        rod = Rod(even(n), (1.0, 1.0, 1.0), start=RodEnd(np.zeros(3), frame), end=RodEnd(None, frame))
        points = np.concatenate([np.zeros((1, 3)), np.cumsum(t / n, axis=0)])
        problem, y = from_frames(rod, points, _carried(frame, t))
        assert problem.angles(y) == pytest.approx(np.zeros(n), abs=1e-12)
        # theta is 0 all along: what the frame misses the clamp's by is the twist of the last cell
        defect = problem.evaluated(y).strain[-1, 2]
        misses.append(abs(math.remainder(abs(defect) - 2.0 * math.pi * (1.0 - math.cos(slope)), 2.0 * math.pi)))
    assert misses[-1] < 1e-3
    assert orders(misses) == pytest.approx(2.0, abs=0.1)


def _carried(frame: np.ndarray, tangents: np.ndarray) -> np.ndarray:
    found = []
    for t in tangents:
        frame = transported(frame, t)
        found.append(frame)
    return np.array(found)


def test_theta_over_the_bishop_frame():
    """p plus the reference twists is the angle over the frame that is carried from the clamp along the rod."""
    found = wrung(30)
    problem, y = found.problem, found.found.y
    theta = problem.bishop(y)
    carried = _carried(found.rod.start.frame, problem.tangents(y))
    d1 = np.cos(theta)[:, None] * carried[:, :, 0] + np.sin(theta)[:, None] * carried[:, :, 1]
    assert d1 == pytest.approx(problem.frames(y)[:, :, 0], abs=1e-9)


@pytest.mark.parametrize("start", ["pinned", "free"])
def test_held_at_its_end_alone(start):
    """What holds s = 0 and s = 1 changes places: the same rod from behind."""
    force = np.array([0.0, 2.0, 0.0])
    n = 24
    whole = Rod(even(n), (1.0, 2.0, 0.5), ((0.5, 0.5), (0.0, 0.0), (0.0, 0.0)), weight=force)
    flipped = np.diag([1.0, -1.0, -1.0])
    before = replace(whole, start=RodEnd(np.zeros(3), EYE))
    one = solved(before)
    # s -> 1 - s: d3 -> -d3, d2 -> -d2, kappa_1 -> -kappa_1
    behind = replace(whole, rest=((-0.5, -0.5), (0.0, 0.0), (0.0, 0.0)), end=RodEnd(np.zeros(3), EYE @ flipped))
    if start == "pinned":
        place = one.vertices[-1]
        behind = replace(behind, start=RodEnd(place, None))
    frames = (one.edges @ flipped)[::-1]
    other = RodShape(solve(*from_frames(behind, one.vertices[::-1].copy(), frames)))
    assert other.found.ok
    assert other.vertices[::-1] == pytest.approx(one.vertices, abs=1e-8)
    assert other.parts.sum() == pytest.approx(one.parts.sum(), rel=1e-9)
