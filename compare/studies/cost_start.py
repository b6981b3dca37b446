"""One solve in a process of its own: python -m compare.studies.cost_start < REQUEST, for the time of a first call.

REQUEST is JSON: `scene` (TOML), `model` (its name), `size` (ladder, values, degree: `compare.models.base.Size`). The
model solves once; nothing is written; the exit code is 0 when the solve came back. Who starts it takes the time, from
the start of the process on.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from compare.models.base import Size
    from compare.scene.scene import Scene


def request(scene: Scene, model: str, size: Size) -> dict[str, Any]:
    """What the process reads."""
    return {
        "scene": scene.to_toml(),
        "model": model,
        "size": {"ladder": size.ladder, "values": size.values, "degree": size.degree},
    }


def main(asked: dict[str, Any]) -> int:
    """Solves once."""
    from compare.models import registry
    from compare.models.base import Options, Size
    from compare.scene.scene import loads

    size = asked["size"]
    registry.model(asked["model"]).solve(
        loads(asked["scene"]), Size(size["ladder"], tuple(size["values"]), size["degree"]), options=Options()
    )
    return 0


def seconds_of_first(asked: dict[str, Any], cache: Path | None = None) -> float | None:
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
        input=json.dumps(asked), text=True, capture_output=True, env=environment, check=False,
    )  # fmt: skip
    spent = time.perf_counter() - clock
    return spent if done.returncode == 0 else None


if __name__ == "__main__":
    sys.exit(main(json.load(sys.stdin)))
