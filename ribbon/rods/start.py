"""Where a curve-angle rod begins: its unknowns and anchors from vertices and material frames of its edges."""

from __future__ import annotations

import numpy as np

from ribbon.rods.curve_angle import Anchors, CurveAngle
from ribbon.rods.rod import FloatArray, Rod, marched, transported


def from_frames(
    rod: Rod, points: FloatArray, frames: FloatArray, turn: float | None = None
) -> tuple[CurveAngle, FloatArray]:
    """Problem and unknowns (4 n + 3,) of vertices (n + 1, 3) and material frames (n, 3, 3) along the edges.

    The anchors are carried along the rod from the start without spin; angles are continuous in s. turn: twist of the
    last cell, between the last edge and an end that is held, to which the number of whole turns is chosen (None: the
    least).
    """
    n = rod.edges
    anchors = np.empty((n + 2, 3, 3))
    anchors[0] = frames[0] if rod.start.frame is None else rod.start.frame
    edges = np.diff(points, axis=0)
    tangents = edges / np.linalg.norm(edges, axis=1)[:, None]
    for j in range(n):
        anchors[j + 1] = transported(anchors[j], tangents[j])
    anchors[n + 1] = anchors[n] if rod.end.frame is None else rod.end.frame
    d1 = np.array([transported(frame, t) for frame, t in zip(frames, tangents, strict=True)])[:, :, 0]
    raw = np.arctan2(np.einsum("ij,ij->i", d1, anchors[1:-1, :, 1]), np.einsum("ij,ij->i", d1, anchors[1:-1, :, 0]))
    angles = np.unwrap(np.concatenate([[0.0], raw]))[1:]
    y = np.zeros((n + 1, 4))
    y[:, :3] = points
    y[:n, 3] = angles
    twists = np.zeros(n + 1)
    twists[n] = angles[-1] + (0.0 if turn is None else turn)
    problem = CurveAngle(rod, Anchors(anchors, twists))
    return problem.anchored(y.reshape(-1)[:-1]), y.reshape(-1)[:-1]


def from_strains(
    rod: Rod, position: FloatArray, frame: FloatArray, strains: FloatArray
) -> tuple[CurveAngle, FloatArray]:
    """Problem and unknowns of the rod that starts at `position` (3,), `frame` (3, 3) with kappa_1, kappa_2, tau =
    `strains` (n + 1, 3) in its cells."""
    return from_frames(rod, *marched(rod, position, frame, strains))
