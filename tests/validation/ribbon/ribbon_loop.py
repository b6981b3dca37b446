"""The loop in which a twisted strip lies on itself, drawn in and turned further: does it ply, does it stack?

A long ply of a round rod lies at the angle b of ``M = 2 B sin^3 b cos b / (r cos 2b)`` against its axis, M the moment
of its ends, r half the distance of the strands (S. Neukirch and J. F. Marko 2011,
doi:10.1103/PhysRevLett.106.138104). Of a strip whose curvature turns about the tangent B is the harmonic mean of both
bending stiffnesses.

A rod takes up turns in a ply because its sections roll against the ply's axis. Those of strips that stack, or stand
edge on edge, do not: what a helix twists with its own frames, sin 2b / (4 pi r) turns per length, is what its writhe
takes away (F. B. Fuller 1971, doi:10.1073/pnas.68.4.815), so that such a ply holds no turns, whatever its angle and
length.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from compare.measure.mesh_limit import Settled, settled
from ribbon import Clamp, Equilibrium
from ribbon.energies.section.rod import stiffnesses
from ribbon.find.continuation import anchored, follow
from ribbon.find.jointed.flat import Placed, halved, placed
from ribbon.find.snap import landed
from ribbon.find.solve import build
from ribbon.find.solving.request import How
from ribbon.forces import PairForce
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.transfer import transferred
from tests.validation import page
from tests.validation.number import Number
from tests.validation.ribbon.ply import complementarity, depth, pushes
from tests.validation.ribbon.ribbon_plectoneme import DISTANCES, FINITE, NU, ROD, SEGMENTS, TURNS, Case, carried, link
from tests.validation.ribbon.ribbon_plectoneme import twist as twisted

FloatArray = NDArray[np.float64]

#: Strips; distances of the ends (l) to which they are drawn in; turns at the last distance before, steps of both.
CASES = (ROD, *FINITE[:2])
NEARER, MORE = (0.4, 0.3, 0.2), (1.75,)
STEP, TURN = 0.005, 0.025
#: Step (l) to the last of DISTANCES: from 0.54 the first of 0.004 does not converge everywhere.
SHORT = 0.002
#: Numbers of segments on which the lowest eigenvalue is taken: of each the one whose joints are far from what touches.
BETWEEN = (range(SEGMENTS, 60), range(2 * SEGMENTS, 100))


class Touch(NamedTuple):
    """Where a strip touches itself: abscissae (l), places across (w), push (D w / l^2), distance of the centrelines
    (l); half the angle of the strands, one reversed, and the angles of both normals to each other and of the push to
    each (degrees)."""

    s: float
    other: float
    v: float
    v_other: float
    push: float
    apart: float
    strands: float
    normals: float
    on: tuple[float, float]


def touches(state: Equilibrium, case: Case) -> list[Touch]:
    """The places that push clearly; rows of one place, on both sides of a joint, as one: their mean by pushes."""
    least = 1e-3 * max((float(np.linalg.norm(pair.force)) for pair in state.pairs), default=0.0)
    clear = [pair for pair in state.pairs if np.linalg.norm(pair.force) > least]
    near = 0.5 / state.problem.lengths.size
    groups: list[list[PairForce]] = []
    for pair in clear:
        same = [g for g in groups if max(abs(g[0].s - pair.s), abs(g[0].s_other - pair.s_other)) < near]
        if same:
            same[0].append(pair)
        else:
            groups.append([pair])
    return [_touch(state, case, group) for group in groups]


def clear_of(places: Sequence[float], counts: Iterable[int]) -> int:
    """How many equal segments have their joints farthest from these places (l)."""
    return min(counts, key=lambda n: max(abs(place * n % 1.0 - 0.5) for place in places))


def lowest(state: Equilibrium, case: Case, distance: float, turns: float) -> tuple[float, float]:
    """The lowest eigenvalue on segments whose joints are far from what touches, and its change to that from half as
    many; nan where it is not found."""
    assert isinstance(state.problem, MixedProblem)
    places, values = [s for one in touches(state, case) for s in (one.s, one.other)], []
    for counts in BETWEEN:
        other = anchored(turned_problem(case, distance, turns, clear_of(places, counts)), state)
        assert isinstance(other, MixedProblem)
        found = landed(other, transferred(state.problem, state.x, other), How())
        values.append(found.lowest_eigenvalue if found.ok else np.nan)
    return values[1], abs(values[1] - values[0])


def _touch(state: Equilibrium, case: Case, rows: list[PairForce]) -> Touch:
    """One place, of its rows."""
    share = np.array([np.linalg.norm(pair.force) for pair in rows])
    s, other, v, v_other = share @ np.array([[p.s, p.s_other, p.v, p.v_other] for p in rows]) / share.sum()
    force = np.sum([pair.force for pair in rows], axis=0)
    push = float(np.linalg.norm(force))
    (r, r_other), (one, two) = state.position([s, other]), state.frame([s, other])
    strands = 0.5 * float(np.degrees(np.arccos(np.clip(-one[:, 2] @ two[:, 2], -1.0, 1.0))))
    on = _between(one[:, 1], force / push), _between(two[:, 1], force / push)
    return Touch(
        s, other, v / case.width, v_other / case.width, push, float(np.linalg.norm(r - r_other)), strands,
        _between(one[:, 1], two[:, 1]), on,
    )  # fmt: skip


def _between(one: FloatArray, other: FloatArray) -> float:
    """The angle of two lines, degrees."""
    return float(np.degrees(np.arccos(min(1.0, abs(float(one @ other))))))


def long_ply(moment: float, apart: float, case: Case) -> float:
    """Angle (degrees) of a long ply under a moment (D w / l), its centrelines this far from each other (l)."""
    normal = stiffnesses((0.5 * case.width, case.strip.thickness, NU, 0.0))[0]
    inplane = normal * case.slender**2
    bending = 2.0 * normal * inplane / (normal + inplane)
    angle = brentq(
        lambda b: 2.0 * bending * np.sin(b) ** 3 * np.cos(b) - moment * 0.5 * apart * np.cos(2.0 * b), 0.0, 0.25 * np.pi
    )
    return float(np.degrees(angle))


def turned_problem(case: Case, distance: float, turns: float, segments: int = SEGMENTS) -> MixedProblem:
    """The strip that touches itself at a distance of its ends, turned by this many turns."""
    binormal = (-float(np.sin(2.0 * np.pi * turns)), float(np.cos(2.0 * np.pi * turns)), 0.0)
    found = build(
        case.strip, Clamp(ruling="free"), end=Clamp((0.0, 0.0, distance), (0.0, 0.0, 1.0), binormal, "free"),
        energy=case.energy, segments=segments, formulation="mixed",
        stiffness="plate" if case.energy == "kirchhoff" else None, apart=case.width / case.slender,
    )  # fmt: skip
    assert isinstance(found, MixedProblem)
    return found


def drawn(case: Case) -> tuple[float, ...]:
    """The distances of NEARER that are gone to: on its last stage w/l = 0.02 takes minutes."""
    return NEARER[:2] if case == FINITE[1] else NEARER


@cache
def lying(case: Case) -> Equilibrium:
    """The strip in contact at the last of DISTANCES."""
    begin, end = DISTANCES
    old = carried(case, DISTANCES[:1]).state
    return _on(old, lambda t: turned_problem(case, begin + (end - begin) * t, TURNS), (begin - end) / SHORT)


@cache
def nearer(case: Case, stages: int) -> Equilibrium:
    """The strip in contact at the last of so many distances."""
    if not stages:
        return lying(case)
    old, begin, end = nearer(case, stages - 1), (DISTANCES[-1], *NEARER)[stages - 1], NEARER[stages - 1]
    return _on(old, lambda t: turned_problem(case, begin + (end - begin) * t, TURNS), (begin - end) / STEP)


@cache
def turned(case: Case, stages: int) -> Equilibrium:
    """The strip in contact at the last of DISTANCES and of so many turns."""
    if not stages:
        return lying(case)
    old, begin, end = turned(case, stages - 1), (TURNS, *MORE)[stages - 1], MORE[stages - 1]
    return _on(old, lambda t: turned_problem(case, DISTANCES[-1], begin + (end - begin) * t), (end - begin) / TURN)


def _balanced(case: Case) -> None:
    """The energy changes by what the ends do: between stages by no less and no more than with the least and the largest
    tension or moment of both. A state of another branch would not."""
    for chain, ends, of in (
        ([nearer(case, k) for k in range(len(drawn(case)) + 1)], (DISTANCES[-1], *drawn(case)), lambda e: e.force[2]),
        ([turned(case, k) for k in range(len(MORE) + 1)], tuple(2.0 * np.pi * n for n in (TURNS, *MORE)),
         lambda e: e.moment[2]),
    ):  # fmt: skip
        for (one, other), (a, b) in zip(pairwise(chain), pairwise(ends), strict=True):
            if one.ok and other.ok:
                work = sorted((b - a) * of(state.end_support) for state in (one, other))
                gained = other.energy.total - one.energy.total
                if not work[0] < gained < work[1]:
                    raise AssertionError(f"{case}, {a:g} to {b:g}: energy {gained}, work {work}")


def _on(old: Equilibrium, way, steps: float) -> Equilibrium:
    """Along the way in so many steps; where it stops, in twice and four times as many."""
    found = old
    for finer in (1, 2, 4) if old.ok else ():
        found = follow(way, old, steps=max(1, round(steps * finer)))
        if found.ok:
            return found
    return found


@cache
def finer(case: Case, times: int) -> Placed | None:
    """The strip at the first of NEARER on segments that end where it touches itself, halved so often."""
    problem = turned_problem(case, NEARER[0], TURNS)
    if not times:
        begin = nearer(case, 1)
        return placed(problem, Placed(begin, 1.0 / SEGMENTS)) if begin.ok else None
    old = finer(case, times - 1)
    return None if old is None else halved(problem, old)


#: What is compared over segments halved twice: heading, unit.
SETTLING = (("angle of the strands", "degrees"), ("angle of the normals", "degrees"), ("push on one", "degrees"),
            ("push", "D w / l^2"), ("tension", "D w / l^2"), ("moment", "D w / l"), ("energy", "D w / l"))  # fmt: skip


@cache
def over_meshes(case: Case) -> tuple[Settled, ...]:
    """Numbers of the loop at the first of NEARER over segments halved twice, as SETTLING has them."""
    rows = []
    for times in range(3):
        found = finer(case, times)
        ends = None if found is None else found.state.end_support
        if found is None or ends is None:
            rows.append([np.nan] * len(SETTLING))
            continue
        state = found.state
        (one,) = touches(state, case)
        rows.append([one.strands, one.normals, one.on[0], one.push, ends.force[2], ends.moment[2], state.energy.total])
    return tuple(settled(list(column)) for column in np.array(rows).T)


def least_normals() -> float:
    """The least angle of the two strips where they touch, of all states."""
    return min(one.normals for case in CASES for _, _, state in states_of(case) for one in touches(state, case))


def far_on(case: Case) -> float:
    """At the most turns: the push's angle to the nearer of both normals."""
    return min(min(one.on) for one in touches(turned(case, len(MORE)), case))


