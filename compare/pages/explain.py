"""What `ribbonbench explain` says: tables, sentences, result and page, from the measured effects."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from compare.measure.grades import YARDSTICK
from compare.models import RICHEST
from compare.models.base import Effect
from compare.page.drawing import pictured
from compare.page.page import Picture
from compare.page.state import DIMENSIONS
from compare.page.study import Study
from compare.page.table import Column, Table
from compare.page.verdict import Verdict
from compare.page.wording import length
from compare.pages.presenter import presenter
from compare.pages.result import state_result
from compare.record.quantity import Quantity
from compare.record.views import document
from compare.scene.scene import Scene
from compare.store.made_by import provenance
from compare.studies.checks import effects, of_state
from compare.studies.effects import Explanation
from compare.studies.effects_measured import ShellSolves, ShellWithout, Solves, iterations
from compare.studies.priced.effects import PricedEffect, PricedEffects

#: The picture of the bars.
BARS = "effects.png"

_EFFECTS: tuple[Quantity[Effect], ...] = (
    Quantity("effect", "effect", kind="word", rank=0, of=lambda e: e.key),
    Quantity("on", "on", kind="truth", rank=0, of=lambda e: e.on),
    Quantity("why", "why", kind="word", rank=1, of=lambda e: e.why),
    Quantity("adds", "what it adds", kind="word", rank=2, of=lambda e: e.words),
)
_EFFECT = Column("effect", "effect", kind="word", rank=0)
_EVALUATION = (
    Column("unknowns", "unknowns", kind="integer", rank=4),
    Column("constraints", "constraints", kind="integer", rank=4),
    Column("evaluation", "evaluation us", "s", "microseconds:1", legend="of all that the minimiser asks for, median of "
           "differences timed in turns", rank=2),
    Column("evaluation_share", "of it %", kind="percent:0", rank=5),
)  # fmt: skip
_SOLVE = (
    Column("status", "status without it", kind="word", legend="of the whole solve from the scene's own seed, as are "
           "iterations and time (warm, median of repeats)", rank=3),
    Column("iterations", "iterations", kind="integer", rank=4),
    Column("seconds", "solve ms", "s", "milliseconds:3", rank=1),
)  # fmt: skip
_MOVES = {
    True: "Hausdorff distance between the shapes with and without it, in l (of a strip that no clamp holds, after the "
    "best rigid motion)",
    False: "largest distance between the centrelines",
}
#: Part of the length below which a move is rounding.
_ROUNDING = 1e-12
#: Effects of which it is said why they have no number.
_BY_NAME = ("contact with itself", "finite thickness")
_REASON = Column("reason", "why not", kind="word", rank=3)


def effect_table(scene: Scene, found: Explanation) -> Table:
    """Which effects are on, and why."""
    return Table.of(f"{scene.title}: effects", _EFFECTS, found.effects)


def cost_table(found: Explanation, solves: Solves | None) -> Table:
    """What each effect that is on costs and changes; the whole scene in the first row."""
    whole = found.evaluation
    moves = Column("moves", "moves", "l", "exponent:1", legend=_MOVES[solves is None or solves.surface], rank=1)
    rows: list[dict[str, Any]] = [{"effect": "everything on", "reason": ""}]
    if whole is not None:
        sizes = {"unknowns": whole.unknowns, "constraints": whole.constraints}
        rows[0] |= {**sizes, "evaluation": whole.seconds}
    if solves is not None:
        state = solves.state
        rows[0] |= {"status": state.word, "iterations": iterations(state), "seconds": state.seconds.warm}
    for effect in found.effects:
        row = _without(effect, found, solves)
        if effect.on and (whole is not None or any(row[key] for key in row if key != "effect")):
            rows.append(row)
    columns = (_EFFECT, *(() if whole is None else _EVALUATION), *_SOLVE, moves, _REASON)
    title = "What each costs, and what changes without it"
    legend = "First row: with everything; below: differences to the same scene with this effect alone switched off"
    return Table.of_records(title, columns, rows, legend + ("." if whole is None else ", in the same formulation."))


def _without(effect: Effect, found: Explanation, solves: Solves | None) -> dict[str, Any]:
    """What is spared, and what the solve is, without an effect; what is not known is left out."""
    row: dict[str, Any] = {"effect": effect.key, "reason": effect.fixed}
    whole, spared = found.evaluation, effect.seconds
    if whole is not None:
        row |= {"unknowns": effect.unknowns, "constraints": effect.constraints, "evaluation": spared}
        row["evaluation_share"] = None if spared is None else max(spared, 0.0) / whole.seconds
    off = None if solves is None else solves.without.get(effect.key)
    if off is not None:
        row |= {"status": off.status, "iterations": off.iterations, "seconds": off.warm, "moves": off.moved}
        row["reason"] = off.reason
    return row


_PRICED: tuple[Column, ...] = (
    _EFFECT,
    Column("on", "on", kind="truth", rank=0),
    Column("moves_mm", "moves mm", "mm", "digits:3", rank=1),
    Column("moves", "moves %", "l", "share:3", rank=1, legend="how far the strip moves when the effect is switched, in "
           "% of l"),
    Column("known_by", "by", kind="word", rank=1, legend="what tells it: first order (the particle that moves most) "
           "where that is good to half of itself, else whole solves (the surfaces); an estimate has no error; -: not "
           "known"),
    Column("solved", "solved %", "l", "share:3", rank=3, legend="by whole solves with and without it"),
    Column("first_order", "first order %", "l", "share:3", rank=3, legend="by the state's own tangent"),
    Column("moves_error", "± %", "l", "share:3", rank=3, legend="how far first order may be off; -: further than it is "
           "worth"),
    Column("energy", "energy %", "", "share:3", rank=2, legend="what it holds or releases in this state, of a load the "
           "work that it does, over the elastic energy"),
    Column("force", "force %", "", "share:3", rank=2, legend="change of the force of what holds the strip"),
    Column("seconds", "ms", "s", "milliseconds:3", rank=1, legend="CPU time that it adds to a warm solve, median of "
           "pairs in turns"),
    Column("spread", "± ms", "s", "milliseconds:3", rank=3, legend="half the distance of their quartiles"),
    Column("share", "of it %", "", "percent:0", rank=4, legend="of the solve with it"),
    Column("why", "why", kind="word", rank=5),
)  # fmt: skip


def priced_table(scene: Scene, prices: PricedEffects) -> Table:
    """Every effect that has a number, on or off, those that move the strip most first."""
    size = scene.units.length
    records: list[dict[str, Any]] = [
        {
            "effect": row.priced.effect,
            "on": row.priced.on,
            "moves_mm": _millimetres(size, _told(row.moves)),
            "moves": _told(row.moves),
            "known_by": row.known_by,
            "solved": _told(row.solved),
            "first_order": _told(row.priced.moves),
            "moves_error": _told(row.priced.moves_error),
            "energy": row.priced.energy,
            "force": row.priced.force_share,
            "seconds": None if row.cost is None else row.cost.seconds,
            "spread": None if row.cost is None else row.cost.spread,
            "share": None if row.cost is None else row.cost.share,
            "why": row.priced.why,
        }
        for row in prices.rows
        if row.moves is not None or row.priced.moves is not None or row.cost is not None
    ]
    columns = [column for column in _PRICED if column.key != "moves_mm" or size is not None]
    legend = "One effect switched alone, on or off, what moves the strip most first."
    return Table.of_records(f"{scene.title}: what each effect is worth", columns, records, legend)


def _millimetres(size: float | None, moves: float | None) -> float | None:
    """A distance over l as one in mm, of a strip of this length (m)."""
    return None if size is None or moves is None else 1e3 * size * moves


def _told(value: float | None) -> float | None:
    """A distance over l without rounding: zero below `_ROUNDING`."""
    return value if value is None or value >= _ROUNDING else 0.0


def _priced_sentences(scene: Scene, solves: Solves | None, prices: PricedEffects) -> list[str]:
    """What has no first order, by name, what ends in another state, and what has no number at all."""
    said = [f"No first order: {prices.refused}."] if prices.refused else []
    own = 0.0 if solves is None else solves.state.error or 0.0
    for row in prices.rows:
        if row.elsewhere(own):
            said.append(
                f"Solved anew, {row.priced.effect} ends in another state, {length(scene.units, row.solved)} away: "
                "first order is of this one."
            )
    doubtful = [row.priced.effect for row in prices.rows if row.priced.doubtful and row.solved is None]
    if doubtful:
        said.append(
            f"First order says nothing here of {', '.join(doubtful)}: the step that would follow is no shorter than "
            "half of the first."
        )
    for row in prices.rows:
        if row.priced.on or row.priced.moves is not None or row.solved is not None:
            continue
        if "no finite tangent" in row.priced.why or row.priced.effect in _BY_NAME:
            said.append(f"{row.priced.effect.capitalize()}: {row.priced.why}.")
    return said


_SHELLS: tuple[Quantity[ShellWithout], ...] = (
    Quantity("effect", "without", kind="word", words={"": "everything on"}, rank=0, of=lambda r: r.name),
    Quantity("status", "status", kind="word", rank=3, of=lambda r: r.status),
    Quantity("iterations", "Newton iterations", kind="integer", rank=4, of=lambda r: r.iterations),
    Quantity("seconds", "solve s", "s", "seconds:3", rank=1, of=lambda r: r.seconds),
    Quantity("moves", "moves", "l", "exponent:1", rank=1,
            legend="Hausdorff distance to the shell with all effects, in l", of=lambda r: r.moved),
    Quantity("error", "own error", "l", "exponent:1", legend="the distance to half the mesh", rank=2,
             of=lambda r: r.error),
    Quantity("reason", "why not", kind="word", rank=3, of=lambda r: r.reason),
)  # fmt: skip


def shell_table(measured: ShellSolves) -> Table:
    """The shell with and without its effects."""
    along, across = measured.elements
    return Table.of(
        f"The shell, w/h = {measured.width_to_thickness:g}, {along} x {across} elements",
        _SHELLS,
        measured.rows,
        "The whole solve along its path, without compilation, in one run. Shear of a shell also takes off torsion at "
        "its free edges, by 0.63 h / w: of a ribbon that belongs to its finite thickness.",
    )


def tables(
    scene: Scene, found: Explanation, solves: Solves | None, shell: ShellSolves | None,
    prices: PricedEffects | None = None, wide: bool = True,
) -> list[Table]:  # fmt: skip
    """What each effect is worth; the effects, and what each costs and changes (beside the first where `wide`); the
    shell's where it was solved."""
    first = [] if prices is None else [priced_table(scene, prices)]
    others = [effect_table(scene, found), cost_table(found, solves)] if wide or prices is None else []
    return [*first, *others, *([shell_table(shell)] if shell else [])]


