"""Starting shapes: omega and eta at the joints, given, or fitted to what is held at the other end.

A shape far from the held end makes a minimiser satisfy the constraints by any means, rulings turned along the strip
among them. A few Gauss-Newton steps on a ribbon of a few segments bring the end near its place first; they need no
energy.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import scipy  # its parts are loaded where they are first used
from numpy.typing import NDArray

from ribbon import law
from ribbon.element import quaternion
from ribbon.problems import mixed_kernels as kernels
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.protocol import Problem

FloatArray = NDArray[np.float64]

#: Segments of the ribbon that is fitted, and weight of the distance to the shape that was asked for.
_PIECES = 8
_WEIGHT = 1e-2
#: Most shapes tried in a fit: one that fits at all needs about 1600.
_MOST_TRIALS = 2000
#: Largest |eta| of a fitted shape (about 60 degrees).
_STEEPEST = 1.7
#: Weight (Gamma) from which a hanging strip begins with its boundary layer, shortest segment there times sqrt(Gamma),
#: and least part of the weight in the clamp's plane of bending.
HEAVY = 100.0
_FIRST_IN_LAYER = 0.3
#: Weight over K^2 from which a naturally curved strip begins pulled out: most of its coils are.
_PULLED_OUT = 2.0
_IN_PLANE = 0.5
#: Distance (l) of held ends below which they are at one place.
_MEETS = 1e-12
#: Mismatch (l, rad) up to which a given shape is near its end's place; the part of it that a fit may leave.
_NEAR, _NEARER = 0.02, 0.5
#: Relative change of a fit's squares, and of its shape, at which a given shape is close enough.
_CLOSE = 1e-2
#: Largest |eta'| w / 2 of a seed beside a clamp that holds the ruling straight.
_STEEP = 0.5


def joints(lengths: FloatArray) -> FloatArray:
    """Abscissae (p + 1,) of the joints, the last exactly 1."""
    s = np.concatenate([[0.0], np.cumsum(lengths)])
    s[-1] = 1.0
    return s


def sampled(values: tuple[float, ...], s: FloatArray) -> FloatArray:
    """A quantity given by `values` at equally spaced abscissae in [0, 1], piecewise linear, at s (k,)."""
    if len(values) == 1:
        return np.full(s.size, values[0])
    return np.interp(s, np.linspace(0.0, 1.0, len(values)), values)


def held_straight(problem: Problem, eta: FloatArray) -> FloatArray:
    """eta (p + 1,) with eta = 0 where a clamp holds the ruling straight, and from there steeply to what was asked for.

    A seed that leaves the plane then leaves it beside such a clamp too, whose bound would flatten a constant ruling.
    """
    s = joints(problem.lengths)
    held = eta.copy()
    if problem.fields.free:
        for clamp, joint in ((problem.start, 0), (problem.end, -1)):
            if problem.fields.held_straight and clamp is not None and clamp.ruling == "straight":
                held[joint] = 0.0
        return held
    for clamp, at in ((problem.start, 0.0), (problem.end, 1.0)):
        if clamp is not None and clamp.ruling == "straight":
            reach = _STEEP / problem.half_width * np.abs(s - at)
            held = np.clip(held, -reach, reach)
    return held


def layer_rate(problem: Problem) -> float | None:
    """One over the length (l) of the layer in which a heavy strip, held at s = 0 only, turns into the weight.

    sqrt(Gamma) times the root of the weight's part in the clamp's plane of bending; None: no such strip, not heavy, or
    one whose natural curvature K keeps it coiled up to the clamp: a coil is pulled out where the weight below it is
    more than K^2 / 2, the elastic energy per length that straightening costs.
    """
    weight = _weight_in_plane(problem)
    if weight is None:
        return None
    pull = problem.strip.gamma * float(np.hypot(*weight))
    curl = max(map(abs, law.values(problem.strip.curvature)))
    return math.sqrt(pull) if pull >= max(HEAVY, _PULLED_OUT * curl * curl) else None


def _weight_in_plane(problem: Problem) -> tuple[float, float] | None:
    """The direction of the weight along t_y and t_z of the clamp; None where something else shapes the strip, or where
    it hangs across its width."""
    start, gravity = problem.start, problem.gravity
    alone = problem.end is None and problem.closure is None and not problem.walls
    if gravity is None or start is None or not start.is_whole or not alone:
        return None
    _, normal, along = -start.frame.T @ np.asarray(gravity.up)
    return (float(normal), float(along)) if math.hypot(normal, along) > _IN_PLANE else None


def hanging(problem: Problem) -> FloatArray | None:
    """omega (p + 1,) of a heavy strip that hangs from its clamp; None where `layer_rate` is.

    theta, from the tangent to the weight, obeys theta'' = Gamma (1 - s) sin(theta): bending moments against the weight
    below a section. With constant tension the solution that decays is theta = 4 atan(tan(theta_0 / 4) exp(-q s)), q =
    sqrt(Gamma); here q s is the integral of q under the tension that falls to zero at s = 1 (Wentzel, Kramers,
    Brillouin). Where segments are longer than the layer, omega is scaled to turn the strip by all of theta_0. The free
    end of a naturally curved strip curls over the length on which K^2 / 2 is more than the weight below, or over Airy's
    length Gamma^(-1/3) of the same equation, if that is longer.
    """
    rate, weight = layer_rate(problem), _weight_in_plane(problem)
    if rate is None or weight is None:
        return None
    s = joints(problem.lengths)
    angle = math.atan2(*weight)
    stretch = 2.0 / 3.0 * (1.0 - (1.0 - s) ** 1.5)
    left = 4.0 * np.arctan(math.tan(0.25 * angle) * np.exp(-rate * stretch))
    omega = -2.0 * rate * np.sqrt(1.0 - s) * np.sin(0.5 * left)  # negative: the tangent turns towards t_y
    turned = float(np.sum(0.5 * (omega[1:] + omega[:-1]) * problem.lengths))
    omega = omega * ((left[-1] - angle) / turned) if turned else omega
    natural = law.at(problem.strip.curvature, s)
    end = natural[-1]
    reach = max(0.5 * end * end / rate**2, rate ** (-2.0 / 3.0))
    return np.asarray(omega + natural * np.exp(-(((1.0 - s) / reach) ** 2)))


def graded(problem: Problem) -> FloatArray:
    """The lengths of the problem's segments, in the layer of `layer_rate` shorter: growing by 1.5 from a part of it;
    the same at the free end of a naturally curved strip, from Airy's length."""
    rate = layer_rate(problem)
    if rate is None:
        return problem.lengths
    most = float(problem.lengths.max())
    found = [min(_FIRST_IN_LAYER / rate, most)]
    last = [min(_FIRST_IN_LAYER * rate ** (-2.0 / 3.0), most)] if problem.has_natural_curvature else []
    while math.fsum(found) + math.fsum(last) < 1.0:
        side = last if last and last[-1] < found[-1] else found
        side.append(min(side[-1] * 1.5, most))
    lengths = np.array([*found, *reversed(last)])
    return lengths / lengths.sum()


