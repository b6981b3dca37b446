"""Thesis 7.2: the middle of the strip between clamps shifted sideways, forth and back, of every model and the shell."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

matplotlib.use("Agg")
from matplotlib import pyplot as plt

from compare.store.store import atomic_write_text
from tests.validation import page
from tests.validation.pieces import Pieces
from tests.validation.workbench.shift_sweeps import (
    ALONG,
    FIRST,
    LAST,
    POISSON,
    SHOTS,
    STEP,
    Case,
    fell_back,
    hysteresis,
    reached,
    sweep,
)

NARROW = (40.0, 20.0, 10.0, 6.0)
CASES = (
    Case("wunderlich", step=STEP), Case("sadowsky"), Case("kirchhoff"), Case("sano"), Case("extensible"),
    Case("finite"), Case("finite", ratio=100.0),
    *(Case(energy, narrow) for narrow in (40.0, 10.0, 6.0) for energy in ("wunderlich", "finite")),
    *(Case(energy, gamma=gamma) for gamma in (1.0, 10.0) for energy in ("wunderlich", "finite")),
)  # fmt: skip
#: Shells: 1 over w/l, w/h, mesh.
SHELLS = (
    (20.0, 50.0, (40, 4)), (10.0, 50.0, (40, 4)), (6.0, 50.0, (40, 4)), (40.0, 50.0, (40, 4)), (20.0, 100.0, (60, 6)),
)  # fmt: skip
INEXTENSIBLE = ("sadowsky", "wunderlich")
SHOWN = ("wunderlich", "finite")
COLOURS = {
    "sadowsky": "tab:orange", "wunderlich": "tab:red", "kirchhoff": "tab:green", "sano": "tab:olive",
    "extensible": "tab:cyan", "finite": "tab:blue",
}  # fmt: skip

Swept = dict[Case, dict[str, Any]]
Shells = dict[tuple[float, float], dict[str, Any]]


def shell(narrow: float, ratio: float, mesh: tuple[int, int]) -> dict[str, Any]:
    """Arch, tilted branch and kinks of the shell (`shell_shift`)."""
    from tests.validation.shell.shell_shift import follow

    return asdict(follow(ratio, mesh, 1.0 / narrow))


def run(out: Path) -> None:
    kept = Pieces("shift")
    swept = {case: kept.get(case.name, lambda c=case: sweep(c)) for case in CASES}
    shells = {
        (narrow, ratio): kept.get(
            f"shell_{narrow:g}_{ratio:g}_{mesh[0]}x{mesh[1]}", lambda n=narrow, r=ratio, m=mesh: shell(n, r, m)
        )
        for narrow, ratio, mesh in SHELLS
    }
    finish(out, swept, shells)


def finish(out: Path, swept: Swept, shells: Shells) -> None:
    """Page, table and figures of what was measured."""
    folder = out / "shift"
    folder.mkdir(parents=True, exist_ok=True)
    atomic_write_text(folder / "heights.csv", as_csv(swept, shells))
    heights_figure(folder / "heights.png", swept, shells)
    shots_figure(folder / "shots.png", swept)
    write(folder / "README.md", swept, shells)


def as_csv(swept: Swept, shells: Shells) -> str:
    """Every height: model, 1 over w/l, w/h, Gamma, direction (of a shell: branch), shift, height."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(["model", "length_to_width", "width_to_thickness", "gamma", "way", "shift", "height"])
    for case, found in swept.items():
        for way in ("forth", "back"):
            for shift, height, *_ in found[way]:
                row = [case.energy, f"{case.narrow:g}", f"{case.ratio:g}", f"{case.gamma:g}", way]
                writer.writerow([*row, f"{shift:.4g}", f"{height:.4f}"])
    for (narrow, ratio), found in shells.items():
        for branch in ("arch", "tilted"):
            for shift, height in found[branch]:
                writer.writerow(
                    ["shell", f"{narrow:g}", f"{ratio:g}", "0", branch, f"{shift:.4f}", f"{abs(height):.4f}"]
                )
    return stream.getvalue()


