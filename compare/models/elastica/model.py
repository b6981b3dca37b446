"""The planar elastica as a model: what it reads of a scene, its sizes, its answer put into space."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

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
from compare.models.capabilities import Reference
from compare.models.effects.switches import Switch
from compare.models.elastica.shape import ElasticaShape
from compare.models.line import LineModel, Task
from compare.models.quantities.elastica import QUANTITIES
from ribbonbench.errors import BadInput

if TYPE_CHECKING:
    from compare.models.capabilities import BranchStart
    from compare.models.elastica.start import Start
    from compare.scene.scene import Scene
    from compare.store.progress import Reporter
    from shellref.elastica.result import ElasticaResult

FloatArray = NDArray[np.float64]

#: Degree of the elements of a reference.
REFERENCE_DEGREE = 4

_RIBBON = "how the ribbon beside it is discretised"
_PLANE = "in its plane the strip bends as one of any width and Poisson's ratio, in l and D w / l"


@dataclass(frozen=True)
class Sized:
    """Where an elastica begins, and its size; None: the usual one."""

    start: Start
    elements: int | None
    degree: int | None

    def solve(self, estimate: bool) -> ElasticaResult:
        """One solve; with `estimate` a second one on halved elements, for the error of the shape."""
        return self.start.once(self.elements, self.degree, estimate)


class ElasticaModel(LineModel[Sized, "ElasticaResult"]):
    """The planar inextensible elastica in scikit-fem."""

    name = "elastica"
    quantities = QUANTITIES
    presenter = "compare.pages.elastica:PRESENTER"
    sizes = (5, 10, 20, 40, 80)
    degrees = (1, 2, 3)
    remedies: Mapping[str, str] = {
        "limit_point": ": go past it by arc length: --set model.arc_length=always",
        "unstable": ": start from a bent [seed], e.g. curvature = 0.5, or tilt the clamp a little",
        "not_converged": ": choose another [seed], or go there by a [[path]]",
    }
    reads = (
        keys.BENDING | keys.SECOND_MOMENT | keys.WEIGHT | keys.TIP_FORCE | keys.CONTACT | keys.OBSTACLES
        | keys.BOTH_CLAMPS - keys.RULINGS - keys.SLIDES - keys.SECTIONS
        | keys.ENERGY | keys.ARC_LENGTH | keys.BUDGET | keys.SEED - keys.RULINGS | keys.PATH
    )  # fmt: skip
    without_effect = keys.because(
        keys.UNSURE,
        keys.SHELL_BESIDE,
        (keys.SECTION, _PLANE),
        (keys.OVER_THE_SURFACE, "in its plane the weight of the surface is that of the centreline"),
        (keys.RULINGS - keys.CLOSURE, "rulings are straight across in a plane"),
        (keys.ELEMENTS | keys.TOLERANCE | keys.RIBBON_SOLVER, _RIBBON),
    )

    def refusal(self, scene: Scene) -> BadInput | None:
        """What breaks planarity."""
        reason = scene.nonplanar_reason()
        if reason is None:
            return None
        return BadInput("model.energy", "elastica", f"is planar, but {reason}", 'choose "wunderlich" or turn the clamp')

    def closed_to(self, scene: Scene) -> str | None:
        """What breaks planarity."""
        return scene.nonplanar_reason()

    def admit(self, scene: Scene, options: Options) -> None:
        """A saddle is not left here; what breaks planarity."""
        if options.leave_saddle:
            raise BadInput(
                "--leave-saddle", None, "is for the ribbon, and this is the elastica",
                'leave it out, or choose model.energy = "wunderlich"',
            )  # fmt: skip
        super().admit(scene, options)

    def budget(self, seconds: float) -> AbstractContextManager[None]:
        """The clock of `shellref` (`ribbonbench.clock`)."""
        from ribbonbench.clock import within

        return within(seconds)

    def problem(self, scene: Scene, size: Size | None, near: Shape | None) -> Task[Sized]:
        """From the natural shape, the seed, along the path, or beside `near` (`compare.models.elastica.start`)."""
        from compare.models.elastica.start import start_of

        start = start_of(scene, near)
        elements = None if size is None else int(size.values[0])
        sized = Sized(start, elements, None if size is None else size.degree)
        return Task(sized, start.kind, "elastica: the scene is planar")

    def run(self, problem: Sized, options: Options, say: Reporter | None) -> ElasticaResult:
        """One way to the equilibrium."""
        return problem.solve(False)

    def estimated(self, problem: Sized, result: ElasticaResult) -> ElasticaResult:
        """The same way again, and on halved elements."""
        return problem.solve(True)

    def finer(self, result: ElasticaResult) -> ElasticaResult | None:
        """Elements cut in two, begun at the angle of the answer."""
        from shellref.elastica.start import halved, solve_near

        nodes = result.nodes
        return solve_near(
            result.problem, nodes, result.angle(nodes), halved(nodes), result.degree, estimate_error=False
        )

    def state(self, scene: Scene, result: ElasticaResult) -> State:
        """In space, at the clamp."""
        r = result
        known = r.status.value != "limit_point"
        # the elastica measures heights from its clamp, a state from the origin
        height = 0.0 if scene.up is None else float(scene.position @ scene.up)
        elements = len(r.nodes) - 1
        return State(
            model=self.name,
            size=Size(f"elastica {r.degree}", (float(elements),), r.degree),
            status=Status(r.status.value),
            word=r.status.value,
            stable=r.stable if known else None,
            message=self._without_options(r),
            energy=Energy(
                elastic=r.energy.bending,
                gravity=r.energy.gravity + scene.gamma * height,
                tip=None if scene.tip is None else r.energy.force - float(scene.tip_force @ scene.position),
                constant=natural_constant(r.problem.curvature),
                parts={"bending": r.energy.bending},
            ),
            shape=ElasticaShape(r, np.asarray(scene.position), scene.frame, scene.width),
            residual=float(r.residual),
            iterations=int(r.iterations),
            lowest_eigenvalue=None if r.lowest_eigenvalue is None else float(r.lowest_eigenvalue),
            supports=_supports(scene, r),
            error=r.error,
            unknowns=r.degree * elements,
            numbers={
                "segments": elements,
                "max_abs_eta": 0.0,
                "max_abs_eta_prime_w_half": 0.0,
                **({} if r.through is None else {"penetration": r.through}),
            },
            native=r,
        )

    def reference(
        self,
        scene: Scene,
        sizes: Sequence[Size],
        *,
        near: Shape | None = None,
        options: Options | None = None,
        say: Reporter | None = None,
    ) -> Reference:
        """Degree `REFERENCE_DEGREE` on four times the most elements; its own error, from elements half as long."""
        most = 4 * int(max(size.values[0] for size in sizes))
        if say is not None:
            say.step(f"reference of the elastica: {most} elements of degree {REFERENCE_DEGREE}")
        size = Size(f"elastica {REFERENCE_DEGREE}", (most,), REFERENCE_DEGREE)
        own = replace(options or Options(), error=True, repeats=0)
        state = self.solve(scene, size, near=near, options=own, say=say)
        return Reference(state, f"{most} elements of degree {REFERENCE_DEGREE}", state.error, f"{2 * most} of them")

    def _without_options(self, r: ElasticaResult) -> str:
        """The solver's message; where there is a remedy in the scene's words, without the solver's own options at its
        end (a budget that is spent is none of them)."""
        from ribbonbench.clock import SPENT

        said, colon, options = r.message.rpartition(": ")
        return said if colon and options != SPENT and r.status.value in self.remedies else r.message

    def branch_start(
        self, scene_at: Callable[[float], Scene], say: Reporter | None = None, *, moving: bool = False
    ) -> BranchStart:
        """A branch of the elastica (`compare.models.branches.elastica`)."""
        from compare.models.branches.elastica import branch_start

        scene = scene_at(0.0)
        if scene.apart is not None or scene.obstacles:
            key = "obstacle" if scene.obstacles else "contact.itself"
            raise BadInput(
                key,
                None,
                "changes along a branch what touches, which the elastica does not follow there",
                "take the ribbon (--model ribbon), or leave it out",
            )
        return branch_start(scene_at, self.solve(scene_at(0.0), options=Options(error=False), say=say))

    def switches(self, scene: Scene) -> Sequence[Effect | Switch]:
        """Loads, ends and natural curvature."""
        from compare.models.elastica.effects import switches

        return switches(scene)


def _supports(scene: Scene, r: ElasticaResult) -> Supports:
    """Forces and moments of the ends in space; a load at the tip is no support (`tip_force` of result.json)."""
    frame, forces = scene.frame, r.forces
    load = r.problem.force

    def in_space(vector: tuple[float, float]) -> FloatArray:
        return in_plane(frame, vector)

    start = Force(in_space(forces.start), forces.start_moment * frame[:, 0])
    held = scene.clamp_end is not None
    of_end = forces.end[0] - load[0], forces.end[1] - load[1]
    end = Force(in_space(of_end), forces.end_moment * frame[:, 0]) if held else None
    return Supports(start, end, _round(scene, r))


def _round(scene: Scene, r: ElasticaResult) -> tuple[Mapping[str, Any], ...]:
    """What every obstacle exerts, as of a ribbon: the moment about the origin."""
    if len(r.problem.barriers) != len(scene.obstacles):
        return ()
    found = []
    for number, name in enumerate(scene.barrier_names):
        own = [touch for touch in r.touches if touch.barrier == number]
        forces = np.array([in_plane(scene.frame, touch.force) for touch in own]).reshape(-1, 3)
        places = scene.position + np.array([in_plane(scene.frame, touch.place) for touch in own]).reshape(-1, 3)
        found.append({
            "name": name, "force": forces.sum(axis=0), "contacts": np.array([touch.s for touch in own]),
            "lines": np.zeros((0, 2)), "points": places, "height": None,
            "moment": np.cross(places, forces).sum(axis=0),
        })  # fmt: skip
    return tuple(found)


def in_plane(frame: FloatArray, vector: Sequence[float]) -> FloatArray:
    """A vector of the plane of a clamp's frame in space."""
    return np.asarray(vector[0] * frame[:, 2] - vector[1] * frame[:, 1])
