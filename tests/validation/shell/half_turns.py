"""Bands of two to nine half turns: ribbons and shells of as many folds, their energies, ways down and distances."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from compare.measure.align import aligned, both
from compare.measure.distance import grid_hausdorff
from compare.measure.grid import Grid
from compare.models import solve
from compare.models.base import Options, State
from compare.models.half_turns import CROSSING, nearest
from compare.scene.scene import Scene, loads
from ribbon import Closure, Strip, refine
from ribbon import solve as solve_ribbon
from ribbon.result import Equilibrium, Status
from tests.validation import page
from tests.validation.number import Number

#: Half turns, w / l and w/h of the shells; segments of a ribbon, and elements of a shell, for each half turn.
TURNS, SHELLS, WIDTH, RATIOS = (2, 3, 4, 5, 6, 7, 8, 9), (2, 3, 4, 5, 6, 7, 8), 0.02, (25.0, 50.0)
SEGMENTS, ALONG, ACROSS = 40, 16, 6
#: Half turns of which the widest band is looked for.
WIDEST = (9,)
#: Energies of the ribbon without a thickness, and one with.
ENERGIES, RICHER = ("sadowsky", "wunderlich", "kirchhoff"), "extensible"
#: To what the widest band of n folds is looked for in n w / l, and between what.
STEP, FIRST, MOST = 0.01, 0.3, 0.5


def closure(n: int) -> Closure:
    """Of n half turns."""
    return Closure("moebius" if n % 2 else "circle", half_turns=n)


@cache
def ribbon(n: int, energy: str, segments: int, width: float = WIDTH) -> Equilibrium:
    """A free band, nu = 0.3, of the thickest shell's thickness, which the energies with a free twist know."""
    strip = Strip(1.0, width, 0.3, thickness=width / RATIOS[0])
    return solve_ribbon(strip, closure=closure(n), energy=energy, segments=segments * n)


def scene(n: int, ratio: float, energy: str = "wunderlich") -> Scene:
    """The same as a scene, with its shell."""
    return loads(
        f'title = "Band"\n[strip]\nlength = 1.0\nwidth = {WIDTH}\npoisson = 0.3\n'
        f'[closure]\nkind = "{closure(n).kind}"\nhalf_turns = {n}\n'
        f'[model]\nenergy = "{energy}"\nelements = {SEGMENTS * n}\n'
        f"[shell]\nwidth_to_thickness = [{ratio:g}]\nelements = [{ALONG * n}, {ACROSS}]\ngrading = [1.0, 0.3]\n"
    )


def shell(n: int, ratio: float) -> State:
    """By its own path, with its error."""
    return solve(scene(n, ratio), "shell", options=Options(error=True, selects=False))


def distance(n: int, ratio: float, there: State, energy: str) -> float | None:
    """From the ribbon of an energy to the shell (Hausdorff / l), as motions and sliding allow."""
    own = scene(n, ratio, energy)
    beside = solve(own, "ribbon", options=Options(repeats=0))
    if beside.shape is None or there.shape is None or not (beside.stands and there.stands):
        return None
    grid = Grid.for_shape(own, max(beside.shape.bend, there.shape.bend))
    points = grid.of(there.shape)
    return grid_hausdorff(aligned(grid.of(beside.shape), points, both(beside.motions, there.motions)), points)


@cache
def widest(n: int) -> float:
    """The largest n w / l, to `STEP`, at which a band of n folds is found (Wunderlich), by halving."""
    low, high = FIRST, MOST
    while high - low > STEP:
        middle = 0.5 * (low + high)
        state = ribbon(n, "wunderlich", SEGMENTS, middle / n)
        low, high = (middle, high) if state.status in (Status.CONVERGED, Status.SADDLE) else (low, middle)
    return low


