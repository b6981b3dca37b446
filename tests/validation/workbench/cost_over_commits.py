"""What the main jobs cost, commit after commit, in units of a calibration kernel: whoever makes one slower sees it.

`python -m tests.validation cost_over_commits` measures the present checkout; `python -m
tests.validation.workbench.cost_over_commits REV ...` measures older ones, each in a git worktree of its own that is
removed afterwards. Either appends a row a job to the table, or replaces the rows of the same commit.
"""

from __future__ import annotations

import csv
import io
import json
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from compare.store.store import atomic_write_text
from tests.validation import page
from tests.validation.number import Number
from tests.validation.workbench import cost_jobs

ROOT = Path(__file__).resolve().parents[3]
TABLE, PAGE, PICTURE = "cost_over_commits.csv", "cost_over_commits.md", "cost_over_commits.png"
#: A ratio counts as changed beyond this factor: what repeated measurements of one commit differ by.
NOISE = 1.25


@dataclass(frozen=True)
class Row:
    """A job at a commit of this time (ISO): its CPU time over the calibration kernel's; None: it could not be run."""

    commit: str
    date: str
    job: str
    ratio: float | None

    def cells(self) -> dict[str, str]:
        ratio = "" if self.ratio is None else f"{self.ratio:.4g}"
        return {**{k: str(v) for k, v in asdict(self).items()}, "ratio": ratio}


def read(path: Path) -> list[Row]:
    """The rows of a table; none where there is none."""
    if not path.exists():
        return []
    with path.open(newline="") as lines:
        return [
            Row(line["commit"], line["date"], line["job"], float(line["ratio"]) if line["ratio"] else None)
            for line in csv.DictReader(lines)
        ]


def merged(old: Sequence[Row], new: Sequence[Row]) -> list[Row]:
    """By date, then in the order of the jobs; a job of a commit that is measured again replaces the former."""
    found = {(row.commit, row.job): row for row in (*old, *new)}
    order = {name: number for number, name in enumerate(cost_jobs.JOBS)}
    return sorted(found.values(), key=lambda row: (row.date, row.commit, order.get(row.job, len(order))))


def written(rows: Sequence[Row]) -> str:
    """The table as CSV."""
    text = io.StringIO()
    table = csv.DictWriter(text, ["commit", "date", "job", "ratio"], lineterminator="\n")
    table.writeheader()
    table.writerows(row.cells() for row in rows)
    return text.getvalue()


def _git(*words: str) -> str:
    return subprocess.run(["git", "-C", str(ROOT), *words], check=True, capture_output=True, text=True).stdout.strip()


def measured(checkout: Path, revision: str, jobs: Sequence[str] = ()) -> list[Row]:
    """The rows of a checkout that stands at `revision`."""
    commit, date = _git("log", "-1", "--format=%h %cI", revision).split()
    if checkout == ROOT and _git(
        "status", "--porcelain", "--untracked-files=no", "--", "ribbon", "shellref", "compare"
    ):
        commit += "+"
    environment = {**os.environ, "PYTHONPATH": str(checkout), "PYTHONNOUSERSITE": "1"}
    # cost_jobs runs as a script from here, with the packages of the checkout
    words = [sys.executable, "-P", str(Path(cost_jobs.__file__).resolve()), *jobs]
    rows = []
    with subprocess.Popen(words, env=environment, stdout=subprocess.PIPE, text=True) as process:
        for line in process.stdout or ():
            found = json.loads(line)
            rows.append(Row(commit, date, found["job"], found["ratio"]))
            print(f"  {commit} {found['job']}: {found['ratio'] if found['ratio'] else found['why']}", flush=True)
    if process.returncode:
        raise AssertionError(f"{commit}: the jobs ended with code {process.returncode}")
    return rows


def older(revision: str, jobs: Sequence[str] = ()) -> list[Row]:
    """The rows of a revision in a worktree of its own."""
    with tempfile.TemporaryDirectory(prefix="ribbonbench-cost-") as folder:
        place = Path(folder) / "checkout"
        _git("worktree", "add", "--detach", str(place), revision)
        try:
            return measured(place, revision, jobs)
        finally:
            _git("worktree", "remove", "--force", str(place))


