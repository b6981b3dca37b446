"""The suite: what every runner scores, and what accuracy costs each on rods that all of them have (results/suite.md).

Scores: every case by every runner that is here, each in a process of its own with one thread. Work: the free end of
four rods beside the collocation of `compare.suite.reference`, which has no mesh, over four meshes of each program;
processor time of the solve alone, without imports and compilation: of CalculiX's and AUTO-07p's process as a whole.
"""

from __future__ import annotations

import csv
import functools
import itertools
import json
import math
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from compare.suite import ours, runners
from compare.suite.answers import NOT_REPRESENTABLE, Absent, Answers, BrokeDown, NotRepresentable
from compare.suite.case import Case, first_scene, load, shipped
from compare.suite.peers import auto, calculix, call
from compare.suite.peers.runners import PROGRAMS
from compare.suite.reference import both_ways
from compare.suite.score import MET, Score, scored
from compare.suite.section import bar_of
from tests.validation import one_core, page
from tests.validation.number import Number
from tests.validation.pieces import Pieces

#: Others than ours: how each answers, from the tree itself, for some are entry points of what is installed. Not fedoo:
#: with SciPy's solver, all that it has in the runner's python, no curl came beyond two thirds of its load in a minute.
RUNNERS: Mapping[str, runners.Runner] = {
    "calculix": calculix.calculix, "auto": auto.auto,
    **{name: program.answers for name, program in PROGRAMS.items()},
}  # fmt: skip
OTHERS = tuple(RUNNERS)
#: Seconds that each way of a runner has for a case.
BUDGET = 600.0
#: Rods of the page on work, with those of our models that have them.
WORK = {
    "cantilever_10": ("elastica", "kirchhoff"), "bend_45": ("antman",), "rod_4_4": ("antman", "curve_angle"),
    "tang_dowell_45": ("antman",),
}  # fmt: skip
#: Elements of the meshes; of the planar elastica, whose elements have degree 4.
SIZES, COARSE = (5, 10, 20, 40, 80), (2, 4, 8, 16)
#: Seconds that a foreign program has for one mesh; distances of the free end (l) at which times are compared.
MESH, REACHED = 120.0, (1e-2, 1e-3, 1e-4)
#: What the two ways of a reference differ by at most, in l.
SURE = 1e-10
#: The runs that `make test` makes again.
PROBED = (("cantilever_10", "kirchhoff", 5), ("bend_45", "antman", 5))


class Mesh(NamedTuple):
    """One mesh of a program: elements, distance of its free end to the reference (l), processor time (s)."""

    elements: int
    error: float
    seconds: float


def absent() -> str | None:
    """What is not here."""
    missing = [name for name in OTHERS if not there(name)]
    return f"no {', '.join(missing)} ({call.VARIABLE} names a python that has the libraries)" if missing else None


def there(name: str) -> bool:
    """Whether a foreign runner's program is on this machine."""
    asked: Mapping[str, Callable[[], object]] = {"calculix": calculix.version, "auto": auto.library}
    try:
        asked.get(name, lambda: call.interpreter(PROGRAMS[name].library))()
    except Absent:
        return False
    return True


@functools.cache
def reference(name: str) -> np.ndarray:
    """The free end (3,) of a rod over its length."""
    case = load(name)
    first, second = both_ways(bar_of(first_scene(case), case.theory).free_rod)
    if np.abs(first - second).max() > SURE:
        raise ArithmeticError(f"{name}: collocation and shooting differ by {np.abs(first - second).max():.1e} l")
    return first


def _way(name: str) -> ours.Way:
    (found,) = (way for way in ours.WAYS if way.name == name)
    return found


def ours_at(name: str, model: str, elements: int, repeats: int = 5) -> Mesh:
    """One of our models on so many elements: a warm solve with its check of stability."""
    case, way = load(name), _way(model)
    scene = ours.scene_of(case, way, elements)
    state, seconds = one_core.timed(lambda: ours.solved(scene, way, elements), repeats + 1, 6.0)
    if state.shape is None or not state.is_equilibrium:
        raise ArithmeticError(f"{name}, {model}, {elements}: {state.word}")
    return Mesh(elements, _apart(state.shape.centreline(np.array([1.0]))[0], name), seconds)


