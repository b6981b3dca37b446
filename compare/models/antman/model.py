"""The shearable, extensible rod (Antman, Simo, Reissner) as a model: what it reads of a scene, sizes, answer."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from compare.models import keys
from compare.models.antman.shape import RodShape
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
from compare.models.effects.switches import Switch
from compare.models.line import LineModel, Task, another_model
from compare.models.quantities.antman import QUANTITIES
from ribbonbench.errors import BadInput

if TYPE_CHECKING:
    from compare.models.antman.problem import Walk
    from compare.models.capabilities import BranchStart
    from compare.scene.scene import Scene
    from compare.store.progress import Reporter
    from shellref.rod.result import RodResult

FloatArray = NDArray[np.float64]

_RULING = "a rod's section stays plane: it has no rulings"
_RIBBON = "how the ribbon beside it is discretised"


class AntmanModel(LineModel["Walk", "RodResult"]):
    """The geometrically exact rod with bending, torsion, shear and stretch."""

    name = "antman"
    quantities = QUANTITIES
    presenter = "compare.pages.rods.antman:PRESENTER"
    sizes = (5, 10, 20, 40, 80)
    degrees = (1, 2, 3)
    remedies: Mapping[str, str] = {
        "unstable": ": use --leave-saddle to go down to a stable one",
        "limit_point": ": choose another [seed], or go there by a [[path]]",
    }
    reads = (
        keys.STRIP | keys.SHAPED | keys.SECOND_MOMENT | keys.WEIGHT | keys.TIP | keys.SHEARED_ROD
        | keys.BOTH_CLAMPS - keys.RULINGS - keys.SECTIONS
        | keys.STIFFNESS | keys.ELEMENTS | keys.BUDGET | keys.SEED - keys.RULINGS | keys.PATH
    )  # fmt: skip
    without_effect = keys.because(
        keys.UNSURE,
        keys.SHELL_BESIDE,
        (keys.OVER_THE_SURFACE, "the weight of a section acts in its middle"),
        (keys.ENERGY, "it chooses the model"),
        (keys.RULINGS - keys.CLOSURE, _RULING),
        (keys.TOLERANCE | keys.RIBBON_SOLVER, _RIBBON),
    )

    def refusal(self, scene: Scene) -> BadInput | None:
        """What a rod with two ends and a section of known stiffness cannot do."""
        from compare.models.antman.problem import refusal

        if scene.closure is not None:
            return BadInput("closure", scene.closure.kind, "closes the strip, and this rod has two ends",
                            "remove [closure], or choose another model.energy")  # fmt: skip
        if scene.walls:
            return BadInput("wall", None, "confines the strip, and the rod knows no contact",
                            'remove [[wall]], or choose model.energy = "wunderlich"')  # fmt: skip
        return refusal(scene)

    def closed_to(self, scene: Scene) -> str | None:
        """Another model's scene, and what the rod refuses."""
        if another_model(self, scene) is not None:
            return f'model.energy is not "{self.name}"'
        refused = self.refusal(scene)
        return None if refused is None else f"{refused.key} {refused.problem}"

    def budget(self, seconds: float) -> AbstractContextManager[None]:
        """The clock of `shellref` (`ribbonbench.clock`)."""
        from ribbonbench.clock import within

        return within(seconds)

    def problem(self, scene: Scene, size: Size | None, near: Shape | None) -> Task[Walk]:
        """From the rest shape or the seed along the path, or beside `near`."""
        from compare.models.antman.problem import DEGREE, mesh_of, walk_of

        mesh = mesh_of(scene) if size is None else int(size.values[0])
        degree = DEGREE if size is None or size.degree is None else size.degree
        walk = walk_of(scene, mesh, degree, near)
        return Task(walk, walk.kind, f"antman: {walk.kind}")

    def run(self, problem: Walk, options: Options, say: Reporter | None) -> RodResult:
        """Along the walk, and on from a saddle where that is asked for."""
        return problem.solve(problem.mesh, bool(options.leave_saddle))

    def estimated(self, problem: Walk, result: RodResult) -> RodResult:
        """By elements half as long, begun at the answer, or gone to all the way where nothing is found there."""
        from shellref.rod.solve import UNKNOWN, error_of

        if result.status in UNKNOWN:
            return result
        again = None if problem.near is not None else problem.solve
        return replace(result, error=error_of(result, again))

    def finer(self, result: RodResult) -> RodResult | None:
        """Elements half as long, begun at the answer."""
        from shellref.rod.solve import refined

        return refined(result)

    def state(self, scene: Scene, result: RodResult) -> State:
        """The rod in space."""
        r = result
        count = len(r.elements.joints) - 1
        return State(
            model=self.name,
            size=Size(f"antman {r.degree}", (float(count),), r.degree),
            status=Status(r.status.value),
            word=r.status.value,
            stable=r.stable,
            message=r.message,
            energy=_energy(r, scene.tip is not None),
            shape=RodShape(r, scene.width),
            residual=r.residual,
            iterations=r.iterations,
            lowest_eigenvalue=r.lowest_eigenvalue,
            supports=_supports(r, scene.clamp_start is not None, scene.clamp_end is not None),
            error=r.error,
            unknowns=r.unknowns,
            numbers={"segments": count, "steps": r.steps, "snaps": r.snaps, "reached": r.reached},
            native=r,
        )

    def branch_start(
        self, scene_at: Callable[[float], Scene], say: Reporter | None = None, *, moving: bool = False
    ) -> BranchStart:
        """A branch of the rod (`compare.models.branches.rod`)."""
        from compare.models.branches.rod import branch_start

        if moving:
            raise BadInput("--moving", None, "moves elements, and a rod's stay where they are", "leave it out")
        return branch_start(scene_at, self.solve(scene_at(0.0), options=Options(error=False), say=say))

    def switches(self, scene: Scene) -> Sequence[Effect | Switch]:
        """Loads, ends, rest shape, shear and stretch."""
        from compare.models.antman.effects import switches

        return switches(scene)


def _energy(r: RodResult, pulled: bool) -> Energy:
    """Its energies; pulled: whether a force acts at s = l."""
    constant, energy = natural_constant(r.problem.curvature), r.energy
    return Energy(
        elastic=energy.elastic - constant,
        gravity=energy.gravity,
        tip=energy.force if pulled else None,
        constant=constant,
        parts={
            "bending": energy.bending, "torsion": energy.torsion, "shear": energy.shear, "stretch": energy.stretch,
        },
    )  # fmt: skip


def _supports(r: RodResult, start: bool, end: bool) -> Supports:
    """What holds it at its ends, where something does."""
    return Supports(
        Force(r.start.force, r.start.moment) if start else None, Force(r.end.force, r.end.moment) if end else None
    )
