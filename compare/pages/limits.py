"""Results of `ribbonbench limits`: rows, tables, `result.json`, `page.json`, the files of a folder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from compare.measure.grades import GRADES, UNKNOWN, worst
from compare.models.holds.words import briefly
from compare.page.page import Picture, Surface
from compare.page.pair import PAIR, Times
from compare.page.si import with_si
from compare.page.study import Study
from compare.page.table import LAST, USUAL, Cell, Column, Table
from compare.page.verdict import Check, Verdict, unchecked
from compare.page.wording import length, percent
from compare.pages import result as results
from compare.pages.pictures.varied import axes_of, label, varied
from compare.record.quantity import ABSENT, DATA, Part, Quantity, pick
from compare.record.views import document, unit_of
from compare.scene.units import Units
from compare.store.store import jsonable
from compare.studies.checks import of_rows, of_state, worst_of
from compare.studies.compare import Comparison
from compare.studies.limits import Finding, Thresholds, doubted_share, doubted_where, hits, other_side

#: The command whose verdict is of estimates alone.
QUICK = "limits --quick"
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
        results.row_result(row, finding.scene)
        if row is not None
        else {
            "width_to_thickness": finding.width_to_thickness,
            "status": ribbon.word,
            "hausdorff": None,
            "centreline": None,
            "ribbon_error": None,
            "shell_error": None,
            "share": None,
            "seconds": asdict(Times(ribbon.seconds.warm, None)),
        }
    )
    return {**finding.values, **document(_HELD, finding), **same, **document(_FOUND, finding)}


def _rival(finding: Finding) -> Any:
    rival = finding.estimate.rival
    return None if rival is None else rival.to_dict()


def _sides(finding: Finding) -> Any:
    sides = finding.estimate.sides
    return None if sides is None else sides.to_dict()


def _why(finding: Finding) -> Any:
    return finding.estimate.why or ABSENT


_HELD: tuple[Quantity[Finding], ...] = (
    Quantity("clamp", "held", kind="word", rank=2, note="what is held, `edge` or `corners`",
             of=lambda f: f.scene.shell.clamp),
)  # fmt: skip
#: What a finding adds to the row of its shell.
_FOUND: tuple[Quantity[Finding], ...] = (
    Quantity("ribbon_status", kind=DATA, of=lambda f: f.ribbon.word),
    Quantity("share_of_total", kind=DATA, of=lambda f: f.share_of_total),
    Quantity("stretching", kind=DATA, of=lambda f: f.share),
    Quantity("zones", kind="percent:0", rank=LAST, of=lambda f: f.zones, parts=(
        Part("clamps", heading="at clamps %", legend="part of that stretching within w/2 of a clamp"),)),
    Quantity("parts", kind=DATA, of=lambda f: f.parts),
    Quantity("verdict", kind=DATA, of=lambda f: f.sentence),
    Quantity("level", kind=DATA, of=lambda f: f.level),
    Quantity("reason", "most of it", kind="word", rank=3, note="what stretches most", of=lambda f: f.cause),
    Quantity("estimate.distance", "estimated distance % l", "l", "percent:2", rank=3,
             note="from the shell, by estimate", of=lambda f: f.estimate.distance),
    Quantity("estimate.share", "estimated stretching %", kind="percent:2", rank=4, note="of stretching, by estimate",
             of=lambda f: None if f.estimate.why else f.estimate.share),
    Quantity("estimate.share_why", kind=DATA, of=_why),
    Quantity("estimate.distance_why", kind=DATA, of=_why),
    Quantity("estimate.passages", kind=DATA, of=lambda f: f.estimate.passages),
    Quantity("estimate.crowded", kind=DATA, of=lambda f: f.estimate.crowded),
    Quantity("estimate.sides", kind=DATA, of=_sides),
    Quantity("estimate.parts", kind=DATA, of=lambda f: f.estimate.parts),
    Quantity("estimate.level", "estimated level", kind="word", rank=3,
             note="the level by estimate from the ribbon alone", of=lambda f: f.estimated_level),
    Quantity("estimate.scale", kind=DATA, of=lambda f: f.estimate.scale),
    Quantity("estimate.seconds", kind=DATA, of=lambda f: f.estimate.seconds),
    Quantity("estimate.false_safe", kind=DATA, of=lambda f: f.false_safe),
    Quantity("estimate.rival", kind=DATA, of=_rival),
)  # fmt: skip


def _of_row(key: str, **shown: Any) -> Quantity[Finding]:
    """A quantity of the shell's row as this page shows it."""
    (found,) = pick(PAIR, key)
    return replace(found.about(lambda f: f.row), **{"legend": "", "note": "", **shown})  # type: ignore[arg-type]


