"""Judges a ribbon's state by numbers: curve, energy, balance, stability, what holds it and stands in its way."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.linalg
import scipy.optimize
from numpy.typing import NDArray

from compare.battery.case import Check, holds
from compare.battery.judge.barriers import facing, sides
from compare.battery.judge.curve import integrated
from compare.battery.judge.discrete import Discrete, unknown_kind

FloatArray = NDArray[np.float64]

#: Bounds of the checks: distances over l (rad for frames), energies and forces relative to their size (at least 1).
CURVE, ENERGY, HELD, STATIONARY, PENETRATION = 1e-8, 1e-9, 1e-8, 1e-7, 1e-6
#: Relative difference of lowest eigenvalues; how near zero, over the largest, nothing is said of their sign.
EIGENVALUE, INDIFFERENT = 1e-4, 1e-7
#: The same of the Hessian with a unit diagonal.
SCALED = 1e-5
#: Segments up to which the spectrum is computed (dense).
MOST = 400
_SAMPLES = 2001


def judged(found: Any, spectrum: bool = True) -> list[Check]:
    """Checks of a ribbon's equilibrium `found` (`ribbon.Equilibrium`; of a model's state: `state.native`).

    spectrum: whether status and lowest eigenvalue are judged too, on up to `MOST` segments. Where the solver does not
    call it an equilibrium only curve, energy and penetration are judged. What is not restated for its kind (energies of
    free twist, the surface's weight, pressure plates) is left out: then the curve and penetration alone.
    """
    checks = [curve_apart(found)]
    code = found.status.code
    equilibrium = code in ("converged", "saddle")
    if found.problem.walls and equilibrium:
        checks.append(penetration(found))
    if unknown_kind(found):
        return checks
    own = Discrete(found)
    checks.append(Check("energy apart from quadrature, relative", energy_apart(found, own), ENERGY))
    if not equilibrium:
        return checks
    checks.append(Check("what is held, missed by (l, rad)", own.missed, HELD))
    checks.append(Check("omega and eta jump at a joint", own.jumps, HELD * max(1.0, float(np.abs(own.q).max()))))
    force, left = multipliers(own)
    acting = own.elastic.gradient, force, own.load
    size = max(1.0, *(float(np.abs(values).max(initial=0.0)) for values in acting))
    checks.append(Check("not in balance, relative to the largest force", left / size, STATIONARY))
    if spectrum and len(own.lengths) <= MOST:
        checks += stability(found, own, force)
    return checks


def curve_apart(found: Any) -> Check:
    """Largest distance of centreline and frames (l, rad) from `solve_ivp`'s, at joints and between them."""
    joints = np.concatenate([[0.0], np.cumsum(found.problem.lengths)])
    wanted = np.unique(np.concatenate([joints, np.linspace(0.0, 1.0, 41)]))
    wanted = np.clip(wanted, 0.0, joints[-1])
    q = found.parameters
    free, sideways = found.has_free_twist, q.shape[1] > 4

    def kappa(s: float) -> FloatArray:
        i = min(max(int(np.searchsorted(joints, s, side="right")) - 1, 0), len(q) - 1)
        u = s - joints[i]
        omega, third = q[i, 0] * u + q[i, 1], q[i, 2] * u + q[i, 3]
        return np.array([omega, q[i, 4] * u + q[i, 5] if sideways else 0.0, third if free else third * omega])

    points, frames = found.joints
    positions, turned = integrated(kappa, joints, frames[0], points[0], wanted)
    far = np.abs(found.position(wanted) - positions).max(axis=1)
    turn = np.abs(found.frame(wanted) - turned).max(axis=(1, 2))
    off = np.maximum(far, turn)
    worst = int(np.argmax(off)) if np.isfinite(off).all() else int(np.flatnonzero(~np.isfinite(off))[0])
    return Check("curve apart from solve_ivp (l, rad)", float(off[worst]), CURVE, said=f"at s = {wanted[worst]:.4g}")


def energy_apart(found: Any, own: Discrete) -> float:
    """Difference of the energies over their size; the parts that are large and cancel are counted in the size, and the
    whole weight at one length: how much of it a state has is a matter of the datum."""
    weight = found.problem.strip.gamma if found.problem.gravity is not None else 0.0
    size = max(1.0, abs(found.energy.elastic), abs(found.energy.gravity), abs(found.energy.total), weight)
    return float(abs(found.energy.total - own.energy) / size)


def penetration(found: Any, samples: int = _SAMPLES) -> Check:
    """How deep (l) the ribbon is in a wall anywhere: both ends of the rulings, along all of s; between
    them too beside what bulges."""
    joints = np.concatenate([[0.0], np.cumsum(found.problem.lengths)])
    inside = np.linspace(0.0, 1.0, 9)[:-1]
    fine = (joints[:-1, None] + inside * np.diff(joints)[:, None]).ravel()
    s = np.unique(np.clip(np.concatenate([fine, joints, np.linspace(0.0, 1.0, samples)]), 0.0, joints[-1]))
    r, frame, eta = found.position(s), found.frame(s), found.eta(s)
    half, length = 0.5 * found.problem.strip.relative_width, found.problem.strip.length
    deepest, where = 0.0, 0.0
    for wall in found.problem.walls:
        if wall.stiffness is not None:
            continue
        for side in sides(wall):
            edge = r + side * half * (frame[:, :, 0] + eta[:, None] * frame[:, :, 2])
            gap, _ = facing(wall, edge, length)
            if -gap.min() > deepest:
                deepest, where = float(-gap.min()), float(s[np.argmin(gap)])
    return Check("penetration of a wall (l)", deepest, PENETRATION, said=f"at s = {where:.4g}")


def multipliers(own: Discrete) -> tuple[FloatArray, float]:
    """Multipliers (m,) of the rows that balance the gradient best, pushes not negative, and what is left of it."""
    if not len(own.jacobian):
        return np.empty(0), float(np.abs(own.gradient).max())
    scale = np.maximum(np.linalg.norm(own.jacobian, axis=1), 1e-300)
    matrix = (own.jacobian / scale[:, None]).T
    if own.one_sided.any():
        high = np.where(own.one_sided, 0.0, np.inf)
        force = scipy.optimize.lsq_linear(matrix, -own.gradient, (-np.inf, high), method="bvls", tol=1e-15).x
        kept = ~own.one_sided | (force < 0.0)
        again = np.linalg.lstsq(matrix[:, kept], -own.gradient, rcond=None)[0]
        force = np.zeros(len(force))
        force[kept] = again
    else:
        force = np.linalg.lstsq(matrix, -own.gradient, rcond=None)[0]
    left = own.gradient + matrix @ force
    return np.asarray(force / scale), float(np.abs(left).max())


def lowest(own: Discrete, force: FloatArray) -> tuple[float, float, int]:
    """Lowest and largest eigenvalue on the tangent of what is held, and the sign that they have, 0 where rounding does
    not tell; (inf, 0, 1) where nothing is free.

    The sign is also looked for in the Hessian with a unit diagonal, which has the same inertia: beside a heavy strip's
    short segments, 1e13 times as stiff as the others, no eigenvalue of its own tells.
    """
    strong = np.abs(force) > 1e-9 * max(1.0, float(np.abs(force).max(initial=0.0)))
    held = np.vstack([own.jacobian[~own.one_sided | strong], own.gauge])
    hessian = own.hessian(force)
    values = _spectrum(hessian, own.metric, held)
    if not values.size:
        return np.inf, 0.0, 1
    least, largest = float(values[0]), float(np.abs(values).max())
    if abs(least) > INDIFFERENT * max(1.0, largest):
        return least, largest, int(np.sign(least))
    diagonal = np.diag(hessian)
    size = np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    scaled = _spectrum(hessian / np.outer(size, size), np.eye(own.size), held / size)
    return least, largest, int(np.sign(scaled[0])) if abs(scaled[0]) > SCALED else 0


def _spectrum(hessian: FloatArray, metric: FloatArray, held: FloatArray) -> FloatArray:
    """Eigenvalues on the null space of `held` (m, n), ascending; none where nothing is free."""
    norm = np.linalg.norm(held, axis=1)[:, None]
    basis = scipy.linalg.null_space(held / norm, rcond=1e-10) if len(held) else np.eye(len(hessian))
    if basis.shape[1] == 0:
        return np.empty(0)
    found = scipy.linalg.eigh(basis.T @ hessian @ basis, basis.T @ metric @ basis, eigvals_only=True)
    return np.asarray(found)


def stability(found: Any, own: Discrete, force: FloatArray) -> list[Check]:
    """Whether the status is that of the lowest eigenvalue, and whether the solver's own is the same."""
    least, _, sign = lowest(own, force)
    if found.at is not None and found.status.code == "saddle":  # the worst choice of rulings that move nothing
        there = Discrete(found, found.problem.parameters(found.at))
        value, _, other = lowest(there, multipliers(there)[0])
        if other < sign or value < least:
            least, sign = value, other
    text = f"lowest eigenvalue {least:.6g}, the solver's {found.lowest_eigenvalue:.6g}"
    right = sign >= 0 if found.status.code == "converged" else sign <= 0
    checks = [holds("status is that of the lowest eigenvalue", right, f"{found.status.code}; {text}")]
    start = found.problem.start
    if start is not None and start.is_whole and np.isfinite(least) and not _undetermined(own):
        off = abs(least - found.lowest_eigenvalue) / max(1.0, abs(least))
        checks.append(Check("lowest eigenvalue apart, relative", off, EIGENVALUE, said=text))
    return checks


def _undetermined(own: Discrete) -> bool:
    """Whether the ruling is undetermined somewhere, so that the solver's eigenvalue may be that of another ruling."""
    return bool((np.abs(own.q[:, 1]) < 1e-6).any())
