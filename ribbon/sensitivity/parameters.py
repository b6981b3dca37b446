"""Derivatives of energy, gradient and rows of a glued ribbon by its parameters, at fixed unknowns.

All in the kernels' own terms, none by a difference of equilibria. Closed form: natural curvature and Poisson's ratio
in the natural term (linear), places and turns of clamps, places of walls, the width in ``x = w eta' / 2`` and on a
ruling's bound. Differences that are exact to rounding because what is differenced is a polynomial: weight by Gamma
(linear), the width in the weight of the surface and in walls (quadratic). An energy that asks its cross-section for
more than x (`ribbon.Strip.section`) has central differences of sixth order of its density by that number, 1e-12 of it
for a smooth density; Sadowsky's and Wunderlich's ask for nothing and get none. Formulas: docs/theory.md, eq. (11.3).
Where the twist is free width, thickness, Poisson's ratio and natural curvature are all such numbers.

What is held: everything else that was given. Of a strip of a material (`ribbon.Strip.from_material`) these are Y, rho
and g, and the weight moves with h, nu, Y and rho::

    Gamma = 12 (1 - nu^2) rho g l^3 / (Y h^2)

(eq. (2.1)); of any other strip it is Gamma. Forces and springs are given in D w, and held so.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ribbon import law
from ribbon.element import quaternion
from ribbon.element.element import GAUSS_POINTS, GAUSS_WEIGHTS
from ribbon.energies import CODES
from ribbon.energies.dispatch import numbers
from ribbon.errors import NotDifferentiable, RibbonInputError
from ribbon.problems.conditions import imaginary_part
from ribbon.sensitivity.system import Point, System

FloatArray = NDArray[np.float64]

#: Names of parameters, each with the shape of a value ("s": one number for every joint) and its meaning.
NAMES = {
    "natural_curvature": "(2,) K at s = 0 and at s = l, in 1/length",
    "natural_curvature(s)": "(p + 1,) K at the joints, linear between them, in 1/length",
    "gamma": "() rho h g l^3 / D",
    "tip": "(3,) dead force at s = l, in D w / l^2",
    "width": "() w, in the strip's unit of length",
    "thickness": "() h, the same; of a strip of a material Gamma moves, otherwise only energies that ask for h feel it",
    "poisson": "() nu; of a strip of a material Gamma moves",
    "young": "() Y of a strip of a material, in Pa",
    "density": "() rho of a strip of a material, in kg/m^3",
    "start.position": "(3,) in the strip's unit of length",
    "start.rotation": "(3,) small rotation vector about the fixed axes, rad",
    "end.position": "(3,) as at the start",
    "end.rotation": "(3,) as at the start",
    "wall.K.offset": "() wall number K moved along its normal, in the strip's unit of length",
}
#: Share of a cross-section's number by which it is differenced, and the weights of sixth order at 1, 2, 3 steps.
_STEP = 1e-2
_SIXTH = (45.0 / 60.0, -9.0 / 60.0, 1.0 / 60.0)


@dataclass(frozen=True)
class Load:
    """What a parameter with k components does at fixed unknowns.

    energy (k,), gradient (n, k) of F = grad E + A^T lambda, rows (m, k) of c; held (n, k): how held unknowns move;
    turning (4, k): of the derivative of the end frame's rows by the last quaternion, times their multipliers; shape: of
    the parameter.
    """

    energy: FloatArray
    gradient: FloatArray
    rows: FloatArray
    held: FloatArray
    shape: tuple[int, ...]
    turning: FloatArray = field(default_factory=lambda: np.zeros((4, 1)))

    def scaled(self, factor: float) -> Load:
        """The same by a parameter in a unit that is `1 / factor` as large."""
        return Load(
            factor * self.energy, factor * self.gradient, factor * self.rows, factor * self.held, self.shape,
            factor * self.turning,
        )  # fmt: skip

    def plus(self, other: Load) -> Load:
        """Both at once, by the same parameter."""
        return Load(
            self.energy + other.energy, self.gradient + other.gradient, self.rows + other.rows, self.held + other.held,
            self.shape, self.turning + other.turning,
        )  # fmt: skip


def load(system: System, name: str) -> Load:
    """The load of a parameter by its name (`NAMES`); `RibbonInputError` for one that is not there."""
    if name.startswith("wall.") and name.endswith(".offset"):
        return _wall(system, name)
    if name not in _LOADS:
        raise RibbonInputError("wrt", name, f"use {', '.join(NAMES)}")
    return _LOADS[name](system)


def natural_at(system: System, s: FloatArray) -> Load:
    """The load of a unit of K l concentrated at every abscissa s (k,): derivatives by it are densities dq / dK(s)."""
    here = system.point
    _only_with_rulings(here, "natural_curvature(s)")
    q = here.problem.parameters(here.x)
    joints = np.concatenate([[0.0], np.cumsum(here.problem.lengths)])
    segment = np.clip(np.searchsorted(joints, s, side="right") - 1, 0, len(joints) - 2)
    local = np.zeros((len(q), 4, s.size))
    energy = np.zeros(s.size)
    for k, i in enumerate(segment):
        energy[k], local[i, :, k] = _natural(q[i], s[k] - joints[i], here.problem.strip.poisson)
    return _elastic(here, energy, local, (s.size,))


# -- elastic terms ----------------------------------------------------------------------------------------------------


def _natural(q: FloatArray, s: float, poisson: float) -> tuple[float, FloatArray]:
    """``-omega (1 + nu eta^2)`` at s of a segment (a, b, n, m), and its derivatives (4,): the natural term per K."""
    omega, eta = q[0] * s + q[1], q[2] * s + q[3]
    by_omega, by_eta = -(1.0 + poisson * eta * eta), -2.0 * poisson * omega * eta
    return float(omega * by_omega), np.array([s * by_omega, by_omega, s * by_eta, by_eta])


def _elastic(here: Point, energy: FloatArray, local: FloatArray, shape: tuple[int, ...]) -> Load:
    """From derivatives (p, 4, k) by (a, b, n, m) of every segment to those by the unknowns."""
    problem = here.problem
    columns, slopes = problem.parameter_map()
    gradient = np.zeros((problem.size, local.shape[2]))
    np.add.at(gradient, columns, np.einsum("pij,pik->pjk", slopes, local))
    return _free(here, energy, gradient, shape)


def _free(here: Point, energy: FloatArray, gradient: FloatArray, shape: tuple[int, ...]) -> Load:
    """A load that moves neither rows nor held unknowns."""
    k = gradient.shape[1]
    return Load(
        energy, gradient, np.zeros((here.rows.size, k)), np.zeros((here.x.size, k)), shape, np.zeros((4, k))
    )  # fmt: skip


def _natural_at_joints(system: System) -> Load:
    here = system.point
    problem = here.problem
    _only_with_rulings(here, "natural_curvature(s)")
    q, nu = problem.parameters(here.x), problem.strip.poisson
    p = len(q)
    energy, local = np.zeros(p + 1), np.zeros((p, 4, p + 1))
    for i, length in enumerate(problem.lengths):
        for t, weight in zip(GAUSS_POINTS, GAUSS_WEIGHTS * length, strict=True):
            value, by = _natural(q[i], t * length, nu)
            for joint, share in ((i, 1.0 - t), (i + 1, t)):
                energy[joint] += weight * share * value
                local[i, :, joint] += weight * share * by
    return _elastic(here, energy, local, (p + 1,)).scaled(problem.strip.length)


def _natural_curvature(system: System) -> Load:
    _no_table(system.point)
    if system.point.problem.fields.free:
        return _natural_by_strip(system.point)
    joints = _natural_at_joints(system)
    s = np.concatenate([[0.0], np.cumsum(system.point.problem.lengths)])
    ends = np.column_stack([1.0 - s, s])
    return _free(system.point, joints.energy @ ends, joints.gradient @ ends, (2,))


def _natural_by_strip(here: Point) -> Load:
    strip = here.problem.strip
    _no_table(here)
    first, last = (value / strip.length for value in law.values(strip.curvature))
    size = max(abs(first), abs(last), 1.0 / strip.length)
    start = _by_strip(here, size, lambda change: {"natural_curvature": (first + change, last)})
    end = _by_strip(here, size, lambda change: {"natural_curvature": (first, last + change)})
    both = [np.concatenate(pair, axis=-1) for pair in ((start.energy, end.energy), (start.gradient, end.gradient))]
    return _free(here, both[0], both[1], (2,))


def _at_points(here: Point) -> tuple[FloatArray, ...]:
    """s on the segment, omega, eta (p, 4) at the Gauss points, their weights (p, 4) and x (p, 4)."""
    problem = here.problem
    a, b, n, m = (v[:, None] for v in problem.parameters(here.x).T)
    s = problem.lengths[:, None] * GAUSS_POINTS
    x = np.broadcast_to(problem.half_width * n, s.shape)
    return s, a * s + b, n * s + m, problem.lengths[:, None] * GAUSS_WEIGHTS, np.ascontiguousarray(x)


def _numbers(here: Point, omega: FloatArray, eta: FloatArray, x: FloatArray, section: Any) -> FloatArray:
    """The density's ten numbers (p, 4, 10)."""
    out = np.empty((omega.size, 10))
    code = CODES[here.problem.energy]
    half_width, thickness, poisson = (float(v) for v in section)
    numbers(code, omega.ravel(), eta.ravel(), x.ravel(), (half_width, thickness, poisson), out)
    return out.reshape(*omega.shape, 10)


