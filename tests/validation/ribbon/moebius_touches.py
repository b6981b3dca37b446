"""A wide Moebius band pushed past its contact: the distance that its surface keeps from itself grows until it touches.

The wider the band the nearer its edge comes to its own surface (E. L. Starostin and G. H. M. van der Heijden 2007,
doi:10.1038/nmat1929, have it up to flat folding). A band that keeps more than it leaves touches itself at two places,
images of each other by the half turn about the axis of the band. The energy then grows with the distance kept as all
places push,

    dE/dd = sum of the pushes

(the envelope of a minimum under gaps >= d), which holds the pushes against energies that know nothing of them.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from ribbon import Closure, Equilibrium, Strip, solve
from ribbon.find.continuation import follow
from ribbon.find.solve import build
from ribbon.judge import nearness
from ribbon.problems.mixed import MixedProblem
from tests.validation import page
from tests.validation.number import Number
from tests.validation.ribbon.ply import complementarity, depth

NU, SEGMENTS = 0.3, (60, 120, 240)
#: Widths of bands that keep nothing, the width that is pushed on, and the distances that it keeps (l).
WIDTHS, WIDE = (0.1, 0.2, 0.3, 0.4), 0.3
KEPT = (0.056, 0.06, 0.065, 0.07, 0.075, 0.08)
#: Up to where parts are looked for (l), and half the difference of distances for the derivative of the energy.
_FAR, _STEP = 0.2, 2.5e-4


def _strip(width: float) -> Strip:
    return Strip(1.0, width, NU, thickness=1e-3)


def problem(kept: float, segments: int) -> MixedProblem:
    """The band of `WIDE` whose parts keep `kept` (l)."""
    found = build(_strip(WIDE), closure=Closure("moebius", "straight"), segments=segments, apart=kept)
    assert isinstance(found, MixedProblem)
    return found


@cache
def free(width: float, segments: int) -> Equilibrium:
    """A band that keeps less than it leaves."""
    closure = Closure("moebius", "straight")
    found = solve(_strip(width), closure=closure, segments=segments, apart=1e-3)
    if not found.ok or pushes(found):
        raise AssertionError(f"{width}: {found.message}")
    return found


@cache
def left(width: float, segments: int) -> float:
    """The least distance (l) of its surface from itself: places that face each other."""
    found = free(width, segments)
    assert isinstance(found.problem, MixedProblem)
    return min(gap for gap, _ in nearness.minima(found.problem, found.x, _FAR)) + 1e-3


@cache
def touching(kept: float, segments: int) -> Equilibrium:
    """The band that keeps `kept`, followed from the one before of `KEPT`."""
    before = [one for one in KEPT if one < kept - 1e-12]
    begin = touching(before[-1], segments) if before else free(WIDE, segments)
    near = before[-1] if before else 0.99 * left(WIDE, segments)
    found = follow(lambda t: problem(near + (kept - near) * t, segments), begin, first=0.5)
    if not (found.ok and found.stable) or depth(found) > 1e-6:
        raise AssertionError(f"{kept}, {segments}: {found.message}")
    return found


def pushes(found: Equilibrium) -> list[tuple[float, float, float]]:
    """Of each place where it touches: abscissae (l) and push (D w / l^2)."""
    assert isinstance(found.problem, MixedProblem)
    if not found.problem.pairs:
        return []
    rows = -found.rows[found.problem.block_slices()["pairs"]]
    return [(pair.s, pair.s_other, float(push)) for pair, push in zip(found.problem.pairs, rows, strict=True)]


def pushed(kept: float, segments: int) -> float:
    """All its pushes together, D w / l^2."""
    return sum(push for _, _, push in pushes(touching(kept, segments)))


@cache
def rise(kept: float, segments: int) -> float:
    """dE/dd by two energies, D w / l^2."""

    def beside(at: float) -> float:
        found = follow(lambda t: problem(kept + (at - kept) * t, segments), touching(kept, segments), first=1.0)
        if not found.ok:
            raise AssertionError(f"{at}: {found.message}")
        return found.energy.total

    return (beside(kept + _STEP) - beside(kept - _STEP)) / (2.0 * _STEP)


PROBES = {
    "left_03": lambda: left(WIDE, SEGMENTS[0]),
    "left_04": lambda: left(0.4, SEGMENTS[0]),
    "push_first": lambda: pushed(KEPT[1], SEGMENTS[0]),
}


def picture(to: Path) -> None:
    """The band free and pushed, with its places, and its energy and pushes over the distance."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 3.8), dpi=110)
    bands = [("free", free(WIDE, SEGMENTS[1])), (f"d = {KEPT[-1]:g} l", touching(KEPT[-1], SEGMENTS[1]))]
    for k, (title, found) in enumerate(bands):
        axes = figure.add_subplot(1, 3, k + 1, projection="3d")
        grid = found.surface(240, 12).grid
        axes.plot_surface(*np.moveaxis(grid, 2, 0), rcount=240, ccount=13, color="0.85", alpha=0.6, linewidth=0)
        for edge in (grid[:, 0], grid[:, -1]):
            axes.plot(*edge.T, color="C0", lw=1.0)
        made = found.problem
        assert isinstance(made, MixedProblem)
        for pair in made.pairs if k else ():
            ends = nearness.shape(made, found.x, np.array([pair.s, pair.s_other]))
            axes.plot(*(ends.r + np.array([[pair.u], [pair.u_other]]) * ends.ruling).T, color="C3", lw=2.0)
        axes.set_aspect("equal", adjustable="datalim")
        axes.set_title(title, y=0.92)
        axes.view_init(elev=25, azim=-120)
        axes.set_axis_off()
    axes = figure.add_subplot(1, 3, 3)
    segments = SEGMENTS[1]
    axes.plot(KEPT, [touching(d, segments).energy.total for d in KEPT], "o-", label="energy, D w / l")
    axes.plot(KEPT, [pushed(d, segments) for d in KEPT], "s-", label="pushes, D w / l$^2$")
    axes.axvline(left(WIDE, segments), color="0.6", lw=0.8)
    axes.set_xlabel("distance kept, l")
    axes.legend()
    figure.tight_layout()
    FigureCanvasAgg(figure).print_png(str(to))


