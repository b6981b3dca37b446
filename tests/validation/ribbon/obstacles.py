"""A strip beside round obstacles: the coil in a tube, by elements in contact and by shooting; large radii beside a
plane, and a sphere beside a cylinder.

V. Romero, T. Witten, E. Cerda, Multiple coiling of an elastic sheet in a tube, Proc. R. Soc. A 464 (2008); told in
Nature 453 (2008), 966.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

from ribbon import Clamp, Equilibrium, Gravity, Strip, Wall, solve
from ribbon.find.contacts import pushed
from ribbon.obstacle import Obstacle
from tests.validation import page
from tests.validation.number import Number

#: As published, degrees.
TOUCHDOWN, FREE_ARC = 24.1, 125.2
#: Turn (rad) from the clamp on the wall to where the strip leaves it; length of the free arc over the radius, so that
#: the whole length is their sum times the radius.
HELD = 2.0
SEGMENTS = (60, 120, 240)
HEAVY = Strip(1.0, 0.1, 0.3, gamma=20.0)
UP = (0.0, 1.0, 0.0)
RADII = (1e1, 1e2, 1e4, 1e5)
#: Turns (rad) on the wall of a strip wound in a tube, with segments.
WOUND = ((30.0, 40), (30.0, 120), (30.0, 400), (100.0, 120), (100.0, 400), (300.0, 320))


@cache
def shot() -> tuple[float, float, float]:
    """Touchdown angle and free arc (degrees), and the arc's length over the radius: the elastica ``theta'' = F_x sin
    theta - F_y cos theta`` from where it leaves the circle, along it and as curved, to a free end on the circle that is
    pushed along the circle's normal. Radius and bending stiffness are 1, and 3 unknowns (F, length) meet 3 conditions.
    """

    def end(unknowns: np.ndarray) -> np.ndarray:
        f_x, f_y, length = unknowns

        def rate(_: float, y: np.ndarray) -> list[float]:
            return [np.cos(y[2]), np.sin(y[2]), y[3], f_x * np.sin(y[2]) - f_y * np.cos(y[2])]

        return np.asarray(solve_ivp(rate, (0.0, length), [0.0, -1.0, 0.0, 1.0], rtol=1e-11, atol=1e-12).y[:, -1])

    def left(unknowns: np.ndarray) -> list[float]:
        x, y, _, curvature = end(unknowns)
        return [np.hypot(x, y) - 1.0, curvature, unknowns[0] * y - unknowns[1] * x]

    found = fsolve(left, [-1.0, -0.7, 2.1], xtol=1e-13)
    x, y, theta, _ = end(found)
    along = np.arctan2(y, x) + 0.5 * np.pi  # the circle's direction, and how far round
    return float(np.degrees(along - theta)), float(np.degrees(along)), float(found[2])


@cache
def gained() -> float:
    """By how much (D w / R) the free arc and its touchdown lower the energy of a strip that lies on the wall all along:
    ``(L - integral kappa^2) / 2`` of the arc that is shot. On it ``H = kappa^2 / 2 + F . t`` is constant, so that
    ``integral kappa^2 / 2 = H L - F . (r(L) - r(0))``; where it leaves the wall t = (1, 0), kappa = 1 and F_x = -1."""
    _, arc, length = shot()
    # at the end kappa = 0 and F is along the radius
    around = np.radians(arc)
    end = np.array([np.sin(around), -np.cos(around)])
    force = -end / end[0]
    constant = 0.5 + force[0]
    return float(0.5 * length - (constant * length - force @ (end - np.array([0.0, -1.0]))))


@cache
def wound(turn: float, segments: int) -> Equilibrium:
    """A flat strip clamped on the wall of a tube and across it, lying on it for `turn` rad but for its end."""
    radius = 1.0 / turn
    tube = Obstacle("cylinder", (0.0, 0.0, 0.0), radius, (1.0, 0.0, 0.0), inside=True)
    found = solve(
        Strip(1.0, min(0.05, 0.5 * radius), 0.3), Clamp((0.0, -radius, 0.0), normal=UP), walls=[tube],
        energy="sadowsky", segments=segments, seed_curvature=-turn,
    )  # fmt: skip
    if not found.ok or not found.penetration < 1e-6:
        raise AssertionError(f"{turn} rad on {segments}: {found.message}")
    return found


def lowered(turn: float, segments: int) -> float:
    """By how much (D w / R) its energy is lower than on the wall all along."""
    return (0.5 * turn**2 - wound(turn, segments).energy.total) / turn


def pressed(turn: float, segments: int) -> float:
    """Mean push of the wall per length, D w / R^3, from the third joint on and until 6 rad before the end."""
    found = wound(turn, segments)
    step = 1.0 / segments
    where = np.array([(s, push) for s, _, push in pushed(found.problem, found.x, found.rows, 0)])
    line = (where[:, 0] > 2.5 * step) & (where[:, 0] < 1.0 - 6.0 / turn)
    joints = np.unique(np.round(where[line, 0] / step)).size
    return float(where[line, 1].sum() / (joints * step) / turn**3)


@cache
def coiled(segments: int) -> Equilibrium:
    """A strip that begins clamped on the wall of a tube and along it, the tube round the x axis."""
    radius = 1.0 / (HELD + shot()[2])
    tube = Obstacle("cylinder", (0.0, 0.0, 0.0), radius, (1.0, 0.0, 0.0), inside=True)
    clamp = Clamp((0.0, -radius, 0.0), tangent=(0.0, 0.0, 1.0), normal=(0.0, 1.0, 0.0))
    found = solve(
        Strip(1.0, 0.05, 0.3), clamp, walls=[tube], energy="sadowsky", segments=segments, seed_curvature=-1.0 / radius,
        formulation="mixed",
    )  # fmt: skip
    if not found.ok or not found.penetration < 1e-6:
        raise AssertionError(found.message)
    return found


def pushes(found: Equilibrium) -> tuple[np.ndarray, np.ndarray]:
    """Where (rad round the tube) it pushes the strip before its end, and how much, both edges together."""
    problem = found.problem
    radius, joints = problem.walls[0].radius, np.concatenate([[0.0], np.cumsum(problem.lengths)])
    slices, own = problem.block_slices(), problem.wall_rows(0)
    where = np.repeat(joints[own.joints], 2)
    force = -found.rows[slices["wall_0"]]
    if "touch_0" in slices:
        rows = problem.touch_rows(0)
        where = np.append(where, joints[rows.segments] + rows.places(found.x))
        force = np.append(force, -found.rows[slices["touch_0"]])
    before = where < 0.9
    return where[before] / radius, force[before]


def leaves(found: Equilibrium) -> float:
    """Where (rad) the strip leaves the wall: a line load p up to there and a force F at its end have the total and the
    first moment of all pushes from 1.5 on, p as it is between 0.5 and 1.5, where nothing but the line pushes."""
    where, force = pushes(found)
    begin = 1.5
    step = found.problem.lengths[0] / found.problem.walls[0].radius
    line = (where > 0.5) & (where < begin)
    first, last = where[line].min() - 0.5 * step, where[line].max() + 0.5 * step
    p = force[line].sum() / (last - first)
    total, moment = force[where > begin].sum(), (force * where)[where > begin].sum()
    # moment = p (s^2 - a^2) / 2 + F s ,  F = total - p (s - a)
    b = total + p * last
    return float((b - np.sqrt(b * b - 2.0 * p * (moment + 0.5 * p * last * last))) / p)


def angles(found: Equilibrium) -> tuple[float, float]:
    """Touchdown angle and free arc in degrees."""
    place, tangent = np.asarray(found.end.position), np.asarray(found.end.frame)[:, 2]
    outwards = place / np.linalg.norm(place)
    across = np.cross([1.0, 0.0, 0.0], outwards)
    touchdown = np.degrees(np.arctan2(abs(tangent @ outwards), abs(tangent @ across)))
    round_about = np.arctan2(place[2], -place[1]) % (2.0 * np.pi)
    return float(touchdown), float(np.degrees(round_about - leaves(found)))


def laid(wall: Wall | Obstacle, segments: int = 40) -> Equilibrium:
    """A heavy cantilever that something stops."""
    found = solve(HEAVY, Clamp(), Gravity(UP), walls=[wall], segments=segments)
    if not found.ok:
        raise AssertionError(found.message)
    return found


@cache
def on_plane() -> float:
    """Energy on a plane 0.1 l below."""
    return laid(Wall((0.0, -0.1, 0.0), UP)).energy.total


def from_plane(radius: float, inside: bool = False) -> float:
    """By how much the energy on a cylinder of this radius in the plane's place differs, times the radius."""
    centre = -0.1 + (radius if inside else -radius)
    return radius * (
        laid(Obstacle("cylinder", (0.0, centre, 0.0), radius, (1.0, 0.0, 0.0), inside)).energy.total - on_plane()
    )


