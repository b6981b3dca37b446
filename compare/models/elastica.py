"""The planar elastica as a model: what it reads of a scene, its sizes, its answer put into space."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from compare.errors import BadInput
from compare.models.base import (
    Effect,
    Energy,
    Force,
    Ladder,
    Options,
    Pose,
    Reference,
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
from compare.models.quantities.elastica import QUANTITIES
from compare.models.timing import clocked

if TYPE_CHECKING:
    from compare.models.elastica_start import Start
    from compare.scene.scene import Scene
    from compare.store.progress import Reporter
    from shellref.elastica.result import ElasticaResult

FloatArray = NDArray[np.float64]

#: Usual sizes and degrees.
ELEMENTS = (5, 10, 20, 40, 80)
DEGREES = (1, 2, 3)
REFERENCE_DEGREE = 4

_RIBBON = "how the ribbon beside it is discretised"
_PLANE = "in its plane the strip bends as one of any width and Poisson's ratio, in l and D w / l"


@dataclass(frozen=True)
class ElasticaShape:
    """The elastica as a strip in space (`compare.models.base.Shape`): rulings straight across; `width` is w / l."""

    result: ElasticaResult
    position: FloatArray
    frame: FloatArray
    width: float

    @property
    def bend(self) -> float:
        """Largest curvature, 1/l, from the turn between samples."""
        s = np.linspace(0.0, 1.0, 2001)
        return float(np.abs(np.gradient(self.result.angle(s), s)).max())

    def centreline(self, s: FloatArray) -> FloatArray:
        """Positions (k, 3)."""
        from shellref.elastica.result import embed

        return embed(self.result, self.position, self.frame, on_strip(s))

    def frames(self, s: FloatArray) -> FloatArray:
        """Frames (k, 3, 3), columns t_x t_y t_z."""
        from shellref.elastica.result import embed_frames

        return embed_frames(self.result, self.frame, on_strip(s))

    def points(self, s: FloatArray, v: FloatArray) -> FloatArray:
        """Positions (k, m, 3)."""
        across = self.frames(s)[:, :, 0]
        return np.asarray(self.centreline(s)[:, None, :] + v[None, :, None] * across[:, None, :])

    def pose(self, s: float) -> Pose:
        """Position and frame of the centreline at one abscissa."""
        return pose_of(self, s)

    def fields(self, s: FloatArray, v: FloatArray) -> dict[str, FloatArray]:
        """S, v, omega, normal, and energy_density without the constant of the natural curvature."""
        grid_s, grid_v = np.meshgrid(s, v, indexing="ij")
        s = on_strip(s)
        omega = self._curvature(s)
        start, end = self.result.problem.curvature
        density = 0.5 * omega**2 - (start + (end - start) * s) * omega
        normal = np.broadcast_to(self.frames(s)[:, None, :, 1], (*grid_s.shape, 3))
        return {
            "S": grid_s,
            "v": grid_v,
            "omega": np.broadcast_to(omega[:, None], grid_s.shape),
            "normal": normal,
            "energy_density": np.broadcast_to(density[:, None], grid_s.shape),
        }

    def _curvature(self, s: FloatArray) -> FloatArray:
        """theta' (k,) by central differences over 1e-4, one-sided at the ends."""
        low, high = np.clip(s - 5e-5, 0.0, 1.0), np.clip(s + 5e-5, 0.0, 1.0)
        return (self.result.angle(high) - self.result.angle(low)) / (high - low)