def end_mismatch(problem: MixedProblem, x: FloatArray) -> FloatArray:
    """What is missing at the end: position (3,) in l if held, rotation vector (3,) in rad if the frame is held."""
    first, last = problem.layout.joint(0), problem.layout.joint(-1)
    parts = []
    if problem.closure is not None:
        target_r, target_q = x[first.position], quaternion.compose(x[first.quaternion], problem.seam)
    else:
        target_r, target_q = problem.end_position, problem.end_quaternion  # type: ignore[assignment]
    if target_r is not None:
        parts.append(x[last.position] - target_r)
    if target_q is not None:
        parts.append(_rotation_vector(quaternion.compose(quaternion.conjugate(target_q), x[last.quaternion])))
    return np.concatenate(parts) if parts else np.empty(0)


def _rotation_vector(q: FloatArray) -> FloatArray:
    q = q if q[0] >= 0 else -q
    norm = float(np.linalg.norm(q[1:]))
    if norm < 1e-12:
        return 2.0 * q[1:]
    return 2.0 * math.atan2(norm, q[0]) * q[1:] / norm


def _is_plain(problem: MixedProblem) -> bool:
    """Whether position and frame of the start are held, and some of the end's."""
    return problem.start is not None and problem.start.is_whole and problem.end is not None


def _mismatch_from_start(problem: MixedProblem) -> Callable[[FloatArray, FloatArray], FloatArray]:
    """`end_mismatch` of the shape with omega, eta (p + 1,) for a start that is held, asked thousands of times."""
    layout = problem.layout
    none = np.zeros(problem.lengths.size + 1)
    held = problem.state(none, none)
    omega_at, slope_at, eta_at, last = layout.omega, layout.slope, layout.joint(0).eta, layout.joint(-1)
    place, frame = problem.end_position, problem.end_quaternion
    back = None if frame is None else quaternion.conjugate(frame)

    def missed(omega: FloatArray, eta: FloatArray) -> FloatArray:
        x = held.copy()
        x[omega_at], x[eta_at], x[slope_at] = omega, eta[0], np.diff(eta) / problem.lengths
        kernels.walk(problem.fields.free, x, problem.lengths, problem.exponent_limit, problem.sideways)
        parts = [] if place is None else [x[last.position] - place]
        if back is not None:
            parts.append(_rotation_vector(quaternion.compose(back, x[last.quaternion])))
        return np.concatenate(parts) if parts else np.empty(0)

    return missed


