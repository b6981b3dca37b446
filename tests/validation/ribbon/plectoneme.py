"""A twisted rod whose clamped ends come together: it bows, and jumps into a loop that lies on itself.

Both clamps are along one axis, turned against each other by three turns, and brought together (S. Neukirch, G. H. M.
van der Heijden and J. M. T. Thompson 2002, J. Mech. Phys. Solids 50, 1175). Beside it half of the rod by shooting, up
to the end of its first place of contact (`tests.reference.clamped_rod`).
"""

from __future__ import annotations

from functools import cache
from itertools import pairwise
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import brentq

from ribbon import Clamp, Equilibrium
from ribbon.find.continuation import follow
from ribbon.find.solve import build, solve
from ribbon.problems.mixed import MixedProblem
from tests.reference import clamped_rod as reference
from tests.validation import page
from tests.validation.number import Number
from tests.validation.ribbon.michell import STRIP, TORSION, held, pushes
from tests.validation.ribbon.ply import complementarity, depth

#: Turn of the clamps against each other (rad), diameter of the rod (l).
TURN, APART = 6.0 * np.pi, 0.02
#: Distances of the ends (l): before the jump, and those that are looked at; steps there, and where it is about to jump.
BOWED, DISTANCES = 0.9, (0.7, 0.645, 0.637, 0.632, 0.56, 0.48, 0.455, 0.44)
_STEP, _FINE, _SUDDEN = 0.015, 0.001, ((0.632, 0.645), (0.44, 0.455))
SEGMENTS = 120
#: Unknowns of the shooting to begin with, without contact (x, a, t, n_2, n_3; curvature in the middle) and with it
#: (x, a, s, n_2, n_3, curvature, F; twist), and steps of both.
_FREE = (8.0, (0.1771634, 0.55806027, 16.90983273, -8.36905827, 39.24286548))
_TOUCHING = (12.58, (0.18441077, -1.77950235, 0.17215523, 165.39492225, 105.14299578, 23.20148149, 169.22395954))
_STEPS = 0.2, 0.05


def rod(turn: float, distance: float, segments: int) -> MixedProblem:
    """The rod between clamps along z at this distance, turned by `turn` (rad)."""
    end = Clamp((0.0, 0.0, distance), (0.0, 0.0, 1.0), (-np.sin(turn), np.cos(turn), 0.0))
    found = build(STRIP, Clamp(), end=end, energy="kirchhoff", segments=segments, apart=APART, round_rod=True)
    assert isinstance(found, MixedProblem)
    return found


@cache
def bowed(segments: int) -> Equilibrium:
    """Turned, and not yet brought together."""
    flat = rod(0.0, BOWED, segments)
    state = solve(
        STRIP, flat.start, end=flat.end, energy="kirchhoff", segments=segments, apart=APART, round_rod=True
    )  # fmt: skip
    return follow(lambda t: rod(TURN * t, BOWED, segments), state, steps=30)


@cache
def at(segments: int, stages: tuple[float, ...]) -> tuple[Equilibrium, tuple[tuple[float, float], ...]]:
    """The rod at the last of the distances, each reached from the one before, and between which distances it jumped."""
    if not stages:
        return bowed(segments), ()
    state, jumps = at(segments, stages[:-1])
    begin, end = (BOWED, *stages)[-2], stages[-1]
    fine = any(low <= end < high for low, high in _SUDDEN)
    steps = max(1, round((begin - end) / (_FINE if fine else _STEP)))
    seen, jumped = [begin], list(jumps)

    def note(record, _) -> None:
        seen.append(begin + (end - begin) * record.t)
        if record.jump:
            jumped.append((seen[-1], seen[-2]))

    state = follow(lambda t: rod(TURN, begin + (end - begin) * t, segments), state, steps=steps, on_step=note)
    return state, tuple(jumped)


# -- by shooting -----------------------------------------------------------------------------------------------------


@cache
def branch(touching: bool) -> tuple[tuple[float, reference.Clamped], ...]:
    """The rods without contact, by the curvature in the middle, or with it, by the twist downwards."""
    begin, guess = _TOUCHING if touching else _FREE
    step = -_STEPS[1] if touching else _STEPS[0]
    found, old, v = [], None, np.array(guess)
    while len(found) < 200:
        value = begin + step * len(found)
        try:
            one = _shot(touching, value, v if old is None else 2.0 * v - old)
        except ValueError:
            break
        old, v = v, one.unknowns
        found.append((value, one))
        if len(found) > 8 and one.distance > found[-4][1].distance:
            break
    return tuple(found)


