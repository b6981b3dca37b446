"""Controls of a path, and clamps: which nodes are held, where they go, and what a clamp carries. NumPy only."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from shellref.shell.problem import Pose


class Control(NamedTuple):
    """How much of each action is there: natural curvature, weight, other loads (factors), and where the clamps are.

    leg: of the clamps' path to which `move` belongs, the same all along a stage (it goes on straight beyond its ends).
    """

    natural: float = 1.0
    weight: float = 1.0
    load: float = 0.0
    move: float = 0.0
    leg: float = 0.0

    def between(self, other: Control, t: float) -> Control:
        """self + t (other - self)."""
        return Control(*(a + t * (b - a) for a, b in zip(self, other, strict=True)))

    def rate(self, other: Control) -> Control:
        """other - self."""
        return Control(*(b - a for a, b in zip(self, other, strict=True)))


def held_nodes(nodes: np.ndarray, clamp: str, at: float, half_width: float, corner: tuple[float, float]) -> np.ndarray:
    """Mask (n,) of the nodes (n, 2) whose position and director the clamp at S = `at` (0 or 1) holds.

    "edge": the whole edge (a physical clamp keeps it straight: thesis, 7.1). "corners": every node of the two corner
    cells, of size `corner` (along S, along v).
    """
    depth = np.abs(nodes[:, 0] - at)
    if clamp == "edge":
        return depth < 1e-9
    return (depth < corner[0] + 1e-9) & (np.abs(nodes[:, 1]) > half_width - corner[1] - 1e-9)


def rotation_vector(rotation: np.ndarray) -> np.ndarray:
    """Axis times angle (3,) of a rotation matrix, angle in [0, pi], from its unit quaternion (Shepperd's pivot)."""
    trace = np.trace(rotation)
    parts = np.array([trace, *np.diag(rotation)])
    k = int(np.argmax(parts))
    m = rotation
    skew = np.array([m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]])
    q = np.empty(4)
    if k == 0:
        q[0], q[1:] = 1.0 + trace, skew
    else:
        i = k - 1
        q[1:] = m[i] + m[:, i]
        q[1 + i] = 1.0 + 2.0 * m[i, i] - trace
        q[0] = skew[i]
    q /= np.linalg.norm(q)
    if q[0] < 0:
        q = -q
    size = np.linalg.norm(q[1:])
    if size < 1e-300:
        return np.zeros(3)
    return 2.0 * np.arctan2(size, q[0]) / size * q[1:]


def rotation(vector: np.ndarray) -> np.ndarray:
    """Rotation matrix of axis times angle (Rodrigues)."""
    angle = float(np.linalg.norm(vector))
    x, y, z = vector
    k = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    a = np.sinc(angle / np.pi)
    b = 0.5 * np.sinc(angle / (2.0 * np.pi)) ** 2
    return np.eye(3) + a * k + b * k @ k


@dataclass(frozen=True)
class PosePath:
    """A clamp's way through poses: straight lines, and frames that turn about a fixed axis by the shortest rotation."""

    poses: tuple[Pose, ...]

    def at(self, move: float, leg: int | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Position (3,) and frame (3, 3) at `move`: 0 at the first pose, 1 at the second, ...; straight on outside.

        leg: between poses leg and leg + 1, and straight on beyond both.
        """
        last = max(len(self.poses) - 2, 0)
        leg = int(np.clip(np.floor(move) if leg is None else leg, 0, last))
        here = self.poses[leg]
        position, frame = np.array(here.position), np.array(here.frame)
        if len(self.poses) == 1 or move == leg:
            return position, frame
        t, there = move - leg, self.poses[leg + 1]
        if t == 1.0:
            return np.array(there.position), np.array(there.frame)
        turn = rotation_vector(np.array(there.frame) @ frame.T)
        return position + t * (np.array(there.position) - position), rotation(t * turn) @ frame


def reactions(
    state: np.ndarray, residual: np.ndarray, held: np.ndarray, origin: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Force (3,) in D w / l^2 and moment (3,) about `origin` in D w / l that a support exerts on the strip.

    state, residual (n, 6): the residual dE/du at held nodes (mask (n,)) is the reaction that balances it; a nodal
    couple conjugate to the director acts through d x (dE/dd). Exact balances of the discrete equilibrium, as the energy
    is objective.
    """
    f, couple = residual[held, :3], residual[held, 3:]
    arms, directors = state[held, :3] - origin, state[held, 3:]
    return f.sum(axis=0), (np.cross(arms, f) + np.cross(directors, couple)).sum(axis=0)
