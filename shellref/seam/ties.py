"""Nodes of a closed strip that are one: the end's is the start's, turned by half turns about the tangent. NumPy only.

After n half turns the particle (1, v) of the strip is the particle (0, (-1)^n v), with

    phi(1, v) = phi(0, (-1)^n v) ,   d(1, v) = (-1)^n d(0, (-1)^n v)

(docs/theory.md, eq. (7.22)). Nodes of the end have no unknowns of their own: their increments are those of their
partners, of the director with the sign (-1)^n, and what acts on them acts on their partners. The tangent of the energy
on that subspace is P^T K P, without a penalty and without a multiplier.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


def turned(half_turns: int) -> int:
    """(-1)^n: what becomes of the normal and of the width's direction at the seam."""
    return -1 if half_turns % 2 else 1


@dataclass(frozen=True)
class Tie:
    """nodes (m,) are where their partners (m,) are, with directors times `sign` (1 or -1)."""

    nodes: np.ndarray
    partners: np.ndarray
    sign: int

    @classmethod
    def of_rows(cls, first: np.ndarray, last: np.ndarray, half_turns: int) -> Tie:
        """The seam of a grid whose first and last rows of nodes, in ascending v, are these (m,)."""
        sign = turned(half_turns)
        return cls(np.asarray(last), np.asarray(first)[::sign], sign)

    def owners(self, n: int) -> np.ndarray:
        """(n,) the node whose unknowns each of n nodes has."""
        found = np.arange(n)
        found[self.nodes] = self.partners
        return found

    def placed(self, state: np.ndarray) -> np.ndarray:
        """The state (n, 6) with the tied nodes where their partners are (a copy)."""
        state = state.copy()
        state[self.nodes, :3] = state[self.partners, :3]
        state[self.nodes, 3:] = self.sign * state[self.partners, 3:]
        return state

    def joined(self, nodal: np.ndarray) -> np.ndarray:
        """What belongs to unknowns of each node (n, k), with that of the tied nodes given to their partners."""
        found = nodal.copy()
        np.add.at(found, self.partners, nodal[self.nodes])
        found[self.nodes] = 0.0
        return found
