"""Whether strips that touch keep their distance, push and never pull, and balance: from numbers told of them alone.

A strip's surface is stated again: its centreline by `solve_ivp` from the curvatures told, cubic Hermite polynomials
between places 1 / 2000 of its length apart (exact tangents, so 1e-14 off), and straight rulings on it. The least
distance of two such surfaces is that of rulings, which is a minimum of a quadratic in a square (closed form on its
inside and its four sides), looked for on a grid and then on ever smaller ones. No code of the solver is used.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy  # its parts are loaded where they are first used
from numpy.typing import NDArray

from compare.battery.case import Check
from compare.battery.judge.curve import integrated
from compare.battery.judge.discrete import Discrete

FloatArray = NDArray[np.float64]

#: Furthest (l) that surfaces are nearer than they are kept, push times gap over the largest push, balance.
PENETRATION, COMPLEMENTARY, BALANCED = 1e-6, 1e-8, 1e-8
#: Samples of a surface, and of the smaller grids around its least distances: how many, on how many levels.
_SAMPLES, _FINER, _LEVELS = 601, 9, 6
#: Grid places at which the least distance is looked for on smaller grids, the nearest ones.
_BEGIN = 60
#: Parts of one strip are looked at from so many distances along it on: nearer they are beside each other.
BESIDE = 4.0


@dataclass(frozen=True)
class Told:
    """Two places that are told to touch: of which surfaces, their particles (S, v) in each one's l, the force (3,) on
    the first, and the gap told, both in the unit of all."""

    one: int
    other: int
    at: tuple[float, float]
    at_other: tuple[float, float]
    force: FloatArray
    gap: float


class Sheet:
    """A strip's surface as data of an equilibrium `found` tell it; scale: its length over that of the unit."""

    def __init__(self, found: Any, scale: float = 1.0) -> None:
        joints = np.concatenate([[0.0], np.cumsum(found.problem.lengths)])
        q, free = found.parameters, found.has_free_twist
        sideways = q.shape[1] > 4

        def kappa(s: float) -> FloatArray:
            i = min(max(int(np.searchsorted(joints, s, side="right")) - 1, 0), len(q) - 1)
            u = s - joints[i]
            omega, third = q[i, 0] * u + q[i, 1], q[i, 2] * u + q[i, 3]
            return np.array([omega, q[i, 4] * u + q[i, 5] if sideways else 0.0, third if free else third * omega])

        grid = np.unique(np.clip(np.concatenate([joints, np.linspace(0.0, 1.0, 2001)]), 0.0, joints[-1]))
        points, frames = found.joints
        r, turned = integrated(kappa, joints, frames[0], points[0], grid)
        rates = np.array([self._rate(frame, kappa(s)) for frame, s in zip(turned, grid, strict=True)])
        hermite = scipy.interpolate.CubicHermiteSpline
        self._place, self._frame = hermite(grid, r, turned[:, :, 2]), hermite(grid, turned, rates)
        self._joints, self._q, self.free, self.scale = joints, q, free, scale
        self.half_width = 0.5 * found.problem.strip.relative_width

    @staticmethod
    def _rate(frame: FloatArray, kappa: FloatArray) -> FloatArray:
        one, two, three = kappa
        return np.asarray(frame @ np.array([[0.0, -three, two], [three, 0.0, -one], [-two, one, 0.0]]))

    def eta(self, s: FloatArray) -> FloatArray:
        """eta (k,); 0 where the twist is free, and sections stay square to the centreline."""
        if self.free:
            return np.zeros(s.shape)
        i = np.clip(np.searchsorted(self._joints, s, side="right") - 1, 0, len(self._q) - 1)
        return np.asarray(self._q[i, 2] * (s - self._joints[i]) + self._q[i, 3])

    def rulings(self, s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Middles (..., 3) and halves (..., 3) of the rulings at s, in the unit of all."""
        frame = self._frame(s)
        half = frame[..., 0] + self.eta(s)[..., None] * frame[..., 2]
        return self.scale * self._place(s), self.scale * self.half_width * half

    def particle(self, at: tuple[float, float]) -> tuple[float, FloatArray]:
        """The foot s and the place (3,) of the particle (S, v): s + v eta(s) = S."""
        big, v = at
        s = big
        if not self.free:
            low, high = max(0.0, big - 0.5), min(1.0, big + 0.5)

            def missed(s: float) -> float:
                return float(s + v * self.eta(np.array(s)) - big)

            s = low if missed(low) >= 0.0 else high if missed(high) <= 0.0 else scipy.optimize.brentq(
                missed, low, high, xtol=1e-15
            )  # fmt: skip
        middle, half = self.rulings(np.array(s))
        return float(s), middle + v / self.half_width * half


def apart(r: FloatArray, a: FloatArray, p: FloatArray, b: FloatArray) -> FloatArray:
    """Least distances (...) of the segments r + u a and p + v b, |u|, |v| <= 1, all (..., 3)."""
    d = r - p
    aa, bb, ab = (np.sum(x * y, axis=-1) for x, y in ((a, a), (b, b), (a, b)))
    da, db = np.sum(d * a, axis=-1), np.sum(d * b, axis=-1)
    square = aa * bb - ab * ab
    safe = np.where(square > 1e-14 * aa * bb, square, np.inf)
    u, v = (ab * db - bb * da) / safe, (aa * db - ab * da) / safe
    inside = (np.abs(u) <= 1.0) & (np.abs(v) <= 1.0) & np.isfinite(safe)
    best = np.where(inside, np.linalg.norm(d + u[..., None] * a - v[..., None] * b, axis=-1), np.inf)
    for side in (-1.0, 1.0):
        v = np.clip((db + side * ab) / bb, -1.0, 1.0)
        best = np.minimum(best, np.linalg.norm(d + side * a - v[..., None] * b, axis=-1))
        u = np.clip((side * ab - da) / aa, -1.0, 1.0)
        best = np.minimum(best, np.linalg.norm(d + u[..., None] * a - side * b, axis=-1))
    return np.asarray(best)


def nearest(one: Sheet, other: Sheet, beside: Any = None) -> tuple[float, float, float]:
    """The least distance of two surfaces and the feet of both; beside: (s, s') -> bool of places that are left out."""
    grid = np.linspace(0.0, 1.0, _SAMPLES)
    (r, a), (p, b) = one.rulings(grid), other.rulings(grid)
    found = np.array([apart(r[k], a[k], p, b) for k in range(grid.size)])
    if beside is not None:
        found[beside(grid[:, None], grid[None, :])] = np.inf
    padded = np.pad(found, 1, constant_values=np.inf)
    around = [padded[1 + i : 1 + i + grid.size, 1 + j : 1 + j + grid.size] for i in (-1, 0, 1) for j in (-1, 0, 1)]
    least = np.argwhere((found <= np.min(around, axis=0)) & np.isfinite(found))
    least = least[np.argsort(found[least[:, 0], least[:, 1]], kind="stable")][:_BEGIN]
    best = (np.inf, np.nan, np.nan)
    for i, j in least:
        best = min(best, _finer(one, other, float(grid[i]), float(grid[j]), 1.0 / (_SAMPLES - 1), beside))
    return best


def _finer(one: Sheet, other: Sheet, s: float, t: float, step: float, beside: Any) -> tuple[float, float, float]:
    """The least distance around two feet, on grids that are each a fourth of the last one's step."""
    best = np.inf
    for _ in range(_LEVELS):
        here, there = (np.clip(np.linspace(at - step, at + step, _FINER), 0.0, 1.0) for at in (s, t))
        (r, a), (p, b) = one.rulings(here), other.rulings(there)
        gaps = apart(r[:, None], a[:, None], p[None], b[None])
        if beside is not None:
            gaps = np.where(beside(here[:, None], there[None, :]), np.inf, gaps)
        i, j = np.unravel_index(int(np.argmin(gaps)), gaps.shape)
        if gaps[i, j] <= best:
            best, s, t = float(gaps[i, j]), float(here[i]), float(there[j])
        step *= 0.25
    return best, s, t


def along_itself(distance: float) -> Any:
    """What of one strip is beside itself: nearer along it than `BESIDE` of these distances; and each pair once."""
    return lambda s, t: t - s < BESIDE * distance


def kept(sheets: Sequence[Sheet], distance: float, told: Sequence[Told], beside: Any = None) -> Iterator[Check]:
    """That surfaces keep their distance everywhere, that pushes are told where they touch, and push.

    beside: (one, other) -> what of these two is left out (None: nothing), as of `nearest`; of a strip with itself
    `along_itself` unless it says so.
    """
    worst, text = np.inf, ""
    for one in range(len(sheets)):
        for other in range(one, len(sheets)):
            left_out = None if beside is None else beside(one, other)
            if one == other and left_out is None:
                left_out = along_itself(distance / sheets[one].scale)
            gap, s, t = nearest(sheets[one], sheets[other], left_out)
            if gap < worst:
                worst, text = gap, f"{one} at s = {s:.4g}, {other} at s = {t:.4g}"
    yield Check("nearer than they are kept (l)", distance - worst, PENETRATION, said=text)
    yield from pushed(sheets, distance, told)


def pushed(sheets: Sequence[Sheet], distance: float, told: Sequence[Told]) -> Iterator[Check]:
    """Of places that are told to touch: push times gap, force along what is between them, none that pulls."""
    size = max([1.0, *(float(np.linalg.norm(one.force)) for one in told)])
    open_, aside, pulls = 0.0, 0.0, 0.0
    for one in told:
        here, there = sheets[one.one].particle(one.at)[1], sheets[one.other].particle(one.at_other)[1]
        apart_ = here - there
        gap = float(np.linalg.norm(apart_))
        along = float(one.force @ apart_) / gap
        open_ = max(open_, abs(along * (gap - distance)) / size)
        aside = max(aside, float(np.linalg.norm(one.force - along * apart_ / gap)) / size)
        pulls = max(pulls, -along / size)
    yield Check("push times gap, over the largest push", open_, COMPLEMENTARY)
    yield Check("force aside of what is between the places, over the largest", aside, 1e-6)
    yield Check("pull, over the largest push", pulls, 0.0)


def of_itself(found: Any) -> list[Told]:
    """The pairs that an equilibrium of one strip tells."""
    return [
        Told(0, 0, (pair.s, pair.v), (pair.s_other, pair.v_other), np.asarray(pair.force), pair.gap)
        for pair in found.pairs
    ]


def balanced(found: Any, sheet: Sheet, told: Sequence[Told]) -> Check:
    """Whether the told forces of contact balance the gradient of the restated energy by omega and eta at the joints
    (virtual work; `compare.battery.judge.discrete`); what clamps and walls exert is what balances best. Developable
    strips alone."""
    feet = [(sheet.particle(one.at)[0], sheet.particle(one.at_other)[0]) for one in told]
    own = Discrete(found, places=np.array([s for pair in feet for s in pair]))
    gradient = own.gradient.copy()
    for one, pair in zip(told, feet, strict=True):
        for s, (_, v), sign in zip(pair, (one.at, one.at_other), (1.0, -1.0), strict=True):
            gradient -= own.by_place(s, v, sign * one.force)
    matrix = own.jacobian.T
    scale = np.maximum(np.linalg.norm(matrix, axis=0), 1e-300) if matrix.size else np.ones(0)
    force = scipy.optimize.lsq_linear(
        matrix / scale, -gradient, (-np.inf, np.where(own.one_sided, 0.0, np.inf)), method="bvls", tol=1e-15
    ).x if matrix.size else np.zeros(0)  # fmt: skip
    left = gradient + (matrix / scale @ force if matrix.size else 0.0)
    size = max([1.0, float(np.abs(own.elastic.gradient).max()), *(float(np.linalg.norm(o.force)) for o in told)])
    return Check("told contacts are not in balance, relative to the largest force", float(np.abs(left).max()) / size,
                 BALANCED)  # fmt: skip
