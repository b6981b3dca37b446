"""Measurements under results/: `python -m tests.validation [--stale | --rules | --remake | --readme] [NAME ...]`.

NAME ... makes these again, all where none is named; `--remake` those that are stale only, cheap ones first (remake.py);
`--stale` lists them with what they will take and makes nothing, `--rules` which modules count for a page and why
(loaded.py); `--readme` renders the pages that take their numbers
from the data (readme.py). `--jobs 2` makes two at once of those that take no times; the others have the machine for
themselves. `--minutes M` begins nothing that would not be done in time, and ends what is not. An interrupted run ends
what it began, says what was done, and goes on where it was when it is called again.
"""

from __future__ import annotations

import argparse
import importlib
import math
import signal
import sys
import time

from compare.store.store import atomic_write_text
from ribbonbench import sources
from tests.validation import loaded, readme, remake, stale
from tests.validation.record import Pages

NAMES = (
    "series",
    "derivatives",
    "coils",
    "tape",
    "minimisers",
    "newton",
    "newton_glued",
    "batches",
    "million",
    "lines",
    "placed",
    "judge",
    "hp",
    "strong_form",
    "shooting",
    "peers",
    "claims",
    "roman_states",
    "special_curves",
    "formulations",
    "start_clamp",
    "forces",
    "seeds",
    "rivals",
    "rivals_again",
    "branches_auto",
    "branches_shell",
    "exact_gravity",
    "moebius",
    "wunderlich_event",
    "moebius_table",
    "moebius_saddle",
    "roman_branches",
    "forceless",
    "twisted_clamps",
    "roman",
    "obstacles",
    "short_coil",
    "moebius_touches",
    "friction",
    "ply",
    "michell",
    "plectoneme",
    "contact_lines",
    "knots",
    "trefoil",
    "ribbon_plectoneme",
    "ribbon_loop",
    "edges",
    "curl_length",
    "rod_ribbon",
    "rod_figures",
    "curve_angle",
    "clamp_layer",
    "clamp_limit",
    "elastica_order",
    "self_contact_planar",
    "layers",
    "joined_strips",
    "daisy",
    "cantilever",
    "shell_mesh",
    "shell_cantilever",
    "shell_bands",
    "shell_bands_mesh",
    "half_turns",
    "rest_shapes",
    "tape_shell",
    "shell_lateral",
    "twisted_tension",
    "green_limit",
    "lateral_torsional",
    "shell_shift",
    "on_edge",
    "shift",
    "shift_branches",
    "shell_curl",
    "shell_corners",
    "models_4_3",
    "models_minima",
    "limits",
    "hit_table",
    "which_model",
    "unseen",
    "unseen_again",
    "sweep",
    "shell_cost",
    "shell_start",
    "shell_thin",
    "shell_walls",
    "shell_contact",
    "loop_shell",
    "shell_roman",
    "shell_table",
    "calculix",
    "shell_beside",
    "shell_adaptive",
    "shell_size",
    "fronts",
    "cost",
    "felt",
    "cost_over_commits",
    "converge",
    "sze",
    "shell_formulation",
    "curl",
    "battery",
    "suite",
    "live",
    "stability_notes",
    "gallery",
    "readme_picture",
)


def absent(module: str) -> str | None:
    """Why a measurement cannot be made here: a package that its module imports, or what its `absent()` says."""
    try:
        found = importlib.import_module(module)
    except ModuleNotFoundError as error:
        top = (error.name or "").partition(".")[0]
        if top in (*sources.PACKAGES, "tests"):
            raise
        return f"no {top}"
    why: str | None = getattr(found, "absent", lambda: None)()
    return why


def one(name: str) -> int:
    """Makes one page again, in this process, and says what changed."""
    pages = Pages()
    module = pages.module(name)
    heard = loaded.Heard()
    with loaded.hearing(heard):
        why = absent(module)
    if why is not None:
        print(f"validation {name}: {stale.MISSING}{why}", flush=True)
        return stale.ABSENT
    print(f"validation {name}: started", flush=True)
    run = importlib.import_module(module).run
    record = pages.measure(name, run, f"python -m tests.validation {name}", heard)
    print(f"validation {name}: {record.seconds:.0f} s, written to results/", flush=True)
    for line in stale.findings(name, record):
        print(f"finding: {line}", flush=True)
    return stale.DONE


def several(names: list[str], every: bool, jobs: int, minutes: float = math.inf) -> int:
    """Makes the pages again, each in a process of its own, and says at the end what was done, also where it is
    interrupted; exit code 1 if one failed, 130 for an interruption."""
    work = remake.Processes(time.monotonic() + 60.0 * minutes)
    outcomes: dict[str, remake.Outcome] = {}
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        remake.remake(names, every, work, jobs=jobs, outcomes=outcomes, left=lambda: work.left)
        code = stale.FAILED if any(outcome.failed for outcome in outcomes.values()) else stale.DONE
    except KeyboardInterrupt:
        code = 130
    finally:
        signal.signal(signal.SIGTERM, before)
        print(stale.summary(Pages(), {name: outcome.done for name, outcome in outcomes.items()}), flush=True)
    return code


#: Pages that hold nothing but numbers of others: made again at once when those change.
FOLLOWS = ("which_model",)


def rendered(failed: int) -> int:
    """Makes again what only says what other pages have (`FOLLOWS`, the gallery's sources, the pages of prose) and says
    what a template asks and nobody measured; then `failed`, else 0."""
    pages = Pages()
    for status in stale.statuses(pages, FOLLOWS):
        if status.stale:
            one(status.name)
    gallery = pages.root / "docs" / "gallery.md"
    headlines = importlib.import_module("tests.validation.workbench.gallery_headlines")
    atomic_write_text(gallery, headlines.written(gallery.read_text(), pages))
    problems = readme.write(pages)
    for line in problems:
        print(f"finding: {line}", flush=True)
    return failed if problems else stale.DONE


def main(arguments: list[str]) -> int:
    """What the module's docstring says. Exit code 1 if a measurement failed, 2 for an unknown name, 3 if the only one
    that is named cannot be made here."""
    parser = argparse.ArgumentParser(prog="python -m tests.validation", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME")
    group = parser.add_mutually_exclusive_group()
    for option in ("stale", "rules", "remake", "readme"):
        group.add_argument(f"--{option}", action="store_true")
    parser.add_argument("--jobs", type=int, choices=(1, 2), default=1)
    parser.add_argument("--minutes", type=float, default=math.inf)
    requested = parser.parse_args(arguments)
    unknown = [name for name in requested.names if name not in NAMES]
    if unknown:
        print(f"unknown: {', '.join(unknown)}; choose from {', '.join(NAMES)}", file=sys.stderr)
        return 2
    names = requested.names or list(NAMES)
    if requested.readme:
        return rendered(stale.FAILED)
    if requested.stale:
        print(stale.listing(sorted(stale.statuses(Pages(), names), key=remake.expected), remake.expected))
        return stale.DONE
    if requested.rules:
        print(stale.rules(Pages(), names))
        return stale.DONE
    alone = len(names) == 1 and not requested.remake
    code = one(names[0]) if alone else several(names, not requested.remake, requested.jobs, requested.minutes)
    return rendered(code if alone else stale.FAILED) or code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
