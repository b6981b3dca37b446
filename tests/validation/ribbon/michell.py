"""Michell's ring beyond its critical turn: from the circle to strands that touch at one place, at two, and along lines.

A straight rod of round section is joined after its end was turned by T about the tangent. The circle is stable up to
T = 2 pi sqrt(3) B / C (J. H. Michell 1889); beyond it the ring writhes, snaps, and lies on itself as B. D. Coleman and
D. Swigon (2000, doi:10.1023/A:1010911113919) have it. Beside it a quarter of the ring by shooting, with forces at its
places of contact (`tests.reference.touching_ring`), and the writhe by Gauss's integral over the shape.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import brentq

from ribbon import Clamp, Equilibrium, Strip
from ribbon.energies.section.rod import stiffnesses
from ribbon.find.continuation import anchored, follow
from ribbon.find.snap import landed
from ribbon.find.solve import build, solve
from ribbon.find.solving.request import How
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.transfer import transferred
from tests.reference import touching_ring as reference
from tests.reference.balanced_ply import of_twist
from tests.validation import page
from tests.validation.number import Number
from tests.validation.ribbon.ply import complementarity, depth

#: Torsional over bending stiffness, diameter of the rod (l), critical turn (rad).
TORSION, APART = 2.0 / 3.0, 0.02
CRITICAL = 2.0 * np.pi * np.sqrt(3.0) / TORSION
_WIDTH = 0.01
#: Turns (rad) that are looked at on the way up from where it has snapped, and on the way down.
SNAPPED = 1.002 * CRITICAL
UP, DOWN = (17.0, 18.5, 19.6, 21.1), (16.0, 15.4, 14.0, 12.0, 10.5)
SEGMENTS, FEWER = 100, 80
#: Segments on which one place and two are looked at, and at which turns; up to which turn on fewer.
ORDERS, ONE, TWO, LESS = (40, 80, 100), 14.0, 17.0, 18.5
#: Up to how many segments joints are put at two places.
_JOINTS = 80
#: Up to which turn there is a shooting of two places.
_SHOT = 17.5
#: How far the circle is moved along its mode, over the rod's diameter.
_KICK = 0.2
#: Part of the largest force from which a place is one that touches.
_CLEARLY = 1e-3
#: Unknowns of the shooting to begin with (of one place: x, a, t, n_2, n_3; of two also s and F), and curvatures of the
#: apex to begin at; steps of the curvature along a branch, and chords of a quarter for the writhe.
_ONE = (17.0, (0.196, -0.008, 4.1, -86.63, 30.97))
_TWO = (22.01, (0.20908, -1.10255, 6.48049, -19.34, 167.567, 0.2308, 201.19))
_STEP, _CHORDS = 0.05, 50


def _strip(nu: float) -> Strip:
    """Of a section that bends alike both ways: (1 - nu^2) (w / h)^2 = 1."""
    return Strip(1.0, _WIDTH, nu, thickness=_WIDTH * np.sqrt(1.0 - nu**2))


def _torsion(nu: float) -> float:
    return float(stiffnesses((0.5 * _WIDTH, _WIDTH * np.sqrt(1.0 - nu**2), nu, 0.0))[1])


#: A rod whose torsional stiffness is `TORSION`.
STRIP = _strip(brentq(lambda nu: _torsion(nu) - TORSION, 0.05, 0.45, xtol=1e-15))


def ring(turn: float, segments: int) -> MixedProblem:
    """The rod whose ends are at one place along one tangent, turned by `turn` (rad) against each other."""
    end = Clamp((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (-np.sin(turn), np.cos(turn), 0.0))
    found = build(STRIP, Clamp(), end=end, energy="kirchhoff", segments=segments, apart=APART, round_rod=True)
    assert isinstance(found, MixedProblem)
    return found


def _on(state: Equilibrium, begin: float, end: float, step: float) -> Equilibrium:
    """From one turn to another, by steps of about so many rad."""
    segments = state.problem.lengths.size
    steps = max(1, round(abs(end - begin) / step))
    return follow(lambda t: ring(begin + (end - begin) * t, segments), state, steps=steps)


@cache
def circle(segments: int, share: float) -> Equilibrium:
    """The circle at a share of its critical turn, below 1."""
    if share <= 0.98:
        flat = ring(0.0, segments)
        state = solve(
            STRIP, flat.start, end=flat.end, energy="kirchhoff", segments=segments, seed_curvature=2.0 * np.pi,
            apart=APART, round_rod=True,
        )  # fmt: skip
        return _on(state, 0.0, share * CRITICAL, 1.4)
    return _on(circle(segments, 0.98), 0.98 * CRITICAL, share * CRITICAL, 0.2)


@cache
def snapped(segments: int) -> Equilibrium:
    """Where the circle goes beyond its critical turn, moved along its mode to the side on which the seam is an apex."""
    state = circle(segments, 0.999)
    problem = anchored(ring(SNAPPED, segments), state)
    layout = state.problem.layout
    places, mode = layout.positions(state.x), layout.positions(state.mode)
    side = np.sign(mode[segments // 2] @ places[segments // 2]) * _KICK * APART / np.abs(mode).max()
    return landed(problem, state.x + side * state.mode, How())


@cache
def at(segments: int, stages: tuple[float, ...]) -> Equilibrium:
    """The ring at the last of the turns, each reached from the one before, the first from where it snapped."""
    if not stages:
        return snapped(segments)
    before = (SNAPPED, *stages)[-2]
    return _on(at(segments, stages[:-1]), before, stages[-1], 0.5)


def critical(segments: int) -> float:
    """The turn at which the circle's lowest eigenvalue is zero, over Michell's, from two just before it."""
    shares = (0.998, 0.9995)
    low, high = (circle(segments, share).lowest_eigenvalue for share in shares)
    return shares[1] + (shares[1] - shares[0]) * high / (low - high)


def pushes(state: Equilibrium) -> np.ndarray:
    """Places (k, 2) that push clearly, and with what (k,), D w / l^2: columns s, s', force."""
    found = np.array([[pair.s, pair.s_other, np.linalg.norm(pair.force)] for pair in state.pairs]).reshape(-1, 3)
    return found[found[:, 2] > _CLEARLY * found[:, 2].max(initial=0.0)]


