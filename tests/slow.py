"""Tests that `make test` leaves to `make validate` because they take long:  python -m tests.slow [JUNIT]

Which they are is measured, not chosen: tests/slow.json holds the tests of a run of the whole suite that took more than
`MOST` seconds, and how long. This command writes it from the run's junit file (out/test/junit.xml), together with those
of the present list that this run left out. They carry the marker `validate` (tests/conftest.py). What rounding can turn
(`tests.portable.PROVED`) stays in `make test`, and `tests.portable` runs the sensitive ones whatever they take.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Mapping
from pathlib import Path
from xml.etree import ElementTree

from tests.portable import PROVED, SLOW_TOO

ROOT = Path(__file__).resolve().parents[1]
LIST = Path(__file__).with_suffix(".json")
#: Seconds on a core beyond which a test is left to `make validate`.
MOST = 5.0


def listed() -> dict[str, float]:
    """Test -> seconds; nothing where the slow ones are wanted too."""
    return {} if os.environ.get(SLOW_TOO) == "1" else _read()


def _read() -> dict[str, float]:
    return dict(json.loads(LIST.read_text(encoding="utf-8"))) if LIST.exists() else {}


def times(junit: Path) -> dict[str, float]:
    """Test -> seconds of all that a run of pytest has run."""
    found = {}
    for case in ElementTree.parse(junit).getroot().iter("testcase"):
        path = ROOT.joinpath(*case.get("classname", "").split(".")).with_suffix(".py")
        if path.exists() and case.find("skipped") is None:
            found[f"{path.relative_to(ROOT).as_posix()}::{case.get('name')}"] = float(case.get("time", "0"))
    return found


def slow(run: Mapping[str, float], before: Mapping[str, float]) -> dict[str, float]:
    """Those of a run that took too long, and those that were left out of it."""
    found = {name: seconds for name, seconds in before.items() if name not in run}
    found |= {name: round(seconds, 1) for name, seconds in run.items() if seconds > MOST}
    return {name: found[name] for name in sorted(found) if name not in PROVED}


def main(words: list[str]) -> int:
    """Writes the list; exit code 0."""
    junit = Path(words[0]) if words else ROOT / "out" / "test" / "junit.xml"
    run = times(junit)
    found = slow(run, _read())
    LIST.write_text(json.dumps(found, indent=1, ensure_ascii=True) + "\n", encoding="utf-8")
    print(f"{len(found)} tests of {sum(found.values()):.0f} s are left to `make validate`; {len(run)} were run")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
