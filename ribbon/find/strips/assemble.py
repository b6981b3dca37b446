"""From strips and joints to one problem; what contradicts itself is refused before anything is computed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ribbon import law
from ribbon.boundary import Clamp
from ribbon.contact import Barrier
from ribbon.energies import chosen
from ribbon.errors import RibbonInputError
from ribbon.loads import Gravity, tip_force
from ribbon.problems.strips.joint import End, Joint
from ribbon.problems.strips.part import Part
from ribbon.problems.strips.problem import StripsProblem
from ribbon.solid import Solid
from ribbon.strip import Strip

FloatArray = NDArray[np.float64]

#: Ends of a strip by their joint.
ENDS = {0: "start", -1: "end"}


@dataclass(frozen=True)
class Member:
    """One of several strips.

    strip: with lengths in the unit that all of them share; start, end: clamps, None: no clamp; stiffness: D in a unit
    that all of them share; segments: how many equal ones, or their lengths over the strip's; curvature, ruling: omega
    (in 1/length) and eta to begin with, values at equal distances; None: the shape at rest, and where that says nothing
    one that is chosen; name: for messages; tip: a dead force (3,) at s = length in the strip's own D w / length^2, its
    direction fixed in space, at a joint too; moment: (3,) there in D w / length, its axis fixed in space
    (`ribbon.find.strips.moment`); None: none.
    """

    strip: Strip
    start: Clamp | None = None
    end: Clamp | None = None
    stiffness: float = 1.0
    segments: int | tuple[float, ...] = 20
    curvature: tuple[float, ...] | None = None
    ruling: tuple[float, ...] = (0.0,)
    name: str = ""
    tip: tuple[float, float, float] | None = None
    moment: tuple[float, float, float] | None = None

    @property
    def lengths(self) -> FloatArray:
        """Lengths of its segments over the strip's."""
        given = self.segments
        found = np.full(given, 1.0 / given) if isinstance(given, int) else np.asarray(given, dtype=float)
        for one in self.strip.rest:
            found = law.cut(one, found)
        return found

    def clamp(self, joint: int) -> Clamp | None:
        """What holds an end."""
        return self.start if joint == 0 else self.end


def assembled(
    members: Sequence[Member],
    joints: Sequence[Joint],
    gravity: Gravity | None = None,
    energy: str = "wunderlich",
    apart: float = 0.0,
    rulings: Sequence[str | None] | None = None,
    walls: Sequence[Barrier] = (),
    friction: float = 0.0,
    itself: bool = False,
    **choices: bool | str | None,
) -> StripsProblem:
    """The problem of `members` with these joints; apart: distance that different strips keep, in their unit of length;
    rulings: of every joint, "straight" or "free" (None: free where the strip goes on or is pinned); walls: rigid
    ones and obstacles that none of them can cross, in their unit of length; friction: Coulomb's coefficient between
    strips that are kept apart, which acts along a path only (`ribbon.find.strips.sliding`); itself: whether parts of
    one strip that face each other are kept apart too, with the same friction; choices: `stiffness` and `in_plane` of
    the energy. `RibbonInputError` for what contradicts itself."""
    if not members:
        raise RibbonInputError("strips", 0, "give one strip at least")
    _check_walls(walls)
    if not (np.isfinite(friction) and friction >= 0.0) or (friction and not apart):
        raise RibbonInputError("friction", friction, "a coefficient >= 0, of strips that are kept apart")
    if itself and not apart:
        raise RibbonInputError("itself", itself, "needs the distance that parts of a strip keep")
    _check_joints(members, joints)
    loose = _loose(members, joints)
    weighty = gravity is not None and any(member.strip.gamma > 0 for member in members)
    loads, moments = [_load(member) for member in members], [_moment(member) for member in members]
    pulled = any(load is not None for load in (*loads, *moments))
    if loose and (len(loose) > 1 or _components(members, joints) > 1 or weighty or pulled or apart or walls):
        name = members[loose[0][0]].name or str(loose[0][0])
        raise RibbonInputError("strips", name, "is held by no clamp; clamp an end of it, or of what it is joined to")
    ruled = list(rulings or [None] * len(joints))
    parts = []
    for k, member in enumerate(members):
        chosen(energy, member.strip)
        held = [member.clamp(joint) or _by_joint(End(k, joint), joints, ruled) for joint in (0, -1)]
        if loose and k == loose[0][0]:
            held[0] = Clamp(ruling=held[0].ruling)
        parts.append(
            Part(
                strip=member.strip,
                start=held[0],
                end=held[1],
                closure=None,
                walls=tuple(walls),
                gravity=gravity,
                energy=energy,
                lengths=member.lengths,
                tip=loads[k],
                moment=moments[k],
                **choices,  # type: ignore[arg-type]
            )
        )
    first = members[0]
    unit = first.stiffness * first.strip.width / first.strip.length
    return StripsProblem(
        tuple(parts),
        tuple(member.strip.length / first.strip.length for member in members),
        tuple(member.stiffness * member.strip.width / member.strip.length / unit for member in members),
        tuple(joints),
        apart / first.strip.length,
        itself,
        mu=friction,
    )


