"""How often four random starts find a state below the one that `solve` returns, between random clamps, and what the
probe of `ribbon.find.probe` that was to prevent it finds and costs."""

from __future__ import annotations

import functools
import time
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from scipy.stats import beta

from compare.battery.cases.seeds import BESIDE, SAME, answer, energy, random_clamps, shaken
from compare.models.base import State
from ribbon.find import minima, relax
from ribbon.problems import transfer
from ribbon.solvers.problem import RESIDUAL_TOLERANCE
from tests.validation import page
from tests.validation.kept_rows import KeptRows
from tests.validation.number import Number

#: Scenes on which the probe's starts were chosen, and others that were not looked at before.
CHOSEN, FRESH = range(200), range(200, 400)
#: Promised: the share of scenes where a lower state is found, below.
PROMISED = 0.02
#: Confidence of the intervals; halvings of the elements on which two states are compared.
LEVEL, HALVINGS = 0.95, 3


def _without(number: int) -> tuple[State, float]:
    """The answer without the probe, and the time of the processor for it in s."""
    with patch.object(minima, "_probed", lambda few, x, seen: x):
        return _timed(number)


def _timed(number: int) -> tuple[State, float]:
    scene = random_clamps(number)
    begun = time.process_time()
    found = answer(scene)
    return found, time.process_time() - begun


def others(number: int) -> list[State]:
    """What random starts end in, as the battery draws them."""
    rng = np.random.default_rng([17, number])
    return [answer(shaken(random_clamps(number), rng)) for _ in range(BESIDE)]


def finer(state: State) -> list[float]:
    """The energy on elements halved so many times; NaN where it is not found there."""
    assert state.native is not None
    problem, x = state.native.problem, state.native.x
    constant, found = energy(state) - problem.value(x), [energy(state)]
    for _ in range(HALVINGS):
        fine = problem.with_changes(lengths=np.repeat(problem.lengths, 2) / 2.0)
        near = relax.from_near(fine, transfer.transferred(problem, x, fine))
        problem, x = fine, near.x
        found.append(problem.value(x) + constant if near.residual <= RESIDUAL_TOLERANCE else float("nan"))
    return found


def above(own: float, lowest: float) -> bool:
    """Whether an energy is above another one by more than rounding."""
    return own > lowest + SAME * max(1.0, abs(lowest))


def measured(number: int) -> dict[str, Any]:
    """A scene: what solve returns with the probe and without, what four random starts do."""
    own, seconds = _timed(number)
    bare, bare_seconds = _without(number)
    ended = [one for one in others(number) if one.ok]
    best = min(ended, key=energy, default=own)
    lost = own.ok and above(energy(own), energy(best))
    seen = own.native.minima if own.native is not None else None
    return {
        "number": number, "ok": own.ok, "energy": energy(own), "without": energy(bare), "seconds": seconds,
        "seconds_without": bare_seconds, "lowest": min(energy(best), energy(own)) if own.ok else energy(best),
        "random": energy(best) if ended else None, "tries": 0 if seen is None else seen.tries,
        "finer": [finer(own), finer(best)] if lost else None,
    }  # fmt: skip


def interval(count: int, of: int) -> tuple[float, float]:
    """Clopper and Pearson's, of a share."""
    tail = 0.5 * (1.0 - LEVEL)
    low = beta.ppf(tail, count, of - count + 1) if count else 0.0
    high = beta.ppf(1.0 - tail, count + 1, of - count) if count < of else 1.0
    return float(low), float(high)


def _lost(row: dict[str, Any], key: str = "energy") -> bool:
    return row["random"] is not None and above(row[key], row["random"])


def remains(row: dict[str, Any]) -> bool:
    """Whether the difference is still there on the finest elements, by more than what the last halving changed."""
    own, best = row["finer"]
    error = abs(own[-1] - own[-2]) + abs(best[-1] - best[-2])
    return not own[-1] - best[-1] <= error


