"""The loop of a twisted ribbon as a shell: where it snaps, and where it lies on itself edge on edge, beside `finite`.

The strip of tests/validation/ribbon/ribbon_plectoneme.py. A shell begins at the ribbon's surface and is followed by its
own equations on three meshes; in contact it has rows for edges that meet edges (docs/theory.md, eq. (7.33)). Its
clamps hold the whole edge: `finite` stands beside it with rulings that are free there, and held straight as the
shell's edge is.
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
from compare.measure.mesh_limit import Settled, settled
from compare.models.branches.shell_remote import ShellEquations, ShellServer
from compare.models.ribbon.state import RibbonShape
from compare.models.shell import starting_surface
from ribbon import Equilibrium
from ribbon.find.continuation import anchored
from ribbon.find.jointed.flat import Placed, halved, placed
from ribbon.find.snap import landed
from ribbon.find.solving.request import How
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.transfer import transferred
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
RULINGS = ("free", "straight")
#: What is followed, as parts of the way from the first distance to the last: behind the fold the branch goes back.
SPAN = (-1.0, 1.0)
MESHES = ((40, 2), (80, 4), (160, 8))
#: The ribbon's equal segments; how far (l) the strip in contact keeps its parts apart.
SEGMENTS, HIGH = (40, 80, 160), LYING.width / LYING.slender
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


@cache
def ribbon_folded(ruling: str = "free", segments: int = SEGMENTS[0]) -> FloatArray:
    """The same of `finite`."""
    run = strips.run_of(WIDE._replace(ruling=ruling), strips.BEGUN, NEAREST, segments)
    point = special(run, "fold")
    state = strips.shape(point)
    ends = state.end_support
    assert ends is not None
    where, fork = (strips.BEGUN + (NEAREST - strips.BEGUN) * one.t for one in (point, special(run, "branch_point")))
    return np.array([where, ends.force[2], ends.moment[2], state.energy.total, fork])


# -- in contact --------------------------------------------------------------------------------------------------------


@cache
def ribbon_lying(ruling: str = "free") -> Equilibrium:
    """The ribbon that lies on itself, on 40 equal segments."""
    state = strips.carried(LYING._replace(ruling=ruling), (0.54, TOUCHING)).state
    assert state.ok
    return state


@cache
def ribbon_finer(ruling: str) -> tuple[Equilibrium, ...]:
    """On segments halved twice: of free rulings they end where it touches and halve towards there; of straight ones,
    which lose the place when such segments are halved, they are equal."""
    case, states = LYING._replace(ruling=ruling), [ribbon_lying(ruling)]
    if ruling == "free":
        here = placed(strips.problem(case, TOUCHING, apart=HIGH), Placed(states.pop(), 1.0 / SEGMENTS[0]))
        while here is not None and len(states) < len(SEGMENTS):
            states.append(here.state)
            here = halved(here.state.problem, here) if len(states) < len(SEGMENTS) else here
    for segments in SEGMENTS[len(states) :]:
        old = states[-1]
        fine = anchored(strips.problem(case, TOUCHING, segments, apart=HIGH), old)
        assert isinstance(fine, MixedProblem)
        assert isinstance(old.problem, MixedProblem)
        states.append(landed(fine, transferred(old.problem, old.x, fine), How()))
    if any(not state.ok or len(strips.pushes(state)) != 1 for state in states):
        raise AssertionError(f"{ruling}: {[state.message for state in states]}")
    return tuple(states)


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


def _number(limit: Settled, unit: str, shown: str) -> Number:
    why = "" if limit.settles else "it does not settle over its meshes"
    return Number(limit.value, limit.error if limit.settles else None, unit, shown, why)


def _limits(rows: list[FloatArray]) -> list[Settled]:
    """Of every column over meshes halved twice."""
    return [settled(list(column), 1e-6) for column in np.array(rows).T]


def _short(limit: Settled, digits: int) -> str:
    return f"{limit.value:.{digits}f}" + (f" +- {limit.error:.0e}" if limit.settles else " (not settled)")


FOLD_DIGITS = (5, 3, 4, 4, 5)


def _folds(numbers: dict[str, Number]) -> list[str]:
    found = {"shell": [(f"{a} x {b}", folded((a, b))) for a, b in MESHES]}
    for ruling in RULINGS:
        found[f"finite, rulings {ruling}"] = [(str(n), ribbon_folded(ruling, n)) for n in SEGMENTS]
    limits = {name: _limits([one for _, one in rows]) for name, rows in found.items()}
    table = []
    for name, rows in found.items():
        table += [[name, mesh, *(f"{x:.{d}f}" for x, d in zip(one, FOLD_DIGITS, strict=True))] for mesh, one in rows]
        table.append([name, "limit", *(_short(x, d) for x, d in zip(limits[name], FOLD_DIGITS, strict=True))])
    shell, free, held = limits.values()
    for name, row in (("", shell), ("_free", free), ("_straight", held)):
        numbers[f"fold{name}"] = _number(row[0], "l", ".5f")
        numbers[f"tension{name}"] = _number(row[1], "D w / l^2", ".2f")
    coarse = float(found["shell"][0][1][0])
    numbers["fold_coarse"] = Number(coarse, abs(coarse - shell[0].value), "l", ".5f")
    coarsely = ribbon_folded("straight")[0] - ribbon_folded("free")[0]
    part = (shell[0].value - free[0].value) / (held[0].value - free[0].value)
    return [
        "## Where it snaps",
        f"w/l = {WIDE.width:g}, w/h = {WIDE.slender:g}, without contact. The shell begins at the ribbon's surface at "
        f"Z = {BEGUN:g} and is followed by its own equations; it is stable down to its fold. Beyond it, on the way "
        "back, a second mode grows unstable where the loop leaves the middle.",
        page.table(["model", "mesh", "fold, Z", "tension at the fold", "moment", "energy",
                    "loop leaves the middle, Z"], table),
        f"The shell's fold lies at {part:.2f} of the way from the ribbon's with free rulings to the one with straight "
        f"rulings. Rulings held straight move the ribbon's by {held[0].value - free[0].value:.4f} l; "
        f"{SEGMENTS[0]} equal segments make {coarsely:.4f} of that.",
    ]  # fmt: skip


def _lyings(numbers: dict[str, Number]) -> list[str]:
    shells = [lying(mesh) for mesh in MESHES]
    beside = {ruling: ribbon_finer(ruling) for ruling in RULINGS}
    rows, limits = [], {}
    for (a, b), found in zip(MESHES, shells, strict=True):
        rows.append(["shell", f"{a} x {b}", *_row(of_shell(found)),
                     *(f"{off(found, beside[ruling][-1]):.1e}" for ruling in RULINGS),
                     f"{nearest(found.surface) * LYING.slender / LYING.width - 1.0:+.0e}"])  # fmt: skip
    limits["shell"] = _limits([np.array(of_shell(found)) for found in shells])
    rows.append(["shell", "limit", *map(_short, limits["shell"][:-1], LYING_DIGITS), "", "", ""])
    for ruling, states in beside.items():
        name = f"finite, rulings {ruling}"
        limits[ruling] = _limits([np.array(of_ribbon(state)) for state in states])
        rows += [[name, str(state.problem.lengths.size), *_row(of_ribbon(state)), "", "", ""] for state in states]
        rows.append([name, "limit", *map(_short, limits[ruling][:-1], LYING_DIGITS), "", "", ""])
    for name, row in (("", limits["shell"]), ("_free", limits["free"]), ("_straight", limits["straight"])):
        numbers[f"push{name}"] = _number(row[2], "D w / l^2", ".2f")
        numbers[f"energy{name}"] = _number(row[5], "D w / l", ".3f")
    coarse = of_shell(shells[0]).push
    numbers["push_coarse"] = Number(coarse, abs(coarse - limits["shell"][2].value), "D w / l^2", ".3f")
    worst = max(unbalanced(found) for found in shells)
    numbers["unbalanced"] = Number(worst, worst, "", ".0e")
    product = max(found.contact["product"] for found in shells if found.contact is not None)
    lowest = ", ".join(f"{of_shell(found).eigenvalue:.2f}" for found in shells)
    push, free, held = (limits[name][2].value for name in ("shell", *RULINGS))
    return [
        "## Where it lies on itself",
        f"w/l = {LYING.width:g}, w/h = {LYING.slender:g}, Z = {TOUCHING:g}, parts of the strip the thickness apart. "
        "The shell touches at v = +0.5 w of the first strand and -0.5 w of the second, edge on edge, as the ribbon "
        f"does, and is stable (lowest eigenvalue {lowest} in its metric, coarse to fine). Segments of free rulings "
        "end where the ribbon touches and halve towards there; of straight ones they are equal. *Off*: centreline "
        "from the ribbon's on its finest segments, at equal s. *Nearest*: least distance of two parts of the shell "
        "over h, less 1, from its points.",
        page.table(["model", "mesh", "s", "s'", "push", "tension", "moment", "energy", "off, free", "off, straight",
                    "nearest"], rows),
        f"The shell pushes with {100.0 * (push / free - 1.0):.1f} % more than the ribbon with free rulings, "
        f"{100.0 * (push / held - 1.0):+.2f} % beside straight ones, within their errors. "
        "Force and moment that both its clamps leave: "
        f"{worst:.0e} of the tension; push times gap {product:.0e} of the push.",
    ]  # fmt: skip


LYING_DIGITS = (5, 5, 3, 3, 4, 4)


def _row(loop: Loop) -> list[str]:
    return [f"{value:.{digits}f}" for value, digits in zip(loop[:-1], LYING_DIGITS, strict=True)]


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
        "in l; meshes along x across, of degree 2, limits over meshes halved twice.",
        *parts,
        "What does not hold: the shell's own snap from one state to the other is not followed with contact; one "
        "distance, one width in contact; no friction.",
    )  # fmt: skip
    return numbers
