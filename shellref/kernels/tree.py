"""In which order a structured mesh is eliminated: a binary tree of rectangles of elements.

A rectangle's unknowns are those of the nodes on it; what no element outside it knows is eliminated with it, what is
left is its border. Two neighbours are joined where their borders meet (nested dissection: George 1973, SIAM J. Numer.
Anal. 10, 345, doi:10.1137/0710032). A strip is cut along its length into pieces of equal length, each dissected by
halves, which are joined one after the other from one end to the other: the work is linear in the length, and so is the
memory. How long a piece is, and which side of a rectangle is halved, is what costs least.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from shellref.kernels import fronts

PIECES = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32)  # elements along, of a piece
EACH = 2.0e3  # multiplications that every front costs, whatever its size
MOVED = 4.0  # and each of its entries

Sides = tuple[bool, bool, bool, bool]  # whether others are at the low and high end of the first, of the second axis


def cost(pivots: int, size: int) -> float:
    """Multiplications of the elimination of `pivots` unknowns from a front of `size`."""
    rest = size - pivots
    return (size**3 - rest**3) / 6.0 + MOVED * size**2 + EACH


class Costs:
    """Least work of rectangles, by size and sides; degree of the elements; five unknowns a node."""

    def __init__(self, degree: int):
        self.degree = degree
        self.least = cache(self._least)

    def border(self, a: int, b: int, sides: Sides) -> int:
        """Unknowns of a x b elements that others know."""
        k = self.degree
        inner = (k * a + 1 - sides[0] - sides[1]) * (k * b + 1 - sides[2] - sides[3])
        return 5 * ((k * a + 1) * (k * b + 1) - inner)

    def joined(self, one: int, other: int, shared: int, border: int) -> float:
        """Of joining two borders with `shared` nodes in common."""
        size = one + other - 5 * shared
        return cost(size - border, size)

    def _least(self, a: int, b: int, sides: Sides) -> tuple[float, int]:
        """(work, axis that is halved) of a x b elements."""
        border = self.border(a, b, sides)
        if a == b == 1:
            size = 5 * (self.degree + 1) ** 2
            return cost(size - border, size), 0
        found = []
        for axis, n in ((0, a), (1, b)):
            if n > 1:
                parts = halves(a, b, sides, axis)
                shared = self.degree * (b, a)[axis] + 1
                work = self.joined(self.border(*parts[0]), self.border(*parts[1]), shared, border)
                found.append((work + sum(self.least(*part)[0] for part in parts), axis))
        return min(found)


def halves(a: int, b: int, sides: Sides, axis: int) -> tuple[tuple[int, int, Sides], tuple[int, int, Sides]]:
    """The two parts of a x b elements cut across an axis."""
    low, high = list(sides), list(sides)
    low[2 * axis + 1] = high[2 * axis] = True
    if axis == 0:
        return (a // 2, b, tuple(low)), (a - a // 2, b, tuple(high))  # type: ignore[return-value]
    return (a, b // 2, tuple(low)), (a, b - b // 2, tuple(high))  # type: ignore[return-value]


class Tree:
    """The tree of a mesh of nx x ny elements, children before parents.

    children (t, 2): numbers of the two parts, -1 for elements; cells (t,): the element, in rows along S, -1 for others.
    pieces: numbers of the first rectangle of every piece, and after the last.
    """

    def __init__(self, elements: tuple[int, int], degree: int):
        self._turned = elements[1] > elements[0]
        self._along, self._across = max(elements), min(elements)
        self._costs = Costs(degree)
        self._children: list[tuple[int, int]] = []
        self._cells: list[int] = []
        self.piece = self._best()
        pieces, before = [0], -1
        for i in range(0, self._along, self.piece):
            n = min(self.piece, self._along - i)
            number = self._built(i, 0, n, self._across, (i > 0, i + n < self._along, False, False))
            before = number if before < 0 else self._joined(before, number)
            pieces.append(len(self._cells))
        self.children = np.array(self._children, dtype=np.int64).reshape(-1, 2)
        self.cells, self.pieces = np.array(self._cells, dtype=np.int64), pieces

    def _best(self) -> int:
        """Length of a piece with the least work per element along, in the middle of the strip."""
        c, b, sides = self._costs, self._across, (True, True, False, False)
        end = c.border(1, b, (False, True, False, False))
        found = []
        for n in PIECES:
            if n <= self._along:
                work = c.joined(end, c.border(n, b, sides), c.degree * b + 1, end)
                found.append(((work + c.least(n, b, sides)[0]) / n, n))
        return min(found)[1]

    def _joined(self, one: int, other: int) -> int:
        self._children.append((one, other))
        self._cells.append(-1)
        return len(self._cells) - 1

    def _built(self, i: int, j: int, a: int, b: int, sides: Sides) -> int:
        """The rectangle of a x b elements from (i, j) on; its number."""
        if a == b == 1:
            self._children.append((-1, -1))
            self._cells.append(j * self._along + i if self._turned else i * self._across + j)
            return len(self._cells) - 1
        _, axis = self._costs.least(a, b, sides)
        low, high = halves(a, b, sides, axis)
        one = self._built(i, j, low[0], low[1], low[2])
        far = (i + low[0], j) if axis == 0 else (i, j + low[1])
        return self._joined(one, self._built(far[0], far[1], high[0], high[1], high[2]))


class Structure:
    """The fronts of a tree: which unknowns they have, which of these they eliminate, where those of their parts go.

    number (c, m): unknowns of the elements, numbered in rows along S, -1 for what is held. front t has the unknowns
    index[start[t] : start[t + 1]], the first pivots[t] of which it eliminates.
    """

    def __init__(self, tree: Tree, number: np.ndarray):
        self.tree, self.number = tree, number
        self.unknowns = int(number.max(initial=-1)) + 1
        shared = np.bincount(number[number >= 0], minlength=self.unknowns)
        self.start, self.index, self.pivots, self.where, self.place = fronts.structured(
            tree.children, tree.cells, number, shared
        )
        size = np.diff(self.start)
        border = size - self.pivots
        self.rows = np.concatenate([[0], np.cumsum(self.pivots * size)])  # of the factors
        self.first = np.concatenate([[0], np.cumsum(self.pivots)])  # pivot of each front
        kept, most = 0, 0
        for (one, other), b in zip(tree.children.tolist(), (border.astype(np.int64) ** 2).tolist(), strict=True):
            if one >= 0:
                kept -= int(border[one] ** 2 + border[other] ** 2)
            kept += b
            most = max(most, kept + (0 if one < 0 else int(border[one] ** 2 + border[other] ** 2)))
        self.most_kept, self.most_size = most, int(size.max(initial=1))
        self.multiplications = float(np.sum((size**3.0 - border**3.0) / 6.0))