def answer(
    scene: Scene, found: Explanation, solves: Solves | None, prices: PricedEffects | None = None
) -> Verdict:  # fmt: skip
    """Which effects are on, which of them moves the shape most, of which of those that are off nothing is known, and
    which of the others would; the grade is that of the solve behind it and of what is known of the moves."""
    on = [effect.key for effect in found.effects if effect.on]
    text = f"{len(on)} of {len(found.effects)} effects are on: {', '.join(on)}" if on else "No effect is on"
    if solves is None:
        return Verdict(text)
    checks = [*of_state(scene, solves.state), effects(prices, solves.state.error or 0.0)]
    if not solves.state.ok:
        return Verdict.of("explain", f"{text}; no stable equilibrium: {solves.state.message}", checks)
    moves = {name: off.moved for name, off in solves.without.items() if off.moved is not None}
    if moves:
        most = max(moves, key=lambda name: moves[name] or 0.0)
        text += f"; without {most} the shape would move most, by {length(scene.units, moves[most])}"
    left = [row for row in prices.rows if not row.priced.on] if prices else []
    unknown = [row.priced.effect for row in left if row.priced.effect in (prices.untold if prices else ())]
    if unknown:
        text += f"; how far {' and '.join(unknown)} would move it is not known"
    out = [row for row in left if (row.moves or 0.0) > _ROUNDING]
    if out:
        first = out[0].priced
        by = length(scene.units, out[0].moves)
        known = " and is known" if unknown else ""
        why = "" if first.effect in first.why else f" ({first.why})"  # what has no tangent repeats its name
        text += f"; of what is left out{known} {first.effect}{why} would move it most, by {by}"
    return Verdict.of("explain", text, checks).doubted(*(("effects",) if unknown else ()))