def ribbons(numbers: dict[str, Number]) -> str:
    """The table of the ribbons."""
    rows = []
    for n in TURNS:
        cells = [str(n)]
        for energy in (*ENERGIES, RICHER):
            few = ribbon(n, energy, SEGMENTS)
            many = refine(few)
            if many.status not in (Status.CONVERGED, Status.SADDLE):
                cells += ["none", "-", "-"]
                continue
            if nearest(many.position(np.linspace(0.0, 1.0, 400, endpoint=False))) <= CROSSING:
                cells += [f"({many.energy.total:.3f})", "-", "-"]
                continue
            error = abs(few.energy.total - many.energy.total)
            cells += [f"{many.energy.total:.3f}", f"{error:.1e}", str(many.unstable_modes)]
            numbers[f"{energy}_{n}"] = Number(many.energy.total, error, "D w / l", ".2f")
            numbers[f"{energy}_{n}_down"] = Number(float(many.unstable_modes or 0), 0.0, "", ".0f")
        wide = f"{widest(n):.2f}" if n in WIDEST else "-"
        if n in WIDEST:
            numbers[f"widest_{n}"] = Number(widest(n), STEP, "", ".3f")
        rows.append([*cells, wide])
    heads = ["half turns"]
    for energy in (*ENERGIES, RICHER):
        heads += [energy, "error", "ways down"]
    return page.table([*heads, "largest n w/l"], rows)


def shells(numbers: dict[str, Number]) -> str:
    """The table of the shells."""
    rows = []
    for n in SHELLS:
        for ratio in RATIOS:
            state = shell(n, ratio)
            if not state.stands or state.energy is None or state.shape is None:
                rows.append([str(n), f"{ratio:g}", state.word, *["-"] * 5])
                continue
            error = (state.errors.get("energy") or {}).get("elastic")
            far = [distance(n, ratio, state, energy) for energy in ("wunderlich", RICHER)]
            energy, down = float(state.energy.elastic), int(state.native.data["negative_eigenvalues"])
            if error is not None:
                numbers[f"shell_{n}_{ratio:g}"] = Number(energy, float(error), "D w / l", ".2f")
            numbers[f"shell_{n}_{ratio:g}_down"] = Number(float(down), 0.0, "", ".0f")
            rows.append([
                str(n), f"{ratio:g}", "stable" if state.stable else "saddle", f"{energy:.3f}",
                "-" if error is None else f"{error:.1e}", str(down),
                *("-" if one is None else f"{one:.1e}" for one in far),
            ])  # fmt: skip
            print(f"  {rows[-1]}", flush=True)
    heads = ["half turns", "w/h", "state", "energy", "error", "ways down", "wunderlich far", f"{RICHER} far"]
    return page.table(heads, rows)


PROBES = {
    "wunderlich_5": lambda: refine(ribbon(5, "wunderlich", SEGMENTS)).energy.total,
    "wunderlich_5_down": lambda: float(refine(ribbon(5, "wunderlich", SEGMENTS)).unstable_modes or 0),
    "kirchhoff_9": lambda: refine(ribbon(9, "kirchhoff", SEGMENTS)).energy.total,
    "shell_4_25": lambda: float(shell(4, 25.0).energy.elastic),
}


def run(out: Path) -> dict[str, Number]:
    """results/half_turns.md."""
    numbers: dict[str, Number] = {}
    lines, surfaces = ribbons(numbers), shells(numbers)
    page.write(
        out / "half_turns.md", "Bands of two to nine half turns", "python -m tests.validation half_turns",
        f"Free bands without weight, w/l = {WIDTH}, nu = 0.3, which may pass through themselves. Each is alike about "
        "as many axes as it has half turns: one fold is minimised, the whole band is a stationary point, its half "
        "turns are counted by linking numbers and its ways down (unstable modes) by inertia. Energies in D w / l on "
        f"{2 * SEGMENTS} segments a half turn, errors: change from half as many; {RICHER}: at w/h = {RATIOS[0]:g}. "
        "largest n w/l: the widest band of n folds that Wunderlich's energy has, to "
        f"{STEP}: beyond, rulings would cross.",
        "Beyond three half turns no band of this kind is stable: what it is left for passes through itself and ends "
        "with fewer. Two half turns of a strip without thickness are the figure of eight, at any width, whose middle "
        "line crosses itself, so that they cannot be counted (in brackets); with a thickness both passages part.",
        lines, "## Shells",
        f"By their own path, {ALONG} elements along a half turn and {ACROSS} across; errors: change from half as "
        "many each way. far: distance (l) to the ribbon of "
        "that energy with the same half turns.",
        surfaces,
    )  # fmt: skip
    return numbers
