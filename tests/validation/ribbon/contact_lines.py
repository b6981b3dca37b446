"""Lines of contact of a ring and of a plectoneme, on segments that follow where a round rod touches itself.

Beside each state Kirchhoff's equations by shooting, with forces at places and a push per length on lines
(`tests.reference.strand`). A state begins at the shape of the shooting; what it is then is the rod's own.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import simpson
from scipy.optimize import brentq

from ribbon.find.jointed.path import refined
from ribbon.find.jointed.rounds import Jointed, settled
from ribbon.find.jointed.touching import Line, Touching, joints
from ribbon.find.solving.request import How
from ribbon.find.solving.verdict import judged
from ribbon.problems.mixed import MixedProblem
from ribbon.solvers.problem import Minimum
from tests.reference import plectoneme as rods
from tests.reference import plied_ring as rings
from tests.reference import strand
from tests.reference.balanced_ply import of_twist
from tests.validation import page
from tests.validation.number import Number
from tests.validation.ribbon.michell import APART, TORSION, ring
from tests.validation.ribbon.plectoneme import rod
from tests.validation.ribbon.ply import complementarity, depth

#: Segments of a rod, of which each place and line takes some more; how often they are halved at two states.
SEGMENTS, COARSE, ROD_SEGMENTS, HALVED = 160, 100, 200, 2
#: Distance of the clamps (l) of the plectoneme.
DISTANCE = 0.41
#: Unknowns of the shootings to begin with: ring (turn, touch, values), plectoneme the same; steps of the turn.
_RINGS = (
    (18.5, rings.TWO, (0.2104, -1.40, 6.91, 36.0, 181.0, 23.1, 0.2189, 295.0)),
    (19.3, rings.THREE, (0.2112, -1.5895, 7.2358, 73.5921, 183.3683, 23.81, 0.2147, 351.7257)),
    (21.1, rings.LINE, (0.21252688, -1.93437577, 7.89705562, 148.585332, 163.486067, 25.1569603, 0.202971566,
                        394.697018, 0.237325347)),
)  # fmt: skip
_RODS = (
    (20.518886, "pp", (0.31028513, 1.6324069, 8.6552154, -78.843479, -230.21124, 26.363941, 0.19079013, 368.28856,
                       0.25499072, 305.90229)),
    (22.220431, "ppp", (0.30928001, 1.1591358, 9.4797111, -201.13434, -190.85052, 28.125071, 0.18085529, 468.28768,
                        0.21046041, 61.148271, 0.2551338, 387.87957)),
    (22.852591, "plp", (0.30878169, 0.99799299, 9.8172557, -240.32092, -161.98116, 28.742404, 0.17684686, 488.96274,
                        0.20822676, 0.21174681, 64.50929, 0.25586612, 405.92373)),
    (23.930078, "plp", (0.30789323, 0.73071298, 10.408094, -296.3048, -97.289409, 29.793986, 0.17040538, 523.13318,
                        0.19962869, 0.21541988, 70.766517, 0.25712288, 434.66209)),
)  # fmt: skip
#: Turns (rad) of rings with a line, and the greatest step of the shooting to them.
_LINED, _STEP = (24.0, 27.0), 0.15
#: Stations from which a line's push per length is told, and its ends from it.
_SOME, _MANY = 9, 13
#: Steps (rad; l) by which a load's slopes are taken.
_TURNED, _PULLED = 0.02, 0.002


# -- by shooting -----------------------------------------------------------------------------------------------------


@cache
def shot_ring(turn: float) -> tuple[str, rings.Ring]:
    """How the ring of a turn touches itself, and the shooting."""
    for at, touch, guess in _RINGS:
        if turn == at:
            return touch, rings.ring(turn, TORSION, APART, touch, np.array(guess))
    at, _, guess = _RINGS[-1]
    earlier = [each for each in _LINED if each < turn]
    known = shot_ring(earlier[-1] if earlier else at)[1]
    v, old, count = known.unknowns, known.unknowns, int(np.ceil((turn - known.turn) / _STEP))
    for k in range(1, count + 1):
        to = known.turn + (turn - known.turn) * k / count
        found = rings.ring(to, TORSION, APART, rings.LINE, 2.0 * v - old)
        old, v = v, found.unknowns
    return rings.LINE, found


@cache
def shot_rod(turn: float, distance: float = DISTANCE) -> tuple[str, rods.Plectoneme]:
    """How the rod of a turn touches itself, and the shooting."""
    near = min(_RODS, key=lambda each: abs(each[0] - turn))
    return near[1], rods.held(distance, turn, TORSION, APART, near[1], np.array(near[2]))


# -- on segments -----------------------------------------------------------------------------------------------------


def _fields(state: np.ndarray, turned: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """omega and the other curvature (k,) of rods with the frame turned by an angle (k,) from w, at states (16, k)."""
    u, m, w = state[3:6].T, state[6:9].T, state[13:16].T
    bent = np.cross(m, u)
    across = np.cross(u, w)
    one = np.cos(turned)[:, None] * w + np.sin(turned)[:, None] * across
    return -np.einsum("ki,ki->k", bent, np.cross(u, one)), np.einsum("ki,ki->k", bent, one)


def _image(state: np.ndarray, axis: int, back: bool) -> np.ndarray:
    """Images (16, k) of states turned by half a turn about an axis; back: passed through the other way."""
    turn = -np.ones(3)
    turn[axis] = 1.0
    out = state.copy()
    for begin, sign in ((0, 1.0), (3, -1.0 if back else 1.0), (6, -1.0 if back else 1.0), (13, 1.0)):
        out[begin : begin + 3] = sign * turn[:, None] * state[begin : begin + 3]
    return out


def _started(
    problem: MixedProblem, touching: Touching, length: float, counts: tuple[int, ...], x: np.ndarray, push: list[float]
) -> Jointed:
    """Unknowns and pushes to start from, as a state that is none yet."""
    rows = np.zeros(problem.row_count)
    rows[problem.block_slices()["pairs"]] = -np.array(push)
    start = Minimum(x, np.zeros(problem.size), rows, 1.0, 0, 0, "", False, 0.0, "newton")
    return Jointed(judged(problem, start, How(check=False)), touching, length, counts)


def _shares(line: Line, own: strand.Touched, first: float, last: float) -> list[float]:
    """What the stations of a line push with at first."""
    share = float(own.push.mean()) * (line.end - line.begin) / line.segments
    out = np.full(line.segments + 1, share)
    out[[0, -1]] = 0.5 * share + np.array([first, last])
    return out.tolist()


@cache
def lined_ring(turn: float, segments: int = SEGMENTS) -> Jointed:
    """The ring of a turn on segments that follow its places."""
    touch, known = shot_ring(turn)
    v, own, length = known.unknowns, known.touched, 1.0 / segments
    s1, places, lines = own.places[0], [], []
    places = [(s1, 1.0 - s1), (0.5 - s1, 0.5 + s1)]
    push = [own.forces[0]] * 2
    if touch == rings.THREE:
        places.append((0.25, 0.75))
        push.append(own.forces[-1])
    if touch == rings.LINE:
        s2 = own.line[0]
        lines.append(Line(s2, 0.5 - s2, (1.0 - s2, 0.5 + s2)))
    touching = Touching(tuple(places), tuple(lines)).on(length)
    for line in touching.lines:
        push += _shares(line, own, own.forces[1], own.forces[1])
    s, counts = joints(touching, length, True)
    quarter, back = np.unique(np.round(np.abs((s + 0.25) % 0.5 - 0.25), 12), return_inverse=True)
    begun = strand.begun(*v[:6], TORSION)
    at = strand.states(begun, touch.rstrip("."), v[6:], APART, 0.25, quarter)
    b = rings.carried(at[:, -1])
    omega, other = np.empty(s.size), np.empty(s.size)
    for k in range(4):
        here = (s >= 0.25 * k - 1e-12) & (s <= 0.25 * (k + 1) + 1e-12)
        own_states = at[:, back[here]]
        if k % 2:
            own_states = _image(own_states, 2, True)
        if k > 1:
            own_states = _image(own_states, 1, False)
        angle = 0.5 * np.pi + known.twist * s[here] + 2.0 * b * ((k + 1) // 2)
        omega[here], other[here] = _fields(own_states, angle)
    problem = ring(turn, segments).with_changes(lengths=np.diff(s), pairs=touching.pairs())
    x = problem.state(omega, np.full(s.size, known.twist), other)
    found = settled(ring(turn, segments), _started(problem, touching, length, counts, x, push))
    if found is None:
        raise AssertionError(f"no ring of {turn:g}")
    return found


@cache
def lined_rod(turn: float) -> Jointed:
    """The plectoneme of a turn on segments that follow its places."""
    touch, known = shot_rod(turn)
    v, own, length = known.unknowns, known.touched, 1.0 / ROD_SEGMENTS
    at, k = own.places, 0
    places, lines, push, ends = [], [], [], []
    for letter in touch:
        if letter == "p":
            places.append((0.5 - at[k], 0.5 + at[k]))
            push.append(own.forces[k])
            k += 1
        else:
            lines.append(Line(0.5 - at[k + 1], 0.5 - at[k], (0.5 + at[k + 1], 0.5 + at[k])))
            ends.append((own.forces[k + 1], own.forces[k]))
            k += 2
    order = sorted(range(len(places)), key=lambda i: places[i])
    touching = Touching(tuple(places[i] for i in order), tuple(lines)).on(length)
    push = [push[i] for i in order]
    for line, (first, last) in zip(touching.lines, ends, strict=True):
        push += _shares(line, own, first, last)
    s, counts = joints(touching, length, False)
    half, back = np.unique(np.minimum(np.round(np.abs(s - 0.5), 12), 0.5), return_inverse=True)
    states = strand.states(strand.begun(*v[:6], TORSION), touch, v[6:], APART, 0.5, half)[:, back]
    states[:, s < 0.5] = _image(states[:, s < 0.5], 0, True)
    across = np.cross(states[3:6, 0], states[13:16, 0])[0]
    first = np.arctan2(-states[13, 0], across)  # so that the row against turning about the axis holds
    omega, other = _fields(states, first + known.twist * s)
    problem = rod(turn, DISTANCE, ROD_SEGMENTS).with_changes(lengths=np.diff(s), pairs=touching.pairs())
    x = problem.state(omega, np.full(s.size, known.twist), other)
    found = settled(rod(turn, DISTANCE, ROD_SEGMENTS), _started(problem, touching, length, counts, x, push))
    if found is None:
        raise AssertionError(f"no rod of {turn:g}")
    return found


@cache
def halved_ring(turn: float, times: int) -> Jointed:
    """The ring on segments halved so often."""
    if not times:
        return lined_ring(turn, COARSE)
    return _halved(ring(turn, COARSE), halved_ring(turn, times - 1))


@cache
def halved_rod(turn: float, times: int) -> Jointed:
    """The plectoneme on segments halved so often."""
    if not times:
        return lined_rod(turn)
    return _halved(rod(turn, DISTANCE, ROD_SEGMENTS), halved_rod(turn, times - 1))


def _halved(problem: MixedProblem, coarse: Jointed) -> Jointed:
    found = refined(problem, coarse)
    if found is None:
        raise AssertionError(f"nothing on {2 * coarse.state.problem.lengths.size} segments")
    return found


# -- what is compared ------------------------------------------------------------------------------------------------


def on_line(one: Jointed) -> dict[str, float]:
    """Of the line: what it pushes with in all, per length and at which angle (rad) against its axis in its middle; of a
    line of many stations at its first and its last end: what half of the stations push with beyond the push per length,
    a parabola through that of all stations but four at each end, where it swings."""
    line, push = one.touching.lines[0], one.pushes[len(one.touching.places) :]
    h, s = (line.end - line.begin) / line.segments, line.stations
    middle = 0.5 * (line.begin + line.end)
    facing = float(np.interp(middle, s, line.facing))
    tangents = one.state.frame([middle, facing])[:, :, 2]
    found = {"all": float(push.sum()), "angle": 0.5 * float(np.arccos(-tangents[0] @ tangents[1]))}
    if s.size >= _SOME:
        found["per length"] = float(np.interp(middle, s, push / h))
    if s.size >= _MANY:
        inner = slice(4, -4)
        fit = np.polynomial.Polynomial.fit(s[inner], push[inner] / h, 2)
        whole = fit.integ()
        half = push[s < middle - 1e-9].sum() + 0.5 * push[np.abs(s - middle) < 1e-9].sum()
        found["per length"] = float(fit(middle))
        found["first"] = float(half - whole(middle) + whole(line.begin))
        found["last"] = float(push.sum() - half - whole(line.end) + whole(middle))
    return found


def on_shot(own: strand.Touched, mirrored: bool) -> dict[str, float]:
    """As `on_line`, of a shooting; mirrored: of half of a line, s to 1/4. Counted from the clamp (ring: the seam)."""
    inside = float(simpson(own.push, x=own.s))
    if mirrored:
        first, middle = own.forces[1], -1
        return {"all": 2.0 * (first + inside), "per length": float(own.push[middle]), "first": first, "last": first,
                "angle": float(own.angle[middle])}  # fmt: skip
    first, last, middle = own.forces[2], own.forces[1], own.s.size // 2
    return {"all": first + last + inside, "per length": float(own.push[middle]), "first": first, "last": last,
            "angle": float(own.angle[middle])}  # fmt: skip


def _place_off(one: Jointed, forces: list[float]) -> float:
    """The largest relative difference of the forces of places of their own from the shooting's."""
    return float(np.abs(_own_places(one) / np.sort(forces) - 1.0).max())


