"""The shell in a process of its own:  python -m shellref.worker REQUEST.json OUT_DIR

REQUEST.json
    problem           fields of ShellProblem (width, thickness, poisson are needed)
    options           fields of ShellOptions (may be absent)
    states_for_error  [[along, across], ...]: more meshes for the same problem, from which the discretisation error of
                      the first can be judged (may be absent)

OUT_DIR (made when absent; files appear whole, by rename)
    shell.json        ShellResult.to_dict(), and `error_states` when asked for: for each extra mesh its elements,
                      status, file, energy, and the distances |x - x'| to the first state at equal material points:
                      `largest` on a 201 x 9 grid, `centreline`, `end` (units l)
    shell.npz         s_nodes, v_nodes, points, directors (ShellSurface), cell_midpoints, energy_density
    shell_AxB.json, shell_AxB.npz   the extra states

Standard output: one JSON object per line ({"event": "step", "load": 0.3, ...}). Exit codes: 0 computed (the status is
inside, also when not converged), 2 bad request, 3 dolfinx is missing; for 2 and 3 the reason is one line on stderr.
"""

from __future__ import annotations

import dataclasses
import json
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np

from shellref.problem import ShellInputError, ShellOptions, ShellProblem
from shellref.result import ShellResult, ShellStatus
from shellref.surface import ShellSurface

DONE, BAD_REQUEST, MISSING = 0, 2, 3
KEYS = ("problem", "options", "states_for_error")


def read_request(path: Path) -> tuple[ShellProblem, ShellOptions, list[ShellProblem]]:
    """The problem, the options and the problem on the meshes of `states_for_error`; raises ShellInputError."""
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
    meshes = data.get("states_for_error") or []
    if not isinstance(meshes, list):
        raise ShellInputError("states_for_error", meshes, "must be a list of [along, across]")
    extra = [dataclasses.replace(problem, elements=mesh) for mesh in meshes]
    return problem, ShellOptions.from_dict(data.get("options") or {}), extra


def distances(first: ShellSurface, other: ShellSurface) -> dict[str, float]:
    """Distances between two surfaces at equal material points, units l: largest on 201 x 9, centreline, end."""
    s, v = np.linspace(0.0, 1.0, 201), np.linspace(first.v_nodes[0], first.v_nodes[-1], 9)
    gap = np.linalg.norm(first.grid(s, v) - other.grid(s, v), axis=-1)
    return {"largest": float(gap.max()), "centreline": float(gap[:, 4].max()), "end": float(gap[-1, 4])}


def _say(event: dict[str, Any]) -> None:
    print(json.dumps(event), flush=True)


def run(problem: ShellProblem, options: ShellOptions, extra: list[ShellProblem], folder: Path) -> ShellResult:
    """Solve, write the files, print progress."""
    from shellref.solve import solve

    first = solve(problem, options, _say)
    rows = []
    for other in extra:
        result = solve(other, options, _say)
        name = "shell_{}x{}".format(*other.elements)
        result.save(folder, name)
        rows.append(
            {
                "elements": list(other.elements),
                "status": result.status.value,
                "file": f"{name}.npz",
                "energy": result.energy,
                "share": result.share,
                "seconds": result.seconds["total"],
                "distance": distances(first.surface, result.surface),
            }
        )
    first.save(folder, "shell", {"error_states": rows} if extra else None)
    return first


def main(arguments: list[str]) -> int:
    """Entry point; returns the exit code."""
    if len(arguments) != 2:
        print("usage: python -m shellref.worker REQUEST.json OUT_DIR", file=sys.stderr)
        return BAD_REQUEST
    folder = Path(arguments[1])
    try:
        problem, options, extra = read_request(Path(arguments[0]))
        folder.mkdir(parents=True, exist_ok=True)
    except ShellInputError as error:
        print(f"bad request: {error}", file=sys.stderr)
        return BAD_REQUEST
    except OSError as error:
        print(f"bad request: {folder.name} cannot be made: {error.strerror}", file=sys.stderr)
        return BAD_REQUEST
    try:
        from shellref import dolfinx_api
    except ImportError as error:
        print(error, file=sys.stderr)
        return MISSING
    _say({"event": "start", "dolfinx": dolfinx_api.versions()["dolfinx"], "elements": list(problem.elements)})
    result = run(problem, options, extra, folder)
    _say({"event": "written", "status": result.status.value, "ok": result.status is ShellStatus.CONVERGED})
    return DONE


if __name__ == "__main__":
    if "OMP_NUM_THREADS" not in os.environ:  # read by BLAS when it is loaded: start over with it set
        os.environ["OMP_NUM_THREADS"] = "1"
        os.execv(sys.executable, sys.orig_argv)
    sys.exit(main(sys.argv[1:]))
