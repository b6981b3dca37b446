"""A strip twisted by one turn and a half whose clamped ends come together: where it snaps, and the loop it lies in.

A helix of N turns over the distance Z of its ends has omega = 2 pi N sqrt(1 - Z^2), tau = omega Z / sqrt(1 - Z^2) and
its own frames at the ends; its axis is then turned into the line of the clamps. So begun every model has the same link:
twist and writhe (Gauss's integral, ends closed far away) add up to N (G. Calugareanu 1959; J. H. White 1969). Without
contact its branch is followed over Z, its special points on elements halved twice; with contact it is carried through
the snap. Rulings are free at the clamps. The rod: Kirchhoff's of the section's own Y I and torsion.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import NamedTuple

import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from compare.continuation.correct import first_point
from compare.continuation.finer import relocated
from compare.continuation.follow import follow as followed
from compare.continuation.point import Options, Point, Run, Special
from compare.measure.mesh_limit import Settled, settled
from compare.models.branches.ribbon import equilibrium
from ribbon import Clamp, Equilibrium, Strip
from ribbon.find.branch.equations import Equations
from ribbon.find.continuation import anchored, follow
from ribbon.find.snap import landed
from ribbon.find.solve import build
from ribbon.find.solving.request import How
from ribbon.find.solving.search import from_shape
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.transfer import transferred
from tests.reference.touching_ring import writhe
from tests.validation import page
from tests.validation.number import Number
from tests.validation.ribbon.ply import complementarity, depth, pushes

FloatArray = NDArray[np.float64]

#: Turns of the clamps against each other, Poisson's ratio, segments.
TURNS, NU, SEGMENTS = 1.5, 0.3, 40
#: Distance of the ends (l) at which a strip is begun, and to which its branch is followed; of inextensible ones the
#: farthest and the nearest.
BEGUN, NEAREST = 0.72, 0.4
SOFT, FAR, NEAR = 0.6, 0.8, 0.05
#: Steps that turn the helix's axis into the line of the clamps.
_TURNED = 60
#: Steps with contact (l), and distances at which what touches is looked at.
STEP, DISTANCES = 0.004, (0.54, 0.5)


class Case(NamedTuple):
    """Energy, w / l, w / h, rulings at the clamps."""

    energy: str
    width: float
    slender: float
    ruling: str = "free"

    @property
    def name(self) -> str:
        return "rod" if self.energy == "kirchhoff" else f"{self.energy}, w/l = {self.width:g}, w/h = {self.slender:g}"

    @property
    def strip(self) -> Strip:
        return Strip(1.0, self.width, NU, thickness=self.width / self.slender)


ROD = Case("kirchhoff", 0.02, 20.0)
FINITE = tuple(Case("finite", w, slender) for w, slender in ((0.01, 20.0), (0.02, 20.0), (0.02, 40.0), (0.05, 20.0)))
TOUCHING = (ROD, *FINITE[:2])
INEXTENSIBLE = (Case("sadowsky", 0.02, 20.0), Case("wunderlich", 0.02, 20.0), Case("wunderlich", 0.05, 20.0))


def problem(
    case: Case, distance: float, lengths: FloatArray | int = SEGMENTS, tilt: float = 0.0, apart: float | None = None
) -> MixedProblem:
    """The strip between clamps at this distance along an axis that is tilted (rad) from the start's tangent, the end's
    frame turned about it by TURNS."""
    axis = np.array([np.sin(tilt), 0.0, np.cos(tilt)])
    frame = Rotation.from_rotvec(2.0 * np.pi * TURNS * axis).as_matrix()
    end = Clamp(tuple(distance * axis), tuple(frame[:, 2]), tuple(frame[:, 1]), case.ruling)
    stiffness = "plate" if case.energy == "kirchhoff" else None
    found = build(
        case.strip, Clamp(ruling=case.ruling), end=end, energy=case.energy, segments=lengths, formulation="mixed",
        stiffness=stiffness, apart=apart,
    )  # fmt: skip
    assert isinstance(found, MixedProblem)
    return found


@cache
def begun(case: Case, distance: float, segments: int = SEGMENTS) -> Equilibrium:
    """The strip at a distance of its ends, from a helix of as many turns."""
    across = float(np.sqrt(1.0 - distance**2))
    ruling, tilt = distance / across, float(np.arccos(distance))
    bend = np.full(segments + 1, 2.0 * np.pi * TURNS * across)
    helix = problem(case, distance, segments, 0.5 * np.pi - np.arctan(ruling))
    state = from_shape(helix, bend, np.full(segments + 1, ruling), How())
    state = follow(lambda t: problem(case, distance, segments, (1.0 - t) * tilt), state, steps=_TURNED)
    if not state.ok or abs(link(state) - TURNS) > 1e-2:
        raise AssertionError(f"{case}: link {link(state)}, {state.message}")
    return state


def twist(state: Equilibrium) -> float:
    """Turns of the section about the centreline."""
    tau = state.tau(np.linspace(0.0, 1.0, 2001))
    return float(0.5 * (tau[1:] + tau[:-1]).sum() / 2000.0 / (2.0 * np.pi))


def link(state: Equilibrium) -> float:
    """Twist and writhe, turns; its ends go on straight and are closed far away."""
    r = state.position(np.linspace(0.0, 1.0, 301))
    far = 200.0 * np.geomspace(1e-3, 1.0, 60)[:, None] * np.array([0.0, 0.0, 1.0])
    angle = np.linspace(0.2, np.pi - 0.2, 60)
    back = 300.0 * np.column_stack([np.sin(angle), 0.0 * angle, np.cos(angle)])
    return twist(state) + writhe(np.vstack([r[0] - far[::-1], r, r[-1] + far, back]))


# -- without contact --------------------------------------------------------------------------------------------------


def run_of(case: Case, begin: float, end: float, segments: int = SEGMENTS) -> Run:
    """The branch from one distance of the ends to another, past folds until two modes are unstable."""
    state = begun(case, begin, segments)

    def at(t: float, lengths: FloatArray) -> MixedProblem:
        return problem(case, begin + (end - begin) * t, lengths)

    system, z = Equations.of(at, state.problem.lengths, 0.0, state.x, state.rows, state.multipliers)
    first = first_point(system, z, 0.0, Options().tolerance)
    assert first is not None
    return followed(first, (0.0, 1.0), Options(steps=200), _few)


def _few(point: Point) -> bool:
    return point.unstable < 2


def shape(point: Point) -> Equilibrium:
    assert isinstance(point.system, Equations)
    return equilibrium(point.system, point.z, point.t)


@cache
def branch(case: Case) -> Run:
    return run_of(case, BEGUN, NEAREST)


def distance(point: Point) -> float:
    """Of the ends, on `branch`."""
    return BEGUN + (NEAREST - BEGUN) * point.t


def numbers_at(special: Special) -> FloatArray:
    """Z, tension, moment, energy, twist (turns) at a special point."""
    state = shape(special.point)
    ends = state.end_support
    assert ends is not None
    return np.array([distance(special.point), ends.force[2], ends.moment[2], state.energy.total, twist(state)])


@cache
def snaps(case: Case) -> tuple[Settled, ...]:
    """The numbers of the fold over elements halved twice."""
    return _over_meshes(next(special for special in branch(case).specials if special.kind == "fold"))


@cache
def forks(case: Case) -> Settled:
    """The distance at which the loop leaves the middle, on elements halved twice."""
    return _over_meshes(next(s for s in branch(case).specials if s.kind == "branch_point"))[0]


def _over_meshes(special: Special) -> tuple[Settled, ...]:
    rows, last = [numbers_at(special)], special
    for _ in range(2):
        finer = relocated(last, Options())
        if finer is None:
            rows.append(np.full(5, np.nan))
            break
        rows.append(numbers_at(finer))
        last = finer
    return tuple(settled(list(column), 1e-9) for column in np.array(rows).T)


@cache
def smooth(case: Case, segments: int = SEGMENTS) -> tuple[Run, Run]:
    """The branch of an inextensible strip, away from where it is begun and together."""
    return run_of(case, SOFT, FAR, segments), run_of(case, SOFT, NEAR, segments)


# -- with contact ------------------------------------------------------------------------------------------------------


class Carried(NamedTuple):
    """The last state of a path, between which distances it jumped, and centrelines on the way: distances and states."""

    state: Equilibrium
    jumps: tuple[tuple[float, float], ...]
    film: tuple[tuple[float, Equilibrium], ...]


@cache
def carried(case: Case, stages: tuple[float, ...]) -> Carried:
    """The strip that touches itself, its thickness apart, at the last of the distances, each reached from the one
    before; where a stage fails, at the last distance before."""
    if not stages:
        return Carried(begun(case, BEGUN), (), ((BEGUN, begun(case, BEGUN)),))
    old = carried(case, stages[:-1])
    begin, end = (BEGUN, *stages)[-2], stages[-1]
    if not old.state.ok:
        return old
    seen, jumps, film = [begin], list(old.jumps), list(old.film)

    def note(record, state: Equilibrium) -> None:
        seen.append(begin + (end - begin) * record.t)
        film.append((seen[-1], state))
        if record.jump:
            jumps.append((seen[-1], seen[-2]))

    thick = case.width / case.slender
    state = follow(
        lambda t: problem(case, begin + (end - begin) * t, apart=thick), old.state,
        steps=max(1, round((begin - end) / STEP)), on_step=note,
    )  # fmt: skip
    return Carried(state, tuple(jumps), tuple(film))


@cache
def finer(case: Case) -> Equilibrium:
    """The strip at the first of the distances on twice as many segments, downhill of what it is on SEGMENTS."""
    state = carried(case, DISTANCES[:1]).state
    assert isinstance(state.problem, MixedProblem)
    fine = anchored(problem(case, DISTANCES[0], 2 * SEGMENTS, apart=case.width / case.slender), state)
    assert isinstance(fine, MixedProblem)
    return landed(fine, transferred(state.problem, state.x, fine), How())


# -- the page ----------------------------------------------------------------------------------------------------------


def _pm(limit: Settled, digits: int) -> str:
    return (
        f"{limit.value:.{digits}f} +- {limit.error:.0e}" if limit.settles else f"{limit.value:.{digits}f} (not settled)"
    )


def snap_rows() -> list[list[str]]:
    rows = []
    for case in (ROD, *FINITE):
        where, tension, moment, energy, turned = snaps(case)
        fork = forks(case)
        rows.append([case.name, "" if case is ROD else f"{case.width * case.slender:g}", _pm(where, 7),
                     _pm(fork, 7) if fork.settles else f"{branch_point(case):.4f} (not settled)", _pm(tension, 4),
                     _pm(moment, 5), _pm(energy, 4), _pm(turned, 5)])  # fmt: skip
    return rows


def branch_point(case: Case) -> float:
    """Where the loop leaves the middle, on SEGMENTS."""
    return next(distance(s.point) for s in branch(case).specials if s.kind == "branch_point")


def smooth_rows() -> tuple[list[list[str]], float, int]:
    """Rows of the inextensible strips, the largest relative change of their energies on twice the segments, and how
    many special points or unstable states are on their branches."""
    rows, off, special = [], 0.0, 0
    for case in INEXTENSIBLE:
        coarse, fine = smooth(case), smooth(case, 2 * SEGMENTS)
        special += sum(len(r.specials) + sum(p.unstable for p in r.points) + (r.ended != "range") for r in coarse)
        points = (coarse[0].points[-1], coarse[1].points[0], coarse[1].points[-1])
        others = (fine[0].points[-1], fine[1].points[0], fine[1].points[-1])
        for at, point, other in zip((FAR, SOFT, NEAR), points, others, strict=True):
            state, again = shape(point), shape(other)
            ends = again.end_support
            assert ends is not None
            change = abs(state.energy.total / again.energy.total - 1.0)
            off = max(off, change)
            name = case.energy if case.energy == "sadowsky" else f"{case.energy}, w/l = {case.width:g}"
            rows.append([name, f"{at:g}", f"{again.energy.total:.4f}", f"{change:.0e}", f"{ends.force[2]:.2f}",
                         f"{ends.moment[2]:.3f}", f"{twist(again):.4f}", f"{link(again):.3f}"])  # fmt: skip
    return rows, off, special


def contact_rows() -> tuple[list[list[str]], dict[str, float]]:
    """Rows of the states in contact, and the worst of them."""
    rows, worst = [], {"deep": 0.0, "product": 0.0, "energy": 0.0, "push": 0.0}
    for case in TOUCHING:
        for k, at in enumerate(DISTANCES):
            path = carried(case, DISTANCES[: k + 1])
            state, ends = path.state, path.state.end_support
            assert ends is not None
            found = pushes(state)
            own = {"deep": depth(state), "product": complementarity(state)}
            if not k and finer(case).ok:
                other = pushes(finer(case))
                own["energy"] = abs(state.energy.total / finer(case).energy.total - 1.0)
                if len(found) == len(other):
                    own["push"] = abs(found[:, 2].sum() / other[:, 2].sum() - 1.0)
            worst = {name: max(value, own.get(name, 0.0)) for name, value in worst.items()}
            across = "; ".join(f"{p.v / case.width:+.2f}, {p.v_other / case.width:+.2f}" for p in state.pairs)
            rows.append([case.name, f"{path.jumps[0][0]:.4f} to {path.jumps[0][1]:.4f}", f"{at:g}",
                         "; ".join(f"{a:.4f}, {b:.4f}" for a, b in found[:, :2]), across,
                         "; ".join(f"{f:.3f}" for f in found[:, 2]), f"{ends.force[2]:.3f}", f"{ends.moment[2]:.4f}",
                         f"{state.energy.total:.4f}",
                         *(f"{own[n]:.0e}" if n in own else "" for n in ("energy", "push")),
                         f"{twist(state):.4f}", f"{state.lowest_eigenvalue:.4f}", f"{own['deep']:.0e}",
                         f"{own['product']:.0e}"])  # fmt: skip
            if not state.ok:
                raise AssertionError(f"{case}, {at}: {state.message}")
    return rows, worst


def _drawn(axes, state: Equilibrium, case: Case, title: str) -> None:
    s, v = np.linspace(0.0, 1.0, 301), 0.5 * case.width * np.array([-1.0, 1.0])
    t = state.frame(s)
    r = state.position(s)[:, None, :] + v[None, :, None] * t[:, None, :, 0]
    axes.plot_surface(r[..., 0], r[..., 1], r[..., 2], color="tab:orange", linewidth=0, shade=True)
    found = pushes(state)
    if len(found):
        axes.plot(*state.position(found[:, 0]).T, "k.", ms=6)
    out = state.position(s)
    k = int(np.argmax(np.hypot(out[:, 0], out[:, 1])))
    axes.set(title=title, xlim=(-0.2, 0.2), ylim=(-0.2, 0.2), zlim=(-0.05, 0.75))
    axes.set_box_aspect((0.4, 0.4, 0.8), zoom=1.5)
    axes.view_init(5, float(np.degrees(np.arctan2(out[k, 1], out[k, 0]))) - 60.0)
    axes.set_axis_off()


def _picture(path: Path) -> None:
    figure = plt.figure(figsize=(13, 8))
    case = FINITE[1]
    fold = next(s for s in branch(case).specials if s.kind == "fold")
    wide = next(s for s in branch(FINITE[-1]).specials if s.kind == "fold")
    last = carried(case, DISTANCES)
    shown = [
        (begun(case, BEGUN), case, f"w/l = 0.02, Z = {BEGUN:g}"),
        (shape(fold.point), case, f"w/l = 0.02, fold, Z = {distance(fold.point):.3f}"),
        (carried(case, DISTANCES[:1]).state, case, f"w/l = 0.02, touches, Z = {DISTANCES[0]:g}"),
        (last.state, case, f"w/l = 0.02, touches, Z = {DISTANCES[1]:g}"),
        (shape(wide.point), FINITE[-1], f"w/l = 0.05, fold, Z = {distance(wide.point):.3f}"),
        (begun(INEXTENSIBLE[2], SOFT), INEXTENSIBLE[2], f"wunderlich, w/l = 0.05, Z = {SOFT:g}"),
    ]
    for k, (state, one, title) in enumerate(shown):
        _drawn(figure.add_subplot(2, 6, k + 1, projection="3d"), state, one, title)
        figure.axes[-1].title.set_fontsize(7)
    left, right = figure.add_subplot(2, 2, 3), figure.add_subplot(2, 2, 4)
    for one in (ROD, *FINITE):
        states = [(distance(point), shape(point)) for point in branch(one).points]
        for axis, of in ((left, lambda s: s.end_support.force[2]), (right, lambda s: s.end_support.moment[2])):
            (line,) = axis.plot([z for z, _ in states], [of(s) for _, s in states], "-", label=one.name)
            if one in TOUCHING:
                touching = [(z, s) for z, s in carried(one, DISTANCES).film if s.pairs]
                axis.plot([z for z, _ in touching], [of(s) for _, s in touching], ".", color=line.get_color(), ms=3)
    left.set(xlabel="distance of the ends Z (l)", ylabel="tension (D w / l^2)", ylim=(0.0, 160.0))
    right.set(xlabel="distance of the ends Z (l)", ylabel="moment about the axis (D w / l)")
    left.legend(fontsize=7, title="dots: it lies on itself")
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    plt.close(figure)


PROBES = {
    "rod_coarse": lambda: distance(next(s.point for s in branch(ROD).specials if s.kind == "fold")),
    "soft_energy": lambda: begun(INEXTENSIBLE[0], SOFT).energy.total,
}


def run(out: Path) -> dict[str, Number]:
    rows = snap_rows()
    soft, off, special = smooth_rows()
    print("  ribbon_plectoneme: without contact", flush=True)
    touching, worst = contact_rows()
    print("  ribbon_plectoneme: with contact", flush=True)
    _picture(out / "ribbon_plectoneme.png")
    if special or not all(snaps(case)[0].settles for case in (ROD, *FINITE)) or worst["deep"] > 1e-6:
        raise AssertionError(f"{special}, {worst}")
    page.write(
        out / "ribbon_plectoneme.md", "A twisted ribbon whose ends come together",
        "python -m tests.validation ribbon_plectoneme", *_text(rows, soft, off, touching),
    )  # fmt: skip
    numbers = {
        "worst_energy": Number(worst["energy"], 0.5 * worst["energy"], "", ".0e"),
        "worst_push": Number(worst["push"], 0.5 * worst["push"], "", ".0e"),
        "deepest": Number(worst["deep"], worst["deep"], "l", ".0e"),
        "soft_off": Number(off, 0.5 * off, "", ".0e"),
        "rod_coarse": Number(PROBES["rod_coarse"](), abs(PROBES["rod_coarse"]() - snaps(ROD)[0].value), "l", ".7f"),
        "soft_energy": Number(PROBES["soft_energy"](), off * PROBES["soft_energy"](), "D w / l", ".3f"),
    }
    for name, case in zip(("rod", "w01", "w02", "w02_40", "w05"), (ROD, *FINITE), strict=True):
        where, tension, moment, *_ = snaps(case)
        numbers[f"snap_{name}"] = Number(where.value, where.error, "l", ".7f")
        numbers[f"tension_{name}"] = (
            Number(tension.value, tension.error, "D w / l^2", ".4f")
            if tension.settles
            else Number(tension.value, None, "D w / l^2", ".4f", "it does not settle over its meshes")
        )
        numbers[f"moment_{name}"] = Number(moment.value, moment.error, "D w / l", ".5f")
    return numbers


def _text(rows: list[list[str]], soft: list[list[str]], off: float, touching: list[list[str]]) -> tuple[str, ...]:
    return (
        f"A strip of length 1, nu = {NU:g}, straight at rest, between clamps along one axis (rulings free there), "
        f"turned against each other by {TURNS:g} turns and brought together to the distance Z; no weight, no friction. "
        f"Begun as a helix of as many turns, so that twist and writhe add up to {TURNS:g} in every model. `finite`: of "
        "finite width and thickness; the rod: `kirchhoff`, the same section's Y I, torsion and bending in its plane "
        f"(w/h = 20). {SEGMENTS} elements, limits and errors over elements halved twice. Forces in D w / l^2, "
        "energies in D w / l, lengths in l.",
        "## Where it snaps\n\nThe branch without contact ends at a fold. Near it the loop leaves the middle to one "
        "side or the other, before the fold or after it.",
        page.table(["strip", "w^2 / (h l)", "fold, Z", "loop leaves the middle, Z", "tension at the fold", "moment",
                    "energy", "twist (turns)"], rows),
        "A strip snaps earlier than the rod, at more tension and moment and with more of its turns still twist: its "
        "edges stretch, so that it is the stiffer the more it is twisted. What tells is w^2 / (h l) rather than w / l.",
        "## Inextensible: it does not snap\n\nSadowsky's and Wunderlich's strips have no fold, no fork and no unstable "
        f"state from Z = {FAR:g} to {NEAR:g}: they cannot twist without bending, and bend into the loop as the ends "
        f"come together. Energies change by up to {off:.0e} of them from {SEGMENTS} to {2 * SEGMENTS} elements.",
        page.table(["strip", "Z", "energy", "change", "tension", "moment", "twist (turns)", "link"], soft),
        "Between them and `finite` lies the strip that hardly stretches: it is not followed here.",
        "## After the snap\n\nWith contact (surface, edges; the thickness h apart) it jumps within the distances given "
        "and lies on itself at one place, edge on edge, off the middle, to one of two sides. *s*: abscissae of both; "
        "*v*: where across, in w. Energy and push off: against twice the elements.",
        page.table(["strip", "jumped, Z", "Z", "s", "v", "push", "tension", "moment", "energy", "energy off",
                    "push off", "twist (turns)", "lowest eigenvalue", "penetration", "push times gap"], touching),
        "Nearer than the last distance, and turned further: [the loop of a twisted ribbon](ribbon_loop.md). What does "
        "not hold: at w/l = 0.05 the way down from the fold does not arrive. Beside a shell, and with rulings "
        "held at the clamps: [the loop as a shell](loop_shell.md).",
        "![shapes, tension and moment over the distance](ribbon_plectoneme.png)",
    )  # fmt: skip
