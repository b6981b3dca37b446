"""Shells on walls: a ring between plates beside the elastica, faces and middle surface, a table, Roman's strip."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from compare.models.shell_build import shell_options, shell_problem
from compare.scene.scene import load
from shellref import ShellOptions, ShellProblem
from shellref.contact.walls import Wall
from shellref.path.begin import begun
from shellref.path.solve import solve
from shellref.shell.result import ShellResult
from tests.reference.squeezed_ring import Squeezed, spreads, squeezed
from tests.test_setup import ROOT
from tests.validation import page
from tests.validation.number import Number

#: Gaps of the plates over l (the circle is 0.3183 high, from 0.2285 on it is flat on them), elements along.
GAPS, ALONG = (0.28, 0.24, 0.2, 0.15), (20, 40, 80)
#: t_x = -e_x, t_y = e_z, t_z = e_y: held at one side, where its tangent is upright.
UPRIGHT = ((-1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0))
THICKNESS = 5e-4
#: Roman's strip (roman_6_2): w/h with nu = 0 and its meshes, and the roof's force on the elastica, D w / l^2.
RATIOS, MESHES, ELASTICA = (100.0, 400.0), ((30, 2), (60, 2)), 70.2723


@cache
def ring(gap: float, along: int, thickness: float = THICKNESS, contact: str = "midsurface") -> ShellResult:
    """A circle, nu = 0, w / l = 0.1, between plates whose middle is where it is held."""
    walls = (
        Wall((0.0, -0.5 * gap, 0.0), (0.0, 1.0, 0.0)),
        Wall((0.0, 0.5 * gap, 0.0), (0.0, -1.0, 0.0)),
    )
    problem = ShellProblem(
        0.1, thickness, 0.0, clamp_frame=UPRIGHT, half_turns=0, start_curvature=-2.0 * math.pi, elements=(along, 2),
        grading=(1.0, 1.0), walls=walls, contact=contact,
    )  # fmt: skip
    return solve(problem)


@cache
def exact(gap: float) -> Squeezed:
    """The elastica between the same plates."""
    return squeezed(gap)


def name(gap: float) -> str:
    """Of a gap in names of numbers: hundredths of l."""
    return f"{100.0 * gap:.0f}"


def force_off(gap: float, along: int) -> float:
    """Relative error of the upper plate's force."""
    return -float(ring(gap, along).walls[1]["force"][1]) / exact(gap).force - 1.0


def energy_off(gap: float, along: int) -> float:
    """Relative error of the energy."""
    return float(ring(gap, along).energy["total"]) / exact(gap).energy - 1.0


def roman(ratio: float, mesh: tuple[int, int]) -> ShellResult:
    """Roman's strip at H = 0.185, nu = 0, by the shell's own path."""
    change = {"strip.poisson": 0.0, "shell.width_to_thickness": [ratio], "shell.elements": list(mesh),
              "shell.grading": [1.0, 1.0]}  # fmt: skip
    scene = load(ROOT / "compare" / "scenes" / "roman_6_2.toml").replace(change)
    return begun(shell_problem(scene, ratio), shell_options(scene), lambda event: None).result


def table(**keys: Any) -> ShellResult:
    """A free strip, Gamma = 20, on a table."""
    strip = {"width": 0.1, "thickness": 2e-3, "poisson": 0.3, "gamma": 20.0, "up": (0.0, 1.0, 0.0), "clamp": "free",
             "elements": (20, 2), "walls": (Wall((0.0, 0.0, 0.0), (0.0, 1.0, 0.0)),)}  # fmt: skip
    return solve(ShellProblem(**{**strip, **keys}), ShellOptions())


PROBES = {
    "force_28_40": lambda: force_off(0.28, 40),
    "energy_20_40": lambda: energy_off(0.2, 40),
    "table_pressure": lambda: pressure(table()),
}


def pressure(result: ShellResult) -> float:
    """The pressure, D / l^3, that differs most from the strip's weight per area, 20."""
    each = np.asarray(result.walls[0]["pressure"])
    return float(each[np.argmax(np.abs(each - 20.0))])


def rings(numbers: dict[str, Number]) -> list[str]:
    """The ring on three meshes."""
    rows = []
    for gap in GAPS:
        known = exact(gap)
        for along in ALONG:
            found = ring(gap, along)
            touch = found.contact or {}
            change = abs(force_off(gap, along) - force_off(gap, ALONG[-2 if along == ALONG[-1] else -1]))
            numbers[f"force_{name(gap)}_{along}"] = Number(force_off(gap, along), 1e-7, "", ".1e")
            numbers[f"energy_{name(gap)}_{along}"] = Number(energy_off(gap, along), 1e-7, "", ".1e")
            ends = np.ravel(found.walls[1]["lines"])
            flat = 0.5 * float(ends.max() - ends.min())
            rows.append([
                f"{gap:g}", str(along), f"{known.force:.4f}", f"{force_off(gap, along):+.1e}", f"{change:.0e}",
                f"{known.energy:.4f}", f"{energy_off(gap, along):+.1e}", f"{known.flat:.4f}", f"{flat:.4f}",
                "yes" if found.stable else "no", f"{touch['through']:.0e}", f"{touch['penetration']:.1e}",
                str(touch["weakly"]), str(found.newton_iterations),
            ])  # fmt: skip
    orders = {gap: [abs(energy_off(gap, a) - energy_off(gap, ALONG[-1])) for a in ALONG[:2]] for gap in GAPS}
    said = ", ".join(f"{math.log2(a / b):.1f} (H = {gap:g})" for gap, (a, b) in orders.items() if a and b)
    force, gap = spreads()
    return [
        "## A ring between plates",
        f"nu = 0, w/l = 0.1, h/l = {THICKNESS:g}, two elements across, held where its tangent is upright (the clamp "
        f"carries nothing). The elastica by shooting (tests/reference/squeezed_ring.py): from H = {gap:.4f}, P "
        f"= {force:.3f} "
        "D w / l^2, on it is flat on the plates along 2 a. Relative errors of force and energy, change of the force to "
        "the finest mesh (of that, to the one before), deepest node and deepest point behind a plate (l), places that "
        "touch and hardly push.",
        page.table(
            ["H", "elements", "force", "shell's off by", "change", "energy", "shell's off by", "a", "shell's a",
             "stable", "nodes through", "penetration", "weakly", "Newton"],
            rows,
        ),
        f"Order of the energy, from 20 and 40 elements to 80: {said}. The place where contact begins falls between "
        "nodes, which is an error of first order in it and of second in what it carries.",
    ]  # fmt: skip