def _went(case: Case) -> tuple[str, str]:
    """Half the angle of the strands before and after it is drawn in, and turned."""
    begin, near, far = (
        touches(state, case)[0].strands
        for state in (nearer(case, 0), nearer(case, len(drawn(case))), turned(case, len(MORE)))
    )
    return f"{begin:.2f} to {near:.2f}", f"{begin:.2f} to {far:.2f}"


# -- the page ----------------------------------------------------------------------------------------------------------


def states_of(case: Case) -> list[tuple[float, float, Equilibrium]]:
    """Turns, distance of the ends, state: those that were found."""
    every = [(TURNS, z, nearer(case, k)) for k, z in enumerate((DISTANCES[-1], *drawn(case)))]
    every += [(n, DISTANCES[-1], turned(case, k + 1)) for k, n in enumerate(MORE)]
    return [one for one in every if one[2].ok]


def rows_of(case: Case) -> list[list[str]]:
    rows = []
    for turns, z, state in states_of(case):
        ends, found = state.end_support, touches(state, case)
        assert ends is not None
        eigenvalue, change = lowest(state, case, z, turns)
        settles = change < 0.1 * abs(eigenvalue)
        for one in found:
            rows.append([
                case.name, f"{turns:g}", f"{z:g}", f"{one.s:.4f}, {one.other:.4f}", f"{one.v:+.2f}, {one.v_other:+.2f}",
                f"{one.apart / case.width:.3f}", f"{one.strands:.2f}",
                f"{long_ply(ends.moment[2], one.apart, case):.2f}", f"{one.normals:.2f}",
                f"{one.on[0]:.1f}, {one.on[1]:.1f}", f"{one.push:.3f}", f"{ends.force[2]:.3f}", f"{ends.moment[2]:.4f}",
                f"{state.energy.total:.4f}", f"{twisted(state):.4f}",
                f"{eigenvalue:.4f} ({change:.0e})" if settles else "not settled",
                f"{depth(state):.0e}", f"{complementarity(state):.0e}",
            ])  # fmt: skip
    return rows


