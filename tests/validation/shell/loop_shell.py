"""The loop of a twisted ribbon as a shell: where it snaps, and where it lies on itself edge on edge, beside `finite`.

The strip of tests/validation/ribbon/ribbon_plectoneme.py. A shell begins at the ribbon's surface and is followed by its
own equations on two meshes; in contact it has rows for edges that meet edges (docs/theory.md, eq. (7.33)). Its
clamps hold the whole edge: `finite` beside it has free rulings there.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from compare.continuation.correct import first_point
from compare.continuation.follow import follow
from compare.continuation.point import Options, Point, Run
from compare.measure.mesh_limit import settled
from compare.models.branches.shell_remote import ShellEquations, ShellServer
from compare.models.ribbon.state import RibbonShape
from compare.models.shell import starting_surface
from ribbon import Equilibrium
from shellref.follow.equations import Equations as OwnEquations
from shellref.path.solve import solve
from shellref.shell.clamps import reactions
from shellref.shell.options import ShellOptions
from shellref.shell.problem import Pose, ShellProblem
from shellref.shell.result import ShellResult
from shellref.shell.surface import ShellSurface
from tests.validation import page
from tests.validation.number import Number
from tests.validation.ribbon import ribbon_plectoneme as strips

FloatArray = NDArray[np.float64]

#: The strips: followed over its fold, and in contact; distances of their ends (l).
WIDE, LYING = strips.FINITE[3], strips.FINITE[1]
BEGUN, NEAREST, TOUCHING = 0.70, 0.67, 0.5
#: What is followed, as parts of the way from the first distance to the last: behind the fold the branch goes back.
SPAN = (-1.0, 1.0)
MESHES = ((30, 2), (60, 4))
TURN = Rotation.from_rotvec([0.0, 0.0, 2.0 * np.pi * strips.TURNS]).as_matrix()


class Loop(NamedTuple):
    """s and s' of what touches, push, tension, moment, energy, least eigenvalue."""

    s: float
    other: float
    push: float
    tension: float
    moment: float
    energy: float
    eigenvalue: float


def shell(case: strips.Case, distance: float, mesh: tuple[int, int], touches: bool = False) -> ShellProblem:
    """The strip between clamps that hold its whole edges."""
    end = Pose((0.0, 0.0, distance), tuple(map(tuple, TURN)))  # type: ignore[arg-type]
    thick = case.width / case.slender
    return ShellProblem(case.width, thick, strips.NU, end=end, elements=mesh, apart=thick if touches else None)


# -- the fold ----------------------------------------------------------------------------------------------------------


def at(point: Point) -> float:
    """The distance of the ends."""
    return BEGUN + (NEAREST - BEGUN) * point.t


def _few(point: Point) -> bool:
    return point.unstable < 2


@cache
def branch(mesh: tuple[int, int]) -> Run:
    """The shell's branch, begun at the ribbon's surface, over its fold until two modes are unstable."""
    start = starting_surface(RibbonShape(strips.begun(WIDE, BEGUN)), shell(WIDE, BEGUN, mesh))
    system = ShellEquations(lambda t: shell(WIDE, BEGUN + (NEAREST - BEGUN) * t, mesh), ShellServer(ShellOptions()))
    z = system.begun(np.concatenate([start.points, start.directors], axis=-1), 0.0)
    first = first_point(system, z, 0.0, Options().tolerance)
    assert first is not None
    return follow(first, SPAN, Options(steps=80), _few)


def special(run: Run, kind: str) -> Point:
    """The first of a kind."""
    return next(one.point for one in run.specials if one.kind == kind)


@cache
def folded(mesh: tuple[int, int]) -> FloatArray:
    """Distance, tension, moment, energy at the shell's fold, and the distance where the loop leaves the middle."""
    run = branch(mesh)
    point = special(run, "fold")
    own = OwnEquations(shell(WIDE, at(point), mesh), ShellOptions())
    state, _ = own.split(point.z)
    model = own.model
    placed, left = (model.on_grid(f).reshape(-1, 6) for f in (state, model.residual(state)))
    end = np.repeat(model.grid.s_nodes, len(model.grid.v_nodes)) == 1.0
    force, moment = reactions(placed, left, end, np.array([0.0, 0.0, at(point)]))
    return np.array([at(point), force[2], moment[2], point.system.energy(point.z, point.t),
                     at(special(run, "branch_point"))])  # fmt: skip


def ribbon_folded() -> FloatArray:
    """The same of `finite`."""
    run = strips.branch(WIDE)
    found = next(one for one in run.specials if one.kind == "fold")
    fork = strips.distance(special(run, "branch_point"))
    return np.append(strips.numbers_at(found)[:4], fork)


