"""One fast model, the ribbon, against shells of several w/h: distances, energies, errors, times (thesis, 4.3).

Every row carries three lengths (design rule 7): the distance between the two models, and the discretisation error of
each. The ribbon's error is extrapolated from its own solutions on segments cut in two and in four
(`compare.measure.error`); the shell's is the distance between
its solution and that on a mesh with half as many elements each way, which bounds the finer mesh's own error from above
as long as halving the elements more than halves the error; where `shell.tolerance` refines the mesh, the estimate that
comes with it. A difference between the models is claimed only when the distance exceeds the sum of both errors.

The shell begins at the ribbon's surface and settles at the full load (`shell.start`). Where a scene has several
equilibria (two clamps, a path, a saddle left), both are then on one branch; where it has one, the beginning is refused
unless the shell's own path, on a coarse mesh, leads to the same state. The shell's equilibrium satisfies its own
equations all the same, wherever it began.

Two models are compared in one state, or not at all (`compare.models.same_state`). Where the shell's own path does not
end in the ribbon's it is begun once more, at the ribbon's surface, and the lower of its two states is taken; the ribbon
is begun at the shell's. Where both are in different states after that, the distance is none between models, and no
difference, slope or grade is made of it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.measure.align import alignment, both
from compare.measure.distance import centreline_distance, grid_hausdorff
from compare.measure.grid import Grid
from compare.models import RICHEST, model
from compare.models.base import BESIDE, Model, Options, Shape, State, Variant, check_keys
from compare.models.choice import beside_the_shell, settled, third_opinion
from compare.models.effects.price import check_price
from compare.models.quantities import NO_LENGTH
from compare.models.same_state import SETTLED, Same, same_state
from compare.models.scope import require_shell
from compare.page.pair import Row, Times
from compare.scene.scene import Scene
from compare.store.progress import Reporter
from compare.store.store import CaseStore
from ribbonbench.errors import BadInput, Missing, ShellMissing

FloatArray = NDArray[np.float64]

#: How the start of a shell is called whose own path ended above what is reached from the surface beside it.
OWN_IS_HIGHER = f"{BESIDE} (its own path ends higher)"
#: Part of the energy (at least 1) by which a state is lower than another.
LOWER = 1e-6


@dataclass(frozen=True)
class Slope:
    """Least-squares slope of log(distance) against log(h/w) over the claimed rows; spread: of the slopes between
    neighbouring rows, smallest and largest."""

    value: float
    rows: int
    spread: tuple[float, float]


@dataclass(frozen=True)
class Comparison:
    """A finished comparison: `fast` is the model beside the shells (the ribbon, unless the scene chooses another), with
    its own error, the thinnest one where it depends on the thickness; elastica: the third opinion of planar scenes;
    `shells` holds the states in the order of `rows`, `beside` the fast model's, one for all rows or one for each."""

    scene: Scene
    fast: State
    elastica: State | None
    elastica_distance: float | None
    rows: tuple[Row, ...]
    shells: tuple[State, ...]
    grid: Grid
    slope: Slope | None
    beside: tuple[State, ...] = ()

    @property
    def ok(self) -> bool:
        """Every solve converged to a stable equilibrium."""
        fast = all(state.ok for state in self.beside or (self.fast,))
        return fast and all(row.status == "converged" for row in self.rows)

    @property
    def falls(self) -> bool | None:
        """Whether the distance falls as h/w falls, over the claimed rows; None with fewer than two of them."""
        claimed = sorted((r.width_to_thickness, r.hausdorff) for r in self.rows if r.claimed and r.hausdorff)
        if len(claimed) < 2:
            return None
        return all(later < earlier for (_, earlier), (_, later) in pairwise(claimed))


def fit_slope(rows: tuple[Row, ...]) -> Slope | None:
    """Slope over the rows whose distance is claimed; None with fewer than two of them."""
    pairs = sorted((1.0 / r.width_to_thickness, r.hausdorff) for r in rows if r.claimed and r.hausdorff)
    if len(pairs) < 2:
        return None
    x, y = np.log(np.array(pairs, dtype=float)).T
    steps = np.diff(y) / np.diff(x)
    return Slope(float(np.polyfit(x, y, 1)[0]), len(pairs), (float(steps.min()), float(steps.max())))


