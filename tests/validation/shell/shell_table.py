"""A Moebius band on a table by the shell, on its edge and fallen (thesis, 6.2.1, figure 6.9), beside the ribbon."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from compare.measure.distance import grid_hausdorff
from compare.models.ribbon.state import RibbonShape
from compare.models.shell import starting_surface
from compare.models.shell_build import shell_options, shell_problem
from compare.scene.scene import Scene, load
from ribbon import Equilibrium
from shellref.path.begin import Beginning
from shellref.shell.result import ShellResult
from shellref.shell.surface import ShellSurface
from tests.validation import page
from tests.validation.number import Number
from tests.validation.ribbon import moebius_table

#: w/h of the shells (a thicker band of w/l = 0.01 stretches so much that it lies elsewhere on its table), their meshes,
#: and the ribbon's segments.
RATIO, MESHES, SEGMENTS = 400.0, ((60, 4), (100, 6)), 200
STATES = tuple(moebius_table.SCENES)
#: A finer mesh of the fallen band, begun at the shell of the last of `MESHES`; parts of an element by which a band is
#: slid along itself before it settles again.
FINEST, PARTS = (160, 8), (-0.25, -0.125, -0.05, 0.0, 0.125, 0.25, 0.375, 0.5)
#: Places whose abscissae are closer are one foot, l; points of the surfaces for distances.
FOOT, POINTS = 0.05, (401, 5)


def scene_of(state: str) -> Scene:
    """The shipped scene with one shell on equal elements."""
    change = {"shell.width_to_thickness": [RATIO], "shell.grading": [1.0, 1.0]}
    return load(moebius_table.SCENES[state]).replace(change)


@cache
def ribbon(state: str, segments: int = SEGMENTS) -> Equilibrium:
    """The ribbon on so many segments."""
    return moebius_table.placed(scene_of(state), segments)


@cache
def shell(state: str, mesh: tuple[int, int]) -> ShellResult:
    """The shell that begins at the ribbon's surface and comes to rest on the table."""
    scene = scene_of(state)
    problem, options = shell_problem(scene, RATIO, mesh), replace(shell_options(scene), begin="given")
    start = starting_surface(RibbonShape(ribbon(state, 100)), problem)
    found = Beginning(problem, options, lambda event: None, None, "self").given(start)[0]
    if found is None:
        raise AssertionError(f"{state}, {mesh}: no equilibrium near the ribbon's")
    return found


def begun_at(state: str, mesh: tuple[int, int], start: ShellSurface) -> ShellResult:
    """The shell that settles at a shell's surface."""
    scene = scene_of(state)
    problem, options = shell_problem(scene, RATIO, mesh), replace(shell_options(scene), begin="given")
    found = Beginning(problem, options, lambda event: None, None, "self").solve(start)
    if not found.walls or found.status.value != "converged":
        raise AssertionError(f"{state}, {mesh}: {found.message}")
    return found


def slid(surface: ShellSurface, by: float) -> ShellSurface:
    """A Moebius band whose abscissae have moved on by `by` (l, less than 1): behind the seam it is turned over."""
    s, v = surface.s_nodes, surface.v_nodes
    points, directors = np.empty_like(surface.points), np.empty_like(surface.directors)
    for row, at in enumerate((s + by) % 1.0):
        side = 1.0 if 0.0 <= s[row] + by <= 1.0 else -1.0
        at = 1.0 if s[row] + by == 1.0 else at
        points[row] = surface.grid(np.array([at]), side * v)[0]
        directors[row] = side * surface.director(np.array([[at]]), side * v[None, :])[0]
    return ShellSurface(s, v, points, directors, surface.degree)


@cache
def moved(part: float) -> ShellResult:
    """The fallen band on the coarser mesh, begun where it lay, slid along itself by a part of an element."""
    return begun_at("fallen", MESHES[0], slid(shell("fallen", MESHES[0]).surface, part / MESHES[0][0]))


