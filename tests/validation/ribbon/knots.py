"""An overhand knot in a round rod without twist, pulled tight and loosened, with places and lines of contact.

It begins at a curve without contact and goes downhill without going through itself; then it is followed over the
distance of its clamps and over its diameter, on segments that follow what touches. Beside it the braid of a loose knot
by shooting (`tests.reference.braid`), a polygon with springs (`ribbon.find.jointed.polygon`) and the knot's
determinant (`tests.reference.knot_type`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import NamedTuple

import matplotlib.pyplot as plt
import numpy as np

from ribbon import Clamp
from ribbon.find.jointed import polygon as polylines
from ribbon.find.jointed import rounds
from ribbon.find.jointed.path import followed, refined
from ribbon.find.jointed.rounds import Jointed, settled
from ribbon.find.jointed.touching import Line, Touching
from ribbon.find.snap import landed
from ribbon.find.solve import build
from ribbon.find.solving.request import How
from ribbon.find.solving.verdict import judged
from ribbon.problems.mixed import MixedProblem
from ribbon.solvers.problem import Minimum
from tests.reference.braid import overhand
from tests.reference.knot_type import closed_far, determinant
from tests.validation import page
from tests.validation.number import Number
from tests.validation.ribbon.michell import STRIP, TORSION
from tests.validation.ribbon.ply import complementarity, depth

#: Diameter (l) and distance of the clamps (l) at which it begins, segments, and those of the polygon before it.
DIAMETER, DISTANCE, SEGMENTS, EDGES = 0.02, 0.4067, 100, 160
#: Distances to which it is pulled, diameters to which it becomes thinner, how often segments are halved.
PULLED, THINNER, HALVED = (0.42, 0.44, 0.5, 0.56, 0.62, 0.68, 0.72, 0.74), (0.0145, 0.0105, 0.0075), 2
#: Diameters to which it becomes thinner on segments halved once, and rows through which a parabola goes to h = 0.
THINNEST, _LAST = (0.005,), 4
#: An order above this is none: the changes are not yet those of the elements.
_MOST = 4.5
#: Over the diameter, how far apart the polygon's strands are at first.
_CLEAR = 1.1
#: Longest and shortest steps of the distance (l) and of the diameter's logarithm.
_PULL, _THIN = (5e-3, 2.5e-4), (0.03, 3e-3)
#: Twist (rad / l) that is none, and turns tried until there is none.
_UNTWISTED, _TURNS = 1e-6, 6
#: Where the shape that `downhill` ended in is kept (`keep`).
KEPT = Path(__file__).parents[2] / "reference" / "knots_overhand.csv"


class Knot(NamedTuple):
    """Distance and diameter (l), turn of the clamps (rad) at which there is no twist, and the equilibrium."""

    distance: float
    diameter: float
    turn: float
    jointed: Jointed


def rod(turn: float, distance: float, diameter: float, segments: int) -> MixedProblem:
    """The rod between clamps along z at this distance, turned by `turn` (rad)."""
    end = Clamp((0.0, 0.0, distance), (0.0, 0.0, 1.0), (-np.sin(turn), np.cos(turn), 0.0))
    found = build(STRIP, Clamp(), end=end, energy="kirchhoff", segments=segments, apart=diameter, round_rod=True)
    assert isinstance(found, MixedProblem)
    return found


def untwisted(knot: Knot) -> Knot:
    """The same with the turn of its clamps at which it has no twist: a turn more is as much more twist, all but."""
    _, diameter, turn, here = knot
    segments = round(1.0 / here.length)
    for _ in range(_TURNS):
        twist = float(here.state.tau([0.5])[0])
        if abs(twist) < _UNTWISTED:
            return knot._replace(turn=turn, jointed=here)
        best = None
        for way in (-1.0, 1.0):
            found = settled(rod(turn + way * twist, knot.distance, diameter, segments), here)
            if found is not None and (
                best is None or abs(found.state.tau([0.5])[0]) < abs(best[1].state.tau([0.5])[0])
            ):
                best = turn + way * twist, found
            if best is not None and abs(best[1].state.tau([0.5])[0]) < 0.5 * abs(twist):
                break
        if best is None:
            break
        turn, here = best
    raise AssertionError(f"twisted by {here.state.tau([0.5])[0]:.1e}")


@cache
def polygon() -> polylines.Polyline:
    """The knot as a polygon with springs, its strands a little farther from each other than they may be."""
    return polylines.relaxed(polylines.overhand(DISTANCE), _CLEAR * DIAMETER, EDGES, polylines.along_z(DISTANCE))


def downhill() -> Knot:
    """The equilibrium downhill of the polygon: minutes."""
    s = np.linspace(0.0, 1.0, SEGMENTS + 1)
    one, other, arrives, _ = polylines.fields(polygon().points, s, polylines.along_z(DISTANCE))
    turn = polylines.about_z(arrives)
    problem = rod(turn, DISTANCE, DIAMETER, SEGMENTS)
    state = landed(problem, problem.state(-one, np.zeros(s.size), other), How(check=False))
    length = 1.0 / SEGMENTS
    found = settled(problem, Jointed(state, rounds.begun(state).on(length), length))
    if found is None:
        raise AssertionError(f"no knot: {state.message}")
    return untwisted(Knot(DISTANCE, DIAMETER, turn, found))


@cache
def pulled(count: int) -> Knot:
    """At the distance of so many of `PULLED`."""
    if not count:
        return kept()
    was, to = pulled(count - 1), PULLED[count - 1]
    start = replace(was.jointed, even=True)
    reached, found = followed(lambda z: rod(was.turn, z, DIAMETER, SEGMENTS), start, was.distance, to, *_PULL)
    if reached != to:
        raise AssertionError(f"pulled to {reached} only")
    return untwisted(Knot(to, DIAMETER, was.turn, found))


@cache
def tightest() -> tuple[Jointed, Jointed]:
    """The tightest knot that is also found on segments halved once, and that."""
    for knot in reversed(pulls()):
        found = refined(rod(knot.turn, knot.distance, DIAMETER, 2 * SEGMENTS), knot.jointed)
        if found is not None:
            return knot.jointed, found
        print(f"knots: nothing on halved segments at {knot.distance:g}")
    raise AssertionError("no knot on halved segments")


@cache
def thinner(count: int) -> Knot:
    """Of so many of the diameters in `THINNER`."""
    if not count:
        return kept()
    return _thinned(thinner(count - 1), THINNER[count - 1], SEGMENTS)


def _thinned(was: Knot, diameter: float, segments: int) -> Knot:
    """The knot of another diameter, followed from one to it."""
    first, to = float(np.log(was.diameter)), float(np.log(diameter))
    reached, found = followed(
        lambda d: rod(was.turn, DISTANCE, float(np.exp(d)), segments), was.jointed, first, to, *_THIN
    )
    if reached != to:
        raise AssertionError(f"thinner to {np.exp(reached)} only")
    return untwisted(Knot(DISTANCE, diameter, was.turn, found))


@cache
def halved(times: int) -> Jointed:
    """The knot that it begins with on segments halved so often."""
    if not times:
        return kept().jointed
    found = refined(rod(kept().turn, DISTANCE, DIAMETER, SEGMENTS * 2**times), halved(times - 1))
    if found is None:
        raise AssertionError(f"nothing on segments halved {times} times")
    return found


@cache
def finer(count: int) -> Knot:
    """As `thinner`, on segments halved once; beyond its diameters those of `THINNEST`, followed on these."""
    beyond = count - len(THINNER)
    if beyond > 0:
        was = finer(count - 1)
        return _thinned(was, THINNEST[beyond - 1], 2 * SEGMENTS)
    knot = thinner(count)
    found = refined(rod(knot.turn, DISTANCE, knot.diameter, 2 * SEGMENTS), knot.jointed)
    if found is None:
        raise AssertionError(f"nothing on halved segments of diameter {knot.diameter:g}")
    return knot._replace(jointed=found)


@cache
def loose() -> tuple[Knot, ...]:
    """The knots of all diameters on halved segments, thickest first, as far as they are reached."""
    return _as_far(finer, len(THINNER) + len(THINNEST))


@cache
def pulls() -> tuple[Knot, ...]:
    """The knots of the distances, as far as they are reached."""
    return _as_far(pulled, len(PULLED))


def _as_far(knot: Callable[[int], Knot], count: int) -> tuple[Knot, ...]:
    found = [knot(0)]
    for k in range(1, count + 1):
        try:
            found.append(knot(k))
        except AssertionError as error:
            print(f"knots: {error}")
            break
    return tuple(found)


# -- kept: a shape to begin at without the way downhill --------------------------------------------------------------


def keep(path: Path, knot: Knot) -> None:
    """Writes the shape and what touches: rows of a name and numbers."""
    here = knot.jointed
    problem = here.state.problem
    assert isinstance(problem, MixedProblem)
    omega, tau = problem.joint_values(here.state.x)
    other = problem.in_plane_values(here.state.x)
    rows = [("turn", [knot.turn]), ("lengths", problem.lengths), ("omega", omega), ("tau", tau), ("other", other),
            ("counts", here.counts), ("push", here.pushes)]  # fmt: skip
    rows += [("place", place) for place in here.touching.places]
    rows += [("line", (line.begin, line.end, *line.facing)) for line in here.touching.lines]
    text = "\n".join(",".join([name, *(f"{v:.15g}" for v in np.asarray(values))]) for name, values in rows)
    path.write_text(text + "\n")


@cache
def kept() -> Knot:
    """What `downhill` ended in, settled from the shape that is kept."""
    own: dict[str, list[np.ndarray]] = {}
    for row in KEPT.read_text().splitlines():
        name, *values = row.split(",")
        own.setdefault(name, []).append(np.array(values, dtype=float))
    lines = tuple(Line(float(v[0]), float(v[1]), tuple(map(float, v[2:]))) for v in own["line"])
    touching = Touching(tuple((float(a), float(b)) for a, b in own["place"]), lines)
    turn = float(own["turn"][0][0])
    whole = rod(turn, DISTANCE, DIAMETER, SEGMENTS)
    problem = whole.with_changes(lengths=own["lengths"][0], pairs=touching.pairs())
    x = problem.state(own["omega"][0], own["tau"][0], own["other"][0])
    rows = np.zeros(problem.row_count)
    rows[problem.block_slices()["pairs"]] = -own["push"][0]
    start = Minimum(x, np.zeros(problem.size), rows, 1.0, 0, 0, "", False, 0.0, "newton")
    counts = tuple(int(v) for v in own["counts"][0])
    here = Jointed(judged(problem, start, How(check=False)), touching, 1.0 / SEGMENTS, counts)
    found = settled(whole, here)
    if found is None:
        raise AssertionError("no knot from the shape that is kept")
    return Knot(DISTANCE, DIAMETER, turn, found)


# -- what is measured ------------------------------------------------------------------------------------------------


class Measured(NamedTuple):
    """Pull and forces (D w / l^2) of a place (mean of both), at both ends of the line and on all of it; abscissae (l)
    of the place from the middle and half of the line's length; size of the loop over that of a circle under this pull;
    determinant; strain: of the strip's surface where it bends most, half of the diameter times the curvature."""

    pull: float
    place: float
    line: float
    at: float
    half: float
    loop: float
    determinant: int
    strain: float

    def scaled(self, diameter: float) -> tuple[float, float, float, float, float]:
        """Thickness h / R of a circle under the pull, and in the units of the braid: place, half of the line, force of
        a place, all that the line pushes with."""
        radius = np.sqrt(0.5 / self.pull)
        long = np.sqrt(diameter * radius)
        force = 0.5 * diameter / long**3
        return (diameter / radius, self.at / long, self.half / long, self.place / force, self.line / force)


