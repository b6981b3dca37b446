"""Parts of a shell kept apart: nodes before other parts of its own surface, with exact derivatives. NumPy, SciPy.

The gap of node i from the part of the surface before which it lies at (t, u, z) (shellref.contact.sheet) is

    g = sigma z - apart ,   sigma = 1 or -1: on which side of that part it is ,

apart from middle surface to middle surface. With l = -J^-T e_z, which is normal to the surface Y + z D there,

    dz = l . (sum W_a dphi_a + z sum W_a dd_a - dx) ,

so that the push is along that normal and balances itself, forces and moments, to rounding. With p = (t, u, z),
p' = -J^-1 F_q and F_q linear in the nodal values

    d2z = l . (2 F_qp p' + F_pp p' p')

(docs/theory.md, eq. (7.31)).

Each pair of parts has one row a node: nodes are those at the smaller S (and those of free ends), feet at the larger. A
side, once known, goes with its node and the place of its foot: what is pushed through is pushed back.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from shellref.contact.rows import MOST_PARTS, Entries, Gradients
from shellref.contact.sheet import Feet, Local, Sheet
from shellref.contact.walls import Standing

#: Feet of a node that are as near as this along the strip (l), from one state to the next, are the same.
FOLLOWED = 0.1
#: Distances to be kept, sizes of elements and lengths (l), of which the largest says how far nodes are looked for, and
#: distances and sizes of elements along the strip within which nothing of it is another part.
REACH = (3.0, 4.0, 0.03)
NEIGHBOURS = (1.6, 3.0)
#: How far (l) nodes are looked for at most where a step went far, and z that is 0.
MOST_REACH, NOTHING = 0.15, 1e-9


@dataclass(frozen=True)
class Found:
    """What follows from a state: nodes (m,), feet, sides (m,), gradients: columns and values (m, c), l (m, 3)."""

    nodes: np.ndarray
    feet: Feet
    side: np.ndarray
    columns: np.ndarray
    values: np.ndarray
    l: np.ndarray


@dataclass(frozen=True)
class PairRows:
    """The nodes of a shell before other parts of it. number: of the strip among what is touched."""

    sheet: Sheet
    slaves: np.ndarray  # nodes that may be pushed
    material: np.ndarray  # (n, 2) S and v of all nodes
    apart: float
    closed: bool
    number: int
    found: Found
    seen: Any = field(default=None, compare=False)  # the state to which it belongs

    @classmethod
    def of(cls, sheet: Sheet, slaves: np.ndarray, material: np.ndarray, apart: float, closed: bool, number: int) -> Any:
        """Without a state there are none."""
        none = np.zeros(0)
        feet = Feet(none.astype(int), none, none, none)
        empty = Found(none.astype(int), feet, none, np.zeros((0, 0), dtype=int), np.zeros((0, 0)), np.zeros((0, 3)))
        return cls(sheet, slaves, material, apart, closed, number, empty)

    @property
    def nodes(self) -> np.ndarray:
        """(m,)."""
        return self.found.nodes

    @property
    def walls(self) -> np.ndarray:
        """(m,)."""
        return np.full(len(self.nodes), self.number)

    @property
    def sides(self) -> np.ndarray:
        """(m,): of no face."""
        return np.zeros(len(self.nodes))

    @property
    def parts(self) -> np.ndarray:
        """(m,): where along the strip the feet are."""
        s, _ = self.sheet.material(self.found.feet)
        return np.clip((s * 64).astype(int), 0, MOST_PARTS - 1)

    @property
    def normals(self) -> np.ndarray:
        """(m, 3)."""
        return np.asarray(-self.found.side[:, None] * self.found.l)

    @property
    def places(self) -> np.ndarray:
        """(m, 4): S and v of the nodes, and of their feet."""
        return np.column_stack([self.material[self.nodes], *self.sheet.material(self.found.feet)])

    @property
    def distances(self) -> np.ndarray:
        """(m,) of the nodes from the other parts."""
        return np.abs(self.found.feet.z)

    @property
    def neighbours(self) -> float:
        """Length along the strip (l) within which nothing is another part."""
        return max(NEIGHBOURS[0] * self.apart, NEIGHBOURS[1] * float(np.diff(self.sheet.grid.s_knots).max()))

    @property
    def reach(self) -> float:
        """How far (l) nodes are looked for."""
        size = float(np.diff(self.sheet.grid.s_nodes).max())
        return float(np.max(np.array(REACH) * (self.apart, size, 1.0)))

    def search(self, state: np.ndarray, reach: float) -> tuple[np.ndarray, Feet]:
        """Nodes (m,) of a state (n, 6) and their feet."""
        at = self.slaves
        s = self.material[at, 0]
        which, feet = self.sheet.near(state, state[at, :3], s, reach, self.neighbours, self.closed)
        own, _ = self.sheet.material(feet)
        ends = np.zeros(len(which), bool) if self.closed else (s[which] <= 0.0) | (s[which] >= 1.0)
        keep = (s[which] < own) | ends
        return at[which[keep]], feet.some(keep)

    def at(self, state: np.ndarray, standing: Standing) -> tuple[PairRows, np.ndarray | None]:
        """The pairs at a state, and which of these each was."""
        if state is self.seen:
            return self, None
        nodes, feet = self.search(state, self.reach)
        before = self.followed(nodes, feet)
        known = before >= 0
        side = np.where(feet.z < 0.0, -1.0, 1.0)
        side[known] = self.found.side[before[known]]
        local = self.sheet.local(state, feet)
        l = _normal(local, feet.z)
        weights, q = local.weights[0], local.nodes.shape[1]
        blocks = [weights[:, :, None] * l[:, None, :], (feet.z[:, None] * weights)[:, :, None] * l[:, None, :]]
        values = np.hstack([-l, np.concatenate(blocks, axis=2).reshape(len(nodes), 6 * q)])
        columns = np.hstack(
            [6 * nodes[:, None] + np.arange(3), (6 * local.nodes[:, :, None] + np.arange(6)).reshape(len(nodes), 6 * q)]
        )
        found = Found(nodes, feet, side, columns, side[:, None] * values, l)
        return replace(self, found=found, seen=state), before

    def followed(self, nodes: np.ndarray, feet: Feet) -> np.ndarray:
        """Which of these pairs (m,) new ones are, -1 none."""
        old, _ = self.sheet.material(self.found.feet)
        new, _ = self.sheet.material(feet)
        of: dict[int, list[int]] = {}
        for k, node in enumerate(self.nodes.tolist()):
            of.setdefault(node, []).append(k)
        before = np.full(len(nodes), -1)
        taken: set[int] = set()
        for k, node in enumerate(nodes.tolist()):
            near = [j for j in of.get(node, ()) if abs(old[j] - new[k]) < FOLLOWED and j not in taken]
            if near:
                before[k] = min(near, key=lambda j, k=k: abs(old[j] - new[k]))  # type: ignore[misc]
                taken.add(int(before[k]))
        return before

    def passed(self, before: np.ndarray, after: np.ndarray, standing: tuple[Standing, Standing]) -> bool:
        """Whether a node is on the other side of a part at a state than it was at the one before."""
        moved = float(np.linalg.norm(after[:, :3] - before[:, :3], axis=1).max())
        reach = min(self.reach + 2.0 * moved, MOST_REACH)
        nodes, feet = self.search(before, reach)
        if not len(nodes):
            return False
        there = replace(self, found=replace(self.found, nodes=nodes, feet=feet))
        nodes, later = self.search(after, reach)
        was = there.followed(nodes, later)
        one, other = feet.z[was], later.z
        through = (was >= 0) & (one * other < 0.0) & (np.minimum(np.abs(one), np.abs(other)) > NOTHING)
        return bool(np.any(through))

    def crossing(self, state: np.ndarray) -> tuple[float, float] | None:
        """S of a place where a state crosses itself, and S of the other part there; None: it does not. There neighbours
        along the strip are on different sides of one part."""
        nodes, feet = self.search(state, self.reach)
        if not len(nodes):
            return None
        own, _ = self.sheet.material(feet)
        s, v = self.material[nodes].T
        step = float(np.diff(self.sheet.grid.s_nodes).max())
        order = np.lexsort((own, s, np.round(v, 12)))
        s, v, own, z = s[order], v[order], own[order], feet.z[order]
        for back in range(1, 5):
            if len(s) <= back:
                break
            near = (np.abs(s[back:] - s[:-back]) < 1.5 * step) & (np.abs(v[back:] - v[:-back]) < 1e-12)
            near &= (np.abs(own[back:] - own[:-back]) < 6.0 * step) & (s[back:] > s[:-back])
            through = near & (z[back:] * z[:-back] < 0.0)
            through &= np.minimum(np.abs(z[back:]), np.abs(z[:-back])) > NOTHING
            if through.any():
                k = int(np.argmax(through))
                return float(s[k]), float(own[k])
        return None

    def points(self, state: np.ndarray) -> np.ndarray:
        """Where the places are (m, 3)."""
        return np.asarray(state[self.nodes, :3])

    def gaps(self, state: np.ndarray, standing: Standing, heights: np.ndarray) -> np.ndarray:
        """(m,)."""
        if state is self.seen:
            z = self.found.feet.z
        else:
            z = self.sheet.solved(state, state[self.nodes, :3], self.found.feet)[0].z
        return np.asarray(self.found.side * z - self.apart)

    def least(self, state: np.ndarray, points: np.ndarray, s: np.ndarray, v: np.ndarray) -> float:
        """Least gap (l) at a state of places (n, 3) of the strip at S and v (n,), at most 0, before other parts; sides
        are those of the nearest of these pairs."""
        which, feet = self.sheet.near(state, points, s, self.apart + self.reach, self.neighbours, self.closed)
        if not len(which) or not len(self.nodes):
            return 0.0
        own, _ = self.sheet.material(feet)
        other, _ = self.sheet.material(self.found.feet)
        tree = cKDTree(np.column_stack([self.material[self.nodes, 0], other]))
        away, near = tree.query(np.column_stack([s[which], own]))
        known = away < FOLLOWED
        side = np.where(known, self.found.side[near], np.where(feet.z < 0.0, -1.0, 1.0))
        return min(0.0, float(np.min(side * feet.z - self.apart)))

    @property
    def _gradients(self) -> Gradients:
        return Gradients(self.found.values, self.found.columns)

    def applied(self, fields: np.ndarray) -> np.ndarray:
        """b . field (m,)."""
        return self._gradients.applied(fields)

    def rates(self, rate: Standing) -> np.ndarray:
        """(m,): nothing moves by itself."""
        return np.zeros(len(self.nodes))

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
        second = self.second(self.seen, self.found.feet.some(some), self.found.l[some])
        return self._gradients.entries(some, (pushes[some] * self.found.side[some])[:, None, None] * second)

    def second(self, state: np.ndarray, feet: Feet, l: np.ndarray) -> np.ndarray:
        """d2z (m, c, c) by the place and the nodal values in the order of the columns."""
        local, z = self.sheet.local(state, feet), feet.z
        m, q = local.nodes.shape
        eye = np.eye(3)

        def spread(of_place: np.ndarray, of_director: np.ndarray) -> np.ndarray:  # (m, q) each -> (m, 6 q, 3)
            both = np.stack([of_place, of_director], axis=2)
            return np.asarray(np.einsum("mqk,ij->mqkij", both, eye).reshape(m, 6 * q, 3))

        w = local.weights
        by_q = np.concatenate([np.broadcast_to(-eye, (m, 3, 3)), spread(w[0], z[:, None] * w[0])], axis=1)
        mixed = [spread(w[1], z[:, None] * w[1]), spread(w[2], z[:, None] * w[2]), spread(0.0 * w[0], w[0])]
        a = np.stack([np.einsum("mci,mi->mc", one, l) for one in mixed], axis=2)  # l . F_qp, of the nodes
        a = np.concatenate([np.zeros((m, 3, 3)), a], axis=1)
        j = local.jacobian(z)
        moved = -np.linalg.solve(j, np.swapaxes(by_q, 1, 2))  # p' (m, 3, c)
        pp = np.zeros((m, 3, 3))
        bends = np.einsum("dmi,mi->dm", local.place[3:] + z[:, None] * local.director[3:], l)
        pp[:, 0, 0], pp[:, 0, 1], pp[:, 1, 0], pp[:, 1, 1] = bends[0], bends[1], bends[1], bends[2]
        for k in (0, 1):
            pp[:, k, 2] = pp[:, 2, k] = np.einsum("mi,mi->m", local.director[1 + k], l)
        once = a @ moved
        return np.asarray(once + np.swapaxes(once, 1, 2) + np.swapaxes(moved, 1, 2) @ pp @ moved)


def _normal(local: Local, z: np.ndarray) -> np.ndarray:
    """l (m, 3)."""
    right = np.broadcast_to(np.array([0.0, 0.0, -1.0]), (len(z), 3))
    return np.asarray(np.linalg.solve(np.swapaxes(local.jacobian(z), 1, 2), right[:, :, None])[:, :, 0])
