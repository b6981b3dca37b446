"""Wunderlich's strip between two clamps by multiple shooting: no elements, no energy minimised.

The equations and their state are those of `tests.reference.wunderlich_equations`; both edges are held. World axes are
those of the start clamp's frame: r(0) = 0, R(0) = 1, eta(0) = 0. At s = 1 the clamp has r = (shift, 0, along), R = 1,
eta = 0: seven conditions for M(0), n, p(0), and one number more, the shift, the middle's height or a force, is given. A
rate of the equations grows as sqrt(24) / w, so that the strip is cut into intervals, whose starts are unknowns too.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import SuperLU, splu
from scipy.spatial.transform import Rotation

from tests.reference.wunderlich_equations import ALL, STATE, bent_at, integrate, ratio, slope

FloatArray = NDArray[np.float64]

#: What of a branch counts as one step: of the middle's height and the shift, l, and of the clamps' force, D w / l^2.
SCALES = {"height": 1.0, "shift": 1.0, "lift": 100.0}
#: omega = 2 (q^T _TURNED q') of a quaternion q: the first component of its conjugate times q'.
_TURNED = np.array([[0.0, 1.0, 0.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, -1.0], [0.0, 0.0, 1.0, 0.0]])
#: Signs of a state under half a turn about the height's axis, read from the other end.
_IMAGE = np.array([-1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, 1.0, -1.0])
#: Newton's iterations, and the residual at which it ends, over the integrator's tolerance.
NEWTON, DONE = 12, 100.0


@dataclass(frozen=True)
class Clamped:
    """A strip of width w and its clamps' distance along, over l; `parts` equal shooting intervals (even); tolerance of
    the integrator."""

    width: float
    along: float = 0.5
    parts: int = 60
    tolerance: float = 1e-9

    @property
    def controls(self) -> dict[str, int]:
        """Which of the unknowns may be given: the middle's height, the end's shift, the force along t_y of the clamps,
        which is zero where the strip is the upright arch."""
        size = STATE * self.parts - 4
        return {"height": 4 + STATE * (self.parts // 2 - 1) + 1, "shift": size - 1, "lift": size - 3}

    def equations(self, v: FloatArray, control: str, value: float) -> tuple[FloatArray, coo_matrix]:
        """Residual and derivative (12 parts - 4,) by v: states at the intervals' starts (parts, 12) but for what the
        start clamp holds (r, R, eta), then the force and the shift; `control`, one of them, has the value."""
        states, force, shift = self.apart(v)
        ends, jacobians = np.empty((self.parts, STATE)), np.empty((self.parts, STATE, ALL))
        for k, state in enumerate(states):
            begin = np.concatenate([state, np.eye(STATE, ALL).ravel()])
            z, steps = integrate(begin, force, self.width, ALL, 1.0 / self.parts, self.tolerance)
            if not steps:
                raise ArithmeticError(f"the integration breaks down in interval {k}")
            ends[k], jacobians[k] = z[:STATE], z[STATE:].reshape(STATE, ALL)
        residual = np.concatenate([(ends[:-1] - states[1:]).ravel(), self._end(ends[-1], shift),
                                   [v[self.controls[control]] - value]])  # fmt: skip
        return residual, self._derivative(jacobians, self.controls[control])

    def apart(self, v: FloatArray) -> tuple[FloatArray, FloatArray, float]:
        """States (parts, 12), force (3,), shift."""
        first = np.concatenate([[0, 0, 0, 1, 0, 0, 0], v[:3], [0.0], v[3:4]])
        return np.concatenate([first[None], v[4:-4].reshape(-1, STATE)]), v[-4:-1], float(v[-1])

    def joined(self, states: FloatArray, force: FloatArray, shift: float) -> FloatArray:
        """The unknowns of `equations`."""
        return np.concatenate([states[0, 7:10], states[0, 11:], states[1:].ravel(), force, [shift]])

    def _end(self, y: FloatArray, shift: float) -> FloatArray:
        """Of the end clamp, (7,): position, the quaternion's vector, eta."""
        return np.concatenate([y[:3] - [shift, 0.0, self.along], y[4:7], y[10:11]])

    def _derivative(self, jacobians: FloatArray, control: int) -> coo_matrix:
        rows, columns, values = [], [], []

        def put(row: int, column: int, block: FloatArray) -> None:
            i, j = np.nonzero(block)
            rows.append(row + i), columns.append(column + j), values.append(block[i, j])

        size = STATE * self.parts - 4
        held, ends = [7, 8, 9, 11], [0, 1, 2, 4, 5, 6, 10]
        for k, by in enumerate(jacobians):
            last = k == self.parts - 1
            rule = by[ends] if last else by
            put(STATE * k, size - 4, rule[:, STATE:])
            put(STATE * k, 4 + STATE * (k - 1) if k else 0, rule[:, :STATE] if k else rule[:, held])
            if not last:
                put(STATE * k, 4 + STATE * k, -np.eye(STATE))
        end = STATE * (self.parts - 1)
        put(end, size - 1, -np.eye(7, 1))
        put(end + 7, control, np.ones((1, 1)))
        shape = (size, size)
        return coo_matrix((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape)

    def newton(self, v: FloatArray, control: str, value: float) -> Found | None:
        """The solution near v of which this is given; None: none is found."""
        try:
            residual, by = self.equations(v, control, value)
            for _ in range(NEWTON):
                size, lu = float(np.abs(residual).max()), splu(by.tocsc())
                if size < DONE * self.tolerance:
                    rate = lu.solve(np.append(np.zeros(residual.size - 1), 1.0))
                    return Found(self, v, control, rate, size, determinant=_determinant(lu))
                step, times = -lu.solve(residual), 1.0
                for _ in range(6):
                    moved = self.equations(v + times * step, control, value)
                    if np.abs(moved[0]).max() < size:
                        break
                    times *= 0.5
                else:
                    return None
                v, (residual, by) = v + times * step, moved
        except (ArithmeticError, RuntimeError):
            return None
        return None

    def integral(self, v: FloatArray) -> FloatArray:
        """(parts,): the first integral N omega / 2 + p eta' + n . t_z at the intervals' starts, D w / l^2."""
        states, force, _ = self.apart(v)
        found, got = np.empty(self.parts), np.empty(STATE, complex)
        for k, state in enumerate(states):
            slope(state + 0j, force + 0j, self.width, bent_at(state + 0j, self.width), got)
            eta, p = state[10:]
            bending, omega = state[7] + eta * state[9], 2.0 * (state[3:7] @ _TURNED @ got[3:7].real)
            found[k] = 0.5 * bending * omega + p * got[10].real + force @ got[:3].real
        return found

    def near(self, s: FloatArray, r: FloatArray, frames: FloatArray, bend: FloatArray, shift: float) -> FloatArray:
        """Unknowns near a shape in world axes: r (m, 3), R (m, 3, 3), and (omega, eta, x) `bend` (m, 3) at s (m,),
        among them the starts of the intervals.

        The moment at s is that of the start less r x n: N = M_1 + eta M_3 is linear in M(0) and n, which follow from
        omega (1 + eta^2)^2 H by least squares; so does p(0) with the integral of p'. Where |x| is near 1 both are known
        badly and left out.
        """
        omega, eta, x = bend.T
        u, b = 1.0 + eta**2, 2.0 * np.arctanh(np.clip(x, -0.999, 0.999))
        bending = omega * u**2 * np.where(np.abs(b) > 1e-6, b / 2 / np.tanh(b / 2 + (np.abs(b) <= 1e-6)), 1.0)
        known = np.abs(x) < 0.95
        across = frames[:, :, 0] + eta[:, None] * frames[:, :, 2]
        rows = np.concatenate([across, np.cross(r - r[0], across)], axis=1)
        moment, force = np.split(np.linalg.lstsq(rows[known], bending[known], rcond=None)[0], 2)
        moments = np.einsum("kij,ki->kj", frames, moment - np.cross(r - r[0], force))
        rise = omega * (2.0 * eta * (moments[:, 0] + eta * moments[:, 2]) / u - moments[:, 2])
        p = np.append(0.0, np.cumsum(0.5 * np.diff(s) * (rise[1:] + rise[:-1])))
        p += np.mean((self.width / 4.0 * bending**2 / u**2 * [ratio(one) if one else 0.0 for one in b] - p)[known])
        turned = Rotation.from_matrix(frames).as_quat()[:, [3, 0, 1, 2]]
        turned[1:] *= np.cumprod(np.where(np.sum(turned[1:] * turned[:-1], axis=1) < 0.0, -1.0, 1.0))[:, None]
        states = np.concatenate([r, turned, moments, eta[:, None], p[:, None]], axis=1)
        at = np.searchsorted(s, np.arange(self.parts) / self.parts - 1e-12)
        return self.joined(states[at], force, shift)


@dataclass(frozen=True)
class Found:
    """A solution: unknowns v, what was given, the derivative `rate` of v by it, residual; way: 1.0 or -1.0, whether the
    branch goes on with what was given, or against it."""

    problem: Clamped
    v: FloatArray
    control: str
    rate: FloatArray
    residual: float
    way: float = 1.0
    determinant: tuple[float, float] = (1.0, 0.0)

    def __getitem__(self, control: str) -> float:
        """One of the controls."""
        return float(self.v[self.problem.controls[control]])

    def ahead(self, control: str) -> float:
        """Derivative of a control along the branch by what was given; that of the shift is zero at a fold, where the
        equations at a given shift have the null vector `rate`."""
        return self.way * float(self.rate[self.problem.controls[control]])

    @property
    def quickest(self) -> str:
        """The control that moves most, over its `SCALES`."""
        return max(SCALES, key=lambda one: abs(self.ahead(one)) / SCALES[one])

    def at(self, control: str, value: float) -> Found | None:
        """The solution of which this is given, begun along the tangent."""
        index = self.problem.controls[control]
        found = self.problem.newton(self.v + (value - self.v[index]) / self.rate[index] * self.rate, control, value)
        return found and replace(found, way=1.0 if self.ahead(control) > 0.0 else -1.0)

    def finer(self) -> Found | None:
        """The same on twice as many intervals with a tenth of the tolerance."""
        old = self.problem
        new, (states, force, shift) = (
            replace(old, parts=2 * old.parts, tolerance=0.1 * old.tolerance),
            old.apart(self.v),
        )
        middles = [integrate(one, force, old.width, 0, 0.5 / old.parts, new.tolerance)[0] for one in states]
        both = np.stack([states, np.array(middles)], axis=1).reshape(-1, STATE)
        found = new.newton(new.joined(both, force, shift), self.control, self[self.control])
        return found and replace(found, way=self.way)

    def upright(self) -> Found | None:
        """The state nearby that is its own image under half a turn about the height's axis, read from its other end."""
        states, force, shift = self.problem.apart(self.v)
        end = integrate(states[-1], force, self.problem.width, 0, 1.0 / self.problem.parts, self.problem.tolerance)[0]
        back = np.concatenate([states, end[None]])[::-1][:-1] * _IMAGE
        back[:, :3] -= end[:3] * _IMAGE[:3]
        both = 0.5 * (states + back), 0.5 * (force + force * [1.0, -1.0, 1.0])
        return self.problem.newton(self.problem.joined(*both, shift), "shift", shift)

    def turned(self, other: Found) -> float:
        """Cosine of the angle between the branch's directions here and there, in the scaled controls."""
        a, b = (np.array([one.ahead(name) / scale for name, scale in SCALES.items()]) for one in (self, other))
        return float(a @ b / np.linalg.norm(a) / np.linalg.norm(b))


def _determinant(lu: SuperLU) -> tuple[float, float]:
    """Sign and logarithm of the size, from a factorisation."""
    pivots = lu.U.diagonal()
    sign = np.prod(np.sign(pivots)) * _parity(lu.perm_r) * _parity(lu.perm_c)
    return float(sign), float(np.sum(np.log(np.abs(pivots))))


def _parity(order: NDArray[np.int32]) -> float:
    """1.0 of an even permutation, -1.0 of an odd one."""
    seen, sign = np.zeros(order.size, bool), 1.0
    for first in range(order.size):
        at, length = first, 0
        while not seen[at]:
            seen[at], at, length = True, order[at], length + 1
        if length and length % 2 == 0:
            sign = -sign
    return sign
