"""A strip too short to go round: between the walls of a tube it touches at two points, at three, along a line, and with
its ends each other.

J. Y. Lee, H.-Y. Lu, R.-K. Lee, Universal law of coiling for a short elastic strip contacting within a tube,
arXiv 2303.08304. One half of it is computed, whose middle is held along the tube's wall: the other half is its image.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import BarycentricInterpolator
from scipy.optimize import brentq

from ribbon import Clamp, Equilibrium, Strip, Wall, solve
from ribbon.obstacle import Obstacle
from tests.reference import short_coil
from tests.validation import page
from tests.validation.number import Number

SEGMENTS = (30, 60, 120)
#: Where the kinds are looked at, two of each.
RATIOS = (2.5, 3.0, 3.5, 4.0, 4.5, 6.0, 6.15, 6.25)
#: Lengths at which nothing but its end and its middle touches, for what comes next.
BEFORE = (3.7, 3.8, 3.9, 4.0, 4.1)
WORDS = {"two": "two points", "three": "three points", "line": "a line", "ends": "a line, its ends each other"}
CHANGES = ("its middle touches", "it lies along the wall", "its ends meet")


@cache
def held(ratio: float, segments: int, lowest: float = 1.0, met: bool = False) -> Equilibrium:
    """One half of a strip of L = `ratio` R, its middle held `lowest` R below the tube's axis; met: a plane through the
    axis keeps its end on its own side, as the other half would."""
    radius = 2.0 / ratio
    tube = Obstacle("cylinder", (0.0, 0.0, 0.0), radius, (1.0, 0.0, 0.0), inside=True)
    walls: list[Any] = [tube, *([Wall((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))] if met else [])]
    clamp = Clamp((0.0, -lowest * radius, 0.0), tangent=(0.0, 0.0, 1.0), normal=(0.0, 1.0, 0.0))
    found = solve(
        Strip(1.0, 0.05, 0.3), clamp, walls=walls, energy="sadowsky", segments=segments, seed_curvature=-1.1 / radius,
        formulation="mixed",
    )  # fmt: skip
    if not found.ok or not found.penetration < 1e-6:
        raise AssertionError(f"{ratio}: {found.message}")
    return found


def lowest(ratio: float, segments: int) -> float:
    """How far below the axis (R) the middle is where it touches nothing: no force holds it up or down."""

    def lift(at: float) -> float:
        return float(held(ratio, segments, at).start.force[1])

    return float(brentq(lift, 0.3, 1.0 - 1e-9, xtol=1e-12))


@cache
def state(ratio: float, segments: int) -> tuple[str, float, Equilibrium]:
    """Kind, how far below the axis (R) the middle is, and the half of it: the kind by what pushes.

    two: the wall would have to pull its middle down, which is so let go until nothing holds it. ends: past the other
    half without the plane, it is pushed by it. line: the tube pushes it between middle and end. three: not there."""
    found = held(ratio, segments)
    assert found.start is not None
    if found.start.force[1] < 0.0:
        at = lowest(ratio, segments)
        return "two", at, held(ratio, segments, at)
    if place(found) > np.pi:
        found = held(ratio, segments, met=True)
        if found.walls[1].pushes.sum() > 0.0:
            return "ends", 1.0, found
    return "line" if pushed_between(found) else "three", 1.0, found


def pushed_between(found: Equilibrium) -> bool:
    """Whether the tube pushes between the middle, which is held, and the end."""
    tube = found.walls[0]
    between = tube.ends[:, 0] < 1.0 - 1e-9
    return bool(tube.pushes[between].sum() > 1e-6 * tube.pushes.sum())


@cache
def half(ratio: float, segments: int) -> short_coil.Half:
    """What the elements have, as the reference tells it."""
    kind, at, found = state(ratio, segments)
    radius = 2.0 / ratio
    return short_coil.Half(
        kind, place(found), at, -float(found.start.force[2]) * radius**2, found.energy.total * radius
    )


def place(found: Equilibrium) -> float:
    """Where its end is, rad round the tube from below."""
    _, y, z = found.end.position
    return float(np.arctan2(z, -y) % (2.0 * np.pi))


def lies_from(segments: int, ratios: tuple[float, ...] = BEFORE) -> float:
    """L / R at which its middle is bent as the tube is: from lengths that the wall does not push there, by the
    polynomial through them (beyond it the elements end within the line, and tell nothing)."""
    excess = [abs(float(held(ratio, segments).omega(np.array([0.0]))[0])) * 2.0 / ratio - 1.0 for ratio in ratios]
    through = BarycentricInterpolator(ratios, excess)
    return float(brentq(through, ratios[-1], ratios[-1] + 0.2, xtol=1e-13))


@cache
def change(which: int, segments: int) -> float:
    """L / R from which on one of `CHANGES` holds."""

    if which == 1:
        return lies_from(segments)

    def off(ratio: float) -> float:
        found = held(ratio, segments)
        if which == 0:  # the wall has to hold it up
            return float(found.start.force[1])
        return place(found) - np.pi

    return float(brentq(off, *((2.6, 3.5) if which == 0 else (5.9, 6.2)), xtol=1e-10))


def known(which: int) -> float:
    """The same of the reference."""
    return (short_coil.threes(), short_coil.lines_begin()[0], short_coil.ends_meet())[which]


PROBES = {
    "middle_touches": lambda: change(0, SEGMENTS[0]),
    "lies_from": lambda: change(1, SEGMENTS[0]),
    "ends_meet": lambda: change(2, SEGMENTS[0]),
    "ends_energy": lambda: half(RATIOS[-1], SEGMENTS[0]).energy,
    "lies_from_known": lambda: known(1),
}


def apart(ratio: float, segments: int) -> tuple[float, float, float]:
    """By how much the end's place (rad), the force in the middle (B / R^2) and the energy (B / R) of a half differ."""
    own, other = half(ratio, segments), short_coil.half(ratio)
    if own.kind != other.kind:
        raise AssertionError(f"{ratio}: {own.kind}, {other.kind}")
    return abs(own.place - other.place), abs(own.middle - other.middle), abs(own.energy - other.energy)


