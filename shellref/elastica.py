r"""Planar inextensible elastica, clamped at s = 0 and free at s = 1, on scikit-fem.

The third opinion on planar scenes: a thread of code that shares nothing with the ribbon nor with the shell.
Lengths are in l, energies in D w / l, forces in D w / l^2, curvatures in 1/l (theory sheet, section 2).

**Coordinates.** The plane is that of the clamped tangent t_z (x axis) and of -t_y (y axis); `theta` is the angle of the
tangent from the x axis, theta' = omega the normal curvature: a positive omega turns the tangent towards -t_y, as in
R' = R [kappa]_x (theory sheet, section 1)::

    t(s) = (cos theta, sin theta),   r(s) = int_0^s t

**Energy**, with natural curvature K(s), weight Gamma against the unit direction u (up) and a dead force F at s = 1::

    E = int_0^1 [1/2 theta'^2 - K theta'] ds + Gamma int_0^1 <r, u> ds - <F, r(1)>

(the ribbon's convention: without the constant 1/2 int K^2). Exchanging the order of integration in the weight (Fubini),

    int_0^1 <r(s), u> ds = int_0^1 int_0^s <t(sigma), u> dsigma ds = int_0^1 (1 - s) <t(s), u> ds ,

so the two loads act together on the local tangent through the force p(s) carried by the section at s::

    E = int_0^1 [1/2 theta'^2 - K theta' + <t(theta), p>] ds ,    p(s) = Gamma (1 - s) u - F

**Weak form.** For all v with v(0) = 0, with t_perp = dt/dtheta = (-sin theta, cos theta)::

    int (theta' - K) v' + <t_perp, p> v ds = 0          (strong form: (theta' - K)' = <t_perp, p>, theta'(1) = K(1))
    int  dtheta' v'     - <t, p> dtheta v ds            (its exact tangent)

This is the classical elastica under its own weight (e.g. B. Audoly and Y. Pomeau, Elasticity and Geometry, Oxford
University Press 2010, section 3.4; thesis, section 4.5).

**Layers at large Gamma.** Write theta = theta_u + psi, with theta_u the hanging direction (t = -u). Then
psi'' = |p| sin psi with |p| = Gamma (1 - s). Near the clamp, psi'' = Gamma sin psi: a pendulum's separatrix, of width
Gamma^(-1/2). (It gives the sqrt(Gamma/2) of figure 4.7: the reach is int sin psi dpsi / |psi'| = sqrt(2/Gamma).) Near
the free end, with sigma = 1 - s, psi'' = Gamma sigma psi: Airy's equation, of width Gamma^(-1/3), set off by the
natural curvature K(1). `graded_nodes` puts its nodes there.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike

from shellref.elastica_fem import ELEMENTS, Array, Discretisation
from shellref.elastica_path import ElasticaOptions, Path, follow


class ElasticaStatus(StrEnum):
    """How a solve ended."""

    CONVERGED = "converged"
    """Equilibrium, stable to the sign of the tangent's lowest eigenvalue."""
    UNSTABLE = "unstable"
    """Equilibrium, but not a minimum of the energy."""
    NOT_CONVERGED = "not_converged"
    """The path of equilibria ends below the full loads, and no descent leads further."""


