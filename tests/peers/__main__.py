"""`python -m tests.peers [CASE ... size pyelastica der]`: peers and ours at equal error, to results/peers.md.

AUTO_DIR names AUTO-07p's folder, PEERS_PYTHON a Python with CasADi, PyElastica and jax, DER_DIR a checkout of DER-JAX
(how to get them: `tests/peers/__init__.py`); whoever is absent is left out, with the reason.
"""

from __future__ import annotations

import csv
import io
import sys
from pathlib import Path

from compare.store.store import atomic_write_text
from tests.peers import auto, further, optimal
from tests.peers.cases import TARGET, Run, cases
from tests.peers.measure import OURS, ROUNDS, grown, measure, peers
from tests.validation import one_core, page

OUT = Path(__file__).resolve().parents[2] / "results"


Measured = dict[str, dict[str, Run]]
"""Case -> peer -> its run."""
Grown = list[tuple[int, float, str]]
"""Segments, CPU s per segment, status."""


#: What the numbers of AUTO do not say by themselves.
AUTO_NOTE = (
    "Optimised (-O3) are AUTO-07p's equations alone, not Debian's objects of it; two runs of the search may end 40 % "
    "apart where many settings are nearly as fast. solve_bvp wants more than 100000 nodes for a reference of K = 100: "
    "its tip is that of every other solver."
)


def _milliseconds(run: Run | None) -> str:
    return "-" if run is None else f"{1e3 * run.seconds:.3g}"


def _names(measured: Measured) -> list[str]:
    return [name for name in peers() if any(name in runs for runs in measured.values())]


def _table(measured: Measured) -> str:
    names = _names(measured)
    rows = [[case, *(_milliseconds(runs.get(name)) for name in names)] for case, runs in measured.items()]
    return page.table(["case", *names], rows)


def _ratios(measured: Measured) -> str:
    names = [name for name in _names(measured) if name != OURS]
    rows = []
    for case, runs in measured.items():
        ours = runs.get(OURS)
        found = [runs.get(name) for name in names]
        rows.append([case, *("-" if ours is None or r is None else f"{r.seconds / ours.seconds:.2g}" for r in found)])
    return page.table(["case", *names], rows)


def _details(measured: Measured) -> str:
    rows = [
        [case, name, run.settings, f"{run.error:.1e}", _milliseconds(run)]
        for case, runs in measured.items()
        for name, run in runs.items()
    ]
    return page.table(["case", "peer", "settings", "tip error / l", "ms"], rows)


def _csv(heads: list[str], rows: list[list[str]]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([heads, *rows])
    return text.getvalue()


def _kept(path: Path) -> list[list[str]]:
    if not path.exists():
        return []
    with path.open(newline="") as lines:
        return list(csv.reader(lines))[1:]


def merged(out: Path, new: dict[str, dict[str, Run | str]]) -> Measured:
    """The cases of the table `out`/peers.csv, those that are `new` in place of the former ones; the table with them."""
    found: Measured = {}
    for case, name, settings, error, seconds in _kept(out / "peers.csv"):
        found.setdefault(case, {})[name] = Run(settings, float(error), 1e-3 * float(seconds))
    found |= {case: {name: r for name, r in runs.items() if isinstance(r, Run)} for case, runs in new.items()}
    found = {case.name: found[case.name] for case in cases() if case.name in found}
    rows = [
        [case, name, run.settings, f"{run.error:.3e}", f"{1e3 * run.seconds:.4g}"]
        for case, runs in found.items()
        for name, run in runs.items()
    ]
    atomic_write_text(out / "peers.csv", _csv(["case", "peer", "settings", "tip_error", "cpu_ms"], rows))
    return found


def _sizes(out: Path, new: Grown | None) -> Grown:
    """What is `new`, or was kept, of the times by size."""
    path = out / "peers_size.csv"
    if new is not None:
        rows = [[str(p), f"{1e6 * t:.4g}", status] for p, t, status in new]
        atomic_write_text(path, _csv(["segments", "cpu_microseconds_a_segment", "status"], rows))
    return [(int(p), 1e-6 * float(t), status) for p, t, status in _kept(path)]


def _picture(measured: Measured, grown: Grown, path: Path) -> None:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(12.0, 4.6), constrained_layout=True, width_ratios=[1.7, 1.0])
    for number, name in enumerate(_names(measured)):
        points = [(i, 1e3 * runs[name].seconds) for i, runs in enumerate(measured.values()) if name in runs]
        left.semilogy(*zip(*points, strict=True), "osd^v<>"[number % 7], ls=":", label=name)
    left.set_xticks(range(len(measured)), [case.replace(", ", "\n") for case in measured], fontsize=7)
    left.set_ylabel(f"CPU time to a tip error of {TARGET:g} l / ms")
    left.grid(alpha=0.3, which="both")
    left.legend(fontsize=8)
    right.loglog([p for p, _, _ in grown], [1e6 * t for _, t, _ in grown], "o-")
    right.set_xlabel("segments")
    right.set_ylabel("ribbon.solve: CPU time per segment / microseconds")
    right.grid(alpha=0.3, which="both")
    figure.savefig(path, dpi=110)
    plt.close(figure)