def fitted(
    problem: MixedProblem, omega: FloatArray, eta: FloatArray, whole: bool = False
) -> tuple[FloatArray, FloatArray, float]:
    """omega, eta (p + 1,) near the given ones whose end lies near where it is held, and the mismatch.

    The change is linear on _PIECES pieces; so is the shape that is fitted, or (whole) the given one, with its detail.
    """
    s = joints(problem.lengths)
    coarse = np.linspace(0.0, 1.0, _PIECES + 1)
    small = problem if whole else problem.with_changes(lengths=np.full(_PIECES, 1.0 / _PIECES))
    at = s if whole else coarse
    spread = np.stack([np.interp(at, coarse, hat) for hat in np.eye(_PIECES + 1)], axis=1)
    bent, turned = np.interp(at, s, omega), np.interp(at, s, eta)
    scale = np.concatenate([np.full(_PIECES + 1, 1.0 + np.abs(bent).max()), np.ones(_PIECES + 1)])
    steepest = min(_STEEPEST, 0.4 / (problem.half_width * _PIECES) + np.abs(turned).max())
    if whole:  # what is given stands; a free twist is no ruling, which may not be steep
        steepest = np.inf if problem.fields.free else max(steepest, float(np.abs(turned).max()))

    def shape(y: FloatArray) -> tuple[FloatArray, FloatArray]:
        change = (scale * y).reshape(2, -1) @ spread.T
        return bent + change[0], np.clip(turned + change[1], -steepest, steepest)

    def state(y: FloatArray) -> FloatArray:
        return small.state(*shape(y))

    missed = (
        _mismatch_from_start(small) if _is_plain(small) else lambda *there: end_mismatch(small, small.state(*there))
    )

    def residual(y: FloatArray) -> FloatArray:
        return np.concatenate([missed(*shape(y)), _WEIGHT * y])

    close = _CLOSE if whole else 1e-8  # a given shape is brought near; the built-in ones are ranked by what they miss
    found = scipy.optimize.least_squares(
        residual, np.zeros(scale.size), method="lm", ftol=close, xtol=close, max_nfev=_MOST_TRIALS
    )
    x = state(found.x)
    missing = float(np.abs(end_mismatch(small, x)).max(initial=0.0))
    there, turned_there = small.joint_values(x)
    return np.interp(s, at, there), np.interp(s, at, turned_there), missing


def brought(problem: MixedProblem, omega: FloatArray, eta: FloatArray) -> tuple[FloatArray, FloatArray]:
    """omega, eta (p + 1,) of a given shape, `fitted` where its end is not near its place, and that brings it nearer.

    A minimiser that begins far off satisfies the rows first, by steps as long as the ribbon, and forgets on which side
    of the clamps the shape was. What a seed says of a state is its bend: the nearest shape between the clamps keeps it.
    Where the fit changes the bend by more than it is, and by more than a whole turn (root mean square), it has lost it:
    a seed that ends half a turn away may be fitted as a coil. The given shape is then begun with.
    """
    away = float(np.abs(end_mismatch(problem, problem.state(omega, eta))).max(initial=0.0))
    if away <= _NEAR:
        return omega, eta
    there, turned, missing = fitted(problem, omega, eta, whole=True)
    size, change = (float(np.sqrt(np.mean(bend * bend))) for bend in (omega, there - omega))
    kept = missing <= _NEARER * away and change <= max(size, 2.0 * math.pi)
    return (there, turned) if kept else (omega, eta)


def guesses(problem: MixedProblem) -> list[tuple[FloatArray, FloatArray]]:
    """Shapes to start from when the natural one says nothing (a flat strip held at both ends): arcs to either side."""
    s = joints(problem.lengths)
    none = np.zeros(s.size)
    distance = 1.0
    if problem.start_position is not None and problem.end_position is not None:
        distance = float(np.linalg.norm(problem.end_position - problem.start_position))
    arc = 2.0 * math.pi  # ends at one place: a whole circle
    if distance > _MEETS:
        chord = min(distance, 0.999)
        arc = scipy.optimize.brentq(lambda c: math.sin(0.5 * c) / (0.5 * c) - chord, 1e-3, 2.0 * math.pi)
    bend = arc * np.cos(2.0 * math.pi * s)
    return [(sign * shape, none + 0.02) for shape in (np.full(s.size, arc), bend) for sign in (1.0, -1.0)]
