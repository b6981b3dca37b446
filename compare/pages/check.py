"""What `ribbonbench check` says and writes: the claims with their numbers, and pins that hold with a margin."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from compare.check import Outcome, Verdict, up
from compare.page.page import Cell, Page, Table, write_page
from compare.pages.result import row_result
from compare.scene.scene import shipped
from compare.store.made_by import provenance
from compare.store.provenance import versions
from compare.store.store import atomic_write_json, atomic_write_text

PINS = "agreements.toml"
_LEGEND = (
    "value: distance (Hausdorff, in l), membrane share of the shell's elastic energy, or slope; error: of the "
    "discretisations, by refinement; agreed: value + error is within the bound; disproved: value - error is beyond it; "
    "undecided: neither, which is no agreement; proves: the smallest bound that these meshes prove."
)
_WORDS = {
    Verdict.AGREED: "agreed: every claim holds, discretisation errors included.",
    Verdict.UNDECIDED: "not agreed: undecided, the discretisation errors are too large for a claim.",
    Verdict.DISPROVED: "not agreed: a claim is disproved.",
    Verdict.UNSOLVED: "not agreed: a model is not at a stable equilibrium.",
}


def table(outcomes: Sequence[Outcome], pinned: bool = False) -> Table:
    """One row for each claim; `pinned`: without bounds, as none was claimed."""
    rows: list[tuple[Cell, ...]] = []
    for outcome in outcomes:
        for claim in outcome.claims:
            bound = claim.bound if isinstance(claim.bound, float) else " to ".join(f"{b:g}" for b in claim.bound)
            rows.append(
                (
                    outcome.pin.scene.name,
                    claim.width_to_thickness,
                    claim.what,
                    None if pinned else bound if isinstance(bound, str) else f"{bound:g}",
                    claim.value,
                    claim.error,
                    claim.ribbon_error,
                    claim.shell_error,
                    None if pinned and claim.verdict is Verdict.AGREED else claim.verdict.value,
                    claim.provable,
                )
            )
    headings = (
        "scene", "w/h", "claim", "bound", "value", "error", "ribbon error", "shell error", "verdict", "proves",
    )  # fmt: skip
    formats = ("", "g", "", "", ".3g", ".1e", ".1e", ".1e", "", ".2e")
    return Table("Agreement of ribbon and shell", headings, tuple(rows), formats, _LEGEND)


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
            if pin.leave_saddle:
                lines.append("leave_saddle = true")
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
    atomic_write_json(
        out / "result.json", {"status": worst.value, "pins": [_entry(o) for o in outcomes], "provenance": made}
    )
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
    page = Page(
        command="check",
        title="Agreement of ribbon and shell" if single is None else f"{single.title}: agreement",
        verdict=tuple(sentences(outcomes, pinned)),
        tables=(table(outcomes, pinned),),
        files=files,
        scene="" if single is None else single.to_toml(),
        provenance=made,
        again=again,
    )
    write_page(out, page)
    return written


def _entry(outcome: Outcome) -> dict[str, Any]:
    pin, found = outcome.pin, outcome.comparison
    fast = found.fast
    return {
        "scene": pin.scene.name,
        "label": pin.label,
        "set": dict(pin.keys),
        "status": outcome.verdict.value,
        "claims": outcome.claims,
        "ribbon": {"status": fast.word, "stable": fast.stable, "lowest_eigenvalue": fast.lowest_eigenvalue},
        "seconds": {"first": fast.seconds.first, "warm": fast.seconds.warm},
        "rows": [row_result(row) for row in found.rows],
    }
