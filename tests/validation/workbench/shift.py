"""Thesis 7.2: the strip between clamps shifted sideways: where its arch gives way, with an error, and its heights."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

matplotlib.use("Agg")
from matplotlib import pyplot as plt

from compare.measure.mesh_limit import Settled
from compare.store.store import atomic_write_text
from ribbon.find.branch.passages import Grading
from tests.validation import page
from tests.validation.number import Number, of_settled
from tests.validation.pieces import Pieces
from tests.validation.shell import shell_shift
from tests.validation.workbench.shift_arch import Ladder, climbed, limit
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
)  # fmt: skip

#: It takes no times that its page rests on.
ALONE = False

#: Elements of the sweeps of height: placed at every state.
SWEPT = Grading(0.01, 0.001, 0.1)
CASES = (Case("wunderlich", step=STEP, grading=SWEPT), Case("finite", grading=SWEPT))
#: Where the arch gives way: elements on which the states of the coarsest mesh are those of the finer ones.
LADDERS = (
    Ladder(Case("wunderlich", 20.0), Grading(0.005, 0.001, 0.05)),
    Ladder(Case("wunderlich", 10.0), Grading(0.01, 0.002, 0.1)),
    Ladder(Case("wunderlich", 6.0), Grading(0.01, 0.002, 0.1)),
    Ladder(Case("finite", 20.0, 50.0), Grading(0.01, 0.0005, 0.1)),
    Ladder(Case("kirchhoff", 20.0, 50.0), None),
)
#: The thesis's and this page's earlier elements: equal ones, which the event meets at another place of each.
EQUAL = (Ladder(Case("wunderlich", 20.0), None, 2), Ladder(Case("finite", 20.0, 50.0), None, 2))
#: Shells, meshes with elements 1.5 times shorter each: 1 over w/l, w/h, meshes.
MESHES = ((40, 4), (60, 6), (90, 9))
SHELLS = (
    (40.0, 50.0, MESHES), (20.0, 50.0, MESHES), (10.0, 50.0, MESHES), (6.0, 50.0, MESHES),
    (20.0, 100.0, ((60, 6), (90, 9), (135, 13))), (20.0, 200.0, ((90, 9), (135, 13), (200, 20))),
)  # fmt: skip
FINER = 1.5
#: The shell whose whole branch stands in the figure.
BRANCH = (20.0, 50.0, (60, 6))
COLOURS = {"wunderlich": "tab:red", "finite": "tab:blue"}

Rungs = list[dict[str, Any]]
Swept = dict[Case, dict[str, Any]]
Key = tuple[str, float, float]


#: Critical shifts on the coarsest mesh of two ladders: number -> the ladder of one rung.
COARSEST = {
    "coarse_kirchhoff_20_50": replace(LADDERS[-1], rungs=1), "coarse_wunderlich_6": replace(LADDERS[2], rungs=1),
}  # fmt: skip
PROBES = {word: lambda ladder=ladder: float(climbed(ladder)[0]["shift"]) for word, ladder in COARSEST.items()}


def _coarsest(ladders: dict[Ladder, Rungs]) -> dict[str, Number]:
    """Of `COARSEST`, with the change to the next mesh and what each was located to."""
    found = {}
    for word, ladder in COARSEST.items():
        first, second = ladders[replace(ladder, rungs=3)][:2]
        error = abs(second["shift"] - first["shift"]) + first["located"]
        found[word] = Number(first["shift"], error, "l", ".4f")
    for ladder in EQUAL:
        for rung in ladders[ladder]:
            if rung["shift"] is not None:
                word = f"equal_{ladder.case.energy}_{rung['p']}"
                found[word] = Number(rung["shift"], None, "l", ".4f", "a number of these elements")
    return found


def run(out: Path) -> dict[str, Number]:
    """Measures what is not kept, writes the page; its numbers by name."""
    kept = Pieces("shift")
    ladders = {ladder: kept.get(ladder.name, lambda x=ladder: climbed(x)) for ladder in (*LADDERS, *EQUAL)}
    shells = {
        (narrow, ratio): [
            {**kept.get(
                f"shell_lost_{narrow:g}_{ratio:g}_{m[0]}x{m[1]}",
                lambda n=narrow, r=ratio, m=m: shell_shift.arch_lost(r, m, 1.0 / n),
            ), "mesh": m}
            for m in meshes
        ]
        for narrow, ratio, meshes in SHELLS
    }  # fmt: skip
    narrow, ratio, mesh = BRANCH
    branch = kept.get(
        f"shell_{narrow:g}_{ratio:g}_{mesh[0]}x{mesh[1]}",
        lambda: asdict(shell_shift.follow(ratio, mesh, 1.0 / narrow)),
    )
    swept = {case: kept.get(case.name, lambda c=case: sweep(c)) for case in CASES}
    return finish(out, ladders, shells, branch, swept)


def finish(
    out: Path, ladders: dict[Ladder, Rungs], shells: dict[tuple[float, float], Rungs], branch: dict[str, Any],
    swept: Swept,
) -> dict[str, Number]:  # fmt: skip
    """Page, numbers, table and figures of what was measured."""
    folder = out / "shift"
    folder.mkdir(parents=True, exist_ok=True)
    limits: dict[Key, Settled] = {
        (x.case.energy, x.case.narrow, _ratio(x.case)): limit(found) for x, found in ladders.items() if x not in EQUAL
    }
    limits |= {("shell", *key): limit(found, FINER) for key, found in shells.items()}
    numbers = {f"lost_{e}_{n:g}_{r:g}" if r else f"lost_{e}_{n:g}": of_settled(found.record("l"))
               for (e, n, r), found in limits.items()} | _coarsest(ladders)  # fmt: skip
    atomic_write_text(folder / "heights.csv", as_csv(swept, branch))
    arch_figure(folder / "arch.png", ladders)
    heights_figure(folder / "heights.png", swept, branch, limits)
    shots_figure(folder / "shots.png", swept)
    write(folder / "README.md", ladders, shells, limits, swept)
    return numbers


def _ratio(case: Case) -> float:
    """w/h, 0 for the models that have no thickness."""
    return 0.0 if case.energy in ("wunderlich", "sadowsky") else case.ratio


def as_csv(swept: Swept, branch: Mapping[str, Any]) -> str:
    """Every height: model, 1 over w/l, w/h, direction (of the shell: branch), shift, height."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(["model", "length_to_width", "width_to_thickness", "way", "shift", "height"])
    for case, found in swept.items():
        for path in ("forth", "back"):
            for shift, height, *_ in found[path]:
                writer.writerow(
                    [case.energy, f"{case.narrow:g}", f"{case.ratio:g}", path, f"{shift:.4g}", f"{height:.4f}"]
                )
    for path in ("arch", "tilted"):
        for shift, height in branch[path]:
            writer.writerow(["shell", f"{BRANCH[0]:g}", f"{BRANCH[1]:g}", path, f"{shift:.4f}", f"{abs(height):.4f}"])
    return stream.getvalue()