def _own_places(one: Jointed) -> np.ndarray:
    """Forces of the places of their own, the least first."""
    return np.sort(one.pushes[: len(one.touching.places)])


def _forces(touch: str, own: strand.Touched, is_ring: bool) -> list[float]:
    """The forces of all places of their own in a shooting."""
    if is_ring:
        return [own.forces[0]] * 2 + ([own.forces[-1]] if touch == rings.THREE else [])
    return own.forces if "l" not in touch else [own.forces[0], own.forces[-1]]


def _row(turn: float, one: Jointed, known: rings.Ring | rods.Plectoneme, touch: str, is_ring: bool,
         off: dict[str, float]) -> list[str]:  # fmt: skip
    state, own = one.state, known.touched
    forces = _forces(touch, own, is_ring)
    each = {"energy": abs(state.energy.total / known.energy - 1.0), "place": _place_off(one, forces),
            "deep": depth(state), "product": complementarity(state)}  # fmt: skip
    cells = [f"{turn:.4g}", touch_name(touch), "; ".join(dict.fromkeys(f"{f:.2f}" for f in _own_places(one))),
             f"{each['place']:.0e}", f"{state.energy.total:.5f}", f"{each['energy']:.0e}"]  # fmt: skip
    if one.touching.lines:
        here, there, line = on_line(one), on_shot(own, is_ring), one.touching.lines[0]
        each["all"] = abs(here["all"] / there["all"] - 1.0)
        each["angle"] = abs(np.degrees(here["angle"] - there["angle"]))
        shown = ["", ""]
        if "per length" in here:
            each["per length"] = abs(here["per length"] / there["per length"] - 1.0)
            shown = [f"{here['per length']:.0f}", f"{each['per length']:.0e}"]
        cells += [f"{line.begin:.4f} to {line.end:.4f}", f"{there['first']:.2f}; {there['last']:.2f}",
                  f"{here['all']:.2f}", f"{each['all']:.0e}", *shown,
                  f"{np.degrees(here['angle']):.3f}", f"{each['angle']:.0e}"]  # fmt: skip
    else:
        cells += [""] * 8
    for name, value in each.items():
        off[name] = max(off.get(name, 0.0), value)
    return [*cells, f"{state.lowest_eigenvalue:.4f}", f"{each['deep']:.0e}", f"{each['product']:.0e}"]


