"""Shells of Moebius bands on three meshes, each half the one before both ways: energies, orders, what is left."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import numpy as np

from ribbon import Closure, Strip, solve
from shellref import ShellOptions, ShellProblem
from shellref.path.begin import begun
from shellref.shell.result import ShellResult
from tests.validation import page
from tests.validation.number import Number

WIDTHS = {"30": 1.0 / 30.0, "10": 0.1, "5": 0.2}
RATIOS = (10.0, 25.0, 50.0, 100.0)
#: Elements along and across, each twice the ones before; grading as in shell_bands. The coarsest is none for the
#: widest band: directors stand over 60 degrees off the normals.
NARROW = ((50, 3), (100, 6), (200, 12))
MESHES = {"30": NARROW, "10": NARROW, "5": ((100, 6), (200, 12), (400, 24))}

#: The widest band of thicknesses that it stretches: w/h, meshes that are solved with the strain left free.
THICK, THICK_MESHES = (10.0, 25.0), ((60, 4), (100, 6), (200, 12))
#: Points of a surface along and across, on which stretches are measured.
POINTS = (1601, 13)


@cache
def band(name: str, ratio: float, mesh: int) -> ShellResult:
    """A free band of nu = 0.3: on the coarsest mesh by its own path, on the others from the mesh before."""
    width, elements = WIDTHS[name], MESHES[name][mesh]
    problem = ShellProblem(
        width, width / ratio, 0.3, clamp="free", half_turns=1, start_curvature=-2.0 * math.pi, elements=elements,
        grading=(1.0, 0.15),
    )  # fmt: skip
    start = None
    if mesh:
        coarser = band(name, ratio, mesh - 1)
        if coarser.status.value != "converged":
            return coarser
        start = coarser.surface
    return begun(problem, ShellOptions(), lambda event: None, start=start).result


@cache
def thick(ratio: float, mesh: int) -> ShellResult:
    """The widest band by its own path, or from the mesh before, whatever its membrane strain."""
    width = WIDTHS["5"]
    problem = ShellProblem(
        width, width / ratio, 0.3, clamp="free", half_turns=1, start_curvature=-2.0 * math.pi,
        elements=THICK_MESHES[mesh], grading=(1.0, 0.15),
    )  # fmt: skip
    start = thick(ratio, mesh - 1).surface if mesh else None
    return begun(problem, ShellOptions(max_strain=1.0), lambda event: None, start=start).result


def stretch(found: ShellResult, width: float) -> float:
    """The largest stretch of a material line along or across, by differences of its surface's points."""
    s, v = np.linspace(0.0, 1.0, POINTS[0]), 0.5 * width * np.linspace(-1.0, 1.0, POINTS[1])
    points = found.surface.grid(s, v)
    along = np.linalg.norm(np.diff(points, axis=0), axis=2) / np.diff(s)[:, None]
    across = np.linalg.norm(np.diff(points, axis=1), axis=2) / np.diff(v)
    return float(max(np.abs(along - 1.0).max(), np.abs(across - 1.0).max()))


def bent(width: float) -> float:
    """The greatest curvature (1/l) on the centreline of Wunderlich's band, across its rulings."""
    ribbon = solve(Strip(1.0, width, 0.3), closure=Closure("moebius", "straight"), segments=200, energy="wunderlich")
    assert ribbon.ok
    s = np.linspace(0.0, 1.0, 4001)
    return float((np.abs(ribbon.omega(s)) * (1.0 + ribbon.eta(s) ** 2)).max())


def too_thick(numbers: dict[str, Number]) -> str:
    """The widest band where its shell is no thin one any more: what its strains are."""
    width, curvature, rows = WIDTHS["5"], bent(WIDTHS["5"]), []
    for ratio in THICK:
        bending, before = 0.5 * curvature * width / ratio, None
        for mesh, elements in enumerate(THICK_MESHES):
            found = thick(ratio, mesh)
            cells = [found.status.value, "-", "-", "-"]
            if found.status.value == "converged":
                energy, strain = float(found.energy["elastic"]), stretch(found, width)
                cells = ["stable" if found.stable else "saddle", f"{energy:.3f}", f"{strain:.1%}",
                         f"{found.lowest_eigenvalue:.0f}"]  # fmt: skip
                if before is not None:
                    numbers[f"stretch_5_{ratio:g}"] = Number(strain, abs(strain - before), "", ".1%")
                before = strain
            rows.append([f"{ratio:g}", f"{elements[0]} x {elements[1]}", *cells, f"{bending:.1%}"])
            print(f"  {rows[-1]}", flush=True)
    return page.table(
        ["w/h", "mesh", "state", "energy", "largest stretch", "lowest eigenvalue", "h kappa / 2 of the ribbon"], rows
    )


