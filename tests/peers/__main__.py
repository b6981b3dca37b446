"""`python -m tests.peers [CASE ...]`: peers and ours at equal error in one run, to results/peers.md.

AUTO_DIR names AUTO-07p's folder, PEERS_PYTHON a Python with CasADi; whoever is absent is left out, with the reason.
"""

from __future__ import annotations

import csv
import io
import sys
from pathlib import Path

from compare.store.store import atomic_write_text
from tests.peers import auto, optimal
from tests.peers.cases import TARGET, Run
from tests.peers.measure import OURS, ROUNDS, measure, peers
from tests.validation import one_core, page

OUT = Path(__file__).resolve().parents[2] / "results"


def _cell(run: Run | str) -> str:
    return run if isinstance(run, str) else f"{1e3 * run.seconds:.3g}"


def _table(measured: list[tuple[str, dict[str, Run | str]]]) -> str:
    names = list(measured[0][1])
    return page.table(
        ["case", *names],
        [[case, *("-" if isinstance(r, str) else _cell(r) for r in runs.values())] for case, runs in measured],
    )


def _ratios(measured: list[tuple[str, dict[str, Run | str]]]) -> str:
    names = [name for name in measured[0][1] if name != OURS]
    rows = []
    for case, runs in measured:
        ours = runs[OURS]
        cells = []
        for name in names:
            run = runs[name]
            known = isinstance(run, Run) and isinstance(ours, Run)
            cells.append(f"{run.seconds / ours.seconds:.2g}" if known else "-")  # type: ignore[union-attr]
        rows.append([case, *cells])
    return page.table(["case", *names], rows)


def _details(measured: list[tuple[str, dict[str, Run | str]]]) -> str:
    rows = [
        [case, name, *((run, "", "") if isinstance(run, str) else (run.settings, f"{run.error:.1e}", _cell(run)))]
        for case, runs in measured
        for name, run in runs.items()
    ]
    return page.table(["case", "peer", "settings", "tip error / l", "ms"], rows)


def _csv(measured: list[tuple[str, dict[str, Run | str]]]) -> str:
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(["case", "peer", "settings", "tip_error", "cpu_ms"])
    for case, runs in measured:
        for name, run in runs.items():
            if isinstance(run, Run):
                table.writerow([case, name, run.settings, f"{run.error:.3e}", f"{1e3 * run.seconds:.4g}"])
    return text.getvalue()


def _picture(measured: list[tuple[str, dict[str, Run | str]]], grown: list[tuple[int, float, str]], path: Path) -> None:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(12.0, 4.6), constrained_layout=True, width_ratios=[1.7, 1.0])
    for number, name in enumerate(measured[0][1]):
        points = [(i, 1e3 * runs[name].seconds) for i, (_, runs) in enumerate(measured) if isinstance(runs[name], Run)]  # type: ignore[union-attr]
        if points:
            left.semilogy(*zip(*points, strict=True), "osd^v<>"[number % 7], ls=":", label=name)
    left.set_xticks(range(len(measured)), [case.replace(", ", "\n") for case, _ in measured], fontsize=7)
    left.set_ylabel(f"CPU time to a tip error of {TARGET:g} l / ms")
    left.grid(alpha=0.3, which="both")
    left.legend(fontsize=8)
    right.loglog([p for p, _, _ in grown], [1e6 * t for _, t, _ in grown], "o-")
    right.set_xlabel("segments")
    right.set_ylabel("ribbon.solve: CPU time per segment / microseconds")
    right.grid(alpha=0.3, which="both")
    figure.savefig(path, dpi=110)
    plt.close(figure)


def report(out: Path, measured: list[tuple[str, dict[str, Run | str]]], grown: list[tuple[int, float, str]]) -> None:
    """Page, table and picture."""
    everyone = peers()
    reasons = {name: peer.absent() for name, peer in everyone.items()}
    _picture(measured, grown, out / "peers.png")
    atomic_write_text(out / "peers.csv", _csv(measured))
    there = [f"- {name}: {peer.version()}" for name, peer in everyone.items() if reasons[name] is None]
    gone = [f"- {name} is left out: {why}" for name, why in reasons.items() if why is not None]
    page.write(
        out / "peers.md", "Other people's solvers at equal error", "python -m tests.validation peers",
        "The cases of [the strong form](strong_form.md), every solver with the settings that are fastest for it at a "
        f"tip error of at most {TARGET:g} l, searched case by case; then all in turn, {ROUNDS} times, one thread; "
        "medians of CPU time in ms. Ours and solve_bvp: warm calls, kernels compiled; ours with its stability check. "
        f"AUTO-07p: whole processes, compiled before, the fastest of {len(auto.SEARCH)} settings of its continuation "
        "in the weight, analytic derivatives. CasADi: direct collocation, the problem built before, the coarsest "
        f"mesh of each degree that reaches the error ({len(optimal.SEARCH)} tried). All end on the same branch.",
        "\n".join(there + gone),
        _table(measured),
        f"Over `{OURS}` (above 1: ours is faster):", _ratios(measured),
        "![times](peers.png)",
        f"`{OURS}` by size ({measured[0][0]}):",
        page.table(
            ["segments", "CPU microseconds per segment", "status"],
            [[str(p), f"{1e6 * t:.3g}", status] for p, t, status in grown],
        ),
        "## Settings", _details(measured), "As a table: [peers.csv](peers.csv).",
    )  # fmt: skip


def main(words: list[str]) -> None:
    """Runs the peers that are there and writes the page."""
    report(OUT, *one_core.call(measure, words))


if __name__ == "__main__":
    main(sys.argv[1:])
