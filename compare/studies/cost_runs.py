"""The timed runs of `ribbonbench cost`: one size of one ladder, its surface and its times, kept as soon as it is done.

warm: the solve alone in a process that has everything loaded. start: what a process that begins fresh adds to it (start
of the process, imports, loading of compiled code). A model that solves in a process of its own brings both with every
run; the others are repeated here, and their start is measured once per family of ladders (`cost_start`).
"""

from __future__ import annotations

import math
import shutil
import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from compare.measure.align import aligned
from compare.measure.grid import Grid
from compare.models.base import Size, State, Status
from compare.models.capabilities import Reference
from compare.store.arrays import npz_bytes
from compare.store.provenance import versions
from compare.store.store import CaseStore, atomic_write_bytes, atomic_write_json, case_key, read_json

FloatArray = NDArray[np.float64]

_EQUILIBRIA = (Status.CONVERGED, Status.UNSTABLE)


@dataclass(frozen=True)
class Run:
    """One size of one ladder, run one or more times.

    solver: the ladder's name; label: its size; unknowns: of the discrete problem; status: the model's word; seconds:
    warm times in s; start: further seconds of a fresh process, where every run is one; points (k, m, 3): its surface on
    the grid, units of l, None when there is none; model: its name; begun: where the solve began, the model's word;
    message: the model's; energy: total, D w / l; reused: found among finished runs; size: the one of the ladder.
    """

    solver: str
    label: str
    unknowns: int
    status: str
    ok: bool
    seconds: tuple[float, ...]
    start: float | None
    points: FloatArray | None
    model: str = ""
    begun: str = ""
    message: str = ""
    energy: float | None = None
    reused: bool = False
    size: Size | None = None

    @property
    def warm(self) -> float | None:
        """Median warm time (s)."""
        return statistics.median(self.seconds) if self.seconds else None

    @property
    def end(self) -> FloatArray | None:
        """The end of the centreline (3,)."""
        return None if self.points is None else self.points[-1, self.points.shape[1] // 2]


@dataclass(frozen=True)
class Finest:
    """A model's reference as it is kept: its state as a run, its own error and what that was found by; against: the run
    of that, where it has a time of its own."""

    run: Run
    error: float | None
    checked: str
    against: Run | None = None


def run_of(state: State, size: Size, grid: Grid, beside: FloatArray | None) -> Run:
    """A state of this size as a run. Motions that nothing resists are taken out against the surface `beside` (k, m, 3).

    Times: the repeated solves; of a model in a process of its own the one solve, with what the process adds to it.
    """
    spent = state.seconds
    alone = spent.process is not None
    times = spent.repeats or ((spent.first,) if alone and state.ok and math.isfinite(spent.first) else ())
    points = None
    if state.shape is not None and state.status in _EQUILIBRIA:
        points = grid.of(state.shape)
        points = points if beside is None else aligned(points, beside, state.motions)
    return Run(
        solver=size.ladder, label=state.size.words or size.label, unknowns=state.unknowns, status=state.word,
        ok=state.ok, seconds=times, start=spent.process - spent.first if spent.process is not None and times else None,
        points=points, model=state.model, begun=state.start, message=state.message,
        energy=None if state.energy is None else state.energy.total, reused=state.reused,
    )  # fmt: skip


def together(runs: Sequence[Run]) -> Run:
    """Repetitions of one size as one run: points from the first, the median of the starts."""
    starts = [run.start for run in runs if run.start is not None]
    return replace(
        runs[0],
        seconds=tuple(seconds for run in runs for seconds in run.seconds),
        start=statistics.median(starts) if starts else None,
        reused=any(run.reused for run in runs),
    )


def finest(reference: Reference, grid: Grid, beside: FloatArray | None) -> Finest:
    """A reference with its state as a run, named by what it is."""
    state, other = reference.state, reference.against
    run = replace(run_of(state, state.size, grid, beside), label=reference.what)
    against = None if other is None else run_of(other, other.size, grid, beside)
    timed = against is not None and against.warm is not None
    return Finest(run, reference.error, reference.checked, against if timed else None)


def machine() -> dict[str, Any]:
    """What times belong to: processor, cores that this process may use, threads that the libraries may use."""
    made = versions()
    return {name: made[name] for name in ("cpu", "cores", "threads", "system")}


_T = TypeVar("_T")


class CachedRun:
    """Finished runs and references in the folder `root`: found again on the same machine, with the same versions and
    sources, which stand in the `parts` of their key. A process that died is tried again.

    fresh: what is there is thrown away first.
    """

    def __init__(self, root: Path, fresh: bool = False) -> None:
        if fresh:
            shutil.rmtree(root, ignore_errors=True)
        self.root = root
        self._machine = case_key(machine())[:8]

    def run(self, parts: list[Any], make: Callable[[], Run]) -> Run:
        """The run that `parts` determine, from the folder or made now and kept."""
        return self._found(["cost", *parts], make, _save, _load, lambda run: run.status != Status.CRASHED.code)

    def finest(self, parts: list[Any], make: Callable[[], Finest]) -> Finest:
        """The reference that `parts` determine, likewise; one that is no stable state is tried again."""

        def save(place: Path, found: Finest) -> None:
            atomic_write_json(place / "reference.json", {"error": found.error, "checked": found.checked})
            _save(place, found.run)
            if found.against is not None:
                _save(place, found.against, "against")

        def load(place: Path) -> Finest:
            against = _load(place, "against") if (place / "against.json").exists() else None
            return Finest(_load(place), **read_json(place / "reference.json"), against=against)

        return self._found(["cost reference", *parts], make, save, load, lambda found: found.run.ok)

    def _found(
        self,
        parts: list[Any],
        make: Callable[[], _T],
        save: Callable[[Path, _T], None],
        load: Callable[[Path], _T],
        lasting: Callable[[_T], bool],
    ) -> _T:
        store = CaseStore(self.root / "runs")
        key = case_key(*parts, self._machine)
        folder = store.get(key)
        if folder is not None:
            return load(folder)
        found = make()
        if lasting(found):
            store.put(key, lambda place: save(place, found))
        return found


#: What stands in a kept run's JSON: all fields but the surface, and what is known only of a run in its study.
_NAMES = tuple(field.name for field in fields(Run) if field.name not in ("points", "reused", "size"))


def _save(place: Path, run: Run, name: str = "run") -> None:
    atomic_write_json(place / f"{name}.json", {field: getattr(run, field) for field in _NAMES})
    points = {} if run.points is None else {"points": run.points}
    atomic_write_bytes(place / f"{name}.npz", npz_bytes(points))


def _load(place: Path, name: str = "run") -> Run:
    with np.load(place / f"{name}.npz", allow_pickle=False) as stored:
        points = stored.get("points")
    data = read_json(place / f"{name}.json")
    return Run(**{**data, "seconds": tuple(data["seconds"])}, points=points, reused=True)