def _shot(touching: bool, value: float, guess: np.ndarray) -> reference.Clamped:
    if touching:
        return reference.touching(value, TURN, TORSION, APART, guess)
    return reference.free(value, TURN, TORSION, guess)


def shot(distance: float, touching: bool) -> reference.Clamped | None:
    """The rod at a distance of its ends before its branch turns back; None where the branch has none."""
    for (low, one), (high, other) in pairwise(branch(touching)):
        if one.distance >= distance > other.distance:
            known = one.unknowns
            value = brentq(lambda b, v=known: _shot(touching, b, v).distance - distance, low, high, xtol=1e-9)
            return _shot(touching, value, known)
    return None


def fold(touching: bool) -> float:
    """The least distance of the branch, by a parabola through three rods."""
    every = branch(touching)
    k = int(np.argmin([one.distance for _, one in every]))
    near = every[min(max(k, 1), len(every) - 2) - 1 :][:3]
    a, b, c = np.polyfit([value - near[1][0] for value, _ in near], [one.distance for _, one in near], 2)
    return float(c - 0.25 * b * b / a)


# -- the page --------------------------------------------------------------------------------------------------------


def compared() -> tuple[list[list[str]], dict[str, float]]:
    """Rows of the table of states, and the largest differences from the shooting."""
    rows, off = [], dict.fromkeys(("energy", "tension", "force", "deep", "product", "held"), 0.0)
    for k, distance in enumerate(DISTANCES):
        state = at(SEGMENTS, DISTANCES[: k + 1])[0]
        if not state.ok:
            raise AssertionError(f"{distance}: {state.message}")
        found, ends = pushes(state), state.end_support
        assert ends is not None
        beside = shot(distance, len(found) > 0) if len(found) < 2 else None
        each = {"deep": depth(state), "product": complementarity(state),
                "held": held(state) / max(1.0, found[:, 2].max(initial=0.0))}  # fmt: skip
        if beside is not None:
            each["energy"] = abs(state.energy.total / beside.energy - 1.0)
            each["tension"] = abs(ends.force[2] / beside.tension - 1.0)
            if len(found):
                each["force"] = abs(found[0, 2] / beside.force - 1.0)
        off = {name: max(value, each.get(name, 0.0)) for name, value in off.items()}
        middle = 0.5 * float(found[:, :2].sum(axis=1).mean()) if len(found) else 0.5
        rows.append([f"{distance:g}", str(len(found)), "; ".join(f"{s:.4f}" for s in found[:, 0]),
                     "; ".join(f"{f:.2f}" for f in found[:, 2]), f"{middle:.4f}", f"{ends.force[2]:.3f}",
                     f"{ends.moment[2]:.4f}", f"{float(state.tau([0.5])[0]):.4f}", f"{state.energy.total:.4f}",
                     *(f"{each[name]:.0e}" if name in each else "" for name in ("energy", "tension", "force")),
                     f"{state.lowest_eigenvalue:.4f}", f"{each['deep']:.0e}", f"{each['product']:.0e}"])  # fmt: skip
    return rows, off


def _picture(path: Path) -> None:
    figure = plt.figure(figsize=(12, 7.5))
    for k, distance in enumerate((0.7, 0.632, 0.48, 0.44)):
        state = at(SEGMENTS, DISTANCES[: DISTANCES.index(distance) + 1])[0]
        axes = figure.add_subplot(2, 4, k + 1, projection="3d")
        r = state.position(np.linspace(0.0, 1.0, 1201))
        axes.plot(*r[:601].T, color="tab:blue", lw=3)
        axes.plot(*r[600:].T, color="tab:orange", lw=3)
        found = pushes(state)
        if len(found):
            axes.plot(*state.position(found[:, 0]).T, "k.", ms=5)
        out = r[np.argmax(np.hypot(r[:, 0], r[:, 1]))]
        axes.set(title=f"Z = {distance:g}", xlim=(-0.2, 0.2), ylim=(-0.2, 0.2), zlim=(-0.05, 0.75))
        axes.set_box_aspect((0.4, 0.4, 0.8), zoom=1.5)
        axes.view_init(5, float(np.degrees(np.arctan2(out[1], out[0]))) - 90.0)
        axes.set_axis_off()
    left, right = figure.add_subplot(2, 2, 3), figure.add_subplot(2, 2, 4)
    for touching in (False, True):
        every = [one for _, one in branch(touching)]
        name = "one place" if touching else "no contact"
        left.plot([one.distance for one in every], [one.tension for one in every], "-", label=f"{name}, shooting")
        right.plot([one.distance for one in every], [one.moment for one in every], "-")
    states = [at(SEGMENTS, DISTANCES[: k + 1])[0] for k in range(len(DISTANCES))]
    left.plot(DISTANCES, [s.end_support.force[2] for s in states], "k.", label=f"{SEGMENTS} segments")
    right.plot(DISTANCES, [s.end_support.moment[2] for s in states], "k.")
    left.set(xlabel="distance of the ends Z (l)", ylabel="tension (D w / l^2)")
    right.set(xlabel="distance of the ends Z (l)", ylabel="moment about the axis (D w / l)")
    left.legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    plt.close(figure)


