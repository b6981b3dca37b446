"""The lab sheet "Le flambage de la paquerette": buckling, equilibria of 5 g and 10 g, mass against deflection."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np
from numpy.typing import NDArray

from shellref.elastica.arc import ArcOptions
from shellref.elastica.buckling import buckling_modes, exact_loads
from tests.validation import page
from tests.validation.elastica.elastica_daisy import (
    LAB_CURVATURES,
    StemCurve,
    StemState,
    critical_masses,
    lab_stem,
    mass_deflection,
    sheet_newton,
    stem_equilibria,
)
from tests.validation.number import Number, rounding

matplotlib.use("Agg")
from matplotlib import pyplot as plt

Array = NDArray[np.float64]

MESHES, DEGREES = (10, 100, 1000), (1, 2)
MASSES = (0.005, 0.010)
MOMENTS = {"polar": "pi r^4 / 2 (polar, the sheet's)", "bending": "pi r^4 / 4 (bending)"}
#: Largest relative difference of scikit-fem and dolfinx; of the three critical masses; of limit points' estimate.
APART, CRITICAL = 1e-10, 1e-8
#: Longest steps of arc length of the limit point's branch: the second is the page's.
STEPS = (0.2, 0.08)


def buckling_table() -> tuple[str, float, dict[int, tuple[Array, Array]]]:
    """Loads on all meshes; largest difference of the two libraries; (s, modes) of scikit-fem's P1 by mesh."""
    from tests.validation.elastica.stem_buckling import stem_buckling

    exact, rows, worst, modes = exact_loads("clamped-free"), [], 0.0, {}
    for degree in DEGREES:
        last: Array | None = None
        for count in MESHES:
            own, other = buckling_modes(count, degree), stem_buckling(count, degree)
            apart = float(np.max(np.abs(other.loads / own.loads - 1.0)))
            worst = max(worst, apart)
            if degree == 1:
                modes[count] = own.s, own.modes
            miss = np.abs(own.loads / exact - 1.0)
            slopes = ["" if last is None or m < 1e-12 else f" ({math.log10(b / m):.2f})"
                      for b, m in zip(miss if last is None else last, miss, strict=True)]  # fmt: skip
            last = miss
            rows.append([
                f"P{degree}", str(count), *(f"{load:.8f}" for load in own.loads), *(f"{load:.8f}" for load in
                other.loads[:1]), *(f"{m:.1e}{order}" for m, order in zip(miss, slopes, strict=True)), f"{apart:.0e}",
            ])  # fmt: skip
    rows.append(["exact", "", *(f"{load:.8f}" for load in exact), f"{exact[0]:.8f}", "", "", "", "", ""])
    heads = ["element", "number", *(f"load {i}" for i in range(1, 5)), "load 1, dolfinx",
             *(f"error {i}" for i in range(1, 5)), "dolfinx"]  # fmt: skip
    return page.table(heads, rows), worst, modes


def critical_table() -> tuple[str, float]:
    """Critical masses by formula, eigenvalue and path, for both second moments; their largest relative difference."""
    rows, worst = [], 0.0
    for kind, said in MOMENTS.items():
        found = critical_masses(lab_stem(0.0, kind))
        worst = max(worst, *(abs(found[path] / found["euler"] - 1.0) for path in ("eigenvalue", "path")))
        moment = lab_stem(0.0, kind).second_moment
        place = ", ".join(f"{1e3 * mass:g} g {'above' if mass > found['euler'] else 'below'}" for mass in MASSES)
        rows.append([said, f"{moment:.6e}", *(f"{1e3 * found[path]:.8f}" for path in ("euler", "eigenvalue", "path")),
                     place])  # fmt: skip
    heads = ["I", "I, m^4", "Euler, g", "eigenvalue, g", "path, g", "the sheet's masses"]
    return page.table(heads, rows), worst


def equilibria_table() -> tuple[str, dict[tuple[str, float], list[StemState]]]:
    """All equilibria found for 5 g and 10 g, kappa_0 = -1 /m, both second moments; which the sheet's Newton finds."""
    rows, found = [], {}
    for kind, said in MOMENTS.items():
        stem = lab_stem(-1.0, kind)
        for mass in MASSES:
            states = stem_equilibria(stem, mass)
            found[kind, mass] = states
            newton, iterations = sheet_newton(stem, mass)
            if newton is None:
                raise AssertionError(f"Newton from theta = pi/2 + kappa_0 s fails for {1e3 * mass:g} g")
            for state in states:
                same = float(np.abs(state.theta - newton.theta).max()) < 1e-6
                rows.append([
                    said, f"{1e3 * mass:g}", f"{1e2 * state.tip[0]:+.5f}", f"{1e2 * state.tip[1]:+.5f}",
                    f"{1e2 * state.deflection:+.5f}", f"{state.lowest_eigenvalue:+.4f}",
                    "stable" if state.stable else "unstable", f"found, {iterations} iterations" if same else "",
                ])  # fmt: skip
    heads = ["I", "M, g", "tip x, cm", "tip y, cm", "deflection, cm", "lowest eigenvalue", "stability",
             "Newton from rest"]  # fmt: skip
    return page.table(heads, rows), found


