"""The Moebius band on its table from standing to fallen, through the saddle between them (thesis, 6.2.1, figure 6.9).

Standing, the band touches the table along a ruling about which the whole is its own image under half a turn; it is lost
where one eigenvalue of that symmetric branch passes zero. The branch that leaves there is the saddle: the band balances
on one place of an edge. Followed with places of contact that slide (`ribbon.find.branch.walls`).

Independent: as Gamma -> 0 the band is rigid, and E = E_0 + Gamma H with the height H of its centre of mass, stationary
over all directions u of the table: H(u) = max_p <p - c, u> over its edges. On one point p of an edge that is
``(p - c) . p' = 0``, H = |p - c| (a saddle), on a ruling or three points the distance from a plane.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize_scalar
from scipy.spatial import ConvexHull

from compare.continuation.correct import first_point
from compare.continuation.follow import follow, switched
from compare.continuation.locate import modes_at
from compare.continuation.point import Options, Point, Run
from compare.measure.mesh_limit import Settled, settled
from compare.models.branches.ribbon import equations, equilibrium
from compare.scene.scene import load
from compare.studies.branches.along import Along
from ribbon import Equilibrium, Strip, solve
from ribbon.boundary import Closure
from ribbon.find.branch.equations import Equations
from ribbon.find.solve import solve_from
from tests.validation import page
from tests.validation.number import Number
from tests.validation.ribbon.moebius_table import SCENES, placed

FloatArray = NDArray[np.float64]

#: Odd numbers of segments: the ruling that stands on the table lies inside of one.
SEGMENTS = (51, 101, 201)
#: Weights: of the scene, the least (nearly rigid), the most of the standing and of the fallen branch.
GAMMA, LIGHT, MOST, FAR = 10.0, 0.1, 600.0, 1500.0
#: Length in the metric of shapes by which the saddle is pushed along its mode.
PUSHED = 0.02
OPTIONS = Options(steps=400)


@dataclass(frozen=True)
class Followed:
    """What a branch says of one state: weights (k,) and energies (k,), heights counted from the table, of its points,
    the points, what is special, and the scenes along it."""

    along: Along
    run: Run
    gamma: FloatArray
    energy: FloatArray

    def at(self, gamma: float) -> Point:
        """The point of this weight, which is an end or a landing."""
        k = int(np.argmin(np.abs(self.gamma - gamma)))
        assert abs(self.gamma[k] - gamma) < 1e-8, (gamma, self.gamma[k])
        return self.run.points[k]


def _height(name: str) -> float:
    """Height of the table of a scene along up."""
    scene = load(SCENES[name])
    assert scene.gravity is not None
    return float(np.asarray(scene.walls[0].point) @ np.asarray(scene.gravity.up))


def _followed(along: Along, run: Run, name: str) -> Followed:
    gamma = np.array([along.value(point.t) for point in run.points])
    energy = np.array([point.system.energy(point.z, point.t) for point in run.points])
    return Followed(along, run, gamma, energy - gamma * _height(name))


@cache
def _begun(name: str, segments: int, least: float, most: float) -> tuple[Along, Point]:
    """The branch of a scene's state at GAMMA over weights between two others: a point of it."""
    scene = load(SCENES[name]).replace({"model.elements": segments})
    along = Along.of(scene, "strip.gamma", least, most)
    t = (GAMMA - least) / (most - least)
    found = placed(load(SCENES[name]), segments)
    system, z = equations(along.scene_at, t, found)
    point = first_point(system, z, t, OPTIONS.tolerance)
    assert point is not None
    return along, point


@cache
def standing(segments: int) -> Followed:
    """The standing band, from the scene's weight up."""
    along, point = _begun("on edge", segments, LIGHT, MOST)
    return _followed(along, follow(point, (0.0, 1.0), OPTIONS), "on edge")


@cache
def fallen(segments: int) -> Followed:
    """The fallen band, from the scene's weight up."""
    along, point = _begun("fallen", segments, LIGHT, FAR)
    return _followed(along, follow(point, (0.0, 1.0), OPTIONS), "fallen")


