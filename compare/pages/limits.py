"""Results of `ribbonbench limits`: rows, tables, `result.json`, `page.json`, the files of a folder."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from compare.page import page
from compare.pages import result as results
from compare.pages.solve import upwards
from compare.store.store import atomic_write_json, atomic_write_text, jsonable
from compare.studies.compare import Comparison
from compare.studies.limits import Finding, Thresholds, hits

_NOT_ON_A_TERMINAL = ("centreline % l", "share's error %", "at clamps %", "elastic", "gravity", "estimated level")
#: Findings up to which each gets its sentence.
_MOST_SENTENCES = 6
_FILES = {
    "result.json": "verdicts, rows, provenance",
    "limits.csv": "one line per shell, or estimate",
}


def row_result(finding: Finding) -> dict[str, Any]:
    """A row of the contract: that of `compare`, the varied keys, verdict and estimate."""
    ribbon = finding.ribbon
    row = finding.row
    same: dict[str, Any] = (
        results.row_result(row)
        if row is not None
        else {
            "width_to_thickness": finding.width_to_thickness,
            "status": ribbon.word,
            "hausdorff": None,
            "centreline": None,
            "ribbon_error": None,
            "shell_error": None,
            "share": None,
            "seconds": {"ribbon": ribbon.seconds.warm, "shell": None},
        }
    )
    return {
        **finding.values,
        "clamp": finding.scene.shell.clamp,
        **same,
        "ribbon_status": ribbon.word,
        "share_of_total": finding.share_of_total,
        "stretching": finding.share,
        "zones": finding.zones,
        "parts": finding.parts,
        "verdict": finding.sentence,
        "level": finding.level,
        "reason": finding.cause,
        "estimate": {
            "distance": finding.estimate.distance,
            "share": finding.estimate.share,
            "parts": finding.estimate.parts,
            "level": finding.estimated_level,
            "scale": finding.estimate.scale,
            "seconds": finding.estimate.seconds,
            "false_safe": finding.false_safe,
        },
    }


def table(findings: Sequence[Finding]) -> page.Table:
    """The findings as a table."""
    keys = list(findings[0].values)
    shells = any(f.row is not None for f in findings)
    headings = [*(key.split(".", 1)[-1] for key in keys), "held", "w/h"]
    formats = ["g"] * len(keys) + ["", "g"]
    if shells:
        headings += [
            "level", "distance % l", "centreline % l", "ribbon error", "shell error", "membrane %", "shear %",
            "share's error %", "at clamps %", "elastic", "gravity",
        ]  # fmt: skip
        formats += ["", ".2f", ".2f", ".1e", ".1e", ".2f", ".2f", ".2f", ".0f", ".4g", ".4g"]
    headings += ["estimated level", "estimated distance % l", "estimated stretching %", "most of it"]
    formats += ["", ".2f", ".2f", ""]
    if shells:
        headings += ["shell s"]
        formats += [".3g"]
    return page.Table(
        title="Limits of inextensibility",
        headings=tuple(headings),
        rows=tuple(_cells(finding, keys, shells) for finding in findings),
        formats=tuple(formats),
        legend=(
            "level: good, fair, poor (see the verdict's thresholds). distance: Hausdorff between ribbon and shell; "
            "errors: of the discretisations, over l. membrane, shear: of the shell's elastic energy; share's error: "
            "change of the membrane share from a mesh half as fine; at clamps: part of that stretching within w/2 of a "
            "clamp. Energies in D w / l, the elastic one with the constant of the natural curvature. Estimates: from "
            "the ribbon alone."
            if shells
            else "Estimates from the ribbon alone. stretching: membrane and shear, of the elastic energy."
        ),
    )


def brief(content: page.Table) -> page.Table:
    """The table without the columns that a terminal has no room for."""
    shown = [k for k, heading in enumerate(content.headings) if heading not in _NOT_ON_A_TERMINAL]
    return page.Table(
        title=content.title,
        headings=tuple(content.headings[k] for k in shown),
        rows=tuple(tuple(row[k] for k in shown) for row in content.rows),
        formats=tuple(content.formats[k] for k in shown),
        legend=content.legend,
    )


def _percent(value: float | None) -> float | None:
    return None if value is None else 100.0 * value


def _cells(finding: Finding, keys: Sequence[str], shells: bool) -> tuple[page.Cell, ...]:
    row, found = finding.row, finding.estimate
    cells: list[page.Cell] = [_cell(finding.values[key]) for key in keys]
    cells += [finding.scene.shell.clamp, finding.width_to_thickness]
    if shells:
        share = (row.share if row is not None else None) or {}
        energy = row.energy if row is not None else None
        zones = finding.zones or {}
        cells += [
            finding.level or (row.status if row is not None else None),
            _percent(finding.distance),
            _percent(row.centreline if row is not None else None),
            row.ribbon_error if row is not None else None,
            row.shell_error if row is not None else None,
            _percent(share.get("membrane")),
            _percent(share.get("shear")),
            _percent(row.share_error if row is not None else None),
            _percent(zones.get("clamps")),
            None if energy is None else energy.elastic,
            None if energy is None else energy.gravity,
        ]
    cells += [finding.estimated_level, _percent(found.distance), _percent(found.share), finding.cause]
    if shells:
        cells.append(row.seconds["shell"] if row is not None else None)
    return tuple(cells)


def _cell(value: Any) -> page.Cell:
    plain = jsonable(value)
    return plain if isinstance(plain, str | float | int | bool) or plain is None else str(plain)


def as_csv(findings: Sequence[Finding]) -> str:
    """One line per finding, all numbers in full."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    rows = [_flat(row_result(finding)) for finding in findings]
    names = list(dict.fromkeys(name for row in rows for name in row))
    writer.writerow(names)
    for row in rows:
        writer.writerow(["" if row.get(name) is None else row[name] for name in names])
    return out.getvalue()


