"""What `ribbonbench explain` says: tables, sentences, result and page, from the measured effects."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from compare.measure.distance import YARDSTICK
from compare.models.base import Effect
from compare.page.page import Cell, Page, Table, write_page
from compare.pages.result import presenter, state_result
from compare.pages.solve import upwards
from compare.scene.check import beyond_the_ribbon
from compare.scene.scene import Scene
from compare.store.made_by import provenance
from compare.store.store import atomic_write_json
from compare.studies.effects import Explanation
from compare.studies.effects_measured import ShellSolves, Solves, iterations

_COST_LEGEND = (
    "First row: with everything; below: differences to the same scene with this effect alone switched off, in the same "
    "formulation. evaluation: of all that the minimiser asks for, median of differences timed in turns. status, "
    "iterations, solve: of the whole solve without it, from the scene's own seed, warm, median of repeats; moves: "
)
_SOLVE_LEGEND = "First row: with everything; below: without this effect alone. moves: "
_MOVES = {
    True: "Hausdorff distance between the shapes with and without it, in l (of a strip that no clamp holds, after the "
    "best rigid motion).",
    False: "largest distance between the centrelines.",
}
_COST_HEADINGS = (
    "effect", "unknowns", "constraints", "evaluation us", "of it %", "status without it", "iterations", "solve ms",
    "moves", "why not",
)  # fmt: skip
_SOLVE_HEADINGS = ("effect", "status", "iterations", "solve ms", "moves / l", "why not")
_SHELL_LEGEND = (
    "The whole solve along its path, without compilation, in one run. moves: Hausdorff distance to the shell with all "
    "effects, in l; its own error is the distance to half the mesh."
)


def effect_table(scene: Scene, found: Explanation) -> Table:
    """Which effects are on, and why."""
    rows = tuple((e.key, e.on, e.why, e.words) for e in found.effects)
    return Table(f"{scene.title}: effects", ("effect", "on", "why", "what it adds"), rows)


def cost_table(found: Explanation, solves: Solves | None) -> Table:
    """What each effect that is on costs and changes; the whole scene in the first row."""
    title, moves = "What each costs, and what changes without it", _MOVES[solves is None or solves.surface]
    on = [(effect, _solve_cells(solves, effect)) for effect in found.effects if effect.on]
    whole, first = found.evaluation, _solve_cells(solves)
    rows: list[tuple[Cell, ...]]
    if whole is None:  # whole solves are all that there is
        rows = [("everything on", *first)]
        rows += [(effect.key, *solved) for effect, solved in on if any(solved)]
        return Table(title, _SOLVE_HEADINGS, tuple(rows), ("", "", "d", ".3g", ".1e", ""), _SOLVE_LEGEND + moves)
    rows = [("everything on", whole.unknowns, whole.constraints, whole.seconds * 1e6, None, *first)]
    rows += [(effect.key, *_spared(effect, whole.seconds), *solved) for effect, solved in on]
    formats = ("", "d", "d", ".1f", ".0f", "", "d", ".3g", ".1e", "")
    return Table(title, _COST_HEADINGS, tuple(rows), formats, _COST_LEGEND + moves)


def _spared(effect: Effect, whole: float) -> tuple[Cell, Cell, Cell, Cell]:
    """What an evaluation is spared without an effect; whole: seconds of one."""
    spared = effect.seconds
    if spared is None:
        return effect.unknowns, effect.constraints, None, None
    return effect.unknowns, effect.constraints, spared * 1e6, 100.0 * max(spared, 0.0) / whole


def _solve_cells(solves: Solves | None, effect: Effect | None = None) -> tuple[Cell, Cell, Cell, Cell, Cell]:
    """Status, iterations, milliseconds, move and reason of the solve without an effect; None: with everything."""
    if effect is None:
        if solves is None:
            return None, None, None, None, ""
        state = solves.state
        return state.word, iterations(state), state.seconds.warm * 1e3, None, ""
    off = None if solves is None else solves.without.get(effect.key)
    if off is None:
        return None, None, None, None, effect.fixed
    return off.status, off.iterations, None if off.warm is None else off.warm * 1e3, off.moved, off.reason


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


def tables(scene: Scene, found: Explanation, solves: Solves | None, shell: ShellSolves | None) -> list[Table]:
    """The effects, what each costs and changes, and the shell's where it was solved."""
    return [effect_table(scene, found), cost_table(found, solves), *([shell_table(shell)] if shell else [])]


def sentences(scene: Scene, found: Explanation, solves: Solves | None) -> list[str]:
    """Sizes, what costs most, what costs and changes nothing, shell and third opinion."""
    said = _evaluation_sentences(found)
    if solves is not None:
        said += _solve_sentences(found, solves)
    if beyond_the_ribbon(scene) is not None:
        beyond = "what the scene asks for (see [tip], strip.second_moment) only the elastica has"
        return [*said, f"Ribbon and shell: none; {beyond}."]
    said.append(f"Shell: {found.shell}")
    return [*said, f"Third opinion: {found.third_opinion}."] if found.third_opinion else said


