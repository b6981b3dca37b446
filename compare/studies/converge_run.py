"""Convergence as h/w falls for one scene: comparisons, one per ruling at the clamp, and what is fitted to them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from compare.models.choice import beside_the_shell
from compare.models.scope import require_shell
from compare.page.pair import Row
from compare.scene.scene import Scene
from compare.store.progress import Reporter
from compare.store.store import CaseStore
from compare.studies.compare import Comparison, compare
from compare.studies.converge import Estimate, Limit, Points, Scalar, limit, scalars, slope
from ribbonbench.errors import BadInput

#: The key that `--ruling` varies.
RULING = "clamp.start.ruling"
#: w/h of a scene that gives none or one.
RATIOS = (20.0, 50.0, 100.0, 200.0)


@dataclass(frozen=True)
class Study:
    """One model against the shells, the one that `compare` sets beside them: the comparison and what is fitted to its
    claimed rows (`points`); ruling: "free", "straight", or "" for a scene without such a clamp."""

    ruling: str
    comparison: Comparison
    points: Points
    slope: Estimate | None
    limit: Limit | None
    scalars: tuple[Scalar, ...]

    @property
    def model(self) -> str:
        """The name of the model beside the shells."""
        return self.comparison.fast.model

    @property
    def inside(self) -> bool | None:
        """Whether the distance that is left at h/w = 0 may be none; None when it was not fitted."""
        return None if self.limit is None else self.limit.d0.both[0] <= 0.0

    @property
    def thinnest(self) -> Row | None:
        """The converged row of the largest w/h."""
        rows = [row for row in self.comparison.rows if row.hausdorff is not None]
        return max(rows, key=lambda row: row.width_to_thickness) if rows else None


def prepared(scene: Scene, ratios: Sequence[float] | None = None, elements: tuple[int, int] | None = None) -> Scene:
    """The scene with two w/h at least: those given, its own, or `RATIOS` where it has one or none."""
    keys: dict[str, Any] = {}
    if elements is not None:
        keys["shell.elements"] = list(elements)
    if ratios is not None:
        if len(set(ratios)) < 2:
            raise BadInput(
                "--width-to-thickness", " ".join(f"{r:g}" for r in ratios), "is not enough for a slope",
                "give two values at least, four for a limit",
            )  # fmt: skip
        keys["shell.width_to_thickness"] = sorted(set(ratios))
    elif len(scene.shell.width_to_thickness) < 2:
        keys["shell.width_to_thickness"] = list(RATIOS)
    found = scene.replace(keys) if keys else scene
    require_shell(found)
    return found


def check_rulings(scene: Scene, rulings: Sequence[str]) -> None:
    """`BadInput` for rulings at the clamp where the model beside the shells has none to choose."""
    beside = beside_the_shell(scene)
    if rulings and RULING not in beside.reads:
        raise BadInput(
            "--ruling", " ".join(rulings), f"is without effect on the model {beside.name}",
            "leave it out, or choose another model.energy",
        )  # fmt: skip


def study(scene: Scene, store: CaseStore, reporter: Reporter, leave_saddle: bool | None = None) -> Study:
    """Compares, and fits what the claimed rows allow."""
    found = compare(scene, store, reporter, leave_saddle=leave_saddle)
    return fitted(scene.clamp_start.ruling if scene.clamp_start is not None else "", found)


def studies(
    scene: Scene, rulings: Sequence[str], store: CaseStore, reporter: Reporter, leave_saddle: bool | None = None
) -> list[Study]:
    """One study per ruling at s = 0 (none named: the scene's own), with the same shells."""
    check_rulings(scene, rulings)
    if not rulings:
        return [study(scene, store, reporter, leave_saddle)]
    found = []
    for ruling in rulings:
        reporter.step(f"{beside_the_shell(scene).name} with a {ruling} ruling at the clamp")
        found.append(study(scene.replace({RULING: ruling}), store, reporter, leave_saddle))
    return found


def fitted(ruling: str, comparison: Comparison) -> Study:
    """The fits of a comparison."""
    rows = [
        row for row in comparison.rows
        if row.claimed and row.hausdorff is not None and row.ribbon_error is not None and row.shell_error is not None
    ]  # fmt: skip
    rows.sort(key=lambda row: row.width_to_thickness)
    columns = [(1.0 / r.width_to_thickness, r.hausdorff, r.ribbon_error, r.shell_error) for r in rows]
    points = Points.of(*np.array(columns, dtype=float).reshape(-1, 4).T)
    return Study(ruling, comparison, points, slope(points), limit(points), tuple(_scalars(comparison, rows, points)))


def _scalars(comparison: Comparison, rows: list[Row], points: Points) -> list[Scalar]:
    """End position (l) and energies (D w / l) at h/w = 0 beside the model's own.

    The surfaces' errors bound those of the end; those of the energies are not known.
    """
    if not rows or any(row.shell_end is None for row in rows) or len(points) != len(rows):
        return []
    if any(row.energy is None or row.energy.elastic is None for row in rows):
        return []
    own, end = comparison.fast.energy, comparison.fast.end
    if own is None or own.elastic is None or end is None:
        return []
    shell: dict[str, list[float]] = {}
    ribbon: dict[str, float] = {}
    for k, axis in enumerate("xyz"):
        shell[f"end {axis} / l"] = [float(row.shell_end["position"][k]) for row in rows]  # type: ignore[index]
        ribbon[f"end {axis} / l"] = float(end.position[k])
    for name in ("elastic", "gravity"):
        shell[f"{name} energy"] = [float(getattr(row.energy, name)) for row in rows]
        ribbon[f"{name} energy"] = float(getattr(own, name))
    shell["total energy"] = [a + b for a, b in zip(shell["elastic energy"], shell["gravity energy"], strict=True)]
    ribbon["total energy"] = ribbon["elastic energy"] + ribbon["gravity energy"]
    still = [name for name, values in shell.items() if max(map(abs, values)) < 1e-9]
    for name in still:  # e.g. out of the plane: nothing to extrapolate
        del shell[name]
    errors = {name: points.shell_error for name in shell if name.startswith("end")}
    known = dict.fromkeys(errors, comparison.fast.error or 0.0)
    return scalars(points, shell, ribbon, errors, known)
