"""From a planar scene to the elastica: its problem in the plane of the start clamp, and where it begins.

Held at its start only, the elastica goes its own way, from the natural shape under rising loads. Held at both ends, or
with a seed or a path of its own, a strip has several equilibria: beside another model the elastica begins at that
model's theta and settles in its own equations; alone it begins as a strip naturally bent like the seed and goes from
there through the stages of the path.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from compare.models.base import BESIDE, Shape
from compare.scene.scene import Scene
from ribbonbench.errors import BadInput
from shellref.elastica.contact.barrier import Barrier
from shellref.elastica.path import ElasticaOptions
from shellref.elastica.problem import ElasticaProblem
from shellref.elastica.result import ElasticaResult, embed, to_plane
from shellref.elastica.solve import solve as solve_elastica
from shellref.elastica.start import DEGREE, natural_start, solve_along, solve_near

FloatArray = NDArray[np.float64]

SAMPLES = 1001
"""Abscissae at which another model's theta is taken."""

SAME_BRANCH = 0.02
"""Distance over l from the other model's centreline beyond which the elastica is on another branch."""

PLANAR = 1e-3
"""Component of a tangent out of the plane from which a shape is not planar and no start for an elastica."""

ELEMENTS = 40
"""Elements of an elastica when nothing else is asked for."""

OWN_DEGREE = 2
"""Degree of its elements where it goes its own way; `shellref.elastica.start.DEGREE` elsewhere."""


@dataclass(frozen=True)
class Start:
    """Where an elastica begins ("natural", "seed", "path"; "ribbon": another model's shape), and its solve from there:
    `once(elements, degree, estimate)`, elements and degree None for the usual ones; one solve, and with `estimate` a
    second one on halved elements."""

    kind: str
    once: Callable[[int | None, int | None, bool], ElasticaResult]


def start_of(scene: Scene, near: Shape | None = None) -> Start:
    """Where the scene's elastica begins; near: the shape on whose branch it is to be.

    Which start leads to that branch is found out by solving. Raises `BadInput` as `elastica_problem`, and for a path
    that the elastica cannot go.
    """
    problem = elastica_problem(scene)
    own = not scene.path and problem.cantilever and not problem.touching
    if near is not None and not own:
        found = _near(scene, near)
        if found is not None:
            return found
    alone = _alone(scene, problem)
    if near is not None and own and _apart(scene, alone.once(None, None, False), near) > SAME_BRANCH:
        return _near(scene, near) or alone
    return alone


def _apart(scene: Scene, result: ElasticaResult, shape: Shape) -> float:
    """Largest distance of the two centrelines at equal s, in l."""
    s = np.linspace(0.0, 1.0, 201)
    line = embed(result, scene.position, scene.frame, s)
    return float(np.linalg.norm(line - shape.centreline(s), axis=1).max())


def _near(scene: Scene, shape: Shape) -> Start | None:
    """From the shape's theta; None when that is not planar, or when there is no equilibrium beside it."""
    s = np.linspace(0.0, 1.0, SAMPLES)
    if out_of_plane(scene, shape, s) > PLANAR:
        return None
    theta = angle_of(scene, shape, s)
    problem = elastica_problem(scene, float(theta[-1]))
    if solve_near(problem, s, theta, ELEMENTS, estimate_error=False) is None:
        return None

    def once(elements: int | None, degree: int | None, estimate: bool) -> ElasticaResult:
        result = solve_near(problem, s, theta, elements or ELEMENTS, degree or DEGREE, estimate_error=estimate)
        if result is None:  # on the usual elements it was there
            raise BadInput("elements", elements, "is too coarse for the elastica beside this shape", "take more")
        return result

    return Start(BESIDE, once)


def _alone(scene: Scene, problem: ElasticaProblem) -> Start:
    """From the seed and along the path where the scene has them, else from the natural shape."""
    options = ElasticaOptions(arc_length=scene.model.arc_length)
    if not scene.path and problem.cantilever and not problem.touching and not _seeded(scene):

        def natural(elements: int | None, degree: int | None, estimate: bool) -> ElasticaResult:
            return solve_elastica(
                problem, elements or ELEMENTS, degree or OWN_DEGREE, options=options, estimate_error=estimate
            )

        return Start("natural", natural)
    stages: list[ElasticaProblem] = []
    turn = seed_turn(scene)
    for stage in scene.stages():
        stages.append(elastica_problem(stage, turn))
        turn = stages[-1].end_angle if stages[-1].end_angle is not None else turn
    problems = [_beginning(scene, stages[0]), *stages]

    def along(elements: int | None, degree: int | None, estimate: bool) -> ElasticaResult:
        try:
            return solve_along(
                problems, elements or ELEMENTS, degree or DEGREE, options=options, estimate_error=estimate
            )
        except ValueError as error:
            raise BadInput(
                "path", None, f"cannot be gone by the elastica: {error}", "let every stage hold the strip alike"
            ) from None

    return Start("path" if scene.path else "seed", along)


def _seeded(scene: Scene) -> bool:
    """Whether the scene gives a cantilever another start than its natural shape: one that asks for the elastica."""
    return scene.model.energy == "elastica" and scene.seed.curvature is not None