def pitchfork(segments: int) -> Any:
    """Where the standing band is lost."""
    (one,) = [special for special in standing(segments).run.specials if special.kind == "branch_point"]
    return one


@cache
def saddle(segments: int) -> Followed:
    """The branch that leaves there, down to LIGHT; its mirror image under the half turn leaves the other way."""
    first = switched(pitchfork(segments), OPTIONS)[0]
    along = standing(segments).along
    run = follow(first, (0.0, 1.0), OPTIONS)
    assert run.ended == "range"
    assert abs(along.value(run.points[-1].t) - LIGHT) < 1e-9
    return _followed(along, run, "on edge")


def at_weight(branch: Followed, gamma: float = GAMMA) -> Point:
    """The point of a branch at a weight inside it, between its neighbours; the last that passes it."""
    g = branch.gamma - gamma
    if abs(g[0]) < 1e-9:
        return branch.run.points[0]
    k = int(np.flatnonzero(g[:-1] * g[1:] <= 0.0)[-1])
    one, other = branch.run.points[k], branch.run.points[k + 1]
    t = (gamma - branch.along.first) / (branch.along.last - branch.along.first)
    near = one if one.z.shape == other.z.shape and abs(one.t - t) < abs(other.t - t) else other
    found = first_point(near.system, near.z, t, OPTIONS.tolerance)
    assert found is not None
    return found


def energy(point: Point, name: str, along: Along) -> float:
    """Total energy, heights from the table."""
    return float(point.system.energy(point.z, point.t)) - along.value(point.t) * _height(name)


def pushed(point: Point, sign: float) -> Equilibrium:
    """Where the saddle comes to rest that is pushed along its unstable mode."""
    values, modes = modes_at(point, 1)
    assert values[0] < 0.0
    z = point.z + sign * PUSHED * modes[:, 0]
    system = point.system
    assert isinstance(system, Equations)
    x, _ = system.whole(z, point.t)
    return solve_from(system.problem(point.t).with_changes(touching=()), x)


def places(point: Point) -> list[tuple[float, float, float]]:
    """s (l), side and share of the weight of the places of contact."""
    system = point.system
    assert isinstance(system, Equations)
    problem = system.problem(point.t)
    x, rows = system.whole(point.z, point.t)
    block, push = problem.touch_rows(0), -rows[problem.block_slices()["touch_0"]]
    s = np.concatenate([[0.0], np.cumsum(problem.lengths)])[block.segments] + block.places(x)
    on = np.flatnonzero(push > 0.0)
    return [(float(s[k]), float(block.sides[k]), float(push[k] / push.sum())) for k in on]


# -- the rigid band ---------------------------------------------------------------------------------------------------


@cache
def weightless(segments: int) -> Equilibrium:
    """The band without weight and table."""
    strip = load(SCENES["on edge"]).strip
    return solve(Strip(strip.length, strip.width, strip.poisson), closure=Closure("moebius", "straight"),
                 segments=segments)  # fmt: skip


def _edge(band: Equilibrium, s: FloatArray, side: float) -> FloatArray:
    """Points (k, 3) of an edge."""
    frames, half = band.frame(s), 0.5 * load(SCENES["on edge"]).width
    return band.position(s) + side * half * (frames[:, :, 0] + band.eta(s)[:, None] * frames[:, :, 2])