def picture(to: Path) -> None:
    """One strip of every kind in its tube."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    shown = RATIOS[::2]
    figure = Figure(figsize=(2.4 * len(shown), 3.0), dpi=110)
    round_about = np.linspace(0.0, 2.0 * np.pi, 200)
    for k, ratio in enumerate(shown):
        axes = figure.add_subplot(1, len(shown), k + 1)
        kind, _, found = state(ratio, SEGMENTS[-1])
        line = found.position(np.linspace(0.0, 1.0, 300)) * 0.5 * ratio
        axes.plot(np.cos(round_about), np.sin(round_about), color="0.7", lw=3)
        axes.plot(np.concatenate([-line[::-1, 2], line[:, 2]]), np.concatenate([line[::-1, 1], line[:, 1]]), lw=1.6)
        axes.set(aspect="equal", title=f"L / R = {ratio:g}\n{WORDS[kind]}")
        axes.title.set_fontsize(8)
        axes.set_axis_off()
    figure.subplots_adjust(left=0.01, right=0.99, bottom=0.02, top=0.84, wspace=0.05)
    FigureCanvasAgg(figure).print_png(str(to))


def floor(off: list[float]) -> str:
    """Of where its middle touches, by how much it is off on finer and finer segments."""
    if off[-1] < off[0]:
        return "The first gets better on finer segments."
    return (
        f"The first does not get better on finer segments, but worse, to {off[-1]:.0e}: a floor of its search for a "
        "force that passes zero, which finer elements do not lessen; what sets it was not looked for."
    )


def run(out: Path) -> dict[str, Number]:
    """Writes short_coil.md and its picture; its numbers by name."""
    changes = [[change(k, p) for p in SEGMENTS] for k in range(len(CHANGES))]
    off = [[abs(one - known(k)) for one in row] for k, row in enumerate(changes)]
    rows = [
        [words, f"{known(k):.6f}", *(f"{one:.6f}" for one in changes[k]), *(f"{e:.0e}" for e in off[k])]
        for k, words in enumerate(CHANGES)
    ]
    states, worst = [], {p: np.zeros(3) for p in SEGMENTS}
    for ratio in RATIOS:
        other = short_coil.half(ratio)
        errors = {p: apart(ratio, p) for p in SEGMENTS}
        for p in SEGMENTS:
            worst[p] = np.maximum(worst[p], errors[p])
        states.append([f"{ratio:g}", WORDS[other.kind], f"{np.degrees(other.place):.3f}", f"{-other.middle:.6f}",
                       f"{2.0 * other.energy:.6f}", *(f"{e:.0e}" for e in errors[SEGMENTS[-1]])])  # fmt: skip
    through = max(state(ratio, SEGMENTS[-1])[2].penetration or 0.0 for ratio in RATIOS)
    if max(row[-1] for row in off) > 1e-3 or worst[SEGMENTS[-1]].max() > 1e-3:
        raise AssertionError(f"{off}, {worst}")
    picture(out / "short_coil.png")
    page.write(
        out / "short_coil.md", "A strip too short to go round its tube", "python -m tests.validation short_coil",
        "A strip of length L across a tube of radius R, 2 < L / R < 2 pi, no friction: it touches at two "
        "points, at three, along a line, and at last its ends touch each other (J. Y. Lee, H.-Y. Lu, "
        "R.-K. Lee, arXiv 2303.08304). `sadowsky`, mixed model, equal segments on one half of it, whose middle is held "
        "along the wall, at the height at which nothing holds it up where it touches nothing, else on the wall; where "
        "its ends meet, a plane through the axis stands for the other half. Beside it closed forms (two points) and "
        "shooting on the elastica, which share nothing with the elements. Not asked: strips whose halves are not "
        "images of each other, to which these could give way.",
        "![one of every kind](short_coil.png)",
        "## Where one kind becomes the next",
        page.table(["L / R from which on", "known", *(f"p = {p}" for p in SEGMENTS), *(f"off, {p}" for p in SEGMENTS)],
                   rows),
        f"From the second on the free part stays as it is, an arc of {np.degrees(short_coil.lines_begin()[2]):.4f} "
        "degrees (125.2 of a long coil), pushed by "
        f"{short_coil.lines_begin()[1]:.6f} B / R^2 at its end, so that the third is the second and twice the angle "
        f"left. The second is taken from L / R = {', '.join(f'{r:g}' for r in BEFORE)}, by the polynomial through the "
        "curvatures of the middle. " + floor(off[0]),
        "## Two lengths of every kind\n\nThe kind is read from what pushes on the elements: the known one at each.",
        page.table(["L / R", "touches at", "end at, degrees", "pressed in its middle, B / R^2", "energy, B / R",
                    "off, rad", "off, force", "off, energy of a half"], states),
        f"Off: {SEGMENTS[-1]} segments beside what is known; the worst on {', '.join(map(str, SEGMENTS))}: "
        + "; ".join(
            f"{words} {', '.join(f'{worst[p][k]:.0e}' for p in SEGMENTS)}"
            for k, words in enumerate(("place", "force", "energy"))
        )
        + f". Penetration at most {through:.0e} l.",
    )  # fmt: skip
    found = {
        name: Number(row[0], max(errors[0], 1e-7), "", ".4f")
        for name, row, errors in zip(("middle_touches", "lies_from", "ends_meet"), changes, off, strict=True)
    }
    found |= {
        f"{name}_off": Number(errors[-1], 0.5 * errors[-1], "", ".0e")
        for name, errors in zip(("middle_touches", "lies_from", "ends_meet"), off, strict=True)
    }
    return found | {
        "middle_touches_known": Number(known(0), 1e-9, "", ".6f"),
        "lies_from_known": Number(known(1), 1e-8, "", ".6f"),
        "ends_meet_known": Number(known(2), 1e-8, "", ".6f"),
        "ends_energy": Number(half(RATIOS[-1], SEGMENTS[0]).energy, 1e-5, "B / R", ".5f"),
        "place_off": Number(worst[SEGMENTS[-1]][0], worst[SEGMENTS[-1]][0], "rad", ".0e"),
        "force_off": Number(worst[SEGMENTS[-1]][1], worst[SEGMENTS[-1]][1], "B / R^2", ".0e"),
        "energy_off": Number(worst[SEGMENTS[-1]][2], worst[SEGMENTS[-1]][2], "B / R", ".0e"),
    }