def arch_figure(path: Path, ladders: dict[Ladder, Rungs]) -> None:
    """Lowest eigenvalue of the arch over the shift, w/l = 1/20, w/h = 50: equal elements, and elements at passages."""
    fig, axes = plt.subplots(1, 2, figsize=(13, 4.6), layout="constrained", sharey=True)
    for axis, energy in zip(axes, COLOURS, strict=True):
        for ladder, found in ladders.items():
            if ladder.case.energy != energy or ladder.case.narrow != 20.0 or _ratio(ladder.case) not in (0.0, 50.0):
                continue
            for rung in found:
                states = np.array(rung["states"])
                placed = ladder.grading is not None
                label = f"p = {rung['p']}, {'at the passages' if placed else 'equal'}"
                axis.plot(*states.T, "o-" if placed else "x--", ms=4, lw=1.2, label=label)
        axis.axhline(0.0, color="k", lw=0.8)
        axis.set(title=energy, xlabel="shift Delta W / l", xlim=(0.25, 0.42), ylim=(-0.02, 0.2))
        axis.grid(True, lw=0.3, alpha=0.6)
        axis.legend(fontsize=8)
    axes[0].set_ylabel("lowest eigenvalue of the arch")
    fig.savefig(path, dpi=90, metadata={"Software": None})
    plt.close(fig)


