"""One solve in a process of its own: python -m compare.studies.cost_start < REQUEST, for the time of a first call.

REQUEST is JSON: `scene` (TOML), `solver` ("ribbon", "elastica"), `elements`, `formulation`, `degree`. Nothing is
written; the exit code is 0 when the solve came back. Who starts it takes the time, from the start of the process on.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any


def main(request: dict[str, Any]) -> int:
    """Solves once."""
    from compare.scene.scene import loads

    scene = loads(request["scene"])
    if request["solver"] == "elastica":
        from compare.studies.cost_runs import elastica_problem
        from shellref.elastica.solve import solve as solve_elastica

        solve_elastica(elastica_problem(scene), request["elements"], request["degree"], estimate_error=False)
        return 0
    from compare.models.ribbon_build import ribbon_arguments
    from ribbon import solve

    keys = {"model.elements": request["elements"], "model.formulation": request["formulation"]}
    solve(**ribbon_arguments(scene.replace(keys)))
    return 0


def seconds_of_first(request: dict[str, Any], cache: Path | None = None) -> float | None:
    """Wall time (s) of one solve in a new process; None when it failed. cache: folder for compiled code (empty: compile
    everything); by default the user's."""
    environment = dict(os.environ)
    root = str(Path(__file__).resolve().parents[2])
    environment["PYTHONPATH"] = os.pathsep.join(p for p in (root, os.environ.get("PYTHONPATH", "")) if p)
    if cache is not None:
        environment.pop("NUMBA_CACHE_DIR", None)
        environment["RIBBONBENCH_CACHE"] = str(cache)
    clock = time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-m", "compare.studies.cost_start"],
        input=json.dumps(request), text=True, capture_output=True, env=environment, check=False,
    )  # fmt: skip
    spent = time.perf_counter() - clock
    return spent if done.returncode == 0 else None


if __name__ == "__main__":
    sys.exit(main(json.load(sys.stdin)))
