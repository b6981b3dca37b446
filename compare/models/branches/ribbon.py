"""The ribbon over one parameter, as a system that a branch is followed of (`ribbon.find.branch.equations`)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from compare.continuation.point import Point
from compare.continuation.system import System
from compare.models.base import Shape, State
from compare.models.branches import confined
from compare.models.capabilities import BranchStart, Freed
from compare.models.ribbon.build import ribbon_problem
from compare.models.ribbon.state import RibbonShape
from compare.scene.scene import Scene
from ribbon import Equilibrium, RibbonInputError
from ribbon.find.branch.equations import Equations, ProblemAt
from ribbon.find.branch.passages import Grading
from ribbon.find.seeds import held_straight
from ribbon.find.solving.request import How
from ribbon.find.solving.search import from_shape, from_state
from ribbon.find.solving.verdict import judged
from ribbon.judge.stability import STRAIGHT, judge
from ribbon.problems.mixed import MixedProblem
from ribbon.sensitivity.system import Point as Tangent
from ribbon.sensitivity.system import point
from ribbon.solvers import choose
from ribbon.solvers.problem import KNOWN, RESIDUAL_TOLERANCE, Minimum, kkt_residual
from ribbonbench.errors import BadInput

FloatArray = NDArray[np.float64]


def equations(scene_at: Callable[[float], Scene], t: float, found: Equilibrium) -> tuple[Equations, FloatArray]:
    """The system around a ribbon's equilibrium, and its z; scene_at: t, without unit -> the scene there."""
    here = _point(found)

    def problem_at(t: float, lengths: FloatArray) -> MixedProblem:
        try:
            made = ribbon_problem(scene_at(t), "mixed")
        except BadInput as error:
            raise RibbonInputError("scene", t, str(error)) from None
        assert isinstance(made, MixedProblem)
        if made.lengths.shape == lengths.shape and np.array_equal(made.lengths, lengths):
            return made
        return made.with_changes(lengths=lengths)

    return _around(problem_at, t, here)


def _point(found: Equilibrium) -> Tangent:
    """The equilibrium in the unknowns of the glued ribbon; one that touches itself is such a ribbon's."""
    problem = found.problem
    if isinstance(problem, MixedProblem) and problem.pairs and found.ok:
        return Tangent(problem, found.x, found.rows, found.multipliers)
    return point(found, unstable=True)


def _around(problem_at: ProblemAt, t: float, found: Tangent) -> tuple[Equations, FloatArray]:
    """The system around an equilibrium, with what touches there, and its z."""
    own = found.problem
    return Equations.of(
        problem_at, own.lengths, t, found.x, found.rows, found.multipliers, touching=own.touching, pairs=own.pairs
    )


def equilibrium(system: Equations, z: FloatArray, t: float) -> Equilibrium:
    """A point of a branch as the ribbon's solve returns it; its stability is told by the branch."""
    problem = system.problem(t)
    x, rows = system.whole(z, t)
    where = problem.block_slices().get("pairs", slice(0, 0))
    rows[where] = np.where(rows[where] < _NO_PULL, np.minimum(rows[where], 0.0), rows[where])
    bounds = np.where(system.side != 0.0, system.slope(problem, x, rows), 0.0)
    residual = kkt_residual(problem, x, bounds, rows)
    return judged(problem, Minimum(x, bounds, rows, residual, 0, 0, "", True, 0.0, KNOWN), How(check=False))


def refused(scene: Scene, moving: bool = False) -> BadInput | None:
    """Of a strip that keeps its parts from each other what its branches do not know; None: nothing."""
    if scene.apart is None:
        return None
    if scene.round_rod:
        return BadInput(
            "contact.section", "round", "lies along itself, which a branch does not know: its places stay there",
            "go there by a [[path]], or leave it out",
        )  # fmt: skip
    others = {"wall": scene.walls, "obstacle": scene.obstacles, "closure": scene.closure}
    beside = next((what for what, there in others.items() if there), None)
    if beside is not None:
        return BadInput(
            "contact.itself", True, f"beside a {beside} changes what touches along a branch in ways not known: "
            "it would go through itself", "go there by a [[path]], or leave it out (--set contact.itself=false)",
        )  # fmt: skip
    if moving:
        return BadInput(
            "--moving", True, "carries what touches of a strip itself to other elements at every point, which is not "
            "known to keep it", "leave it out, and take more elements",
        )  # fmt: skip
    return None


def branch_start(scene_at: Callable[[float], Scene], state: State, moving: bool = False) -> BranchStart:
    """The branch through a state at t = 0; moving: on as many elements or more, that follow passages of the curvature
    through zero (`ribbon.find.branch.passages`). `BadInput` for a state that is no equilibrium."""
    if not state.is_equilibrium:
        raise BadInput(
            "SCENE", scene_at(0.0).name, f"has no equilibrium where the branch would begin: {state.message}",
            "begin elsewhere (--from), or give a [seed] or a [[path]] that leads there",
        )  # fmt: skip
    between = None if moving else confined.branch_start(scene_at, state)
    if between is not None:
        return between
    system, z = equations(scene_at, 0.0, state.native)
    if moving:
        mean = 1.0 / system.lengths.size
        graded = replace(system, grading=Grading(mean, _LEAST * mean, min(_GROWTH * mean, 1.0)))
        graded.problem(0.0)
        system, z, _ = graded.moved(z, 0.0, np.zeros((z.size, 0)))

    def shape(point: Point) -> Shape:
        assert isinstance(point.system, Equations)
        return RibbonShape(equilibrium(point.system, point.z, point.t))

    def force(point: Point, shape: Shape) -> FloatArray | None:
        assert isinstance(shape, RibbonShape)
        end = shape.equilibrium.end_support
        return None if end is None else end.force

    return BranchStart(state, system, z, shape, lambda count: others(system, z, count), freed, force, downhill=downhill)


