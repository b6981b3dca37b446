"""What a walk leaves on disk while it goes on: every step as a line, and a checkpoint from which it can be resumed.

FOLDER/steps.jsonl: one JSON object per attempt (LoadStep). FOLDER/checkpoint.npz: the last good point and the one
before it on the grid, their rates, the place in the path, a digest of problem, options and sources; written whole, by
rename.
"""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import json
import os
import time
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from shellref.path.arc import Point
from shellref.path.newton import stress_rate
from shellref.path.walk import Walk
from shellref.shell import archive
from shellref.shell.body import Stage
from shellref.shell.naghdi import NaghdiModel
from shellref.shell.result import LoadStep

#: What says where a walk is, beside its points and its log; one that has ended is not resumed.
_PLACE = tuple(
    field.name
    for field in dataclasses.fields(Walk)
    if field.name not in ("point", "older", "steps", "status", "message")
)
EVERY = 1.0  # seconds between checkpoints: a large state is not written more often than it pays


def digest(*parts: dict[str, Any]) -> str:
    """A digest of what defines a walk: problem, options, and the sources that walk."""
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()


def _line(step: LoadStep) -> str:
    return json.dumps(step.to_dict(), allow_nan=False) + "\n"


class FolderJournal:
    """Keeps a walk in a folder (made when absent); only the first process writes."""

    def __init__(self, folder: str | os.PathLike[str], key: str, model: NaghdiModel, stages: tuple[Stage, ...]):
        self.folder, self.key, self.model, self.stages = Path(folder), key, model, stages
        self.first = model.comm.rank == 0
        self._last = -np.inf
        if self.first:
            self.folder.mkdir(parents=True, exist_ok=True)

    @property
    def checkpoint(self) -> Path:
        """The checkpoint's file."""
        return self.folder / "checkpoint.npz"

    def step(self, step: LoadStep) -> None:
        """Append one attempt."""
        if self.first:
            with (self.folder / "steps.jsonl").open("a", encoding="utf-8") as stream:
                stream.write(_line(step))

    def point(self, walk: Walk, now: bool = False) -> None:
        """Keep the walk's point, unless one was kept within the last second (and not `now`)."""
        due = self.model.comm.bcast(now or time.monotonic() - self._last >= EVERY, root=0)
        if not due:
            return
        older = walk.point if walk.older is None else walk.older
        points = (walk.point, older)
        rates = [np.zeros_like(point.state) if point.rate is None else point.rate[0] for point in points]
        fields = np.stack([self.model.on_grid(field) for field in (*(point.state for point in points), *rates)])
        meta = {
            "key": self.key,
            "loads": [walk.point.load, older.load],
            "negative": [walk.point.negative, older.negative],
            "has_older": walk.older is not None,
            "has_rate": [point.rate is not None for point in points],
            "steps": len(walk.steps),
            "walk": {name: getattr(walk, name) for name in _PLACE},
        }
        if self.first:
            archive.write(self.checkpoint, archive.npz(fields=fields, meta=np.array(json.dumps(meta))))
        self._last = time.monotonic()

    def resume(self) -> Walk | None:
        """The walk of the checkpoint, with its log; None when there is none of this problem."""
        data: dict[str, Any] | None = None
        if self.first:
            data = self._read()
        data = self.model.comm.bcast(data, root=0)
        if data is None:
            return None
        meta, points = data["meta"], []
        known = zip(
            data["fields"][:2], data["fields"][2:], meta["loads"], meta["negative"], meta["has_rate"], strict=True
        )
        for field, sway, load, negative, has_rate in known:
            state, rate = self.model.from_grid(field), None
            if self.stages:
                stage = self.stages[min(meta["walk"]["stage"], len(self.stages) - 1)]
                self.model.set_control(stage.at(load))
                if has_rate:
                    rate = (
                        self.model.from_grid(sway),
                        stress_rate(self.model, state, self.model.from_grid(sway), stage, load),
                    )
            points.append(Point(load, state, self.model.stress(state), negative, rate))
        return Walk(points[0], points[1] if meta["has_older"] else None, steps=data["steps"], **meta["walk"])

    def _read(self) -> dict[str, Any] | None:
        """What is on disk; a checkpoint of another problem, or one that is torn, is passed over."""
        try:
            with np.load(self.checkpoint, allow_pickle=False) as stored:
                meta, fields = json.loads(str(stored["meta"])), stored["fields"]
        except (OSError, EOFError, ValueError, KeyError, zipfile.BadZipFile):
            meta, fields = {}, None
        known = meta.get("key") == self.key
        steps = self._log(meta["steps"]) if known else []
        lines = "".join(_line(step) for step in steps)
        archive.write(self.folder / "steps.jsonl", lines.encode())  # goes on from the checkpoint, or begins anew
        return {"meta": meta, "fields": fields, "steps": steps} if known else None

    def _log(self, count: int) -> list[LoadStep]:
        """The first `count` attempts of the log; lines that cannot be read are left out."""
        try:
            lines = (self.folder / "steps.jsonl").read_text(encoding="utf-8", errors="replace").splitlines()[:count]
        except OSError:
            return []
        steps = []
        for line in lines:
            with contextlib.suppress(ValueError, TypeError, KeyError):
                data = json.loads(line)
                data["correction"] = np.inf if data["correction"] is None else data["correction"]
                steps.append(LoadStep(**data))
        return steps

    def finish(self) -> None:
        """The walk is at its end: nothing to resume."""
        if self.first:
            self.checkpoint.unlink(missing_ok=True)
