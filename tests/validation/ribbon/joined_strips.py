"""Strips that are joined and strips that press each other, beside the uncut strip and beside shooting."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from ribbon import Gravity, Strip, solve
from ribbon.energies import names
from ribbon.find.strips import solve as strips
from ribbon.find.strips.result import StripsEquilibrium
from tests.reference.joined_rods import Bigon, bigon_of_rods, facing, stiffnesses
from tests.ribbon.strips.strips_scenes import OBLIQUE, SECTION, UP, bigon, chain, cut, ring
from tests.ribbon.strips.test_strips_touch import APART, cantilevers, on_high
from tests.validation import page
from tests.validation.number import Number, rounding

#: Energies of the cut strip; weight and curl; parts.
ENERGIES = ("wunderlich", "sadowsky", *names.FREE)
GAMMA, CURL, PARTS = 30.0, 2.0, (2, 3)
#: Angle of the bigon beside shooting, its segments; angles of the table.
ANGLE, SEGMENTS, ANGLES = 40.0, (8, 16, 32), (10.0, 20.0, 30.0, 40.0, 60.0)
#: The facing cantilevers: clamp to tip, gap, weight, segments.
OVER, GAP, WEIGHT, PRESSED = 0.85, 0.005, 3.0, (8, 16, 32)
S = np.linspace(0.0, 1.0, 101)
#: Bigons of a ring; their angles; turns of its starts.
CELLS, RINGS, TURNS = 6, (50.0, 60.0, 70.0), (1, 3)


def checked(found: StripsEquilibrium) -> StripsEquilibrium:
    if not found.ok:
        raise AssertionError(found.message)
    return found


@cache
def apart_from_uncut(energy: str, parts: int) -> tuple[float, float]:
    """Relative difference of the energy, and the largest distance (l), of a cut strip to the uncut one."""
    strip = Strip(length=1.0, natural_curvature=CURL, gamma=GAMMA, **SECTION)
    one = solve(strip, OBLIQUE, UP, energy=energy, segments=12, formulation="mixed")
    found = checked(strips.solve(cut(parts, 12, GAMMA, CURL), chain(parts), UP, energy))
    places = [found.positions(k, S) / parts - one.position((k + S) / parts) for k in range(parts)]
    return abs(found.energy.total * parts / one.energy.total - 1.0), float(np.abs(places).max())


@cache
def arched(degrees: float, segments: int, energy: str = "kirchhoff") -> StripsEquilibrium:
    """A bigon of two strips, w / l = 0.05, h / w = 0.2."""
    members, joints = bigon(degrees, 1, (1.0, 1.0))
    return checked(strips.solve([replace(one, segments=segments) for one in members], joints, energy=energy))


@cache
def shot(degrees: float = ANGLE) -> Bigon:
    """The same of rods by shooting in space."""
    return bigon_of_rods(degrees, *stiffnesses(0.05, 0.01, 0.4), arched(degrees, SEGMENTS[0]).joints[0].moment)


def off(segments: int) -> float:
    """Relative difference of the bigon's energy to shooting."""
    return abs(0.5 * arched(ANGLE, segments).energy.total / shot().energy - 1.0)


@cache
def rings(degrees: float, turns: int) -> StripsEquilibrium:
    """Six bigons in a ring, begun as so many turns."""
    return checked(strips.solve(*ring(CELLS, degrees, turns), energy="kirchhoff"))


@cache
def pressed(segments: int) -> StripsEquilibrium:
    """Two cantilevers that face each other, the tip of the heavy one on the other."""
    members = cantilevers(OVER, GAP, WEIGHT, segments, opposite=True)
    return checked(strips.solve(members, (), Gravity((0.0, 0.0, 1.0)), "kirchhoff", APART))


@cache
def force() -> float:
    """What they exert on each other, by shooting."""
    return float(facing(2 * OVER, GAP, APART, WEIGHT, [0.8, 0.71, -0.6, -0.7, -0.2])[0])


def push(segments: int) -> float:
    """The same by elements."""
    return float(np.linalg.norm(on_high(pressed(segments))))


def unclamped() -> float:
    """Largest force (D w / l^2) of a bigon's joint that nothing but the bigon loads."""
    return max(float(np.abs(joint.force).max()) for joint in arched(ANGLE, SEGMENTS[-1]).joints)


PROBES = {
    "bigon_energy": lambda: 0.5 * arched(ANGLE, SEGMENTS[-1]).energy.total,
    "bigon_shot": lambda: shot().energy,
    "push_shot": force,
    "push": lambda: push(PRESSED[0]),
}