@dataclass(frozen=True)
class ElasticaProblem:
    """Clamped-free planar elastica with l = 1, D w = 1.

    Parameters
    ----------
    gamma : weight against bending stiffness, >= 0.
    up : unit vector (2,) against the weight in plane coordinates (x along t_z, y along -t_y).
    curvature : natural curvature at s = 0 and s = 1, linear between.
    force : dead force (2,) at the free end, in D w / l^2.
    """

    gamma: float = 0.0
    up: tuple[float, float] = (0.0, 1.0)
    curvature: tuple[float, float] = (0.0, 0.0)
    force: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        for name, size in (("gamma", 1), ("up", 2), ("curvature", 2), ("force", 2)):
            value = np.atleast_1d(np.asarray(getattr(self, name), dtype=float))
            if value.shape != (size,) or not np.all(np.isfinite(value)):
                raise ValueError(f"{name} = {getattr(self, name)}: must be {size} finite number(s)")
            plain = tuple(float(number) for number in value)  # arrays compare badly: keep plain numbers
            object.__setattr__(self, name, plain if size > 1 else plain[0])
        if self.gamma < 0.0:
            raise ValueError(f"gamma = {self.gamma}: must not be negative; turn `up` instead")
        if abs(math.hypot(*self.up) - 1.0) > 1e-9:
            raise ValueError(f"up = {self.up}: is not a unit vector")

    def natural_curvature(self, s: Array) -> Array:
        """K(s), any shape."""
        return self.curvature[0] * (1.0 - s) + self.curvature[1] * s

    def carried(self, s: Array) -> tuple[Array, Array]:
        """The two components of p(s) = Gamma (1 - s) u - F, any shape."""
        lever = self.gamma * (1.0 - s)
        return lever * self.up[0] - self.force[0], lever * self.up[1] - self.force[1]

    def scaled(self, factor: float) -> ElasticaProblem:
        """The same strip under `factor` times the loads."""
        return ElasticaProblem(
            self.gamma * factor, self.up, self.curvature, (self.force[0] * factor, self.force[1] * factor)
        )

    @property
    def load(self) -> float:
        """Largest |p(s)|, at the clamp or at the free end, in D w / l^2."""
        return max(math.hypot(*(float(c) for c in self.carried(np.array(s)))) for s in (0.0, 1.0))


@dataclass(frozen=True)
class ElasticaEnergy:
    """Parts of the energy in D w / l: bending without the constant 1/2 int K^2, gravity (0 at the clamp), end force."""

    bending: float
    gravity: float
    force: float

    @property
    def total(self) -> float:
        return self.bending + self.gravity + self.force