def faces(numbers: dict[str, Number]) -> list[str]:
    """The ring with both faces."""
    rows = []
    for gap in (0.28, 0.2):
        ours = -float(ring(gap, 40, 1e-3, "faces").walls[1]["force"][1])
        nearer, same = (-float(ring(x, 40, 1e-3).walls[1]["force"][1]) for x in (gap - 1e-3, gap))
        numbers[f"faces_{name(gap)}"] = Number(ours / nearer - 1.0, 1e-7, "", ".1e")
        slope = (exact(gap - 1e-3).force / exact(gap).force) - 1.0
        rows.append([f"{gap:g}", f"{ours:.4f}", f"{nearer:.4f}", f"{ours / nearer - 1.0:+.1e}",
                     f"{ours / same - 1.0:+.2%}", f"{slope:+.2%}"])  # fmt: skip
    return [
        "## Faces and middle surface",
        "The same ring, h/l = 1e-3, whose faces meet plates H apart, beside one whose middle surface meets "
        "plates H - h "
        "apart; over the middle surface between plates H apart, and what the elastica says of that.",
        page.table(["H", "faces", "middle surface, H - h", "apart", "over middle surface, H", "elastica"], rows),
    ]


def tables(numbers: dict[str, Number]) -> list[str]:
    """Strips on a table, and a plate on a spring."""
    flat, thick = table(), table(contact="faces")
    numbers["table_pressure"] = Number(pressure(flat), 1e-6, "D / l^3", ".6f")
    spring = table(walls=(Wall((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 50.0),))
    rows = []
    cases = (("flat", flat), ("flat, faces", thick), ("on a plate, k = 50", spring),
             ("curled down, K = 1", table(natural_curvature=(1.0, 1.0))),
             ("curled up, K = -1", table(natural_curvature=(-1.0, -1.0))))  # fmt: skip
    for label, result in cases:
        (wall,) = result.walls
        y = result.surface.points[..., 1]
        rows.append([label, f"{wall['force'][1]:.9f}", str(len(wall["points"])), f"{wall['pressure'].min():.4g}",
                     f"{wall['pressure'].max():.4g}", f"{y.min():.4g}", f"{y.max():.4g}",
                     "yes" if result.stable else "no", f"{result.lowest_eigenvalue:.4g}"])  # fmt: skip
    return [
        "## A strip on a table",
        "Nothing holds it but the table: three motions are taken out. Gamma = 20, w/l = 0.1, w/h = 50, nu = "
        "0.3, 20 x 2 "
        "elements; the table's force (20), places that it pushes, least and largest pressure (D / l^3; of the flat "
        "strip the weight per area, 20, everywhere; the curled ones stand on their ends and on their middle), "
        "lowest and "
        "highest point.",
        page.table(
            ["strip", "force", "places", "least pressure", "largest", "lowest", "highest", "stable", "eigenvalue"], rows
        ),
    ]


def romans(numbers: dict[str, Number]) -> list[str]:
    """Roman's strip beside the elastica."""
    rows = []
    for ratio in RATIOS:
        found = [roman(ratio, mesh) for mesh in MESHES]
        forces = [-float(one.walls[1]["force"][1]) for one in found]
        numbers[f"roman_{ratio:g}"] = Number(forces[-1], abs(forces[-1] - forces[0]), "D w / l^2", ".3f")
        for mesh, one, force in zip(MESHES, found, forces, strict=True):
            rows.append([f"{ratio:g}", f"{mesh[0]} x {mesh[1]}", f"{force:.4f}", f"{force / ELASTICA - 1.0:+.2%}",
                         f"{float(one.walls[0]['force'][1]):.3g}", "yes" if one.stable else "no"])  # fmt: skip
    return [
        "## Roman's strip",
        f"roman_6_2 with nu = 0: force of the roof at H = 0.185, by the shell's own path (a planar arc, clamps, "
        f"weight, "
        f"then the roof comes down), beside that of Roman's elastica with weight, {ELASTICA} D w / l^2 "
        "([roman](roman.md)).",
        page.table(["w/h", "elements", "roof", "off by", "floor", "stable"], rows),
    ]


def run(out: Path) -> dict[str, Number]:
    """results/shell_walls.md."""
    numbers: dict[str, Number] = {}
    parts = [*rings(numbers), *faces(numbers), *tables(numbers), *romans(numbers)]
    page.write(
        out / "shell_walls.md", "Shells on walls", "python -m tests.validation shell_walls",
        "Contact without friction by an active set: no penalty is in the answer ([theory](../docs/theory.md), (7.26), "
        "(7.27)). Forces in D w / l^2, energies in D w / l, lengths in l.",
        *parts,
    )  # fmt: skip
    return numbers
