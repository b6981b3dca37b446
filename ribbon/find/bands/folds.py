"""Bands of two or more half turns: found as bands of as many folds, which are alike about as many axes.

A strip passes through itself, and loses half turns in pairs: what goes down from a twisted band ends in a circle or a
Moebius band. Among bands of n folds of one hand (`ribbon.problems.alike.fold`) there is no way down to those, so that
the energy of one fold is minimised, and the whole band, folded out, is a stationary point that Newton's iteration only
has to confirm. How many ways lead down from it is told by its inertia. What it has of half turns is counted by linking
numbers, and those that have others than were asked for are passed over.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ribbon.element import quaternion
from ribbon.find import relax
from ribbon.find.bands import whole as _band
from ribbon.problems import transfer
from ribbon.problems.alike import fold as _fold
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.protocol import Problem
from ribbon.solvers import choose
from ribbon.solvers.budget import spent
from ribbon.solvers.newton_near import stationary_near
from ribbon.solvers.problem import NEWTON, RESIDUAL_TOLERANCE, FloatArray, Minimum, kkt_residual
from ribbonbench.linking import half_turns

#: Seeds of a fold: omega = BENT sin, eta = -TILTED sin (over the fold's length, from its first axis to its second); how
#: steep rulings are there at most, over the bound; barrier and most iterations.
_BENT, _TILTED, _STEEP = (1.5, 2.5, 3.5), (0.3, 0.7, 1.2), 0.8
_HOW = {"mu_init": 1e-3, "max_iter": 250}
#: Least segments of a fold's half period; energies (relative) that are the same; residual of the whole band.
_LEAST, _SAME, _EXACT = 4, 1e-6, 1e-10
#: Segments for each half turn on which folds are looked for.
_FEW = 40
#: Difference of segments (relative) up to which they are equal.
_EQUAL = 1e-9
#: Part of the largest omega by which images of places may differ.
_ALIKE = 0.05
#: Part of the width at which the line beside the middle runs that is linked with it.
_BESIDE = 0.25


def is_folded(problem: Problem) -> bool:
    """Whether the band is asked to have two half turns or more."""
    return problem.closure is not None and problem.closure.folded


def is_alike(problem: Problem) -> bool:
    """Whether a band may be alike about axes: nothing but its closure, and a straight ruling there, makes places of it
    differ."""
    start = problem.start
    pinned = start is not None and not problem.fields.free and start.ruling != "straight"
    return not (problem.has_gravity or problem.has_natural_curvature or problem.walls or pinned)


def fitting(problem: MixedProblem) -> MixedProblem:
    """The band on as many equal segments, or a few more, of which a period has a whole number; one whose segments are
    not equal as it is."""
    if np.ptp(problem.lengths) > _EQUAL * problem.lengths[0]:
        return problem
    return _on_equal_segments(problem)[0]


def states(problem: MixedProblem) -> Iterator[Minimum]:
    """Stationary bands of as many half turns as were asked for, by their energy; behind them those of as many folds
    that have others, as the figure of eight, whose half turns undo each other where it crosses itself.

    Folds are looked for on few segments, where none hold creases of their own, and followed to many.
    """
    most = _FEW * _folds(problem)
    if problem.lengths.size > most:
        few = problem.with_changes(lengths=np.full(most, 1.0 / most))
        followed = (beside(few, one.x, problem) for one in states(few))
        yield from (one for one in followed if one is not None)
        return
    band, fold = _on_equal_segments(problem)
    if fold is None:
        return
    found = sorted(_minima(fold), key=lambda one: fold.value(one.x))
    wholes = (_whole(problem, band, fold, one) for one in found)
    others = []
    for whole in wholes:
        if whole is not None and turns(problem, whole.x) == _folds(problem):
            yield whole
        elif whole is not None:
            others.append(whole)
    yield from others


def _minima(fold: _fold.Fold) -> list[Minimum]:
    """The minima that the seeds of a fold lead to, each once."""
    seen: list[Minimum] = []
    with choose.using("ipopt" if choose.asked() == "ipopt" else "newton"):
        for start in _seeds(fold):
            if spent():
                break
            found = relax.once(fold, start, dict(_HOW))
            if not found.residual <= RESIDUAL_TOLERANCE:
                continue
            energy = fold.value(found.x)
            if all(abs(energy - fold.value(one.x)) > _SAME * energy for one in seen):
                seen.append(found)
    return seen


def nothing(problem: MixedProblem) -> Minimum:
    """What there is where no band of so many folds was found: the circle's shape, which is not stationary."""
    n, width = _folds(problem), 2.0 * problem.half_width
    x = problem.state(*_band.circle(problem))
    none, rows = np.zeros(problem.size), np.zeros(problem.row_count)
    return Minimum(
        x=x, multipliers=none, rows=rows, residual=kkt_residual(problem, x, none, rows), iterations=0, code=2,
        message=f"no band of {n} folds was found: one fold, half its l / {n} long, is {2.0 * n * width:.3g} times as "
        f"wide as long, and rulings of a twist that turns it over would cross; fewer half turns, or a narrower strip",
        finished=False, seconds=0.0, solver=NEWTON,
    )  # fmt: skip


