"""The curve-angle rod beside curvature elements, rods of figure 4.5 (thesis, 4.4): iterations, time, error."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from numpy.typing import NDArray

from compare.models import solve as solve_scene
from compare.models.base import Options, State
from compare.scene.scene import load
from tests.validation import page
from tests.validation.number import Number

matplotlib.use("Agg")
import matplotlib.pyplot as plt

#: Its times, or the workers it starts, want the machine.
ALONE = True

FloatArray = NDArray[np.float64]
#: The three rods: sqrt(y^2 + z^2) of the tip at Gamma, of a prototype by another method.
TIPS = {20: 0.16360, 60: 0.20285, 100: 0.21369}
#: Discretisations: label -> what the scene says, sizes.
LADDERS: dict[str, tuple[dict[str, Any], tuple[int, ...]]] = {
    "curve-angle": ({"model.energy": "curve_angle"}, (20, 40, 80, 160)),
    "curve-angle, quasi-static": ({"model.energy": "curve_angle", "rod.twist": "quasi-static"}, (20, 40)),
    "curvature elements": ({"model.energy": "kirchhoff", "model.formulation": "mixed"}, (5, 10, 20, 40)),
}
REFERENCE = {"model.energy": "kirchhoff", "model.formulation": "mixed", "model.elements": 160}
S = np.linspace(0.0, 1.0, 401)


def solved(gamma: int, keys: dict[str, Any], repeats: int = 1) -> State:
    """One rod of figure 4.5."""
    return solve_scene(load("rod_4_5").replace({"strip.gamma": float(gamma), **keys}), options=Options(repeats=repeats))


def distance(state: State, other: State) -> float:
    """Largest distance over l of the centrelines at equal s."""
    assert state.shape is not None
    assert other.shape is not None
    return float(np.linalg.norm(state.shape.centreline(S) - other.shape.centreline(S), axis=1).max())


def tip(state: State) -> float:
    """sqrt(y^2 + z^2) of the free end."""
    assert state.end is not None
    return float(np.hypot(*state.end.position[1:]))


@cache
def reference(gamma: int) -> State:
    """160 curvature elements, whose tip the prototype's is."""
    found = solved(gamma, REFERENCE, 0)
    if not found.ok or abs(tip(found) - TIPS[gamma]) > 1e-5:
        raise AssertionError(f"Gamma = {gamma}: {found.message}, tip {tip(found):.6f}")
    return found


def _rod(gamma: int, label: str, n: int) -> State:
    return solved(gamma, LADDERS[label][0] | {"model.elements": n}, 0)


PROBES = {
    "tip_20": lambda: tip(_rod(20, "curve-angle", 160)),
    "distance_20": lambda: distance(_rod(20, "curve-angle", 160), reference(20)),
    "elements_distance_100": lambda: distance(_rod(100, "curvature elements", 20), reference(100)),
}


def _numbers(found: dict[tuple[int, str, int], tuple[float, float, int]]) -> dict[str, Number]:
    """Tips, distances and orders. The reference is of order 4 and leaves a 4096th of what 20 elements do; an order's
    error is its change from the pair of sizes before."""
    numbers = {}
    for gamma in TIPS:
        leaves = found[gamma, "curvature elements", 20][0] / 4095.0
        numbers[f"tip_{gamma}"] = Number(tip(_rod(gamma, "curve-angle", 160)), leaves + 1e-9, "l", ".5f")
        for word, label, n in (("distance", "curve-angle", 160), ("elements_distance", "curvature elements", 20)):
            numbers[f"{word}_{gamma}"] = Number(found[gamma, label, n][0], leaves, "l", ".1e")
        for word, label in (("order", "curve-angle"), ("elements_order", "curvature elements")):
            a, b, c = (found[gamma, label, n][0] for n in LADDERS[label][1][-3:])
            last, before = (float(np.log2(x / y)) for x, y in ((b, c), (a, b)))
            numbers[f"{word}_{gamma}"] = Number(last, abs(last - before), shown=".2f")
    orders = sorted((numbers[f"elements_order_{gamma}"] for gamma in TIPS), key=lambda order: order.value)
    return numbers | {"elements_order_least": orders[0], "elements_order_most": orders[-1]}


