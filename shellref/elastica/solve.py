r"""Planar inextensible elastica on scikit-fem: clamped at s = 0 and free at s = 1, or held as `ElasticaProblem` says.

The third opinion on planar scenes: a thread of code that shares nothing with the ribbon nor with the shell.
Lengths are in l, energies in D w / l, forces in D w / l^2, curvatures in 1/l (theory sheet, section 2).

**Coordinates.** The plane is that of the clamped tangent t_z (x axis) and of -t_y (y axis); `theta` is the angle of the
tangent from the x axis, theta' = omega the normal curvature: a positive omega turns the tangent towards -t_y, as in
R' = R [kappa]_x (theory sheet, section 1)::

    t(s) = (cos theta, sin theta),   r(s) = int_0^s t

**Energy**, with natural curvature K(s), weight Gamma against the unit direction u (up) and a dead force F at s = 1
(docs/theory.md, eq. (8.1))::

    E = int_0^1 [1/2 theta'^2 - K theta'] ds + Gamma int_0^1 <r, u> ds - <F, r(1)>

(the ribbon's convention: without the constant 1/2 int K^2). Exchanging the order of integration in the weight (Fubini),

    int_0^1 <r(s), u> ds = int_0^1 int_0^s <t(sigma), u> dsigma ds = int_0^1 (1 - s) <t(s), u> ds ,

so the two loads act together on the local tangent through the force p(s) carried by the section at s (docs/theory.md,
eq. (8.2))::

    E = int_0^1 [1/2 theta'^2 - K theta' + <t(theta), p>] ds ,    p(s) = Gamma (1 - s) u - F

**Weak form** (docs/theory.md, eq. (8.3)). For all v with v(0) = 0, with t_perp = dt/dtheta = (-sin theta, cos theta)::

    int (theta' - K) v' + <t_perp, p> v ds = 0          (strong form: (theta' - K)' = <t_perp, p>, theta'(1) = K(1))
    int  dtheta' v'     - <t, p> dtheta v ds            (its exact tangent)

This is the classical elastica under its own weight (e.g. B. Audoly and Y. Pomeau, Elasticity and Geometry, Oxford
University Press 2010, section 3.4; thesis, section 4.5).

**Held ends** enter as constraints, their forces as multipliers: `shellref.elastica.system`; paths past limit points and
over to other branches: `shellref.elastica.arc` and `shellref.elastica.branches`; rods in SI units:
`shellref.elastica.rod`; the lab sheet's flower stem: `tests.validation.elastica.elastica_daisy`.

**Layers at large Gamma.** Write theta = theta_u + psi, with theta_u the hanging direction (t = -u). Then
psi'' = |p| sin psi with |p| = Gamma (1 - s). Near the clamp, psi'' = Gamma sin psi: a pendulum's separatrix, of width
Gamma^(-1/2). (It gives the sqrt(Gamma/2) of figure 4.7: the reach is int sin psi dpsi / |psi'| = sqrt(2/Gamma);
docs/theory.md, eq. (8.4).) Near
the free end, with sigma = 1 - s, psi'' = Gamma sigma psi: Airy's equation, of width Gamma^(-1/3), set off by the
natural curvature K(1). `graded_nodes` puts its nodes there.
"""

from __future__ import annotations

import math
import time
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ribbonbench import clock
from shellref import law
from shellref.elastica.fem import ELEMENTS, HERMITE_DEGREE, Array, Discretisation, stability
from shellref.elastica.held import Arrival, drive
from shellref.elastica.path import ElasticaOptions, Path, follow
from shellref.elastica.problem import ElasticaEnergy, ElasticaForces, ElasticaProblem
from shellref.elastica.result import ElasticaResult, ElasticaStatus, embed, embed_frames, to_plane
from shellref.elastica.system import System

