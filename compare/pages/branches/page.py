"""What `ribbonbench branches` says and writes: branches.json, points.csv, special.csv, shapes.npz, branches.png."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from compare.measure.grades import FAIR, GOOD, POOR
from compare.page.page import Picture
from compare.page.study import Study
from compare.page.table import Column, Table
from compare.page.verdict import Check, Verdict
from compare.pages.branches.html import HTML, document
from compare.pages.branches.words import WORDS
from compare.pages.pictures.branches import branches_picture, ordinate
from compare.pages.result import state_result
from compare.store.arrays import npz_bytes
from compare.store.store import atomic_write_bytes, atomic_write_json, atomic_write_text, jsonable
from compare.studies.branches.bars import known
from compare.studies.branches.diagram import Branch, BranchPoint, Diagram
from compare.studies.branches.measured import LINE

PICTURE, RECORD, SHAPES = "branches.png", "branches.json", "shapes.npz"
ENDS = {
    "range": "an end of the range", "closed": "back at its beginning", "steps": "its last allowed point",
    "stuck": "a point behind which none was found",
    "unposed": "a point behind which its energy is not convex and its modes are those of its elements",
    "spread": "a point from which on its parts lie along each other, which is not followed",
    "unresolved": "the last point that its elements resolve", "stopped": "the end of the time",
}  # fmt: skip


def _special_columns(diagram: Diagram) -> tuple[Column, ...]:
    unit = diagram.along.unit
    return (
        Column("model", "model", kind="word"),
        Column("branch", "branch", kind="integer"),
        Column("kind", "kind", kind="word", words=WORDS),
        Column(
            "parameter", diagram.along.key, unit, "digits:8", legend="the limit of finer elements, where it settles"
        ),
        Column("parameter_error", "+-", unit, "exponent:1", legend="of that; - : not settled"),
        Column("unstable", "unstable modes", kind="integer", legend="of its side with fewer; of an event: behind it"),
        Column("order", "order", kind="digits:2", rank=9),
        Column("on_mesh", "on its own elements", unit, "digits:8", rank=9),
        Column("energy", "energy", "D w / l", "digits:6", rank=9),
        Column("what", "what happens", kind="word", rank=9),
    )


def special_table(diagram: Diagram) -> Table:
    """A row for every fold and branch point, then events; of mirror images those of one."""
    rows = []
    for branch, point in diagram.special:
        if branch.image_of is not None:
            continue
        limit = point.settled
        value = limit.value if limit is not None and limit.settles else point.parameter
        order = None if limit is None else limit.order
        rows.append(
            (branch.model, branch.number, point.kind, value, point.error, point.unstable, order, point.parameter,
             point.energy, point.what)
        )  # fmt: skip
    return Table("Folds, branch points and events", _special_columns(diagram), tuple(rows))


_BRANCHES = (
    Column("model", "model", kind="word"),
    Column("branch", "branch", kind="integer"),
    Column("begins", "begins at", kind="digits:6"),
    Column("leaves", "leaves branch", kind="integer"),
    Column("ends_at", "ends at", kind="digits:6"),
    Column("ended", "which is", kind="word", words=ENDS),
    Column("points", "points", kind="integer", rank=9),
    Column("image_of", "image of", kind="integer"),
    Column("image_by", "by", kind="word"),
    Column("least", "fewest unstable modes", kind="integer", rank=9),
)


def branch_table(diagram: Diagram) -> Table:
    """A row for every branch."""
    rows = [
        (b.model, b.number, b.points[0].parameter, None if b.leaves is None else b.leaves[0], b.points[-1].parameter,
         b.ended, len(b.points), b.image_of, b.image_by or "", min(p.unstable for p in b.points))
        for b in diagram.branches
    ]  # fmt: skip
    return Table("Branches", _BRANCHES, tuple(rows))


def point_table(diagram: Diagram) -> Table:
    """A row for every point of every branch."""
    unit = diagram.along.unit
    columns = (
        Column("model", "model", kind="word"),
        Column("branch", "branch", kind="integer"),
        Column("point", "point", kind="integer"),
        Column("kind", "kind", kind="word", words=WORDS),
        Column("parameter", diagram.along.key, unit, "digits:12"),
        Column("parameter_error", "+-", unit, "exponent:2"),
        Column("unstable", "unstable modes", kind="integer"),
        Column("energy", "energy", "D w / l", "digits:12"),
        Column("energy_error", "+-", "D w / l", "exponent:2", legend="of the energy, to the limit of finer elements"),
        Column("arc", "arc length", kind="digits:6"),
        *(Column(f"{n}_{c}", f"{n} {c}", "l", "digits:8") for n in ("end", "middle") for c in "xyz"),
        Column("shape_error", "+-", "l", "exponent:2", legend="the most that a place of its centreline is off"),
        *(Column(f"force_{c}", f"force {c}", "D w / l^2", "digits:8") for c in "xyz"),
        Column("force_error", "+-", "D w / l^2", "exponent:2", legend="of the force of what holds s = l"),
        Column("settles", "settles", kind="word", legend="whether finer elements say that all of these are errors"),
        Column("residual", "residual", kind="exponent:1"),
        Column("what", "what happens", kind="word"),
    )
    rows = [
        (b.model, b.number, k, p.kind, p.parameter, p.error, p.unstable, p.energy, known(p.bars, "energy"), p.arc,
         *p.end, *p.middle, known(p.bars, "shape"), *((None,) * 3 if p.force is None else p.force),
         known(p.bars, "force"), _settles(p), p.residual, p.what)
        for b in diagram.branches
        for k, p in enumerate(b.points)
    ]  # fmt: skip
    return Table("Points", columns, tuple(rows))


def _settles(point: BranchPoint) -> str:
    return "" if point.bars is None else "yes" if point.bars.settles else "no"


def _checks(diagram: Diagram) -> list[Check]:
    worst = max(p.residual for b in diagram.branches for p in b.points)
    short = [b for b in diagram.branches if b.ended not in ("range", "closed")]
    own = [(b, p) for b, p in diagram.special if p.kind in ("fold", "branch_point")]
    asked = [p for _, p in own]
    unknown = sum(p.settles is None for b, p in own if b.image_of is None)
    bounds = sum(p.kind == "ruling" for _, p in diagram.special)
    open_ones = diagram.unsettled
    ends = f"{len(short)} of {len(diagram.branches)} branches end early" if short else "every branch goes to an end"
    if not asked:
        settled = Check("settled", GOOD, "no fold and no branch point was met")
    elif open_ones:
        settled = Check("settled", POOR, f"{open_ones} of {len(asked)} do not settle on finer elements")
    elif unknown:
        settled = Check("settled", FAIR, "places on finer elements were not asked for")
    else:
        settled = Check("settled", GOOD, "all settle on finer elements")
    if diagram.rough and settled.grade == GOOD:
        settled = Check("settled", FAIR, f"numbers of {diagram.rough} regular points do not settle on finer elements")
    if bounds and settled.grade == GOOD:
        settled = Check("settled", FAIR, "where it falls by rulings is an upper bound: the worst ones are searched for")
    left = f"{diagram.left} more branches were met and not followed" if diagram.left else "all that were met"
    unasked = sum(b.unasked for b in diagram.branches)
    if unasked:
        left += f"; at {unasked} points it is not known whether other rulings make it fall"
    return [
        Check("residual", GOOD, f"residuals up to {worst:.1e}", worst),
        Check("ends", FAIR if short else GOOD, ends),
        settled,
        Check("complete", FAIR if diagram.left or unasked else GOOD, left),
    ]


def _place(point: BranchPoint) -> str:
    if point.kind == "ruling":
        return f"{point.parameter:.4g} at the latest"
    if point.settled is not None and point.settled.settles:
        return f"{point.settled.value:.8g} +- {point.settled.error:.1g}"
    return f"{point.parameter:.6g}" + (" (not settled)" if point.settles is False else "")


def answer(diagram: Diagram) -> Verdict:
    """Where the scene's own state loses its stability, what else is there, what is not settled first."""
    key, begin = diagram.along.key, ""
    if diagram.unsettled:
        begin = f"Not settled: {diagram.unsettled} special points are these elements' own. "
    if diagram.rough:
        of = sum(p.bars is not None and p.kind == "regular" for b in diagram.branches for p in b.points)
        begin += f"Not settled: numbers of {diagram.rough} of {of} regular points. "
    said = []
    for model in diagram.starts:
        own = next(b for b in diagram.branches if b.model == model)
        others = sum(b.model == model and b.leaves is not None and b.image_of is None for b in diagram.branches)
        said.append(f"{model}: {_told(own, key)}" + (f", {others} more branches" if others else ""))
    return Verdict.of("branches", begin + "; ".join(said), _checks(diagram)).doubted("settled")


