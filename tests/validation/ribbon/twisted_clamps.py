"""A strip between clamps nearer to each other than it is long, one turned about the line between them, from no turn to
three: states, stability, special points with errors, images, and four places by shooting.

Kirchhoff's rod of rectangular section (`kirchhoff`). A half turn about the
axis through the middle that bisects both normals carries the scene into itself read from the other end; a branch is
symmetric or has an image. Frames do not count turns: the states of a scene are those at phi, phi + 1, ..., and,
mirrored, those at 1 - phi, 2 - phi, ...

Independent (Kirchhoff): shooting on r' = t, Q' = Q [kappa], m' + t x n = 0, n' = 0 with m = (kappa_1, A kappa_2,
C kappa_3) in the frame's axes (S. Antman 2005, Nonlinear Problems of Elasticity, ch. 8), six unknowns n, m(0), six
conditions at the end; their determinant is zero at pitchforks. Derivatives by complex steps.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from compare import registry
from compare.continuation import correct
from compare.continuation.correct import first_point
from compare.continuation.finer import relocated
from compare.continuation.follow import follow, switched
from compare.continuation.point import Options, Point, Run, Special
from compare.measure.mesh_limit import Settled, settled
from compare.models.branches.ribbon import equilibrium
from compare.models.capabilities import Branches
from compare.scene.scene import Scene, loads
from compare.studies.branches.states import states
from ribbon import Equilibrium
from ribbon.energies.free import in_plane_stiffness
from ribbon.energies.section.rod import stiffnesses
from ribbon.find.branch.equations import Equations
from tests.validation import page
from tests.validation.number import Number

FloatArray = NDArray[np.float64]

#: Segments, and turns up to which is followed.
SEGMENTS, TURNS = 16, 3.0
#: Distance of the clamps, l; unstable modes from which a branch is not followed on.
APART, MODES = 0.8, 2
ENERGIES = ("kirchhoff",)
#: Elements of `finite`, which does not settle.
FINITE = (16, 32, 64)
#: Turns at which states by random starts are compared with those of the branches, and starts.
ASKED, TRIES = 0.3, 4
#: Shooting and the limit of the elements, turns.
NEAR = 1e-6
OPTIONS = Options(steps=400)
#: Where around a pitchfork the determinant is asked for: not at it, where no step of Newton's is known (arc length).
_NODES = 0.004 * np.array([-3.0, -2.0, -1.0, 1.0, 2.0, 3.0])
SCENE = """
title = "Two clamps, one turned about the line between them"
[strip]
length = 1.0
width = 0.05
poisson = 0.3
thickness = 5e-4
gamma = 0.0
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
[clamp.end]
position = [{apart}, 0.0, 0.0]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
[model]
energy = "{energy}"
elements = {segments}
[seed]
curvature = [-6.0, 6.0, -6.0]
"""


def scene(energy: str, turn: float = 0.0, segments: int = SEGMENTS) -> Scene:
    """The scene, its end turned."""
    found = loads(SCENE.format(apart=APART, energy=energy, segments=segments), "twisted_clamps")
    angle = 2.0 * np.pi * turn
    return found.replace({"clamp.end.normal": [0.0, -float(np.sin(angle)), float(np.cos(angle))]})


def scenes(energy: str, segments: int) -> Callable[[float], Scene]:
    """t in [0, 1] -> the scene, turned by t TURNS; ValueError beyond."""
    flat = scene(energy, 0.0, segments)
    end = flat.clamp_end
    assert end is not None

    def there(t: float) -> Scene:
        if not 0.0 <= t <= 1.0:
            raise ValueError(f"t = {t} lies outside 0 <= t <= 1")
        angle = 2.0 * np.pi * TURNS * t
        return replace(flat, clamp_end=replace(end, normal=(0.0, -float(np.sin(angle)), float(np.cos(angle)))))

    return there


@dataclass(frozen=True)
class Line:
    """A branch: its name, run, which special point it leaves, and at which other one it is back on the symmetric
    one."""

    name: str
    run: Run
    leaves: Special | None
    back: Special | None = None


def _few(point: Point) -> bool:
    return point.unstable < MODES


def _until_back(run: Run) -> tuple[Run, Special | None]:
    """A branch aside until it passes the symmetric one again, and where: behind that it is its own other side."""
    back = next((k for k, s in enumerate(run.specials) if s.kind == "branch_point" and not s.change), None)
    if back is None:
        return run, None
    there = run.specials[back]
    points = tuple(point for point in run.points if point.arc < there.point.arc)
    return replace(run, points=points, specials=run.specials[:back], ended="joins"), there


def _is_at(back: Special | None, special: Special) -> bool:
    return back is not None and abs(back.point.t - special.point.t) < NEAR


def _winds(point: Point) -> bool:
    return point.tangent[1] > 0.0


@cache
def lines(energy: str, segments: int = SEGMENTS) -> tuple[Line, ...]:
    """The arch's branch until it turns back, and one side of each branch that leaves it, once; the other side is its
    image."""
    model = registry.model("ribbon")
    assert isinstance(model, Branches)
    start = model.branch_start(scenes(energy, segments), None)
    first = first_point(start.system, start.z, 0.0, OPTIONS.tolerance)
    assert first is not None
    found = [Line("symmetric", follow(first, (0.0, 1.0), OPTIONS, _winds), None)]
    for k, special in enumerate(s for s in found[0].run.specials if s.kind == "branch_point"):
        for side, begin in enumerate(switched(special, OPTIONS)[: 2 if k == 0 else 1]):  # the other is its image
            if not any(_is_at(line.back, special) for line in found):
                run, back = _until_back(follow(begin, (0.0, 1.0), OPTIONS, _few))
                found.append(Line(f"aside {k + 1}{'ab'[side]}", run, special, back))
    return tuple(found)


def turn(point: Point) -> float:
    """Turns of the end."""
    return TURNS * point.t


def shape(point: Point) -> Equilibrium:
    """The ribbon there."""
    assert isinstance(point.system, Equations)
    return equilibrium(point.system, point.z, point.t)


def centreline(point: Point, count: int = 101) -> FloatArray:
    """Points (k, 3)."""
    return shape(point).position(np.linspace(0.0, 1.0, count))


def image(line: FloatArray, turned: float) -> FloatArray:
    """A centreline (k, 3) read from the other end, after half a turn about the axis that bisects both normals."""
    angle = np.pi * turned
    axis = np.array([0.0, -np.sin(angle), np.cos(angle)])
    middle = np.array([0.5 * APART, 0.0, 0.0])
    return Rotation.from_rotvec(np.pi * axis).apply(line[::-1] - middle) + middle


def landed(line: Line, turned: float) -> list[Point]:
    """Points of a branch at a turn, between neighbours."""
    found = []
    for one, other in zip(line.run.points[:-1], line.run.points[1:], strict=True):
        if (turn(one) - turned) * (turn(other) - turned) > 0.0 or turn(one) == turn(other):
            continue
        share = (turned - turn(one)) / (turn(other) - turn(one))
        guess = (1.0 - share) * one.z + share * other.z if one.z.shape == other.z.shape else one.z
        point = first_point(one.system, guess, turned / TURNS, OPTIONS.tolerance)
        if point is not None:
            found.append(point)
    return found


@cache
def located(energy: str) -> tuple[tuple[str, Special, Settled], ...]:
    """Folds and branch points, each with its limit over elements halved twice; of sides that are images one."""
    found = []
    for line in lines(energy):
        for special in line.run.specials:
            if special.kind not in ("fold", "branch_point") or line.name.endswith("b"):
                continue
            values, last = [turn(special.point)], special
            for _ in range(2):
                again = None if last is None else relocated(last, OPTIONS)
                values.append(float("nan") if again is None else turn(again.point))
                last = again  # type: ignore[assignment]
            found.append((line.name, special, settled(values, 1e-9)))
    return tuple(found)


# -- shooting ---------------------------------------------------------------------------------------------------------


@cache
def _constants() -> tuple[float, float]:
    """Stiffness in the plane and of torsion, D w."""
    strip = scene("kirchhoff").strip
    section = 0.5 * strip.width, 5e-4, strip.poisson, 0.0
    return in_plane_stiffness(section), float(stiffnesses(section)[1])


def _rates(y: Any, sideways: float, torsion: float) -> Any:
    """d/ds of r (3), Q (9, rows space, columns t_x t_y t_z), m (3, in the frame) and n (3), columns (15 + 3, k)."""
    q, m, n = y[3:12].reshape(3, 3, -1), y[12:15], y[15:18]
    kappa = np.array([m[0], m[1] / sideways, m[2] / torsion])
    body = np.einsum("ijk,ik->jk", q, n)
    out = np.empty_like(y)
    out[:3] = q[:, 2]
    out[3:12] = np.array([
        q[:, 1] * kappa[2] - q[:, 2] * kappa[1],
        q[:, 2] * kappa[0] - q[:, 0] * kappa[2],
        q[:, 0] * kappa[1] - q[:, 1] * kappa[0],
    ]).transpose(1, 0, 2).reshape(9, -1)  # fmt: skip
    # m' + kappa x m + t x n = 0, t x n = (-n_y, n_x, 0)
    out[12] = -(kappa[1] * m[2] - kappa[2] * m[1]) + body[1]
    out[13] = -(kappa[2] * m[0] - kappa[0] * m[2]) - body[0]
    out[14] = -(kappa[0] * m[1] - kappa[1] * m[0])
    out[15:18] = 0.0
    return out


def _frame(turned: Any) -> FloatArray:
    """Columns t_x, t_y, t_z of a clamp."""
    angle = 2.0 * np.pi * turned
    normal, along = np.array([0.0, -np.sin(angle), np.cos(angle)]), np.array([1.0, 0.0, 0.0])
    return np.column_stack([np.cross(normal, along), normal, along])


def missed(u: FloatArray, turned: float) -> tuple[FloatArray, FloatArray]:
    """What the end misses (6,) from u = (n, m(0)), and its derivatives (6, 6)."""
    step = 1e-30
    start = np.zeros((18, 7), dtype=complex)
    start[3:12] = _frame(0.0).reshape(9, 1)
    start[15:18], start[12:15] = u[:3, None], u[3:, None]
    for k in range(6):
        start[15 + k if k < 3 else 9 + k, 1 + k] += 1j * step
    found = solve_ivp(
        lambda s, y: _rates(y.reshape(18, 7), *_constants()).ravel(), (0.0, 1.0), start.ravel(), method="DOP853",
        rtol=1e-10, atol=1e-11,
    ).y[:, -1].reshape(18, 7)  # fmt: skip
    q, goal = found[3:12].reshape(3, 3, 7), _frame(turned)
    rest = np.einsum("ji,jlk->ilk", goal, q)
    out = np.concatenate([
        found[:3] - np.array([[APART], [0.0], [0.0]]),
        np.array([rest[2, 1] - rest[1, 2], rest[0, 2] - rest[2, 0], rest[1, 0] - rest[0, 1]]),
    ])  # fmt: skip
    return out[:, 0].real, out[:, 1:].imag / step


def shot(u: FloatArray, turned: float) -> FloatArray:
    """Newton's iteration on the end's conditions."""
    for _ in range(20):
        left, jacobian = missed(u, turned)
        if float(np.abs(left).max()) < 1e-9:
            return u
        u = u - np.linalg.solve(jacobian, left)
        if not float(np.abs(u).max()) < 1e4:
            break
    raise AssertionError(f"turn = {turned}: shooting does not settle, {np.abs(left).max():.1e}")


def _begun(point: Point) -> FloatArray:
    """n and m(0) of an equilibrium: the clamp pushes the start by -n and turns it by -m."""
    start = shape(point).start
    return np.concatenate([-np.asarray(start.force), -(_frame(0.0).T @ np.asarray(start.moment))])


def by_shooting(special: Special) -> float:
    """The place of a pitchfork of the symmetric branch, turns: a root between points on both sides."""
    fine = relocated(special, OPTIONS)
    special = fine if fine is not None else special
    near = turn(special.point)
    places, values = [], []
    for ahead in _NODES:
        point = correct.at(special.point, float(ahead), OPTIONS.tolerance)
        assert point is not None
        places.append(turn(point))
        values.append(float(np.linalg.det(missed(shot(_begun(point), places[-1]), places[-1])[1])))
    fit = np.polynomial.Polynomial.fit(np.array(places) - near, values, _NODES.size - 1)
    return near + float(brentq(fit, min(places) - near, max(places) - near, xtol=1e-13))


# -- the page ---------------------------------------------------------------------------------------------------------


def seen(energy: str, turned: float) -> list[tuple[float, int, str]]:
    """Energies, unstable modes and branches of the states of the scene at a turn, mirrored ones too."""
    wound = [turned + k for k in range(int(TURNS) + 1)] + [k - turned for k in range(1, int(TURNS) + 1)]
    found = [
        (float(point.system.energy(point.z, point.t)), point.unstable, f"{line.name} at {at:g}")
        for line in lines(energy)
        if not line.name.endswith("b")
        for at in wound
        if at <= TURNS
        for point in landed(line, at)
    ]
    return sorted(found)


def asymmetry(line: Line) -> float:
    """Largest distance (l) of a branch's centrelines from their own images."""
    points = line.run.points[:: max(1, len(line.run.points) // 8)]
    return max(float(np.abs(centreline(p) - image(centreline(p), turn(p))).max()) for p in points)


def images_apart(one: Line, other: Line) -> float:
    """Largest distance (l) between a branch's centrelines and the images of its other side, at two turns."""
    apart = []
    for at in (0.4, 0.8):
        first = [centreline(p) for p in landed(one, at)]
        second = [image(centreline(p), at) for p in landed(other, at)]
        apart += [min(float(np.abs(a - b).max()) for b in second) for a in first]
    return max(apart)


@cache
def pitchfork_of(energy: str) -> float:
    """Where the symmetric branch is lost, on SEGMENTS."""
    return min(turn(s.point) for s in lines(energy)[0].run.specials)


@cache
def lost_of_finite(segments: int) -> float:
    """Where the arch of `finite` first has an unstable mode, turns, on so many equal elements."""
    model = registry.model("ribbon")
    assert isinstance(model, Branches)
    start = model.branch_start(scenes("finite", segments), None)
    first = first_point(start.system, start.z, 0.0, OPTIONS.tolerance)
    assert first is not None
    return turn(follow(first, (0.0, 1.0), OPTIONS, lambda point: not point.unstable).specials[0].point)


PROBES = {"lost_kirchhoff_coarse": lambda: pitchfork_of("kirchhoff"), "torsion": lambda: _constants()[1]}


def _first(energy: str, name: str, kind: str, k: int = 0) -> tuple[Special, Settled]:
    return [(special, limit) for line, special, limit in located(energy) if (line, special.kind) == (name, kind)][k]


def run(out: Path) -> dict[str, Number]:
    rows, numbers = [], {}
    for energy in ENERGIES:
        for name, special, limit in located(energy):
            rows.append([
                energy, name, special.kind.replace("_", " "), f"{limit.value:.7f}",
                f"{limit.error:.0e}" if limit.settles else "not settled", f"{special.change:+d}",
                f"{special.point.system.energy(special.point.z, special.point.t):.3f}",
            ])  # fmt: skip
        print(f"  twisted_clamps: {energy}", flush=True)
        kinds = {"lost": ("symmetric", "branch_point", 0), "again": ("symmetric", "branch_point", 1),
                 "lost_third": ("symmetric", "branch_point", 2), "again_third": ("symmetric", "branch_point", 3),
                 "turns_back": ("symmetric", "fold", 0), "snaps": ("aside 1a", "fold", 0)}  # fmt: skip
        for key, (name, kind, k) in kinds.items():
            _, limit = _first(energy, name, kind, k)
            assert limit.settles
            numbers[f"{key}_{energy}"] = Number(limit.value, limit.error, "turns", ".7f")
    changes = [(s.kind, s.change) for s in lines("kirchhoff")[0].run.specials]
    if changes != [*2 * [("branch_point", 1), ("branch_point", -1)], ("fold", 1)]:
        raise AssertionError(f"the symmetric branch: {changes}")
    shots = []
    for key in ("lost", "again", "lost_third", "again_third"):
        name, kind, k = kinds[key]
        special, limit = _first("kirchhoff", name, kind, k)
        place = by_shooting(special)
        shots.append([f"{name}, {kind.replace('_', ' ')}", f"{limit.value:.8f}", f"{limit.error:.0e}", f"{place:.8f}",
                      f"{limit.value - place:.0e}"])  # fmt: skip
        numbers[f"{key}_shot"] = Number(place, 1e-7, "turns", ".7f")
        if abs(limit.value - place) > max(NEAR, limit.error):
            raise AssertionError(f"{key}: {limit} by elements, {place} by shooting")
        print(f"  twisted_clamps: {key} by shooting", flush=True)
    symmetric, one, other = lines("kirchhoff")[:3]
    own, apart = asymmetry(symmetric), images_apart(one, other)
    if own > 1e-8 or apart > 1e-6:
        raise AssertionError(f"images: {own}, {apart}")
    by_branches = seen("kirchhoff", ASKED)
    asked = states(scene("kirchhoff", ASKED), TRIES, 20.0)
    stable = sorted({round(s.energy, 4) for s in asked.seen if s.stable})
    missing = [e for e in stable if not any(abs(e - value) < 1e-3 for value, *_ in by_branches)]
    numbers |= {
        "stable": Number(len({round(e, 3) for e, u, _ in by_branches if not u}), 0, shown="d"),
        "missing": Number(len(missing), 0, shown="d"),
    }
    finite = [lost_of_finite(count) for count in FINITE]
    for count, place in zip(FINITE, finite, strict=True):
        numbers[f"lost_finite_{count}"] = Number(place, None, "turns", ".4f", "a number of these elements")
    _picture(out / "twisted_clamps.png")
    numbers |= {
        "lost_kirchhoff_coarse": Number(pitchfork_of("kirchhoff"), 1e-8, "turns", ".7f"),
        "torsion": Number(_constants()[1], 1e-12, "D w", ".6f"),
    }
    page.write(
        out / "twisted_clamps.md", "Clamped strips from no turn to three: the states connected with the arch",
        "python -m tests.validation twisted_clamps",
        f"w/l = 0.05, w/h = 100, nu = 0.3, no weight; clamps {APART:g} l apart, their tangents along the line between "
        "them, the end turned about it. The strip goes through itself where it would touch. Followed on "
        f"{SEGMENTS} elements from the flat arch on until it turns back; a branch aside ends where it has {MODES} "
        "unstable modes or is back on the symmetric one. Limits "
        "and errors over elements halved twice.",
        page.table(["model", "branch", "what", "turns", "+-", "change of unstable modes", "energy / (D w / l)"], rows),
        "The arch winds with its half turn kept, loses its stability to two shapes that are images of each other, and "
        "has it again later; so once more in its third turn, at whose end it snaps at a fold. The shapes aside of the "
        "first are carried on until they snap at a fold, those of the third turn lead from its loss over "
        "a fold to where it is stable again. Those that leave where it is stable again for the first time are "
        "unstable but for a short stretch between two folds.",
        "`finite` has no number here: the arch is lost at "
        + ", ".join(f"{place:.4f}" for place in finite)
        + f" turns on {', '.join(str(count) for count in FINITE)} elements. Where its curvature passes 1 / zeta "
        "nothing resists a change of kappa' ([shifted clamps](shift_branches.md)); that this is the cause here was "
        "not measured.",
        "![Energies over the turns](twisted_clamps.png)",
        "## By shooting (Kirchhoff)",
        page.table(["what", "elements, turns", "+-", "shooting, turns", "apart"], shots),
        f"## Images\n\nThe symmetric branch is its own image (half a turn about the bisector of both normals, read "
        f"from the other end) to {own:.0e} l; both sides of the first pitchfork are each other's to {apart:.0e} l "
        f"(at 0.4 and 0.8 turns, where both were followed). Over -turns all is mirrored.",
        f"## States of one scene\n\nFrames do not count turns: at {ASKED:g} turns the states are those of "
        f"{ASKED:g}, {1 + ASKED:g}, {2 + ASKED:g} and, mirrored, {1 - ASKED:g}, {2 - ASKED:g} and {3 - ASKED:g} turns.",
        page.table(["energy", "unstable modes", "branch"], [[f"{e:.4f}", str(u), name] for e, u, name in by_branches]),
        f"`solve --all` with {TRIES} random starts ends in stable states of the energies "
        f"{', '.join(f'{e:g}' for e in stable)}; not on these branches: "
        + (", ".join(f"{e:g}" for e in missing) if missing else "none") + ". No list is a proof.",
    )  # fmt: skip
    return numbers


def _picture(path: Path) -> None:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, len(ENERGIES), figsize=(8, 4.6), constrained_layout=True, squeeze=False)
    for axis, energy in zip(axes[0], ENERGIES, strict=True):
        for k, line in enumerate(found for found in lines(energy) if not found.name.endswith("b")):
            t = np.array([turn(p) for p in line.run.points])
            e = np.array([p.system.energy(p.z, p.t) for p in line.run.points])
            stable = np.array([p.unstable == 0 for p in line.run.points])
            axis.plot(t, np.where(stable, e, np.nan), f"C{k}-", label=line.name.removesuffix("a"))
            axis.plot(t, e, f"C{k}--", lw=0.8)
        for _, special, limit in located(energy):
            place = limit.value if limit.settles else turn(special.point)
            high = special.point.system.energy(special.point.z, special.point.t)
            axis.plot([place], [high], "ko" if special.kind == "branch_point" else "k|", ms=5)
        axis.set_title(energy)
        axis.set_xlabel("turns")
    axes[0, 0].set_ylabel("energy, D w / l")
    axes[0, 0].legend()
    figure.savefig(path, dpi=110)
    plt.close(figure)