@cache
def rigid(segments: int) -> dict[str, float]:
    """Heights H of the centre of mass of the rigid weightless band: on edge, fallen, balanced on an edge."""
    band = weightless(segments)
    middles = (np.arange(20000) + 0.5) / 20000
    centre = band.position(middles).mean(axis=0)
    s = np.linspace(0.0, 1.0, 6001)
    points = np.concatenate([_edge(band, s, side) for side in (1.0, -1.0)])
    middle = np.array([0.5])
    normal = band.frame(middle)[0][:, 1]
    on_edge = abs(float((_edge(band, middle, 1.0)[0] - centre) @ normal))
    hull = ConvexHull(points)
    normals, off = hull.equations[:, :3], hull.equations[:, 3]
    heights = -(normals @ centre + off)
    feet = centre + heights[:, None] * normals
    inside = [k for k, simplex in enumerate(hull.simplices) if np.all(_barycentric(points[simplex], feet[k]) >= 0.0)]
    low, high = 0.40, 0.4999
    best = []
    for side in (1.0, -1.0):

        def far(place: float, side: float = side) -> float:
            return float(np.linalg.norm(_edge(band, np.array([place]), side)[0] - centre))

        for sign in (1.0, -1.0):
            found = minimize_scalar(lambda v, f=far, g=sign: g * f(v), bounds=(low, high), method="bounded",
                                    options={"xatol": 1e-10})  # fmt: skip
            if low + 1e-3 < found.x < high - 1e-3 and _supports(points, centre, _edge(band, np.array([found.x]), side)):
                best.append(far(found.x))
    (balanced,) = best
    return {"on edge": on_edge, "fallen": float(min(heights[inside])), "balanced": balanced}


def _supports(points: FloatArray, centre: FloatArray, point: FloatArray) -> bool:
    """Whether the plane across p - c leaves all points on one side."""
    arm = point[0] - centre
    return bool(((points - point[0]) @ arm).max() <= 1e-6)


def _barycentric(triangle: FloatArray, foot: FloatArray) -> FloatArray:
    one, other, by = triangle[1] - triangle[0], triangle[2] - triangle[0], foot - triangle[0]
    matrix = np.column_stack([one, other])
    found = np.linalg.lstsq(matrix, by, rcond=None)[0]
    return np.array([1.0 - found.sum(), *found])


def light(segments: int, name: str) -> float:
    """(E(LIGHT) - E_0) / LIGHT of a branch: the height of a band that is nearly rigid."""
    if name == "balanced":
        point, along, scene = saddle(segments).run.points[-1], saddle(segments).along, "on edge"
    else:
        along, begun = _begun(name, segments, LIGHT, MOST if name == "on edge" else FAR)
        run = follow(begun.turned(), (0.0, 1.0), OPTIONS)
        assert run.ended == "range"
        point, scene = run.points[-1], name
    return (energy(point, scene, along) - weightless(segments).energy.elastic) / LIGHT


# -- the page ---------------------------------------------------------------------------------------------------------


@cache
def three(segments: int) -> dict[str, tuple[Point, float]]:
    """The states at the scene's weight, and their energies."""
    stands, on_saddle = at_weight(standing(segments)), at_weight(saddle(segments))
    along, lies = _begun("fallen", segments, LIGHT, FAR)
    return {
        "on edge": (stands, energy(stands, "on edge", standing(segments).along)),
        "saddle": (on_saddle, energy(on_saddle, "on edge", saddle(segments).along)),
        "fallen": (lies, energy(lies, "fallen", along)),
    }


def _lost(segments: int) -> float:
    """Gamma at which the standing band is lost."""
    return standing(segments).along.value(pitchfork(segments).point.t)


def _lets_go(segments: int) -> float:
    """Gamma at which the rolling band lets go of one of its two edges."""
    branch = saddle(segments)
    return next(branch.along.value(s.point.t) for s in branch.run.specials if s.what.endswith("lets go"))


def _most(segments: int) -> float:
    """The largest Gamma of the branch that leaves."""
    branch = saddle(segments)
    return max(branch.along.value(s.point.t) for s in branch.run.specials)


def barriers(segments: int) -> tuple[float, float]:
    """Energy of the saddle above the standing and above the fallen state."""
    found = three(segments)
    return found["saddle"][1] - found["on edge"][1], found["saddle"][1] - found["fallen"][1]


PROBES = {"lost_51": lambda: _lost(SEGMENTS[0]), "barrier_51": lambda: barriers(SEGMENTS[0])[0]}


def _number(found: Settled, unit: str, shown: str) -> Number:
    assert found.settles, found
    return Number(found.value, found.error, unit, shown)


