"""From a planar scene to the elastica: its problem in the plane of the start clamp, and how it is started.

Held at its start only, the elastica goes its own way, from the natural shape under rising loads. Held at both ends, or
with a seed or a path of its own, a strip has several equilibria: beside a ribbon the elastica begins at the ribbon's
theta and settles in its own equations; alone it begins as a strip naturally bent like the seed and goes from there
through the stages of the path.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from compare.errors import BadInput
from compare.models.timing import timed
from compare.scene.scene import Scene
from ribbon import Equilibrium
from shellref.elastica.solve import (
    ElasticaOptions,
    ElasticaProblem,
    ElasticaResult,
    ElasticaStatus,
    embed,
    embed_frames,
    to_plane,
)
from shellref.elastica.solve import solve as solve_elastica
from shellref.elastica.start import natural_start, solve_along, solve_near

FloatArray = NDArray[np.float64]
Progress = Callable[[str], None]

SAMPLES = 1001
"""Abscissae at which a ribbon's theta is taken."""

SAME_BRANCH = 0.02
"""Distance over l from the ribbon's centreline beyond which the elastica is on another branch and is started again."""

PLANAR_RIBBON = 1e-3
"""Component of a ribbon's tangent out of the plane from which it is not planar and no start for an elastica."""

ELEMENTS = 40
"""Elements of an elastica that does not go its own way."""

BEGAN = {
    "natural": "the natural shape, the loads raised",
    "seed": "the seed as natural shape, then straightened and loaded",
    "path": "the seed, then the stages of the path",
    "ribbon": "the ribbon's shape",
}
"""Where an elastica began, in words."""

OFFER = "go past it by arc length: --set model.arc_length=always"


@dataclass(frozen=True)
class ElasticaRun:
    """An elastica solve put into space (clamp at `position` (3,), `frame` (3, 3)), times in s.

    start: where it began: "natural", "seed", "path" or "ribbon".
    """

    result: ElasticaResult
    position: FloatArray
    frame: FloatArray
    first: float
    warm: float
    start: str = "natural"

    def centreline(self, s: FloatArray) -> FloatArray:
        """Positions (k, 3) at abscissae s (k,), units of l."""
        return embed(self.result, self.position, self.frame, s)

    def frames(self, s: FloatArray) -> FloatArray:
        """Material frames (k, 3, 3) at abscissae s (k,)."""
        return embed_frames(self.result, self.frame, s)

    def in_space(self, vector: tuple[float, float]) -> FloatArray:
        """A vector (2,) of the plane in space, shape (3,)."""
        return vector[0] * self.frame[:, 2] - vector[1] * self.frame[:, 1]

    def couple(self, moment: float) -> FloatArray:
        """A couple about the normal of the plane, counter-clockwise in it, in space, shape (3,): t_z x (-t_y) = t_x."""
        return moment * self.frame[:, 0]


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
    if scene.up is not None and (scene.gamma or scene.tip_load):
        plane, _ = to_plane(frame, scene.up)
        norm = float(np.hypot(*plane))
        up = plane[0] / norm, plane[1] / norm
        force = -scene.tip_load * up[0], -scene.tip_load * up[1]
    end: tuple[float, float] | None = None
    if scene.end_position is not None:
        end, _ = to_plane(frame, scene.end_position - position)
    angle: float | None = None
    if scene.end_frame is not None:
        (x, y), _ = to_plane(frame, scene.end_frame[:, 2])
        own = math.atan2(y, x)
        near = seed_turn(scene) if turn is None else turn
        angle = own + 2.0 * math.pi * round((near - own) / (2.0 * math.pi))
    return ElasticaProblem(gamma=scene.gamma, up=up, curvature=scene.curvature, force=force, end=end, end_angle=angle)


def seed_turn(scene: Scene) -> float:
    """Total angle of the seed's tangent: the integral of its curvature, piecewise linear at equal distances."""
    values = np.array(scene.seed_curvature)
    return float(np.mean(0.5 * (values[1:] + values[:-1])))


def ribbon_angle(scene: Scene, ribbon: Equilibrium, s: FloatArray) -> FloatArray:
    """theta (k,) of a ribbon's tangent in the plane of the start clamp, continuous from s = 0, at s (k,) ascending."""
    frames = np.asarray(ribbon.frame(s))
    axes = scene.frame
    theta = np.unwrap(np.arctan2(-frames[:, :, 2] @ axes[:, 1], frames[:, :, 2] @ axes[:, 2]))
    return theta - 2.0 * math.pi * round(float(theta[0]) / (2.0 * math.pi))


def out_of_plane(scene: Scene, ribbon: Equilibrium, s: FloatArray) -> float:
    """Largest component of a ribbon's tangent out of the plane of its start clamp, at s (k,)."""
    return float(np.abs(np.asarray(ribbon.frame(s))[:, :, 2] @ scene.frame[:, 0]).max())


