"""Which places of a shell push on what they touch: a primal-dual active set within Newton's iteration. NumPy, SciPy.

At an equilibrium, with r = dE/du, gaps g and pushes lambda of all places (docs/theory.md, eq. (7.26)),

    P^T (r - sum b lambda) = 0 ,   g >= 0 ,   lambda >= 0 ,   lambda g = 0 .

The last three are lambda = max(0, lambda - c g) for any c > 0, which Newton's iteration solves though it has corners
(semi-smooth: Hintermueller, Ito and Kunisch 2002, doi:10.1137/S1052623401383558): a step keeps the gaps of the active
places at zero and takes no push at the others; then places that would go through become active, and those that pull
are let go. It ends where the set no longer changes: no penalty, no tolerance of a contact law is in the answer.

A plate's compliance is not that of a membrane: from a set that is far off, full steps of this kind chatter. Then the
walls are soft for a while (lambda = -stiffness g, the system's lower block -1/stiffness): that settles within a few
steps, and the walls are made stiffer (`STIFFER`) until they are rigid again, from a set that is nearly right. The
answer knows nothing of that.

Where a set comes back the steps go round in a circle. From there on places that go through come first, all of them,
and where there are none those that pull most are let go (`HARD` of the worst); where that goes round too, one place
changes at a time.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import csr_matrix

from shellref.contact.everywhere import Everywhere
from shellref.contact.rows import HELD, independent, lengths
from shellref.contact.saddle import Saddle
from shellref.contact.touching import Touching
from shellref.contact.walls import Standing, WallPath

#: Gap (over l) below which a place touches where nothing is known of it yet; and where walls alone carry the strip and
#: nothing touches so, the same above the lowest place.
TOUCHES, LOWEST = 1e-6, 1e-4
#: Gap (l) and push (of the largest one, at least 1 D w / l^2) within which a place is on its wall, and does not pull.
THROUGH, PULLS = 1e-11, 1e-9
#: Stiffness of walls that are soft for a while, D / l^4, over the largest pressure there is (at least 1 D / l^3); after
#: how many iterations with changes, and more than how many places at once, they become so.
STIFFER = (1e4, 1e6, 1e8)
PATIENCE, MANY = 2, 4
#: Part of what is behind soft walls that may still change when they are made stiffer; iterations with them, at most.
FEW, MOST_SOFT = 0.1, 40
#: Part of the deepest gap below zero from which places of something curved come to push at once.
NEARLY = 0.9
#: Part of the hardest pull from which places are let go, where all at once went round in a circle.
HARD = 0.3
#: Push over the largest one below which a place that touches does so weakly (strict complementarity fails there).
WEAKLY = 1e-6


#: Cosine of director and normal below which both faces of a node may be on a wall at once (a strip on edge).
ACROSS = 0.1


class Snapshot(NamedTuple):
    """What a contact is at a state."""

    rows: Touching
    active: np.ndarray
    pushes: np.ndarray
    heights: np.ndarray
    known: bool


@dataclass(frozen=True)
class Judged:
    """Complementarity of a state: deepest gap below zero at a place (l), largest pull and the largest |lambda g| over
    the largest push, and the number of places that touch weakly."""

    through: float
    pull: float
    product: float
    weakly: int


def other_faces(rows: Touching) -> tuple[np.ndarray, np.ndarray]:
    """Numbers (p,) of the rows of upper faces, and (p,) of the lower face of the same node and wall."""
    if not rows.sides.any():
        return np.zeros(0, dtype=int), np.zeros(0, dtype=int)
    key = rows.keys
    upper, lower = np.flatnonzero(rows.sides > 0.0), np.flatnonzero(rows.sides < 0.0)
    _, a, b = np.intersect1d(key[upper], key[lower], assume_unique=True, return_indices=True)
    return upper[a], lower[b]


class Contact:
    """Rows of a shell with the active ones, their pushes (m,) in D w / l^2 and the ways (walls,) of plates in l."""

    def __init__(
        self, path: WallPath, rows: Touching, comm: Any, own: int, everywhere: Everywhere,
        areas: np.ndarray, carries: bool,
    ):  # fmt: skip
        """rows, areas (N,): of all nodes; own: the first unknowns, each of a node of its own; carries: nothing but
        walls holds the strip along some of their normals. States and fields of nodes (n, 6) are a process's own."""
        self.path, self._n, self.areas = path, len(everywhere.nodes), areas
        self._own, self._carries, self.everywhere = own, carries, everywhere
        self.saddle = Saddle(comm)
        self.springs = path.springs
        self._plates = np.flatnonzero(self.springs)
        m = len(rows)
        self.active, self.pushes, self.heights = np.zeros(m, dtype=bool), np.zeros(m), np.zeros(len(self.springs))
        self._known = False
        self._held = np.zeros(0, dtype=int)  # numbers of the rows of the factors last made
        self._seen: set[bytes] = set()
        self._care = self._tries = self._hardness = 0
        self._may_soften = True
        self._lost = 0
        self._put(rows)

    def _put(self, rows: Touching) -> None:
        self.rows = rows
        self._areas, self._others = self.areas[rows.nodes], other_faces(rows)

    def see(self, state: np.ndarray, standing: Standing) -> None:
        """Gradients, and of parts of the strip the places, at a state (n, 6): what pushed and is still there does."""
        rows, before = self.rows.at(self.everywhere.every(state), standing)
        if rows is self.rows:
            return
        if before is None:
            self.rows = rows
            return
        known = before >= 0
        self._lost += int(self.active.sum()) - int(self.active[before[known]].sum())
        self.active = np.where(known, self.active[before], False) if len(self.active) else np.zeros(len(rows), bool)
        self.pushes = np.where(known, self.pushes[before], 0.0) if len(self.pushes) else np.zeros(len(rows))
        self._put(rows)

    def snapshot(self) -> Snapshot:
        """To come back to."""
        return Snapshot(self.rows, self.active.copy(), self.pushes.copy(), self.heights.copy(), self._known)

    def restore(self, of: Snapshot) -> None:
        """Back to a snapshot."""
        self._put(of.rows)
        self.active, self.pushes, self.heights = of.active.copy(), of.pushes.copy(), of.heights.copy()
        self._known = of.known

    def begin(self, state: np.ndarray, standing: Standing) -> None:
        """A new iteration at a state (n, 6): the active set of the last one, or of what touches."""
        self.see(state, standing)
        self._lost = 0
        self._seen = set()
        self._care = self._tries = self._hardness = 0
        self._may_soften = True
        if self._known:
            return
        gaps = self.gaps(state, standing)
        self.active = gaps <= TOUCHES
        if self._carries and len(gaps):
            least = np.array([np.min(gaps[self.rows.walls == k], initial=np.inf) for k in range(len(self.springs))])
            nearest = gaps <= least[self.rows.walls] + LOWEST
            self.active |= nearest & (np.min(least) == least)[self.rows.walls] & (np.min(least) > TOUCHES)
        self.active = self.everywhere.agreed(self._one_face(self.active, gaps))
        self.pushes[:] = 0.0
        self._known = True

    def gaps(self, state: np.ndarray, standing: Standing) -> np.ndarray:
        """(m,) at a state (n, 6)."""
        return self.rows.gaps(self.everywhere.every(state), standing, self.heights)

    def applied(self, field: np.ndarray) -> np.ndarray:
        """b . field (m,), of nodal increments (n, 6)."""
        return self.rows.applied(self.everywhere.every(field))

    def passed(self, before: np.ndarray, after: np.ndarray, standing: tuple[Standing, Standing]) -> bool:
        """Whether from one state (n, 6) to the next the strip went through a body, or parts of it each other."""
        every = self.everywhere.every
        return bool(self.everywhere.agreed(self.rows.passed(every(before), every(after), standing)))

    def crossing(self, state: np.ndarray) -> tuple[float, float] | None:
        """S of both parts where a state (n, 6) crosses itself; None: it does not."""
        found: tuple[float, float] | None = self.everywhere.agreed(self.rows.crossing(self.everywhere.every(state)))
        return found

    def forces(self) -> np.ndarray:
        """(n, 6): what is exerted on the nodes."""
        return self.everywhere.own(self.rows.forces(self.pushes, self._n))

    def curvature(self) -> Any:
        """(6 N, 6 N) second derivatives of the gaps times the pushes, scipy.sparse; None: there are none."""
        return self.rows.curvature(self.pushes, self._n)

    def bent(self, step: np.ndarray) -> np.ndarray | None:
        """`curvature` times nodal increments (n, 6); None: there are none."""
        bend = self.curvature()
        if bend is None:
            return None
        whole = self.everywhere.every(step)
        return self.everywhere.own((bend @ whole.ravel()).reshape(whole.shape))

    @property
    def energy(self) -> float:
        """Of the plates' springs, D w / l."""
        return float(0.5 * np.sum(self.springs * self.heights**2))

    def factor(self, tangent: Any, projection: Any) -> None:
        """Factorise the tangent (PETSc) on what keeps the active places on their walls; projection: P (6 N, unknowns).

        Raises petsc_api.FactorisationFailed.
        """
        held = np.flatnonzero(self.active)
        rows = (self.rows.matrix(held, self._n) @ projection).tocsr()
        moved = lengths(rows) > HELD
        held, rows = held[moved], rows[moved]
        if self._own < rows.shape[1] and len(held):
            keep = independent(rows, self._own)
            held, rows = held[keep], rows[keep]
        self._held = held
        on = csr_matrix((len(held), len(self._plates)))
        if len(self._plates):
            place = np.searchsorted(self._plates, self.rows.walls[held])
            springy = self.springs[self.rows.walls[held]] > 0.0
            at = np.flatnonzero(springy)
            on = csr_matrix((np.ones(len(at)), (at, place[springy])), shape=(len(held), len(self._plates)))
        give = np.zeros(len(held))
        if self._hardness:
            pressure = max(1.0, float(np.max(self.pushes / self._areas, initial=0.0)))
            give = 1.0 / (pressure * STIFFER[self._hardness - 1] * self._areas[held])
        bend = self.curvature()
        if bend is not None:
            bend = -(projection.T @ bend @ projection)
        self.saddle.factor(tangent, rows, self.springs[self._plates], on, give, bend)

    def solve(self, right: np.ndarray, rates: np.ndarray) -> np.ndarray:
        """du (unknowns,) with K du + ... = right and b . du = rates (m,) at the active places, with the last factors:
        plates give way."""
        return self.saddle.solve_all(right, np.zeros(len(self._plates)), rates[self._held])[0]

    def correct(self, right: np.ndarray, gaps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(du (unknowns,), dq (walls,)) of a Newton step, right = -P^T r, gaps (m,) where held nodes are put; takes
        the pushes that belong to it and moves the plates."""
        plates = self._plates
        moved = np.zeros(len(self.springs))
        on_plates = -self.springs[plates] * self.heights[plates]
        step, moved[plates], found = self.saddle.solve_all(right, on_plates, -gaps[self._held])
        self.pushes[:] = 0.0
        self.pushes[self._held] = found
        self.heights += moved
        return step, moved

    def update(self, gaps: np.ndarray) -> int:
        """The active set after a step that leads to these gaps (m,); how many places changed."""
        changed = self._updated(gaps)
        self.active, changed = self.everywhere.agreed((self.active, changed))
        self.pushes[~self.active] = 0.0
        return changed

    def _updated(self, gaps: np.ndarray) -> int:
        size = max(1.0, float(np.max(np.abs(self.pushes), initial=0.0)))
        through = self._deepest(~self.active & (gaps < -THROUGH), gaps)
        pulls = self.active & (self.pushes < -PULLS * size)
        changed = through | pulls
        if self._hardness:
            return self._while_soft(gaps)
        lost, self._lost = self._lost, 0
        if not changed.any():
            return lost
        self._tries += 1
        if self._tries > PATIENCE and np.sum(changed) > MANY and self._may_soften:
            self._hardness, self._may_soften = 1, False
        changed = self._careful(through, pulls, gaps)
        key = np.sort(self.rows.labels[self.active ^ changed]).tobytes()
        if key in self._seen and self._care < 2:
            self._care, self._seen = self._care + 1, set()
            changed = self._careful(through, pulls, gaps)
            key = np.sort(self.rows.labels[self.active ^ changed]).tobytes()
        self._seen.add(key)
        before = self.active.copy()
        self.active = self._one_face(self.active ^ changed, gaps)
        changed = self.active ^ before
        self.pushes[~self.active] = 0.0
        return int(changed.sum()) + lost

    def _deepest(self, through: np.ndarray, gaps: np.ndarray) -> np.ndarray:
        """Of the places that go through (m,) all of walls, and of everything curved those nearly as deep as the
        deepest: where something touches at a point, many places at once would be held as on a plate."""
        curved = through & (self.rows.walls >= len(self.path.normals))
        if not curved.any():
            return through
        deepest = np.zeros(len(self.springs))
        np.minimum.at(deepest, self.rows.walls[curved], gaps[curved])
        return through & (~curved | (gaps <= NEARLY * deepest[self.rows.walls]))

    def _while_soft(self, gaps: np.ndarray) -> int:
        """The set where walls are soft: what is behind them; stiffer ones when that has settled."""
        behind = gaps < 0.0
        changed = behind ^ self.active
        if np.sum(changed) <= max(MANY, FEW * np.sum(behind)) or self._tries > MOST_SOFT:
            self._hardness = (self._hardness + 1) % (len(STIFFER) + 1)
        self._tries += 1
        self.active = self._one_face(behind, gaps)
        self.pushes[~self.active] = 0.0
        return max(1, int(changed.sum()))

    def _one_face(self, active: np.ndarray, gaps: np.ndarray) -> np.ndarray:
        """The set (m,) with one face of each node on a wall, the nearer one: both, n . d = (g+ - g-) / h, are the same
        row where the director is along the normal, and touch together only where it is across."""
        first, second = self._others
        both = active[first] & active[second] & (np.abs(gaps[first] - gaps[second]) > 2.0 * ACROSS * self.rows.lever)
        active = active.copy()
        active[np.where(gaps[first] > gaps[second], first, second)[both]] = False
        return active

    def _careful(self, through: np.ndarray, pulls: np.ndarray, gaps: np.ndarray) -> np.ndarray:
        """Mask (m,) of the places to change of those that go through and those that pull."""
        if self._care == 0:
            return through | pulls
        some = through if through.any() else pulls & (self.pushes <= HARD * np.min(self.pushes))
        if self._care == 1:
            return some
        one = np.zeros_like(some)
        one[int(np.argmin(np.where(some, gaps if through.any() else self.pushes, np.inf)))] = True
        return one

    def judged(self, state: np.ndarray, standing: Standing) -> Judged:
        """How well a state (n, 6) with the present pushes fulfils the conditions, at every place."""
        gaps = self.gaps(state, standing)
        most = float(np.max(self.pushes, initial=0.0))
        size = max(most, 1e-300)
        return Judged(
            through=max(0.0, -float(np.min(gaps, initial=0.0))),
            pull=max(0.0, -float(np.min(self.pushes, initial=0.0))) / size,
            product=float(np.max(np.abs(self.pushes * gaps), initial=0.0) / size),
            weakly=int(np.sum((gaps <= TOUCHES) & (self.pushes <= WEAKLY * most))) if most else 0,
        )
