"""Weight of the surface against weight of the centreline (thesis, eq. 2.9, 2.10), and what eq. 2.9 leaves out."""

from __future__ import annotations

import functools
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from compare.models.ribbon.build import ribbon_arguments
from compare.scene.scene import load
from ribbon import Clamp, Equilibrium, Gravity, Strip, solve
from ribbon.find.solve import build, solve_shape
from ribbon.surface import surface
from tests.validation import page
from tests.validation.number import Number, rounding

WIDTHS = (0.2, 0.1, 0.05, 0.025, 0.0125)
#: Scene, values of Gamma.
SCENES = (("hanging_5_3_1", (3.0, 30.0)), ("curl_4_3", (10.0, 100.0)), ("arc_5_1", (10.0, 100.0)))
SEGMENTS = 40
UP = (0.6, 0.0, 0.8)
#: Cells of the flat strip over which the weight is integrated by Simpson's rule.
ALONG, ACROSS = 6000, 8


#: What the entry of results/README.md tells: scene, Gamma, w/l.
TOLD = ("curl_4_3", 100.0, 0.025)


def _order(sizes: list[float], first: int = 0) -> float:
    """Slope of log size against log w, the widest ones left out before `first`."""
    return float(np.polyfit(np.log(WIDTHS[first:]), np.log(np.abs(sizes[first:])), 1)[0])


def _slope(sizes: list[float]) -> Number:
    """The order with the change that leaving out the widest strip makes."""
    order = _order(sizes)
    return Number(order, abs(order - _order(sizes, 1)), shown=".2f")


def _pair(name: str, gamma: float, width: float, segments: int = SEGMENTS) -> tuple[Equilibrium, Equilibrium]:
    """The equilibrium under the weight of the centreline, and from its shape that under the weight of the surface."""
    scene = load(name).replace({"strip.gamma": gamma, "strip.width": width, "model.formulation": "mixed"})
    arguments = {**ribbon_arguments(scene), "segments": segments}
    line = solve(**arguments)
    gravity = arguments.pop("gravity")
    for key in ("seed_curvature", "seed_ruling"):
        del arguments[key]
    problem = build(**arguments, gravity=Gravity(gravity.up, exact=True))
    s = np.linspace(0.0, 1.0, segments + 1)
    return line, solve_shape(problem, line.omega(s), line.eta(s))


def _moved(line: Equilibrium, exact: Equilibrium) -> float:
    """Largest distance of the two centrelines."""
    s = np.linspace(0.0, 1.0, 201)
    return float(np.linalg.norm(line.position(s) - exact.position(s), axis=1).max())


def _differences() -> tuple[list[list[str]], list[Number]]:
    rows, orders = [], []
    for name, gammas in SCENES:
        for gamma in gammas:
            moved, energy = [], []
            for width in WIDTHS:
                line, exact = _pair(name, gamma, width)
                if not (line.ok and exact.ok):
                    raise AssertionError(f"{name}, Gamma = {gamma:g}, w/l = {width:g}: {line.message}; {exact.message}")
                moved.append(_moved(line, exact))
                energy.append(exact.energy.total - line.energy.total)
            orders.append(_slope(moved))
            for what, sizes in (("position / l", moved), ("energy", energy)):
                rows.append([name, f"{gamma:g}", what, *(f"{v:.1e}" for v in sizes), f"{_order(sizes):.2f}"])
    return rows, sorted(orders, key=lambda order: order.value)


def _by_simpson(values: np.ndarray, steps: tuple[float, float]) -> float:
    """Integral of values (cells along + 1, cells across + 1) over the rectangle."""
    weights = []
    for n, step in zip(values.shape, steps, strict=True):
        w = np.full(n, 2.0)
        w[1::2] = 4.0
        w[0] = w[-1] = 1.0
        weights.append(w * step / 3.0)
    return float(weights[0] @ values @ weights[1])


