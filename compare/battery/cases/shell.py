"""The shell: thin, coiled, nu at its limits, snapping, coarse; judged by `compare.battery.thin` and closed forms."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from compare.battery import planar, thin
from compare.battery.case import Case, Check, Rung, holds, near

FLAT = ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))  # t_x = e_y, t_y = e_z, t_z = e_x


def solved(options: dict[str, Any] | None = None, **keys: Any) -> Any:
    """A shell of w / l = 0.1, w / h = 100, nu = 0 on 40 x 2 elements but for `keys`; skipped where dolfinx is not."""
    _communicator()
    from shellref.path.solve import solve
    from shellref.shell.options import ShellOptions
    from shellref.shell.problem import ShellProblem

    base: dict[str, Any] = {"width": 0.1, "thickness": 1e-3, "poisson": 0.0, "elements": (40, 2)}
    return solve(ShellProblem(**{**base, **keys}), ShellOptions(**(options or {})))


def _communicator() -> Any:
    """That of one process. Raises `Missing` where dolfinx is not there."""
    from ribbonbench.errors import Missing

    try:
        from shellref.fenics import dolfinx_api

        return dolfinx_api.communicator("self")
    except ImportError as missing:
        raise Missing(str(missing), "apt install python3-dolfinx") from None


def _elastica(result: Any, bound: float) -> Iterator[Check]:
    """A strip with nu = 0 that stays in its plane is an elastica: the collocation beside its centreline.

    The clamp's frame is the identity: the plane's x is z, its y is -y.
    """
    from shellref.elastica.problem import ElasticaProblem

    problem = result.problem
    up = (0.0, 1.0) if problem.up is None else (problem.up[2], -problem.up[1])
    twin = ElasticaProblem(gamma=problem.gamma, up=up, curvature=problem.natural_curvature)
    s = np.linspace(0.0, 1.0, 401)
    frames = result.surface.frames(s)
    theta = np.unwrap(np.arctan2(-frames[:, 1, 2], frames[:, 2, 2]))
    points = result.surface.centreline(s)
    plane = np.stack([points[:, 2], -points[:, 1]], axis=1)
    at = planar.collocated(twin, s, theta - theta[0], plane, np.zeros(2), 1e-6)
    own = np.stack([np.interp(s, at.s, at.points[:, k]) for k in (0, 1)], axis=1)
    off = float(np.linalg.norm(own - plane, axis=1).max())
    yield Check("distance from the elastica's collocation (l)", off, bound)
    law = problem.natural_curvature
    constant = (law[0] ** 2 + law[0] * law[1] + law[1] ** 2) / 6.0
    total = at.bending + at.gravity + constant
    size = max(1.0, abs(total))
    yield Check("energy against the elastica's (relative)", abs(result.energy["total"] - total) / size, 30.0 * bound)


EPS = float(np.finfo(float).eps)

HANGING: dict[str, Any] = {"natural_curvature": (3.0, 3.0), "gamma": 20.0, "up": (0.0, 1.0, 0.0)}


def _thin(rung: Rung) -> Iterator[Check]:
    ratio = float(rung)
    result = solved(thickness=0.1 * ratio, **HANGING)
    yield from thin.judged(result, stiff=2.0 * EPS * 12.0 / (0.1 * ratio) ** 2)
    text = f"{result.stable}, lowest eigenvalue {result.lowest_eigenvalue}"
    known = result.stable is True if ratio > 5e-5 else result.stable is not False
    yield holds("stable (below h/w = 1e-4: or not known, within rounding)", known, text)
    yield from _elastica(result, 3e-5)


def _poisson(rung: Rung) -> Iterator[Check]:
    return thin.judged(solved(poisson=float(rung), **HANGING))


def _bent(rung: Rung) -> Iterator[Check]:
    """Pure bending to a cylinder of radius R: the section curls at its edges by Lamb's equation."""
    poisson, curvature, width, thickness = float(rung), 1.0, 0.2, 2e-3
    arc = np.array([0.0, -(1.0 - math.cos(curvature)) / curvature, math.sin(curvature) / curvature])
    cos, sin = math.cos(curvature), math.sin(curvature)
    # t_z' = -K t_y: at S = 1 the frame is turned about t_x by K
    frame = ((1.0, 0.0, 0.0), (0.0, cos, -sin), (0.0, sin, cos))
    from shellref.shell.problem import Pose, Waypoint

    result = solved(
        width=width, thickness=thickness, poisson=poisson, elements=(24, 12), grading=(1.0, 0.3),
        start_curvature=curvature, end=Pose(tuple(arc.tolist()), frame), sections=("free", "free"),
        path=(Waypoint(natural=1.0, name="release"),),
    )  # fmt: skip
    yield from thin.judged(result)
    expected = section_energy(poisson, width, thickness, curvature)
    yield near("elastic energy against Lamb's section (relative)", result.energy["elastic"] / expected, 1.0, 3e-3)
    step = 1e-4 * curvature
    more, less = (section_energy(poisson, width, thickness, curvature + x) for x in (step, -step))
    slope = (more - less) / (2.0 * step)
    # the couple in the mean along the arc: a force of the end's, which keeps the chord, adds to it
    end = result.clamps["end"]
    couple = end["moment"] + np.cross(arc - thin.centre(result.surface), end["force"])
    yield near("couple, in the mean along the strip, over dE / dK", abs(float(couple[0])) / slope, 1.0, 3e-3)