def freed(point: Point) -> Freed | None:
    """Where the strip is straight along a stretch its rulings there move nothing, and the unknowns of the branch have
    but one choice of them: the count of unstable modes is that of this choice (docs/theory.md, eq. (6.1), (6.2))."""
    system = point.system
    assert isinstance(system, Equations)
    problem = system.problem(point.t)
    x, rows = system.whole(point.z, point.t)
    straight = np.abs(problem.joint_values(x)[0]) < STRAIGHT
    if problem.fields.free or not (straight[1:] & straight[:-1]).any():
        return None
    bounds = np.where(system.side != 0.0, system.slope(problem, x, rows), 0.0)
    found = judge(problem, Minimum(x, bounds, rows, 0.0, 0, 0, "", True, 0.0, KNOWN))

    def beside() -> Iterator[tuple[System, FloatArray]]:
        bend = problem.joint_values(found.mode)[0]
        omega, eta = problem.joint_values(found.at)
        size, held = float(np.abs(bend).max()), held_straight(problem, eta)
        for push in (_PUSHED, -_PUSHED) if size > 0.0 else ():
            there = from_shape(problem, omega + push / size * bend, held, How(options={"max_iter": _MOST}, check=False))
            own = float(problem.energy_parts(x).sum())
            fell = float(there.problem.energy_parts(there.x).sum()) < own - _LOWER * max(1.0, abs(own))
            if fell and there.residual <= RESIDUAL_TOLERANCE and isinstance(there.problem, MixedProblem):
                yield _around(
                    system.problem_at, point.t, Tangent(there.problem, there.x, there.rows, there.multipliers)
                )

    return Freed(found.stable, beside)


#: Pull (D w / l^2) of parts that touch that is rounding: where they touch first and let go it is nothing.
_NO_PULL = 1e-9
#: Steps downhill that stay on their side (`ribbon.find.minima`).
_SHORT = {"reach": 0.3, "mu_init": 1e-5, "max_iter": 300}


def downhill(point: Point, dz: FloatArray) -> tuple[Equations, FloatArray] | None:
    """Where short steps downhill lead from a point moved by dz: a system and z; None where they end nowhere."""
    system = point.system
    assert isinstance(system, Equations)
    problem = system.problem(point.t)
    x, _ = system.whole(point.z + system.reach(point.z, dz) * dz, point.t)
    with choose.using("newton"):  # the one that knows short steps
        found = from_state(problem, x, How(options=dict(_SHORT), check=False))
    if not found.residual <= RESIDUAL_TOLERANCE or not isinstance(found.problem, MixedProblem):
        return None
    return _around(system.problem_at, point.t, Tangent(found.problem, found.x, found.rows, found.multipliers))


#: Length of an element at a passage over the mean one, and growth with the distance over the mean length.
_LEAST, _GROWTH = 0.2, 10.0
#: Knots and sizes (1/l, none) of random curvatures and rulings; the seed of the committed draws.
_KNOTS, _BENT, _TURNED, _DRAW = 6, 12.0, 0.6, 20261125
#: Iterations of a start at the most.
_MOST = 300
#: Curvature (1/l) by which a straight strip is bent along its unstable mode; change of energy (relative, at least 1) by
#: which it falls.
_PUSHED, _LOWER = 0.3, 1e-9


def others(system: Equations, z: FloatArray, count: int) -> Iterator[tuple[str, Equations, FloatArray]]:
    """Equilibria that the ribbon's minimiser reaches from the images of its own shape (mirrored, turned over, reversed)
    and from `count` random ones."""
    problem = system.problem(0.0)
    x, _ = system.whole(z, 0.0)
    omega, eta = problem.joint_values(x)
    s = np.concatenate([[0.0], np.cumsum(problem.lengths)])
    back = [np.interp(1.0 - s, s, values) for values in (omega, eta)]
    starts = [
        ("its mirror image", omega, -eta),
        ("the other side", -omega, eta),
        ("turned over", -omega, -eta),
        ("its reversal", back[0], -back[1]),
        ("its reversal, turned over", -back[0], back[1]),
    ]
    rng = np.random.default_rng(_DRAW)
    knots = np.linspace(0.0, 1.0, _KNOTS)
    for k in range(count):
        bent, turned = _BENT * rng.normal(size=_KNOTS), _TURNED * rng.normal(size=_KNOTS)
        starts.append((f"random start {k}", np.interp(s, knots, bent), np.interp(s, knots, turned)))
    for name, bend, ruling in starts:
        held = held_straight(problem, ruling)
        found = from_shape(problem, bend, held, How(options={"max_iter": _MOST}, check=False))
        if found.residual <= RESIDUAL_TOLERANCE and isinstance(found.problem, MixedProblem):
            new, at = _around(system.problem_at, 0.0, Tangent(found.problem, found.x, found.rows, found.multipliers))
            yield name, new, at
