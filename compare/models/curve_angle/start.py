"""From a scene to the curve-angle rod: its data with l = 1, where it begins, and the way through the stages."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from compare.models.base import Shape
from compare.scene.inputs.law import turn as turn_of
from ribbon.rods.result import RodShape
from ribbon.rods.rod import Rod, RodEnd, marched, rotation
from ribbon.rods.solve import newton, solve
from ribbon.rods.start import from_frames
from ribbonbench.errors import BadInput

if TYPE_CHECKING:
    from compare.scene.scene import Scene
    from ribbon.rods.curve_angle import CurveAngle

FloatArray = NDArray[np.float64]


def stiffness_missing(scene: Scene) -> BadInput | None:
    """Why the stiffnesses of the section are not known; None: they are."""
    rod = scene.rod
    if rod is not None and rod.bending is not None and rod.torsion is not None:
        return None
    if _thickness(scene) is None:
        what = "rod" if scene.strip.second_moment is not None else "strip.thickness"
        return BadInput(
            what, None, "is missing: without a thickness the stiffnesses of a rod's section are not known",
            "add [rod] with bending and torsion" + ("" if what == "rod" else ", or strip.thickness"),
        )  # fmt: skip
    return None


def held_badly(scene: Scene) -> BadInput | None:
    """Walls, and ends of which none keeps the rod from turning about its own axis."""
    if scene.walls:
        return BadInput("wall", None, "confines the strip, and this rod has no contact", 'choose energy = "kirchhoff"')
    if scene.closure is not None:
        if scene.gamma and not scene.start_clamped:
            return BadInput(
                "closure", scene.closure.kind, "leaves a rod with weight without a place",
                "add [clamp.start] with position, tangent and normal, or remove [gravity]",
            )  # fmt: skip
        return None
    if scene.start_frame is None and scene.end_frame is None:
        return BadInput(
            "clamp.start", None, "leaves the frame free, and so does clamp.end: the rod may turn about its own axis",
            "give tangent and normal to one of them",
        )  # fmt: skip
    if scene.start_position is None and scene.end_position is None:
        return BadInput("clamp.start", None, "leaves the position free, and so does clamp.end", "give position")
    return None


def _thickness(scene: Scene) -> float | None:
    ratios = scene.shell.width_to_thickness
    return float(scene.width / ratios[0]) if scene.thickness is None and len(ratios) == 1 else scene.thickness


def stiffness_of(scene: Scene) -> tuple[float, float, float]:
    """E I_1, E I_2, G J in D w (Y I of a scene with strip.second_moment): those of `[rod]`, else of the rectangle as
    the energy "kirchhoff" has them (docs/theory.md, eq. (10.5), (10.18))."""
    from ribbon.energies.section.rod import stiffnesses

    given = scene.rod
    bending, torsion = (None, None) if given is None else (given.bending, given.torsion)
    thickness, nu = _thickness(scene), scene.strip.poisson
    if thickness is not None:
        plate = 1.0 if scene.model.stiffness == "plate" else 0.0
        normal, twist = stiffnesses((0.5 * scene.width, thickness, nu, plate))
        bending = bending or (normal, (1.0 - nu**2) * (scene.width / thickness) ** 2)
        torsion = torsion or twist
    assert bending is not None  # `stiffness_missing`
    assert torsion is not None
    return float(bending[0]), float(bending[1]), float(torsion)


def origin_of(scene: Scene) -> FloatArray:
    """The place (3,) that the rod is seen from while it is solved: what holds it, at s = 0 if that does (l = 1)."""
    held = scene.start_position if scene.start_position is not None else scene.end_position
    return np.zeros(3) if held is None else held


def _end(scene: Scene, end: str, origin: FloatArray) -> RodEnd:
    spec = scene.clamp_start if end == "start" else scene.clamp_end
    position = scene.start_position if end == "start" else scene.end_position
    frame = scene.start_frame if end == "start" else scene.end_frame
    slide = None if spec is None or spec.slide is None else np.array(spec.slide) / np.linalg.norm(spec.slide)
    return RodEnd(None if position is None else position - origin, frame, slide)


def seam_turn(scene: Scene) -> float:
    """Angle by which the end of a closed rod is turned about its tangent."""
    assert scene.closure is not None
    return math.pi if scene.closure.kind == "moebius" else scene.closure.twist


def rod_of(scene: Scene, lengths: FloatArray, origin: FloatArray) -> Rod:
    """The scene's rod with edges of `lengths` (n,), l = 1, seen from `origin` (3,). A closed rod is held at its seam,
    on both sides: that takes its rigid motions from it and nothing else."""
    start, end = _end(scene, "start", origin), _end(scene, "end", origin)
    if scene.closure is not None:
        frame = np.eye(3) if start.frame is None else start.frame
        position = -origin if start.position is None else start.position
        start = RodEnd(position, frame)
        end = RodEnd(position, frame @ rotation(np.array([0.0, 0.0, seam_turn(scene)])))
    up = scene.up
    return Rod(
        lengths=np.asarray(lengths, dtype=float),
        stiffness=stiffness_of(scene),
        rest=(scene.curvature, scene.geodesic, scene.twist),
        start=start,
        end=end,
        weight=np.zeros(3) if up is None else scene.gamma * up,
        force=scene.tip_force,
        moment=scene.tip_moment,
    )


def begun(scene: Scene, rod: Rod) -> tuple[CurveAngle, FloatArray]:
    """Problem and unknowns of the seed: the curvature that it says, or at rest; of a closed rod a circle whose twist is
    even."""
    strains = rod.at_rest(rod.middles)
    turn = 0.0
    if scene.closure is not None:
        sense = -1.0 if turn_of(scene.curvature) < 0.0 else 1.0
        strains = np.zeros((rod.edges + 1, 3))
        strains[:, 0] = sense * 2.0 * math.pi * scene.closure.turns
        turn = seam_turn(scene)
    elif scene.seed.curvature is not None:
        values = np.array(scene.seed_curvature)
        strains = np.zeros((rod.edges + 1, 3))
        strains[:, 0] = np.interp(rod.middles, np.linspace(0.0, 1.0, values.size), values)
    first = np.zeros(3) if rod.start.position is None else rod.start.position
    if rod.start.frame is not None:
        points, frames = marched(rod, first, rod.start.frame, strains)
    else:  # marched from an arbitrary frame, then moved as a whole to where the end is held
        assert rod.end.frame is not None
        points, frames = marched(rod, np.zeros(3), np.eye(3), strains)
        last = frames[-1] @ rotation(rod.cells[-1] * strains[-1])
        move = rod.end.frame @ last.T
        points, frames = points @ move.T, move @ frames
        held = rod.start.position, rod.end.position
        points = points + (held[0] - points[0] if held[0] is not None else np.asarray(held[1]) - points[-1])
    if turn:
        middles = 0.5 * (rod.vertices[1:] + rod.vertices[:-1])
        frames = np.array([f @ rotation(np.array([0.0, 0.0, turn * s])) for f, s in zip(frames, middles, strict=True)])
    return from_frames(rod, points, frames)


def beside(rod: Rod, shape: Shape, origin: FloatArray) -> tuple[CurveAngle, FloatArray]:
    """Problem and unknowns of the rod, seen from `origin` (3,), in another model's shape."""
    s = rod.vertices
    points = np.asarray(shape.centreline(s)) - origin
    return from_frames(rod, points, np.asarray(shape.frames(0.5 * (s[1:] + s[:-1]))))


