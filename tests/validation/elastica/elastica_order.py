"""The planar elastica: orders of convergence, the heavy cantilever's digits, buckling loads, the flower stem."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")
from matplotlib import pyplot as plt

from shellref.elastica.buckling import buckling_modes, exact_loads
from shellref.elastica.solve import ElasticaProblem, solve
from tests.reference.elastica_closed import heavy_cantilever
from tests.reference.elastica_errors import KINDS, errors, orders
from tests.validation import page
from tests.validation.elastica.elastica_daisy import (
    LAB_CURVATURES,
    StemCurve,
    critical_masses,
    lab_stem,
    mass_deflection,
    sheet_newton,
    stem_equilibria,
)
from tests.validation.number import Number, rounding

GAMMAS = (1.0, 10.0, 1e2, 1e3, 1e4, 1e5)
ELEMENTS, DEGREE = 100, 4
MESHES = (10, 100, 1000)
PROMISED_DIGITS, PROMISED_LOADS = 1e-9, 1e-10
#: Rounding of a tip of length 1 by two solves, in l.
EPSILON = 4e-15


def order_table(measured: dict[str, dict[str, np.ndarray]]) -> str:
    """One row for every element and mesh."""
    rows = []
    for kind, found in measured.items():
        _, _, _, angle, end = KINDS[kind]
        slopes = {name: [np.nan, *orders(found[name], found["elements"])] for name in ("angle", "tip", "energy")}
        for k, count in enumerate(found["elements"]):
            row = [kind, f"{count}"]
            for name, wanted in (("angle", angle), ("tip", end), ("energy", end)):
                row += [f"{found[name][k]:.1e}", "" if k == 0 else f"{slopes[name][k]:.2f} ({wanted})"]
            rows.append(row)
    heads = ["element", "number", "theta, L2", "order", "tip / l", "order", "energy, D w / l", "order"]
    return page.table(heads, rows)


def graded_ratio(gamma: float) -> float:
    """Drop over reach of the heavy cantilever's end on graded elements."""
    end = solve(ElasticaProblem(gamma=gamma), ELEMENTS, DEGREE, estimate_error=False).end
    return float(-end[1] / end[0])


def last_orders(found: dict[str, np.ndarray]) -> tuple[float, float]:
    """Order of the tip on the two finest meshes, and what it leaves open: its change from the meshes before, and what
    rounding of the tip (`EPSILON`) makes of it."""
    slopes = orders(found["tip"], found["elements"])
    return float(slopes[-1]), float(abs(slopes[-1] - slopes[-2]) + EPSILON / (found["tip"][-1] * np.log(2.0)))


def digits_table() -> tuple[str, float]:
    """Drop over reach of the heavy cantilever, and the largest relative error with graded elements."""
    rows, worst = [], 0.0
    for gamma in GAMMAS:
        x, drop = heavy_cantilever(gamma)
        row = [f"{gamma:g}", f"{drop / x:.10g}"]
        for nodes in (ELEMENTS, np.linspace(0.0, 1.0, ELEMENTS + 1)):
            end = solve(ElasticaProblem(gamma=gamma), nodes, DEGREE, estimate_error=False).end
            miss = abs(-end[1] / end[0] / (drop / x) - 1.0)
            row.append(f"{miss:.0e}")
            if isinstance(nodes, int):
                worst = max(worst, miss)
        row += [f"{drop / x / (gamma / 8) - 1:+.3g}", f"{drop / x / np.sqrt(gamma / 2) - 1:+.3g}"]
        rows.append(row)
    heads = ["Gamma", "y / x", "graded", "equal", "y / x against Gamma / 8", "against sqrt(Gamma / 2)"]
    return page.table(heads, rows), worst


def buckling_table() -> tuple[str, float]:
    """First four loads over the closed forms, and the largest difference from dolfinx with SLEPc."""
    from tests.validation.elastica.stem_buckling import stem_buckling

    exact, rows, worst = exact_loads("clamped-free"), [], 0.0
    for degree in (1, 2):
        before = None
        for count in MESHES:
            own, other = buckling_modes(count, degree), stem_buckling(count, degree)
            apart = float(np.max(np.abs(other.loads / own.loads - 1.0)))
            worst = max(worst, apart)
            miss = own.loads / exact - 1.0
            slope = "" if before is None or miss[3] < 1e-12 else f"{np.log10(before / miss[3]):.2f} ({2 * degree})"
            before = miss[3]
            rows.append([f"P{degree}", str(count), *(f"{m:.1e}" for m in miss), slope, f"{apart:.0e}"])
    heads = ["element", "number", *(f"load {i}" for i in (1, 2, 3, 4)), "order, load 4", "dolfinx and SLEPc"]
    return page.table(heads, rows), worst


