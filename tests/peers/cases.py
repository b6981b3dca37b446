"""The seven cases of the strong form (results/strong_form.md), and how far a free end is from the reference."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.scene.scene import load
from ribbon import Clamp, Equilibrium, Gravity, Strip, refine, solve
from tests.reference.strong_form import Solution, StrongForm, collocate

FloatArray = NDArray[np.float64]

#: Scene, sign of K.
NAMES = (
    ("figure_4_1", 1), ("coil_10_100", 1), ("coil_10_100", -1), ("coil_40_1200", 1), ("coil_40_1200", -1),
    ("coil_100_7500", 1), ("coil_100_7500", -1),
)  # fmt: skip
#: So narrow a strip (w / l) that the bound on eta' is out of reach; Sadowsky's energy does not know the width.
NARROW = 1e-3
#: Distance of the free end (l) that a run may have, and that beyond which it stands on another branch.
TARGET, BRANCH = 1e-6, 0.03
#: Tolerance of the reference; segments of the ribbon it starts from.
_REFERENCE, _START = 1e-8, 160


@dataclass(frozen=True)
class Run:
    """What a peer did: its settings, distance of its free end to the reference (l), CPU s."""

    settings: str
    error: float
    seconds: float


@dataclass(frozen=True)
class Case:
    """A coil: K l, Gamma, nu, frame (3, 3) of the clamp and direction up (3,)."""

    name: str
    curvature: float
    gamma: float
    poisson: float
    up: tuple[float, float, float]
    frame: FloatArray

    @property
    def strong(self) -> StrongForm:
        """The boundary-value problem."""
        return StrongForm(self.gamma, (self.curvature, self.curvature), self.poisson, self.up, self.frame)

    @property
    def first_up(self) -> FloatArray:
        """g (3,) at the clamp: the vertical in its frame."""
        return np.asarray(self.frame.T @ np.asarray(self.up))

    def ribbon(self, segments: int, **keywords: Any) -> Equilibrium:
        """`ribbon.solve` from the natural shape."""
        strip = Strip(1.0, NARROW, self.poisson, self.curvature, self.gamma)
        clamp = Clamp((0.0, 0.0, 0.0), self.frame[:, 2], self.frame[:, 1], ruling="free")
        return solve(strip, clamp, Gravity(self.up), energy="sadowsky", segments=segments, **keywords)

    def error(self, tip: FloatArray) -> float:
        """Distance of r(1) - r(0) (3,) to the reference's, l."""
        return float(np.linalg.norm(np.asarray(tip) - reference(self.name)))

    def tip(self, s: FloatArray, y: FloatArray, degree: int) -> FloatArray:
        """r(1) - r(0) of values y (6, k) at abscissae s (k,), k - 1 a multiple of `degree`: a polynomial of that degree
        on every `degree` intervals, read off densely."""
        fine, values = [], []
        for begin in range(0, s.size - 1, degree):
            x, v = s[begin : begin + degree + 1], y[:, begin : begin + degree + 1]
            at = np.linspace(x[0], x[-1], 6 * degree + 1)[:-1]
            weights = np.array([1.0 / np.prod((x[i] - np.delete(x, i)) / (x[-1] - x[0])) for i in range(x.size)])
            apart = at[:, None] - x[None, :]
            on = np.isclose(apart, 0.0, atol=1e-14)
            parts = weights / np.where(on, 1.0, apart)
            parts = np.where(on.any(axis=1)[:, None], on.astype(float), parts)
            fine.append(at)
            values.append((v @ parts.T) / parts.sum(axis=1))
        t, u = np.append(np.concatenate(fine), s[-1]), np.hstack([*values, y[:, -1:]])
        return Solution(self.strong, t, u, self.strong.right_side(t, u), True, "", 1, 0.0).tip()


@functools.cache
def case(name: str, sign: int) -> Case:
    """The case of a scene with this sign of K."""
    scene = load(name)
    return Case(
        f"{name}, K l = {sign * scene.curvature[0]:g}", sign * scene.curvature[0], scene.gamma, scene.strip.poisson,
        tuple(map(float, scene.up)), np.asarray(scene.frame),
    )  # fmt: skip


def cases() -> list[Case]:
    """All seven."""
    return [case(name, sign) for name, sign in NAMES]


@functools.cache
def reference(name: str) -> FloatArray:
    """r(1) - r(0) (3,): solve_bvp at a tolerance of 1e-8, from a fine ribbon, which shares nothing with it."""
    (found,) = [c for c in cases() if c.name == name]
    ribbon = found.ribbon(20 if abs(found.curvature) < 50 else 40)
    while ribbon.problem.lengths.size < _START:
        ribbon = refine(ribbon)
    s = np.linspace(0.0, 1.0, int(max(4 * abs(found.curvature), 60)))
    start = strong_values(found, ribbon, s)
    looser = collocate(found.strong, s, start, 10 * _REFERENCE, 100000)
    solution = collocate(found.strong, looser.s, looser.y, _REFERENCE, 100000)
    if not solution.converged:
        raise AssertionError(f"{name}: no reference")
    return solution.tip()


def strong_values(found: Case, ribbon: Equilibrium, s: FloatArray) -> FloatArray:
    """y (6, k) of a ribbon at s (k,); M_2 from ``m = int_s^1 (r(t) - r(s)) x (-Gamma e_g) dt``."""
    r, frames = ribbon.position(s), ribbon.frame(s)
    steps = 0.5 * np.diff(s)[:, None] * (r[1:] + r[:-1])
    behind = np.concatenate([np.cumsum(steps[::-1], axis=0)[::-1], np.zeros((1, 3))])
    moment = -found.gamma * np.cross(behind - (1 - s)[:, None] * r, np.asarray(found.up))
    g = np.einsum("kij,i->jk", frames, np.asarray(found.up))
    return np.vstack([g, ribbon.omega(s), ribbon.eta(s), np.einsum("ki,ki->k", moment, frames[:, :, 1])])
