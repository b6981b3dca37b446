"""From a scene to what the ribbon's solver takes: strip, clamps, closure, walls, weight, with l = 1."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Literal

import numpy as np

from compare.scene.scene import Scene
from ribbon import Clamp, Closure, Gravity, Strip, Wall
from ribbon.contact import Barrier
from ribbon.energies.names import FREE
from ribbon.find.solve import Problem, build
from ribbon.obstacle import Obstacle
from ribbon.problems import formulation as _formulation
from ribbon.solid import Solid
from ribbon.solvers import choose

#: The energy behind "auto", and beside an elastica: the one that is exact in the width (thesis, eq. 2.11).
AUTO_ENERGY = "wunderlich"


def ribbon_energy(scene: Scene) -> str:
    """The energy the ribbon uses: the scene's own, "wunderlich" for "auto" and beside an elastica."""
    return AUTO_ENERGY if scene.model.energy in ("auto", "elastica") else scene.model.energy


def has_free_twist(scene: Scene) -> bool:
    """Whether the scene's energy is one of a strip of finite thickness, whose twist is free."""
    return ribbon_energy(scene) in FREE


def needs_thickness(scene: Scene) -> bool:
    """Whether the ribbon depends on a thickness: by its energy, or because an accuracy chooses it."""
    return has_free_twist(scene) or scene.model.accuracy is not None


def relative_thickness(scene: Scene) -> float | None:
    """h / l of the ribbon: the strip's own; for an energy that asks for it, or a choice by accuracy, also that of the
    scene's only w/h."""
    ratios = scene.shell.width_to_thickness
    if needs_thickness(scene) and len(ratios) == 1:
        return float(scene.width / ratios[0])
    return scene.thickness


def ribbon_strip(scene: Scene) -> Strip:
    """The scene's strip with l = 1."""
    return Strip(
        length=1.0,
        width=scene.width,
        poisson=scene.strip.poisson,
        natural_curvature=scene.curvature,
        gamma=scene.gamma,
        thickness=relative_thickness(scene),
        natural_twist=scene.twist,
        natural_geodesic_curvature=scene.geodesic,
    )


def _clamp(scene: Scene, end: str) -> Clamp | None:
    """The clamp at "start" or "end", its position in units of l, with None for what it leaves free; None: no clamp."""
    spec = scene.clamp_start if end == "start" else scene.clamp_end
    if spec is None:
        return None
    position = scene.start_position if end == "start" else scene.end_position
    frame = scene.start_frame if end == "start" else scene.end_frame
    tangent = None if frame is None else frame[:, 2]
    normal = None if frame is None else frame[:, 1]
    ruling: str | None = spec.ruling
    if has_free_twist(scene) and f"clamp.{end}.ruling" not in scene.own_keys:
        ruling = None  # what goes without saying for a ruling is no demand on an energy that knows none
    return Clamp(position, tangent=tangent, normal=normal, ruling=ruling)


def ribbon_clamp(scene: Scene) -> Clamp | None:
    """What holds s = 0: a clamp that holds nothing for a free start; None for a band that no clamp holds."""
    found = _clamp(scene, "start")
    return Clamp(None, None, None) if found is None and scene.closure is None else found


def ribbon_end(scene: Scene) -> Clamp | None:
    """What holds s = l; None: free, or closed."""
    return _clamp(scene, "end")


def ribbon_closure(scene: Scene) -> Closure | None:
    """The band's closure; None: an open ribbon."""
    spec = scene.closure
    return None if spec is None else Closure(spec.kind, spec.ruling, spec.turns, spec.half_turns)


def ribbon_walls(scene: Scene) -> tuple[Barrier, ...]:
    """The walls, then the obstacles (`Scene.barriers`), points in units of l, stiffness in D w / l^3."""
    placed = zip(scene.walls, scene.wall_points, scene.wall_normals, strict=True)
    walls = (Wall(point, normal, wall.stiffness, wall.friction) for wall, point, normal in placed)
    return (*walls, *_obstacles(scene))