__all__ = [
    "ElasticaEnergy",
    "ElasticaForces",
    "ElasticaOptions",
    "ElasticaProblem",
    "ElasticaResult",
    "ElasticaStatus",
    "embed",
    "embed_frames",
    "graded_nodes",
    "solve",
    "to_plane",
]


def solve(
    problem: ElasticaProblem,
    nodes: int | ArrayLike = 40,
    degree: int = 2,
    options: ElasticaOptions | None = None,
    estimate_error: bool = True,
    hermite: bool = False,
) -> ElasticaResult:
    """The equilibrium reached from the natural shape by raising the loads and moving held ends to their place.

    Parameters
    ----------
    nodes : number of elements, graded towards the layers (`graded_nodes`), or the joints themselves, from 0 to 1.
    degree : polynomial degree of theta on an element, 1 to 4.
    estimate_error : solve once more on halved elements, for `ElasticaResult.error`.
    hermite : cubic elements with continuous curvature instead of the continuous ones (degree 3 only).
    """
    options = options or ElasticaOptions()
    problem.check_reach()
    if problem.touching:
        raise ValueError(
            "apart, barriers: contact has a way of its own: shellref.elastica.start.solve_along, solve_near"
        )
    if degree not in ELEMENTS:
        raise ValueError(f"degree = {degree}: must be one of {sorted(ELEMENTS)}")
    if hermite and degree != HERMITE_DEGREE:
        raise ValueError(f"degree = {degree}: Hermite elements have degree {HERMITE_DEGREE}")
    joints = (
        graded_nodes(int(nodes), problem, degree) if isinstance(nodes, (int, np.integer)) else _checked_nodes(nodes)
    )
    joints = law.cut(joints, problem.curvature)
    result = _solve_once(problem, joints, degree, hermite, options)
    if not estimate_error:
        return result
    halved = np.sort(np.concatenate([joints, 0.5 * (joints[1:] + joints[:-1])]))
    finer = _solve_once(problem, halved, degree, hermite, options)
    if result.load_factor < 1.0 or finer.load_factor < 1.0:
        return result
    distance = np.linalg.norm(finer.position(halved) - result.position(halved), axis=1)
    return replace(result, error=float(distance.max()))


def graded_nodes(elements: int, problem: ElasticaProblem, degree: int = 2) -> Array:
    """Joints of `elements` elements, dense where the loads make layers: shape (elements + 1,).

    Equal steps of a smooth density, so that halving the steps refines everywhere: a constant, plus exp(-s / c) for the
    layer at the clamp, of width delta = |p(0)|^(-1/2), and exp(-(1 - s) / c) for the one at the free end, of width
    Gamma^(-1/3) or |F|^(-1/2), whichever is smaller. A held end carries a force of the order of the loads: its layer is
    as wide as the clamp's. A fifth of the elements serve the end where K(1) is not zero or its angle is given; a
    twentieth otherwise, for the lowest mode alone, which is Airy's (its eigenvalue is 7.8 % off at Gamma = 1e7
    without). An error in H1 of exp(-s / delta) is spread evenly over elements of degree q when their density falls as
    exp(-2 s / ((2 q + 1) delta)); hence c = (q + 1/2) delta. Without load the joints are evenly spaced.
    """
    if isinstance(elements, bool) or elements < 1:
        raise ValueError(f"elements = {elements}: must be a whole number >= 1")
    clamp = min(1.0, math.hypot(problem.gamma, *problem.force) ** -0.5) if problem.load > 1.0 else 1.0
    tip = min(1.0, max(problem.gamma, math.hypot(*problem.force) ** 1.5, 1.0) ** (-1.0 / 3.0))
    if problem.end is not None:
        tip = min(tip, clamp)
    layer = law.knots(problem.curvature)[1][-1] != 0.0 or problem.end_angle is not None
    end = 0.2 if layer else 0.05
    near, far = (degree + 0.5) * clamp, (degree + 0.5) * tip
    fine = np.concatenate([[0.0], np.geomspace(1e-9, 0.5, 4000)])
    s = np.concatenate([fine, 1.0 - fine[-2::-1]])
    share = (0.6 - end) * s + 0.4 * np.expm1(-s / near) / math.expm1(-1.0 / near)
    share += end * (1.0 - np.expm1((s - 1.0) / far) / math.expm1(-1.0 / far))
    joints = np.interp(np.linspace(0.0, share[-1], elements + 1), share, s)
    joints[0], joints[-1] = 0.0, 1.0
    return law.cut(joints, problem.curvature)