def heights_figure(path: Path, swept: Swept, branch: Mapping[str, Any], limits: dict[Key, Settled]) -> None:
    """H(Delta W) at w/l = 1/20: solid forth, dashed back; marks where each arch gives way."""
    fig, axis = plt.subplots(figsize=(9, 6), layout="constrained")
    arch = np.array([p for p in branch["arch"] if p[0] <= branch["pitchfork"] + 1e-9])
    axis.plot(arch[:, 0], np.abs(arch[:, 1]), "k-", lw=1.6, label="shell, w/h = 50")
    tilted = np.array(branch["tilted"])
    axis.plot(tilted[:, 0], np.abs(tilted[:, 1]), "k-", lw=1.6)
    axis.plot([branch["flat"], LAST], [0, 0], "k-", lw=1.6)
    for case, found in swept.items():
        for way, style in (("forth", "-"), ("back", "--")):
            rows = np.array(found[way])
            if rows.size:
                label = f"{case.energy}, {way}"
                axis.plot(rows[:, 0], np.abs(rows[:, 1]), style, color=COLOURS[case.energy], lw=1.2, label=label)
    whole = np.array(branch["arch"])
    for energy, ratio, colour in (("wunderlich", 0.0, "tab:red"), ("finite", 50.0, "tab:blue"), ("shell", 50.0, "k")):
        at = limits[energy, 20.0, ratio]
        if at.settles:
            height = float(np.interp(at.value, whole[:, 0], np.abs(whole[:, 1])))
            axis.errorbar([at.value], [height], xerr=[at.error], fmt="v", color=colour, mec="k", ms=8,
                          label=f"{energy}: arch lost")  # fmt: skip
    axis.set(title="w/l = 1/20", xlabel="shift Delta W / l", ylabel="H / l", xlim=(0.0, LAST))
    axis.grid(True, lw=0.3, alpha=0.6)
    axis.legend(fontsize=9, loc="lower left")
    fig.savefig(path, dpi=90, metadata={"Software": None})
    plt.close(fig)


def shots_figure(path: Path, swept: Swept) -> None:
    """Figure 7.5: Wunderlich's strip at the thesis's shifts, and the centreline of `finite`, mirrored where need be."""
    strip, other = (next(found for case, found in swept.items() if case.energy == energy) for energy in COLOURS)
    fig = plt.figure(figsize=(15, 3.4), layout="constrained")
    for k, shot in enumerate(SHOTS):
        axis: Any = fig.add_subplot(1, len(SHOTS), k + 1, projection="3d")
        left, centre, right = (np.array(line) for line in strip["shots"][f"{shot:g}"])
        x, y, z = (np.stack([left[:, j], right[:, j]]) for j in range(3))
        axis.plot_surface(x, y, z, color=COLOURS["wunderlich"], rcount=2, ccount=101, lw=0, alpha=0.8)
        line = np.array(other["shots"][f"{shot:g}"][1])
        if np.dot(line[:, 2], centre[:, 2]) < 0:
            line[:, 2] *= -1
        axis.plot(*line.T, color=COLOURS["finite"], lw=1.5)
        axis.set_box_aspect((0.7, 0.7, 0.6))
        axis.set(xlim=(-0.1, 0.6), ylim=(-0.1, 0.6), zlim=(-0.15, 0.45), title=f"Delta W = {shot:g} l")
        axis.set_xticklabels([])
        axis.set_yticklabels([])
        axis.set_zticklabels([])
        axis.view_init(25, -60)
    fig.savefig(path, dpi=80, metadata={"Software": None})
    plt.close(fig)