def _obstacles(scene: Scene) -> Iterator[Obstacle]:
    for spec, body in zip(scene.obstacles, scene.bodies, strict=True):
        if spec.kind == "box":
            yield Solid("box", body.point, body.radius, body.axis, body.inside, body.normal, body.size)
        elif spec.kind == "edge":
            yield Solid("edge", body.point, body.radius, body.axis, body.inside, body.normal, None, body.angle)
        else:
            kind: Literal["cylinder", "sphere"] = "sphere" if spec.kind == "sphere" else "cylinder"
            yield Obstacle(kind, body.point, body.radius, body.axis, body.inside, friction=spec.friction)


def ribbon_gravity(scene: Scene) -> Gravity | None:
    """The weight's direction, or None for a weightless scene: the term is then absent."""
    if scene.gravity is None or scene.up is None or not scene.gamma:
        return None
    return Gravity(up=scene.up, exact=scene.gravity.exact)


def requested_formulation(scene: Scene) -> str:
    """The formulation asked of the ribbon; a path is gone in the mixed model unless the scene says otherwise.

    (Its steps start warm with multipliers, and stages may hold what the chained model cannot.)
    """
    requested = scene.model.formulation
    return "mixed" if requested == "auto" and (scene.path or scene.seed.curve is not None) else requested


def build_arguments(scene: Scene) -> dict[str, Any]:
    """Keywords of `ribbon.find.solve.build`: the problem alone, without a starting shape."""
    return {
        "strip": ribbon_strip(scene),
        "clamp": ribbon_clamp(scene),
        "gravity": ribbon_gravity(scene),
        "end": ribbon_end(scene),
        "closure": ribbon_closure(scene),
        "walls": ribbon_walls(scene),
        "energy": ribbon_energy(scene),
        "segments": np.asarray(scene.model.lengths),
        "formulation": requested_formulation(scene),
        "held_by": scene.model.held_by,
        "stiffness": scene.model.stiffness,
        "in_plane": scene.model.in_plane,
        "tip": None if scene.tip is None else scene.tip_force,
        "apart": scene.apart,
        "round_rod": scene.round_rod,
    }


def ribbon_arguments(scene: Scene) -> dict[str, Any]:
    """Keywords of `ribbon.solve`: those of `build_arguments` and the starting shape, curvature in 1/l."""
    curvature = "natural" if scene.seed.curvature is None else scene.seed_curvature
    return {**build_arguments(scene), "seed_curvature": curvature, "seed_ruling": scene.seed.ruling}


def ribbon_problem(scene: Scene, formulation: str | None = None) -> Problem:
    """The ribbon's minimisation problem of a scene; `formulation`: another one than the scene asks for."""
    arguments = build_arguments(scene)
    with choose.using(scene.model.solver):
        return build(**(arguments if formulation is None else {**arguments, "formulation": formulation}))


def formulation_why(scene: Scene, used: str) -> str:
    """Why the ribbon has the formulation `used` ("chained", "mixed", "matrix")."""
    from ribbon.find.adaptive import HEAVY

    if scene.model.formulation == "auto" and used == "mixed" and scene.path:
        return "a [[path]] goes on from multipliers and may hold more on its way than the chained model can"
    if scene.model.formulation == "auto" and used == "mixed" and scene.model.tolerance and scene.gamma > HEAVY:
        return f"segments are placed by a tolerance; beyond Gamma = {HEAVY:g} chained forces are rounded too coarsely"
    clamp, end = ribbon_clamp(scene), ribbon_end(scene)
    start = None if clamp is None or (clamp.position is None and not clamp.holds_frame) else clamp
    segments = len(scene.model.lengths)
    arguments = start, end, ribbon_closure(scene), ribbon_walls(scene), ribbon_gravity(scene), segments
    chosen, why = _formulation.choose(scene.model.formulation, *arguments, scene.model.solver, scene.apart is not None)
    return why if chosen == used else f"{chosen} ({why}) cannot solve this scene; {used} can"