@cache
def _few() -> Equilibrium:
    return at(60, (0.7,))[0]


PROBES = {
    "probe_energy": lambda: _few().energy.total,
    "without_end": lambda: reference.without_end(TURN, TORSION),
    "shot_force": lambda: reference.touching(_TOUCHING[0], TURN, TORSION, APART, np.array(_TOUCHING[1])).force,
}


def run(out: Path) -> dict[str, Number]:
    rows, off = compared()
    folds = fold(False), fold(True)
    jumps = at(SEGMENTS, DISTANCES)[1]
    _picture(out / "plectoneme.png")
    endless = reference.without_end(TURN, TORSION)
    few, fine = _few(), at(SEGMENTS, (0.7,))[0]
    page.write(
        out / "plectoneme.md",
        "A twisted rod whose ends come together",
        "python -m tests.validation plectoneme",
        f"A straight round rod of length 1 and diameter {APART:g}, torsional over bending stiffness {TORSION:.4f}, "
        "between clamps along one axis that are turned against each other by three turns and brought together to the "
        f"distance Z (`kirchhoff`, {SEGMENTS} segments, no friction). Forces in D w / l^2, energies in D w / l, "
        "lengths in l. What does not hold: nearer than 0.44 the path is not followed here; two places "
        "beside a shooting, and with more turns three and a line, are on segments that follow them: [lines of "
        "contact](contact_lines.md). Where along the rod the loop stands costs next to nothing, so that its middle is "
        "the mesh's.",
        f"It bows out, ever more sharply, jumps to a loop that lies on itself at one place, whose feet draw together, "
        f"and jumps to two. By shooting the equilibria without contact end at Z = {folds[0]:.5f} and those with one "
        f"place at {folds[1]:.4f}; the path jumped between {jumps[0][0]:.4f} and {jumps[0][1]:.4f}, and between "
        f"{jumps[-1][0]:.4f} and {jumps[-1][1]:.4f}. A loop on a rod without end jumps at {endless:.4f} (Neukirch, "
        "van der Heijden and Thompson 2002).",
        "*Middle*: halfway between the places that touch. *Shooting*: relative differences.",
        page.table(["Z", "places", "on one strand (s)", "forces", "middle (s)", "tension", "moment", "twist", "energy",
                    "energy, shooting", "tension", "force", "lowest eigenvalue",
                    "penetration", "push times gap"], rows),
        "![shapes, tension and moment over the distance](plectoneme.png)",
    )  # fmt: skip
    if max(off["energy"], off["tension"], off["force"]) > 1e-3 or off["deep"] > 1e-6 or len(jumps) != 2:
        raise AssertionError(f"{off}, {jumps}")
    if not jumps[0][0] < folds[0] + 2e-4 or not jumps[0][1] > folds[0] - 1e-3:
        raise AssertionError(f"{jumps}, {folds}")
    force = reference.touching(_TOUCHING[0], TURN, TORSION, APART, np.array(_TOUCHING[1])).force
    return {
        "jump": Number(folds[0], 1e-5, "l", ".4f"),
        "jump_low": Number(jumps[0][0], 5e-4, "l", ".4f"),
        "jump_high": Number(jumps[0][1], 5e-4, "l", ".4f"),
        "second_jump": Number(folds[1], 1e-3, "l", ".3f"),
        "without_end": Number(endless, 1e-9, "l", ".4f"),
        "energy_off": Number(off["energy"], 0.5 * off["energy"], "", ".0e"),
        "tension_off": Number(off["tension"], 0.5 * off["tension"], "", ".0e"),
        "force_off": Number(off["force"], 0.5 * off["force"], "", ".0e"),
        "deepest": Number(off["deep"], 1e-6, "l", ".0e"),
        "complementarity": Number(off["product"], 1e-8, "D w / l", ".0e"),
        "probe_energy": Number(few.energy.total, abs(few.energy.total - fine.energy.total), "D w / l", ".4f"),
        "shot_force": Number(force, 1e-5, "D w / l^2", ".4f"),
    }