def _line(name: str, rows: list[dict[str, Any]]) -> tuple[list[str], dict[str, float]]:
    count, was = sum(_lost(row) for row in rows), sum(_lost(row, "without") for row in rows)
    low, high = interval(count, len(rows))
    better = sum(above(row["without"], row["energy"]) for row in rows)
    numbers = {"scenes": len(rows), "above": count, "without": was, "low": low, "high": high, "better": better}
    texts = [str(len(rows)), str(was), str(better), str(count), f"{100 * count / len(rows):.1f} %",
             f"{100 * low:.1f} to {100 * high:.1f} %"]  # fmt: skip
    return [name, *texts], numbers


def _energy(number: int) -> float:
    return energy(_timed(number)[0])


PROBES = {f"energy_{number}": functools.partial(_energy, number) for number in (80, 192, 26)}


def run(out: Path) -> dict[str, Number]:
    kept = KeptRows.of(out.parent / "out" / "validate" / "rivals", "compare.battery.cases.seeds", "compare.models")
    rows = []
    for number in (*CHOSEN, *FRESH):
        rows.append(kept.row(str(number), functools.partial(measured, number)))
        if number % 20 == 19:
            print(f"  rivals: {number + 1} scenes", flush=True)
    bad = [row["number"] for row in rows if not row["ok"]]
    parts = [rows[: len(CHOSEN)], rows[len(CHOSEN) :], rows]
    names = ("the probe was chosen on them", "not looked at before", "all")
    lines, numbers = zip(*(_line(name, part) for name, part in zip(names, parts, strict=True)), strict=True)
    lost = [row for row in rows if _lost(row)]
    remain = sum(map(remains, lost))
    whole, bare = (sum(row[key] for row in rows) for key in ("seconds", "seconds_without"))
    share = 1.0 - bare / whole
    every = numbers[-1]
    page.write(
        out / "rivals.md", "Does a random start find less energy than solve?", "python -m tests.validation rivals",
        "Strips between two random clamps (`compare.battery.cases.seeds.random_clamps`: 0.05 to 0.95 l apart, turned "
        "by up to a whole turn, leaning or not, hanging or weightless, curled or not, 24 elements): `solve` without a "
        "seed, and four random starts beside it. Counted: a random start ends in a stable state whose energy is lower "
        f"by more than {SAME:g} (relative, at least 1) on the same elements. Interval: Clopper and Pearson's, 95 %.",
        "The probe asks, where both ends are held and no seed is given, the images of the state found (mirrored, "
        "turned over, read from the other end), arcs twisted to either side and four committed random shapes, each by "
        "one attempt of at most 80 steps (`ribbon.find.probe`). With a seed, one clamp, a closed band or walls "
        "nothing is asked.",
        page.table(
            ["scenes", "count", "above, without the probe", "lowered by the probe", "above", "share", "interval"],
            lines,
        ),
        f"The probe takes {100 * share:.0f} % of the time of such a solve (all {len(rows)} scenes, time of the "
        f"processor, {np.mean([row['tries'] for row in rows]):.0f} tries each). Of the {len(lost)} scenes where a "
        f"random start is lower, {remain} keep a difference above what the last of {HALVINGS} halvings of the elements "
        "changed: "
        + ("; ".join(said(row) for row in lost) or "none") + ".",
        f"Without an answer: {', '.join(map(str, bad)) or 'none'}. That a state is the lowest of those seen is no "
        "proof.",
    )  # fmt: skip
    if not every["above"] < PROMISED * every["scenes"]:
        raise AssertionError(f"{every['above']} of {every['scenes']} scenes end above a random start")
    found = {
        f"{name}_{key}": Number(part[key], 0, shown="d")
        for name, part in zip(("chosen", "fresh", "all"), numbers, strict=True)
        for key in ("scenes", "above", "without", "better")
    }
    found |= {f"all_{end}": Number(100.0 * every[end], 0, "%", ".1f") for end in ("low", "high")}
    found["share"] = Number(100.0 * share, None, "%", ".0f", why="times of one run")
    found["remain"] = Number(remain, 0, shown="d")
    by = {row["number"]: row["energy"] for row in rows}
    return found | {name: Number(by[int(name[7:])], 1e-6 * abs(by[int(name[7:])]), "D w / l", ".6g") for name in PROBES}


def said(row: dict[str, Any]) -> str:
    own, best = row["finer"]
    return f"scene {row['number']}: {own[0]:.6g} above {best[0]:.6g}, on the finest {own[-1]:.6g} and {best[-1]:.6g}"