def touch_name(touch: str) -> str:
    """What touches, in words, of a whole rod."""
    names = {rings.TWO: "two", rings.THREE: "three", rings.LINE: "place, line, place", "pp": "two", "ppp": "three",
             "plp": "place, line, place"}  # fmt: skip
    return names[touch]


def orders() -> tuple[list[list[str]], dict[str, float]]:
    """Rows of differences from the shooting on ever shorter segments; orders over the last halving."""
    cases = [("ring, 18.5, two places", 18.5, True), ("ring, 21.1, a line", 21.1, True),
             ("rod, 23.93, a line", _RODS[-1][0], False)]  # fmt: skip
    rows, last = [], {}
    for name, turn, is_ring in cases:
        touch, known = shot_ring(turn) if is_ring else shot_rod(turn)
        before: dict[str, float] = {}
        for times in range(HALVED + 1):
            one = (halved_ring if is_ring else halved_rod)(turn, times)
            each = {"energy": abs(one.state.energy.total / known.energy - 1.0),
                    "place": _place_off(one, _forces(touch, known.touched, is_ring))}  # fmt: skip
            if one.touching.lines:
                here, there = on_line(one), on_shot(known.touched, is_ring)
                each |= {k: abs(here[k] / there[k] - 1.0) for k in ("all", "per length", "angle") if k in here}
                if "first" in here:
                    each["end"] = max(abs(here[k] / there[k] - 1.0) for k in ("first", "last"))
            cells = [name, str(one.state.problem.lengths.size)]
            for key in ("energy", "place", "all", "end", "per length", "angle"):
                order = f" ({np.log2(before[key] / each[key]):.1f})" if key in before else ""
                cells.append(f"{each[key]:.1e}{order}" if key in each else "")
            last["deep"] = max(last.get("deep", 0.0), depth(one.state))
            rows.append([*cells, f"{depth(one.state):.0e}", f"{complementarity(one.state):.0e}"])
            last |= {f"{key} {name}": float(np.log2(before[key] / each[key])) for key in each if key in before}
            before = each
        last |= {f"off {key} {name}": value for key, value in before.items()}
    return rows, last


