"""From a scene to what the shell takes: problem and options, and for two clamps the way from a planar arc.

Only NumPy and the shell's dataclasses are imported: neither a solver nor the ribbon.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.models.holds import shell as shell_holds
from compare.models.holds.words import at_ends
from compare.models.scope import beyond_the_shell, require_shell
from compare.scene.data import unit
from compare.scene.inputs import law
from compare.scene.scene import Scene
from compare.scene.spec import ClampSpec, ShellSpec
from compare.scene.stages import stage_name
from ribbonbench.errors import BadInput
from shellref.contact.obstacles import Obstacle
from shellref.contact.walls import Wall
from shellref.inputs import ShellInputError, Vector
from shellref.path.begin import coarse_meshes
from shellref.shell.material import SHEAR_FACTOR
from shellref.shell.options import ShellOptions
from shellref.shell.problem import IDENTITY, Pose, ShellProblem, Waypoint

FloatArray = NDArray[np.float64]

#: Elements along and across when the scene does not say, and how they are graded (first element at the clamp,
#: elements at the long edges, over even ones). The thesis has an even grid of 100 x 4 (4.3); docs/shell.md shows what
#: grading buys.
DEFAULT_ELEMENTS = (100, 8)
#: The first mesh when a tolerance is to be reached.
FIRST_ELEMENTS = (50, 4)
GRADING = (0.2, 0.1)
#: The same for strips wider than WIDE (w / l), which fold near their clamps: at w/l = 0.5, Gamma = 1000 (thesis, 7.3)
#: the mesh above gives 3.0 % of membrane energy, this one 1.13 %, 200 x 16 elements 1.09 % (results/limits).
WIDE = 0.15
WIDE_ELEMENTS = (100, 12)
WIDE_GRADING = (0.1, 0.2)
#: The same for tape springs, whose folds form and travel anywhere (results/tape_shell: greatest moments to 0.2 %, the
#: moment of a growing fold to some 5 %).
TAPE_ELEMENTS = (80, 6)
TAPE_GRADING = (1.0, 1.0)
#: Largest turn (rad) of a clamp on one leg of the way from the arc: frames turn by the shortest rotation.
MOST_TURN = 1.0
#: Steps of tape springs: a fold is born within a hundredth of the length, and most steps take three to five iterations.
TAPE_OPTIONS = {"arc_length": "always", "first_step": 0.02, "arc_step": 0.002, "max_arc": 0.02, "max_newton": 8}
#: What a tolerance is of, in words after it.
REQUESTED = {"surface": "l", "end": "l at the end", "middle": "l in the middle", "energy": "of the elastic energy"}
#: Relative difference below which two laws of natural curvature, or two weights, are the same.
_SAME = 1e-12


def shell_elements(scene: Scene) -> tuple[int, int]:
    """Elements (along, across) of the scene's shell runs; of the first mesh where a tolerance is to be reached."""
    if scene.shell.elements is not None:
        return scene.shell.elements
    if scene.shell.tolerance is not None:
        return FIRST_ELEMENTS
    if scene.transverse_curvature:
        return TAPE_ELEMENTS
    return WIDE_ELEMENTS if scene.width > WIDE else DEFAULT_ELEMENTS


def shell_options(scene: Scene, **changes: Any) -> ShellOptions:
    """How the scene's shell is solved: a tape spring by arc length in small steps, since it folds and snaps.

    Alone a shell begins with the path on a coarse mesh where the scene has one equilibrium (or says so); where it may
    have several, states on the way matter and the path is walked on the mesh itself.
    """
    if scene.transverse_curvature:
        changes = {**TAPE_OPTIONS, **changes}
    stiffer = scene.shell.shear_factor / SHEAR_FACTOR
    if stiffer > 1.0:  # what the full rule has of shear stays as it is: more of it would lock
        changes = {"stabilisation": ShellOptions().stabilisation / stiffer, **changes}
    start = scene.shell.start
    changes = {"coarse": start == "coarse" or (start != "path" and not scene.several_equilibria), **changes}
    return ShellOptions(accuracy=scene.shell.tolerance, goal=scene.shell.goal, **changes)


