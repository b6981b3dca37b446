"""Which strips lie along each other, and which places of one face the other: stations (docs/theory.md, eq. (5.25)).

Faces that lie along each other are nearest on a line or all over, and no place is nearest. What is held there is a
fixed set: places of either strip that stay on its material, each against the nearest place of the other strip, which
alone slides. Rulings side by side are nearest at an end of what they share, which is an edge of one of both, so that
stations begin on both edges of both strips; where a face bends under the other's ruling they are put between, by what
is deepest (`ribbon.find.strips.lain`).
"""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ribbon.find.strips import touch
from ribbon.judge import nearness
from ribbon.problems.itself.pairs import Pair
from ribbon.problems.strips.between import Touching
from ribbon.problems.strips.problem import StripsProblem

FloatArray = NDArray[np.float64]

#: Angle (rad) of tangents and of normals up to which places of two strips lie along each other, and how far (l_0)
#: beyond what they keep; part of the shorter strip, at the least, along which they do.
_ANGLE, _NEAR, _ALONG = np.deg2rad(5.0), 0.04, 0.5
#: Samples of a segment: where strips are looked at for whether they face each other, and where feet are looked for.
_LOOKED, _SAMPLES = 2, 6
#: Stations of a segment on each edge to begin with.
_EACH = 2
#: Places of a segment on each line, and the lines (over half the width), on which they are looked at.
_FINE, _LINES = 8, (-1.0, 0.0, 1.0)
#: Times that a foot is put on the segment next to its own, and how far beyond that it is then, over its length.
_PASSED, _ON = 4, 1e-10


class Station(NamedTuple):
    """A place (s, u) of the strip `one`, in its own l, held against the strip `other`."""

    one: int
    other: int
    s: float
    u: float


def along(problem: StripsProblem, x: FloatArray) -> list[tuple[int, int]]:
    """The strips one < other that lie along each other at the unknowns x (n,): with their faces, nearer than they soon
    could meet, along half of the shorter one at the least."""
    if not problem.apart or not np.all(np.isfinite(x)):
        return []
    found = []
    seen = [_Seen.of(problem, x, k, _LOOKED) for k in range(len(problem.parts))]
    for one, other in combinations(range(len(problem.parts)), 2):
        a, b = (one, other) if problem.lengths_over[one] <= problem.lengths_over[other] else (other, one)
        if _shared(problem, seen[a], seen[b]) >= _ALONG:
            found.append((one, other))
    return found


class _Seen(NamedTuple):
    """A strip at abscissae s (n,): positions r, half rulings, tangents, normals (n, 3), lengths in l_0."""

    s: FloatArray
    r: FloatArray
    half: FloatArray
    tangent: FloatArray
    normal: FloatArray

    @classmethod
    def of(cls, problem: StripsProblem, x: FloatArray, k: int, each: int) -> _Seen:
        part, sigma = problem.parts[k], problem.lengths_over[k]
        s = abscissae(part.lengths, each)
        r, ruling, _, frame = nearness.shape(part, problem.own(x, k), s)
        return cls(s, sigma * r, sigma * part.half_width * ruling, frame[:, :, 2], frame[:, :, 1])


def abscissae(lengths: FloatArray, each: int) -> FloatArray:
    """Joints and places between them, `each` on every segment."""
    starts = np.concatenate([[0.0], np.cumsum(lengths)])[:-1]
    return np.append((starts[:, None] + lengths[:, None] * np.arange(each) / each).ravel(), 1.0)


def _shared(problem: StripsProblem, a: _Seen, b: _Seen) -> float:
    """The part of a strip's samples that face the other strip."""
    away = a.r[:, None] - b.r[None]
    j = np.argmin(np.einsum("ijc,ijc->ij", away, away), axis=1)
    away = away[np.arange(len(j)), j]
    unit = b.half[j] / np.linalg.norm(b.half[j], axis=1)[:, None]
    aside = np.abs(np.einsum("kc,kc->k", away, unit))
    above = np.abs(np.einsum("kc,kc->k", away, b.normal[j]))
    wide = np.linalg.norm(a.half, axis=1) + np.linalg.norm(b.half[j], axis=1)
    both = (a.tangent, b.tangent[j]), (a.normal, b.normal[j])
    cosines = [np.abs(np.einsum("kc,kc->k", one, two)) for one, two in both]
    faces = (np.minimum(*cosines) > np.cos(_ANGLE)) & (aside < wide) & (above < problem.apart + _NEAR)
    inside = np.abs(np.einsum("kc,kc->k", away, b.tangent[j])) < np.linalg.norm(np.diff(b.r, axis=0), axis=1).max()
    return float(np.mean(faces & inside))


def stations(problem: StripsProblem, pairs: list[tuple[int, int]]) -> list[Station]:
    """Those that are held to begin with, of strips that lie along each other: on both edges of both."""
    found = []
    for pair in pairs:
        for one, other in (pair, pair[::-1]):
            part = problem.parts[one]
            found += [
                Station(one, other, float(s), side * part.half_width)
                for s in abscissae(part.lengths, _EACH)
                for side in (1.0, -1.0)
            ]
    return found


