"""Clamps: which nodes are held, and what the clamp carries."""

from __future__ import annotations

import numpy as np


def held_nodes(nodes: np.ndarray, clamp: str) -> np.ndarray:
    """Mask (n,) of the nodes whose position and director are held; nodes (n, 2) material coordinates (S, v).

    "edge": the whole edge S = 0 (a physical clamp keeps it straight: thesis, 7.1).
    """
    held = {"edge": nodes[:, 0] < 1e-9}
    return held[clamp]


def reactions(
    state: np.ndarray, residual: np.ndarray, held: np.ndarray, origin: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Force (3,) in D w / l^2 and moment (3,) about `origin` in D w / l that the clamp exerts on the strip.

    state, residual (n, 6): the residual dE/du at held nodes is the reaction that balances it; a nodal couple conjugate
    to the director acts through d x (dE/dd). Exact balances of the discrete equilibrium, as the energy is objective.
    """
    f, couple = residual[held, :3], residual[held, 3:]
    arms, directors = state[held, :3] - origin, state[held, 3:]
    return f.sum(axis=0), (np.cross(arms, f) + np.cross(directors, couple)).sum(axis=0)
