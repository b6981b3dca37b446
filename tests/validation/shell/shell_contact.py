"""Shells on round bodies and on themselves: the coil in a tube, a strip on a bar, the fold whose sides meet, in its
plane and askew, beside shooting, the elastica and the ribbon."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from compare import registry
from compare.models import solve as solve_scene
from compare.models.base import Options, State
from compare.scene.scene import loads
from ribbon import Clamp, Gravity, Strip
from ribbon import solve as solve_ribbon
from ribbon.obstacle import Obstacle as RibbonObstacle
from shellref import ShellOptions, ShellProblem
from shellref.contact.obstacles import Obstacle
from shellref.path.solve import solve
from shellref.shell.problem import IDENTITY, Pose, Waypoint
from shellref.shell.result import ShellResult
from tests.reference.touching_fold import Fold, folds
from tests.validation import page
from tests.validation.number import Number
from tests.validation.ribbon.obstacles import HELD, shot

TUBE, BAR_MESHES, FOLD_MESHES = (60, 120, 240), (20, 40, 80), (20, 40, 80)
#: Distances of the fold's clamps, and what its sides keep.
FOLDS = ((0.15, 0.02), (0.12, 0.02), (0.15, 0.0), (0.12, 0.0))
#: One element across bends to a cylinder.
NARROW = ShellOptions(stabilisation=0.03)
BAR = (0.0, -0.25, 0.6), 0.1, (1.0, 0.0, 0.0)
UP = (0.0, 1.0, 0.0)
#: The fold with its clamps 0.02 of the length beside each other, w/h = 100; meshes of the shell.
ASKEW = """
[strip]
length = 1.0
width = 0.05
poisson = 0.3
thickness = 0.02
[contact]
itself = true
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [0.0, 0.0, 1.0]
normal = [0.0, 1.0, 0.0]
[clamp.end]
position = [0.02, 0.0, 0.16]
tangent = [0.0, 0.0, 1.0]
normal = [0.0, 1.0, 0.0]
[seed]
curvature = [3.0, -3.0, 3.0]
[model]
energy = "wunderlich"
elements = 40
[[path]]
"clamp.end.position" = [0.02, 0.0, 0.6]
[shell]
width_to_thickness = [100]
"""
ASKEW_MESHES = ((30, 2), (60, 4))


@cache
def coiled(elements: int) -> ShellResult:
    """A strip that begins clamped on the wall of a tube and along it; finer meshes begin at the coarsest state."""
    radius = 1.0 / (HELD + shot()[2])
    frame = ((-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, -1.0))
    tube = Obstacle("cylinder", (0.0, 0.0, 0.0), radius, (1.0, 0.0, 0.0), inside=True)
    problem = ShellProblem(
        0.02, 2e-4, 0.0, clamp_position=(0.0, -radius, 0.0), clamp_frame=frame, elements=(elements, 1),
        grading=(1.0, 1.0), start_curvature=-1.02 / radius, obstacles=(tube,),
    )  # fmt: skip
    return solve(problem, NARROW, start=None if elements == TUBE[0] else coiled(TUBE[0]).surface)


def touchdown(found: ShellResult) -> float:
    """The angle (degrees) at which the end meets the wall."""
    place, tangent = found.surface.centreline(np.array(1.0)), found.surface.frames(np.array(1.0))[:, 2]
    outwards = place / np.linalg.norm(place)
    along = np.cross([1.0, 0.0, 0.0], outwards)
    return float(np.degrees(np.arctan2(abs(tangent @ outwards), abs(tangent @ along))))


@cache
def barred(elements: int) -> ShellResult:
    """A heavy cantilever on a bar across, nu = 0."""
    point, radius, axis = BAR
    problem = ShellProblem(
        0.1, 1e-3, 0.0, gamma=20.0, up=UP, elements=(elements, 2), grading=(0.5, 1.0),
        obstacles=(Obstacle("cylinder", point, radius, axis),),
    )  # fmt: skip
    return solve(problem)


@cache
def ribbon_barred() -> tuple[np.ndarray, float]:
    """Force and energy of the ribbon on it."""
    point, radius, axis = BAR
    walls = [RibbonObstacle("cylinder", point, radius, axis)]
    found = solve_ribbon(Strip(1.0, 0.1, 0.0, gamma=20.0), Clamp(), Gravity(UP), walls=walls, segments=120)
    return found.walls[0].force, found.energy.total


@cache
def folded(distance: float, apart: float, elements: int) -> ShellResult:
    """The fold between two clamps on one line, nu = 0."""

    def end(z: float) -> Pose:
        return Pose((0.0, 0.0, z), IDENTITY)

    way = (Waypoint(natural=1.0, name="natural"), Waypoint(end=end(0.5)), Waypoint(end=end(0.25)))
    problem = ShellProblem(
        0.02, 2e-4, 0.0, elements=(elements, 1), grading=(1.0, 1.0), end=end(distance), start_curvature=2.0, path=way,
        apart=apart,
    )  # fmt: skip
    return solve(problem, replace(NARROW, arc_length="never"))


def push(found: ShellResult) -> float:
    """Of one part on the other."""
    return float(np.linalg.norm(sum(pair["force"] for pair in found.pairs)))


@cache
def known(distance: float, apart: float) -> Fold:
    """The fold by shooting."""
    return folds(np.array([0.15, distance]), apart)[-1]


def fold_off(distance: float, apart: float, elements: int) -> tuple[float, float]:
    """Relative errors of push and energy."""
    exact, found = known(distance, apart), folded(distance, apart, elements)
    return push(found) / exact.push - 1.0, found.energy["total"] / exact.energy - 1.0


@cache
def askew() -> tuple[State, tuple[State, ...]]:
    """The ribbon and the shells of the fold askew, begun at its surface."""
    scene = loads(ASKEW, "askew")
    line = solve_scene(scene)
    shell: Any = registry.model("shell")
    found = [
        shell.solve(scene.replace({"shell.elements": list(mesh)}), near=line.shape, options=Options(error=False))
        for mesh in ASKEW_MESHES
    ]
    return line, tuple(found)


PROBES = {
    "touchdown": lambda: touchdown(coiled(TUBE[0])),
    "bar_20": lambda: float(barred(BAR_MESHES[0]).walls[0]["force"][1]),
    "fold_20": lambda: push(folded(*FOLDS[0], FOLD_MESHES[0])),
}


def _tube(numbers: dict[str, Number]) -> list[str]:
    exact, rows = shot()[0], []
    for n in TUBE:
        found = coiled(n)
        rows.append([f"{n}", f"{touchdown(found):.4f}", f"{touchdown(found) - exact:.1e}",
                     f"{len(found.walls[0]['contacts'])}", f"{found.contact['penetration']:.0e}", str(found.stable)])  # type: ignore[index]  # fmt: skip
    for name, n in (("touchdown", TUBE[0]), ("touchdown_fine", TUBE[-1])):
        value = touchdown(coiled(n))
        numbers[name] = Number(value, abs(value - exact) + 1e-4, "degrees", ".4f")
    numbers["touchdown_shot"] = Number(exact, 1e-4, "degrees", ".4f")
    return [
        "## The coil in a tube",
        f"As [round obstacles](obstacles.md) has it: nu = 0, w/l = 0.02, one element across. By shooting the end meets "
        f"the wall at {exact:.4f} degrees. The coarsest mesh walks its own path, the others begin at its state.",
        page.table(["elements", "touchdown", "off shooting", "places", "penetration / l", "stable"], rows),
    ]


def _bar(numbers: dict[str, Number]) -> list[str]:
    (force, energy), rows = ribbon_barred(), []
    for n in BAR_MESHES:
        found = barred(n)
        own, left = found.walls[0]["force"], found.clamps["start"]["force"] - 20.0 * np.array(UP)
        rows.append([f"{n} x 2", f"{own[1]:.4f}", f"{own[2]:.4f}", f"{found.energy['total']:.6f}",
                     f"{np.abs(left + own).max():.0e}", f"{found.contact['penetration']:.0e}"])  # type: ignore[index]  # fmt: skip
    rows.append(["ribbon", f"{force[1]:.4f}", f"{force[2]:.4f}", f"{energy:.6f}", "", ""])
    values = [float(barred(n).walls[0]["force"][1]) for n in BAR_MESHES]
    numbers["bar_20"] = Number(values[0], abs(values[0] - force[1]), "D w / l^2", ".4f")
    numbers["bar_80"] = Number(values[-1], abs(values[-1] - force[1]), "D w / l^2", ".4f")
    numbers["bar_ribbon"] = Number(float(force[1]), 1e-3, "D w / l^2", ".4f")
    return [
        "## A heavy strip on a bar",
        "Gamma = 20, w/l = 0.1, w/h = 100, nu = 0; a bar of radius 0.1 across, 0.25 below the clamp, 0.6 before. "
        "The ribbon (120 segments) touches at a place that slides, the shell at nodes: its "
        "force changes with where these are.",
        page.table(["model", "force y", "force z", "energy", "balance", "penetration / l"], rows),
    ]


def _folds(numbers: dict[str, Number]) -> list[str]:
    rows, worst = [], 0.0
    for distance, apart in FOLDS:
        offs = [fold_off(distance, apart, n) for n in FOLD_MESHES]
        worst, found = max(worst, abs(offs[-1][0])), folded(distance, apart, FOLD_MESHES[-1])
        shot_push = f"{known(distance, apart).push:.4f}"
        rows.append([f"{distance}", f"{apart}", shot_push, *(f"{off[0]:.1e}" for off in offs),
                     *(f"{off[1]:.0e}" for off in offs), f"{found.contact['penetration']:.0e}"])  # type: ignore[index]  # fmt: skip
    value = push(folded(*FOLDS[0], FOLD_MESHES[0]))
    numbers["fold_20"] = Number(value, abs(value - known(*FOLDS[0]).push), "D w / l^2", ".3f")
    numbers["fold_worst"] = Number(worst, 0.5 * worst, "", ".1e")
    numbers["fold_energy"] = Number(max(abs(fold_off(d, a, FOLD_MESHES[-1])[1]) for d, a in FOLDS), 1e-4, "", ".0e")
    heads = ["clamps", "apart", "push", *(f"push off, {n}" for n in FOLD_MESHES),
             *(f"energy off, {n}" for n in FOLD_MESHES), "penetration / l"]  # fmt: skip
    return [
        "## A fold whose sides meet",
        "As [the planar elastica in contact](self_contact_planar.md) has it, nu = 0, w/l = 0.02, w/h = 100, on 20, 40 "
        "and 80 elements along: push of one side on the other and energy beside shooting.",
        page.table(heads, rows),
    ]


def _askew(numbers: dict[str, Number]) -> list[str]:
    line, shells = askew()

    def row(name: str, state: State) -> list[str]:
        force, held = state.supports.itself, state.supports.end
        assert force is not None
        assert held is not None
        count = len(state.native.data["pairs"]) if state.model == "shell" else len(state.native.pairs)
        return [name, *(f"{x:.3f}" for x in force), f"{count}", f"{held.force[2]:.3f}", f"{state.energy.elastic:.4f}"]  # type: ignore[union-attr]

    rows = [row("ribbon, wunderlich, 40 segments", line)]
    rows += [row(f"shell, {a} x {b}", state) for (a, b), state in zip(ASKEW_MESHES, shells, strict=True)]
    sizes = [float(state.supports.itself[2]) for state in (line, *shells)]  # type: ignore[index]
    numbers["askew_ribbon"] = Number(sizes[0], 0.4, "D w / l^2", ".3f")
    numbers["askew_shell"] = Number(sizes[-1], abs(sizes[-1] - sizes[-2]) + 1e-3, "D w / l^2", ".3f")
    return [
        "## The fold askew: ribbon and shell",
        "Clamps 0.16 of the length apart and 0.02 beside each other, sides kept 0.02 apart, w/l = 0.05, w/h = 100, "
        "nu = 0.3: the sides meet obliquely. What the parts at larger s exert on the others, and the clamp at the end:",
        page.table(["model", "force x", "force y", "force z", "pairs", "clamp, force z", "elastic"], rows),
    ]


def run(out: Path) -> dict[str, Number]:
    """results/shell_contact.md."""
    numbers: dict[str, Number] = {}
    parts = [*_tube(numbers), *_bar(numbers), *_folds(numbers), *_askew(numbers)]
    page.write(
        out / "shell_contact.md", "Shells on round bodies and on themselves",
        "python -m tests.validation shell_contact",
        "Exact unilateral conditions at nodes ([theory](../docs/theory.md), (7.26) to (7.31)): places of contact are "
        "nodes, and forces change with where these are by half an element. Forces in D w / l^2, energies in D w / l, "
        "lengths in l.",
        *parts,
    )  # fmt: skip
    return numbers