def _by_section(here: Point, place: int) -> tuple[float, FloatArray]:
    """Energy and its derivatives (p, 4) by (a, b, n, m), both by the number `place` of the section, x held."""
    s, omega, eta, weights, x = _at_points(here)
    section = np.array(here.problem.strip.section)
    step = _STEP * (abs(section[place]) or 1.0)
    found = np.zeros((*s.shape, 10))
    for k, share in enumerate(_SIXTH, start=1):
        for sign in (1.0, -1.0):
            moved = section.copy()
            moved[place] += sign * k * step
            found += sign * share / step * _numbers(here, omega, eta, x, moved)
    by = here.problem.half_width * found[..., 3]
    local = [s * found[..., 1], found[..., 1], s * found[..., 2] + by, found[..., 2]]
    return float((weights * found[..., 0]).sum()), np.stack([(weights * v).sum(axis=1) for v in local], axis=1)


def _only_with_rulings(here: Point, name: str) -> None:
    if here.problem.fields.free:
        remedy = f'the energy "{here.problem.energy}" has no derivative by it; use natural_curvature (both ends)'
        raise RibbonInputError("wrt", name, remedy)


def _no_table(here: Point) -> None:
    if law.is_table(here.problem.strip.curvature):
        remedy = "has no derivative by its two ends where the strip has a table of K; use natural_curvature(s)"
        raise RibbonInputError("wrt", "natural_curvature", remedy)


