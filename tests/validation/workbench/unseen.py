"""The promise of `limits --quick` on a hundred scenes that no constant has seen: its first line beside the shell's.

Every scene is asked twice, as a user asks: by the estimate from the ribbon alone, and with a shell. Both answers are
verdicts (`compare.page.claims`). Of each scene:

    same            the estimate's grade is the shell's
    too cautious    the estimate is worse, or says that it does not know
    too bold        the estimate is better
    falsely safe    the estimate is "good", and with a shell it is not
    no shell        no answer from the shell to compare with

The scenes were drawn once (`drawn.unseen`), after every constant; none that was run is left out. What is finished is
kept row by row under out/validate/unseen, so that a run that was stopped goes on; the page says how many were run.
"""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from compare.measure.grades import GOOD, GRADES, UNKNOWN
from compare.pages.limits import answer
from compare.scene.scene import Scene
from compare.store.progress import Reporter
from compare.store.store import CaseStore, atomic_write_json
from compare.studies.limits import Thresholds, quick, study
from ribbonbench.errors import BadInput
from tests.validation import page
from tests.validation.kept_rows import KeptRows
from tests.validation.number import Number
from tests.validation.workbench.drawn import UNSEEN_SEED, unseen

COMMAND = "python -m tests.validation unseen"
SAME, CAUTIOUS, BOLD, FALSELY_SAFE, NO_SHELL = "same", "too cautious", "too bold", "falsely safe", "no shell"
OUTCOMES = (SAME, CAUTIOUS, BOLD, FALSELY_SAFE, NO_SHELL)


#: Draws names and scenes.
Scenes = Callable[[], tuple[tuple[str, Scene], ...]]


def outcome(estimated: str, measured: str | None) -> str:
    """One of `OUTCOMES`, from the grades of both answers; measured None: there was no shell."""
    if measured in (None, UNKNOWN):
        return NO_SHELL
    if estimated == GOOD and measured != GOOD:
        return FALSELY_SAFE
    if estimated == measured:
        return SAME
    return CAUTIOUS if GRADES.index(estimated) > GRADES.index(measured) else BOLD


def asked(name: str, scene: Scene, store: CaseStore, reporter: Reporter) -> dict[str, Any]:
    """Both answers on one scene."""
    estimates = quick(scene, Thresholds(), say=reporter)
    told = answer(estimates)
    (estimate,) = estimates
    found: dict[str, Any] = {
        "name": name, "estimated": told.grade, "estimate": estimate.distance, "text": told.text,
        "doubts": [check.name for check in told.checks if check.grade != GOOD],
    }  # fmt: skip
    try:
        findings, _ = study(scene, store, reporter, Thresholds())
    except BadInput as error:
        return {**found, "measured": None, "why": str(error), "outcome": NO_SHELL}
    said = answer(findings)
    (finding,) = findings
    ok = finding.ok and finding.share is not None
    measured = said.grade if ok else None
    return {
        **found, "measured": measured, "distance": finding.distance, "share": finding.share, "why": said.text,
        "shell_error": None if finding.row is None else finding.row.shell_error,
        "ribbon_error": None if finding.row is None else finding.row.ribbon_error,
        "outcome": outcome(told.grade, measured),
    }  # fmt: skip


def estimated(name: str, scenes: Scenes = unseen) -> float:
    """The estimated distance (l) of an unseen scene."""
    (found,) = quick(dict(scenes())[name], Thresholds())
    assert found.distance is not None
    return found.distance


#: Two scenes whose estimates are computed again; what a processor may change of them, as a part.
PROBED, REPEATED = ("held_03", "held_10"), 1e-5
PROBES = {f"estimate_{name}": partial(estimated, name) for name in PROBED}


def numbers(rows: Sequence[Mapping[str, Any]], probed: Sequence[str] = PROBED) -> dict[str, Number]:
    """The counts, and the estimates of `probed`."""
    found = {name.replace(" ", "_"): Number(count, 0.0, shown="d") for name, count in counted(rows).items()}
    return found | {
        f"estimate_{row['name']}": Number(row["estimate"], REPEATED * row["estimate"], "l", ".2e")
        for row in rows
        if row["name"] in probed
    }