def compare(
    scene: Scene, store: CaseStore, reporter: Reporter, *, leave_saddle: bool | None = None, bare: bool = False
) -> Comparison:
    """Runs the scene's model, the elastica where the scene is planar, and one shell per w/h of the scene.

    Finished shell cases are taken from `store` and new ones are kept there at once; the state of an interrupted path of
    the ribbon stands beside them. leave_saddle: as in `compare.models.base.Options`. bare: the distances and
    their errors alone, without the elastica, and without solves that are repeated for their warm time.

    Raises `ShellMissing`, with the scene's own model's answer, where no shell can be run here.
    """
    require_shell(scene)
    shell, quick = model(RICHEST), beside_the_shell(scene)
    for one in (shell, quick):  # what a model refuses, or would ignore, is said before anything is solved
        check_keys(one, scene)
    check_price(scene)
    repeats = 0 if bare else None
    requested = Options(leave_saddle=leave_saddle, error=True, repeats=repeats, store=store)
    own = one_energy(quick.variants(scene))
    beside = tuple(quick.solve(variant.scene, options=requested, say=reporter) for variant in own)
    fast = beside[-1]
    grid = Grid.for_shape(scene, max(state.shape.bend if state.shape is not None else 1.0 for state in beside))
    lines = [_on_grid(state, grid) for state in beside]
    third = None if bare else third_opinion(scene, quick)
    elastica = None if third is None else _beside(third, scene, fast, reporter)
    planar = None if elastica is None or elastica.shape is None else elastica.shape.centreline(grid.s)
    several = scene.several_equilibria or bool(leave_saddle) or fast.left_saddle is not None
    rows: list[Row] = []
    shells: list[State] = []
    for k, variant in enumerate(shell.variants(scene)):
        k = min(k, len(beside) - 1)  # one for all, or one for each
        near = beside[k].shape if beside[k].stands else None
        options = Options(error=True, store=store, fallback=True, grid=grid, selects=several)
        try:
            state = shell.solve(variant.scene, near=near, options=options, say=reporter)
            same = same_state(quick, own[k].scene, beside[k], state, grid)
            if near is not None and same.answer is not True and state.start not in SETTLED:
                state, same = lower_state(
                    shell, variant, state, same, quick, own[k].scene, beside[k], options, reporter
                )
        except Missing as why:
            raise ShellMissing(why, own[-1].scene, fast) from why
        rows.append(_row(beside[k], grid, *lines[k], planar, variant, state, same))
        shells.append(state)
    found = tuple(rows)
    line = lines[-1][1]
    apart = None if planar is None or line is None else centreline_distance(line, planar)
    return Comparison(scene, fast, elastica, apart, found, tuple(shells), grid, fit_slope(found), beside)


def _beside(third: Model, scene: Scene, fast: State, reporter: Reporter) -> State | None:
    """The third opinion, begun at the shape of `fast`; None where it is not to be had, which is told."""
    try:
        return third.solve(
            scene, near=fast.shape if fast.ok else None, options=Options(error=True, repeats=None), say=reporter
        )
    except ModuleNotFoundError as error:  # an optional library
        reporter.aside(f"without the elastica beside it: {error.name} is not installed")
    except BadInput as refused:  # it is not beside that shape, and cannot go the scene's own path, which leaves a plane
        reporter.aside(f"without the elastica beside it: {refused.key} {refused.problem}")
    return None


def one_energy(variants: tuple[Variant, ...]) -> tuple[Variant, ...]:
    """Variants of several w/h with one energy, where the scene leaves it open: the one chosen for the thickest strip,
    which is near enough to thinner shells too. Distances of several models would make no slope and no limit."""
    if len(variants) < 2 or variants[0].scene.model.accuracy is None:
        return variants
    thickest = min(variants, key=lambda variant: variant.keys["width_to_thickness"])
    energy = settled(thickest.scene).model.energy
    named = {"model.energy": energy, "model.accuracy": None}
    return tuple(replace(variant, scene=variant.scene.replace(named)) for variant in variants)


def lower_state(
    shell: Model,
    variant: Variant,
    state: State,
    same: Same,
    quick: Model,
    scene: Scene,
    fast: State,
    options: Options,
    say: Reporter | None = None,
) -> tuple[State, Same]:
    """The lower of two states of a shell, and whether it is that of the model beside it (`fast`, of the model `quick`
    on `scene`): `state`, where its own path ended, which is not known to be, and the one that is reached from the
    surface of `fast`. `state` itself where the scene says where its shell begins, or where nothing stable is found from
    there."""
    assert options.grid is not None
    own = None if state.energy is None else state.energy.total
    if variant.scene.shell.start != "auto" or options.selects or not state.ok or own is None:
        return state, same
    there = shell.solve(variant.scene, near=fast.shape, options=replace(options, error=False, selects=True), say=say)
    its = None if there.energy is None else there.energy.total
    if not there.ok or its is None:
        why = f"begun at the surface of the {fast.model} the shell finds no stable state ({there.word})"
        return state, replace(same, again=why)
    if not its < own - LOWER * max(1.0, abs(own)):
        why = f"begun at the surface of the {fast.model} the shell rests no lower, at {its:.6g} D w / l"
        return state, replace(same, again=why)
    there = shell.solve(variant.scene, near=fast.shape, options=replace(options, selects=True), say=say)
    there = replace(there, start=OWN_IS_HIGHER)
    found = same_state(quick, scene, fast, there, options.grid)
    why = f"the shell's own path ends higher, at {own:.6g} for {its:.6g} D w / l"
    return there, replace(found, again=why)