def run(out: Path) -> dict[str, Number]:
    """Solves, checks orders and the prototype's tips, writes the page and its picture."""
    folder = out / "curve_angle"
    folder.mkdir(exist_ok=True)
    rows, lines, found = [], [], {}
    for gamma in TIPS:
        for label, (keys, sizes) in LADDERS.items():
            for n in sizes:
                state = solved(gamma, keys | {"model.elements": n})
                miss = distance(state, reference(gamma)) if state.ok else np.nan
                found[gamma, label, n] = (miss, state.seconds.warm, state.iterations)
                place = f"{tip(state):.5f}" if state.ok else state.word
                rows.append(
                    [
                        str(gamma), label, str(n), str(state.unknowns), str(state.iterations),
                        f"{state.seconds.warm * 1e3:.3g}", place, f"{miss:.1e}",
                    ]
                )  # fmt: skip
                print("  " + " | ".join(rows[-1]), flush=True)
        for label in ("curve-angle", "curvature elements"):
            sizes = LADDERS[label][1][-2:]
            first, last = (found[gamma, label, n][0] for n in sizes)
            lines.append(
                f"- Gamma = {gamma}, {label}: order {np.log2(first / last):.2f} from {sizes[0]} to {sizes[1]}."
            )
    orders = [np.log2(found[gamma, "curve-angle", 80][0] / found[gamma, "curve-angle", 160][0]) for gamma in TIPS]
    if not all(abs(order - 2.0) < 0.15 for order in orders):
        raise AssertionError(f"orders {orders}")
    picture(folder / "curve_angle.png", found)
    heads = ["Gamma", "discretisation", "n", "unknowns", "iterations", "ms, warm", "tip / l", "distance / l"]
    page.write(
        folder / "README.md",
        "The curve-angle rod beside curvature elements",
        "OMP_NUM_THREADS=1 python -m tests.validation curve_angle",
        "The rods of figure 4.5 of the thesis at Gamma = 20, 60, 100 (K l = 10, w/l = 1/30, h/w = 1/10, nu = 0.4; "
        "scene rod_4_5) from their natural shape, both by Ipopt with exact Hessians. Times beside other work. "
        "tip: sqrt(y^2 + z^2) of the free end; a prototype by another method has 0.16360, 0.20285, 0.21369. distance: "
        "largest between the centrelines at equal s, against 160 curvature elements.",
        page.table(heads, rows),
        "Orders of that distance:",
        "\n".join(lines),
        "![Distance against time and iterations](curve_angle.png)",
    )
    return _numbers(found)


def picture(path: Path, found: dict[tuple[int, str, int], tuple[float, float, int]]) -> None:
    """Distance against time, and against iterations; one marker for each Gamma."""
    figure, axes = plt.subplots(1, 2, figsize=(9.0, 3.8), layout="constrained", sharey=True)
    for (label, (_, sizes)), colour in zip(LADDERS.items(), ("C0", "C2", "C1"), strict=True):
        for gamma, mark in zip(TIPS, "os^", strict=True):
            miss, seconds, iterations = np.array([found[gamma, label, n] for n in sizes], dtype=float).T
            name = label if gamma == 20 else None
            axes[0].loglog(seconds * 1e3, miss, mark + "-", color=colour, ms=4, lw=1, label=name)
            axes[1].semilogy(iterations, miss, mark + "-", color=colour, ms=4, lw=1)
    axes[0].set_xlabel("time, warm (ms)")
    axes[1].set_xlabel("iterations of Ipopt")
    axes[0].set_ylabel("distance / l")
    axes[1].set_title("o, square, triangle: Gamma = 20, 60, 100", fontsize=9)
    axes[0].legend(fontsize=8)
    for axis in axes:
        axis.grid(alpha=0.3, which="both")
    figure.savefig(path, dpi=110)
    plt.close(figure)