def beside(old: MixedProblem, x: FloatArray, problem: MixedProblem) -> Minimum | None:
    """The band of `problem` beside the band x of `old`, on other segments; None where it is not found."""
    band, fold = _on_equal_segments(problem)
    if fold is None:
        return None
    reach = 0.5 / fold.folds
    here = np.concatenate([[0.0], np.cumsum(old.lengths)])
    s = _fold.first_axis(old) + reach * np.concatenate([[0.0], np.cumsum(fold.lengths)])
    omega, eta = (np.interp(s, here, values) for values in old.joint_values(x))
    if turns(old, x) != fold.folds or not _alike(old, x, fold.folds):
        return None
    sideways = old.in_plane_values(x)
    bent = None if sideways is None else reach * np.interp(s, here, sideways)
    found = relax.from_near(fold, fold.state(reach * omega, (reach if fold.fields.free else 1.0) * eta, bent))
    return _whole(problem, band, fold, found) if found.residual <= RESIDUAL_TOLERANCE else None


def shape(problem: MixedProblem) -> tuple[FloatArray, FloatArray] | None:
    """omega and eta (p + 1,) of the weightless, flat band of as many half turns, without what it stands on or rests
    in: where the search for one that is not alike about axes begins; None where there is none."""
    strip = replace(problem.strip, gamma=0.0, natural_curvature=0.0, natural_twist=0.0, natural_geodesic_curvature=0.0)
    bare = problem.with_changes(strip=strip, gravity=None, walls=(), start=None, apart=0.0)
    found = next(states(bare), None)
    return None if found is None else bare.joint_values(found.x)


def _alike(problem: MixedProblem, x: FloatArray, n: int) -> bool:
    """Whether the band is its own image by a turn, to what its segments resolve: omega(s + l/n) = -omega(s)."""
    joints = np.concatenate([[0.0], np.cumsum(problem.lengths)])
    omega = problem.joint_values(x)[0]
    s = joints[joints <= 1.0 - 1.0 / n]
    ahead = np.interp(s + 1.0 / n, joints, omega)
    return bool(np.abs(ahead + omega[: s.size]).max() <= _ALIKE * np.abs(omega).max())


def turns(problem: MixedProblem, x: FloatArray) -> int:
    """Half turns of the closed band x."""
    frames = quaternion.matrix(problem.layout.quaternions(x))[:-1]
    middle = problem.layout.positions(x)[:-1]
    across = _BESIDE * 2.0 * problem.half_width * frames[:, :, 0]
    lines = np.stack([middle + across, middle, middle - across], axis=1)
    assert problem.closure is not None
    return round(abs(half_turns(lines, problem.closure.sign < 0)))


def _folds(problem: MixedProblem) -> int:
    assert problem.closure is not None
    assert problem.closure.half_turns is not None
    return problem.closure.half_turns


def _on_equal_segments(problem: MixedProblem) -> tuple[MixedProblem, _fold.Fold | None]:
    """The band on as many equal segments, or more, of which a period has a whole number, and its fold; None: a fold
    would be wider than long."""
    n = _folds(problem)
    count = max(_LEAST, math.ceil(problem.lengths.size / n)) * n
    band = problem
    if count != problem.lengths.size or np.ptp(problem.lengths) > _EQUAL / count:
        band = problem.with_changes(lengths=np.full(count, 1.0 / count))
    return band, None if 4.0 * n * problem.half_width >= 1.0 else _fold.fold_of(band, n)


def _seeds(fold: _fold.Fold) -> Iterator[FloatArray]:
    wave = np.sin(0.5 * math.pi * np.concatenate([[0.0], np.cumsum(fold.lengths)]))
    for bent in _BENT:
        for tilted in _TILTED:
            turned = -tilted * wave
            if fold.fields.free:
                turned = bent * wave * turned
            else:
                steep = float(np.max(np.abs(np.diff(turned)) / fold.lengths)) * fold.half_width
                turned *= min(1.0, _STEEP / steep)
            yield fold.state(bent * wave, turned)


def _whole(problem: MixedProblem, band: MixedProblem, fold: _fold.Fold, found: Minimum) -> Minimum | None:
    """The band of a fold, on the segments of `problem`; None where Newton's iteration leads away from it."""
    clock = time.perf_counter()
    x = _fold.unfolded(fold, found.x, band)
    count = turns(band, x)
    whole = stationary_near(band, x, _EXACT)
    if whole is not None and band is not problem:
        whole = stationary_near(problem, transfer.transferred(band, whole.x, problem), _EXACT)
    if whole is None or turns(problem, whole.x) != count:
        return None
    return replace(
        whole, iterations=whole.iterations + found.iterations, seconds=found.seconds + time.perf_counter() - clock,
        residual=kkt_residual(problem, whole.x, whole.multipliers, whole.rows),
    )  # fmt: skip
