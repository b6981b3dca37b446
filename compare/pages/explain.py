"""What `ribbonbench explain` says: tables, sentences, result and page, from the measured effects."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from compare.measure.distance import YARDSTICK
from compare.models.ribbon_run import ElasticaRun
from compare.page.study import Study
from compare.page.table import Column, ColumnOf, Table
from compare.pages.result import elastica_result, ribbon_result
from compare.scene.scene import Scene
from compare.store.made_by import provenance
from compare.studies import effects_elastica
from compare.studies.effects import Effect, Explanation
from compare.studies.effects_elastica import Part, Without
from compare.studies.effects_measured import CHEAP, ShellSolves, ShellWithout, Solves, iterations

_EFFECTS: tuple[ColumnOf[Effect | Part], ...] = (
    (Column("effect", "effect", kind="word"), lambda e: e.name),
    (Column("on", "on", kind="truth"), lambda e: e.on),
    (Column("why", "why", kind="word"), lambda e: e.why),
    (Column("adds", "what it adds", kind="word"), lambda e: e.adds),
)
_COSTS = (
    Column("effect", "effect", kind="word"),
    Column("unknowns", "unknowns", kind="integer"),
    Column("constraints", "constraints", kind="integer"),
    Column("evaluation", "evaluation us", "s", "microseconds:1", legend="of all that the minimiser asks for, median of "
           "differences timed in turns"),
    Column("evaluation_share", "of it %", kind="percent:0"),
    Column("status", "status without it", kind="word", legend="of the whole solve from the scene's own seed, as are "
           "iterations and time (warm, median of repeats)"),
    Column("iterations", "iterations", kind="integer"),
    Column("seconds", "solve ms", "s", "milliseconds:3"),
    Column("moves", "moves", "l", "exponent:1", legend="Hausdorff distance between the shapes with and without it, in "
           "l (of a strip that no clamp holds, after the best rigid motion)"),
    Column("reason", "why not", kind="word"),
)  # fmt: skip
_COST_LEGEND = (
    "First row: with everything; below: differences to the same scene with this effect alone switched off, in the same "
    "formulation."
)


def effect_table(scene: Scene, found: Sequence[Effect | Part]) -> Table:
    """Which effects are on, and why."""
    return Table.of(f"{scene.title}: effects", _EFFECTS, found)


def cost_table(found: Explanation, solves: Solves | None) -> Table:
    """What each effect that is on costs and changes; the whole scene in the first row."""
    whole = {
        "effect": "everything on",
        "unknowns": found.unknowns,
        "constraints": found.constraints,
        "evaluation": found.evaluation,
        "reason": "",
    }
    if solves is not None:
        run = solves.run
        whole |= {"status": run.equilibrium.status.code, "iterations": iterations(run), "seconds": run.warm}
    rows = [whole, *(_cost_row(effect, found, solves) for effect in found.effects if effect.on)]
    return Table.of_records("What each costs, and what changes without it", _COSTS, rows, _COST_LEGEND)


def _cost_row(effect: Effect, found: Explanation, solves: Solves | None) -> dict[str, Any]:
    spared = effect.seconds
    off = None if solves is None else solves.without.get(effect.name)
    row = {
        "effect": effect.name,
        "unknowns": effect.unknowns,
        "constraints": effect.constraints,
        "evaluation": spared,
        "evaluation_share": None if spared is None else max(spared, 0.0) / found.evaluation,
        "reason": effect.fixed,
    }
    if off is not None:
        row |= {"status": off.status, "iterations": off.iterations, "seconds": off.warm, "moves": off.moved}
        row["reason"] = effect.fixed or off.reason
    return row


_SHELLS: tuple[ColumnOf[ShellWithout], ...] = (
    (Column("effect", "without", kind="word", words={"": "everything on"}), lambda r: r.name),
    (Column("status", "status", kind="word"), lambda r: r.status),
    (Column("iterations", "Newton iterations", kind="integer"), lambda r: r.iterations),
    (Column("seconds", "solve s", "s", "seconds:3"), lambda r: r.seconds),
    (Column("moves", "moves", "l", "exponent:1", legend="Hausdorff distance to the shell with all effects, in l"),
     lambda r: r.moved),
    (Column("error", "own error", "l", "exponent:1", legend="the distance to half the mesh"), lambda r: r.error),
    (Column("reason", "why not", kind="word"), lambda r: r.reason),
)  # fmt: skip


def shell_table(measured: ShellSolves) -> Table:
    """The shell with and without its effects."""
    along, across = measured.elements
    return Table.of(
        f"The shell, w/h = {measured.width_to_thickness:g}, {along} x {across} elements",
        _SHELLS,
        measured.rows,
        "The whole solve along its path, without compilation, in one run.",
    )


_ELASTICA: tuple[ColumnOf[Without], ...] = (
    (Column("effect", "effect", kind="word"), lambda o: o.name),
    (Column("status", "status", kind="word"), lambda o: o.status),
    (Column("iterations", "iterations", kind="integer"), lambda o: o.iterations),
    (Column("seconds", "solve ms", "s", "milliseconds:3"), lambda o: o.seconds),
    (Column("moves", "moves / l", "l", "exponent:1", legend="largest distance between the centrelines"),
     lambda o: o.moves),
)  # fmt: skip


def elastica_tables(scene: Scene, found: Sequence[Part], own: ElasticaRun, others: Sequence[Without]) -> list[Table]:
    """The effects of a scene of the elastica, and what each costs and changes."""
    whole = Without("everything on", own.result.status.value, own.result.iterations, own.warm, None)
    legend = "First row: with everything; below: without this effect alone."
    return [
        effect_table(scene, found),
        Table.of("What each costs, and what changes without it", _ELASTICA, [whole, *others], legend),
    ]


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
    Study(
        "explain",
        f"{scene.title}: effects",
        tables=tuple(tables(scene, found, solves, shell)),
        sentences=tuple(sentences(found, solves)),
        files={"result.json": "everything measured"},
    ).write(out, result(scene, found, solves, shell), again, scene)


def tables(scene: Scene, found: Explanation, solves: Solves | None, shell: ShellSolves | None) -> list[Table]:
    """The effects, what each costs and changes, and the shell's where it was solved."""
    known = [effect_table(scene, found.effects), cost_table(found, solves)]
    return known + ([shell_table(shell)] if shell else [])


def write_elastica(
    out: Path, scene: Scene, found: Sequence[Part], own: ElasticaRun, others: Sequence[Without], again: str
) -> None:
    """The same of a scene that only the elastica can solve."""
    measured = {"command": "explain", "effects": found, "without": others}
    Study(
        "explain",
        f"{scene.title}: effects",
        tables=tuple(elastica_tables(scene, found, own, others)),
        sentences=tuple(effects_elastica.sentences(scene, own)),
    ).write(out, {**elastica_result(scene, own), **measured}, again, scene)