@dataclass(frozen=True)
class Foot:
    """Where the table pushes: mean abscissa (l), and the part of the weight that it carries there."""

    s: float
    share: float


def feet(s: np.ndarray, pushes: np.ndarray) -> list[Foot]:
    """The feet of pushes (k,) at abscissae (k,), in order."""
    order = np.argsort(s)
    s, pushes = s[order], pushes[order]
    parts = np.split(np.arange(len(s)), np.flatnonzero(np.diff(s) > FOOT) + 1)
    total = pushes.sum()
    return [Foot(float(s[p] @ pushes[p] / pushes[p].sum()), float(pushes[p].sum() / total)) for p in parts]


def shell_feet(found: ShellResult) -> list[Foot]:
    """Of a shell."""
    wall = found.walls[0]
    return feet(np.asarray(wall["contacts"])[:, 0], np.asarray(wall["pushes"]))


def ribbon_feet(found: Equilibrium) -> list[Foot]:
    """Of a ribbon, by its multipliers."""
    _, pushes, s = moebius_table.pushes(found)
    return feet(s, pushes)


def left(state: str, found: ShellResult) -> tuple[float, float]:
    """Of weight and table: the force that is left over (D w / l^2), and the moment of the pushes about the centre of
    mass of the surface (D w / l)."""
    scene, (wall,) = scene_of(state), found.walls
    s, along = np.polynomial.legendre.leggauss(400)
    v, across = np.polynomial.legendre.leggauss(4)
    points = found.surface.grid(0.5 * (s + 1.0), 0.5 * scene.width * v)
    centre = np.einsum("k,m,kmi->i", 0.5 * along, 0.5 * across, points)
    up, weight = scene.up, scene.gamma
    assert up is not None
    force = float(np.linalg.norm(wall["force"] - weight * up))
    return force, float(np.linalg.norm(np.cross(wall["points"] - centre, wall["pushes"][:, None] * up).sum(axis=0)))


def total(state: str, found: ShellResult) -> float:
    """Energy, D w / l, heights counted from the table."""
    scene = scene_of(state)
    assert scene.up is not None
    return float(found.energy["total"]) - scene.gamma * float(scene.wall_points[0] @ scene.up)


def ribbon_total(state: str, found: Equilibrium) -> float:
    """Of the ribbon, as `total`."""
    scene = scene_of(state)
    assert scene.up is not None
    return found.energy.total - scene.gamma * float(scene.wall_points[0] @ scene.up)


PROBES = {
    "lift_fallen": lambda: float(np.linalg.norm(shell("fallen", MESHES[0]).walls[0]["force"])),
    "share_fallen_60": lambda: shell_feet(shell("fallen", MESHES[0]))[0].share,
    "total_edge_60": lambda: total("on edge", shell("on edge", MESHES[0])),
}


def _cells(told: list[Foot]) -> str:
    return ", ".join(f"{foot.s:.4f} ({foot.share:.3f})" for foot in told)


def _with(number: Number) -> str:
    """A number and its error."""
    return f"{number} +- {number.error:.1g}"


def _rows(state: str) -> list[list[str]]:
    """The ribbon's line, then the shells'."""
    line = ribbon(state)
    s, v = np.linspace(0.0, 1.0, POINTS[0]), 0.5 * scene_of(state).width * np.linspace(-1.0, 1.0, POINTS[1])
    shape = RibbonShape(line).points(s, v)
    force, moment = moebius_table.unbalanced(line)
    found = [[
        state, f"ribbon, {SEGMENTS}", "yes", f"{line.energy.elastic:.3f}", f"{ribbon_total(state, line):.3f}",
        f"{force:.0e}", f"{moment:.0e}", "", _cells(ribbon_feet(line)), "", "",
    ]]  # fmt: skip
    for mesh in MESHES:
        one = shell(state, mesh)
        force, moment = left(state, one)
        found.append([
            state, f"shell, {mesh[0]} x {mesh[1]}", "yes" if one.stable else "no", f"{one.energy['elastic']:.3f}",
            f"{total(state, one):.3f}", f"{force:.0e}", f"{moment:.0e}", f"{one.residual['sliding']:+.2f}",
            _cells(shell_feet(one)), f"{(one.contact or {})['penetration']:.0e}",
            f"{grid_hausdorff(shape, one.surface.grid(s, v)):.1e}",
        ])  # fmt: skip
    return found