def _told(branch: Branch, key: str) -> str:
    """What becomes of a branch's stability."""
    span = f"{key} = {branch.points[0].parameter:.6g} to {branch.points[-1].parameter:.6g}"
    start, first = branch.points[0].unstable, branch.turning
    if first is None and any(bool(p.unstable) != bool(start) for p in branch.points):
        return f"changes its stability somewhere along {span}: the place was not found"
    if first is None and start:
        first = next((p for p in branch.special if p.kind != "event"), None)
    if first is None:
        return f"{'stable' if not start else f'unstable ({start} modes)'} all along {span}"
    change = "loses its stability" if not start else f"({start} unstable modes) changes"
    what = f"where {first.what}" if first.kind == "event" else f"a {WORDS[first.kind]}"
    return f"the scene's own branch {change} at {key} = {_place(first)}, {what}"


#: What is said of modes aside of the plane of a model's unknowns, by whether they are counted.
_ASIDE = {
    True: "modes aside of its plane are counted, for rulings that are free; what leaves there is not followed",
    False: "its unknowns are of a plane, modes aside of it are not counted: --model with a ribbon's energy tells them",
}


def sentences(diagram: Diagram) -> list[str]:
    """What else to know."""
    said = []
    moving = "" if diagram.moving else ", or such as follow the passages of its curvature through zero (--moving)"
    if diagram.unsettled:
        said.append(
            f"{diagram.unsettled} folds or branch points do not settle on elements halved twice: take more elements "
            f"(--set model.elements=N){moving}, before their places are believed."
        )
    if diagram.rough:
        said.append(
            f"At {diagram.rough} regular points energy, shape or force do not settle on elements halved twice: what "
            f"stands beside them (settles = no) is no error. Take more elements (--set model.elements=N){moving}."
        )
    regular = [p for b in diagram.branches if b.image_of is None for p in b.points if p.kind == "regular"]
    if all(p.bars is None for p in regular):
        said.append("Regular points have no errors: --errors all asks finer elements for them too.")
    said += [f"{model}: {_ASIDE[counted]}." for model, counted in diagram.aside.items()]
    events = sum(p.kind == "event" and p.aside is None for _, p in diagram.special)
    if events:
        said.append(f"{events} bounds or contacts begin or end on the way; the branches go on behind them.")
    if diagram.left:
        said.append(f"{diagram.left} branches were met and not followed: --branches N follows more.")
    images = [b for b in diagram.branches if b.image_of is not None]
    if images:
        said.append(
            f"{len(images)} branches are images of others (by a mirror, a turn, or read from the other end): their own "
            "branch points were not followed again."
        )
    circles = sum(b.circle for b in diagram.branches)
    if circles:
        said.append(
            f"{circles} branches stand for a circle of branches each, turned into each other at no cost: one of it is "
            "followed, and its modes are counted without that turn."
        )
    said.append("What is not connected with these branches is not seen: a diagram is no proof that it is all.")
    return said