def _by_strip(here: Point, size: float, changed: Callable[[float], dict[str, Any]]) -> Load:
    """By a number of the strip of about this size: `changed` gives the strip's fields for a change of the number.

    Central differences of sixth order of energy, gradient and rows at fixed unknowns.
    """
    problem = here.problem
    step = _STEP * (abs(size) or 1.0)
    parts = [np.zeros(1), np.zeros((here.x.size, 1)), np.zeros((here.rows.size, 1))]
    for k, share in enumerate(_SIXTH, start=1):
        for sign in (1.0, -1.0):
            other = problem.with_changes(strip=replace(problem.strip, **changed(sign * k * step)))
            factor = sign * share / step
            gradient = other.gradient(here.x) + other.jacobian_matrix(here.x).T @ here.rows
            parts[0] = parts[0] + factor * other.value(here.x)
            parts[1] = parts[1] + factor * gradient[:, None]
            parts[2] = parts[2] + factor * other.constraints(here.x)[:, None]
    return replace(_free(here, parts[0], parts[1], ()), rows=parts[2])


def _poisson(system: System) -> Load:
    here = system.point
    problem = here.problem
    if problem.fields.free:
        nu = float(problem.strip.poisson)
        own = _by_strip(here, min(nu, 0.5 - nu) or 0.1, lambda change: {"poisson": nu + change})
        return _with_weight(system, own, "poisson")
    energy, local = _by_section(here, 2)
    if problem.has_natural_curvature:
        s, omega, eta, weights, _ = _at_points(here)
        natural = problem.material.curvature
        k = natural[:, :1] + natural[:, 1:] * s
        by_omega, by_eta = -k * eta * eta, -2.0 * k * omega * eta
        energy += float((weights * omega * by_omega).sum())
        parts = [s * by_omega, by_omega, s * by_eta, by_eta]
        local = local + np.stack([(weights * v).sum(axis=1) for v in parts], axis=1)
    return _with_weight(system, _elastic(here, np.array([energy]), local[:, :, None], ()), "poisson")