def _solve_once(
    problem: ElasticaProblem, nodes: Array, degree: int, hermite: bool, options: ElasticaOptions
) -> ElasticaResult:
    """One mesh: from the natural shape (exact without load) to the full loads in steps that adapt."""
    began = time.perf_counter()
    scale = max(1.0, *law.sizes(problem.curvature), math.sqrt(problem.load))
    tolerance = options.tolerance * scale
    if problem.cantilever and options.arc_length != "always":
        discrete = Discretisation(nodes, degree, problem.start_angle, hermite=hermite)
        path = follow(discrete, problem.scaled, problem.load, tolerance, options)
        status, message = _verdict(path, options)
        loaded = problem.scaled(path.reached)
        couple = float(discrete.balance(path.coefficients, loaded)[discrete.ends[0]])
        start = loaded.weight[0] - loaded.force[0], loaded.weight[1] - loaded.force[1]
        return result_of(
            problem, degree, hermite, status, message, discrete, path.coefficients, loaded, path.reached, began,
            forces=ElasticaForces(start, loaded.force, couple, 0.0), residual=path.residual,
            lowest_eigenvalue=path.eigenvalue, rounding=path.rounding, iterations=path.iterations, steps=path.steps,
            snaps=path.snaps, limits=0, switches=0,
        )  # fmt: skip
    end = drive(problem, nodes, degree, hermite, tolerance, options)
    return arrived(problem, degree, hermite, end, began)


def arrived(problem: ElasticaProblem, degree: int, hermite: bool, end: Arrival, began: float) -> ElasticaResult:
    """The result at the end of a way to `problem` that was begun at the time `began` (s, of `time.perf_counter`)."""
    point, system = end.point, end.system
    status, message = _arrival_verdict(end)
    return result_of(
        problem, degree, hermite, status, message, system.discrete, point.z[: system.count], system.way.at(point.t),
        point.t, began, forces=system.forces(point.z, point.t), residual=point.norm,
        lowest_eigenvalue=float(point.eigenvalues[0]), rounding=point.rounding, iterations=end.iterations,
        steps=end.steps, snaps=0, limits=end.limits, switches=end.switches,
    )  # fmt: skip


def branch_result(system: System, degree: int, z: Array, t: float, norm: float) -> ElasticaResult:
    """The result at a point z (N + m,) of a branch, whose residual has this norm; at the branch's t."""
    problem, began = system.way.at(t), time.perf_counter()
    values, rounding = system.eigenpairs(z, t)[0], system.rounding(z, t)
    stable = stability(float(values[0]), rounding)
    status = ElasticaStatus.UNSTABLE if stable is False else ElasticaStatus.CONVERGED
    message = "on a branch: " + ("unstable" if stable is False else "stable" if stable else "at a fold")
    return result_of(
        problem, degree, False, status, message, system.discrete, z[: system.count], problem, 1.0, began,
        forces=system.forces(z, t), residual=norm, lowest_eigenvalue=float(values[0]), rounding=rounding, iterations=0,
        steps=0, snaps=0, limits=0, switches=0,
    )  # fmt: skip