def section_energy(poisson: float, width: float, thickness: float, curvature: float) -> float:
    r"""Elastic energy (D w / l) of a strip bent to the radius R = 1/K with free long edges (H. Lamb, Phil. Mag. 31
    (1891), 182): its section's height z(v) minimises, per length and with D = h^2 E / (12 (1 - nu^2)) = 1,

        int 1/2 [K^2 + z''^2 + 2 nu K z''] + 6 (1 - nu^2) / h^2 (K z)^2 dv ,

    discretised by Hermite cubics on 400 elements (E h = 12 (1 - nu^2) D / h^2; the membrane strain along is -K z).
    """
    n = 400
    a = width / n
    stiff = np.array([[12, 6 * a, -12, 6 * a], [6 * a, 4 * a * a, -6 * a, 2 * a * a],
                      [-12, -6 * a, 12, -6 * a], [6 * a, 2 * a * a, -6 * a, 4 * a * a]]) / a**3  # fmt: skip
    mass = np.array([[156, 22 * a, 54, -13 * a], [22 * a, 4 * a * a, 13 * a, -3 * a * a],
                     [54, 13 * a, 156, -22 * a], [-13 * a, -3 * a * a, -22 * a, 4 * a * a]]) * a / 420.0  # fmt: skip
    spring = 12.0 * (1.0 - poisson**2) / thickness**2 * curvature**2
    matrix, load = np.zeros((2 * n + 2, 2 * n + 2)), np.zeros(2 * n + 2)
    for i in range(n):
        at = slice(2 * i, 2 * i + 4)
        matrix[at, at] += stiff + spring * mass
    load[1], load[-1] = poisson * curvature, -poisson * curvature  # -nu K [z'] at both edges
    found = np.linalg.solve(matrix, load)
    return float(0.5 * curvature**2 - 0.5 * load @ found / width)


def _coils(rung: Rung) -> Iterator[Check]:
    turns = int(rung)
    curl = 2.0 * math.pi * turns
    result = solved(
        {"natural_path": "stepped"}, natural_curvature=(curl, curl), elements=(16 + 24 * turns, 1), width=0.03,
        poisson=0.3, grading=(1.0, 1.0),
    )  # fmt: skip
    yield from thin.judged(result)
    s = np.linspace(0.0, 1.0, 201)
    points = result.surface.centreline(s)
    exact = np.stack([0.0 * s, (np.cos(curl * s) - 1.0) / curl, np.sin(curl * s) / curl], axis=1)
    yield Check("distance from the coil (l)", float(np.linalg.norm(points - exact, axis=1).max()), 1e-4)
    yield Check("energy left over that of the flat strip", result.energy["elastic"] / (0.5 * curl**2), 1e-4)


def _snapped(rung: Rung) -> Iterator[Check]:
    """A curl that is pulled back over its clamp: it snaps, and must arrive on an equilibrium of the elastica."""
    result = solved(natural_curvature=(10.0, 10.0), gamma=float(rung), up=(0.0, 0.0, -1.0), elements=(60, 2))
    yield from thin.judged(result)
    yield holds("stable", result.stable is True, f"lowest eigenvalue {result.lowest_eigenvalue}")
    yield from _elastica(result, 2e-4)


