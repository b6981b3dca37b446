"""Other states of a strip that is held at one end: of lower energy than the one that was found, or near a shape.

A strip with one clamp may rest in several states all the same. Where a heavy one is bent and twisted at its clamp, the
curvature may pass zero beside it: the ruling flips there (omega and eta change sign, the twist omega eta keeps its
own), within a layer about one width long (`ribbon.find.minima`). With and without such a flip the strip hangs apart by
several percent of l, and which one has the lower energy no seed tells.

The `probe` solves the strip with rulings anew, three times (Sadowsky's where the twist is free, which is one more),
from the state with the signs of curvature and ruling changed beside the clamp (within one and two widths), and with its
twist reversed. That is a fifth of what a choice by accuracy takes. Kicks along the lowest mode, both ways and up
to four times the largest curvature, led back on every scene tried, and are not among them. Nothing here proves that
there is no rival: a state that the probe does not reach is not seen.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from compare.measure.curvatures import curvatures
from compare.measure.distance import grid_hausdorff
from compare.measure.grades import GOOD_UP_TO
from compare.models.capabilities import Rival

if TYPE_CHECKING:
    from compare.models.base import Shape
    from compare.scene.scene import Scene
    from ribbon import Equilibrium

    #: Of which the probe was asked, and what it said.
    Probed = tuple[Equilibrium, Rival | None]

FloatArray = NDArray[np.float64]

#: Lengths beside the clamp, in widths, on which the ruling is flipped.
LAYERS = (1.0, 2.0)
#: The strip that is probed where the twist is free: it costs the least, and its flips are sharp.
PROBED = "sadowsky"
#: Energies whose strip of finite thickness is the one with energy "finite"; each is probed with its own.
RULED = ("sadowsky", "wunderlich")
#: Solves of a probe: one for each layer, and the twist reversed.
TRIES = len(LAYERS) + 1
#: Distance (Hausdorff / l) from which a state is another one, and difference of energies (relative, at least 1) from
#: which one is lower.
APART = GOOD_UP_TO["distance"]
_LOWER = 1e-6
#: Times as far from the ribbon as the state on its one side may be the one on the other.
FARTHER = 2.0
#: Least curvature (1/l) by which a twist is divided to make a ruling, and largest ruling (eta) of a start.
_BENT, _STEEPEST = 0.3, 1.5
_ALONG, _ACROSS = 200, 2
#: Part of the largest curvature, and of a ruling of 1, by which a state that was led back differs: a start that stops
#: early ends within 1e-5 of it, other states are 1e-2 away and more.
_NEAR = 1e-4


def is_probed(scene: Scene) -> bool:
    """Whether a lower state is looked for: of a strip that is held at one end and hangs free. Where a scene may have
    several equilibria for its holds, its seed or path says which one is meant (`Scene.several_equilibria`)."""
    return not (scene.several_equilibria or scene.barriers or scene.closure is not None or scene.path)


def probe(scene: Scene, equilibrium: Equilibrium) -> Rival | None:
    """The lowest rival of a stable equilibrium of the scene that the probe sees; None: none, or none was looked for
    (`is_probed`)."""
    if not equilibrium.ok or not is_probed(scene):
        return None
    here = _counterpart(scene, equilibrium) if equilibrium.problem.fields.free else equilibrium
    if here is None or not here.ok or here.problem.row_count:
        return None
    own = here.energy.total
    surface = here.surface(_ALONG, _ACROSS).grid
    best: Rival | None = None
    for omega, eta in _starts(here, scene.width):
        there = _rest(here, omega, np.clip(eta, -_STEEPEST, _STEEPEST))
        if there is None:
            continue
        energy = there.energy.total
        if not there.ok or energy >= (own if best is None else best.energy) - _LOWER * max(1.0, abs(own)):
            continue
        apart = grid_hausdorff(surface, there.surface(_ALONG, _ACROSS).grid)
        if apart > APART:
            best = Rival(here.problem.energy, float(energy), float(own), apart)
    return best


def probe_once(scene: Scene, equilibrium: Equilibrium, seen: Probed | None = None) -> Rival | None:
    """`probe`, which is not asked twice of one equilibrium; seen: what is known of one."""
    return seen[1] if seen is not None and seen[0] is equilibrium else probe(scene, equilibrium)


def _rest(here: Equilibrium, omega: FloatArray, eta: FloatArray) -> Equilibrium | None:
    """Where the strip of `here` comes to rest from omega and eta (p + 1,) of its joints; None: there.

    First as exactly as a start needs: nine of ten are led back to `here`, which is known. A start has kinks:
    where Newton's iteration stops on the way it begins once more there, before anything that takes ten times as long is
    asked.
    """
    from ribbon.find.relax import placed
    from ribbon.find.solve import solve_from, solve_shape
    from ribbon.solvers import choose, newton

    problem: Any = here.problem
    with choose.using("newton"), np.errstate(over="ignore", invalid="ignore"):
        first = newton.minimise(problem, placed(problem, omega, eta), rough=True)
        if _same(here, first.x):
            return None
        if np.all(np.isfinite(first.x)):
            there = solve_from(problem, first.x)
            if there.ok:
                return there
    return solve_shape(problem, omega, eta)


def _same(here: Equilibrium, x: FloatArray) -> bool:
    """Whether the unknowns x (n,) are those of `here` but for what an iteration that stops early may leave."""
    values, own = here.problem.joint_values(x), here.problem.joint_values(here.x)
    return all(
        bool(np.abs(there - known).max() <= _NEAR * max(1.0, float(np.abs(known).max())))
        for there, known in zip(values, own, strict=True)
    )


def either_side(
    scene: Scene, equilibrium: Equilibrium, best: Equilibrium, seen: dict[int, float] | None = None
) -> tuple[Equilibrium, ...]:
    """`best`, the strip with energy "finite" that was found from the ribbon `equilibrium`
    (`compare.models.ribbon.neglected.beside`), and where there is one the state on the ribbon's other side.

    A ribbon without thickness may rest between two states of the strip that has some, as a column between both sides to
    which it buckles: a shell that begins at the ribbon's surface goes to one of them, and the strip with energy
    "finite" to the other. So it is begun once more where curvature and twist lie as far on the other side of the
    ribbon's. What it comes to counts when it stays on that side, no more than `FARTHER` times as far, without new
    inflections; not looked for where the first is so near that neither keeps a distance from being good. seen: gets the
    distance to `best` by its id, for `neglected.to_shell`.
    """
    from compare.models.ribbon.neglected import apart, grid_of, inflections
    from ribbon.find.solve import solve_from

    grid = grid_of(scene, best)
    moved = apart(equilibrium, best, grid)
    if seen is not None:
        seen[id(best)] = moved
    if FARTHER * moved <= APART:
        return (best,)
    omega, eta = equilibrium.problem.joint_values(equilibrium.x)
    twist = eta if equilibrium.problem.fields.free else eta * omega
    there = best.problem.joint_values(best.x)
    problem: Any = best.problem
    other = solve_from(problem, problem.state(2.0 * omega - there[0], 2.0 * twist - there[1]), leave_saddle=True)
    if not other.ok or inflections(other) > max(inflections(equilibrium), inflections(best)):
        return (best,)
    beside = moved < apart(best, other, grid) and apart(equilibrium, other, grid) <= FARTHER * moved
    return (best, other) if beside else (best,)


def _starts(equilibrium: Equilibrium, width: float) -> Iterator[tuple[FloatArray, FloatArray]]:
    """omega and eta (p + 1,) of the starts: a flip beside the clamp, the twist reversed."""
    s = np.concatenate([[0.0], np.cumsum(equilibrium.problem.lengths)])
    omega, eta = equilibrium.problem.joint_values(equilibrium.x)
    for widths in LAYERS:
        sign = np.where(s < widths * width, -1.0, 1.0)
        yield sign * omega, sign * eta
    yield omega, -eta


def _counterpart(scene: Scene, equilibrium: Equilibrium) -> Equilibrium | None:
    """The strip of `PROBED` that rests near one with a free twist."""
    from compare.models.ribbon.build import ribbon_problem
    from ribbon.errors import RibbonInputError
    from ribbon.find.solve import solve_shape
    from ribbonbench.errors import BadInput

    plain = scene.replace({"model.energy": PROBED, "model.accuracy": None, "model.stiffness": None})
    try:
        problem: Any = ribbon_problem(plain).with_changes(lengths=equilibrium.problem.lengths)
    except (BadInput, RibbonInputError):
        return None
    omega, twist = equilibrium.problem.joint_values(equilibrium.x)
    return solve_shape(problem, *_ruled(omega, twist))


def _ruled(omega: FloatArray, twist: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Curvature and ruling of a curvature and a twist (k,)."""
    bent = np.where(np.abs(omega) < _BENT, np.where(omega < 0.0, -_BENT, _BENT), omega)
    return omega, np.clip(twist / bent, -_STEEPEST, _STEEPEST)