def _shell_lines(axis: Any, found: Mapping[str, Any], style: str, label: str) -> None:
    arch = np.array([p for p in found["arch"] if p[0] <= found["pitchfork"] + 1e-9])
    axis.plot(arch[:, 0], np.abs(arch[:, 1]), style, color="k", lw=1.6, label=label)
    if found["tilted"]:
        tilted = np.array(found["tilted"])
        axis.plot(tilted[:, 0], np.abs(tilted[:, 1]), style, color="k", lw=1.6)
    if np.isfinite(found["flat"]):
        axis.plot([found["flat"], LAST], [0, 0], style, color="k", lw=1.6)


def heights_figure(path: Path, swept: Swept, shells: Shells) -> None:
    """H(Delta W): solid forth, dashed back; one panel for each width, one for the weight."""
    fig, axes = plt.subplots(2, 3, figsize=(16, 9), layout="constrained", sharex=True)
    panels = dict(zip(NARROW, axes.flat, strict=False))
    heavy = axes.flat[len(NARROW)]
    axes.flat[-1].axis("off")
    for case, found in swept.items():
        axis = heavy if case.gamma else panels[case.narrow]
        colour = COLOURS[case.energy]
        wide = {"lw": 1.0, "alpha": 0.5} if case.ratio != 50.0 or case.gamma == 1.0 else {"lw": 1.2}
        label = case.energy + (f", w/h = {case.ratio:g}" if case.energy == "finite" and not case.gamma else "")
        label += f", Gamma = {case.gamma:g}" if case.gamma else ""
        for way, style in (("forth", "-"), ("back", "--")):
            if found[way]:
                rows = np.array(found[way])
                axis.plot(rows[:, 0], np.abs(rows[:, 1]), style, color=colour, label=label if way == "forth" else None,
                          **wide)  # fmt: skip
    for (narrow, ratio), found in shells.items():
        _shell_lines(panels[narrow], found, "-" if ratio == 50.0 else ":", f"shell, w/h = {ratio:g}")
    for narrow, axis in panels.items():
        axis.set_title(f"w/l = 1/{narrow:g}")
    heavy.set_title("w/l = 1/20, with weight (w/h = 50)")
    for axis in axes.flat[:-1]:
        axis.set(xlabel="shift Delta W / l", ylabel="H / l")
        axis.grid(True, lw=0.3, alpha=0.6)
        axis.legend(fontsize=7)
    fig.savefig(path, dpi=90, metadata={"Software": None})
    plt.close(fig)


def shots_figure(path: Path, swept: Swept) -> None:
    """Figure 7.5: the strip at the thesis's shifts, seen from the side and above."""
    cases = [case for case in swept if case.energy in SHOWN and case.narrow == 20.0 and not case.gamma]
    cases = [case for case in cases if case.ratio == 50.0]
    fig = plt.figure(figsize=(15, 3.1 * len(cases)), layout="constrained")
    for i, case in enumerate(cases):
        for k, shot in enumerate(SHOTS):
            axis: Any = fig.add_subplot(len(cases), len(SHOTS), i * len(SHOTS) + k + 1, projection="3d")
            left, _, right = (np.array(line) for line in swept[case]["shots"][f"{shot:g}"])
            x, y, z = (np.stack([left[:, j], right[:, j]]) for j in range(3))
            axis.plot_surface(x, y, z, color=COLOURS[case.energy], rcount=2, ccount=101, lw=0, alpha=0.9)
            axis.set_box_aspect((0.7, 0.7, 0.5))
            axis.set(xlim=(-0.1, 0.6), ylim=(-0.1, 0.6), zlim=(-0.05, 0.45), title=f"{case.energy}, {shot:g}")
            axis.set_xticklabels([])
            axis.set_yticklabels([])
            axis.set_zticklabels([])
            axis.view_init(25, -60)
    fig.savefig(path, dpi=70, metadata={"Software": None})
    plt.close(fig)