def weights(problem: Any, x: np.ndarray, cells: int = ALONG) -> dict[str, float]:
    """Weight energy of the shape x over Gamma: centreline, eq. 2.9 as printed, with the ends, over the rectangle."""
    width = 2 * problem.half_width
    up = np.asarray(problem.gravity.up)
    points, frames = problem.joints(x)
    q = problem.parameters(x)
    grid = surface(q, problem.lengths, points, frames, problem.exponent_limit, width, cells, ACROSS).grid @ up
    gamma = problem.strip.gamma
    ours = problem.energy_parts(x)[2] / gamma
    plain = problem.with_changes(gravity=replace(problem.gravity, exact=False))
    ends = 0.0
    for joint, sign in ((0, 1.0), (-1, -1.0)):
        eta = x[problem.layout.joint(joint).eta]
        across, along = frames[joint, :, 0] @ up, frames[joint, :, 2] @ up
        ends += sign * width**2 / 12 * (eta * across + eta**2 / 2 * along)
    return {
        "line": float(plain.energy_parts(x)[2]) / gamma,
        "eq. 2.9": ours - ends,
        "with the ends": ours,
        "rectangle": _by_simpson(grid, (1.0 / cells, width / ACROSS)) / width,
    }


def _smooth(width: float, cells: int = ALONG) -> dict[str, float]:
    """Weights of the same smooth shape, that wide."""
    problem = build(
        Strip(1.0, width, 0.5, 0.0, 1.0), Clamp(ruling="free"), Gravity(UP, exact=True), segments=SEGMENTS,
        formulation="mixed",
    )  # fmt: skip
    s = np.linspace(0.0, 1.0, SEGMENTS + 1)
    return weights(problem, problem.state(3.0 + np.sin(4.0 * s), 0.5 - 0.9 * s + 0.3 * np.cos(3.0 * s)), cells)


@functools.cache
def told() -> dict[str, float]:
    """What each formula leaves of the integral at the width that is told."""
    found = _smooth(TOLD[2])
    return {name: abs(found[name] - found["rectangle"]) for name in ("line", "eq. 2.9", "with the ends")}


PROBES = {
    "curl_position": lambda: _moved(*_pair(*TOLD)),
    "line_left": lambda: told()["line"],
    "printed_left": lambda: told()["eq. 2.9"],
    "ends_left": lambda: told()["with the ends"],
}


def _rectangle() -> tuple[list[list[str]], dict[str, Number]]:
    """The same smooth shape at every width: what each formula leaves of the integral over the flat strip."""
    left: dict[str, list[float]] = {"line": [], "eq. 2.9": [], "with the ends": []}
    for width in WIDTHS:
        found = _smooth(width)
        for name, sizes in left.items():
            sizes.append(abs(found[name] - found["rectangle"]))
    orders = {name: _slope(sizes) for name, sizes in left.items()}
    return [[n, *(f"{v:.1e}" for v in sizes), str(orders[n])] for n, sizes in left.items()], orders


def _straight() -> tuple[list[list[str]], float]:
    """A straight strip at rest: its elastic energy is zero whatever its rulings, and so must be what they weigh."""
    width, gamma = 0.1, 100.0
    problem: Any = build(
        Strip(1.0, width, 0.5, 0.0, gamma),
        Clamp(ruling="free"),
        Gravity(UP, exact=True),
        segments=SEGMENTS,
        formulation="mixed",
    )
    rows, worst = [], 0.0
    s = np.linspace(0.0, 1.0, SEGMENTS + 1)
    for first in (0.0, -1.0, -10.0, -100.0, -1000.0):
        eta = first + 0.9 * 2.0 / width * s
        x = problem.state(np.zeros(s.size), eta)
        assert np.array_equal(x[problem.layout.eta], eta)
        q = problem.joints(x)[1][:, :, 0] + eta[:, None] * problem.joints(x)[1][:, :, 2]
        line = gamma * float(np.asarray(UP)[2]) / 2
        # trapezium rule: exact, the integrand is linear
        slopes = np.diff(eta) * (0.5 * (q[1:] + q[:-1]) @ np.asarray(UP))
        literal = line + gamma * width**2 / 12 * float(slopes.sum())
        parts = problem.energy_parts(x)
        worst = max(worst, abs(float(parts[2]) - line) / (1.0 + abs(literal)))
        rows.append([f"{first:g}", f"{parts[0]:.1e}", f"{line:.6f}", f"{literal:.6f}", f"{parts[2]:.6f}"])
    return rows, worst