def sentences(
    scene: Scene, found: Explanation, solves: Solves | None, prices: PricedEffects | None = None
) -> list[str]:  # fmt: skip
    """What has no first order, sizes, what costs most, what costs and changes nothing, shell and third opinion."""
    lines = [*(_priced_sentences(scene, solves, prices) if prices else []), *_evaluation_sentences(found)]
    if solves is not None:
        lines += _solve_sentences(found, solves)
    if scene.strip.second_moment is not None:
        return [*lines, "Ribbon and shell: none; the rod of strip.second_moment only the elastica has."]
    lines.append(f"Shell: {found.shell}")
    return [*lines, f"Third opinion: {found.third_opinion}."] if found.third_opinion else lines


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
    untold = [f"{name} ({off.status})" for name, off in solves.without.items() if off.moved is None and not off.reason]
    if untold:
        said.append(f"How far the shape would move is not known without {', '.join(untold)}.")
    return said or (["Every effect that can be off alone moves the shape visibly."] if moves else [])


def result(
    scene: Scene, found: Explanation, solves: Solves | None, shell: ShellSolves | None,
    prices: PricedEffects | None = None,
) -> dict[str, Any]:  # fmt: skip
    """result.json: the contract's keys of the solve where there is one, and what was measured."""
    explanation = explanation_result(found)
    if solves is None:
        about = {"scene": scene.name, "title": scene.title, "status": "explained", "provenance": provenance(scene)}
        return {
            **about,
            **document(DIMENSIONS, scene),
            "explanation": explanation,
            "without": None,
            "shell_without": shell,
        }
    return {
        **state_result(scene, solves.state),
        "explanation": explanation,
        "without": dict(solves.without),
        "shell_without": shell,
        "prices": None if prices is None else [_price_result(row) for row in prices.rows],
        "prices_why": "" if prices is None else prices.refused,
        **presenter(solves.state).explained(explanation["effects"], solves.without),
    }


