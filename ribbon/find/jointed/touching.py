"""Where a round rod touches itself, as unknowns of its segments: places of their own, and lines with two ends.

A force across bends the curvature's slope: within a segment it costs the order, at a joint nothing. So each place of
contact is a joint on both strands, and of a line every station and the place that faces it. A line ends where the gap
leaves zero with its third derivative: outside of its end, at a distance t from it,

    g(t) = g_1 t + g_2 t^2 / 2 + g_3 t^3 / 6 ,   g_1 = g_2 = 0 ,   g_3 > 0 ,

since nothing exerts a moment at a point; the force there makes g_3 vanish inside. On a line that is too long g_2 > 0,
on one that is too short g_2 < 0. Between stations the push is shared out to them, as by supports of a beam.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ribbon.judge import nearness
from ribbon.problems.itself.pairs import Pair
from ribbon.problems.mixed import MixedProblem
from ribbon.result import Equilibrium

FloatArray = NDArray[np.float64]

#: Where, over a segment, the gap outside of a line's end is looked at.
_LOOKS = np.array([0.25, 0.5, 0.75, 0.95])
#: Segments from one place to the next, at the least.
_LEAST = 4
#: Length of the segments on lines over that beside them: what sags between stations falls with its fourth power.
_SHARE = 0.5
#: Part of a segment below which two places are one.
_SAME = 0.05


@dataclass(frozen=True)
class Line:
    """A line of contact: its first and last abscissa on the strand that comes first, begin < end, and the abscissae
    (segments + 1,) on the other strand that face its joints. These fall, as of a ply, or rise, where both strands run
    the same way, as in a knot. All are over l, in [0, 1].

    closed: it has no ends, since a ring lies on itself all along: begin = 0, end = facing[0], facing[-1] = 1, and the
    last station is the first one with its strands exchanged, so that one row holds both."""

    begin: float
    end: float
    facing: tuple[float, ...]
    closed: bool = False

    @property
    def segments(self) -> int:
        """Between its ends."""
        return len(self.facing) - 1

    @property
    def rows(self) -> int:
        """Stations that are held: all of them, of a closed line all but the last."""
        return len(self.facing) - self.closed

    @property
    def way(self) -> int:
        """1 where both strands run the same way, else -1."""
        return 1 if self.facing[-1] > self.facing[0] else -1

    @property
    def stations(self) -> FloatArray:
        """Abscissae (segments + 1,) of its joints."""
        return np.linspace(self.begin, self.end, self.segments + 1)

    def on(self, segments: int) -> Line:
        """The same line on other segments."""
        facing = np.interp(np.linspace(self.begin, self.end, segments + 1), self.stations, self.facing)
        return replace(self, facing=tuple(map(float, facing)))

    def uneven(self) -> float:
        """How far (l) its middle is from where it goes to itself under half a turn, s to 1 - s."""
        return 0.25 * (self.begin + self.end + self.facing[0] + self.facing[-1]) - 0.5

    def to(self, begin: float, end: float) -> Line:
        """The line between other ends, what faces it continued straight."""
        s, facing = self.stations, np.array(self.facing)
        new = np.linspace(begin, end, s.size)
        out = np.interp(new, s, facing)
        for side, first, second in ((new < s[0], 0, 1), (new > s[-1], -1, -2)):
            slope = (facing[first] - facing[second]) / (s[first] - s[second])
            out[side] = facing[first] + slope * (new[side] - s[first])
        return Line(begin, end, tuple(map(float, out)))


@dataclass(frozen=True)
class Touching:
    """Places of their own, (s, s') over l with s < s', and lines. It is not checked."""

    places: tuple[tuple[float, float], ...] = ()
    lines: tuple[Line, ...] = ()

    def pairs(self) -> tuple[Pair, ...]:
        """Rows: places that slide, then the stations of each line."""
        out = [Pair(s, 0.0, other, 0.0, True) for s, other in self.places]
        for line in self.lines:
            out += [
                Pair(float(s), 0.0, other, 0.0, True, True)
                for s, other in zip(line.stations[: line.rows], line.facing[: line.rows], strict=True)
            ]
        return tuple(out)

    def on(self, length: float) -> Touching:
        """With segments on its lines for ones of about this length (l, positive) beside them: half as long, and four at
        the least."""
        return replace(
            self, lines=tuple(line.on(_count(line.end - line.begin, _SHARE * length)) for line in self.lines)
        )

    def even(self) -> Touching:
        """Of a state that half a turn takes to itself, s to 1 - s: each place halfway between where it is and the image
        of the one that it goes to."""
        own = np.array(self.places).reshape(-1, 2)
        image = 1.0 - own[:, ::-1]
        near = [int(np.argmin(np.abs(own - each).sum(axis=1))) for each in image]
        places = tuple((float(s), float(other)) for s, other in 0.5 * (own + image[near]))
        return Touching(places, self.lines)

    def doubled(self) -> Touching:
        """With twice the segments on its lines."""
        return replace(self, lines=tuple(line.on(2 * line.segments) for line in self.lines))


def _count(gap: float, length: float, least: int = _LEAST) -> int:
    return max(least, round(gap / length - 1e-6))


def joints(
    touching: Touching, length: float, ring: bool, counts: tuple[int, ...] = ()
) -> tuple[FloatArray, tuple[int, ...]]:
    """Joints (p + 1,) of which one is at each place of contact, on both strands, and on lines at all that face each
    other; between them equal segments of about `length`, or `counts` of them; and how many. ring: one halfway too.

    length: over l, positive (ZeroDivisionError for 0); joints: abscissae over l from 0 to 1, which rise where what
    touches does not overlap; counts: from one place, or end of a line, to the next along the strip, those on lines left
    out; where fewer are given than are needed the length says the others.
    """
    fixed = {0.0: 0, 1.0: 0}
    if ring:
        fixed[0.5] = 0
    inside: list[FloatArray] = []
    for s, other in touching.places:
        fixed[s] = fixed[other] = 0
    for line in touching.lines:
        for each in (line.stations, np.array(line.facing)[:: line.way]):
            inside.append(each)
            fixed[float(each[0])] = fixed[float(each[-1])] = 0
    own = sorted(fixed)
    near = _SAME * length
    ends = [own[0]] + [b for a, b in pairwise(own) if b - a > near]
    ends[-1] = 1.0
    out: list[FloatArray] = [np.array([0.0])]
    found: list[int] = []
    for a, b in pairwise(ends):
        own_joints = [each for each in inside if abs(each[0] - a) < near and abs(each[-1] - b) < near]
        if own_joints:
            out.append(own_joints[0][1:])
            continue
        count = counts[len(found)] if len(counts) > len(found) else _count(b - a, length)
        found.append(count)
        out.append(np.linspace(a, b, count + 1)[1:])
    return np.concatenate(out), tuple(found)


def short_line(state: Equilibrium, s: float, other: float, reach: float) -> Line:
    """A line of two segments, `reach` (l) to both sides of a place (s, other) of a state."""
    one, across = state.frame([s, other])[:, :, 2]
    way = reach if one @ across > 0.0 else -reach
    return Line(s - reach, s + reach, (other - way, other, other + way))


def slid(problem: MixedProblem, x: FloatArray, touching: Touching) -> Touching:
    """What touches where it has gone: places beyond their joints too; the ends of lines as they are."""
    if not problem.pairs:
        return touching
    rows = problem.pair_rows()
    at = rows.free_places(x)
    count = len(touching.places)
    places = tuple((float(s), float(other)) for s, other in at[:count])
    lines = []
    for line in touching.lines:
        own = tuple(map(float, at[count : count + line.rows, 1]))
        count += line.rows
        if line.closed:  # its stations go on to where it begins on the other strand
            lines.append(replace(line, end=own[0], facing=(*own, 1.0)))
        else:
            lines.append(replace(line, facing=own))
    return Touching(places, tuple(lines))


def leaving(problem: MixedProblem, x: FloatArray, line: Line) -> FloatArray:
    """How the gap leaves zero outside of both ends of a line: (g_1, g_2, g_3) (2, 3), l^(1 - k); nan at an end beside
    which it is not found."""
    starts = np.concatenate([[0.0], np.cumsum(problem.lengths)])
    out = np.full((2, 3), np.nan)
    for k, (s, facing, way) in enumerate(((line.begin, line.facing[0], -1), (line.end, line.facing[-1], 1))):
        i = problem.segment_at(s + way * 0.5 * problem.lengths.min())
        t = _LOOKS * float(min(abs(starts[i + (way > 0)] - s), problem.lengths[i]))
        guess = [Pair(float(s + way * d), 0.0, float(facing + line.way * way * d), 0.0, True, True) for d in t]
        gaps, found = nearness.narrowed(problem, x, guess)
        if len(found) < t.size:
            continue
        out[k] = np.linalg.lstsq(np.stack([t, t**2 / 2.0, t**3 / 6.0], axis=1), gaps, rcond=None)[0]
    return out
