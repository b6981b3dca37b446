"""A deformed shell surface, evaluated anywhere in material coordinates. NumPy only: no dolfinx needed to read results.

Material coordinates: S in [0, 1] along the strip, v in [-w/2, w/2] across it, both over the length l.
"""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np

from shellref.kernels import lagrange
from shellref.shell import archive


def _locate(nodes: np.ndarray, degree: int, x: np.ndarray, name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Element number, local coordinate in [0, 1] and element size of each x; nodes (k n + 1,) ascending."""
    ends = nodes[::degree]
    slack = 1e-9 * (ends[-1] - ends[0])
    if np.any(x < ends[0] - slack) or np.any(x > ends[-1] + slack) or not np.all(np.isfinite(x)):
        raise ValueError(f"{name} must lie in [{ends[0]:g}, {ends[-1]:g}]")
    element = np.clip(np.searchsorted(ends, x, side="right") - 1, 0, len(ends) - 2)
    size = (ends[1:] - ends[:-1])[element]
    return element, np.clip((x - ends[element]) / size, 0.0, 1.0), size


@dataclass(frozen=True)
class ShellSurface:
    """Piecewise polynomial surface through the nodes of a shell solve.

    s_nodes (k nx + 1,), v_nodes (k ny + 1,): material coordinates of the nodes, ascending (units l), Gauss-Lobatto in
    every element of degree k. points, directors (k nx + 1, k ny + 1, 3): position (units l) and unit director (= +t_y)
    at the nodes.
    """

    s_nodes: np.ndarray
    v_nodes: np.ndarray
    points: np.ndarray
    directors: np.ndarray
    degree: int = 2

    def __post_init__(self) -> None:
        shape = (len(self.s_nodes), len(self.v_nodes), 3)
        if self.points.shape != shape or self.directors.shape != shape:
            raise ValueError(f"points and directors must have shape {shape}, not {self.points.shape}")
        k = self.degree
        if any(len(nodes) <= k or (len(nodes) - 1) % k for nodes in (self.s_nodes, self.v_nodes)):
            raise ValueError(f"elements of degree {k} have a multiple of {k} and one more nodes in each direction")

    def _interpolate(self, field: np.ndarray, s: np.ndarray, v: np.ndarray, slope: bool = False) -> np.ndarray:
        """field (ns, nv, 3) or its S-derivative at s, v (broadcast together): broadcast shape + (3,)."""
        s, v = np.broadcast_arrays(np.asarray(s, dtype=float), np.asarray(v, dtype=float))
        k = self.degree
        i, a, size = _locate(self.s_nodes, k, s, "s")
        j, b, _ = _locate(self.v_nodes, k, v, "v")
        along = lagrange.slopes(k, a) / size[..., None] if slope else lagrange.values(k, a)
        rows = (k * i)[..., None, None] + np.arange(k + 1)[:, None]
        columns = (k * j)[..., None, None] + np.arange(k + 1)
        return np.einsum("...a,...b,...abk->...k", along, lagrange.values(k, b), field[rows, columns])

    def evaluate(self, s: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Positions at material points; s, v broadcast against each other, result has their shape + (3,), units l."""
        return self._interpolate(self.points, s, v)

    def grid(self, s: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Positions on the grid s (m,) x v (k,): (m, k, 3), units l."""
        return self.evaluate(np.asarray(s)[:, None], np.asarray(v)[None, :])

    def director(self, s: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Unit directors at material points, shape of s, v broadcast + (3,)."""
        d = self._interpolate(self.directors, s, v)
        return d / np.linalg.norm(d, axis=-1, keepdims=True)

    def centreline(self, s: np.ndarray) -> np.ndarray:
        """Positions of the material line v = 0: shape of s + (3,), units l."""
        return self.evaluate(s, self._middle())

    def frames(self, s: np.ndarray) -> np.ndarray:
        """Frames on v = 0, shape of s + (3, 3), columns t_x t_y t_z.

        t_z is the unit dphi/dS (mean of both sides at an element's end), t_y the director made normal to it,
        t_x = t_y x t_z.
        """
        s = np.asarray(s, dtype=float)
        shift = 1e-9
        back, ahead = np.clip(s - shift, self.s_nodes[0], None), np.clip(s + shift, None, self.s_nodes[-1])
        behind, before = (self._interpolate(self.points, x, self._middle(), slope=True) for x in (back, ahead))
        tz = behind + before
        tz = tz / np.linalg.norm(tz, axis=-1, keepdims=True)
        d = self.director(s, self._middle())
        ty = d - np.sum(d * tz, axis=-1, keepdims=True) * tz
        ty = ty / np.linalg.norm(ty, axis=-1, keepdims=True)
        return np.stack([np.cross(ty, tz), ty, tz], axis=-1)

    def _middle(self) -> np.ndarray:
        return np.asarray(0.5 * (self.v_nodes[0] + self.v_nodes[-1]))

    def save(self, path: str | os.PathLike[str], **extra: np.ndarray) -> None:
        """Write an .npz (s_nodes, v_nodes, points, directors, degree and `extra` arrays), atomically."""
        content = archive.npz(
            s_nodes=self.s_nodes,
            v_nodes=self.v_nodes,
            points=self.points,
            directors=self.directors,
            degree=np.array(self.degree),
            **extra,
        )
        archive.write(path, content)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> ShellSurface:
        """Read what `save` (or the worker) wrote."""
        with np.load(path, allow_pickle=False) as data:
            degree = int(data["degree"]) if "degree" in data else 2
            return cls(data["s_nodes"], data["v_nodes"], data["points"], data["directors"], degree)