def writhe(state: Equilibrium) -> float:
    """Gauss's integral over the ring, from polygons of 480 and 960 chords (order 2)."""
    coarse, fine = (reference.writhe(state.position(np.arange(n) / n)) for n in (480, 960))
    return (4.0 * fine - coarse) / 3.0


def held(state: Equilibrium) -> float:
    """With what (D w / l^2) the rows against sliding and turning hold it."""
    return float(np.abs(state.rows[state.problem.block_slices()["gauge_ring"]]).max())


# -- by shooting -----------------------------------------------------------------------------------------------------


@cache
def branch(places: int) -> tuple[reference.Ring, ...]:
    """The rings of one place or of two, by the curvature of the apex."""
    begin, guess = _ONE if places == 1 else _TWO
    found = {}
    for step, last in ((-_STEP, 16.9 if places == 1 else 21.17), (_STEP, 21.25 if places == 1 else 22.85)):
        v, apex = np.array(guess), begin
        while (last - apex) * step >= 0.0:
            try:
                one = reference.ring(apex, TORSION, APART, v, places, chords=_CHORDS)
            except ValueError:
                break
            found[round(apex, 6)], v, apex = one, one.unknowns, apex + step
    return tuple(found[apex] for apex in sorted(found))


def shot(turn: float, places: int) -> reference.Ring:
    """The ring of the turn with so many places, on the stable part of its branch."""
    every = branch(places)
    turns = np.array([one.turn for one in every])
    stable = slice(0, int(turns.argmax()) + 1) if places == 1 else slice(int(turns.argmin()), len(every))
    k = int(np.searchsorted(turns[stable], turn)) + (stable.start or 0)
    return reference.of_turn(turn, TORSION, APART, every[k - 1].unknowns, (every[k - 1].apex, every[k].apex), places)


def fold(places: int) -> float:
    """The greatest turn with one place of contact, or the least with two, from a parabola through three rings."""
    every = branch(places)
    turns = np.array([one.turn for one in every])
    k = int(turns.argmax() if places == 1 else turns.argmin())
    k = min(max(k, 1), len(every) - 2)
    a, b, c = np.polyfit([one.apex - every[k].apex for one in every[k - 1 : k + 2]], turns[k - 1 : k + 2], 2)
    return float(c - 0.25 * b * b / a)


