"""The shell's own surface as something to touch: patches that are smooth along the strip, and the lines of its
directors. NumPy, SciPy.

A place x lies before a patch at (t, u, z) where it is on the line of the director there (docs/theory.md, eq. (7.30)):

    F = Y(t, u) + z D(t, u) - x = 0 ,   J = [Y_t + z D_t, Y_u + z D_u, D] .

Y and D are the elements' polynomials across, and along each element that of the two next degrees whose slopes at its
ends are the means of the elements that meet there. Y and D are linear in the nodal values and join with their slopes:
pushes turn smoothly where a place slides from one element to the next.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from scipy.spatial import cKDTree

from shellref.kernels.lagrange import lobatto

#: Newton's iterations for a foot, where they end, and how far (elements) beyond an element they may go.
ITERATIONS, ENOUGH, BEYOND = 12, 1e-12, 0.6
#: How far (elements) beyond an element a foot may seem to be by the lines of its middle, and how much farther z.
SEEMS, FARTHER = 1.0, 1.5
#: Part of an element by which a foot may be beyond it, and part of one within which two feet are the same.
WITHIN, SAME = 1e-7, 1e-5


class Mesh(Protocol):
    """A grid of elements of a degree on nodes (as `shellref.shell.grid.Grid`)."""

    degree: int
    s_knots: np.ndarray
    v_knots: np.ndarray
    s_nodes: np.ndarray

    @property
    def elements(self) -> tuple[int, int]:
        """(along, across)."""
        ...


class Feet(NamedTuple):
    """(m,) each: element, local coordinates t along and u across, both in [0, 1], and z."""

    element: np.ndarray
    t: np.ndarray
    u: np.ndarray
    z: np.ndarray

    def some(self, mask: np.ndarray) -> Feet:
        """Those of a mask, or of numbers."""
        return Feet(*(x[mask] for x in self))


@dataclass(frozen=True)
class Local:
    """Patches at feet: weights (6, m, q) of the nodes, by (1, t, u, tt, tu, uu); nodes (m, q); place (6, m, 3) and
    director (6, m, 3), Y and D with their derivatives."""

    weights: np.ndarray
    nodes: np.ndarray
    place: np.ndarray
    director: np.ndarray

    def jacobian(self, z: np.ndarray) -> np.ndarray:
        """J (m, 3, 3)."""
        sides = self.place[1:3] + z[:, None] * self.director[1:3]
        return np.stack([sides[0], sides[1], self.director[0]], axis=-1)


def _powers(x: np.ndarray, count: int) -> np.ndarray:
    """(3, m, count): x^j and its first two derivatives."""
    j = np.arange(count)
    power = x[:, None] ** j
    first, second = np.zeros_like(power), np.zeros_like(power)
    first[:, 1:] = j[1:] * power[:, :-1]
    second[:, 2:] = j[2:] * j[1:-1] * power[:, :-2]
    return np.stack([power, first, second])


class Sheet:
    """A mesh's surface."""

    def __init__(self, grid: Mesh, order: np.ndarray):
        """order: numbers of the nodes on the grid."""
        self.grid, k = grid, grid.degree
        self.elements = grid.elements
        nx, ny = self.elements
        nodes = lobatto(k)[0]
        self._across = np.linalg.inv(np.vander(nodes, increasing=True))  # (powers, nodes)
        self._along = np.stack([self._smooth(a) for a in range(nx)])  # (nx, powers, stencil)
        rows = np.clip(k * np.arange(nx)[:, None] + np.arange(-k, 2 * k + 1), 0, k * nx)
        columns = k * np.arange(ny)[:, None] + np.arange(k + 1)
        self.stencil = order[rows[:, None, :, None], columns[None, :, None, :]].reshape(nx * ny, -1)
        own = order[rows[:, None, k : 2 * k + 1, None], columns[None, :, None, :]]
        self._own = own.reshape(nx * ny, -1)

    def _smooth(self, a: int) -> np.ndarray:
        """(k + 3, 3 k + 1): powers of t (rows) of the functions in element a of the nodes of a - 1, a and a + 1."""
        k, sizes = self.grid.degree, np.diff(self.grid.s_knots)
        nodes = lobatto(k)[0]
        polynomials = self._across
        slope = {x: np.array([j * x ** max(j - 1, 0) for j in range(k + 1)]) @ polynomials for x in (0.0, 1.0)}
        found = np.zeros((k + 3, 3 * k + 1))
        found[: k + 1, k : 2 * k + 1] = polynomials
        product = np.polynomial.polynomial.polyfromroots(nodes)
        rate = np.polynomial.polynomial.polyder(product)
        at = {x: float(np.polynomial.polynomial.polyval(x, rate)) for x in (0.0, 1.0)}
        first = np.polynomial.polynomial.polymul(product, [1.0 / at[0.0], -1.0 / at[0.0]])
        last = np.polynomial.polynomial.polymul(product, [0.0, 1.0 / at[1.0]])
        for x, bump, other, there in ((0.0, first, a - 1, 0), (1.0, last, a + 1, 2 * k)):
            if 0 <= other < len(sizes):
                jump = np.zeros(3 * k + 1)
                jump[there : there + k + 1] += sizes[a] / sizes[other] * slope[1.0 - x]
                jump[k : 2 * k + 1] -= slope[x]
                found += 0.5 * np.outer(bump, jump)
        return found

    def local(self, state: np.ndarray, feet: Feet) -> Local:
        """Everything at feet, of a state (n, 6)."""
        k, ny = self.grid.degree, self.elements[1]
        one = np.einsum("dmj,mjs->dms", _powers(feet.t, k + 3), self._along[feet.element // ny])
        two = np.einsum("dmj,js->dms", _powers(feet.u, k + 1), self._across)
        shape = len(feet.t), self.stencil.shape[1]
        kinds = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
        weights = np.stack([(one[a][:, :, None] * two[b][:, None, :]).reshape(shape) for a, b in kinds])
        nodes = self.stencil[feet.element]
        values = np.einsum("dmq,mqi->dmi", weights, state[nodes])
        return Local(weights, nodes, values[..., :3], values[..., 3:])

    def border(self, edge: np.ndarray, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The long edges (m,), 0 (v = -w/2) or 1, at S = s (m,): weights (3, m, q) of the nodes on them, values and
        first and second derivatives by S, and these nodes (m, q)."""
        k, (nx, ny), knots = self.grid.degree, self.elements, self.grid.s_knots
        a = np.clip(np.searchsorted(knots, s, side="right") - 1, 0, nx - 1)
        size = np.diff(knots)[a]
        powers = _powers((s - knots[a]) / size, k + 3) / size[:, None] ** np.arange(3)[:, None, None]
        weights = np.einsum("dmj,mjs->dms", powers, self._along[a])
        cell = a * ny + np.where(edge == 0, 0, ny - 1)
        nodes = self.stencil[cell].reshape(len(s), 3 * k + 1, k + 1)
        return weights, np.where((edge == 0)[:, None], nodes[:, :, 0], nodes[:, :, -1])

    def material(self, feet: Feet) -> tuple[np.ndarray, np.ndarray]:
        """S and v (m,)."""
        ny, s, v = self.elements[1], self.grid.s_knots, self.grid.v_knots
        a, b = feet.element // ny, feet.element % ny
        return s[a] + feet.t * np.diff(s)[a], v[b] + feet.u * np.diff(v)[b]

    def solved(self, state: np.ndarray, points: np.ndarray, feet: Feet) -> tuple[Feet, np.ndarray]:
        """The feet (m,) of points (m, 3) by Newton's method from others, and a mask of those that were found."""
        t, u, z = feet.t.copy(), feet.u.copy(), feet.z.copy()
        step = np.full((len(t), 3), np.inf)
        for _ in range(ITERATIONS):
            local = self.local(state, Feet(feet.element, t, u, z))
            j = local.jacobian(z)
            flat = np.abs(np.linalg.det(j)) < 1e-300
            j[flat] = np.eye(3)
            miss = local.place[0] + z[:, None] * local.director[0] - points
            step = -np.linalg.solve(j, miss[:, :, None])[:, :, 0]
            step[flat] = np.inf
            good = np.isfinite(step).all(axis=1)
            t = np.where(good, np.clip(t + step[:, 0], -BEYOND, 1.0 + BEYOND), t)
            u = np.where(good, np.clip(u + step[:, 1], -BEYOND, 1.0 + BEYOND), u)
            z = np.where(good, z + step[:, 2], z)
            if np.all(np.abs(np.where(good[:, None], step, 0.0)) <= ENOUGH):
                break
        size = np.abs(step[:, :2]).max(axis=1, initial=0.0)
        return Feet(feet.element, t, u, z), (size <= 1e-9) & (np.abs(t - 0.5) < 0.5 + BEYOND)

    def near(
        self, state: np.ndarray, points: np.ndarray, s: np.ndarray, reach: float, apart: float, closed: bool
    ) -> tuple[np.ndarray, Feet]:
        """Numbers (m,) of points (n, 3) of the strip at S = s (n,), and their feet on other parts of it, at least
        `apart` along it from there, with |z| <= reach; in the order of the points, then of S and v.

        Elements whose spheres come near a point are found by a tree of the points.
        """
        corners = state[self._own, :3]
        centres = 0.5 * (corners.min(axis=1) + corners.max(axis=1))
        radii = np.linalg.norm(corners - centres[:, None], axis=2).max(axis=1)
        ny, knots = self.elements[1], self.grid.s_knots
        found = cKDTree(points).query_ball_point(centres, 1.1 * radii + reach)
        element = np.repeat(np.arange(len(found)), [len(one) for one in found])
        number = np.fromiter((i for one in found for i in one), dtype=np.int64, count=len(element))
        away = self._along_strip(s[number], 0.5 * (knots[:-1] + knots[1:])[element // ny], closed)
        wide = away > apart - 0.5 * np.diff(knots)[element // ny]
        element, number = element[wide], number[wide]
        begin, seems = self._seem(state, points[number], element, reach)
        number = number[seems]
        feet, good = self.solved(state, points[number], begin.some(seems))
        good &= (np.abs(feet.t - 0.5) <= 0.5 + WITHIN) & (np.abs(feet.u - 0.5) <= 0.5 + WITHIN)
        good &= np.abs(feet.z) <= reach
        own, v = self.material(feet)
        good &= self._along_strip(s[number], own, closed) >= apart
        number, feet, own, v = number[good], feet.some(good), own[good], v[good]
        order = np.lexsort((v, own, number))
        number, feet, own, v = number[order], feet.some(order), own[order], v[order]
        first = np.ones(len(number), dtype=bool)  # of feet on a border of elements, which all of them have
        size_s, size_v = SAME * np.diff(knots).min(), SAME * np.diff(self.grid.v_knots).min()
        for back in (1, 2, 3):
            same = (number[back:] == number[:-back]) & (np.abs(own[back:] - own[:-back]) < size_s)
            first[back:] &= ~(same & (np.abs(v[back:] - v[:-back]) < size_v))
        return number[first], feet.some(first)

    def _seem(
        self, state: np.ndarray, points: np.ndarray, element: np.ndarray, reach: float
    ) -> tuple[Feet, np.ndarray]:
        """Feet of points (m, 3) on elements (m,) as they seem from the middles of these, and a mask of those that may
        be on them, within reach."""
        every = np.arange(len(self.stencil))
        half, z = np.full(len(every), 0.5), np.zeros(len(element))
        middle = self.local(state, Feet(every, half, half, 0.0 * half))
        place, director = middle.place[:3][:, element], middle.director[:3][:, element]
        found = np.zeros((len(element), 3))
        for _ in range(2):
            sides = place[1:] + z[:, None] * director[1:]
            j = np.stack([sides[0], sides[1], director[0]], axis=-1)
            j[np.abs(np.linalg.det(j)) < 1e-300] = np.eye(3)
            found = np.linalg.solve(j, (points - place[0])[:, :, None])[:, :, 0]
            z = found[:, 2]
        seems = (np.abs(found[:, :2]) <= 0.5 + SEEMS).all(axis=1) & (np.abs(z) <= FARTHER * reach)
        t, u = np.clip(0.5 + found[:, 0], 0.0, 1.0), np.clip(0.5 + found[:, 1], 0.0, 1.0)
        return Feet(element, t, u, z), seems

    @staticmethod
    def _along_strip(s: np.ndarray, other: np.ndarray, closed: bool) -> np.ndarray:
        away = np.abs(s - other)
        return np.minimum(away, 1.0 - away) if closed else away
