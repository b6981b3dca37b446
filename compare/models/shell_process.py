"""The shell in a process of its own (design rule 2); finished cases are found again, unfinished ones go on."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from compare.models.shell_build import DEFAULT_ELEMENTS, shell_elements, shell_options, shell_problem
from compare.store.provenance import software
from compare.store.store import CaseStore, Unfinished, case_key, read_json
from ribbonbench import system
from ribbonbench.errors import BadInput, Missing
from ribbonbench.start import THREADS
from shellref.shell.options import ShellOptions
from shellref.shell.problem import ShellProblem
from shellref.shell.result import LoadStep
from shellref.shell.surface import ShellSurface

__all__ = [
    "DEFAULT_ELEMENTS", "LoadStep", "Report", "ShellCase", "run_shell", "shell_elements", "shell_options",
    "shell_problem",
]  # fmt: skip

Progress = Callable[[str], None]

#: The module that solves a shell, in a process of its own: what a kept case depends on begins there.
WORKER = "shellref.worker"
#: Digits of a start that count in a case's key: a start only selects a branch.
START_DIGITS = 6
_BAD_REQUEST = 2
_MISSING = 3


@dataclass(frozen=True)
class Report:
    """What the worker answers (`shellref.shell.result.ShellResult` without what lies on the surface), read from
    shell.json; end, middle: position and frame of the centreline there. Units as there."""

    problem: ShellProblem
    options: ShellOptions
    elements: tuple[int, int]
    load_factor: float
    path_factor: float
    negative_eigenvalues: int | None
    residual: Mapping[str, float]
    factorisations: int
    steps: tuple[LoadStep, ...]
    energy: Mapping[str, float]
    share: Mapping[str, float]
    seconds: Mapping[str, float]
    memory_mb: float
    discretisation: Mapping[str, Any] | None
    end: Mapping[str, Any]
    middle: Mapping[str, Any]
    provenance: Mapping[str, Any]

    @classmethod
    def of(cls, data: Mapping[str, Any]) -> Report:
        """The report in the content of shell.json. KeyError: it lacks a field."""
        found = {field.name: data[field.name] for field in fields(cls)}
        along, across = found["elements"]
        typed = {
            "problem": ShellProblem.from_dict(found["problem"]),
            "options": ShellOptions.from_dict(found["options"]),
            "elements": (int(along), int(across)),
            "steps": tuple(LoadStep(**step) for step in found["steps"]),
        }
        return cls(**{**found, **typed})

    @property
    def width_to_thickness(self) -> float:
        """w/h: 50 and not 50.00000000000001."""
        return float(f"{self.problem.width / self.problem.thickness:.12g}")


@dataclass(frozen=True)
class ShellCase:
    """A shell run: the worker's report `data` (shell.json) and where its files are.

    reused: found among the finished cases. A worker that died has status "crashed" and no surface.
    """

    data: dict[str, Any]
    folder: Path | None
    reused: bool

    @cached_property
    def report(self) -> Report:
        """`data`, typed. KeyError: the worker died without a report."""
        return Report.of(self.data)

    @property
    def status(self) -> str:
        """The shell's word (shellref.shell.result.ShellStatus), or "crashed"."""
        return str(self.data["status"])

    @property
    def ok(self) -> bool:
        """Converged at the full load and not known to be unstable."""
        return self.status == "converged" and self.data.get("stable") is not False

    @property
    def start(self) -> str | None:
        """How the solve began (shellref.path.begin.Begun.how)."""
        return self.data.get("start")

    @property
    def seconds(self) -> float:
        """Wall time of the solve alone (s): no import, no compilation of forms."""
        spent = self.data.get("seconds", {})
        if "total" not in spent:
            return float("nan")
        return float(spent["total"] - spent.get("import", 0.0) - spent.get("compile", 0.0))

    @cached_property
    def surface(self) -> ShellSurface:
        """The deformed surface."""
        if self.folder is None:
            raise FileNotFoundError(f"this shell case has no surface: {self.data['message']}")
        return ShellSurface.load(self.folder / "shell.npz")

    def density(self) -> tuple[np.ndarray, np.ndarray]:
        """Midpoints (cells, 2) in (S, v), and bending, membrane and shear energy per area (cells, 3), D / l^2."""
        return self._density

    @cached_property
    def _density(self) -> tuple[np.ndarray, np.ndarray]:
        if self.folder is None:
            raise FileNotFoundError(f"this shell case has no surface: {self.data['message']}")
        with np.load(self.folder / "shell.npz", allow_pickle=False) as stored:
            return stored["cell_midpoints"], stored["energy_density"]


def shell_key(problem: ShellProblem, options: ShellOptions, start: ShellSurface | None = None) -> str:
    """The key of a case: problem, options, software, the worker's sources, and the start to `START_DIGITS` digits."""
    made_by = software(WORKER)
    parts: list[Any] = ["shell", problem.to_dict(), options.to_dict(), made_by]
    if start is not None:
        digest = hashlib.sha256()
        for field in (start.s_nodes, start.v_nodes, start.points, start.directors):
            digest.update(np.ascontiguousarray(np.round(field, START_DIGITS) + 0.0).tobytes())
        parts.append(digest.hexdigest())
    return case_key(*parts)