def opened() -> float:
    """The turn at which one place of contact pushes no more."""
    first = branch(1)[0]
    return reference.opened(TORSION, APART, np.append(first.unknowns, first.apex)).turn


# -- the page --------------------------------------------------------------------------------------------------------


def regime(state: Equilibrium) -> str:
    """How strands touch: "" (not at all), the number of places, or that of stations on lines between places."""
    found = pushes(state)
    h = 1.2 / state.problem.lengths.size
    runs = np.split(found, np.nonzero(np.diff(found[:, 0]) > h)[0] + 1) if len(found) else []
    names = [f"line {run[0, 0]:.3f} to {run[-1, 0]:.3f}" if len(run) > 2 else f"{run[:, 0].mean():.4f}" for run in runs]
    return "; ".join(names)


def compared() -> tuple[list[list[str]], dict[str, float]]:
    """Rows of the table of states, and the largest differences from the shooting by what they are of."""
    cases = [(up[-1], up) for up in reached()] + [(turn, DOWN[: k + 1]) for k, turn in enumerate(DOWN)]
    rows, off = [], dict.fromkeys(("energy", "force", "writhe", "sum", "deep", "product", "held", "coarse"), 0.0)
    for turn, stages in sorted(cases):
        state, few = at(SEGMENTS, stages), at(FEWER, stages) if turn <= LESS else None
        if not (state.ok and (few is None or few.ok)):
            raise AssertionError(f"{turn}: {state.message}; {few and few.message}")
        found, twist, own = pushes(state), float(state.tau([0.1])[0]), writhe(state)
        beside = shot(turn, 1 if turn < 15.9 else 2) if turn <= _SHOT else None
        each = {"sum": abs(twist + 2.0 * np.pi * own - turn), "deep": depth(state), "product": complementarity(state),
                "held": held(state) / max(1.0, found[:, 2].max())}  # fmt: skip
        if few is not None:
            each["coarse"] = abs(few.energy.total / state.energy.total - 1.0)
        if beside is not None:
            each["energy"] = abs(state.energy.total / beside.energy - 1.0)
            each["force"] = abs(found[0, 2] / beside.force - 1.0)
            each["writhe"] = abs(own - beside.writhe)
        off = {name: max(value, each.get(name, 0.0)) for name, value in off.items()}
        rows.append([f"{turn:g}", str(len(found)), regime(state), f"{found[:, 2].sum():.2f}", f"{twist:.4f}",
                     f"{TORSION * twist:.3f}", f"{own:.5f}", f"{each['sum']:.0e}", f"{state.energy.total:.4f}",
                     *(f"{each[k]:.0e}" if k in each else "" for k in ("coarse", "energy", "force")),
                     f"{state.lowest_eigenvalue:.4f}", f"{each['deep']:.0e}", f"{each['product']:.0e}"])  # fmt: skip
    return rows, off


def with_joints(state: Equilibrium) -> Equilibrium:
    """The equilibrium on as many segments, of which a joint is at each place that pushes: no force within a segment."""
    joints = np.concatenate([[0.0], np.cumsum(state.problem.lengths)])
    joints[-1] = 1.0
    for place in pushes(state)[:, :2].ravel():
        joints[np.argmin(np.abs(joints - place))] = place
    problem = anchored(state.problem.with_changes(lengths=np.diff(joints), pairs=()), state)
    return landed(problem, transferred(state.problem, state.x, problem), How())


def orders() -> list[list[str]]:
    """Rows of energy's and force's differences from the shooting over the segments, at one place, which is a joint, and
    at two, which are within segments, and at joints."""
    rows, one, two = [], shot(ONE, 1), shot(TWO, 2)
    for n in ORDERS:
        states = [(at(n, tuple(t for t in DOWN if t >= ONE)), one), (at(n, (TWO,)), two)]
        if n <= _JOINTS:
            states.append((with_joints(states[1][0]), two))
        cells = []
        for state, known in states:
            if not state.ok:
                raise AssertionError(f"{n}: {state.message}")
            cells += [f"{abs(state.energy.total / known.energy - 1.0):.1e}",
                      f"{abs(pushes(state)[0, 2] / known.force - 1.0):.1e}"]  # fmt: skip
        rows.append([str(n), *cells, *[""] * (6 - len(cells))])
    return rows