def measured(here: Jointed) -> Measured:
    state, touching = here.state, here.touching
    support = state.end_support
    assert support is not None
    if len(touching.places) != 2 or len(touching.lines) != 1:
        raise AssertionError(f"another contact: {touching}")
    count, line = len(touching.places), touching.lines[0]
    (first, _), (last, _) = touching.places
    points = state.position(np.linspace(0.0, 1.0, 401))
    middle, top = state.position([0.5 * (first + last), 0.5])
    pull = float(support.force[2])
    return Measured(
        pull, float(here.pushes[:count].mean()), float(here.pushes[count:].sum()), 0.5 * (last - first),
        0.5 * (line.end - line.begin), float(np.linalg.norm(top - middle) / (2.0 * np.sqrt(0.5 / pull))),
        determinant(closed_far(points)), _strain(here),
    )  # fmt: skip


def _strain(here: Jointed) -> float:
    problem = here.state.problem
    assert isinstance(problem, MixedProblem)
    one, other = problem.joint_values(here.state.x)[0], problem.in_plane_values(here.state.x)
    return 0.5 * float(problem.apart) * float(np.hypot(one, other).max())


def _row(knot: Knot, off: dict[str, float]) -> list[str]:
    here, own = knot.jointed, measured(knot.jointed)
    state, line = here.state, here.touching.lines[0]
    (s, other), _ = here.touching.places
    each = {"deep": depth(state), "product": complementarity(state), "twist": abs(float(state.tau([0.5])[0])),
            "uneven": float(np.ptp(here.pushes[:2])) / own.place}  # fmt: skip
    for name, value in each.items():
        off[name] = max(off.get(name, 0.0), value)
    if not state.ok or own.determinant != 3:
        raise AssertionError(f"{state.message}, determinant {own.determinant}")
    return [f"{knot.distance:g}", f"{knot.diameter:g}", f"{own.pull:.3f}", f"{own.scaled(knot.diameter)[0]:.4f}",
            f"{own.loop:.3f}", f"{state.energy.total:.5f}", f"{s:.4f}, {other:.4f}", f"{own.place:.2f}",
            f"{line.begin:.4f} to {line.end:.4f}", f"{own.line:.2f}", f"{own.strain:.3f}",
            f"{state.lowest_eigenvalue:.4f}", f"{each['deep']:.0e}", f"{each['product']:.0e}",
            str(own.determinant)]  # fmt: skip