def stem_text() -> str:
    """The lab sheet's equilibria and critical masses."""
    stem = lab_stem(-1.0, "polar")
    masses = {kind: critical_masses(lab_stem(0.0, kind)) for kind in ("polar", "bending")}
    lines = [
        f"Critical mass of the straight stem: {1e3 * masses['polar']['euler']:.9f} g by Euler's formula, "
        f"{1e3 * masses['polar']['eigenvalue']:.9f} g by linear buckling, {1e3 * masses['polar']['path']:.9f} g by the "
        "path's bifurcation, with the sheet's second moment pi r^4 / 2, which is the polar one; with the bending value "
        f"pi r^4 / 4 {1e3 * masses['bending']['euler']:.9f} g. All that follows takes the sheet's. kappa_0 = -1 /m:"
    ]
    for grams in (5, 10):
        state, iterations = sheet_newton(stem, 1e-3 * grams)
        assert state is not None
        others = ", ".join(
            f"{1e2 * other.deflection:+.4f} cm ({'stable' if other.stable else 'unstable'}, "
            f"{other.lowest_eigenvalue:+.3f})"
            for other in stem_equilibria(stem, 1e-3 * grams)
        )
        kind = "stable" if state.stable else "unstable"
        lines.append(
            f"- {grams} g: Newton from theta = pi/2 + kappa_0 s finds a tip displacement of {1e2 * state.tip[0]:+.4f} "
            f"cm in {iterations} iterations, {kind}. Equilibria (lowest eigenvalue): {others}."
        )
    return "\n".join([*lines[:1], "", *lines[1:]])


def stem_table(diagrams: dict[float, list[StemCurve]]) -> str:
    """Branches of the four diagrams."""
    rows = []
    for curvature, curves in diagrams.items():
        for curve in curves:
            events = [f"limit point {1e3 * mass:.5f} g" for mass in curve.limits]
            events += [f"bifurcation {1e3 * mass:.5f} g" for mass in curve.bifurcations]
            stable = sum(state.stable is True for state in curve.states)
            rows.append([
                f"{curvature:g}", curve.name, str(len(curve.states)), str(stable), ", ".join(events),
                f"{1e2 * curve.states[-1 if curve.name != 'apart' else 0].deflection:+.4f}",
            ])  # fmt: skip
    return page.table(["kappa_0, 1/m", "branch", "states", "stable", "events", "x at 10 g, cm"], rows)


def figure(path: Path, measured: dict[str, dict[str, np.ndarray]], diagrams: dict[float, list[StemCurve]]) -> None:
    """Left: error of the tip over elements; right: mass over transverse displacement of the stem."""
    drawing, (left, right) = plt.subplots(1, 2, figsize=(10.5, 4.2), layout="constrained")
    for kind, marker in zip(measured, "osd^v", strict=True):
        found = measured[kind]
        left.loglog(found["elements"], found["tip"], marker=marker, label=f"{kind}: order {KINDS[kind][4]}")
    left.set(xlabel="number of elements", ylabel="error of the tip / l", title="Convergence of the tip")
    left.set_ylim(top=20.0)
    left.legend(ncols=3, loc="upper right", fontsize="small")
    left.grid(alpha=0.3)
    for k, (curvature, curves) in enumerate(diagrams.items()):
        for number, curve in enumerate(curves):
            states = curve.drawn
            x = 1e2 * np.array([state.deflection for state in states])
            mass = 1e3 * np.array([state.mass for state in states])
            stable = np.array([state.stable is True for state in states])
            label = f"$\\kappa_0$ = {curvature:g} /m" if number == 0 else None
            meets = ~stable | np.roll(~stable, 1) | np.roll(~stable, -1)  # dotted up to the stable part
            right.plot(x, np.where(stable, mass, np.nan), color=f"C{k}", label=label)
            right.plot(x, np.where(meets & (not stable.all()), mass, np.nan), color=f"C{k}", linestyle=":")
    right.axhline(1e3 * lab_stem(0.0, "polar").critical_mass, color="0.5", linewidth=0.8)
    right.set(
        xlabel="largest transverse displacement, cm", ylabel="mass, g", title="Flower stem (dotted: unstable)",
        xlim=(-9, 9), ylim=(0, 10.2),
    )  # fmt: skip
    right.legend(loc="lower left")
    right.grid(alpha=0.3)
    drawing.savefig(path, dpi=130)
    plt.close(drawing)