def record(diagram: Diagram) -> dict[str, Any]:
    """branches.json."""
    points, place = [], 0
    for b in diagram.branches:
        for k, p in enumerate(b.points):
            points.append({
                "model": b.model, "branch": b.number, "point": k, "kind": p.kind, "parameter": p.parameter,
                "parameter_error": p.error, "settles": p.settles if p.bars is None or p.settles is not None
                else p.bars.settles, "order": p.settled.order if p.settled else None,
                "limit": p.settled.value if p.settled and p.settled.settles else None,
                "on_meshes": list(p.meshes), "unstable_modes": p.unstable, "unstable_aside": p.aside,
                "stable": p.stable, "energy": p.energy, "energy_error": known(p.bars, "energy"),
                "shape_error": known(p.bars, "shape"), "end_force": p.force,
                "end_force_error": known(p.bars, "force"),
                "critical_eigenvalues": list(p.critical), "arc": p.arc, "end": p.end, "middle": p.middle,
                "residual": p.residual, "what": p.what, "shape": {"file": SHAPES, "row": place},
            })  # fmt: skip
            place += 1
    return {
        "along": diagram.along.key,
        "unit": diagram.along.unit,
        "from": diagram.along.first,
        "to": diagram.along.last,
        "branches": [
            {
                "model": b.model, "branch": b.number, "points": len(b.points), "ended": b.ended,
                "leaves": None if b.leaves is None else {"branch": b.leaves[0], "parameter": b.leaves[1]},
                "image_of": b.image_of, "image_by": b.image_by, "circle": b.circle,
                "joins": [{"branch": number, "parameter": value} for number, value in b.joins],
            }
            for b in diagram.branches
        ],
        "modes_aside": {model: "counted" if known else "not counted" for model, known in diagram.aside.items()},
        "not_followed": diagram.left,
        "not_settled": diagram.unsettled,
        "points": points,
    }  # fmt: skip


