"""What `ribbonbench identify` says and writes: result.json, table.csv, identify.png, fitted.toml, page.json."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from compare.page.page import Picture
from compare.page.remedies import message
from compare.page.study import Study
from compare.page.table import Column, Table
from compare.page.verdict import Verdict
from compare.pages.result import state_result
from compare.pictures.identify import identify_picture
from compare.scene.keys import KEYS
from compare.scene.units import Units
from compare.store.store import atomic_write_text
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


def table(found: Identified) -> Table:
    """A row for every fitted key."""
    rows = []
    for fitted in found.keys:
        low, high = fitted.interval or (None, None)
        unit = KEYS[fitted.key].unit or "-"
        rows.append((fitted.key, fitted.value, low, high, unit, fitted.start, fitted.error))
    return Table("Fitted keys", _COLUMNS, tuple(rows))


def answer(found: Identified) -> Verdict:
    """How near the fitted ribbon is to the points."""
    left = Units.of(found.scene).text(found.rms, "l")
    keys = ", ".join(f"{fitted.key} = {fitted.value:.5g}" for fitted in found.keys)
    if not found.ok:
        return Verdict(f"The fit did not end at a stable equilibrium; the last one is {left} from the points: {keys}")
    return Verdict(f"{keys}: the ribbon passes the {len(found.points.places)} points at {left} (root mean square)")


def sentences(found: Identified) -> list[str]:
    """What else to know of the fit."""
    how = "by their abscissae" if found.points.s is not None else "each with the nearest point of the centreline"
    said = [
        f"{len(found.points.places)} points, {how}; {found.iterations} equilibria; {message(found.state)}. "
        "Points stand in the axes of the scene: nothing is moved to fit them."
    ]
    if found.hardly:
        said.append(
            f"The keys can hardly be told apart by these points (condition {found.condition:.1e}): the intervals say "
            "so; fix one of them, or measure another load."
        )
    return said


def result(found: Identified) -> dict[str, Any]:
    """result.json: that of the fitted scene, and `identified`."""
    length = Units.of(found.scene).length
    return {
        **state_result(found.scene, found.state),
        "identified": {
            "keys": [
                {"key": f.key, "value": f.value, "interval": f.interval, "error": f.error, "start": f.start}
                for f in found.keys
            ],
            "points": len(found.points.places),
            "feet": found.feet,
            "rms": found.rms,
            "rms_m": None if length is None else found.rms * length,
            "condition": found.condition,
            "correlation": found.correlation,
            "equilibria": found.iterations,
            "converged": found.converged,
        },
    }


def write(out: Path, found: Identified, again: str) -> None:
    """Writes everything of a fit into the folder `out`, each file atomically."""
    identify_picture(out / PICTURE, found)
    atomic_write_text(out / FITTED, found.scene.to_toml())
    shown = table(found)
    Study(
        "identify",
        found.scene.title,
        tables=(shown,),
        verdict=answer(found),
        sentences=tuple(sentences(found)),
        pictures=(
            Picture(
                PICTURE,
                f"Two side views of the fitted centreline and the {len(found.points.places)} measured points, whose "
                f"distances from it have a root mean square of {found.rms:.2e} l.",
                "The measured points on the fitted centreline, from two sides.",
            ),
        ),
        data={"table.csv": shown},
        files={"result.json": "all numbers", "table.csv": "the fitted keys", FITTED: "the scene with the fitted keys"},
    ).write(out, result(found), again, found.scene)
