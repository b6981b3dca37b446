"""Do the sections of a scene go together? Impossible or contradictory geometry is found before anything is computed.

Every fault is a `BadInput` that names the key, its value and what would be right. Distances here are in the scene's
own unit of length l.
"""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np

from compare import registry
from compare.scene.data import SceneData, frame_of, unit
from compare.scene.inputs import bodies
from compare.scene.spec import ClampSpec, ObstacleSpec, WallSpec
from compare.scene.table import UNIT_TOLERANCE, show
from ribbonbench import statics
from ribbonbench.errors import BadInput

TOO_FAR = 1e-12
"""How far, relatively, the two held points may be further apart than the length: rounding."""

STRETCHED = 1e-9
"""Difference of distance and length, relative to the length, up to which clamped frames have to lie along the chord:
the strip has no room to turn to others."""

ON_WALL = 1e-9
"""How far in front of a wall, in units of l, a held point stands on it: rounding."""

INTO_WALL = 1e-6
"""How far, over one length, a clamp that stands on a wall may point into it: rounding."""

TIGHTEST = 1e5
"""Curvature, in units of 1/l, that no strip turns away from an obstacle with: ten times a seed's largest. A point that
is g in front of it and heads for it with slope m turns away with m^2 / (2 g) at least."""

ACROSS = 33
"""Points of a held edge that are looked at beside an obstacle, its middle among them."""

OF_A_ROD = "is for a strip of section w x h, and strip.second_moment is that of a rod; the planar elastica bends rods"
"""What is said of a model that takes no strip.second_moment."""

MOEBIUS_WIDTH = 1.0 / math.sqrt(3.0)
"""Bound of w / l for an embedded paper Moebius band (R. Schwartz 2023, doi:10.48550/arXiv.2308.12641)."""

FEWEST_CLOSED = 3
"""Smallest number of elements of a closed band."""


def check_geometry(scene: SceneData) -> None:
    """Raise for the first combination of sections that cannot be, or that the chosen model cannot do."""
    _check_closure(scene)
    with np.errstate(over="ignore", invalid="ignore"):  # points at the end of the range of numbers
        _check_distance(scene)
        _check_room(scene)
        _check_common_room(scene)
        for name, clamp in (("clamp.start", scene.clamp_start), ("clamp.end", scene.clamp_end)):
            _check_clamp_and_walls(scene, name, clamp)
            _check_clamp_and_obstacles(scene, name, clamp)
    _check_tip(scene)
    _check_support(scene)
    _check_formulation(scene)
    _check_elastica(scene)


def check_clamps(scene: SceneData) -> None:
    """No clamp of a strip among others is behind a wall or in an obstacle, and walls leave room."""
    _check_room(scene)
    _check_common_room(scene)
    for name, clamp in (("clamp.start", scene.clamp_start), ("clamp.end", scene.clamp_end)):
        _check_clamp_and_walls(scene, name, clamp)
        _check_clamp_and_obstacles(scene, name, clamp)


def _check_closure(scene: SceneData) -> None:
    closure = scene.closure
    if closure is None:
        return
    if scene.clamp_end is not None:
        raise BadInput(
            "clamp.end",
            None,
            f'contradicts closure.kind = "{closure.kind}", which glues the end to the start',
            "remove [clamp.end] (clamp.start can hold the seam) or [closure]",
        )
    strip, model = scene.strip, scene.model
    if closure.kind == "moebius" and strip.width >= MOEBIUS_WIDTH * strip.length:
        raise BadInput(
            "strip.width",
            strip.width,
            f"is too wide for a Moebius band of length {strip.length}: without self-crossing the length must exceed "
            "sqrt(3) widths (Schwartz 2023, doi:10.48550/arXiv.2308.12641)",
            f"give a width below {MOEBIUS_WIDTH * strip.length:.6g}",
        )
    if model.elements < FEWEST_CLOSED:
        key = "model.elements" if model.element_lengths is None else "model.element_lengths"
        value = model.elements if model.element_lengths is None else list(model.element_lengths)
        raise BadInput(
            key,
            value,
            f"is too coarse for a closed band: {model.elements} elements cannot meet the closure",
            f"give at least {FEWEST_CLOSED} elements, better 20",
        )