def branch_table(diagrams: dict[tuple[str, float], list[StemCurve]]) -> str:
    """Branches with their events and what they are at 10 g; the estimate of the limit points."""
    rows = []
    for (kind, curvature), curves in diagrams.items():
        stem = lab_stem(curvature, kind)
        turn = abs(curvature * stem.length)
        load = math.pi**2 / 4 + 1.5 * (math.pi**2 / 4 * turn**2) ** (1.0 / 3.0)
        estimate = 1e3 * load / stem.tip_load(1.0)
        for curve in curves:
            events = [f"limit point {1e3 * mass:.5f} g (estimate {estimate:.4f})" for mass in curve.limits]
            events += [f"bifurcation {1e3 * mass:.6f} g" for mass in curve.bifurcations]
            at_most = max(curve.states, key=lambda state: (state.mass, state.lowest_eigenvalue))
            stable = sum(state.stable is True for state in curve.states)
            rows.append([
                kind, f"{curvature:g}", curve.name, f"{len(curve.states)}", f"{stable}", ", ".join(events) or "none",
                f"{1e2 * at_most.deflection:+.4f}",
            ])  # fmt: skip
    heads = ["I", "kappa_0, 1/m", "branch", "states", "stable", "events", "deflection at 10 g, cm"]
    return page.table(heads, rows)


def modes_figure(path: Path, modes: dict[int, tuple[Array, Array]]) -> None:
    """The first four modes of theta and, on the right, their distance to sin(sqrt(load) s)."""
    drawing, (left, right) = plt.subplots(1, 2, figsize=(11.0, 4.2), layout="constrained")
    s, found = modes[MESHES[1]]
    exact = exact_loads("clamped-free")
    for k in range(4):
        sign = np.sign(found[k, 1])
        left.plot(s, sign * found[k], color=f"C{k}", label=f"mode {k + 1}, load {exact[k]:.2f}")
        left.plot(s[::4], np.sin(np.sqrt(exact[k]) * s[::4]), "o", ms=3, color=f"C{k}", mfc="none")
    left.set(xlabel="s", ylabel="$\\Delta\\theta$, largest value 1", ylim=(-1.15, 1.9),
             title=f"Modes on {MESHES[1]} linear elements; dots: $\\sin(\\sqrt{{\\lambda_i}}\\, s)$")  # fmt: skip
    left.legend(ncols=2, loc="upper center")
    for k in range(4):
        loads = [abs(buckling_modes(n, 1).loads[k] / exact[k] - 1.0) for n in MESHES]
        right.loglog(MESHES, loads, "o-", color=f"C{k}", label=f"load {k + 1}")
    right.set(xlabel="linear elements", ylabel="relative error", title="Loads (at the nodes the modes are exact)")
    right.legend()
    for axes in (left, right):
        axes.grid(alpha=0.3)
    drawing.savefig(path, dpi=120)
    plt.close(drawing)


def shape_figure(path: Path, found: dict[tuple[str, float], list[StemState]]) -> None:
    """The equilibria in space, one panel per second moment and mass; dashed: unstable."""
    drawing, panels = plt.subplots(1, len(found), figsize=(14.0, 3.6), sharey=True, layout="constrained")
    s = np.linspace(0.0, 10.0, 101)
    for axes, ((kind, mass), states) in zip(panels, found.items(), strict=True):
        axes.plot(*_line(s, math.pi / 2 - 0.01 * s), color="0.7", label="at rest")
        for k, state in enumerate(states):
            x, y = _line(s, state.theta)
            word = "stable" if state.stable else "unstable"
            axes.plot(x, y, "-" if state.stable else "--", color=f"C{k}", lw=2, label=word)
            axes.plot(x[-1], y[-1], "o", color=f"C{k}", ms=9)
        axes.axhline(0.0, color="0.5", lw=0.8)
        axes.set(xlabel="x, cm", title=f"{1e3 * mass:g} g, I {'polar' if kind == 'polar' else 'bending'}",
                 xlim=(-10.5, 9.5), ylim=(-4.5, 11.5))  # fmt: skip
        axes.set_aspect("equal")
        axes.legend(fontsize="small", loc="upper left")
        axes.grid(alpha=0.3)
    panels[0].set(ylabel="y, cm")
    drawing.savefig(path, dpi=120)
    plt.close(drawing)