def _evaluation_sentences(found: Explanation) -> list[str]:
    whole = found.evaluation
    if whole is None:
        return []
    rows = f"{whole.constraints} constraints" if whole.constraints else "no constraints"
    said = [
        f"{found.model.capitalize()}: {whole.formulation} ({whole.why}); {whole.unknowns} unknowns, {whole.bounds} "
        f"with bounds, {rows}; one evaluation of {whole.of} {whole.seconds * 1e6:.0f} us."
    ]
    timed = [(e.seconds, e.key) for e in found.effects if e.seconds is not None]
    if timed and max(timed)[0] > 0.1 * whole.seconds:
        spared, dearest = max(timed)
        said.append(f"Dearest in an evaluation: {dearest}, {min(spared / whole.seconds, 1.0):.0%} of it.")
    return said


def _solve_sentences(found: Explanation, solves: Solves) -> list[str]:
    state = solves.state
    known = "unknown" if state.error is None else f"{state.error:.1e} l"
    warm = f"{state.seconds.warm * 1e3:.3g} ms"
    if found.evaluation is None:
        degree = "" if state.size.degree is None else f" of degree {state.size.degree}"
        said = [
            f"{found.model.capitalize()}: {state.size.label} elements{degree}; {state.message}; discretisation error "
            f"{known}, {warm} warm."
        ]
    else:
        said = [
            f"Solve: {state.word}, {iterations(state)} iterations, {warm} warm ({state.seconds.first:.3g} s the first "
            f"time); discretisation error {known}."
        ]
    if not solves.without:
        why = f"a solve takes more than {solves.limit:g} s, or --no-run; --run does it"
        possible = any(effect.on and effect.changes is not None for effect in found.effects)
        return [*said, f"Not solved without its effects: {why}."] if possible else said
    return said + _idle_sentences(found, solves, warm)


def _idle_sentences(found: Explanation, solves: Solves, warm: str) -> list[str]:
    """Which effects cost and change nothing."""
    moves = {name: off for name, off in solves.without.items() if off.moved is not None}
    small = max(YARDSTICK, solves.state.error or 0.0)
    reason = "1 permille of l" if small == YARDSTICK else f"the {found.model}'s own discretisation error"
    said = [
        f"Little changes without {name}: the shape moves by {off.moved:.1e} l, no more than {reason}; the solve "
        f"takes {(off.warm or 0.0) * 1e3:.3g} ms without and {warm} with it."
        for name, off in moves.items()
        if (off.moved or 0.0) <= small
    ]
    return said or (["Every effect that can be off alone moves the shape visibly."] if moves else [])


def result(scene: Scene, found: Explanation, solves: Solves | None, shell: ShellSolves | None) -> dict[str, Any]:
    """result.json: the contract's keys of the solve where there is one, and what was measured."""
    explanation = explanation_result(found)
    if solves is None:
        about = {"scene": scene.name, "title": scene.title, "status": "explained", "provenance": provenance(scene)}
        return {**about, "explanation": explanation, "without": None, "shell_without": shell}
    own = getattr(presenter(solves.state), "explained", None)
    return {
        **state_result(scene, solves.state),
        "explanation": explanation,
        "without": dict(solves.without),
        "shell_without": shell,
        **({} if own is None else own(explanation["effects"], solves.without)),
    }


def explanation_result(found: Explanation) -> dict[str, Any]:
    """The effects, and what the model evaluates (None where it has no such thing)."""
    whole = found.evaluation
    return {
        "model": found.model,
        "effects": [
            {
                "name": e.key,
                "on": e.on,
                "why": e.why,
                "adds": e.words,
                "off": e.changes,
                "unknowns": e.unknowns,
                "constraints": e.constraints,
                "seconds": e.seconds,
                "fixed": e.fixed,
            }
            for e in found.effects
        ],
        "unknowns": None if whole is None else whole.unknowns,
        "bounds": None if whole is None else whole.bounds,
        "constraints": None if whole is None else whole.constraints,
        "formulation": None if whole is None else whole.formulation,
        "formulation_why": None if whole is None else whole.why,
        "evaluation": None if whole is None else whole.seconds,
        "third_opinion": found.third_opinion,
        "shell": found.shell,
    }


def write(
    out: Path, scene: Scene, found: Explanation, solves: Solves | None, shell: ShellSolves | None, again: str
) -> None:
    """Writes result.json and page.json into `out`."""
    data = result(scene, found, solves, shell)
    atomic_write_json(out / "result.json", data)
    page = Page(
        command="explain",
        title=f"{scene.title}: effects",
        verdict=tuple(sentences(scene, found, solves)),
        tables=tuple(tables(scene, found, solves, shell)),
        files={"result.json": "everything measured"},
        scene=scene.to_toml(),
        up=upwards(scene),
        provenance=data["provenance"],
        again=again,
    )
    write_page(out, page)
