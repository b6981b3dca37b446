"""Multipliers against differences of the energy: forces, moments, a wall's force (thesis, appendix A)."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from compare.models.ribbon.build import ribbon_arguments
from compare.scene.scene import load
from ribbon import Clamp, Equilibrium, Gravity, Strip, Wall, solve
from ribbon.find.solve import solve_from
from tests.validation import page
from tests.validation.number import Number, rounding

SCENES = ("arc_5_1", "two_clamps_5_3_2", "start_5_3_3_1", "start_5_3_3_5")
#: Larger of the two steps of the central differences: length in l, angle in rad.
STEP = 5e-4
#: The same for the wall, whose joints in contact must not change.
WALL_STEP = 2e-4
#: Aim, relative to the size of the force or moment.
AIM = 1e-6
_TIGHT = {"tol": 1e-12}


def _richardson(energy: Callable[[float], float], step: float) -> float:
    """dE/dt at 0 with an error of order step^4."""
    coarse, fine = ((energy(h) - energy(-h)) / (2 * h) for h in (step, 0.5 * step))
    return (4 * fine - coarse) / 3


def _rotation(axis: int, angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    turned = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    turned[i, i] = turned[j, j] = c
    turned[j, i], turned[i, j] = s, -s
    return turned


def _moved(clamp: Clamp, shift: np.ndarray, turn: np.ndarray) -> Clamp:
    frame = turn @ clamp.frame
    return replace(clamp, position=np.asarray(clamp.position) + shift, tangent=frame[:, 2], normal=frame[:, 1])


def _solved(e: Equilibrium, **changes: Any) -> float:
    """Energy of the equilibrium next to `e` with fields of its problem changed."""
    problem: Any = e.problem
    changed = problem.with_changes(**changes)
    near = solve_from(changed, e.x, warm=(e.rows, e.multipliers), options=_TIGHT, check=False)
    if near.residual > 1e-9:
        raise AssertionError(f"no equilibrium next to it: {near.message}")
    return near.energy.total


def differences(e: Equilibrium, end: str) -> tuple[np.ndarray, np.ndarray]:
    """Force (3,) and moment (3,) on the ribbon at `end` ("start" or "end") by differences of the energy."""
    clamp = getattr(e.problem, end)
    none, unit = np.zeros(3), np.eye(3)
    force = [
        _richardson(lambda h, k=k: _solved(e, **{end: _moved(clamp, h * unit[k], unit)}), STEP) for k in range(3)
    ]  # fmt: skip
    moment = [
        _richardson(lambda h, k=k: _solved(e, **{end: _moved(clamp, none, _rotation(k, h))}), STEP) for k in range(3)
    ]
    return np.array(force), np.array(moment)


def _floor() -> Equilibrium:
    """A strip clamped above a floor on which it comes to rest."""
    strip = Strip(1.0, 0.05, 0.3, 0.0, 60.0)
    clamp = Clamp((0, 0, 0.2), (1, 0, 0), (0, 0, 1), ruling="free")
    return solve(strip, clamp, Gravity((0, 0, 1)), walls=(Wall((0, 0, 0), (0, 0, 1)),), segments=20, options=_TIGHT)


def _vector(values: np.ndarray) -> str:
    return "(" + ", ".join(f"{v:.6f}" for v in values) + ")"


@functools.cache
def clamped(name: str) -> Equilibrium:
    """A scene's state."""
    e = solve(**ribbon_arguments(load(name)), options=_TIGHT)
    if not e.ok:
        raise AssertionError(f"{name}: {e.message}")
    return e


def _clamp_errors(e: Equilibrium, end: str) -> list[tuple[str, np.ndarray, np.ndarray, float]]:
    """Of force and moment of a support: name, from multipliers, from the energy, relative error."""
    held = e.end_support if end == "end" else e.start
    assert held is not None
    found = []
    for what, rows, energy in zip(("force", "moment"), (held.force, held.moment), differences(e, end), strict=True):
        found.append((what, rows, energy, float(np.linalg.norm(rows - energy) / np.linalg.norm(rows))))
    return found