def _rows(
    ladders: dict[Ladder, Rungs], shells: dict[tuple[float, float], Rungs], limits: dict[Key, Settled]
) -> list[list[str]]:
    rows = []
    for ladder, found in ladders.items():
        if ladder in EQUAL:
            continue
        case = ladder.case
        cells = [f"{_shift(rung)} ({rung['p']})" for rung in found]
        key = (case.energy, case.narrow, _ratio(case))
        rows.append([case.energy, f"1/{case.narrow:g}", f"{key[2]:g}" if key[2] else "", *cells,
                     *[""] * (3 - len(cells)), *_told(limits[key])])  # fmt: skip
    for (narrow, ratio), found in shells.items():
        cells = [f"{_shift(rung)} ({rung['mesh'][0]} x {rung['mesh'][1]})" for rung in found]
        rows.append(["shell", f"1/{narrow:g}", f"{ratio:g}", *cells, *_told(limits["shell", narrow, ratio])])
    return rows


def _shift(rung: Mapping[str, Any]) -> str:
    if rung["shift"] is None:
        return "stable"
    return f"{rung['shift']:.4f}" + ("*" if rung.get("kind") == "lost" else "")


def _told(found: Settled) -> list[str]:
    order = "" if found.order is None else f"{found.order:.1f}"
    if not found.settles:
        return ["does not settle", f"changes by {found.error:.1g}", ""]
    return [f"{found.value:.4f}", f"{found.error:.1g}", order]


def _number(value: float) -> str:
    return f"{value:.3f}" if np.isfinite(value) else "none"


