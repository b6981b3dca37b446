"""A shell to be solved, whatever it stands for: surface, material, loads, supports, and how they vary on a path. NumPy.

Lengths in any unit; bending stiffness D = 1 per unit width, so a force of F in a table is F / D here. Energies, forces
and moments are divided by `normaliser` (the width of a strip, so that they come in D w / l).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from shellref.contact.walls import WallPath
from shellref.holds.moment import EdgeMoment
from shellref.seam.ties import Tie
from shellref.shell.clamps import Control
from shellref.shell.director import FREE, HELD, Edge
from shellref.shell.grid import Grid
from shellref.shell.material import SHEAR_FACTOR
from shellref.shell.midsurface import MidSurface

__all__ = ["Body", "Control", "Placement", "Stage", "Supports", "line_force", "point_force"]

Placement = Callable[[float], np.ndarray]


@dataclass(frozen=True)
class Stage:
    """A leg of the path: the controls go from `start` to `end` as the stage's load goes from 0 to 1."""

    name: str
    start: Control
    end: Control

    def at(self, load: float) -> Control:
        """The controls at this load."""
        return self.start.between(self.end, load)

    def rate(self) -> Control:
        """Their derivative."""
        return self.start.rate(self.end)


@dataclass(frozen=True)
class Supports:
    """What is held at each node, and where it is put.

    translations (n, 3): components of the position that are held. directors (n,): director.FREE, HELD or an axis (0, 1,
    2) to which the director stays normal. placement(move) -> (n, 6): values of everything held (other entries unused);
    None: held where the reference surface is. edges: whose nodes are held but move by unknowns of their own (one
    process only); tie: nodes that are one with others of the same process. motions(state (n, 6)) -> (k, n, 6): what
    some held components, those in `floating` (n, 3), keep the shell from, and nothing resists; None: nothing of that
    kind, and none of them. swings: held at a node alone, about which it may turn.
    """

    translations: np.ndarray
    directors: np.ndarray
    placement: Placement | None = None
    edges: tuple[Edge, ...] = ()
    tie: Tie | None = None
    motions: Callable[[np.ndarray], np.ndarray] | None = None
    floating: np.ndarray | None = None
    swings: bool = False

    @classmethod
    def none(cls, n: int) -> Supports:
        """Nothing held, n nodes."""
        return cls(np.zeros((n, 3), dtype=bool), np.full(n, FREE))

    def hold(self, where: np.ndarray, axes: str = "xyz", director: int | None = None) -> Supports:
        """These supports and more: positions along `axes` where the mask is true; director HELD or normal to one."""
        translations, directors = self.translations.copy(), self.directors.copy()
        for axis in axes:
            translations[where, "xyz".index(axis)] = True
        if director is not None:
            crossed = where & (directors != FREE) & (directors != director)
            directors[where] = director
            directors[crossed] = HELD  # normal to two axes at once: it cannot move
        return replace(self, translations=translations, directors=directors)

    def dealt(self, at: np.ndarray, tie: Tie | None, everywhere: Callable[[np.ndarray], np.ndarray]) -> Supports:
        """Of these, of all nodes in the order of the grid, those of a process's nodes, which are the numbers `at` (n,);
        tie: of its own nodes. everywhere: a process's state (n, 6) -> that of all nodes, on all processes together. No
        edges."""
        placement, motions, floating = self.placement, self.motions, self.floating
        return Supports(
            self.translations[at],
            self.directors[at],
            None if placement is None else lambda move: placement(move)[at],
            tie=tie,
            motions=None if motions is None else lambda state: motions(everywhere(state))[:, at],
            floating=None if floating is None else floating[at],
            swings=self.swings,
        )


@dataclass(frozen=True)
class Body:
    """A shell with its loads; functions of nodes (n, 2) in material coordinates, so that every process makes its own.

    natural(s, v) -> (n, 3): natural curvature (11, 22, 2*12) at natural = 1; `natural_start` the same at natural = 0.
    weight: force (3,) per area at weight = 1, minus the gradient of its potential.
    forces(grid, nodes) -> (n, 3): nodal forces at load = 1; couples(grid, nodes) -> (n, 3): nodal couples m at load =
    1, acting as m x d on the director (exact for couples normal to it). moment(grid, nodes): a moment of fixed
    direction on an edge at load = 1.
    supports(grid, nodes) -> Supports.
    """

    surface: MidSurface
    grid: Grid
    thickness: float
    poisson: float
    supports: Callable[[Grid, np.ndarray], Supports]
    normaliser: float = 1.0
    natural: Callable[[np.ndarray, np.ndarray], np.ndarray] | None = None
    natural_start: Callable[[np.ndarray, np.ndarray], np.ndarray] | None = None
    weight: tuple[float, float, float] | None = None
    forces: Callable[[Grid, np.ndarray], np.ndarray] | None = None
    couples: Callable[[Grid, np.ndarray], np.ndarray] | None = None
    moment: Callable[[Grid, np.ndarray], EdgeMoment] | None = None  # one process only
    walls: WallPath | None = None  # what it may touch
    shear_factor: float = SHEAR_FACTOR  # of the transverse shear stiffness k G h
    closed: bool = False  # its ends are one: on several processes the first has both
    bends_along: bool = False  # h_e of the stabilisation: an element's length along S; else the root of its area


def point_force(place: tuple[float, float], force: tuple[float, float, float]) -> Callable:
    """`Body.forces` of one force at the node nearest to `place` (S, v)."""

    def forces(grid: Grid, nodes: np.ndarray) -> np.ndarray:
        row, column = grid.positions(np.array([place], dtype=float))
        rows, columns = grid.positions(nodes)
        result = np.zeros((len(nodes), 3))
        result[(rows == row[0]) & (columns == column[0])] = force
        return result

    return forces


def line_force(axis: int, place: float, per_length: tuple[float, float, float]) -> Callable:
    """`Body.forces` (or `couples`) per length of the line S = place (axis 0) or v = place (axis 1)."""

    def forces(grid: Grid, nodes: np.ndarray) -> np.ndarray:
        positions = grid.positions(nodes)
        at = (grid.s_nodes, grid.v_nodes)[axis]
        on = positions[axis] == int(np.argmin(np.abs(at - place)))
        share = grid.nodal_shares(1 - axis)[positions[1 - axis]]
        return np.where(on, share, 0.0)[:, None] * np.asarray(per_length, dtype=float)

    return forces