def shell_problem(
    scene: Scene, width_to_thickness: float, elements: tuple[int, int] | None = None, way: bool = True
) -> ShellProblem:
    """The scene as a shell of this w/h, D and Gamma kept (lengths in l); `elements`: others than the scene's.

    way: with the scene's [[path]] and the arc from which it starts; without, only the state itself is described.
    """
    shell = scene.shell
    weight = scene.up is not None and scene.gamma > 0
    floats = scene.clamp_start is None and scene.clamp_end is None
    curvature = _start_curvature(scene)
    start, end = end_poses(scene, curvature)
    usual = TAPE_GRADING if scene.transverse_curvature else WIDE_GRADING if scene.width > WIDE else GRADING
    grading = shell.grading or usual
    try:
        problem = ShellProblem(
            width=scene.width,
            thickness=scene.width / width_to_thickness,
            poisson=scene.strip.poisson,
            natural_curvature=scene.curvature,
            transverse_curvature=scene.transverse_curvature,
            natural_twist=scene.twist,
            natural_geodesic_curvature=scene.geodesic,
            slide=(_slide(scene.clamp_start), _slide(scene.clamp_end)),
            turns=hinged(scene),
            sections=(shell_holds.section(scene, scene.clamp_start), shell_holds.section(scene, scene.clamp_end)),
            holds=shell_holds.holds(scene),
            gamma=scene.gamma if weight else 0.0,
            up=tuple(float(c) for c in scene.up) if weight else None,  # type: ignore[arg-type, union-attr]
            clamp_position=(0.0,) * 3 if floats else start.position,
            clamp_frame=IDENTITY if floats else start.frame,
            clamp="free" if floats else shell.clamp,
            elements=elements or shell_elements(scene),
            grading=grading,
            end=end,
            tip=None if scene.tip is None else tuple(scene.tip_force.tolist()),  # type: ignore[arg-type]
            tip_moment=tuple(scene.tip_moment.tolist()) if scene.tip_moment.any() else None,
            guided=scene.guided,
            corner=scene.shell_corner,
            edge_layer=scene.shell_edge_layer,
            start_curvature=curvature,
            half_turns=None if scene.closure is None else scene.closure.turned,
            walls=shell_walls(scene),
            obstacles=shell_obstacles(scene),
            apart=scene.apart,
            contact=shell.contact,
            shear_factor=shell.shear_factor,
        )
        _check_goal(shell, problem)
        return with_path(scene, problem) if way else problem
    except ShellInputError as error:
        raise BadInput(f"shell.{error.key}", error.value, "cannot be used", error.remedy) from None


def shell_walls(scene: Scene) -> tuple[Wall, ...]:
    """The walls, points in units of l, stiffness in D w / l^3."""
    placed = zip(scene.walls, wall_points(scene), scene.wall_normals, strict=True)
    return tuple(Wall(point, tuple(normal.tolist()), wall.stiffness) for wall, point, normal in placed)


def wall_points(scene: Scene) -> tuple[Vector, ...]:
    """A point of every wall, in units of l."""
    return tuple(tuple(point) for point in scene.wall_points.tolist())


def shell_obstacles(scene: Scene) -> tuple[Obstacle, ...]:
    """The obstacles, lengths in l."""

    def plain(given: FloatArray | None) -> Vector | None:
        return None if given is None else tuple(given.tolist())  # type: ignore[return-value]

    return tuple(
        Obstacle(
            body.kind, tuple(body.point.tolist()), float(body.radius), plain(body.axis), plain(body.normal),
            plain(body.size), float(body.angle), body.inside,
        )
        for body in scene.bodies
    )  # fmt: skip


def obstacle_points(scene: Scene) -> tuple[Vector, ...]:
    """The point of every obstacle, in units of l."""
    return tuple(body.point for body in shell_obstacles(scene))