def result_of(
    problem: ElasticaProblem,
    degree: int,
    hermite: bool,
    status: ElasticaStatus,
    message: str,
    discrete: Discretisation,
    coefficients: Array,
    loaded: ElasticaProblem,
    reached: float,
    began: float,
    **found: Any,
) -> ElasticaResult:
    """The result of a solve that ended with these coefficients (N,) under the loads of `loaded`."""
    bending, loads = discrete.energies(coefficients, loaded)
    points = discrete.position(coefficients, discrete.nodes)
    force = -float(points[-1] @ np.array(loaded.force))
    return ElasticaResult(
        problem=problem,
        degree=degree,
        status=status,
        message=message,
        nodes=discrete.nodes,
        theta=discrete.angle(coefficients, discrete.nodes),
        x=points[:, 0],
        y=points[:, 1],
        energy=ElasticaEnergy(bending, loads - force, force),
        load_factor=reached,
        seconds=time.perf_counter() - began,
        error=None,
        hermite=hermite,
        _discrete=discrete,
        _coefficients=coefficients,
        **found,
    )


NEAR_LIMIT = 0.3
"""Lowest eigenvalue under which load steps that cannot go on are taken to have met a limit point, in D w / l."""

OFFER = 'follow the path past it by arc length (ElasticaOptions(arc_length="always"))'


def _verdict(path: Path, options: ElasticaOptions) -> tuple[ElasticaStatus, str]:
    """Status and what it means or what to try, of load steps."""
    if path.reached < 1.0:
        where = f"the path of equilibria ends at {path.reached:.6g} of the loads"
        if clock.spent():
            return ElasticaStatus.NOT_CONVERGED, f"{where}: {clock.SPENT}"
        if path.eigenvalue < NEAR_LIMIT and (options.arc_length == "never" or options.snaps == 0):
            return ElasticaStatus.LIMIT_POINT, f"{where}, at a limit point: {OFFER}, or let it snap (snaps above 0)"
        return ElasticaStatus.NOT_CONVERGED, f"{where}: allow more snaps, use more elements, or {OFFER}"
    if path.stable is False:
        return (
            ElasticaStatus.UNSTABLE,
            f"equilibrium, but unstable (lowest eigenvalue {path.eigenvalue:.3g}): tilt the clamp or the load a little",
        )
    snapped = f", after {path.snaps} snap(s) past limit points: other minima may exist" if path.snaps else ""
    if path.stable is None:
        return ElasticaStatus.CONVERGED, f"{_at_fold(path.eigenvalue, path.rounding)}{snapped}"
    return ElasticaStatus.CONVERGED, f"stable equilibrium{snapped}"


def _at_fold(eigenvalue: float, rounding: float) -> str:
    """What is said of a state whose lowest eigenvalue is zero to rounding."""
    return f"equilibrium at a fold: lowest eigenvalue {eigenvalue:.2g}, rounding {rounding:.2g}; neither stable nor not"


def _arrival_verdict(end: Arrival) -> tuple[ElasticaStatus, str]:
    """The same of a way."""
    if end.stopped:
        where = f"the steps end at {end.point.t:.6g} of the way"
        if clock.spent():
            return ElasticaStatus.NOT_CONVERGED, f"{where}: {clock.SPENT}"
        if end.stopped == "limit":
            return ElasticaStatus.LIMIT_POINT, f"{where}, at a limit point: {OFFER}"
        return ElasticaStatus.NOT_CONVERGED, f"{where}: use more elements, more arc_steps, or another `bow`"
    eigenvalue = float(end.point.eigenvalues[0])
    passed = f", past {end.limits} limit point(s): other minima may exist" if end.limits else ""
    if end.point.stable is False:
        why = f"equilibrium, but unstable (lowest eigenvalue {eigenvalue:.3g}){passed}"
        return ElasticaStatus.UNSTABLE, f"{why}: tilt a clamp or the load a little, or start from another `bow`"
    switched = ", on a branch that leaves the first path" if end.switches else ""
    if end.point.stable is None:
        return ElasticaStatus.CONVERGED, f"{_at_fold(eigenvalue, end.point.rounding)}{switched}{passed}"
    return ElasticaStatus.CONVERGED, f"stable equilibrium{switched}{passed}"


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
