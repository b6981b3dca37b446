"""Closed shells: Moebius bands as h / w falls, beside the ribbon that is their limit; circles against closed forms."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")
from matplotlib import pyplot as plt

from compare.measure.align import aligned, both
from compare.measure.distance import grid_hausdorff
from compare.measure.energy_map import density_on_grid
from compare.models.base import Options, State
from compare.models.choice import beside_the_shell
from compare.scene.scene import Scene, loads
from compare.store.progress import Reporter
from compare.store.store import CaseStore
from compare.studies.compare import Comparison, Row, compare
from shellref import ShellOptions, ShellProblem
from shellref.path.begin import begun
from tests.reference.bent_section import stiffness
from tests.validation import page
from tests.validation.number import Number

WIDTHS = {"30": 1.0 / 30.0, "10": 0.1, "5": 0.2}
#: w/h, and the largest h/l: thicker bands stretch by over 5 %, beyond which the shell's law is not meant.
RATIOS = (10.0, 25.0, 50.0, 100.0, 200.0, 400.0)
THICK = 0.0101
#: Elements of the shells (their error: half as many each way), segments of the ribbons.
MESH, SEGMENTS = (200, 12), 200
#: Energies of a free twist, which know the thickness.
RICHER = ("finite", "extensible")
#: Energy of the inextensible Moebius band of w / l = 1 / 30, D w / l (moebius.md; Starostin & van der Heijden: 5.93).
KNOWN = 5.9301 * math.pi**2
CIRCLE = 2.0 * math.pi**2
#: Circles: elements along (nu = 0), and w/h with nu = 0.5.
ALONG, CONTRACTING = (32, 48, 64), (20.0, 50.0, 100.0, 200.0, 500.0, 1000.0)


def scene(width: float, ratios: tuple[float, ...], mesh: tuple[int, int] = MESH, energy: str = "wunderlich") -> Scene:
    """A free Moebius band, nu = 0.3."""
    return loads(
        f'title = "Moebius band"\n[strip]\nlength = 1.0\nwidth = {width!r}\npoisson = 0.3\n'
        f'[closure]\nkind = "moebius"\n'
        f'[model]\nenergy = "{energy}"\nelements = {SEGMENTS}\n'
        f"[shell]\nwidth_to_thickness = {list(ratios)}\nelements = {list(mesh)}\ngrading = [1.0, 0.15]\n"
    )


def shell_energy(width: float, ratio: float, mesh: tuple[int, int]) -> float:
    """Of a shell alone, by its own path, D w / l."""
    problem = ShellProblem(
        width, width / ratio, 0.3, clamp="free", half_turns=1, start_curvature=-2.0 * math.pi, elements=mesh,
        grading=(1.0, 0.15),
    )  # fmt: skip
    return float(begun(problem, ShellOptions(), lambda event: None).result.energy["elastic"])


@cache
def circle(poisson: float, ratio: float, mesh: tuple[int, int]) -> float:
    """Energy of a free circle of w / l = 0.1 over 2 pi^2 D w / l."""
    grading = (1.0, 1.0 if poisson == 0.0 else 0.15)
    problem = ShellProblem(0.1, 0.1 / ratio, poisson, clamp="free", half_turns=0, elements=mesh, grading=grading)
    return float(begun(problem, ShellOptions(), lambda event: None).result.energy["elastic"]) / CIRCLE


def relative(ratio: float) -> float:
    """The circle's energy with nu = 0.5 over that of the closed form."""
    return circle(0.5, ratio, (48, 8)) / stiffness(0.5, 0.1, 0.1 / ratio, 2.0 * math.pi)


#: The mesh of the probed bands, and of their errors.
PROBED = ((60, 4), (100, 6))
PROBES = {
    "circle_flat_32": lambda: circle(0.0, 1000.0, (ALONG[0], 2)) - 1.0,
    "circle_contracting_20": lambda: relative(20.0) - 1.0,
    "moebius_30_50_60x4": lambda: shell_energy(WIDTHS["30"], 50.0, PROBED[0]),
}


@dataclass(frozen=True)
class Limit:
    """What energies tend to as h -> 0, from three thicknesses each half the one before: E + c h^order."""

    value: float
    order: float


def limit(energies: tuple[float, float, float]) -> Limit:
    """Of the energies at h, h / 2 and h / 4 (Aitken)."""
    first, second = energies[1] - energies[0], energies[2] - energies[1]
    return Limit(energies[2] + second**2 / (first - second), math.log2(first / second))


def beside(comparison: Comparison, row: Row, shell: State, width: float) -> dict[str, tuple[float, float]]:
    """(energy, distance to the shell / l) of the energies of a free twist at the thickness of a row."""
    found = {}
    assert shell.shape is not None
    there = comparison.grid.of(shell.shape)
    for energy in RICHER:
        own = scene(width, (row.width_to_thickness,), energy=energy)
        state = beside_the_shell(own).solve(own, options=Options(repeats=0))
        if state.ok and state.shape is not None and state.energy is not None:
            points = aligned(comparison.grid.of(state.shape), there, both(state.motions, shell.motions))
            found[energy] = (float(state.energy.elastic), grid_hausdorff(points, there))
    return found


