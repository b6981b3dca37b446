"""What another theory does to an equilibrium, to first order, without solving it (docs/theory.md, eq. (11.5), (11.6)).

A theory B beside the state's own A is what it changes of the optimality system at the state's own unknowns::

    dF = (grad E_B + A_B^T lambda) - (grad E_A + A_A^T lambda),   dc = c_B - c_A

and the state goes by ``K d = -(dF, dc)``, K its own factored tangent (`ribbon.sensitivity.system`). Three kinds:

- `towards`: another problem on the same unknowns (another energy with the same fields, weight, rest curvature, load);
- `of_energy`: an energy of other fields, its density taken on the state's own: a ribbon with rulings has the twist
  ``eta omega``, and a strip with a free twist the ruling ``twist / omega``;
- `softer`: strains that the theory holds at zero get a compliance. At every joint the segment before it ends with the
  internal force and moment that the multipliers of its glue are; what they stretch, shear or bend is a gap of the glue.

How far first order can be trusted is asked of the point that is reached: the step that one more back-substitution
with the same tangent would add there (`Response.beyond`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ribbon import law
from ribbon.element import quaternion
from ribbon.energies import CODES, FREE_CODES
from ribbon.energies.dispatch import numbers
from ribbon.energies.free import free_numbers, natural_numbers
from ribbon.errors import NotDifferentiable
from ribbon.problems.mixed_kernels import ROWS
from ribbon.result import Equilibrium
from ribbon.sensitivity.gradients import Gradients
from ribbon.sensitivity.parameters import Load
from ribbon.sensitivity.system import Point, System, point
from ribbonbench.threads import alone

FloatArray = NDArray[np.float64]
#: What a theory changes at a point.
Theory = Callable[[Point], Load]

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)
_NODES, _WEIGHTS = 0.5 * (_NODES + 1.0), 0.5 * _WEIGHTS
#: Step, of unknowns of size 1, of differences that are exact but for rounding: the glue's Jacobian is linear in them.
_STEP = 1e-2


@dataclass(frozen=True)
class Response:
    """Where a theory moves a state, to first order.

    energy: of the theory over the state's own, in the state's own unknowns (D w / l); work: what its load does on the
    way, 1/2 |dF . dx| (D w / l); beyond: the step that would follow, None where the theory has no value at the point
    that the first one reaches.
    """

    first: Gradients
    name: str
    energy: float
    work: float
    beyond: Gradients | None

    def position(self, s: ArrayLike) -> FloatArray:
        """Change (k, 3) of positions, l, at abscissae s (k,)."""
        return self.first.position(s)[self.name]

    def rotation(self, s: ArrayLike) -> FloatArray:
        """Change (k, 3) of frames as a rotation vector, rad."""
        return self.first.rotation(s)[self.name]

    def support(self, end: bool) -> FloatArray:
        """Change (3,) of the force of what holds the end, or the start, D w / l^2."""
        return (self.first.end_force() if end else self.first.start_force())[self.name]


@alone
def responses(
    equilibrium: Equilibrium, theories: Mapping[str, Theory], *, unstable: bool = False
) -> dict[str, Response | NotDifferentiable]:
    """The response to every theory by its name; for one that has none, why.

    Raises `NotDifferentiable` where the state itself has no tangent (no stable equilibrium, a fold, a bifurcation).
    """
    here = point(equilibrium, unstable=unstable)
    system = System.of(here)
    system.check()
    found: dict[str, Response | NotDifferentiable] = {}
    for name, theory in theories.items():
        try:
            found[name] = _response(system, name, theory)
        except NotDifferentiable as refusal:
            found[name] = refusal
    return found


def _response(system: System, name: str, theory: Theory) -> Response:
    load = theory(system.point)
    first = _step(system, name, load)
    dx, drows = first.unknowns[:, 0], first.multipliers[:, 0]
    work = 0.5 * abs(float(load.gradient[:, 0] @ dx + load.rows[:, 0] @ drows))
    return Response(first, name, float(load.energy[0]), work, _beyond(system, name, theory, dx, drows))


def _step(system: System, name: str, load: Load) -> Gradients:
    """The solution with the state's own factor; `NotDifferentiable` for what is not finite."""
    if not all(np.all(np.isfinite(part)) for part in (load.gradient, load.rows, load.energy)):
        raise NotDifferentiable("not_finite", f"{name} has no finite tangent at this state")
    dx, drows = system.solve(load.gradient, load.rows, load.held)
    if not (np.all(np.isfinite(dx)) and np.all(np.isfinite(drows))):
        raise NotDifferentiable("not_finite", f"{name} moves this state by more than any number")
    return Gradients((name,), system.condition, dx, drows, system, (load,))