def balanced(turn: float) -> list[str]:
    """Halfway along a ring's line: twist, angle and push per length of the shooting, and those of the ply of least
    energy that is twisted as much, which nothing pulls and nothing turns."""
    known = shot_ring(turn)[1]
    here, ply = on_shot(known.touched, True), of_twist(known.twist, 0.5 * APART, TORSION)
    return [f"{turn:.4g}", f"{known.twist:.4f}", f"{np.degrees(here['angle']):.3f}", f"{np.degrees(ply.angle):.3f}",
            f"{here['per length']:.0f}", f"{ply.push:.0f}"]  # fmt: skip


def ply_of_moment(moment: float) -> tuple[float, float]:
    """Angle (rad) and tension of a long ply under the moment M, r half the diameter: between straight ends of the twist
    M / C a length l of ply takes ``V = C t^2 / 2 + l sin^4 b / (2 r^2) + T l`` at ``R = t + l sin 2b / (2 r)``, so that
    ``M = 2 sin^3 b cos b / (r cos 2b)`` and ``T = M sin 2b / (2 r) - sin^4 b / (2 r^2)`` (Neukirch and Marko 2011)."""
    r = 0.5 * APART

    def of(b: float) -> float:
        return float(2.0 * np.sin(b) ** 3 * np.cos(b) / (r * np.cos(2.0 * b)))

    b = brentq(lambda b: of(b) - moment, 1e-3, 0.25 * np.pi - 1e-3, xtol=1e-14)
    return b, float(moment * np.sin(2.0 * b) / (2.0 * r) - np.sin(b) ** 4 / (2.0 * r * r))


