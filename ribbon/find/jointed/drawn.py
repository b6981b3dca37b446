"""A strip that begins in a drawn curve: made smooth as a polygon, framed, and gone downhill of without going through
itself; and a state as one on segments that follow what touches.

The frame begins at the first clamp's and is carried along the curve without twist (R. L. Bishop 1975); what is missing
at the other clamp, an angle a there, is a constant twist tau = a / l. Turned by phi = a s / l about the tangent, the
carried normal w and its cross product with the tangent have the curvature vector's parts k_1 and k_2, so that

    omega = -(k_1 cos phi - k_2 sin phi) ,   kappa_2 = k_2 cos phi + k_1 sin phi ,

since t_z' = -omega t_y + kappa_2 t_x, t_x = t_y x t_z. A rod that may turn about the axis of its clamps for nothing
begins turned to where its row holds it (`ribbon.problems.alike`): turned there by a search it loses its shape.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ribbon.errors import RibbonInputError
from ribbon.find import snap
from ribbon.find.jointed import polygon, rounds
from ribbon.find.jointed import touching as touch
from ribbon.find.jointed.path import refined
from ribbon.find.jointed.rounds import Jointed, settled
from ribbon.find.jointed.wound import link
from ribbon.find.seeds import joints
from ribbon.find.solving import search
from ribbon.find.solving.assemble import assembled
from ribbon.find.solving.request import How, Progress, Request
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.transfer import transferred
from ribbon.result import Equilibrium, Status
from ribbon.solvers.budget import spent, within

FloatArray = NDArray[np.float64]

#: Edges of the polygon; how far its strands are apart at first, over the distance that they keep.
EDGES, CLEAR = 160, 1.1
#: Distance (l) of strands that keep none, from which a polygon's push each other away.
_THIN = 1e-3
#: How near (l) to the axis of the clamps a place says no side of it.
_ON_AXIS = 1e-6
#: How often a state is gone downhill of again, on segments that end where it touches.
_LANDINGS = 3
#: Turns by which the link of a state may be other than the drawn curve's.
_WOUND = 0.5
_LOST = "not converged: it is linked"


def ends_of(problem: MixedProblem) -> polygon.Ends:
    """Where the problem holds a curve. `RibbonInputError` where it does not hold both ends whole."""
    start, end = problem.start, problem.end
    if start is None or end is None or not (start.is_whole and end.is_whole):
        raise RibbonInputError("curve", None, "a drawn curve is held at both ends: give position and frame of both")
    assert start.position is not None
    assert end.position is not None
    first, last = np.asarray(start.position, dtype=float), np.asarray(end.position, dtype=float)
    return polygon.Ends(first, last, np.asarray(start.frame)[:, 2], np.asarray(end.frame)[:, 2])


def unknowns(problem: MixedProblem, curve: ArrayLike) -> FloatArray:
    """Unknowns (n,) of a drawn curve, points (k, 3) in l in the order of s, between the problem's clamps.

    `RibbonInputError` where the problem does not bend in the strip's plane, or does not hold both ends."""
    if not problem.fields.in_plane:
        raise RibbonInputError(
            "curve", None, 'a curve in space bends in the strip\'s plane too: choose energy = "kirchhoff"'
        )
    ends = ends_of(problem)
    points = np.asarray(curve, dtype=float)
    smooth = polygon.relaxed(points, CLEAR * (problem.apart or _THIN), EDGES, ends).points
    frame = np.asarray(problem.start.frame)  # type: ignore[union-attr]
    if problem.spins:
        smooth = _turned(smooth, ends, frame[:, 1])
    s = joints(problem.lengths)
    one, other, arrives, _ = polygon.fields(smooth, s, ends, frame[:, 1])
    held = np.asarray(problem.end.frame)[:, 1]  # type: ignore[union-attr]
    angle = float(np.arctan2(np.cross(arrives, held) @ ends.arrives, arrives @ held))
    turned = angle * s
    omega = -(one * np.cos(turned) - other * np.sin(turned))
    return problem.state(omega, np.full(s.size, angle), other * np.cos(turned) + one * np.sin(turned))


def _turned(points: FloatArray, ends: polygon.Ends, normal: FloatArray) -> FloatArray:
    """Points (k, 3) turned about the axis of the ends, the shorter way, until the place halfway is in the plane of the
    axis and `normal` (3,)."""
    from scipy.spatial.transform import Rotation

    axis = ends.leaves
    middle = np.array([np.interp(0.5, np.linspace(0.0, 1.0, len(points)), points[:, k]) for k in range(3)]) - ends.first
    out, aside = float(middle @ normal), float(middle @ np.cross(axis, normal))
    if np.hypot(out, aside) < _ON_AXIS:
        return points
    angle = np.arctan2(aside, out)
    angle -= np.pi * np.round(angle / np.pi)
    return np.asarray(Rotation.from_rotvec(-angle * axis).apply(points - ends.first) + ends.first)


