"""4.3 for both signs of K: how far every one-dimensional model is from the shell, and what its accuracy costs."""

from __future__ import annotations

import csv
import json
import resource
from collections.abc import Sequence
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.measure.distance import centreline_distance, grid_hausdorff
from compare.measure.front import Mark, reach
from compare.models import solve
from compare.models.base import Options, Size, State, natural_constant
from compare.models.shell import mesh_size
from compare.scene.scene import Scene, load
from compare.store.store import CaseStore, atomic_write_text
from tests.validation import one_core, page
from tests.validation.number import Number
from tests.validation.workbench import models_4_3_figures as figures
from tests.validation.workbench import models_4_3_times as times

FloatArray = NDArray[np.float64]

SCENES = ("curl_4_3", "curl_4_3_down")
RATIOS = (10.0, 20.0, 50.0, 100.0, 200.0, 400.0)
#: Scene and w/h of the work-precision diagrams.
HEADLINES = (("curl_4_3", 100.0), ("curl_4_3", 20.0))
FOLDER, SHELLS = "models_4_3", "shells.npz"
#: Meshes of the shells that errors are measured to, and of those on the diagram.
MESH = (100, 8)
MESHES = ((25, 2), (50, 4), (100, 4))
ELEMENTS = (5, 10, 20, 40, 80)
#: Elements of the table: five times as many as the scene has.
FINE = 100
TARGETS = (1e-2, 5e-3, 3e-3, 2e-3, 1.5e-3, 1e-3)
REPEATS = 5
S, V = np.linspace(0.0, 1.0, 201), np.linspace(-0.5, 0.5, 5)

#: What each model sets in the scene; only two of them know of a clamp that holds the whole edge.
MODELS: dict[str, dict[str, Any]] = {
    "sadowsky": {"model.energy": "sadowsky", "clamp.start.ruling": "free"},
    "wunderlich": {"model.energy": "wunderlich"},
    "kirchhoff": {"model.energy": "kirchhoff", "clamp.start.ruling": None},
    "sadowsky_kt": {"model.energy": "sadowsky_kt", "clamp.start.ruling": None},
    "sano": {"model.energy": "sano", "clamp.start.ruling": None},
    "extensible": {"model.energy": "extensible", "clamp.start.ruling": None},
    "finite": {"model.energy": "finite"},
    "finite + in_plane": {"model.energy": "finite", "model.in_plane": True},
}
#: Pages whose tables are read.
READS = ("curl_4_3/table.csv", "curl_4_3_down/table.csv")
HEADS = (
    "scene", "w/h", "model", "status", "hausdorff / l", "centreline / l", "end / l", "elastic energy", "membrane share",
)  # fmt: skip


@dataclass(frozen=True)
class Shell:
    """A shell's state, and the processor time of its solve (s): no import, no compilation of forms."""

    state: State
    seconds: float


def scene_of(name: str, ratio: float, model: str | None = None) -> Scene:
    """The shipped scene at one w/h, for a model of `MODELS`."""
    return load(name).replace({"shell.width_to_thickness": [ratio], **({} if model is None else MODELS[model])})


def shell(name: str, ratio: float, mesh: tuple[int, int], work: Path = Path("out/validate/models_4_3")) -> Shell:
    """The shell, kept in `work` with the time it took."""
    times = work / f"{name}_{ratio:g}_{mesh[0]}x{mesh[1]}.json"
    before = _children()
    state = solve(
        scene_of(name, ratio), "shell", size=mesh_size(mesh), options=Options(store=CaseStore(work / "cases"))
    )
    if not state.ok:
        raise AssertionError(f"{name}, w/h = {ratio:g}, {mesh}: the shell is {state.word}")
    if not state.reused:
        spent = state.native.data["seconds"]
        share = 1.0 - (spent.get("import", 0.0) + spent.get("compile", 0.0)) / spent["total"]
        atomic_write_text(
            times, json.dumps({"processor": (_children() - before) * share, "wall": state.native.seconds})
        )
    kept = json.loads(times.read_text())["processor"] if times.exists() else state.native.seconds
    return Shell(state, float(kept))


def _children() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def ribbon(name: str, ratio: float, model: str, elements: int, formulation: str = "mixed") -> State:
    """A one-dimensional model on elements graded towards the clamp."""
    return solve(scene_of(name, ratio, model), "ribbon", size=Size(formulation, (float(elements),)))


def membrane(state: State, constant: float) -> float:
    """Its part of the elastic energy with the constant of the natural curvature; 0 of a model that does not stretch."""
    return float(state.energy.parts.get("membrane", 0.0)) / (state.energy.elastic + constant)