def settling_rows() -> list[list[str]]:
    """Numbers of every strip's loop over segments halved twice."""
    rows = []
    for case in CASES:
        for (name, unit), limit in zip(SETTLING, over_meshes(case), strict=True):
            value = f"{limit.value:.4f}" if np.isfinite(limit.value) else ""
            error = f"{limit.error:.0e}" if limit.settles else f"not settled (changes by {limit.error:.0e})"
            rows.append([case.name, f"{name} ({unit})", value, error])
    return rows


#: The frames of the strip of pictures: distances of the ends of states on the way, of the last case.
FRAMES = (0.62, 0.57, 0.552, 0.54, 0.5)


def frames(case: Case) -> list[tuple[str, Equilibrium]]:
    """States on the way through the snap and on, titled."""
    film = (*carried(case, DISTANCES[:1]).film, (DISTANCES[-1], lying(case)))
    chosen = [min(film, key=lambda one, z=z: abs(one[0] - z)) for z in FRAMES]
    every = [(f"Z = {z:.3f}", state) for z, state in chosen]
    every += [(f"Z = {z:g}", nearer(case, k + 1)) for k, z in enumerate(drawn(case))]
    every += [(f"Z = {DISTANCES[-1]:g}, {n:g} turns", turned(case, k + 1)) for k, n in enumerate(MORE)]
    return [(title, state) for title, state in every if state.ok]


