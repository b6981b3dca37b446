"""Derivatives of whatever an equilibrium tells by whatever it depends on (docs/theory.md, eq. (11.2), (11.4)).

What is told is in l and D w, what it depends on as it is given, in the strip's own unit of length (`ribbon.strip`).

>>> g = gradients(result, wrt=["gamma", "end.position"])  # doctest: +SKIP
>>> g.position(0.5)["end.position"]  # (3, 3): d r(l/2) / d position of the clamp  # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ribbon.contact import Wall
from ribbon.element import quaternion
from ribbon.element.kinematics import walk
from ribbon.errors import RibbonInputError
from ribbon.result import Equilibrium
from ribbon.sensitivity import parameters
from ribbon.sensitivity.parameters import Load
from ribbon.sensitivity.system import Point, System, point
from ribbon.strip import abscissae
from ribbonbench.threads import alone

FloatArray = NDArray[np.float64]
#: Name of a parameter -> derivative, its shape that of the output followed by that of the parameter.
Derivatives = dict[str, FloatArray]


@dataclass(frozen=True)
class Gradients:
    """First derivatives of an equilibrium by the parameters `names`; made by `gradients`.

    Every method answers with a dictionary from a parameter's name to an array, the output's axes first, then the
    parameter's (`ribbon.sensitivity.parameters.NAMES`, where their units are, and what is held). Outputs: lengths in l,
    curvatures in 1/l, energy in D w / l, forces in D w / l^2, moments in D w / l, turns as rotation vectors about the
    fixed axes in rad; abscissae in l, `RibbonInputError` for one that is not in [0, 1].

    Where rigid motions are free, positions and turns are those of the ribbon's own gauge: only what does not
    change with the motion means something.

    condition: estimated condition of the scaled tangent; unknowns (n, k) and multipliers (m, k): all of the response,
    of `ribbon.problems.mixed.MixedProblem`.
    """

    names: tuple[str, ...]
    condition: float
    unknowns: FloatArray
    multipliers: FloatArray
    _system: System
    _loads: tuple[Load, ...]

    @property
    def _point(self) -> Point:
        return self._system.point

    def _named(self, values: FloatArray) -> Derivatives:
        """`values` (..., k) split by parameter."""
        found, at = {}, 0
        for name, load in zip(self.names, self._loads, strict=True):
            count = load.energy.size
            found[name] = values[..., at : at + count].reshape((*values.shape[:-1], *load.shape))
            at += count
        return found

    def _total(self, part: str) -> FloatArray:
        return np.concatenate([getattr(load, part) for load in self._loads], axis=-1)

    # -- shape --------------------------------------------------------------------------------------------------------

    def energy(self) -> Derivatives:
        """Of the total energy, D w / l."""
        slope = self._point.problem.gradient(self._point.x)
        return self._named(self._total("energy") + slope @ self.unknowns)

    def omega(self, s: ArrayLike) -> Derivatives:
        """Of the normal curvature (k,) at abscissae s (k,), or () at one s."""
        return self._at_joints(s, self.unknowns[self._point.problem.layout.omega])

    def eta(self, s: ArrayLike) -> Derivatives:
        """Of the ruling's eta (k,) at abscissae s (k,), or () at one s."""
        return self._at_joints(s, self.unknowns[self._point.problem.layout.eta])

    def _at_joints(self, s: ArrayLike, values: FloatArray) -> Derivatives:
        """Linear between the joints' values (p + 1, k)."""
        at = abscissae(s)
        joints = np.concatenate([[0.0], np.cumsum(self._point.problem.lengths)])
        columns = [np.interp(at, joints, column) for column in values.T]
        return self._named(np.stack(columns, axis=-1))

    def position(self, s: ArrayLike) -> Derivatives:
        """Of r (k, 3) at abscissae s (k,) in [0, 1], or (3,) at one s."""
        return self._pose(s, 0)

    def rotation(self, s: ArrayLike) -> Derivatives:
        """Small rotation vector (k, 3) of the frame at abscissae s (k,), or (3,): ``d frame = [it]_x frame``."""
        return self._pose(s, 1)

    def _pose(self, s: ArrayLike, which: int) -> Derivatives:
        at = abscissae(s)
        found = self._poses(np.atleast_1d(at))[which]
        return self._named(found if at.ndim else found[0])

    def _poses(self, s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Changes of positions and rotation vectors (k, 3, parameters)."""
        problem, x, dx = self._point.problem, self._point.x, self.unknowns
        joints = np.concatenate([[0.0], np.cumsum(problem.lengths)])
        i = np.clip(np.searchsorted(joints, s, side="left") - 1, 0, len(joints) - 2)
        along = np.maximum(s - joints[i], 0.0)
        layout = problem.layout
        turned = _spins(x, dx, layout.columns(3, 4, 5, 6)[i])
        moved = dx[layout.columns(0, 1, 2)[i]]
        columns, slopes = problem.parameter_map()
        dq = np.einsum("kij,kjc->kic", slopes[i], dx[columns[i]])
        inside = along > 0.0
        if not inside.any():
            return moved, turned
        fields = problem.fields
        jets = np.empty((int(inside.sum()), 12, fields.components))
        walk(fields.free, problem.parameters(x)[i[inside]], along[inside], problem.exponent_limit, jets)
        first = slice(1, 1 + 2 * fields.count)
        frames = quaternion.matrix(layout.quaternions(x))[i[inside]]
        q, chord = jets[:, :9, 0].reshape(-1, 3, 3), jets[:, 9:12, 0]
        by_q = np.einsum("krp,kpc->krc", jets[:, :9, first], dq[inside]).reshape(len(q), 3, 3, -1)
        by_chord = np.einsum("krp,kpc->krc", jets[:, 9:12, first], dq[inside])
        arm = np.einsum("kij,kj->ki", frames, chord)
        moved[inside] += np.cross(turned[inside], arm[:, :, None], axis=1) + np.einsum("kij,kjc->kic", frames, by_chord)
        spin = np.einsum("kijc,klj->kilc", by_q, q)  # dQ Q^T, skew
        axial = 0.5 * np.stack(
            [spin[:, 2, 1] - spin[:, 1, 2], spin[:, 0, 2] - spin[:, 2, 0], spin[:, 1, 0] - spin[:, 0, 1]], axis=1
        )
        turned[inside] += np.einsum("kij,kjc->kic", frames, axial)
        return moved, turned

    def natural_density(self, s: ArrayLike) -> Gradients:
        """The same gradients by K at single abscissae s (k,): densities dq / dK(s), by the name "natural_curvature(s)".

        The derivative of an output by a change dK(s) of the law is the integral of the density times dK over s (in l).
        In the strip's unit of length: K is in 1/length.
        """
        at = np.atleast_1d(abscissae(s))
        load = parameters.natural_at(self._system, at).scaled(self._point.problem.strip.length)
        return _solved(self._system, ("natural_curvature(s)",), (load,))

    # -- what holds the ribbon ----------------------------------------------------------------------------------------

    def start_force(self) -> Derivatives:
        """Of the force (3,) of the support at s = 0 on the ribbon."""
        return self._named(self._start()[0])

    def start_moment(self) -> Derivatives:
        """Of its moment (3,), about its own point."""
        return self._named(self._start()[1])

    def end_force(self) -> Derivatives:
        """Of the force (3,) of the clamp at s = l; `RibbonInputError` where there is none."""
        return self._named(self._end()[0])

    def end_moment(self) -> Derivatives:
        """Of its moment (3,), about its own point."""
        return self._named(self._end()[1])

    def wall_force(self, number: int) -> Derivatives:
        """Of the force (3,) of a wall on the ribbon."""
        problem = self._point.problem
        if not 0 <= number < len(problem.walls):
            raise RibbonInputError("number", number, f"there are {len(problem.walls)} walls, counted from 0")
        wall, slices = problem.walls[number], problem.block_slices()
        if not isinstance(wall, Wall):
            raise RibbonInputError("number", number, "is a round obstacle, whose force has no derivatives here")
        blocks = [slices[name] for name in (f"wall_{number}", f"touch_{number}") if name in slices]
        push = -sum(self.multipliers[where].sum(axis=0) for where in blocks)
        return self._named(np.asarray(wall.normal)[:, None] * push)

    def _start(self) -> tuple[FloatArray, FloatArray]:
        """Derivatives (3, k) of what `ribbon.problems.supports.start` gives."""
        here = self._point
        problem, held = here.problem, here.problem.start
        rows, drows = here.rows.copy(), self.multipliers.copy()
        for name, where in problem.block_slices().items():
            if name.startswith(("start_", "gauge_")):
                rows[where], drows[where] = 0.0, 0.0
        first = problem.layout.joint(0)
        jacobian = problem.jacobian_matrix(here.x)
        slope = problem.gradient(here.x) + jacobian.T @ rows
        change = problem.hessian_matrix(here.x, rows) @ self.unknowns + jacobian.T @ drows + self._total("gradient")
        force = moment = np.zeros((3, self.unknowns.shape[1]))
        if held is not None and held.position is not None:
            force = change[first.position]
        if held is not None and held.holds_frame:
            q = first.quaternion
            moment = _moments(slope[q], change[q], here.x[q], self.unknowns[q])
        return force, moment

    def _end(self) -> tuple[FloatArray, FloatArray]:
        """Derivatives (3, k) of what `ribbon.problems.supports.end` gives."""
        here = self._point
        problem = here.problem
        if problem.end is None:
            raise RibbonInputError("end", None, "no clamp holds s = l")
        slices, blocks = problem.block_slices(), problem.blocks()
        force = moment = np.zeros((3, self.unknowns.shape[1]))
        if "end_position" in slices:
            force = -self.multipliers[slices["end_position"]]
        if "end_frame" in slices:
            frame: Any = blocks["end_frame"]
            where, q = slices["end_frame"], problem.layout.joint(-1).quaternion
            turning = frame.coefficients.T @ here.rows[where]
            change = frame.coefficients.T @ self.multipliers[where] + self._total("turning")
            moment = -_moments(turning, change, here.x[q], self.unknowns[q])
        return force, moment


def _spins(x: FloatArray, dx: FloatArray, columns: NDArray[np.int64]) -> FloatArray:
    """Rotation vectors (k, 3, parameters) ``2 Im(dq o conj q) / |q|^2`` of the quaternions at `columns` (k, 4)."""
    found = np.empty((len(columns), 3, dx.shape[1]))
    for k, column in enumerate(columns):
        q = x[column]
        back = quaternion.conjugate(q) / (q @ q)
        for c, change in enumerate(dx[column].T):
            found[k, :, c] = 2.0 * quaternion.compose(change, back)[1:]
    return found


def _moments(by_q: FloatArray, change: FloatArray, q: FloatArray, dq: FloatArray) -> FloatArray:
    """Change (3, k) of ``by_q . (e_k o q) / 2`` (`ribbon.problems.supports`): by_q, q (4,) change by `change`,
    dq (4, k)."""
    units = np.eye(4)[1:]
    found = np.empty((3, dq.shape[1]))
    for r, unit in enumerate(units):
        left = np.column_stack([quaternion.compose(unit, basis) for basis in np.eye(4)])
        found[r] = 0.5 * (change.T @ (left @ q) + by_q @ (left @ dq))
    return found


def _solved(system: System, names: tuple[str, ...], loads: tuple[Load, ...]) -> Gradients:
    parts = (np.concatenate([getattr(load, part) for load in loads], axis=1) for part in ("gradient", "rows", "held"))
    dx, drows = system.solve(*parts)
    return Gradients(names, system.condition, dx, drows, system, loads)


@alone
def gradients(result: Equilibrium, wrt: Sequence[str], *, unstable: bool = False) -> Gradients:
    """First derivatives of an equilibrium by parameters, from one factorisation of its tangent.

    result: of `ribbon.solve`, `refine`, `follow`, in any formulation; wrt: names of parameters
    (`ribbon.sensitivity.parameters.NAMES`); unstable: also of a saddle. By a length, place or curvature it is per the
    strip's own unit of length, as that is given. Of a strip made by `Strip.from_material` Young's modulus, density and
    g are held: D and Gamma move with thickness and Poisson's ratio; of any other strip Gamma is held.

    Contacts that push and rulings on their bound are held (the derivative is that of the ribbon as long as they stay).
    Nothing is solved again and no equilibrium is differenced: what is exact and what is not is said in
    `ribbon.sensitivity.parameters`. The segments stay where they are. Source: implicit function theorem on the
    optimality system (A. V. Fiacco 1983; Nocedal & Wright 2006, 12.3; docs/theory.md, eq. (11.2)).

    Raises `RibbonInputError` for a name that is not there, `NotDifferentiable` for a state that is no stable
    equilibrium, a singular tangent (fold, bifurcation) and a contact about to open or to close.
    """
    if isinstance(wrt, str):
        wrt = [wrt]
    if not wrt:
        raise RibbonInputError("wrt", wrt, "name at least one parameter")
    system = System.of(point(result, unstable=unstable))
    return _solved(system, tuple(wrt), tuple(parameters.load(system, name) for name in wrt))


def energy_slopes(result: Equilibrium, wrt: Sequence[str]) -> Derivatives:
    """Of the total energy alone, D w / l, without solving for the response: ``dE/dp = dL/dp`` at an equilibrium.

    Also where the tangent is singular, and of what is not stable. Arguments and errors as in `gradients`.
    """
    here = point(result, unstable=True)
    system = System.of(here)
    slope = here.problem.gradient(here.x) + here.problem.jacobian_matrix(here.x).T @ here.rows
    found = {}
    for name in wrt:
        load = parameters.load(system, name)
        found[name] = (load.energy + here.rows @ load.rows + slope @ load.held).reshape(load.shape)
    return found