def stored_case(store: CaseStore, key: str, progress: Progress | None = None) -> ShellCase | None:
    """The finished case of this key, or None; `progress` is told of a damaged one."""
    found = store.get(key, progress)
    if found is not None:
        with contextlib.suppress(OSError, ValueError):
            return ShellCase(read_json(found / "shell.json"), found, True)
    return None


def run_shell(
    problem: ShellProblem,
    store: CaseStore,
    options: ShellOptions | None = None,
    progress: Progress | None = None,
    start: ShellSurface | None = None,
) -> ShellCase:
    """The finished case of this problem, from the store or from a new worker process.

    start: a surface near the state at the full load, from which the worker settles. A case that an interrupted run left
    unfinished goes on from its checkpoint; one that another process works on is waited for. Raises `BadInput` or
    `Missing` when the worker refuses; anything else it meets is a status.
    """
    options = options or ShellOptions()
    key = shell_key(problem, options, start)
    found = stored_case(store, key, progress)
    if found is not None:
        return found
    waiting = None if progress is None else (lambda: progress("another run works on this case: waiting for it"))
    try:
        with store.unfinished(key, waiting) as unfinished:
            found = stored_case(store, key)  # finished by the run that was waited for
            if found is not None:
                return found

            def write(folder: Path) -> None:
                reason = _work(problem, options, start, folder, unfinished, progress)
                if reason is not None:
                    raise _Crashed(reason)

            folder = store.put(key, write)
    except _Crashed as crash:
        return ShellCase({"status": "crashed", "stable": None, "message": str(crash), "seconds": {}}, None, False)
    return ShellCase(read_json(folder / "shell.json"), folder, False)


class _Crashed(Exception):
    """The worker died without a report; nothing is stored."""


def _work(
    problem: ShellProblem,
    options: ShellOptions,
    start: ShellSurface | None,
    folder: Path,
    unfinished: Unfinished,
    progress: Progress | None,
) -> str | None:
    """Runs the worker into `folder`; None when it reported, otherwise why it did not, in one line.

    The worker inherits the lock of the unfinished case: should this process be killed, nobody else works on the case
    until the worker, which is ended with it, has let go; what is said to it lies beside the checkpoints, and is removed
    with them.
    """
    scratch = Path(tempfile.mkdtemp(prefix="request-", dir=unfinished.folder))
    try:
        data = {"problem": problem.to_dict(), "options": options.to_dict(), "folder": str(unfinished.folder.resolve())}
        if start is not None:
            start.save(scratch / "start.npz")
            data["start"] = "start.npz"
        request = scratch / "request.json"
        request.write_text(json.dumps(data))
        environment = {THREADS[0]: "1", **os.environ}
        root = str(Path(__file__).resolve().parents[2])
        environment["PYTHONPATH"] = os.pathsep.join(p for p in (root, os.environ.get("PYTHONPATH", "")) if p)
        with (scratch / "stderr").open("w+") as errors:
            process = subprocess.Popen(
                [
                    sys.executable,
                    "-P",
                    "-m",
                    "ribbonbench.start",
                    str(os.getpid()),
                    WORKER,
                    str(request),
                    str(folder),
                ],
                stdout=subprocess.PIPE,
                stderr=errors,
                stdin=subprocess.DEVNULL,
                text=True,
                env=environment,
                start_new_session=True,
                pass_fds=(unfinished.lock,),
            )
            try:
                assert process.stdout is not None
                for line in process.stdout:
                    _tell(line, progress)
                code = process.wait()
            except BaseException:
                system.end_tree(process)
                process.wait()
                raise
            errors.seek(0)
            last = [text.strip() for text in errors.read().splitlines() if text.strip()][-1:]
        words = last[0] if last else "no message"
        if code == _BAD_REQUEST:
            raise BadInput("shell", None, words)
        if code == _MISSING:
            raise Missing.of(words)
        if code != 0 or not (folder / "shell.json").exists():
            return f"the shell's process ended with code {code}: {words}"
        return None
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def event_text(event: dict[str, Any]) -> str | None:
    """A progress event of the shell in words; None: nothing to say."""
    kind = event.get("event")
    if kind == "step":
        word = "" if event.get("accepted", True) else ", cut back"
        how = "" if event.get("method", "load") == "load" else f" ({event['method']})"
        load = float(event.get("load", 0))
        return f"{event.get('stage', 'load')}{how} {load:.0%}, {event.get('iterations')} it{word}"
    if kind == "coarse":
        return f"path on {' x '.join(map(str, event['elements']))}"
    if kind in ("thicker", "thinner"):
        return f"settles at w/h = {event['width_to_thickness']:g}"
    if kind == "mesh":
        return f"mesh {' x '.join(map(str, event['elements']))}: error {event['estimate']:.1e}"
    return str(kind) if kind else None


def _tell(line: str, progress: Progress | None) -> None:
    """Passes a progress line of the worker on as text."""
    if progress is None:
        return
    try:
        event = json.loads(line)
    except ValueError:
        return
    text = event_text(event)
    if text is not None:
        progress(text)