def _drawn(axes, state: Equilibrium, case: Case, title: str) -> None:
    s, v = np.linspace(0.0, 1.0, 401), 0.5 * case.width * np.array([-1.0, 1.0])
    frame = state.frame(s)
    r = state.position(s)[:, None, :] + v[None, :, None] * frame[:, None, :, 0]
    axes.plot_surface(r[..., 0], r[..., 1], r[..., 2], color="tab:orange", linewidth=0, shade=True, rcount=401)
    found = pushes(state)
    if len(found):
        axes.plot(*state.position(found[:, 0]).T, "k.", ms=5)
    line = state.position(s)
    k = int(np.argmax(np.hypot(line[:, 0], line[:, 1])))
    axes.set(xlim=(-0.22, 0.22), ylim=(-0.22, 0.22), zlim=(-0.1, 0.7))
    axes.set_title(title, fontsize=8)
    axes.set_box_aspect((0.44, 0.44, 0.8), zoom=1.6)
    axes.view_init(5, float(np.degrees(np.arctan2(line[k, 1], line[k, 0]))) - 60.0)
    axes.set_axis_off()


def _picture(path: Path) -> None:
    case = CASES[-1]
    shown = frames(case)
    figure = plt.figure(figsize=(1.7 * len(shown), 3.6))
    for k, (title, state) in enumerate(shown):
        _drawn(figure.add_subplot(1, len(shown), k + 1, projection="3d"), state, case, title)
    figure.subplots_adjust(left=0.0, right=1.0, bottom=0.0, top=0.9, wspace=0.0)
    figure.savefig(path, dpi=80)
    plt.close(figure)


