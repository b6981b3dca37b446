"""`python -m tests.validation [NAME ...]`: remakes the measurements named, or all, under results/."""

from __future__ import annotations

import importlib
import sys
import time
from pathlib import Path

NAMES = (
    "series",
    "derivatives",
    "coils",
    "tape",
    "minimisers",
    "newton",
    "newton_glued",
    "batches",
    "placed",
    "judge",
    "hp",
    "strong_form",
    "shooting",
    "peers",
    "claims",
    "formulations",
    "start_clamp",
    "forces",
    "seeds",
    "exact_gravity",
    "moebius",
    "wunderlich_event",
    "moebius_table",
    "roman",
    "curl_length",
    "rod_ribbon",
    "rod_figures",
    "curve_angle",
    "clamp_layer",
    "clamp_limit",
    "elastica_order",
    "daisy",
    "cantilever",
    "shell_mesh",
    "shell_cantilever",
    "tape_shell",
    "shell_lateral",
    "twisted_tension",
    "lateral_torsional",
    "shell_shift",
    "on_edge",
    "shift",
    "shell_curl",
    "shell_corners",
    "models_4_3",
    "models_minima",
    "limits",
    "hit_table",
    "unseen",
    "sweep",
    "shell_cost",
    "shell_start",
    "shell_adaptive",
    "shell_size",
    "cost",
    "cost_over_commits",
    "converge",
    "sze",
    "shell_formulation",
    "curl",
    "battery",
    "stability_notes",
    "gallery",
    "readme_picture",
)


def _module(name: str) -> str:
    """The dotted name of a measurement's module: it stands in one of the rooms beside this file."""
    (path,) = Path(__file__).parent.glob(f"*/{name}.py")
    return f"tests.validation.{path.parent.name}.{name}"


def main(arguments: list[str]) -> int:
    """Runs the measurements named; exit code 2 for an unknown name."""
    names = arguments or list(NAMES)
    unknown = [name for name in names if name not in NAMES]
    if unknown:
        print(f"unknown: {', '.join(unknown)}; choose from {', '.join(NAMES)}", file=sys.stderr)
        return 2
    out = Path(__file__).resolve().parents[2] / "results"
    for name in names:
        began = time.perf_counter()
        print(f"validation {name}: started", flush=True)
        importlib.import_module(_module(name)).run(out)
        print(f"validation {name}: {time.perf_counter() - began:.0f} s, written to results/", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