def _thickness(system: System) -> Load:
    here = system.point
    if here.problem.strip.thickness is None:
        raise RibbonInputError("wrt", "thickness", "the strip has none; give it one")
    if here.problem.fields.free:
        h = float(here.problem.strip.thickness)
        return _with_weight(system, _by_strip(here, h, lambda change: {"thickness": h + change}), "thickness")
    energy, local = _by_section(here, 1)
    own = _elastic(here, np.array([energy]), local[:, :, None], ()).scaled(1.0 / here.problem.strip.length)
    return _with_weight(system, own, "thickness")


# -- width ------------------------------------------------------------------------------------------------------------


def _width(system: System) -> Load:
    here = system.point
    problem = here.problem
    if problem.fields.free:
        w = float(problem.strip.width)
        return _by_strip(here, w, lambda change: {"width": w + change})
    s, omega, eta, weights, x = _at_points(here)
    ten = _numbers(here, omega, eta, x, problem.strip.section)
    n = problem.parameters(here.x)[:, 2:3]
    c = problem.half_width
    e_x, by_omega, by_eta = ten[..., 3], n * ten[..., 6], n * ten[..., 8]
    parts = [s * by_omega, by_omega, s * by_eta + e_x + c * n * ten[..., 9], by_eta]
    local = np.stack([(weights * v).sum(axis=1) for v in parts], axis=1)
    energy, own = _by_section(here, 0)
    energy += float((weights * n * e_x).sum())
    found = _elastic(here, np.array([energy]), (local + own)[:, :, None], ())
    rest = _width_of_the_rest(here)
    slopes = system.on_bound
    found.held[slopes, 0] = -here.x[slopes] / c  # n = +- 1/c
    return found.plus(rest).scaled(0.5 / problem.strip.length)


