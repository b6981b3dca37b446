"""Places of the strip that are held apart from each other: one row a pair, which slides.

On the segment that starts at joint i, at the distance h behind it, the point u of the ruling stands at::

    X = r_i + R(q_i) y ,   y = p(h) + u (Q(h) e_x + (m + n h) Q(h) e_z)

(without the last term where the twist is free). Of two places, on segments far from each other, the row is

    g(x) = min (|X - X'|^2 - d^2) / (2 d)   over t = (h, u, h', u') ,

to first order how far the gap |X - X'| exceeds the distance d to be kept, so that its multiplier is minus a force: the
minimum beside where the search begins, within the segments and the width. A `u` may be held; on parallel rulings no
place is nearest. At a minimum inside, f_t = 0 and by the implicit function theorem (R. Hettich and K. Kortanek 1993,
section 3, doi:10.1137/1035089)::

    g_x = f_x ,   g_xx = f_xx - f_xt f_tt^-1 f_tx .

With D = X - X' all of it follows from D and its derivatives: f_x = D . D_x / d, f_xx = (D_x . D_x + D . D_xx) / d.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ribbon.element.kinematics import walk
from ribbon.element.quaternion import form
from ribbon.problems import mixed_kernels as kernels
from ribbon.problems.layout import OMEGA, POSITION, STRIDE

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

#: How far (of a segment's length) a minimum may lie beyond the ends of its segment, on the element continued there.
BEYOND = 1e-2
#: The same while an equilibrium of a round rod is looked for: rows stay smooth, and a place that is beyond is put on
#: the next segment afterwards. Both elements are alike there up to (jump of the curvature's slope) (1e-2 h)^3.
BEYOND_ROUND = 0.5
#: Steps of the search for the nearest places, and their last one (l).
_STEPS, _FOUND = 30, 1e-8
#: Steps (l) below which a search is judged by its slopes.
_CLOSE = 1e-5
#: Turn (rad) along a segment beyond which a trial is no shape.
_TURNS = 40.0
#: Least eigenvalue of f_tt, over its largest, below which parts lie along each other.
_VALLEY = 0.05
#: Least eigenvalue of f_tt, over its largest, that tells where a minimum is.
_FLAT = 1e-9


class Pair(NamedTuple):
    """Two places that are held apart: abscissae s < s_other and places u, u_other on their rulings, l; held: whether
    these two are as they are (opposite rulings are parallel; a round rod), or slide too; stays: whether s is as it is
    (parts lie along each other, and no place is nearest), and u with it; of these u_other may slide."""

    s: float
    u: float
    s_other: float
    u_other: float
    held: bool = False
    stays: bool = False

    def at(self, places: FloatArray) -> Pair:
        """The pair at other places (s, u, s_other, u_other)."""
        s, u, s_other, u_other = map(float, places)
        return Pair(s, u, s_other, u_other, self.held, self.stays)

    def ordered(self) -> Pair:
        """With the place first that comes first, where either may: what stays stays first."""
        if self.stays or self.s <= self.s_other:
            return self
        return self._replace(s=self.s_other, u=self.u_other, s_other=self.s, u_other=self.u)


class Side(NamedTuple):
    """Of one place of each pair: position (k, 3), its derivatives by t = (h, u) (k, 3, 2), by the 7 + P unknowns
    (k, 3, n), the second ones by t (k, 3, 2, 2), by t and unknowns (k, 3, 2, n), by unknowns (k, 3, n, n)."""

    place: FloatArray
    by_t: FloatArray
    by_x: FloatArray
    tt: FloatArray
    tx: FloatArray
    xx: FloatArray


@dataclass(frozen=True)
class PairRows:
    """Places of the strip at least `distance` (l) apart, one row a pair.

    pairs: where the search begins; segments (2, k): of both places; lengths: of all segments; half_width: w / (2 l);
    limit, components: of the series; free: whether the twist is; sideways: first column of the in-plane curvatures, -1
    without; over (2, p): how far, of its length, places go beyond start and end of a segment, None: `BEYOND`.
    """

    pairs: tuple[Pair, ...]
    distance: float
    segments: IntArray
    lengths: FloatArray
    half_width: float
    limit: float
    components: int
    free: bool = False
    sideways: int = -1
    over: FloatArray | None = None
    lower: float = 0.0
    upper: float = np.inf
    _kept: dict[str, Any] = field(default_factory=dict, repr=False, compare=False)

    @property
    def count(self) -> int:
        """One row a pair."""
        return len(self.pairs)

    @cached_property
    def _parameters(self) -> int:
        return 4 if self.sideways < 0 else 6

    @cached_property
    def _own(self) -> int:
        return 7 + self._parameters

    @cached_property
    def _columns(self) -> IntArray:
        """Columns (2, k, 7 + P) of r, q of the joint before each place, and of what bends its segment."""
        found = np.empty((2, self.count, self._own), dtype=np.int64)
        found[:, :, :7] = STRIDE * self.segments[:, :, None] + np.arange(POSITION, OMEGA)
        for side in range(2):
            for row, i in enumerate(self.segments[side]):
                found[side, row, 7:] = [kernels.bending_column(i, z, self.sideways) for z in range(self._parameters)]
        return found

    @cached_property
    def _starts(self) -> FloatArray:
        return np.concatenate([[0.0], np.cumsum(self.lengths)])

    @cached_property
    def _from(self) -> FloatArray:
        """Abscissae (k, 2) of the joints before both places."""
        return np.asarray(self._starts[self.segments.T])

    @cached_property
    def long(self) -> FloatArray:
        """Lengths (k, 2) of both places' segments."""
        return np.asarray(self.lengths[self.segments.T])

    @cached_property
    def _begin(self) -> FloatArray:
        """t (k, 4) from which the search begins."""
        s = np.array([[pair.s, pair.s_other] for pair in self.pairs])
        u = np.array([[pair.u, pair.u_other] for pair in self.pairs])
        h = s - self._from
        return np.stack([h[:, 0], u[:, 0], h[:, 1], u[:, 1]], axis=1)

    @cached_property
    def _loose(self) -> BoolArray:
        """Which of t (k, 4) slide."""
        held, stays = np.array([(pair.held, pair.stays) for pair in self.pairs]).T
        return np.stack([~stays, ~held & ~stays, np.ones_like(held), ~held], axis=1)

    @cached_property
    def _room(self) -> tuple[FloatArray, FloatArray]:
        """Bounds (k, 4) of t."""
        own = self.lengths[self.segments.T]
        edge = np.full(self.count, self.half_width)
        over = np.full((2, self.lengths.size), BEYOND) if self.over is None else self.over
        before, behind = (own * each[self.segments.T] for each in over)
        low = np.stack([-before[:, 0], -edge, -before[:, 1], -edge], axis=1)
        high = np.stack([own[:, 0] + behind[:, 0], edge, own[:, 1] + behind[:, 1], edge], axis=1)
        return low, high

    @cached_property
    def _forms(self) -> FloatArray:
        """N(e_c, e_r) (3, 3, 4, 4): R(q)_cr = q^T N q."""
        forms = np.empty((3, 3, 4, 4))
        for c, axis in enumerate(np.eye(3)):
            for r, other in enumerate(np.eye(3)):
                form(axis, other, forms[c, r])
        return forms

    # -- one place ----------------------------------------------------------------------------------------------------

    def _side(self, x: FloatArray, side: int, t: FloatArray, second: bool) -> Side:
        """The places of one side at t (k, 2); second: with first and second derivatives by the unknowns,
        which the search for the nearest places does without."""
        k, count = self.count, 1 + self._parameters
        q = np.empty((k, self._parameters))
        for row, i in enumerate(self.segments[side]):
            kernels.own_parameters(x, self.lengths, i, self.sideways, q[row])
        h, u = np.ascontiguousarray(t[:, 0]), t[:, 1]
        states = np.empty((k, 12, self.components))
        walk(self.free, q, h, self.limit, states)
        frame = states[:, :9].reshape(k, 3, 3, self.components)  # rows, columns t_x t_y t_z, jets
        ruling = frame[:, :, 0].copy()
        if not self.free and second:
            ruling += _times(q[:, 3] + q[:, 2] * h, h, frame[:, :, 2])
        elif not self.free:
            ruling[:, :, 0] += (q[:, 3] + q[:, 2] * h)[:, None] * frame[:, :, 2, 0]
        y = states[:, 9:12] + u[:, None, None] * ruling
        along, bent, turned = self._derived(q, h, u, frame)
        for row, i in enumerate(self.segments[side] if second else ()):
            for r in range(3):
                for jet in (y, ruling, along):
                    kernels.by_unknowns(jet[row, r], self.lengths[i])
        quaternion = x[self._columns[side][:, 3:7]]
        by_q = 2.0 * np.einsum("crab,kb->kcra", self._forms, quaternion)
        matrix = 0.5 * np.einsum("kcra,ka->kcr", by_q, quaternion)
        place = x[self._columns[side][:, :3]] + np.einsum("kcr,kr->kc", matrix, y[:, :, 0])
        by_t = np.stack([np.einsum("kcr,kr->kc", matrix, jet[:, :, 0]) for jet in (along, ruling)], axis=2)
        tt = np.zeros((k, 3, 2, 2))
        tt[:, :, 0, 0] = np.einsum("kcr,kr->kc", matrix, bent)
        tt[:, :, 0, 1] = tt[:, :, 1, 0] = np.einsum("kcr,kr->kc", matrix, turned)
        by_x, tx, xx = np.empty((0, 3, 0)), np.empty((0, 3, 2, 0)), np.empty((0, 3, 0, 0))
        if second:
            by_x, tx = np.empty((k, 3, self._own)), np.zeros((k, 3, 2, self._own))
            xx = np.zeros((k, 3, self._own, self._own))
            by_x[:, :, :3] = np.eye(3)
            by_x[:, :, 3:7] = np.einsum("kcra,kr->kca", by_q, y[:, :, 0])
            by_x[:, :, 7:] = np.einsum("kcr,krz->kcz", matrix, y[:, :, 1:count])
            for at, jet in enumerate((along, ruling)):
                tx[:, :, at, 3:7] = np.einsum("kcra,kr->kca", by_q, jet[:, :, 0])
                tx[:, :, at, 7:] = np.einsum("kcr,krz->kcz", matrix, jet[:, :, 1:count])
            xx[:, :, 3:7, 3:7] = 2.0 * np.einsum("crab,kr->kcab", self._forms, y[:, :, 0])
            xx[:, :, 3:7, 7:] = np.einsum("kcra,krz->kcaz", by_q, y[:, :, 1:count])
            xx[:, :, 7:, 3:7] = np.swapaxes(xx[:, :, 3:7, 7:], 2, 3)
            one, other = np.triu_indices(self._parameters)
            xx[:, :, 7 + one, 7 + other] = np.einsum("kcr,krz->kcz", matrix, y[:, :, count:])
            xx[:, :, 7 + other, 7 + one] = xx[:, :, 7 + one, 7 + other]
        return Side(place, by_t, by_x, tt, tx, xx)

    def _derived(
        self, q: FloatArray, h: FloatArray, u: FloatArray, frame: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """y_h as jets (k, 3, components) with its first derivatives by the parameters, y_hh and y_hu (k, 3), from
        t_x' = kappa_3 t_y - kappa_2 t_z, t_y' = kappa_1 t_z - kappa_3 t_x and t_z' = kappa_2 t_x - kappa_1 t_y; of a
        developable surface t_x' + eta t_z' = 0."""
        along = np.zeros((self.count, 3, self.components))
        count = 1 + self._parameters
        first = frame[..., :count]
        t_x, t_y, t_z = (frame[:, :, column, 0] for column in range(3))
        u, one = u[:, None], (q[:, 0] * h + q[:, 1])[:, None]
        if not self.free:
            along[:, :, :count] = (1.0 + u * q[:, 2:3])[:, :, None] * first[:, :, 2]
            along[:, :, 3] += u * t_z
            return along, -(1.0 + u * q[:, 2:3]) * one * t_y, q[:, 2:3] * t_z
        three = (q[:, 2] * h + q[:, 3])[:, None]
        two = (q[:, 4] * h + q[:, 5])[:, None] if self._parameters == 6 else np.zeros_like(one)
        along[:, :, :count] = (1.0 - u * two)[:, :, None] * first[:, :, 2] + (u * three)[:, :, None] * first[:, :, 1]
        along[:, :, 3] += u * h[:, None] * t_y
        along[:, :, 4] += u * t_y
        slope = q[:, 4:5] if self._parameters == 6 else np.zeros_like(one)
        if self._parameters == 6:
            along[:, :, 5] -= u * h[:, None] * t_z
            along[:, :, 6] -= u * t_z
        bent = (1.0 - u * two) * (two * t_x - one * t_y) - u * slope * t_z
        bent += u * q[:, 2:3] * t_y + u * three * (one * t_z - three * t_x)
        return along, bent, three * t_y - two * t_z

    # -- both of them -------------------------------------------------------------------------------------------------

    def _both(self, x: FloatArray, t: FloatArray, second: bool = False) -> tuple[Side, Side]:
        return self._side(x, 0, t[:, :2], second), self._side(x, 1, t[:, 2:], second)

    def _slopes(self, one: Side, other: Side) -> tuple[FloatArray, FloatArray, FloatArray]:
        """f (k,), f_t (k, 4), f_tt (k, 4, 4)."""
        apart = one.place - other.place
        by_t = np.concatenate([one.by_t, -other.by_t], axis=2)
        tt = np.einsum("kcs,kct->kst", by_t, by_t)
        tt[:, :2, :2] += np.einsum("kc,kcst->kst", apart, one.tt)
        tt[:, 2:, 2:] -= np.einsum("kc,kcst->kst", apart, other.tt)
        f = (np.einsum("kc,kc->k", apart, apart) - self.distance**2) / (2.0 * self.distance)
        return f, np.einsum("kc,kct->kt", apart, by_t) / self.distance, tt / self.distance

    def _nearest(self, x: FloatArray) -> tuple[FloatArray, BoolArray]:
        """t (k, 4) of the nearest places beside where the search begins, and which of them are inside (k, 4)."""
        low, high = self._room
        t = np.clip(self._begin, low, high)
        f, slope, curved = self._slopes(*self._both(x, t))
        trust = np.full(self.count, 0.1)
        for _ in range(_STEPS):
            if not np.isfinite(curved).all():  # a minimiser's trial that is no shape
                break
            bound = ((t <= low) & (slope > 0.0)) | ((t >= high) & (slope < 0.0))
            moves = self._loose & ~bound
            step = np.clip(t + _steps(slope, curved, moves, trust), low, high) - t
            last = float(np.abs(step).max(initial=0.0)) <= _FOUND  # the error behind it is its square
            tried = self._slopes(*self._both(x, t + step))
            less = np.abs(np.where(moves, tried[1], 0.0)).max(axis=1) < np.abs(np.where(moves, slope, 0.0)).max(axis=1)
            close = np.abs(step).max(axis=1) < _CLOSE  # where f tells no difference any more its slope does
            better = np.where(close, less, tried[0] <= f + 1e-16)
            trust = np.where(better, np.minimum(2.0 * trust, 0.1), 0.25 * np.abs(step).max(axis=1))
            t[better] += step[better]
            f, slope, curved = (
                np.where(better.reshape(-1, *(1,) * (new.ndim - 1)), new, old)
                for new, old in zip(tried, (f, slope, curved), strict=True)
            )
            if last:
                break
        return t, self._loose & (t > low) & (t < high)

    def _at(self, x: FloatArray) -> dict[str, Any]:
        """The nearest places at x, and all that is asked for there."""
        x = np.ascontiguousarray(x, dtype=float)
        key = x.tobytes()
        if self._kept.get("key") != key:
            if self._wild(x):  # a minimiser's trial that is no shape: its series would be long
                return {"f": np.full(self.count, np.nan)}
            t, inside = self._nearest(x)
            one, other = self._both(x, t, True)
            f, _, curved = self._slopes(one, other)
            self._kept.update(key=key, t=t, inside=inside, sides=(one, other), f=f, curved=curved)
        return self._kept

    def _wild(self, x: FloatArray) -> bool:
        """Whether a place's segment bends or twists by more than `_TURNS`, or is not finite."""
        h = self.long
        bends = self._all.reshape(self.count, 2, self._own)[:, :, 7:]
        omega, eta, slope, other, *sideways = np.moveaxis(np.abs(x[bends]), 2, 0)
        bend, twist = omega + other, eta + slope * h
        turn = bend + twist + sum(sideways) if self.free else bend * (1.0 + twist)
        return not float((turn * h).max(initial=0.0)) < _TURNS

    def places(self, x: FloatArray) -> FloatArray:
        """(s, u, s_other, u_other) (k, 4) of the nearest places, within their segments."""
        t = self._at(x)["t"].copy()
        t[:, ::2] = self._from + np.clip(t[:, ::2], 0.0, self.long)
        return np.asarray(t)

    def free_places(self, x: FloatArray) -> FloatArray:
        """(s, s_other) (k, 2) of the nearest places, beyond their segments too, as far as the search goes."""
        return np.asarray(self._at(x)["t"][:, ::2] + self._from)

    def past(self, x: FloatArray) -> FloatArray:
        """How far (k, 2) the places are beyond their segments, l: below 0 before the joint where one begins, above
        behind the one where it ends, 0 within."""
        t = self._at(x)["t"][:, ::2]
        return np.asarray(t - np.clip(t, 0.0, self.long))

    def gaps(self, x: FloatArray) -> FloatArray:
        """By how much (k,) the places are farther from each other than `distance`, l."""
        one, other = self.ends(x)
        return np.asarray(np.linalg.norm(one - other, axis=1) - self.distance)

    def along(self, x: FloatArray) -> BoolArray:
        """Whether parts lie along each other at the places (k,): one of both could as well be elsewhere."""
        here = self._at(x)
        held = np.array([pair.held for pair in self.pairs])
        moves = np.stack([np.ones_like(held), ~held, np.ones_like(held), ~held], axis=1)
        found = np.zeros(self.count, dtype=bool)
        for k, which in enumerate(moves):
            values = np.linalg.eigvalsh(here["curved"][k][np.ix_(which, which)])
            found[k] = values[0] < _VALLEY * values[-1]
        return found

    def bulge(self, x: FloatArray) -> FloatArray:
        """How the gap of two curves bends (k,) along the first, 1/l: f_ss - f_ss'^2 / f_s's', 0 where they lie along
        each other."""
        curved = self._at(x)["curved"][:, ::2, ::2]
        return np.asarray(curved[:, 0, 0] - curved[:, 0, 1] ** 2 / np.maximum(curved[:, 1, 1], _FLAT))

    def beyond(self, x: FloatArray) -> IntArray:
        """On which side (k, 2) of its segment the nearest place would lie further: -1, 1, or 0 where it is inside."""
        t, own = self._at(x)["t"][:, ::2], self.long
        low, high = (bound[:, ::2] for bound in self._room)
        low, high = np.maximum(low, -BEYOND * own), np.minimum(high, (1.0 + BEYOND) * own)
        return (t >= high).astype(np.int64) - (t <= low).astype(np.int64)

    def ends(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Positions (k, 3) of both places."""
        one, other = self._at(x)["sides"]
        return one.place, other.place

    # -- the rows -----------------------------------------------------------------------------------------------------

    def values(self, x: FloatArray) -> FloatArray:
        """(k,)."""
        return np.asarray(self._at(x)["f"])

    def _gradients(self, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """D (k, 3), D_x (k, 3, 2 n), f_x (k, 2 n)."""
        one, other = self._at(x)["sides"]
        apart = one.place - other.place
        by_x = np.concatenate([one.by_x, -other.by_x], axis=2)
        return apart, by_x, np.einsum("kc,kcx->kx", apart, by_x) / self.distance

    @cached_property
    def _all(self) -> IntArray:
        """Columns (k, 2 n) of both places."""
        return np.concatenate([self._columns[0], self._columns[1]], axis=1)

    def jacobian_structure(self) -> tuple[IntArray, IntArray]:
        """One row of 2 n."""
        return np.repeat(np.arange(self.count), self._all.shape[1]), self._all.ravel()

    def jacobian(self, x: FloatArray) -> FloatArray:
        """In the order of the structure."""
        return self._gradients(x)[2].ravel()

    def hessian_structure(self) -> tuple[IntArray, IntArray]:
        """All by all, the lower triangle."""
        rows, places = np.tril_indices(self._all.shape[1])
        one, other = self._all[:, rows].ravel(), self._all[:, places].ravel()
        return np.maximum(one, other), np.minimum(one, other)

    def hessian(self, x: FloatArray, multipliers: FloatArray) -> FloatArray:
        """In the order of the structure."""
        here = self._at(x)
        one, other = here["sides"]
        apart, by_x, _ = self._gradients(x)
        n = self._own
        full = np.einsum("kcx,kcy->kxy", by_x, by_x)
        full[:, :n, :n] += np.einsum("kc,kcxy->kxy", apart, one.xx)
        full[:, n:, n:] -= np.einsum("kc,kcxy->kxy", apart, other.xx)
        mixed = np.einsum("kct,kcx->ktx", np.concatenate([one.by_t, -other.by_t], axis=2), by_x)
        mixed[:, :2, :n] += np.einsum("kc,kctx->ktx", apart, one.tx)
        mixed[:, 2:, n:] -= np.einsum("kc,kctx->ktx", apart, other.tx)
        full, mixed = full / self.distance, mixed / self.distance
        for k, inside in enumerate(here["inside"]):
            where = np.nonzero(inside)[0]
            curved = here["curved"][k][np.ix_(where, where)]
            if where.size and _is_positive(curved):
                full[k] -= mixed[k, where].T @ np.linalg.solve(curved, mixed[k, where])
        rows, places = np.tril_indices(full.shape[1])
        return np.asarray(multipliers[:, None] * full[:, rows, places]).ravel()


def _is_positive(matrix: FloatArray) -> bool:
    values = np.linalg.eigvalsh(matrix)
    return bool(values[0] > _FLAT * max(values[-1], 1e-300))


def _steps(slope: FloatArray, curved: FloatArray, moves: BoolArray, trust: FloatArray) -> FloatArray:
    """Newton's steps (k, 4) of what moves towards a minimum, each no longer than `trust` (k,)."""
    both = moves[:, :, None] & moves[:, None, :]
    values, vectors = np.linalg.eigh(np.where(both, curved, 0.0) + np.eye(4) * ~moves[:, :, None])
    least = _FLAT * np.abs(values).max(axis=1, keepdims=True)
    towards = np.einsum("kij,ki->kj", vectors, np.where(moves, slope, 0.0)) / np.maximum(np.abs(values), least)
    step = -np.where(moves, np.einsum("kij,kj->ki", vectors, towards), 0.0)
    longest = np.maximum(np.abs(step).max(axis=1), 1e-300)
    return step * np.minimum(1.0, trust / longest)[:, None]


def _times(eta: FloatArray, h: FloatArray, jets: FloatArray) -> FloatArray:
    """Jets (k, 3, 15) of (m + n h) g by (a, b, n, m) from those of g, eta (k,) = m + n h."""
    by = np.zeros((len(eta), 4))
    by[:, 2], by[:, 3] = h, 1.0
    out = eta[:, None, None] * jets
    out[:, :, 1:5] += jets[:, :, :1] * by[:, None, :]
    at = 5
    for i in range(4):
        for j in range(i, 4):
            out[:, :, at] += by[:, None, i] * jets[:, :, 1 + j] + by[:, None, j] * jets[:, :, 1 + i]
            at += 1
    return out
