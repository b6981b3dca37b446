"""All rungs of the battery of hard cases, group by group; a group that is done is kept as a piece."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Any

from compare.battery.groups import GROUPS, chosen
from compare.battery.run import attempt
from compare.cli import main
from tests.validation import page
from tests.validation.number import Number, rounding
from tests.validation.pieces import key

#: How rungs end, in the order of the counts.
_ENDS = ("passed", "failed", "known failure", "no longer fails", "skipped")


#: Cases whose worst check `make test` computes again.
PROBED = ("gain", "rounded_factor", "width_factor")


def worst(name: str) -> float:
    """Largest error of a case of the group `functions`, over its quick rungs."""
    (case,) = (case for case in chosen("functions") if case.name == f"functions/{name}")
    return max(check.value for rung in case.rungs for check in attempt(case, rung, timed=False).checks)


PROBES = {name: lambda name=name: worst(name) for name in PROBED}


def numbers(found: dict[str, dict[str, Any]]) -> dict[str, Number]:
    """Counts of cases and of rungs by how they ended; errors against mpmath."""
    rungs: Counter[str] = Counter()
    for record in found.values():
        rungs.update(record["rungs"])
    return {
        "cases": Number(sum(len(record["cases"]) for record in found.values()), 0, shown="d"),
        "rungs": Number(sum(rungs.values()), 0, shown="d"),
        **{end.replace(" ", "_"): Number(rungs[end], 0, shown="d") for end in _ENDS},
        **{name: rounding(worst(name), shown=".1e") for name in PROBED},
        "balance": rounding(imbalance(found)[0], shown=".1e"),
    }


def imbalance(found: dict[str, dict[str, Any]]) -> tuple[float, str]:
    """Largest imbalance of forces over the largest force on a rung that passed, and its case."""
    worst = (0.0, "")
    for record in found.values():
        for case in record["cases"]:
            for tried in (tried for tried in case["tried"] if tried["ended"] == "passed"):
                for check in tried["checks"]:
                    if check["what"].startswith("not in balance, relative"):
                        worst = max(worst, (check["value"], case["case"]))
    return worst


def run(out: Path) -> dict[str, Number]:
    folder = out.parent / "out" / "validate" / "battery" / key("battery")
    found = {group: _group(group, folder / group) for group in GROUPS}
    there = {group: record for group, record in found.items() if record is not None}
    write(out, there)
    return numbers(there)


def _group(group: str, folder: Path) -> dict[str, Any] | None:
    """result.json of a group: of an earlier run of the same program where there is one."""
    path = folder / "result.json"
    if not path.is_file():
        main(["battery", group, "--long", "--quiet", "--out", str(folder)])
    record: dict[str, Any] = json.loads(path.read_text())
    return record if record["cases"] else None


def write(out: Path, found: dict[str, dict[str, Any]]) -> None:
    """results/battery.md from the results of groups."""
    rungs: Counter[str] = Counter()
    cases: Counter[str] = Counter()
    parts = []
    worst = imbalance(found)
    for group, record in found.items():
        rungs.update(record["rungs"])
        cases.update(case["ended"] for case in record["cases"])
        rows = []
        for case in record["cases"]:
            fine = sum(t["ended"] in ("passed", "no longer fails") for t in case["tried"])
            rows.append([
                case["case"].partition("/")[2], case["parameter"], str(case["reaches"]),
                f"{fine} of {len(case['tried'])}", _number(case["worst"]), _number(case["bound"]), case["what"] or "",
                case["ended"], f"{case['seconds']:.3g}",
            ])  # fmt: skip
        said = [f"- **{c['case']}** ({c['ended']}): {c['why']}" for c in record["cases"] if c["why"]]
        heads = ["case", "difficulty", "goes to", "passed", "worst", "bound", "of", "ended", "CPU s"]
        ran = "" if record["long"] else "The quick rungs alone; the long ones were not run for this page."
        parts += [f"## {group}: {GROUPS[group]}", ran, page.table(heads, rows), "\n".join(said)]
    total = sum(rungs.values())
    head = (
        f"{sum(cases.values())} hard cases with {total} rungs: "
        + ", ".join(f"{rungs[end]} {end}" for end in _ENDS if rungs[end])
        + f". Largest imbalance of forces that passed: {worst[0]:.1e} of the largest force ({worst[1]}). "
        "What a case says is hard and expected: `ribbonbench battery --list --wide`."
    )
    page.write(
        out / "battery.md", "Hard cases", "python -m tests.validation battery", head, *(part for part in parts if part)
    )


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.1e}"