# -- in contact --------------------------------------------------------------------------------------------------------


@cache
def ribbon_lying() -> Equilibrium:
    """The ribbon that lies on itself."""
    state = strips.carried(LYING, (0.54, TOUCHING)).state
    assert state.ok
    return state


@cache
def lying(mesh: tuple[int, int]) -> ShellResult:
    """The shell that lies on itself, begun at the ribbon's surface, without a kick."""
    problem = shell(LYING, TOUCHING, mesh, True)
    found = solve(problem, ShellOptions(kick=False), start=starting_surface(RibbonShape(ribbon_lying()), problem))
    if found.status != "converged" or not found.stable or len(found.pairs) != 1:
        raise AssertionError(f"{mesh}: {found.status}, {found.message}, {len(found.pairs)} pairs")
    return found


def of_ribbon(state: Equilibrium) -> Loop:
    ends = state.end_support
    assert ends is not None
    ((s, other, push),) = strips.pushes(state)[:, :3]
    return Loop(s, other, push, ends.force[2], ends.moment[2], state.energy.total, state.lowest_eigenvalue or 0.0)


def of_shell(found: ShellResult) -> Loop:
    (pair,) = found.pairs
    end = found.clamps["end"]
    push = float(np.linalg.norm(pair["force"]))
    return Loop(pair["s"], pair["s_other"], push, end["force"][2], end["moment"][2], found.energy["total"],
                found.lowest_eigenvalue or 0.0)  # fmt: skip


def off(found: ShellResult, state: Equilibrium) -> float:
    """Largest distance (l) of both centrelines, at equal abscissae."""
    s = np.linspace(0.0, 1.0, 401)
    return float(np.linalg.norm(found.surface.centreline(s) - state.position(s), axis=1).max())


def nearest(surface: ShellSurface) -> float:
    """Least distance (l) of two parts of a surface, from its points alone."""
    s, v = np.linspace(0.0, 1.0, 2001), np.linspace(surface.v_nodes[0], surface.v_nodes[-1], 9)
    points, label = surface.grid(s, v), np.repeat(s, len(v)).reshape(len(s), len(v))
    one, other = label < 0.4, label > 0.43
    return float(cKDTree(points[one]).query(points[other])[0].min())


def unbalanced(found: ShellResult) -> float:
    """Force and moment about the origin that both clamps leave, over the tension (D w / l^2) and l."""
    ends = found.clamps
    force = ends["start"]["force"] + ends["end"]["force"]
    moment = ends["start"]["moment"] + ends["end"]["moment"]
    moment = moment + np.cross([0.0, 0.0, TOUCHING], ends["end"]["force"])
    return float(max(np.abs(force).max(), np.abs(moment).max()) / ends["end"]["force"][2])


PROBES: dict[str, Callable[[], float]] = {
    "fold_coarse": lambda: float(folded(MESHES[0])[0]),
    "push_coarse": lambda: of_shell(lying(MESHES[0])).push,
}


# -- the page ----------------------------------------------------------------------------------------------------------


def _folds(numbers: dict[str, Number]) -> list[str]:
    rows = [(f"shell, {a} x {b}", folded((a, b))) for a, b in MESHES]
    free = ribbon_folded()
    limits = [settled(list(column), 1e-6) for column in np.array([one for _, one in rows]).T]
    rows += [("finite, rulings free at the clamps", free)]
    table = [
        [name, f"{z:.6f}", f"{fork:.6f}", f"{force:.3f}", f"{moment:.4f}", f"{energy:.4f}"]
        for name, (z, force, moment, energy, fork) in rows
    ]
    where, tension = limits[0], limits[1]
    for name, limit, unit, shown in (("fold", where, "l", ".5f"), ("tension", tension, "D w / l^2", ".2f")):
        numbers[name] = (
            Number(limit.value, limit.error, unit, shown) if limit.settles
            else Number(limit.value, None, unit, shown, "it does not settle over its meshes")
        )  # fmt: skip
    numbers["fold_free"] = Number(float(free[0]), 1e-5, "l", ".5f")
    coarse = float(rows[0][1][0])
    numbers["fold_coarse"] = Number(coarse, abs(coarse - where.value), "l", ".5f")
    return [
        "## Where it snaps",
        f"w/l = {WIDE.width:g}, w/h = {WIDE.slender:g}, without contact. The shell begins at the ribbon's surface at "
        f"Z = {BEGUN:g} and is followed by its own equations; it is stable down to its fold. Beyond it, on the way "
        "back, a second mode grows unstable where the loop leaves the middle.",
        page.table(["model", "fold, Z", "loop leaves the middle, Z", "tension at the fold", "moment", "energy"], table),
        f"Over the meshes the shell's fold goes to Z = {where.text}, tension {tension.text}. Clamps "
        "that hold the whole edge keep it flat and let no warping through: the strip is the stiffer.",
    ]


