"""From a strip (ShellProblem) to a body with supports, stages of its path and the state in which the path begins."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from shellref import law
from shellref.contact.obstacles import Obstacle
from shellref.contact.walls import FACES, Wall, WallPath, depth
from shellref.holds import motions as free_motions
from shellref.holds import parts
from shellref.holds.moment import EdgeMoment
from shellref.inputs import ShellInputError, Vector
from shellref.law import Law
from shellref.seam import gauge
from shellref.seam.ties import Tie, turned
from shellref.shell.body import Body, Control, Stage, Supports, line_force
from shellref.shell.clamps import PosePath, held_nodes
from shellref.shell.director import HELD, Edge
from shellref.shell.edges import FlatEdge, FreeEdge, PivotEdge, RigidEdge, middle_weights
from shellref.shell.grid import Grid, knots_across, knots_along, snapped
from shellref.shell.midsurface import (
    Cylinder,
    MidSurface,
    Ruled,
    flat_strip,
    natural_curve,
    natural_strip,
    turning_angle,
)
from shellref.shell.options import ShellOptions
from shellref.shell.problem import Pose, ShellProblem, Waypoint

LAYER_ELEMENTS = 2  # elements in an edge layer
#: How far (l) a path's first shape may be behind a wall that then is where it is; how much farther than needed it
#: goes out of the way otherwise.
BEHIND, CLEARANCE = 1e-5, 0.05
Motions = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Strip:
    """A strip ready to be solved: body, stages, and the clamps' poses along the path (None: no clamp there)."""

    problem: ShellProblem
    body: Body
    stages: tuple[Stage, ...]
    start_curvature: Law
    start: PosePath | None
    end: PosePath | None

    def initial_state(self, nodes: np.ndarray) -> np.ndarray:
        """Positions and directors (n, 6) where the path begins."""
        p = self.problem
        s, v = nodes.T
        if self.start is None and p.closed:
            return self._on_walls(np.hstack(natural_strip(s, v, np.zeros(3), np.eye(3), self.start_curvature)))
        if self.start is None and p.rests:
            return self._on_walls(np.hstack(natural_strip(s, v, np.zeros(3), self._lying(), self.start_curvature)))
        if self.start is None:
            return self._at_rest(s, v)
        pose = self.start.poses[0]
        position, frame = np.array(pose.position), np.array(pose.frame)
        if p.transverse_curvature or p.shaped:
            points, directors = self.body.surface.place(s, v)
            return np.hstack([position + points @ frame.T, directors @ frame.T])
        return np.hstack(natural_strip(s, v, position, frame, self.start_curvature))

    def _lying(self) -> np.ndarray:
        """The frame at S = 0 of a strip whose normal is the carrying wall's in its middle: an arch is level."""
        normal = np.array(carrying(self.problem).normal)
        across = np.eye(3)[int(np.argmin(np.abs(normal)))]
        tangent = np.cross(across, normal) / np.linalg.norm(np.cross(across, normal))
        middle = np.stack([np.cross(normal, tangent), normal, tangent], axis=1)
        return _turned(middle, -float(turning_angle(np.array([0.5]), self.start_curvature)[0]))

    def _on_walls(self, state: np.ndarray) -> np.ndarray:
        return state + np.append(lifted(self.problem, state[:, :3], state[:, 3:]), np.zeros(3))

    def supports_near(self, state: np.ndarray, nodes: np.ndarray) -> Supports | None:
        """What holds a strip that may move as a whole, or a closed one along itself, near a state (n, 6) of its nodes:
        the body's supports, and one component of a position for each of these motions; None: there are none."""
        problem = self.problem
        rests = self.start is None and problem.rests
        if (self.start is not None and not problem.partly_held) or (
            self.start is None and not problem.closed and not rests
        ):
            return None  # a strip that nothing holds is held by the body's own supports, in its middle
        base = Supports.none(len(nodes)) if self.start is None else self.body.supports(self.body.grid, nodes)
        tie = _tie(problem, self.body.grid, nodes)
        motions = self._motions(base, tie, state, nodes)
        now = motions(state)
        if not len(now):
            return None
        own, order = ~base.translations.any(axis=1), self.body.grid.order(nodes)
        if tie is not None:
            own[tie.nodes] = False
        floating = np.zeros((len(nodes), 3), dtype=bool)
        along = order.ravel()[own[order.ravel()]]  # in the order of the grid
        floating[along] = gauge.held(now[:, along])
        put = state.copy()

        def placement(move: float) -> np.ndarray:
            return put if base.placement is None else np.where(held6, base.placement(move), put)

        held6 = np.concatenate([base.translations, np.repeat((base.directors == HELD)[:, None], 3, axis=1)], axis=1)
        return dataclasses.replace(
            base, translations=base.translations | floating, placement=placement, tie=tie, motions=motions,
            floating=floating,
        )  # fmt: skip

    def _motions(self, base: Supports, tie: Tie | None, state: np.ndarray, nodes: np.ndarray) -> Motions:
        """What moves the strip as a whole, or along itself: state (n, 6) -> (k, n, 6), of as many as near this one."""
        problem, grid = self.problem, self.body.grid
        order = grid.order(nodes)
        sign = turned(problem.half_turns or 0)
        uniform = problem.slides and (bool(problem.walls) or not gauge.turns(state[order], grid.degree, sign))
        dead = ((problem.up, problem.loaded), (problem.tip, problem.pulled))
        loads = [np.array(x) / np.linalg.norm(np.array(x)) for x, acts in dead if acts]
        loads += [np.array(wall.normal) for wall in problem.walls]  # nor does a motion along all of them change a gap
        corners = [order[row, [0, -1]] for row in (0, -1)]
        if problem.closed and _pinned(problem, 0):
            corners[0] = np.flatnonzero(_at_middle(grid, nodes, 0))
        points = {edge.name: edge.point for edge in base.edges}

        def held_point(now: np.ndarray, k: int) -> np.ndarray:
            name = ("start", "end")[k]
            return points[name](now) if name in points else np.asarray(now[corners[k], :3].mean(axis=0))

        def motions(now: np.ndarray) -> np.ndarray:
            supports = [
                free_motions.Support(
                    held_point(now, k) if parts.at_a_point(part) else None, parts.has_frame(part),
                    None if slide is None else np.array(slide),
                )
                for k, (part, slide) in enumerate(zip(problem.ends, problem.slide, strict=True))
            ]  # fmt: skip
            if uniform:  # a held point of it may be another one
                supports = []
            centre = now[:, :3].mean(axis=0)
            found = free_motions.fields(free_motions.free(supports, loads, centre), now, centre)
            if uniform:
                slide = np.zeros((1, *now.shape))
                rows = gauge.sliding(now[order], grid.s_nodes, grid.degree, sign)
                slide[:, order[:-1].ravel()] = rows.reshape(-1, 6)
                found = free_motions.vanishing(np.concatenate([found, slide]), base.translations)
            return found if tie is None else np.array([tie.placed(field) for field in found]).reshape(found.shape)

        return motions

    def _at_rest(self, s: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Where a free strip begins (n, 6): its middle is where the supports of `_isostatic` hold it."""
        if self.problem.transverse_curvature or self.problem.shaped:
            return np.hstack(self.body.surface.place(s, v))
        bent, nodes = self.start_curvature, self.body.grid.s_nodes
        row, _ = _middle(self.body.grid)
        points, directors = natural_strip(s, v, np.zeros(3), np.eye(3), bent)
        centre, ahead = natural_strip(nodes[row : row + 2], np.zeros(2), np.zeros(3), np.eye(3), bent)[0]
        back = _turned(np.eye(3), -math.atan2(centre[1] - ahead[1], ahead[2] - centre[2]))
        return np.hstack([(points - centre) @ back.T + [0.0, 0.0, nodes[row]], directors @ back.T])


def carrying(problem: ShellProblem) -> Wall:
    """The wall that carries most of the weight; the first one of a strip without weight."""
    up = np.array(problem.up or problem.walls[0].normal)
    return max(problem.walls, key=lambda wall: float(up @ np.array(wall.normal)))


def lifted(problem: ShellProblem, points: np.ndarray, directors: np.ndarray) -> np.ndarray:
    """The way (3,) along its carrying wall's normal that brings a strip of points and directors (n, 3) onto that wall;
    none where something else holds it."""
    if not problem.rests:
        return np.zeros(3)
    wall = carrying(problem)
    lever = 0.5 * problem.thickness if problem.contact == FACES else 0.0
    faces = [points + side * lever * directors for side in (1.0, -1.0)]
    return np.asarray(depth(wall, np.vstack(faces)) * np.array(wall.normal))


def layer_width(problem: ShellProblem) -> float:
    """Width sqrt(h / kappa) of the layer at edges and clamps (units l; docs/theory.md, eq. (7.14)), from the largest
    curvature to be expected.

    kappa: the natural curvature, that of the arc at the start, or that of a clamped strip under its weight:
    Gamma / 2 when light, sqrt(2 Gamma) when heavy (planar elastica); under a force F at its end F and
    sqrt(2 F), under a moment M there M.
    """
    kappa = max(*law.sizes(problem.natural_curvature), *law.sizes(problem.natural_twist))
    kappa = max(kappa, abs(problem.start_curvature or 0.0), abs(problem.transverse_curvature))
    if problem.loaded:
        kappa = max(kappa, min(0.5 * problem.gamma, math.sqrt(2.0 * problem.gamma)))
    if problem.pulled:
        force = math.hypot(*problem.tip or ())
        kappa = max(kappa, min(force, math.sqrt(2.0 * force)))
    if problem.twisted:
        kappa = max(kappa, math.hypot(*problem.tip_moment or ()))
    if problem.end is not None and not problem.guided:
        kappa = max(kappa, math.pi)
    return min(math.sqrt(problem.thickness / max(kappa, 1.0)), 0.25 * problem.width)


def _ratio(knots, target: float) -> float:
    """The grading ratio in [1e-3, 1] whose first element is as near as may be to `target`; knots(ratio) -> array."""
    low, high = math.log(1e-3), 0.0
    for _ in range(50):
        middle = 0.5 * (low + high)
        if np.diff(knots(math.exp(middle)))[0] > target:
            high = middle
        else:
            low = middle
    return math.exp(high)


def strip_grid(problem: ShellProblem, refine: tuple[int, int] = (1, 1)) -> Grid:
    """The mesh of a strip; every element cut in `refine` (along, across). Raises ShellInputError for held corners."""
    (nx, ny), both = problem.elements, problem.end is not None or problem.closed
    along, across = problem.grading
    if problem.edge_layer is not None:
        layer = layer_width(problem) if problem.edge_layer == "auto" else float(problem.edge_layer)
        target = layer / LAYER_ELEMENTS
        along = _ratio(lambda ratio: knots_along(nx, ratio, both), target)
        across = _ratio(lambda ratio: knots_across(ny, ratio, problem.width), target)
    if problem.closed and problem.clamp == "free":
        along = 1.0  # no place along it is known to need more than another
    s, v = knots_along(nx, along, both), knots_across(ny, across, problem.width)
    s = _kinked(s, *rest_laws(problem))
    if problem.corner is not None:
        half, c = 0.5 * problem.width, problem.corner
        try:
            s = snapped(s, [c] + ([1.0 - c] if both else []))
            v = snapped(v, [c - half, half - c])
        except ValueError as error:
            raise ShellInputError("elements", problem.elements, f"for corner = {c:g}: {error}") from None
    return Grid(s, v, problem.degree).refined(*refine)


def rest_laws(problem: ShellProblem) -> tuple[Law, Law, Law]:
    """kappa_1, kappa_2, kappa_3 of the strip at rest."""
    return problem.natural_curvature, problem.natural_geodesic_curvature, problem.natural_twist


def _kinked(knots: np.ndarray, *laws: Law) -> np.ndarray:
    """Knots along S with one at every point of the laws' tables: an inner knot of an element so near is moved there,
    where none is, one more is put in."""
    points = [law.knots(one)[0][1:-1] for one in laws if law.is_table(one)]
    kinks = np.unique(np.concatenate(points)) if points else np.empty(0)
    found, fixed = knots.copy(), {0, len(knots) - 1}
    for kink in kinks:
        k = int(np.argmin(np.abs(found - kink)))
        size = np.diff(found)[max(0, min(k - (found[k] > kink), len(found) - 2))]
        if abs(found[k] - kink) <= law.NEAR:
            continue
        if k not in fixed and abs(found[k] - kink) < 0.25 * size:
            found[k] = kink
            fixed.add(k)
            continue
        place = int(np.searchsorted(found, kink))
        found = np.insert(found, place, kink)
        fixed = {i + (i >= place) for i in fixed} | {place}
    return found


def rest_surface(problem: ShellProblem) -> MidSurface:
    """The reference surface, in the axes of the start; of a strip that nothing holds in those of its middle."""
    if not problem.shaped:
        return Cylinder(curvature_across=problem.transverse_curvature)
    return Ruled(*rest_laws(problem))


def rest_end(problem: ShellProblem, pose: Pose, curvature: Law) -> Pose:
    """Where the end of the unstressed strip is whose start is held at `pose`; curvature: of the strip that begins."""
    surface = rest_surface(problem)
    if not isinstance(surface, Ruled):
        return arc_end(pose, curvature)
    points, frames = surface.frames(np.array([1.0]))
    frame = np.array(pose.frame)
    place, turned = np.array(pose.position) + frame @ points[0], frame @ frames[0]
    return Pose(tuple(place.tolist()), tuple(map(tuple, turned.tolist())))  # type: ignore[arg-type]


def _turned(frame: np.ndarray, angle: float) -> np.ndarray:
    """The frame after a planar curve has turned by `angle`: t_z' = -omega t_y."""
    c, s = math.cos(angle), math.sin(angle)
    tx, ty, tz = frame.T
    return np.stack([tx, c * ty + s * tz, c * tz - s * ty], axis=1)


def arc_end(pose: Pose, curvature: Law) -> Pose:
    """Where the end of the planar natural curve is, with its frame."""
    at = np.array([1.0])
    (z,), (y,) = natural_curve(at, curvature)
    frame = np.array(pose.frame)
    place = np.array(pose.position) + z * frame[:, 2] + y * frame[:, 1]
    turned = _turned(frame, float(turning_angle(at, curvature)[0]))
    return Pose(tuple(place.tolist()), tuple(map(tuple, turned.tolist())))  # type: ignore[arg-type]


def _start_curvature(problem: ShellProblem, options: ShellOptions) -> Law:
    """The curvature of the strip where its path begins."""
    if problem.shaped:
        return problem.natural_curvature  # it is in the reference surface
    if problem.start_curvature is not None:
        return problem.start_curvature, problem.start_curvature
    flat = options.natural_path == "stepped" or problem.clamp == "corners" or problem.transverse_curvature
    both = problem.end is not None and not problem.guided
    return (0.0, 0.0) if flat or both else problem.natural_curvature


def build_strip(
    problem: ShellProblem, options: ShellOptions, refine: tuple[int, int] = (1, 1), grid: Grid | None = None
) -> Strip:
    """The body, the stages and the clamps of a strip; grid: another one than the problem's own, cut in `refine`."""
    grid = strip_grid(problem, refine) if grid is None else grid
    begin = _start_curvature(problem, options)
    start, end, walls, stages = _stages(problem, begin)

    def along(curvature: Law):
        def natural(s: np.ndarray, v: np.ndarray) -> np.ndarray:
            k = law.value(curvature, s)
            return np.stack([k, 0.0 * k, 0.0 * k], axis=1)

        return natural

    def supports(grid: Grid, nodes: np.ndarray) -> Supports:
        return _supports(problem, strip_corner_knots(problem, refine), grid, nodes, start, end)

    weight = None
    if problem.loaded:
        weight = tuple(-problem.gamma * x for x in problem.up or ())
    body = Body(
        surface=_placed_at_rest(problem, grid),
        grid=grid,
        thickness=problem.thickness,
        shear_factor=problem.shear_factor,
        poisson=problem.poisson,
        supports=supports,
        normaliser=problem.width,
        natural=None if problem.shaped else along(problem.natural_curvature),
        natural_start=None if problem.shaped else along(begin),
        weight=weight,  # type: ignore[arg-type]
        forces=line_force(0, 1.0, problem.tip or (0.0, 0.0, 0.0)) if problem.pulled else None,
        moment=(lambda grid, nodes: _end_moment(problem, grid, nodes)) if problem.twisted else None,
        bends_along=True,
        walls=walls,
        closed=problem.closed,
    )
    return Strip(problem, body, stages, begin, start, end)


def _end_moment(problem: ShellProblem, grid: Grid, nodes: np.ndarray) -> EdgeMoment:
    """The moment at S = 1 on the nodes there."""
    rows, columns = grid.positions(nodes)
    at = np.flatnonzero(rows == len(grid.s_nodes) - 1)
    return EdgeMoment.on(at, nodes[at, 1], grid.nodal_shares(1)[columns[at]], np.array(problem.tip_moment))


def _placed_at_rest(problem: ShellProblem, grid: Grid) -> MidSurface:
    """The reference surface; of a strip that nothing holds in the axes of its middle, where `_isostatic` holds it."""
    surface = rest_surface(problem)
    if isinstance(surface, Ruled) and problem.clamp == "free":
        return dataclasses.replace(surface, origin=float(grid.s_nodes[_middle(grid)[0]]))
    return surface


def strip_corner_knots(problem: ShellProblem, refine: tuple[int, int]) -> tuple[float, float]:
    """(along S, along v) size of the held corner cells of a strip's own mesh, over l (not shrunk by `refine`)."""
    if problem.clamp != "corners":
        return 0.0, 0.0
    if problem.corner is not None:
        return problem.corner, problem.corner
    grid = strip_grid(problem)
    return float(grid.s_knots[1]), float(grid.v_knots[1] - grid.v_knots[0])


def _stages(
    problem: ShellProblem, begin: Law
) -> tuple[PosePath | None, PosePath | None, WallPath | None, tuple[Stage, ...]]:
    """Poses of both clamps and places of the walls at every knot of the path, and the stages between the knots."""
    natural = 1.0 if begin == problem.natural_curvature else 0.0
    control = Control(natural, 0.0, 0.0, 0.0)
    at_start = [problem.start]
    at_end = [] if problem.end is None else [rest_end(problem, problem.start, begin)]
    first = next((w.start for w in problem.path if w.start is not None), None)
    if first is not None:  # the path moves the start: begin where it is first said to be
        at_start = [first]
        at_end = [] if problem.end is None else [rest_end(problem, first, begin)]
    own = own_places(problem)
    at_walls = [_first_places(problem, _before(problem, at_start[0], begin))]
    stages: list[Stage] = []

    def leg(
        name: str,
        natural: float | None = None,
        gravity: float | None = None,
        start: Pose | None = None,
        end: Pose | None = None,
        tip: float | None = None,
        walls: tuple[Vector, ...] | None = None,
    ) -> None:
        nonlocal control
        place, other = start or at_start[-1], (end or at_end[-1]) if at_end else None
        moves = place != at_start[-1] or (at_end and other != at_end[-1]) or (walls or at_walls[-1]) != at_walls[-1]
        target = Control(
            control.natural if natural is None else natural,
            control.weight if gravity is None else gravity,
            control.load if tip is None else tip,
            control.move + 1.0 if moves else control.move,
        )
        if moves:
            at_start.append(place)
            at_walls.append(walls or at_walls[-1])
            if other is not None:
                at_end.append(other)
        target = target._replace(leg=max(math.ceil(target.move) - 1.0, 0.0))
        if target._replace(leg=control.leg) != control:
            stages.append(Stage(name, control._replace(leg=target.leg), target))
            control = target

    if not problem.path:
        leg("natural", natural=1.0)
    for waypoint in problem.path:
        leg(waypoint.name, waypoint.natural, waypoint.gravity, waypoint.start, waypoint.end, waypoint.tip,
            _places(problem, waypoint, at_walls[-1]))  # fmt: skip
    leg("clamps", start=problem.start, end=problem.end)
    leg("natural", natural=1.0)
    at_tip = problem.pulled or problem.twisted
    last = "gravity" if not at_tip else "gravity and tip" if problem.loaded else "tip"
    leg(last, gravity=1.0 if problem.loaded else 0.0, tip=1.0 if at_tip else 0.0)
    leg("walls", walls=own)
    walls = _wall_path(problem, np.array(at_walls).reshape(len(at_walls), -1, 3)) if problem.touches else None
    if problem.clamp == "free":
        return None, None, walls, tuple(stages)
    return PosePath(tuple(at_start)), PosePath(tuple(at_end)) if at_end else None, walls, tuple(stages)


def _wall_path(problem: ShellProblem, at: np.ndarray) -> WallPath:
    """at (m, walls and obstacles, 3): their points at the knots of the path."""
    count = len(problem.walls)
    normals = np.array([wall.normal for wall in problem.walls]).reshape(-1, 3)
    offsets = np.einsum("mki,ki->mk", at[:, :count], normals)
    stiffness = tuple(wall.stiffness for wall in problem.walls)
    return WallPath(normals, stiffness, offsets, problem.contact, problem.obstacles, at[:, count:], problem.apart)


def own_places(problem: ShellProblem) -> tuple[Vector, ...]:
    """Points of walls and obstacles where the path ends."""
    return (*(wall.point for wall in problem.walls), *(body.point for body in problem.obstacles))


def _places(problem: ShellProblem, waypoint: Waypoint, now: tuple[Vector, ...]) -> tuple[Vector, ...] | None:
    """Points of the walls and obstacles at a waypoint, where they are `now` where it does not say; None: all there."""
    if waypoint.walls is waypoint.obstacles is None:
        return None
    count = len(problem.walls)
    walls = now[:count] if waypoint.walls is None else waypoint.walls
    return (*walls, *(now[count:] if waypoint.obstacles is None else waypoint.obstacles))


def _first_places(problem: ShellProblem, clear: tuple[Vector, ...]) -> tuple[Vector, ...]:
    """Points of walls and obstacles where the path begins: where the first waypoint has them that moves them."""
    count = len(problem.walls)
    walls = next((w.walls for w in problem.path if w.walls is not None), clear[:count])
    return (*walls, *next((w.obstacles for w in problem.path if w.obstacles is not None), clear[count:]))


def _before(problem: ShellProblem, pose: Pose, begin: Law) -> tuple[Vector, ...]:
    """Points of walls and obstacles where the path begins: where they are, or as far back as leaves them clear of the
    shape that it begins with; where walls alone carry the strip, where they are."""
    own = own_places(problem)
    if problem.rests or problem.transverse_curvature or not own:
        return own
    shape = first_shape(problem, pose, begin)
    found = []
    for wall in problem.walls:
        behind = depth(wall, shape)
        back = 0.0 if behind <= BEHIND else (1.0 + CLEARANCE) * behind
        found.append(tuple(x - back * n for x, n in zip(wall.point, wall.normal, strict=True)))
    across, normal, _ = np.array(pose.frame).T
    found += [aside(body, shape, np.array([normal, -normal, across, -across])) for body in problem.obstacles]
    return tuple(found)  # type: ignore[arg-type]


def first_shape(problem: ShellProblem, pose: Pose, begin: Law) -> np.ndarray:
    """Points (n, 3) of the strip with which a path begins that starts at a pose, of its faces where these touch."""
    s, v = (x.ravel() for x in np.meshgrid(np.linspace(0.0, 1.0, 201), 0.5 * problem.width * np.linspace(-1, 1, 5)))
    points, directors = natural_strip(s, v, np.array(pose.position), np.array(pose.frame), begin)
    if problem.contact != FACES:
        return np.asarray(points)
    return np.vstack([points + side * 0.5 * problem.thickness * directors for side in (1.0, -1.0)])


def aside(body: Obstacle, points: np.ndarray, ways: np.ndarray) -> Vector:
    """Where a body is clear of points (n, 3): its own point, or the nearest one along ways (k, 3); of a room, and where
    no way leads out, its own."""
    centre = np.array(body.point)
    if body.inside or body.gaps(points, centre).min() >= -BEHIND:
        return body.point
    for back in CLEARANCE * 1.2 ** np.arange(30):
        for way in ways:
            if body.gaps(points, centre + back * way).min() >= 0.0:
                return tuple((centre + (1.0 + CLEARANCE) * back * way).tolist())
    return body.point


def _supports(
    problem: ShellProblem,
    corner: tuple[float, float],
    grid: Grid,
    nodes: np.ndarray,
    start: PosePath | None,
    end: PosePath | None,
) -> Supports:
    """What is held of a strip and how it moves."""
    tie = _tie(problem, grid, nodes)
    if start is None and problem.rests:
        return dataclasses.replace(Supports.none(len(nodes)), tie=tie)
    if start is None:
        return dataclasses.replace(_isostatic(grid, nodes), tie=tie)
    half = 0.5 * problem.width
    held = [held_nodes(nodes, problem.clamp, 0.0, half, corner), np.zeros(len(nodes), dtype=bool)]
    if end is not None:
        held[1] = held_nodes(nodes, problem.clamp, 1.0, half, corner)
    at_rest = rest_surface(problem)

    def rigid(where: np.ndarray, origin: float) -> tuple[np.ndarray, np.ndarray]:
        """Positions from the clamp and directors of the nodes there, in its axes."""
        if isinstance(at_rest, Ruled):
            return at_rest.section(nodes[where, 0], nodes[where, 1])
        return at_rest.place(nodes[where, 0] - origin, nodes[where, 1])

    def placement(move: float) -> np.ndarray:
        out = np.zeros((len(nodes), 6))
        for path, where, origin in ((start, held[0], 0.0), (end, held[1], 1.0)):
            if path is not None:
                position, frame = path.at(move)
                if problem.transverse_curvature or problem.shaped:
                    points, directors = rigid(where, origin)
                    out[where] = np.hstack([position + points @ frame.T, directors @ frame.T])
                else:
                    out[where] = np.hstack(flat_strip(nodes[where, 0] - origin, nodes[where, 1], position, frame))
        return out

    if tie is not None:
        held[0][tie.nodes] = held[0][tie.partners]  # put in place with them
    base, edges = Supports.none(len(nodes)), list[Edge]()
    for k, (name, path) in enumerate((("start", start), ("end", end))):
        part = problem.ends[k]
        if path is None or part == parts.NOTHING:
            continue
        if _pinned(problem, k) and tie is None:
            at = np.flatnonzero(held[k])
            at = at[np.argsort(nodes[at, 1])]
            weights = middle_weights(nodes[at, 1], grid.nodal_shares(1))
            base = base.hold(held[k], "xyz", HELD)
            edges.append(FreeEdge(name, at, weights, path))
            continue
        if _pinned(problem, k):
            point = _at_middle(grid, nodes, -k)
            base = base.hold(point, "xyz")
            assert tie is not None
            base = base.hold(np.isin(tie.owners(len(nodes)), np.flatnonzero(point)), "xyz")
            continue
        base = base.hold(held[k], "xyz", HELD)
        edge = _edge(problem, k, name, path, np.flatnonzero(held[k]), nodes, rigid(held[k], k))
        edges += [] if edge is None else [edge]
    swings = tie is not None and _pinned(problem, 0)
    return Supports(base.translations, base.directors, placement, tuple(edges), tie, swings=swings)


def _tie(problem: ShellProblem, grid: Grid, nodes: np.ndarray) -> Tie | None:
    """The seam of a closed strip."""
    if problem.half_turns is None:
        return None
    rows, columns = grid.positions(nodes)
    ends = [np.flatnonzero(rows == row) for row in (0, len(grid.s_nodes) - 1)]  # on several processes the first's alone
    first, last = (at[np.argsort(columns[at])] for at in ends)
    return Tie.of_rows(first, last, problem.half_turns)


def _edge(
    problem: ShellProblem,
    k: int,
    name: str,
    path: PosePath,
    at: np.ndarray,
    nodes: np.ndarray,
    rest: tuple[np.ndarray, np.ndarray],
) -> Edge | None:
    """The edge at S = k with freedoms of its own, or whose section a rotating clamp must carry rigidly; None: neither.

    at (m,): its nodes; rest: their positions and directors in the clamp's axes, (m, 3) each.
    """
    slide = problem.slide[k]
    slides = np.zeros((0, 3)) if slide is None else np.array([slide])
    if problem.holds[k] in (parts.POSITION, parts.SECTION):
        anywhere = problem.holds[k] == parts.SECTION
        return PivotEdge(name, at, nodes[at, 1], path, np.eye(3) if anywhere else slides)
    if problem.holds[k] == parts.FRAME:
        return RigidEdge(name, at, *rest, path, np.eye(3))
    if problem.sections[k] == "free":
        middle = np.flatnonzero(np.abs(nodes[at, 1]) < 1e-9)
        if not len(middle):
            remedy = "must have a node in the middle of a free section: use an even number of elements across"
            raise ShellInputError("elements", problem.elements, remedy)
        return FlatEdge(name, at, int(middle[0]), path, slides)
    turns = problem.turns and k == 1
    if slide is None and not turns and not problem.transverse_curvature:
        return None
    axis = np.array(path.poses[0].frame)[:, 0] if turns else None
    return RigidEdge(name, at, *rest, path, slides, axis)


def _middle(grid: Grid) -> tuple[int, int]:
    """Row and column of the node nearest the strip's middle."""
    return int(np.argmin(np.abs(grid.s_nodes - 0.5))), int(np.argmin(np.abs(grid.v_nodes)))


def _pinned(problem: ShellProblem, k: int) -> bool:
    """Whether the end at S = k is held at its middle node alone."""
    return problem.ends[k] == parts.POSITION and problem.sections[k] == "free"


def _at_middle(grid: Grid, nodes: np.ndarray, row: int) -> np.ndarray:
    """Mask (n,) of the node in the middle of the start (row 0) or of the end (row -1), where the process has it.
    ShellInputError where the mesh has none."""
    column = int(np.argmin(np.abs(grid.v_nodes)))
    if abs(grid.v_nodes[column]) > 1e-9:
        remedy = "must have a node in the middle of an edge that is held there: use an even number across"
        raise ShellInputError("elements", grid.elements, remedy)
    rows, columns = grid.positions(nodes)
    return (rows == row % len(grid.s_nodes)) & (columns == column)


def _isostatic(grid: Grid, nodes: np.ndarray) -> Supports:
    """Six components held at three nodes around the middle: no rigid motion is left, and nothing is resisted."""
    row, column = _middle(grid)
    rows, columns = grid.positions(nodes)
    middle = (rows == row) & (columns == column)
    side = (rows == row) & (columns == len(grid.v_nodes) - 1)
    ahead = (rows == row + 1) & (columns == column)
    return Supports.none(len(nodes)).hold(middle, "xyz").hold(side, "yz").hold(ahead, "y")
