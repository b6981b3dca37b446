"""A strip with straight rulings between floor and roof over one parameter: equations of a branch whose places of
contact move (`ribbon.find.branch.chain`), with what begins and ends along it.

    gap        an arc comes to a plane between its ends: a new place of contact
    push       a place pushes no more: it lets go, two arcs are one
    floor      the curvature at the floor, the same at all its places, passes zero: flat parts begin
    flat       the flat parts' length passes zero: places again
    buckles    without weight: a flat part of all the flat length buckles, thrust 4 pi^2 / length^2

Hamilton's function is the same at all places: ``kappa^2 / 2 - Gamma Y`` (docs/theory.md, eq. (8.9)). So the floor's
places flatten together, before the roof's, whose curvature then is ``- sqrt(2 Gamma H)``: under weight the roof's never
do. Without weight both are flat at once, and how the flat length is shared out, on the floor and at the roof, is
neutral. Under weight a flat part does not buckle, it is heavy as soon as it lifts: what has buckled stands apart, as a
hump of the length 8.9868 / sqrt(thrust) on the flat part, the lower the larger the thrust (`humped`).
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
import scipy  # its parts are loaded where they are first used
from numpy.typing import NDArray

from ribbon.find.branch import chain
from ribbon.find.branch.chain import FLOOR, ROOF, Chain, Setting
from ribbon.find.branch.equations import differenced

FloatArray = NDArray[np.float64]
SettingAt = Callable[[float], Setting]

#: Step in t by which what is given is differenced.
_STEP = 1e-4
#: Push (D w / l^2) below which a place that begins is firm: P sin theta = 0 holds for P = 0 too, and the tangent that
#: is meant is that of theta = 0; by how much (D w / l) its angle is held then. By how much (D w / l^3) lengths are soft
#: where modes are counted and a place pushes less: where one is that does not push, its elements would choose.
PUSHED, FIRM, SOFT = 0.1, 1e3, 0.1
#: Places along an arc at which its angle is asked for, to find where it is level.
_SEEN = 400
#: Nearest (in xi) that a level place is to an end of its arc: nearer ones are told by the curvature at that end.
_INSIDE = 0.02
#: Curvature at the floor (1/l) below which it all but slides along the strip, and eigenvalues (of the matrix whose
#: diagonal is about 1) that are none there.
_SLIDES, _NONE = 0.02, 1e-7
#: How far (l) an arc may go through a plane.
THROUGH = 1e-6
Condition = tuple[str, int]


@dataclass(frozen=True)
class Dense:
    """The second derivatives (n, n) at a point, factored; rest: rows and places, with a negative eigenvalue each; soft
    (n,): taken off the diagonal where eigenvalues are counted; blunt: whether the solution of least size is meant,
    where the whole may slide: eigenvalues that are none are left out."""

    matrix: FloatArray
    rest: int
    soft: FloatArray
    blunt: bool = False

    @cached_property
    def _factor(self) -> tuple[FloatArray, NDArray[np.int32]]:
        with warnings.catch_warnings():
            warnings.simplefilter("error", scipy.linalg.LinAlgWarning)
            try:
                return scipy.linalg.lu_factor(self.matrix, check_finite=False)
            except scipy.linalg.LinAlgWarning:  # singular to the last bit: any neighbour has the same null vector
                shift = 1e-15 * float(np.abs(self.matrix).max()) * np.eye(self.matrix.shape[0])
                return scipy.linalg.lu_factor(self.matrix + shift, check_finite=False)

    @cached_property
    def unstable(self) -> int:
        """Number of unstable modes in the plane; sliding is none of them."""
        if self.blunt:
            return int((self._least[1] < 0.0).sum()) - self.rest
        soft = self.matrix - np.diag(self.soft)
        scale = 1.0 / np.sqrt(np.maximum(np.abs(soft).max(axis=1), 1e-300))
        values = scipy.linalg.eigvalsh(scale[:, None] * soft * scale)
        return int((values < 0.0).sum()) - self.rest

    @cached_property
    def _least(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        scale = 1.0 / np.sqrt(np.maximum(np.abs(self.matrix).max(axis=1), 1e-300))
        values, vectors = scipy.linalg.eigh(scale[:, None] * self.matrix * scale)
        kept = np.abs(values) > _NONE
        return scale, values[kept], vectors[:, kept]

    def solve(self, b: FloatArray) -> FloatArray:
        """K^-1 b."""
        if self.blunt:
            scale, values, vectors = self._least
            inverse = scale[:, None] * vectors
            return np.asarray(inverse @ ((inverse.T @ b).T / values).T)
        return np.asarray(scipy.linalg.lu_solve(self._factor, b, check_finite=False))

    solve_transposed = solve


@dataclass(frozen=True)
class Confined:
    """setting_at: t -> what is given; chain: which planes it touches, in order; first: a number that a condition of it
    keeps; buckled: whether a flat part would buckle that has all of the flat length, without weight; entered (n,): its
    first z behind an event, where the matrix has more than one solution for the tangent (`factor`)."""

    setting_at: SettingAt
    chain: Chain
    first: tuple[int, Condition] | None = None
    buckled: bool = False
    entered: FloatArray | None = field(default=None, compare=False, repr=False)

    @property
    def size(self) -> int:
        """Unknowns and multipliers."""
        return self.chain.size

    def residual(self, z: FloatArray, t: float) -> FloatArray:
        """G (n,); nan where there is no scene, or an arc would have no length."""
        try:
            setting = self.setting_at(t)
        except ValueError:
            return np.full(self.size, np.nan)
        if not np.all(self.chain.lengths(z) > 0.0):
            return np.full(self.size, np.nan)
        return self.chain.residual(z, setting)

    def norm(self, residual: FloatArray) -> float:
        """Largest moment, misfit, difference of Hamilton's function over a force of 100 D w / l^2."""
        scale = np.ones(self.size)
        scale[self.chain.angles : self.chain.angles + self.chain.arcs] = 1e-2
        return float(np.abs(scale * residual).max())

    def rate(self, z: FloatArray, t: float) -> FloatArray:
        """dG/dt (n,) by differences, of which G, linear in what is given, has no error: from one side at an end."""
        return differenced(lambda at: self.residual(z, at), t, _STEP)

    def factor(self, z: FloatArray, t: float) -> Dense | None:
        """The second derivatives, factored; where it has just begun with the angles of places held that do not push
        yet; of what may slide along the strip nothing, there and where flat parts are near."""
        setting, a = self.setting_at(t), self.chain.angles
        matrix = self.chain.jacobian(z, setting)
        if not np.all(np.isfinite(matrix)):
            return None
        pushes, soft = self.chain.pushes(z, setting.gamma), np.zeros(self.size)
        begins = self.entered is not None and np.array_equal(z, self.entered)
        for j in np.flatnonzero(pushes < PUSHED) if begins else ():
            own = self.chain.columns[j + 1][0]
            matrix[own, own] -= FIRM  # its place takes a negative eigenvalue: see `Chain.places`
        if not begins:
            soft[a : a + self.chain.arcs] = max(0.0, SOFT - float(np.abs(pushes).min(initial=SOFT)))
        slides = not self.chain.flat and abs(self.chain.clamped(z, setting)) < _SLIDES
        return Dense(matrix, self.chain.rows + self.chain.places - self.buckled, soft, begins or slides)

    @cached_property
    def _weights(self) -> FloatArray:
        out = np.zeros(self.size)
        own = chain.basis(self.chain.elements)
        for place in self.chain.columns:
            free = place >= 0
            np.add.at(out, place[free], (own.values.T @ own.weights)[free] / self.chain.arcs)
        return np.maximum(out, 0.0)

    def mass(self, v: FloatArray) -> FloatArray:
        """Mean square of the angles."""
        return self._weights * v

    def reach(self, z: FloatArray, dz: FloatArray) -> float:
        """The part of a step that leaves an arc a fifth of its length."""
        a, m = self.chain.angles, self.chain.arcs
        falls = -dz[a : a + m] / z[a : a + m]
        return float(min(1.0, 0.8 / max(float(falls.max()), 1e-300)))

    def stepped(self, z: FloatArray, dz: FloatArray) -> FloatArray:
        """z + dz, lengths kept positive."""
        y = z + dz
        own = slice(self.chain.angles, self.chain.angles + self.chain.arcs)
        y[own] = np.maximum(y[own], 0.2 * z[own])
        return y

    def renewed(self, z: FloatArray, t: float, directions: FloatArray) -> tuple[Confined, FloatArray, FloatArray]:
        """Everything moves something."""
        return self, z, directions

    def moved(self, z: FloatArray, t: float, directions: FloatArray) -> tuple[Confined, FloatArray, FloatArray]:
        """Elements are parts of arcs, and move with them."""
        return self, z, directions

    def convexity(self, z: FloatArray, t: float) -> float:
        """Its rulings are straight."""
        return float("inf")

    def resolved(self, z: FloatArray, t: float) -> bool:
        """What they leave is told by finer ones, where a special point is; whether nothing is behind a plane."""
        setting = self.setting_at(t)
        for k in range(self.chain.arcs):
            y = np.array([self.height(z, k, float(xi), setting) for xi in self.level(z, k)])
            if np.any(y < -THROUGH) or np.any(y > setting.height + THROUGH):
                return False
        return True

    def energy(self, z: FloatArray, t: float) -> float:
        """Total energy over the floor, D w / l."""
        return self.chain.energy(z, self.setting_at(t))

    def finer(self, z: FloatArray, t: float, directions: FloatArray) -> tuple[Confined, FloatArray, FloatArray]:
        """Every element cut in two: the same shapes."""
        many = replace(self.chain, elements=2 * self.chain.elements)
        new = replace(self, chain=many, entered=None)
        return new, self._on(many, z), np.column_stack([self._on(many, v) for v in directions.T] or [np.zeros(0)])

    def _on(self, many: Chain, z: FloatArray) -> FloatArray:
        nodes = chain.nodes(many.elements)
        values = chain.at(self.chain.elements, nodes)[0]
        return chain.filled(many, [values @ self.chain.angle(z, k) for k in range(many.arcs)], z[self.chain.angles :])

    # -- what begins and ends -----------------------------------------------------------------------------------------

    @cached_property
    def _conditions(self) -> list[Condition]:
        own, chain_ = [], self.chain
        own += [("gap", k) for k in range(chain_.arcs)]
        own += [("push", j) for j in range(1, chain_.arcs) if not chain_.lies(chain_.planes[j])]
        if chain_.flat:
            own += [("flat", 0), ("buckles", 0)]
        else:
            own.append(("floor", 0))
        if self.first is not None:
            number, condition = self.first
            while len(own) <= number:
                own.append(("none", 0))
            where = own.index(condition)
            own[where], own[number] = own[number], own[where]
        return own

    def slacks(self, z: FloatArray, t: float) -> FloatArray:
        """Of every condition."""
        setting = self.setting_at(t)
        pushes = self.chain.pushes(z, setting.gamma)
        found = []
        for kind, k in self._conditions:
            if kind == "gap":
                found.append(self._gap(z, k, setting)[0])
            elif kind == "push":
                found.append(1e-3 * float(pushes[k - 1]))
            elif kind == "floor":
                found.append(1e-2 * self.chain.clamped(z, setting))
            elif kind == "flat":
                found.append(self.chain.flat_length(z))
            elif kind == "buckles":
                away = 1.0 - self._thrust(z)
                found.append(1.0 if setting.gamma else -away if self.buckled else away)
            else:
                found.append(1.0)
        return np.array(found)

    def level(self, z: FloatArray, k: int) -> FloatArray:
        """xi at which arc k is level between its ends, where its height is greatest or least."""
        seen = np.linspace(_INSIDE, 1.0 - _INSIDE, _SEEN)
        theta = self.chain.angle(z, k)
        values = chain.at(self.chain.elements, seen)[0] @ theta
        if float(np.abs(values).max()) < _FLAT:
            return np.zeros(0)
        roots = []
        for i in np.flatnonzero(np.signbit(values[:-1]) != np.signbit(values[1:])):
            low, high = float(seen[i]), float(seen[i + 1])
            xi = low + (high - low) * float(values[i] / (values[i] - values[i + 1]))
            for _ in range(_NEWTON):
                value, slope = (float((row @ theta)[0]) for row in chain.at(self.chain.elements, np.array([xi])))
                xi = min(max(xi - value / slope, low), high) if slope else xi
            roots.append(xi)
        return np.array(roots)

    def height(self, z: FloatArray, k: int, xi: float, setting: Setting) -> float:
        """Over the floor, of a place of arc k."""
        theta = self.chain.angle(z, k)
        edges = np.concatenate([np.arange(int(xi * self.chain.elements) + 1) / self.chain.elements, [xi]])
        x, w = np.polynomial.legendre.leggauss(chain.POINTS)
        total = 0.0
        for a, b in pairwise(edges):
            if b > a:
                at = 0.5 * (a + b) + 0.5 * (b - a) * x
                total += 0.5 * (b - a) * float(w @ np.sin(chain.at(self.chain.elements, at)[0] @ theta))
        return float(self.chain.heights(setting)[k] + self.chain.lengths(z)[k] * total)

    def _gap(self, z: FloatArray, k: int, setting: Setting) -> tuple[float, float, int]:
        """Least distance of arc k from a plane between its ends, where (xi), and the plane; 1 where it is nowhere
        level, and where it lies."""
        best = (1.0, 0.5, FLOOR)
        for xi in self.level(z, k):
            y = self.height(z, k, float(xi), setting)
            if not self.chain.flat:  # else a level place on the floor has no curvature, as a flat part's end
                best = min(best, (y, float(xi), FLOOR))
            if not (self.chain.flat and setting.gamma == 0.0):
                best = min(best, (setting.height - y, float(xi), ROOF))
        return best

    def beyond(
        self, z: FloatArray, t: float, condition: int, directions: FloatArray
    ) -> tuple[Confined, FloatArray, FloatArray, str]:
        """The system in which something has begun or ended."""
        kind, k = self._conditions[condition]
        make = {"gap": self._touched, "push": self._let_go, "floor": self._flattened, "flat": self._lifted,
                "buckles": self._buckled}[kind]  # fmt: skip
        new, carry, partner, what = make(z, k, self.setting_at(t))
        there = carry(z)
        new = replace(new, first=(condition, partner), entered=there)
        wide = np.column_stack([carry(v) for v in directions.T] or [np.zeros(0)])
        return new, there, wide, what

    def _touched(self, z: FloatArray, k: int, setting: Setting) -> tuple[Confined, _Carry, Condition, str]:
        _, xi, plane = self._gap(z, k, setting)
        old, here = self.chain, self._s(z, k, xi)
        planes = (*old.planes[: k + 1], plane, *old.planes[k + 1 :])
        many = replace(old, planes=planes)
        nodes = chain.nodes(old.elements)

        def carry(v: FloatArray) -> FloatArray:
            own = [old.angle(v, i) for i in range(old.arcs)]
            first = chain.at(old.elements, xi * nodes)[0] @ own[k]
            last = chain.at(old.elements, xi + (1.0 - xi) * nodes)[0] @ own[k]
            length = old.lengths(v)
            lift = old.lifts(v)
            behind = setting.gamma * (1.0 - xi) * length[k]
            lengths = np.concatenate([length[:k], [xi * length[k], (1.0 - xi) * length[k]], length[k + 1 :]])
            lifts = np.concatenate([lift[:k], [lift[k] + behind, lift[k]], lift[k + 1 :]])
            rest = np.concatenate([lengths, lifts, v[old.angles + 2 * old.arcs :]])
            return chain.filled(many, [*own[:k], first, last, *own[k + 1 :]], rest)

        where = "roof" if plane == ROOF else "floor"
        return replace(self, chain=many), carry, ("push", k + 1), f"touches the {where} at s = {here:.4g} l"

    def _let_go(self, z: FloatArray, j: int, setting: Setting) -> tuple[Confined, _Carry, Condition, str]:
        old, here = self.chain, self._s(z, j, 0.0)
        few = replace(old, planes=(*old.planes[:j], *old.planes[j + 1 :]))
        nodes = chain.nodes(old.elements)
        both = old.lengths(z)[j - 1 : j + 1]
        xi = float(both[0] / both.sum())

        def carry(v: FloatArray) -> FloatArray:
            own = [old.angle(v, i) for i in range(old.arcs)]
            before = chain.at(old.elements, np.minimum(nodes / xi, 1.0))[0] @ own[j - 1]
            behind = chain.at(old.elements, np.maximum((nodes - xi) / (1.0 - xi), 0.0))[0] @ own[j]
            length, lift = old.lengths(v), old.lifts(v)
            lengths = np.concatenate([length[: j - 1], [length[j - 1] + length[j]], length[j + 1 :]])
            lifts = np.concatenate([lift[: j - 1], lift[j:]])
            rest = np.concatenate([lengths, lifts, v[old.angles + 2 * old.arcs :]])
            return chain.filled(few, [*own[: j - 1], np.where(nodes < xi, before, behind), *own[j + 1 :]], rest)

        where = "roof" if old.planes[j] == ROOF else "floor"
        return replace(self, chain=few), carry, ("gap", j - 1), f"lets go of the {where} at s = {here:.4g} l"

    def _flattened(self, z: FloatArray, _: int, setting: Setting) -> tuple[Confined, _Carry, Condition, str]:
        old = self.chain
        flat = replace(old, flat=True, weightless=setting.gamma == 0.0)

        def carry(v: FloatArray) -> FloatArray:
            return chain.filled(flat, [old.angle(v, i) for i in range(old.arcs)], v[old.angles : -1])

        where = "contacts" if flat.weightless else "contacts with the floor"
        return replace(self, chain=flat), carry, ("flat", 0), f"{where} spread into flat parts"

    def _lifted(self, z: FloatArray, _: int, setting: Setting) -> tuple[Confined, _Carry, Condition, str]:
        old = self.chain
        points = replace(old, flat=False, weightless=False)

        def carry(v: FloatArray) -> FloatArray:
            rest = np.concatenate([v[old.angles :], [0.0]])
            return chain.filled(points, [old.angle(v, i) for i in range(old.arcs)], rest)

        return replace(self, chain=points), carry, ("floor", 0), "the flat parts have become places"

    def _buckled(self, z: FloatArray, _: int, setting: Setting) -> tuple[Confined, _Carry, Condition, str]:
        return replace(self, buckled=not self.buckled), lambda v: v, ("buckles", 0), "a flat part buckles"

    def _thrust(self, z: FloatArray) -> float:
        """Over that under which a flat part buckles that has all of the flat length."""
        return -self.chain.tension(z) * self.chain.flat_length(z) ** 2 / (4.0 * np.pi**2)

    def _s(self, z: FloatArray, k: int, xi: float) -> float:
        """Abscissa of a place, flat parts shared out alike."""
        return float(self.starts(z)[k] + xi * self.chain.lengths(z)[k])

    def starts(self, z: FloatArray) -> FloatArray:
        """Abscissae (k,) of the arcs' starts: of the flat length the clamps' parts take one share each and those
        between folds two."""
        length, planes = self.chain.lengths(z), self.chain.planes
        shares = np.array([1.0 if j == 0 else 2.0 if plane == FLOOR else 0.0 for j, plane in enumerate(planes[:-1])])
        flat = self.chain.flat_length(z) if self.chain.flat else 0.0
        before = flat * np.cumsum(shares) / (shares.sum() + 1.0)
        return before + np.concatenate([[0.0], np.cumsum(length)[:-1]])


#: Angle below which an arc lies; Newton steps for a level place, from between two places near it.
_FLAT, _NEWTON = 1e-9, 5
_Carry = Callable[[FloatArray], FloatArray]