def _lyings(numbers: dict[str, Number]) -> list[str]:
    shells = [lying(mesh) for mesh in MESHES]
    free = ribbon_lying()
    loops = [of_shell(found) for found in shells]
    rows = []
    for (a, b), found, loop in zip(MESHES, shells, loops, strict=True):
        rows.append([f"shell, {a} x {b}", *_row(loop), f"{off(found, free):.1e}",
                     f"{nearest(found.surface) * LYING.slender / LYING.width - 1.0:+.0e}"])  # fmt: skip
    rows.append(["finite, rulings free at the clamps", *_row(of_ribbon(free)), "", ""])
    limits = [settled(list(column), 1e-6) for column in np.array(loops).T]
    push, energy = limits[2], limits[5]
    for name, limit, fine, unit, shown in (
        ("push", push, loops[-1].push, "D w / l^2", ".2f"), ("energy", energy, loops[-1].energy, "D w / l", ".3f")
    ):  # fmt: skip
        numbers[name] = (
            Number(limit.value, limit.error, unit, shown) if limit.settles
            else Number(fine, None, unit, shown, "it does not settle over its meshes")
        )  # fmt: skip
    for name, kind in (("free", free),):
        loop = of_ribbon(kind)
        numbers[f"push_{name}"] = Number(loop.push, 1e-3 * loop.push, "D w / l^2", ".2f")
        numbers[f"energy_{name}"] = Number(loop.energy, 1e-5 * loop.energy, "D w / l", ".3f")
    numbers["push_coarse"] = Number(loops[0].push, abs(loops[0].push - push.value), "D w / l^2", ".3f")
    worst = max(unbalanced(found) for found in shells)
    numbers["unbalanced"] = Number(worst, worst, "", ".0e")
    product = max(found.contact["product"] for found in shells if found.contact is not None)
    return [
        "## Where it lies on itself",
        f"w/l = {LYING.width:g}, w/h = {LYING.slender:g}, Z = {TOUCHING:g}, parts of the strip the thickness apart. "
        "The shell touches at the same place as the ribbon, at v = +0.5 w of the first strand and -0.5 w of the "
        "second, edge on edge, and is stable. *Eigenvalue*: each model in its own metric. *Off*: centreline from the "
        "ribbon's, at equal s. *Nearest*: least distance of two parts of the shell over h, less 1, from its points.",
        page.table(["model", "s", "s'", "push", "tension", "moment", "energy", "eigenvalue", "off",
                    "nearest"], rows),
        f"The push goes to {push.text}, the energy to {energy.text}. Force and moment that both clamps leave: "
        f"{worst:.0e} of the tension; push times gap {product:.0e} of the push.",
    ]  # fmt: skip


def _row(loop: Loop) -> list[str]:
    return [f"{loop.s:.4f}", f"{loop.other:.4f}", f"{loop.push:.3f}", f"{loop.tension:.3f}", f"{loop.moment:.4f}",
            f"{loop.energy:.4f}", f"{loop.eigenvalue:.4g}"]  # fmt: skip


def run(out: Path) -> dict[str, Number]:
    """results/loop_shell.md."""
    numbers: dict[str, Number] = {}
    parts = _folds(numbers)
    print("  loop_shell: the fold", flush=True)
    parts += _lyings(numbers)
    page.write(
        out / "loop_shell.md", "The loop of a twisted ribbon as a shell", "python -m tests.validation loop_shell",
        "The strip of [a twisted ribbon whose ends come together](ribbon_plectoneme.md), 1.5 turns, nu = 0.3, as a "
        "Naghdi shell beside `finite`. Edges that meet edges: [theory](../docs/theory.md), (7.33), (7.34). The "
        "shell's clamps hold the whole edge, position and director. Forces in D w / l^2, energies in D w / l, lengths "
        "in l; meshes along x across, of degree 2; the ribbon on 40 segments.",
        *parts,
        "What does not hold: the shell's own snap from one state to the other is not followed with contact; one "
        "distance, one width in contact; a ribbon's clamp has no counterpart that holds the section as the shell's "
        "does: it is flat there, and lets no warping through.",
    )  # fmt: skip
    return numbers