def _beyond(system: System, name: str, theory: Theory, dx: FloatArray, drows: FloatArray) -> Gradients | None:
    """The step that would follow at the point that the first one reaches."""
    here = system.point
    there = replace(here, x=here.x + dx, rows=here.rows + drows)
    problem = here.problem
    try:
        with np.errstate(all="ignore"):
            load = theory(there)
            rest = problem.gradient(there.x) + problem.jacobian_matrix(there.x).T @ there.rows
            missed = problem.constraints(there.x)
            changed = replace(load, gradient=load.gradient + rest[:, None], rows=load.rows + missed[:, None])
            return _step(system, name, changed)
    except NotDifferentiable:
        return None


# -- another problem on the same unknowns -----------------------------------------------------------------------------


def towards(**changes: Any) -> Theory:
    """The theory of the same problem with fields of it changed (`energy`, `gravity`, `tip`, `strip` ...).

    `NotDifferentiable` where that one has other rows: what held a rigid motion is gone, or another has come.
    """

    def theory(here: Point) -> Load:
        own = here.problem
        other = own.with_changes(**changes)
        if other.row_count != own.row_count or other.size != own.size:
            raise NotDifferentiable("other_rows", "it changes which rigid motions of the strip nothing resists")
        with np.errstate(all="ignore"):
            gradient = _lagrangian(other, here) - _lagrangian(own, here)
            rows = other.constraints(here.x) - own.constraints(here.x)
            energy = other.value(here.x) - own.value(here.x)
        return _load(here, energy, gradient, rows)

    return theory


def _lagrangian(problem: Any, here: Point) -> FloatArray:
    return np.asarray(problem.gradient(here.x) + problem.jacobian_matrix(here.x).T @ here.rows)


def _load(here: Point, energy: float, gradient: FloatArray, rows: FloatArray | None = None) -> Load:
    """A load with one component that holds no unknown."""
    still = np.zeros(here.rows.size) if rows is None else rows
    return Load(np.array([energy]), gradient[:, None], still[:, None], np.zeros((here.x.size, 1)), ())


# -- an energy of other fields ----------------------------------------------------------------------------------------


def of_energy(name: str, thickness: float | None) -> Theory:
    """The theory of the elastic energy `name` in place of the state's own; thickness: h / l of the strip there."""

    def theory(here: Point) -> Load:
        own = here.problem
        half_width, known, nu = (float(v) for v in own.strip.section)
        section = (half_width, known if thickness is None else thickness, nu, 0.0)
        other, by_other = _energies(name, here, section)
        mine, by_mine = _energies(own.energy, here, tuple(own.fields.section))
        return by_parameters(here, other - mine, by_other - by_mine)

    return theory


def by_parameters(here: Point, energy: float, local: FloatArray) -> Load:
    """A load from its derivatives (p, 4) by (a, b, n, m) of every segment."""
    columns, slopes = here.problem.parameter_map()
    gradient = np.zeros(here.problem.size)
    np.add.at(gradient, columns, np.einsum("pi,pik->pk", local, slopes[:, :4, :]))
    return _load(here, energy, gradient)


def _energies(name: str, here: Point, section: tuple[float, ...]) -> tuple[float, FloatArray]:
    """Elastic energy of the energy `name` on a state's own fields, and its derivatives (p, 4) by (a, b, n, m)."""
    problem = here.problem
    a, b, n, m = (v[:, None] for v in problem.parameters(here.x)[:, :4].T)
    s = problem.lengths[:, None] * _NODES
    weights = problem.lengths[:, None] * _WEIGHTS
    natural, slope = _natural(problem, s)
    first, second = a * s + b, n * s + m
    with np.errstate(all="ignore"):
        if name in CODES:
            density = _ruled(name, first, second, a, n, natural, section, problem.fields.free)
        else:
            density = _twisted(name, first, second, a, n, natural, slope, section, problem, s)
        value, by = density
        parts = [s * by[0] + by[2], by[0], s * by[1] + by[3], by[1]]
        return float((weights * value).sum()), np.stack([(weights * part).sum(axis=1) for part in parts], axis=1)


def _natural(problem: Any, s: FloatArray) -> tuple[FloatArray, FloatArray]:
    """K at the points s (p, g) of the segments and its slope there."""
    pieces = law.pieces(problem.strip.curvature, problem.lengths)
    return pieces[:, :1] + pieces[:, 1:] * s, np.broadcast_to(pieces[:, 1:], s.shape)


