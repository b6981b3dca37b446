"""What a planar elastica's solve returns, and the way back into space."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike

from shellref.elastica.fem import Array, Discretisation, stability
from shellref.elastica.problem import ElasticaEnergy, ElasticaForces, ElasticaProblem


class ElasticaStatus(StrEnum):
    """How a solve ended."""

    CONVERGED = "converged"
    """Equilibrium; stable, or at a fold (`stable` is None): the tangent's lowest eigenvalue is zero to rounding."""
    UNSTABLE = "unstable"
    """Equilibrium, but not a minimum of the energy."""
    LIMIT_POINT = "limit_point"
    """Load steps met a limit point below the full loads and were not allowed past it: `stable` says nothing of them."""
    NOT_CONVERGED = "not_converged"
    """The path of equilibria ends below the full loads, and no descent leads further."""


@dataclass(frozen=True)
class Touch:
    """A place s that touches: another place (`other`, and `barrier` None) or the barrier of a number (`other` None).

    force (2,): on the place s, D w / l^2 (the opposite on the other place); gap: what is left, l; place (2,): of s.
    """

    s: float
    other: float | None
    barrier: int | None
    force: tuple[float, float]
    gap: float
    place: tuple[float, float]

    @property
    def push(self) -> float:
        """Size of the force, D w / l^2."""
        return float(np.hypot(*self.force))


@dataclass(frozen=True)
class ElasticaResult:
    """An equilibrium (or the last one found) with what is needed to judge it.

    nodes, theta, x, y : shape (n + 1,), at the joints of the elements.
    forces : what the supports and the dead force do to both ends, at the loads reached.
    residual : L2 norm of the out-of-balance moment, in D w / l, and of the misfit where ends are held.
    lowest_eigenvalue : of the tangent on the constraints against int v^2 (clamped-free without load: pi^2/4), in
        D w / l. rounding : bound of what it is known to (`Discretisation.rounding`), in D w / l.
    load_factor : share of the loads (of the way, where the end is held) that was reached; 1 unless the status is
        LIMIT_POINT or NOT_CONVERGED.
    iterations : Newton iterations in all; steps : load or arc-length steps; snaps : descents past limit points;
    limits : limit points that arc length passed; switches : bifurcations where the path went over to another branch.
    error : largest distance between this centreline and that of the halved elements, in l; None when not asked for.
    seconds : wall time, the error estimate not included.
    touches : where the strip touches what it may touch. through : how far (l) any place is nearer than it may be; None
    where there is nothing to touch.
    """

    problem: ElasticaProblem
    degree: int
    status: ElasticaStatus
    message: str
    nodes: Array
    theta: Array
    x: Array
    y: Array
    energy: ElasticaEnergy
    forces: ElasticaForces
    residual: float
    lowest_eigenvalue: float
    rounding: float
    load_factor: float
    iterations: int
    steps: int
    snaps: int
    seconds: float
    error: float | None
    limits: int
    switches: int
    hermite: bool
    _discrete: Discretisation = field(repr=False, compare=False)
    _coefficients: Array = field(repr=False, compare=False)
    touches: tuple[Touch, ...] = ()
    through: float | None = None

    @property
    def stable(self) -> bool | None:
        """None at a fold or a bifurcation: the lowest eigenvalue is zero to rounding."""
        return stability(self.lowest_eigenvalue, self.rounding)

    def angle(self, s: ArrayLike) -> Array:
        """theta at the abscissae s (N,): shape (N,)."""
        return self._discrete.angle(self._coefficients, _abscissae(s))

    def position(self, s: ArrayLike) -> Array:
        """Points at the abscissae s (N,) to quadrature accuracy: shape (N, 2)."""
        return self._discrete.position(self._coefficients, _abscissae(s))

    @property
    def end(self) -> tuple[float, float]:
        """Point at s = 1."""
        return float(self.x[-1]), float(self.y[-1])

    @property
    def middle(self) -> tuple[float, float]:
        """Point at s = 1/2."""
        x, y = self.position([0.5])[0]
        return float(x), float(y)


def to_plane(frame: ArrayLike, vector: ArrayLike) -> tuple[tuple[float, float], float]:
    """A spatial vector (3,) in the plane of a clamp frame (3, 3; columns t_x, t_y, t_z), and its part along t_x."""
    across, y, x = np.asarray(frame, dtype=float).T @ np.asarray(vector, dtype=float)
    return (float(x), float(-y)), float(across)


def embed(result: ElasticaResult, position: ArrayLike, frame: ArrayLike, s: ArrayLike | None = None) -> Array:
    """The centreline in space, shape (N, 3): `position` (3,) + x t_z - y t_y, at the joints or at abscissae s (N,)."""
    axes = np.asarray(frame, dtype=float)
    plane = np.column_stack([result.x, result.y]) if s is None else result.position(s)
    return np.asarray(position, dtype=float) + np.outer(plane[:, 0], axes[:, 2]) - np.outer(plane[:, 1], axes[:, 1])


def embed_frames(result: ElasticaResult, frame: ArrayLike, s: ArrayLike) -> Array:
    """Material frames in space at the abscissae s (N,), shape (N, 3, 3), columns t_x, t_y, t_z."""
    axes = np.asarray(frame, dtype=float)
    theta = result.angle(s)[:, None]
    tangent = np.cos(theta) * axes[:, 2] - np.sin(theta) * axes[:, 1]
    normal = np.sin(theta) * axes[:, 2] + np.cos(theta) * axes[:, 1]
    across = np.broadcast_to(axes[:, 0], tangent.shape)
    return np.stack([across, normal, tangent], axis=2)


def _abscissae(s: ArrayLike) -> Array:
    points = np.atleast_1d(np.asarray(s, dtype=float))
    if points.ndim != 1 or not np.all((points >= 0.0) & (points <= 1.0)):
        raise ValueError("abscissae must be a list of numbers from 0 to 1")
    return points