def _check_distance(scene: SceneData) -> None:
    """The two held points are no further apart than the strip is long; at that distance it is straight."""
    start, end, length = scene.clamp_start, scene.clamp_end, scene.strip.length
    if start is None or end is None or start.position is None or end.position is None:
        return
    if start.slide is not None or end.slide is not None:
        _check_slid_distance(scene)
        return
    distance = math.dist(start.position, end.position)
    value = list(end.position)
    if not distance <= length * (1.0 + TOO_FAR):
        chord = np.array(end.position) - start.position
        nearest = tuple(start.position + chord * (length / distance))
        furthest = f"; in this direction the furthest is {show(nearest)}" if math.isfinite(distance) else ""
        raise BadInput(
            "clamp.end.position",
            value,
            f"is {distance:.12g} away from clamp.start.position, further than strip.length = {length}",
            f"give a point within {length} of it{furthest}",
        )
    slack = max(0.0, 1.0 - distance / length)
    if slack > STRETCHED:
        return
    # a tangent that leaves the chord by an angle costs some angle^2 / 15 of the length
    tolerance = max(4.0 * UNIT_TOLERANCE, math.sqrt(slack))
    chord = (np.array(end.position) - start.position) / distance
    frames = [frame_of(start), frame_of(end)]
    for name, frame in zip(("start", "end"), frames, strict=True):
        if frame is not None and np.linalg.norm(frame[:, 2] - chord) > tolerance:
            raise BadInput(
                f"clamp.{name}.tangent",
                list(frame[:, 2]),
                f"is not along the chord, but the clamps stand strip.length = {length} apart and stretch the strip "
                "straight",
                f"give {show(tuple(chord))}, or move clamp.end.position closer",
            )
    if frames[0] is not None and frames[1] is not None and np.linalg.norm(frames[0] - frames[1]) > 2.0 * tolerance:
        raise BadInput(
            "clamp.end.normal",
            list(frames[1][:, 1]),
            f"is not clamp.start.normal, but the clamps stand strip.length = {length} apart and stretch the strip "
            "straight",
            f"give {show(tuple(frames[0][:, 1]))}, or move clamp.end.position closer",
        )


def _check_slid_distance(scene: SceneData) -> None:
    """Points that slide come within the length of each other."""
    start, end = scene.clamp_start, scene.clamp_end
    assert start is not None
    assert end is not None
    assert start.position is not None
    assert end.position is not None
    ways = np.array([unit(clamp.slide) for clamp in (start, end) if clamp.slide is not None]).T
    chord = np.array(end.position) - start.position
    nearest = float(np.linalg.norm(chord - ways @ np.linalg.lstsq(ways, chord, rcond=None)[0]))
    if nearest > scene.strip.length * (1.0 + TOO_FAR):
        raise BadInput(
            "clamp.end.position", list(end.position),
            f"comes, slid, no nearer than {nearest:.12g} to clamp.start.position, further than strip.length = "
            f"{scene.strip.length}", "move it closer",
        )  # fmt: skip


def wall_name(index: int, wall: WallSpec) -> str:
    """How keys and errors name a wall: by its name, or by its number from 0."""
    return f"wall.{index if wall.name is None else wall.name}"


def obstacle_name(index: int, obstacle: ObstacleSpec) -> str:
    """How keys and errors name an obstacle: by its name, or by its number from 0."""
    return f"obstacle.{index if obstacle.name is None else obstacle.name}"


def _check_room(scene: SceneData) -> None:
    """Two rigid walls that face each other leave a gap."""
    rigid = [(wall_name(i, wall), wall) for i, wall in enumerate(scene.walls) if wall.stiffness is None]
    for (first_name, first), (second_name, second) in combinations(rigid, 2):
        normal = unit(first.normal)
        gap = float((np.array(second.point) - first.point) @ normal)
        if normal @ unit(second.normal) < -1.0 + UNIT_TOLERANCE and gap < 0.0:
            raise BadInput(
                f"{second_name}.point",
                list(second.point),
                f"contradicts {first_name}: the walls face away from each other and leave no room "
                f"(the gap is {gap:.6g})",
                f"move it to the side of {first_name} where its normal points, or turn both normals round",
            )