def thin_coarse() -> np.ndarray:
    """`Measured.scaled` (k, 5) of the diameters, on halved segments, thickest first."""
    return np.array([measured(knot.jointed).scaled(knot.diameter) for knot in loose()])


def thin() -> np.ndarray:
    """The same on segments halved once more."""
    return np.array([still_finer(count) for count in range(len(loose()))])


def limit(values: np.ndarray, meshes: np.ndarray) -> tuple[list[float], list[float]]:
    """Place, half line, force and push (4,) at h / R = 0 of rows of `thin`: by parabolas in the root of h / R through
    the last (least squares); and how far from them the farthest of other ways is: a line or a parabola through the last
    three, a cubic through all, and the parabola of rows that are off by `meshes` (4,)."""

    def at_zero(rows: np.ndarray, degree: int) -> np.ndarray:
        root = np.sqrt(rows[:, 0])
        return np.array([np.polynomial.Polynomial.fit(root, rows[:, k], degree)(0.0) for k in range(1, 5)])

    told = at_zero(values[-_LAST:], 2)
    shaken = [values[-_LAST:].copy() for _ in range(_LAST)]
    for k, rows in enumerate(shaken):
        rows[k, 1:] += meshes
    others = [at_zero(values[-3:], 1), at_zero(values[-3:], 2), at_zero(values, 3), *(at_zero(r, 2) for r in shaken)]
    return told.tolist(), np.max([np.abs(each - told) for each in others], axis=0).tolist()