def _bridge(first: float) -> tuple[Any, float]:
    """A clamp's path with this first step: its result, and by how much Newton's method still moves the steps that it
    kept (l, directors)."""
    communicator = _communicator()
    from shellref.path.solver import Solver
    from shellref.shell.options import ShellOptions
    from shellref.shell.problem import Pose, ShellProblem, Waypoint
    from shellref.shell.strip import build_strip

    options = ShellOptions(first_step=first, max_step=max(first, 0.25), arc_length="never")
    problem = ShellProblem(
        width=0.05, thickness=5e-4, poisson=0.3, elements=(20, 2), start_curvature=-2.5, clamp_frame=FLAT,
        end=Pose((0.3, 0.1, 0.05), FLAT), path=(Waypoint(natural=1.0, name="release"),),
    )  # fmt: skip
    solver = Solver(build_strip(problem, options), options, communicator, lambda event: None)
    states, observe = [], solver.observe

    def seen(state: np.ndarray) -> dict[str, Any]:
        states.append(state.copy())
        return observe(state)

    solver.observe = seen  # type: ignore[method-assign]
    result = solver.run()
    stages = {stage.name: stage for stage in solver.strip.stages}
    equilibrium, left = solver.equilibrium, 0.0
    for step, state in zip((one for one in result.steps if one.accepted), states, strict=True):
        again = equilibrium.solve(state, None, stages[step.stage], step.load)
        left = max(left, equilibrium.largest(again.state - state) if again.converged else math.inf)
    return result, left


def _fast(rung: Rung) -> Iterator[Check]:
    """Steps on the way end as soon as quadratic convergence leaves less than 1e-6: held by going on from them."""
    (slow, _), (fast, left) = _bridge(0.05), _bridge(float(rung))
    yield from thin.judged(fast)
    off = float(np.abs(fast.surface.points - slow.surface.points).max())
    yield Check("distance from the state of short steps (l)", off, 1e-7)
    yield Check("kept steps from their equilibria (l, directors)", left, 1e-6)


def _coarse(rung: Rung) -> Iterator[Check]:
    across = int(rung)
    result = solved(poisson=0.3, elements=(40, across), **HANGING)
    yield from thin.judged(result)
    fine = solved(poisson=0.3, elements=(40, 8), **HANGING)
    off = float(np.linalg.norm(result.surface.centreline(np.array(1.0)) - fine.surface.centreline(np.array(1.0))))
    yield Check("end from that of 8 elements across (l)", off, 0.02 if across == 1 else 5e-3)


def _work(rung: Rung) -> Iterator[Check]:
    """Along a path of equilibria dE/dGamma is the height of the centre of weight."""
    gamma, change = float(rung), 0.01 * float(rung)
    keys = {**HANGING, "poisson": 0.3}
    below, at, above = (solved(**{**keys, "gamma": gamma + x}) for x in (-change, 0.0, change))
    slope = (above.energy["total"] - below.energy["total"]) / (2.0 * change)
    height = float(thin.centre(at.surface) @ np.asarray(at.problem.up))
    yield from thin.judged(at)
    yield near("dE / dGamma against the height of the centre (l)", slope, height, 2e-5)


def _walls(rung: Rung) -> Iterator[Check]:
    """A strip held above a table, which pushes what the weight lays on it: judged from the shape alone."""
    from shellref.contact.walls import Wall

    table, gamma = Wall((0.0, -0.05, 0.0), (0.0, 1.0, 0.0)), float(rung)
    result = solved(gamma=gamma, up=(0.0, 1.0, 0.0), poisson=0.3, walls=(table,), elements=(24, 2))
    (wall,) = result.walls
    yield from complementary(result)
    points, surface = wall["points"], result.surface
    pushed = float(wall["force"][1]) + float(result.clamps["start"]["force"][1])
    yield near("table and clamp over the weight", pushed / gamma, 1.0, 1e-8)
    clamp = result.clamps["start"]
    centre = thin.centre(surface)
    moment = clamp["moment"] + wall["moment"] + np.cross(centre, [0.0, -gamma, 0.0])
    yield Check("moments left over (of the weight's)", float(np.abs(moment).max()) / gamma, 1e-6)
    yield holds("stable, and lies on the table", result.stable is True and len(points) > 0, result.message)


