"""From a scene to the shearable rod: its section, what holds and loads it, and the way from the seed along the path."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from compare.errors import BadInput
from compare.models.base import Shape
from compare.scene.data import unit
from compare.scene.scene import Scene
from compare.scene.spec import SAY_ELEMENTS, ClampSpec, RodSpec
from shellref.rod.problem import Held, RodProblem, Section, rectangle
from shellref.rod.solve import Start

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
class WayThere:
    """The problems to go through, in order, the equal steps that each stage has at least, and what the way begins at:
    "natural", "seed" or "path"."""

    problems: tuple[RodProblem, ...]
    steps: tuple[int | None, ...]
    kind: str


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
    length, rod = scene.strip.length, scene.rod
    weight = np.zeros(3) if scene.up is None else -scene.gamma * scene.up
    start = _held(scene.clamp_start, scene.start_position, scene.start_frame)
    end = _held(scene.clamp_end, scene.end_position, scene.end_frame)

    def law(values: tuple[float, float] | None) -> tuple[float, float]:
        return (0.0, 0.0) if values is None else (values[0] * length, values[1] * length)

    return RodProblem(
        section=section_of(scene),
        curvature=scene.curvature,
        in_plane=law(None if rod is None else rod.natural_in_plane),
        twist=law(None if rod is None else rod.natural_twist),
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


def way_there(scene: Scene) -> WayThere:
    """From the rest shape, or from a rod naturally bent like the seed, through the stages of the path."""
    stages = [problem_of(stage) for stage in scene.stages()]
    counts = [None, *(stage.steps for stage in scene.path[1:]), None] if scene.path else [None]
    first = stages[0]
    bent = first.curvature
    if scene.seed.curvature is not None:
        values = np.array(scene.seed_curvature)
        slope, start = np.polyfit(np.linspace(0.0, 1.0, len(values)), values, 1)
        bent = (float(values[0]), float(values[1])) if len(values) == 2 else (float(start), float(start + slope))
    points = [held.position for held in (first.start, first.end) if held.position is not None]
    if len(points) == 2 and math.dist(*points) < 1.0 - 1e-9 and max(map(abs, bent)) < STRAIGHT:
        bow = -BOW if sum(bent) < 0.0 else BOW
        bent = (bow, bow)
    kind = "path" if scene.path else "seed" if scene.seed.curvature is not None else "natural"
    return WayThere((first.bent(bent), *stages), tuple(counts), kind)


def mesh_of(scene: Scene) -> int | FloatArray:
    """Number of equal elements, or the joints, as the scene says them; the usual number where it does not."""
    said = {f"model.{name}" for name in SAY_ELEMENTS} & scene.given()
    if not said:
        return ELEMENTS
    joints = np.concatenate([[0.0], np.cumsum(scene.model.lengths)])
    return np.asarray(joints / joints[-1])


def beside(shape: Shape, s: FloatArray) -> Start:
    """Another model's shape at the nodes s (n,) of a mesh."""
    return Start(np.asarray(shape.centreline(s)), np.asarray(shape.frames(s)))