@dataclass(frozen=True)
class CachedRun:
    """A shell on 100 x 8 elements as results/models_4_3/shells.npz keeps it (single precision, lengths in l).

    points (201, 5, 3) at S x V, centreline (201, 3) at S; elastic: energy in D w / l without the natural constant.
    """

    points: FloatArray
    centreline: FloatArray
    elastic: float


def kept(folder: Path, name: str, ratio: float) -> CachedRun:
    """From the file, where it stands; else solved, a minute each on one core, and added to it."""
    path, key = folder / SHELLS, f"{name}/{ratio:g}/"
    there = dict(np.load(path)) if path.exists() else {}
    if key + "points" not in there:
        state = shell(name, ratio, MESH).state
        there[key + "points"] = state.shape.points(S, V * load(name).width).astype(np.float32)
        there[key + "centreline"] = state.shape.centreline(S).astype(np.float32)
        there[key + "elastic"] = np.float64(state.energy.elastic)
        np.savez_compressed(path, **there)
    return CachedRun(
        *(there[key + what].astype(float) for what in ("points", "centreline")), float(there[key + "elastic"])
    )


def known(out: Path, name: str) -> dict[float, dict[str, float]]:
    """Discretisation error and membrane share of the shells by w/h, from the comparison's own page."""
    with (out / name / "table.csv").open() as lines:
        return {
            float(row["width_to_thickness"]): {
                "error": float(row["shell_error"]),
                "share": float(row["membrane_share"]),
            }
            for row in csv.DictReader(lines)
            if row["status"] == "converged" and row["shell_error"]
        }


def distances(out: Path, name: str, ratio: float) -> list[list[Any]]:
    """Rows of the table (`HEADS`), the shell's own first."""
    scene, own = load(name), kept(out / FOLDER, name, ratio)
    there = known(out, name).get(ratio, {})
    constant = natural_constant(scene.curvature)
    rows: list[list[Any]] = [
        [name, ratio, "shell", "converged", there.get("error"), None, None, own.elastic, there.get("share")]
    ]
    for model in MODELS:
        state = ribbon(name, ratio, model, FINE)
        line = state.shape.centreline(S)
        apart = grid_hausdorff(state.shape.points(S, V * scene.width), own.points)
        end = float(np.linalg.norm(line[-1] - own.centreline[-1]))
        away = [apart, centreline_distance(line, own.centreline), end]
        rows.append([name, ratio, model, state.word, *away, state.energy.elastic, membrane(state, constant)])
        print("  ", *rows[-1], flush=True)
    return rows


def precision(out: Path, name: str, ratio: float) -> dict[str, list[Mark]]:
    """Error to the finest shell against processor time, by model."""
    from compare.models.ribbon.model import sized
    from compare.models.ribbon.solving import solver
    from compare.models.ribbon.state import RibbonShape

    best, across = kept(out / FOLDER, name, ratio).points, V * load(name).width
    found: dict[str, list[Mark]] = {model: [] for model in MODELS}
    for model, marks in found.items():
        for elements in ELEMENTS:
            scene = sized(scene_of(name, ratio, model), Size("chained" if elements <= 40 else "mixed", (elements,)))
            state, seconds = one_core.timed(solver(scene), REPEATS + 1, 10.0)
            if not state.ok:
                print(f"   {model}, {elements} elements: {state.status.code}", flush=True)
                continue
            error = grid_hausdorff(RibbonShape(state).points(S, across), best)
            marks.append(Mark(str(elements), seconds, error))
            print("  ", ratio, model, marks[-1], flush=True)
    runs = [(mesh, shell(name, ratio, mesh)) for mesh in MESHES]
    found["shell"] = [
        Mark(f"{mesh[0]} x {mesh[1]}", run.seconds, grid_hausdorff(run.state.shape.points(S, across), best))
        for mesh, run in runs
    ]
    return found


def reach_rows(found: dict[str, list[Mark]]) -> list[list[str]]:
    """Time to each total error: finite, extensible, Wunderlich, shell, and the factor from finite to the shell."""
    rows = []
    for target in TARGETS:
        seconds = {name: reach(found[name], target) for name in ("wunderlich", "extensible", "finite", "shell")}
        row = [f"{target:.1e}"]
        for at in seconds.values():
            row.append("-" if at is None or at.seconds is None else f"{'<= ' if at.bound else ''}{at.seconds:.3g}")
        ours, theirs = seconds["finite"], seconds["shell"]
        both = ours is not None and theirs is not None and ours.seconds is not None and theirs.seconds is not None
        row.append(f"{theirs.seconds / ours.seconds:.0f}" if both else "-")  # type: ignore[union-attr, operator]
        rows.append(row)
    return rows


