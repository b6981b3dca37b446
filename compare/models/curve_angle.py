"""The curve-angle rod as a model: what it reads of a scene, its sizes, its answer."""

from __future__ import annotations

from collections.abc import Mapping
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
from compare.models.timing import clocked

if TYPE_CHECKING:
    from compare.scene.scene import Scene
    from compare.store.progress import Reporter
    from ribbon.rods.result import RodShape
    from ribbon.rods.stability import Stability

FloatArray = NDArray[np.float64]

#: Usual sizes: edges of equal length.
EDGES = (10, 20, 40, 80, 160, 320)
#: Edges where the scene says nothing about elements: an edge is straight, and an element of the ribbon is not.
DEFAULT_EDGES = 100
#: Edges up to which the rod is cut in two for its error and as a reference.
MOST = 2000
LADDER = "curve_angle"


@dataclass(frozen=True)
class CurveAngleShape:
    """The rod as a strip in space (`compare.models.base.Shape`): its sections are straight across."""

    native: RodShape

    @property
    def bend(self) -> float:
        """Largest normal curvature, 1/l."""
        return float(np.abs(self.native.strains[:, 0]).max())

    def centreline(self, s: FloatArray) -> FloatArray:
        """Positions (k, 3)."""
        return self.native.centreline(on_strip(s))

    def frames(self, s: FloatArray) -> FloatArray:
        """Frames (k, 3, 3), columns t_x t_y t_z."""
        return self.native.frames(on_strip(s))

    def points(self, s: FloatArray, v: FloatArray) -> FloatArray:
        """Positions (k, m, 3)."""
        across = self.frames(s)[:, :, 0]
        return np.asarray(self.centreline(s)[:, None, :] + v[None, :, None] * across[:, None, :])

    def pose(self, s: float) -> Pose:
        """Position and frame of the centreline at one abscissa."""
        return pose_of(self, s)

    def fields(self, s: FloatArray, v: FloatArray) -> dict[str, FloatArray]:
        """S, v, omega, kappa_2, tau, normal, and energy_density without the constant of the natural curvature."""
        grid_s, grid_v = np.meshgrid(s, v, indexing="ij")
        strain, rest = self.native.strain(on_strip(s)), self.native.rod.at_rest(on_strip(s))
        density = 0.5 * (strain - rest) ** 2 @ np.array(self.native.rod.stiffness) - 0.5 * rest[:, 0] ** 2
        along = dict(zip(("omega", "kappa_2", "tau", "energy_density"), (*strain.T, density), strict=True))
        return {
            "S": grid_s,
            "v": grid_v,
            "normal": np.broadcast_to(self.frames(s)[:, None, :, 1], (*grid_s.shape, 3)),
            **{name: np.broadcast_to(values[:, None], grid_s.shape) for name, values in along.items()},
        }


class CurveAngleModel:
    """`compare.models.base.Model`: Kirchhoff's rod in positions and one angle (du Peloux 2017, chapter 4)."""

    name = "curve_angle"
    presenter: str | None = None
    reads = frozenset(
        {
            "title", "strip.length", "strip.width", "strip.thickness", "strip.poisson", "strip.natural_curvature",
            "strip.gamma", "strip.young", "strip.density", "strip.second_moment", "tip.*", "gravity.up",
            "gravity.acceleration", "clamp.start.position", "clamp.start.frame", "clamp.start.tangent",
            "clamp.start.normal", "clamp.start.across", "clamp.start.slide", "clamp.end.position", "clamp.end.frame",
            "clamp.end.tangent", "clamp.end.normal", "clamp.end.across", "clamp.end.slide", "closure.kind",
            "closure.turns", "closure.twist", "rod.bending", "rod.torsion", "rod.natural_twist",
            "rod.natural_in_plane", "rod.twist", "model.energy", "model.stiffness", "model.elements", "model.grading",
            "model.element_lengths", "model.budget", "seed.curvature", "path",
        }
    )  # fmt: skip
    without_effect: Mapping[str, str] = {
        "uncertainty.*": "how sure the inputs are moves no result (compare.studies.inputs)",
        "gravity.exact": "its sections are straight across: the weight is the centreline's",
        "clamp.start.ruling": "a rod's sections do not turn in its plane",
        "clamp.end.ruling": "a rod's sections do not turn in its plane",
        "closure.ruling": "a rod's sections do not turn in its plane",
        "seed.ruling": "a rod's sections do not turn in its plane",
        "rod.shear": "the rod has no shear",
        "rod.stretch": "the rod does not stretch",
        "model.tolerance": "edges are not placed",
        "model.formulation": "how the ribbon beside it is discretised",
        "model.held_by": "how the ribbon beside it is held",
        "model.solver": "the minimiser of the ribbon beside it",
        "model.arc_length": "how the elastica beside it passes limit points",
        "shell.*": "how the shell beside it is made and held",
    }

    def refusal(self, scene: Scene) -> BadInput | None:
        """What the rod needs: stiffnesses, and ends that keep it from turning for ever."""
        from compare.models.curve_angle_start import held_badly, stiffness_missing

        if scene.model.energy != self.name:
            return BadInput(
                "model.energy", scene.model.energy, f'is not "{self.name}"', f'choose model.energy = "{self.name}"'
            )
        return stiffness_missing(scene) or held_badly(scene)

    def variants(self, scene: Scene) -> tuple[Variant, ...]:
        """One."""
        return (Variant({}, scene),)

    def ladders(self, scene: Scene) -> tuple[Ladder, ...]:
        """Edges of equal length."""
        refused = self.refusal(scene)
        if refused is not None:
            return (Ladder(LADDER, why=str(refused)),)
        return (Ladder(LADDER, tuple(Size(LADDER, (float(n),)) for n in EDGES)),)

    def solve(
        self,
        scene: Scene,
        size: Size | None = None,
        *,
        near: Shape | None = None,
        options: Options | None = None,
        say: Reporter | None = None,
    ) -> State:
        """From the seed and through the stages of the path, or from `near`."""
        from compare.models.curve_angle_start import way
        from ribbon.rods.result import RodShape
        from ribbon.rods.stability import judged, left
        from ribbon.solvers.budget import within

        options = options or Options()
        refused = self.refusal(scene)
        if refused is not None:
            raise refused
        lengths = lengths_of(scene) if size is None else np.full(int(size.values[0]), 1.0 / int(size.values[0]))
        if say is not None:
            say.step(f"curve-angle rod: {lengths.size} edges")
        with within(scene.model.budget):
            found, seconds = clocked(lambda: way(scene, lengths, near), options.repeats)
            stability = judged(found.found) if found.found.ok else None
            if options.leave_saddle and stability is not None and stability.stable is False:
                found = RodShape(left(found.found, stability), found.origin)
                stability = judged(found.found) if found.found.ok else None
            state = state_of(scene, found, stability)
            state = replace(state, seconds=seconds, start="near" if near is not None else state.start)
            if options.error and state.ok:
                state = with_error(self, state, options, scene.width)
        return state

    def refined(self, state: State) -> State | None:
        """Every edge cut in two, begun at the state."""
        from compare.models.curve_angle_start import cut_in_two
        from ribbon.rods.stability import judged

        if not state.ok or state.native.rod.edges >= MOST:
            return None
        found = cut_in_two(state.native)
        return state_of(None, found, judged(found.found) if found.found.ok else None)

    def effects(self, scene: Scene) -> tuple[Effect, ...]:
        """Loads, ends, rest shape, on or off."""
        from compare.models.effects.curve_angle import effects

        return effects(scene)


