"""Coils whose layers lie on each other, by the planar elastica, beside a closed form of their tension, and by a ribbon
of some width, judged in space."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import numpy as np

from ribbon import Clamp, Gravity, Strip
from ribbon.find.solve import build, solve_shape
from ribbon.result import Equilibrium
from shellref.elastica.problem import ElasticaProblem
from shellref.elastica.result import ElasticaResult
from shellref.elastica.start import natural_start, solve_along
from tests.validation import page
from tests.validation.number import Number

#: Turns, thickness (l), natural curvature (1/l), elements.
COILS = ((2.5, 0.01, 20.0, (40, 80)), (5.5, 0.003, 42.0, (110, 220)), (10.5, 0.0008, 80.0, (420,)))
#: The heavy one: turns, thickness, natural curvature, weight against stiffness, elements.
HEAVY = (15.5, 2e-4, 100.0, 1e3, 310)
#: Width (l) and Poisson's ratio of the ribbon, and how loosely it is wound, over its thickness.
WIDE, POISSON, LOOSELY = 0.05, 0.3, 1.5


def loose(problem: ElasticaProblem, turns: float, apart: float) -> ElasticaProblem:
    """The strip wound loosely: a curvature that falls along it, clear of itself."""
    mean, half = 1.0 / (2.0 * math.pi * turns), 0.75 * apart * turns
    return natural_start(problem, (1.0 / (mean - half), 1.0 / (mean + half)))


@cache
def coil(turns: float, apart: float, curved: float, elements: int, gamma: float = 0.0) -> ElasticaResult:
    """The coil let go, and then under weight."""
    light = ElasticaProblem(curvature=(curved, curved), apart=apart)
    way = [loose(light, turns, apart), light]
    if gamma:
        way.append(ElasticaProblem(curvature=(curved, curved), apart=apart, gamma=gamma))
    found = solve_along(way, elements, 3, estimate_error=False)
    if not found.stable or found.load_factor < 1.0 or not (found.through or 0.0) < 1e-6:
        raise AssertionError(f"{found.message}, {found.through}")
    return found


@cache
def ribbon(turns: float, apart: float, curved: float, segments: int, gamma: float = 0.0) -> Equilibrium:
    """The same by Wunderlich's ribbon, wound on a spiral of constant pitch and let go, stable in space."""
    rise, angle = LOOSELY * apart / (2.0 * math.pi), 2.0 * math.pi * turns
    first = (1.0 - 0.5 * rise * angle**2) / angle
    strip = Strip(1.0, WIDE, POISSON, natural_curvature=curved, gamma=gamma)
    problem = build(
        strip, Clamp((0, 0, 0), (1, 0, 0), (0, 1, 0)), gravity=Gravity((0.0, -1.0, 0.0)) if gamma else None,
        energy="wunderlich", segments=segments, apart=apart,
    )  # fmt: skip
    start = 1.0 / np.sqrt(first**2 + 2.0 * rise * np.linspace(0.0, 1.0, segments + 1))
    found = solve_shape(problem, start, np.zeros(segments + 1))
    if not found.ok or not found.stable:
        raise AssertionError(f"{found.message}: {turns} turns on {segments} segments")
    return found


def tension_off(found: ElasticaResult) -> float:
    """Median over elements of |T + theta'^2 / 2 - K^2 / 2 - T(1)|, over K^2 / 2: T by what touches alone."""
    s = 0.5 * (found.nodes[3:-4] + found.nodes[4:-3])
    force = np.zeros((len(s), 2))
    end = 0.0
    last = np.array([math.cos(found.theta[-1]), math.sin(found.theta[-1])])
    for touch in found.touches:
        force += np.where(s < touch.s, 1.0, 0.0)[:, None] * touch.force
        if touch.other is not None:
            force -= np.where(s < touch.other, 1.0, 0.0)[:, None] * touch.force
        end -= float(last @ touch.force) if touch.other == 1.0 else 0.0
    theta, step = found.angle(s), 1e-4 * float(np.diff(found.nodes).min()) * 100.0
    bent = (found.angle(s + 0.1 * step) - found.angle(s - 0.1 * step)) / (0.2 * step)
    tension = np.cos(theta) * force[:, 0] + np.sin(theta) * force[:, 1]
    half = 0.5 * float(found.problem.natural_curvature(np.array(0.5))) ** 2
    return float(np.median(np.abs(tension + 0.5 * bent**2 - half - end))) / half


def complementarity(found: ElasticaResult) -> float:
    """Largest push times gap."""
    return max(touch.push * abs(touch.gap) for touch in found.touches)


PROBES = {
    "energy": lambda: coil(*COILS[0][:3], COILS[0][3][0]).energy.total,
    "eigenvalue": lambda: float(coil(*COILS[0][:3], COILS[0][3][0]).lowest_eigenvalue),
    "ribbon": lambda: ribbon(*COILS[0][:3], COILS[0][3][0]).energy.total,
}