def _width_of_the_rest(here: Point) -> Load:
    """Weight of the surface and walls, quadratic in c = w / (2 l): three values at c, 3/4 c, 1/2 c are exact."""
    problem = here.problem
    surface = problem.gravity is not None and problem.gravity.exact and problem.has_gravity
    if not surface and not problem.walls:
        return _free(here, np.zeros(1), np.zeros((here.x.size, 1)), ())

    if problem.obstacles:
        raise NotDifferentiable("width", "the gap of a round obstacle is no polynomial in the width")

    def values(share: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        strip = replace(problem.strip, width=share * problem.strip.width, natural_curvature=0.0)
        other = problem.with_changes(strip=strip, energy="sadowsky")
        gradient = other.gradient(here.x) + other.jacobian_matrix(here.x).T @ here.rows
        return np.array([other.value(here.x)]), gradient[:, None], other.constraints(here.x)[:, None]

    by = [
        (3.0 * full - 4.0 * less + half) / (0.5 * problem.half_width)
        for full, less, half in zip(values(1.0), values(0.75), values(0.5), strict=True)
    ]
    return replace(_free(here, by[0], by[1], ()), rows=by[2])


# -- weight -----------------------------------------------------------------------------------------------------------


def _gamma(system: System) -> Load:
    here = system.point
    problem = here.problem
    if problem.gravity is None:
        raise RibbonInputError("wrt", "gamma", "nothing weighs here; give the ribbon its Gravity")
    plain = {} if problem.fields.free else {"energy": "sadowsky"}  # whose own energy is the cheapest
    light, heavy = (
        problem.with_changes(strip=replace(problem.strip, gamma=gamma, natural_curvature=0.0), **plain)
        for gamma in (0.0, 1.0)
    )
    energy = np.array([heavy.energy_parts(here.x)[2]])
    gradient = heavy.gradient(here.x) - light.gradient(here.x)
    return _free(here, energy, gradient[:, None], ())


def _with_weight(system: System, own: Load, name: str) -> Load:
    """`own` and what the parameter does through Gamma, where a material is held (the formula above)."""
    strip = system.point.problem.strip
    if strip.material is None or not system.point.problem.has_gravity:
        return own
    slope = {
        "thickness": -2.0 / (strip.thickness or np.inf),
        "poisson": -2.0 * strip.poisson / (1.0 - strip.poisson**2),
        "young": -1.0 / strip.material.young,
        "density": 1.0 / strip.material.density,
    }[name]
    return own.plus(_gamma(system).scaled(slope * strip.gamma))


def _of_material(system: System, name: str) -> Load:
    here = system.point
    if here.problem.strip.material is None:
        raise RibbonInputError("wrt", name, "the strip has no material; make it by Strip.from_material, or use gamma")
    return _with_weight(system, _free(here, np.zeros(1), np.zeros((here.x.size, 1)), ()), name)


def _young(system: System) -> Load:
    return _of_material(system, "young")


def _density(system: System) -> Load:
    return _of_material(system, "density")


def _tip(system: System) -> Load:
    here = system.point
    last = here.problem.layout.joint(-1).position
    gradient = np.zeros((here.x.size, 3))
    gradient[last] = -np.eye(3)
    return _free(here, -here.x[last], gradient, (3,))


# -- what holds the ribbon --------------------------------------------------------------------------------------------


def _empty(here: Point, k: int) -> tuple[Load, FloatArray, FloatArray, FloatArray]:
    """A load of a (k,) parameter with its gradient, rows and held, to be filled."""
    found = _free(here, np.zeros(k), np.zeros((here.x.size, k)), (k,))
    return found, found.gradient, found.rows, found.held


def _start_position(system: System) -> Load:
    here = system.point
    problem = here.problem
    if problem.start_position is None:
        raise RibbonInputError("wrt", "start.position", "nothing is held there")
    found, _, rows, held = _empty(here, 3)
    blocks = problem.block_slices()
    if "start_position" in blocks:
        rows[blocks["start_position"]] = -np.eye(3)
    else:
        held[problem.layout.joint(0).position] = np.eye(3)
    return found.scaled(1.0 / problem.strip.length)


def _turns(q: FloatArray) -> FloatArray:
    """(4, 3): change of the quaternion q by small turns about the fixed axes, ``phi o q / 2``."""
    return 0.5 * np.column_stack([quaternion.compose(unit, q) for unit in np.eye(4)[1:]])


def _start_rotation(system: System) -> Load:
    here = system.point
    problem = here.problem
    q = problem.start_quaternion
    if q is None:
        raise RibbonInputError("wrt", "start.rotation", "no frame is held there")
    found, _, rows, held = _empty(here, 3)
    blocks = problem.block_slices()
    if "start_frame" in blocks:
        rows[blocks["start_frame"]] = -_turns(q)
    else:
        held[problem.layout.joint(0).quaternion] = _turns(q)
    return found


def _end_position(system: System) -> Load:
    here = system.point
    problem = here.problem
    if problem.end_position is None:
        raise RibbonInputError("wrt", "end.position", "nothing is held there")
    found, _, rows, _ = _empty(here, 3)
    rows[problem.block_slices()["end_position"]] = -np.eye(3)
    return found.scaled(1.0 / problem.strip.length)


def _end_rotation(system: System) -> Load:
    here = system.point
    problem = here.problem
    q = problem.end_quaternion
    if q is None:
        raise RibbonInputError("wrt", "end.rotation", "no frame is held there")
    found, gradient, rows, _ = _empty(here, 3)
    where, last = problem.block_slices()["end_frame"], problem.layout.joint(-1).quaternion
    for k, turned in enumerate(_turns(q).T):
        matrix = imaginary_part(turned)
        rows[where, k] = matrix @ here.x[last]
        found.turning[:, k] = matrix.T @ here.rows[where]
    gradient[last] = found.turning
    return found


def _wall(system: System, name: str) -> Load:
    here = system.point
    number = name.removeprefix("wall.").removesuffix(".offset")
    slices = here.problem.block_slices()
    if f"wall_{number}" not in slices:
        raise RibbonInputError("wrt", name, f"there are {len(here.problem.walls)} walls, counted from 0")
    found, _, rows, _ = _empty(here, 1)
    for block in (f"wall_{number}", f"touch_{number}"):
        if block in slices:
            rows[slices[block]] = -1.0
    return replace(found, shape=()).scaled(1.0 / here.problem.strip.length)


_LOADS: dict[str, Callable[[System], Load]] = {
    "natural_curvature": _natural_curvature,
    "natural_curvature(s)": _natural_at_joints,
    "gamma": _gamma,
    "tip": _tip,
    "width": _width,
    "thickness": _thickness,
    "poisson": _poisson,
    "young": _young,
    "density": _density,
    "start.position": _start_position,
    "start.rotation": _start_rotation,
    "end.position": _end_position,
    "end.rotation": _end_rotation,
}
