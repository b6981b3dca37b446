"""Sadowsky's strip through a state without force: there it lies on a sphere (E. L. Starostin & G. H. M. van der Heijden
2018, doi:10.1103/PhysRevE.97.023001), which the solver knows nothing of.

A strip whose end is free to move and held turned has no force; clamped there, and that clamp moved to and fro on a
straight line, it is a branch along which the end's force passes zero. The distance of its centreline from the sphere
that fits it best is in proportion to the force, and at none what the elements leave.

Independent of the fit: the radius is |M| / (2 E), M the moment and E the energy (D w, D w / l), for the density
``kappa^2 (1 + eta^2)^2 / 2`` is the same all along (Hamilton's function without a force), and M too.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from compare.continuation.correct import first_point
from compare.continuation.follow import follow
from compare.continuation.point import Options, Run
from compare.measure.mesh_limit import settled
from compare.models.branches.ribbon import equilibrium
from ribbon import Clamp, Equilibrium, Strip, solve
from ribbon.find.branch.equations import Equations
from ribbon.find.solve import build
from ribbon.find.solving.request import How
from ribbon.find.solving.search import from_shape
from ribbon.problems.mixed import MixedProblem
from tests.validation import page
from tests.validation.number import Number

FloatArray = NDArray[np.float64]

#: Segments; of the strip whose place without force is the middle of the line; half the length of the line, l.
SEGMENTS, FINE, HALF = (20, 40, 80), 320, 0.02
#: Turn of the end clamp (degrees about z, y, x), width and Poisson's ratio, which change nothing.
TURNED = (0.7, -2.0, 0.4)
STRIP = Strip(1.0, 0.02, 0.3)
START = Clamp((0.0, 0.0, 0.0), tangent=(1.0, 0.0, 0.0), normal=(0.0, 0.0, 1.0), ruling="free")
OPTIONS = Options(step=0.01, most=0.05, steps=60)


def _end(place: FloatArray | None) -> Clamp:
    frame = Rotation.from_euler("zyx", TURNED).as_matrix()
    return Clamp(place, tangent=frame[:, 0], normal=frame[:, 2], ruling="free")


@cache
def free(segments: int) -> Equilibrium:
    """The end's place free."""
    found = solve(STRIP, START, end=_end(None), energy="sadowsky", segments=segments, seed_curvature=3.0,
                  seed_ruling=0.2)  # fmt: skip
    assert found.ok
    return found


@cache
def middle() -> FloatArray:
    """Where the end is without force, l."""
    return np.asarray(free(FINE).position(np.array([1.0]))[0])


@dataclass(frozen=True)
class Passed:
    """Of the branch at a place of the clamp: how far (l) from the middle, size of the end's force (D w / l^2), "
    "largest
    distance (l) from the sphere that fits best, its radius and centre, |M| / (2 E)."""

    away: float
    force: float
    off: float
    radius: float
    centre: FloatArray
    by_moment: float


def fitted(found: Equilibrium) -> tuple[float, float, FloatArray]:
    """Largest distance of the centreline from the sphere that fits it best, its radius and its centre, l."""
    line = found.position(np.linspace(0.0, 1.0, 101))
    best = np.linalg.lstsq(np.column_stack([2.0 * line, np.ones(len(line))]), (line**2).sum(axis=1), rcond=None)[0]
    radius = float(np.sqrt(best[3] + best[:3] @ best[:3]))
    return float(np.abs(np.linalg.norm(line - best[:3], axis=1) - radius).max()), radius, best[:3]


def _place(t: float) -> FloatArray:
    return middle() + np.array([(2.0 * t - 1.0) * HALF, 0.0, 0.0])


@cache
def branch(segments: int) -> tuple[Run, Run]:
    """From the middle to both ends of the line."""

    def problem_at(t: float, lengths: FloatArray) -> MixedProblem:
        made = build(STRIP, START, end=_end(_place(t)), energy="sadowsky", segments=segments, formulation="mixed")
        assert isinstance(made, MixedProblem)
        return made

    s = np.linspace(0.0, 1.0, segments + 1)
    near = from_shape(problem_at(0.5, s), free(segments).omega(s), free(segments).eta(s), How(check=False))
    system, z = Equations.of(problem_at, near.problem.lengths, 0.5, near.x, near.rows, near.multipliers)
    point = first_point(system, z, 0.5, OPTIONS.tolerance)
    assert point is not None
    return follow(point, (0.0, 1.0), OPTIONS), follow(point.turned(), (0.0, 1.0), OPTIONS)


@cache
def passed(segments: int) -> tuple[Passed, ...]:
    """Along the line, in order."""
    ahead, back = branch(segments)
    found = []
    for point in (*back.points[:0:-1], *ahead.points):
        assert isinstance(point.system, Equations)
        own = equilibrium(point.system, point.z, point.t)
        held = own.end_support
        assert held is not None
        force = float(np.linalg.norm(held.force))
        by_moment = float(np.linalg.norm(held.moment)) / (2.0 * own.energy.elastic)
        found.append(Passed(float((_place(point.t) - middle())[0]), force, *fitted(own), by_moment))
    return tuple(found)


def at_middle(segments: int) -> Passed:
    """Where the end's force is least."""
    return min(passed(segments), key=lambda p: p.force)


