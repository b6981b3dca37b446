"""Two long edges of a shell, and where they are nearest to each other (docs/theory.md, eq. (7.33)). NumPy, SciPy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.spatial.distance import cdist

from shellref.contact.sheet import Sheet

#: Places of an element at which lines are looked at for where they come near.
SAMPLES = 4
#: Newton's iterations for the nearest places, where they end, and the longest of its steps (elements).
ITERATIONS, ENOUGH, LONGEST = 30, 1e-13, 1.0
#: Least sine of the angle by which n leads out of a strip.
OUTSIDE = 0.02


class Ends(NamedTuple):
    """(m,) each: edges 0 (v = -w/2) or 1, and S, of both lines; the first one has the smaller S."""

    one: np.ndarray
    s: np.ndarray
    other: np.ndarray
    t: np.ndarray

    def some(self, mask: np.ndarray) -> Ends:
        """Those of a mask, or of numbers."""
        return Ends(*(x[mask] for x in self))


class Line(NamedTuple):
    """A border line at places: weights (3, m, q) of the nodes by S (values, first and second derivatives), nodes
    (m, q), place (3, m, 3) with its derivatives, director (m, 3)."""

    weights: np.ndarray
    nodes: np.ndarray
    place: np.ndarray
    director: np.ndarray


@dataclass(frozen=True)
class Between:
    """What is between two lines at `ends`: both lines, n (m, 3), |x' x y'| (m,) and z (m,), at a state."""

    ends: Ends
    x: Line
    y: Line
    n: np.ndarray
    cross: np.ndarray
    z: np.ndarray

    @property
    def sine(self) -> np.ndarray:
        """Of the angle of both lines (m,)."""
        lengths = [np.linalg.norm(line.place[1], axis=1) for line in (self.x, self.y)]
        return np.asarray(self.cross / np.maximum(lengths[0] * lengths[1], 1e-300))

    def leads_out(self, side: np.ndarray) -> np.ndarray:
        """Mask (m,) of those whose n, on a side, leads out of both strips past their edges."""
        out = []
        for line, edge, sign in ((self.x, self.ends.one, -1.0), (self.y, self.ends.other, 1.0)):
            across = np.cross(line.director, line.place[1])
            across /= np.maximum(np.linalg.norm(across, axis=1), 1e-300)[:, None]
            outwards = (2.0 * edge - 1.0)[:, None] * across
            out.append(sign * side * np.einsum("mi,mi->m", outwards, self.n) >= OUTSIDE)
        return np.asarray(out[0] & out[1])


def _line(sheet: Sheet, state: np.ndarray, edge: np.ndarray, s: np.ndarray) -> Line:
    """Border lines at S = s (m,) of edges (m,)."""
    weights, nodes = sheet.border(edge, s)
    values = np.einsum("dmq,mqi->dmi", weights, state[nodes])
    return Line(weights, nodes, values[..., :3], values[0, :, 3:])


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.asarray(np.einsum("mi,mi->m", a, b))


def between(sheet: Sheet, state: np.ndarray, ends: Ends) -> Between:
    """What is between the lines of a state (n, 6)."""
    x, y = _line(sheet, state, ends.one, ends.s), _line(sheet, state, ends.other, ends.t)
    n = np.cross(x.place[1], y.place[1])
    cross = np.linalg.norm(n, axis=1)
    n = n / np.maximum(cross, 1e-300)[:, None]
    return Between(ends, x, y, n, cross, np.einsum("mi,mi->m", n, x.place[0] - y.place[0]))


def newton(sheet: Sheet, state: np.ndarray, ends: Ends) -> tuple[Between, np.ndarray]:
    """The nearest places (m,) of lines from others by Newton's method on |F|^2 / 2, and a mask of minima found."""
    longest = LONGEST * float(np.diff(sheet.grid.s_knots).max())
    good, step = np.zeros(len(ends.s), dtype=bool), np.zeros((len(ends.s), 2))
    for _ in range(ITERATIONS):
        x, y = _line(sheet, state, ends.one, ends.s), _line(sheet, state, ends.other, ends.t)
        f = x.place[0] - y.place[0]
        slope = np.stack([_dot(f, x.place[1]), -_dot(f, y.place[1])], axis=1)
        xx, yy = _dot(x.place[1], x.place[1]), _dot(y.place[1], y.place[1])
        xy = -_dot(x.place[1], y.place[1])
        a, b = xx + _dot(f, x.place[2]), yy - _dot(f, y.place[2])
        good = (a > 0.0) & (a * b > xy * xy)
        a, b = np.where(good, a, xx), np.where(good, b, yy * (1.0 + 1e-3))
        det = np.maximum(a * b - xy * xy, 1e-300)
        step = (
            -np.stack([b * slope[:, 0] - xy * slope[:, 1], a * slope[:, 1] - xy * slope[:, 0]], axis=1) / det[:, None]
        )
        step = np.clip(step, -longest, longest)
        ends = ends._replace(s=np.clip(ends.s + step[:, 0], 0.0, 1.0), t=np.clip(ends.t + step[:, 1], 0.0, 1.0))
        if not len(step) or np.abs(step).max() <= ENOUGH:
            break
    inside = (np.minimum(ends.s, ends.t) > 0.0) & (np.maximum(ends.s, ends.t) < 1.0)
    return between(sheet, state, ends), good & inside & (np.abs(step).max(axis=1, initial=0.0) <= 1e-10)


def solved(sheet: Sheet, state: np.ndarray, begin: Ends) -> Between:
    """The nearest places that are found from seeds."""
    found, good = newton(sheet, state, begin)
    return between(sheet, state, found.ends.some(good))


def seeds(sheet: Sheet, state: np.ndarray, reach: float, apart: float, closed: bool) -> Ends:
    """Where two lines are nearer to each other than at all samples around, within reach and a sample's length, at least
    `apart` along the strip."""
    knots = sheet.grid.s_knots
    part = (np.arange(SAMPLES) + 0.5) / SAMPLES
    s = (knots[:-1, None] + np.diff(knots)[:, None] * part).ravel()
    places = [_line(sheet, state, np.full(len(s), edge), s).place[0] for edge in (0, 1)]
    away = s[None, :] - s[:, None]
    far = (away < apart) | (closed & (1.0 - away < apart))
    near = reach + float(np.diff(s).max())
    ends = []
    for one in (0, 1):
        for other in (0, 1):
            d = cdist(places[one], places[other])
            d[far] = np.inf
            i, j = np.nonzero(d <= near)
            least = np.ones(len(i), dtype=bool)
            for a in (-1, 0, 1):
                for b in (-1, 0, 1):
                    at = np.clip(i + a, 0, len(s) - 1), np.clip(j + b, 0, len(s) - 1)
                    least &= d[i, j] <= d[at]
            i, j = i[least], j[least]
            ends.append(Ends(np.full(len(i), one), s[i], np.full(len(i), other), s[j]))
    return Ends(*(np.concatenate(parts) for parts in zip(*ends, strict=True)))