def reached() -> list[tuple[float, ...]]:
    """The turns on the way up, with those before them, as far as the path goes."""
    found = []
    for k in range(len(UP)):
        if not at(SEGMENTS, UP[: k + 1]).ok:
            break
        found.append(UP[: k + 1])
    return found


def _picture(path: Path) -> None:
    figure = plt.figure(figsize=(12, 7.5))
    shown = [("circle, 16.31", circle(SEGMENTS, 0.999)), ("one place, 14", at(SEGMENTS, DOWN[:3])),
             ("two places, 17", at(SEGMENTS, UP[:1])),
             (f"lines, {reached()[-1][-1]:g}", at(SEGMENTS, reached()[-1]))]  # fmt: skip
    for k, (title, state) in enumerate(shown):
        axes = figure.add_subplot(2, 4, k + 1, projection="3d")
        r = state.position(np.linspace(0.0, 1.0, 1201))
        r = (r - r.mean(axis=0)) @ np.linalg.svd(r - r.mean(axis=0), full_matrices=False)[2].T
        axes.plot(*r[:601].T, color="tab:blue", lw=3)
        axes.plot(*r[600:].T, color="tab:orange", lw=3)
        found = pushes(state)
        if len(found):
            places = r[np.round(found[:, 0] * 1200).astype(int)]
            axes.plot(*places.T, "k.", ms=5)
        axes.set(title=title, xlim=(-0.2, 0.2), ylim=(-0.2, 0.2), zlim=(-0.2, 0.2))
        axes.set_box_aspect((1, 1, 1), zoom=1.4)
        axes.view_init(60, -75)
        axes.set_axis_off()
    left, right = figure.add_subplot(2, 2, 3), figure.add_subplot(2, 2, 4)
    for places, name in ((1, "one place"), (2, "two places")):
        every = branch(places)
        left.plot([one.turn for one in every], [one.writhe for one in every], "-", label=f"{name}, shooting")
        right.plot([one.turn for one in every], [one.force for one in every], "-", label=f"{name}, shooting")
    cases = [(up[-1], at(SEGMENTS, up)) for up in reached()]
    cases += [(turn, at(SEGMENTS, DOWN[: k + 1])) for k, turn in enumerate(DOWN)]
    left.plot([turn for turn, _ in cases], [writhe(state) for _, state in cases], "k.", label=f"{SEGMENTS} segments")
    right.plot([turn for turn, _ in cases], [pushes(s)[:, 2].max() for _, s in cases], "k.")
    left.plot([8.0, CRITICAL], [0.0, 0.0], "k-", lw=1, label="circle")
    left.axvline(CRITICAL, color="k", ls=":")
    left.set(xlabel="turn T (rad)", ylabel="writhe")
    right.set(xlabel="turn T (rad)", ylabel="largest force of a place (D w / l^2)")
    left.legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    plt.close(figure)


@cache
def _few() -> Equilibrium:
    return snapped(40)


PROBES = {
    "probe_energy": lambda: _few().energy.total,
    "probe_force": lambda: float(pushes(_few())[0, 2]),
    "shot_force": lambda: reference.ring(17.0, TORSION, APART, np.array(_ONE[1])).force,
}