def _line(s: Array, theta: Array) -> tuple[Array, Array]:
    """The curve (x, y), each (n,), of angles (n,) at arc lengths (n,), by trapezoids."""
    step = np.diff(s)
    mean_cos = 0.5 * (np.cos(theta[1:]) + np.cos(theta[:-1]))
    mean_sin = 0.5 * (np.sin(theta[1:]) + np.sin(theta[:-1]))
    return np.concatenate([[0.0], np.cumsum(step * mean_cos)]), np.concatenate([[0.0], np.cumsum(step * mean_sin)])


def curve_figure(path: Path, diagrams: dict[tuple[str, float], list[StemCurve]], kind: str) -> None:
    """Mass against deflection, all of it and near the critical mass; dashed: unstable; dots: limit points."""
    drawing, (whole, near) = plt.subplots(1, 2, figsize=(12.0, 5.2), layout="constrained")
    critical = 1e3 * lab_stem(0.0, kind).critical_mass
    for k, curvature in enumerate(LAB_CURVATURES):
        for number, curve in enumerate(diagrams[kind, curvature]):
            x = 1e2 * np.array([state.deflection for state in curve.drawn])
            mass = 1e3 * np.array([state.mass for state in curve.drawn])
            stable = np.array([state.stable is True for state in curve.drawn])
            for event in curve.bifurcations:  # where the stability changes, between two states
                place = int(np.searchsorted(mass, 1e3 * event))
                x = np.insert(x, place, np.interp(1e3 * event, mass, x))
                mass, stable = np.insert(mass, place, 1e3 * event), np.insert(stable, place, False)
            for axes in (whole, near):
                label = f"$\\kappa_0$ = {curvature:g} /m" if number == 0 else None
                _pieces(axes, x, mass, stable, f"C{k}", label)
    for axes in (whole, near):
        axes.axhline(critical, color="0.5", lw=0.8)
        axes.grid(alpha=0.3)
        axes.set(xlabel="largest transverse displacement, cm", ylabel="mass of the flower, g")
    whole.set(title=f"I {'polar, as on the sheet' if kind == 'polar' else 'for bending'}; dashed: unstable",
              xlim=(-9.0, 9.0), ylim=(0.0, 10.2))  # fmt: skip
    near.set(title=f"Near the critical mass, {critical:.3f} g", xlim=(-4.0, 4.0),
             ylim=(0.85 * critical, 1.25 * critical))  # fmt: skip
    whole.legend(loc="lower left", fontsize="small")
    drawing.savefig(path, dpi=120)
    plt.close(drawing)


def _pieces(axes: plt.Axes, x: Array, mass: Array, stable: Array, colour: str, label: str | None) -> None:
    """A branch in pieces of one stability: solid, or dashed; the piece between two states is that of its later one."""
    begin = 0
    for k in range(1, len(x) + 1):
        if k < len(x) and stable[k] == stable[begin]:
            continue
        last = min(k + 1, len(x)) if k < len(x) else k
        axes.plot(
            x[begin:last], mass[begin:last], "-" if stable[begin] else "--", color=colour, lw=1.6 if stable[begin]
            else 1.1, label=label if begin == 0 else None,
        )  # fmt: skip
        begin = k


def explanation(found: dict[tuple[str, float], list[StemState]]) -> str:
    """What the sheet asks to remark."""
    light, heavy = found["polar", 0.005], found["polar", 0.010]
    return (
        f"With the sheet's I and 5 g there is {len(light)} equilibrium, for 5 g is below the critical mass: Newton "
        f"from theta = pi/2 + kappa_0 s finds it. With 10 g there are {len(heavy)}: one on the side of the natural "
        "curvature, stable; one on the other side, stable too; and one nearly upright, unstable, to which Newton from "
        "rest goes, for it looks for zeros of the gradient and not for minima. Nature takes the first, which the loop "
        "over the mass finds too. With the bending value of I both masses are above critical."
    )


def tip(mass: float, elements: int = 20) -> float:
    """Sideways place (cm) of the tip to which the sheet's Newton goes, kappa_0 = -1 /m, its second moment."""
    state, _ = sheet_newton(lab_stem(-1.0, "polar"), mass, elements=elements)
    if state is None:
        raise AssertionError(f"Newton from theta = pi/2 + kappa_0 s fails for {1e3 * mass:g} g")
    return 1e2 * state.tip[0]


def limit(most: float) -> float:
    """Mass (g) of the limit point, kappa_0 = -1 /m, the sheet's second moment; steps of arc length up to `most`."""
    curves = mass_deflection(lab_stem(-1.0, "polar"), (0.010,), ArcOptions(most=most))
    (mass,) = (mass for curve in curves for mass in curve.limits)
    return 1e3 * mass