def run(out: Path) -> dict[str, Number]:
    rows, gone, events = [], [], []
    for p in SEGMENTS:
        for name, (point, total) in three(p).items():
            where = ", ".join(f"{s:.4f} ({share:.2f})" for s, _, share in places(point))
            rows.append([str(p), name, str(point.unstable), f"{total:.6f}", where])
        on_way = [s for s in saddle(p).run.specials if s.kind == "event"]
        events.append([str(p), f"{_lost(p):.3f}", f"{_most(p):.3f}", f"{_lets_go(p):.3f}",
                       str(sum("slides" in s.what for s in on_way))])  # fmt: skip
        print(f"  moebius_saddle: {p} segments", flush=True)
    barrier = settled([barriers(p)[0] for p in SEGMENTS])
    fall = settled([barriers(p)[1] for p in SEGMENTS])
    lost = settled([_lost(p) for p in SEGMENTS])
    goes = settled([_lets_go(p) for p in SEGMENTS])
    heights = {name: (rigid(SEGMENTS[-1])[name], light(SEGMENTS[-1], name)) for name in rigid(SEGMENTS[-1])}
    apart = max(abs(one - other) for one, other in heights.values())
    point, _ = three(SEGMENTS[-1])["saddle"]
    for sign in (1.0, -1.0):
        end = pushed(point, sign)
        gone.append(min(three(SEGMENTS[-1]), key=lambda n: abs(three(SEGMENTS[-1])[n][1] - end.energy.total
                                                               + GAMMA * _height("on edge"))))  # fmt: skip
    far = fallen(SEGMENTS[0])
    unstable = [p.unstable for _, (p, _) in three(SEGMENTS[-1]).items()]
    if unstable != [0, 1, 0] or apart > 2e-5 or sorted(gone) != ["fallen", "on edge"]:
        raise AssertionError(f"unstable modes {unstable}, heights {heights}, pushed {gone}")
    if far.run.ended != "range" or any(p.unstable for p in far.run.points):
        raise AssertionError(f"the fallen branch: {far.run.ended}")
    _picture(out / "moebius_saddle.png", SEGMENTS[0])
    unsettled = f"not settled, {goes.value:.2f} on the finest" if not goes.settles else f"{goes.value:.2f}"
    page.write(
        out / "moebius_saddle.md", "A Moebius band on a table: from standing to fallen through its saddle",
        "python -m tests.validation moebius_saddle",
        "w / l = 0.01, nu = 0.5 (scenes moebius_table_edge and moebius_table_fallen). Places of contact slide along "
        "the edges from segment to segment (`ribbon.find.branch.walls`); Gamma = 10 is the scenes' weight. Odd numbers "
        "of segments, so that the ruling on which the band stands is inside one. Energies in D w / l.",
        page.table(["p", "state", "unstable modes", "energy", "contacts: s / l (share of the weight)"], rows),
        f"The saddle lies {barrier.value:.3e} +- {barrier.error:.0e} above the standing state and {fall.value:.4f} +- "
        f"{fall.error:.0e} above the fallen one (three meshes): it balances on one place of one edge, "
        "0.007 l from the ruling on which the band stands; the half turn gives its mirror image on the other edge. "
        f"The standing band is a minimum, and all but none: a barrier of {barrier.value:.1e} is "
        f"{barrier.value / GAMMA:.1e} l of height. Pushed along its unstable mode both ways ({SEGMENTS[-1]} segments) "
        f"the saddle ends {' and '.join(gone)}; the minimiser, whose steps are longer than such a barrier is wide, "
        "leaves it on coarser ones to fall both ways.",
        "## Over the weight",
        "The standing band, its own image under half a turn about the vertical, is lost in a pitchfork; the branch "
        "that leaves rolls on both edges, from facet to facet (each has a fold of its own: waves of the elements), "
        "lets go of one edge, turns back and is the saddle, down to no weight at all.",
        page.table(["p", "lost at Gamma", "largest Gamma of the branch", "one edge lets go", "slides over joints"],
                   events),
        f"Lost at Gamma = {lost.value:.2f} +- {lost.error:.1g} (order {lost.order:.2f}: facets); where one edge lets "
        f"go is {unsettled}, and the rolling stretch is between them. The fallen band is stable to Gamma = {FAR:g}, "
        "without a fold: the two minima are connected over the saddle, and over no fold of the weight.",
        "![Energies over the weight](moebius_saddle.png)",
        f"## Rigid, by its edges alone\n\nAs Gamma falls the band is rigid; (E - E_0) / Gamma at Gamma = {LIGHT:g} "
        "against the centre's height over the weightless band's edges: the plane under a ruling, a facet of the convex "
        "hull, a place of an edge at a stationary distance.",
        page.table(["state", "by the edges / l", "by the branch / l", "apart"],
                   [[n, f"{a:.7f}", f"{b:.7f}", f"{a - b:.1e}"] for n, (a, b) in heights.items()]),
    )  # fmt: skip
    return {
        "barrier": _number(barrier, "D w / l", ".3e"),
        "fall": _number(fall, "D w / l", ".4f"),
        "lost": _number(lost, "", ".1f"),
        "lost_51": Number(_lost(SEGMENTS[0]), 1e-5, "", ".4f"),
        "barrier_51": Number(barriers(SEGMENTS[0])[0], 1e-9, "D w / l", ".4e"),
        "lets_go": Number(goes.value, goes.error if goes.settles else max(abs(goes.value - _lets_go(p))
                          for p in SEGMENTS), "", ".1f"),
        "rigid_apart": Number(apart, 1e-6, "l", ".0e"),
    }  # fmt: skip