def write(out: Path, diagram: Diagram, again: str) -> None:
    """Writes everything of a diagram into the folder `out`, each file atomically."""
    branches_picture(out / PICTURE, diagram)
    found = record(diagram)
    atomic_write_json(out / RECORD, jsonable(found))
    lines = np.array([p.centreline for b in diagram.branches for p in b.points])
    atomic_write_bytes(out / SHAPES, npz_bytes({"s": np.linspace(0.0, 1.0, LINE), "centreline": lines}))
    texts = answer(diagram), sentences(diagram), (special_table(diagram), branch_table(diagram))
    atomic_write_text(out / HTML, document(diagram, *texts, (out / PICTURE).read_bytes()))
    start = next(iter(diagram.starts.values()))
    summary = {name: value for name, value in found.items() if name != "points"}
    special, points = special_table(diagram), point_table(diagram)
    Study(
        "branches",
        f"{diagram.scene.title}: branches over {diagram.along.key}",
        tables=(special, branch_table(diagram)),
        verdict=answer(diagram),
        sentences=tuple(sentences(diagram)),
        pictures=(
            Picture(
                PICTURE,
                f"{ordinate(diagram)[0]} of {len(diagram.branches)} branches over {diagram.along.key}, full where "
                "stable, dashed where not; folds, branch points and events are marked, with their errors.",
                "Bifurcation diagram",
            ),
        ),
        data={"points.csv": points, "special.csv": special},
        files={
            "result.json": "the state where it begins, and the special points",
            RECORD: "every point of every branch",
            "points.csv": "the same as a table", "special.csv": "folds, branch points and events",
            HTML: "the diagram to click on, with the strip's shape at every point: one file for any browser",
            SHAPES: "centrelines (points, 101, 3) in l, in the order of branches.json",
        },
    ).write(out, {
        **state_result(diagram.along.scene_at(0.0), start), "branches": summary, "special": special.records(),
    }, again, diagram.scene)  # fmt: skip