@functools.cache
def floor() -> tuple[Equilibrium, float, float]:
    """The strip on its floor, the floor's force from the multipliers and from the energy."""
    e = _floor()
    if not (e.ok and e.walls[0].contacts.size):
        raise AssertionError(f"floor: {e.message}")
    wall = e.problem.walls[0]  # type: ignore[attr-defined]
    lift = _richardson(lambda h: _solved(e, walls=(replace(wall, point=(0.0, 0.0, h)),)), WALL_STEP)
    return e, float(e.walls[0].force[2]), lift


def _end_force(name: str) -> float:
    """Size of the force at the end from the multipliers."""
    held = clamped(name).end_support
    assert held is not None
    return float(np.linalg.norm(held.force))


PROBES = {
    "wall": lambda: floor()[1],
    "wall_by_energy": lambda: floor()[2],
    "contacts": lambda: floor()[0].walls[0].contacts.size,
    "end_force_arc_5_1": lambda: _end_force("arc_5_1"),
    "end_force_start_5_3_3_1": lambda: _end_force("start_5_3_3_1"),
}


def run(out: Path) -> dict[str, Number]:
    rows, worst = [], 0.0
    sizes: dict[str, Number] = {}
    for name in SCENES:
        e = clamped(name)
        for end in ("end", "start"):
            for what, by_rows, by_energy, error in _clamp_errors(e, end):
                worst = max(worst, error)
                rows.append([name, end, what, _vector(by_rows), _vector(by_energy), f"{error:.0e}"])
                size = float(np.linalg.norm(by_rows))
                unit = "D w / l^2" if what == "force" else "D w / l"
                sizes[f"{end}_{what}_{name}"] = Number(size, max(1e-9, 2.0 * error) * size, unit, ".6f")
    e, push, lift = floor()
    between = len(e.problem.touching)  # type: ignore[attr-defined]
    wall_error = abs(lift - push) / push
    balance = abs(float(e.start.force[2]) + push - 60.0) / 60.0
    page.write(
        out / "forces.md", "Multipliers are forces", "python -m tests.validation forces",
        "What a support exerts on the ribbon, in D w / l^2 and D w / l, from the multipliers (thesis, appendix A) and "
        "from differences of the energy of neighbouring equilibria: the clamp moved along and turned about the three "
        f"axes. Central differences with steps of {STEP:g} and half of it, extrapolated (Richardson); every shifted "
        "problem is solved again. Error: norm of the difference over the norm of the vector. "
        f"Largest: {worst:.0e} (aim: {AIM:.0e}).",
        page.table(["scene", "support", "what", "from multipliers", "from the energy", "relative error"], rows),
        "## A wall\n\n"
        f"A strip (w/l = 0.05, Gamma = 60) clamped 0.2 l above a floor, 20 segments, {e.walls[0].contacts.size} joints "
        f"and {between} points of the edges between joints in contact: the floor holds both (held at joints alone, "
        "the edges dip into it and its force is another in the third digit). "
        f"Force of the floor from its multipliers: {push:.8f}; dE/dH when the floor is lifted (steps of "
        f"{WALL_STEP:g} and half of it): {lift:.8f}; relative difference {wall_error:.0e}. Clamp and floor carry the "
        f"weight to {balance:.0e}.",
    )  # fmt: skip
    if max(worst, wall_error) > AIM or balance > 1e-8:
        raise AssertionError(f"multipliers and energies differ: {worst:.1e}, wall {wall_error:.1e}, {balance:.1e}")
    return sizes | {
        "worst": rounding(worst),
        "wall_relative": rounding(wall_error),
        "wall": Number(push, max(1e-9, 2.0 * wall_error) * push, "D w / l^2", ".4f"),
        "wall_by_energy": Number(lift, max(1e-9, 2.0 * wall_error) * push, "D w / l^2", ".8f"),
        "contacts": Number(e.walls[0].contacts.size, 0, shown="d"),
        "between": Number(between, 0, shown="d"),
    }