@dataclass(frozen=True)
class Walk:
    """The scene's rod with edges of `lengths` (n,): from the seed through the stages of the path, or from `near`,
    another model's shape."""

    scene: Scene
    lengths: FloatArray
    near: Shape | None = None

    def solve(self) -> RodShape:
        """The end of the walk."""
        scene, lengths = self.scene, self.lengths
        quasi = scene.rod is not None and scene.rod.twist == "quasi-static"
        origin = origin_of(scene)
        if self.near is not None:
            rod = rod_of(scene, lengths, origin)
            return RodShape(solve(*beside(rod, self.near, origin), quasi_static=quasi), origin)
        stages = scene.stages()
        problem, y = begun(stages[0], rod_of(stages[0], lengths, origin))
        # a round rod's circle of even twist is an equilibrium at every turn: not to be left for any other on the way
        found = newton(problem, y) if scene.closure is not None else None
        if found is None or not found.ok:
            found = solve(problem, y, quasi_static=quasi)
        for stage in stages[1:]:
            if not found.ok:
                break
            rod = rod_of(stage, lengths, origin)
            frames = found.problem.anchors.frames.copy()
            for at, end in ((0, rod.start.frame), (-1, rod.end.frame)):
                if end is not None:
                    frames[at] = end
            anchors = replace(found.problem.anchors, frames=frames)
            found = solve(replace(problem, rod=rod, anchors=anchors), found.y, quasi_static=quasi)
        return RodShape(found, origin)


def cut_in_two(shape: RodShape) -> RodShape:
    """The equilibrium with every edge cut in two."""
    rod = replace(shape.rod, lengths=np.repeat(0.5 * shape.rod.lengths, 2))
    s = rod.vertices
    turn = 0.5 * float(shape.problem.evaluated(shape.found.y).strain[-1, 2])
    points = shape.centreline(s, shape.origin)
    return RodShape(solve(*from_frames(rod, points, shape.frames(0.5 * (s[1:] + s[:-1])), turn)), shape.origin)