def run_elastica(scene: Scene, progress: Progress | None = None, near: Equilibrium | None = None) -> ElasticaRun:
    """Solves a planar scene as an elastica in theta(s); `BadInput` names what breaks planarity otherwise.

    near: the ribbon's equilibrium, on whose branch the elastica is to be.
    """
    problem = elastica_problem(scene)
    if progress:
        progress("elastica: the scene is planar")
    own = not scene.path and problem.cantilever
    if near is not None and not own:
        found = _near(scene, near)
        if found is not None:
            return found
    run = _alone(scene, problem)
    if near is not None and own and _apart(run, near) > SAME_BRANCH:
        return _near(scene, near) or run
    return run


def _run(scene: Scene, once: Callable[[bool], ElasticaResult], start: str) -> ElasticaRun:
    """Timed without the error estimate, then solved with it."""
    _, first, warm = timed(lambda: once(False))
    return ElasticaRun(_worded(once(True)), np.asarray(scene.position), scene.frame, first, warm, start)


def _worded(result: ElasticaResult) -> ElasticaResult:
    """The message with what the scene can do about it, in the place of the solver's own options."""
    where, _, _ = result.message.rpartition(": ")
    if result.status is ElasticaStatus.LIMIT_POINT:
        return replace(result, message=f"{where}: {OFFER}")
    if result.status is ElasticaStatus.NOT_CONVERGED:
        return replace(result, message=f"{where}: choose another [seed], or go there by a [[path]]")
    return result


def _apart(run: ElasticaRun, ribbon: Equilibrium) -> float:
    """Largest distance of the two centrelines at equal s, in l."""
    s = np.linspace(0.0, 1.0, 201)
    return float(np.linalg.norm(run.centreline(s) - ribbon.position(s), axis=1).max())


def _near(scene: Scene, ribbon: Equilibrium) -> ElasticaRun | None:
    """From the ribbon's theta; None when that is not planar, or when there is no equilibrium beside it."""
    s = np.linspace(0.0, 1.0, SAMPLES)
    if out_of_plane(scene, ribbon, s) > PLANAR_RIBBON:
        return None
    theta = ribbon_angle(scene, ribbon, s)
    problem = elastica_problem(scene, float(theta[-1]))
    clock = time.perf_counter()
    if solve_near(problem, s, theta, ELEMENTS, estimate_error=False) is None:
        return None
    first = time.perf_counter() - clock

    def once(estimate: bool) -> ElasticaResult:
        found = solve_near(problem, s, theta, ELEMENTS, estimate_error=estimate)
        assert found is not None  # the same solve as above
        return found

    return replace(_run(scene, once, "ribbon"), first=first)


def _alone(scene: Scene, problem: ElasticaProblem) -> ElasticaRun:
    """From the seed and along the path where the scene has them, else from the natural shape."""
    options = ElasticaOptions(arc_length=scene.model.arc_length)
    seeded = scene.model.energy == "elastica" and scene.seed.curvature is not None
    if not scene.path and problem.cantilever and not seeded:

        def once(estimate: bool) -> ElasticaResult:
            return solve_elastica(problem, options=options, estimate_error=estimate)

        return _run(scene, once, "natural")
    stages: list[ElasticaProblem] = []
    turn = seed_turn(scene)
    for stage in scene.stages():
        stages.append(elastica_problem(stage, turn))
        turn = stages[-1].end_angle if stages[-1].end_angle is not None else turn
    problems = [_beginning(scene, stages[0]), *stages]
    try:
        return _run(
            scene,
            lambda estimate: solve_along(problems, ELEMENTS, options=options, estimate_error=estimate),
            "path" if scene.path else "seed",
        )
    except ValueError as error:
        raise BadInput(
            "path", None, f"cannot be gone by the elastica: {error}", "let every stage hold the strip alike"
        ) from None


def _beginning(scene: Scene, first: ElasticaProblem) -> ElasticaProblem:
    """The unloaded strip that is naturally bent like the seed (its linear part, where the seed has more values)."""
    values = np.array(scene.seed_curvature)
    s = np.linspace(0.0, 1.0, len(values))
    slope, start = np.polyfit(s, values, 1)
    bent = float(start), float(start + slope)
    if len(values) == 2:
        bent = float(values[0]), float(values[1])
    if first.end is not None and float(np.abs(bent).max()) < STRAIGHT:
        sign = -1.0 if sum(bent) < 0.0 else 1.0
        turn = first.end_angle if first.end_angle else sign * BOW
        bent = turn, turn
    return natural_start(first, bent)


STRAIGHT = 0.5
"""Curvature times l below which a seed is straight: between two held points it would be taut and its force unknown."""

BOW = 2.0
"""Curvature times l with which the way then begins."""
