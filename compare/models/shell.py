"""The Naghdi shell as a model: one solve per w/h of the scene, each in a process of its own, kept and found again."""

from __future__ import annotations

import contextlib
import math
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from compare.measure.align import Motions, aligned, even_along
from compare.measure.distance import grid_hausdorff
from compare.measure.numbers import nested
from compare.models import half_turns, keys
from compare.models.base import (
    BESIDE,
    NEAR,
    Effect,
    Energy,
    Force,
    Ladder,
    Model,
    Options,
    Seconds,
    Shape,
    Size,
    State,
    Status,
    Supports,
    Variant,
    between_parts,
    check_keys,
    natural_constant,
    on_strip,
)  # fmt: skip
from compare.models.capabilities import BranchStart, Reference
from compare.models.effects.price import check_price
from compare.models.effects.shell import effects
from compare.models.holds import shell as shell_holds
from compare.models.holds.bodies import net
from compare.models.holds.planes import box, plane_net
from compare.models.quantities.shell import QUANTITIES
from compare.models.reference import STRETCHING, beside_mesh, judged
from compare.models.scope import has_shell, require_shell
from compare.models.shell_build import shell_elements, shell_options, shell_problem
from compare.models.shell_process import ShellCase, run_shell
from compare.scene.inputs.law import Law, at, values
from compare.store.store import CaseStore
from ribbonbench.errors import BadInput

if TYPE_CHECKING:
    from compare.scene.scene import Scene
    from compare.store.progress import Reporter
    from shellref.shell.options import ShellOptions
    from shellref.shell.problem import ShellProblem
    from shellref.shell.surface import ShellSurface

FloatArray = NDArray[np.float64]

#: Usual meshes.
MESHES = ((25, 2), (50, 4), (100, 4), (100, 8))
#: One more from the ribbon's surface, so that it reaches 1e-4 l too (curl_4_3, w/h = 200: 100 x 8 ends at 1.1e-4).
FINER_NEAR = (150, 12)
LADDER = "shell"
#: Parts of a shell's elastic energy; what holds the elements' own modes is none of the strip's.
PARTS = ("bending", "membrane", "shear", "stabilisation")
#: The same meshes, each begun at the ribbon's surface.
NEAR_LADDER = f"{LADDER} {NEAR}"

_STATUS = {
    "converged": Status.CONVERGED,
    "unstable": Status.UNSTABLE,
    "not_converged": Status.NOT_CONVERGED,
    "limit_point": Status.LIMIT_POINT,
    "stretched": Status.INFEASIBLE,
    "invalid": Status.FAILED,
    "crashed": Status.CRASHED,
}

#: How a shell's solve began, from the worker's words (shellref.path.begin.Begun).
START = {
    "path": "path",
    "coarse path": "coarse path",
    "given": BESIDE,
    "given, as the coarse path": f"{BESIDE} (as the coarse path)",
    "given, by way of thicker strips": f"{BESIDE} (thicker first)",
    "path (none near the start)": "path (none near the ribbon)",
    "path (the start is refused)": "path (the ribbon's is refused)",
}


@dataclass(frozen=True)
class ShellShape(Shape):
    """The shell's middle surface.

    curvature: the scene's natural one at both ends, 1/l.
    """

    case: ShellCase
    curvature: Law = (0.0, 0.0)

    @property
    def surface(self) -> ShellSurface:
        """Positions and directors at the nodes."""
        return self.case.surface

    @property
    def bend(self) -> float:
        """Largest curvature of the centreline, 1/l, from the turn of its tangent between samples."""
        s = np.linspace(0.0, 1.0, 2001)
        tangent = self.frames(s)[:, :, 2]
        return float(np.linalg.norm(np.diff(tangent, axis=0), axis=1).max() * (s.size - 1))

    def points(self, s: FloatArray, v: FloatArray) -> FloatArray:
        """Positions (k, m, 3)."""
        return self.surface.grid(on_strip(s), v)

    def centreline(self, s: FloatArray) -> FloatArray:
        """Positions (k, 3) of v = 0."""
        return self.surface.centreline(on_strip(s))

    def frames(self, s: FloatArray) -> FloatArray:
        """Frames (k, 3, 3) of the centreline, columns across, normal, along."""
        return self.surface.frames(on_strip(s))

    def fields(self, s: FloatArray, v: FloatArray) -> dict[str, FloatArray]:
        """S, v, normal (the director), and the energies per area of the cell around each particle, D / l^2:
        the parts bending, membrane, shear with the constant of the natural curvature, and energy_density, their sum
        without it (its mean over the cell), where the natural curvature is the scene's."""
        from compare.measure.energy_map import at_points, density_on_grid

        grid_s, grid_v = np.meshgrid(s, v, indexing="ij")
        surface = self.surface
        k = surface.degree
        parts = at_points(surface.s_nodes[::k], surface.v_nodes[::k], density_on_grid(self.case), s, v)
        names = ("bending", "membrane", "shear")
        law = at(self.curvature, surface.s_nodes[::k])
        constant = np.array([natural_constant(ends) for ends in pairwise(law)])
        without = (
            parts.sum(axis=2)
            - at_points(surface.s_nodes[::k], surface.v_nodes[[0, -1]], constant[:, None, None], s, v)[:, :, 0]
        )
        return {
            "S": grid_s,
            "v": grid_v,
            "normal": surface.director(grid_s, grid_v),
            **({"energy_density": without} if natural_reached(self.case.data) else {}),
            **{f"{name}_density": parts[:, :, i] for i, name in enumerate(names)},
        }