@cache
def growth(turn: float) -> tuple[float, float]:
    """By how much (l / rad) the clamps come together with the turn at constant tension, on segments and by shooting."""
    begin = lined_rod(turn)

    def tension(more: float, nearer: float) -> float:
        found = settled(rod(turn + more, DISTANCE - nearer, ROD_SEGMENTS), begin)
        if found is None or found.state.end_support is None:
            raise AssertionError(f"no rod of {turn + more:g}, {DISTANCE - nearer:g}")
        return float(found.state.end_support.force[2])

    def shot(more: float, nearer: float) -> float:
        return shot_near(turn, more, nearer).tension

    out = []
    for of in (tension, shot):
        turned = (of(_TURNED, 0.0) - of(-_TURNED, 0.0)) / (2.0 * _TURNED)
        pulled = (of(0.0, -_PULLED) - of(0.0, _PULLED)) / (2.0 * _PULLED)
        out.append(turned / pulled)
    return out[0], out[1]


def shot_near(turn: float, more: float, nearer: float) -> rods.Plectoneme:
    """The shooting of a rod beside one of those of the page."""
    touch, known = shot_rod(turn)
    return rods.held(DISTANCE - nearer, turn + more, TORSION, APART, touch, known.unknowns)


# -- the page --------------------------------------------------------------------------------------------------------