def _ruled(
    name: str, omega: FloatArray, second: FloatArray, a: FloatArray, n: FloatArray, natural: FloatArray,
    section: tuple[float, ...], free: bool,
) -> tuple[FloatArray, Sequence[FloatArray]]:  # fmt: skip
    """Density (p, g) of an energy with rulings, and its derivatives by both fields and by both slopes."""
    c, nu = section[0], section[2]
    slope: FloatArray = np.broadcast_to(n, omega.shape)
    eta: FloatArray = second / omega if free else second
    bend = np.broadcast_to(a, omega.shape)
    by_s = (slope - eta * bend) / omega if free else slope  # eta'
    ten = np.empty((omega.size, 10))
    flat = [np.ascontiguousarray(part).ravel() for part in (omega, eta, c * by_s)]
    numbers(CODES[name], flat[0], flat[1], flat[2], tuple(section[:3]), ten)
    ten = ten.reshape(*omega.shape, 10)
    value = ten[..., 0] - natural * omega * (1.0 + nu * eta**2)
    by_omega = ten[..., 1] - natural * (1.0 + nu * eta**2)
    by_eta = ten[..., 2] - 2.0 * nu * natural * omega * eta
    by_x = c * ten[..., 3]
    if not free:
        return np.asarray(value), [np.asarray(part) for part in (by_omega, by_eta, np.zeros(omega.shape), by_x)]
    # eta = t / k, eta' = (t' - eta k') / k
    steep_k = -by_s / omega + eta * bend / omega**2
    both = (
        by_omega - by_eta * eta / omega + by_x * steep_k,
        by_eta / omega - by_x * bend / omega**2,
        -by_x * eta / omega,
        by_x / omega,
    )
    return np.asarray(value), [np.asarray(part) for part in both]


def _twisted(
    name: str, k: FloatArray, second: FloatArray, a: FloatArray, n: FloatArray, natural: FloatArray,
    slope: FloatArray, section: tuple[float, ...], problem: Any, s: FloatArray,
) -> tuple[FloatArray, Sequence[FloatArray]]:  # fmt: skip
    """The same of an energy with a free twist."""
    free = problem.fields.free
    dk, dn = np.broadcast_to(a, k.shape), np.broadcast_to(n, k.shape)
    t = second if free else second * k
    dt = dn if free else dn * k + second * dk
    out = np.empty((k.size, 15))
    flat = [np.ascontiguousarray(part).ravel() for part in (k, t, dk, dt, natural)]
    for row in range(k.shape[0]):  # the slope of K is one number a call
        part = slice(row * k.shape[1], (row + 1) * k.shape[1])
        k_row, t_row, dk_row, dt_row, natural_row = (v[part] for v in flat)
        free_numbers(
            FREE_CODES[name], k_row, t_row, dk_row, dt_row, natural_row, float(slope[row, 0]), section, out[part]
        )
    if any(law.values(problem.strip.twist)):
        joints = np.concatenate([[0.0], np.cumsum(problem.lengths)[:-1]])[:, None] + s
        rest = law.at(problem.strip.twist, joints).ravel()
        natural_numbers(FREE_CODES[name], flat[0], flat[1], flat[4], rest, section, out)
    value, by_k, by_t, by_dk, by_dt = out[:, :5].reshape(*k.shape, 5).transpose(2, 0, 1)
    if free:
        return value, (by_k, by_t, by_dk, by_dt)
    return value, (
        by_k + by_t * second + by_dt * dn,
        by_t * k + by_dt * dk,
        by_dk + by_dt * second,
        by_dt * k,
    )


# -- strains that the theory holds at zero ----------------------------------------------------------------------------


def stretching(thickness: float, poisson: float) -> FloatArray:
    """Compliance (6,) of the middle line's strain under a tension in D w / l^2: ``h^2 / (12 (1 - nu^2))``."""
    return np.array([0.0, 0.0, thickness**2 / (12.0 * (1.0 - poisson**2)), 0.0, 0.0, 0.0])


def shear(thickness: float, poisson: float) -> FloatArray:
    """Compliance (6,) of transverse shear, through the thickness and in the plane: ``h^2 / (5 (1 - nu))`` with a
    section's share of 5/6."""
    both = thickness**2 / (5.0 * (1.0 - poisson))
    return np.array([both, both, 0.0, 0.0, 0.0, 0.0])


def in_plane(thickness: float, poisson: float, width: float) -> FloatArray:
    """Compliance (6,) of bending in the strip's plane, about its normal: ``(h / w)^2 / (1 - nu^2)`` (eq. (10.5))."""
    return np.array([0.0, 0.0, 0.0, 0.0, (thickness / width) ** 2 / (1.0 - poisson**2), 0.0])


def softer(compliance: FloatArray) -> Theory:
    """The theory in which internal force and moment strain the middle line: compliance (6,) of strains along, and of
    curvatures about, t_x, t_y, t_z, per D w / l^2 and D w / l.

    The Lagrangian gains ``-1/2 sum_j L_j C f_j^2``, f_j the internal force at joint j in its own frame, a function of
    unknowns and multipliers: its derivatives are the load.
    """

    def theory(here: Point) -> Load:
        return _softened(here, compliance)

    return theory


