"""Few and many elements, strong grading, strong curl, great weight."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from typing import Any

import numpy as np

from compare.battery.case import Case, Check, Rung, ends_as, holds, near
from compare.battery.judge.ribbon import judged
from compare.battery.scenes import changed, solved

#: CPU seconds that a single strip may take (most of it the first compilation that a process may need).
_SECONDS = 60.0


def _elements(count: Rung) -> Iterator[Check]:
    """The flat cantilever is the elastica: end and energy tend to its values with the fourth power of the length."""
    n = int(count)
    state = solved(changed("cantilever", {"model.elements": n}))
    yield ends_as(state, "converged")
    yield from judged(state.native, spectrum=n <= 200)
    assert state.end is not None
    tip = np.array([0.0, *_elastica_tip(10.0)])
    off = float(np.abs(state.end.position - tip).max())
    yield Check("end apart from the elastica (l)", off, 0.2 / n**4 + 1e-10, said=f"{off:.2e}")


def _elastica_tip(gamma: float) -> tuple[float, float]:
    """(y, z) of the free end of the elastica clamped level under its weight, by `solve_bvp`: theta'' = Gamma (1 - s)
    cos(theta), theta(0) = 0, theta'(1) = 0, theta the angle below the horizontal (docs/theory.md, chapter 8)."""
    from scipy.integrate import quad, solve_bvp

    s = np.linspace(0.0, 1.0, 201)

    def slope(at: Any, y: Any) -> Any:
        return np.vstack([y[1], -gamma * (1.0 - at) * np.cos(y[0])])

    found = solve_bvp(slope, lambda a, b: np.array([a[0], b[1]]), s, np.zeros((2, s.size)), tol=1e-12, max_nodes=100000)
    angle = found.sol
    down = quad(lambda t: math.sin(angle(t)[0]), 0.0, 1.0, epsabs=1e-13, limit=400)[0]
    out = quad(lambda t: math.cos(angle(t)[0]), 0.0, 1.0, epsabs=1e-13, limit=400)[0]
    return -down, out


def _graded(ratio: Rung) -> Iterator[Check]:
    """Segments whose lengths grow by a constant factor, so that the longest is `ratio` times the shortest."""
    from ribbon import Clamp, Gravity, Strip, solve

    lengths = np.geomspace(1.0, float(ratio), 40)
    strip = Strip(1.0, 0.05, gamma=100.0, natural_curvature=10.0)
    up = Gravity(up=(1.0, 0.0, 0.0))
    clamp = Clamp(normal=(-math.sqrt(0.5), math.sqrt(0.5), 0.0))
    found = solve(strip, clamp, up, segments=lengths / lengths.sum(), leave_saddle=True)
    yield holds("status converged", found.ok, found.message)
    yield from judged(found)


def _curl(curvature: Rung) -> Iterator[Check]:
    """Weightless, it is the coil: omega = K, energy -K^2 / 2, the end of an arc of the angle K."""
    k = float(curvature)
    state = solved(changed("cantilever", {"strip.natural_curvature": k, "strip.gamma": 0.0}))
    yield ends_as(state, "converged")
    yield from judged(state.native, spectrum=False)
    assert state.energy is not None
    assert state.energy.total is not None
    assert state.end is not None
    yield near("energy, -K^2/2", state.energy.total, -0.5 * k * k, 1e-12)
    down, out = -(1.0 - math.cos(k)) / k, math.sin(k) / k
    off = float(np.abs(state.end.position - np.array([0.0, down, out])).max())
    yield Check("end apart from the arc (l)", off, 1e-12 + 1e-16 * k)


def _weight(gamma: Rung) -> Iterator[Check]:
    """A heavy strip clamped level hangs straight down behind a layer of the length 1/sqrt(Gamma)."""
    g = float(gamma)
    began = time.process_time()
    state = solved(changed("cantilever", {"strip.gamma": g}, placed=True))
    yield Check("time (CPU s)", time.process_time() - began, _SECONDS, timed=True)
    yield ends_as(state, "converged")
    yield from judged(state.native)
    assert state.energy is not None
    assert state.energy.total is not None
    # E + Gamma / 2 -> the layer's energy: int q (1 - cos) turned by a right angle, 2 (2 - sqrt 2) sqrt(Gamma)
    layer = 2.0 * (2.0 - math.sqrt(2.0)) * math.sqrt(g)
    found = state.energy.total + 0.5 * g
    yield Check("energy of the layer, relative", abs(found / layer - 1.0), 1.0 / math.sqrt(g) + 1e-3 + 1e-15 * g)
    assert state.iterations is not None
    yield Check("iterations of the last solve", float(state.iterations), 30.0)