#: The same strip begun as an arch whose end is turned: a scene whose path is the film.
SCENE = """\
title = "A twisted strip that snaps into a loop and lies on itself"

[strip]
length = 1.0
width = 0.02
thickness = 0.001
poisson = 0.3

[contact]
itself = true

[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [0.0, 0.0, 1.0]
normal = [0.0, 1.0, 0.0]
ruling = "free"

[clamp.end]
position = [0.0, 0.0, 0.54]
tangent = [0.0, 0.0, 1.0]
normal = [0.0, -1.0, 0.0]
ruling = "free"

[seed]
curvature = [2.0, -2.0, 2.0]

[model]
energy = "finite"
elements = 40

[[path]]
"clamp.end.position" = [0.0, 0.0, 0.9]
"clamp.end.normal" = [0.0, 1.0, 0.0]
[[path]]
"clamp.end.normal" = [-1.0, 0.0, 0.0]
[[path]]
"clamp.end.normal" = [0.0, -1.0, 0.0]
[[path]]
"clamp.end.normal" = [1.0, 0.0, 0.0]
[[path]]
"clamp.end.normal" = [0.0, 1.0, 0.0]
[[path]]
"clamp.end.normal" = [-1.0, 0.0, 0.0]
[[path]]
"clamp.end.normal" = [0.0, -1.0, 0.0]
[[path]]
"clamp.end.position" = [0.0, 0.0, 0.6]
"""

PROBES = {
    "long_ply": lambda: long_ply(10.0, 0.01, FINITE[0]),
    "long_ply_wide": lambda: long_ply(10.0, 0.02, FINITE[1]),
}


def run(out: Path) -> dict[str, Number]:
    rows = [row for case in CASES for row in rows_of(case)]
    print("  ribbon_loop: states", flush=True)
    settling = settling_rows()
    _picture(out / "ribbon_loop.png")
    (out / "ribbon_loop.toml").write_text(SCENE)
    every = [(case, one) for case in CASES for one in states_of(case)]
    missing = [case.name for case in CASES if len(states_of(case)) < len(drawn(case)) + len(MORE) + 1]
    if missing:
        raise AssertionError(f"not all states of {missing}")
    deepest = max(depth(state) for _, (_, _, state) in every)
    off = max(abs(link(state) - turns) for _, (turns, _, state) in every)
    for case in CASES:
        _balanced(case)
    if deepest > 1e-6 or off > 1e-2 or not rows:
        raise AssertionError(f"{deepest}, {off}")
    page.write(
        out / "ribbon_loop.md", f"The loop of a twisted ribbon: no ply up to {MORE[-1]:g} turns, no stack",
        "python -m tests.validation ribbon_loop", *_text(rows, settling),
    )  # fmt: skip
    numbers = {
        "long_ply": Number(PROBES["long_ply"](), 1e-9, "degrees", ".2f"),
        "long_ply_wide": Number(PROBES["long_ply_wide"](), 1e-9, "degrees", ".2f"),
        "deepest": Number(deepest, deepest, "l", ".0e"),
        "turns": Number(MORE[-1], 0.0, "", ".2f"),
        "normals_least": Number(least_normals(), None, "degrees", ".2f", "on one mesh"),
    }
    for name, case in zip(("rod", "w01", "w02"), CASES, strict=True):
        angle, normals = over_meshes(case)[:2]
        state = nearer(case, 1)
        assert state.end_support is not None
        (one,) = touches(state, case)
        ply = long_ply(state.end_support.moment[2], one.apart, case)
        far = touches(turned(case, len(MORE)), case)[0]
        numbers[f"turned_{name}"] = Number(far.strands, None, "degrees", ".2f", "on one mesh")
        numbers[f"on_{name}"] = Number(far_on(case), None, "degrees", ".1f", "on one mesh")
        numbers[f"long_{name}"] = Number(ply, 0.01, "degrees", ".2f")
        for key, limit in (("strands", angle), ("normals", normals)):
            why = "" if limit.settles else "it does not settle over its meshes"
            numbers[f"{key}_{name}"] = Number(
                limit.value, limit.error if limit.settles else None, "degrees", ".2f", why
            )
    return numbers


def _each(texts: Iterable[str]) -> str:
    """Of the rod and both strips."""
    return ", ".join(texts)