def _least(segments: int) -> list[list[str]]:
    """Rows of the distances kept, on some segments."""
    rows = []
    for kept in KEPT:
        found = touching(kept, segments)
        places = pushes(found)
        rows.append([
            f"{kept:g}", "; ".join(f"{a:.4f}, {b:.4f}" for a, b, _ in places), f"{pushed(kept, segments):.3f}",
            f"{rise(kept, segments):.3f}", f"{found.energy.total:.4f}", f"{found.lowest_eigenvalue:.4f}",
            f"{depth(found):.0e}", f"{complementarity(found):.0e}",
        ])  # fmt: skip
    return rows


def _settled(values: list[float]) -> tuple[float, str]:
    """What the last halving changed, and how."""
    first, last = abs(values[1] - values[0]), abs(values[2] - values[1])
    return last, f"{last:.0e}" + (f" (order {np.log2(first / last):.1f})" if 0.0 < last < 0.8 * first else "")


def run(out: Path) -> dict[str, Number]:
    """Writes moebius_touches.md and its picture; its numbers by name."""
    bands = {width: [left(width, p) for p in SEGMENTS] for width in WIDTHS}
    fine = SEGMENTS[1]
    at = KEPT[3]
    settling = {
        "energy, D w / l": [touching(at, p).energy.total for p in SEGMENTS],
        "pushes, D w / l^2": [pushed(at, p) for p in SEGMENTS],
        "lowest eigenvalue": [touching(at, p).lowest_eigenvalue for p in SEGMENTS],
    }
    off = max(abs(rise(kept, fine) / pushed(kept, fine) - 1.0) for kept in KEPT[1:])
    uneven = max(abs(np.ptp([push for *_, push in pushes(touching(kept, fine))])) for kept in KEPT)
    uneven /= pushed(KEPT[-1], fine)
    if off > 5e-3 or uneven > 1e-3:
        raise AssertionError(f"dE/dd and pushes differ by {off}, the two places by {uneven}")
    picture(out / "moebius_touches.png")
    heads = ["d", "s, s' of the places", "pushes", "dE/dd", "energy", "lowest eigenvalue", "penetration",
             "push times gap"]  # fmt: skip
    page.write(
        out / "moebius_touches.md", "A wide Moebius band pushed past its contact",
        "python -m tests.validation moebius_touches",
        f"Free Moebius bands of length 1, nu = {NU:g}, no weight, ruling straight at the seam (`wunderlich`, "
        f"{', '.join(map(str, SEGMENTS))} segments). Lengths in l, energies in D w / l, forces in D w / l^2.",
        "![free, pushed, energy and pushes](moebius_touches.png)",
        "## What a free band leaves\n\nThe least distance of the surface from itself, between an edge and the surface "
        "beside the other edge: what a band of that width may be thick before it touches itself.",
        page.table(["w / l", *(f"p = {p}" for p in SEGMENTS), "changed by the last halving"],
                   [[f"{width:g}", *(f"{one:.6f}" for one in row), _settled(row)[1]] for width, row in bands.items()]),
        f"## Pushed past it\n\nThe band of w / l = {WIDE:g} keeps more and more, d, on {fine} segments. It touches at "
        "two places, images of each other by the half turn about its axis. Without contact its energy is "
        f"{free(WIDE, fine).energy.total:.4f}. dE/dd: by energies at d +- "
        f"{_STEP:g}, which do not know the pushes; under gaps of at least d it is their sum.",
        page.table(heads, _least(fine)),
        f"dE/dd is within {off:.0e} of the pushes from d = {KEPT[1]:g} on, and the two places push alike to "
        f"{uneven:.0e} of all. At d = {at:g}, over segments halved:",
        page.table(["what", *(f"p = {p}" for p in SEGMENTS), "changed by the last halving"],
                   [[what, *(f"{one:.5f}" for one in row), _settled(row)[1]] for what, row in settling.items()]),
        "Not here: a band so thick that it "
        "touches along its edges; a shell.",
    )  # fmt: skip
    found = {}
    for name, width in (("left_03", WIDE), ("left_04", 0.4)):
        row = bands[width]
        found[name] = Number(row[-1], max(abs(row[-1] - row[0]), 1e-6), "l", ".4f")
    first = [pushed(KEPT[1], p) for p in SEGMENTS]
    return found | {
        "push_first": Number(first[1], max(np.ptp(first), 1e-3), "D w / l^2", ".2f"),
        "push_last": Number(pushed(KEPT[-1], fine), _settled(settling["pushes, D w / l^2"])[0], "D w / l^2", ".1f"),
        "energy_free": Number(free(WIDE, fine).energy.total, abs(free(WIDE, fine).energy.total
                              - free(WIDE, SEGMENTS[2]).energy.total), "D w / l", ".3f"),
        "energy_last": Number(touching(KEPT[-1], fine).energy.total, _settled(settling["energy, D w / l"])[0],
                              "D w / l", ".3f"),
        "rise_off": Number(off, off, "", ".0e"),
        "uneven": Number(uneven, uneven, "", ".0e"),
    }  # fmt: skip