def write(
    path: Path, ladders: dict[Ladder, Rungs], shells: dict[tuple[float, float], Rungs], limits: dict[Key, Settled],
    swept: Swept,
) -> None:  # fmt: skip
    """The page."""
    wunderlich, finite = limits["wunderlich", 20.0, 0.0], limits["finite", 20.0, 50.0]
    thick, thin, thinner = (limits["shell", 20.0, ratio] for ratio in (50.0, 100.0, 200.0))
    if not all(found.settles for found in (wunderlich, thick)) or wunderlich.value - wunderlich.error <= thick.value:
        raise AssertionError("a sentence of the page does not hold: Wunderlich's arch is lost after the shell's")
    if not thick.value < thin.value < thinner.value < wunderlich.value:
        raise AssertionError("a sentence of the page does not hold: the thinner the shell the later")
    open_ones = [f"{e}, w/l = 1/{n:g}" + (f", w/h = {r:g}" if r else "")
                 for (e, n, r), found in limits.items() if not found.settles]  # fmt: skip
    unsettled = f" Not settled: {'; '.join(open_ones)}." if open_ones else " All of the table settle."
    loops = []
    for case, found in swept.items():
        loop = hysteresis(dict(found))
        loops.append([
            case.energy, _number(reached(found["forth"])),
            _number(fell_back(found["back"])) if found["back"] else "none",
            f"{loop[0]:.3f} to {loop[1]:.3f}" if loop else "none", found["stopped"],
        ])  # fmt: skip
    equal = []
    for ladder in EQUAL:
        shifts = ", ".join(f"{_shift(rung)} (p = {rung['p']})" for rung in ladders[ladder])
        equal.append(f"{ladder.case.energy} {shifts}")
    page.write(
        path, "Clamps shifted sideways, every model (thesis 7.2)", "python -m tests.validation shift",
        f"The arch of w/l = 1/20 is lost at {wunderlich.text} (Wunderlich), {finite.text} (`finite`, w/h = 50) and "
        f"{thick.text}, {thin.text}, {thinner.text} (shells, w/h = 50, 100, 200).{unsettled}",
        f"nu = {POISSON:g} (the thesis gives none), no weight, clamps {ALONG:g} l apart, both edges held (ruling "
        "straight where the energy knows one). Everything over l. Pieces are kept in out/validate/shift; delete them "
        "to measure anew.",
        "## Where the arch gives way (U-US)",
        "The shift at which the lowest eigenvalue of the upright arch passes zero, on three meshes (elements in "
        "brackets; halved for ribbons, 1.5 times shorter for shells), located on each to "
        "3e-4 (shells 1e-4); limit, error and order by `compare.measure.mesh_limit`. *: the branch is no more there "
        "though its eigenvalue is not yet zero. Ribbons' elements are graded to where the curvature passes zero and to "
        "the clamps, and placed anew at every state (`ribbon.find.branch.passages`), those of `kirchhoff` "
        "are equal.",
        page.table(
            ["model", "w/l", "w/h", "coarse", "finer", "finest", "limit", "error", "order"],
            _rows(ladders, shells, limits),
        ),
        "![Lowest eigenvalue of the arch over the shift](arch.png)",
        f"**Why equal elements say something else.** On them: {'; '.join(equal)}; here before: 0.337 and 0.347 on 100. "
        "Where a twisted strip's curvature passes zero, rulings meet at an edge (eta' at its bound 2 / w), over a "
        "length of 0.2 to 0.9 w ([event](../wunderlich_event.md)); 100 equal elements have five in a width. The "
        "energy of the element with the event, of the order kappa'^2 h^3, depends on where in it the event lies, which "
        "is a stiffness of the order h against moving it; the eigenvalue falls by no more than 0.0018 for a "
        "shift of 1e-3, so that the critical shift scatters by 0.05. From a shift of about 0.34 on Wunderlich's strip "
        "has a second pair of events, 0.002 l from its clamps, where the held ruling meets a curvature that changes "
        "its sign: that one needs the shortest elements.",
        "**Thinner shells come nearer to Wunderlich's strip**: at w/l = 1/20 the arch is lost later the thinner it is, "
        "and before Wunderlich's; the distance to the shell of w/h = 50 is the shell's thickness, not an error of "
        "elements.",
        "**`finite` is lost too early, and not by its passages**: there its state is smooth on 100 elements (x = w "
        "eta' / 2 is 0.45 at most). What gives way is the layer at its clamps, 0.2 w long: held at tau = 0, x is "
        "w tau' kappa / 2 (kappa^2 + 1 / zeta^2), which is greatest at |kappa| = 1 / zeta = 3.25; H(x) makes that a "
        "ridge of the energy, and the clamp's curvature comes to it at a shift of 0.30 (x = 0.93). Beyond, its "
        "eigenvalue falls steeply. The interpolation between ruled and soft sections in (10.13) is not that of a shell "
        "whose section a clamp holds flat; 100 equal elements step over the layer and seemed right. It is not mended "
        "here: a mend has to be derived from the shell at a clamp.",
        "## Heights forth and back, w/l = 1/20",
        f"Delta W from {FIRST:g} to {LAST:g} and back in steps of {2 * STEP:g} ({STEP:g} for Wunderlich, as in the "
        "thesis), elements placed at every state, unstable states left along their unstable mode. *flat*: forth, H "
        "below 5e-3 from there on; *upright*: back, the arch again (both to a step). *hysteresis*: shifts between "
        "which H differs by more than 0.01. These depend on steps and elements and have no error: the folds of the "
        "tilted branch were not located. Shell: branch by arc length on 60 x 6 ([page](../shell_shift.md)).",
        page.table(["model", "flat", "upright", "hysteresis", "stopped"], loops),
        "![Heights forth and back](heights.png)",
        "## Snapshots (figure 7.5)",
        "Wunderlich's strip, forth; blue: the centreline of `finite`.",
        "![The strip at the thesis's shifts](shots.png)",
        "Not measured here: strips with weight, other widths forth and back, shells above w/h = 200.",
    )  # fmt: skip