def _number(value: float) -> str:
    return f"{value:.3f}" if np.isfinite(value) else "none"


def _gap(case: Case, found: Mapping[str, Any], shells: Shells) -> str:
    """Largest and mean difference of H, forth, to the shell of the same width and thickness."""
    shell_found = shells.get((case.narrow, case.ratio if case.energy == "finite" else 50.0))
    if shell_found is None or case.gamma:
        return ""
    arch = [p for p in shell_found["arch"] if p[0] <= shell_found["pitchfork"]]
    line = np.array([*arch, *shell_found["tilted"]])
    order = np.argsort(line[:, 0], kind="stable")
    rows = np.array(found["forth"])
    there = np.interp(rows[:, 0], line[order, 0], np.abs(line[order, 1]))
    there[rows[:, 0] > shell_found["flat"]] = 0.0
    apart = np.abs(np.abs(rows[:, 1]) - there)
    return f"{apart.mean():.4f} / {apart.max():.3f}"


def write(path: Path, swept: Swept, shells: Shells) -> None:
    """The page."""
    rows = []
    for case, found in swept.items():
        loop = hysteresis(dict(found))
        rows.append([
            case.energy, f"1/{case.narrow:g}", "" if case.energy in INEXTENSIBLE else f"{case.ratio:g}",
            f"{case.gamma:g}", f"{case.segments}", _number(found["pitchfork"]), _number(reached(found["forth"])),
            _number(found["flat"]), _number(fell_back(found["back"])) if found["back"] else "none",
            f"{loop[0]:.3f} to {loop[1]:.3f}" if loop else "none", _gap(case, found, shells), found["stopped"],
        ])  # fmt: skip
    for (narrow, ratio), found in shells.items():
        near = [f for f in found["folds"] if f < found["pitchfork"]]
        back = min(near, default=found["pitchfork"])
        loop_words = "none" if found["pitchfork"] - back < 1e-3 else f"{back:.3f} to {found['pitchfork']:.3f}"
        highest = max([f for f in found["folds"] if f > found["flat"]], default=found["flat"])
        rows.append([
            "shell", f"1/{narrow:g}", f"{ratio:g}", "0", "", _number(found["pitchfork"]), _number(highest),
            _number(found["flat"]), _number(back), loop_words, "", "",
        ])  # fmt: skip
    page.write(
        path, "Clamps shifted sideways, every model (thesis 7.2)", "python -m tests.validation shift",
        f"nu = {POISSON:g} (the thesis gives none), clamps {ALONG:g} l apart, both edges held (ruling straight where "
        f"the energy knows one), Delta W from {FIRST:g} to {LAST:g} and back in steps of {2 * STEP:g} ({STEP:g} for "
        "Wunderlich at w/l = 1/20, as in the thesis), p equal elements, each state from the last, unstable states left "
        "along their unstable mode; Gamma along -z, the arch standing. *U-US*: the arch is no longer stable (bisected "
        "to 3e-4). *US-S*: forth, H below 5e-3 from there on (to a step). *S-US*: back, the flat strip is no longer "
        "stable. *US-U*: back, the arch stands upright again (to a step). *hysteresis*: shifts between which H differs "
        "by more than 0.01, forth and back. *to the shell*: mean and largest difference of H, forth, to the shell of "
        "this w/l and w/h (of w/h = 50 for the inextensible). Shells: branches by arc length ([their "
        "page](../shell_shift.md)), Q2 40 x 4 at w/h = 50, 60 x 6 at 100. Pieces are kept in out/validate/shift; "
        "delete them to measure anew.",
        page.table(
            ["model", "w/l", "w/h", "Gamma", "p", "U-US", "US-S", "S-US", "US-U", "hysteresis", "to the shell",
             "stopped"], rows,
        ),
        "![Heights forth and back](heights.png)",
        "Solid forth, dashed back; black: the shell.",
        "![The strip at the thesis's shifts](shots.png)",
    )  # fmt: skip
