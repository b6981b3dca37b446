"""What `ribbonbench check` says and writes: the claims with their numbers, and pins that hold with a margin."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from compare.measure.grades import GOOD, POOR, UNKNOWN, worst
from compare.page import verdict as page
from compare.page.study import Study
from compare.page.table import Table
from compare.pages.result import row_result
from compare.record.quantity import DATA, Quantity
from compare.record.views import document
from compare.scene.scene import shipped
from compare.store.made_by import provenance
from compare.store.provenance import versions
from compare.store.store import atomic_write_text
from compare.studies.agreement.verdict import Claim, Outcome, Verdict, up

PINS = "agreements.toml"
_COLUMNS: tuple[Quantity[tuple[Outcome, Claim]], ...] = (
    Quantity("scene", "scene", kind="word", rank=0, of=lambda p: p[0].pin.scene.name),
    Quantity("width_to_thickness", "w/h", kind="digits", rank=1, of=lambda p: p[1].width_to_thickness),
    Quantity("claim", "claim", kind="word", rank=1, of=lambda p: p[1].what),
    Quantity("bound", "bound", kind="interval", legend="the largest value claimed; of a slope both ends", rank=1,
             of=lambda p: p[1].bound),
    Quantity("value", "value", kind="digits:3", legend="distance (Hausdorff, in l), membrane share of the shell's "
            "elastic energy, or slope", rank=1, of=lambda p: p[1].value),
    Quantity("error", "error", kind="exponent:1", legend="of the discretisations, by refinement", rank=2,
             of=lambda p: p[1].error),
    Quantity("ribbon_error", "ribbon error", "l", "exponent:1", of=lambda p: p[1].ribbon_error),
    Quantity("shell_error", "shell error", "l", "exponent:1", of=lambda p: p[1].shell_error),
    Quantity("verdict", "verdict", kind="word", legend="agreed: value + error is within the bound; disproved: value - "
            "error is beyond it; undecided: neither, which is no agreement", rank=0, of=lambda p: p[1].verdict.value),
    Quantity("proves", "proves", kind="exponent:2", legend="the smallest bound that these meshes prove", rank=4,
             of=lambda p: p[1].provable),
)  # fmt: skip
#: Without a claim (pins yet to be made) there is no bound, and no verdict but a failure.
_PINNED: dict[str, Callable[[tuple[Outcome, Claim]], Any]] = {
    "bound": lambda p: None,
    "verdict": lambda p: None if p[1].verdict is Verdict.AGREED else p[1].verdict.value,
}
_WORDS = {
    Verdict.AGREED: "agreed: every claim holds, discretisation errors included.",
    Verdict.UNDECIDED: "not agreed: undecided, the discretisation errors are too large for a claim.",
    Verdict.DISPROVED: "not agreed: a claim is disproved.",
    Verdict.UNSOLVED: "not agreed: a model is not at a stable equilibrium.",
}


def table(outcomes: Sequence[Outcome], pinned: bool = False) -> Table:
    """One row for each claim; `pinned`: without bounds, as none was claimed."""
    columns = [replace(q, of=_PINNED.get(q.key, q.of)) if pinned else q for q in _COLUMNS]
    claims = [(outcome, claim) for outcome in outcomes for claim in outcome.claims]
    return Table.of("Agreement of ribbon and shell", columns, claims)


#: The grade of each verdict, the worst of several counts.
_GRADES = {Verdict.AGREED: GOOD, Verdict.UNDECIDED: UNKNOWN, Verdict.DISPROVED: POOR, Verdict.UNSOLVED: POOR}


def answer(outcomes: Sequence[Outcome], pinned: bool = False) -> page.Verdict:
    """Whether ribbon and shell agree as closely as is claimed."""
    agreed = sum(outcome.agreed for outcome in outcomes)
    claims = "; ".join(claim.says for claim in outcomes[0].claims)
    yes = "agree as claimed" if agreed else "are not shown to agree as claimed"
    text = f"Ribbon and shell {yes}: {claims}"
    if pinned and agreed == len(outcomes):
        text = "Ribbon and shell were measured, and the claims that hold are pinned"
    elif len(outcomes) > 1:
        text = f"Ribbon and shell agree as claimed in {agreed} of {len(outcomes)} pins"
    return page.Verdict.of("check", text, _checks(outcomes))


def _checks(outcomes: Sequence[Outcome]) -> list[page.Check]:
    """What the answer rests on: that both models were solved, and what came of every claim."""
    unsolved = sum(outcome.verdict is Verdict.UNSOLVED for outcome in outcomes)
    count = len(outcomes)
    grade = worst(*(_GRADES[outcome.verdict] for outcome in outcomes)) if count else UNKNOWN
    agreed = sum(outcome.agreed for outcome in outcomes)
    return [
        page.Check("solved", POOR if unsolved else GOOD, f"{count - unsolved} of {count} solved by both models"),
        page.Check("agreed", grade, f"{agreed} of {count} agreed"),
    ]


def sentences(outcomes: Sequence[Outcome], pinned: bool = False) -> list[str]:
    """A verdict, and every claim that does not hold."""
    said = [
        f"{outcome.pin.label}: {claim.says}."
        for outcome in outcomes
        for claim in outcome.claims
        if claim.verdict is not Verdict.AGREED
    ]
    agreed = sum(outcome.agreed for outcome in outcomes)
    if pinned and agreed == len(outcomes):
        said = ["Measured; the bounds of the pins are the values and twice their errors, rounded upwards."]
        claims = [claim for outcome in outcomes for claim in outcome.claims]
        if any((claim.error or 0.0) > (claim.value or 0.0) for claim in claims):
            said.append("An error exceeds its value: finer meshes (--set shell.elements=[...]) make a sharper pin.")
        return said
    if len(outcomes) == 1:
        return [f"{outcomes[0].pin.label}: {_WORDS[outcomes[0].verdict]}", *said]
    return [f"{agreed} of {len(outcomes)} pins agreed.", *said]


def pins_text(outcomes: Sequence[Outcome]) -> str:
    """[[agreement]]s with bounds of the measured values and twice their errors; one for each w/h that was solved."""
    lines = [
        "# What separates ribbon and shell, as claims: `ribbonbench check FILE` or compare.check.assert_pin.",
        "# Bounds: the values measured and twice their discretisation errors, rounded upwards.",
    ]
    for outcome in outcomes:
        pin = outcome.pin
        name = pin.scene.name if pin.scene.name in shipped() else f"{pin.scene.name}.toml"
        for row in outcome.comparison.rows:
            claims = [
                c for c in outcome.claims if c.width_to_thickness == row.width_to_thickness and c.error is not None
            ]
            if not claims:
                continue
            lines += ["", "[[agreement]]", f"scene = {json.dumps(name)}"]
            lines.append(f"width_to_thickness = {row.width_to_thickness:g}")
            keys = {key: value for key, value in pin.keys if key != "shell.width_to_thickness"}
            if keys:
                lines.append(f"set = {{ {', '.join(f'{json.dumps(k)} = {json.dumps(v)}' for k, v in keys.items())} }}")
            if pin.leave_saddle is not None:
                lines.append(f"leave_saddle = {json.dumps(pin.leave_saddle)}")
            for claim in claims:
                key = "distance" if claim.what == "distance" else "share"
                bound = up((claim.value or 0.0) + 2.0 * (claim.error or 0.0))
                lines.append(f"{key} = {bound:g}  # measured {claim.value:.2e}, error {claim.error:.1e}")
    return "\n".join(lines) + "\n"


def write(out: Path, outcomes: Sequence[Outcome], again: str, *, pinned: bool = False) -> Path | None:
    """Writes result.json and page.json, and with `pinned` the pins (a scene file beside them); returns their file."""
    single = outcomes[0].pin.scene if len(outcomes) == 1 else None
    made = provenance(single) if single is not None else versions()
    verdicts = {outcome.verdict for outcome in outcomes}
    worst = max(verdicts, key=list(Verdict).index)
    files = {"result.json": "every claim with its numbers"}
    written = None
    if pinned:
        files[PINS] = "the pins"
        for outcome in outcomes:
            scene = outcome.pin.scene
            if scene.name not in shipped():
                plain = scene.to_toml()
                atomic_write_text(out / f"{scene.name}.toml", plain)
                files[f"{scene.name}.toml"] = "the scene of the pins"
        written = atomic_write_text(out / PINS, pins_text(outcomes))
    Study(
        "check",
        "Agreement of ribbon and shell" if single is None else f"{single.title}: agreement",
        verdict=answer(outcomes, pinned),
        tables=(table(outcomes, pinned),),
        sentences=tuple(sentences(outcomes, pinned)),
        files=files,
    ).write(
        out, {"status": worst.value, "pins": [document(_PIN, o) for o in outcomes], "provenance": made}, again, single
    )
    return written


#: What result.json says of a pin.
_PIN: tuple[Quantity[Outcome], ...] = (
    Quantity("scene", kind=DATA, of=lambda o: o.pin.scene.name),
    Quantity("label", kind=DATA, of=lambda o: o.pin.label),
    Quantity("set", kind=DATA, of=lambda o: dict(o.pin.keys)),
    Quantity("status", kind=DATA, of=lambda o: o.verdict.value),
    Quantity("claims", kind=DATA, of=lambda o: o.claims),
    Quantity("ribbon.status", kind=DATA, of=lambda o: o.comparison.fast.word),
    Quantity("ribbon.stable", kind=DATA, of=lambda o: o.comparison.fast.stable),
    Quantity("ribbon.lowest_eigenvalue", kind=DATA, of=lambda o: o.comparison.fast.lowest_eigenvalue),
    Quantity("seconds.first", unit="s", kind=DATA, of=lambda o: o.comparison.fast.seconds.first),
    Quantity("seconds.warm", unit="s", kind=DATA, of=lambda o: o.comparison.fast.seconds.warm),
    Quantity("rows", kind=DATA, of=lambda o: [row_result(row, o.comparison.scene) for row in o.comparison.rows]),
)
