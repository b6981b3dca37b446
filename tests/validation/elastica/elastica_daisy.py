r"""The lab sheet's flower stem: an upright, weightless, slightly curved stem with a mass M at its tip (TP 2.2).

Length 10 cm, radius 2 mm, E = 10 MPa, natural curvature kappa_0 per metre, theta(0) = pi/2, g = 9.81 m/s^2. Without
dimensions K = kappa_0 L and lambda = M g L^2 / (E I). The sheet bends the stem with I = pi r^4 / 2, the polar moment;
then M_c = E I pi^2 / (4 g L^2) is 6.32 g. With the bending value pi r^4 / 4 it is 3.16 g, and the sheet's 5 g is above
critical too. `lab_stem` takes either and must be told which.

For kappa_0 = 0 the diagram of mass against deflection is a pitchfork. For kappa_0 != 0 it comes apart: a stable branch
from M = 0 to the side of the natural curvature, and another on the other side, stable beyond a limit point and unstable
before it. Near M_c, from the two lowest orders of the energy in the amplitude of sin(pi s / 2), that limit point has

    lambda - lambda_c = (3/2) (lambda_c K^2)^(1/3) ,   lambda_c = pi^2 / 4
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from shellref.elastica.arc import ArcOptions, Branch, Point, point_at, states_at
from shellref.elastica.branches import diagram, equilibria
from shellref.elastica.buckling import buckling_modes
from shellref.elastica.fem import stability
from shellref.elastica.problem import Array, LoadPath
from shellref.elastica.rod import Rod, circular, circular_polar
from shellref.elastica.system import System

LAB_CURVATURES = (-1.0, -0.01, -0.0001, 0.0)
"""The sheet's natural curvatures, 1/m."""

LAB_MASSES = np.round(np.arange(0, 101) * 1e-4, 10)
"""The sheet's masses, 0 to 10 g in steps of 0.1 g, in kg: shape (101,)."""


@dataclass(frozen=True)
class StemState:
    """An equilibrium of the stem: mass [kg], tip (2,) [m], deflection [m], theta at s = linspace(0, L, 101), stability.

    deflection : transverse displacement x of largest size along the stem, with its sign. rounding : bound of what the
    lowest eigenvalue is known to.
    """

    mass: float
    tip: tuple[float, float]
    deflection: float
    theta: Array
    lowest_eigenvalue: float
    rounding: float

    @property
    def stable(self) -> bool | None:
        """None at a limit point or a bifurcation: the lowest eigenvalue is zero to rounding."""
        return stability(self.lowest_eigenvalue, self.rounding)


@dataclass(frozen=True)
class StemCurve:
    """One branch of mass against deflection: the states in order along the branch, and its events.

    name : "from rest" (reached from M = 0), "right" or "left" (x > 0, x < 0) for branches that bifurcate, and "apart"
    for one not connected with the first. states : at the masses asked; drawn : these and the branch's own points, limit
    points among them, for curves without gaps. limits, bifurcations : masses [kg] of its limit points and bifurcations.
    """

    name: str
    states: tuple[StemState, ...]
    drawn: tuple[StemState, ...]
    limits: tuple[float, ...]
    bifurcations: tuple[float, ...]

    def at(self, mass: float) -> list[StemState]:
        """The states of this mass (kg), as many as the branch has."""
        return [state for state in self.states if abs(state.mass - mass) <= 1e-9]


def lab_stem(curvature: float, second_moment: str) -> Rod:
    """The sheet's stem; curvature kappa_0 in 1/m; second_moment: "polar" (as the sheet) or "bending"."""
    moments = {"polar": circular_polar, "bending": circular}
    if second_moment not in moments:
        raise ValueError(f'second_moment = {second_moment!r}: must be "polar" (as on the sheet) or "bending"')
    return Rod(length=0.1, young=10e6, second_moment=moments[second_moment](2e-3), curvature=curvature)


def stem_system(rod: Rod, mass: float, elements: int = 20, degree: int = 3) -> System:
    """The stem along the way from no mass (t = 0) to this one (kg; t = 1)."""
    if not 0.0 < mass < math.inf:
        raise ValueError(f"mass = {mass}: must be greater than zero")
    return System(np.linspace(0.0, 1.0, elements + 1), degree, LoadPath(rod.problem(0.0), rod.problem(mass)))


def from_rest(system: System) -> Array:
    """z (N,) of the natural shape theta = pi/2 + kappa_0 s."""
    return system.discrete.natural_shape(system.way.at(0.0))


def sheet_newton(rod: Rod, mass: float, tolerance: float = 1e-10, elements: int = 20) -> tuple[StemState | None, int]:
    """What the sheet's plain Newton finds for this mass (kg) from theta = pi/2 + kappa_0 s, and its iterations."""
    system = stem_system(rod, mass, elements)
    solved = system.newton(from_rest(system), 1.0, tolerance, iterations=50)
    point = None if solved.z is None else point_at(system, solved.z, 1.0)
    return None if point is None else _state(system, rod, mass, point), solved.iterations