def by_ratio(rows: Sequence[Sequence[Any]], name: str, column: str, digits: str = "{:.1e}") -> str:
    """A Markdown table of one column: models down, w/h across."""
    at = HEADS.index(column)
    ratios = sorted({row[1] for row in rows if row[0] == name})
    lines = []
    for model in ("shell", *MODELS):
        values = {row[1]: row[at] for row in rows if row[0] == name and row[2] == model}
        if any(value is not None for value in values.values()):
            lines.append([model, *("-" if values.get(r) is None else digits.format(values[r]) for r in ratios)])
    return page.table(["model", *(f"w/h = {ratio:g}" for ratio in ratios)], lines)


def as_csv(heads: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """Comma-separated, six digits."""
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(heads)
    writer.writerows([[f"{v:.6g}" if isinstance(v, float) else v for v in row] for row in rows])
    return text.getvalue()


def measured(out: Path, ratios: Sequence[float], headlines: Sequence[tuple[str, float]]) -> tuple[Any, Any, Any]:
    """All rows, the marks of the diagrams, and the times of one scene."""
    rows = [row for name in SCENES for ratio in ratios for row in distances(out, name, ratio)]
    marks = {(name, ratio): precision(out, name, ratio) for name, ratio in headlines}
    return rows, marks, times.measured(MODELS)


def elastic(model: str, elements: int = FINE) -> float:
    """Elastic energy (D w / l) of a model on the curl at w/h = 100."""
    return float(ribbon(SCENES[0], 100.0, model, elements).energy.elastic)


#: Models whose energy is computed again by `make test`.
PROBED = ("wunderlich", "extensible", "finite")
PROBES = {f"elastic_{model}": lambda model=model: elastic(model) for model in PROBED}


def numbers(rows: Sequence[Sequence[Any]], marks: dict[Any, dict[str, list[Mark]]], spent: Any) -> dict[str, Number]:
    """Distances with the shells' own errors, energies with their change on half as many elements, times."""
    found = {}
    for model in PROBED:
        value = elastic(model)
        found[f"elastic_{model}"] = Number(value, abs(value - elastic(model, FINE // 2)), "D w / l", ".4f")
    errors = {(row[0], row[1]): row[4] for row in rows if row[2] == "shell"}
    for scene, ratio, model, _, distance, *_ in rows:
        if model != "shell":
            name = f"{model.replace(' + ', '_')}_{'up' if scene == SCENES[0] else 'down'}_{ratio:g}"
            error = errors[scene, ratio]
            why = "" if error is not None else "the comparison has no shell of this w/h"
            found[name] = Number(distance, error, "l", ".1e", why)
    for (_, ratio), work in marks.items():
        ours = next(mark for mark in work["finite"] if mark.label == "20")
        error = max(ours.error, work["finite"][-1].error)
        at = reach(work["shell"], error)
        found[f"equal_error_{ratio:g}"] = Number(error, error, "l", ".1e")
        if at is not None and at.seconds is not None:
            found[f"factor_{ratio:g}"] = Number(
                at.seconds / ours.seconds, None, "", ".0f", "processor times of one run"
            )
    most = max(error for error in errors.values() if error is not None)
    found["shells_most"] = Number(most, most, "l", ".1e")
    for model in ("extensible", "finite"):
        found[f"slower_{model}"] = Number(times.worst(spent, model), None, "", ".1f", "processor times of one run")
    return found


def run(out: Path, ratios: Sequence[float] = RATIOS, headlines: Any = HEADLINES) -> dict[str, Number]:
    """Writes models_4_3/: README.md, distances.csv, work.csv, shell.csv and two figures."""
    folder = out / FOLDER
    folder.mkdir(parents=True, exist_ok=True)
    (folder / SHELLS).unlink(missing_ok=True)  # those of an earlier program; the store of cases keeps today's
    rows, marks, spent = one_core.call(measured, out, ratios, headlines)
    atomic_write_text(folder / "times.csv", as_csv(times.HEADS, spent))
    atomic_write_text(folder / "distances.csv", as_csv(HEADS, rows))
    work = [
        [name, ratio, model, mark.label, mark.seconds, mark.error]
        for (name, ratio), found in marks.items() for model, those in found.items() for mark in those
    ]  # fmt: skip
    atomic_write_text(folder / "work.csv", as_csv(("scene", "w/h", "model", "size", "seconds", "error / l"), work))
    write_shells(folder, ratios)
    figures.distances(folder / "distances.png", rows, HEADS, SCENES, tuple(MODELS))
    figures.work(folder / "work.png", marks)
    write_page(folder, rows, marks, spent)
    return numbers(rows, marks, spent)


def write_shells(folder: Path, ratios: Sequence[float]) -> None:
    """Nine points of every shell's centreline, for the test."""
    lines: list[list[Any]] = []
    for name in SCENES:
        for ratio in ratios:
            points = kept(folder, name, ratio).centreline[::25]
            lines += [[name, ratio, k / 8.0, *(f"{x:.9f}" for x in point)] for k, point in enumerate(points)]
    atomic_write_text(folder / "shell.csv", as_csv(("scene", "w/h", "s / l", "x", "y", "z"), lines))


def write_page(folder: Path, rows: Any, marks: dict[Any, dict[str, list[Mark]]], spent: list[list[Any]]) -> None:
    """README.md from the numbers."""
    parts: list[str] = [
        "How far each one-dimensional model is from the Naghdi shell (100 x 8 elements of degree 2, "
        "[shells.npz](shells.npz)), D and Gamma kept: "
        "`curl_4_3` and `curl_4_3_down`, the whole edge held (ruling straight for wunderlich and finite; the others "
        f"know of no edge), {FINE} elements graded towards the clamp. No constant is fitted. Numbers: "
        "[distances.csv](distances.csv), [work.csv](work.csv).",
        "![distance to the shell against w/h](distances.png)",
    ]
    for name in SCENES:
        parts += [
            f"## {load(name).title}",
            "Hausdorff distance of the surfaces over l; of the shell its own error, to 50 x 4 elements:",
            by_ratio(rows, name, "hausdorff / l"),
            "Largest distance of centreline points of equal abscissa over l:", by_ratio(rows, name, "centreline / l"),
            "Elastic energy in D w / l, without the constant of the natural curvature:",
            by_ratio(rows, name, "elastic energy", "{:.4f}"),
            "Membrane share of the elastic energy (with the constant):",
            by_ratio(rows, name, "membrane share", "{:.4%}"),
        ]  # fmt: skip
    parts += [
        "## What accuracy costs",
        "Total error (Hausdorff distance to the finest shell over l: the model's and the discretisation's together) "
        "against processor time of one solve, one thread of a shared machine: one-dimensional models on 5 to 80 graded "
        "elements (median of five warm solves, chained to 40 elements, glued with 80), the shell on "
        "25 x 2 to 100 x 4 elements (one solve along its path, without import and compilation). The finest shell has "
        "100 x 8; its own error is in the first table, and no total error below that means anything.",
        "![total error against time](work.png)",
    ]
    for (name, ratio), found in marks.items():
        parts += [f"### {name}, w/h = {ratio:g}", "\n".join(f"- {line}" for line in headline(found))]
        heads = ["total error / l", *(f"{m} s" for m in ("wunderlich", "extensible", "finite", "shell")), "factor"]
        parts.append(page.table(heads, reach_rows(found)))
    parts.append(
        "Times are interpolated in log-log between neighbours on a model's Pareto front; <=: its fastest run is there "
        "already; -: not reached; factor: the shell's time over that of finite."
    )
    parts += [
        "## Time beside Wunderlich's energy",
        f"The same scenes at w/h = {times.RATIO:g}, the same elements: iterations, processor time of a warm solve, and "
        f"that over wunderlich's. At most {times.worst(spent, 'extensible'):.1f} times for extensible, "
        f"{times.worst(spent, 'finite'):.1f} for finite, {times.worst(spent, 'finite + in_plane'):.1f} with in-plane "
        "bending. The energy of sadowsky_kt has a pole at k = 0, which can cost it iterations. Numbers: "
        "[times.csv](times.csv).",
        times.part(spent),
    ]
    page.write(
        folder / "README.md", "Every model against the shell, 4.3", "python -m tests.validation models_4_3", *parts
    )


def headline(found: dict[str, list[Mark]]) -> list[str]:
    """The factor at equal total error: that of the scene's 20 elements, or of the finest where that is larger."""
    ours = next(mark for mark in found["finite"] if mark.label == "20")
    last = found["finite"][-1]
    error = max(ours.error, last.error)
    at = reach(found["shell"], error)
    said = [
        f"finite: total error {ours.error:.1e} l with 20 elements, {last.error:.1e} l with {last.label} (that is the "
        "model's own; where fewer elements are nearer, the two errors have opposite signs)."
    ]
    if at is not None and at.seconds is not None:
        said.append(
            f"At the larger of these, {error:.1e} l: finite {1e3 * ours.seconds:.3g} ms, the shell on its own "
            f"{at.seconds:.3g} s: **a factor {at.seconds / ours.seconds:.0f} at equal total error**."
        )
    for name in ("wunderlich", "extensible"):
        least = min(found[name], key=lambda mark: mark.error)
        said.append(f"{name} comes to {least.error:.1e} l at best, however fine it is.")
    said.append("For less than finite's own error there is the shell alone.")
    return said
