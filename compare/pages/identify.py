"""What `ribbonbench identify` says and writes: result.json, table.csv, identify.png, fitted.toml, page.json."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from compare.measure.grades import POOR, YARDSTICK
from compare.page.page import Picture
from compare.page.remedies import message
from compare.page.study import Study
from compare.page.table import Column, Table
from compare.page.verdict import Check, Verdict
from compare.pages.pictures.identify import identify_picture
from compare.pages.result import state_result
from compare.scene.keys import KEYS
from compare.store.store import atomic_write_text
from compare.studies.checks import finite, residual, stable_here
from compare.studies.fit.judged import SYSTEMATIC
from compare.studies.identify import Identified

PICTURE, FITTED = "identify.png", "fitted.toml"
_COLUMNS = (
    Column("key", "key", kind="word"),
    Column("value", "value", kind="digits:6"),
    Column("low", "95 % from", kind="digits:6"),
    Column("high", "to", kind="digits:6"),
    Column("unit", "unit", kind="word"),
    Column("start", "began at", kind="digits:6"),
    Column("error", "standard error", kind="digits:3", rank=9),
)


def table(fit: Identified) -> Table:
    """A row for every fitted key."""
    rows = []
    for fitted in fit.keys:
        low, high = fitted.interval or (None, None)
        unit = KEYS[fitted.key].unit or "-"
        rows.append((fitted.key, fitted.value, low, high, unit, fitted.start, fitted.error))
    return Table("Fitted keys", _COLUMNS, tuple(rows))


def answer(fit: Identified) -> Verdict:
    """How near the fitted ribbon is to the points."""
    left = _length(fit, fit.rms)
    keys = ", ".join(f"{fitted.key} = {fitted.value:.5g}" for fitted in fit.keys)
    if not fit.ok:
        text = f"The fit did not end at a stable equilibrium; the last one is {left} from the points: {keys}"
        return Verdict.of("identify", text, _checks(fit))
    moved = ", moved onto it," if fit.registered is not None else ""
    count = len(fit.points.places)
    if not fit.passes:
        text = f"No fit: the nearest ribbon stays {left} from the {count} points{moved} with {keys}"
        return Verdict.of("identify", text, _checks(fit))
    text = f"{keys}: the ribbon passes the {count} points{moved} at {left} (root mean square)"
    return Verdict.of("identify", text, _checks(fit)).doubted("fit")


def _checks(found: Identified) -> list[Check]:
    """What the answer rests on: the last state, and how near it is to the points."""
    state = found.state
    grade = found.grade if found.ok and found.passes else POOR
    fit = Check("fit", grade, f"{found.rms:.1e} l from the points", found.rms)
    return [finite(state), residual(state), stable_here(state), fit]


def _length(fit: Identified, value: float) -> str:
    """A length with its share of the strip's, where it has a unit."""
    units = fit.scene.units
    return units.text(value, "l") + (f", {100.0 * value:.2g} % of its length," if units.known else "")


def _noise(fit: Identified) -> str:
    """What is left beside the points' own scatter."""
    text = fit.scene.units.text
    if fit.scatter is None:
        return "The points are too few to tell their own scatter from a difference of shapes."
    own = text(fit.scatter, "l")
    if fit.rms <= SYSTEMATIC * fit.scatter:
        return f"The points scatter by {own} about a smooth curve: what is left is their noise."
    if fit.rms <= YARDSTICK:
        return f"The points scatter by {own} about a smooth curve: what is left is no noise, but too small to be seen."
    return (
        f"The points scatter by {own} about a smooth curve: what is left is no noise, and the intervals do not hold. "
        "Another key, the clamp, the axes or the model is not as the scene says."
    )


def _placed(fit: Identified) -> str:
    """Where the points stand."""
    text = fit.scene.units.text
    if fit.registered is not None:
        at = fit.registered
        shift, turn = at.motion.shift, np.degrees(at.motion.turn)
        off = "" if at.shift_error is None else f" (standard error {text(float(np.linalg.norm(at.shift_error)), 'l')})"
        return (
            f"The points were moved as a rigid body: {text(float(np.linalg.norm(shift)), 'l')}{off} and "
            f"{float(np.linalg.norm(turn)):.3g} degrees about their mean."
        )
    if fit.offset is not None:
        seen = fit.offset
        return (
            f"The points seem to stand elsewhere: moved by {text(seen.shift, 'l')} and turned by "
            f"{np.degrees(seen.turn):.2g} degrees they would be about {text(seen.rms, 'l')} from the ribbon. Mend "
            "their axes, or let the fit move them: --register."
        )
    return "Points stand in the axes of the scene: nothing is moved to fit them."


def sentences(fit: Identified) -> list[str]:
    """What else to know of the fit."""
    how = "by their abscissae" if fit.points.s is not None else "each with the nearest point of the centreline"
    said = [
        f"{len(fit.points.places)} points, {how}; {fit.iterations} equilibria; {message(fit.state)}.",
        _placed(fit),
        _noise(fit),
    ]
    if fit.began_beside:
        said.append("The scene's own state is a saddle: the fit began at the stable one that is nearer to the points.")
    if fit.differenced:
        said.append("Where the equilibrium has no derivative (straight, or at a bifurcation) it was differenced.")
    if fit.hardly:
        said.append(
            f"The keys can hardly be told apart by these points (condition {fit.condition:.1e}): the intervals say "
            "so; fix one of them, or measure another load."
        )
    return said


def result(fit: Identified) -> dict[str, Any]:
    """result.json: that of the fitted scene, and `identified`."""
    length, at = fit.scene.units.length, fit.registered
    return {
        **state_result(fit.scene, fit.state),
        "identified": {
            "keys": [
                {"key": f.key, "value": f.value, "interval": f.interval, "error": f.error, "start": f.start}
                for f in fit.keys
            ],
            "points": len(fit.points.places),
            "feet": fit.feet,
            "rms": fit.rms,
            "rms_m": None if length is None else fit.rms * length,
            "grade": fit.grade,
            "scatter": fit.scatter,
            "offset": fit.offset,
            "registered": None
            if at is None
            else {
                "turn": at.motion.turn,
                "turn_error": at.turn_error,
                "shift": at.motion.shift,
                "shift_error": at.shift_error,
                "pivot": at.motion.pivot,
            },
            "condition": fit.condition,
            "correlation": fit.correlation,
            "equilibria": fit.iterations,
            "converged": fit.converged,
        },
    }


def write(out: Path, fit: Identified, again: str) -> None:
    """Writes everything of a fit into the folder `out`, each file atomically."""
    identify_picture(out / PICTURE, fit)
    atomic_write_text(out / FITTED, fit.scene.to_toml())
    shown = table(fit)
    Study(
        "identify",
        fit.scene.title,
        tables=(shown,),
        verdict=answer(fit),
        sentences=tuple(sentences(fit)),
        pictures=(
            Picture(
                PICTURE,
                f"Two side views of the fitted centreline and the {len(fit.points.places)} measured points, whose "
                f"distances from it have a root mean square of {fit.rms:.2e} l.",
                "The measured points on the fitted centreline, from two sides.",
            ),
        ),
        data={"table.csv": shown},
        files={"result.json": "all numbers", "table.csv": "the fitted keys", FITTED: "the scene with the fitted keys"},
    ).write(out, result(fit), again, fit.scene)