def off(name: str, model: str, elements: int) -> float:
    """How far one of our models is from the reference, in l."""
    return ours_at(name, model, elements, 0).error


PROBES: Mapping[str, Callable[[], float]] = {
    f"off_{case}_{model}_{n}": functools.partial(off, case, model, n) for case, model, n in PROBED
}


def _apart(end: np.ndarray, name: str) -> float:
    return float(np.linalg.norm(np.asarray(end) - reference(name)))


def other_at(name: str, program: str, elements: int) -> Mesh | str:
    """A foreign program on so many elements; in words, why not."""
    case = load(name)
    scene = first_scene(case)
    try:
        if program == "calculix":
            reply = calculix.solved(calculix.plate_of(scene, case.theory), elements, MESH)
        elif program == "auto":
            auto.linked(auto.SOURCE)  # compiled before its time is taken
            reply = auto.solved(bar_of(scene, case.theory), elements, MESH)
        else:
            known, bar = PROGRAMS[program], bar_of(scene, case.theory)
            python, _ = call.interpreter(known.library)
            texts = [known.text(bar, elements)] if known.text is not None else []
            asked = {"bars": [bar.to_dict()], "size": elements, "texts": texts}
            reply = call.points_of(python, known.script, asked, MESH)
    except (BrokeDown, NotRepresentable) as why:
        return str(why)
    return Mesh(elements, _apart(reply.points[0][-1], name), float(reply.seconds or math.nan))


# -- scores


def scores_of(runner: str, name: str, budget: float) -> list[dict[str, Any]]:
    """What a runner answers to a case, as records of answers.json."""
    answers = RUNNERS[runner] if runner in RUNNERS else runners.runner(runner)
    said = runners.answered(answers, load(name), budget)
    return [one.to_dict() for one in said]


def answers(kept: Pieces, names: tuple[str, ...], budget: float) -> list[Score]:
    """Of all runners to all cases."""
    found = []
    for runner in ("ours", *OTHERS):
        for name in names:
            make = functools.partial(scores_of, runner, name, budget)
            said = kept.get(f"{runner}-{name}", functools.partial(one_core.call, make) if runner == "ours" else make)
            for one in map(Answers.from_dict, said):
                found += list(scored(load(name), runner, one))
    return found


def best(scores: list[Score]) -> Score:
    """Of one question by one runner: met, else the nearest, else whatever is said of it but that another theory."""
    rank = {MET: 0, "off": 1, "another equilibrium": 2, NOT_REPRESENTABLE: 4}
    return min(scores, key=lambda s: (rank.get(s.outcome, 3), s.off if s.off is not None else 0.0))


def cell(scores: list[Score]) -> str:
    """Of one case by one runner: its questions' outcomes."""
    asks = [best([s for s in scores if s.ask == ask]) for ask in dict.fromkeys(s.ask for s in scores)]
    met = [s for s in asks if s.outcome == MET]
    if len(met) == len(asks):
        return "met"
    away = [s.off for s in asks if s.off is not None and s.outcome != MET]
    if away:
        mesh = max((s.mesh or 0.0) for s in asks)
        return f"off {max(away):.2g}" + (f" (mesh {mesh:.2g})" if mesh > 0.25 * max(away) else "")
    return "-" if all(s.outcome == NOT_REPRESENTABLE for s in asks) else asks[0].outcome


def questions(scores: list[Score], runner: str, outcome: str | None = None) -> int:
    """Questions that a runner answered, or those with an outcome of one of its ways at least."""
    rows = [
        s for s in scores if s.runner == runner and (s.off is not None if outcome is None else s.outcome == outcome)
    ]
    return len({(s.case, s.ask) for s in rows})