def _plates(rung: Rung) -> Iterator[Check]:
    """A ring between plates, nu = 0: both push alike, and by virtual work as its energy falls with their gap."""
    from shellref.contact.walls import Wall

    upright = ((-1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0))

    def ring(gap: float) -> Any:
        walls = tuple(Wall((0.0, side * 0.5 * gap, 0.0), (0.0, -side, 0.0)) for side in (-1.0, 1.0))
        return solved(
            clamp_frame=upright, half_turns=0, start_curvature=-2.0 * math.pi, elements=(80, 2), grading=(1.0, 1.0),
            walls=walls,
        )  # fmt: skip

    gap, change = float(rung), 2e-4
    below, at, above = (ring(gap + x) for x in (-change, 0.0, change))
    yield from complementary(at)
    lower, upper = (float(wall["force"][1]) for wall in at.walls)
    yield near("lower plate over the upper one", -lower / upper, 1.0, 1e-6)
    slope = (above.energy["total"] - below.energy["total"]) / (2.0 * change)
    yield near("dE / dH over minus the force", slope / upper, 1.0, 5e-3)


def complementary(result: Any) -> Iterator[Check]:
    """Gaps and pushes of a shell's nodes, from its surface and the walls."""
    through = product = pull = 0.0
    for wall, found in zip(result.problem.walls, result.walls, strict=True):
        normal, place = np.asarray(wall.normal), np.asarray(wall.point)
        through = max(through, -float(np.min((result.surface.points - place) @ normal)))
        if len(found["points"]):
            product = max(product, float(np.abs((found["points"] - place) @ normal).max()))
            pull = max(pull, -float(found["pressure"].min()) / float(found["pressure"].max()))
    yield Check("nodes behind a wall (l)", through, 1e-9)
    yield Check("gap where a wall pushes (l)", product, 1e-9)
    yield Check("pull over the largest push", pull, 1e-9)


CASES = (
    Case(
        "shell/thin", "the membrane is (w / h)^2 times stiffer than the bending",
        "in the plane and with nu = 0 the elastica, whatever h; forces and moments in balance to eps 12 (l / h)^2",
        "h / w", _thin, (1e-4,), (1e-2, 1e-3, 1e-5),
    ),
    Case(
        "shell/Poisson", "nu from -0.99 to 0.5, the ends of what plane stress allows",
        "in balance; the bending energy is that of the surface", "nu", _poisson, (0.5,), (-0.5, -0.9, -0.99),
    ),
    Case(
        "shell/pure bending", "a strip bent to a cylinder; its long edges curl",
        "Lamb's energy of the section, and its couple", "nu", _bent, (), (0.0, 0.3, 0.5, -0.5, -0.9),
    ),
    Case(
        "shell/coils", "rolled up from flat: the director turns by whole turns", "the circle, and no energy left",
        "turns", _coils, (1,), (2, 4, 10),
    ),
    Case(
        "shell/snap", "a curl pulled back over its clamp snaps on the way", "a stable state that is an elastica's",
        "Gamma", _snapped, (), (20.0, 50.0, 200.0, 1000.0),
    ),
    Case(
        "shell/path too fast", "the first step of a clamp's path is the whole way",
        "steps are cut back; the same state as by short steps, not another branch", "first step", _fast, (),
        (0.2, 0.5, 1.0),
    ),
    Case(
        "shell/coarse across", "one element across", "in balance, near the fine mesh", "elements across", _coarse,
        (), (1, 2, 4),
    ),
    Case(
        "shell/work", "energies along a path", "dE / dGamma is the height of the centre of weight", "Gamma", _work,
        (), (1.0, 20.0, 400.0),
    ),
    Case(
        "shell/table", "contact appears and spreads under a strip that a table stops",
        "no node behind it, no pull, a push only where the gap is zero; table, clamp and weight in balance", "Gamma",
        _walls, (10.0,), (3.0, 30.0, 100.0, 300.0),
    ),
    Case(
        "shell/plates", "a ring pressed flat between two plates", "the same, and dE / dH is the force", "gap (l)",
        _plates, (), (0.3, 0.25, 0.2, 0.15, 0.1),
    ),
)  # fmt: skip