def end_poses(scene: Scene, curvature: float | None) -> tuple[Pose, Pose | None]:
    """Poses of both ends, those of what is not held where the path begins: on an arc of this curvature (1/l)."""
    if not shell_holds.partly(scene):
        floats = scene.clamp_start is None
        return Pose((0.0,) * 3, IDENTITY) if floats else start_pose(scene), end_pose(scene)
    if scene.start_position is not None and scene.end_position is not None and curvature is None:
        curvature = held_curvature(scene)
    return shell_holds.poses(scene, curvature)


def held_curvature(scene: Scene) -> float:
    """Curvature (1/l) of the arc between two points of which a frame is free: bent as the seed, or the strip's natural
    shape, or downwards."""
    assert scene.start_position is not None
    assert scene.end_position is not None
    turn = arc_turn(math.dist(scene.start_position, scene.end_position))
    seed = scene.seed_curvature
    middle = float(np.interp(0.5, np.linspace(0.0, 1.0, len(seed)), seed))
    return math.copysign(turn, middle or law.turn(scene.curvature) or (-1.0 if scene.gamma else 1.0))


def _start_curvature(scene: Scene) -> float | None:
    """That of the arc where the shell's path begins: of a band the circle of so many turns, bent as the ribbon's."""
    given = scene.shell_start_curvature
    if scene.closure is None or given is not None:
        return given
    turn = 2.0 * math.pi * scene.closure.turns
    return math.copysign(turn, law.turn(scene.curvature)) if law.turn(scene.curvature) else -turn


def _check_goal(shell: ShellSpec, problem: ShellProblem) -> None:
    why = problem.without_goal(shell.goal)
    if shell.goal != "surface" and shell.tolerance is None:
        why = "needs a tolerance to reach"
    if why is not None:
        remedy = "give shell.tolerance, or remove it" if shell.tolerance is None else 'use "surface", or another one'
        raise BadInput("shell.goal", shell.goal, why, remedy)


def _pose(position: FloatArray, frame: FloatArray) -> Pose:
    return Pose(tuple(position.tolist()), tuple(map(tuple, frame.tolist())))  # type: ignore[arg-type]


def start_pose(scene: Scene) -> Pose:
    """The clamp at s = 0, position in units of l."""
    return _pose(scene.position, scene.frame)


def end_pose(scene: Scene) -> Pose | None:
    """The clamp at s = l, position in units of l (0 where it guides: nothing depends on it); None: the end is free.

    Of an edge that turns freely the frame says which way t_x goes: that of the start.
    """
    position, frame = scene.end_position, scene.frame if hinged(scene) else scene.end_frame
    if frame is None or (position is None and not scene.guided):
        return None
    return _pose(np.zeros(3) if position is None else position, frame)


def hinged(scene: Scene) -> bool:
    """Whether a tape spring's end holds its point alone: the edge keeps its section and turns about t_x."""
    return bool(scene.transverse_curvature) and scene.end_position is not None and scene.end_frame is None


def _slide(clamp: ClampSpec | None) -> tuple[float, float, float] | None:
    if clamp is None or clamp.slide is None:
        return None
    return tuple(unit(clamp.slide).tolist())  # type: ignore[return-value]


def line_weight(scene: Scene) -> str | None:
    """What is to be said about a ribbon that is weighed along its centreline, beside a shell; None: nothing."""
    if scene.gravity is None or not scene.gamma or scene.gravity.exact:
        return None
    return (
        "The shell weighs its surface, the ribbon its centreline: their loads differ by order w^2 (gravity.exact = "
        "true weighs the ribbon's surface too)."
    )


