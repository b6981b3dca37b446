"""Long edges of a shell kept apart: the nearest places of two border lines, with exact derivatives. NumPy, SciPy.

Two lines x(s) and y(t) of the surface's borders, smooth along the strip (shellref.contact.sheet), are nearest to each
other, or cross, where what is between them is along their common normal (docs/theory.md, eq. (7.33)):

    F = x(s) - y(t) = z n ,   n = x' x y' / |x' x y'| ,   g = sigma z - apart ,

sigma = 1 or -1: on which side of the other line the first one is. z has a sign, so that lines that went through each
other are told, and pushed back. n is normal to both lines and to its own changes: with p = (s, t), F linear in the
nodal values q,

    dz = n . F_q dq ,   d2z = F_q^T (dn/dq) + (n . F_qp) p'

(docs/theory.md, eq. (7.34)), finite for z = 0 too. The push along n on nodes of both lines balances itself to rounding.

A row is there where no face is nearer: where n leads out of both strips, past their edges. What lies before a face has
a row of nodes (shellref.contact.pairs); edges that are all but parallel have no nearest places of their own.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from shellref.contact.lines import Between, Ends, between, newton, seeds, solved
from shellref.contact.pairs import FOLLOWED, MOST_REACH, NEIGHBOURS, NOTHING, REACH
from shellref.contact.rows import MOST_PARTS, Entries, Gradients
from shellref.contact.sheet import Sheet
from shellref.contact.walls import Standing

#: Least sine of the angle of two edges.
PARALLEL = 0.1
#: S by which two minima are the same.
SAME = 1e-7
#: Parts of a row of edges follow those of rows of nodes (a label tells them apart).
OTHER_PARTS = MOST_PARTS // 2


@dataclass(frozen=True)
class EdgeRows:
    """The long edges of a shell before each other. number: of the strip among what is touched; side (m,)."""

    sheet: Sheet
    material: np.ndarray  # (n, 2) S and v of all nodes
    apart: float
    closed: bool
    number: int
    between: Between
    side: np.ndarray
    seen: Any = field(default=None, compare=False)  # the state to which it belongs

    @classmethod
    def of(cls, sheet: Sheet, material: np.ndarray, apart: float, closed: bool, number: int) -> EdgeRows:
        """Without a state there are none."""
        none = np.zeros(0)
        ends = Ends(none.astype(int), none, none.astype(int), none)
        there = between(sheet, np.zeros((len(material), 6)), ends)
        return cls(sheet, material, apart, closed, number, there, none)

    def __len__(self) -> int:
        return len(self.side)

    @property
    def ends(self) -> Ends:
        """Where the nearest places are."""
        return self.between.ends

    @property
    def nodes(self) -> np.ndarray:
        """(m,): the node of the first line that has most of it."""
        line = self.between.x
        most = np.argmax(line.weights[0], axis=1) if len(self) else np.zeros(0, dtype=int)
        return np.asarray(line.nodes[np.arange(len(self)), most], dtype=int)

    @property
    def walls(self) -> np.ndarray:
        """(m,)."""
        return np.full(len(self), self.number)

    @property
    def sides(self) -> np.ndarray:
        """(m,): of no face."""
        return np.zeros(len(self))

    @property
    def parts(self) -> np.ndarray:
        """(m,): where along the strip the second line is met, and which edge that is."""
        place = np.clip((self.ends.t * 64).astype(int), 0, OTHER_PARTS // 2 - 1)
        return np.asarray(OTHER_PARTS + 2 * place + self.ends.other)

    @property
    def normals(self) -> np.ndarray:
        """(m, 3)."""
        return np.asarray(self.side[:, None] * self.between.n)

    @property
    def places(self) -> np.ndarray:
        """(m, 4): S and v on both lines."""
        v = self.sheet.grid.v_knots[[0, -1]]
        return np.column_stack([self.ends.s, v[self.ends.one], self.ends.t, v[self.ends.other]])

    @property
    def distances(self) -> np.ndarray:
        """(m,) of both lines."""
        return np.abs(self.between.z)

    @property
    def neighbours(self) -> float:
        """Length along the strip (l) within which nothing is another part."""
        return max(NEIGHBOURS[0] * self.apart, NEIGHBOURS[1] * float(np.diff(self.sheet.grid.s_knots).max()))

    @property
    def reach(self) -> float:
        """How far (l) lines are looked for."""
        size = float(np.diff(self.sheet.grid.s_nodes).max())
        return float(np.max(np.array(REACH) * (self.apart, size, 1.0)))

    def search(self, state: np.ndarray, reach: float) -> Between:
        """All nearest places of two edges at a state (n, 6), within reach, in the order of both S."""
        found = solved(self.sheet, state, seeds(self.sheet, state, reach, self.neighbours, self.closed))
        ends, away = found.ends, found.ends.t - found.ends.s
        good = (np.abs(found.z) <= reach) & (found.sine >= PARALLEL) & (away >= self.neighbours)
        if self.closed:
            good &= 1.0 - away >= self.neighbours
        keys = np.column_stack([ends.one, ends.other, np.round(ends.s / SAME), np.round(ends.t / SAME)])[good]
        _, first = np.unique(keys, axis=0, return_index=True)
        return between(self.sheet, state, ends.some(np.flatnonzero(good)[np.sort(first)]))

    def at(self, state: np.ndarray, standing: Standing) -> tuple[EdgeRows, np.ndarray | None]:
        """The pairs at a state, and which of these each was."""
        if state is self.seen:
            return self, None
        found = self.search(state, self.reach)
        before = self.followed(found.ends)
        side = np.where(found.z < 0.0, -1.0, 1.0)
        side[before >= 0] = self.side[before[before >= 0]]
        keep = found.leads_out(side)
        there = between(self.sheet, state, found.ends.some(keep))
        return replace(self, between=there, side=side[keep], seen=state), before[keep]

    def followed(self, ends: Ends) -> np.ndarray:
        """Which of these pairs (m,) new ones are, -1 none."""
        before = np.full(len(ends.s), -1)
        taken: set[int] = set()
        old = self.ends
        for k in range(len(before)):
            away = np.maximum(np.abs(old.s - ends.s[k]), np.abs(old.t - ends.t[k]))
            away[(old.one != ends.one[k]) | (old.other != ends.other[k])] = np.inf
            away[list(taken)] = np.inf
            if len(away) and float(away.min()) < FOLLOWED:
                before[k] = int(np.argmin(away))
                taken.add(int(before[k]))
        return before

    def passed(self, before: np.ndarray, after: np.ndarray, standing: tuple[Standing, Standing]) -> bool:
        """Whether two edges are on the other side of each other at a state than they were at the one before."""
        moved = float(np.linalg.norm(after[:, :3] - before[:, :3], axis=1).max())
        reach = min(self.reach + 2.0 * moved, MOST_REACH)
        was = self.search(before, reach)
        side = np.where(was.z < 0.0, -1.0, 1.0)
        was = between(self.sheet, before, was.ends.some(was.leads_out(side)))
        if not len(was.z):
            return False
        now = self.search(after, reach)
        which = replace(self, between=was, side=np.sign(was.z)).followed(now.ends)
        one, other = was.z[which], now.z
        least = np.minimum(np.abs(one), np.abs(other))
        return bool(np.any((which >= 0) & (one * other < 0.0) & (least > NOTHING)))

    def crossing(self, state: np.ndarray) -> tuple[float, float] | None:
        """None: an edge that went through the strip is on the wrong side of its surface (shellref.contact.pairs)."""
        return None

    def points(self, state: np.ndarray) -> np.ndarray:
        """Where the places of the first lines are (m, 3)."""
        return np.asarray(np.einsum("mq,mqi->mi", self.between.x.weights[0], state[self.between.x.nodes, :3]))

    def gaps(self, state: np.ndarray, standing: Standing, heights: np.ndarray) -> np.ndarray:
        """(m,)."""
        z = self.between.z
        if state is not self.seen and len(self):
            z = newton(self.sheet, state, self.ends)[0].z
        return np.asarray(self.side * z - self.apart)

    @cached_property
    def _gradients(self) -> Gradients:
        """Those of the gaps by the positions of the nodes of both lines."""
        x, y = self.between.x, self.between.y
        nodes, weights = np.hstack([x.nodes, y.nodes]), np.hstack([x.weights[0], -y.weights[0]])
        count = (len(nodes), 3 * nodes.shape[1])
        columns = (6 * nodes[:, :, None] + np.arange(3)).reshape(count)
        return Gradients((weights[:, :, None] * self.normals[:, None, :]).reshape(count), columns)

    def applied(self, fields: np.ndarray) -> np.ndarray:
        """b . field (m,), of nodal increments (n, 6)."""
        return self._gradients.applied(fields)

    def rates(self, rate: Standing) -> np.ndarray:
        """(m,): nothing moves by itself."""
        return np.zeros(len(self))

    def forces(self, pushes: np.ndarray, n: int) -> np.ndarray:
        """sum of b lambda (n, 6)."""
        return self._gradients.forces(pushes, n)

    def matrix(self, some: np.ndarray, n: int) -> Any:
        """The rows `some`."""
        return self._gradients.matrix(some, n)

    def curvature(self, pushes: np.ndarray, n: int) -> Entries | None:
        """Of those that push."""
        some = np.flatnonzero(pushes)
        if not len(some):
            return None
        blocks = (pushes[some] * self.side[some])[:, None, None] * self.second()[some]
        return self._gradients.entries(some, blocks)

    def second(self) -> np.ndarray:
        """d2z (m, c, c) by the positions of the nodes in the order of the columns."""
        at = self.between
        n, x, y = at.n, at.x, at.y
        none = [np.zeros_like(line.weights[0]) for line in (x, y)]
        by_q = _spread(np.hstack([x.weights[0], -y.weights[0]]))  # F_q (m, 3, c)
        slope_x = _spread(np.hstack([x.weights[1], none[1]]))
        slope_y = _spread(np.hstack([none[0], y.weights[1]]))

        def turned(dx: np.ndarray, dy: np.ndarray) -> np.ndarray:
            """What changes (m, 3, k) of x' and y' make of n."""
            found = np.cross(dx, y.place[1][:, :, None], axis=1) + np.cross(x.place[1][:, :, None], dy, axis=1)
            found = found / at.cross[:, None, None]
            return np.asarray(found - n[:, :, None] * np.einsum("mi,mik->mk", n, found)[:, None, :])

        nothing = np.zeros_like(n)[:, :, None]
        along = [turned(x.place[2][:, :, None], nothing), turned(nothing, y.place[2][:, :, None])]
        of_q = turned(slope_x, slope_y)
        z = at.z[:, None, None]
        j = np.concatenate(
            [x.place[1][:, :, None] - z * along[0], -y.place[1][:, :, None] - z * along[1], -n[:, :, None]], axis=2
        )
        moved = -np.linalg.solve(j, by_q - z * of_q)[:, :2]  # p' (m, 2, c)
        whole = of_q + along[0] * moved[:, :1] + along[1] * moved[:, 1:]
        mixed = np.stack([np.einsum("mi,mic->mc", n, one) for one in (slope_x, -slope_y)], axis=1)
        found = np.einsum("mic,mid->mcd", by_q, whole) + np.einsum("mkc,mkd->mcd", mixed, moved)
        return np.asarray(0.5 * (found + np.swapaxes(found, 1, 2)))


def _spread(weights: np.ndarray) -> np.ndarray:
    """(m, 3, 3 q) of weights (m, q) of nodes."""
    m, q = weights.shape
    return np.asarray(np.einsum("mq,ij->miqj", weights, np.eye(3)).reshape(m, 3, 3 * q))
