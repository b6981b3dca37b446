"""Thesis 7.2: the middle of a strip between two clamps shifted sideways, both ways, by following its branches."""

from __future__ import annotations

import contextlib
import time
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

matplotlib.use("Agg")
from matplotlib import pyplot as plt

from shellref import Pose, ShellOptions, ShellProblem, Waypoint
from shellref.path.solve import solve
from tests.validation import page
from tests.validation.number import Number

#: It takes no times that its page rests on.
ALONE = False

WIDTH, NU = 1 / 20, 0.3
#: Above w/h = 100 creases travel along the tilted branch element by element: 40 x 4 loses it, 60 x 6 takes an hour.
RATIOS = (50.0, 67.0, 83.0, 100.0)
MESHES = ((40, 4), (60, 6))
FRAME = ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))  # t_x = e_y, t_y = e_z, t_z = e_x
FIRST, LAST = 0.01, 0.6
COARSE = 83.0  # above this w/h the coarser mesh holds the arch stable too long: its pitchfork is no estimate
#: Largest change of a kink's place, over l, from the coarser to the finer mesh.
CONVERGED = 0.01


class Reached(Exception):
    """The branch came down to H = 0."""


@dataclass
class Branches:
    """What was met on the way: (shift, H) of the arch and of the tilted branch, and the events."""

    arch: list[tuple[float, float]] = field(default_factory=list)
    tilted: list[tuple[float, float]] = field(default_factory=list)
    pitchfork: float = np.nan  # U -> US
    folds: list[float] = field(default_factory=list)  # of the tilted branch
    flat: float = np.nan  # US -> S
    seconds: float = 0.0
    iterations: int = 0

    @property
    def lowest(self) -> float:
        """Where the tilted branch is lost on the way back: its fold nearest the arch, or the pitchfork without one."""
        near = [f for f in self.folds if f < self.pitchfork]
        return min(near, default=self.pitchfork)

    @property
    def highest(self) -> float:
        """Where the tilted branch ends on the way out."""
        return max([f for f in self.folds if f > self.flat], default=self.flat)


def problem(ratio: float, mesh: tuple[int, int], width: float = WIDTH) -> ShellProblem:
    """An arc, closed to an arch between clamps half a length apart, then sheared."""
    first, last = (Pose((0.5, shift, 0.0), FRAME) for shift in (FIRST, LAST))
    return ShellProblem(
        width, width / ratio, NU, clamp_frame=FRAME, end=last, start_curvature=-2.5, elements=mesh, grading=(0.3, 0.5),
        path=(Waypoint(natural=1.0, name="release"), Waypoint(end=first, name="close")),
    )  # fmt: skip


def height(mesh: tuple[int, int], ratio: float = RATIOS[0]) -> float:
    """H (l) of the arch where it begins to be followed, at the shift `FIRST`."""
    whole = problem(ratio, mesh)
    released, closed = whole.path
    result = solve(replace(whole, end=closed.end, path=(released,)), ShellOptions(kick=False))
    return abs(float(result.section(0.5)["position"][2]))


PROBES = {
    "height_50_40x4": lambda: height(MESHES[0]),
    "height_100_40x4": lambda: height(MESHES[0], RATIOS[-1]),
}


def numbers(kept: dict[tuple[float, tuple[int, int]], Branches]) -> dict[str, Number]:
    """Kinks with their change from the coarser mesh, where there are two; the height of the arch at its beginning."""
    found = {}
    for ratio in (RATIOS[0], RATIOS[-1]):
        value = height(MESHES[0], ratio)
        found[f"height_{ratio:g}_40x4"] = Number(value, abs(height(MESHES[1], ratio) - value), "l", ".4f")
    for (ratio, mesh), b in kept.items():
        other = kept.get((ratio, MESHES[0] if mesh == MESHES[1] else MESHES[1]))
        for kind in ("pitchfork", "lowest", "flat", "highest"):
            value = getattr(b, kind)
            error = None if other is None else abs(value - getattr(other, kind))
            if np.isfinite(value) and (error is None or np.isfinite(error)):
                name = f"{kind}_{ratio:g}_{mesh[0]}x{mesh[1]}"
                found[name] = Number(value, error, "l", ".4f", "" if error is not None else "one mesh")
    return found


