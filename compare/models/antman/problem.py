"""From a scene to the shearable rod: its section, what holds and loads it, the way from the seed along the path."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from compare.models.base import BESIDE, Shape
from compare.scene.data import unit
from compare.scene.inputs.law import Law, turn
from compare.scene.inputs.law import values as values_of
from compare.scene.scene import Scene
from compare.scene.spec import SAY_ELEMENTS, ClampSpec, RodSpec
from ribbonbench.errors import BadInput
from shellref.rod.problem import Held, RodProblem, Section, rectangle
from shellref.rod.result import RodResult
from shellref.rod.solve import Start, nodes, solve

FloatArray = NDArray[np.float64]

ELEMENTS = 40
"""Elements where the scene does not say them."""

DEGREE = 2
"""Degree of the elements where nothing else is asked for."""

STRAIGHT = 0.5
"""Curvature times l below which a seed counts as straight: between two held ends it could only buckle."""

BOW = 2.0
"""Curvature times l with which the way then begins."""


@dataclass(frozen=True)
class Walk:
    """The problems to go through, in order, the equal steps that each stage has at least, what the way begins at
    ("natural", "seed", "path"; `BESIDE`: another shape, on the mesh's nodes), mesh and degree."""

    problems: tuple[RodProblem, ...]
    steps: tuple[int | None, ...]
    kind: str
    mesh: int | FloatArray
    degree: int
    near: Start | None = None

    def solve(self, mesh: int | FloatArray, leave_saddle: bool = False) -> RodResult:
        """The end of the walk on a mesh; beside the other shape at once, where there is one."""
        if self.near is not None:
            return solve(self.problems[-1], mesh, self.degree, near=self.near, leave_saddle=leave_saddle)
        return solve(self.problems, mesh, self.degree, self.steps, leave_saddle=leave_saddle)


def section_of(scene: Scene) -> Section:
    """`[rod]` where it says a stiffness, else the rectangle w x h. Raises `BadInput` where neither does."""
    rod, h = scene.rod or RodSpec(), scene.thickness
    if h is None:
        for name in ("bending", "torsion", "shear", "stretch"):
            if getattr(rod, name) is None:
                raise BadInput(
                    "strip.thickness", None, f"is not given, and so the section's stiffness in {name} is not known",
                    f"add {'' if scene.strip.second_moment else 'strip.thickness, or '}rod.{name}",
                )  # fmt: skip
        assert rod.bending is not None
        assert rod.torsion is not None
        assert rod.shear is not None
        assert rod.stretch is not None
        return Section(rod.bending, rod.torsion, rod.shear, rod.stretch)
    full = rectangle(scene.width, h, scene.strip.poisson, scene.model.stiffness == "plate")
    return Section(
        rod.bending or full.bending,
        rod.torsion or full.torsion,
        rod.shear or full.shear,
        rod.stretch or full.stretch,
    )


def problem_of(scene: Scene) -> RodProblem:
    """The scene itself, without its path. Raises `BadInput` for a scene that holds nothing."""
    weight = np.zeros(3) if scene.up is None else -scene.gamma * scene.up
    start = _held(scene.clamp_start, scene.start_position, scene.start_frame)
    end = _held(scene.clamp_end, scene.end_position, scene.end_frame)

    return RodProblem(
        section=section_of(scene),
        curvature=scene.curvature,
        in_plane=scene.geodesic,
        twist=scene.twist,
        weight=weight,
        force=scene.tip_force,
        moment=scene.tip_moment,
        start=start,
        end=end,
    )


def _held(clamp: ClampSpec | None, position: FloatArray | None, frame: FloatArray | None) -> Held:
    if clamp is None:
        return Held()
    return Held(position, frame, None if clamp.slide is None else unit(clamp.slide))


def refusal(scene: Scene) -> BadInput | None:
    """What holds the strip too little: some end has to hold a point, and some end a frame, or both a point."""
    ends = [clamp for clamp in (scene.clamp_start, scene.clamp_end) if clamp is not None]
    points = sum(clamp.position is not None for clamp in ends)
    if points == 0 or (points < 2 and not any(clamp.tangent is not None for clamp in ends)):
        return BadInput(
            "clamp.start", None, "and clamp.end leave the rod free to move or turn as a whole",
            "add [clamp.start] with position, tangent and normal",
        )  # fmt: skip
    try:
        section_of(scene)
    except BadInput as error:
        return error
    return None


def walk_of(scene: Scene, mesh: int | FloatArray, degree: int, near: Shape | None = None) -> Walk:
    """From the rest shape, or from a rod naturally bent like the seed, through the stages of the path; beside `near`,
    another model's shape, where that is given."""
    if near is not None:
        alone = problem_of(scene.replace({"path": None}) if scene.path else scene)
        s = nodes(mesh, degree, alone)
        start = Start(np.asarray(near.centreline(s)), np.asarray(near.frames(s)))
        return Walk((alone,), (None,), BESIDE, mesh, degree, start)
    stages = [problem_of(stage) for stage in scene.stages()]
    counts = [None, *(stage.steps for stage in scene.path[1:]), None] if scene.path else [None]
    first = stages[0]
    bent: Law = first.curvature
    if scene.seed.curvature is not None:
        values = np.array(scene.seed_curvature)
        slope, start = np.polyfit(np.linspace(0.0, 1.0, len(values)), values, 1)
        bent = (float(values[0]), float(values[1])) if len(values) == 2 else (float(start), float(start + slope))
    points = [held.position for held in (first.start, first.end) if held.position is not None]
    straight = max(map(abs, values_of(bent))) < STRAIGHT and not scene.shaped
    if len(points) == 2 and math.dist(*points) < 1.0 - 1e-9 and straight:
        bow = -BOW if turn(bent) < 0.0 else BOW
        bent = (bow, bow)
    kind = "path" if scene.path else "seed" if scene.seed.curvature is not None else "natural"
    return Walk((first.bent(bent), *stages), tuple(counts), kind, mesh, degree)


def mesh_of(scene: Scene) -> int | FloatArray:
    """Number of equal elements, or the joints, as the scene says them; the usual number where it does not."""
    said = {f"model.{name}" for name in SAY_ELEMENTS} & scene.given()
    if not said:
        return ELEMENTS
    joints = np.concatenate([[0.0], np.cumsum(scene.model.lengths)])
    return np.asarray(joints / joints[-1])
