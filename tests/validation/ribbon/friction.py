"""A strip that rubs: its end pressed on a floor, a strip on a slope, a fold between floor and roof pressed and let go.

The ribbon's increments (`ribbon.find.friction`) beside closed forms and beside shooting on the elastica with friction,
which shares nothing with them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

from compare.measure.friction import missed
from ribbon import Clamp, Equilibrium, Gravity, Strip, Wall, solve
from ribbon.find.continuation import StepRecord
from ribbon.find.friction.path import follow
from ribbon.find.solve import Problem, build, solve_from
from tests.validation import page
from tests.validation.number import Number

UP = (0.0, 1.0, 0.0)
#: The pressed end: slope of the clamp below the horizontal and coefficient, of an end that slides and of one that
#: sticks; how far the clamp falls (l).
SLIDES, STICKS = (30.0, 0.3), (75.0, 0.5)
FALL, STUCK_FALL = 0.25, 0.05
#: Falls (l) that are small, and segments.
SMALL = (4e-3, 2e-3, 1e-3)
SEGMENTS = (10, 20, 40)
#: The slope: coefficients.
SLOPES = (0.1, 0.3, 0.5)
#: The fold: heights of the roof where it begins and at its lowest, coefficients, increments each way.
TOP, LOW, MIDDLE = 0.189, 0.171, 0.18
MUS = (0.3, 0.15, 0.075, 0.0375)
STEPS = (6, 12, 24)
FOLD = 40
#: A strip that is dragged: height (l) of its clamp over the table, Gamma, mu, places (l) of the clamp.
HANGS, HEAVY, DRAG, WAY = 0.08, 100.0, 0.3, (0.02, -0.02)
DRAGGED = ("sadowsky", "wunderlich")


def _run(
    problem_at: Callable[[float], Problem], start: Equilibrium, steps: int, smallest: float | None = None
) -> tuple[list[Equilibrium], Equilibrium]:
    """The states along a path, the one at its beginning first, and its end."""
    states: list[Equilibrium] = [start]

    def kept(_: StepRecord, state: Equilibrium) -> None:
        states.append(state)

    return states, follow(problem_at, start, steps=steps, on_step=kept, smallest=smallest)


# -- the pressed end --------------------------------------------------------------------------------------------------


def _clamp(slope: float, height: float) -> Clamp:
    a = math.radians(slope)
    return Clamp((0.0, height, 0.0), tangent=(0.0, -math.sin(a), math.cos(a)), normal=(0.0, math.cos(a), math.sin(a)))


@cache
def pressed(slope: float, mu: float, falls: tuple[float, ...], segments: int, steps: int) -> tuple[Equilibrium, ...]:
    """States of a weightless strip whose end touches a floor, its clamp falling by `falls` in turn, `steps` each."""
    top = math.sin(math.radians(slope))
    ways = np.array([0.0, *falls])

    def at(t: float, friction: float = mu) -> Problem:
        fall = float(np.interp(t * len(falls), np.arange(len(ways)), ways))
        return build(
            Strip(1.0, 0.02), _clamp(slope, top - fall), energy="sadowsky", formulation="mixed", segments=segments,
            walls=[Wall((0.0, 1e-9, 0.0), UP, friction=friction)],
        )  # fmt: skip

    first = at(0.0, 0.0)
    flat = np.zeros(segments + 1)
    states, end = _run(at, solve_from(first, first.state(flat, flat)), steps * len(falls))
    if not end.ok:
        raise AssertionError(end.message)
    return tuple(states)


def _shot(slope: float, end: np.ndarray, curvature: float) -> np.ndarray:
    """theta, theta', z, y at s = 1 of the elastica ``theta'' = T sin theta - N cos theta`` from a clamp at the origin,
    with the force (T, N) on its end."""

    def rate(_: float, u: np.ndarray) -> list[float]:
        return [u[1], end[0] * math.sin(u[0]) - end[1] * math.cos(u[0]), math.cos(u[0]), math.sin(u[0])]

    begin = [-math.radians(slope), curvature, 0.0, 0.0]
    return solve_ivp(rate, (0.0, 1.0), begin, "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]


def _solved(residual: Callable[[np.ndarray], Sequence[float]], guess: Sequence[float]) -> np.ndarray:
    found, _, code, text = fsolve(residual, guess, xtol=1e-13, full_output=True)
    if code != 1 and np.abs(residual(found)).max() > 1e-9:
        raise AssertionError(text)
    return found


@cache
def slid(slope: float, mu: float, fall: float) -> tuple[float, float]:
    """N and place z of an end that slid outwards, the friction on it -mu N: shooting, by growing falls."""
    found = np.array([0.01, 0.01])
    for part in np.linspace(0.1, 1.0, 10):
        height = math.sin(math.radians(slope)) - part * fall - 1e-9
        found = _solved(
            lambda u, h=height: (
                (w := _shot(slope, np.array([-mu * u[1], u[1]]), u[0]))[1],
                w[3] + h,
            ),
            found,
        )
    return float(found[1]), float(_shot(slope, np.array([-mu * found[1], found[1]]), found[0])[2])


def stuck(slope: float, fall: float, z: float, guess: Sequence[float]) -> np.ndarray:
    """(theta'(0), T, N) of an end that is held at z on the floor without moment: shooting."""
    height = math.sin(math.radians(slope)) - fall - 1e-9
    return _solved(lambda u: ((w := _shot(slope, u[1:], u[0]))[1], w[2] - z, w[3] + height), guess)


def _end(state: Equilibrium) -> tuple[float, float, float]:
    """N, the friction on the strip along z, and where its end is."""
    wall = state.walls[0]
    return float(wall.force[1]), 0.0 if wall.friction is None else float(wall.friction[2]), state.end.position[2]


def small(fall: float) -> float:
    """N over the fall, of a fall that is small, less the closed form 3 / (cos a (cos a - mu sin a))."""
    slope, mu = SLIDES
    a = math.radians(slope)
    state = pressed(slope, mu, (fall,), 20, 2)[-1]
    return _end(state)[0] / fall - 3.0 / (math.cos(a) * (math.cos(a) - mu * math.sin(a)))


def lifted(segments: int, steps: int) -> tuple[float, float, float]:
    """The pressed end lifted again by 0.001 l, where it sticks: N, T of the ribbon, and the larger distance of both to
    shooting with the end held where shooting has it before."""
    slope, mu = SLIDES
    back = 1e-3
    state = pressed(slope, mu, (FALL, FALL - back), segments, steps)[-1]
    force, z = slid(slope, mu, FALL)
    begin = pressed(slope, mu, (FALL,), 20, 2)[-1]
    guess = np.array([begin.omega([0.0])[0] * -1.0, -mu * force, force])
    for part in np.linspace(0.2, 1.0, 5):
        guess = stuck(slope, FALL - part * back, z, guess)
    push, friction, _ = _end(state)
    return push, friction, max(abs(push - guess[2]), abs(friction - guess[1]))


def held(segments: int, steps: int) -> tuple[float, float, float]:
    """An end that sticks from the first: T / N of the ribbon, its distance to shooting in N over N, and how far the end
    went (l)."""
    slope, mu = STICKS
    states = pressed(slope, mu, (STUCK_FALL,), segments, steps)
    begin, state = states[1].before, states[-1]
    assert begin is not None
    (push, friction, z), (_, _, first) = _end(state), _end(begin)
    own = stuck(slope, STUCK_FALL, first, [-float(state.omega([0.0])[0]), friction, push])
    return friction / push, abs(push - own[2]) / push, z - first


# -- the slope --------------------------------------------------------------------------------------------------------


@cache
def slipped(mu: float, segments: int = 10) -> tuple[float, float]:
    """Largest angle (degrees) at which a heavy strip was found at rest on a table that nothing but friction holds it
    on, and the next one, at which none was; its weight turns from the normal by twice the angle of friction."""
    most = 2.0 * math.atan(mu)

    def at(t: float, friction: float = mu) -> Problem:
        a = most * t
        return build(
            Strip(1.0, 0.02, gamma=1.0), Clamp(None, None, None), Gravity((0.0, math.cos(a), math.sin(a))),
            walls=[Wall((0.0, 0.0, 0.0), UP, friction=friction)], energy="sadowsky", formulation="mixed",
            segments=segments,
        )  # fmt: skip

    first = at(0.0, 0.0)
    flat = np.zeros(segments + 1)
    _, end = _run(at, solve_from(first, first.state(flat, flat)), 8, smallest=2e-4)
    good = [step["t"] for step in end.log if step["accepted"]]
    return math.degrees(most * max(good)), math.degrees(most * end.log[-1]["t"])


# -- dragged ----------------------------------------------------------------------------------------------------------


@cache
def dragged(
    energy: str, segments: int, way: tuple[float, ...] = WAY, steps: int = 4
) -> tuple[tuple[Equilibrium, ...], ...]:
    """States of a heavy strip that hangs from a clamp HANGS above a table and is dragged along by it, to each of the
    places `way` (l) of the clamp, in so many increments: the one where it begins, then those on the way."""

    def at(z: float) -> Problem:
        return build(
            strip=Strip(1.0, 0.05, thickness=1e-3, gamma=HEAVY), energy=energy, gravity=Gravity(UP), segments=segments,
            clamp=Clamp((0.0, HANGS, z), (0.0, 0.0, 1.0), UP), formulation="mixed",
            walls=[Wall((0.0, 0.0, 0.0), UP, friction=DRAG)],
        )  # fmt: skip

    last = solve_from(at(0.0), at(0.0).state(*(np.zeros(segments + 1),) * 2))
    found = []
    for here, there in pairwise((0.0, *way)):
        states, last = _run(lambda t, here=here, there=there: at(here + t * (there - here)), last, steps)
        if not last.ok:
            raise AssertionError(last.message)
        found.append(tuple(states))
    return tuple(found)


def drag(energy: str, segments: int) -> tuple[float, float]:
    """Pushes of the table where the strip slides forth and back."""
    forth, back = (states[-1].walls[0].force[1] for states in dragged(energy, segments))
    return float(forth), float(back)


def shot_drag(way: float) -> tuple[float, float]:
    """Push of the table and where the strip meets it (l), of the elastica that is dragged along itself (way 1) or back
    (-1): the hanging part shot from there to the clamp, with the friction mu N of all that lies as its tension."""

    def rest(unknown: np.ndarray) -> Sequence[float]:
        where, point = unknown
        tension = -way * DRAG * (HEAVY * (1.0 - where) + point)

        def slopes(s: float, y: np.ndarray) -> list[float]:
            shear = point - HEAVY * (where - s)
            return [y[1], math.sin(y[0]) * tension - math.cos(y[0]) * shear, math.sin(y[0])]

        path = solve_ivp(slopes, (where, 0.0), [0.0, 0.0, 0.0], rtol=1e-11, atol=1e-13)
        return [path.y[0, -1], path.y[2, -1] - HANGS]

    where, point = _solved(rest, [0.45, 10.0])
    return HEAVY * (1.0 - where) + point, where


# -- the fold ---------------------------------------------------------------------------------------------------------


def _between(height: float, mu: float, segments: int) -> dict[str, object]:
    return {
        "strip": Strip(1.0, 0.05), "clamp": Clamp(ruling="free"), "end": Clamp((0.0, 0.0, 0.9), None, None),
        "walls": [Wall((0.0, -1e-6, 0.0), UP, friction=mu), Wall((0.0, height, 0.0), (0.0, -1.0, 0.0), friction=mu)],
        "segments": segments, "energy": "sadowsky", "formulation": "mixed",
    }  # fmt: skip


@cache
def looped(mu: float, steps: int, segments: int = FOLD) -> tuple[Equilibrium, ...]:
    """States of a fold whose roof comes down and goes up again, `steps` each way: clamped at one end, hinged at the
    other, 0.1 l nearer than it is long, so that its top is not in its middle."""

    def height(t: float) -> float:
        return LOW + (TOP - LOW) * abs(1.0 - 2.0 * t)

    start = solve(**_between(TOP, 0.0, segments), seed_curvature=(-8.0, 8.0, 8.0, -1.0))
    states, end = _run(lambda t: build(**_between(height(t), mu, segments)), start, 2 * steps)
    if not end.ok or any(step["jump"] or not step["accepted"] for step in end.log):
        raise AssertionError(end.message)
    return tuple(states)


def _roof(state: Equilibrium) -> float:
    return float(-state.walls[1].force[1])


def _heights(steps: int) -> np.ndarray:
    return LOW + (TOP - LOW) * np.abs(1.0 - np.arange(2 * steps + 1) / steps)


def area(mu: float, steps: int, segments: int = FOLD) -> float:
    """Work of the roof round the loop, by trapezia."""
    states = looped(mu, steps, segments)
    forces = np.array([_roof(state) for state in states])
    return float(-np.sum(0.5 * (forces[1:] + forces[:-1]) * np.diff(_heights(steps))))


def lost(mu: float, steps: int, segments: int = FOLD) -> float:
    """What friction took away round the loop."""
    return float(looped(mu, steps, segments)[-1].rubbed or 0.0)


def unbalanced(mu: float, steps: int, segments: int = FOLD) -> float:
    """Work of the roof less what the strip's energy gained and what friction took away."""
    states = looped(mu, steps, segments)
    return area(mu, steps, segments) - (states[-1].energy.total - states[0].energy.total) - lost(mu, steps, segments)


def both(mu: float, steps: int, segments: int = FOLD) -> tuple[float, float]:
    """Force on the roof half way, coming down and going up."""
    states = looped(mu, steps, segments)
    return _roof(states[steps // 2]), _roof(states[steps + steps // 2])


def law(states: Sequence[Equilibrium], mu: float) -> float:
    """By how much Coulomb's law is missed in any of the states, by `compare.measure.friction`."""
    worst = 0.0
    for state in states:
        for wall, spec in zip(state.walls, state.problem.walls, strict=True):
            rubs = [{"push": rub.push, "friction": rub.friction, "slip": rub.slip} for rub in wall.rubs]
            worst = max(worst, missed(rubs, mu, np.tile(np.asarray(spec.normal), (len(rubs), 1))).most)
    return worst


PROBES = {
    "slid_push": lambda: _end(pressed(*SLIDES, (FALL,), 20, 2)[-1])[0],
    "slid_shot": lambda: slid(*SLIDES, FALL)[0],
    "slope_03": lambda: 0.5 * sum(slipped(0.3)),
    "lost_coarse": lambda: lost(MUS[0], STEPS[0]),
}


def _pressed_table() -> tuple[list[list[str]], float]:
    push, z = slid(*SLIDES, FALL)
    rows, last = [], 0.0
    for segments in SEGMENTS:
        state = pressed(*SLIDES, (FALL,), segments, 2)[-1]
        own, friction, place = _end(state)
        last = max(abs(own - push) / push, abs(place - z))
        off = f"{abs(own - push) / push:.1e}", f"{abs(place - z):.1e}"
        rows.append([str(segments), f"{own:.8f}", f"{friction / own:.8f}", *off, f"{lifted(segments, 2)[2]:.1e}"])
    return rows, last


def run(out: Path) -> dict[str, Number]:
    push, _ = slid(*SLIDES, FALL)
    rows, off = _pressed_table()
    by_steps = [abs(_end(pressed(*SLIDES, (FALL,), 20, steps)[-1])[0] - push) / push for steps in (1, 2, 8)]
    smalls = [small(fall) for fall in SMALL]
    ratio, far, went = held(20, 10)
    if off > 1e-6 or max(by_steps) > 1e-6 or far > 1e-5:
        raise AssertionError(f"{off}, {by_steps}, {far}")
    shots = [shot_drag(1.0), shot_drag(-1.0)]
    drags = {(energy, n): drag(energy, n) for energy in DRAGGED for n in SEGMENTS}
    drag_rows = [
        [energy, str(n), *(f"{push:.4f}" for push in pushes),
         *(f"{abs(push - shot[0]) / shot[0]:.1e}" for push, shot in zip(pushes, shots, strict=True))]
        for (energy, n), pushes in drags.items()
    ]  # fmt: skip
    drag_off = max(
        abs(push - shot[0]) / shot[0]
        for energy in DRAGGED for push, shot in zip(drags[energy, SEGMENTS[-1]], shots, strict=True)
    )  # fmt: skip
    if drag_off > 1e-3:
        raise AssertionError(f"dragged: {drag_off}")
    slopes = {mu: slipped(mu) for mu in SLOPES}
    angles = [
        [f"{mu:g}", f"{math.degrees(math.atan(mu)):.4f}", f"{low:.4f}", f"{high:.4f}"]
        for mu, (low, high) in slopes.items()
    ]
    if not all(low <= math.degrees(math.atan(mu)) <= high for mu, (low, high) in slopes.items()):
        raise AssertionError(str(slopes))
    steps = STEPS[1]
    loops = []
    for mu in MUS:
        down, up = both(mu, steps)
        loops.append([f"{mu:g}", f"{down:.4f}", f"{up:.4f}", f"{lost(mu, steps):.5f}", f"{lost(mu, steps) / mu:.4f}",
                      f"{area(mu, steps):.5f}", f"{law(looped(mu, steps), mu):.0e}"])  # fmt: skip
    free = both(0.0, steps)
    by_steps_rows = [
        [str(n), *(f"{force:.5f}" for force in both(MUS[0], n)), f"{lost(MUS[0], n):.6f}", f"{area(MUS[0], n):.6f}",
         f"{unbalanced(MUS[0], n):.1e}"]
        for n in STEPS
    ]  # fmt: skip
    by_segments = [
        [str(n), *(f"{force:.5f}" for force in both(MUS[0], STEPS[0], n)), f"{lost(MUS[0], STEPS[0], n):.6f}"]
        for n in (FOLD // 2, FOLD, 2 * FOLD)
    ]
    changes = np.diff([lost(MUS[0], n) for n in STEPS])
    by_mesh = np.diff([lost(MUS[0], STEPS[0], n) for n in (FOLD // 2, FOLD, 2 * FOLD)])
    downs = [both(MUS[0], STEPS[0], n)[0] for n in (FOLD // 2, FOLD, 2 * FOLD)]
    order = math.log2(abs(changes[0] / changes[1]))
    mesh = math.log2(abs(by_mesh[0] / by_mesh[1]))
    down, up = both(MUS[0], STEPS[-1])
    lasts = lost(MUS[0], STEPS[-1])
    numbers = {
        "slid_push": Number(_end(pressed(*SLIDES, (FALL,), 20, 2)[-1])[0], 1e-6, "D w / l^2", ".5f"),
        "slid_shot": Number(push, 1e-8, "D w / l^2", ".6f"),
        "slid_off": Number(off, 10.0 * off, "", ".0e"),
        "stuck_off": Number(far, 10.0 * far, "", ".0e"),
        "drag_forth": Number(drags["sadowsky", SEGMENTS[0]][0], 1e-3, "D w / l^2", ".2f"),
        "drag_shot": Number(shots[0][0], 1e-6, "D w / l^2", ".2f"),
        "drag_shot_back": Number(shots[1][0], 1e-6, "D w / l^2", ".2f"),
        "drag_off": Number(drag_off, 10.0 * drag_off, "", ".0e"),
        "slope_03": Number(0.5 * sum(slopes[0.3]), abs(slopes[0.3][1] - slopes[0.3][0]), "degrees", ".2f"),
        "down": Number(down, abs(down - both(MUS[0], STEPS[-2])[0]) + 1e-3, "D w / l^2", ".2f"),
        "up": Number(up, abs(up - both(MUS[0], STEPS[-2])[1]) + 1e-3, "D w / l^2", ".2f"),
        "lost": Number(lasts, abs(changes[-1]) + abs(by_mesh[-1]), "D w / l", ".4f"),
        "lost_coarse": Number(lost(MUS[0], STEPS[0]), 1e-5, "D w / l", ".4f"),
        "balance": Number(abs(unbalanced(MUS[0], STEPS[-1])), abs(unbalanced(MUS[0], STEPS[-2])), "D w / l", ".0e"),
        "law": Number(law(looped(MUS[0], steps), MUS[0]), 1e-8, "", ".0e"),
        "order": Number(order, 0.3, "", ".1f"),
    }
    page.write(
        out / "friction.md", "A strip that rubs", "python -m tests.validation friction",
        "Coulomb friction along a path (theory, eq. (5.14) to (5.16)), `sadowsky`, no weight unless it is named; "
        "lengths in l, forces in D w / l^2, work in D w / l.",
        "In short: the end that slides pushes {slid_push}, by shooting {slid_shot} ({slid_off} of it off; {stuck_off} "
        "where the end sticks); a heavy strip that is dragged presses on its table by {drag_shot} forth and "
        "{drag_shot_back} back, within {drag_off} of shooting; at mu = 0.3 a strip slips off at {slope_03} degrees; "
        "a fold takes {down} down and {up} "
        "up, and {lost} is lost round the loop.".format(**numbers),
        "## An end pressed on a floor",
        f"A strip is clamped {SLIDES[0]:g} degrees below the horizontal, its free end on the floor, mu = "
        f"{SLIDES[1]:g}; the clamp falls by {FALL:g} l in two increments, and the end slides outwards. Shooting "
        f"on the elastica with "
        f"the friction mu N against the slip has N = {push:.8f}. Then the clamp is lifted by 0.001 l: the end sticks, "
        "and N and T are those of shooting with the end held where it was.",
        page.table(["segments", "N", "T / N", "N off, of it", "end off", "lifted: N, T off"], rows),
        f"In 1, 2 and 8 increments N is {', '.join(f'{one:.0e}' for one in by_steps)} of it off shooting: what "
        "slides one way does not depend on the increments. For falls d that are small N / d tends to the beam's "
        "3 / (cos a "
        f"(cos a - mu sin a)): off by {', '.join(f'{one:.1e}' for one in smalls)} at d = "
        f"{', '.join(f'{d:g}' for d in SMALL)}.",
        f"At {STICKS[0]:g} degrees and mu = {STICKS[1]:g} > cot {STICKS[0]:g} degrees the end does not slide at all: "
        f"the strip buckles between clamp and end. After a fall of {STUCK_FALL:g} l T / N = {ratio:.5f}, the end went "
        f"{abs(went):.0e} l, and N is {far:.0e} of it off shooting with the end held (20 segments).",
        "## A heavy strip dragged",
        f"A strip of Gamma = {HEAVY:g} hangs from a clamp, level and {HANGS:g} l above a table (mu = {DRAG:g}), on "
        f"which the rest lies; the clamp goes forth by {WAY[0]:g} l, the way that it points, and back to {WAY[1]:g} l, "
        "four increments each. Push of the table where the strip slides; the elastica's, shot from where it touches, "
        "with the friction of all that lies as its tension: "
        f"{shots[0][0]:.4f} forth (it touches at {shots[0][1]:.4f} l), {shots[1][0]:.4f} back ({shots[1][1]:.4f} l). "
        "What lies flat has more rows than what they hold; the least pushes that hold the same are taken.",
        page.table(["energy", "segments", "forth", "back", "forth off", "back off"], drag_rows),
        "## A strip on a slope",
        "A heavy strip (Gamma = 1) lies on a table, held by nothing else; its weight turns from the table's normal. "
        "The last angle (degrees) at which it was found at rest, and the next one, at which it was not:",
        page.table(["mu", "arctan mu", "at rest", "not at rest"], angles),
        "## A fold pressed and let go",
        f"A strip is clamped at one end and hinged at the other, 0.1 l nearer than it is long; a roof comes down on "
        f"the fold from {TOP:g} to {LOW:g} l and goes up again, {steps} increments each way, {FOLD} segments. Force on "
        f"the roof at {MIDDLE:g} l, what friction took away, over mu too, the work of the roof round the loop, "
        f"and by how "
        "much Coulomb's law is missed in any state (`compare.measure.friction`).",
        page.table(["mu", "F down", "F up", "lost", "lost / mu", "work of the roof", "law"], loops),
        f"Without friction both are {free[0]:.4f} and {free[1]:.4f}. Increments halved, mu = {MUS[0]:g}; the balance "
        "is the work of the roof less what the energy gained and friction took:",
        page.table(["increments", "F down", "F up", "lost", "work of the roof", "balance"], by_steps_rows),
        f"What is lost changes with the order {order:.1f} of the increment. Segments doubled, {STEPS[0]} increments:",
        page.table(["segments", "F down", "F up", "lost"], by_segments),
        f"What is lost changes with the order {mesh:.1f} of the segment's length; the force half way down by "
        f"{' and '.join(f'{abs(change):.2f}' for change in np.diff(downs))}.",
    )  # fmt: skip
    return numbers