def _price_result(row: PricedEffect) -> dict[str, Any]:
    """An effect of result.json's ``prices``: moves over l, shares of 1, times in s."""
    one, cost = row.priced, row.cost
    return {
        "effect": one.effect,
        "on": one.on,
        "moves": row.moves,
        "moves_known_by": row.known_by,
        "moves_first_order": one.moves,
        "moves_error": one.moves_error,
        "moves_solved": row.solved,
        "energy_share": one.energy,
        "force": one.force,
        "force_share": one.force_share,
        "seconds": None if cost is None else cost.seconds,
        "seconds_error": None if cost is None else cost.spread,
        "seconds_share": None if cost is None else cost.share,
        "pairs": None if cost is None else cost.pairs,
        "why": one.why,
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
        RICHEST: found.shell,
    }


def write(
    out: Path, scene: Scene, found: Explanation, solves: Solves | None, shell: ShellSolves | None, again: str,
    prices: PricedEffects | None = None,
) -> None:  # fmt: skip
    """Writes result.json, page.json and, where effects have prices, their bars into `out`."""
    pictures: tuple[Picture, ...] = ()
    if prices is not None and pictured(lambda: _bars(out / BARS, scene, prices)):
        known = [(row.priced.effect, row.moves or 0.0) for row in prices.rows if (row.moves or 0.0) > _ROUNDING]
        moves = [f"{effect} {100.0 * move:.2g} %" for effect, move in known[:5]]
        alt = f"Bars of how far each effect moves the strip, on a logarithmic axis: {', '.join(moves)} of the length"
        pictures = (Picture(BARS, alt, "How far each effect moves the strip, in % of its length."),)
    Study(
        "explain",
        f"{scene.title}: effects",
        verdict=answer(scene, found, solves, prices),
        tables=tuple(tables(scene, found, solves, shell, prices)),
        sentences=tuple(sentences(scene, found, solves, prices)),
        pictures=pictures,
        files={"result.json": "everything measured"},
    ).write(out, result(scene, found, solves, shell, prices), again, scene)


def _bars(path: Path, scene: Scene, prices: PricedEffects) -> None:
    from compare.pages.pictures.effects import effects_picture

    effects_picture(path, scene.title, prices)