def run(out: Path) -> dict[str, Number]:
    """Writes unseen.md and unseen.json; its numbers by name."""
    rows = measured(out, "unseen", unseen)
    write(out, rows)
    return numbers(rows)


#: Scenes that are asked whatever time it takes: those of the probes among them.
LEAST = 3


def measured(
    out: Path, name: str, scenes: Scenes, most: int | None = None, seconds: float = math.inf
) -> list[dict[str, Any]]:
    """Both answers on the drawn scenes, on the first `most` of them: those that are kept are not asked again, and none
    is begun when `seconds` have passed."""
    until = time.monotonic() + seconds
    place = out.parent / "out" / "validate" / name
    store = CaseStore(place / "cases")
    kept = KeptRows.of(place, "compare.studies.limits", "compare.pages.limits")
    rows: list[dict[str, Any]] = []
    with Reporter() as reporter:
        for scene_name, scene in scenes()[:most]:
            reporter.step(scene_name)
            if not kept.has(scene_name) and len(rows) >= LEAST and time.monotonic() > until:
                break
            rows.append(kept.row(scene_name, partial(asked, scene_name, scene, store, reporter)))
    return rows


def counted(rows: Sequence[Mapping[str, Any]]) -> dict[str, int]:
    """How many scenes ended how; judged: those with a shell."""
    count = Counter(row["outcome"] for row in rows)
    return {"scenes": len(rows), "judged": len(rows) - count[NO_SHELL], **{name: count[name] for name in OUTCOMES}}


def write(out: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """unseen.md and unseen.json, which README takes its promise from."""
    count = counted(rows)
    atomic_write_json(out / "unseen.json", {"command": COMMAND, "counts": count, "scenes": list(rows)})
    page.write(
        out / "unseen.md",
        "The estimate on a hundred scenes that no constant has seen",
        COMMAND,
        f"Drawn once (seed {UNSEEN_SEED}), after every constant of the estimate: pose, width, w/h from 15 to 400, nu, "
        "K, Gamma; 60 held at one end, 15 arches, 25 between clamps that are shifted, turned and leaning. Each is "
        f"asked as a user asks, `limits --quick` and `limits`: grades of both first lines. Of {len(unseen())} drawn "
        f"{len(rows)} were run so far, in this order; none of these is left out.",
        f"Falsely safe: {named(rows, FALSELY_SAFE)}. Too bold: {named(rows, BOLD)}. Scenes without a shell to "
        "compare with: it rests in another state than the ribbon, as the answer then says, or its share is not known.",
        *_older(rows),
        *tables(rows),
    )


def tables(rows: Sequence[Mapping[str, Any]]) -> tuple[str, ...]:
    """The counts, and every scene."""
    count = counted(rows)
    return (
        page.table(["", "scenes"], [[name, str(count[name])] for name in ("scenes", "judged", *OUTCOMES)]),
        "## Every scene",
        "Distances in % of l; doubts: checks of the estimate's verdict that keep it from being good.",
        page.table(
            ["scene", "estimated", "with a shell", "outcome", "estimate", "distance", "errors", "doubts"],
            [_row(row) for row in rows],
        ),
    )


def _older(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """What is to be known of rows that an earlier measure made (`earlier`); nothing where there are none."""
    older = [row["name"] for row in rows if row.get("earlier")]
    if not older:
        return []
    return [
        f"{len(rows) - len(older)} of them were measured again after a shell's stretching was freed of what holds its "
        "elements' own modes; of the others the share is an upper bound, and in the grade it counts as it is: "
        f"{', '.join(older)}."
    ]


def named(rows: Sequence[Mapping[str, Any]], outcome: str) -> str:
    return ", ".join(row["name"] for row in rows if row["outcome"] == outcome) or "none"


def _row(row: Mapping[str, Any]) -> list[str]:
    def percent(value: float | None) -> str:
        return "" if value is None else f"{100.0 * value:.2g}"

    errors = [row.get(name) for name in ("ribbon_error", "shell_error")]
    return [
        row["name"], row["estimated"], row["measured"] or "none", row["outcome"], percent(row["estimate"]),
        percent(row.get("distance")), " + ".join(percent(error) or "?" for error in errors),
        ", ".join(row["doubts"]),
    ]  # fmt: skip