def reasons(scores: list[Score]) -> list[str]:
    """Why ours met a question by none of its models, and how foreign programs broke down."""
    lines = []
    for runner in ("ours", *OTHERS):
        for case in shipped():
            own = [s for s in scores if s.runner == runner and s.case == case]
            for ask in dict.fromkeys(s.ask for s in own):
                one = best([s for s in own if s.ask == ask])
                if one.outcome not in (MET, NOT_REPRESENTABLE) and (runner == "ours" or one.off is None):
                    by = f"{runner}, {one.way}" if one.way else runner
                    lines.append(f"- {case}, {ask} ({by}): {one.told}" + (f"; {one.why}" if one.why else ""))
    return list(dict.fromkeys(lines))


# -- work


def worked(name: str, program: str) -> list[list[Any]]:
    """Rows of a program's meshes of one rod, from the first that it solves to the first that it does not; where it
    solves none, one row with the reason."""
    mine = program in WORK[name]
    rows: list[list[Any]] = []
    why = ""
    for n in COARSE if program == "elastica" else SIZES:
        found = ours_at(name, program, n) if mine else other_at(name, program, n)
        if not isinstance(found, str):
            rows.append(list(found))
        elif rows:
            break
        else:
            why = found
    return rows or [[0, why, 0.0]]


def reached(rows: list[list[Any]], error: float) -> float | None:
    """Time (s) at an error, between meshes by powers; None where it is not reached, or already by the coarsest."""
    meshes = [Mesh(*row) for row in rows if not isinstance(row[1], str)]
    for one, two in itertools.pairwise(meshes):
        if two.error <= error < one.error:
            part = math.log(one.error / error) / math.log(one.error / two.error)
            return float(one.seconds * (two.seconds / one.seconds) ** part)
    return None


def picture(path: Path, work: Mapping[str, Mapping[str, list[list[Any]]]]) -> None:
    """Error against time, a panel for each rod."""
    import matplotlib.pyplot as plt

    size = (4.0 * len(work), 3.6)
    figure, grid = plt.subplots(1, len(work), figsize=size, sharey=True, layout="constrained", squeeze=False)
    for panel, (name, programs) in zip(grid[0], work.items(), strict=True):
        for program, rows in programs.items():
            meshes = [Mesh(*row) for row in rows if not isinstance(row[1], str)]
            if meshes:
                own = program in WORK[name]
                panel.loglog(
                    [m.seconds for m in meshes], [m.error for m in meshes], "o-" if own else "s--", label=program
                )
        panel.set(title=name, xlabel="processor time (s)")
        panel.legend(fontsize=7)
    grid[0, 0].set_ylabel("free end, distance / l")
    figure.savefig(path, dpi=120)
    plt.close(figure)


def _of_one_case(scores: list[Score], case: Case) -> list[str]:
    rows = [[s for s in scores if s.case == case.name and s.runner == r] for r in ("ours", *OTHERS)]
    return [case.name, case.level, str(len(case.asks)), *map(cell, rows)]