def _times(zero: Sequence[float], known: Sequence[float], open_: Sequence[float]) -> str:
    """How many times the stated difference the farthest of the braid's numbers is away."""
    return f"{max(abs(a - b) / e for a, b, e in zip(zero, known, open_, strict=True)):.1f}"


@cache
def still_finer(count: int) -> np.ndarray:
    """The row of `thin` of a loose knot on segments halved once more."""
    knot = finer(count)
    found = refined(rod(knot.turn, DISTANCE, knot.diameter, 4 * SEGMENTS), knot.jointed)
    if found is None:
        raise AssertionError(f"nothing on segments halved twice of diameter {knot.diameter:g}")
    return np.array(measured(found).scaled(knot.diameter))


def _numbers(here: Jointed) -> list[str]:
    own = measured(here)
    values = (here.state.energy.total, own.pull, own.place, own.line, own.half)
    return [str(here.state.problem.lengths.size), *(f"{v:.7f}" for v in values), f"{depth(here.state):.0e}",
            f"{complementarity(here.state):.0e}"]  # fmt: skip


def orders() -> tuple[list[list[str]], dict[str, tuple[float, float]]]:
    """Rows of the knot on halved segments, and of each number what the last halving changed and the order."""
    all_of = {"energy": [], "pull": [], "place": [], "line": [], "half": []}  # type: dict[str, list[float]]
    rows = []
    for times in range(HALVED + 1):
        here = halved(times)
        own = measured(here)
        values = (here.state.energy.total, own.pull, own.place, own.line, own.half)
        for each, value in zip(all_of.values(), values, strict=True):
            each.append(value)
        rows.append(_numbers(here))
    changes = {}
    for name, (a, b, c) in all_of.items():
        changes[name] = abs(c - b), float(np.log2(abs(b - a) / abs(c - b)))
    told = [f"{v:.1e}" + (f" (order {order:.1f})" if order <= _MOST else "") for v, order in changes.values()]
    rows.append(["changed by the last", *told, "", ""])
    return rows, changes