def _on_grid(state: State, grid: Grid) -> tuple[FloatArray | None, FloatArray | None]:
    """Surface and centreline of a state on the grid; None where it has no shape."""
    if state.shape is None:
        return None, None
    return grid.of(state.shape), state.shape.centreline(grid.s)


def _row(
    fast: State,
    grid: Grid,
    fast_points: FloatArray | None,
    fast_line: FloatArray | None,
    planar_line: FloatArray | None,
    variant: Variant,
    state: State,
    same: Same,
) -> Row:
    """The row of one shell; without a converged surface it keeps the status and no distances."""
    hausdorff = centreline = planar = laid = None
    shape: Shape | None = state.shape if state.stands else None
    if shape is not None:
        line = shape.centreline(grid.s)
        if fast_points is not None and fast_line is not None:
            points = grid.of(shape)
            laid = alignment(fast_points, points, both(fast.motions, state.motions))
            hausdorff = grid_hausdorff(laid.of(fast_points), points)
            centreline = centreline_distance(laid.particles(fast_line[:, None])[:, 0], line)
        if planar_line is not None:
            planar = centreline_distance(planar_line, line)
    known = hausdorff is not None and state.error is not None and fast.error is not None and same.answer is True
    claimed = known and hausdorff > state.error + fast.error  # type: ignore[operator]
    seconds = state.seconds.warm
    mesh = tuple(int(value) for value in state.size.values)
    return Row(
        width_to_thickness=variant.keys["width_to_thickness"],
        status=state.word,
        stable=state.stable,
        message=state.message,
        hausdorff=hausdorff,
        centreline=centreline,
        ribbon_error=fast.error,
        shell_error=state.error if shape is not None else None,
        claimed=claimed,
        energy=state.energy,
        share=state.numbers.get("share"),
        shell_end=_pose(state, 1.0),
        shell_middle=_pose(state, 0.5),
        shell_forces=_held(state, "force"),
        shell_moments=_held(state, "moment"),
        shell_walls=_walls(state),
        shell_contacts=_contacts(state),
        seconds=Times(fast.seconds.warm, None if math.isnan(seconds) else seconds),
        elements=mesh,  # type: ignore[arg-type]
        newton_iterations=state.iterations,
        reused=state.reused,
        same_state=same.answer,
        same_why=same.why,
        counterpart=same.counterpart,
        shell_errors=state.errors,
        elastica=planar,
        start=state.start,
        begun_again=same.again,
        share_error=state.numbers.get("share_error"),
        laid=laid,
        warm=bool(fast.seconds.repeats),
        searched=variant.scene.model.tolerance is not None,
    )


def _held(state: State, kind: str) -> dict[str, FloatArray | None]:
    """The shell's "force" or "moment" of the supports at both ends (3,), None where there is none: of the ribbon they
    are those of result.json."""
    ends = {"start": state.supports.start, "end": state.supports.end}
    return {name: None if found is None else getattr(found, kind) for name, found in ends.items()}


def _walls(state: State) -> tuple[dict[str, Any], ...]:
    """What each wall exerts on a shell, each number with its error; moments are about the origin, in D w / l, pressures
    in D / l^3."""
    found = []
    for k, wall in enumerate(state.supports.walls):
        entry: dict[str, Any] = {"name": wall["name"], "contacts": len(wall["points"]), "height": wall["height"]}
        for kind in ("force", "moment", "gap", "mean_pressure", "greatest_pressure"):
            known = (state.errors.get(f"{kind}s") or {}).get("walls") or ()
            entry |= {kind: wall[kind], f"{kind}_error": known[k] if k < len(known) else None}
        entry |= {"mean_pressure_why": NO_LENGTH} if wall["mean_pressure"] is None else {}
        found.append(entry)
    return tuple(found)


def _contacts(state: State) -> dict[str, Any] | None:
    """What parts of a shell exert on each other; None: they are not kept apart."""
    force = state.supports.itself
    if force is None:
        return None
    pairs = list(state.native.data.get("pairs") or ())
    error = (state.errors.get("forces") or {}).get("itself")
    return {"force": force.tolist(), "force_error": error, "count": len(pairs), "pairs": pairs}


def _pose(state: State, at: float) -> dict[str, Any] | None:
    """Position and frame of the shell's centreline, as its report has them."""
    found = state.native.data.get("end" if at == 1.0 else "middle")
    return None if found is None else dict(found)
