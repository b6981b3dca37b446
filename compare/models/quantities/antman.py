"""What a shearable rod's result holds beside that of every model."""

from __future__ import annotations

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


QUANTITIES: tuple[Quantity[Answered], ...] = (
    Quantity("model.formulation", kind=DATA, of=lambda a: "quaternions"),
    Quantity("model.elements", kind=DATA, of=lambda a: len(a.state.native.elements.joints) - 1),
    Quantity("model.degree", kind=DATA, of=lambda a: a.state.native.degree),
    Quantity("path.reached", kind=DATA, of=lambda a: a.state.native.reached),
    Quantity("path.steps", kind=DATA, of=lambda a: a.state.native.steps),
    Quantity("path.snaps", kind=DATA, of=lambda a: a.state.native.snaps),
    Quantity("section.bending", kind=DATA, of=lambda a: a.state.native.problem.section.bending),
    Quantity("section.torsion", kind=DATA, of=lambda a: a.state.native.problem.section.torsion),
    Quantity("section.shear", kind=DATA, of=lambda a: a.state.native.problem.section.shear),
    Quantity("section.stretch", kind=DATA, of=lambda a: a.state.native.problem.section.stretch),
    Quantity("max_abs_shear", kind=DATA, of=lambda a: float(np.abs(along(a)[:, 1:3]).max())),
    Quantity("max_abs_stretch", kind=DATA, of=lambda a: float(np.abs(along(a)[:, 3]).max())),
    Quantity("flutter", kind=DATA, of=lambda a: a.state.native.flutter),
)