PROBES = {
    "energy_30_25_50x3": lambda: float(band("30", 25.0, 0).energy["elastic"]),
    "energy_10_25_100x6": lambda: float(band("10", 25.0, 1).energy["elastic"]),
}


def row(name: str, ratio: float, numbers: dict[str, Number]) -> list[str]:
    """Energies on the three meshes, their order, the limit and how far the finest is from it."""
    found = [band(name, ratio, mesh) for mesh in range(3)]
    bad = next((one for one in found if one.status.value != "converged"), None)
    if bad is not None:
        known = [
            f"{one.energy['elastic']:.4f}" if one.status.value == "converged" else one.status.value for one in found
        ]
        return [f"1/{name}", f"{ratio:g}", *known, *["-"] * 4]
    energies = [float(one.energy["elastic"]) for one in found]
    first, second = energies[1] - energies[0], energies[2] - energies[1]
    order = math.log2(abs(first / second)) if second else math.inf
    even = first * second > 0.0 and order > 0.5
    limit = energies[2] + second / (2.0**order - 1.0) if even else energies[2]
    error = max(abs(limit - energies[2]), abs(second) / 3.0) if even else abs(second)
    eigenvalues = [one.lowest_eigenvalue for one in found]
    numbers[f"limit_{name}_{ratio:g}"] = Number(limit, error, "D w / l", ".3f")
    if even:
        numbers[f"order_{name}_{ratio:g}"] = Number(order, 0.0, "", ".1f")
    return [
        f"1/{name}", f"{ratio:g}", *(f"{one:.4f}" for one in energies), f"{order:.1f}" if even else "not even",
        f"{limit:.4f}", f"{error:.1e}", f"{eigenvalues[1]:.0f}, {eigenvalues[2]:.0f}",
    ]  # fmt: skip


def run(out: Path) -> dict[str, Number]:
    """results/shell_bands_mesh.md."""
    numbers: dict[str, Number] = {}
    rows = []
    for name in WIDTHS:
        for ratio in RATIOS:
            rows.append(row(name, ratio, numbers))
            print(f"  {rows[-1]}", flush=True)
    for name, value in (("energy_30_25_50x3", ("30", 0)), ("energy_10_25_100x6", ("10", 1))):
        energy = float(band(value[0], 25.0, value[1]).energy["elastic"])
        near = float(band(value[0], 25.0, value[1] + 1).energy["elastic"])
        numbers[name] = Number(energy, abs(energy - near), "D w / l", ".3f")
    heads = ["w/l", "w/h", "coarse", "middle", "fine", "order", "limit", "error", "lowest eigenvalue"]
    page.write(
        out / "shell_bands_mesh.md", "Shells of Moebius bands on three meshes",
        "python -m tests.validation shell_bands_mesh",
        "Free bands of one half turn, nu = 0.3: elastic energy in D w / l on three meshes, each half the one "
        "before both ways (50 x 3, 100 x 6, 200 x 12; of w/l = 1/5 100 x 6, 200 x 12, 400 x 24, as on 50 x 3 "
        "its directors stand over 60 degrees off the normals), graded across as in "
        "[shell_bands](shell_bands.md); the coarsest by its own path, the others begun at the one before. "
        "order: of the changes; limit: by that order (Richardson); error: how far the finest mesh is from it,"
        " at least a third of the last change. Where changes are not even, one falling and one rising or "
        "below the order 0.5, there is no order: the limit is then the finest mesh's energy, its error the "
        "last change. Lowest eigenvalue of the two finer meshes, D / (areal mass l^4). stretched: by over 5 "
        "%, beyond what the shell's law is meant for.",
        page.table(heads, rows),
        "## w/l = 1/5 at w/h = 10 and 25",
        "The same bands with no limit to the strain. largest stretch: of a material line of the surface, along or "
        "across, by differences of its points. The last column: half the thickness times the greatest curvature on the "
        "centreline of Wunderlich's band, which a developable strip as thick would bear at its faces. Where either is "
        "beyond 5 % a shell for small strains has no answer, finer meshes or not: that is what these rows are.",
        too_thick(numbers),
    )  # fmt: skip
    return numbers