def slower(rows: Sequence[Row]) -> list[str]:
    """Sentences on the jobs of the last commit that cost more than NOISE times the least before it."""
    commits = list(dict.fromkeys(row.commit for row in rows))
    found = []
    for row in (row for row in rows if commits and row.commit == commits[-1]):
        before = [r for r in rows if r.job == row.job and r.commit != row.commit and r.ratio]
        if row.ratio and before:
            best = min(before, key=lambda r: r.ratio or 0.0)
            if best.ratio and row.ratio > NOISE * best.ratio:
                found.append(f"{row.job}: {row.ratio / best.ratio:.2g} times what it was at {best.commit}")
    return found


def _table(rows: Sequence[Row]) -> str:
    commits = list(dict.fromkeys((row.commit, row.date) for row in rows))
    value = {(row.commit, row.job): row.ratio for row in rows}

    def cell(ratio: float | None) -> str:
        return "-" if ratio is None else f"{ratio:.3g}"

    lines = []
    for job in dict.fromkeys(row.job for row in rows):
        ratios = [value.get((commit, job)) for commit, _ in commits]
        first, last = ratios[0], ratios[-1]
        gain = f"{first / last:.3g}" if first and last else "-"
        lines.append([job, *map(cell, ratios), gain])
    return page.table(["job", *(f"{commit} ({date[:10]})" for commit, date in commits), "first / last"], lines)


def _picture(rows: Sequence[Row], path: Path) -> None:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    commits = list(dict.fromkeys(row.commit for row in rows))
    figure, axis = plt.subplots(figsize=(9.0, 4.8), constrained_layout=True)
    for number, job in enumerate(dict.fromkeys(row.job for row in rows)):
        points = [(commits.index(r.commit), r.ratio) for r in rows if r.job == job and r.ratio]
        axis.semilogy(*zip(*points, strict=True), marker="osd^v"[number % 5], color=f"C{number % 10}", label=job)
    axis.set_xticks(range(len(commits)), commits, rotation=45, ha="right", fontsize=8)
    axis.set_ylabel("CPU time over the calibration kernel's")
    axis.grid(alpha=0.3, which="both")
    axis.legend(fontsize=8, frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
    figure.savefig(path, dpi=110)
    plt.close(figure)


def report(out: Path, rows: Sequence[Row]) -> None:
    """Table, picture and page."""
    atomic_write_text(out / TABLE, written(rows))
    _picture(rows, out / PICTURE)
    worse = slower(rows)
    last = f"The last commit is slower (beyond {NOISE}) in: " + "; ".join(worse) + "." if worse else (
        f"No job of the last commit costs more than {NOISE} times the least before it."
    )  # fmt: skip
    page.write(
        out / PAGE, "Cost over commits", "python -m tests.validation cost_over_commits",
        "CPU time of the main jobs, processes that they start included, over the CPU time of a fixed kernel (a "
        "compiled loop, dense factorisations, plain Python; about 15 ms) that runs in the same process just before and "
        f"after each repetition; medians of up to {cost_jobs.REPEATS}, one thread, kernels and forms compiled before. "
        "Ratios can be set beside those of other days on one machine, and roughly beside other machines. Older "
        "revisions: `python -m tests.validation.workbench.cost_over_commits REV ...`; a `+` after a commit: with "
        "changes that are not committed.",
        last, _table(rows), f"![Ratios over commits]({PICTURE})", f"All rows: [{TABLE}]({TABLE}).",
    )  # fmt: skip


#: Why `make test` computes no number of it again.
NO_PROBES = "times of one commit on one machine, in those of a kernel beside them: another run has others"


def run(out: Path) -> dict[str, Number]:
    """Measures the present checkout."""
    here = measured(ROOT, "HEAD")
    report(out, merged(read(out / TABLE), here))
    why = "processor times of one run over those of a fixed kernel"
    return {
        "_".join(re.findall(r"[a-z0-9]+", row.job.lower())): Number(row.ratio, None, "", ".3g", why)
        for row in here
        if row.ratio
    }


def main(revisions: list[str]) -> None:
    """Measures the revisions named."""
    out = ROOT / "results"
    for revision in revisions:
        report(out, merged(read(out / TABLE), older(revision)))


if __name__ == "__main__":
    main(sys.argv[1:])