def _numbers() -> dict[str, Number]:
    """Forces and energies of the finer mesh with their change from the coarser one, and what the probes take anew."""
    numbers: dict[str, Number] = {}
    for state in STATES:
        word = state.split()[-1]
        coarse, fine = (shell(state, mesh) for mesh in MESHES)
        ends = total(state, coarse), total(state, fine)
        numbers[f"total_{word}"] = Number(ends[1], abs(ends[1] - ends[0]), "D w / l", ".2f")
        numbers[f"total_{word}_60"] = Number(ends[0], 1e-5 * ends[0], "D w / l", ".2f")
        numbers[f"ribbon_{word}"] = Number(
            ribbon_total(state, ribbon(state)),
            abs(ribbon_total(state, ribbon(state)) - ribbon_total(state, ribbon(state, 100))), "D w / l", ".2f",
        )  # fmt: skip
        lift = float(np.linalg.norm(fine.walls[0]["force"]))
        numbers[f"lift_{word}"] = Number(lift, 1e-6, "D w / l^2", ".8f")
    first = [shell_feet(shell("fallen", mesh))[0] for mesh in MESHES]
    numbers["share_fallen"] = Number(first[1].share, abs(first[1].share - first[0].share), "", ".3f")
    numbers["share_fallen_60"] = Number(first[0].share, 1e-4, "", ".3f")
    numbers["foot_fallen"] = Number(first[1].s, 0.5 / MESHES[1][0], "l", ".3f")
    own = ribbon_feet(ribbon("fallen"))[0], ribbon_feet(ribbon("fallen", 100))[0]
    numbers["ribbon_share_fallen"] = Number(own[0].share, max(abs(own[0].share - own[1].share), 1e-4), "", ".3f")
    fine = begun_at("fallen", FINEST, shell("fallen", MESHES[1]).surface)
    change = abs(total("fallen", fine) - total("fallen", shell("fallen", MESHES[1])))
    numbers["total_finest"] = Number(total("fallen", fine), change, "D w / l", ".2f")
    numbers["share_finest"] = Number(
        shell_feet(fine)[0].share, abs(shell_feet(fine)[0].share - first[1].share), "", ".4f"
    )
    numbers["left_finest"] = Number(left("fallen", fine)[1], 1e-4, "D w / l", ".3f")
    slidings = [moved(part).residual["sliding"] for part in PARTS[1:3]]
    numbers["sliding_before"] = Number(slidings[0], 1e-4, "D w / l^2", "+.2f")
    numbers["sliding_after"] = Number(slidings[1], 1e-4, "D w / l^2", "+.2f")
    numbers["ribbon_foot_fallen"] = Number(own[0].s, 1.0 / SEGMENTS, "l", ".3f")
    return numbers