def run(out: Path) -> dict[str, Number]:
    rows, through, off, halved = [], 0.0, 0.0, 0.0
    for turns, apart, curved, sizes in COILS:
        states = [coil(turns, apart, curved, n) for n in sizes]
        if len(states) > 1:
            halved = max(halved, abs(states[0].energy.total / states[-1].energy.total - 1.0))
        for n, one in zip(sizes, states, strict=True):
            through, off = max(through, one.through or 0.0), max(off, tension_off(one))
            rows.append([f"{turns:g}", f"{apart:g}", f"{curved:g}", str(n), str(len(one.touches)),
                         f"{one.energy.total:.5f}", f"{one.through:.0e}", f"{complementarity(one):.0e}",
                         f"{tension_off(one):.0e}", f"{one.lowest_eigenvalue:.3f}"])  # fmt: skip
    turns, apart, curved, gamma, elements = HEAVY
    heavy = coil(turns, apart, curved, elements, gamma)
    through = max(through, heavy.through or 0.0)
    beside, ribbon_off = [], 0.0
    light = [(*given, n, 0.0) for *given, sizes in COILS for n in sizes]
    for case in (*light, (turns, apart, curved, elements, gamma)):
        one, other = ribbon(*case), coil(*case)
        off_by = one.energy.total / other.energy.total - 1.0
        ribbon_off = max(ribbon_off, abs(off_by))
        beside.append([f"{case[0]:g}", f"{case[1]:g}", f"{case[2]:g}", f"{case[4]:g}", str(case[3]),
                       f"{one.energy.total:.5f}", f"{off_by:.0e}", str(len(one.pairs) // 2), f"{one.residual:.0e}",
                       f"{one.lowest_eigenvalue:.3f}"])  # fmt: skip
    most = [one for *_, sizes in COILS for one in sizes][-1]
    ten = coil(*COILS[-1][:3], most)
    if off > 1e-2:
        raise AssertionError(f"tension {off}")
    page.write(
        out / "layers.md",
        "Coils whose layers lie on each other",
        "python -m tests.validation layers",
        "A strip of one natural curvature K (1/l), clamped at its inner end, wound loosely and let go: "
        "the planar elastica (`shellref.elastica.contact.layers`), elements of degree 3, no friction, every place "
        "that may touch as an inequality of each step. Energies in D w / l, lengths in l.",
        "## By natural curvature",
        "Penetration: anywhere, between joints too. Tension off: by pushes across a strip T + theta'^2 / 2 is the same "
        "along it, K^2 / 2 and the tension at the free end; the median over elements, over K^2 / 2, T from the pushes "
        "alone. All are stable in their plane (lowest eigenvalue).",
        page.table(["turns", "thickness", "K", "elements", "places", "energy", "penetration", "push times gap",
                    "tension off", "eigenvalue"], rows),
        f"With elements halved the energy changes by {halved:.0e} of itself at the most.",
        "## Under weight",
        f"K = {curved:g}, {turns:g} turns, thickness {apart:g}, weight against stiffness {gamma:g}, across the clamp: "
        f"{len(heavy.touches)} places push on {elements} elements, energy {heavy.energy.total:.4f}, penetration "
        f"{heavy.through:.0e}, push times gap {complementarity(heavy):.0e}, stable in its plane "
        f"({heavy.lowest_eigenvalue:.3f}).",
        "## By a ribbon, in space",
        f"Wunderlich's ribbon of width {WIDE:g} l (nu = {POISSON:g}), its middle surface as far from itself as the "
        "strip is thick (`ribbon.find.layers`): found by the curvatures in its plane, held across each ruling, and "
        "judged with all its freedom. off: its energy over the elastica's on the same number of elements, less 1; "
        "pushes: places that push; the eigenvalue is the lowest of all modes in space.",
        page.table(["turns", "thickness", "K", "weight", "segments", "energy", "off", "pushes", "residual",
                    "eigenvalue"], beside),
    )  # fmt: skip
    return {
        "touches": Number(float(len(ten.touches)), 5.0, "", ".0f"),
        "heavy_touches": Number(float(len(heavy.touches)), 5.0, "", ".0f"),
        "through": Number(through, 2e-7, "l", ".0e"),
        "tension_off": Number(off, 1e-3, "", ".0e"),
        "energy_off": Number(halved, halved, "", ".0e"),
        "ribbon_off": Number(ribbon_off, ribbon_off, "", ".0e"),
        "ribbon": Number(PROBES["ribbon"](), 1e-3, "D w / l", ".4f"),
        "eigenvalue": Number(PROBES["eigenvalue"](), 2e-2, "", ".3f"),
        "energy": Number(coil(*COILS[0][:3], COILS[0][3][0]).energy.total, 1e-3, "D w / l", ".4f"),
    }
