"""The shell bent in a plane against the elastica and against its own equations: orders, and that nothing locks."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

from shellref import ShellOptions, ShellProblem, ShellResult, ShellStatus
from shellref.path.solve import solve
from tests.reference.planar_naghdi import cantilever
from tests.validation import page
from tests.validation.number import Number

#: It takes no times that its page rests on.
ALONE = False

WIDTH = 0.05
RATIOS = (10.0, 100.0, 1000.0, 10000.0)
GAMMAS = (1.0, 100.0, 10000.0)
MESHES = {2: (20, 40, 80, 160), 3: (10, 20, 40, 80), 4: (8, 16, 32)}
GRADING = {1.0: 1.0, 100.0: 0.3, 10000.0: 0.1}
#: Largest h times curvature at the clamp, sqrt(2 Gamma) h, of a thin shell (bending strain: half of it).
THIN = 0.15
#: Smallest order seen from both sides on the two finest meshes (Q2), and the largest ratio of errors between two w/h.
LEAST_ORDER, MOST_RATIO = 1.8, 1.5


def solved(gamma: float, ratio: float, degree: int, along: int) -> tuple[ShellResult, np.ndarray, float]:
    """The shell on this mesh, its tip (2,), and the wall time (s)."""
    problem = ShellProblem(
        WIDTH, WIDTH / ratio, 0.0, gamma=gamma, up=(0.0, 1.0, 0.0), elements=(along, 2),
        grading=(GRADING[gamma], 1.0), degree=degree,
    )  # fmt: skip
    began = time.perf_counter()
    result = solve(problem, ShellOptions(stability=False))
    return result, np.array(result.section(1.0)["position"])[[2, 1]], time.perf_counter() - began


def miss(ratio: float, degree: int, along: int) -> float:
    """Distance (in l) of the tip to that of the equations, Gamma = 1."""
    return float(np.hypot(*(solved(1.0, ratio, degree, along)[1] - cantilever(1.0, WIDTH / ratio))))


PROBES = {
    "q2_40_10": lambda: miss(10.0, 2, 40),
    "q2_40_100": lambda: miss(100.0, 2, 40),
    "q3_20_100": lambda: miss(100.0, 3, 20),
}


def run(out: Path) -> dict[str, Number]:
    rows, errors, orders = [], {}, []
    for gamma in GAMMAS:
        elastica = np.array(cantilever(gamma, 0.0))
        for ratio in RATIOS:
            h = WIDTH / ratio
            if h * np.sqrt(2.0 * gamma) > THIN:
                continue
            exact = np.array(cantilever(gamma, h))
            for degree, meshes in MESHES.items():
                if degree > 2 and ratio not in (RATIOS[1], RATIOS[-1]):
                    continue
                last = None
                for n in meshes:
                    result, tip, seconds = solved(gamma, ratio, degree, n)
                    print(f"  {gamma:g} {ratio:g} Q{degree} {n}: {seconds:.1f} s", flush=True)
                    error = float(np.hypot(*(tip - exact)))
                    order = np.log2(last / error) if last else np.nan
                    last = error
                    errors[gamma, ratio, degree, n] = error
                    if degree == 2 and n >= meshes[-2]:
                        orders.append(order)
                    rows.append([
                        f"{gamma:g}", f"{ratio:g}", f"Q{degree} {n} x 2", result.status.value, f"{error:.1e}",
                        f"{order:.1f}" if np.isfinite(order) else "", f"{np.hypot(*(tip - elastica)):.1e}",
                        f"{np.hypot(*(exact - elastica)):.1e}", str(result.newton_iterations), f"{seconds:.1f}",
                    ])  # fmt: skip
                    if result.status is not ShellStatus.CONVERGED:
                        raise AssertionError(f"Gamma = {gamma:g}, w/h = {ratio:g}, Q{degree} {n}: {result.message}")
    spread = max(
        errors[g, r, 2, n] / errors[g, q, 2, n]
        for g in GAMMAS for n in MESHES[2][:3] for r in RATIOS for q in RATIOS
        if (g, r, 2, n) in errors and (g, q, 2, n) in errors
    )  # fmt: skip
    page.write(
        out / "shell_cantilever.md", "A planar cantilever: shell, elastica, and the shell's own equations",
        "python -m tests.validation shell_cantilever",
        f"Horizontal strip, clamped at one end, under its weight; w/l = {WIDTH:g}, nu = 0. error: distance (over l) of "
        "the tip to that of the Naghdi strip solved as an ordinary differential equation with the same thickness "
        "(`tests/reference/planar_naghdi.py`), order: of it from the mesh above; to the elastica: of this tip, and "
        "of the differential equation's (the shell's real shear and stretch). First element at the clamp over "
        "the even ones: "
        + ", ".join(f"{g:g} for Gamma = {k:g}" for k, g in GRADING.items())
        + f". On the same Q2 mesh the error differs between two w/h by a factor of {spread:.2f} at most: "
        "nothing locks. Stability is not looked at here. "
        "The order 2 of Q2 is that of the stabilisation (c = 0.01; about 4 with c = 0, docs/shell.md). "
        f"Left out: h sqrt(2 Gamma) > {THIN:g}, where the bent strip is no thin shell any more (at w/h = 10 and "
        "Gamma = 10,000 its bending strain reaches 0.35; the discrete strip is then unstable).",
        page.table(
            ["Gamma", "w/h", "mesh", "status", "error / l", "order", "to the elastica", "model", "Newton", "s"], rows
        ),
    )  # fmt: skip
    if not spread < MOST_RATIO:
        raise AssertionError(f"the error depends on w/h by a factor of {spread:.2f}")
    if not min(orders) > LEAST_ORDER:
        raise AssertionError(f"orders on the finest Q2 meshes fall to {min(orders):.2f}")
    # what Newton and rounding leave: the tip's distance on the finest mesh of the highest degree, by thickness
    left = {ratio: errors[1.0, ratio, 4, MESHES[4][-1]] for ratio in (RATIOS[1], RATIOS[-1])}
    return {
        **{f"q2_40_{r:g}": Number(errors[1.0, r, 2, 40], left[RATIOS[-1]], "l", ".1e") for r in RATIOS},
        "q3_20_100": Number(errors[1.0, 100.0, 3, 20], left[100.0], "l", ".1e"),
        "spread": Number(spread, left[RATIOS[-1]] / errors[1.0, RATIOS[-1], 2, 80], shown=".2f"),
        "least_order": Number(min(orders), 2.0 - LEAST_ORDER, shown=".1f"),
    }