def run(out: Path) -> dict[str, Number]:
    """results/shell_table.md."""
    numbers = _numbers()
    gaps = [numbers[f"{model}_edge"].value - numbers[f"{model}_fallen"].value for model in ("ribbon", "total")]
    arms = [
        f"{state} " + " and ".join(f"{left(state, one)[1] / abs(one.residual['sliding']):.3f}" for one in found)
        for state, found in ((state, [shell(state, mesh) for mesh in MESHES]) for state in STATES)
    ]
    rows: list[Any] = [row for state in STATES for row in _rows(state)]
    page.write(
        out / "shell_table.md", "A Moebius band on a table, by the shell", "python -m tests.validation shell_table",
        "Scenes moebius_table_edge and moebius_table_fallen (w/l = 0.01, nu = 0.5, Gamma = 10), nothing but table and "
        f"weight holds the band; shells of w/h = {RATIO:g} that begin at the ribbon's surface, and the ribbon "
        "([by itself](moebius_table.md)). Energies in D w / l, heights from the table. Left: what weight and table "
        "leave over of force (D w / l^2) and moment about the surface's centre of mass (D w / l), from the shape, the "
        "pushes and the weight alone. Sliding: the force (D w / l^2) with which the mesh resists that the band slides "
        "along itself. Carried: abscissa of each foot (l), and its part of the weight. Penetration between nodes, and "
        "distance to the ribbon (Hausdorff), in l.",
        page.table(
            ["state", "model", "stable", "elastic", "total", "force left", "moment left", "sliding", "carried",
             "penetration", "distance"], rows,
        ),
        f"The table carries the weight in every state, on the same feet by the same parts as the ribbon's multipliers "
        f"say. On edge the band has {gaps[0]:.2f} D w / l more than fallen by the ribbon, {gaps[1]:.2f} by the shell, "
        "which stretches at the event and has less energy in both. The moment that is left is the mesh's: only "
        "nodes are pushed, a band that slid by half an element would stand on others, and the sliding, which "
        "nothing else resists, is held. It is that force times one arm in each state, on either mesh: "
        f"{'; '.join(arms)} l.",
        "## Slid along itself",
        f"The fallen band on {MESHES[0][0]} x {MESHES[0][1]} elements, begun where it lay but slid by a part of an "
        "element: each is a stable state of its mesh, where the band is held, at energies that differ in the fourth "
        f"digit. Between {PARTS[1]:g} and {PARTS[2]:g} of an element the second foot goes over from one node to the "
        f"next, the energy is least and the mesh's own force goes from {numbers['sliding_before']} to "
        f"{numbers['sliding_after']} D w / l^2: its sign changes there, and with it that of the moment, which is that "
        "force times nearly one arm everywhere. No start that was slid settled on both nodes.",
        page.table(
            ["slid by, elements", "total", "sliding", "moment left", "arm", "carried"],
            [[f"{part:g}", f"{total('fallen', one):.5f}", f"{one.residual['sliding']:+.3f}",
              f"{left('fallen', one)[1]:.4f}", f"{left('fallen', one)[1] / abs(one.residual['sliding']):.3f}",
              _cells(shell_feet(one))] for part, one in ((part, moved(part)) for part in PARTS)],
        ),
        f"On {FINEST[0]} x {FINEST[1]} elements none is found from the ribbon's surface: a first step down brings more "
        "than a thousand nodes to the table at once, and a start 4e-3 l away is too far for the narrow foot. From the "
        f"shell on {MESHES[1][0]} x {MESHES[1][1]} it settles, at {_with(numbers['total_finest'])} D w / l, "
        f"{_with(numbers['share_finest'])} of the weight on its first foot, {numbers['left_finest']} D w / l of moment "
        "left.",
        "## Numbers",
        "On the finer mesh, with the change from the coarser one (of a foot half an element): table on edge "
        f"{numbers['lift_edge']}, fallen {numbers['lift_fallen']} D w / l^2; first foot of the fallen shell at "
        f"{_with(numbers['foot_fallen'])} l with {_with(numbers['share_fallen'])} of the weight, of the ribbon at "
        f"{_with(numbers['ribbon_foot_fallen'])} l with {_with(numbers['ribbon_share_fallen'])}; total energy "
        f"{_with(numbers['total_edge'])} and {_with(numbers['total_fallen'])} D w / l (weight Gamma = 10, thesis "
        "6.2.1).",
    )  # fmt: skip
    return numbers