def _check_walls(walls: Sequence[Barrier]) -> None:
    if any(wall.stiffness is not None for wall in walls):
        raise RibbonInputError("walls", len(walls), "walls of several strips are rigid; leave their stiffness out")
    if any(wall.friction and isinstance(wall, Solid) for wall in walls):
        raise RibbonInputError("walls", len(walls), "boxes and edges have no friction; planes and round bodies may")


def _load(member: Member) -> tuple[float, float, float] | None:
    """The force at its end; `RibbonInputError` where a clamp holds that."""
    load = tip_force(member.tip)
    if load is not None and member.end is not None and member.end.position is not None:
        raise RibbonInputError(
            "tip", load, "loads a point that a clamp holds; remove the force, or the clamp's position"
        )
    return load


def _moment(member: Member) -> tuple[float, float, float] | None:
    """The moment at its end; `RibbonInputError` where a clamp holds the frame there."""
    if member.moment is None:
        return None
    try:
        moment = tip_force(member.moment)
    except RibbonInputError:
        raise RibbonInputError("moment", member.moment, "three finite numbers, a moment in D w / l") from None
    if moment is not None and member.end is not None and member.end.holds_frame:
        raise RibbonInputError("moment", moment, "turns a frame that a clamp holds; remove the moment, or the frame")
    return moment


def _by_joint(end: End, joints: Sequence[Joint], rulings: Sequence[str | None]) -> Clamp:
    """What joints leave of an end to be held by itself: nothing but its ruling."""
    ruling = "free"
    for joint, said in zip(joints, rulings, strict=True):
        if end in (joint.one, joint.other):
            straight = said == "straight" or (said is None and joint.kind in ("rigid", "hinge"))
            ruling = "straight" if straight else ruling
    return Clamp(None, None, None, ruling=ruling)


def _check_joints(members: Sequence[Member], joints: Sequence[Joint]) -> None:
    groups: dict[End, int] = {}
    for number, joint in enumerate(joints):
        for end in (joint.one, joint.other):
            if not 0 <= end.strip < len(members) or end.joint not in ENDS:
                raise RibbonInputError("joint", tuple(end), "is no end of a strip")
            if members[end.strip].clamp(end.joint) is not None:
                what = f"{members[end.strip].name or end.strip}.{ENDS[end.joint]}"
                raise RibbonInputError("joint", what, "a clamp holds this end already; remove the clamp or the joint")
        one, other = (
            groups.setdefault(end, len(members) * 2 + 2 * number + k) for k, end in enumerate((joint.one, joint.other))
        )
        if one == other:
            what = f"{members[joint.other.strip].name or joint.other.strip}.{ENDS[joint.other.joint]}"
            raise RibbonInputError("joint", what, "these ends are joined already; remove one of the joints")
        groups = {end: one if group == other else group for end, group in groups.items()}


def _groups(members: Sequence[Member], joints: Sequence[Joint]) -> list[set[int]]:
    """Strips that hang together."""
    found = [{k} for k in range(len(members))]
    for joint in joints:
        one = next(group for group in found if joint.one.strip in group)
        other = next(group for group in found if joint.other.strip in group)
        if one is not other:
            found.remove(other)
            one |= other
    return found


def _components(members: Sequence[Member], joints: Sequence[Joint]) -> int:
    return len(_groups(members, joints))


def _loose(members: Sequence[Member], joints: Sequence[Joint]) -> list[list[int]]:
    """Strips that hang together and that no clamp holds whole."""

    def is_held(member: Member) -> bool:
        return any(clamp is not None and clamp.is_whole for clamp in (member.start, member.end))

    return [sorted(group) for group in _groups(members, joints) if not any(is_held(members[k]) for k in group)]


def shapes(
    problem: StripsProblem, members: Sequence[Member], bend: Sequence[float] | None
) -> list[tuple[FloatArray, FloatArray]]:
    """omega (1/l) and eta (p + 1,) of every strip to begin with; bend: what is added to the curvature of those that
    give none."""
    found = []
    for k, (member, part) in enumerate(zip(members, problem.parts, strict=True)):
        s = np.concatenate([[0.0], np.cumsum(part.lengths)])
        if member.curvature is None:
            omega = law.at(member.strip.curvature, s) + (0.0 if bend is None else bend[k])
        else:
            omega = _values(member.curvature, s) * member.strip.length
        found.append((omega, _values(member.ruling, s)))
    return found


def _values(given: ArrayLike, s: FloatArray) -> FloatArray:
    values = np.atleast_1d(np.asarray(given, dtype=float))
    return np.interp(s, np.linspace(0.0, 1.0, values.size), values) if values.size > 1 else np.full(s.size, values[0])
