"""A ply of a round rod: its ends stand side by side and are turned against each other, so that it winds up on itself.

First it touches itself at a point, then at two, then along a line between two points, as B. D. Coleman and D. Swigon
(2000, doi:10.1023/A:1010911113919) have it of closed rods. In the middle of the line the ply is in balance: its angle
and what its strands push each other with are those of least energy (`tests.reference.balanced_ply`).
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from ribbon import Clamp, Equilibrium, Strip
from ribbon.energies.section.rod import stiffnesses
from ribbon.find.continuation import follow
from ribbon.find.solve import build, solve
from ribbon.judge import nearness
from ribbon.problems.mixed import MixedProblem
from tests.reference.balanced_ply import Ply, of_twist
from tests.validation import page
from tests.validation.number import Number

NU, WIDTH = 0.3, 0.01
#: Both bendings alike: (1 - nu^2) (w / h)^2 = 1.
STRIP = Strip(1.0, WIDTH, NU, thickness=WIDTH * np.sqrt(1.0 - NU**2))
TORSION = stiffnesses((0.5 * WIDTH, STRIP.thickness, NU, 0.0))[1]
#: Diameter of the rod, distance of its ends (l); steps of a turn.
APART, ENDS, STEPS = 0.05, 0.1, 10
#: Turns at which it is looked at, segments, and fewer of both.
TURNS, SEGMENTS, FEWER, LESS = (1.5, 2.45, 3.0, 3.5, 4.0, 4.5), 100, 70, (1.5, 2.45, 3.0)
#: Part of the largest force from which a place is one that touches.
_CLEARLY = 1e-3
#: Force over the median of its neighbours from which a place is one before or behind a line.
_ALONE = 3.0


def folded(turns: float, segments: int) -> MixedProblem:
    """The rod whose ends are turned by `turns` against each other."""
    half = np.pi * turns
    binormal = (float(np.sin(half)), float(np.cos(half)), 0.0)
    start = Clamp((-0.5 * ENDS, 0.0, 0.0), (0.0, 0.0, 1.0), binormal)
    end = Clamp((0.5 * ENDS, 0.0, 0.0), (0.0, 0.0, -1.0), binormal)
    found = build(STRIP, start, end=end, energy="kirchhoff", segments=segments, apart=APART, round_rod=True)
    assert isinstance(found, MixedProblem)
    return found


@cache
def wound(segments: int, stages: tuple[float, ...]) -> Equilibrium:
    """The equilibrium at the last of the turns, each reached from the one before."""
    if not stages:
        flat = folded(0.0, segments)
        return solve(
            STRIP, flat.start, end=flat.end, energy="kirchhoff", segments=segments, seed_curvature=1.5 * np.pi,
            apart=APART, round_rod=True,
        )  # fmt: skip
    state, begin, end = wound(segments, stages[:-1]), (0.0, *stages)[-2], stages[-1]
    steps = max(1, round(STEPS * (end - begin)))
    return follow(lambda t: folded(begin + (end - begin) * t, segments), state, steps=steps)


def pushes(state: Equilibrium) -> np.ndarray:
    """Places (k, 2) that push clearly, and with what (k,), D w / l^2: columns s, s', force."""
    found = np.array([[pair.s, pair.s_other, np.linalg.norm(pair.force)] for pair in state.pairs]).reshape(-1, 3)
    return found[found[:, 2] > _CLEARLY * found[:, 2].max(initial=0.0)]


def line(state: Equilibrium) -> np.ndarray:
    """As `pushes`, of the line alone: without the places before and behind it; empty without one."""
    found, h = pushes(state), 1.5 / state.problem.lengths.size
    runs = np.split(found, np.nonzero(np.diff(found[:, 0]) > h)[0] + 1)
    longest = max(runs, key=len)
    longest = longest[longest[:, 2] < _ALONE * np.median(longest[:, 2])]
    return longest if len(longest) > 3 else found[:0]


def middle(state: Equilibrium) -> tuple[float, float, Ply]:
    """In the middle of the line: angle (rad) of a strand against the axis, push per length (mean of three stations),
    and the ply in balance that is twisted as much."""
    found = line(state)
    k = int(np.argmin(np.abs(found[:, 0] - 0.5 * (found[0, 0] + found[-1, 0]))))
    one, other = state.frame(found[k, :2])[:, :, 2]
    angle = 0.5 * float(np.arccos(-one @ other))
    push = float(found[k - 1 : k + 2, 2].mean()) * state.problem.lengths.size
    return angle, push, of_twist(abs(float(state.tau([0.5])[0])), 0.5 * APART, TORSION)


def depth(state: Equilibrium) -> float:
    """How much nearer (l) its strands are anywhere than they may be."""
    assert isinstance(state.problem, MixedProblem)
    return max((-gap for gap, _ in nearness.minima(state.problem, state.x, 0.0)), default=0.0)


def complementarity(state: Equilibrium) -> float:
    """Largest product of a push and its gap, D w / l."""
    assert isinstance(state.problem, MixedProblem)
    if not state.problem.pairs:
        return 0.0
    push = -state.rows[state.problem.block_slices()["pairs"]]
    return float(np.abs(push * state.problem.pair_rows().values(state.x)).max())