def columns(keys: Sequence[str]) -> list[Quantity[Finding]]:
    """The columns of the page: the varied keys first."""

    def varied(key: str) -> Quantity[Finding]:
        return Quantity(key, key.split(".", 1)[-1], rank=0, of=lambda f: _cell(f.values[key]))

    return [
        *(varied(key) for key in keys),
        *_HELD,
        Quantity("width_to_thickness", "w/h", kind="digits", rank=1, note="w/h", of=lambda f: f.width_to_thickness),
        Quantity("level", "level", kind="word", legend="good, fair, poor (see the verdict's thresholds)", rank=0,
                 of=lambda f: f.level or _without_level(f)),
        Quantity("distance", "distance % l", "l", "percent:2", legend="Hausdorff between ribbon and shell", rank=1,
                 of=lambda f: f.distance),
        _of_row("centreline", heading="centreline % l", kind="percent:2", rank=LAST,
                note="largest distance at equal s"),
        _of_row("ribbon_error", legend="of the discretisation, over l", rank=4),
        _of_row("shell_error", legend="the same of the shell", rank=3),
        _of_row("share", parts=(
            Part("membrane", heading="membrane %", kind="percent:2", rank=2, note="part of the shell's elastic energy"),
            Part("shear", heading="shear %", kind="percent:2", rank=USUAL, note="the same"))),
        _of_row("share_error", heading="share's error %", kind="percent:2", rank=LAST,
                legend="of both shares, as the error of the shape",
                note="error of the shares of membrane and shear, by the mesh that tells the error of the shape"),
        *pick(_FOUND, "zones"),
        _of_row("energy", kind="digits:4", rank=LAST, parts=(
            Part("elastic", heading="elastic", legend="without the constant of the natural curvature"),
            Part("gravity", heading="gravity"))),
        *pick(_FOUND, "estimate.level", "estimate.distance", "estimate.share", "reason"),
        _of_row("seconds.shell", name="", rank=USUAL),
    ]  # fmt: skip


#: What an estimate alone has.
_ESTIMATED = ("clamp", "width_to_thickness", "estimate.level", "estimate.distance", "estimate.share", "reason")


def _without_level(finding: Finding) -> str | None:
    """What stands in place of a level: the shell's status, or that it rests in another state."""
    if finding.another is not False:
        return "another state" if finding.another else "state not known"
    return None if finding.row is None else finding.row.status


def table(findings: Sequence[Finding]) -> Table:
    """The findings as a table."""
    keys = list(findings[0].values)
    shells = any(f.row is not None for f in findings)
    shown = columns(keys)
    return Table.of(
        "Limits of inextensibility",
        shown if shells else [column for column in shown if column.key in (*keys, *_ESTIMATED)],
        findings,
        "Shares are of the shell's elastic energy, energies in D w / l. Estimates: from the ribbon alone."
        if shells
        else "Estimates from the ribbon alone. stretching: membrane and shear, of the elastic energy.",
    )


def grid_map(findings: Sequence[Finding]) -> Table | None:
    """A grid as a map: the last varied key across, the others down, in each cell the grade and the distance; None where
    fewer than two keys are varied."""
    keys = varied(findings)
    if len(keys) < 2:
        return None
    *down, across = keys
    heads = list(dict.fromkeys(label({across: axes_of(f).get(across)}) for f in findings))
    rows: dict[str, dict[str, str]] = {}
    for finding in findings:
        axes = axes_of(finding)
        row = rows.setdefault(label({key: axes.get(key) for key in down}), {})
        far = "" if finding.distance is None else f" {percent(finding.distance)}"
        row[label({across: axes.get(across)})] = f"{finding.level or UNKNOWN}{far}"
    columns = [Column("case", "", kind="word", rank=0), *(Column(head, head, kind="word", rank=1) for head in heads)]
    records = [{"case": case, **cells} for case, cells in rows.items()]
    return Table.of_records("Grade and distance over the grid", columns, records, "Distance in % of l.")


def _cell(value: Any) -> Cell:
    plain = jsonable(value)
    return str(plain) if isinstance(plain, dict) else plain