def shell_words(scene: Scene) -> str:
    """What holds the shell of a scene, its mesh, and where its solves begin."""
    shell, length = scene.shell, scene.strip.length
    what = "the whole edge"
    if shell.clamp == "corners":
        cell = "one cell of the mesh" if shell.corner is None else f"a cell of {shell.corner / length:g} l"
        what = f"{cell} at both corners"
    mesh = " x ".join(map(str, shell_elements(scene))) + " elements"
    if shell.tolerance is not None:
        mesh += f" at first, refined to {shell.tolerance:g} {REQUESTED[shell.goal]}"
    words = [_holds(scene, what), mesh]
    if scene.barriers:
        kinds = [name for name, given in (("walls", scene.walls), ("obstacles", scene.obstacles)) if given]
        met = "the middle surface meets" if shell.contact == "midsurface" else "both faces meet"
        met = f"{met} the {' and '.join(kinds)}"
        words.insert(1, f"{met}, without friction")
    if scene.apart is not None:
        words.insert(1, f"parts of its middle surface keep {scene.apart:g} l apart")
    bent = any(law.values(scene.curvature))
    try:
        problem = shell_problem(scene, require_shell(scene)[0])
    except BadInput as refusal:
        path = f"its own path is not available ({refusal.key} {refusal.problem})"
    else:
        if problem.shaped:
            begin = "its shape at rest"
        elif problem.half_turns:
            begin = "a circle whose end is turned and joined"
        elif problem.closed:
            begin = "a circle"
        elif problem.start_curvature:
            begin = f"a planar arc of curvature {problem.start_curvature:.4g}/l"
        elif problem.start_curvature is None and bent and shell.clamp == "edge" and not _both(problem):
            begin = "its natural shape"
        else:
            begin = "the straight tape" if problem.transverse_curvature else "the flat strip"
        names = list(dict.fromkeys(stage.name for stage in problem.path if stage.name != "arc"))
        names += [] if problem.path or not bent or begin in ("its natural shape", "its shape at rest") else ["natural"]
        names += ["gravity"] if problem.loaded else []
        names += ["tip"] if problem.pulled or problem.twisted else []
        names += ["walls"] if any(stage.walls or stage.obstacles for stage in problem.path) else []
        path = f"its path goes from {begin}" + (f" over {', '.join(names)}" if names else "")
    start = shell.start
    if start in ("auto", "ribbon"):
        words.append(f"compare begins at the ribbon's surface, ribbonbench shell does not know it: {path}")
    else:
        words.append(path)
    if shell_options(scene).coarse and coarse_meshes(shell_elements(scene)):
        words.append("on a coarse mesh first")
    return "; ".join(words)


def _holds(scene: Scene, what: str) -> str:
    """What holds the shell; what: of an edge whose frame is held."""
    if scene.closure is None:
        held = at_ends(scene, what)
        return f"its clamps hold {held}" if held else "no clamp holds it"
    held = "nothing holds it" if scene.clamp_start is None else f"its clamp holds {what} at the seam"
    return f"its ends are joined node to node, and {held}"


def _both(problem: ShellProblem) -> bool:
    """Whether positions are held at both ends."""
    return problem.end is not None and not problem.guided


# -- the way ----------------------------------------------------------------------------------------------------------


def with_path(scene: Scene, problem: ShellProblem) -> ShellProblem:
    """The problem with the waypoints of the scene's [[path]] and, for two clamps, the arc where the path begins.

    Raises `BadInput` for a stage that the shell cannot follow.
    """
    if problem.closed and scene.path:
        remedy = "leave the path out (--set path=[]): a shell's band has one of its own"
        raise BadInput("path", None, "is not what the shell's band can follow", remedy)
    if problem.partly_held:
        if scene.path:
            remedy = "leave the path out (--set path=[]): a shell that is held in part has a beginning of its own"
            raise BadInput("path", None, "is not what a shell that is held in part can follow", remedy)
        return _released_path(scene, problem)
    if not scene.path and (problem.shaped or not _both(problem)):
        return problem  # of a strip that is no plane at rest the clamps go from where it has its end
    stages = _followed(scene)
    first = stages[0]
    curvature = problem.start_curvature
    # where the shell begins if nothing is said
    begin: law.Law = (0.0, 0.0) if problem.clamp == "corners" else scene.curvature
    if curvature is not None:
        begin = (curvature, curvature)
    waypoints: list[Waypoint] = []
    if _both(problem):
        here, there = start_pose(first), end_pose(first)
        assert there is not None
        arc = curvature
        if arc is None:
            arc = 0.0 if scene.transverse_curvature else arc_curvature(here, there, scene)
        if not scene.transverse_curvature:  # a tape spring begins straight, in its own section
            curvature = arc
        begin = (arc, arc)
        waypoints += from_arc(here, there, arc)
        # the arc is unstressed; its natural curvature goes over into the strip's while it is held as an arc
        waypoints.insert(1, Waypoint(natural=_fraction(first, scene, begin), name="natural"))
        waypoints.append(Waypoint(start=here, end=there, name="clamps"))
    elif (
        curvature is None
        and problem.clamp == "edge"
        and not scene.transverse_curvature
        and not _same(first.curvature, scene.curvature)
    ):
        curvature, *others = law.values(first.curvature)
        if any(other != curvature for other in others):
            key = "strip.natural_curvature"
            given = np.array(first.strip.natural_curvature).tolist()
            raise BadInput(
                stage_name(0, key), given, "is no arc for the shell's path to begin with",
                "give one number, or shell.start_curvature",
            )  # fmt: skip
        begin = (curvature, curvature)
    if scene.path:
        waypoints.append(_waypoint(first, scene, begin, "path 1"))
    for number, stage in enumerate(stages[1:-1], start=2):
        waypoints.append(_waypoint(stage, scene, begin, f"path {number}"))
    return dataclasses.replace(problem, start_curvature=curvature, path=tuple(waypoints))


