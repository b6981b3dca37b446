"""A Moebius band on a table, standing on its edge and fallen (thesis, 6.2.1, figure 6.9)."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from compare.models.ribbon.build import ribbon_arguments
from compare.scene.scene import Scene, load
from ribbon import Equilibrium, solve
from ribbon.element import quaternion
from ribbon.find import relax
from ribbon.find.solve import solve_from
from tests.validation import page
from tests.validation.number import Number, rounding

FloatArray = NDArray[np.float64]

SEGMENTS = (100, 200, 400)
SCENES = {"on edge": "moebius_table_edge", "fallen": "moebius_table_fallen"}
#: Angles (rad) by which the standing band is turned about its line of contact, and across it, before it is let go.
TILTS = (0.01, 0.02, 0.05, 0.2)


def placed(scene: Scene, segments: int) -> Equilibrium:
    """The scene's equilibrium on so many equal elements."""
    return solve(**ribbon_arguments(scene.replace({"model.elements": segments})))


def pushes(equilibrium: Equilibrium) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Points (k, 3) of the edges that the table pushes, how hard (k,), and their abscissae (k,)."""
    problem: Any = equilibrium.problem
    push = -equilibrium.rows[problem.block_slices()["wall_0"]].reshape(-1, 2)
    joints = problem.blocks()["wall_0"].joints
    points, frames = equilibrium.joints
    s = np.concatenate([[0.0], np.cumsum(problem.lengths)])
    eta = equilibrium.eta(s)
    ruling = problem.half_width * (frames[:, :, 0] + eta[:, None] * frames[:, :, 2])
    edges = np.stack([points + ruling, points - ruling], axis=1)[joints]
    touching = push > 1e-6
    found_at = [edges[touching], push[touching], np.repeat(s[joints][:, None], 2, axis=1)[touching]]
    if problem.touching:  # between the joints
        at = np.array([touch.s for touch in problem.touching])
        side = problem.half_width * np.array([[touch.side] for touch in problem.touching])
        frames = equilibrium.frame(at)
        between = equilibrium.position(at) + side * (frames[:, :, 0] + equilibrium.eta(at)[:, None] * frames[:, :, 2])
        force = -equilibrium.rows[problem.block_slices()["touch_0"]]
        more = [part[force > 1e-6] for part in (between, force, at)]
        found_at = [np.concatenate(pair) for pair in zip(found_at, more, strict=True)]
    return found_at[0], found_at[1], found_at[2]


def heights(equilibrium: Equilibrium) -> tuple[float, float]:
    """Height of the centre of the weight and of the highest point of the surface above the table."""
    wall = equilibrium.problem.walls[0]  # type: ignore[attr-defined]
    normal = np.asarray(wall.normal)
    middles = (np.arange(4000) + 0.5) / 4000
    centre = float(np.mean((equilibrium.position(middles) - np.asarray(wall.point)) @ normal))
    return centre, float(((equilibrium.surface(400, 4).points - np.asarray(wall.point)) @ normal).max())


def unbalanced(equilibrium: Equilibrium) -> tuple[float, float]:
    """Size of weight plus wall force, and of their moment about the centre of the weight, along the table."""
    gravity = equilibrium.problem.gravity
    assert gravity is not None
    up = np.asarray(gravity.up)
    weight = -equilibrium.problem.strip.gamma * up
    points, push, _ = pushes(equilibrium)
    middles = (np.arange(4000) + 0.5) / 4000
    centre = equilibrium.position(middles).mean(axis=0)
    moment = np.cross(points - centre, push[:, None] * up).sum(axis=0)
    return float(np.linalg.norm(equilibrium.walls[0].force + weight)), float(np.linalg.norm(moment))


def turned(equilibrium: Equilibrium, axis: FloatArray, angle: float) -> Equilibrium:
    """Where the band comes to rest that is lifted off the table, turned by `angle` about `axis`, and let go."""
    problem: Any = equilibrium.problem
    spin = quaternion.from_matrix(Rotation.from_rotvec(angle * axis).as_matrix())
    start = quaternion.compose(spin, equilibrium.x[problem.layout.joint(0).quaternion])
    fresh = problem.with_changes(reference=tuple(start.tolist()))
    s = np.concatenate([[0.0], np.cumsum(problem.lengths)])
    x = relax.placed(fresh, equilibrium.omega(s), equilibrium.eta(s))
    wall = problem.walls[0]
    normal, points = np.asarray(wall.normal), problem.layout.positions(x)
    drop = float(((points - np.asarray(wall.point)) @ normal).min()) - 1.2 * problem.half_width
    points -= drop * normal
    return solve_from(fresh, x)


def contact_line(equilibrium: Equilibrium) -> FloatArray:
    """Unit vector along the ruling at s = l/2."""
    middle = equilibrium.middle
    line = middle.frame[:, 0] + equilibrium.eta([0.5])[0] * middle.frame[:, 2]
    return np.asarray(line / np.linalg.norm(line))


def _energy(equilibrium: Equilibrium) -> float:
    """Total energy with heights counted from the table."""
    wall, gravity = equilibrium.problem.walls[0], equilibrium.problem.gravity  # type: ignore[attr-defined]
    assert gravity is not None
    return equilibrium.energy.total - equilibrium.problem.strip.gamma * float(
        np.asarray(wall.point) @ np.asarray(gravity.up)
    )


def _row(name: str, equilibrium: Equilibrium) -> list[str]:
    centre, top = heights(equilibrium)
    force, moment = unbalanced(equilibrium)
    _, push, s = pushes(equilibrium)
    weight = equilibrium.problem.strip.gamma
    shares = ", ".join(f"{a:.4g} ({b / weight:.2f})" for a, b in zip(s, push, strict=True))
    return [
        name, str(equilibrium.problem.lengths.size), equilibrium.status.code, f"{equilibrium.lowest_eigenvalue:.3f}",
        f"{equilibrium.energy.elastic:.4f}", f"{_energy(equilibrium) - equilibrium.energy.elastic:.4f}",
        f"{_energy(equilibrium):.4f}",
        f"{centre:.4f}", f"{top:.4f}", f"{_lift(equilibrium):.10f}", f"{force:.0e}", f"{moment:.0e}", shares,
    ]  # fmt: skip


def _let_go(edge: Equilibrium, fallen: Equilibrium) -> list[str]:
    """For one number of elements: where the standing band ends from every tilt."""
    line = contact_line(edge)
    gravity = edge.problem.gravity
    assert gravity is not None
    across = np.cross(np.asarray(gravity.up), line)
    cells = [str(edge.problem.lengths.size)]
    for tilt in TILTS:
        words = []
        for axis in (line, across):
            for sign in (1.0, -1.0):
                e = turned(edge, axis, sign * tilt)
                if not e.ok:
                    words.append(e.status.code)
                elif abs(_energy(e) - _energy(edge)) < 1e-2:
                    words.append("stands")
                elif abs(_energy(e) - _energy(fallen)) < 1e-2:
                    words.append("falls")
                else:
                    words.append(f"{_energy(e):.3f}")
        cells.append(words[0] if len(set(words)) == 1 else ", ".join(words))
    return cells


@cache
def coarse(name: str) -> Equilibrium:
    """The band on the coarsest elements."""
    return placed(load(SCENES[name]), SEGMENTS[0])


def _lift(equilibrium: Equilibrium) -> float:
    """Force of the table against the weight."""
    gravity = equilibrium.problem.gravity
    assert gravity is not None
    return float(equilibrium.walls[0].force @ np.asarray(gravity.up))


PROBES = {
    "total_fallen_100": lambda: _energy(coarse("fallen")),
    "lift": lambda: _lift(coarse("fallen")),
}


def _numbers(found: dict[str, dict[int, Equilibrium]]) -> dict[str, Number]:
    """Energies by state and elements, the finest with their change from half as many; what balances."""
    numbers, states = {}, [e for solved in found.values() for e in solved.values()]
    for name, solved in found.items():
        word = name.split()[-1]
        for p, e in solved.items():
            numbers[f"total_{word}_{p}"] = Number(_energy(e), 1e-8 * _energy(e), "D w / l", ".4f")
        change = abs(_energy(solved[SEGMENTS[-1]]) - _energy(solved[SEGMENTS[-2]]))
        numbers[f"total_{word}"] = Number(_energy(solved[SEGMENTS[-1]]), change, "D w / l", ".4f")
        lowest, before = (solved[p].lowest_eigenvalue for p in (SEGMENTS[-1], SEGMENTS[-2]))
        numbers[f"eigenvalue_{word}"] = Number(lowest, max(abs(lowest - before), 1e-4), "D w / l", ".3f")
    lifts = [_lift(e) for e in states]
    return numbers | {
        "lift": Number(lifts[0], 1e-8, "D w / l^2", ".10f"),
        "lift_off": rounding(max(abs(lift - e.problem.strip.gamma) for lift, e in zip(lifts, states, strict=True))),
        "moment": rounding(max(unbalanced(e)[1] for e in states)),
    }


def run(out: Path) -> dict[str, Number]:
    scenes = {name: load(file) for name, file in SCENES.items()}
    found = {name: {p: placed(scene, p) for p in SEGMENTS} for name, scene in scenes.items()}
    rows = [_row(name, e) for name, solved in found.items() for e in solved.values()]
    for solved in found.values():
        for e in solved.values():
            if not e.ok or max(unbalanced(e)) > 1e-6:
                raise AssertionError(e.message)
    tilts = [_let_go(found["on edge"][p], found["fallen"][p]) for p in (100, 200)]
    edge = found["on edge"][SEGMENTS[-1]]
    omega, eta = abs(edge.omega([0.5])[0]), edge.eta([0.5])[0]
    radius = 1.0 / (omega * (1.0 + eta**2))
    centre = heights(edge)[0]
    half = 0.5 * scenes["on edge"].width * float(np.sqrt(1.0 + eta**2))
    facets = [omega * float(np.sqrt(1.0 + eta**2)) / p for p in SEGMENTS]
    feet = [str(pushes(e)[1].size) for e in found["on edge"].values()]
    _picture(out / "moebius_table.png", {name: solved[100] for name, solved in found.items()})
    heads = [
        "state", "p", "status", "lowest eigenvalue", "elastic", "weight", "total", "centre / l", "top / l",
        "force of the table", "force left", "moment left", "contacts: s / l (share of the weight)",
    ]  # fmt: skip
    page.write(
        out / "moebius_table.md", "A Moebius band on a table (thesis, 6.2.1)",
        "python -m tests.validation moebius_table",
        "w / l = 0.01, nu = 0.5, Gamma = 10, straight ruling at the seam, no clamp: the table and the weight alone "
        "hold the band (scenes moebius_table_edge and moebius_table_fallen). Energies in D w / l, "
        "heights from the table. "
        "The force of the table is the sum of the multipliers (Gamma = 10 is the weight); left: force and moment about "
        "the centre of the weight that do not cancel. A joint's edge is in contact when its multiplier exceeds 1e-6.",
        page.table(heads, rows),
        "## On edge: a minimum or a saddle?\n\n"
        "On these elements it is a minimum: the lowest eigenvalue on what the contacts leave free is positive. "
        f"Both edges touch at s = l/2 ({', '.join(feet)} points on {', '.join(str(p) for p in SEGMENTS)} elements), at "
        "joints or between them: a line of contact, over which the band might roll. A rigid band would not: there it "
        f"rolls on a cylinder of radius 1 / (omega (1 + eta^2)) = {radius:.3f} l, more than the height {centre:.3f} l "
        "of its "
        "centre, and a body that rolls is stable then. Across, it stands on a ruling of half the length "
        f"{half:.4f} l and would tip over at {np.arctan(half / centre):.3f} rad. The elastic band was tried: turned by "
        "an angle about its line of contact (both ways) and across it (both ways), lifted and let go. "
        "The minimiser takes "
        "steps of its own, without friction or inertia, and may leave a basin that it started in, so that 'falls' says "
        f"less than 'stands'. One facet turns by {facets[0]:.3f} rad on {SEGMENTS[0]} elements, by {facets[1]:.3f} on "
        f"{SEGMENTS[1]}; the basin does not shrink with it, which speaks for a minimum of the smooth band as well, a "
        "shallow one. The fallen state has the lower energy by "
        f"{_energy(edge) - _energy(found['fallen'][SEGMENTS[-1]]):.3f}; on 50 elements the scene's own start falls.",
        page.table(["p", *(f"{t:g} rad" for t in TILTS)], tilts),
        "![on a table](moebius_table.png)\n\nBlue: the band, red: its centreline at the event, green: contacts.",
    )  # fmt: skip
    return _numbers(found)


def _picture(path: Path, states: dict[str, Equilibrium]) -> None:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure = plt.figure(figsize=(12, 5.6), constrained_layout=True)
    for place, (name, found) in enumerate(states.items(), start=1):
        wall = found.problem.walls[0]  # type: ignore[attr-defined]
        up = np.asarray(wall.normal)
        first = found.middle.frame[:, 2] - (found.middle.frame[:, 2] @ up) * up
        first /= np.linalg.norm(first)
        axes = np.array([first, np.cross(up, first), up])
        origin = found.position(np.linspace(0.0, 1.0, 501)).mean(axis=0)
        origin = origin - ((origin - np.asarray(wall.point)) @ up) * up
        grid = (found.surface(400, 4).grid - origin) @ axes.T
        event = (found.position(np.linspace(0.0, 0.02, 20)) - origin) @ axes.T
        points = (pushes(found)[0] - origin) @ axes.T
        axis: Any = figure.add_subplot(1, 2, place, projection="3d", computed_zorder=False)
        side = 0.22
        x, y = np.meshgrid([-side, side], [-side, side])
        axis.plot_surface(x, y, np.zeros_like(x), color="0.7", alpha=0.35)
        axis.plot_surface(*np.moveaxis(grid, 2, 0), color="#5b8fc7", rstride=4, cstride=4, lw=0, antialiased=True)
        for edge in (grid[:, 0], grid[:, -1]):
            axis.plot(*edge.T, color="#1f3f68", lw=0.8)
        axis.plot(*event.T, color="tab:red", lw=2.5)
        axis.scatter(*points.T, color="tab:green", s=40, depthshade=False)
        axis.set_xlim(-side, side)
        axis.set_ylim(-side, side)
        axis.set_zlim(0.0, side)
        axis.set_box_aspect((2, 2, 1))
        axis.view_init(elev=22, azim=-55)
        axis.set_xticks((-0.2, 0.0, 0.2))
        axis.set_yticks((-0.2, 0.0, 0.2))
        axis.set_zticks((0.0, 0.1, 0.2))
        axis.set_xlabel("x / l")
        axis.set_ylabel("y / l")
        axis.set_zlabel("up / l")
        axis.set_title(f"{name}, energy {_energy(found):.2f} D w / l", fontsize=10)
    figure.savefig(path, dpi=110)
    plt.close(figure)