def _check_common_room(scene: SceneData) -> None:
    """Some point is on the side of all rigid walls: otherwise some of their normals cancel at places that contradict
    (Farkas' lemma)."""
    rigid = [
        (wall_name(k, wall), normal, float(normal @ point))
        for k, (wall, normal, point) in enumerate(
            zip(scene.walls, scene.wall_normals, scene.wall_points, strict=True)
        )
        if wall.stiffness is None
    ]  # fmt: skip
    if len(rigid) < 3:
        return
    from scipy.optimize import linprog  # not before it is needed: it loads half of scipy

    normals = np.array([normal for _, normal, _ in rigid])
    offsets = np.array([offset for *_, offset in rigid])
    # the deepest point: t at most 1, N x >= offset + t
    found = linprog(
        [0.0, 0.0, 0.0, -1.0], A_ub=np.hstack([-normals, np.ones((len(rigid), 1))]), b_ub=-offsets,
        bounds=[(None, None)] * 3 + [(None, 1.0)],
    )  # fmt: skip
    if found.status == 0 and -found.fun < -statics.BEHIND_WALL:
        last = rigid[-1][0]
        raise BadInput(
            f"{last}.point", None,
            f"leaves no room: no point is on the side of all {len(rigid)} walls (each would have to give way by "
            f"{found.fun:.6g} of the length)", "move the walls apart, or turn a normal round",
        )  # fmt: skip


def _check_clamp_and_walls(scene: SceneData, name: str, clamp: ClampSpec | None) -> None:
    """No rigid wall goes through a held point or, with the frame held, through the edge across it."""
    if clamp is None or clamp.position is None:
        return
    frame = frame_of(clamp)
    length, half = scene.strip.length, 0.5 * scene.strip.width
    points = [np.array(clamp.position)]
    if frame is not None:
        points += [points[0] + half * frame[:, 0], points[0] - half * frame[:, 0]]
    for index, wall in enumerate(scene.walls):
        heights = -statics.depth(points, wall.point, unit(wall.normal))
        lowest = float(heights.min())
        if wall.stiffness is None and lowest < -statics.BEHIND_WALL * length:
            part = "the held point" if heights[0] == lowest else "a corner of the held edge"
            wall_key = wall_name(index, wall)
            raise BadInput(
                f"{name}.position",
                list(clamp.position),
                f"is on the wrong side of {wall_key}: {part} stands {-lowest:.6g} behind the wall",
                f"move it by {-lowest:.6g} along {wall_key}.normal, or move the wall back",
            )
        if frame is not None and wall.stiffness is None and lowest <= ON_WALL * length:
            into = float(frame[:, 2] @ unit(wall.normal)) * (1.0 if name == "clamp.start" else -1.0)
            if into < -INTO_WALL:
                wall_key = wall_name(index, wall)
                raise BadInput(
                    f"{name}.tangent",
                    list(frame[:, 2]),
                    f"points the strip into {wall_key}, on which it is held: it would have to turn round on the spot",
                    f"turn it along {wall_key}, or move {name}.position off the wall",
                )


def _check_clamp_and_obstacles(scene: SceneData, name: str, clamp: ClampSpec | None) -> None:
    """No obstacle goes through a held point or, with the frame held, through the edge across it."""
    for index, obstacle in enumerate(scene.obstacles):
        bodies.check_rounding(obstacle_name(index, obstacle), obstacle, scene.strip.length)
    if clamp is None or clamp.position is None:
        return
    frame = frame_of(clamp)
    length, half = scene.strip.length, 0.5 * scene.strip.width
    middle = np.array(clamp.position)
    across = np.zeros(1) if frame is None else np.linspace(-1.0, 1.0, ACROSS)
    points = middle if frame is None else middle + half * across[:, None] * frame[:, 0]
    for index, obstacle in enumerate(scene.obstacles):
        key = obstacle_name(index, obstacle)
        gaps, normals = bodies.Body.of(obstacle, length).facing(np.atleast_2d(points))
        at = int(np.argmin(gaps))
        if gaps[at] < -statics.BEHIND_WALL * length:
            side = "outside" if obstacle.inside else "inside"
            part = "the held point" if across[at] == 0.0 else "the held edge"
            raise BadInput(
                f"{name}.position", list(clamp.position),
                f"is {side} {key}: {part} stands {-gaps[at]:.6g} {'beyond its' if obstacle.inside else 'below its'} "
                "surface", f"move it, or change {key}.point or {key}.{bodies.SIZE[obstacle.kind]}"
                + ("" if obstacle.inside else f" (inside = true keeps the strip in {key})"),
            )  # fmt: skip
        if frame is None:
            continue
        into = (normals @ frame[:, 2]) * (1.0 if name == "clamp.start" else -1.0)
        near = np.maximum(ON_WALL, into**2 / (2.0 * TIGHTEST)) * length
        if clamp.ruling == "free":  # what is beside the middle follows its ruling
            near = np.where(across == 0.0, near, -np.inf)
        if np.any((into < -INTO_WALL) & (gaps <= near)):
            raise BadInput(
                f"{name}.tangent", list(frame[:, 2]),
                f"points the strip into {key}, on which it is held: it would have to turn round on the spot",
                f"turn it along {key}, or move {name}.position off it",
            )  # fmt: skip


