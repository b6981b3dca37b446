"""A planar elastica in contact, beside a given shape or along given problems.

What `shellref.elastica.start` gives for problems that let it touch something. Ways are gone in steps of Newton's
method, from what touches at one on to the next.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from ribbonbench import clock
from shellref.elastica.contact.layers import Layers
from shellref.elastica.contact.rows import Beside, Pair
from shellref.elastica.contact.solve import Contact, Touching
from shellref.elastica.fem import Array, stability
from shellref.elastica.held import natural_state
from shellref.elastica.problem import ElasticaForces, ElasticaProblem, LoadPath
from shellref.elastica.result import ElasticaResult, ElasticaStatus, Touch
from shellref.elastica.solve import result_of
from shellref.elastica.system import System


def near(
    problem: ElasticaProblem, joints: Array, degree: int, tolerance: float, s: Array, theta: Array
) -> ElasticaResult | None:
    """The equilibrium beside the shape theta (k,) at s (k,), begun with what touches there; None: none is found, or one
    to which the strip would go through something."""
    began = time.perf_counter()
    system = System(joints, degree, LoadPath(problem, problem))
    contact = Contact(system, degree, tolerance)
    z = np.zeros(system.size)
    z[: system.count] = system.discrete.projected(np.interp(system.discrete.s, s, theta))
    z[system.discrete.given] = [a for a in (problem.start_angle, problem.end_angle) if a is not None]
    found = contact.settle(z, 1.0, None, contact.touching(z, 1.0))
    if found is None or contact.passes(z, found.z, 1.0):
        return None
    contact, found = _fitted(contact, found, joints)
    return _result(problem, degree, contact, found, 1, began)


def along(
    problems: Sequence[ElasticaProblem], joints: Array, degree: int, tolerances: Sequence[float]
) -> ElasticaResult:
    """The end of the way from the natural shape of the first problem to the others in turn; tolerances: of each."""
    began = time.perf_counter()
    here: Touching | None = None
    z: Array | None = None
    steps = iterations = 0
    result: ElasticaResult | None = None
    for (first, last), tolerance in zip(pairwise(problems), tolerances[1:], strict=True):
        system = System(joints, degree, LoadPath(first, last))
        contact = Contact(system, degree, tolerance)
        z = natural_state(system) if z is None else z
        many = _coiled(contact, z)
        here = None if many else contact.settle(z, 0.0, None, () if here is None else here.rows)
        here, taken = (None, 0) if here is None else contact.walk(here)
        if here is None or here.t < 1.0:
            here, taken = _downhill(contact, z if here is None else here.z, here, taken)
        if here is None:
            lost = Touching(0.0, z, (), np.zeros(0), float("nan"), 0)
            return _result(last, degree, contact, lost, steps, began)
        steps, iterations, z = steps + taken, iterations + here.iterations, here.z
        result = _result(last, degree, contact, replace(here, iterations=iterations), steps, began)
        if here.t < 1.0:
            return result
    assert here is not None  # there are two problems or more
    contact, fitted = _fitted(contact, replace(here, iterations=iterations), joints)
    return _result(problems[-1], degree, contact, fitted, steps, began)


def _coiled(contact: Contact, z: Array) -> bool:
    """Whether a strip of some thickness turns by more than a whole turn: layers upon layers."""
    system = contact.system
    turned = system.discrete.angle(z[: system.count], np.array([0.0, 1.0]))
    return bool(system.way.last.apart) and abs(float(turned[1] - turned[0])) > 2.0 * math.pi


def _downhill(contact: Contact, z: Array, here: Touching | None, taken: int) -> tuple[Touching | None, int]:
    """The end of a way from z, downhill in steps of the problem (`shellref.elastica.contact.layers`), as few as it may
    be; where none is found what there was. Without a thickness nothing tells sides there, and nothing is tried."""
    system, t, step = contact.system, 0.0 if here is None else here.t, 1.0
    if not system.way.last.apart and not system.way.last.barriers:
        return here, taken
    while t < 1.0 and step > LEAST and not clock.spent():
        ahead = min(1.0, t + step)
        if contact.crossed(z, z, t, ahead):  # a bar would begin on the other side of the strip
            step *= 0.25
            continue
        layers = Layers(system, contact.degree, contact.tolerance, ahead)
        found = layers.settle(z)
        if not found.found:
            step *= 0.25
            continue
        z, t, taken = found.z, ahead, taken + 1
        here = Touching(t, z, *found.rows(layers.problem), found.norm, found.steps, layers.eigenvalue(found))
    return here, taken


#: Least part of a way that is gone downhill.
LEAST = 1.0 / 300.0
#: How often elements are put to where the strip touches, and how far (l) these places may still move.
FITS, FITTED = 6, 1e-10


def _fitted(contact: Contact, state: Touching, joints: Array) -> tuple[Contact, Touching]:
    """The same equilibrium on elements that end where single forces act: there theta'' jumps, and within an element
    that costs its order. Where it is not found again, as it was."""
    for _ in range(FITS):
        places = np.array(sorted({s for row in state.rows if not row.held
                                  for s in ((row.s, row.other) if isinstance(row, Pair) else (row.s,))}))  # fmt: skip
        nodes = contact.system.discrete.nodes
        if not len(places) or np.abs(places[:, None] - nodes).min(axis=1).max() < FITTED:
            break
        system = System(_ended_at(joints, places), contact.degree, contact.system.way)
        fresh = Contact(system, contact.degree, contact.tolerance)
        z = np.concatenate([np.zeros(system.count), state.z[contact.system.count :]])
        theta = contact.system.discrete.angle(state.z[: contact.system.count], system.discrete.s.ravel())
        z[: system.count] = system.discrete.projected(theta.reshape(system.discrete.s.shape))
        held = contact.system.discrete.given
        z[system.discrete.given] = state.z[held]
        again = fresh.settle(z, state.t, None, state.rows)
        if again is None:
            break
        contact, state = fresh, replace(again, iterations=again.iterations + state.iterations)
    return contact, state


def _ended_at(joints: Array, places: Array) -> Array:
    """Joints with the places among them, the nearest joint inside taken away where it is nearer than a third."""
    found = joints
    for place in places:
        k = int(np.argmin(np.abs(found - place)))
        own = float(np.diff(joints).min())
        if 0 < k < len(found) - 1 and abs(found[k] - place) < 0.4 * own and found[k] not in places:
            found = np.delete(found, k)
        if np.abs(found - place).min() > 1e-12:
            found = np.sort(np.append(found, place))
    return found


def touches(contact: Contact, state: Touching) -> tuple[Touch, ...]:
    """What touches at a state."""
    found = []
    for gap, push in zip(contact.gaps(state.z, state.rows, second=False) or [], state.pushes, strict=False):
        force = push * gap.push
        s, other, place = gap.row.s, None, gap.place
        if isinstance(gap.row, Pair):
            other = gap.row.other
            if other < s:  # the first place is the one of smaller s
                place = place - (gap.gap + gap.row.distance) * gap.push
                s, other, force = other, s, -force
        barrier = gap.row.number if isinstance(gap.row, Beside) else None
        found.append(Touch(s, other, barrier, (float(force[0]), float(force[1])), gap.gap,
                           (float(place[0]), float(place[1]))))  # fmt: skip
    return tuple(sorted(found, key=lambda touch: touch.s))


def forces(contact: Contact, state: Touching) -> ElasticaForces:
    """Forces and couples on both ends: what the supports and the dead force do, beside what touches."""
    system, z = contact.system, state.z
    own = system.forces(z, state.t)
    gaps = contact.gaps(z, state.rows, second=False) or []
    pushed = np.zeros(system.count)
    walls = np.zeros(2)
    for gap, push in zip(gaps, state.pushes, strict=False):
        pushed += push * gap.slope
        walls += push * gap.push if isinstance(gap.row, Beside) else 0.0
    given = set(system.discrete.given.tolist())
    couples = [-float(pushed[dof]) if int(dof) in given else 0.0 for dof in system.discrete.ends]
    start = own.start[0] - float(walls[0]), own.start[1] - float(walls[1])
    return ElasticaForces(start, own.end, own.start_moment + couples[0], own.end_moment + couples[1])


def _result(
    problem: ElasticaProblem, degree: int, contact: Contact, state: Touching, steps: int, began: float
) -> ElasticaResult:
    system = contact.system
    lost = not np.isfinite(state.norm)
    values = np.array([np.nan]) if lost else contact.eigenvalues(state) if state.lowest is None else [state.lowest]
    rounding = system.rounding(state.z, state.t)
    stable = None if lost else stability(float(values[0]), rounding)
    status, message = _verdict(state, stable, float(values[0]), rounding)
    found = result_of(
        problem, degree, False, status, message, system.discrete, state.z[: system.count], system.way.at(state.t),
        state.t, began, forces=forces(contact, state), residual=state.norm, lowest_eigenvalue=float(values[0]),
        rounding=rounding, iterations=state.iterations, steps=steps, snaps=0, limits=0, switches=0,
    )  # fmt: skip
    return replace(found, touches=touches(contact, state), through=contact.through(state))


def _verdict(state: Touching, stable: bool | None, eigenvalue: float, rounding: float) -> tuple[ElasticaStatus, str]:
    if state.t < 1.0:
        where = f"the steps in contact end at {state.t:.6g} of the way"
        return ElasticaStatus.NOT_CONVERGED, f"{where}: use more elements, or begin on another branch"
    count = len(state.rows)
    held = f"touches at {count} place{'s' * (count != 1)}" if count else "touches nothing"
    if stable is False:
        return ElasticaStatus.UNSTABLE, f"equilibrium that {held}, but unstable (lowest eigenvalue {eigenvalue:.3g})"
    if stable is None:
        return ElasticaStatus.CONVERGED, (
            f"equilibrium at a fold that {held}: lowest eigenvalue {eigenvalue:.2g}, rounding {rounding:.2g}"
        )
    return ElasticaStatus.CONVERGED, f"stable equilibrium that {held}"