def _released_path(scene: Scene, problem: ShellProblem) -> ShellProblem:
    """The problem with the way of its clamps where two points are held: they hold all of the ends until they let go."""
    if problem.closed or scene.start_position is None or scene.end_position is None:
        return problem
    assert problem.end is not None
    given = problem.start_curvature
    arc = held_curvature(scene) if given is None else given
    way = from_arc(problem.start, problem.end, arc)
    way.insert(1, Waypoint(natural=1.0, name="natural"))
    way.append(Waypoint(start=problem.start, end=problem.end, name="clamps"))
    return dataclasses.replace(problem, start_curvature=arc, path=tuple(way))


def _followed(scene: Scene) -> tuple[Scene, ...]:
    """The stages of the scene and the scene itself, each of them such that the shell can follow."""
    stages, section = scene.stages(), shell_holds.section
    for number, stage in enumerate(stages[:-1]):
        for key, differs in (
            ("clamp.end", (stage.clamp_end is None) != (scene.clamp_end is None)),
            ("clamp.start.slide", _slide(stage.clamp_start) != _slide(scene.clamp_start)),
            ("clamp.end.slide", _slide(stage.clamp_end) != _slide(scene.clamp_end)),
            ("clamp.start.section", section(stage, stage.clamp_start) != section(scene, scene.clamp_start)),
            ("clamp.end.section", section(stage, stage.clamp_end) != section(scene, scene.clamp_end)),
            ("clamp.end.frame", hinged(stage) != hinged(scene)),
            ("strip.natural_twist", stage.twist != scene.twist),
            ("strip.natural_geodesic_curvature", stage.geodesic != scene.geodesic),
            ("strip.transverse_curvature", stage.transverse_curvature != scene.transverse_curvature),
            ("strip.width", stage.width != scene.width),
            ("strip.length", stage.strip.length != scene.strip.length),
            ("strip.poisson", stage.strip.poisson != scene.strip.poisson),
            ("gravity.up", stage.gamma > 0 and scene.up is not None and not np.allclose(stage.up, scene.up)),  # type: ignore[arg-type]
            ("strip.gamma", stage.gamma > 0 and not scene.gamma),
            ("clamp.end.position", stage.guided != scene.guided),
            ("clamp.start", shell_holds.holds(stage)[0] != shell_holds.holds(scene)[0]),
            ("clamp.end", shell_holds.holds(stage)[1] != shell_holds.holds(scene)[1]),
            ("tip", not _along(_at_tip(stage), _at_tip(scene))),
            ("wall.normal", not np.array_equal(stage.wall_normals, scene.wall_normals)),
            ("contact", stage.apart != scene.apart),
            ("obstacle", _shapes(stage) != _shapes(scene)),
            ("wall.stiffness", [w.stiffness for w in stage.walls] != [w.stiffness for w in scene.walls]),
        ):
            if differs:
                raise _cannot_follow(number, key)
        beyond = beyond_the_shell(stage)
        if beyond is not None:
            raise BadInput(stage_name(number, beyond[0]), None, beyond[1], "leave the stage out (--set path=[])")
    return stages


