"""The planar elastica that touches itself or a tube, by elements in contact and by shooting.

The fold whose sides meet, the half figure of eight, the pinched ring until its poles meet (a teardrop), the coil in a
tube; and the ribbon beside it.
"""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import numpy as np

from ribbon import Clamp, Equilibrium, Strip
from ribbon.find.continuation import switch
from ribbon.find.solve import build, refine
from ribbon.find.solve import solve as solve_ribbon
from shellref.elastica.contact.barrier import Barrier
from shellref.elastica.problem import ElasticaProblem
from shellref.elastica.result import ElasticaResult
from shellref.elastica.start import natural_start, solve_along, solve_near
from tests.reference.touching_fold import Fold, folds
from tests.reference.touching_loops import eight, half_eight, pinched
from tests.validation import page
from tests.validation.number import Number
from tests.validation.ribbon.obstacles import HELD, shot

#: Distances of the fold's clamps and what its sides keep; elements of the ladder; heights of the pinched half ring.
FOLDS, APART, ELEMENTS, HEIGHTS = (0.15, 0.12, 0.1), (0.0, 0.02), (20, 40, 80), (0.4, 0.2, 0.1, 0.0)
#: Elements in the tube, and where elements alone are enough.
TUBE, USUAL = (20, 40, 80), 40
#: The ribbon's fold: distance, what is kept, segments.
RIBBON = (0.16, 0.02, (40, 80, 160))


@cache
def known(apart: float) -> list[Fold]:
    """The folds by shooting."""
    return folds(np.array(FOLDS), apart)


@cache
def folded(distance: float, apart: float, elements: int) -> ElasticaResult:
    """The fold by elements."""

    def between(z: float) -> ElasticaProblem:
        return ElasticaProblem(end=(z, 0.0), end_angle=0.0, apart=apart)

    way = [natural_start(between(0.5), (2.0, 2.0)), between(0.5), between(distance)]
    return _checked(solve_along(way, elements, 3, estimate_error=False))


@cache
def hinged(elements: int = USUAL) -> ElasticaResult:
    """A strut, hinged at both ends, that are brought together."""

    def between(z: float) -> ElasticaProblem:
        return ElasticaProblem(start_angle=None, end=(z, 0.0), apart=0.0)

    bent = natural_start(ElasticaProblem(end=(0.5, 0.0)), (2.0, 2.0))
    first = ElasticaProblem(start_angle=None, end=bent.end, curvature=(2.0, 2.0), apart=0.0)
    return solve_along([first, between(0.4), between(0.0)], elements, 3, estimate_error=False)


@cache
def half_ring(height: float, elements: int = USUAL) -> ElasticaResult:
    """Half a ring between its poles."""
    problem = ElasticaProblem(end=(0.0, height), end_angle=math.pi, apart=0.0)
    return _checked(solve_along([natural_start(problem, (math.pi, math.pi)), problem], elements, 3,
                                estimate_error=False))  # fmt: skip


@cache
def coiled(elements: int) -> ElasticaResult:
    """A strip clamped on the inner wall of a tube and along it."""
    radius = 1.0 / (HELD + shot()[2])
    problem = ElasticaProblem(barriers=(Barrier((0.0, radius), radius, -1.0),))
    return solve_along([natural_start(problem, (1.0 / radius, 1.0 / radius)), problem], elements, 3,
                       estimate_error=False)  # fmt: skip


def _checked(found: ElasticaResult) -> ElasticaResult:
    if not found.stable or found.load_factor < 1.0 or not (found.through or 0.0) < 1e-6:
        raise AssertionError(f"{found.message}, {found.through}")
    return found


def area(found: ElasticaResult) -> float:
    """Between the strip and its chord, by Gauss points on every element."""
    x, w = np.polynomial.legendre.leggauss(8)
    h = np.diff(found.nodes)[:, None]
    s = (found.nodes[:-1, None] + 0.5 * h * (x + 1.0)).ravel()
    r, theta = found.position(s), found.angle(s)
    return float((0.5 * h * w).ravel() @ (0.5 * (r[:, 0] * np.sin(theta) - r[:, 1] * np.cos(theta))))


def touchdown(found: ElasticaResult) -> float:
    """Angle (degrees) at which the end of the coil meets the tube."""
    barrier = found.problem.barriers[0]
    out = (np.array(found.end) - barrier.point) / np.linalg.norm(np.array(found.end) - barrier.point)
    theta = float(found.theta[-1])
    return float(np.degrees(np.arcsin(abs(out @ [np.cos(theta), np.sin(theta)]))))