def stem_equilibria(rod: Rod, mass: float) -> list[StemState]:
    """The equilibria of this mass (kg) that deflation finds, stable ones first."""
    system = stem_system(rod, mass)
    rest = from_rest(system)
    guesses = [rest, *(_leaning(system, rest, side) for side in (1.0, -1.0))]
    found = equilibria(system, 1.0, guesses)
    return [_state(system, rod, mass, point) for point in found]


def mass_deflection(
    rod: Rod, masses: Sequence[float] | Array = LAB_MASSES, options: ArcOptions | None = None
) -> list[StemCurve]:
    """Every branch of mass against deflection from no mass to the largest, with states at these masses (kg)."""
    masses = np.asarray(masses, dtype=float)
    if masses.ndim != 1 or len(masses) < 1 or not np.all(np.isfinite(masses)) or masses.min() < 0.0:
        raise ValueError("masses: must be a list of numbers, none negative")
    most = float(masses.max())
    system = stem_system(rod, most)
    options = options or ArcOptions(most=0.2)
    rest = from_rest(system)
    start = point_at(system, rest, 0.0, options)
    assert start is not None  # the natural shape is an equilibrium
    guesses = [_leaning(system, rest, side) for side in (1.0, -1.0)]
    curves = []
    for index, branch in enumerate(diagram(system, start, (0.0, 1.0), guesses, options)):
        states, drawn = _along(system, rod, most, branch, masses / most, options)
        name = "from rest" if index == 0 else "apart"
        if index > 0 and branch.ended == "reached" and branch.points[0].t < 1.0:  # it began at a bifurcation
            name = "right" if system.discrete.reach(branch.points[-1].z)[0] > 0.0 else "left"
        curves.append(
            StemCurve(
                name,
                tuple(states),
                tuple(drawn),
                tuple(most * event.point.t for event in branch.limits()),
                tuple(most * event.point.t for event in branch.bifurcations()),
            )
        )
    return curves


def critical_masses(rod: Rod) -> dict[str, float]:
    """The straight stem's critical mass (kg) three ways: Euler's formula, linear buckling, the path's bifurcation."""
    straight = replace(rod, curvature=0.0)
    unit = straight.tip_load(1.0)
    system = stem_system(straight, 1.5 * straight.critical_mass)
    start = point_at(system, from_rest(system), 0.0)
    assert start is not None
    branch = diagram(system, start, (0.0, 1.0))[0]
    return {
        "euler": straight.critical_mass,
        "eigenvalue": float(buckling_modes(20, 3, 1).loads[0]) / unit,
        "path": 1.5 * straight.critical_mass * branch.bifurcations()[0].point.t,
    }


def _leaning(system: System, rest: Array, side: float) -> Array:
    """A guess that leans far to one side: theta = pi/2 - side 1.5 sin(pi s / 2)."""
    lean = system.discrete.projected(math.pi / 2 - side * 1.5 * np.sin(0.5 * math.pi * system.discrete.s))
    guess = rest.copy()
    guess[system.discrete.free] = lean[system.discrete.free]
    return guess


def _along(
    system: System, rod: Rod, most: float, branch: Branch, shares: Array, options: ArcOptions
) -> tuple[list[StemState], list[StemState]]:
    """States at these shares of the largest mass (k,) in the order in which the branch passes them; these and all its
    own points, limit points among them."""
    first = branch.points[0]
    start = _state(system, rod, most * first.t, first)
    wanted = [start] if np.any(shares == first.t) else []
    drawn = [start]
    for a, b in zip(branch.points[:-1], branch.points[1:], strict=True):
        pair = replace(branch, points=(a, b))
        passed = [t for t in shares if min(a.t, b.t) < t < max(a.t, b.t) or (t == b.t and t != a.t)]
        for t in sorted(passed, reverse=b.t < a.t):
            found = [_state(system, rod, most * t, p) for p in states_at(system, pair, np.array([t]), options)[0]]
            wanted += found
            drawn += found
        if b.t not in passed:
            drawn.append(_state(system, rod, most * b.t, b))
    return wanted, drawn


def _state(system: System, rod: Rod, mass: float, point: Point) -> StemState:
    s = np.linspace(0.0, 1.0, 101)
    theta = point.z[: system.count]
    place = rod.length * system.discrete.position(theta, s)
    across = place[:, 0]
    return StemState(
        float(mass),
        (float(place[-1, 0]), float(place[-1, 1])),
        float(across[np.argmax(np.abs(across))]),
        system.discrete.angle(theta, s),
        float(point.eigenvalues[0]),
        point.rounding,
    )
