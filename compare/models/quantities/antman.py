"""What a shearable rod's result holds beside that of every model."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.models.quantities import Answered
from compare.record.quantity import DATA, Quantity

FloatArray = NDArray[np.float64]

#: Abscissae at which the strains are looked at.
POINTS = 401


def along(a: Answered) -> FloatArray:
    """The abscissa, the strains (shear x, y, stretch, curvatures) and what the section carries (force, moment; all in
    its own frame) at `POINTS` places (k, 13)."""
    s = np.linspace(0.0, 1.0, POINTS)
    return np.column_stack([s, a.state.native.strains(s), a.state.native.section_forces(s)])


def _model(a: Answered) -> dict[str, Any]:
    r = a.state.native
    return {
        "energy": a.scene.model.energy, "formulation": "quaternions", "elements": len(r.elements.joints) - 1,
        "degree": r.degree, "unknowns": a.state.unknowns,
    }  # fmt: skip


def _path(a: Answered) -> dict[str, Any]:
    r = a.state.native
    return {"reached": r.reached, "steps": r.steps, "snaps": r.snaps}


def _section(a: Answered) -> dict[str, Any]:
    section = a.state.native.problem.section
    return {
        "bending": section.bending, "torsion": section.torsion, "shear": section.shear, "stretch": section.stretch,
    }  # fmt: skip


QUANTITIES: tuple[Quantity[Answered], ...] = (
    Quantity("model", kind=DATA, of=_model),
    Quantity("path", kind=DATA, of=_path),
    Quantity("section", kind=DATA, of=_section),
    Quantity("max_abs_shear", kind=DATA, of=lambda a: float(np.abs(along(a)[:, 1:3]).max())),
    Quantity("max_abs_stretch", kind=DATA, of=lambda a: float(np.abs(along(a)[:, 3]).max())),
    Quantity("flutter", kind=DATA, of=lambda a: a.state.native.flutter),
)
