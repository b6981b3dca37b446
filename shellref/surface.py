"""A deformed shell surface, evaluated anywhere in material coordinates. NumPy only: no dolfinx needed to read results.

Material coordinates: S in [0, 1] along the strip, v in [-w/2, w/2] across it, both over the length l.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np


def _lagrange(t: np.ndarray) -> np.ndarray:
    """Quadratic Lagrange functions of the nodes 0, 1/2, 1 at t: (..., 3)."""
    return np.stack([(2 * t - 1) * (t - 1), 4 * t * (1 - t), t * (2 * t - 1)], axis=-1)


def _lagrange_slope(t: np.ndarray) -> np.ndarray:
    """Their derivatives: (..., 3)."""
    return np.stack([4 * t - 3, 4 - 8 * t, 4 * t - 1], axis=-1)


def _locate(nodes: np.ndarray, x: np.ndarray, name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Element number, local coordinate in [0, 1] and element size of each x; nodes (2 n + 1,) ascending."""
    ends = nodes[::2]
    slack = 1e-9 * (ends[-1] - ends[0])
    if np.any(x < ends[0] - slack) or np.any(x > ends[-1] + slack) or not np.all(np.isfinite(x)):
        raise ValueError(f"{name} must lie in [{ends[0]:g}, {ends[-1]:g}]")
    element = np.clip(np.searchsorted(ends, x, side="right") - 1, 0, len(ends) - 2)
    size = (ends[1:] - ends[:-1])[element]
    return element, np.clip((x - ends[element]) / size, 0.0, 1.0), size


@dataclass(frozen=True)
class ShellSurface:
    """Biquadratic surface through the nodes of a shell solve.

    s_nodes (2 nx + 1,), v_nodes (2 ny + 1,): material coordinates of the nodes, ascending (units l).
    points, directors (2 nx + 1, 2 ny + 1, 3): position (units l) and unit director (= +t_y) at the nodes.
    """

    s_nodes: np.ndarray
    v_nodes: np.ndarray
    points: np.ndarray
    directors: np.ndarray

    def __post_init__(self) -> None:
        shape = (len(self.s_nodes), len(self.v_nodes), 3)
        if self.points.shape != shape or self.directors.shape != shape:
            raise ValueError(f"points and directors must have shape {shape}, not {self.points.shape}")
        if any(len(nodes) < 3 or len(nodes) % 2 == 0 for nodes in (self.s_nodes, self.v_nodes)):
            raise ValueError("biquadratic elements have an odd number of nodes, 3 or more, in each direction")

    def _interpolate(self, field: np.ndarray, s: np.ndarray, v: np.ndarray, slope: bool = False) -> np.ndarray:
        """field (ns, nv, 3) or its S-derivative at s, v (broadcast together): broadcast shape + (3,)."""
        s, v = np.broadcast_arrays(np.asarray(s, dtype=float), np.asarray(v, dtype=float))
        i, a, size = _locate(self.s_nodes, s, "s")
        j, b, _ = _locate(self.v_nodes, v, "v")
        along = _lagrange_slope(a) / size[..., None] if slope else _lagrange(a)
        rows = (2 * i)[..., None, None] + np.arange(3)[:, None]
        columns = (2 * j)[..., None, None] + np.arange(3)
        return np.einsum("...a,...b,...abk->...k", along, _lagrange(b), field[rows, columns])

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
        """Write an .npz (s_nodes, v_nodes, points, directors and `extra` arrays), atomically."""
        path = Path(path)
        temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
        with open(temporary, "wb") as stream:
            np.savez(
                stream,
                s_nodes=self.s_nodes,
                v_nodes=self.v_nodes,
                points=self.points,
                directors=self.directors,
                **extra,
            )  # type: ignore[arg-type]
        os.replace(temporary, path)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> ShellSurface:
        """Read what `save` (or the worker) wrote."""
        with np.load(path, allow_pickle=False) as data:
            return cls(data["s_nodes"], data["v_nodes"], data["points"], data["directors"])