def _cannot_follow(number: int, key: str) -> BadInput:
    return BadInput(
        stage_name(number, key), None, "is not what the shell's path can change: poses of the clamps, places of the "
        "walls and obstacles, fractions of the scene's own weight, of its own load at the tip, its natural curvature",
        "leave the stage out (--set path=[])",
    )  # fmt: skip


def _waypoint(stage: Scene, scene: Scene, begin: law.Law, name: str) -> Waypoint:
    """The stage as a waypoint."""
    gravity = stage.gamma / scene.gamma if scene.gamma else None
    whole = _at_tip(scene)
    size = float(whole @ whole)
    tip = float(_at_tip(stage) @ whole) / size if size else None
    walls = wall_points(stage) if scene.walls else None
    start = None if scene.clamp_start is None else start_pose(stage)
    obstacles = obstacle_points(stage) if scene.obstacles else None
    return Waypoint(_fraction(stage, scene, begin), gravity, start, end_pose(stage), name, tip, walls, obstacles)


def _shapes(scene: Scene) -> list[Obstacle]:
    """The obstacles without their places."""
    return [dataclasses.replace(body, point=(0.0, 0.0, 0.0)) for body in shell_obstacles(scene)]


def _at_tip(scene: Scene) -> FloatArray:
    """Force and moment at s = 1, (6,), in D w / l^2 and D w / l."""
    return np.concatenate([scene.tip_force, scene.tip_moment])


def _along(force: FloatArray, whole: FloatArray) -> bool:
    """Whether loads (k,) are a multiple of `whole`."""
    size = float(whole @ whole)
    rest = force - (float(force @ whole) / size if size else 0.0) * whole
    return bool(np.abs(rest).max() <= 1e-9 * max(np.abs(force).max(), np.abs(whole).max()))


def _same(a: law.Law, b: law.Law) -> bool:
    one, other = law.knots(a), law.knots(b)
    return np.shape(one) == np.shape(other) and bool(np.allclose(one, other, rtol=_SAME, atol=0.0))


def _fraction(stage: Scene, scene: Scene, begin: law.Law) -> float | None:
    """f with K_stage = begin + f (K - begin): the natural curvature on its way from the start's to the scene's."""
    s = np.unique(np.concatenate([law.knots(one)[0] for one in (scene.curvature, stage.curvature, begin)]))
    whole, here = (law.at(one, s) - law.at(begin, s) for one in (scene.curvature, stage.curvature))
    if _same(stage.curvature, scene.curvature):
        return 1.0
    scale = float(whole @ whole)
    fraction = float(here @ whole) / scale if scale else 0.0
    if np.abs(here - fraction * whole).max() > 1e-9 * max(1.0, float(np.abs(here).max())):
        number = scene.stages().index(stage)
        key = "strip.natural_curvature"
        raise BadInput(
            stage_name(number, key), np.array(stage.strip.natural_curvature).tolist(),
            "is not between the curvature where the shell's path begins and the scene's",
            "give a multiple of the scene's own law, or leave the stage out (--set path=[])",
        )  # fmt: skip
    return fraction


# -- from a planar arc to two clamps ----------------------------------------------------------------------------------


def arc_turn(distance: float) -> float:
    """The angle in [0, 2 pi] by which an arc of length 1 turns whose chord is `distance`: 2 sin(c / 2) = c d."""
    if distance >= 1.0:
        return 0.0
    low, high = 0.0, 2.0 * math.pi
    for _ in range(80):
        middle = 0.5 * (low + high)
        if 2.0 * math.sin(0.5 * middle) > middle * distance:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def arc_curvature(start: Pose, end: Pose, scene: Scene) -> float:
    """Curvature (1/l) of the planar arc whose chord is the clamps' distance.

    It bends the way in which both clamps turn the less to their frames; where that does not decide, as the seed does in
    its middle, or the natural curvature, or positively.
    """
    turn = arc_turn(math.dist(start.position, end.position))
    if turn == 0.0:
        return 0.0
    effort = {sign: sum(float(np.sum(path**2)) for path in _turns(start, end, sign * turn)[1]) for sign in (1.0, -1.0)}
    if abs(effort[1.0] - effort[-1.0]) > 1e-6 * (effort[1.0] + effort[-1.0]):
        return turn * min(effort, key=effort.__getitem__)
    seed = scene.seed_curvature
    middle = float(np.interp(0.5, np.linspace(0.0, 1.0, len(seed)), seed))
    return math.copysign(turn, middle or law.turn(scene.curvature) or 1.0)


