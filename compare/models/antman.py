"""The shearable, extensible rod (Antman, Simo, Reissner) as a model: what it reads of a scene, sizes, answer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from compare.errors import BadInput
from compare.models.base import (
    BESIDE,
    Effect,
    Energy,
    Force,
    Ladder,
    Options,
    Pose,
    Shape,
    Size,
    State,
    Status,
    Supports,
    Variant,
    natural_constant,
    on_strip,
    pose_of,
)  # fmt: skip
from compare.models.quantities.antman import QUANTITIES
from compare.models.timing import clocked

if TYPE_CHECKING:
    from compare.scene.scene import Scene
    from compare.store.progress import Reporter
    from shellref.rod.result import RodResult

FloatArray = NDArray[np.float64]

#: Usual sizes and degrees.
ELEMENTS = (5, 10, 20, 40, 80)
DEGREES = (1, 2, 3)

_RULING = "a rod's section stays plane: it has no rulings"
_RIBBON = "how the ribbon beside it is discretised"

#: Fields at the particles: name -> index of the strain.
STRAINS = {"shear_x": 0, "shear_y": 1, "stretch": 2, "kappa_1": 3, "kappa_2": 4, "kappa_3": 5}


@dataclass(frozen=True)
class RodShape:
    """The rod as a strip in space (`compare.models.base.Shape`): its section a straight line along t_x; width w / l."""

    result: RodResult
    width: float

    @property
    def bend(self) -> float:
        """Largest curvature about t_x, 1/l."""
        return float(np.abs(self.result.strains(np.linspace(0.0, 1.0, 501))[:, 3]).max())

    def centreline(self, s: FloatArray) -> FloatArray:
        """Positions (k, 3)."""
        return self.result.position(on_strip(s))

    def frames(self, s: FloatArray) -> FloatArray:
        """Frames (k, 3, 3), columns t_x t_y t_z; t_z normal to the section, which may shear."""
        return self.result.frames(on_strip(s))

    def points(self, s: FloatArray, v: FloatArray) -> FloatArray:
        """Positions (k, m, 3)."""
        across = self.frames(s)[:, :, 0]
        return np.asarray(self.centreline(s)[:, None, :] + v[None, :, None] * across[:, None, :])

    def pose(self, s: float) -> Pose:
        """Position and frame of the centreline at one abscissa."""
        return pose_of(self, s)

    def fields(self, s: FloatArray, v: FloatArray) -> dict[str, FloatArray]:
        """S, v, normal, the six strains, omega (= kappa_1), and energy_density without the constant of the natural
        curvature."""
        grid_s, grid_v = np.meshgrid(s, v, indexing="ij")
        s = on_strip(s)
        found = self.result.strains(s)
        problem = self.result.problem
        start, end = problem.curvature
        natural = start + (end - start) * s
        stiffness = problem.section.stiffness
        density = 0.5 * self.result.excess(s) ** 2 @ stiffness - 0.5 * natural**2
        along = {"energy_density": density, "omega": found[:, 3], **{k: found[:, i] for k, i in STRAINS.items()}}
        return {
            "S": grid_s,
            "v": grid_v,
            "normal": np.broadcast_to(self.frames(s)[:, None, :, 1], (*grid_s.shape, 3)),
            **{name: np.broadcast_to(values[:, None], grid_s.shape) for name, values in along.items()},
        }


class AntmanModel:
    """`compare.models.base.Model`: the geometrically exact rod with bending, torsion, shear and stretch."""

    name = "antman"
    quantities = QUANTITIES
    presenter: str | None = "compare.pages.rods.antman"
    reads = frozenset(
        {
            "title", "strip.length", "strip.width", "strip.thickness", "strip.poisson", "strip.natural_curvature",
            "strip.gamma", "strip.young", "strip.density", "strip.second_moment", "tip.mass", "tip.load", "tip.force",
            "tip.tension", "tip.moment", "gravity.up", "gravity.acceleration", "rod.bending", "rod.torsion",
            "rod.shear", "rod.stretch", "rod.natural_twist", "rod.natural_in_plane", "clamp.start.position",
            "clamp.start.frame", "clamp.start.tangent", "clamp.start.normal", "clamp.start.across",
            "clamp.start.slide", "clamp.end.position", "clamp.end.frame", "clamp.end.tangent", "clamp.end.normal",
            "clamp.end.across", "clamp.end.slide", "model.stiffness", "model.elements",
            "model.grading", "model.element_lengths", "model.budget", "seed.curvature", "path",
        }
    )  # fmt: skip
    without_effect: Mapping[str, str] = {
        "uncertainty.*": "how sure the inputs are moves no result (compare.studies.inputs)",
        "gravity.exact": "the weight of a section acts in its middle",
        "model.energy": "it chooses the model",
        "clamp.start.ruling": _RULING,
        "clamp.end.ruling": _RULING,
        "seed.ruling": _RULING,
        "model.tolerance": _RIBBON,
        "model.formulation": _RIBBON,
        "model.held_by": _RIBBON,
        "model.solver": _RIBBON,
        "shell.*": "how the shell beside it is made and held",
    }

    def refusal(self, scene: Scene) -> BadInput | None:
        """What a rod with two ends and a section of known stiffness cannot do."""
        from compare.models.antman_problem import refusal

        if scene.closure is not None:
            return BadInput("closure", scene.closure.kind, "closes the strip, and this rod has two ends",
                            "remove [closure], or choose another model.energy")  # fmt: skip
        if scene.walls:
            return BadInput("wall", None, "confines the strip, and the rod knows no contact",
                            'remove [[wall]], or choose model.energy = "wunderlich"')  # fmt: skip
        return refusal(scene)

    def variants(self, scene: Scene) -> tuple[Variant, ...]:
        """One."""
        return (Variant({}, scene),)

    def ladders(self, scene: Scene) -> tuple[Ladder, ...]:
        """One for each degree of the elements, of a scene that asks for this rod."""
        reason = None if scene.model.energy == self.name else f'model.energy is not "{self.name}"'
        if reason is None:
            refused = self.refusal(scene)
            reason = None if refused is None else f"{refused.key} {refused.problem}"
        return tuple(
            Ladder(f"antman {q}", () if reason else tuple(Size(f"antman {q}", (n,), q) for n in ELEMENTS), reason)
            for q in DEGREES
        )

    def solve(
        self,
        scene: Scene,
        size: Size | None = None,
        *,
        near: Shape | None = None,
        options: Options | None = None,
        say: Reporter | None = None,
    ) -> State:
        """From the rest shape or the seed along the path, or beside `near`."""
        from compare.models.antman_problem import DEGREE, beside, mesh_of, problem_of, way_there
        from shellref.clock import within
        from shellref.rod.solve import nodes, solve

        options = options or Options()
        refused = self.refusal(scene)
        if refused is not None:
            raise refused
        mesh = mesh_of(scene) if size is None else int(size.values[0])
        degree = DEGREE if size is None or size.degree is None else size.degree
        there = way_there(scene)
        start = None if near is None else beside(near, nodes(mesh, degree))
        if say is not None:
            say.step(f"antman: {there.kind if near is None else BESIDE}")

        def once(error: bool) -> RodResult:
            if start is not None:
                return solve(
                    problem_of(scene.replace({"path": None}) if scene.path else scene), mesh, degree, near=start,
                    leave_saddle=bool(options.leave_saddle), estimate_error=error,
                )  # fmt: skip
            return solve(
                there.problems, mesh, degree, there.steps,
                leave_saddle=bool(options.leave_saddle), estimate_error=error,
            )  # fmt: skip

        def timed() -> RodResult:
            with within(scene.model.budget):
                return once(options.error)

        found, seconds = clocked(timed, options.repeats)
        state = self._state(scene, found, seconds, there.kind if near is None else BESIDE)
        with within(scene.model.budget):
            return self._with_errors(state) if options.error else state

    def _with_errors(self, state: State) -> State:
        """With the errors of forces, moments and energies, from elements half as long."""
        from dataclasses import replace

        from compare.measure.error import error_of_first
        from compare.measure.numbers import errors_of, numbers_of

        finer = self.refined(state) if state.is_equilibrium else None
        known = finer is not None and finer.is_equilibrium
        chain = [numbers_of(one) for one in ((state, finer) if known else (state,))]
        why = "from elements half as long" if known else "none was found on elements half as long"
        return replace(state, errors=errors_of(chain, error_of_first, state.residual or 0.0), error_why=why)

    def _state(self, scene: Scene, r: RodResult, seconds: object, kind: str) -> State:
        from compare.models.base import Seconds

        assert isinstance(seconds, Seconds)
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
            seconds=seconds,
            unknowns=r.unknowns,
            numbers={"segments": count, "steps": r.steps, "snaps": r.snaps, "reached": r.reached},
            start=kind,
            native=r,
        )  # fmt: skip

    def refined(self, state: State) -> State | None:
        """The same on elements half as long, begun at the state."""
        from dataclasses import replace

        from shellref.rod.solve import refined

        found, seconds = clocked(lambda: refined(state.native))
        shape = state.shape
        assert isinstance(shape, RodShape)
        count = len(found.elements.joints) - 1
        return replace(
            state,
            size=Size(state.size.ladder, (float(count),), found.degree),
            status=Status(found.status.value),
            word=found.status.value,
            stable=found.stable,
            message=found.message,
            energy=_energy(found, state.energy is not None and state.energy.tip is not None),
            supports=_supports(found, state.supports.start is not None, state.supports.end is not None),
            shape=RodShape(found, shape.width),
            residual=found.residual,
            iterations=found.iterations,
            lowest_eigenvalue=found.lowest_eigenvalue,
            error=None,
            seconds=seconds,
            unknowns=found.unknowns,
            numbers={**state.numbers, "segments": count},
            native=found,
        )

    def effects(self, scene: Scene) -> tuple[Effect, ...]:
        """Loads, ends, rest shape, shear and stretch, on or off."""
        from compare.models.effects.antman import effects

        return effects(scene)


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