def eigenvalue(kind: str) -> float:
    """Critical mass (g) by linear buckling on 20 elements of degree 3."""
    return 1e3 * float(buckling_modes(20, 3, 1).loads[0]) / lab_stem(0.0, kind).tip_load(1.0)


PROBES = {
    "critical_mass_polar": lambda: eigenvalue("polar"),
    "critical_mass_bending": lambda: eigenvalue("bending"),
    "tip_5g": lambda: tip(0.005),
    "tip_10g": lambda: tip(0.010),
    "limit_point": lambda: limit(STEPS[0]),
}


def run(out: Path) -> dict[str, Number]:
    loads, apart, modes = buckling_table()
    critical, spread = critical_table()
    table, found = equilibria_table()
    diagrams = {
        (kind, curvature): mass_deflection(lab_stem(curvature, kind), options=ArcOptions(most=STEPS[1]))
        for kind in MOMENTS
        for curvature in LAB_CURVATURES
    }
    modes_figure(out / "daisy_modes.png", modes)
    shape_figure(out / "daisy_shapes.png", found)
    for kind in MOMENTS:
        curve_figure(out / f"daisy_{kind}.png", diagrams, kind)
    straight = replace(lab_stem(0.0, "polar"), curvature=0.0)
    page.write(
        out / "daisy.md", "The daisy: the lab sheet on the buckling of a stem", "python -m tests.validation daisy",
        f"A stem of L = {straight.length:g} m, r = 2 mm, E = {straight.young:.0e} Pa, upright and weightless, with a "
        "flower of mass M at its tip; natural curvature kappa_0 (seed: TP 2.2). "
        "By `tests/validation/elastica/elastica_daisy.py`, 20 elements of degree 3. Scenes: `daisy_sheet` (the "
        "sheet's I), `daisy_5g`, `daisy_10g`, `daisy_straight` (the I of bending).",
        "## Buckling loads and modes (2.2)",
        "lambda_i = (2 i - 1)^2 pi^2 / 4 on 10, 100 and 1000 elements; error: relative, in brackets its order (P1: 2, "
        "P2: 4; empty at rounding); dolfinx: largest relative difference of its loads (SLEPc) to scikit-fem's on the "
        "same mesh. The modes are sin(sqrt(lambda_i) s); the sheet writes sin(lambda_i s).",
        loads, "![the first four modes, and errors over the number of elements](daisy_modes.png)",
        "## Critical mass", "M_c = E I pi^2 / (4 g L^2); from the smallest eigenvalue; and where the path of the "
        "upright stem bifurcates.", critical,
        "The sheet's I is the polar moment of the section, which belongs to torsion; only with it does its critical "
        "mass lie between its two masses.",
        "## Equilibria of 5 g and 10 g, kappa_0 = -1 /m (3.2)", explanation(found), table,
        "![the equilibria in space](daisy_shapes.png)",
        "## Mass against deflection (4)",
        "From 0 to 10 g in steps of 0.1 g, both sides, by arc length. kappa_0 = 0: the upright stem is stable up to "
        "the critical mass; there two branches leave, stable both (pitchfork). kappa_0 != 0 takes it apart: the branch "
        "from rest bends to the side of the natural curvature without an event; the one on the other side is stable "
        "above its limit point and unstable beside the upright. The smaller kappa_0, the nearer "
        "both come to the pitchfork. "
        "Estimate of the limit points: lambda - pi^2 / 4 = 3/2 (pi^2 / 4 K^2)^(1/3), K = kappa_0 L, of first order.",
        branch_table(diagrams),
        "![mass against deflection with the sheet's I](daisy_polar.png)",
        "![mass against deflection with the I of bending](daisy_bending.png)",
    )  # fmt: skip
    if not apart < APART:
        raise AssertionError(f"dolfinx and scikit-fem differ by {apart:.1e}")
    if not spread < CRITICAL:
        raise AssertionError(f"the critical masses differ by {spread:.1e}")
    limits = [limit(most) for most in STEPS]
    numbers = {"limit_point": Number(limits[1], abs(limits[0] - limits[1]), "g", ".5f"),
               "libraries_apart": rounding(apart, shown=".0e")}  # fmt: skip
    for kind in MOMENTS:
        exact = 1e3 * lab_stem(0.0, kind).critical_mass
        numbers[f"critical_mass_{kind}"] = Number(eigenvalue(kind), abs(eigenvalue(kind) - exact), "g", ".8f")
    for name, mass in (("tip_5g", MASSES[0]), ("tip_10g", MASSES[1])):
        numbers[name] = Number(tip(mass), abs(tip(mass) - tip(mass, 40)), "cm", "+.5f")
    return numbers