def faced(
    problem: StripsProblem, x: FloatArray, places: list[Station], reach: float
) -> tuple[list[Station], list[Touching]]:
    """Of stations those nearer to the other strip than `reach` (l_0) beyond what is to be kept, sorted by the strips,
    each with its nearest place there at the unknowns x (n,)."""
    seen = {k: _Seen.of(problem, x, k, _SAMPLES) for k in {station.other for station in places}}
    kept: list[Station] = []
    found: list[Touching] = []
    for one, other in sorted({(station.one, station.other) for station in places}):
        own = [station for station in places if (station.one, station.other) == (one, other)]
        part, sigma, b = problem.parts[one], problem.lengths_over[one], seen[other]
        s, u = (np.array([getattr(station, name) for station in own]) for name in ("s", "u"))
        order = np.argsort(s, kind="stable")
        own, s, u = [own[k] for k in order], s[order], u[order]
        r, ruling, _, _ = nearness.shape(part, problem.own(x, one), s)
        away = sigma * (r + u[:, None] * ruling)[:, None] - b.r[None]
        across = np.clip(np.einsum("ijc,jc->ij", away, b.half) / np.einsum("jc,jc->j", b.half, b.half), -1.0, 1.0)
        gap = np.linalg.norm(away - across[..., None] * b.half, axis=2)
        j = np.argmin(gap, axis=1)
        rows = np.arange(len(own))
        near = gap[rows, j] < problem.apart + reach + float(np.linalg.norm(np.diff(b.r, axis=0), axis=1).max())
        near &= ~touch.joined(problem, one, other, s, b.s[j])
        if not near.any():
            continue
        half = problem.parts[other].half_width
        pairs = [
            Pair(float(s[k]), float(u[k]), float(b.s[j[k]]), float(across[k, j[k]]) * half, False, True)
            for k in np.flatnonzero(near)
        ]
        gaps, pairs = _feet(problem, x, one, other, pairs)
        chosen = gaps < reach
        kept += [own[k] for k in np.flatnonzero(near)[chosen]]
        found += [Touching(one, other, pair) for pair, is_near in zip(pairs, chosen, strict=True) if is_near]
    return kept, found


def _feet(
    problem: StripsProblem, x: FloatArray, one: int, other: int, pairs: list[Pair]
) -> tuple[FloatArray, list[Pair]]:
    """Gaps (k,) of stations from their nearest places beside those given, and the pairs, each on its segment."""
    part = problem.parts[other]
    for _ in range(_PASSED):
        rows = problem.with_changes(touching=tuple(Touching(one, other, pair) for pair in pairs)).between(one, other)
        places, past = rows.places(x), rows.past(x)[:, 1]
        beyond = np.where(np.abs(past) > _ON * part.lengths[rows.segments[1]], np.sign(past), 0.0)
        moved, passed = [], False
        for k, (pair, side) in enumerate(zip(pairs, beyond, strict=True)):
            beside = part.beside(int(rows.segments[1, k]), int(side)) if side else None
            at = pair._replace(s_other=float(places[k, 2]), u_other=float(places[k, 3]))
            if beside is not None:
                at, passed = at._replace(s_other=touch.inside(part, beside, int(side))), True
            moved.append(at)
        if not passed:
            break
        pairs = moved
    return rows.gaps(x), moved


def deepest(
    problem: StripsProblem, x: FloatArray, pairs: list[tuple[int, int]], below: float
) -> list[tuple[float, Station]]:
    """Gaps (l_0) over what is to be kept on lines along strips that lie along each other, where least and below
    -`below`, and between which places."""
    found = []
    for pair in pairs:
        for one, other in (pair, pair[::-1]):
            part = problem.parts[one]
            s = abscissae(part.lengths, _FINE)
            for u in _LINES:
                line = [Station(one, other, float(each), u * part.half_width) for each in s]
                kept, touching = faced(problem, x, line, problem.apart)
                if not kept:
                    continue
                here = problem.with_changes(touching=tuple(touching)).between(one, other).gaps(x)
                gaps = np.full(s.size, np.inf)
                gaps[np.searchsorted(s, [station.s for station in kept])] = here
                around = np.pad(gaps, 1, constant_values=np.inf)
                least = np.flatnonzero((gaps < -below) & (gaps <= around[:-2]) & (gaps < around[2:]))
                found += [(float(gaps[k]), line[k]._replace(s=_lowest(s, gaps, int(k)))) for k in least]
    return found


def _lowest(s: FloatArray, gaps: FloatArray, k: int) -> float:
    """Where the parabola through a least gap and those beside it is least."""
    if k in (0, s.size - 1) or not np.isfinite(gaps[k - 1 : k + 2]).all():
        return float(s[k])
    back, on = s[k] - s[k - 1], s[k + 1] - s[k]
    left, right = (gaps[k] - gaps[k - 1]) / back, (gaps[k + 1] - gaps[k]) / on
    bend = (right - left) / (0.5 * (back + on))
    slope = (left * on + right * back) / (back + on)
    return float(np.clip(s[k] - slope / max(bend, 1e-300), s[k] - 0.5 * back, s[k] + 0.5 * on))


def is_held(problem: StripsProblem) -> bool:
    """Whether strips are held at stations."""
    return any(touching.pair.stays for touching in problem.touching)


def deeper(
    problem: StripsProblem, near: list[tuple[float, Touching]], lines: list[tuple[float, Station]], known: list[Station]
) -> list[Station]:
    """Stations where strips are nearer to each other than they are kept (`touch.minima`, `deepest`), beside those
    known: on the strip whose edge is there, or on the one that has none so near."""
    found: list[Station] = []
    places = [[station] for _, station in lines]
    for _, (one, other, pair) in near:
        both = [Station(one, other, pair.s, pair.u), Station(other, one, pair.s_other, pair.u_other)]
        places.append(sorted(both, key=lambda each: abs(each.u) < 0.999 * problem.parts[each.one].half_width))
    for each in places:
        for fresh in each:
            part = problem.parts[fresh.one]
            room = 1e-3 * float(part.lengths.min()), 1e-2 * part.half_width
            if not any(
                (station.one, station.other) == (fresh.one, fresh.other)
                and abs(station.s - fresh.s) < room[0]
                and abs(station.u - fresh.u) < room[1]
                for station in (*known, *found)
            ):
                found.append(fresh)
                break
    return found
