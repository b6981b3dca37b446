"""The measured cost of accuracy as sentences, tables, a picture, result.json and page.json."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from compare.measure.front import Reach, reach
from compare.measure.grades import GOOD, GOOD_UP_TO, POOR, YARDSTICK, grade
from compare.models import RICHEST
from compare.models.quantities.ladders import NAMES
from compare.page.page import Picture
from compare.page.si import with_si
from compare.page.study import Study
from compare.page.table import Column, Table
from compare.page.verdict import Check, Verdict
from compare.pages.pictures.cost import picture
from compare.pages.result import state_result
from compare.record.quantity import Quantity
from compare.studies.cost_plan import FAR, Cost, Party, Reference, Row

COLUMNS: tuple[Quantity[Row], ...] = (
    Quantity("solver", "solver", kind="word", words=NAMES, rank=0, of=lambda r: r.run.solver),
    Quantity("size", "size", kind="word", rank=0, of=lambda r: r.run.label),
    Quantity("unknowns", "unknowns", kind="integer", rank=4, of=lambda r: r.run.unknowns),
    Quantity("status", "status", kind="word", rank=2, of=lambda r: r.run.status),
    Quantity("error", "error", "l", "exponent:1", rank=1, of=lambda r: r.error,
             legend="discretisation, Hausdorff distance over l to the reference of the same model"),
    Quantity("error_end", "error of end", "l", "exponent:1", legend="the same of the centreline's end point",
             of=lambda r: r.error_end),
    Quantity("shown", "above its reference's", kind="truth", legend="the error exceeds the reference's own; otherwise "
            "only that bound is known", rank=3, of=lambda r: r.shown),
    Quantity("distance", "distance", "l", "exponent:1", legend="to the common reference, the difference of the models "
            "included", rank=2, of=lambda r: r.distance),
    Quantity("distance_end", "distance of end", "l", "exponent:1", legend="the same of the end point",
             of=lambda r: r.distance_end),
    Quantity("seconds", "warm s", "s", "seconds:3", legend="the solve alone, median of the runs", rank=1,
             of=lambda r: r.run.warm),
    Quantity("seconds_least", "least s", "s", "seconds:3", note="the fastest run",
             of=lambda r: min(r.run.seconds, default=None)),
    Quantity("seconds_most", "most s", "s", "seconds:3", note="the slowest",
             of=lambda r: max(r.run.seconds, default=None)),
    Quantity("runs", "runs", kind="integer", of=lambda r: len(r.run.seconds)),
    Quantity("reused", "kept", kind="truth", legend="a time measured by an earlier run on this machine and these "
            "versions", of=lambda r: r.run.reused),
)  # fmt: skip


# -- sentences --------------------------------------------------------------------------------------------------------


def seconds_text(value: float) -> str:
    """A time with its unit."""
    return f"{value * 1e3:.3g} ms" if value < 1.0 else f"{value:.3g} s"


def _reach_text(name: str, found: Reach) -> str:
    if found.seconds is None:
        return f"{name} does not reach it: {found.best.error:.1e} at best ({found.best.label})"
    sizes = " to ".join(mark.label for mark in found.between)
    if found.bound:
        return f"{name} needs at most {seconds_text(found.seconds)} ({sizes}, error {found.between[0].error:.1e})"
    return f"{name} needs {seconds_text(found.seconds)} ({sizes})"


def _target(value: float) -> str:
    return f"{value * 1e3:g} permille of l"


def _models(cost: Cost) -> list[str]:
    return list(dict.fromkeys(row.model for row in cost.rows))


def _reached(cost: Cost, target: float, common: bool) -> dict[Party, Reach]:
    """What the target takes, by party."""
    found = {party: reach(cost.marks(party.model, common, party.near), target) for party in cost.parties}
    return {party: value for party, value in found.items() if value is not None}


def _factor(quick: str, slow: str, ratio: float) -> str:
    """How much faster one party is than another, whichever that is; ratio: of the times, slow over quick."""
    if ratio < 1.0:
        return f"the {slow} is faster than the {quick}, by a factor {1.0 / ratio:.3g}"
    return f"a factor {ratio:.3g} from {quick} to {slow}"


def _said(cost: Cost, target: float, common: bool) -> str | None:
    """One sentence for one target: what each model needs, and the factor where two reach it."""
    found = _reached(cost, target, common)
    if not found:
        return None
    parts = [_reach_text(f"the {party.words}", value) for party, value in found.items()]
    text = f"to {_target(target)} " + "; ".join(parts)
    reached = {party: value for party, value in found.items() if value.seconds}
    for party, value in reached.items():
        for slow, other in reached.items():
            if slow.model == RICHEST != party.model:
                assert value.seconds is not None
                assert other.seconds is not None
                text += "; " + _factor(party.words, slow.words, other.seconds / value.seconds)
                text += ", between the runs named" if other.bound or value.bound else ""
    return text


def _own_errors(cost: Cost) -> str:
    return ", ".join(
        f"{r.model} {r.what}: {'unknown' if r.error is None else f'{r.error:.1e}'} (against {r.checked})"
        for r in cost.references
    )


def plateau(cost: Cost, model: str) -> float | None:
    """The distance (l) of the most accurate run of a model to the common reference, where it is ten times its own
    discretisation error and above that of the reference: the difference of the models. None otherwise."""
    rows = [r for r in cost.rows if r.model == model and r.run.ok and r.error is not None and r.distance is not None]
    if cost.common is None or cost.common.model == model or cost.common.error is None or not rows:
        return None
    best = min(rows, key=lambda row: row.error or 0.0)
    assert best.error is not None
    assert best.distance is not None
    return best.distance if best.distance > 10.0 * best.error and best.distance > cost.common.error else None


def answer(cost: Cost) -> Verdict:
    """What the fast models need for the first target that one of them reaches, in total error where there is a common
    reference, and what the others need; good where that is good between models, or 1 permille of discretisation."""
    common = cost.common
    kind = "discretisation error" if common is None else f"total error, against the {common.model}"
    targets = [target for target in sorted({YARDSTICK, *cost.plan.targets}) if target >= YARDSTICK]
    reached = {target: _seconds(cost, target) for target in targets}
    richest = RICHEST if common is None else common.model
    fast = next((t for t in targets if any(party.model != richest for party in reached[t])), None)
    alone = next((t for t in targets if reached[t]), None)
    left = "".join(f"; the {model} is left out, {100 * far:.2g} % of l away" for model, far in cost.far.items())
    if alone is None:
        return Verdict.of("cost", f"No run reaches a {kind} of 1 permille of l{left}", _checks(cost, None, ()))
    target = alone if fast is None else fast
    known = reached[target]
    each = ", ".join(f"the {party.words} {seconds_text(seconds)}" for party, seconds in known.items())
    quick = min((seconds for party, seconds in known.items() if party.model != RICHEST), default=None)
    slow = [seconds for party, seconds in known.items() if party.model == RICHEST]
    factors = [seconds / quick for seconds in slow] if quick else []
    factor = f", factors {' and '.join(f'{f:.3g}' for f in factors)}" if len(factors) > 1 else ""
    factor = f", a factor {factors[0]:.3g}" if len(factors) == 1 else factor
    text = f"To {_target(target)} of {kind} {each}{factor if min(factors, default=0.0) > 1.0 else ''}"
    if alone < target:
        only = ", ".join(f"the {party.words} {seconds_text(seconds)}" for party, seconds in reached[alone].items())
        text += f"; to {_target(alone)} only {only}"
    return Verdict.of("cost", text + left, _checks(cost, target, [party.model for party in known]))


def _checks(cost: Cost, target: float | None, models: Sequence[str]) -> list[Check]:
    """What the answer rests on: target, the error that was reached, None: none; models: those that it names."""
    if target is None:
        reached = Check("reached", POOR, "no run reaches the yardstick", None, YARDSTICK)
    else:
        kind = "error" if cost.common is None else "distance"
        text = f"an error of {target:.0e} l is reached"
        reached = Check("reached", grade(kind, target), text, target, GOOD_UP_TO[kind])
    far = [model for model in models if model in cost.far]
    return [
        reached,
        Check("read", GOOD, "a model that would ignore a key takes no part"),
        Check("near", POOR if far else GOOD, f"farther than {FAR:g} l: {', '.join(far) or 'none named'}", bound=FAR),
    ]


def _seconds(cost: Cost, target: float) -> dict[Party, float]:
    """What the parties that reach a target need (s), in total error where there is a common reference."""
    found = _reached(cost, target, cost.common is not None)
    return {party: value.seconds for party, value in found.items() if value.seconds}


def sentences(cost: Cost) -> list[str]:
    """The verdict: discretisation errors, the common reference, first calls, what is missing."""
    said = [
        f"The {model} is {far:.1e} l from the common reference, farther than {FAR:g} l: it is in another state, or no "
        "model of this scene, and is left out of fronts and times."
        for model, far in cost.far.items()
    ]
    for target in cost.plan.targets:
        text = _said(cost, target, common=False)
        if text is not None:
            said.append(f"Discretisation, each model against its own reference: {text}.")
    if any(row.near for row in cost.rows):
        said.append(_near_text(cost))
    said.append(f"Errors of the references (/ l): {_own_errors(cost)}.")
    if cost.common is not None:
        targets = (YARDSTICK,) if YARDSTICK in cost.plan.targets else cost.plan.targets  # the table has them all
        for target in targets:
            text = _said(cost, target, common=True)
            if text is not None:
                said.append(f"Against one reference, {_common_text(cost.common)}: {text}.")
        for model in _models(cost):
            rest = plateau(cost, model)
            if rest is not None:
                said.append(
                    f"The {model} ends {rest:.1e} l from that reference however fine it is: the models differ by that."
                )
    for start in cost.starts:
        more = "" if start.compiled is None else f", {start.compiled:.3g} s when everything has to be compiled"
        name = NAMES.get(start.solver, start.solver)
        said.append(f"A fresh process adds {start.seconds:.3g} s to a solve by the {name}{more}.")
    spent = cost.machine
    threads = ", ".join(f"{k}={v}" for k, v in spent["threads"].items()) or "no thread variable set"
    said.append(f"Times: medians of up to {cost.plan.repeats} runs, {spent['cpu']}, {spent['cores']} cores, {threads}.")
    hidden = [row.label for row in cost.rows if row.shown is False]
    if hidden:
        said.append(f"Not above the error of their own reference, and drawn there: {', '.join(hidden)}.")
    failed = [f"{row.label} ({row.run.status})" for row in cost.rows if not row.run.ok]
    if failed:
        said.append(f"Without a stable solution: {', '.join(failed)}.")
    said += [f"Left out: {text}." for text in cost.left_out]
    return said


def _near_text(cost: Cost) -> str:
    """What it means to begin at the surface of the model beside, and where runs on their own began."""
    base = cost.base
    beside = "the ribbon's" if base is None else f"the {base.model}'s"
    warm = "" if base is None else f" ({seconds_text(base.seconds.warm)} more)"
    own = {row.run.begun for row in cost.rows if row.model == RICHEST and not row.near and row.run.begun}
    refused = [row.label for row in cost.rows if row.near and row.run.begun.startswith("path")]
    text = (
        f"The shell from {beside} surface{warm} settles there at the full load, its inertia checked; on its own it "
        f"knows no ribbon and begins with {' or '.join(_BEGUN.get(word, word) for word in sorted(own)) or 'its path'}"
    )
    return text + (f". Refused, and the path walked: {', '.join(refused)}." if refused else ".")


_BEGUN = {"path": "its path", "coarse path": "its path on a coarse mesh"}


def _common_text(reference: Reference) -> str:
    error = "unknown" if reference.error is None else f"{reference.error:.1e}"
    return f"the {reference.model} ({reference.what}; own error {error} l)"


# -- tables -----------------------------------------------------------------------------------------------------------


def table(cost: Cost) -> Table:
    """Every run."""
    return Table.of("Runs", COLUMNS, cost.rows)


_REACHED = (
    Column("kind", "error", kind="word", legend="discretisation, or total: distance to the common reference and that "
           "one's own error; a distance counts at least as much as the run's own discretisation error, as a coarse run "
           "may be near another model by accident", rank=2),
    Column("target", "target / l", "l", "exponent:0", rank=0),
    Column("model", "model", kind="word", rank=0),
    Column("seconds", "s", "s", "seconds:3", legend="interpolated in log-log between neighbours on the model's Pareto "
           "front, never beyond it; -: not reached", rank=1),
    Column("at_most", "at most", kind="truth", legend="the fastest run is more accurate than asked for", rank=3),
    Column("between", "between", kind="word", rank=3),
    Column("best_error", "best error / l", "l", "exponent:1", rank=4),
)  # fmt: skip


def reach_table(cost: Cost) -> Table:
    """Times for the targets, by model and kind of error."""
    rows = []
    for common in (False, True) if cost.common is not None else (False,):
        for target in cost.plan.targets:
            for party, found in _reached(cost, target, common).items():
                how = (
                    " to ".join(mark.label for mark in found.between)
                    if found.seconds is not None
                    else f"best: {found.best.label}"
                )
                kind = "total, against the common reference" if common else "discretisation"
                rows.append((kind, target, party.words, found.seconds, found.bound, how, found.best.error))
    return Table("Time to reach an error", _REACHED, tuple(rows))


# -- files of the whole measurement -----------------------------------------------------------------------------------


def _alt(cost: Cost) -> str:
    words = " ".join(sentences(cost)[: 1 + len(cost.plan.targets)])
    kinds = "two diagrams" if cost.common is not None else "a diagram"
    return f"{kinds} of error against time of a warm solve, both logarithmic, one curve for each solver. {words}"


def result(cost: Cost) -> dict[str, Any]:
    """`result.json`: the contract's keys of the scene's own state, and the measurement under `cost`."""
    document = state_result(cost.scene, cost.base)
    document["cost"] = result_of(cost)
    document["complete"] = cost.ok
    return document


def result_of(cost: Cost) -> dict[str, Any]:
    """The entry `cost` of result.json."""
    return {
        "machine": cost.machine,
        "plan": cost.plan,
        "left_out_beyond": FAR,
        "far": cost.far,
        "references": [
            {"model": r.model, "what": r.what, "error": r.error, "checked_against": r.checked} for r in cost.references
        ],
        "common": None if cost.common is None else cost.common.model,
        "rows": [
            {
                "solver": row.run.solver, "model": row.model, "size": row.run.label, "unknowns": row.run.unknowns,
                "status": row.run.status, "ok": row.run.ok, "energy": row.run.energy,
                "error": row.error, "error_end": row.error_end,
                "above_reference_error": row.shown, "distance": row.distance, "distance_end": row.distance_end,
                "above_common_error": row.distance_shown, "reused": row.run.reused,
                "seconds": {"warm": row.run.warm, "runs": row.run.seconds, "start": row.run.start},
            }
            for row in cost.rows
        ],
        "starts": cost.starts,
        "targets": reach_table(cost).records(),
        "left_out": cost.left_out,
        "sentences": sentences(cost),
    }  # fmt: skip


def write(out: Path, cost: Cost, again: str) -> None:
    """result.json, table.csv, cost.png, page.json; `again`: the command that makes them again."""
    picture(out / "cost.png", cost)
    runs = table(cost)
    Study(
        "cost",
        f"{cost.scene.title}: what accuracy costs",
        verdict=answer(cost),
        tables=(reach_table(cost), runs),
        sentences=tuple(sentences(cost)),
        pictures=(Picture("cost.png", _alt(cost), "Error against time"),),
        data={"table.csv": with_si(runs, cost.scene.units)},
        files={"result.json": "all numbers", "table.csv": "every run"},
    ).write(out, result(cost), again, cost.scene)


__all__ = ["picture", "reach_table", "result", "sentences", "table", "write"]