def _numbers(orders: list[Number], left: dict[str, Number]) -> dict[str, Number]:
    """What is told: the curl, the orders, and what the formulas leave, on twice the segments and half the cells."""
    moved, finer = (_moved(*_pair(*TOLD, segments)) for segments in (SEGMENTS, 2 * SEGMENTS))
    here = told()
    simpson = abs(_smooth(TOLD[2])["rectangle"] - _smooth(TOLD[2], ALONG // 2)["rectangle"])
    names = {"line_left": "line", "printed_left": "eq. 2.9", "ends_left": "with the ends"}
    return {name: Number(here[key], simpson + 1e-13, "of the weight", ".1e") for name, key in names.items()} | {
        "curl_position": Number(moved, abs(moved - finer), "l", ".1e"),
        "order_least": orders[0],
        "order_most": orders[-1],
        "ends_order": left["with the ends"],
        "line_order": left["line"],
    }


def run(out: Path) -> dict[str, Number]:
    straight, worst = _straight()
    rectangle, orders = _rectangle()
    difference, moved = _differences()
    heads = [*(f"w/l = {w:g}" for w in WIDTHS), "order in w"]
    page.write(
        out / "exact_gravity.md", "Weight of the surface or of the centreline",
        "python -m tests.validation exact_gravity",
        "`gravity.exact = true` weighs the surface (thesis, eq. 2.9), false the centreline (eq. 2.10). Energies in "
        "D w / l, lengths in l.",
        f"## How much it changes\n\nThe same scene with either, {SEGMENTS} equal segments, the exact one started "
        "from the other's shape: largest distance of the centrelines, and energy of the exact one minus the "
        "other's (where its sign changes with w, the fitted order of its size means little).",
        page.table(["scene", "Gamma", "difference of", *heads], difference),
        "## Why eq. 2.9 needs its ends\n\nEq. 2.9 weighs `r(s) + u q(s)` for s from 0 to l: the surface between "
        "the rulings of both ends. The strip is a rectangle: where an end's ruling is oblique, a triangle is "
        "missing on one side and one too many on the other. A straight strip has no elastic energy whatever its "
        "rulings are, and its weight does not depend on them; eq. 2.9 as printed does, by Gamma w^2/12 [eta <t_x, "
        "e> + eta^2/2 <t_z, e>] between the ends, without bound. Below: w/l = 0.1, Gamma = 100, t_z inclined to "
        "the vertical, eta = eta(0) + 0.9 (2/w) s, evaluated by hand. A minimiser would follow it: there is no "
        "lowest energy. The end terms of `ribbon.problems.mixed_kernels.end_weight` take the triangles into account.",
        page.table(["eta(0)", "elastic", "weight: centreline", "eq. 2.9 as printed", "with the ends"], straight),
        "## Against the integral over the flat strip\n\nWeight energy over Gamma of one shape, omega l = 3 + sin 4s, "
        f"eta = 0.5 - 0.9 s + 0.3 cos 3s, up = {UP}, minus the integral of <phi, e> over the material rectangle by "
        f"Simpson's rule on {ALONG} x {ACROSS} cells of `Equilibrium.surface`'s points. Between the ends eq. 2.9 is "
        "exact; what is left with the end terms is their own next order, from the triangles' second-order shape.",
        page.table(["formula", *heads], rectangle),
    )  # fmt: skip
    if worst > 1e-10:
        raise AssertionError(f"the weight of a straight strip depends on its rulings: {worst:.1e}")
    if not (orders["line"].value < 2.5 and orders["with the ends"].value > 3.5):
        raise AssertionError(f"orders in w: {orders}")
    return _numbers(moved, orders) | {"straight": rounding(worst)}
