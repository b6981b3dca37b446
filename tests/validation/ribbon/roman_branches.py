"""Roman's strip under a falling roof as branches (thesis, 6.2.2, figures 6.12 to 6.14): from the free arch to i = 2.3.

Places of contact are unknowns (`ribbon.find.branch.confined`), so that each event has a limit on ever finer elements.
Independent: half waves by shooting (`tests.validation.ribbon.roman`), whose curvature at the floor and force they are
held to, and elliptic integrals; the glued ribbon's minimiser; N folds alike are one fold with Gamma / N^3.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import scipy.optimize
import scipy.special
from numpy.typing import NDArray

from compare.continuation.correct import first_point
from compare.continuation.finer import relocated
from compare.continuation.follow import follow, switched
from compare.continuation.point import Options, Point, Run, Special
from compare.measure.mesh_limit import Settled, settled
from compare.models.branches.confined import ConfinedShape
from compare.studies.branches import aside as passages
from ribbon.find.branch.aside import of_chain
from ribbon.find.branch.chain import Setting
from ribbon.find.branch.confined import Confined
from ribbon.find.branch.folds import HUMP, arch, humped, waves
from tests.reference.aside_shooting import critical, determinant
from tests.validation import page
from tests.validation.number import Number
from tests.validation.ribbon.roman import DELTA, GAMMA, Experiment, free_height, line_contact, press

FloatArray = NDArray[np.float64]

#: Elements of an arc; heights between which the roof moves; the last exponent of the lowering.
ELEMENTS, TOP, LAST = 8, 0.21, 2.3
#: Where the humps begin, times the number of folds, and where what they lead to is left.
BEGUN, LEFT = 0.1, 0.17
#: To what heights are located on a mesh, l.
LOCATED = 1e-9
OPTIONS = Options(steps=300)


@cache
def low() -> float:
    """The roof's height at i = 2.3: the free arch's under weight, over exp(2.3)."""
    own, z = arch(Setting(TOP, DELTA, GAMMA), 2 * ELEMENTS)
    found = first_point(Confined(lambda t: Setting(TOP, DELTA, GAMMA), own), z, 0.0, OPTIONS.tolerance, check=False)
    assert found is not None
    system = found.system
    assert isinstance(system, Confined)
    return system.height(found.z, 0, 0.5, Setting(TOP, DELTA, GAMMA)) * math.exp(-LAST)


@dataclass(frozen=True)
class Lowering:
    """Heights over t, at a weight."""

    gamma: float

    def __call__(self, t: float) -> Setting:
        return Setting(self.height(t), DELTA, self.gamma)

    def height(self, t: float) -> float:
        """H, l."""
        return TOP + t * (low() - TOP)

    def t(self, height: float) -> float:
        """Where the roof is at this height."""
        return (TOP - height) / (TOP - low())


def chain_of(point: Point):  # type: ignore[no-untyped-def]
    """Its chain."""
    assert isinstance(point.system, Confined)
    return point.system.chain


def _first(system: Confined, z: FloatArray, t: float, along: float = 1.0) -> Point:
    found = first_point(system, z, t, OPTIONS.tolerance, along)
    assert found is not None
    return found


@cache
def one_fold(gamma: float) -> Run:
    """From the free arch down."""
    at = Lowering(gamma)
    own, z = arch(at(0.0), ELEMENTS)
    return follow(_first(Confined(at, own), z, 0.0), (0.0, 1.0), OPTIONS)


@cache
def folds(count: int, gamma: float = GAMMA) -> Run:
    """So many alike, from next to no force down."""
    at = Lowering(gamma)
    t = at.t(0.19 / count)
    own, z = waves(at(t), count, ELEMENTS)
    return follow(_first(Confined(at, own), z, t), (0.0, 1.0), OPTIONS)


def at_height(run: Run, gamma: float, height: float) -> Point:
    """The point of a run that goes down at this height."""
    t = Lowering(gamma).t(height)
    k = int(np.flatnonzero([p.t <= t for p in run.points])[-1])
    point = run.points[k]
    return _first(point.system, point.z, t)  # type: ignore[arg-type]


@cache
def leading_on(count: int) -> Run:
    """From the hump on the flat part beside so many folds up, over the fold, to one fold more."""
    at = Lowering(GAMMA)
    below = one_fold(GAMMA) if count == 1 else folds(count)
    flat = at_height(below, GAMMA, BEGUN / count)
    assert isinstance(flat.system, Confined)
    system, z = humped(flat.system, flat.z, flat.t)
    start = _first(system, z, flat.t, -1.0)
    left = LEFT / (count + 1)
    return follow(start, (0.0, 1.0), OPTIONS,
                  lambda p: not (len(chain_of(p).planes) == 2 * count + 3 and at.height(p.t) < left))  # fmt: skip


@cache
def leaning() -> Run:
    """What leaves one fold where it leans over, one of two mirror images."""
    (lost,) = [s for s in one_fold(GAMMA).specials if s.kind == "branch_point"]
    return follow(switched(lost, OPTIONS)[0], (0.0, 1.0), OPTIONS)


TOUCHES, SPREADS, ENDS, BUCKLES = "touches the roof", "spread into flat parts", "have become places", "buckles"
#: Runs by name, of a weight.
RUNS: dict[str, Callable[[float], Run]] = {
    "one": lambda gamma: one_fold(gamma),
    "leaning": lambda gamma: leaning(),
    "on 1": lambda gamma: leading_on(1),
    "on 2": lambda gamma: leading_on(2),
}


def special(run: Run, word: str) -> Special:
    """The first of this kind, or of these words."""
    return next(s for s in run.specials if s.kind == word or word in s.what)


@cache
def limit(name: str, gamma: float, word: str) -> Settled:
    """The height of a special point on elements halved twice."""
    at, found = Lowering(gamma), special(RUNS[name](gamma), word)
    values = [at.height(found.point.t)]
    for _ in range(2):
        finer = relocated(found, OPTIONS)
        if finer is None:
            return Settled(values[-1], float("nan"), None, False)
        found = finer
        values.append(at.height(found.point.t))
    return settled(values, LOCATED)


def half_wave(lean: float) -> tuple[float, float, float]:
    """Length, height and thrust of the weightless half wave between flat parts whose ends lean by this angle to the
    force, in closed form (a wave of Euler's elastica from inflection to inflection): k = sin(lean / 2),
    chord / length = 2 E / K - 1, force = (4 K / length)^2."""
    k2 = math.sin(0.5 * lean) ** 2
    whole, part = float(scipy.special.ellipk(k2)), float(scipy.special.ellipe(k2))
    chord = 2.0 * part / whole - 1.0
    length = 0.5 * DELTA / (1.0 - chord * math.cos(lean))
    return length, length * chord * math.sin(lean), (4.0 * whole / length) ** 2 * math.cos(lean)


def shot_spread(gamma: float) -> float:
    """The height at which the curvature at the floor is none: by shooting, without weight in closed form."""
    if not gamma:
        lean = scipy.optimize.brentq(lambda a: half_wave(a)[0] - 0.5, 0.3, 0.9, xtol=1e-15)
        return half_wave(float(lean))[1]
    near = limit("one", gamma, SPREADS).value
    return float(scipy.optimize.brentq(lambda h: line_contact(h, DELTA, gamma).low, near - 1e-4, near + 1e-4,
                                       xtol=1e-13))  # fmt: skip


def closed_buckled() -> float:
    """The height at which a weightless flat part of all the flat length buckles, in closed form."""

    def over(lean: float) -> float:
        length, _, thrust = half_wave(lean)
        return thrust * (1.0 - 2.0 * length) ** 2 - 4.0 * math.pi**2

    return half_wave(float(scipy.optimize.brentq(over, 0.3, 1.2, xtol=1e-15)))[1]


def shot_touch(gamma: float) -> float:
    """The height at which the roof's force is none: by shooting, extrapolated from a little force; of the weightless
    arch by elliptic integrals."""
    if not gamma:
        return free_height(DELTA)
    near = limit("one", gamma, TOUCHES).value
    heights = near - np.array([4e-4, 3e-4, 2e-4, 1e-4])
    forces = [line_contact(float(h), DELTA, gamma).force for h in heights]
    return float(np.polynomial.Polynomial.fit(forces, heights, 3)(0.0))


def shape(point: Point) -> ConfinedShape:
    """As a strip."""
    assert isinstance(point.system, Confined)
    return ConfinedShape(point.system, point.z, point.t, np.zeros(3), np.eye(3), 0.2)


def neck(point: Point) -> float:
    """Of one fold that is its own mirror image: the least distance of its sides over the height, l, below the top."""
    own, s = shape(point), np.linspace(0.0, 0.5, 4001)
    places = own.plane(s)
    top = float(places[-1, 0])
    theta = own.angle(s)
    steep = np.flatnonzero((theta[:-1] > 0.5 * np.pi) != (theta[1:] > 0.5 * np.pi))
    return 2.0 * (top - float(places[steep[0], 0])) if steep.size else float("inf")


def touches_itself() -> float:
    """The height at which the sides of one fold, its own mirror image, meet below its top."""
    run = one_fold(GAMMA)
    at = Lowering(GAMMA)
    heights = [at.height(p.t) for p in run.points]
    k = next(i for i, p in enumerate(run.points) if neck(p) < 0.0)
    return float(scipy.optimize.brentq(lambda h: neck(at_height(run, GAMMA, h)), heights[k], heights[k - 1], xtol=1e-9))


def beside_ribbon(count: int, height: float) -> list[float]:
    """The roof's force, and that of the glued ribbon over it - 1 on three meshes."""
    own = at_height(one_fold(GAMMA) if count == 1 else folds(count), GAMMA, height)
    pushes = chain_of(own).pushes(own.z, GAMMA)
    force = float(pushes[np.array(chain_of(own).planes[1:-1]) == 1].sum())
    found = [press(Experiment().folded(count, height, p)) / force - 1.0 for p in (60, 120, 240)]
    return [force, *found]


def line_on_bed(thrust: float) -> float:
    """Energy of a hump on an endless heavy line under this thrust, D w / l: ``C Gamma^2 T^(-5/2)`` for the shape of
    `ribbon.find.branch.folds.humped`, C its ``int f_uu^2 / 2 - f_u^2 / 2 + f du``."""
    u = HUMP * np.polynomial.legendre.leggauss(40)[0]
    w = HUMP * np.polynomial.legendre.leggauss(40)[1]
    slope, bent = np.sin(u) / np.cos(HUMP) - u, np.cos(u) / np.cos(HUMP) - 1.0
    raised = -np.cos(u) / np.cos(HUMP) - 0.5 * u * u + 1.0 + 0.5 * HUMP**2
    return GAMMA**2 * thrust**-2.5 * float(w @ (0.5 * bent**2 - 0.5 * slope**2 + raised))


def barrier(count: int, height: float) -> tuple[float, float, float]:
    """Energy of the hump above the flat state, of that of an endless line, and of the state with one fold more above
    the flat one, D w / l."""
    own = at_height(one_fold(GAMMA) if count == 1 else folds(count), GAMMA, height)
    assert isinstance(own.system, Confined)
    system, z = humped(own.system, own.z, own.t)
    hump = _first(system, z, own.t)
    assert hump.unstable == own.unstable + 1
    energy = own.system.energy(own.z, own.t)
    more = at_height(folds(count + 1), GAMMA, height)
    line = line_on_bed(-own.system.chain.tension(own.z))
    return system.energy(hump.z, hump.t) - energy, line, more.system.energy(more.z, more.t) - energy


def alike(count: int) -> tuple[float, float, float]:
    """N folds alike, as one with Gamma / N^3: heights times N at which they touch and lie flat, and the roof's force
    over N^3 at i = 2.3, nan where their sides have met before."""
    gamma = GAMMA / count**3
    run = one_fold(gamma)
    at = Lowering(gamma)
    touch, spread = (at.height(special(run, word).point.t) for word in (TOUCHES, SPREADS))
    height = low() * count
    if height < touches_itself():
        return touch, spread, float("nan")
    point = at_height(run, gamma, height)
    return touch, spread, float(chain_of(point).pushes(point.z, gamma)[0])


PROBES = {
    "touch_8": lambda: Lowering(GAMMA).height(special(one_fold(GAMMA), TOUCHES).point.t),
    "spread_8": lambda: Lowering(GAMMA).height(special(one_fold(GAMMA), SPREADS).point.t),
    "fold_8": lambda: Lowering(GAMMA).height(special(leading_on(1), "fold").point.t),
}


def crosses(point: Point) -> bool:
    """Whether the centreline goes through itself."""
    line = shape(point).plane(np.linspace(0.0, 1.0, 801))
    a, d = line[:-1], np.diff(line, axis=0)
    gap = a[None, :] - a[:, None]
    across = d[:, None, 0] * d[None, :, 1] - d[:, None, 1] * d[None, :, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        one = (gap[..., 0] * d[None, :, 1] - gap[..., 1] * d[None, :, 0]) / across
        other = (gap[..., 0] * d[:, None, 1] - gap[..., 1] * d[:, None, 0]) / across
    met = (one > 0.0) & (one < 1.0) & (other > 0.0) & (other < 1.0)
    return bool(np.any(np.triu(met, 3)))


# -- aside of the plane ---

#: Widths w / l of Wunderlich's strips, and Sadowsky's of none; branches that are asked, with the least height (l) that
#: is: where the one of the plane has lost its stability in it, or ends.
WIDTHS = (0.2, 0.1, 0.05, 0.02, 0.0)
BESIDE: dict[str, tuple[Callable[[], Run], float]] = {
    "one": (lambda: one_fold(GAMMA), 0.0700),
    "leaning": (leaning, 0.0),
    "two": (lambda: folds(2), 0.0350),
    "three": (lambda: folds(3), 0.0234),
}
#: Where a shooting has flat parts and folds that are upright, by name the number of folds.
SHOT_ASIDE = {"two": 2, "three": 3}


def asked_aside(width: float, count: int = 3) -> Callable[[Point], NDArray[np.float64]]:
    """The lowest eigenvalues (count,) aside of a point's plane, over t, for a width (l)."""

    def asks(point: Point) -> NDArray[np.float64]:
        own, setting = chain_of(point), Lowering(GAMMA)(point.t)
        return of_chain(own, point.z, setting, width, elements=min(own.elements // 2, 6)).lowest(count)

    return asks


@cache
def gives_way(name: str, width: float) -> Settled | float:
    """The height (l) at which the first mode aside becomes unstable as the roof falls, on elements halved twice; where
    none does the lowest eigenvalue on the way."""
    run_, low_ = BESIDE[name][0](), BESIDE[name][1]
    at, asks = Lowering(GAMMA), asked_aside(width, 1)
    points = [p for p in run_.points if at.height(p.t) > low_]
    values = [float(asks(p)[0]) for p in points]
    k = next((k for k in range(1, len(values)) if values[k] < 0.0), None)
    if k is None:
        return min(values)
    (one,) = passages.passed(points[k - 1 : k + 1], (0, 1), asks, OPTIONS, 2, lambda: False)
    if one is None:
        raise AssertionError(f"{name}, w = {width}: no root found")
    roots = [one.point, *one.finer]
    return settled([math.nan if p is None else at.height(p.t) for p in roots], LOCATED)


def _beside() -> list[list[str]]:
    rows = []
    for name in BESIDE:
        for width in WIDTHS:
            found = gives_way(name, width)
            if isinstance(found, float):
                rows.append([name, f"{width:g}", "stable", "", f"{found:.3f}", "", ""])
                continue
            error = f"{found.error:.0e}" if found.settles else "not settled"
            shot = ["", ""]
            if not width and name in SHOT_ASIDE:
                near = found.value
                ends = [determinant(near + side, DELTA, GAMMA, SHOT_ASIDE[name]) for side in (-1e-5, 1e-5)]
                if ends[0] * ends[1] < 0.0:
                    own = critical(near - 1e-5, near + 1e-5, DELTA, GAMMA, SHOT_ASIDE[name])
                    shot = [f"{own:.10f}", f"{near - own:+.0e}"]
                else:
                    shot = ["none within 1e-05", ""]
            rows.append([name, f"{width:g}", f"{found.value:.9f}", error, "", *shot])
    return rows


# -- the page ---------------------------------------------------------------------------------------------------------

HEADS = ("branch", "what happens", "H / l", "+-", "i", "unstable modes", "independent", "apart")


def _row(name: str, gamma: float, word: str, what: str, shot: float | None = None) -> list[str]:
    found, run = limit(name, gamma, word), RUNS[name](gamma)
    one = special(run, word)
    before = one.before.unstable
    after = before + one.change
    error = f"{found.error:.0e}" if found.settles else "not settled: one mesh"
    exponent = math.log(low() * math.exp(LAST) / found.value)
    beside = ["", ""] if shot is None else [f"{shot:.10f}", f"{found.value - shot:+.0e}"]
    return [name, what, f"{found.value:.9f}", error, f"{exponent:.3f}", f"{before} to {after}", *beside]


def _scaled(count: int, word: str) -> float:
    """The height at which so many folds alike touch or lie flat: of one fold with Gamma / N^3, over N."""
    gamma = GAMMA / count**3
    return (shot_touch(gamma) if word == TOUCHES else shot_spread(gamma)) / count


def _events() -> list[list[str]]:
    last = "spread into flat parts, on the floor"
    rows = [
        _row("one", GAMMA, TOUCHES, "touches the roof", shot_touch(GAMMA)),
        _row("one", GAMMA, SPREADS, last, shot_spread(GAMMA)),
        _row("one", GAMMA, "branch_point", "branch point: leans over"),
    ]
    for count in (1, 2):
        rows += [
            _row(f"on {count}", GAMMA, ENDS, "hump and fold fill the length: flat parts end"),
            _row(f"on {count}", GAMMA, "fold", "fold: the hump is a fold that hangs"),
            _row(f"on {count}", GAMMA, TOUCHES, "it touches the roof", _scaled(count + 1, TOUCHES)),
            _row(f"on {count}", GAMMA, SPREADS, last, _scaled(count + 1, SPREADS)),
        ]
    return rows


def _weightless() -> list[list[str]]:
    return [
        _row("one", 0.0, TOUCHES, "touches the roof", shot_touch(0.0)),
        _row("one", 0.0, SPREADS, "spread into flat parts", shot_spread(0.0)),
        _row("one", 0.0, BUCKLES, "all of the flat length in one part: it buckles", closed_buckled()),
    ]


def run(out: Path) -> dict[str, Number]:
    """Writes roman_branches.md and its picture into the folder."""
    at = Lowering(GAMMA)
    rows, light, aside = _events(), _weightless(), _beside()
    beside = [(n, h, *beside_ribbon(n, h)) for n, h in ((1, 0.185), (1, 0.165), (2, 0.0925))]
    barriers = [(1, h, *barrier(1, h)) for h in (0.095, 0.085, 0.075)]
    barriers += [(2, h, *barrier(2, h)) for h in (0.06, 0.05, 0.045)]
    many = [(n, *alike(n)) for n in range(1, 9)]
    leans, itself = leaning(), touches_itself()
    through = [at.height(p.t) for p in leans.points if crosses(p)]
    lost = [(n, at.height(special(folds(n) if n > 1 else one_fold(GAMMA), "branch_point").point.t)) for n in (1, 2, 3)]
    pieces = [one_fold(GAMMA), folds(2), folds(3), leading_on(1), leading_on(2)]
    ends = [run_.ended for run_ in pieces[:3]]
    hamilton = max(
        abs(chain_of(p).curvature(p.z, 0, np.ones(1))[0] / math.sqrt(2.0 * GAMMA * at.height(p.t)) + 1.0)
        for p in one_fold(GAMMA).points if chain_of(p).flat and at.height(p.t) > 0.12
    )  # fmt: skip
    if ends != ["range"] * 3 or any(p.unstable for p in one_fold(GAMMA).points if at.height(p.t) > lost[0][1]):
        raise AssertionError(f"branches end by {ends}")
    _picture(out / "roman_branches.png")
    crossing = f"goes through itself from H = {max(through):.4f} down" if through else "does not go through itself"
    page.write(
        out / "roman_branches.md", "Roman's strip under a falling roof: branches with their events",
        "python -m tests.validation roman_branches",
        f"Algorithm 3 (thesis, 6.2.2, figures 6.12 to 6.14): Delta = {DELTA}, Gamma = {GAMMA:g}, the roof from H "
        f"= {TOP} down to i = "
        f"{LAST} "
        f"(H = {low():.6f}), rulings straight, floor at the clamps' height. Places of contact are unknowns (theory, "
        "(8.8)): every event has a limit on arcs of 8, 16 and 32 elements. Unstable modes are counted in the "
        "plane, on "
        "what touches, and aside of it in a table of their own; states aside are another page's "
        "([states](roman_states/README.md)). "
        "`ribbonbench branches roman_6_2 --along wall.roof.point[1] --from 0.19 --to 0.0195` follows the first.",
        "## Events",
        "*one*: from the free arch down. *on 1*, *on 2*: from one (two) folds with a hump on the flat part up, "
        "over a "
        "fold, and down with two (three) folds. Independent: shooting on Roman's elastica (of N folds with Gamma "
        "/ N^3, over N); the height of the touch by extrapolating its force. Where the last of several folds "
        "touches, the "
        "roof pushes none of them: two events in one place, which is not located again on finer arcs from three "
        "folds on.",
        page.table(HEADS, rows),
        f"Under weight no flat part buckles. The floor's curvature comes to zero while the roof's is - sqrt(2 "
        f"Gamma H) "
        f"(Hamilton's function; kept to {hamilton:.0e} down to H = 0.12), so that the roof's contact stays a "
        "line, and a flat part on the floor, lifted anywhere, weighs at once. What has buckled is an equilibrium "
        "apart from it, with one "
        "unstable mode, that comes as near as one likes but not to it. On an endless heavy line (Hobbs 1984) it "
        "costs C Gamma^2 "
        "T^(-5/2), T the thrust:",
        page.table(
            ["folds", "H / l", "hump above the flat state, D w / l", "on an endless line",
             "one fold more above it, D w / l"],
            [[str(n), f"{h:g}", f"{up:.3e}", f"{line:.3e}", f"{more:.2f}"] for n, h, up, line, more in barriers],
        ),
        "So the number of folds changes in a snap over that barrier, at no place of its own: a minimiser on 60 "
        "segments snaps at H = 0.1161 ([page](roman.md)), where one fold and more than half its length flat are "
        "stable here, down "
        f"to H = {lost[0][1]:.4f}. Above the fold at {limit('on 1', GAMMA, 'fold').value:.4f} one fold is all "
        f"that there is "
        "of these; below it both are stable.",
        "## Without weight",
        "All of the flat length may lie anywhere: on the floor and at the roof its shares are neutral, and have no "
        "unknowns. Then the tangent is regular. What buckles is the longest flat part that can be, thrust 4 pi^2 / "
        "length^2; of a shorter share later. Independent: elliptic integrals.",
        page.table(HEADS, light),
        "## Aside of its plane",
        "With rulings that are free (theory, (8.10), (8.11)): where the first mode aside becomes unstable as the roof "
        "falls, under weight, flat parts shared out alike; where none does the lowest eigenvalue of the second "
        "variation over the stiffness aside. Branches are asked as long as their own plane keeps them. At w/l = 0.2, "
        "Roman's, nothing gives way aside: what is stable in the plane is stable. A narrow strip does, the sooner the "
        "more folds there are, whose flat parts between may yaw. w/l = 0 is Sadowsky's strip; independent: shooting on "
        "forces and moments in space.",
        page.table(["branch", "w / l", "gives way at H / l", "+-", "lowest eigenvalue", "independent", "apart"], aside),
        "## To i = 2.3",
        "N folds alike are one with Gamma / N^3 at N H, to rounding: so every N has its heights. At N H = "
        + ", ".join(f"{n * h:.5f} ({n})" for n, h in lost)
        + f" they lean over (one mesh; N in brackets), all at once; the branch that leaves one fold there {crossing}, "
        f"that of the upright one does at H = {itself:.5f}, where its sides meet. At i = {LAST} that is passed by "
        f"three "
        "folds and less; four and more are flat on the floor, on lines at the roof, and upright.",
        page.table(
            ["N", "N H: touches", "N H: flat on the floor", f"N H at i = {LAST}", "F / N^3 there"],
            [[str(n), f"{a:.6f}", f"{b:.6f}", f"{n * low():.5f}", "sides have met" if math.isnan(f) else f"{f:.2f}"]
             for n, a, b, f in many],
        ),
        "## The glued ribbon beside it",
        "The minimiser's force on the roof over the branch's, - 1.",
        page.table(["N", "H / l", "F, D w / l^2", "p = 60", "p = 120", "p = 240"],
                   [[str(n), f"{h:g}", f"{f:.4f}", *(f"{v:+.1e}" for v in meshes)] for n, h, f, *meshes in beside]),
        "![Forces and energies over the height, shapes](roman_branches.png)",
    )  # fmt: skip
    return _numbers(itself, lost[0][1], barriers, beside)


def _numbers(
    itself: float,
    lost: float,
    barriers: list[tuple[int, float, float, float, float]],
    beside: list[tuple[float, ...]],
) -> dict[str, Number]:
    def of(name: str, gamma: float, word: str) -> Number:
        found = limit(name, gamma, word)
        return Number(found.value, found.error, "l", ".9f")

    wide = [gives_way(name, WIDTHS[0]) for name in BESIDE]

    def shot_beside(name: str) -> Number:
        found = gives_way(name, 0.0)
        assert not isinstance(found, float)
        return Number(found.value, found.error, "l", ".9f")

    return {
        "touch": of("one", GAMMA, TOUCHES),
        "spread": of("one", GAMMA, SPREADS),
        "lost": of("one", GAMMA, "branch_point"),
        "ends": of("on 1", GAMMA, ENDS),
        "fold": of("on 1", GAMMA, "fold"),
        "touch_two": of("on 1", GAMMA, TOUCHES),
        "fold_two": of("on 2", GAMMA, "fold"),
        "buckles": of("one", 0.0, BUCKLES),
        "buckles_apart": Number(abs(limit("one", 0.0, BUCKLES).value - closed_buckled()), 1e-11, "l", ".0e"),
        "spread_apart": Number(abs(limit("one", GAMMA, SPREADS).value - shot_spread(GAMMA)), 1e-10, "l", ".0e"),
        "aside_two": shot_beside("two"),
        "aside_three": shot_beside("three"),
        "aside_wide": Number(min(v for v in wide if isinstance(v, float)), 1e-6, "", ".3f"),
        "itself": Number(itself, 1e-6, "l", ".5f"),
        "barrier": Number(barriers[1][2], 1e-6, "D w / l", ".3e"),
        "barrier_line": Number(barriers[1][3], 1e-7, "D w / l", ".3e"),
        "ribbon": Number(max(abs(row[-1]) for row in beside), 1e-4, "", ".1e"),
        "touch_8": Number(PROBES["touch_8"](), 1e-10, "l", ".9f"),
        "spread_8": Number(PROBES["spread_8"](), 1e-10, "l", ".9f"),
        "fold_8": Number(PROBES["fold_8"](), 1e-9, "l", ".9f"),
    }


def _picture(path: Path) -> None:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(12, 4.8), constrained_layout=True, width_ratios=(3, 2))
    at, left = Lowering(GAMMA), axes[0]
    drawn = [("one fold", one_fold(GAMMA), "C0"), ("two folds", folds(2), "C1"), ("three folds", folds(3), "C2"),
             ("hump, to two", leading_on(1), "C3"), ("hump, to three", leading_on(2), "C4")]  # fmt: skip
    for word, run_, colour in drawn:
        height = np.array([at.height(p.t) for p in run_.points])
        energy = np.array([p.system.energy(p.z, p.t) for p in run_.points])
        unstable = np.array([p.unstable for p in run_.points])
        parts = np.split(np.arange(height.size), np.flatnonzero(np.diff(unstable != 0)) + 1)
        for k, part in enumerate(parts):
            own = np.append(part, part[-1] + 1) if part[-1] + 1 < height.size else part
            left.plot(height[own], energy[own], colour + ("--" if unstable[part[0]] else "-"), lw=1.4,
                      label=word if k == 0 else None)  # fmt: skip
        for one in run_.specials:
            mark = {"fold": "v", "branch_point": "D"}.get(one.kind, "o")
            left.plot(
                at.height(one.point.t), one.point.system.energy(one.point.z, one.point.t), mark, color=colour, ms=5
            )
    left.set(yscale="log", xlabel="H / l", ylabel="energy, D w / l", xlim=(low(), TOP), ylim=(4.0, 2e3))
    left.invert_xaxis()
    left.legend(fontsize=8)
    states = [(one_fold(GAMMA), 0.19, "0.19"), (one_fold(GAMMA), 0.1, "0.10"), (folds(2), 0.07, "0.07"),
              (folds(3), 0.045, "0.045")]  # fmt: skip
    s, lift = np.linspace(0.0, 1.0, 801), 0.0
    for run_, height_, word in states:
        line = shape(at_height(run_, GAMMA, height_)).plane(s)
        axes[1].plot(line[:, 0], line[:, 1] - lift, "C0")
        axes[1].plot(
            [0.0, 0.9, np.nan, 0.0, 0.9], [-lift, -lift, np.nan, height_ - lift, height_ - lift], "0.7", lw=0.8
        )
        axes[1].text(0.92, 0.4 * height_ - lift, f"H = {word}", fontsize=8)
        lift += 0.16
    hump = min((p for p in leading_on(1).points if p.unstable), key=lambda p: abs(at.height(p.t) - 0.12))
    line = shape(hump).plane(s)
    axes[1].plot(line[:, 0], line[:, 1] - lift, "C3--")
    axes[1].text(0.92, -lift + 0.04, f"hump, H = {at.height(hump.t):.3f}", fontsize=8)
    axes[1].set_aspect("equal")
    axes[1].axis("off")
    axes[1].set_xlim(-0.02, 1.25)
    figure.savefig(path, dpi=110)
    plt.close(figure)