def _softened(here: Point, compliance: FloatArray) -> Load:
    problem, x = here.problem, here.x
    p = problem.lengths.size
    inner = internal(here)
    frames = quaternion.matrix(problem.layout.quaternions(x))
    share = 0.5 * (np.append(problem.lengths, 0.0) + np.append(0.0, problem.lengths))[:, None]
    local = np.hstack([np.einsum("jik,ji->jk", frames, part) for part in (inner.force, inner.moment)])
    strain = share * compliance * local
    gap, turn = (np.einsum("jik,jk->ji", frames, part) for part in (strain[:, :3], strain[:, 3:]))
    q = problem.layout.quaternions(x)
    spin = 0.5 * np.array([quaternion.compose(np.append(0.0, one), own) for one, own in zip(turn, q, strict=True)])
    moved = np.zeros((p + 1, x.size))
    at = np.arange(p + 1)[:, None]
    moved[at, problem.layout.columns(0, 1, 2)] = gap
    moved[at, problem.layout.columns(3, 4, 5, 6)] = spin
    rows, gradient = np.zeros(here.rows.size), np.zeros(x.size)
    segment = np.repeat(np.arange(p), ROWS)
    glue = problem.jacobian_matrix(x)[: ROWS * p]
    for parity in (0, 1):
        joints = np.arange(2 - parity, p + 1, 2)  # each the end of a segment, none the start of one of those
        ends = np.isin(segment, joints - 1)
        shift = moved[joints].sum(axis=0)
        rows[: ROWS * p][ends] -= (glue @ shift)[ends]
        gradient -= _along(here, shift, np.where(ends, here.rows[: ROWS * p], 0.0))
    start = moved[0]
    ends = segment == 0
    rows[: ROWS * p][ends] += (glue @ start)[ends]
    gradient += _along(here, start, np.where(ends, here.rows[: ROWS * p], 0.0))
    torque = np.cross(inner.force, gap) + np.cross(inner.moment, turn)
    for joint in range(p + 1):
        own = 2.0 * quaternion.compose(np.append(0.0, torque[joint]), q[joint])
        own = own + 0.5 * quaternion.compose(np.append(0.0, turn[joint]), inner.by_quaternion[joint])
        gradient[problem.layout.joint(joint).quaternion] += own
    return _load(here, -0.5 * float((strain * local).sum()), gradient, rows)


@dataclass(frozen=True)
class Internal:
    """Internal force (p + 1, 3) in D w / l^2 and moment (p + 1, 3) in D w / l at the joints, in the fixed frame, and
    the derivative (p + 1, 4) by the joint's quaternion that the moment comes from."""

    force: FloatArray
    moment: FloatArray
    by_quaternion: FloatArray


def internal(here: Point) -> Internal:
    """What the segment before a joint exerts there through its glue; at s = 0 what holds the start, from the balance of
    the first joint."""
    problem, x = here.problem, here.x
    p = problem.lengths.size
    glue = problem.jacobian_matrix(x)[: ROWS * p]
    segment = np.repeat(np.arange(p), ROWS)
    places = problem.layout.columns(*range(7))
    loads = problem.gradient(x)
    found = np.empty((p + 1, 7))
    for parity in (0, 1):
        pull = glue.T @ np.where(segment % 2 == parity, here.rows[: ROWS * p], 0.0)
        joints = np.arange(1 + parity, p + 1, 2)
        found[joints] = pull[places[joints]]
        if parity == 0:
            found[0] = -(loads + pull)[places[0]]
    found[1:, 3:] += loads[places[1:, 3:]]  # a segment's weight turns with the frame of its end
    q = problem.layout.quaternions(x)
    moment = np.empty((p + 1, 3))
    for k, unit in enumerate(np.eye(4)[1:]):
        moment[:, k] = [0.5 * by @ quaternion.compose(unit, own) for by, own in zip(found[:, 3:], q, strict=True)]
    return Internal(found[:, :3], moment, found[:, 3:])


def _along(here: Point, shift: FloatArray, rows: FloatArray) -> FloatArray:
    """Derivative (n,) along `shift` (n,) of ``glue^T rows`` and the energy's gradient."""
    size = float(np.abs(shift).max())
    if size == 0.0:
        return np.zeros(shift.size)
    problem = here.problem
    step = _STEP / size
    change = np.zeros(shift.size)
    for sign in (1.0, -1.0):
        there = here.x + sign * step * shift
        value = problem.jacobian_matrix(there)[: rows.size].T @ rows + problem.gradient(there)
        change += sign * value / (2.0 * step)
    return change