class ShellModel(Model):
    """The nonlinear Naghdi shell in FEniCSx."""

    name = "shell"
    quantities = QUANTITIES
    presenter = "compare.pages.shell:PRESENTER"
    reads = (
        keys.STRIP | keys.SHAPED | keys.CROSS_CURVED | keys.WEIGHT | keys.TIP | keys.BOTH_CLAMPS - keys.RULINGS
        | keys.CLOSED | keys.HALF_TURNS | keys.WALLS | keys.OBSTACLES | keys.CONTACT
        | keys.SEED - keys.RULINGS | keys.PATH | keys.SHELL
    )  # fmt: skip
    without_effect = keys.because(
        keys.UNSURE,
        (keys.OVER_THE_SURFACE, "the shell always weighs its surface"),
        (keys.CLAMP_RULINGS, "where a frame is held, shell.clamp says what a shell's clamp holds"),
        (keys.RULINGS & (keys.SEED | keys.CLOSURE), "a shell has no rulings"),
        (keys.MODEL, "how the ribbon beside it is discretised and solved"),
    )

    def refusal(self, scene: Scene) -> BadInput | None:
        """A scene without thickness, or held as no shell can be."""
        try:
            for ratio in require_shell(scene):
                shell_problem(scene, ratio, way=False)
        except BadInput as refused:
            return refused
        return None

    def variants(self, scene: Scene) -> tuple[Variant, ...]:
        """One for each w/h."""
        return tuple(
            Variant({"width_to_thickness": float(ratio)}, scene.replace({"shell.width_to_thickness": [float(ratio)]}))
            for ratio in require_shell(scene)
        )

    def ladders(self, scene: Scene) -> tuple[Ladder, ...]:
        """Meshes of degree 2, on their own and, where that is another beginning, from the ribbon's surface."""
        if not has_shell(scene):
            return (Ladder(LADDER, why="the scene has no thickness, or its supports are not a shell's"),)
        own = Ladder(LADDER, tuple(mesh_size(mesh) for mesh in MESHES))
        if scene.several_equilibria or scene.shell.start in ("coarse", "path"):
            return (own,)
        near = (*own.sizes, mesh_size(FINER_NEAR))
        return own, Ladder(NEAR_LADDER, tuple(replace(size, ladder=NEAR_LADDER) for size in near))

    def solve(
        self,
        scene: Scene,
        size: Size | None = None,
        *,
        near: Shape | None = None,
        options: Options | None = None,
        say: Reporter | None = None,
    ) -> State:
        """The scene's shell at its (first) w/h, begun as `begin` says; a size of `LADDER` begins at `near` only where
        that selects."""
        options = options or Options()
        if size is not None and size.ladder == LADDER and not options.selects:
            near = None
        ratio = require_shell(scene)[0]
        if size is not None and scene.shell.tolerance is not None:  # a size that is asked for is not refined
            scene = scene.replace({"shell.tolerance": None, "shell.goal": None})
        elements = shell_elements(scene) if size is None else (int(size.values[0]), int(size.values[1]))
        requested = check_price(scene, elements, 2 if size is None or size.degree is None else size.degree, options.yes)
        if say is not None:
            words = f", {requested.text}" if requested.said else ""
            say.step(f"shell: w/h = {ratio:g}, {elements[0]} x {elements[1]} elements{words}")
        problem = problem_of(scene, ratio, elements, options.fallback)
        if size is not None and size.degree is not None:
            problem = replace(problem, degree=size.degree)
        near, how = begin(scene, near, options.selects)
        if size is not None and size.ladder == NEAR_LADDER and near is not None and not options.selects:
            how = replace(how, begin="stable")
        with contextlib.ExitStack() as stack:
            store = options.store
            if store is None:  # nothing is kept: the files live as long as the state's arrays take to load
                place = stack.enter_context(tempfile.TemporaryDirectory(prefix="ribbonbench-shell-"))
                store = CaseStore(Path(place))
            case, wall = _run(how, problem, store, near, say)
            found = half_turns.counted(scene, state_of(scene, case, wall))
            if options.error and (scene.shell.tolerance is None or scene.shell.goal != "surface"):
                found = self._with_error(scene, found, elements, ratio, store, near, how, options, say)
            if options.store is None and case.folder is not None:
                _ = case.surface, case.density()
            return found

    def _with_error(
        self,
        scene: Scene,
        state: State,
        elements: tuple[int, int],
        ratio: float,
        store: CaseStore,
        near: Shape | None,
        how: ShellOptions,
        options: Options,
        say: Reporter | None,
    ) -> State:
        """Errors by what changes on `beside_mesh`, as `judged` says. It begins at the state's own shape, on the same
        branch, unless the scene asks for its path.
        """
        # a mesh refined for a goal is compared with its first mesh, which is coarser, as it is
        check = beside_mesh(elements) if scene.shell.tolerance is None else elements
        how = replace(how, accuracy=None)
        if say is not None:
            say.step(f"shell: w/h = {ratio:g}, {check[0]} x {check[1]} elements, for the discretisation error")
        if scene.shell.start != "path" and state.stands:
            near, how = state.shape, replace(how, begin="given")
        try:
            case, _ = _run(how, problem_of(scene, ratio, check, options.fallback), store, near, say)
        except BadInput as refused:  # a mesh that cannot have the held corners' knots
            return replace(state, error_why=f"on {check[0]} x {check[1]} elements: {refused}")
        partner = half_turns.counted(scene, state_of(scene, case))
        return judged(scene, state, partner, options.grid)

    def branch_start(
        self, scene_at: Callable[[float], Scene], say: Reporter | None = None, *, moving: bool = False
    ) -> BranchStart:
        """A branch of the shell of the first w/h, on the scene's own mesh (`compare.models.branches.shell`)."""
        from compare.models.branches.shell import branch_start

        first = scene_at(0.0)
        if moving:
            raise BadInput("--moving", None, "moves elements, and a shell's stay where they are", "leave it out")
        if first.shell.tolerance is not None:  # the mesh is that of the branch, and its errors are told by halving it
            first = first.replace({"shell.tolerance": None, "shell.goal": None})
        return branch_start(scene_at, self.solve(first, options=Options(error=False), say=say))

    def barriers(self, scene: Scene, state: State, points: FloatArray) -> list[FloatArray]:
        """Planes, those on springs where they have moved to, then obstacles."""
        low, high, _ = box(points)
        heights = [wall["height"] or 0.0 for wall in state.supports.walls] or [0.0] * len(scene.walls)
        placed = zip(scene.wall_points, scene.wall_normals, heights, strict=False)
        planes = [plane_net(point + height * normal, normal, low, high) for point, normal, height in placed]
        return planes + [net(body, points) for body in scene.bodies]

    def refined(self, state: State) -> State | None:
        """None: a shell is refined by its scene's mesh."""
        return None

    def reference(
        self,
        scene: Scene,
        sizes: Sequence[Size],
        *,
        near: Shape | None = None,
        options: Options | None = None,
        say: Reporter | None = None,
    ) -> Reference:
        """The largest mesh with degree 3, against degree 2 on half as many elements more each way.

        That bounds the error as long as the reference is twice as accurate. The check begins at its start even where
        `options.store` has a part of it: its time is that of a run.
        """
        options = replace(options or Options(), error=False)
        assert options.grid is not None, "a reference's error is measured on a grid"
        own = [size for size in sizes if size.ladder == LADDER] or sizes  # the check is FINER_NEAR, on its own
        largest = max(own, key=lambda size: math.prod(size.values))
        ratio = f"w/h = {require_shell(scene)[0]:g}"
        fine = replace(largest, degree=3, words=f"{largest.label}, Q3")
        check = Size(LADDER, tuple(float(-(-3 * int(value) // 2)) for value in largest.values), 2)
        found = []
        for size, store in ((fine, options.store), (check, None)):
            if say is not None:
                say.step(f"reference of the shell: {ratio}, {size.label}")
            found.append(self.solve(scene, size, near=near, options=replace(options, store=store), say=say))
        state, other = found
        error = None
        if state.ok and other.ok and state.shape is not None and other.shape is not None:
            points = options.grid.of(state.shape)
            error = grid_hausdorff(points, aligned(options.grid.of(other.shape), points, state.motions))
        checked = check.label if other.ok else f"{check.label}: {other.word}"
        return Reference(state, f"{fine.label}, {ratio}", error, checked, other)

    def effects(self, scene: Scene) -> tuple[Effect, ...]:
        """The shell in words (on where the scene has one), and the effects that can be off in it."""
        found = effects(scene)
        if found[0].on:
            try:
                check_keys(self, scene)
            except BadInput as refusal:  # what it does not read is no shell of this scene
                return (Effect(found[0].key, "", False, f"{refusal.key} {refusal.problem}"), *found[1:])
        return found


def mesh_size(mesh: tuple[int, int], degree: int | None = 2) -> Size:
    """The size of a mesh (elements along, across) of elements of this degree; None: not known."""
    return Size(LADDER, (float(mesh[0]), float(mesh[1])), degree)


def problem_of(scene: Scene, ratio: float, elements: tuple[int, int], fallback: bool = False) -> ShellProblem:
    """The shell with the scene's path; with `fallback` without it where the shell cannot follow that path."""
    try:
        return shell_problem(scene, ratio, elements)
    except BadInput:
        if not fallback:
            raise
        return shell_problem(scene, ratio, elements, way=False)


def begin(scene: Scene, near: Shape | None, selects: bool) -> tuple[Shape | None, ShellOptions]:
    """Where a shell begins, as `shell.start` says, with the options that believe as much of it (shellref.path.begin).

    near: the surface of a state beside it; selects: that says which of several states is asked for.
    """
    options = shell_options(scene)
    start = scene.shell.start
    if near is None or start in ("coarse", "path"):
        return None, options
    if selects:
        return near, replace(options, begin="given")
    return near, replace(options, begin="checked" if start == "auto" else "stable")


def _run(
    options: ShellOptions, problem: ShellProblem, store: CaseStore, near: Shape | None, say: Reporter | None
) -> tuple[ShellCase, float | None]:
    """The case, and the wall time (s) of its process; None for one that was found."""
    progress = None if say is None else say.detail
    start = None if near is None else starting_surface(near, problem)
    clock = time.perf_counter()
    case = run_shell(problem, store, options, progress=progress, start=start)
    return case, None if case.reused else time.perf_counter() - clock


def starting_surface(near: Shape, problem: ShellProblem) -> ShellSurface:
    """Positions and normals of a shape at the nodes of the problem's mesh (units l): where the shell's solve begins.

    The shell settles there at the full load. Its equilibrium satisfies its own equations whatever it began with: the
    start only selects the branch, where a strip with two clamps has several. A shell's own surface is taken as it is.
    """
    from shellref.shell.strip import strip_grid
    from shellref.shell.surface import ShellSurface

    if isinstance(near, ShellShape):
        return near.surface
    grid = strip_grid(problem)
    s, v = grid.s_nodes, grid.v_nodes
    return ShellSurface(s, v, near.points(s, v), near.fields(s, v)["normal"], grid.degree)


def state_of(scene: Scene, case: ShellCase, wall: float | None = None) -> State:
    """A shell case as a state; wall: of its process (s). Its energy leaves out the constant of the natural curvature,
    which it has in full only where its natural curvature is the scene's: elsewhere the elastic energy is not known."""
    data = case.data
    unstable = case.status == "converged" and not case.ok
    mesh = data.get("elements") or shell_elements(scene)
    discretisation = data.get("discretisation") or {}
    problem = data.get("problem")  # None: the worker died without a report
    seconds = case.seconds
    return State(
        model="shell",
        size=mesh_size((int(mesh[0]), int(mesh[1])), None if problem is None else int(problem["degree"])),
        status=Status.UNSTABLE if unstable else _STATUS.get(case.status, Status.FAILED),
        word="unstable" if unstable else case.status,
        stable=data.get("stable"),
        message=str(data.get("message", "")),
        energy=energy_of(scene, data),
        shape=None if case.folder is None else ShellShape(case, scene.curvature),
        residual=(data.get("residual") or {}).get("relative"),
        iterations=data.get("newton_iterations"),
        lowest_eigenvalue=_number(data.get("lowest_eigenvalue")),
        supports=_supports(scene, data),
        error=discretisation.get("estimate") if discretisation.get("goal", "surface") == "surface" else None,
        errors=nested((discretisation.get("meshes") or [{}])[-1].get("errors") or {}) if discretisation else {},
        error_why="by the meshes that were refined" if discretisation else "",
        seconds=Seconds(seconds if math.isfinite(seconds) else float("nan"), process=wall),
        unknowns=int(data.get("dofs", 0)),
        numbers={
            "elements": " x ".join(str(number) for number in mesh),
            "share": data.get("share"),
            "share_error": _share_error(discretisation),
            **_beyond_walls(data),
        },
        start=START[case.start or "path"],
        motions=motions_of(scene),
        reused=case.reused,
        native=case,
    )


def motions_of(scene: Scene) -> Motions | None:
    """What nothing resists: of a band that no clamp holds the rigid motions, and its sliding along itself."""
    if scene.closure is None or scene.clamp_start is not None:
        return shell_holds.motions_of(scene)
    sign = -1 if scene.closure.turned % 2 else 1
    seam = sign if even_along(values(scene.curvature), sign) else 0
    mirror = bool(seam) and not any(values(scene.curvature))
    if scene.walls:  # the table's plane, and turns about its normal
        rigid = shell_holds.motions_of(scene)
        none = np.zeros((0, 3))
        return Motions(
            none if rigid is None else rigid.translations, none if rigid is None else rigid.axes, None, seam, mirror
        )
    return Motions(np.eye(3), np.eye(3), None, seam, mirror)


def _share_error(discretisation: Mapping[str, Any]) -> float | None:
    """What the shares of membrane and shear change by on a mesh twice as fine along, and on one across."""
    changes = (discretisation.get("meshes") or [{}])[-1].get("share")
    return None if not changes else 2.0 * sum(float(changes[part]) for part in STRETCHING)


def natural_reached(data: Mapping[str, Any]) -> bool:
    """Whether the natural curvature of a shell's report is the scene's, and not one on the way there."""
    return abs(float(data.get("natural_factor", 1.0)) - 1.0) < 1e-12


def energy_of(scene: Scene, data: Mapping[str, Any]) -> Energy | None:
    """The energy in a shell's report."""
    energy = data.get("energy")
    if not energy:
        return None
    constant = natural_constant(scene.curvature)
    parts = {name: float(energy[name]) for name in PARTS if name in energy}
    elastic = float(energy["elastic"]) - constant if natural_reached(data) else None
    tip = _number(energy.get("tip"))
    plates = _number(energy.get("plates")) if any(wall.stiffness is not None for wall in scene.walls) else None
    return Energy(
        elastic=elastic, gravity=float(energy["gravity"]), tip=tip, plates=plates, constant=constant, parts=parts
    )


def _number(value: Any) -> float | None:
    return None if value is None else float(value)


def _beyond_walls(data: Mapping[str, Any]) -> dict[str, float]:
    """How far the shell reaches beyond a wall, into an obstacle or through itself, over l, between nodes too, where it
    may touch one of these."""
    contact = data.get("contact")
    return {} if contact is None else {"penetration_between": float(contact["penetration"])}


def _supports(scene: Scene, data: Mapping[str, Any]) -> Supports:
    clamps = data.get("clamps") or {}

    def force(name: str) -> Force | None:
        found = clamps.get(name)
        return None if found is None else Force(np.asarray(found["force"]), np.asarray(found["moment"]))

    found = data.get("walls") or ()
    walls = tuple(_wall(scene, number, wall) for number, wall in enumerate(found))
    pairs = ((pair["s"], pair["s_other"], pair["force"]) for pair in data.get("pairs") or ())
    return Supports(force("start"), force("end"), walls, None if scene.apart is None else between_parts(pairs))


def _wall(scene: Scene, number: int, found: Mapping[str, Any]) -> dict[str, Any]:
    """What a wall or an obstacle exerts, as a ribbon's is told, with its moment about the origin, the nearest node's
    gap, and the pressures (D / l^3)."""
    contacts = np.asarray(found["contacts"], dtype=float).reshape(-1, 2)
    return {
        "name": scene.barrier_names[number],
        "force": np.asarray(found["force"], dtype=float),
        "moment": np.asarray(found["moment"], dtype=float),
        "gap": found["gap"],
        "contacts": np.unique(np.round(contacts[:, 0], 10)),
        "lines": np.asarray(found["lines"], dtype=float).reshape(-1, 2),
        "points": np.asarray(found["points"], dtype=float).reshape(-1, 3),
        "pushes": np.asarray(found["pushes"], dtype=float),
        "pressure": np.asarray(found["pressure"], dtype=float),
        "greatest_pressure": found["greatest_pressure"],
        "mean_pressure": found["mean_pressure"],
        "height": found["height"],
    }
