"""Solves with a factored matrix that is changed by little rank (Sherman, Morrison and Woodbury). NumPy only."""

from __future__ import annotations

from typing import Any

import numpy as np


class Corrected:
    """(K - U G U^T)^-1 from the factors of K: with Z = K^-1 U it is K^-1 + Z G (1 - U^T Z G)^-1 U^T K^-1.

    factors: with `solve(right (n,))` = K^-1 right; u: U (n, k); g: G (k, k), of any rank, not symmetric.
    """

    def __init__(self, factors: Any, u: np.ndarray, g: np.ndarray) -> None:
        self._factors, self._u, self._g = factors, u, g
        self._z = np.stack([factors.solve(np.ascontiguousarray(column)) for column in u.T], axis=1)
        self._small = np.eye(len(g)) - u.T @ self._z @ g

    def solve(self, right: np.ndarray) -> np.ndarray:
        """(K - U G U^T)^-1 right (n,)."""
        found = self._factors.solve(right)
        y = np.linalg.solve(self._small, self._u.T @ found)
        return np.asarray(found + self._z @ (self._g @ y))