def _picture(path: Path, segments: int) -> None:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure = plt.figure(figsize=(12, 4.8), constrained_layout=True)
    axis = figure.add_subplot(1, 2, 1)
    stands, leaves, lies = standing(segments), saddle(segments), fallen(segments)
    base = CubicSpline(stands.gamma, stands.energy)
    upto = leaves.gamma >= GAMMA
    inside = lies.gamma <= MOST
    lost = _lost(segments)
    stable = stands.gamma <= lost
    axis.plot(stands.gamma[stable], 0.0 * stands.gamma[stable], "C0-", label="on edge")
    axis.plot(stands.gamma[~stable], 0.0 * stands.gamma[~stable], "C0--")
    axis.plot(leaves.gamma[upto], 1e3 * (leaves.energy - base(leaves.gamma))[upto], "C1--", label="saddle, x 1000")
    axis.plot(lies.gamma[inside], (lies.energy - base(lies.gamma))[inside], "C2-", label="fallen")
    axis.plot([lost], [0.0], "ko", ms=4)
    axis.set_xlabel("Gamma")
    axis.set_ylabel("energy above the standing band, D w / l")
    axis.legend()
    point, _ = three(segments)["saddle"]
    system = point.system
    assert isinstance(system, Equations)
    band = equilibrium(system, point.z, point.t)
    other: Any = figure.add_subplot(1, 2, 2, projection="3d", computed_zorder=False)
    grid = band.surface(400, 4).grid[:, :, [1, 2, 0]] - np.array([0.0, 0.0, _height("on edge")])
    other.plot_surface(*np.moveaxis(grid, 2, 0), color="#5b8fc7", rstride=4, cstride=4, lw=0)
    for edge in (grid[:, 0], grid[:, -1]):
        other.plot(*edge.T, color="#1f3f68", lw=0.8)
    ((s, side, _),) = places(point)
    at = _edge(band, np.array([s]), side)[0][[1, 2, 0]] - np.array([0.0, 0.0, _height("on edge")])
    other.scatter(*at, color="tab:green", s=40)
    other.set_box_aspect((1, 1, 1))
    middle = grid.reshape(-1, 3).mean(axis=0)
    for k, setter in enumerate((other.set_xlim, other.set_ylim)):
        setter(middle[k] - 0.11, middle[k] + 0.11)
    other.set_zlim(0.0, 0.22)
    for setter in (other.set_xticks, other.set_yticks):
        setter((-0.1, 0.0, 0.1))
    other.set_title("the saddle, balanced on a place of its edge", fontsize=10)
    figure.savefig(path, dpi=110)
    plt.close(figure)
