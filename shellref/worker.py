"""The shell in a process of its own:  python -m shellref.worker REQUEST.json OUT_DIR

REQUEST.json
    problem           fields of ShellProblem (width, thickness, poisson are needed)
    options           fields of ShellOptions (may be absent)
    start             .npz of a ShellSurface of the same strip, on any mesh, near the state at the full load: the solve
                      settles there, and walks the path only when it cannot, or when the option `begin` refuses that
                      (shellref.path.begin; may be absent). Its path is relative to the request
    folder            where checkpoints of the path are kept; the same request with the same folder goes on where a
                      killed worker stopped (may be absent). Relative to the request

OUT_DIR (made when absent; files appear whole, by rename)
    shell.json        ShellResult.to_dict(), `start` and `begun` (`how` and `notes` of shellref.path.begin.Begun)
    shell.npz         s_nodes, v_nodes, points, directors (ShellSurface), cell_midpoints, energy_density

Standard output: one JSON object per line ({"event": "step", "load": 0.3, ...}). Exit codes: 0 computed (the status is
inside, also when not converged), 2 bad request, 3 dolfinx is missing; for 2 and 3 the reason is one line on stderr.
"""

from __future__ import annotations

import json
import os
import sys
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from shellref.inputs import ShellInputError
from shellref.path.begin import begun
from shellref.shell.options import ShellOptions
from shellref.shell.problem import ShellProblem
from shellref.shell.result import ShellResult, ShellStatus
from shellref.shell.surface import ShellSurface

DONE, BAD_REQUEST, MISSING = 0, 2, 3
KEYS = ("problem", "options", "start", "folder")


@dataclass(frozen=True)
class Request:
    """What is asked of the worker; start: near the state at the full load; folder: for checkpoints."""

    problem: ShellProblem
    options: ShellOptions
    start: ShellSurface | None = None
    folder: Path | None = None


def read_request(path: Path) -> Request:
    """The request of a file; raises ShellInputError."""
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ShellInputError("request", path.name, f"cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise ShellInputError("request", path.name, f"is not JSON: {error}") from error
    if not isinstance(data, dict) or "problem" not in data:
        raise ShellInputError("request", path.name, "must be an object with the key `problem`")
    for key in data:
        if key not in KEYS:
            raise ShellInputError(key, data[key], f"unknown key; known: {', '.join(KEYS)}")
    problem = ShellProblem.from_dict(data["problem"])
    for key in ("start", "folder"):
        if data.get(key) is not None and not isinstance(data[key], str):
            raise ShellInputError(key, data[key], "must be a path")
    start, folder = data.get("start"), data.get("folder")
    return Request(
        problem=problem,
        options=ShellOptions.from_dict(data.get("options") or {}),
        start=None if start is None else read_start(path.parent / start, problem),
        folder=None if folder is None else path.parent / folder,
    )


def read_start(path: Path, problem: ShellProblem) -> ShellSurface:
    """The surface to start from; raises ShellInputError when it is none, or one of another strip."""
    try:
        surface = ShellSurface.load(path)
    except OSError as error:
        raise ShellInputError("start", path.name, f"cannot be read: {error.strerror or error}") from error
    except (ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise ShellInputError("start", path.name, "is no .npz of s_nodes, v_nodes, points and directors") from error
    half = 0.5 * problem.width
    ends = (surface.s_nodes[0], surface.s_nodes[-1], surface.v_nodes[0], surface.v_nodes[-1])
    if not np.allclose(ends, (0.0, 1.0, -half, half), rtol=0.0, atol=1e-9):
        raise ShellInputError(
            "start", path.name, f"is not the surface of a strip of length 1 and width {problem.width:g}"
        )
    if not (np.all(np.isfinite(surface.points)) and np.all(np.isfinite(surface.directors))):
        raise ShellInputError("start", path.name, "has values that are not finite")
    return surface


def _say(event: dict[str, Any]) -> None:
    print(json.dumps(event), flush=True)


def run(request: Request, folder: Path) -> ShellResult:
    """Solve, write the files, print progress."""
    keep = None if request.folder is None else request.folder / "path"
    found = begun(request.problem, request.options, _say, request.start, keep)
    found.result.save(folder, "shell", {"start": found.how, "begun": found.notes})
    return found.result


def main(arguments: list[str]) -> int:
    """Entry point; returns the exit code."""
    if len(arguments) != 2:
        print("usage: python -m shellref.worker REQUEST.json OUT_DIR", file=sys.stderr)
        return BAD_REQUEST
    folder = Path(arguments[1])
    try:
        request = read_request(Path(arguments[0]))
        folder.mkdir(parents=True, exist_ok=True)
    except ShellInputError as error:
        print(f"bad request: {error}", file=sys.stderr)
        return BAD_REQUEST
    except OSError as error:
        print(f"bad request: {folder.name} cannot be made: {error.strerror}", file=sys.stderr)
        return BAD_REQUEST
    try:
        from shellref.fenics import dolfinx_api
    except ImportError as error:
        print(error, file=sys.stderr)
        return MISSING
    _say({"event": "start", "dolfinx": dolfinx_api.versions()["dolfinx"], "elements": list(request.problem.elements)})
    try:
        result = run(request, folder)
    except ShellInputError as error:
        print(f"bad request: {error}", file=sys.stderr)
        return BAD_REQUEST
    _say({"event": "written", "status": result.status.value, "ok": result.status is ShellStatus.CONVERGED})
    return DONE


if __name__ == "__main__":
    if "OMP_NUM_THREADS" not in os.environ:  # read by BLAS when it is loaded: start over with it set
        os.environ["OMP_NUM_THREADS"] = "1"
        os.execv(sys.executable, sys.orig_argv)
    sys.exit(main(sys.argv[1:]))