def full_table(findings: Sequence[Finding]) -> Table:
    """Everything of a row of result.json in columns: names of nested values with dots."""
    records = [_flat(row_result(finding)) for finding in findings]
    keys = dict.fromkeys(key for record in records for key in record)
    known: tuple[Quantity[Any], ...] = (*PAIR, *_HELD, *_FOUND)
    columns = [Column(key, key, unit_of(known, key), _kind(records, key)) for key in keys]
    table = Table.of_records("Limits of inextensibility", columns, records)
    return with_si(table, [finding.scene.units for finding in findings])


def _kind(records: Sequence[dict[str, Any]], key: str) -> str:
    """ "digits" of a column of numbers, "plain" of another."""
    values = [record[key] for record in records if record.get(key) is not None]
    numbers = bool(values) and all(isinstance(v, int | float) and not isinstance(v, bool) for v in values)
    return "digits" if numbers else "plain"


_LEFT_OUT = ("shell_end", "shell_middle", "message", "elements", "si")


def _flat(row: Mapping[str, Any], before: str = "") -> dict[str, Any]:
    """A row of result.json by names with dots; walls by their names, which have a column in every row."""
    flat: dict[str, Any] = {}
    for name, value in jsonable(row).items():
        if name in _LEFT_OUT:
            continue
        if isinstance(value, dict):
            flat.update(_flat(value, f"{before}{name}."))
        elif isinstance(value, list) and any(isinstance(part, dict) for part in value):
            flat.update(_flat({part.get("name") or str(k): part for k, part in enumerate(value)}, f"{before}{name}."))
        else:
            flat[before + name] = value
    return flat


def _extremes(findings: Sequence[Finding]) -> list[str]:
    """The best and the worst case, what stretches in how many cases, and what is no claim."""
    known = [f for f in findings if f.share is not None]
    by_share = sorted(known, key=lambda f: f.share or 0.0)
    by_distance = sorted((f for f in known if f.distance is not None), key=lambda f: f.distance or 0.0)
    lines: list[str] = []
    for title, chosen in (
        ("least stretching", by_share[:1]),
        ("most stretching", by_share[-1:]),
        ("farthest", by_distance[-1:]),
    ):
        lines += [f"{title.capitalize()}. {f.sentence}" for f in chosen]
    causes = [f.cause for f in known]
    counts = ", ".join(f"{name.replace('_', ' ')} {causes.count(name)}" for name in dict.fromkeys(causes))
    lines.append(f"What stretches most, by number of cases: {counts}.")
    open_ones = [f for f in findings if f.row is not None and f.row.hausdorff is not None and not f.row.claimed]
    if open_ones:
        lines.append(f"In {len(open_ones)} cases the distance is not above the discretisation errors (see the table).")
    lines += [f.sentence for f in findings if f.share is None]
    return lines


def answer(findings: Sequence[Finding], units: Units | None = None) -> Verdict:
    """By how much the model is off, at the worst of the findings; as good as what was checked of all of them."""
    levels = [finding.level or UNKNOWN for finding in findings]
    first = max(findings, key=lambda f: (GRADES.index(f.level or UNKNOWN) if f.level else -1, f.distance or 0.0))
    command = QUICK if all(finding.row is None for finding in findings) else "limits"
    checks = worst_of(_checks(finding, command) for finding in findings)
    if first.level is None or first.share is None:
        bad = next((f for f in findings if not f.ok), first)
        return Verdict.of(command, bad.sentence.removesuffix("."), checks)
    told = units or first.scene.units
    by = "By estimate the" if first.row is None else "The"
    energy = f"{percent(first.left_out or 0.0)} of the energy"
    where = doubted_where(first.estimate) if first.row is None else ""
    if where:
        whole = percent((first.left_out or 0.0) + first.estimate.more)
        energy += f", or up to {whole} {where},"
    off = f"off by {length(told, first.distance)} and {energy}"
    if first.row is None and first.estimate.sides is not None:
        off += f", or by {length(told, first.estimate.sides.distances[1])} on its other side,"
    if len(findings) == 1:
        text = f"{by} {first.words} is {off} at w/h = {first.width_to_thickness:g}"
    else:
        counts = ", ".join(f"{levels.count(name)} {name}" for name in GRADES if name in levels)
        text = f"{by} {first.words} is {off} at the worst of {len(findings)} cases ({counts})"
    return Verdict.of(command, text, checks).doubted("distance", "share")