def concentrated(shell: State, width: float) -> float:
    """The part of the membrane energy that is within a width of the section where most of it is, over l."""
    density = density_on_grid(shell.native)[..., 1]
    surface = shell.native.surface
    ends, across = surface.s_nodes[:: surface.degree], surface.v_nodes[:: surface.degree]
    along = (density * np.diff(across)).sum(axis=1) * np.diff(ends)
    middle = 0.5 * (ends[1:] + ends[:-1])
    away = np.abs((middle - middle[np.argmax(along)] + 0.5) % 1.0 - 0.5)
    return float(along[away <= width].sum() / along.sum())


def moebius(found: dict[str, Comparison], numbers: dict[str, Number]) -> list[str]:
    """The table and the limit of each width; `numbers` are filled."""
    parts = []
    for name, width in WIDTHS.items():
        comparison = found[name]
        ribbon = comparison.fast
        assert ribbon.energy is not None
        limit_energy = float(ribbon.energy.elastic)
        error = float((ribbon.errors.get("energy") or {}).get("elastic") or 0.0)
        numbers[f"ribbon_{name}"] = Number(limit_energy, error, "D w / l", ".3f")
        rows, energies = [], {}
        for row, shell in zip(comparison.rows, comparison.shells, strict=True):
            if not shell.ok:
                why = "stretched by over 5 %" if row.status == "stretched" else row.status
                rows.append([f"{row.width_to_thickness:g}", why, *["-"] * (9 + 2 * len(RICHER))])
                continue
            assert row.energy is not None
            assert row.share is not None
            ratio, energy = row.width_to_thickness, float(row.energy.elastic)
            energies[ratio] = energy
            own = float(row.shell_errors["energy"]["elastic"])
            others = beside(comparison, row, shell, width)
            numbers[f"energy_{name}_{ratio:g}"] = Number(energy, own, "D w / l", ".3f")
            far_error = (row.shell_error or 0.0) + (row.ribbon_error or 0.0)
            numbers[f"distance_{name}_{ratio:g}"] = Number(row.hausdorff or 0.0, far_error, "l", ".2e")
            for energy_name, (value, far) in others.items():
                numbers[f"{energy_name}_{name}_{ratio:g}"] = Number(value / energy - 1.0, own / energy, "", "+.2%")
                numbers[f"{energy_name}_far_{name}_{ratio:g}"] = Number(far, row.shell_error or 0.0, "l", ".1e")
            rows.append([
                f"{ratio:g}", f"{energy:.3f}", f"{own:.1e}", f"{100.0 * (1.0 - energy / limit_energy):.2f}",
                f"{row.hausdorff:.2e}", f"{far_error:.1e}", f"{100.0 * row.share['membrane']:.2f}",
                f"{100.0 * row.share['shear']:.2f}", f"{100.0 * concentrated(shell, width):.0f}",
                "yes" if row.stable else "no", f"{shell.lowest_eigenvalue:.0f}",
                *(f"{others[e][0] / energy - 1.0:+.2%}" if e in others else "-" for e in RICHER),
                *(f"{others[e][1]:.1e}" if e in others else "-" for e in RICHER),
            ])  # fmt: skip
        thin = limit(tuple(energies[ratio] for ratio in RATIOS[-3:]))  # type: ignore[arg-type]
        before = limit(tuple(energies[ratio] for ratio in RATIOS[-4:-1]))  # type: ignore[arg-type]
        slope, apart = comparison.slope, abs(thin.value - before.value)
        numbers[f"limit_{name}"] = Number(thin.value, apart, "D w / l", ".2f")
        numbers[f"order_{name}"] = Number(thin.order, abs(thin.order - before.order), "", ".2f")
        falls = "not known" if slope is None else f"{slope.value:.2f} ({slope.spread[0]:.2f} to {slope.spread[1]:.2f})"
        parts += [
            f"## w/l = 1/{name}",
            f"Ribbon (Wunderlich, {SEGMENTS} segments): {limit_energy:.3f} D w / l, error {error:.0e}. Shells of three "
            f"thicknesses, each half the one before, tend to {thin.value:.2f} (error {apart:.1e}) with the order "
            f"{thin.order:.2f} of h (w/h = 100 to 400; 50 to 200: {before.value:.2f}, {before.order:.2f}). Slope of "
            f"the distance against h/w in log-log: {falls}.",
            page.table(
                ["w/h", "energy", "its error", "below the ribbon %", "distance", "its error", "membrane %", "shear %",
                 "within w %", "stable", "lowest eigenvalue", *(f"{e}'s energy" for e in RICHER),
                 *(f"{e} far" for e in RICHER)],
                rows,
            ),
        ]  # fmt: skip
    return parts