def _picture(path: Path) -> None:
    figure = plt.figure(figsize=(12, 4.5))
    shown = [("ring, 24 rad", lined_ring(24.0)), ("rod, 23.93 rad", lined_rod(_RODS[-1][0]))]
    for k, (title, one) in enumerate(shown):
        axes = figure.add_subplot(1, 3, k + 1, projection="3d")
        r = one.state.position(np.linspace(0.0, 1.0, 1201))
        r = (r - r.mean(axis=0)) @ np.linalg.svd(r - r.mean(axis=0), full_matrices=False)[2].T
        axes.plot(*r[:601].T, color="tab:blue", lw=3)
        axes.plot(*r[600:].T, color="tab:orange", lw=3)
        places = [s for s, _ in one.touching.places] + list(one.touching.lines[0].stations)
        axes.plot(*r[np.round(np.array(places) * 1200).astype(int)].T, "k.", ms=5)
        axes.set(title=title)
        axes.set_aspect("equal")
        axes.view_init(60, -75)
        axes.set_axis_off()
    axes = figure.add_subplot(1, 3, 3)
    for turn in (21.1, 24.0, 27.0):
        one, own = lined_ring(turn), shot_ring(turn)[1].touched
        (drawn,) = axes.plot(own.s, own.push, "-", label=f"ring, {turn:g} rad")
        line, push = one.touching.lines[0], one.pushes[len(one.touching.places) :]
        h = (line.end - line.begin) / line.segments
        axes.plot(line.stations[1:-1], push[1:-1] / h, ".", color=drawn.get_color())
    axes.set(xlabel="s (l)", ylabel="push per length (D w / l^3)", title="lines: shooting; dots: stations")
    axes.legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    plt.close(figure)


PROBES = {
    "ring_energy": lambda: lined_ring(18.5).state.energy.total,
    "line_energy": lambda: lined_ring(21.1).state.energy.total,
    "line_force": lambda: float(on_line(lined_ring(21.1))["all"]),
}

_HEADS = ["turn (rad)", "touches", "forces of places", "off", "energy", "off", "line from, to (s)",
          "at its ends (shooting)", "line in all", "off", "per length, halfway", "off", "angle (degrees)", "off",
          "lowest eigenvalue", "penetration", "push times gap"]  # fmt: skip


