"""All nodes of a shell on every process: what it touches is found by each of them from the whole state. NumPy, SciPy.

Gaps, the active set and the rows of what touches are small beside elements and factors: they are not distributed. Every
process gathers the state in the order of the grid and finds the same; forces on nodes and rows of the projection are
those of the whole, of which it keeps its own. On one process nodes stay in the order that they have.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np


class Grid(Protocol):
    """Nodes on a grid, as `shellref.shell.grid.Grid`."""

    @property
    def nodes(self) -> np.ndarray:
        """(N, 2) all of them."""
        ...

    def numbers(self, nodes: np.ndarray) -> np.ndarray:
        """(n,) which of all nodes each one (n, 2) is."""
        ...


class Model(Protocol):
    """The nodes of a process with their communicator, as `shellref.shell.naghdi.NaghdiModel`."""

    comm: Any
    grid: Any
    nodes: np.ndarray
    owned: int

    def on_grid(self, state: np.ndarray) -> np.ndarray:
        """Of a nodal field (n, k) all values on the grid."""
        ...


class Everywhere:
    """From a process's nodes (n,), ghosts among them, to all (N,) and back; nodes (N, 2): in material coordinates."""

    def __init__(self, model: Model):
        self._model = model
        self.alone = model.comm.size == 1
        self.nodes = model.nodes if self.alone else model.grid.nodes
        self._own = model.grid.numbers(model.nodes)

    def every(self, field: np.ndarray) -> np.ndarray:
        """(N, k) of a field (n, k); collective."""
        if self.alone:
            return field
        return self._model.on_grid(field).reshape(len(self.nodes), -1)

    def mask(self, own: np.ndarray) -> np.ndarray:
        """(N,) of a mask (n,); collective."""
        return self.every(own[:, None].astype(float))[:, 0] > 0.5

    def own(self, field: np.ndarray) -> np.ndarray:
        """(n, k) of a field (N, k)."""
        return field if self.alone else field[self._own]

    def rows(self, matrix: Any) -> Any:
        """(6 N, unknowns) of the rows (6 owned, unknowns) that each process has, scipy.sparse; collective."""
        from scipy.sparse import vstack

        if self.alone:
            return matrix
        model = self._model
        found = vstack(model.comm.allgather(matrix), format="csr")
        numbers = np.concatenate(model.comm.allgather(self._own[: model.owned]))
        place = np.empty(len(numbers), dtype=int)
        place[numbers] = np.arange(len(numbers))
        return found[(6 * place[:, None] + np.arange(6)).ravel()]

    def agreed(self, value: Any) -> Any:
        """What the first process has: decisions on it are the same everywhere, on any processors; collective."""
        return value if self.alone else self._model.comm.bcast(value)