class ElasticaModel:
    """`compare.models.base.Model`: the planar inextensible elastica in scikit-fem."""

    name = "elastica"
    quantities = QUANTITIES
    presenter: str | None = "compare.pages.elastica"
    reads = frozenset(
        {
            "title", "strip.length", "strip.natural_curvature", "strip.gamma", "strip.young", "strip.density",
            "strip.thickness", "strip.second_moment", "tip.mass", "tip.load", "tip.force", "tip.tension", "gravity.up",
            "gravity.acceleration", "clamp.start.position", "clamp.start.frame", "clamp.start.tangent",
            "clamp.start.normal", "clamp.start.across", "clamp.end.position", "clamp.end.frame", "clamp.end.tangent",
            "clamp.end.normal", "clamp.end.across", "model.energy", "model.arc_length", "model.budget",
            "seed.curvature", "path",
        }
    )  # fmt: skip
    without_effect: Mapping[str, str] = {
        "uncertainty.*": "how sure the inputs are moves no result (compare.studies.inputs)",
        "strip.width": _PLANE,
        "strip.poisson": _PLANE,
        "gravity.exact": "in its plane the weight of the surface is that of the centreline",
        "clamp.start.ruling": "rulings are straight across in a plane",
        "clamp.end.ruling": "rulings are straight across in a plane",
        "seed.ruling": "rulings are straight across in a plane",
        "model.elements": _RIBBON,
        "model.grading": _RIBBON,
        "model.element_lengths": _RIBBON,
        "model.tolerance": _RIBBON,
        "model.formulation": _RIBBON,
        "model.held_by": _RIBBON,
        "model.solver": _RIBBON,
        "shell.*": "how the shell beside it is made and held",
    }

    def refusal(self, scene: Scene) -> BadInput | None:
        """What breaks planarity."""
        reason = scene.nonplanar_reason()
        if reason is None:
            return None
        return BadInput("model.energy", "elastica", f"is planar, but {reason}", 'choose "wunderlich" or turn the clamp')

    def variants(self, scene: Scene) -> tuple[Variant, ...]:
        """One."""
        return (Variant({}, scene),)

    def ladders(self, scene: Scene) -> tuple[Ladder, ...]:
        """One for each degree of the elements."""
        reason = scene.nonplanar_reason()
        return tuple(
            Ladder(f"elastica {q}", () if reason else tuple(Size(f"elastica {q}", (n,), q) for n in ELEMENTS), reason)
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
        """From the natural shape, the seed, along the path, or beside `near` (`compare.models.elastica_start`)."""
        from compare.models.elastica_start import start_of
        from shellref.clock import within

        options = options or Options()
        if options.leave_saddle:
            raise BadInput(
                "--leave-saddle", None, "is for the ribbon, and this is the elastica",
                'leave it out, or choose model.energy = "wunderlich"',
            )  # fmt: skip
        refused = self.refusal(scene)
        if refused is not None:
            raise refused
        if say is not None:
            say.step("elastica: the scene is planar")
        start = start_of(scene, near)
        elements = None if size is None else int(size.values[0])
        degree = None if size is None else size.degree

        def once() -> ElasticaResult:
            with within(scene.model.budget):
                return start.once(elements, degree, False)

        found, seconds = clocked(once, options.repeats)
        if not options.error:
            return self._state(scene, found, seconds, start)
        with within(scene.model.budget):
            state = self._state(scene, start.once(elements, degree, True), seconds, start)
            return self._with_errors(scene, state, start)

    def _with_errors(self, scene: Scene, state: State, start: Start) -> State:
        """With the errors of forces, moments and energies, from elements half as long."""
        from compare.measure.error import error_of_first
        from compare.measure.numbers import errors_of, numbers_of
        from shellref.elastica.start import halved, solve_near

        r = state.native
        finer = None
        if state.is_equilibrium:
            finer = solve_near(r.problem, r.nodes, r.angle(r.nodes), halved(r.nodes), r.degree, estimate_error=False)
        chain = [numbers_of(state)]
        if finer is not None:
            chain.append(numbers_of(self._state(scene, finer, state.seconds, start)))
        why = "from elements half as long" if finer is not None else "none was found on elements half as long"
        return replace(state, errors=errors_of(chain, error_of_first, state.residual or 0.0), error_why=why)

    def _state(self, scene: Scene, r: ElasticaResult, seconds: object, start: Start) -> State:
        from compare.models.base import Seconds

        assert isinstance(seconds, Seconds)
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
            message=r.message,
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
            seconds=seconds,
            unknowns=r.degree * elements,
            numbers={"segments": elements, "max_abs_eta": 0.0, "max_abs_eta_prime_w_half": 0.0},
            start=start.kind,
            native=r,
        )

    def refined(self, state: State) -> State | None:
        """None: an elastica brings its own error, from halved elements."""
        return None

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

    def effects(self, scene: Scene) -> tuple[Effect, ...]:
        """Loads, ends and natural curvature, on or off."""
        from compare.models.effects.elastica import effects

        return effects(scene)


def _supports(scene: Scene, r: ElasticaResult) -> Supports:
    """Forces and moments of the ends in space; a load at the tip is no support (`tip_force` of result.json)."""
    frame, forces = scene.frame, r.forces
    load = r.problem.force

    def in_space(vector: tuple[float, float]) -> FloatArray:
        return vector[0] * frame[:, 2] - vector[1] * frame[:, 1]

    start = Force(in_space(forces.start), forces.start_moment * frame[:, 0])
    held = scene.clamp_end is not None
    of_end = forces.end[0] - load[0], forces.end[1] - load[1]
    return Supports(start, Force(in_space(of_end), forces.end_moment * frame[:, 0]) if held else None)