@dataclass(frozen=True)
class ElasticaResult:
    """An equilibrium (or the last one found) with what is needed to judge it.

    nodes, theta, x, y : shape (n + 1,), at the joints of the elements.
    residual : L2 norm of the out-of-balance moment, in D w / l.
    lowest_eigenvalue : of the tangent against int v^2 (pi^2/4 without load), in D w / l.
    load_factor : share of the loads that was reached; 1 unless the status is NOT_CONVERGED.
    iterations : Newton iterations in all; steps : load steps accepted; snaps : descents past limit points.
    error : largest distance between this centreline and that of the halved elements, in l; None when not asked for.
    seconds : wall time, the error estimate not included.
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
    residual: float
    lowest_eigenvalue: float
    load_factor: float
    iterations: int
    steps: int
    snaps: int
    seconds: float
    error: float | None
    _discrete: Discretisation = field(repr=False, compare=False)
    _coefficients: Array = field(repr=False, compare=False)

    @property
    def stable(self) -> bool:
        return self.lowest_eigenvalue > 0.0

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


def solve(
    problem: ElasticaProblem,
    nodes: int | ArrayLike = 40,
    degree: int = 2,
    options: ElasticaOptions | None = None,
    estimate_error: bool = True,
) -> ElasticaResult:
    """The equilibrium reached from the natural shape by raising the loads in steps.

    Parameters
    ----------
    nodes : number of elements, graded towards the layers (`graded_nodes`), or the joints themselves, from 0 to 1.
    degree : polynomial degree of theta on an element, 1 to 4.
    estimate_error : solve once more on halved elements, for `ElasticaResult.error`.
    """
    options = options or ElasticaOptions()
    if degree not in ELEMENTS:
        raise ValueError(f"degree = {degree}: must be one of {sorted(ELEMENTS)}")
    joints = (
        graded_nodes(int(nodes), problem, degree) if isinstance(nodes, (int, np.integer)) else _checked_nodes(nodes)
    )
    result = _solve_once(problem, joints, degree, options)
    if not estimate_error:
        return result
    halved = np.sort(np.concatenate([joints, 0.5 * (joints[1:] + joints[:-1])]))
    finer = _solve_once(problem, halved, degree, options)
    if finer.status is ElasticaStatus.NOT_CONVERGED or result.status is ElasticaStatus.NOT_CONVERGED:
        return result
    distance = np.linalg.norm(finer.position(halved) - result.position(halved), axis=1)
    return replace(result, error=float(distance.max()))


def graded_nodes(elements: int, problem: ElasticaProblem, degree: int = 2) -> Array:
    """Joints of `elements` elements, dense where the loads make layers: shape (elements + 1,).

    Equal steps of a smooth density, so that halving the steps refines everywhere: a constant, plus exp(-s / c) for the
    layer at the clamp, of width delta = |p(0)|^(-1/2), and, when K(1) is not zero, exp(-(1 - s) / c) for the one at the
    free end, of width Gamma^(-1/3) or |F|^(-1/2), whichever is smaller. An error in H1 of exp(-s / delta) is spread
    evenly over elements of degree q when their density falls as exp(-2 s / ((2 q + 1) delta)); hence
    c = (q + 1/2) delta. Without load the joints are evenly spaced.
    """
    if isinstance(elements, bool) or elements < 1:
        raise ValueError(f"elements = {elements}: must be a whole number >= 1")
    clamp = min(1.0, math.hypot(problem.gamma, *problem.force) ** -0.5) if problem.load > 1.0 else 1.0
    tip = min(1.0, max(problem.gamma, math.hypot(*problem.force) ** 1.5, 1.0) ** (-1.0 / 3.0))
    near, far = (degree + 0.5) * clamp, (degree + 0.5) * tip
    fine = np.concatenate([[0.0], np.geomspace(1e-9, 0.5, 4000)])
    s = np.concatenate([fine, 1.0 - fine[-2::-1]])
    share = 0.4 * s + 0.4 * np.expm1(-s / near) / math.expm1(-1.0 / near)
    share += 0.2 * ((1.0 - np.expm1((s - 1.0) / far) / math.expm1(-1.0 / far)) if problem.curvature[1] else s)
    joints = np.interp(np.linspace(0.0, share[-1], elements + 1), share, s)
    joints[0], joints[-1] = 0.0, 1.0
    return joints


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


def _solve_once(problem: ElasticaProblem, nodes: Array, degree: int, options: ElasticaOptions) -> ElasticaResult:
    """One mesh: from the natural shape (exact without load) to the full loads in steps that adapt."""
    began = time.perf_counter()
    discrete = Discretisation(nodes, degree)
    scale = max(1.0, *(abs(k) for k in problem.curvature), math.sqrt(problem.load))
    path = follow(discrete, problem.scaled, problem.load, options.tolerance * scale, options)
    loaded = problem.scaled(path.reached)
    bending, loads = discrete.energies(path.coefficients, loaded)
    points = discrete.position(path.coefficients, nodes)
    force = -float(points[-1] @ np.array(loaded.force))
    status, message = _verdict(path)
    return ElasticaResult(
        problem=problem,
        degree=degree,
        status=status,
        message=message,
        nodes=nodes,
        theta=discrete.angle(path.coefficients, nodes),
        x=points[:, 0],
        y=points[:, 1],
        energy=ElasticaEnergy(bending, loads - force, force),
        residual=path.residual,
        lowest_eigenvalue=path.eigenvalue,
        load_factor=path.reached,
        iterations=path.iterations,
        steps=path.steps,
        snaps=path.snaps,
        seconds=time.perf_counter() - began,
        error=None,
        _discrete=discrete,
        _coefficients=path.coefficients,
    )


def _verdict(path: Path) -> tuple[ElasticaStatus, str]:
    """Status and what it means or what to try."""
    if path.reached < 1.0:
        return (
            ElasticaStatus.NOT_CONVERGED,
            f"the path of equilibria ends at {path.reached:.6g} of the loads: allow more snaps or use more elements",
        )
    if path.eigenvalue <= 0.0:
        return (
            ElasticaStatus.UNSTABLE,
            f"equilibrium, but unstable (lowest eigenvalue {path.eigenvalue:.3g}): tilt the clamp or the load a little",
        )
    snapped = f", after {path.snaps} snap(s) past limit points: other minima may exist" if path.snaps else ""
    return ElasticaStatus.CONVERGED, f"stable equilibrium{snapped}"


def _checked_nodes(nodes: ArrayLike) -> Array:
    joints = np.asarray(nodes, dtype=float)
    if (
        joints.ndim != 1
        or len(joints) < 2
        or joints[0] != 0.0
        or joints[-1] != 1.0
        or not np.all(np.diff(joints) > 0.0)
    ):
        raise ValueError(f"nodes of shape {joints.shape}: must increase from 0 to 1")
    return joints


def _abscissae(s: ArrayLike) -> Array:
    points = np.atleast_1d(np.asarray(s, dtype=float))
    if points.ndim != 1 or not np.all((points >= 0.0) & (points <= 1.0)):
        raise ValueError("abscissae must be a list of numbers from 0 to 1")
    return points