def circles(numbers: dict[str, Number]) -> list[str]:
    """Circles bent from flat."""
    errors = {n: circle(0.0, 1000.0, (n, 2)) - 1.0 for n in ALONG}
    for n, error in errors.items():
        numbers[f"circle_flat_{n}"] = Number(error, 1e-8, "", ".1e")
    rows = []
    for ratio in CONTRACTING:
        expected = stiffness(0.5, 0.1, 0.1 / ratio, 2.0 * math.pi)
        value, mesh = relative(ratio) - 1.0, circle(0.5, ratio, (24, 4)) / circle(0.5, ratio, (48, 8)) - 1.0
        numbers[f"circle_contracting_{ratio:g}"] = Number(value, abs(mesh), "", ".1e")
        x = (3.0 * 0.75) ** 0.25 * math.sqrt(2.0 * math.pi * 0.1 * ratio)
        rows.append([f"{ratio:g}", f"{x:.2f}", f"{expected:.5f}", f"{expected + expected * value:.5f}", f"{value:+.1e}",
                     f"{mesh:+.0e}"])  # fmt: skip
    return [
        "## Circles",
        "Bent from flat and joined, w/l = 0.1, nothing holds them. nu = 0, w/h = 1000, two elements across: energy "
        "over 2 pi^2 D w / l, less one: "
        + ", ".join(f"{error:.1e} ({n} elements)" for n, error in errors.items())
        + ".",
        "nu = 0.5: energy over 2 pi^2 D w / l, against the closed form of a section whose edges curl "
        "(tests/reference/bent_section.py; between 1 - nu^2 of a beam and 1 of a plate). What is left falls with the "
        "thickness: shear and stretch that the closed form leaves out. mesh: change from half as many elements.",
        page.table(["w/h", "x", "closed form", "shell", "shell over it - 1", "mesh"], rows),
    ]


def figure(path: Path, found: dict[str, Comparison]) -> None:
    """Energy below the ribbon's, and distance, against h / w."""
    drawn, axes = plt.subplots(1, 2, figsize=(10.0, 4.2), layout="constrained")
    for name, comparison in found.items():
        assert comparison.fast.energy is not None
        whole = float(comparison.fast.energy.elastic)
        rows = [row for row in comparison.rows if row.hausdorff is not None and row.energy is not None]
        thin = [1.0 / row.width_to_thickness for row in rows]
        below = [1.0 - float(row.energy.elastic) / whole for row in rows if row.energy is not None]
        axes[0].loglog(thin, below, "o-", label=f"w/l = 1/{name}")
        axes[1].loglog(thin, [row.hausdorff for row in rows], "o-")
    axes[0].set_ylabel("energy below the ribbon's, part of it")
    axes[1].set_ylabel("distance to the ribbon, l")
    axes[0].legend()
    for one in axes:
        one.set_xlabel("h / w")
        one.grid(True, which="both", lw=0.3)
    drawn.savefig(path, dpi=110)
    plt.close(drawn)


def run(out: Path) -> dict[str, Number]:
    """results/shell_bands.md and .png."""
    store = CaseStore(out.parent / "out" / "validate" / "shell_bands" / "cases")
    numbers: dict[str, Number] = {}
    found = {}
    for name, width in WIDTHS.items():
        ratios = tuple(ratio for ratio in RATIOS if width / ratio <= THICK)
        found[name] = compare(scene(width, ratios), store, Reporter(quiet=True), bare=True)
        print(f"  w/l = 1/{name}: {[row.status for row in found[name].rows]}", flush=True)
    probed = [shell_energy(WIDTHS["30"], 50.0, mesh) for mesh in PROBED]
    numbers["moebius_30_50_60x4"] = Number(probed[0], abs(probed[1] - probed[0]), "D w / l", ".2f")
    tables = moebius(found, numbers)
    rounds = circles(numbers)
    figure(out / "shell_bands.png", found)
    page.write(
        out / "shell_bands.md", "Closed shells: Moebius bands and circles", "python -m tests.validation shell_bands",
        f"Free Moebius bands, nu = 0.3, shells of {MESH[0]} x {MESH[1]} elements joined node to node, begun at the "
        "ribbon's surface; energies in D w / l, lengths in l, eigenvalues in D / (areal mass l^4), without rigid "
        "motions and sliding. Errors: change from half as many elements each way; of the distance, that of both "
        "models. within w: part of the membrane energy within one width of the section where most of it is. Distances: "
        "after the rigid motion and the sliding along itself that bring both closest. The last columns: energies of a "
        f"free twist beside the shell, and their distance to it. Known: {KNOWN:.4f} D w / l (5.9301 pi^2) at w/l = "
        "1/30.",
        *tables, "![Energy and distance against h/w](shell_bands.png)", *rounds,
    )  # fmt: skip
    return numbers