def _text(rows: list[list[str]], settling: list[list[str]]) -> tuple[str, ...]:
    return (
        f"What does not hold: a ply is not reached, so that none is measured; beyond {MORE[-1]:g} turns nothing is "
        "followed (the lowest eigenvalue falls towards a snap, behind which the strip of w/l = 0.02 did not come to "
        "rest in a minute of computing); end force is read, not held; w/l = 0.05 does not arrive. "
        f"[A shell](loop_shell.md) stands beside w/l = 0.02 at Z = {DISTANCES[-1]:g} and {TURNS:g} turns alone.",
        "The loop of [a twisted ribbon whose ends come together](ribbon_plectoneme.md), carried on from where it "
        f"lies on itself (Z = {DISTANCES[-1]:g}, {TURNS:g} turns; {SEGMENTS} elements, no friction): its ends are "
        f"brought nearer at {TURNS:g} turns, or turned further at Z = {DISTANCES[-1]:g}. Forces in D w / l^2, energies "
        "in D w / l, lengths in l, angles in degrees.",
        f"*Lowest eigenvalue*: on {BETWEEN[1][0]} to {BETWEEN[1][-1]} elements, so many that their joints are far from "
        f"what touches, and its change from that on {BETWEEN[0][0]} to {BETWEEN[0][-1]} such. On {SEGMENTS} "
        f"elements the rod at Z = {NEARER[-1]:g}, whose places are beside joints, has "
        f"{nearer(ROD, len(NEARER)).lowest_eigenvalue:.4f}.",
        "*Strands*: half the angle of the two strands where they touch, one of them reversed: in a ply their angle "
        "against its axis. *Long ply*: that of a long ply of a round rod under the same moment (Neukirch and Marko "
        "2011), its strands as far apart and its bending the harmonic mean of the section's two. *Normals*: angle of "
        "the two strips there, 0 face on face. *Push on*: its angle to either strip's normal, 0 on the face, 90 in the "
        "strip's plane. *Apart*: centrelines, in w.",
        page.table(["strip", "turns", "Z", "s", "v", "apart", "strands", "long ply", "normals", "push on", "push",
                    "tension", "moment", "energy", "twist (turns)", "lowest eigenvalue", "penetration",
                    "push times gap"], rows),
        f"It does not stack: at {TURNS:g} turns edges lie on each other, at {MORE[-1]:g} one edge nearly on the "
        f"other's face (the push {_each(f'{far_on(case):.1f}' for case in CASES)} degrees from its normal), and the "
        f"faces stand {least_normals():.2f} degrees from each other or more. It does not ply up to {MORE[-1]:g} turns: "
        "drawn in, its strands turn away from a ply's angle, towards 90 degrees "
        f"({_each(_went(case)[0] for case in CASES)}), a coil whose ends lie along each other; turned further they "
        f"turn towards it ({_each(_went(case)[1] for case in CASES)}), and are far from a long ply's. Whether they "
        "reach one beyond is not known. A ply of strips that stack or stand edge on edge could not hold a turn: its "
        "sections keep their place against its axis, and their twist, sin 2b / (4 pi r) turns per length, is what its "
        "writhe takes away (Fuller 1971; `tests/ribbon/find/test_ribbon_loop.py` winds one up). A round rod's roll "
        "there.",
        f"## Over segments halved twice\n\nThe loop at Z = {NEARER[0]:g}, {TURNS:g} turns. Segments end where it "
        "touches and halve towards there, since curvature and twist jump under a force on an edge "
        "(`ribbon.find.jointed.flat`). On equal segments angles and forces changed by up to "
        "3e-3, and most did not settle.",
        page.table(["strip", "what", "value", "error"], settling),
        "## On the way\n\nFrames of the strip of w/l = 0.02 as it snaps and is drawn in; dots: where it touches. The "
        "film: `ribbonbench solve results/ribbon_loop.toml --out film`, then `ribbonbench export film --format gltf` "
        "(`path.glb`): [a scene](ribbon_loop.toml) that begins as an arch, is turned by quarters and drawn in to Z = "
        f"{DISTANCES[0]:g}. It ends in the state of that distance.",
        "![frames on the way](ribbon_loop.png)",
    )  # fmt: skip
