"""Classical shooting for the Sadowsky ribbon's Euler-Lagrange equations (thesis, 4.2; row SHOOTING of table 3.2).

The equations are those of `tests.reference.strong_form`: six unknowns y = (g_1, g_2, g_3, omega, eta, M_2). At the
clamp g is known and p = (omega, eta, M_2) is guessed; y is integrated to the free end, where (omega - K, eta, M_2) must
vanish, three equations for three numbers. Newton's method takes their Jacobian from the variational equations
``Y' = (dy' / dy) Y``, integrated beside y (by complex step), and halves a step that does not lessen the residual.
Continuation: K is that of the scene from the start, Gamma grows from 0, where p = (K, 0, 0) is the solution.

`backwards` shoots from the free end, where omega = K, eta = 0, M_2 = 0 are known and the direction of the weight g,
a unit vector, is guessed: two angles, and g(0) must be that of the clamp.

A guess's error grows along the strip; `Shot.growth`, the norm of the Jacobian, is by how much.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tests.reference.strong_form import Solution, StrongForm

FloatArray = NDArray[np.float64]

#: Steps of Newton's method, and halvings of one of them, before a weight counts as not reached.
NEWTON_STEPS, HALVINGS = 15, 6
#: omega, eta, M_2 beyond which an integration has lost its way.
FAR = 1e4


@dataclass(frozen=True)
class Shot:
    """What shooting ends with: y (6,) at the clamp, residual (its norm), growth (spectral norm of the Jacobian), steps
    (weights that were solved), integrations, reached (part of the weight), seconds (CPU s)."""

    problem: StrongForm
    start: FloatArray
    residual: float
    growth: float
    steps: int
    integrations: int
    reached: float
    seconds: float

    @property
    def converged(self) -> bool:
        """Whether the full weight was reached."""
        return self.reached == 1.0

    def solution(self, tolerance: float = 1e-12) -> Solution:
        """The equations integrated once more from the clamp, as a `Solution` (its mesh is the integrator's)."""
        nodes = np.empty((200_000, 7))
        _, steps = integrate(self.start, 0, _of(self.problem), 0.0, 1.0, tolerance, nodes)
        s, y = nodes[: steps + 1, 0].copy(), nodes[: steps + 1, 1:].T.copy()
        return Solution(self.problem, s, y, self.problem.right_side(s, y), self.converged, "", self.steps, self.seconds)


@njit(cache=True)
def slope(s, y, gamma, start, end, poisson, out):
    """y' (6,) at s, real or complex: `StrongForm.right_side` of one point, compiled."""
    omega, eta, m_2 = y[3], y[4], y[5]
    k, rise = start + (end - start) * s, end - start
    c = gamma * (1.0 - s)
    e2 = eta * eta
    u = 1.0 + e2
    convex = omega * u - poisson * k
    first = eta * omega * m_2 - c * y[1] + rise * (1.0 - poisson * e2)
    third = -omega * m_2 + 2.0 * rise * poisson * eta
    out[0] = eta * omega * y[1]
    out[1] = omega * (y[2] - eta * y[0])
    out[2] = -omega * y[1]
    out[3] = ((omega * (1.0 + 3.0 * e2) - poisson * k) * first - eta * (poisson * k - 2.0 * omega * e2) * third) / (
        u * u * convex
    )
    out[4] = (0.5 * (1.0 - e2) * third - eta * first) / (u * convex)
    out[5] = omega * eta * (omega * u * u + k * (1.0 - 2.0 * poisson - poisson * e2)) + c * y[0]


@njit(cache=True)
def tangent(s, z, columns, pull, out):
    """(y', Y') (6 + 6 columns,) at s of z = (y, Y row by row); pull: Gamma, K at both ends, nu."""
    gamma, start, end, poisson = pull
    moved, turned = np.empty(6, dtype=np.complex128), np.empty(6, dtype=np.complex128)
    slope(s, z[:6], gamma, start, end, poisson, out[:6])
    for j in range(columns):
        for i in range(6):
            moved[i] = z[i] + 1e-30j * z[6 + columns * i + j]
        slope(s, moved, gamma, start, end, poisson, turned)
        for i in range(6):
            out[6 + columns * i + j] = turned[i].imag / 1e-30


@njit(cache=True)
def integrate(z, columns, pull, begin, end, tolerance, nodes):
    """z at `end` by the pair of Dormand and Prince (1980, doi:10.1016/0771-050X(80)90013-3), orders 5 and 4, and the
    number of steps; -1 steps where omega, eta or M_2 leave `FAR`. A step's error in each component is at most
    `tolerance` times the larger of 1 and the component. nodes (n, 1 + 6): s and y of the first n steps."""
    a = np.array([
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [1 / 5, 0.0, 0.0, 0.0, 0.0, 0.0],
        [3 / 40, 9 / 40, 0.0, 0.0, 0.0, 0.0],
        [44 / 45, -56 / 15, 32 / 9, 0.0, 0.0, 0.0],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0.0, 0.0],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0.0],
        [35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    ])  # fmt: skip
    c = np.array([0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0])
    e = np.array([71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40])
    z = z.copy()
    size = z.size
    k = np.empty((7, size))
    trial = np.empty(size)
    s, step, steps = begin, 1e-3 * (end - begin), 0
    if len(nodes):
        nodes[0, 0], nodes[0, 1:] = s, z[:6]
    while (end - s) * (end - begin) > 0.0:
        if abs(step) > abs(end - s):
            step = end - s
        for stage in range(7):
            trial[:] = z
            for j in range(stage):
                for i in range(size):
                    trial[i] += step * a[stage, j] * k[j, i]
            tangent(s + c[stage] * step, trial, columns, pull, k[stage])
        worst = 0.0
        for i in range(size):
            error = 0.0
            for j in range(7):
                error += step * e[j] * k[j, i]
            worst = max(worst, abs(error) / (tolerance * max(1.0, abs(trial[i]))))
            if not np.isfinite(trial[i]):
                worst = np.inf
        if worst <= 1.0:
            s = end if step == end - s else s + step
            z[:] = trial
            steps += 1
            if steps < len(nodes):
                nodes[steps, 0], nodes[steps, 1:] = s, z[:6]
            if max(abs(z[3]), abs(z[4]), abs(z[5])) > FAR:
                return z, -1
        step *= min(4.0, max(0.2, 0.9 * max(worst, 1e-12) ** -0.2))
        if abs(step) < 1e-9 or not np.isfinite(step):
            return z, -1
    return z, steps


