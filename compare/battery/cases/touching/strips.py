"""Several strips: rings of bigons, joints of all kinds, stiffnesses far apart, strips that lie across each other."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from compare.battery.case import Case, Check, Rung, holds, near
from compare.battery.judge.touching import Sheet, Told, kept
from compare.measure.balance import Wrench, abscissae
from compare.models.strips.balance import left_over
from ribbon import Clamp, Gravity, Strip, Wall, solve
from ribbon.element import quaternion
from ribbon.find.strips import solve as strips
from ribbon.find.strips.assemble import Member
from ribbon.problems.strips.joint import End, Joint

UP = np.array([0.0, 0.0, 1.0])
#: Distance that strips keep, l; what is left of force and moment; joints opened (l, rad).
APART, BALANCE, HELD = 0.05, 1e-6, 1e-8
#: Time for a solve, s.
BUDGET, SHORT = 60.0, 30.0
#: Widths along both strips from a joint within which they are not looked at (docs/scenes.md).
_BESIDE = 3.0


def balance(found: Any, members: Sequence[Member], up: np.ndarray | None) -> Check:
    """What is left of force and moment of every strip, over the largest of its own."""
    worst: float = 0.0
    for k, strip in enumerate(found.strips):
        over, unit = found.problem.lengths_over[k], found.problem.stiffness_over[k]
        wrenches = []
        held = members[k]
        for clamp, support, s in ((held.start, strip.start, 0.0), (held.end, strip.end_support, 1.0)):
            if clamp is not None and support is not None:
                at = over * strip.position([s])[0]
                wrenches.append(Wrench(at, unit / over * support.force, unit * support.moment))
        for joint in found.joints:
            for end, sign in ((joint.other, 1.0), (joint.one, -1.0)):
                if end.strip == k:
                    wrenches.append(Wrench(joint.at, sign * joint.force, sign * joint.moment))
        for touch in found.touching:
            for number, at, sign in ((touch.one, touch.at, 1.0), (touch.other, touch.at_other, -1.0)):
                if number == k:
                    wrenches.append(Wrench(at, sign * touch.force, np.zeros(3)))
        places = over * strip.position(abscissae()[0])
        worst = max(worst, left_over(places, unit / over * members[k].strip.gamma, up, wrenches))
    return Check("force and moment of a strip are not in balance, relative", worst, BALANCE)


def told(found: Any) -> list[Told]:
    """The places at which strips are told to touch."""
    return [
        Told(one.one, one.other, (one.s, one.v), (one.s_other, one.v_other), np.asarray(one.force), one.gap)
        for one in found.touching
    ]


def _turn(axis: int, degrees: float) -> tuple[float, float, float, float]:
    w, x, y, z = quaternion.turn(np.eye(3)[axis], math.radians(degrees))
    return float(w), float(x), float(y), float(z)


def _converged(found: Any) -> Check:
    return holds("converged", found.status.code == "converged", f"{found.status.code}: {found.message}")


def _joined(found: Any) -> Check:
    return Check("a joint is open (l, rad)", max(max(j.opened, j.turned) for j in found.joints), HELD)


def _ring(rung: Rung) -> Iterator[Check]:
    """Bigons of 60 degrees in a ring, begun as a turn of all."""
    cells = int(rung)
    strip = Strip(length=1.0, width=0.1, poisson=0.3, thickness=0.02)
    members = [Member(strip, segments=8, curvature=(-2.0 * math.pi / cells,)) for _ in range(2 * cells)]
    joints = []
    for one in range(0, 2 * cells, 2):
        other, following = one + 1, (one + 2) % (2 * cells)
        joints += [
            Joint(End(one, 0), End(other, 0), "rigid", _turn(1, 60.0)),
            Joint(End(one, -1), End(other, -1), "rigid", _turn(1, -60.0)),
            Joint(End(other, -1), End(following, 0), "rigid"),
        ]
    found = strips.solve(members, joints, energy="kirchhoff", budget=BUDGET)
    yield _converged(found)
    yield _joined(found)
    yield balance(found, members, None)


_KINDS = {"seamless": 0.0, "rigid": 90.0, "hinge": 0.0, "pin": 0.0}


def _joint(rung: Rung) -> Iterator[Check]:
    """A clamped strip and a heavy one joined to its end; seamless: the uncut strip."""
    kind = str(rung)
    section: Any = {"width": 0.05, "poisson": 0.4, "thickness": 1e-3}
    level = Clamp((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, -math.sqrt(0.5), math.sqrt(0.5)))
    half = Strip(length=0.5, gamma=2.0 / 8.0, **section)
    members = [Member(half, level, segments=8), Member(half, segments=8)]
    joint = Joint(End(0, -1), End(1, 0), kind, _turn(1, _KINDS[kind]))  # type: ignore[arg-type]
    found = strips.solve(members, [joint], Gravity(UP), "kirchhoff", budget=BUDGET)
    if kind == "pin":  # what hangs by one end turns about itself: neutral, so that its stability is not told
        yield holds("stationary", found.residual < 1e-7, found.message)
    else:
        yield _converged(found)
    yield _joined(found)
    yield balance(found, members, UP)
    if kind == "seamless":
        whole = solve(Strip(length=1.0, gamma=2.0, **section), level, Gravity(UP), energy="kirchhoff", segments=16,
                      formulation="mixed")  # fmt: skip
        yield near("energy, of the uncut strip's", found.energy.total * 2.0, whole.energy.total, 1e-8)
    if kind in ("hinge", "pin"):
        axis = found.strips[0].end.frame[:, 0]
        moment = found.joints[0].moment
        free = float(np.linalg.norm(moment)) if kind == "pin" else abs(float(moment @ axis))
        yield Check("moment where the joint is free, D w / l", free, 1e-7)


def _stiff(rung: Rung) -> Iterator[Check]:
    """A bigon of 40 degrees, one strip so many times as stiff as the other."""
    strip = Strip(length=1.0, width=0.05, poisson=0.4, thickness=0.01)
    members = [Member(strip, stiffness=c, segments=12, curvature=(1.0,)) for c in (1.0, float(rung))]
    joints = [
        Joint(End(0, 0), End(1, 0), "rigid", _turn(1, 40.0)), Joint(End(0, -1), End(1, -1), "rigid", _turn(1, -40.0))
    ]  # fmt: skip
    found = strips.solve(members, joints, energy="kirchhoff", budget=BUDGET)
    yield _converged(found)
    yield _joined(found)
    yield balance(found, members, None)
    numbers = [
        Joint(End(1 - j.one.strip, j.one.joint), End(1 - j.other.strip, j.other.joint), "rigid", j.turn) for j in joints
    ]
    swapped = strips.solve(members[::-1], numbers, energy="kirchhoff", budget=BUDGET)
    yield near("energy, in the unit of either strip", swapped.energy.total * float(rung) / found.energy.total, 1.0,
               1e-6)  # fmt: skip


def _section(width: float) -> Any:
    return {"width": width, "poisson": 0.3, "thickness": 0.2 * width}


def _low() -> Member:
    """A weightless cantilever along x, its face up."""
    low = Clamp((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    return Member(Strip(length=1.0, gamma=0.0, **_section(0.05)), low, segments=10, name="low")


def _across(x: float, y: float, weight: float, gap: float, name: str) -> Member:
    """A heavy one along y above it, that crosses it at x, 0.8 of its length from its clamp."""
    clamp = Clamp((x, y, APART + gap), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    return Member(Strip(length=1.0, gamma=weight, **_section(0.05)), clamp, segments=10, name=name)


def _apart(found: Any, members: Sequence[Member]) -> Iterator[Check]:
    yield _converged(found)
    if not found.ok:
        return
    yield balance(found, members, UP)
    sheets = [Sheet(strip, over) for strip, over in zip(found.strips, found.problem.lengths_over, strict=True)]
    yield from kept(sheets, APART, told(found), _between)


def _between(one: int, other: int) -> Any:
    """Nothing keeps a strip from itself."""
    return (lambda s, t: np.ones(np.broadcast(s, t).shape, dtype=bool)) if one == other else None


def _cross(rung: Rung) -> Iterator[Check]:
    """Its crossing slides along the lower one to its end, over its corners and beyond them."""
    members = [_low(), _across(float(rung), -0.8, 3.0, 0.01, "high")]
    found = strips.solve(members, (), Gravity(UP), "kirchhoff", APART, budget=BUDGET)
    yield from _apart(found, members)


def _many(rung: Rung) -> Iterator[Check]:
    """So many light strips across one."""
    count = int(rung)
    places = np.linspace(0.2, 0.95, count) if count > 1 else [0.8]
    members = [_low(), *(_across(float(x), -0.8, 1.0, 0.01, f"high_{k}") for k, x in enumerate(places))]
    found = strips.solve(members, (), Gravity(UP), "kirchhoff", APART, budget=BUDGET)
    yield from _apart(found, members)


def _along(rung: Rung) -> Iterator[Check]:
    """A heavy strip above another, clamped beside it and turned from its direction by an angle."""
    turn = math.radians(float(rung))
    way = (math.cos(turn), math.sin(turn), 0.0)
    clamp = Clamp((0.0, 0.0, APART + 0.005), way, (0.0, 0.0, 1.0))
    high = Member(Strip(length=1.0, gamma=3.0, **_section(0.05)), clamp, segments=10, name="high")
    members = [_low(), high]
    found = strips.solve(members, (), Gravity(UP), "kirchhoff", APART, budget=SHORT)
    yield from _apart(found, members)


#: Height by which the clamp of each strip of a stack is above the last one's, beyond the distance (l), how far from the
#: clamp the second one comes down (l), and how near the closed form of small slopes is, over what is told.
_LIFT, _DOWN, _SMALL = 1e-3, 0.5, 5e-3


def _stack(rung: Rung) -> Iterator[Check]:
    """Equal strips on each other on a table, the first one flat, each of the others let down from its clamp. Small
    slopes: what is lifted by d at the clamp lies from a = (72 d / q)^(1/4) on, its clamp bears 2 q a / 3, and what it
    lies on q (1 - 2 a / 3)."""
    count, q = int(rung), 72.0 * _LIFT / _DOWN**4
    members = [
        Member(Strip(length=1.0, gamma=q, **_section(0.05)),
               Clamp((0.0, 0.0, k * (APART + _LIFT)), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)), segments=10, name=f"layer_{k}")
        for k in range(count)
    ]  # fmt: skip
    table = Wall((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    found = strips.solve(members, (), Gravity(UP), "kirchhoff", APART, budget=BUDGET, walls=[table])
    yield _converged(found)
    if not found.ok:
        return
    sheets = [Sheet(strip, over) for strip, over in zip(found.strips, found.problem.lengths_over, strict=True)]
    yield from kept(sheets, APART, told(found), _between)
    on = np.zeros((count + 1, 3))  # what each strip pushes the one above it with; first the table
    on[0] = found.strips[0].walls[0].force
    for touch in found.touching:
        on[max(touch.one, touch.other)] += touch.force if touch.one > touch.other else -touch.force
    lies = q * (1.0 - 2.0 / 3.0 * _DOWN * np.arange(count) ** 0.25)
    for k, strip in enumerate(found.strips):
        assert strip.start is not None
        left = strip.start.force + on[k] - on[k + 1] - q * UP
        yield Check(f"forces on strip {k} are not in balance, over its weight", float(np.abs(left).max()) / q, BALANCE)
        if k:
            above = float(lies[k:].sum())
            yield near(f"what strip {k} lies with, over small slopes'", on[k][2] / above, 1.0, _SMALL)
            bears = strip.start.force[2] / (q - lies[k])
            yield near(f"what the clamp of strip {k} bears, over small slopes'", bears, 1.0, _SMALL)


CASES: tuple[Case, ...] = (
    Case(
        "touching/ring_of_bigons",
        "rings of ever more bigons (60 degrees): two strips and three joints a cell, a loop of loops",
        "a stable state whose joints are closed and whose every strip is in balance",
        "bigons",
        _ring,
        (3.0, 6.0),
        (12.0, 24.0, 48.0),
    ),
    Case(
        "touching/joints",
        "a heavy strip joined to the end of an oblique cantilever by every kind of joint; a pin leaves it free to turn",
        "forces balance, no moment where a joint is free; joined seamlessly it is the uncut strip to 1e-8",
        "kind",
        _joint,
        ("seamless", "rigid", "hinge", "pin"),
    ),
    Case(
        "touching/stiffnesses",
        "a bigon of 40 degrees of two strips, one ever stiffer: the soft one is bent by hundreds of its own forces",
        "a stable state in balance, the same in the units of either strip",
        "ratio of stiffnesses",
        _stiff,
        (1.0, 100.0),
        (1e3, 1e4, 1e5),
    ),
    Case(
        "touching/across_a_strip",
        "a heavy strip across another: its crossing at ever larger x, where an edge goes over a corner of the end of "
        "the lower one, and past it",
        "nowhere nearer than 0.05 l by more than 1e-6 l; pushes times gaps vanish; every strip is in balance",
        "place of the crossing / l",
        _cross,
        (0.9,),
        (0.3, 0.97, 0.98, 0.99, 1.0, 1.02),
    ),
    Case(
        "touching/many_across",
        "ever more light strips across one that carries them all",
        "nowhere nearer than 0.05 l by more than 1e-6 l; pushes times gaps vanish; every strip is in balance",
        "strips across",
        _many,
        (2.0,),
        (4.0, 8.0),
    ),
    Case(
        "touching/along_each_other",
        "a heavy strip that lies upon another in ever more nearly the same direction: from a place to a face",
        "nowhere nearer than 0.05 l by more than 1e-6 l; pushes times gaps vanish; every strip is in balance",
        "angle between them, degrees",
        _along,
        (30.0,),
        (10.0, 3.0, 1.0, 0.0),
    ),
    Case(
        "touching/stack",
        "ever more heavy strips lying on each other on a table, each let down from a clamp of its own",
        "nowhere nearer than 0.05 l by more than 1e-6 l; pushes times gaps vanish; forces balance; what clamps bear "
        "and strips lie with is the closed form of small slopes within 0.5 %",
        "strips",
        _stack,
        (2.0,),
        (3.0, 5.0),
    ),
)
