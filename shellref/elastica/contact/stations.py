r"""Many places of a planar elastica that may touch, at once: gaps, first derivatives, and the sum of the second ones.

As `shellref.elastica.contact.rows` has them for places that are held there (s fixed, the foot s' where it is nearest):
with t, n, k' at the foot, D = r(s) - r(s'), eta = <n, D>, phi' the basis functions there, P = <t, dr(s) - dr(s')>,

    g = side eta - distance ,   dg = side <n, dr(s) - dr(s')> ,   F = eta phi' + P ,
    d^2 g = side [<n, d^2 r(s) - d^2 r(s')> - eta phi' phi' - phi' P - P phi' + k' / (k' eta - 1) F F] ,

and of a barrier g = side (rho - radius), d^2 g = side [<u, d^2 r> + (dr dr - (u dr)(u dr)) / rho]. Of a sum
sum_k lambda_k d^2 g_k the first terms are one integral with the force of all that pushes behind a place,

    sum_k lambda_k <a_k, d^2 r(s_k)> = - int_0^1 <A(s), t> phi phi ,   A(s) = sum over s_k > s of lambda_k a_k ,

element by element, and the rest has the rank of the places: linear in them but for one product of matrices.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from shellref.elastica.contact.barrier import Barrier
from shellref.elastica.contact.near import finer, samples
from shellref.elastica.contact.places import Moving, Places
from shellref.elastica.problem import Array

#: Turn (rad) from which parts of the strip face each other.
FACING = 2.0
#: Newton steps of a foot, the last one's size and the longest (l).
_STEPS, _FOUND, _STRIDE = 30, 1e-13, 0.02


@dataclass(frozen=True)
class Stations:
    """Places s (k,), their feet (k,), sides (k,) and barriers (k,) (-1: the strip itself)."""

    s: Array
    foot: Array
    side: Array
    barrier: Array

    @property
    def keys(self) -> list[tuple[int, int, int]]:
        """What tells one from another: place, side, barrier."""
        return [(round(s * 1e12), int(e), int(b)) for s, e, b in zip(self.s, self.side, self.barrier, strict=True)]

    def of(self, chosen: Array) -> Stations:
        """Some of them."""
        return Stations(*(part[chosen] for part in (self.s, self.foot, self.side, self.barrier)))

    def at(self, foot: Array) -> Stations:
        """With other feet."""
        return Stations(self.s, foot, self.side, self.barrier)


def beside(
    moving: Moving, places: Array, nodes: Array, apart: float | None, barriers: Sequence[Barrier], reach: float
) -> Stations:
    """The places (k,) whose gap to a barrier is below reach (l), and of each the nearest places of the strip on both
    sides that it faces: those farther along, of both ends any."""
    last = len(places) - 1
    theta, _, r = moving.shape(places)
    found: list[tuple[float, float, float, int]] = []
    for number, barrier in enumerate(barriers):
        near = np.flatnonzero(barrier.gaps(r) < reach)
        found += [(float(places[i]), 0.0, 1.0, number) for i in near]
    if apart is not None:
        s = samples(finer(moving, nodes))
        angle, _, place = moving.shape(s)
        t = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        n = np.stack([-t[:, 1], t[:, 0]], axis=1)
        along = r @ t.T - np.sum(place * t, axis=1)
        high = r @ n.T - np.sum(place * n, axis=1)
        i, j = np.nonzero((along[:, :-1] >= 0.0) & (along[:, 1:] < 0.0))
        share = along[i, j] / (along[i, j] - along[i, j + 1])
        eta = (1.0 - share) * high[i, j] + share * high[i, j + 1]
        foot = (1.0 - share) * s[j] + share * s[j + 1]
        turn = np.abs((1.0 - share) * angle[j] + share * angle[j + 1] - theta[i])
        end = (i == 0) | (i == last)
        near = (np.abs(eta) < apart + reach) & ((turn > FACING) | (end & (turn > 0.5 * math.pi)))
        near &= (foot > places[i]) | end
        for side in (1.0, -1.0):
            own = np.flatnonzero(near & (np.sign(eta) == side))
            own = own[np.lexsort((np.abs(eta[own]), i[own]))]
            first = own[np.unique(i[own], return_index=True)[1]]
            found += [(float(places[i[k]]), float(foot[k]), side, -1) for k in first]
    parts = [np.array(part) for part in zip(*found, strict=True)] if found else [np.zeros(0)] * 4
    stations = Stations(parts[0], parts[1], parts[2], parts[3].astype(int))
    return slid(moving, stations)[0]


def slid(moving: Moving, stations: Stations) -> tuple[Stations, Array]:
    """With feet where they are nearest, those that have one; and which (k,) these are."""
    pairs = np.flatnonzero(stations.barrier < 0)
    if not len(pairs):
        return stations, np.ones(len(stations.s), dtype=bool)
    r = moving.shape(stations.s[pairs])[2]
    foot = stations.foot[pairs].copy()
    good = np.ones(len(pairs), dtype=bool)
    for _ in range(_STEPS):
        theta, curvature, at = moving.shape(np.clip(foot, 0.0, 1.0))
        t, apart = np.stack([np.cos(theta), np.sin(theta)], axis=1), r - at
        rate = curvature * (apart[:, 1] * t[:, 0] - apart[:, 0] * t[:, 1]) - 1.0
        good &= rate < -1e-3
        step = np.clip(-np.sum(t * apart, axis=1) / np.where(good, rate, -1.0), -_STRIDE, _STRIDE)
        foot = foot + step
        good &= (foot >= 0.0) & (foot <= 1.0)
        foot = np.clip(foot, 0.0, 1.0)
        if np.abs(step[good]).max(initial=0.0) < _FOUND:
            break
    every = np.ones(len(stations.s), dtype=bool)
    every[pairs] = good & (np.abs(step) < 1e-9)
    feet = stations.foot.copy()
    feet[pairs] = foot
    return stations.at(feet).of(every), every


def openings(moving: Moving, stations: Stations, apart: float, barriers: Sequence[Barrier]) -> Array:
    """Gaps (k,) of stations that have slid, alone."""
    r = moving.shape(stations.s)[2]
    theta, _, foot = moving.shape(stations.foot)
    apart_by = r - foot
    found = stations.side * (np.cos(theta) * apart_by[:, 1] - np.sin(theta) * apart_by[:, 0]) - apart
    for number, barrier in enumerate(barriers):
        own = stations.barrier == number
        found[own] = barrier.gaps(r[own])
    return np.asarray(found)


class Gaps:
    """Gaps (k,) of stations that have slid, with their slopes (k, N)."""

    def __init__(self, moving: Moving, stations: Stations, apart: float, barriers: Sequence[Barrier]) -> None:
        self._moving, self.stations = moving, stations
        self._pairs = np.flatnonzero(stations.barrier < 0)
        self._walls = np.flatnonzero(stations.barrier >= 0)
        count, size = len(stations.s), moving.size
        self.gap, self.slope, self.push = np.zeros(count), np.zeros((count, size)), np.zeros((count, 2))
        self.place = np.zeros((count, 2))
        side = stations.side[self._pairs]
        self._one, self._other = moving.at(stations.s[self._pairs]), moving.at(stations.foot[self._pairs])
        between = self._one.position - self._other.position
        self._eta = np.sum(self._other.normal * between, axis=1)
        moves = self._one.moves - self._other.moves
        self._pull = np.einsum("kd,kdn->kn", self._other.tangent, moves)
        self.gap[self._pairs] = side * self._eta - apart
        self.slope[self._pairs] = side[:, None] * np.einsum("kd,kdn->kn", self._other.normal, moves)
        self.push[self._pairs] = side[:, None] * self._other.normal
        self.place[self._pairs] = self._one.position
        self._beside: Places = moving.at(stations.s[self._walls])
        outward = [barriers[int(b)].outward(r) for b, r in
                   zip(stations.barrier[self._walls], self._beside.position, strict=True)]  # fmt: skip
        u = np.array([one for one, _ in outward]).reshape(-1, 2)
        sides = np.array([barriers[int(b)].side if near else 1.0
                          for b, (_, near) in zip(stations.barrier[self._walls], outward, strict=True)])  # fmt: skip
        self._near, self._sides = np.array([near for _, near in outward], dtype=float), sides
        self._u = u
        for k, place in zip(self._walls, self._beside.position, strict=True):
            self.gap[k] = barriers[int(stations.barrier[k])].gaps(place[None])[0]
        self.slope[self._walls] = sides[:, None] * np.einsum("kd,kdn->kn", u, self._beside.moves)
        self.push[self._walls], self.place[self._walls] = sides[:, None] * u, self._beside.position

    def bent(self, pushes: Array) -> Array:
        """sum_k lambda_k d^2 g_k, shape (N, N)."""
        own = pushes[self._pairs] * self.stations.side[self._pairs]
        wall = pushes[self._walls] * self._sides
        s = np.concatenate([self._one.s, self._other.s, self._beside.s])
        force = np.concatenate([own[:, None] * self._other.normal, -own[:, None] * self._other.normal,
                                wall[:, None] * self._u])  # fmt: skip
        found = self._moving.bent_by(s, force)
        phi, pull, eta, k = self._other.phi, self._pull, self._eta, self._other.curvature
        first = eta[:, None] * phi + pull
        found -= phi.T @ ((own * eta)[:, None] * phi)
        cross = phi.T @ (own[:, None] * pull)
        found -= cross + cross.T
        found += first.T @ ((own * k / (k * eta - 1.0))[:, None] * first)
        across = np.einsum("kd,kdn->kn", np.stack([-self._u[:, 1], self._u[:, 0]], axis=1), self._beside.moves)
        return found + across.T @ ((wall * self._near)[:, None] * across)