def _picture(path: Path) -> None:
    figure = plt.figure(figsize=(13, 8))
    shown = [(f"begun, h = {DIAMETER:g}", kept()), (f"pulled to {pulls()[-1].distance:g}", pulls()[-1]),
             (f"h = {loose()[-1].diameter:g}", loose()[-1])]  # fmt: skip
    for k, (title, knot) in enumerate(shown):
        axes = figure.add_subplot(2, 3, k + 1, projection="3d")
        here = knot.jointed
        r = here.state.position(np.linspace(0.0, 1.0, 1201))
        axes.plot(*r[:601].T, color="tab:blue", lw=3)
        axes.plot(*r[600:].T, color="tab:orange", lw=3)
        places = [s for s, _ in here.touching.places] + list(here.touching.lines[0].stations)
        axes.plot(*here.state.position(places).T, "k.", ms=5)
        axes.set(title=title)
        axes.set_aspect("equal")
        axes.view_init(25, -60)
        axes.set_axis_off()
    left, middle, right = (figure.add_subplot(2, 3, k) for k in (4, 5, 6))
    every = pulls()
    left.plot([knot.distance for knot in every], [measured(knot.jointed).pull for knot in every], "o-")
    left.set(xlabel="distance of the clamps (l)", ylabel="pull (D w / l^2)", title=f"h = {DIAMETER:g}")
    known = overhand()
    values = thin()
    names = ("place / (h R)^(1/2)", "half line / (h R)^(1/2)", "force of a place", "push of the line")
    for k, (name, value) in enumerate(zip(names, (known.place, known.line, known.force, known.push), strict=True)):
        axes = middle if k < 2 else right
        (drawn,) = axes.plot(np.sqrt(values[:, 0]), values[:, k + 1], "o-", label=name)
        axes.plot([0.0], [value], "*", ms=12, color=drawn.get_color())
    right.set_ylabel("over B h / (2 (h R)^(3/2))")
    for axes in (middle, right):
        axes.set(xlabel="(h / R)^(1/2)", title="dots: knot; stars: braid of a loose one")
        axes.set_xlim(left=0.0)
        axes.set_ylim(bottom=0.0)
        axes.legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    plt.close(figure)