def _picture(path: Path, states: list[tuple[float, Equilibrium]]) -> None:
    figure = plt.figure(figsize=(12, 7))
    shown = [one for one in states if one[0] in (1.5, 2.45, 3.5, 4.5)]
    for k, (turns, state) in enumerate(shown):
        axes = figure.add_subplot(2, 4, k + 1, projection="3d")
        r = state.position(np.linspace(0.0, 1.0, 1001))
        axes.plot(*r[:501].T, color="tab:blue", lw=3)
        axes.plot(*r[500:].T, color="tab:orange", lw=3)
        at = state.position(pushes(state)[:, 0])
        axes.plot(*at.T, "k.", ms=4)
        axes.set(title=f"{turns:g} turns", xlim=(-0.15, 0.15), ylim=(-0.15, 0.15), zlim=(0.0, 0.45))
        axes.set_box_aspect((0.3, 0.3, 0.45))
        axes.view_init(8, -70)
        axes.set_axis_off()
    left, right = figure.add_subplot(2, 2, 3), figure.add_subplot(2, 2, 4)
    for turns, state in states:
        found = line(state)
        if len(found):
            known = middle(state)[2]
            (drawn,) = left.plot(found[:, 0], found[:, 2] * SEGMENTS, ".-", label=f"{turns:g} turns")
            left.axhline(known.push, color=drawn.get_color(), ls=":")
            angles = [0.5 * np.arccos(-np.dot(*state.frame(row[:2])[:, :, 2])) for row in found]
            right.plot(found[:, 0], np.degrees(angles), ".-", color=drawn.get_color())
            right.axhline(np.degrees(known.angle), color=drawn.get_color(), ls=":")
    left.set(xlabel="s (l)", ylabel="push per length (D w / l^3)", title="dotted: a ply in balance, twisted as much")
    right.set(xlabel="s (l)", ylabel="angle against the axis (degrees)")
    left.legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    plt.close(figure)


@cache
def _point() -> Equilibrium:
    return wound(50, (1.5,))


PROBES = {
    "point_push": lambda: float(pushes(_point())[:, 2].sum()),
    "point_energy": lambda: _point().energy.total,
    "known_push": lambda: of_twist(15.0, 0.5 * APART, TORSION).push,
}


def run(out: Path) -> dict[str, Number]:
    states = [(turns, wound(SEGMENTS, TURNS[: k + 1])) for k, turns in enumerate(TURNS)]
    coarse = {turns: wound(FEWER, LESS[: k + 1]) for k, turns in enumerate(LESS)}
    rows, offs = [], {}
    for turns, state in states:
        if not state.ok:
            raise AssertionError(f"{turns}: {state.message}")
        found, own = pushes(state), line(state)
        cells = [f"{turns:g}", str(len(found)), f"{found[:, 2].sum():.2f}", f"{state.energy.total:.4f}"]
        beside = coarse.get(turns)
        cells.append(f"{abs(beside.energy.total / state.energy.total - 1.0):.0e}" if beside is not None else "")
        if len(own):
            angle, push, known = middle(state)
            offs[turns] = abs(np.degrees(angle - known.angle)), abs(push / known.push - 1.0)
            cells += [f"{own[0, 0]:.3f} to {own[-1, 0]:.3f}", f"{np.degrees(angle):.2f}",
                      f"{np.degrees(known.angle):.2f}", f"{push:.0f}", f"{known.push:.0f}"]  # fmt: skip
        else:
            cells += [""] * 5
        rows.append([*cells, f"{depth(state):.0e}", f"{complementarity(state):.0e}"])
    last = max(offs)
    kinds = {turns: len(line(state)) for turns, state in states}
    page.write(
        out / "ply.md",
        "A ply of a round rod",
        "python -m tests.validation ply",
        f"A round rod of length 1 and diameter {APART:g}, its ends clamped {ENDS:g} apart beside each other, both "
        "along the axis, and turned against each other (`kirchhoff`, both bendings alike, torsional over bending "
        f"stiffness {TORSION:.4f}, {SEGMENTS} segments, no friction). Forces in D w / l^2, energies in D w / l, "
        "lengths in l.",
        "It touches itself at one place, at two, and along a line between two places (Coleman and Swigon). On the "
        "line it is held at the joints of one strand, each with the nearest place of the other; places of their own "
        "slide. The angle is that of a strand against the axis, halfway along the line; *ply*: that of least energy "
        "with the same twist, on a line without end. Between the two the ends of the line are still felt; they fade "
        "as it grows.",
        page.table(["turns", "places", "sum of forces", "energy", f"energy off, {FEWER} segments", "line from, to (s)",
                    "angle (degrees)", "ply", "push per length", "ply", "penetration", "push times gap"], rows),
        f"At {last:g} turns the angle is {offs[last][0]:.2f} degrees and the push {100 * offs[last][1]:.1f} % from the "
        f"ply's.",
        "![shapes, pushes and angles](ply.png)",
    )  # fmt: skip
    _picture(out / "ply.png", states)
    if offs[last][0] > 0.2 or offs[last][1] > 0.08 or min(kinds[turns] for turns in (4.0, 4.5)) < 5:
        raise AssertionError(f"{offs}, {kinds}")
    deepest, worst = max(depth(state) for _, state in states), max(complementarity(state) for _, state in states)
    point = _point()
    finer = wound(SEGMENTS, TURNS[:1])
    push, energy = float(pushes(point)[:, 2].sum()), point.energy.total
    return {
        "point_push": Number(push, abs(push - float(pushes(finer)[:, 2].sum())) + 1e-5, "D w / l^2", ".3f"),
        "point_energy": Number(energy, abs(energy - finer.energy.total) + 1e-7, "D w / l", ".5f"),
        "known_push": Number(of_twist(15.0, 0.5 * APART, TORSION).push, 1e-3, "D w / l^3", ".2f"),
        "angle_off": Number(offs[last][0], 0.02, "degrees", ".2f"),
        "push_off": Number(offs[last][1], 0.01, "", ".3f"),
        "push_off_first": Number(offs[min(offs)][1], 0.05, "", ".2f"),
        "turns": Number(last, 0.0, "", ".1f"),
        "deepest": Number(deepest, 1e-6, "l", ".0e"),
        "complementarity": Number(worst, 1e-8, "D w / l", ".0e"),
    }