def from_arc(start: Pose, end: Pose, curvature: float) -> list[Waypoint]:
    """Waypoints from the planar arc to the clamps' frames: the arc stands on the clamps' points (or begins at the
    start and points at the end), then both frames turn steadily, by less than `MOST_TURN` on a leg.
    """
    frames, ways = _turns(start, end, curvature)
    here, there = np.array(start.position), np.array(end.position)
    half = 0.5 * curvature
    chord = 1.0 if abs(half) < 1e-9 else math.sin(half) / half
    chord_frame = _chord_frame(start, end)
    arc_end = here + chord * chord_frame[:, 2]
    legs = max(1, math.ceil(max(float(np.linalg.norm(path)) for path in ways) / MOST_TURN))
    found = [Waypoint(start=_pose(here, frames[0]), name="arc")]
    for leg in range(1, legs):
        t = leg / legs
        turned = [_rotation(t * path) @ frame for path, frame in zip(ways, frames, strict=True)]
        place = arc_end + t * (there - arc_end)
        found.append(Waypoint(start=_pose(here, turned[0]), end=_pose(place, turned[1]), name="clamps"))
    return found


def _chord_frame(start: Pose, end: Pose) -> FloatArray:
    """The frame whose tangent is the chord and whose normal is nearest those of the clamps (columns t_x t_y t_z)."""
    here, there = np.array(start.position), np.array(end.position)
    frames = [np.array(start.frame), np.array(end.frame)]
    chord = there - here
    size = float(np.linalg.norm(chord))
    tangent = chord / size if size > 1e-9 else frames[0][:, 2]
    for candidate in (frames[0][:, 1] + frames[1][:, 1], frames[0][:, 1], frames[0][:, 2], frames[0][:, 0]):
        normal = candidate - (candidate @ tangent) * tangent
        if np.linalg.norm(normal) > 1e-3:
            break
    normal = normal / np.linalg.norm(normal)
    return np.stack([np.cross(normal, tangent), normal, tangent], axis=1)


def _turns(start: Pose, end: Pose, curvature: float) -> tuple[list[FloatArray], list[FloatArray]]:
    """Frames of the arc's two ends, and the rotation vectors (3,) that take them to the clamps' frames.

    The way of each goes over the chord's frame, so that the strip is not wound up where the arc turns by more than pi.
    """
    middle = _chord_frame(start, end)
    frames, ways = [], []
    for pose, angle in ((start, -0.5 * curvature), (end, 0.5 * curvature)):
        bent = angle * middle[:, 0]  # positive curvature turns the tangent towards -t_y: about t_x
        frame = _rotation(bent) @ middle
        wanted = _rotation_vector(np.array(pose.frame) @ middle.T)
        frames.append(frame)
        direct = _rotation_vector(np.array(pose.frame) @ frame.T)
        ways.append(_near(direct, wanted - bent))
    return frames, ways


def _near(vector: FloatArray, wanted: FloatArray) -> FloatArray:
    """The rotation vector of the same rotation (angle + 2 pi k about its axis) nearest to `wanted`."""
    angle = float(np.linalg.norm(vector))
    if angle < 1e-12:
        return vector
    axis = vector / angle
    return min(((angle + 2.0 * math.pi * k) * axis for k in (-1, 0, 1)), key=lambda v: float(np.sum((v - wanted) ** 2)))


def _rotation(vector: FloatArray) -> FloatArray:
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_rotvec(vector).as_matrix())


def _rotation_vector(rotation: FloatArray) -> FloatArray:
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_matrix(rotation).as_rotvec())