def follow(ratio: float, mesh: tuple[int, int], width: float = WIDTH) -> Branches:
    """The arch to its pitchfork, and the tilted branch from there to the flat S."""
    found, began = Branches(), time.perf_counter()

    def watch(event: dict[str, Any]) -> None:
        if event.get("event") != "step" or event["stage"] != "clamps":
            return
        found.iterations += event["iterations"]
        if not event["accepted"] or event["method"] not in ("load", "arc", "switch"):
            if event["accepted"] and event["method"] == "locate" and event["note"] == "bifurcation":
                found.pitchfork = shift(event["load"])
            return
        z = event["values"]["middle"][2]
        place = (shift(event["load"]), -z)
        if event["method"] == "switch" or found.tilted:
            if "limit point" in event["note"]:
                found.folds.append(shift(float(event["note"].split()[-1])))
            if found.tilted and (z > 0 or abs(z) < 1e-6):
                (a, h0), (b, h1) = found.tilted[-1], place
                found.flat = a + (b - a) * h0 / (h0 - h1)
                found.folds = [f for f in found.folds if abs(f - found.flat) > 5e-4]
                raise Reached
            found.tilted.append(place)
        else:
            found.arch.append(place)

    def shift(load: float) -> float:
        return FIRST + load * (LAST - FIRST)

    options = ShellOptions(switch=True, kick=False, arc_length="always", max_arc=0.01, max_step=0.02, max_steps=160)
    with contextlib.suppress(Reached):
        solve(problem(ratio, mesh, width), options, watch)
    found.seconds = time.perf_counter() - began
    return found


#: To what `arch_lost` locates, as a share of the way of the clamps.
LOCATED = 2e-4


def arch_lost(ratio: float, mesh: tuple[int, int], width: float = WIDTH) -> dict[str, Any]:
    """Only where the arch loses its stability, by load steps and bisection on the inertia: "shift", "located" (both
    over l), "seconds"."""
    tried: list[float] = []
    began = time.perf_counter()

    def watch(event: dict[str, Any]) -> None:
        if event.get("event") != "step" or event["stage"] != "clamps":
            return
        if event["method"] == "switch":
            raise Reached
        if event["accepted"] and event["method"] == "locate" and event["note"] == "bifurcation":
            tried.append(FIRST + event["load"] * (LAST - FIRST))

    options = ShellOptions(
        switch=True, kick=False, arc_length="auto", max_step=0.06, max_steps=160, event_tolerance=LOCATED
    )
    with contextlib.suppress(Reached):
        solve(problem(ratio, mesh, width), options, watch)
    shift = tried[-1] if tried else None
    return {"shift": shift, "located": LOCATED * (LAST - FIRST), "seconds": time.perf_counter() - began}


