"""What `ribbonbench explain` says: tables, sentences, result and page, from the measured effects."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Any

from compare.measure.distance import YARDSTICK
from compare.page.page import Cell, Page, Table, write_page
from compare.pages.result import ribbon_result
from compare.scene.scene import Scene
from compare.store.made_by import provenance
from compare.store.store import atomic_write_json
from compare.studies.effects import Effect, Explanation
from compare.studies.effects_measured import CHEAP, ShellSolves, Solves, iterations

_COST_LEGEND = (
    "First row: with everything; below: differences to the same scene with this effect alone switched off, in the same "
    "formulation. evaluation: of all that the minimiser asks for, median of differences timed in turns. status, "
    "iterations, solve: of the whole solve without it, from the scene's own seed, warm, median of repeats; moves: "
    "Hausdorff distance between the shapes with and without it, in l (of a strip that no clamp holds, after the best "
    "rigid motion)."
)
_SHELL_LEGEND = (
    "The whole solve along its path, without compilation, in one run. moves: Hausdorff distance to the shell with all "
    "effects, in l; its own error is the distance to half the mesh."
)


def effect_table(scene: Scene, found: Explanation) -> Table:
    """Which effects are on, and why."""
    rows = tuple((e.name, e.on, e.why, e.adds) for e in found.effects)
    return Table(f"{scene.title}: effects", ("effect", "on", "why", "what it adds"), rows)


def cost_table(found: Explanation, solves: Solves | None) -> Table:
    """What each effect that is on costs and changes; the whole scene in the first row."""
    whole: tuple[Cell, ...] = (
        "everything on", found.unknowns, found.constraints, found.evaluation * 1e6, None,
        *_solve_cells(solves), None, "",
    )  # fmt: skip
    rows = [whole] + [_cost_row(effect, found, solves) for effect in found.effects if effect.on]
    headings = (
        "effect", "unknowns", "constraints", "evaluation us", "of it %", "status without it", "iterations", "solve ms",
        "moves", "why not",
    )  # fmt: skip
    formats = ("", "d", "d", ".1f", ".0f", "", "d", ".3g", ".1e", "")
    return Table("What each costs, and what changes without it", headings, tuple(rows), formats, _COST_LEGEND)


def _solve_cells(solves: Solves | None) -> tuple[Cell, Cell, Cell]:
    if solves is None:
        return None, None, None
    return solves.run.equilibrium.status.code, iterations(solves.run), solves.run.warm * 1e3


def _cost_row(effect: Effect, found: Explanation, solves: Solves | None) -> tuple[Cell, ...]:
    spared = effect.seconds
    off = None if solves is None else solves.without.get(effect.name)
    return (
        effect.name,
        effect.unknowns,
        effect.constraints,
        None if spared is None else spared * 1e6,
        None if spared is None else 100.0 * max(spared, 0.0) / found.evaluation,
        None if off is None else off.status,
        None if off is None else off.iterations,
        None if off is None or off.warm is None else off.warm * 1e3,
        None if off is None else off.moved,
        effect.fixed or (off.reason if off is not None else ""),
    )


def shell_table(measured: ShellSolves) -> Table:
    """The shell with and without its effects."""
    along, across = measured.elements
    rows = tuple(
        (r.name or "everything on", r.status, r.iterations, _known(r.seconds), r.moved, r.error, r.reason)
        for r in measured.rows
    )
    return Table(
        f"The shell, w/h = {measured.width_to_thickness:g}, {along} x {across} elements",
        ("without", "status", "Newton iterations", "solve s", "moves", "own error", "why not"),
        rows,
        ("", "", "d", ".3g", ".1e", ".1e", ""),
        _SHELL_LEGEND,
    )


def _known(value: float | None) -> float | None:
    return None if value is None or math.isnan(value) else value


def sentences(found: Explanation, solves: Solves | None) -> list[str]:
    """Sizes, what costs most, what costs and changes nothing, shell and elastica."""
    rows = f"{found.constraints} constraints" if found.constraints else "no constraints"
    asked = "energy, gradient, Hessian" + (", constraints and their Jacobian" if found.constraints else "")
    said = [
        f"Ribbon: {found.formulation} ({found.formulation_why}); {found.unknowns} unknowns, {found.bounds} "
        f"with bounds, {rows}; one evaluation of {asked} {found.evaluation * 1e6:.0f} us."
    ]
    timed = [e for e in found.effects if e.seconds is not None]
    if timed:
        dearest = max(timed, key=lambda e: e.seconds or 0.0)
        if (dearest.seconds or 0.0) > 0.1 * found.evaluation:
            share = min((dearest.seconds or 0.0) / found.evaluation, 1.0)
            said.append(f"Dearest in an evaluation: {dearest.name}, {share:.0%} of it.")
    if solves is not None:
        said += _solve_sentences(solves)
    return [*said, f"Shell: {found.shell}", f"Third opinion: {found.third_opinion}."]


def _solve_sentences(solves: Solves) -> list[str]:
    run, error = solves.run, solves.error
    known = "unknown" if error is None else f"{error:.1e} l"
    said = [
        f"Solve: {run.equilibrium.status.code}, {iterations(run)} iterations, {run.warm * 1e3:.3g} ms warm "
        f"({run.first:.3g} s the first time); discretisation error {known}."
    ]
    if not solves.without:
        said.append(f"Not solved without its effects: a solve takes more than {CHEAP:g} s, or --no-run; --run does it.")
        return said
    moves = {name: off for name, off in solves.without.items() if off.moved is not None}
    small = max(YARDSTICK, error or 0.0)
    idle = [name for name, off in moves.items() if (off.moved or 0.0) <= small]
    for name in idle:
        off = moves[name]
        reason = "1 permille of l" if small == YARDSTICK else "the ribbon's own discretisation error"
        said.append(
            f"Little changes without {name}: the shape moves by {off.moved:.1e} l, no more than {reason}; the solve "
            f"takes {(off.warm or 0.0) * 1e3:.3g} ms without and {run.warm * 1e3:.3g} ms with it."
        )
    if moves and not idle:
        said.append("Every effect that can be off alone moves the shape visibly.")
    return said


def result(scene: Scene, found: Explanation, solves: Solves | None, shell: ShellSolves | None) -> dict[str, Any]:
    """result.json: the contract's keys of the ribbon's solve where there is one, and what was measured."""
    data: dict[str, Any] = {}
    if solves is not None:
        data = ribbon_result(scene, solves.run, solves.error)
    else:
        data = {"scene": scene.name, "title": scene.title, "status": "explained", "provenance": provenance(scene)}
    data["explanation"] = dataclasses.asdict(found)
    data["without"] = None if solves is None else dict(solves.without)
    data["shell_without"] = shell
    return data


def write(
    out: Path, scene: Scene, found: Explanation, solves: Solves | None, shell: ShellSolves | None, again: str
) -> None:
    """Writes result.json and page.json into `out`."""
    data = result(scene, found, solves, shell)
    atomic_write_json(out / "result.json", data)
    tables = [effect_table(scene, found), cost_table(found, solves)] + ([shell_table(shell)] if shell else [])
    up = None if scene.up is None else tuple(float(c) for c in scene.up)
    page = Page(
        command="explain",
        title=f"{scene.title}: effects",
        verdict=tuple(sentences(found, solves)),
        tables=tuple(tables),
        files={"result.json": "everything measured"},
        scene=scene.to_toml(),
        up=up,  # type: ignore[arg-type]
        provenance=data["provenance"],
        again=again,
    )
    write_page(out, page)