def near(equilibrium: Equilibrium, shape: Shape, finer: int = 1) -> Equilibrium:
    """Where the strip of `equilibrium`, on its own segments cut into `finer` parts each, comes to rest from another
    model's shape; whatever its status.

    The start has the shape's curvature and twist at the joints (`compare.measure.curvatures`) and, where nothing holds
    a frame, stands as the shape does: a strip on a table rests on its ends or, the other way up, on its middle.
    """
    from ribbon.find.solve import solve_shape

    problem: Any = equilibrium.problem
    if problem.row_count and problem.start_quaternion is None and problem.end_quaternion is None:
        problem = problem.anchored(_pose(shape))
    if finer > 1:
        problem = problem.with_changes(lengths=np.repeat(problem.lengths / finer, finer))
    s = np.concatenate([[0.0], np.cumsum(problem.lengths)])
    s[-1] = 1.0
    kappa = curvatures(shape.frames, s)
    omega, twist = kappa[:, 0], kappa[:, 2]
    start = (omega, twist) if problem.fields.free else _ruled(omega, twist)
    return solve_shape(problem, *start, leave_saddle=True)


def _pose(shape: Shape) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Quaternion and position (l) of the start of a shape, as `ribbon.problems.held.Held.anchored` takes them."""
    from ribbon.element import quaternion

    first = np.zeros(1)
    return tuple(quaternion.from_matrix(shape.frames(first)[0]).tolist()), tuple(shape.centreline(first)[0].tolist())