_LEFT_OUT = ("shell_end", "shell_middle", "message", "elements")


def _flat(row: dict[str, Any], before: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for name, value in jsonable(row).items():
        if name in _LEFT_OUT:
            continue
        if isinstance(value, dict):
            flat.update(_flat(value, f"{before}{name}."))
        else:
            flat[before + name] = value
    return flat


def _extremes(findings: Sequence[Finding]) -> list[str]:
    """The best and the worst case, what stretches in how many cases, and what is no claim."""
    known = [f for f in findings if f.share is not None]
    by_share = sorted(known, key=lambda f: f.share or 0.0)
    by_distance = sorted((f for f in known if f.distance is not None), key=lambda f: f.distance or 0.0)
    said: list[str] = []
    for title, chosen in (
        ("least stretching", by_share[:1]),
        ("most stretching", by_share[-1:]),
        ("farthest", by_distance[-1:]),
    ):
        said += [f"{title.capitalize()}. {f.sentence}" for f in chosen]
    causes = [f.cause for f in known]
    counts = ", ".join(f"{name.replace('_', ' ')} {causes.count(name)}" for name in dict.fromkeys(causes))
    said.append(f"What stretches most, by number of cases: {counts}.")
    open_ones = [f for f in findings if f.row is not None and f.row.hausdorff is not None and not f.row.claimed]
    if open_ones:
        said.append(f"In {len(open_ones)} cases the distance is not above the discretisation errors (see the table).")
    said += [f.sentence for f in findings if f.share is None]
    return said


def verdict(findings: Sequence[Finding], thresholds: Thresholds) -> list[str]:
    """The sentences: of every finding where there are few, then how often the estimate was right."""
    levels = [f.level for f in findings]
    said = [finding.sentence for finding in findings] if len(findings) <= _MOST_SENTENCES else _extremes(findings)
    if len(findings) > 1:
        counts = ", ".join(f"{levels.count(name)} {name}" for name in ("good", "fair", "poor") if name in levels)
        open_ones = levels.count(None)
        counts += f", {open_ones} without a verdict" if open_ones else ""
        said.insert(
            0,
            f"{len(findings)} cases: {counts} (good: within {100 * thresholds.distance:g} % of l and "
            f"{100 * thresholds.share:g} % of the elastic energy; fair: within five times that).",
        )
    score = hits(findings)
    if score["known"]:
        said.append(
            f"The estimate from the ribbon alone gives the shell's level in {score['same']} of {score['known']} cases, "
            f"a worse one in {score['cautious']}, a better one in {score['bold']}; {score['false_safe']} false safe."
        )
    return said


def result(findings: Sequence[Finding], comparison: Comparison | None, thresholds: Thresholds) -> dict[str, Any]:
    """`result.json`: the ribbon's keys (of the last case) with one row per case."""
    last = findings[-1]
    base = (
        results.comparison_result(comparison)
        if comparison is not None
        else results.state_result(last.scene, last.ribbon)
    )
    return {
        **base,
        "command": "limits",
        "thresholds": {"distance": thresholds.distance, "share": thresholds.share},
        "rows": [row_result(finding) for finding in findings],
        "verdict": verdict(findings, thresholds),
        "hits": hits(findings),
        "complete": all(finding.ok for finding in findings),
    }


def write(
    out: Path,
    findings: Sequence[Finding],
    comparison: Comparison | None,
    thresholds: Thresholds,
    again: str,
) -> None:
    """result.json, page.json, limits.csv; with shells shares.png, maps.png, shapes.png and estimate.png; of one scene
    its surfaces, too (ribbon.vtu, shell_wNNNN.vtu)."""
    scene = findings[-1].scene
    shells = [f for f in findings if f.maps is not None]
    atomic_write_text(out / "limits.csv", as_csv(findings))
    document = result(findings, comparison, thresholds)
    atomic_write_json(out / "result.json", document)
    pictures: list[page.Picture] = []
    if shells:
        pictures = _pictures(out, shells, scene.title)
    page.write_page(
        out,
        page.Page(
            command="limits",
            title=f"{scene.title}: limits of inextensibility",
            verdict=tuple(verdict(findings, thresholds)),
            tables=(table(findings),),
            pictures=tuple(pictures),
            surfaces=() if comparison is None else _surfaces(out, comparison),
            files=_FILES,
            scene=scene.to_toml() if len(findings) == 1 else "",
            up=upwards(scene),
            provenance=jsonable(document["provenance"]),
            again=again,
        ),
    )


def _surfaces(out: Path, comparison: Comparison) -> tuple[page.Surface, ...]:
    """Writes the surfaces of a scene; the shells begin coloured by the membrane's share."""
    from compare.export import surfaces as export

    found = []
    if comparison.fast.shape is not None:
        name = f"{comparison.fast.model}.vtu"
        export.write_surface(out / name, comparison.fast.shape, comparison.grid)
        found.append(page.Surface(name, comparison.fast.model, "ribbon"))
    for row, state in zip(comparison.rows, comparison.shells, strict=True):
        if state.ok:
            ratio = row.width_to_thickness
            name = f"shell_w{ratio:g}.vtu"
            export.write_shell(out / name, state.native, comparison.grid)
            label = f"shell, w/h = {ratio:g}"
            found.append(page.Surface(name, label, "shell", "membrane_share", width_to_thickness=ratio))
    return tuple(found)


def _pictures(out: Path, shells: Sequence[Finding], title: str) -> list[page.Picture]:
    found: list[page.Picture] = []
    clamps = list(dict.fromkeys(f.scene.shell.clamp for f in shells))
    for clamp in clamps:
        there = [f for f in shells if f.scene.shell.clamp == clamp]
        found += _of_one_clamp(out, there, title, f"_{clamp}" if len(clamps) > 1 else "")
    if len(shells) > 1:
        from compare.pictures import limits as limits_figures

        limits_figures.estimate_picture(out / "estimate.png", shells, "Estimate against shell")
        found.append(
            page.Picture(
                "estimate.png",
                "Estimated against computed distance and share, on a line but for a factor",
                "Estimates from the ribbon alone against the shells; dotted: a factor of 2.",
            )
        )
    return found


def _of_one_clamp(out: Path, shells: Sequence[Finding], title: str, suffix: str) -> list[page.Picture]:
    """Figures 7.8 to 7.10 for one way of holding the strip."""
    from compare.pictures import limits as limits_figures

    worst = max(f.share or 0.0 for f in shells)
    held = "two corners held" if shells[0].scene.shell.clamp == "corners" else "whole edge held"
    names = {kind: f"{kind}{suffix}.png" for kind in ("shares", "maps", "shapes")}
    limits_figures.shares_picture(out / names["shares"], shells, f"{title} ({held})")
    limits_figures.maps_picture(out / names["maps"], shells, f"{title} ({held})")
    limits_figures.shapes_picture(out / names["shapes"], shells, f"{title} ({held})")
    return [
        page.Picture(
            names["shares"],
            f"Energies by kind; {held}; stretching is at most {100 * worst:.2g} % of the elastic energy",
            "Shares of bending, membrane and shear (thesis, figure 7.9); the estimate from the ribbon alone dotted.",
        ),
        page.Picture(
            names["maps"],
            "Local shares of bending, membrane and shear over the flat strip, the clamp at the top",
            "Which energy prevails where (thesis, figure 7.10). Points of one colour need not store the same energy; "
            "where hardly any is stored all three strips are blue.",
        ),
        page.Picture(names["shapes"], f"Shells at rest from two sides, {held}", "Shells at rest (thesis, figure 7.8)."),
    ]
