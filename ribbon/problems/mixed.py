"""Mixed (glued) problem: every segment on its own, glued by constraints; sparse, cost linear in p (thesis, 5.2).

Nine unknowns a joint and one a segment (`ribbon.problems.mixed_kernels`), eight rows of glue a segment (docs/theory.md,
eq. (4.5)), then the rows of what holds the ribbon (`ribbon.problems.conditions`). Position, frame and ruling that a
clamp holds at s = 0 are eliminated (they are fixed unknowns), or held by rows when ``held_by = "constraints"`` (thesis,
5.3.3). Rigid motions that nothing resists are removed by rows that fix the start (`gauge`), whose multipliers vanish at
equilibrium; that of a seam that slides (`Held.slides`) where the segments are mirror images about it, and is told else.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy  # its parts are loaded where they are first used

from ribbon import law
from ribbon.element import quaternion
from ribbon.element.kinematics import body_jets_many
from ribbon.problems import chained_kernels, order, supports
from ribbon.problems import mixed_kernels as kernels
from ribbon.problems.chained import too_far
from ribbon.problems.held import HALF_TURN, FloatArray, Held, IntArray
from ribbon.problems.layout import ETA, OMEGA, QUATERNION, STRIDE

__all__ = ["HALF_TURN", "MixedProblem"]

#: Places of a joint on which the weight of an oblique end depends.
_ENDS = np.array([*range(QUATERNION, OMEGA), ETA])


@dataclass(frozen=True)
class MixedProblem(Held):
    """Energy of the glued ribbon with constraints, sparse Jacobian and Hessian of the Lagrangian.

    Fields and what holds the ribbon: `ribbon.problems.held.Held`.
    """

    @property
    def rows(self) -> MixedProblem:
        """All of it has rows: the glue, and what holds it."""
        return self

    def energy_parts(self, x: FloatArray) -> FloatArray:
        """Bending, natural-curvature and gravity energy, that of pressure plates and of an end force (5,), D w / l."""
        parts = np.append(self._parts_and_glue(x, False)[0], [self._plate_energy(x), self._tip_energy(x)])
        parts[2] += sum(end[1] for end in self._oblique_ends(x))
        return parts

    def _tip_energy(self, x: FloatArray) -> float:
        return 0.0 if self.tip is None else -float(x[self.layout.joint(-1).position] @ np.asarray(self.tip))

    def _oblique_ends(self, x: FloatArray) -> list[tuple[int, float, FloatArray, FloatArray]]:
        """Of either end with an exact weight: first column, energy, derivatives (5,), second ones (15,) by q, eta."""
        gamma, up, exact = self._gravity_arguments()
        found: list[tuple[int, float, FloatArray, FloatArray]] = []
        if not exact or self.closure is not None:
            return found
        factor = gamma * self.half_width**2 / 3.0
        for column, joint, sign in ((0, self.layout.joint(0), 1.0), (self.last, self.layout.joint(-1), -1.0)):
            by, second = np.empty(5), np.empty(15)
            energy = kernels.end_weight(x[joint.quaternion], x[joint.eta], up, sign * factor, by, second)
            found.append((column, energy, by, second))
        return found

    def _plate_energy(self, x: FloatArray) -> float:
        heights = x[self.layout.heights]
        return 0.5 * float(sum(self.walls[k].stiffness * h * h for k, h in zip(self.plates, heights, strict=True)))  # type: ignore[misc,operator]

    def _parts_and_glue(self, x: FloatArray, want_glue: bool) -> tuple[FloatArray, FloatArray]:
        gamma, up, exact = self._gravity_arguments()
        parts = np.empty(3)
        glue = np.empty(kernels.ROWS * self.lengths.size)
        self.counters.value += 1
        if too_far(self.parameters(x), self.lengths, self.fields.free):
            return np.full(3, np.nan), np.full(glue.size, np.nan)
        self.counters.series += self.lengths.size * (want_glue or gamma != 0.0)
        kernels.energy_and_glue(
            np.ascontiguousarray(x, dtype=float), self.lengths, self.material, gamma, up, exact, self.exponent_limit,
            self.sideways, want_glue, parts, glue,
        )  # fmt: skip
        return parts, glue

    def _evaluated(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Energies and glue of x, one evaluation for both."""
        key = np.ascontiguousarray(x, dtype=float).tobytes()
        if self._cache.get("value_key") != key:
            self._cache["values"] = self._parts_and_glue(x, True)
            self._cache["value_key"] = key
        return self._cache["values"]  # type: ignore[no-any-return]

    def value(self, x: FloatArray) -> float:
        """Total energy, and what friction adds to it in an increment; units D w / l."""
        ends = sum(end[1] for end in self._oblique_ends(x))
        rubbed = 0.0 if self.friction is None else self.friction.value(x)
        return float(self._evaluated(x)[0].sum() + self._plate_energy(x) + self._tip_energy(x) + ends + rubbed)

    def constraints(self, x: FloatArray) -> FloatArray:
        """The rows: the glue, then the blocks."""
        return np.concatenate([self._evaluated(x)[1], *(rows.values(x) for rows in self.blocks().values())])

    def parameters(self, x: FloatArray) -> FloatArray:
        """(a, b, n, m) of every segment, (p, 4), or with (c, d) of an in-plane curvature (p, 6)."""
        q = np.empty((self.lengths.size, 2 * self.fields.count))
        kernels.parameters(np.ascontiguousarray(x, dtype=float), self.lengths, self.sideways, q)
        return q

    def parameter_map(self) -> tuple[IntArray, FloatArray]:
        """Columns (p, k) of (omega_0, eta_0, slope, omega_1), and of the in-plane curvatures at both joints, and slopes
        (p, k, k) of the segments' parameters by them."""
        count = 2 * self.fields.count
        columns = STRIDE * np.arange(self.lengths.size)[:, None] + kernels.Z
        slopes = np.zeros((self.lengths.size, count, count))
        if self.sideways >= 0:
            columns = np.hstack([columns, self.sideways + np.arange(self.lengths.size)[:, None] + np.arange(2)])
            slopes[:, 4, 4], slopes[:, 4, 5], slopes[:, 5, 4] = -1.0 / self.lengths, 1.0 / self.lengths, 1.0
        slopes[:, 0, 0], slopes[:, 0, 3] = -1.0 / self.lengths, 1.0 / self.lengths
        slopes[:, 1, 0] = slopes[:, 2, 2] = slopes[:, 3, 1] = 1.0
        return columns, slopes

    def _jets(self, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        key = np.ascontiguousarray(x, dtype=float).tobytes()
        if self._cache.get("key") != key:
            p = self.lengths.size
            gamma, _, exact = self._gravity_arguments()
            q = self.parameters(x)
            if "jets" not in self._cache:
                components = self.fields.components
                self._cache["jets"] = (
                    np.empty((p, components)), np.empty((p, 13, components)),
                    np.empty((p if gamma else 1, 3, components)),
                )  # fmt: skip
            local, jets, weight = self._cache["jets"]
            if too_far(q, self.lengths, self.fields.free):
                self._cache.pop("key", None)
                return np.full_like(local, np.nan), np.full_like(jets, np.nan), np.full_like(weight, np.nan)
            chained_kernels.local_derivatives(q, self.lengths, self.material, local)
            body_jets_many(self.fields.free, q, self.lengths, self.exponent_limit, self._level, jets)
            self.counters.series += p
            if gamma:
                kernels.weight_jets(jets, q, self.lengths, self.half_width, exact, weight)
            kernels.all_by_unknowns(self.lengths, local, jets, 7, weight, gamma != 0.0)
            self._cache["key"] = key
        return self._cache["jets"]  # type: ignore[no-any-return]

    def gradient(self, x: FloatArray) -> FloatArray:
        """Gradient (size,) of the energy."""
        self.counters.gradient += 1
        local, _, weight = self._jets(x)
        gamma, up, _ = self._gravity_arguments()
        out = np.empty(self.size)
        kernels.gradient(x, self.lengths, local, gamma, up, weight, self.sideways, out)
        for k, column in zip(self.plates, range(self.layout.ribbon, self.size), strict=True):
            out[column] = self.walls[k].stiffness * x[column]  # type: ignore[operator]
        for column, _, by, _ in self._oblique_ends(x):
            out[column + _ENDS] += by
        if self.tip is not None:
            out[self.layout.joint(-1).position] -= np.asarray(self.tip)
        if self.friction is not None:
            self.friction.add_gradient(x, out)
        return out

    def jacobian_structure(self) -> tuple[IntArray, IntArray]:
        """Rows and columns of the Jacobian's entries."""
        if "jacobian" not in self._cache:
            rows, columns = kernels.jacobian_structure(self.lengths.size, self.sideways)
            parts = [(rows, columns)]
            for name, where in self.block_slices().items():
                r, c = self.blocks()[name].jacobian_structure()
                parts.append((r + where.start, c))
            self._cache["jacobian"] = tuple(np.concatenate(part) for part in zip(*parts, strict=True))
        return self._cache["jacobian"]  # type: ignore[no-any-return]

    def jacobian(self, x: FloatArray) -> FloatArray:
        """The Jacobian's entries in the order of the structure."""
        _, jets, _ = self._jets(x)
        out = np.empty(kernels.jacobian_entries(self.fields.components) * self.lengths.size)
        kernels.jacobian(x, self.lengths, jets, out)
        return np.concatenate([out, *(rows.jacobian(x) for rows in self.blocks().values())])

    def hessian_structure(self) -> tuple[IntArray, IntArray]:
        """Rows and columns of the entries of the Hessian's lower triangle; entries of one place add up."""
        if "hessian" not in self._cache:
            parts = [kernels.hessian_structure(self.lengths.size, self.sideways)]
            parts += [rows.hessian_structure() for rows in self.blocks().values()]
            columns = np.arange(self.layout.ribbon, self.size)
            parts.append((columns, columns))
            for column, *_ in self._oblique_ends(np.zeros(self.size)):
                rows, places = np.tril_indices(5)
                parts.append((column + _ENDS[rows], column + _ENDS[places]))
            if self.friction is not None:
                parts.append(self.friction.hessian_structure())
            self._cache["hessian"] = tuple(np.concatenate(part) for part in zip(*parts, strict=True))
        return self._cache["hessian"]  # type: ignore[no-any-return]

    def hessian(self, x: FloatArray, multipliers: FloatArray, factor: float = 1.0) -> FloatArray:
        """Entries of the lower triangle of ``factor d2E + sum multipliers d2c`` in the order of the structure."""
        self.counters.hessian += 1
        local, jets, weight = self._jets(x)
        gamma, up, _ = self._gravity_arguments()
        out = np.empty(kernels.hessian_entries(self.fields.components) * self.lengths.size)
        kernels.hessian(x, self.lengths, multipliers, factor, local, jets, gamma, up, weight, out)
        parts = [out]
        for name, where in self.block_slices().items():
            parts.append(self.blocks()[name].hessian(x, multipliers[where]))
        parts.append(factor * np.array([self.walls[k].stiffness for k in self.plates], dtype=float))
        parts.extend(factor * second for *_, second in self._oblique_ends(x))
        if self.friction is not None:
            parts.append(factor * self.friction.hessian(x))
        return np.concatenate(parts)

    def elimination(self) -> tuple[IntArray, IntArray]:
        """Groups of the unknowns (size,) and of the rows (m,) in the order of their elimination along the strip."""
        if "order" not in self._cache:
            self._cache["order"] = order.elimination(self)
        return self._cache["order"]  # type: ignore[no-any-return]

    # -- as sparse matrices -------------------------------------------------------------------------------------------

    def jacobian_matrix(self, x: FloatArray) -> scipy.sparse.csr_matrix:
        """The Jacobian (rows, size)."""
        rows, columns = self.jacobian_structure()
        count = len(self.constraint_bounds()[0])
        return scipy.sparse.csr_matrix((self.jacobian(x), (rows, columns)), shape=(count, self.size))

    def hessian_matrix(self, x: FloatArray, multipliers: FloatArray) -> scipy.sparse.csr_matrix:
        """Hessian (size, size) of the Lagrangian, both triangles."""
        rows, columns = self.hessian_structure()
        values = self.hessian(x, multipliers)
        lower = scipy.sparse.csr_matrix((values, (rows, columns)), shape=(self.size, self.size))
        return lower + scipy.sparse.tril(lower, -1).T

    # -- what holds the ribbon ----------------------------------------------------------------------------------------

    def start_force(self, x: FloatArray, rows: FloatArray) -> supports.Force:
        """What the support at s = 0 exerts on the ribbon, from the multipliers of the rows."""
        return supports.start(self, x, rows)

    def end_force(self, x: FloatArray, rows: FloatArray) -> supports.Force | None:
        """What the clamp at s = l exerts; None for a free or closed end."""
        return supports.end(self, x, rows)

    def wall_forces(self, x: FloatArray, rows: FloatArray) -> tuple[supports.WallForce, ...]:
        """What every wall exerts."""
        return supports.walls(self, x, rows)

    def pair_forces(self, x: FloatArray, rows: FloatArray) -> tuple[supports.PairForce, ...]:
        """What parts of the ribbon that touch each other exert."""
        return supports.pairs(self, x, rows)

    # -- states -------------------------------------------------------------------------------------------------------

    def state(self, omega: FloatArray, eta: FloatArray, in_plane: FloatArray | None = None) -> FloatArray:
        """Unknowns of the shape with omega, eta and in-plane curvature (p + 1,; None: the natural one) at the joints,
        glued, put where something holds it."""
        x = np.zeros(self.size)
        layout = self.layout
        first, last = layout.joint(0), layout.joint(-1)
        x[first.quaternion] = self.reference if self.start_quaternion is None else self.start_quaternion
        x[first.position] = self.origin if self.start_position is None else self.start_position
        x[layout.omega] = omega
        if in_plane is None:
            in_plane = law.at(self.strip.geodesic, np.concatenate([[0.0], np.cumsum(self.lengths)]))
        if self.fields.in_plane:
            x[layout.sideways] = in_plane
        x[first.eta] = eta[0]
        x[layout.slope] = np.diff(eta) / self.lengths
        kernels.walk(self.fields.free, x, self.lengths, self.exponent_limit, self.sideways)
        x[layout.eta] = eta  # no rounding where a clamp holds it straight
        turned = self.start_quaternion
        if turned is None and self.end_quaternion is not None:
            spin = quaternion.compose(self.end_quaternion, quaternion.conjugate(x[last.quaternion]))
            x[first.quaternion] = quaternion.compose(spin, x[first.quaternion])
            kernels.walk(self.fields.free, x, self.lengths, self.exponent_limit, self.sideways)
        if self.start_position is None and self.end_position is not None:
            layout.positions(x)[:] += self.end_position - x[last.position]
        return x

    def joints(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Positions (p + 1, 3) in units of l and frames (p + 1, 3, 3) at the joints."""
        return self.layout.positions(x).copy(), quaternion.matrix(self.layout.quaternions(x))
