"""The curve-angle rod as a model: what it reads of a scene, its sizes, its answer."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from compare.models import keys
from compare.models.base import (
    Effect,
    Energy,
    Force,
    Options,
    Shape,
    Size,
    State,
    Status,
    Supports,
    natural_constant,
)  # fmt: skip
from compare.models.curve_angle.shape import CurveAngleShape
from compare.models.effects.switches import Switch
from compare.models.line import LineModel, Task, another_model
from ribbonbench.errors import BadInput

if TYPE_CHECKING:
    from compare.models.capabilities import BranchStart
    from compare.models.curve_angle.start import Walk
    from compare.scene.scene import Scene
    from compare.store.progress import Reporter
    from ribbon.rods.result import RodShape

FloatArray = NDArray[np.float64]

#: Edges where the scene says nothing about elements: an edge is straight, and an element of the ribbon is not.
DEFAULT_EDGES = 100
#: Edges up to which the rod is cut in two for its error and as a reference.
MOST = 2000

_RULING = "a rod's sections do not turn in its plane"


class CurveAngleModel(LineModel["Walk", "RodShape"]):
    """Kirchhoff's rod in positions and one angle (du Peloux 2017, chapter 4)."""

    name = "curve_angle"
    sizes = (10.0, 20.0, 40.0, 80.0, 160.0, 320.0)
    halvings = ("from edges cut in two", "from edges cut in two, in four")
    not_found = "the rod with its edges cut in two was not found"
    remedies: Mapping[str, str] = {
        "saddle": ": use --leave-saddle to go down to a stable one, or start from a bent [seed], e.g. curvature = 0.5",
    }
    reads = (
        keys.STRIP | keys.SHAPED | keys.SECOND_MOMENT | keys.WEIGHT | keys.TIP | keys.ROD_STRAINS | keys.ROD_TWIST
        | keys.BOTH_CLAMPS - keys.RULINGS - keys.SECTIONS | keys.CLOSURE - keys.RULINGS
        | keys.ENERGY | keys.STIFFNESS | keys.ELEMENTS | keys.BUDGET | keys.SEED - keys.RULINGS | keys.PATH
    )  # fmt: skip
    without_effect = keys.because(
        keys.UNSURE,
        keys.SHELL_BESIDE,
        (keys.OVER_THE_SURFACE, "its sections are straight across: the weight is the centreline's"),
        (keys.RULINGS, _RULING),
        (keys.inside("rod", "shear"), "the rod has no shear"),
        (keys.inside("rod", "stretch"), "the rod does not stretch"),
        (keys.TOLERANCE, "edges are not placed"),
        (keys.RIBBON_SOLVER, "how the ribbon beside it is discretised, held and solved"),
        (keys.ARC_LENGTH, "how the elastica beside it passes limit points"),
    )

    def refusal(self, scene: Scene) -> BadInput | None:
        """What the rod needs: stiffnesses, and ends that keep it from turning for ever."""
        from compare.models.curve_angle.start import held_badly, stiffness_missing

        return another_model(self, scene) or stiffness_missing(scene) or held_badly(scene)

    def budget(self, seconds: float) -> AbstractContextManager[None]:
        """The clock of `ribbon`."""
        from ribbon.solvers.budget import within

        return within(seconds)

    def problem(self, scene: Scene, size: Size | None, near: Shape | None) -> Task[Walk]:
        """From the seed and through the stages of the path, or from `near`."""
        from compare.models.curve_angle.start import Walk

        lengths = lengths_of(scene) if size is None else np.full(int(size.values[0]), 1.0 / int(size.values[0]))
        begins = "near" if near is not None else "path" if scene.path else "seed"
        return Task(Walk(scene, lengths, near), begins, f"curve-angle rod: {lengths.size} edges")

    def run(self, problem: Walk, options: Options, say: Reporter | None) -> RodShape:
        """Along the walk, and on from a saddle where that is asked for."""
        from ribbon.rods.result import RodShape
        from ribbon.rods.stability import judged, left

        found = problem.solve()
        stability = judged(found.found) if options.leave_saddle and found.found.ok else None
        if stability is None or stability.stable is not False:
            return found
        return RodShape(left(found.found, stability), found.origin)

    def finer(self, found: RodShape) -> RodShape | None:
        """Every edge cut in two, begun at the answer."""
        from compare.models.curve_angle.start import cut_in_two

        return None if found.rod.edges >= MOST else cut_in_two(found)

    def refined(self, state: State) -> State | None:
        """Every edge cut in two, of a stable state."""
        return super().refined(state) if state.ok else None

    def error(self, scene: Scene, chain: Sequence[State], options: Options) -> float | None:
        """From the distances of the shapes on edges cut in two and in four."""
        from compare.measure.error import extrapolated
        from compare.measure.grid import Grid

        grid = options.grid or Grid(np.linspace(0.0, 1.0, 401), np.array([-0.5, 0.0, 0.5]) * scene.width)
        return extrapolated([grid.of(state.shape) for state in chain if state.ok and state.shape is not None])

    def state(self, scene: Scene, found: RodShape) -> State:
        """The rod with its stability."""
        from ribbon.rods.stability import judged

        shape, rod = found, found.rod
        stability = judged(found.found) if found.found.ok else None
        stable = None if stability is None else stability.stable
        status = (
            Status.NOT_CONVERGED if not found.found.ok else Status.UNSTABLE if stable is False else Status.CONVERGED
        )
        constant = natural_constant(rod.rest[0])
        follows = scene.rod is not None and scene.rod.twist == "quasi-static"
        start, end = shape.reactions
        parts = shape.parts
        return State(
            model=self.name,
            size=Size(self.name, (float(rod.edges),)),
            status=status,
            word=status.value if status is not Status.UNSTABLE else "saddle",
            stable=stable,
            message=found.found.message if status is not Status.UNSTABLE else "an equilibrium, unstable",
            energy=Energy(
                elastic=float(parts.sum()) - constant,
                gravity=shape.weight,
                tip=shape.tip if rod.force.any() else None,
                constant=constant,
                parts={"bending": float(parts[0]) - constant, "in_plane": float(parts[1]), "twist": float(parts[2])},
            ),
            shape=CurveAngleShape(shape) if np.all(np.isfinite(found.found.y)) else None,
            residual=found.found.residual,
            iterations=found.found.iterations,
            lowest_eigenvalue=None if stability is None or stability.stable is None else stability.eigenvalue,
            supports=Supports(None if rod.start.free else Force(*start), None if rod.end.free else Force(*end)),
            unknowns=shape.problem.size - (rod.edges if follows else 0),
            numbers={
                "segments": rod.edges,
                "max_abs_tau": float(np.abs(shape.strains[:, 2]).max()),
                "max_abs_kappa_2": float(np.abs(shape.strains[:, 1]).max()),
            },
            native=shape,
        )

    def branch_start(
        self, scene_at: Callable[[float], Scene], say: Reporter | None = None, *, moving: bool = False
    ) -> BranchStart:
        """A branch of the rod (`compare.models.branches.curve_angle`)."""
        from compare.models.branches.curve_angle import branch_start

        if moving:
            raise BadInput("--moving", None, "moves elements, and a rod's stay where they are", "leave it out")
        return branch_start(scene_at, self.solve(scene_at(0.0), options=Options(error=False), say=say))

    def switches(self, scene: Scene) -> Sequence[Effect | Switch]:
        """Loads, ends, rest shape."""
        from compare.models.curve_angle.effects import switches

        return switches(scene)


def lengths_of(scene: Scene) -> FloatArray:
    """Lengths (n,) of the edges: the scene's elements, where it says them."""
    from compare.scene.spec import SAY_ELEMENTS

    if any(f"model.{key}" in scene.own_keys for key in SAY_ELEMENTS):
        return np.array(scene.model.lengths)
    return np.full(DEFAULT_EDGES, 1.0 / DEFAULT_EDGES)