def _check_support(scene: SceneData) -> None:
    """A strip with loads is held at a point, or walls carry it: what carries its weight is a sum of their normals, none
    of them pulling.

    Otherwise there is a direction along which it falls or slides for ever (Farkas' lemma).
    """
    if any(clamp is not None and clamp.position is not None for clamp in (scene.clamp_start, scene.clamp_end)):
        return
    if scene.tip is not None and scene.tip_force.any():
        raise BadInput(
            "tip", None, "pulls the strip away for ever: no clamp holds a point of it",
            "add [clamp.start] with a position",
        )  # fmt: skip
    up = scene.up
    if up is None or scene.gravity is None or scene.gamma == 0.0:
        return
    remedy = "add [clamp.start] with a position, or a [[wall]] whose normal is gravity.up"
    value = list(scene.gravity.up)
    normals = [*scene.wall_normals, *(way for body in scene.bodies for way in bodies.directions(body))]
    if not any(normal @ up > UNIT_TOLERANCE for normal in normals):
        raise BadInput("gravity.up", value, "makes the strip fall for ever: no clamp and no wall holds it", remedy)
    if not statics.is_carried(normals, up):
        raise BadInput(
            "gravity.up",
            value,
            "makes the strip slide away for ever: no clamp holds it, and walls without friction hold it only along "
            "their normals",
            f"{remedy}, or a second wall for it to lean on",
        )


def _check_formulation(scene: SceneData) -> None:
    """The chained model starts at a clamp and knows line gravity only."""
    if scene.model.formulation != "chained":
        return
    reason = None
    if scene.closure is not None:
        reason = "closed bands ([closure])"
    elif scene.walls:
        reason = "walls ([[wall]])"
    elif scene.obstacles:
        reason = "obstacles ([[obstacle]])"
    elif scene.gravity is not None and scene.gravity.exact:
        reason = "weight over the surface (gravity.exact)"
    elif not scene.start_clamped:
        reason = "a start whose position or frame is free (clamp.start)"
    if reason is not None:
        raise BadInput(
            "model.formulation",
            "chained",
            f"is not available for {reason}",
            'choose formulation = "mixed" or "auto"',
        )
    if scene.model.held_by != "elimination":
        raise BadInput(
            "model.held_by",
            scene.model.held_by,
            'contradicts model.formulation = "chained", whose clamp is eliminated by construction',
            'remove it, or choose formulation = "mixed"',
        )


def _check_elastica(scene: SceneData) -> None:
    """A section of any shape is that of rods; in a plane the weight is along the centreline."""
    chosen = registry.chosen_by(scene.model.energy)
    if chosen.planar:
        if scene.gravity is not None and scene.gravity.exact:
            raise BadInput(
                "model.energy",
                scene.model.energy,
                "is not available in this version where gravity.exact puts the weight over the surface",
                'choose energy = "wunderlich" or "auto"',
            )
    elif scene.strip.second_moment is not None and not chosen.rod:
        raise BadInput("model.energy", scene.model.energy, OF_A_ROD, 'choose model.energy = "elastica"')


def _check_tip(scene: SceneData) -> None:
    """What is loaded at s = l can move there, and a tension has a direction."""
    tip, held = scene.tip, scene.clamp_end
    if tip is None:
        return
    if scene.closure is not None:
        raise BadInput("tip", None, "loads the end, and [closure] leaves none", "remove [tip] or [closure]")
    if held is not None and held.slide is not None:
        size = float(np.linalg.norm(scene.tip_force))
        if size and abs(scene.tip_force @ unit(held.slide)) <= UNIT_TOLERANCE * size:
            remedy = "remove [tip], or turn clamp.end.slide"
            raise BadInput("tip", None, "pulls across clamp.end.slide, and does no work at a point that slides", remedy)
    elif held is not None and held.position is not None:
        remedy = "remove [tip], or clamp.end.position"
        if tip.tension is not None:
            problem = "cannot be given where clamp.end holds the position: there it is the clamp's reaction"
            raise BadInput("tip.tension", tip.tension, problem, remedy)
        raise BadInput("tip", None, "loads a point that clamp.end holds", remedy)
    if tip.tension is not None and scene.tension_direction is None:
        raise BadInput(
            "tip.tension", tip.tension, "has no direction: neither clamp.end nor clamp.start holds a tangent",
            "add one, or give tip.force",
        )  # fmt: skip