def lengths_of(scene: Scene) -> FloatArray:
    """Lengths (n,) of the edges: the scene's elements, where it says them."""
    from compare.scene.spec import SAY_ELEMENTS

    if any(f"model.{key}" in scene.own_keys for key in SAY_ELEMENTS):
        return np.array(scene.model.lengths)
    return np.full(DEFAULT_EDGES, 1.0 / DEFAULT_EDGES)


def state_of(scene: Scene | None, shape: RodShape, stability: Stability | None) -> State:
    """A rod as a state; scene: None for one that is refined."""
    found, rod = shape.found, shape.rod
    stable = None if stability is None else stability.stable
    status = Status.NOT_CONVERGED if not found.ok else Status.UNSTABLE if stable is False else Status.CONVERGED
    constant = natural_constant(rod.rest[0])
    follows = scene is not None and scene.rod is not None and scene.rod.twist == "quasi-static"
    start, end = shape.reactions
    parts = shape.parts
    size = Size(LADDER, (float(rod.edges),))
    return State(
        model="curve_angle",
        size=size,
        status=status,
        word=status.value if status is not Status.UNSTABLE else "saddle",
        stable=stable,
        message=found.message if status is not Status.UNSTABLE else "an equilibrium, unstable",
        energy=Energy(
            elastic=float(parts.sum()) - constant,
            gravity=shape.weight,
            tip=shape.tip if rod.force.any() else None,
            constant=constant,
            parts={"bending": float(parts[0]) - constant, "in_plane": float(parts[1]), "twist": float(parts[2])},
        ),
        shape=CurveAngleShape(shape) if np.all(np.isfinite(found.y)) else None,
        residual=found.residual,
        iterations=found.iterations,
        lowest_eigenvalue=None if stability is None or stability.stable is None else stability.eigenvalue,
        supports=Supports(None if rod.start.free else Force(*start), None if rod.end.free else Force(*end)),
        unknowns=shape.problem.size - (rod.edges if follows else 0),
        numbers={
            "segments": rod.edges,
            "max_abs_tau": float(np.abs(shape.strains[:, 2]).max()),
            "max_abs_kappa_2": float(np.abs(shape.strains[:, 1]).max()),
        },
        start="path" if scene is not None and scene.path else "seed",
        native=shape,
    )


def with_error(model: CurveAngleModel, state: State, options: Options, width: float) -> State:
    """The state with its discretisation error and those of its forces, moments and energies, from edges cut in two and
    in four; width: w / l of the strip shown."""
    from compare.measure.error import error_of_first, extrapolated
    from compare.measure.grid import Grid
    from compare.measure.numbers import errors_of, numbers_of

    assert state.shape is not None
    grid = options.grid or Grid(np.linspace(0.0, 1.0, 401), np.array([-0.5, 0.0, 0.5]) * width)
    shapes, chain, current = [grid.of(state.shape)], [numbers_of(state)], state
    for _ in range(2):
        finer = model.refined(current)
        if finer is None or finer.shape is None or not finer.ok:
            break
        shapes.append(grid.of(finer.shape))
        chain.append(numbers_of(finer))
        current = finer
    why = {1: "the rod with its edges cut in two was not found", 2: "from edges cut in two"}
    errors = errors_of(chain, error_of_first, state.residual or 0.0)
    return replace(
        state,
        error=extrapolated(shapes),
        errors=errors,
        error_why=why.get(len(shapes), "from edges cut in two, in four"),
    )
