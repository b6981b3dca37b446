"""From the natural shape to the full loads: load steps that adapt, and a descent in energy where the path ends.

Below a limit point the steps follow one branch of equilibria, each solved by Newton with the exact tangent. At a limit
point, where a real strip snaps, the state is relaxed at a slightly higher load by a descent in energy (Newton with the
tangent shifted until it is positive definite, and a line search; J. Nocedal and S. Wright, Numerical Optimization,
2nd ed., Springer 2006, section 3.4), and the stepping goes on from there. Snaps are counted, never hidden.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ribbonbench import clock
from shellref.elastica.fem import Array, Discretisation, Loads, stability
from shellref.elastica.system import solve_sparse

QUICK = 6
"""Newton iterations of a step that count as quick: the next load step is longer."""

MOST_TURN = 1.5
"""Radians that a section may turn in one load step: a bigger turn is taken for a jump to another branch."""

DESCENT_TURN = 0.5
"""Radians that a section may turn in one iteration of a descent, so that it does not leave its valley."""

DESCENT_SHIFT = 0.1
"""Lowest eigenvalue that the shifted tangent of a descent has at least, in D w / l; the unloaded strip has pi^2/4."""


@dataclass(frozen=True)
class ElasticaOptions:
    """Numbers of the solution procedure; the defaults serve Gamma from 0 to 1e6.

    tolerance : of the out-of-balance moment (its L2 norm), relative to max(1, |K|, sqrt(load)).
    first_load : load of the first step from the natural shape, in D w / l^2.
    growth : factor on the load step after a quick step; cut : after a failed one.
    smallest : load step, relative to the load reached, below which the path is taken to end in a limit point.
    iterations : most Newton iterations of one step; descent : most iterations of one descent.
    snaps : most descents; 0 stops at the first limit point.
    arc_length : "auto" (load steps and descents for a clamped-free strip, arc length for one whose end is held),
        "always", or "never": load steps that stop at the first limit point and say so.
    arc_steps : most steps by arc length. switch : at a bifurcation behind which the path is unstable, go over to a
        branch that arrives stable. bow : natural curvature (1/l) with which the way of a straight strip begins, when
        both its ends are held; None: one that suits the angles, or 2. Its sign chooses the side, at bifurcations too.
    """

    tolerance: float = 1e-11
    first_load: float = 4.0
    growth: float = 2.0
    cut: float = 0.25
    smallest: float = 1e-4
    iterations: int = 15
    descent: int = 500
    snaps: int = 20
    arc_length: str = "auto"
    arc_steps: int = 200
    switch: bool = True
    bow: float | None = None

    def __post_init__(self) -> None:
        for name in ("tolerance", "first_load", "smallest", "iterations"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ValueError(f"{name} = {getattr(self, name)}: must be greater than zero")
        if self.arc_length not in ("auto", "always", "never"):
            raise ValueError(f'arc_length = {self.arc_length!r}: must be "auto", "always" or "never"')
        if self.bow is not None and not 0.1 <= abs(self.bow) <= 6.0:
            raise ValueError(f"bow = {self.bow}: its size must lie between 0.1 and 6")
        if not (self.growth > 1.0 and 0.0 < self.cut < 1.0):
            raise ValueError(f"growth = {self.growth}, cut = {self.cut}: growth must exceed 1, cut lie between 0 and 1")


@dataclass
class Path:
    """Where the stepping stands: coefficients (N,), residual norm, lowest eigenvalue and the bound of its rounding,
    share of the loads, counts."""

    coefficients: Array
    residual: float
    eigenvalue: float
    rounding: float
    reached: float = 0.0
    steps: int = 0
    iterations: int = 0
    snaps: int = 0

    @property
    def stable(self) -> bool | None:
        """None at a fold or a bifurcation: the lowest eigenvalue is zero to rounding."""
        return stability(self.eigenvalue, self.rounding)


def follow(
    discrete: Discretisation,
    loads_at: Callable[[float], Loads],
    load: float,
    tolerance: float,
    options: ElasticaOptions,
) -> Path:
    """Raise the share of the loads from 0 (natural shape) to 1; `load`: largest |p(s)| at 1, `tolerance`: absolute."""
    natural = discrete.natural_shape(loads_at(0.0))
    path = Path(
        natural,
        discrete.moment_norm(discrete.residual(natural, loads_at(0.0))),
        discrete.lowest_eigenvalue(natural, loads_at(0.0)),
        discrete.rounding(natural, loads_at(0.0)),
    )
    first = step = min(1.0, options.first_load / max(load, options.first_load))
    guarded = True  # refuse steps from a stable to an unstable equilibrium; one at a fold is neither, and is taken
    while path.reached < 1.0 and not clock.spent():
        target = min(1.0, path.reached + step)
        loads = loads_at(target)
        trial, norm, used = newton(discrete, loads, path.coefficients, tolerance, options)
        path.iterations += used
        if trial is not None:
            eigenvalue, rounding = discrete.lowest_eigenvalue(trial, loads), discrete.rounding(trial, loads)
            if not guarded or stability(eigenvalue, rounding) is not False:
                path.coefficients, path.residual = trial, norm
                path.eigenvalue, path.rounding = eigenvalue, rounding
                path.reached, path.steps = target, path.steps + 1
                step *= options.growth if used <= QUICK else 1.0
                continue
        step *= options.cut
        if step > options.smallest * max(path.reached, first):
            continue
        if path.snaps >= options.snaps or options.arc_length == "never":
            break
        step = first
        guarded = _snap(discrete, loads_at, tolerance, options, path)
        if not guarded and path.stable is not False:
            break
    return path


def newton(
    discrete: Discretisation, loads: Loads, start: Array, tolerance: float, options: ElasticaOptions
) -> tuple[Array | None, float, int]:
    """Newton from `start` (N,): coefficients (None: it fails or turns the strip too far), residual norm, iterations."""
    coefficients = start.copy()
    norm = math.inf
    for iteration in range(options.iterations + 1):
        residual = discrete.residual(coefficients, loads)
        norm = discrete.moment_norm(residual)
        turned = discrete.turned(coefficients - start)
        if not math.isfinite(norm) or turned > MOST_TURN:
            return None, norm, iteration
        if norm <= tolerance:
            return coefficients, norm, iteration
        if iteration < options.iterations:
            step = solve_sparse(discrete.tangent(coefficients, loads), residual)
            if step is None:
                return None, norm, iteration
            coefficients[discrete.free] -= step
    return None, norm, options.iterations


def _snap(
    discrete: Discretisation,
    loads_at: Callable[[float], Loads],
    tolerance: float,
    options: ElasticaOptions,
    path: Path,
) -> bool:
    """Relax `path` at a slightly higher load. True: it rests, and on no saddle; False: it did not, or rests on one.

    On a symmetric saddle (a straight strip above its buckling load) there is no slope to descend: the path is left
    there, unstable, and its eigenvalue says so.
    """
    target = min(1.0, path.reached + 10.0 * options.smallest * max(path.reached, options.smallest))
    relaxed, norm, used = descend(discrete, loads_at(target), path.coefficients, tolerance, options)
    path.iterations += used
    path.snaps += 1
    if relaxed is None:
        return False
    path.coefficients, path.residual, path.reached = relaxed, norm, target
    path.eigenvalue = discrete.lowest_eigenvalue(relaxed, loads_at(target))
    path.rounding = discrete.rounding(relaxed, loads_at(target))
    return path.stable is not False


def descend(
    discrete: Discretisation, loads: Loads, start: Array, tolerance: float, options: ElasticaOptions
) -> tuple[Array | None, float, int]:
    """A minimum of the energy downhill of `start` (N,): coefficients (None: not reached), residual norm, iterations."""
    coefficients = start.copy()
    energy = sum(discrete.energies(coefficients, loads))
    norm = math.inf
    for iteration in range(options.descent):
        residual = discrete.residual(coefficients, loads)
        norm = discrete.moment_norm(residual)
        if norm <= tolerance:
            return coefficients, norm, iteration
        tangent = discrete.tangent(coefficients, loads)
        shift = DESCENT_SHIFT - discrete.lowest_eigenvalue(coefficients, loads)
        if shift > 0.0:
            tangent = (tangent + shift * discrete.mass).tocsc()
        direction = solve_sparse(tangent, -residual)
        if direction is None:
            return None, norm, iteration
        slope = float(residual @ direction)
        size = min(1.0, DESCENT_TURN / float(np.max(np.abs(direction))))
        for _ in range(40):
            trial = coefficients.copy()
            trial[discrete.free] += size * direction
            trial_energy = sum(discrete.energies(trial, loads))
            if trial_energy <= energy + 1e-4 * size * slope + 1e-14 * abs(energy):
                break
            size *= 0.5
        else:
            return None, norm, iteration
        coefficients, energy = trial, trial_energy
    return None, norm, options.descent