def report(out: Path, new: dict[str, dict[str, Run | str]], sizes: Grown | None) -> None:
    """Page, tables and picture, the cases that are not new as they were."""
    measured, grown = merged(out, new), _sizes(out, sizes)
    everyone = peers()
    reasons = {name: peer.absent() for name, peer in everyone.items()}
    _picture(measured, grown, out / "peers.png")
    tried = len(auto.SEARCH) * len(auto.INTERVALS)
    there = [f"- {name}: {peer.version()}" for name, peer in everyone.items() if reasons[name] is None]
    gone = [f"- {name} is left out: {why}" for name, why in reasons.items() if why is not None]
    page.write(
        out / "peers.md", "Other people's solvers at equal error", "python -m tests.validation peers",
        "The cases of [the strong form](strong_form.md), every solver with the settings that are fastest for it at a "
        f"tip error of at most {TARGET:g} l, searched case by case; then all in turn, {ROUNDS} times, one thread; "
        "medians of CPU time in ms. Ours and solve_bvp: warm calls, kernels compiled; ours with its stability check. "
        f"AUTO-07p: whole processes, compiled before, the fastest of {tried} settings of its continuation in the "
        "weight, analytic derivatives. CasADi: direct collocation, the problem built before, the coarsest mesh of "
        f"each degree that reaches the error ({len(optimal.SEARCH)} tried). All end on the same branch.",
        AUTO_NOTE,
        "\n".join(there + gone),
        _table(measured),
        f"Over `{OURS}` (above 1: ours is faster):", _ratios(measured),
        "![times](peers.png)",
        f"`{OURS}` by size (coil_10_100, K l = 10):",
        page.table(
            ["segments", "CPU microseconds per segment", "status"],
            [[str(p), f"{1e6 * t:.3g}", status] for p, t, status in grown],
        ),
        "## Settings", _details(measured), "As a table: [peers.csv](peers.csv).",
        *further.parts(out), "As a table: [peers_further.csv](peers_further.csv).",
    )  # fmt: skip


def main(words: list[str]) -> None:
    """Runs the peers that are there and writes the page."""
    coils = [word for word in words if word not in further.PARTS]
    for name in [case.name for case in cases() if not words or any(word in case.name for word in coils)]:
        report(OUT, one_core.call(measure, [name]), None)
    if not words or "size" in words:
        report(OUT, {}, one_core.call(grown))
    if not words or set(words) & set(further.PARTS):
        further.measure(words, OUT)
        report(OUT, {}, None)


if __name__ == "__main__":
    main(sys.argv[1:])
