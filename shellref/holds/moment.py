"""A moment of fixed direction on the free end edge of a shell. NumPy only.

M does the virtual work M . omega on the rotation omega of the edge's mean frame: of the director's mean D and of the
edge's mean direction A, both linear in the nodes x_i, d_i of the edge at v_i (shares s_i of its length, sum 1),

    D = sum s_i d_i ,   A = sum a_i x_i ,   a_i = s_i (v_i - v) / sum s_j (v_j - v)^2 ,   v = sum s_j v_j

With e = D / |D|, c = e . A, q = |A|^2 - c^2 (the edge's direction across e), the frame turns by
omega = e x de + e [(e x A) . (dA - c de)] / q, so that the work is g_D . dD + g_A . dA with

    g_A = (M . e) (e x A) / q ,   g_D = [M x e - (M . e) c (e x A) / q] / |D|

(docs/theory.md, eq. (7.32)). A rigid turn of the edge is that of its frame, so the nodes' forces a_i g_A on positions
and s_i g_D on directors have no resultant and exactly the moment M, whatever the edge's shape; what M bends and twists
acts on directors, evenly, what it turns in the surface on positions, in proportion to v, as a beam's stress.

M . omega is no differential: the tangent G = d(g_D, g_A) / d(D, A) is not symmetric where M leaves the plane across the
edge's director, and there is no potential. Its rank is six at most: the shell's symmetric tangent is factored, and what
comes out corrected (shellref.fenics.rank).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


def _cross(a: np.ndarray) -> np.ndarray:
    """(3, 3): its product with b is a x b."""
    x, y, z = a
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


@dataclass(frozen=True)
class EdgeMoment:
    """moment (3,), fixed in space, on the nodes (m,) of an edge; shares (m,): s_i, arms (m,): a_i."""

    nodes: np.ndarray
    shares: np.ndarray
    arms: np.ndarray
    moment: np.ndarray

    @classmethod
    def on(cls, nodes: np.ndarray, v: np.ndarray, lengths: np.ndarray, moment: np.ndarray) -> EdgeMoment:
        """On nodes at v (m,) that have these lengths (m,) of the edge."""
        shares = lengths / lengths.sum()
        across = v - shares @ v
        return cls(nodes, shares, shares * across / (shares @ across**2), np.asarray(moment, dtype=float))

    def frame(self, state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(D, A) of a state (n, 6)."""
        edge = state[self.nodes]
        return self.shares @ edge[:, 3:], self.arms @ edge[:, :3]

    def forces(self, state: np.ndarray) -> np.ndarray:
        """(n, 6): a_i g_A on positions, s_i g_D on directors."""
        d, a = self.frame(state)
        size = float(np.linalg.norm(d))
        e = d / size
        along, turned, c = float(self.moment @ e), np.cross(e, a), float(e @ a)
        q = float(a @ a) - c * c
        on_a = along * turned / q
        out = np.zeros_like(state)
        out[self.nodes] = np.hstack(
            [np.outer(self.arms, on_a), np.outer(self.shares, (np.cross(self.moment, e) - c * on_a) / size)]
        )
        return out

    def tangent(self, state: np.ndarray) -> np.ndarray:
        """G (6, 6), rows g_D, g_A, columns D, A."""
        m = self.moment
        d, a = self.frame(state)
        size = float(np.linalg.norm(d))
        e = d / size
        b, x, c = float(m @ e), np.cross(e, a), float(e @ a)
        q = float(a @ a) - c * c
        straight = (np.eye(3) - np.outer(e, e)) / size  # de / dD
        slope_e, slope_a = -2.0 * c * a, 2.0 * (a - c * e)  # of q
        on_a = b * x / q
        by_e = np.outer(x, m) / q - b * _cross(a) / q - np.outer(on_a, slope_e) / q
        by_a = b * _cross(e) / q - np.outer(on_a, slope_a) / q
        on_d = np.cross(m, e) - c * on_a  # times |D|
        d_by_e = _cross(m) - np.outer(on_a, a) - c * by_e
        d_by_a = -np.outer(on_a, e) - c * by_a
        return np.block(
            [
                [(d_by_e @ straight - np.outer(on_d, e) / size) / size, d_by_a / size],
                [by_e @ straight, by_a],
            ]
        )

    def columns(self, count: int) -> np.ndarray:
        """B (6, count, 6): the nodal fields of which the products with increments are the changes of (D, A)."""
        out = np.zeros((6, count, 6))
        for axis in range(3):
            out[axis, self.nodes, 3 + axis] = self.shares
            out[3 + axis, self.nodes, axis] = self.arms
        return out

    def stiff(self, state: np.ndarray, step: np.ndarray) -> np.ndarray:
        """The change (n, 6) of `forces` along nodal increments (n, 6)."""
        d, a = self.frame(step)
        change = self.tangent(state) @ np.concatenate([d, a])
        out = np.zeros_like(state)
        out[self.nodes] = np.hstack([np.outer(self.arms, change[3:]), np.outer(self.shares, change[:3])])
        return out