def run(out: Path) -> dict[str, Number]:
    counts = (30, 60, 120)
    offs = [abs(critical(n) - 1.0) for n in counts]
    rows, off = compared()
    by_order = orders()
    _picture(out / "michell.png")
    folds = fold(1), fold(2), opened()
    few, fine = _few(), snapped(SEGMENTS)
    push = float(pushes(few)[0, 2])
    up = reached()[-1]
    last = at(SEGMENTS, up)
    crossed = 0.5 * float(np.arccos(-np.dot(*state_tangents(last))))
    ply = of_twist(abs(float(last.tau([0.1])[0])), 0.5 * APART, TORSION).angle
    page.write(
        out / "michell.md",
        "Michell's ring beyond its critical turn",
        "python -m tests.validation michell",
        f"A straight round rod of length 1 and diameter {APART:g}, torsional over bending stiffness {TORSION:.4f}, its "
        "ends joined after one was turned by T about the tangent (`kirchhoff`, both ends held at one place; no "
        "friction). Forces in D w / l^2, energies in D w / l, lengths in l. What does not hold: on these equal "
        "segments a line is begun, not followed far, and nothing stands beside it; both on segments that follow the "
        "places: [lines of contact](contact_lines.md). Elements have one order, so that they settle in the number of "
        "segments alone.",
        f"The circle is stable up to T = 2 pi sqrt(3) / {TORSION:.4f} = {CRITICAL:.5f} (Michell 1889): its lowest "
        f"eigenvalue vanishes there to {offs[0]:.0e}, {offs[1]:.0e} and {offs[2]:.0e} of it on "
        f"{counts[0]}, {counts[1]} and {counts[2]} segments. Beyond, it snaps to two places of contact. They come "
        f"together as T falls, the branch ends at {folds[1]:.2f}, and the ring snaps to one place, which lasts up to "
        f"{folds[0]:.3f} and down to {folds[2]:.4f}, where it pushes no more and the ring springs back to the circle: "
        "between these the circle and one place, and for a little one place and two, are stable at the same turn "
        "(all three by shooting; forces of places at s and 1 - s, 1/2 - s, 1/2 + s are equal).",
        "*Writhe*: by Gauss's integral over the shape; with the twist it makes up the turn to *off*. *Shooting*: "
        "relative difference of energy and of the force of a place.",
        page.table(["T (rad)", "places", "on one strand (s)", "sum of forces", "twist", "moment C t", "writhe", "off",
                    "energy", f"energy off, {FEWER} segments", "energy, shooting", "force, shooting",
                    "lowest eigenvalue", "penetration", "push times gap"], rows),
        f"At T = {up[-1]:g} the strands stand halfway at {np.degrees(crossed):.2f} degrees against their axis; a "
        f"ply without end of this twist has {np.degrees(ply):.2f}. The rows that hold the ring against sliding along "
        f"itself push with at most {off['held']:.0e} of the largest force.",
        "Relative differences from the shooting over the segments. One place is at a joint by symmetry. A force within "
        "a segment is a kink of the curvature there, which segments cannot have; with joints put where two places "
        f"are (up to {_JOINTS} segments) it is one between them:",
        page.table(["segments", f"energy, T = {ONE:g}, one place", "force", f"energy, T = {TWO:g}, two", "force",
                    "energy, joints at the places", "force"], by_order),
        "![shapes, writhe and forces over the turn](michell.png)",
    )  # fmt: skip
    if off["energy"] > 1e-4 or off["force"] > 1e-3 or off["sum"] > 1e-3 or off["deep"] > 1e-6 or offs[-1] > 1e-3:
        raise AssertionError(f"{off}, {offs}")
    return {
        "critical_off": Number(offs[-1], offs[-2], "", ".0e"),
        "energy_off": Number(off["energy"], 0.5 * off["energy"], "", ".0e"),
        "force_off": Number(off["force"], 0.5 * off["force"], "", ".0e"),
        "turn_off": Number(off["sum"], off["sum"], "rad", ".0e"),
        "deepest": Number(off["deep"], 1e-6, "l", ".0e"),
        "complementarity": Number(off["product"], 1e-8, "D w / l", ".0e"),
        "fold_one": Number(folds[0], 1e-3, "rad", ".3f"),
        "fold_two": Number(folds[1], 3e-3, "rad", ".3f"),
        "opened": Number(folds[2], 1e-5, "rad", ".4f"),
        "last_turn": Number(up[-1], 0.0, "rad", ".0f"),
        "segments": Number(SEGMENTS, 0.0, "", ".0f"),
        "probe_energy": Number(few.energy.total, abs(few.energy.total - fine.energy.total), "D w / l", ".3f"),
        "probe_force": Number(push, abs(push - float(pushes(fine)[0, 2])), "D w / l^2", ".2f"),
        "shot_force": Number(reference.ring(17.0, TORSION, APART, np.array(_ONE[1])).force, 1e-6, "D w / l^2", ".4f"),
    }


def state_tangents(state: Equilibrium) -> tuple[np.ndarray, np.ndarray]:
    """Tangents (3,) at s = 1/4 and 3/4."""
    frames = state.frame([0.25, 0.75])[:, :, 2]
    return frames[0], frames[1]