def solved(
    request: Request,
    curve: ArrayLike,
    how: How | None = None,
    budget: float | None = None,
    *,
    begin: FloatArray | None = None,
    look: snap.Look | None = None,
) -> Equilibrium:
    """The equilibrium downhill of a drawn curve, points (k, 3) in l; budget: time in s on the processor; look: told
    the unknowns on the way, and `begin`, of those (n,), goes on from there.

    Of a strip that is kept apart from itself the way there leads through no part of it. `RibbonInputError` as
    `unknowns`."""
    problem = assembled(request)
    if not isinstance(problem, MixedProblem):
        raise RibbonInputError("curve", None, 'a drawn curve needs formulation = "mixed"')
    how = how or How()
    with within(budget):
        first = unknowns(problem, curve)
        x = first if begin is None or begin.shape != first.shape else begin
        if not problem.apart:
            return search.from_state(problem, x, how)
        return _as_drawn(problem, first, snap.landed(problem, x, how, look))


def _as_drawn(problem: MixedProblem, first: FloatArray, state: Equilibrium) -> Equilibrium:
    """The state, NOT_CONVERGED where it is wound about itself in another way than the unknowns `first` (n,): looks at
    the way there see no passage through a strip whose segments do not meet yet."""
    if not np.all(np.isfinite(state.x)):
        return state
    changed = link(state.problem, state.x) - link(problem, first)  # type: ignore[arg-type]
    if abs(changed) < _WOUND:
        return state
    text = (
        f"{_LOST} by {changed:+.2g} turns other than the drawn curve (it went through itself, or "
        "about a clamp): take more segments"
    )
    return replace(state, status=Status.NOT_CONVERGED, stable=None, message=text, notes=())


def following(state: Equilibrium, budget: float | None = None, progress: Progress | None = None) -> Equilibrium:
    """An equilibrium of a round rod on segments that follow what touches in it (`Equilibrium.jointed`); the state
    itself where it is none, and NOT_CONVERGED where none is found on those."""
    deep = state.status is Status.NOT_CONVERGED and state.residual <= rounds.RESIDUAL_TOLERANCE
    deep = deep and not state.message.startswith(_LOST)
    if state.status not in (Status.CONVERGED, Status.SADDLE) and not deep:
        return state  # what is too deep between segments that stand still need not be on those that follow
    problem = state.problem
    assert isinstance(problem, MixedProblem)
    length, here = 1.0 / problem.lengths.size, state
    with within(budget):
        for landings in range(_LANDINGS + 1):
            found = settled(problem, Jointed(here, rounds.begun(here).on(length), length))
            if found is not None or landings == _LANDINGS or spent():
                break
            here = _landed_again(problem, here, length, progress)
        return _joined(state, found)


def _landed_again(problem: MixedProblem, state: Equilibrium, length: float, progress: Progress | None) -> Equilibrium:
    """Downhill of a state on segments that end where it touches: a rod that slides along itself at next to no change of
    its energy is held where segments stand, and has far to go when they do not."""
    old = state.problem
    assert isinstance(old, MixedProblem)
    s, _ = touch.joints(rounds.begun(state).on(length), length, rounds.is_ring(problem))
    fresh = problem.with_changes(lengths=np.diff(s), pairs=()).anchored(old.anchor(state.x))
    return snap.landed(fresh, transferred(old, state.x, fresh), How(check=False, progress=progress))


def halved(state: Equilibrium) -> Equilibrium:
    """The state of `following` on halved segments; NOT_CONVERGED where it is not found there."""
    here = state.jointed
    assert isinstance(here, Jointed)
    problem = state.problem
    assert isinstance(problem, MixedProblem)
    return _joined(state, refined(problem, here))


def _joined(state: Equilibrium, found: Jointed | None) -> Equilibrium:
    if found is None:
        text = "not converged: no equilibrium was found on segments that follow what touches"
        return replace(state, status=Status.NOT_CONVERGED, stable=None, message=text, notes=(), jointed=None)
    fresh = found.state
    whole = replace(fresh, log=state.log, iterations=fresh.iterations + state.iterations)
    return replace(whole, jointed=replace(found, state=whole))
