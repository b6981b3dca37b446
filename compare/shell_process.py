"""The shell in a process of its own (design rule 2), with finished cases kept and found again."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from compare.errors import BadInput, Missing
from compare.provenance import software, source_digest
from compare.scene import Scene
from compare.store import CaseStore, case_key, read_json
from shellref.problem import ShellInputError, ShellOptions, ShellProblem
from shellref.surface import ShellSurface

Progress = Callable[[str], None]

#: Elements along and across when the scene does not say, and how they are graded (first element at the clamp,
#: elements at the long edges, over even ones). The thesis has an even grid of 100 x 4 (4.3); docs/shell.md shows what
#: grading buys.
DEFAULT_ELEMENTS = (100, 8)
GRADING = (0.2, 0.1)
_BAD_REQUEST = 2
_MISSING = 3


@dataclass(frozen=True)
class ShellCase:
    """A shell run: the worker's report `data` (shell.json) and where its files are.

    reused: found among the finished cases. A worker that died has status "crashed" and no surface.
    """

    data: dict[str, Any]
    folder: Path | None
    reused: bool

    @property
    def status(self) -> str:
        """The worker's word: "converged", "not_converged", "unstable", "invalid", or "crashed"."""
        return str(self.data["status"])

    @property
    def ok(self) -> bool:
        """Converged at the full load and not known to be unstable."""
        return self.status == "converged" and self.data.get("stable") is not False

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


def shell_problem(scene: Scene, width_to_thickness: float, elements: tuple[int, int]) -> ShellProblem:
    """The scene as a shell of this w/h, D and Gamma kept (lengths in l)."""
    weight = scene.up is not None and scene.gamma > 0
    try:
        return ShellProblem(
            width=scene.width,
            thickness=scene.width / width_to_thickness,
            poisson=scene.strip.poisson,
            natural_curvature=scene.curvature,
            gamma=scene.gamma if weight else 0.0,
            up=tuple(float(c) for c in scene.up) if weight else None,  # type: ignore[arg-type, union-attr]
            clamp_position=tuple(float(c) for c in scene.position),  # type: ignore[arg-type]
            clamp_frame=tuple(tuple(float(c) for c in row) for row in scene.frame),  # type: ignore[arg-type]
            clamp=scene.shell.clamp,
            elements=elements,
            grading=GRADING,
        )
    except ShellInputError as error:
        raise BadInput(f"shell.{error.key}", error.value, "cannot be used", error.remedy) from None


def shell_elements(scene: Scene) -> tuple[int, int]:
    """Elements (along, across) of the scene's shell runs."""
    return scene.shell.elements or DEFAULT_ELEMENTS


def run_shell(
    problem: ShellProblem, store: CaseStore, options: ShellOptions | None = None, progress: Progress | None = None
) -> ShellCase:
    """The finished case of this problem, from the store or from a new worker process.

    Raises `BadInput` or `Missing` when the worker refuses; anything else it meets is a status.
    """
    options = options or ShellOptions()
    made_by = {**software(), "source": source_digest("shellref")}
    key = case_key("shell", problem.to_dict(), options.to_dict(), made_by)
    found = store.get(key)
    if found is not None:
        with contextlib.suppress(OSError, ValueError):
            return ShellCase(read_json(found / "shell.json"), found, True)

    def write(folder: Path) -> None:
        reason = _work(problem, options, folder, progress)
        if reason is not None:
            raise _Crashed(reason)

    try:
        folder = store.put(key, write)
    except _Crashed as crash:
        return ShellCase({"status": "crashed", "stable": None, "message": str(crash), "seconds": {}}, None, False)
    return ShellCase(read_json(folder / "shell.json"), folder, False)


class _Crashed(Exception):
    """The worker died without a report; nothing is stored."""


def _work(problem: ShellProblem, options: ShellOptions, folder: Path, progress: Progress | None) -> str | None:
    """Runs the worker into `folder`; None when it reported, otherwise why it did not, in one line."""
    scratch = Path(tempfile.mkdtemp(prefix="ribbonbench-shell-"))
    try:
        request = scratch / "request.json"
        request.write_text(json.dumps({"problem": problem.to_dict(), "options": options.to_dict()}))
        environment = {**os.environ, "OMP_NUM_THREADS": os.environ.get("OMP_NUM_THREADS", "1")}
        root = str(Path(__file__).resolve().parent.parent)
        environment["PYTHONPATH"] = os.pathsep.join(p for p in (root, os.environ.get("PYTHONPATH", "")) if p)
        with (scratch / "stderr").open("w+") as errors:
            process = subprocess.Popen(
                [sys.executable, "-m", "shellref.worker", str(request), str(folder)],
                stdout=subprocess.PIPE,
                stderr=errors,
                stdin=subprocess.DEVNULL,
                text=True,
                env=environment,
                start_new_session=True,
            )
            try:
                assert process.stdout is not None
                for line in process.stdout:
                    _tell(line, progress)
                code = process.wait()
            except BaseException:
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(process.pid, signal.SIGKILL)
                process.wait()
                raise
            errors.seek(0)
            last = [text.strip() for text in errors.read().splitlines() if text.strip()][-1:]
        words = last[0] if last else "no message"
        if code == _BAD_REQUEST:
            raise BadInput("shell", None, words)
        if code == _MISSING:
            raise Missing(words, "")
        if code != 0 or not (folder / "shell.json").exists():
            return f"the shell's process ended with code {code}: {words}"
        return None
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def _tell(line: str, progress: Progress | None) -> None:
    """Passes a progress line of the worker on as text."""
    if progress is None:
        return
    try:
        event = json.loads(line)
    except ValueError:
        return
    if event.get("event") == "step":
        word = "" if event.get("accepted", True) else ", cut back"
        progress(f"{event.get('stage', 'load')} {float(event.get('load', 0)):.0%}, {event.get('iterations')} it{word}")
    elif event.get("event"):
        progress(str(event["event"]))