@cache
def ribbon_fold(segments: int) -> Equilibrium:
    """The same fold of the ribbon, a surface, by its own elements and rows: segments halved from the coarsest on."""
    distance, apart, sizes = RIBBON
    if segments != sizes[0]:
        found = refine(ribbon_fold(segments // 2))
    else:
        strip, begin = Strip(1.0, 0.05, thickness=apart), Clamp((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0))
        ends = [
            Clamp((0.0, 0.0, z), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0))
            for z in (0.6, 0.5, 0.3, 0.2, 0.19, 0.18, 0.17, distance)
        ]
        how = {"energy": "sadowsky", "segments": segments, "apart": apart}
        found = solve_ribbon(strip, begin, end=ends[0], seed_curvature=(3.0, -3.0, 3.0), **how)
        for end in ends[1:]:
            found = switch(build(strip, begin, end=end, **how), found)
    if not found.ok:
        raise AssertionError(found.message)
    return found


def off(distance: float, apart: float, elements: int) -> tuple[float, float, float]:
    """Relative difference of push and energy to shooting, and of the place (l)."""
    (fold,) = [one for z, one in zip(FOLDS, known(apart), strict=True) if z == distance]
    found = folded(distance, apart, elements)
    (touch,) = found.touches
    return (
        abs(touch.push - fold.push) / fold.push, abs(found.energy.total - fold.energy) / fold.energy,
        abs(touch.s - fold.s),
    )  # fmt: skip


def beside() -> float:
    """From the shape of one mesh on another: by how much (part) the push differs; the same state."""
    own = folded(FOLDS[1], APART[1], ELEMENTS[-1])
    s = np.linspace(0.0, 1.0, 401)
    again = solve_near(own.problem, s, own.angle(s), ELEMENTS[-1], 3, estimate_error=False)
    if again is None:
        raise AssertionError("nothing beside it")
    return abs(again.touches[0].push - own.touches[0].push) / own.touches[0].push


PROBES = {
    "push": lambda: folded(FOLDS[1], APART[1], USUAL).touches[0].push,
    "push_shot": lambda: known(APART[1])[1].push,
    "teardrop_area": lambda: area(half_ring(0.0)),
    "eight_force": lambda: -hinged().forces.end[0],
    "touchdown": lambda: touchdown(coiled(TUBE[1])),
}


def run(out: Path) -> dict[str, Number]:
    rows, worst, slopes = [], 0.0, []
    for apart in APART:
        for distance, fold in zip(FOLDS, known(apart), strict=True):
            found = folded(distance, apart, ELEMENTS[-1])
            errors = [off(distance, apart, n) for n in ELEMENTS]
            slopes.append(math.log2(errors[0][0] / errors[1][0]))
            worst = max(worst, *errors[-1][:2])
            rows.append([f"{distance:g}", f"{apart:g}", f"{fold.s:.6f}", f"{fold.push:.5f}", f"{fold.energy:.6f}",
                         *(f"{e[0]:.0e}" for e in errors), f"{errors[-1][1]:.0e}", f"{found.through:.0e}"])  # fmt: skip
    rings, ring_error = [], 0.0
    for height in HEIGHTS:
        own, by = half_ring(height), pinched(height)
        differ = [abs(2.0 * own.forces.end[1] / (2.0 * by.force[1]) - 1.0), abs(area(own) / by.area - 1.0)]
        ring_error = max(ring_error, *differ)
        rings.append([f"{height / 2.0:g}", f"{8.0 * abs(by.force[1]):.6f}", f"{by.area / 2.0:.8f}",
                      *(f"{d:.0e}" for d in differ)])  # fmt: skip
    strut, half = hinged(), half_eight()
    angle, force = eight()
    eight_off = max(abs(-strut.forces.end[0] / force - 1.0), abs(area(strut) / half.area - 1.0))
    known_angle, _, _ = shot()
    tubes = [(n, coiled(n)) for n in TUBE]
    tube_rows = [[str(n), f"{touchdown(one):.4f}", f"{abs(touchdown(one) - known_angle):.1e}", str(len(one.touches)),
                  f"{one.through:.0e}"] for n, one in tubes]  # fmt: skip
    if max(worst, ring_error, eight_off) > 1e-4 or abs(touchdown(tubes[-1][1]) - known_angle) > 0.1:
        raise AssertionError(f"{worst}, {ring_error}, {eight_off}")
    distance, apart, segments = RIBBON
    other = folded(distance, apart, ELEMENTS[-1])
    ribbons = [(n, ribbon_fold(n)) for n in segments]
    pushes = [sum(float(np.linalg.norm(pair.force)) for pair in one.pairs) for _, one in ribbons]
    ribbon_rows = [[str(n), f"{push:.4f}", f"{abs(push / other.touches[0].push - 1.0):.1e}",
                    f"{max(abs(pair.s - other.touches[0].s) for pair in one.pairs):.0e}",
                    f"{abs(one.energy.total / other.energy.total - 1.0):.0e}"]
                   for (n, one), push in zip(ribbons, pushes, strict=True)]  # fmt: skip
    page.write(
        out / "self_contact_planar.md",
        "The planar elastica in contact",
        "python -m tests.validation self_contact_planar",
        "Exact unilateral conditions on places that slide (`shellref.elastica.contact`), elements of degree 3, no "
        "friction; shooting shares nothing with them. Forces in D w / l^2, energies in D w / l, lengths in l.",
        "## A fold whose sides meet, and after",
        "A strip between two parallel clamps on one line, brought together to a distance: the sides of "
        "its neck meet and "
        "push each other, the distance `apart` between centrelines (0: they touch). Elements end where it touches.",
        page.table(["clamps", "apart", "place", "push", "energy", *(f"push off, {n} elements" for n in ELEMENTS),
                    "energy off", "penetration"], rows),
        f"Order of the push, from {ELEMENTS[0]} to {ELEMENTS[1]} elements: {min(slopes):.1f} to {max(slopes):.1f}.",
        "## The half figure of eight",
        f"A strut hinged at both ends turns there by {math.degrees(angle):.4f} degrees from its chord when they meet, "
        f"under the force 4 K(m)^2 = {force:.6f} with 2 E(m) = K(m). By {USUAL} elements in contact: force and area "
        f"{eight_off:.0e} off. Both ends at one point turn about it freely: the lowest eigenvalue is "
        f"{strut.lowest_eigenvalue:.0e}, zero to rounding. Beyond, with one end past the other, the "
        f"strip would have to go "
        "through its first end: the steps end there, and no state beyond is given.",
        "## The pinched ring, until its poles meet",
        "A ring of length 1, pinched between two points: force, area, and how far elements are off "
        "(part). At distance 0 "
        "its poles meet and each half is a teardrop; more force goes from finger to finger, and the shape stays.",
        page.table(["distance of the poles", "force", "area", "force off", "area off"], rings),
        "## The coil in a tube",
        f"As [round obstacles](obstacles.md) has it for the ribbon; by shooting {known_angle:.4f} degrees.",
        page.table(["elements", "touchdown", "off shooting", "places", "penetration"], tube_rows),
        "## The ribbon beside it",
        f"The fold with the clamps {distance:g} and its sides {apart:g} apart: the ribbon (`sadowsky`, w "
        f"= 0.05, pairs at "
        f"both edges together) against {ELEMENTS[-1]} elements of the elastica (push {other.touches[0].push:.5f}).",
        page.table(["segments", "push", "push off", "place off", "energy off"], ribbon_rows),
    )  # fmt: skip
    middle, drop = folded(FOLDS[1], APART[1], USUAL), half_ring(0.0)
    return {
        "push": Number(middle.touches[0].push, middle.touches[0].push * off(FOLDS[1], APART[1], USUAL)[0] + 1e-7,
                       "D w / l^2", ".4f"),
        "push_shot": Number(known(APART[1])[1].push, 1e-6, "D w / l^2", ".4f"),
        "worst": Number(worst, 2e-8, "", ".0e"),
        "order": Number(min(slopes), 0.5, "", ".1f"),
        "teardrop_area": Number(area(drop), abs(area(drop) - pinched(0.0).area) + 1e-9, "l^2", ".6f"),
        "ring_off": Number(ring_error, 1e-9, "", ".0e"),
        "eight_force": Number(-strut.forces.end[0], abs(strut.forces.end[0] + force) + 1e-7, "D w / l^2", ".6f"),
        "eight_angle": Number(math.degrees(angle), 1e-9, "degrees", ".4f"),
        "eight_off": Number(eight_off, 1e-9, "", ".0e"),
        "touchdown": Number(touchdown(tubes[1][1]), abs(touchdown(tubes[1][1]) - known_angle) + 1e-4, "degrees", ".3f"),
        "touchdown_fine": Number(touchdown(tubes[-1][1]), abs(touchdown(tubes[-1][1]) - known_angle) + 1e-4, "degrees",
                                 ".3f"),
        "ribbon_push_off": Number(abs(pushes[-1] / other.touches[0].push - 1.0), 1e-4, "", ".0e"),
        "beside": Number(beside(), 1e-8, "", ".0e"),
    }  # fmt: skip
