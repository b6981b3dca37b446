"""How far a strip reaches beyond its walls, anywhere and not at its joints alone.

The strip is ruled: over a ruling the distance from a plane is linear, so that its least value is at an edge, and the
strip is as far beyond a wall as one of its edges ``r +- (w/2) (t_x + eta t_z)`` is. Their distance is sampled along
every segment and each of its minima is narrowed down.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ribbon.problems.mixed import MixedProblem
from ribbon.problems.protocol import Problem
from ribbon.problems.touching import Touch
from ribbon.solvers.problem import violation
from ribbon.surface import centreline

FloatArray = NDArray[np.float64]

#: Furthest (l) that an equilibrium reaches beyond a wall.
TOLERANCE = 1e-6
#: Samples of a segment, at the least, and turn (rad) between two of them, at the most.
_SAMPLES, _TURN = 8, 0.1
#: Samples and rounds that narrow a minimum down: the interval shrinks to its quarter in each.
_NARROWED, _ROUNDS = 9, 6


def minima(problem: Problem, x: FloatArray, below: float = 0.0) -> list[tuple[float, Touch]]:
    """Distances (l) below `below` of the edges from their walls where they are least, and where that is."""
    shape = _Edges(problem, x)
    s = _abscissae(problem, x)
    found: list[tuple[float, Touch]] = []
    for wall, side, distance in shape.distances(s):
        left = np.concatenate([[np.inf], distance[:-1]])
        right = np.concatenate([distance[1:], [np.inf]])
        least = np.nonzero((distance < left) & (distance <= right) & (distance < below + shape.reach))[0]
        if not least.size:
            continue
        low, high = s[np.maximum(least - 1, 0)], s[np.minimum(least + 1, s.size - 1)]
        for _ in range(_ROUNDS):
            tried = np.linspace(low, high, _NARROWED)
            values = shape.distance(tried.ravel(), wall, side).reshape(tried.shape)
            at = np.argmin(values, axis=0)
            each = np.arange(least.size)
            low = tried[np.maximum(at - 1, 0), each]
            high = tried[np.minimum(at + 1, _NARROWED - 1), each]
        at = np.argmin(values, axis=0)
        found += [
            (float(values[k, j]), Touch(wall, float(tried[k, j]), side))
            for j, k in enumerate(at)
            if values[k, j] < below
        ]
    return found


def deepest(problem: Problem, x: FloatArray) -> float | None:
    """How far (l) the strip reaches beyond a wall, 0 where it does not; None without walls, and where it has no shape.

    Where a minimiser stopped before the pieces of a strip fit together, the strip is the one that their curvatures make
    from its start on: one in pieces, each on its own side of the wall, would reach nowhere.
    """
    if not problem.walls or not np.all(np.isfinite(x)):
        return None
    if violation(problem, x) > TOLERANCE:
        x = _in_one_piece(problem, x)
    return max((-distance for distance, _ in minima(problem, x)), default=0.0)


def _in_one_piece(problem: Problem, x: FloatArray) -> FloatArray:
    """The unknowns with every piece where the one before it ends."""
    assert isinstance(problem, MixedProblem)
    layout = problem.layout
    anchored = problem.anchored(problem.anchor(x))
    whole = anchored.state(*problem.joint_values(x), problem.in_plane_values(x))
    if problem.start_position is None:
        layout.positions(whole)[:] += x[layout.joint(0).position] - whole[layout.joint(0).position]
    whole[layout.ribbon :] = x[layout.ribbon :]  # plates
    return np.asarray(whole)


def _abscissae(problem: Problem, x: FloatArray) -> FloatArray:
    """Joints and points between them, close enough together for every minimum of a distance to show."""
    q, lengths = problem.parameters(x), problem.lengths
    bend = (np.abs(q[:, 1]) + np.abs(q[:, 0]) * lengths) * lengths
    slant = 1.0 if problem.fields.free else np.sqrt(1.0 + (np.abs(q[:, 3]) + np.abs(q[:, 2]) * lengths) ** 2)
    counts = np.maximum(_SAMPLES, np.ceil(bend * slant / _TURN)).astype(int)
    starts = np.concatenate([[0.0], np.cumsum(lengths)])
    parts = [a + h * np.arange(n) / n for a, h, n in zip(starts, lengths, counts, strict=False)]
    return np.concatenate([*parts, starts[-1:]])


class _Edges:
    """Distances of the edges of a shape from its walls."""

    def __init__(self, problem: Problem, x: FloatArray) -> None:
        self.problem = problem
        self.q = problem.parameters(x)
        self.points, self.frames = problem.joints(x)
        self.seam = 0 if problem.closure is None else problem.closure.sign
        heights = iter(x[problem.layout.heights]) if isinstance(problem, MixedProblem) else iter(())
        self.heights = [0.0 if wall.stiffness is None else float(next(heights)) for wall in problem.walls]
        #: How far a minimum may lie below the samples beside it, l.
        self.reach = float(problem.lengths.max()) / _SAMPLES

    def edge(self, s: FloatArray, side: float) -> FloatArray:
        """Positions (k, 3)."""
        problem = self.problem
        r, frame, _, eta = centreline(
            self.q, problem.lengths, self.points, self.frames, s, problem.exponent_limit, self.seam, problem.fields.free
        )
        ruling = frame[:, :, 0] if problem.fields.free else frame[:, :, 0] + eta[:, None] * frame[:, :, 2]
        return np.asarray(r + side * problem.half_width * ruling)

    def distance(self, s: FloatArray, wall: int, side: float) -> FloatArray:
        """From one wall (k,)."""
        plane = self.problem.walls[wall]
        point = np.asarray(plane.point) / self.problem.strip.length
        return np.asarray((self.edge(s, side) - point) @ np.asarray(plane.normal) - self.heights[wall])

    def distances(self, s: FloatArray) -> list[tuple[int, float, FloatArray]]:
        """Of every wall and edge: the wall, the edge, the distances (k,)."""
        return [(k, side, self.distance(s, k, side)) for k in range(len(self.problem.walls)) for side in (1.0, -1.0)]