def elastica_problem(scene: Scene, turn: float | None = None) -> ElasticaProblem:
    """The elastica's problem of a planar scene; `BadInput` names what breaks planarity otherwise.

    turn: total angle by which the tangent turns, about; that of the seed when not given. (The clamp at the end says it
    but for whole turns.)
    """
    reason = scene.nonplanar_reason()
    if reason:
        raise BadInput("model.energy", "elastica", f"is planar, but {reason}", 'choose "wunderlich" or turn the clamp')
    frame, position = scene.frame, scene.position
    up, force = (0.0, 1.0), (0.0, 0.0)
    if scene.up is not None and scene.gamma:
        plane, _ = to_plane(frame, scene.up)
        norm = float(np.hypot(*plane))
        up = plane[0] / norm, plane[1] / norm
    if scene.tip is not None:
        force, _ = to_plane(frame, scene.tip_force)
    end: tuple[float, float] | None = None
    if scene.end_position is not None:
        end, _ = to_plane(frame, scene.end_position - position)
    angle: float | None = None
    if scene.end_frame is not None:
        (x, y), _ = to_plane(frame, scene.end_frame[:, 2])
        own = math.atan2(y, x)
        near = seed_turn(scene) if turn is None else turn
        angle = own + 2.0 * math.pi * round((near - own) / (2.0 * math.pi))
    return ElasticaProblem(
        gamma=scene.gamma,
        up=up,
        curvature=scene.curvature,
        force=force,
        end=end,
        end_angle=angle,
        apart=scene.apart,
        barriers=circles(scene),
    )


def circles(scene: Scene) -> tuple[Barrier, ...]:
    """The cylinders of the scene where they go through the plane."""
    return tuple(
        Barrier(
            to_plane(scene.frame, np.array(one.point) / scene.strip.length - scene.position)[0],
            one.radius / scene.strip.length,
            -1.0 if one.inside else 1.0,
        )
        for one in scene.obstacles
        if one.radius is not None  # a cylinder: others are refused (`compare.scene.planar`)
    )


def seed_turn(scene: Scene) -> float:
    """Total angle of the seed's tangent: the integral of its curvature, piecewise linear at equal distances."""
    values = np.array(scene.seed_curvature)
    return float(np.mean(0.5 * (values[1:] + values[:-1])))


def angle_of(scene: Scene, shape: Shape, s: FloatArray) -> FloatArray:
    """theta (k,) of a shape's tangent in the plane of the start clamp, continuous from s = 0, at s (k,) ascending."""
    frames = np.asarray(shape.frames(s))
    axes = scene.frame
    theta = np.unwrap(np.arctan2(-frames[:, :, 2] @ axes[:, 1], frames[:, :, 2] @ axes[:, 2]))
    return theta - 2.0 * math.pi * round(float(theta[0]) / (2.0 * math.pi))


def out_of_plane(scene: Scene, shape: Shape, s: FloatArray) -> float:
    """Largest component of a shape's tangent out of the plane of its start clamp, at s (k,)."""
    return float(np.abs(np.asarray(shape.frames(s))[:, :, 2] @ scene.frame[:, 0]).max())


def _beginning(scene: Scene, first: ElasticaProblem) -> ElasticaProblem:
    """The unloaded strip that is naturally bent like the seed (its linear part, where the seed has more values).

    Held at both ends a seed of less than half a turn says a side; where its linear part would lie on the other one,
    its mean is turned over.
    """
    values = np.array(scene.seed_curvature)
    s = np.linspace(0.0, 1.0, len(values))
    slope, start = np.polyfit(s, values, 1)
    bent = float(start), float(start + slope)
    if len(values) == 2:
        bent = float(values[0]), float(values[1])
    if first.end is not None and float(np.abs(bent).max()) < STRAIGHT:
        turn = first.end_angle or 0.0
        bent = (turn, turn) if abs(turn) > LEVEL else (seed_side(values) * BOW,) * 2
    elif first.end is not None and abs(seed_turn(scene)) < math.pi and sum(bent) * _sag(values) < 0.0:
        bent = -bent[1], -bent[0]
    return natural_start(first, bent)


def seed_side(values: FloatArray) -> float:
    """The side of its chord on which the seed's shape mostly lies: the sign of the curvature that bends an arc there.

    values (k,): curvature at equal distances, linear between. The mean deflection from the chord of a slightly curved
    strip is - int kappa s (1 - s) / 2 ds. 1 where that is nothing beside the curvatures: a seed in S, or a straight one
    has no side, and rounding is not asked.
    """
    return -1.0 if _sag(values) < 0.0 else 1.0


def _sag(values: FloatArray) -> float:
    """The mean of the seed's curvature by s (1 - s); 0 where it is nothing beside the curvatures."""
    s = np.linspace(0.0, 1.0, 20 * (len(values) - 1) + 1)
    curvature = np.interp(s, np.linspace(0.0, 1.0, len(values)), values)
    weight = s * (1.0 - s)
    mean = float(curvature @ weight) / float(weight.sum())
    return mean if abs(mean) > LEVEL * float(np.abs(values).max()) else 0.0


STRAIGHT = 0.5
"""Curvature times l below which a seed is straight: between two held points it would be taut and its force unknown."""

LEVEL = 1e-6
"""Turn in radians, and share of a seed's curvature, below which it is nothing but rounding."""

BOW = 2.0
"""Curvature times l with which the way then begins."""