PROBES = {
    "energy": lambda: kept().jointed.state.energy.total,
    "place": lambda: measured(kept().jointed).place,
    "braid_force": lambda: overhand().force,
    "braid_place": lambda: overhand().place,
}

_HEADS = ["clamps apart", "h", "pull F", "h / R", "loop / 2 R", "energy", "place (s, s')", "its force", "line (s)",
          "its push in all", "h / 2 times curvature", "lowest eigenvalue", "penetration", "push times gap",
          "determinant"]  # fmt: skip


def run(out: Path) -> dict[str, Number]:
    off: dict[str, float] = {}
    rows = [_row(knot, off) for knot in pulls()]
    rows += [_row(knot, off) for knot in loose()[1:]]
    table, changes = orders()
    tight = [_numbers(here) for here in tightest()]
    values, known = thin(), overhand()
    coarse = thin_coarse()
    meshes = np.abs(values - coarse)[:, 1:].max(axis=0)
    zero, open_ = limit(values, meshes)
    theory = [known.place, known.line, known.force, known.push]
    scaled = [[f"{knot.diameter:g}", *(f"{v:.4f}" for v in each)] for knot, each in zip(loose(), values, strict=True)]
    scaled.append(["to 0", "0", *(f"{v:.3f} +- {e:.3f}" for v, e in zip(zero, open_, strict=True))])
    scaled.append(["changed by the last halving", "", *(f"{v:.4f}" for v in meshes)])
    scaled.append(["braid", "0", *(f"{v:.5f}" for v in theory)])
    soft = polylines.relaxed(polylines.overhand(DISTANCE), DIAMETER, EDGES, polylines.along_z(DISTANCE))
    energy, own = halved(HALVED).state.energy.total, measured(halved(HALVED))
    soft_off = abs(soft.energy / energy - 1.0)
    _picture(out / "knots.png")
    page.write(
        out / "knots.md",
        "An overhand knot in a round rod",
        "python -m tests.validation knots",
        f"A straight round rod of length 1 and diameter h, torsional over bending stiffness {TORSION:.4f}, tied into "
        "an overhand knot between clamps along one axis, which are turned so that it has no twist (`kirchhoff`, no "
        "friction, on segments that follow what touches: `ribbon.find.jointed`). Forces in D w / l^2, energies in "
        "D w / l, lengths in l. It began at a drawn curve without contact, made smooth as a polygon, from which it "
        "went downhill without going through itself (kept: that takes minutes); then its clamps are moved, or its "
        "diameter. *Determinant*: of the "
        "knot, from the crossings of its projection by other code: 3, that of a trefoil, in every row.",
        "It touches itself at a place, along a line, and at a place. Its strands run the same way on the line, other "
        "than those of a ply. Its two places push alike to "
        f"{off['uneven']:.0e}. R = (D w / (2 F))^(1/2) is the radius of a circle that holds the pull F; *loop*: from "
        f"the middle of the braid to the top of the loop, over 2 R. Rows of h = {DIAMETER:g} on {SEGMENTS} segments "
        f"and some more, those of thinner ones on {2 * SEGMENTS}:",
        page.table(_HEADS, rows),
        f"From {DISTANCE:g} to {pulls()[-1].distance:g} apart what touches stays a place, a line and a place: no other "
        "place opens and none closes. The ends of the line push less over its middle. The tightest on "
        "segments halved once, as far as it is found there:",
        page.table(["segments", "energy", "pull", "force of a place", "push of the line", "half of the line",
                    "penetration", "push times gap"], tight),
        f"The first row on segments halved {HALVED} times:",
        page.table(["segments", "energy", "pull", "force of a place", "push of the line", "half of the line",
                    "penetration", "push times gap"], table),
        "A loose knot: h / R goes to 0. Lengths over (h R)^(1/2), forces over B h / (2 (h R)^(3/2)), B = D w; beside "
        "them the braid of two strands by shooting (`tests.reference.braid`), which is of leading order, so that the "
        f"root of h / R is left over. Segments halved once more than above. *To 0*: parabolas in that root through the "
        f"last {_LAST} rows; +-: the farthest of a line and a parabola through the last three, a cubic through all, "
        "and the same parabola with one row changed by as much as the last halving changed the rows: not the error of "
        f"a limit whose order is not known. The braid is within {_times(zero, theory, open_)} times that.",
        page.table(["h", "h / R", "place", "half of the line", "force of a place", "push of the line"], scaled),
        f"A polygon of {EDGES} edges with springs for contact has the energy {soft.energy:.2f}, "
        f"{100.0 * soft_off:.1f} % from the first row's.",
        "What does not hold: tighter knots (its clamps' turn kept it goes in ever smaller steps to 0.7474 "
        "and a pull of 1001, h / R = 0.895, where it stopped: stations that are even on one strand are uneven on the "
        "other, whose surface bends the other way); without friction alone. A scene asks for it with "
        "`seed.curve` and `contact.joints` ([how](../docs/scenes.md)). A closed trefoil is [another page](trefoil.md).",
        "![shapes, pull, and what touches over the root of h / R](knots.png)",
    )  # fmt: skip
    far = max(abs(a / b - 1.0) for a, b in zip(zero, theory, strict=True))
    if off["deep"] > 1e-6 or off["product"] > 1e-8 or changes["energy"][0] > 1e-5 or soft_off > 0.05:
        raise AssertionError(f"{off}, {changes}, {soft_off}")
    first, last = kept().jointed, pulls()[-1]
    place, pull = measured(first).place, measured(last.jointed).pull
    coarse_pull, fine_pull = (measured(here).pull for here in tightest())
    pull_off = pull * max(abs(fine_pull / coarse_pull - 1.0), 1e-5)
    return {
        "energy": Number(first.state.energy.total, abs(first.state.energy.total - energy), "D w / l", ".4f"),
        "place": Number(place, abs(place - own.place), "D w / l^2", ".1f"),
        "order": Number(changes["place"][1], 1.0, "", ".1f"),
        "distance": Number(last.distance, 0.0, "l", "g"),
        "pull": Number(pull, pull_off, "D w / l^2", ".1f"),
        "tight": Number(measured(last.jointed).scaled(DIAMETER)[0], 1e-3, "", ".2f"),
        "loose": Number(float(values[-1, 0]), 1e-3, "", ".2f"),
        "force_zero": Number(zero[2], open_[2], "", ".3f"),
        "place_zero": Number(zero[0], open_[0], "", ".2f"),
        "line_zero": Number(zero[1], open_[1], "", ".2f"),
        "push_zero": Number(zero[3], open_[3], "", ".2f"),
        "braid_force": Number(known.force, 1e-8, "", ".5f"),
        "braid_place": Number(known.place, 1e-8, "", ".5f"),
        "braid_line": Number(known.line, 1e-8, "", ".5f"),
        "braid_push": Number(known.push, 1e-6, "", ".5f"),
        "limit_off": Number(100.0 * far, 50.0 * far, "%", ".0f"),
        "soft_off": Number(100.0 * soft_off, 50.0 * soft_off, "%", ".1f"),
        "deepest": Number(off["deep"], off["deep"] or 1e-12, "l", ".0e"),
        "complementarity": Number(off["product"], off["product"], "D w / l", ".0e"),
    }