class Shooter:
    """Shoots at a problem from one of its ends; tolerance: of the integrator, relative and absolute."""

    def __init__(self, problem: StrongForm, tolerance: float = 1e-11, backwards: bool = False) -> None:
        self.problem, self.tolerance, self.backwards = problem, tolerance, backwards
        self.integrations = 0

    def _at_clamp(self) -> FloatArray:
        return np.asarray(self.problem.frame).T @ np.asarray(self.problem.up, dtype=float)

    def natural(self) -> FloatArray:
        """The unknowns of the weightless ribbon: (K, 0, 0), or g (3,) at the free end."""
        if not self.backwards:
            return np.array([self.problem.curvature[0], 0.0, 0.0])
        return self.problem.natural_shape(2001)[1][:3, -1]

    def _begin(self, p: FloatArray) -> tuple[FloatArray, FloatArray]:
        """y (6,) where the shot begins, and its derivative (6, m) by the unknowns (two turns of g, backwards)."""
        if not self.backwards:
            return np.concatenate([self._at_clamp(), p]), np.vstack([np.zeros((3, 3)), np.eye(3)])
        tangents = np.linalg.svd(p[None, :])[2][1:].T
        return np.concatenate([p, [self.problem.curvature[1], 0.0, 0.0]]), np.vstack([tangents, np.zeros((3, 2))])

    def _moved(self, p: FloatArray, step: FloatArray) -> FloatArray:
        if not self.backwards:
            return p + step
        turned = p + self._begin(p)[1][:3] @ step
        return turned / np.linalg.norm(turned)

    def _along(self, p: FloatArray, way: FloatArray) -> FloatArray:
        q = p + way
        return q / np.linalg.norm(q) if self.backwards else q

    def residual(self, problem: StrongForm, p: FloatArray) -> tuple[FloatArray, FloatArray] | None:
        """Residual (3,) at the other end and its Jacobian (3, m); None: the integration breaks down on the way."""
        self.integrations += 1
        y, by = self._begin(p)
        ends = (1.0, 0.0) if self.backwards else (0.0, 1.0)
        z, steps = integrate(
            np.concatenate([y, by.ravel()]), by.shape[1], _of(problem), *ends, self.tolerance, np.empty((0, 7))
        )
        if steps < 0:
            return None
        m = by.shape[1]
        if self.backwards:
            return z[:3] - self._at_clamp(), z[6:].reshape(6, m)[:3]
        return z[3:6] - [problem.curvature[1], 0.0, 0.0], z[6:].reshape(6, m)[3:]

    def newton(self, gamma: float, p: FloatArray) -> tuple[FloatArray, float, float] | None:
        """Unknowns at this weight from p, with residual and growth; None: not found."""
        problem = replace(self.problem, gamma=gamma)
        found = self.residual(problem, p)
        for _ in range(NEWTON_STEPS):
            if found is None:
                return None
            size, growth = float(np.linalg.norm(found[0])), float(np.linalg.norm(found[1], 2))
            # as near as the integrator's own error lets it come
            if size <= 10.0 * self.tolerance * max(1.0, growth):
                return p, size, growth
            step = -np.linalg.lstsq(found[1], found[0], rcond=None)[0]
            for _ in range(HALVINGS):
                moved = self._moved(p, step)
                trial = self.residual(problem, moved)
                if trial is not None and np.linalg.norm(trial[0]) < size:
                    break
                step = 0.5 * step
            else:
                return None
            p, found = moved, trial
        return None

    def shoot(self, first: float = 0.1, smallest: float = 1e-5, budget: float = 60.0) -> Shot:
        """Continuation in Gamma: a step grows by 1.5 after a success and is halved after a failure, down to
        `smallest`; the next guess goes on as the last two solutions did. budget: CPU s."""
        clock = time.process_time()
        p, done, step, steps = self.natural(), 0.0, first, 0
        before, rate = p, np.zeros(3)
        residual = growth = 0.0
        while done < 1.0 and step >= smallest and time.process_time() - clock < budget:
            aim = min(1.0, done + step)
            found = self.newton(aim * self.problem.gamma, self._along(p, (aim - done) * rate))
            steps += 1
            if found is None:
                step *= 0.5
                continue
            before, (p, residual, growth) = p, found
            rate, done, step = (p - before) / (aim - done), aim, 1.5 * step
        reached = replace(self.problem, gamma=done * self.problem.gamma)
        start = self._begin(p)[0]
        if self.backwards:
            start, _ = integrate(start, 0, _of(reached), 1.0, 0.0, 1e-12, np.empty((0, 7)))
        return Shot(reached, start, residual, growth, steps, self.integrations, done, time.process_time() - clock)


def _of(problem: StrongForm) -> tuple[float, float, float, float]:
    return float(problem.gamma), float(problem.curvature[0]), float(problem.curvature[1]), float(problem.poisson)
