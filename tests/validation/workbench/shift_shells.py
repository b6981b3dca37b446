"""Thesis 7.2: where shells between shifted clamps leave the arch and S, and the tilted branch between, mesh by mesh.

U and S are followed over short ranges around their branch points, begun at the rod's states; US from where it leaves U.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from compare import registry
from compare.continuation.correct import first_point
from compare.continuation.follow import follow, switched
from compare.continuation.point import Options, Point
from compare.models.base import Options as SolveOptions
from compare.models.branches.shell import branch_start
from compare.models.capabilities import BranchStart
from compare.scene.scene import Scene
from compare.studies.branches.along import Along
from compare.studies.branches.run import scene_for
from tests.validation.workbench.shift_followed import SHIFT, STEPS, Case, height

#: Shifts between which U with US, and S, are followed: from well on their stable side to beyond their branch points.
UPRIGHT, ODD = (0.28, 0.52), (0.56, 0.38)
#: Height (l) down to which US is followed: below where the ribbon's has its folds.
LOW = 0.18


@dataclass(frozen=True)
class Shell:
    """A shell of w/l = 1 / `narrow`, w/h = `ratio` on so many elements along and across."""

    narrow: float
    ratio: float
    mesh: tuple[int, int]

    @property
    def name(self) -> str:
        """For files."""
        return f"shell_{self.narrow:g}_{self.ratio:g}_{self.mesh[0]}x{self.mesh[1]}"

    def scene(self, shift: float, flat: bool) -> Scene:
        """`shift_7_2` at a shift, with the seed of the arch or of S."""
        rod = Case("kirchhoff", self.narrow, self.ratio).scene(flat)
        return rod.replace(
            {"path": None, "clamp.end.position": [0.5, shift, 0.0], "shell.elements": list(self.mesh)}
        )  # fmt: skip


def begun(shell: Shell, span: tuple[float, float], flat: bool) -> tuple[BranchStart, Point, Along]:
    """The shell at the first shift, from the rod's state there."""
    scene = shell.scene(span[0], flat)
    own, name = scene_for(scene, "kirchhoff")
    rod = registry.model(name).solve(own)
    surface = registry.model("shell")
    state = surface.solve(scene, near=rod.shape, options=SolveOptions(error=False, selects=True))
    along = Along.of(scene, SHIFT, *span)
    start = branch_start(along.scene_at, state)
    first = first_point(start.system, start.z, 0.0, Options().tolerance)
    if first is None or first.unstable:
        raise AssertionError(f"{shell.name}: no stable state to begin with at a shift of {span[0]:g}")
    if flat != (abs(height(start, first)) < 1e-5):
        raise AssertionError(f"{shell.name}: its middle is at {height(start, first):g} l")
    return start, first, along


def _line(name: str, start: BranchStart, points: tuple[Point, ...], along: Along, ended: str) -> dict[str, Any]:
    return {
        "name": name, "shift": [along.value(p.t) for p in points], "height": [height(start, p) for p in points],
        "unstable": [p.unstable for p in points], "ended": ended, "elements": 0,
    }  # fmt: skip


def flat_lost(shell: Shell, span: tuple[float, float] = ODD) -> dict[str, Any]:
    """S from its stable side on: "lost" (the first shift at which an eigenvalue passes zero, None: it does not),
    "line"."""
    start, first, along = begun(shell, span, True)
    run = follow(first, options=Options(steps=STEPS), on_point=lambda p: not p.unstable)
    lost = [along.value(s.point.t) for s in run.specials if s.kind == "branch_point"]
    print(f"  {shell.name}: S lost at {lost}, {run.ended}", flush=True)
    return {"lost": lost[0] if lost else None, "lines": [_line("S", start, run.points, along, run.ended)]}


def arch_lost(shell: Shell, tilted: int = STEPS, span: tuple[float, float] = UPRIGHT) -> dict[str, Any]:
    """U to where an eigenvalue passes zero ("lost"), and so many points of US from there ("folds": shift, height), at
    the most until it is down at `LOW`."""
    start, first, along = begun(shell, span, False)
    run = follow(first, options=Options(steps=STEPS), on_point=lambda p: not p.unstable)
    forks = [s for s in run.specials if s.kind == "branch_point"]
    told: dict[str, Any] = {
        "lost": along.value(forks[0].point.t) if forks else None, "folds": [],
        "lines": [_line("U", start, run.points, along, run.ended)],
    }  # fmt: skip
    print(f"  {shell.name}: U lost at {told['lost']}, {run.ended}", flush=True)
    for leaving in switched(forks[0])[:1] if forks and tilted else ():
        us = follow(leaving, options=Options(steps=tilted), on_point=lambda p: height(start, p) > LOW)
        told["folds"] = [
            [along.value(s.point.t), height(start, s.point)] for s in us.specials if s.kind == "fold"
        ]  # fmt: skip
        told["lines"].append(_line("US", start, us.points, along, us.ended))
        print(f"  {shell.name}: US {len(us.points)} points, {us.ended}, folds {told['folds']}", flush=True)
    return told