def along_force(segments: int) -> tuple[float, float]:
    """Least and largest distance from the sphere over the force, where the force is above 0.01."""
    rates = [p.off / p.force for p in passed(segments) if p.force > 0.01]
    return min(rates), max(rates)


PROBES = {
    "off_20": lambda: at_middle(20).off,
    "radius_20": lambda: at_middle(20).radius,
    "rate_20": lambda: along_force(20)[1],
}


def run(out: Path) -> dict[str, Number]:
    """Writes forceless.md and its picture into the folder."""
    own = {p: at_middle(p) for p in SEGMENTS}
    order = float(np.log2(own[40].off / own[80].off))
    radius = settled([own[p].radius for p in SEGMENTS], 1e-12)
    by_moment = settled([own[p].by_moment for p in SEGMENTS], 1e-12)
    centre = [settled([float(own[p].centre[k]) for p in SEGMENTS], 1e-12) for k in range(3)]
    low, high = along_force(SEGMENTS[-1])
    ends = [r.ended for p in SEGMENTS for r in branch(p)]
    if set(ends) != {"range"} or not 3.5 < order < 4.5 or abs(radius.value - by_moment.value) > 1e-9:
        raise AssertionError(f"{ends}, order {order}, radii {radius}, {by_moment}")
    _picture(out / "forceless.png")
    rows = [
        [str(p), f"{f.force:.1e}", f"{f.off:.1e}", f"{f.radius:.10f}", f"{f.by_moment:.10f}"] for p, f in own.items()
    ]
    every = passed(SEGMENTS[-1])
    page.write(
        out / "forceless.md", "A Sadowsky strip through a state without force: on a sphere",
        "python -m tests.validation forceless",
        f"Clamped at the origin along x and, turned by {TURNED} rad about z, y, x, at the place where such an end "
        f"has "
        f"no force; there the clamp moves along x by +- {HALF} l. Where the end's force passes zero the "
        f"centreline lies on "
        "a sphere (Starostin and van der Heijden 2018); the solver is not told.",
        "## Where the force is none",
        page.table(
            ["segments", "force, D w / l^2", "distance from the sphere, l", "radius, l", "moment / (2 energy), l"], rows
        ),
        f"Order {order:.1f}. Radius {radius.value:.9f} +- {radius.error:.0e} l, centre "
        + ", ".join(f"{c.value:.7f} +- {c.error:.0e}" for c in centre)
        + " l. Moment over twice the energy, which asks nothing of the shape: "
        f"{by_moment.value:.9f} +- {by_moment.error:.0e} l, {abs(radius.value - by_moment.value):.0e} l apart.",
        "## Along the branch",
        f"Off the sphere in proportion to the force: {low:.3e} to {high:.3e} l per D w / l^2 "
        f"({SEGMENTS[-1]} segments).",
        page.table(["clamp moved by, l", "force, D w / l^2", "distance from the sphere, l", "radius, l"],
                   [[f"{p.away:+.5f}", f"{p.force:.4f}", f"{p.off:.2e}", f"{p.radius:.6f}"] for p in every]),
        "![Distance from the sphere over the clamp's place; the strip on its sphere](forceless.png)",
    )  # fmt: skip
    return {
        "off_20": Number(own[20].off, 1e-10, "l", ".1e"),
        "off_80": Number(own[80].off, 1e-12, "l", ".1e"),
        "order": Number(order, 0.05, "", ".1f"),
        "radius": Number(radius.value, radius.error, "l", ".9f"),
        "radius_20": Number(own[20].radius, 1e-10, "l", ".10f"),
        "by_moment": Number(by_moment.value, by_moment.error, "l", ".9f"),
        "radii_apart": Number(abs(radius.value - by_moment.value), 1e-10, "l", ".0e"),
        "rate_20": Number(along_force(20)[1], 1e-8, "l / (D w / l^2)", ".3e"),
        "force": Number(max(p.force for p in every), 1e-3, "D w / l^2", ".2f"),
    }


def _picture(path: Path) -> None:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib.axes import Axes

    figure = plt.figure(figsize=(11, 4.4), constrained_layout=True)
    left: Axes = figure.add_subplot(1, 2, 1)
    for segments in SEGMENTS:
        found = passed(segments)
        left.semilogy([p.away for p in found], [p.off for p in found], ".-", label=f"{segments} segments")
    left.set(xlabel="clamp moved by, l", ylabel="distance from the sphere, l")
    left.legend()
    right = figure.add_subplot(1, 2, 2, projection="3d")
    found = free(SEGMENTS[-1])
    _, radius, centre = fitted(found)
    u, v = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, 41), np.linspace(0.0, np.pi, 21))
    ball = np.stack([np.cos(u) * np.sin(v), np.sin(u) * np.sin(v), np.cos(v)], axis=-1) * radius + centre
    right.plot_wireframe(*np.moveaxis(ball, 2, 0), color="0.85", lw=0.5)  # type: ignore[attr-defined]
    right.plot(*found.position(np.linspace(0.0, 1.0, 400)).T, "C3", lw=2.0)
    right.set_box_aspect((1, 1, 1))  # type: ignore[arg-type]
    figure.savefig(path, dpi=110)
    plt.close(figure)