def run(out: Path) -> dict[str, Number]:
    rows, kept = [], {}
    worst = 0.0
    for ratio in RATIOS:
        for mesh in MESHES:
            b = kept[ratio, mesh] = follow(ratio, mesh)
            print(f"  w/h = {ratio:g}, {mesh}: {b.seconds:.0f} s", flush=True)
            change = ""
            if mesh != MESHES[0]:
                a = kept[ratio, MESHES[0]]
                gaps = [abs(a.pitchfork - b.pitchfork), abs(a.lowest - b.lowest), abs(a.flat - b.flat)]
                change = " ".join(f"{g:.0e}" for g in gaps)
                worst = max(worst, *(gaps if ratio <= COARSE else gaps[1:]))
            rows.append([
                f"{ratio:g}", f"{mesh[0]} x {mesh[1]}", f"{b.pitchfork:.4f}", f"{b.lowest:.4f}",
                f"{b.pitchfork - b.lowest:.4f}", f"{b.flat:.4f}", f"{b.highest:.4f}", str(len(b.folds)), change,
                str(b.iterations), f"{b.seconds:.0f}",
            ])  # fmt: skip
    figure(out / "shell_shift.png", kept)
    page.write(
        out / "shell_shift.md", "Clamps shifted sideways (thesis 7.2)", "python -m tests.validation shell_shift",
        "On these two meshes no kink settles by itself: *change* is what the finer one moves it by, and no bound. "
        "Where the arch is lost on three meshes, with limit, error and order, stands in [7.2](shift/README.md). "
        f"w/l = 1/20, nu = {NU:g} (the thesis gives none), weightless, both edges held, clamps l/2 apart. H: "
        "height of the "
        "strip's middle over the clamps' plane; Delta W: the shift. The arch (U) is followed by arc length from "
        "Delta W = "
        "0.01 to where its inertia changes, the tilted branch (US) from that pitchfork along the critical mode "
        "to H = 0, "
        "where it meets the flat S. Stable are the arch before the pitchfork, the tilted branch between its "
        "outer folds, "
        "and S beyond. So on the way out the middle leaves the arch at *pitchfork* and reaches S at *out*; on "
        "the way back S "
        "is left at *flat* and the strip falls back to the arch at *back*. hysteresis: pitchfork - back. All over l; "
        f"change: of pitchfork, back and flat from the coarser mesh. Located to {1e-3 * (LAST - FIRST):.0e}.",
        page.table(
            ["w/h", "mesh", "pitchfork U-US", "back US-U", "hysteresis", "flat S-US", "out US-S", "folds", "change",
             "iterations", "s"], rows,
        ),
        "![H against the shift](shell_shift.png)",
        "On 60 x 6 there is no hysteresis at the U-US kink up to w/h = 100 (shifts 0.352 to 0.357); at the US-S "
        "kink (0.484 to 0.473, falling with the thickness) flat and out still differ by up to 6e-3 and folds "
        "remain, no more than the change with the mesh: not resolved. The coarser mesh invents a hysteresis: at w/h "
        "= 83 and 100 it keeps the arch stable for too long (its pitchfork moves by 9e-3 and 3e-2 with the mesh) "
        "and makes the tilted branch fold, creases jumping from element to element. The inextensible ribbon's "
        "hysteresis (thesis, figure 7.6) is another: between two folds of the tilted branch, which thin shells have "
        "too ([branches](shift_branches.md)). Thinner shells are not followed here beyond their pitchfork.",
    )  # fmt: skip
    if not worst < CONVERGED:
        raise AssertionError(f"a kink still moves by {worst:.1e} between the meshes")
    return numbers(kept)


def figure(path: Path, kept: dict[tuple[float, tuple[int, int]], Branches]) -> None:
    """H(Delta W) of both branches for every thickness, on the finest mesh there is."""
    fig, axis = plt.subplots(figsize=(8, 5), layout="constrained")
    for k, ratio in enumerate(RATIOS):
        b = kept.get((ratio, MESHES[-1])) or kept[ratio, MESHES[0]]
        colour = f"C{k}"
        x, y = np.array(b.arch).T
        axis.plot(x, np.abs(y), "-", color=colour, lw=1)
        if b.tilted:
            x, y = np.array(b.tilted).T
            axis.plot(x, np.abs(y), "-", color=colour, lw=1.3, label=f"w/h = {ratio:g}")
        axis.plot([b.flat, LAST], [0, 0], "-", color=colour, lw=1)
        axis.plot([b.pitchfork], [np.interp(b.pitchfork, *np.array(b.arch).T)], "o", color=colour, ms=4)
    axis.set(xlabel="shift Delta W / l", ylabel="H", title="7.2: arch, tilted branch, flat S (circles: pitchfork)")
    axis.legend()
    axis.grid(True, lw=0.3, alpha=0.6)
    fig.savefig(path, dpi=110, metadata={"Software": None})
    plt.close(fig)