def run(out: Path) -> dict[str, Number]:
    off: dict[str, float] = {}
    ringed, rodded, theory = [], [], []
    for turn in [each[0] for each in _RINGS] + list(_LINED):
        touch, known = shot_ring(turn)
        ringed.append(_row(turn, lined_ring(turn), known, touch, True, off))
    for turn, touch, _ in _RODS:
        rod_shot = shot_rod(turn)[1]
        rodded.append(_row(turn, lined_rod(turn), rod_shot, touch, False, off))
        ends = lined_rod(turn).state.end_support
        assert ends is not None
        angle, tension = ply_of_moment(rod_shot.moment)
        off["tension"] = max(off.get("tension", 0.0), abs(ends.force[2] / rod_shot.tension - 1.0))
        own = f"{np.degrees(on_line(lined_rod(turn))['angle']):.2f}" if "l" in touch else ""
        theory.append([f"{turn:.4g}", f"{ends.force[2]:.3f}", f"{abs(ends.force[2] / rod_shot.tension - 1.0):.0e}",
                       f"{tension:.2f}", f"{rod_shot.moment:.4f}", own, f"{np.degrees(angle):.2f}"])  # fmt: skip
    last = _RODS[-1][0]
    grown, known_growth = growth(last)
    long = APART / np.sin(2.0 * ply_of_moment(shot_rod(last)[1].moment)[0])
    table, order = orders()
    _picture(out / "contact_lines.png")
    page.write(
        out / "contact_lines.md",
        "Lines of contact of a ring and of a plectoneme",
        "python -m tests.validation contact_lines",
        f"The round rods of [Michell's ring](michell.md) and of [a twisted rod whose ends come "
        f"together](plectoneme.md) "
        f"(length 1, diameter {APART:g}, torsional over bending stiffness {TORSION:.4f}, no friction; clamps of the "
        f"second {DISTANCE:g} apart), on segments that follow where it touches itself (`ribbon.find.jointed`): joints "
        "stand at every place of contact, a line is held at its joints, and its two ends are unknowns: there the gap "
        "leaves zero with its third derivative. Forces in D w / l^2, energies in D w / l, lengths in l. *Off*: "
        "relative "
        "difference from Kirchhoff's equations by shooting, where a line is a curve at half the diameter from the axis "
        "and its push follows from that (angle: degrees). States begin at the shape of the shooting. What does not "
        "hold: "
        "a place that becomes a line is not passed through on a path here (at "
        "the turn where the gap is flat in third order the place slides at no change of it), so that a line is begun "
        "behind it. A scene asks for such segments with `contact.joints` ([how](../docs/scenes.md)).",
        f"A ring, {SEGMENTS} segments and some more:",
        page.table(_HEADS, ringed),
        f"The rod between clamps, {ROD_SEGMENTS} segments and some more:",
        page.table(_HEADS, rodded),
        "On segments halved twice; in brackets the order. Of the line's ends the force is that of its stations "
        f"beyond the push per length, on {_MANY} stations or more:",
        page.table(["state", "segments", "energy", "forces of places", "line in all", "at its ends",
                    "per length, halfway", "angle", "penetration", "push times gap"], table),
        "Halfway along a ring's line, and in a ply without end of the same twist (Thompson, van der Heijden and "
        "Neukirch 2002, by energy):",
        page.table(["turn (rad)", "twist", "angle (degrees)", "ply", "push per length", "ply"],
                   [balanced(turn) for turn in (21.1, *_LINED)]),
        "A long ply under the moment M between straight ends has the angle b of M = 2 sin^3 b cos b / (r cos 2b) "
        "and the "
        "tension T = M sin 2b / (2 r) - sin^4 b / (2 r^2), r half the diameter (Neukirch and Marko 2011, by "
        "energy). The "
        "rod's ply is short: loop and clamps are felt.",
        page.table(["turn (rad)", "tension", "off", "tension, long ply", "moment", "angle", "angle, long ply"], theory),
        f"At constant tension the clamps come together with the turn by {grown:.5f} l / rad at {last:.4g} rad "
        f"({known_growth:.5f} by shooting, {abs(grown / known_growth - 1.0):.0e} off; a long ply: 2 r / sin 2b = "
        f"{long:.5f}).",
        "![shapes, and pushes along lines](contact_lines.png)",
    )  # fmt: skip
    fourth = min(value for key, value in order.items() if key.startswith("energy "))
    ends = max(value for key, value in order.items() if key.startswith("off end "))
    deepest = max(off["deep"], order["deep"])
    bad = off["energy"] > 2e-6 or deepest > 1e-6 or off["product"] > 1e-8 or off["tension"] > 1e-5
    if bad or fourth < 3.5 or abs(grown / known_growth - 1.0) > 5e-3 or off["angle"] > 0.01:
        raise AssertionError(f"{off}, {order}, {grown}, {known_growth}")
    one, line = lined_ring(18.5), lined_ring(21.1)
    here, there = on_line(line)["all"], on_shot(shot_ring(21.1)[1].touched, True)["all"]
    return {
        "energy_off": Number(off["energy"], 0.5 * off["energy"], "", ".0e"),
        "place_off": Number(off["place"], 0.5 * off["place"], "", ".0e"),
        "all_off": Number(off["all"], 0.5 * off["all"], "", ".0e"),
        "angle_off": Number(off["angle"], 0.5 * off["angle"], "degrees", ".0e"),
        "order": Number(fourth, abs(4.0 - fourth), "", ".1f"),
        "ends_off": Number(ends, 0.5 * ends, "", ".1e"),
        "length_off": Number(off["per length"], 0.5 * off["per length"], "", ".0e"),
        "growth": Number(grown, abs(grown - known_growth), "l / rad", ".5f"),
        "growth_off": Number(abs(grown / known_growth - 1.0), 0.5 * abs(grown / known_growth - 1.0), "", ".0e"),
        "growth_long": Number(long, abs(long - grown), "l / rad", ".5f"),
        "last_turn": Number(_LINED[-1], 0.0, "rad", ".0f"),
        "deepest": Number(deepest, deepest, "l", ".0e"),
        "complementarity": Number(off["product"], off["product"], "D w / l", ".0e"),
        "ring_energy": Number(
            one.state.energy.total, abs(one.state.energy.total - shot_ring(18.5)[1].energy), "D w / l", ".4f"
        ),
        "line_energy": Number(
            line.state.energy.total, abs(line.state.energy.total - shot_ring(21.1)[1].energy), "D w / l", ".4f"
        ),
        "line_force": Number(here, abs(here - there), "D w / l^2", ".2f"),
    }