PROBES = {
    "order_p2": lambda: last_orders(errors("P2"))[0],
    "tip_p4_16": lambda: float(errors("P4")["tip"][2]),
    "ratio_10": lambda: graded_ratio(10.0),
    "load_1_p1_100": lambda: float(buckling_modes(100, 1).loads[0]),
}


def run(out: Path) -> dict[str, Number]:
    measured = {kind: errors(kind) for kind in KINDS}
    digits, worst_digits = digits_table()
    loads, worst_loads = buckling_table()
    diagrams = {curvature: mass_deflection(lab_stem(curvature, "polar")) for curvature in LAB_CURVATURES}
    figure(out / "elastica_order.png", measured, diagrams)
    page.write(
        out / "elastica_order.md", "The planar elastica, measured", "python -m tests.validation elastica_order",
        "## Orders",
        "Clamped-free, Gamma = 25 askew, natural curvature from 4 to -3, a force at the tip; equal elements; errors "
        "against P4 on 384. In brackets the order expected: degree + 1 for the angle, twice the degree for tip and "
        "energy. P1, P2: Lagrange; P3, P4: hierarchical; Hermite: cubic with continuous curvature, which nears its "
        "orders from below.",
        order_table(measured),
        "![error of the tip over elements, and mass over displacement of the flower stem](elastica_order.png)",
        "## The heavy cantilever",
        f"Drop over reach of the end by Taylor series shooting from the free end (no finite elements, no mesh), and "
        f"the relative error of {ELEMENTS} elements of degree {DEGREE}, graded towards the clamp's layer and equal. "
        f"Promised: {PROMISED_DIGITS:.0e} on graded elements. Last columns: relative distance to both asymptotes.",
        digits,
        "## Buckling of the straight stem",
        "Relative error of the first four loads, (2 i - 1)^2 pi^2 / 4, and largest relative difference between "
        f"scikit-fem and dolfinx with SLEPc on the same mesh (promised: {PROMISED_LOADS:.0e}). Modes: "
        "sin(sqrt(load) s).",
        loads,
        "## The flower stem",
        stem_text(),
        "Mass against largest transverse displacement up to 10 g in steps of 0.1 g, both sides:",
        stem_table(diagrams),
    )  # fmt: skip
    if not worst_digits < PROMISED_DIGITS:
        raise AssertionError(f"drop over reach is {worst_digits:.1e} off, promised {PROMISED_DIGITS:.0e}")
    if not worst_loads < PROMISED_LOADS:
        raise AssertionError(f"buckling loads differ by {worst_loads:.1e}, promised {PROMISED_LOADS:.0e}")
    found = {f"order_{kind.lower()}": last_orders(values) for kind, values in measured.items()}
    exact = heavy_cantilever(10.0)
    ratio, load = graded_ratio(10.0), buckling_modes(100, 1).loads[0]
    return {
        **{name: Number(*both, shown=".2f") for name, both in found.items()},
        "tip_p4_16": Number(measured["P4"]["tip"][2], measured["P4"]["tip"][3], "l", ".1e"),
        "tip_p4_32": rounding(measured["P4"]["tip"][3], "l", ".1e"),
        "ratio_10": Number(ratio, abs(ratio - exact[1] / exact[0]), shown=".10g"),
        "worst_ratio": rounding(worst_digits, shown=".0e"),
        "load_1_p1_100": Number(load, PROMISED_LOADS * load, shown=".8f"),
        "libraries_apart": Number(worst_loads, PROMISED_LOADS, shown=".0e", why="the iterations' tolerance decides it"),
    }