def across(kind: str) -> Equilibrium:
    """On a bar across, or on a ball below the middle of the strip."""
    axis = (1.0, 0.0, 0.0) if kind == "cylinder" else None
    return laid(Obstacle("cylinder" if axis else "sphere", (0.0, -0.2, 0.6), 0.1, axis))


PROBES = {
    "touchdown": lambda: angles(coiled(SEGMENTS[0]))[0],
    "free_arc": lambda: angles(coiled(SEGMENTS[0]))[1],
    "touchdown_shot": lambda: shot()[0],
    "plane_slope": lambda: from_plane(RADII[-1]),
    "wound_gain": lambda: lowered(*WOUND[-2]),
    "wound_push": lambda: pressed(*WOUND[1]),
}


def _wound() -> tuple[list[str], dict[str, Number]]:
    """The strip wound by many radians: parts of the page and numbers."""
    rows = [[f"{turn:g}", str(n), f"{lowered(turn, n):.5f}", f"{pressed(turn, n):.10f}",
             f"{wound(turn, n).penetration:.0e}"] for turn, n in WOUND]  # fmt: skip
    off, push_off = abs(lowered(*WOUND[-2]) - gained()), abs(pressed(*WOUND[1]) - 1.0)
    if abs(lowered(*WOUND[2]) - gained()) > 1e-4 or push_off > 1e-6:
        raise AssertionError(f"{rows}, {gained()}")
    parts = [
        "## A strip wound in a tube",
        "A flat strip many times as long as the tube is round, clamped across its axis; parts pass through each other. "
        "It lies on the wall with the push of a thrust N, N / R per length; without friction the push at the free end "
        "has no moment about the axis, so that N = D / R^2 and the push is D w / R^3 exactly. Its energy is lower than "
        f"that of a strip that lies on the wall all along by what the free arc gains, {gained():.5f} D w / R by "
        "shooting, however long it is.",
        page.table(["turn, rad", "segments", "gain, D w / R", "push, D w / R^3", "penetration / l"], rows),
    ]
    return parts, {
        "wound_gain": Number(lowered(*WOUND[-2]), max(off, 1e-6), "D w / R", ".5f"),
        "wound_gain_shot": Number(gained(), 1e-6, "D w / R", ".5f"),
        "wound_push": Number(pressed(*WOUND[1]), max(push_off, 1e-8), "D w / R^3", ".6f"),
    }


