"""The strip between two clamps, one shifted sideways, forth and back (thesis 7.2): heights, kinks, snapshots."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ribbon import Clamp, Equilibrium, Gravity, Strip, solve
from ribbon.find.branch.passages import Grading
from ribbon.find.continuation import StepRecord, follow
from ribbon.find.solve import Problem, build

#: nu of the shells (`shell_shift`; the thesis gives none, and a flat developable strip does not know it).
POISSON = 0.3
#: The thesis's shifts, over l: from, to, step; the clamps' distance along.
FIRST, LAST, STEP, ALONG = 0.01, 0.61, 0.005, 0.5
#: Shifts of figure 7.5.
SHOTS = (0.01, 0.1, 0.2, 0.3, 0.4, 0.5)
#: Tilt of the middle's normal (degrees) above which the arch leans, height (over l) below which the strip lies flat.
LEANS, FLAT = 0.5, 5e-3
#: Difference of heights, forth and back, above which there is a hysteresis.
APART = 0.01


@dataclass(frozen=True)
class Case:
    """A model of a strip of width w/l = 1 / `narrow` and w/h = `ratio` between clamps that hold the whole edges;
    `segments` equal elements, or elements that `grading` places at each state of a sweep."""

    energy: str
    narrow: float = 20.0
    ratio: float = 50.0
    segments: int = 100
    gamma: float = 0.0
    step: float = 2 * STEP
    grading: Grading | None = None

    @property
    def name(self) -> str:
        """For files."""
        placed = "" if self.grading is None else f"_{self.grading.longest:g}_{self.grading.least:g}"
        return f"{self.energy}_{self.narrow:g}_{self.ratio:g}_p{self.segments}_g{self.gamma:g}_{self.step:g}{placed}"

    @property
    def held(self) -> dict[str, Any]:
        """What both clamps hold besides the frame: the ruling straight, where the energy knows one."""
        return {"ruling": "straight"} if self.energy in ("sadowsky", "wunderlich", "finite") else {}

    def arguments(self, shift: float) -> dict[str, Any]:
        """Keywords of `solve` and `build` at a shift of the end clamp."""
        width = 1.0 / self.narrow
        return {
            "strip": Strip(1.0, width, POISSON, 0.0, self.gamma, width / self.ratio),
            "clamp": Clamp((0, 0, 0), (1, 0, 0), (0, 0, 1), **self.held),
            "end": Clamp((ALONG, shift, 0), (1, 0, 0), (0, 0, 1), **self.held),
            "gravity": Gravity((0, 0, 1)) if self.gamma else None,
            "energy": self.energy,
            "segments": self.segments,
        }

    def problem(self, shift: float) -> Problem:
        """The minimisation problem at a shift."""
        return build(**self.arguments(shift))

    def arch(self) -> Equilibrium:
        """The arch at the first shift, very nearly planar."""
        found = solve(**self.arguments(FIRST), seed_curvature=[-8.0, 8.0, -8.0], seed_ruling=[1e-3, -1e-3])
        if not found.ok or found.middle.position[2] < 0:
            raise AssertionError(f"{self.name}: no arch to begin with: {found.message}")
        return found


def tilt(equilibrium: Equilibrium) -> float:
    """Angle of the middle's normal from the vertical, in degrees."""
    return float(np.degrees(np.arccos(np.clip(equilibrium.middle.frame[2, 1], -1.0, 1.0))))


def sweep(case: Case) -> dict[str, Any]:
    """Forth and back in the thesis's steps, unstable states left along their unstable mode.

    "forth", "back": rows (shift, height of the middle, tilt, lowest eigenvalue, jump); "shots": centreline and edges
    (3, k, 3) at `SHOTS`, forth. Everything over l.
    """
    kept: dict[str, Any] = {"forth": [], "back": [], "shots": {}, "stopped": ""}
    found = case.arch()
    kept["forth"].append(row(FIRST, found, False))
    kept["shots"][f"{FIRST:g}"] = strips(found)
    for name, first, last in (("forth", FIRST, LAST), ("back", LAST, FIRST)):

        def on_step(record: StepRecord, new: Equilibrium, name=name, first=first, last=last) -> None:  # type: ignore[no-untyped-def]
            shift = first + (last - first) * record.t
            kept[name].append(row(shift, new, record.jump))
            for shot in SHOTS:
                if name == "forth" and abs(shift - shot) < 1e-9:
                    kept["shots"][f"{shot:g}"] = strips(new)

        found = follow(
            lambda t, first=first, last=last: case.problem(first + (last - first) * t), found,  # type: ignore[misc]
            steps=round((LAST - FIRST) / case.step), leave_saddle=True, on_step=on_step, place=case.grading,
        )  # fmt: skip
        if not found.ok:
            kept["stopped"] += f"{name}: {found.message}; "
            if name == "forth":
                break
    return kept


def row(shift: float, equilibrium: Equilibrium, jump: bool) -> list[float]:
    return [
        shift,
        float(equilibrium.middle.position[2]),
        tilt(equilibrium),
        float(equilibrium.lowest_eigenvalue),
        float(jump),
    ]


def strips(equilibrium: Equilibrium, count: int = 101) -> list[Any]:
    """Left edge, centreline, right edge (3, count, 3)."""
    s = np.linspace(0.0, 1.0, count)
    grid = equilibrium.surface(count, 3).grid
    return [grid[:, 0].tolist(), equilibrium.position(s).tolist(), grid[:, -1].tolist()]


def hysteresis(kept: dict[str, Any]) -> tuple[float, float] | None:
    """First and last shift at which the heights forth and back differ by more than `APART`."""
    forth, back = np.array(kept["forth"]), np.array(kept["back"])
    if not len(back):
        return None
    heights = np.interp(forth[:, 0], back[::-1, 0], np.abs(back[::-1, 1]))
    apart = forth[np.abs(np.abs(forth[:, 1]) - heights) > APART, 0]
    return (float(apart.min()), float(apart.max())) if apart.size else None


def reached(rows: list[list[float]]) -> float:
    """Shift from which on the middle stays at the clamps' height (forth); nan if it never does."""
    shifts, heights = np.array(rows)[:, 0], np.abs(np.array(rows)[:, 1])
    high = np.flatnonzero(heights > FLAT)
    if not high.size or high[-1] + 1 == len(shifts):
        return float("nan")
    return float(shifts[high[-1] + 1])


def fell_back(rows: list[list[float]]) -> float:
    """Shift at which the strip is the upright arch again (back); nan if it never is."""
    upright = [r[0] for r in rows if r[2] < LEANS]
    return max(upright) if upright else float("nan")