def _checks(finding: Finding, command: str) -> list[Check]:
    """What a finding rests on: the model's own state, the shell where there is one, distance and share."""
    found = {check.name: check for check in of_state(finding.scene, finding.ribbon, command)}
    if finding.row is not None:
        found |= {check.name: check for check in of_rows([finding.row], command)}
    rival = finding.estimate.rival
    if rival is not None:
        found["rivals"] = unchecked("rivals", rival.text)
    sure = finding.another is False
    for name, value in (("distance", finding.distance), ("share", finding.left_out)):
        text = f"{name} {'not known' if value is None else f'{100.0 * value:.2g} %'}"
        if name == "share" and finding.row is None:
            text += doubted_share(finding.estimate).removesuffix(".")
        if name == "distance" and finding.row is None:
            text += other_side(finding.estimate).removesuffix(".")
        grade = UNKNOWN if value is None or not sure else finding.grades.get(name, UNKNOWN)
        if name in found:  # the shell's row has its own word about it
            grade = worst(grade, found[name].grade)
        found[name] = Check(name, grade, text, value)
    return list(found.values())


def verdict(findings: Sequence[Finding], thresholds: Thresholds) -> list[str]:
    """The sentences: of every finding where they are few and no map has them, then how often the estimate was right."""
    levels = [f.level for f in findings]
    few = len(findings) <= _MOST_SENTENCES and grid_map(findings) is None
    said = [finding.sentence for finding in findings] if few else _extremes(findings)
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
    Study(
        "limits",
        f"{scene.title}: limits of inextensibility",
        verdict=answer(findings),
        tables=(table(findings),),
        sentences=tuple(verdict(findings, thresholds)),
        pictures=tuple(_pictures(out, shells, scene.title)) if shells else (),
        surfaces=() if comparison is None else _surfaces(out, comparison),
        data={"limits.csv": full_table(findings)},
        files=_FILES,
    ).write(out, result(findings, comparison, thresholds), again, scene, text=len(findings) == 1)


def _surfaces(out: Path, comparison: Comparison) -> tuple[Surface, ...]:
    """Writes the surfaces of a scene; the shells begin coloured by the membrane's share."""
    from compare.pages.written import write_fast, write_shells

    return (*write_fast(out, comparison), *write_shells(out, comparison, "membrane_share"))


def _pictures(out: Path, shells: Sequence[Finding], title: str) -> list[Picture]:
    found: list[Picture] = []
    clamps = list(dict.fromkeys(f.scene.shell.clamp for f in shells))
    for clamp in clamps:
        there = [f for f in shells if f.scene.shell.clamp == clamp]
        found += _of_one_clamp(out, there, title, f"_{clamp}" if len(clamps) > 1 else "")
    if len(shells) > 1:
        from compare.pages.pictures import limits as limits_figures

        limits_figures.estimate_picture(out / "estimate.png", shells, "Estimate against shell")
        found.append(
            Picture(
                "estimate.png",
                "Estimated against computed distance and share, on a line but for a factor",
                "Estimates from the ribbon alone against the shells; dotted: a factor of 2.",
            )
        )
    return found


def _of_one_clamp(out: Path, shells: Sequence[Finding], title: str, suffix: str) -> list[Picture]:
    """Figures 7.8 to 7.10 for one way of holding the strip."""
    from compare.pages.pictures import limits as limits_figures

    worst = max(f.share or 0.0 for f in shells)
    held = f"{briefly(shells[0].scene)} held"
    names = {kind: f"{kind}{suffix}.png" for kind in ("shares", "maps", "shapes")}
    limits_figures.shares_picture(out / names["shares"], shells, f"{title} ({held})")
    limits_figures.maps_picture(out / names["maps"], shells, f"{title} ({held})")
    limits_figures.shapes_picture(out / names["shapes"], shells, f"{title} ({held})")
    return [
        Picture(
            names["shares"],
            f"Energies by kind; {held}; stretching is at most {percent(worst)} of the elastic energy",
            "Shares of bending, membrane and shear (thesis, figure 7.9); the estimate from the ribbon alone dotted.",
        ),
        Picture(
            names["maps"],
            "Local shares of bending, membrane and shear over the flat strip, the clamp at the top",
            "Which energy prevails where (thesis, figure 7.10). Points of one colour need not store the same energy; "
            "where hardly any is stored all three strips are blue.",
        ),
        Picture(names["shapes"], f"Shells at rest from two sides, {held}", "Shells at rest (thesis, figure 7.8)."),
    ]