def run(out: Path) -> dict[str, Number]:
    touchdown, arc, _ = shot()
    rows, off = [], []
    for segments in SEGMENTS:
        found = coiled(segments)
        own = angles(found)
        off.append((abs(own[0] - touchdown), abs(own[1] - arc)))
        rows.append([str(segments), f"{own[0]:.4f}", f"{own[1]:.4f}", f"{off[-1][0]:.1e}", f"{off[-1][1]:.1e}",
                     f"{found.penetration:.0e}"])  # fmt: skip
    if max(off[-1]) > 0.1 or abs(touchdown - TOUCHDOWN) > 0.05 or abs(arc - FREE_ARC) > 0.05:
        raise AssertionError(f"{off}, {touchdown}, {arc}")
    slopes = {radius: (from_plane(radius), from_plane(radius, True)) for radius in RADII}
    large = [[f"{r:.0e}", *(f"{slope:.4f}" for slope in slopes[r])] for r in RADII]
    bar, ball = across("cylinder"), across("sphere")
    apart = abs(bar.energy.total - ball.energy.total)
    wound_parts, wound_numbers = _wound()
    page.write(
        out / "obstacles.md", "Round obstacles", "python -m tests.validation obstacles",
        "## The coil in a tube",
        f"A strip clamped on the inner wall of a tube and along it, {HELD:g} rad of it before the free arc; "
        "`sadowsky`, equal segments, no friction. It leaves the wall along it, comes back with its free end and "
        f"touches down at an angle. V. Romero, T. Witten and E. Cerda have {TOUCHDOWN} degrees and a free arc of "
        f"{FREE_ARC} degrees; shooting on the elastica, which shares nothing with the elements, {touchdown:.4f} and "
        f"{arc:.4f}.",
        page.table(["segments", "touchdown", "free arc", "off shooting", "off shooting", "penetration / l"], rows),
        "Angles in degrees. The free arc begins where a line load that ends in a force has the total and the first "
        "moment of all pushes of the wall, whatever their share on joints and on the place that slides.",
        *wound_parts,
        "## A large radius is a plane",
        "Energy of a heavy cantilever (Gamma = 20, 40 segments) on a cylinder less that on a plane, times the radius "
        "over l, outside and inside: it tends to a constant.",
        page.table(["R / l", "outside", "inside"], large),
        "## A ball below the middle is a bar across",
        f"The strip touches the ball between its edges at v = {ball.walls[0].ends[0, 1]:.0e} l, the bar with both; the "
        f"energies differ by {apart:.0e} D w / l, and the forces by "
        f"{np.abs(bar.walls[0].force - ball.walls[0].force).max():.0e} D w / l^2.",
    )  # fmt: skip
    first = angles(coiled(SEGMENTS[0]))
    return {
        "touchdown": Number(first[0], max(off[0][0], 1e-6), "degrees", ".2f"),
        "free_arc": Number(first[1], max(off[0][1], 1e-6), "degrees", ".2f"),
        "touchdown_fine": Number(angles(coiled(SEGMENTS[-1]))[0], max(off[-1][0], 1e-6), "degrees", ".3f"),
        "free_arc_fine": Number(angles(coiled(SEGMENTS[-1]))[1], max(off[-1][1], 1e-6), "degrees", ".3f"),
        "touchdown_shot": Number(touchdown, 1e-6, "degrees", ".4f"),
        "free_arc_shot": Number(arc, 1e-6, "degrees", ".4f"),
        **wound_numbers,
        "plane_slope": Number(slopes[RADII[-1]][0], abs(slopes[RADII[-1]][0] - slopes[RADII[-2]][0]) + 0.05, "", ".3f"),
        "bar_and_ball": Number(apart, 1e-7, "D w / l", ".0e"),
    }
