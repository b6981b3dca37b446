"""What walls and bodies exert, and how well a state keeps the conditions of contact, between its nodes too.

NumPy only.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Protocol

import numpy as np

from shellref.contact.active import Contact
from shellref.contact.edges import EdgeRows
from shellref.contact.pairs import PairRows
from shellref.contact.walls import Standing

#: Points of an element, each way, at which the surface is looked at between its nodes.
BETWEEN = 8
#: Digits to which nodes of one row have one abscissa.
DIGITS = 10


class Surface(Protocol):
    """A surface with directors, of elements of a degree on nodes (as `shellref.shell.surface.ShellSurface`)."""

    @property
    def s_nodes(self) -> np.ndarray:
        """As there."""
        ...

    @property
    def v_nodes(self) -> np.ndarray:
        """As there."""
        ...

    @property
    def degree(self) -> int:
        """As there."""
        ...

    def grid(self, s: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Positions (m, k, 3)."""
        ...

    def director(self, s: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Unit directors, of the shape of s and v broadcast."""
        ...


def material(surface: Surface) -> tuple[np.ndarray, np.ndarray]:
    """S and v, each ascending, of `BETWEEN` steps of every element each way, its nodes among them where its degree
    divides that."""

    def fine(ends: np.ndarray) -> np.ndarray:
        steps = np.arange(BETWEEN) / BETWEEN
        return np.append((ends[:-1, None] + np.diff(ends)[:, None] * steps).ravel(), ends[-1])

    return fine(surface.s_nodes[:: surface.degree]), fine(surface.v_nodes[:: surface.degree])


def sampled(surface: Surface) -> tuple[np.ndarray, np.ndarray]:
    """Positions and directors (n, 3) at `material`."""
    s, v = material(surface)
    return surface.grid(s, v).reshape(-1, 3), surface.director(s[:, None], v[None, :]).reshape(-1, 3)


def walls(contact: Contact, state: np.ndarray, standing: Standing) -> Iterator[dict[str, Any]]:
    """Of each wall, then of each body, what `ShellResult.walls` says; state (n, 6) of the process's nodes.

    The moment is exact for the discrete balance: a face's push acts at the face.
    """
    contact.see(state, standing)
    rows, pushes, path = contact.rows, contact.pushes, contact.path
    nodes, areas, everywhere = contact.everywhere.nodes, contact.areas, contact.everywhere.every(state)
    gaps, points, normals = rows.gaps(everywhere, standing, contact.heights), rows.points(everywhere), rows.normals
    stiffness = (*path.stiffness, *(None,) * len(path.bodies))
    for k, spring in enumerate(stiffness):
        own = rows.walls == k
        at = np.flatnonzero(own & contact.active)
        force, pressure = pushes[at, None] * normals[at], pushes[at] / areas[rows.nodes[at]]
        touched = lines(nodes[:, 0], nodes[rows.nodes[at], 0])
        length = float(np.sum(touched[:, 1] - touched[:, 0]))
        yield {
            "force": force.sum(axis=0),
            "moment": np.cross(points[at], force).sum(axis=0),
            "gap": float(np.min(gaps[own], initial=np.inf)) if own.any() else None,
            "height": None if spring is None else float(contact.heights[k]),
            "contacts": nodes[rows.nodes[at]],
            "lines": touched,
            "points": points[at],
            "pushes": pushes[at],
            "pressure": pressure,
            "greatest_pressure": float(np.max(pressure, initial=0.0)),
            "mean_pressure": float(pushes[at].sum()) / length if length > 0.0 else None,
        }


def pairs(contact: Contact) -> list[dict[str, Any]]:
    """Where parts of the strip push each other, at the state last seen, what `ShellResult.pairs` says."""
    found = []
    first = 0
    for block in contact.rows.blocks:
        here = slice(first, first + len(block.nodes))
        first += len(block.nodes)
        if not isinstance(block, (PairRows, EdgeRows)):
            continue
        places, apart = block.places, block.distances
        force = contact.pushes[here, None] * block.normals
        for k in np.flatnonzero(contact.active[here]):
            s, v, s_other, v_other = places[k].tolist()
            found.append(
                {"s": s, "v": v, "s_other": s_other, "v_other": v_other, "force": force[k], "gap": float(apart[k])}
            )
    return found


def _too_near(contact: Contact, state: np.ndarray, surface: Surface) -> float:
    """By how much (l) parts of the strip are nearer than they may be, between its nodes too, at the state last seen."""
    least, state = 0.0, contact.everywhere.every(state)
    for block in contact.rows.blocks:
        if isinstance(block, PairRows):
            s, v = material(surface)
            at, along = np.meshgrid(s, v, indexing="ij")
            points = surface.grid(s, v).reshape(-1, 3)
            least = min(least, block.least(state, points, at.ravel(), along.ravel()))
        if isinstance(block, EdgeRows) and len(block):
            least = min(least, float((block.side * block.between.z).min()) - block.apart)
    return -least


def lines(everywhere: np.ndarray, touched: np.ndarray) -> np.ndarray:
    """(n, 2) first and last abscissa of the rows of nodes that touch without a gap between them; everywhere, touched:
    abscissae of all nodes, and of those that a wall pushes."""
    rows = np.unique(np.round(everywhere, DIGITS))
    on = np.isin(rows, np.round(touched, DIGITS))
    edges = np.flatnonzero(np.diff(np.concatenate([[False], on, [False]]).astype(int)))
    return np.column_stack([rows[edges[::2]], rows[edges[1::2] - 1]])


def contact(
    contact: Contact, state: np.ndarray, standing: Standing, surface: Surface, thickness: float
) -> dict[str, Any]:
    """{"surface", "through": deepest of the places behind its wall (l), "pull" and "product": largest pull and largest
    |lambda g| over the largest push, "weakly": places that touch and hardly push, "penetration": the deepest behind a
    wall, within a body or nearer to another part than may be, anywhere (l), 0 where nothing is}; surface: of the state.
    """
    judged = contact.judged(state, standing)
    path = contact.path
    points, directors = sampled(surface)
    lever = 0.5 * thickness if contact.rows.sides.any() else 0.0
    count = len(path.normals)
    heights = (points @ path.normals.T) - standing.offsets - contact.heights[:count]
    heights = heights - lever * np.abs(directors @ path.normals.T)
    least = float(np.min(heights, initial=0.0))
    for body, centre in zip(path.bodies, standing.centres, strict=True):
        for side in (1.0, -1.0) if lever else (0.0,):
            least = min(least, float(body.gaps(points + side * lever * directors, centre).min()))
    return {
        "surface": path.surface,
        "through": judged.through,
        "pull": judged.pull,
        "product": judged.product,
        "weakly": judged.weakly,
        "penetration": max(0.0, -least, _too_near(contact, state, surface)),
    }
