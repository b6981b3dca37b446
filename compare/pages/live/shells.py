"""A shell beside the strip in the hand, solved in the background by a process of its own: `ribbonbench compare`."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from compare.page.page import SHELL
from compare.pages.export.source import read_source
from compare.pages.live.drawn import FloatArray
from compare.pages.report.surfaces import thinned
from compare.scene.scene import Scene
from compare.store.store import atomic_write_text, read_json
from ribbonbench import system
from ribbonbench.errors import BadInput

#: w/h of a shell of a scene that gives no thickness; points of its surface that are drawn.
RATIO, POINTS = 100.0, 2400
#: Letters of what the process said last that are told.
_SAID = 200


@dataclass(frozen=True)
class Shell:
    """A shell that was solved: what is said of it, its grade, its surface (k, m, 3) in l (None: it has none)."""

    text: str
    grade: str
    ratio: float
    points: FloatArray | None


def with_shell(scene: Scene) -> tuple[Scene, float]:
    """The scene with one shell, the thinnest that it asks for, or of w/h = RATIO; and its w/h."""
    if scene.shell.width_to_thickness:
        ratio = max(scene.shell.width_to_thickness)
    elif scene.strip.thickness is not None:
        return scene, scene.strip.width / scene.strip.thickness
    else:
        ratio = RATIO
    return scene.replace({"shell.width_to_thickness": [ratio]}), ratio


class ShellRun:
    """A comparison that runs. `scene`: one whose solve comes to the state in the hand."""

    def __init__(self, scene: Scene, folder: Path) -> None:
        from compare.models.scope import require_shell

        found, self.ratio = with_shell(scene)
        require_shell(found)
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        path = atomic_write_text(folder / "scene.toml", found.to_toml())
        command = [
            sys.executable, "-m", "ribbonbench.start", str(os.getpid()), "ribbonbench", "compare", str(path.resolve()),
            "--out", str((folder / "compare").resolve()),
        ]  # fmt: skip
        self._said = (folder / "said").open("wb")
        with system.shielded():
            self._process = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=self._said, stderr=self._said, start_new_session=True
            )

    @property
    def running(self) -> bool:
        """Whether it has not ended yet."""
        return self._process.poll() is None

    @property
    def said(self) -> str:
        """The last line that it has said."""
        text = (self.folder / "said").read_text(encoding="utf-8", errors="replace")
        lines = [line.strip() for line in text.splitlines() if line.strip()]
        return lines[-1][:_SAID] if lines else ""

    def shell(self) -> Shell:
        """What it found; `BadInput` with its last words where it found nothing."""
        try:
            result: Any = read_json(self.folder / "compare" / "result.json")
            answer = result["answer"]
            text, grade = f"{answer['text']}: {answer['grade']}", str(answer["grade"])
        except (OSError, ValueError, KeyError, TypeError):
            problem = f"was not solved: {self.said or 'it said nothing'}"
            raise BadInput("the shell", None, problem.removeprefix("ribbonbench: ")) from None
        points = None
        with contextlib.suppress(BadInput, StopIteration):
            surface = next(one for one in read_source(self.folder / "compare").surfaces if one.kind == SHELL)
            sheet = thinned(surface.sheet, POINTS)
            if sheet.shape is not None:
                points = sheet.points.reshape(*sheet.shape, 3)
        return Shell(text, grade, self.ratio, points)

    def end(self) -> None:
        """Ends it, at once."""
        if self.running:
            system.end_tree(self._process)
        self._process.wait()
        self._said.close()
