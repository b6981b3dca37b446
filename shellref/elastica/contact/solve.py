r"""Equilibria of a planar elastica in contact: Newton on what touches, by an active set, along a way of problems.

With gaps g_k (`shellref.elastica.contact.rows`) and pushes lambda_k, in the notation of `shellref.elastica.system`,

    balance - sum_k lambda_k dg_k = 0 ,   <n_j, r(1) - end> = 0 ,   g_k = 0 ,   lambda_k > 0 ,   all other gaps >= 0 .

What pulls is let go and what is too near is taken in until neither is left: an exchange of places, since contact is a
condition on all of them (R. Hettich and K. Kortanek 1993, doi:10.1137/1035089). No penalty is in the answer.

Stable when A - sum_k lambda_k d^2 g_k is positive on what keeps the held end and all touching places: its lowest
eigenvalue there against int v^2. The matrices are dense: a push moves all that lies behind it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse

from ribbonbench import clock
from shellref.elastica.contact.near import TOO_NEAR, alike, beside, samples, settled, too_near
from shellref.elastica.contact.places import Moving
from shellref.elastica.contact.rows import Beside, Gap, Row, evaluated, slid
from shellref.elastica.problem import Array
from shellref.elastica.system import System, dense_pairs

#: Push (D w / l^2, of the largest one too) below which a place pulls, and is let go.
PULLS = 1e-9
#: Newton iterations, changes of what touches, and rad that a section may turn in one of them.
ITERATIONS, ROUNDS, MOST_TURN = 30, 60, 1.5
#: Longest, first and shortest step of a way.
LONGEST, FIRST, SHORTEST = 0.1, 0.02, 1e-5
#: Gap (l) within which a shape that is given touches: as exact as such shapes are; what pulls is let go.
TOUCHES = 1e-3
#: How often the way from a shape to what is found beside it is looked at, and how far (l) into what it may not pass.
_LOOKS, _INTO = 40, 5e-3
#: Most looks at whether a bar goes over the strip in a step.
_MOST_LOOKS = 4000.0


@dataclass(frozen=True)
class Touching:
    """z (N + m,) at t, what touches there with the pushes (k,) in D w / l^2; norm of what is left, iterations; the
    lowest eigenvalue where it is known already."""

    t: float
    z: Array
    rows: tuple[Row, ...]
    pushes: Array
    norm: float
    iterations: int
    lowest: float | None = None


class Contact:
    """The contact of one discretisation along one way."""

    def __init__(self, system: System, degree: int, tolerance: float) -> None:
        self.system, self.degree, self.tolerance = system, degree, tolerance
        self._nodes = system.discrete.nodes

    def moving(self, z: Array) -> Moving:
        """Places at z."""
        return Moving(self.system.discrete, self.degree, z[: self.system.count])

    def settle(self, z: Array, t: float, before: Touching | None, rows: tuple[Row, ...]) -> Touching | None:
        """The equilibrium at t beside z (N + m,), what touches begun with `rows`; None: none is found."""
        problem = self.system.way.at(t)
        reference = None if before is None else self.moving(before.z)
        used, rows = 0, tuple(self._at(row, t) for row in rows)
        seen: set[frozenset[tuple[str, float, bool]]] = set()
        for count in range(ROUNDS):
            found = self._newton(z, t, rows)
            if found is None or clock.spent():
                return None
            used += found.iterations
            if self.system.discrete.turned((found.z - z)[: self.system.count]) > MOST_TURN:
                return None
            z, rows = found.z, found.rows
            pulls = found.pushes < -PULLS * max(1.0, float(np.max(np.abs(found.pushes), initial=0.0)))
            key = frozenset((row.label, round(row.s, 6), row.held) for row in rows)
            careful = key in seen or count > ROUNDS // 3
            seen.add(key)
            moving = self.moving(z)
            near = too_near(moving, self._nodes, problem.apart, problem.barriers, reference)
            fresh = [row for row in (self._taken(gap, rows) for gap in near) if row is not None]
            if not pulls.any() and not fresh:
                return replace(found, iterations=used)
            kept = list(rows)
            if pulls.any():
                worst = {int(np.argmin(found.pushes))} if careful else set(np.flatnonzero(pulls).tolist())
                kept = [row for k, row in enumerate(rows) if k not in worst]
            if not (careful and pulls.any()):
                kept += fresh
            rows = tuple(self._sorted_out(moving, kept))
        return None

    def _taken(self, gap: Gap, rows: tuple[Row, ...]) -> Row | None:
        """The row to be taken in for a place that is too near: none for what is in, and for what sags between two
        joints that are (`through` says how far)."""
        row = gap.row
        if any(alike(row, known, self._nodes) for known in rows):
            return None
        cell = int(np.clip(np.searchsorted(self._nodes, row.s, side="right") - 1, 0, len(self._nodes) - 2))
        joints = self._nodes[cell : cell + 2]
        within = all(
            s == 0.0 or any(known.held and beside(replace(row, s=s), known, 1e-6, 1.0) for known in rows)
            for s in joints
        )
        return None if within else row

    def _lined(self, row: Row, rows: list[Row]) -> bool:
        """Whether a place is one of a line of them: others touch on both sides of it, an element away or so."""
        reach = 1.6 * float(np.diff(self._nodes).max())
        others = [other.s - row.s for other in rows if other is not row and beside(row, other, reach, 1.0)]
        return any(d > 0.0 for d in others) and any(d < 0.0 for d in others)

    def _sorted_out(self, moving: Moving, rows: list[Row]) -> list[Row]:
        """Rows slid, those of a line and blunt ones held at a joint, each once."""
        found: list[Row] = []
        for row in rows:
            gap = None if row.held else settled(moving, self._nodes, row, self._lined(row, rows))
            row = row if gap is None else gap.row
            if not any(alike(row, known, self._nodes) for known in found):
                found.append(row)
        return found

    def _at(self, row: Row, t: float) -> Row:
        """The row beside its barrier at t."""
        if isinstance(row, Beside):
            return replace(row, barrier=self.system.way.at(t).barriers[row.number])
        return row

    def gaps(self, z: Array, rows: tuple[Row, ...], second: bool) -> list[Gap] | None:
        """Rows slid to where they are least."""
        moving = self.moving(z)
        found = []
        for row in rows:
            gone = slid(moving, row)
            if gone is None and not row.held:  # no least place beside it: the nearest joint
                at = float(self._nodes[int(np.argmin(np.abs(self._nodes - row.s)))])
                gone = slid(moving, replace(row, s=at, held=True))
            if gone is None:
                return None
            found.append(evaluated(moving, gone, second))
        return found

    def _newton(self, z: Array, t: float, rows: tuple[Row, ...]) -> Touching | None:
        """Newton with these rows at zero."""
        system, count = self.system, self.system.count
        pushes = np.zeros(len(rows))
        for iteration in range(ITERATIONS + 1):
            gaps = self.gaps(z, rows, second=True)
            if gaps is None:
                return None
            rows = tuple(gap.row for gap in gaps)
            slopes = np.array([gap.slope for gap in gaps]).reshape(len(rows), count)
            free = system.discrete.free
            residual = system.residual(z, t)
            if iteration == 0 and len(rows):
                pushes = np.linalg.lstsq(slopes[:, free].T, residual[free], rcond=None)[0]
            residual[free] -= slopes[:, free].T @ pushes
            away = np.array([gap.gap for gap in gaps])
            norm = math.hypot(system.norm(residual), float(np.linalg.norm(away)))
            if not math.isfinite(norm):
                return None
            if norm <= self.tolerance:
                return Touching(t, z, rows, pushes, norm, iteration)
            if iteration == ITERATIONS:
                break
            step = self._step(z, t, gaps, slopes, pushes, np.concatenate([residual, away]))
            if step is None:
                return None
            z, pushes = z - step[: system.size], pushes - step[system.size :]
        return None

    def _step(self, z: Array, t: float, gaps: list[Gap], slopes: Array, pushes: Array, right: Array) -> Array | None:
        """Newton's step of (z, pushes)."""
        system = self.system
        free, size = system.discrete.free, system.size
        matrix = np.zeros((len(right), len(right)))
        matrix[:size, :size] = system.jacobian(z, t).toarray()
        for gap, push in zip(gaps, pushes, strict=True):
            assert gap.bend is not None
            matrix[np.ix_(free, free)] -= push * gap.bend[np.ix_(free, free)]
        matrix[size:, : system.count] = slopes
        matrix[np.ix_(free, np.arange(size, len(right)))] = -slopes[:, free].T
        try:
            step = np.linalg.solve(matrix, right)
        except np.linalg.LinAlgError:
            return None
        return step if np.all(np.isfinite(step)) else None

    def eigenvalues(self, state: Touching, count: int = 3) -> Array:
        """Lowest eigenvalues (count,) of the tangent on what keeps the end and all touching places."""
        system = self.system
        free = system.discrete.free
        tangent = system.discrete.tangent(state.z[: system.count], system.loads(state.z, state.t)).toarray()
        gaps = self.gaps(state.z, state.rows, second=True) or []
        rows = [system.holding(state.z)[:, free]]
        for gap, push in zip(gaps, state.pushes, strict=True):
            assert gap.bend is not None
            tangent -= push * gap.bend[np.ix_(free, free)]
            rows.append(gap.slope[None, free])
        held = np.vstack(rows)
        values, _ = dense_pairs(
            scipy.sparse.csc_matrix(tangent), system.discrete.mass, held, min(count, len(free) - len(held))
        )
        return np.asarray(values)

    def walk(self, start: Touching) -> tuple[Touching, int]:
        """From a state at t = 0 by steps to t = 1, or as far as they go; and how many."""
        here, step, steps = start, FIRST, 0
        last: Touching | None = None
        while here.t < 1.0 and not clock.spent():
            t = min(1.0, here.t + step)
            ahead = here.z
            if last is not None and last.rows and [r.label for r in last.rows] == [r.label for r in here.rows]:
                ahead = here.z + (t - here.t) / (here.t - last.t) * (here.z - last.z)
            there = self.settle(ahead, t, here, here.rows)
            if there is None and ahead is not here.z:
                there = self.settle(here.z, t, here, here.rows)
            if there is not None and self.crossed(here.z, there.z, here.t, t):
                there = None
            if there is None:
                step *= 0.5
                if step < SHORTEST:
                    break
                continue
            steps += 1
            last, here = here, replace(there, iterations=there.iterations + here.iterations)
            if there.iterations <= 8:
                step = min(1.5 * step, LONGEST)
        return here, steps

    def touching(self, z: Array, t: float) -> tuple[Row, ...]:
        """What touches of a shape that is given, within `TOUCHES`."""
        problem = self.system.way.at(t)
        moving = self.moving(z)
        gaps = too_near(moving, self._nodes, problem.apart, problem.barriers, None, TOUCHES)
        return tuple(self._sorted_out(moving, [gap.row for gap in gaps]))

    def passes(self, begin: Array, end: Array, t: float) -> bool:
        """Whether the strip goes through something on the straight way between two shapes (N + m,): deeper than it is
        in either."""
        problem = self.system.way.at(t)

        def depth(share: float) -> float:
            moving = self.moving(begin + share * (end - begin))
            near = too_near(moving, self._nodes, problem.apart, problem.barriers, None, -_INTO)
            return max((-gap.gap for gap in near), default=0.0)

        allowed = max(depth(0.0), depth(1.0)) + _INTO
        return any(depth(share) > allowed for share in np.linspace(0.0, 1.0, _LOOKS + 1)[1:-1])

    def crossed(self, begin: Array, end: Array, from_t: float, to_t: float) -> bool:
        """Whether a bar and the strip go through each other, each going straight, from a shape (N + m,) at one t to
        another at a later one: what goes over a circle comes within half a radius of its centre."""
        first, last = self.system.way.at(from_t).barriers, self.system.way.at(to_t).barriers
        s = samples(self._nodes)
        r = [self.moving(z).shape(s)[2] for z in (begin, end)]
        for one, other in zip(first, last, strict=True):
            radius = min(one.radius, other.radius)
            if math.isinf(radius) or other.side < 0.0:
                continue
            away = [place - np.array(barrier.point) for place, barrier in zip(r, (one, other), strict=True)]
            went = float(np.linalg.norm(away[1] - away[0], axis=1).max())
            looks = 1 + math.ceil(min(_MOST_LOOKS, 4.0 * went / radius))
            for share in np.linspace(0.0, 1.0, looks + 1):
                if np.linalg.norm(away[0] + share * (away[1] - away[0]), axis=1).min() < 0.5 * radius:
                    return True
        return False

    def through(self, state: Touching) -> float:
        """How far (l) any place of the strip is nearer than it may be."""
        problem = self.system.way.at(state.t)
        moving = self.moving(state.z)
        near = too_near(moving, self._nodes, problem.apart, problem.barriers, moving, -1e-14)
        return max((-gap.gap for gap in near), default=0.0)


__all__ = ["TOO_NEAR", "Contact", "Touching"]