def run(out: Path) -> dict[str, Number]:
    cuts = {(energy, parts): apart_from_uncut(energy, parts) for energy in ENERGIES for parts in PARTS}
    worst = max(max(pair) for pair in cuts.values())
    errors, misses = [off(n) for n in SEGMENTS], [abs(push(n) / force() - 1.0) for n in PRESSED]
    if worst > 1e-8 or errors[-1] > 1e-5 or misses[-1] > 1e-3:
        raise AssertionError(f"{worst}, {errors}, {misses}")
    order = math.log2(errors[0] / errors[1])
    arches = []
    for degrees in ANGLES:
        one, other = arched(degrees, 16), arched(degrees, 16, "wunderlich")
        arches.append([f"{degrees:g}", *(f"{state.energy.total:.5f}" for state in (one, other)),
                       *(f"{abs(state.strips[0].end.position[1]):.4f}" for state in (one, other)),
                       *(f"{np.linalg.norm(state.joints[0].moment):.4f}" for state in (one, other)),
                       *(f"{state.lowest_eigenvalue:.3f}" for state in (one, other))])  # fmt: skip
    lunes = abs(rings(60.0, 3).energy.total / (6.0 * math.pi**2) - 1.0)
    table = []
    for degrees in RINGS:
        for turns in TURNS:
            state = rings(degrees, turns)
            each = [strip.energy.total for strip in state.strips]
            table.append([f"{degrees:g}", str(turns), f"{state.energy.total:.6f}", f"{min(each):.5f}, {max(each):.5f}",
                          f"{state.lowest_eigenvalue:.4f}"])  # fmt: skip
    gap = max(abs(one.gap - APART) for one in pressed(PRESSED[-1]).touching)
    page.write(
        out / "joined_strips.md",
        "Several strips",
        "python -m tests.validation joined_strips",
        "Strips joined at their ends, and strips that press each other (`ribbon.find.strips`). Lengths in l, energies "
        "in D w / l, forces in D w / l^2.",
        "## A strip cut and joined",
        f"The curled cantilever (K l = {CURL:g}, Gamma = {GAMMA:g}, its width at 45 degrees) cut into equal parts and "
        "joined so that it goes on, beside the uncut strip of as many segments: energy (part) and shape (l) differ by",
        page.table(
            ["energy", *(f"{what}, {parts} parts" for parts in PARTS for what in ("energy", "shape"))],
            [[energy, *(f"{value:.0e}" for parts in PARTS for value in cuts[energy, parts])] for energy in ENERGIES],
        ),
        "## A bigon beside shooting",
        f"Two straight strips (w / l = 0.05, h / w = 0.2) joined at both ends at {ANGLE:g} degrees in their plane: "
        "they rise out of it to either side. Rods of the same section by a shooting in space "
        f"(`tests/reference/joined_rods.py`) have the energy {shot().energy:.8f} each; `kirchhoff` is off by (part)",
        page.table(["segments of a strip", "energy of a strip", "energy off"],
                   [
                [str(n), f"{0.5 * arched(ANGLE, n).energy.total:.6f}", f"{error:.1e}"]
                for n, error in zip(SEGMENTS, errors, strict=True)
            ]),
        f"Order {order:.1f}. A joint of a free bigon exerts a moment and no force: {unclamped():.0e} at the most.",
        "Over the angle, with 16 segments a strip: energy of both strips, height of the far joint over the plane of "
        "the near one, moment of a joint, lowest eigenvalue.",
        page.table(["degrees", *(f"{what}, {name}" for what in ("energy", "height", "moment", "eigenvalue")
                                 for name in ("rod", "wunderlich"))], arches),
        "## A ring of bigons",
        f"{CELLS} bigons (w / l = 0.1, h / w = 0.2) in a ring, one strip of each going on into the next: open, and "
        "folded threefold like a band saw's blade (Yu et al., arXiv:2011.06905), which is a second stable state where "
        "the angle is large enough. Its strips are half great circles of one sphere, E = pi^2 / 2 of each: "
        f"{lunes:.0e} off. From 50 degrees on three turns it is a saddle, which is left for the open state.",
        page.table(["degrees", "turns at the start", "energy", "of its strips, least and most", "eigenvalue"], table),
        "## Two cantilevers that face each other",
        f"The tip of a heavy one (Gamma = {WEIGHT:g}) on a weightless one, centre surfaces {APART:g} apart; two planar "
        f"elasticas by shooting press each other with {force():.6f}. Two pairs of places, at both edges, by elements:",
        page.table(["segments of a strip", "force", "force off"],
                   [[str(n), f"{push(n):.6f}", f"{miss:.1e}"] for n, miss in zip(PRESSED, misses, strict=True)]),
        "The force acts at one place of a segment, inside which the moment has a corner that linear curvature has not. "
        f"The gap is met within {gap:.0e}.",
    )  # fmt: skip
    return {
        "cut": rounding(worst),
        "bigon_energy": Number(0.5 * arched(ANGLE, SEGMENTS[-1]).energy.total, errors[-1] * shot().energy + 1e-8,
                               "D w / l", ".6f"),
        "bigon_shot": Number(shot().energy, 1e-8, "D w / l", ".6f"),
        "bigon_off": Number(errors[-1], 1e-8, "", ".1e"),
        "bigon_order": Number(order, 0.3, "", ".1f"),
        "ring_open": Number(rings(60.0, 1).energy.total, 1e-2, "D w / l", ".4f"),
        "ring_folded": Number(rings(60.0, 3).energy.total, 1e-8 + abs(rings(60.0, 3).energy.total - 6.0 * math.pi**2),
                              "D w / l", ".6f"),
        "push": Number(push(PRESSED[0]), abs(push(PRESSED[0]) - force()), "D w / l^2", ".6f"),
        "push_shot": Number(force(), 1e-6, "D w / l^2", ".6f"),
        "push_off": Number(misses[-1], misses[-1], "", ".1e"),
    }  # fmt: skip