def run(out: Path, names: tuple[str, ...] | None = None, budget: float = BUDGET) -> dict[str, Number]:
    """Writes suite.md, suite.csv and suite.png."""
    os.environ["OMP_NUM_THREADS"] = "1"
    names, kept = names or shipped(), Pieces("suite")
    scores = answers(kept, names, budget)
    work = {
        name: {
            program: kept.get(f"work-{name}-{program}", functools.partial(one_core.call, worked, name, program))
            for program in (*models, *OTHERS)
        }
        for name, models in WORK.items()
    }
    numbers = _numbers(scores, work)
    with (out / "suite.csv").open("w", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(
            ("runner", "way", "case", "asked", "outcome", "value", "reference", "off", "mesh", "seconds", "why")
        )
        for s in sorted(scores, key=lambda s: (s.runner, s.case, s.way)):
            value = None if s.value is None else json.dumps(s.value)
            writer.writerow((s.runner, s.way, s.case, s.ask, s.outcome, value, json.dumps(s.reference), s.off, s.mesh,
                             None if s.seconds is None else f"{s.seconds:.1f}", s.why))  # fmt: skip
    picture(out / "suite.png", work)
    _write(out, [load(name) for name in names], scores, work, budget)
    return numbers


def _numbers(scores: list[Score], work: Mapping[str, Mapping[str, list[list[Any]]]]) -> dict[str, Number]:
    asks = {(s.case, s.ask) for s in scores}
    numbers = {"asked": Number(len(asks), 0, shown="d"), "met": Number(questions(scores, "ours", MET), 0, shown="d")}
    numbers["others"] = Number(sum(questions(scores, one) > 0 for one in OTHERS), 0, shown="d")
    for one in OTHERS:
        numbers[f"answered_{one}"] = Number(questions(scores, one), 0, shown="d")
        numbers[f"met_{one}"] = Number(questions(scores, one, MET), 0, shown="d")
    for name, programs in work.items():
        for program, rows in programs.items():
            for n, error, seconds in rows:
                if not isinstance(error, str):
                    numbers[f"off_{name}_{program}_{n}"] = Number(error, SURE, "l", ".1e")
                    numbers[f"ms_{name}_{program}_{n}"] = Number(
                        1e3 * seconds, None, "ms", ".3g", "processor time of one run"
                    )
            for level in REACHED:
                found = reached(rows, level)
                if found is not None:
                    at = f"reach_{name}_{program}_1e{-round(math.log10(level))}"
                    numbers[at] = Number(1e3 * found, None, "ms", ".3g", "processor time of one run")
    return numbers


def _write(
    out: Path, cases: list[Case], scores: list[Score], work: Mapping[str, Mapping[str, list[list[Any]]]], budget: float
) -> None:
    versions = {s.runner: s.version for s in scores if s.version}
    counted = [
        f"- {one}{f' ({versions[one]})' if one in versions else ''}: {questions(scores, one)} questions answered, "
        f"{questions(scores, one, MET)} of them within the interval of the reference"
        for one in ("ours", *OTHERS)
    ]
    parts = []
    for name, programs in work.items():
        rows = []
        for program, meshes in programs.items():
            said = [row for row in meshes if isinstance(row[1], str)]
            told = [f"{n}: {error:.1e}, {1e3 * s:.3g} ms" for n, error, s in meshes if not isinstance(error, str)]
            times = [reached(meshes, level) for level in REACHED]
            cells = ["-" if t is None else f"{1e3 * t:.3g}" for t in times]
            rows.append([program, "; ".join(told) or said[0][1], *cells])
        heads = (
            "program",
            "elements: distance of the free end / l, processor time",
            *(f"ms at {e:.0e}" for e in REACHED),
        )
        parts += [f"### {load(name).title} ({name})", page.table(heads, rows)]
    page.write(
        out / "suite.md", "The suite: scores, and work against precision", "python -m tests.validation suite",
        f"`ribbonbench suite run --runner ...` on all {len(cases)} cases, {budget:g} s for each model or program and "
        "case. Met: within the interval of the reference; off: by so many intervals (of the nearest of its models), "
        "with the program's own discretisation error where that is a good part of it; -: not representable, by the "
        "theory, the physics or the question. Adapters make clamped cantilevers; what they refuse is no verdict on a "
        "program. Every answer is in [suite.csv](suite.csv).",
        f"{len({(s.case, s.ask) for s in scores})} questions are asked.",
        "\n".join(counted),
        page.table(("case", "level", "asks", "ours", *OTHERS), [_of_one_case(scores, case) for case in cases]),
        "\n".join([
            "What ours met by none of its models, and where others ended:", "", *(reasons(scores) or ["- nothing"])
        ]),
        "## Work against precision",
        "Free ends of rods beside the collocation of the rod's own equations (two ways within 1e-10 l). One thread; "
        "processor time of the solve without imports, models and compilation; ours warm, with its check of stability, "
        "median of five; the others one run each, CalculiX's and AUTO-07p's whole processes. MuJoCo is made for "
        "motion: "
        "its balance is found by Newton's method with differences, written for it here. PyElastica is let fall. Times "
        "at an error are between meshes by powers; -: not reached, or already by the coarsest mesh. The bend's rod "
        "shears and stretches; OpenSees' does not shear, MuJoCo's neither, and they end at what that is.",
        "![Error against time](suite.png)",
        *parts,
    )  # fmt: skip
