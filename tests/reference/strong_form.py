"""The Sadowsky ribbon's Euler-Lagrange equations, solved by collocation: an independent check of the ribbon element.

The strong form behind the thesis's comparison with shooting and AUTO (4.2), written from the balance of forces and
moments; it shares nothing with `ribbon`. Lengths in l, energies in D w / l, no bound on eta', weight along the
centreline, clamped at s = 0 and free at s = 1.

Frame ``R' = R [kappa]_x``, ``kappa = (omega, 0, eta omega)``. With the weight ``-Gamma e_g`` per length the force that
the part beyond s exerts is ``n = -c e_g``, ``c = Gamma (1 - s)``. The moment M in the frame obeys
``M' + kappa x M + e_z x R^T n = 0`` (virtual rotation phi: ``delta kappa = phi' + kappa x phi``), that is, with
``g = R^T e_g``::

    M_1' = eta omega M_2 - c g_2 ,  M_2' = omega (M_3 - eta M_1) + c g_1 ,  M_3' = -omega M_2 ,  g' = -kappa x g .

M_2 is the reaction to kappa_2 = 0; the density ``e = omega^2 (1 + eta^2)^2 / 2 - K omega (1 + nu eta^2)`` by kappa_1
and kappa_3 = eta omega gives the two others, ``M_1 = e_omega - (eta / omega) e_eta`` and ``M_3 = e_eta / omega``::

    M_1 = omega (1 - eta^4) - K (1 - nu eta^2) ,   M_3 = 2 eta (omega (1 + eta^2) - nu K) .

Their Jacobian by (omega, eta) has the determinant ``2 (1 + eta^2)^2 (omega (1 + eta^2) - nu K)``: the equations are
regular where Sadowsky's density is strictly convex. Unknowns y = (g_1, g_2, g_3, omega, eta, M_2). Only g of the frame
appears, so that six equations are enough; frame and position follow by quadrature. At the free end M = 0, for K != 0
the same as ``omega = K, eta = 0``. First integrals: ``|g| = 1`` and ``M . g = 0`` (no torque about the vertical).
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import solve_bvp

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class StrongForm:
    """The boundary-value problem.

    gamma: rho h g l^3 / D; curvature: K l at s = 0 and s = 1, not 0 at s = 1; poisson: nu; up: e_g (3,); frame: at the
    clamp (3, 3), columns t_x t_y t_z.
    """

    gamma: float
    curvature: tuple[float, float]
    poisson: float
    up: ArrayLike
    frame: FloatArray

    def __post_init__(self) -> None:
        if self.curvature[1] == 0:
            raise ValueError("the boundary conditions at the free end need a natural curvature there")

    def natural(self, s: FloatArray) -> FloatArray:
        """K (m,) at s (m,)."""
        return self.curvature[0] + (self.curvature[1] - self.curvature[0]) * s

    def right_side(self, s: FloatArray, y: FloatArray) -> FloatArray:
        """y' (6, m) at s (m,), y (6, m)."""
        g_1, g_2, g_3, omega, eta, m_2 = y
        nu, k, slope = self.poisson, self.natural(s), self.curvature[1] - self.curvature[0]
        c = self.gamma * (1.0 - s)
        e2 = eta * eta
        u = 1.0 + e2
        convex = omega * u - nu * k
        # the derivatives of omega (1 - eta^4) - K (..) and of 2 eta (..) along s with K held
        first = eta * omega * m_2 - c * g_2 + slope * (1.0 - nu * e2)
        third = -omega * m_2 + 2.0 * slope * nu * eta
        out = np.empty_like(y)
        out[0] = eta * omega * g_2
        out[1] = omega * (g_3 - eta * g_1)
        out[2] = -omega * g_2
        out[3] = ((omega * (1.0 + 3.0 * e2) - nu * k) * first - eta * (nu * k - 2.0 * omega * e2) * third) / (
            u * u * convex
        )
        out[4] = (0.5 * (1.0 - e2) * third - eta * first) / (u * convex)
        out[5] = omega * eta * (omega * u * u + k * (1.0 - 2.0 * nu - nu * e2)) + c * g_1
        return out

    def jacobian(self, s: FloatArray, y: FloatArray) -> FloatArray:
        """dy' / dy (6, 6, m)."""
        g_1, g_2, g_3, omega, eta, m_2 = y
        nu, k, slope = self.poisson, self.natural(s), self.curvature[1] - self.curvature[0]
        c = self.gamma * (1.0 - s)
        e2 = eta * eta
        u = 1.0 + e2
        convex = omega * u - nu * k
        first = eta * omega * m_2 - c * g_2 + slope * (1.0 - nu * e2)
        third = -omega * m_2 + 2.0 * slope * nu * eta
        j = np.zeros((6, 6, y.shape[1]))
        j[0, 1], j[0, 3], j[0, 4] = eta * omega, eta * g_2, omega * g_2
        j[1, 0], j[1, 2], j[1, 3], j[1, 4] = -omega * eta, omega, g_3 - eta * g_1, -omega * g_1
        j[2, 1], j[2, 3] = -omega, -g_2
        # omega' = (p first - q third) / (u^2 convex), eta' = (r third - eta first) / (u convex)
        p, q, r = omega * (1.0 + 3.0 * e2) - nu * k, eta * (nu * k - 2.0 * omega * e2), 0.5 * (1.0 - e2)
        below, other = u * u * convex, u * convex
        j[3, 1], j[4, 1] = -p * c / below, eta * c / other
        j[3, 5] = (p * eta * omega + q * omega) / below
        j[4, 5] = -(r * omega + e2 * omega) / other
        top, second = p * first - q * third, r * third - eta * first
        first_by = {3: eta * m_2, 4: omega * m_2 - 2.0 * slope * nu * eta}
        third_by = {3: -m_2, 4: 2.0 * slope * nu}
        p_by = {3: 1.0 + 3.0 * e2, 4: 6.0 * omega * eta}
        q_by = {3: -2.0 * eta * e2, 4: nu * k - 6.0 * omega * e2}
        u_by = {3: 0.0, 4: 2.0 * eta}
        convex_by = {3: u, 4: 2.0 * omega * eta}
        for i in (3, 4):
            by = p_by[i] * first + p * first_by[i] - q_by[i] * third - q * third_by[i]
            below_by = 2.0 * u * u_by[i] * convex + u * u * convex_by[i]
            j[3, i] = (by - top * below_by / below) / below
            by = (-eta * third if i == 4 else 0.0) + r * third_by[i] - eta * first_by[i] - (first if i == 4 else 0.0)
            j[4, i] = (by - second * (u_by[i] * convex + u * convex_by[i]) / other) / other
        stiff = omega * u * u + k * (1.0 - 2.0 * nu - nu * e2)
        j[5, 0] = c
        j[5, 3] = eta * (stiff + omega * u * u)
        j[5, 4] = omega * (stiff + e2 * (4.0 * omega * u - 2.0 * nu * k))
        return j

    def boundary(self, ya: FloatArray, yb: FloatArray) -> FloatArray:
        """Residual (6,) of g(0) = R(0)^T e_g, omega(1) = K(1), eta(1) = 0, M_2(1) = 0."""
        start = np.asarray(self.frame).T @ np.asarray(self.up)
        return np.concatenate([ya[:3] - start, [yb[3] - self.curvature[1], yb[4], yb[5]]])

    def boundary_jacobian(self, _ya: FloatArray, _yb: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Derivatives (6, 6) of `boundary` by y(0) and y(1)."""
        at_start, at_end = np.zeros((6, 6)), np.zeros((6, 6))
        at_start[:3, :3] = np.eye(3)
        at_end[3:, 3:] = np.eye(3)
        return at_start, at_end

    def moment(self, s: FloatArray, y: FloatArray) -> FloatArray:
        """M (3, m) in the material frame, units D w / l."""
        omega, eta, m_2 = y[3:]
        nu, k = self.poisson, self.natural(s)
        e2 = eta * eta
        return np.stack([omega * (1 - e2 * e2) - k * (1 - nu * e2), m_2, 2 * eta * (omega * (1 + e2) - nu * k)])

    def natural_shape(self, nodes: int) -> tuple[FloatArray, FloatArray]:
        """Mesh (nodes,) and y (6, nodes) of the weightless ribbon: omega = K, eta = 0, M = 0, g turning about t_x."""
        s = np.linspace(0.0, 1.0, nodes)
        start = np.asarray(self.frame).T @ np.asarray(self.up)
        angle = self.curvature[0] * s + 0.5 * (self.curvature[1] - self.curvature[0]) * s * s
        y = np.zeros((6, nodes))
        y[0] = start[0]
        y[1] = start[1] * np.cos(angle) + start[2] * np.sin(angle)
        y[2] = start[2] * np.cos(angle) - start[1] * np.sin(angle)
        y[3] = self.natural(s)
        return s, y


@dataclass(frozen=True)
class Solution:
    """Solution of the boundary-value problem.

    s (m,), y (6, m), slope (6, m): mesh, values and y' at its nodes; converged, message: of solve_bvp; solves: calls of
    solve_bvp; seconds: CPU time of this process.
    """

    problem: StrongForm
    s: FloatArray
    y: FloatArray
    slope: FloatArray
    converged: bool
    message: str
    solves: int
    seconds: float

    @property
    def nodes(self) -> int:
        """Number of mesh nodes."""
        return self.s.size

    def __call__(self, s: FloatArray) -> FloatArray:
        """y (6, k) at s (k,): the cubic collocation spline."""
        i = np.clip(np.searchsorted(self.s, s, side="right") - 1, 0, self.s.size - 2)
        h = self.s[i + 1] - self.s[i]
        t = (s - self.s[i]) / h
        y0, y1, f0, f1 = self.y[:, i], self.y[:, i + 1], h * self.slope[:, i], h * self.slope[:, i + 1]
        return y0 + t * (f0 + t * (3 * (y1 - y0) - 2 * f0 - f1 + t * (2 * (y0 - y1) + f0 + f1)))

    def centreline(self, parts: int = 4) -> tuple[FloatArray, FloatArray]:
        """Abscissae (k,) and positions (k, 3) from the clamp, with every mesh interval cut into `parts`.

        Frames by the fourth-order Magnus step with two Gauss points (Iserles and Norsett 1999,
        doi:10.1098/rsta.1999.0362), the position by the trapezoidal rule with end derivatives (fourth order).
        """
        s = (self.s[:-1, None] + np.diff(self.s)[:, None] * np.arange(parts) / parts).ravel()
        s = np.append(s, self.s[-1])
        h = np.diff(s)
        a, b = (_curvatures(self(s[:-1] + h * (0.5 + sign * np.sqrt(3) / 6))) for sign in (-1, 1))
        turn = 0.5 * h[:, None] * (a + b) + np.sqrt(3) / 12 * h[:, None] ** 2 * np.cross(a, b)
        frames = np.concatenate([np.asarray(self.problem.frame)[None], _rotations(turn)])
        shift = 1
        while shift < len(frames):  # products of all that precede, in log2 sweeps
            frames[shift:] = frames[:-shift] @ frames[shift:]
            shift *= 2
        tangent = frames[:, :, 2]
        bend = -self(s)[3][:, None] * frames[:, :, 1]  # t_z' = -omega t_y
        steps = 0.5 * h[:, None] * (tangent[:-1] + tangent[1:]) + h[:, None] ** 2 / 12 * (bend[:-1] - bend[1:])
        return s, np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])

    def tip(self, parts: int = 4) -> FloatArray:
        """r(1) - r(0), (3,), units of l."""
        return self.centreline(parts)[1][-1]

    def energy(self) -> float:
        """Total energy, units D w / l, without the weight of the clamp's height and the constant 1/2 int K^2 ds."""
        s, r = self.centreline()
        nodes, weights = np.polynomial.legendre.leggauss(5)
        h = np.diff(self.s)
        at = (self.s[:-1, None] + 0.5 * h[:, None] * (nodes + 1)).ravel()
        omega, eta = self(at)[3:5]
        k = self.problem.natural(at)
        density = 0.5 * omega**2 * (1 + eta**2) ** 2 - k * omega * (1 + self.problem.poisson * eta**2)
        height = r @ np.asarray(self.problem.up)
        slope = self(s)[2]  # t_z . e_g
        step = np.diff(s)
        weight = np.sum(step * (height[:-1] + height[1:]) / 2 + step**2 / 12 * (slope[:-1] - slope[1:]))
        return float((0.5 * h[:, None] * weights).ravel() @ density + self.problem.gamma * weight)


def _curvatures(y: FloatArray) -> FloatArray:
    """kappa (k, 3) from y (6, k)."""
    return np.stack([y[3], np.zeros_like(y[3]), y[4] * y[3]], axis=1)


def _rotations(turn: FloatArray) -> FloatArray:
    """exp([turn]_x) (k, 3, 3) by Rodrigues' formula, turn (k, 3)."""
    angle = np.linalg.norm(turn, axis=1)
    first = np.sinc(angle / np.pi)
    second = 0.5 * np.sinc(0.5 * angle / np.pi) ** 2
    x = np.zeros((len(turn), 3, 3))
    x[:, 0, 1], x[:, 0, 2], x[:, 1, 2] = -turn[:, 2], turn[:, 1], -turn[:, 0]
    x -= np.swapaxes(x, 1, 2).copy()
    return np.eye(3) + first[:, None, None] * x + second[:, None, None] * (x @ x)


def collocate(problem: StrongForm, s: FloatArray, y: FloatArray, tolerance: float, max_nodes: int = 40000) -> Solution:
    """solve_bvp (scipy; Kierzenka and Shampine 2001, doi:10.1145/502800.502801) from the mesh s and the values y."""
    clock = time.process_time()
    with np.errstate(all="ignore"):
        r = solve_bvp(
            problem.right_side, problem.boundary, s, y, fun_jac=problem.jacobian, bc_jac=problem.boundary_jacobian,
            tol=tolerance, bc_tol=min(tolerance, 1e-9), max_nodes=max_nodes,
        )  # fmt: skip
    good = bool(r.success and np.all(np.isfinite(r.y)))
    return Solution(problem, r.x, r.y, r.yp, good, r.message, 1, time.process_time() - clock)


def coarsened(solution: Solution, nodes: int) -> FloatArray:
    """At most `nodes` mesh points with the density of the solution's mesh, (k,)."""
    if solution.nodes <= nodes:
        return solution.s
    return np.interp(np.linspace(0.0, solution.nodes - 1.0, nodes), np.arange(solution.nodes), solution.s)


def continued(
    problem: StrongForm,
    tolerance: float,
    nodes: int,
    first: float = 0.1,
    loose: float = 1e-2,
    smallest: float = 1e-3,
    growth: float = 2.0,
    most: int = 8,
) -> Solution:
    """Continuation in Gamma from the natural shape, as the thesis does (4.2), then `tolerance` at the full weight.

    nodes: of the natural shape, and of the mesh a step starts from (solve_bvp adds nodes, it never takes any away);
    a step may use `most` times as many before it counts as failed. first: share of Gamma of the first step; a step
    grows by `growth` after a success and is halved after a failure, down to `smallest`; loose: tolerance on the way.
    The next start is extrapolated from the last two shapes.
    """
    clock = time.process_time()
    s, y = problem.natural_shape(nodes)
    found = collocate(replace(problem, gamma=0.0), s, y, loose)
    before: Solution | None = None
    done, step, solves = 0.0, first, 1
    while done < 1.0:
        aim = min(1.0, done + step)
        s = coarsened(found, nodes)
        y = found(s)
        if before is not None:
            y = y + (aim - done) * problem.gamma / (found.problem.gamma - before.problem.gamma) * (y - before(s))
        trial = collocate(replace(problem, gamma=aim * problem.gamma), s, y, loose, most * nodes)
        solves += 1
        if trial.converged:
            before, found, done, step = found, trial, aim, growth * step
        else:
            step *= 0.5
            if step < smallest:
                break
    if done == 1.0:
        found = collocate(problem, found.s, found.y, tolerance)
        solves += 1
    return replace(found, converged=done == 1.0 and found.converged, solves=solves, seconds=time.process_time() - clock)