def _heavy_coil(curl: float) -> Any:
    def run(gamma: Rung) -> Iterator[Check]:
        began = time.process_time()
        scene = changed("cantilever", {"strip.gamma": float(gamma), "strip.natural_curvature": curl}, placed=True)
        state = solved(scene, leave_saddle=True)
        yield Check("time (CPU s)", time.process_time() - began, _SECONDS, timed=True)
        yield ends_as(state, "converged")
        yield from judged(state.native)

    return run


def _hanging(gamma: Rung) -> Iterator[Check]:
    """From every attitude of the clamp: level, rising, upright, turned over, rolled about its tangent."""
    for angle in (0.0, 0.6, 1.5, 2.5, 3.1):
        up = [0.3 * math.sin(angle), math.cos(angle), math.sin(angle)]
        size = math.sqrt(sum(v * v for v in up))
        scene = changed("cantilever", {"strip.gamma": float(gamma), "gravity.up": [v / size for v in up]}, placed=True)
        state = solved(scene, leave_saddle=True)
        checks = [ends_as(state, "converged"), *judged(state.native)]
        yield from (Check(f"{c.what}, clamp at {angle:g} rad", c.value, c.bound, c.timed, c.said) for c in checks)


_SHORT: dict[Rung, str] = dict.fromkeys(
    (1e8, 1e12),
    "joints 1e-9 l apart and nearer: forces on one of them are differences of rounding over that distance",
)
_LAYERS = (
    "two layers of 1e-4 l, or one out of the clamp's plane, are not reached from a plane seed; said: not converged, or "
    "infeasible"
)
_TURNED = (
    "a layer of 1e-3 l out of the clamp's plane, in which the ruling turns to eta = 6 within a third of it: it ends on "
    "a saddle (eigenvalue -2e-5 to -4e-4) or not converged, and says so"
)
CASES: tuple[Case, ...] = (
    Case(
        "size/elements",
        "one element carries the whole strip, or ten thousand carry 1e-4 each",
        "status and balance on any number, the end within 0.2 / p^4 of the elastica's (order 4, theory chapter 8)",
        "p", _elements, (1, 2, 3, 20), (5, 100, 500, 1000, 10_000),
    ),
    Case(
        "size/grading",
        "neighbouring segments of very different lengths make matrices of the fourth power of their ratio",
        "a stable equilibrium in balance, with the eigenvalue of the same problem stated apart",
        "longest over shortest", _graded, (1.0, 1e4), (1e2, 1e6, 1e8, 1e12), _SHORT,
    ),
    Case(
        "size/curl",
        "many turns on a segment: errors of the frame grow with K",
        "the coil of closed form: energy -K^2/2, end of the arc",
        "K l", _curl, (1.0, 100.0), (10.0, 500.0, -500.0, 1000.0, 3000.0),
    ),
    Case(
        "size/weight",
        "the strip turns within l/sqrt(Gamma); forces of 1e9 beside a bending stiffness of 1",
        "a stable equilibrium in balance within a minute; the layer's energy 2 (2 - sqrt 2) sqrt(Gamma)",
        "Gamma", _weight, (1e4, 1e6), (1e3, 1e5, 1e7, 1e8, 1e9),
    ),
    Case(
        "size/heavy_coil_100",
        "weight pulls the coils of K = 100 out, from none of them to all but the last",
        "a stable equilibrium in balance within a minute, saddles left",
        "Gamma", _heavy_coil(100.0), (1e3,), (1e2, 1e5, 1e6, 1e7, 1e8), {1e8: _LAYERS},
    ),
    Case(
        "size/heavy_coil_500",
        "the same with K = 500",
        "a stable equilibrium in balance within a minute, saddles left",
        "Gamma", _heavy_coil(500.0), (), (1e3, 1e5, 1e7),
    ),
    Case(
        "size/hanging",
        "clamps level, rising, upright, turned over, rolled: the layer is not in the clamp's plane of bending",
        "a stable equilibrium in balance from each",
        "Gamma", _hanging, (), (1e2, 1e4, 1e6, 1e8), {1e6: _TURNED, 1e8: _LAYERS},
    ),
)  # fmt: skip
