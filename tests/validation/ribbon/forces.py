"""Multipliers against differences of the energy: forces, moments, a wall's force (thesis, appendix A)."""

from __future__ import annotations

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


def run(out: Path) -> None:
    rows, worst = [], 0.0
    for name in SCENES:
        e = solve(**ribbon_arguments(load(name)), options=_TIGHT)
        if not e.ok:
            raise AssertionError(f"{name}: {e.message}")
        for end in ("end", "start"):
            held = e.end_support if end == "end" else e.start
            assert held is not None
            for what, by_rows, by_energy in zip(
                ("force", "moment"), (held.force, held.moment), differences(e, end), strict=True
            ):
                error = float(np.linalg.norm(by_rows - by_energy) / np.linalg.norm(by_rows))
                worst = max(worst, error)
                rows.append([name, end, what, _vector(by_rows), _vector(by_energy), f"{error:.0e}"])
    e = _floor()
    if not (e.ok and e.walls[0].contacts.size):
        raise AssertionError(f"floor: {e.message}")
    wall = e.problem.walls[0]  # type: ignore[attr-defined]
    lift = _richardson(lambda h: _solved(e, walls=(replace(wall, point=(0.0, 0.0, h)),)), WALL_STEP)
    push = float(e.walls[0].force[2])
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
        f"in contact. Force of the floor from its multipliers: {push:.8f}; dE/dH when the floor is lifted (steps of "
        f"{WALL_STEP:g} and half of it): {lift:.8f}; relative difference {wall_error:.0e}. Clamp and floor carry the "
        f"weight to {balance:.0e}.",
    )  # fmt: skip
    if max(worst, wall_error) > AIM or balance > 1e-8:
        raise AssertionError(f"multipliers and energies differ: {worst:.1e}, wall {wall_error:.1e}, {balance:.1e}")
