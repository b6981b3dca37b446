"""How far a strip reaches beyond its walls, anywhere and not at its joints alone.

The strip is ruled: over a ruling the distance from a plane is linear, so that its least value is at an edge, and the
strip is as far beyond a wall as one of its edges ``r +- (w/2) (t_x + eta t_z)`` is. Their distance is sampled along
every segment and each of its minima is narrowed down. Seen from inside a round obstacle the same holds; from outside a
ruling may be nearest between its ends, where that is known for each (`ribbon.obstacle`), and its gap there is a third
curve beside those of both edges.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ribbon.obstacle import Obstacle
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
#: In the place of an edge: the nearest point of a ruling between its ends; by how much (l) it is nearer than those.
BETWEEN, _NEARER = 0.0, 1e-9


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
            (float(values[k, j]), Touch(wall, float(tried[k, j]), shape.across(float(tried[k, j]), wall, side)))
            for j, k in enumerate(at)
            if values[k, j] < below
        ]
    return found


def bends(problem: Problem, x: FloatArray, touch: Touch) -> bool:
    """Whether an obstacle is round where a point of the strip is nearest to it, not flat."""
    shape = _Edges(problem, x)
    surface = shape.surfaces[touch.wall]
    assert isinstance(surface, Obstacle)
    r, ruling = shape.rulings(np.array([touch.s]))
    return bool(np.any(surface.derivatives(r + touch.side * ruling)[2]))


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
        self.surfaces = [wall.scaled(problem.strip.length) for wall in problem.walls]
        #: How far a minimum may lie below the samples beside it, l.
        self.reach = float(problem.lengths.max()) / _SAMPLES

    def rulings(self, s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Positions (k, 3) of the centreline and half rulings (k, 3) there."""
        problem = self.problem
        r, frame, _, eta = centreline(
            self.q, problem.lengths, self.points, self.frames, s, problem.exponent_limit, self.seam, problem.fields.free
        )
        ruling = frame[:, :, 0] if problem.fields.free else frame[:, :, 0] + eta[:, None] * frame[:, :, 2]
        return r, problem.half_width * ruling

    def distance(self, s: FloatArray, wall: int, side: float) -> FloatArray:
        """From one wall (k,), of an edge or of the nearest point between (side BETWEEN; infinite where that is one)."""
        surface = self.surfaces[wall]
        r, ruling = self.rulings(s)
        if side != BETWEEN:
            return np.asarray(surface.gaps(r + side * ruling) - self.heights[wall])
        assert isinstance(surface, Obstacle)
        across = surface.nearest(r, ruling)
        inner = np.abs(across) < 1.0
        gaps = surface.gaps(r + np.clip(across, -1.0, 1.0)[:, None] * ruling)
        edges = np.minimum(surface.gaps(r + ruling), surface.gaps(r - ruling))
        return np.asarray(np.where(inner & (edges - gaps > _NEARER), gaps, np.inf))

    def across(self, s: float, wall: int, side: float) -> float:
        """Where across (-1 to 1) the nearest point of the ruling at s is, of an edge or between."""
        surface = self.surfaces[wall]
        if side != BETWEEN:
            return side
        assert isinstance(surface, Obstacle)
        return float(surface.nearest(*self.rulings(np.array([s])))[0])

    def distances(self, s: FloatArray) -> list[tuple[int, float, FloatArray]]:
        """Of every wall and edge, and of what is between them: the wall, the edge, the distances (k,)."""
        return [
            (k, side, self.distance(s, k, side))
            for k, surface in enumerate(self.surfaces)
            for side in ((1.0, -1.0, BETWEEN) if isinstance(surface, Obstacle) and surface.between else (1.0, -1.0))
        ]
