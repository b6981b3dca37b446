"""u_input: by how much a shape may be off because its inputs are (ASME V&V 20-2009, chapter 3; first order).

With the standard uncertainties u_k of the scene's section `[uncertainty]`, taken as independent, and exact derivatives
of the centreline r(s) by the keys x_k (docs/theory.md, eq. (11.2))::

    u_input = max over s of sqrt( sum_k |dr(s)/dx_k|^2 u_k^2 )
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
import scipy  # its parts are loaded where they are first used
from numpy.typing import NDArray

from compare.measure.align import Motions
from compare.models import model
from compare.models.base import State
from compare.models.capabilities import Differentiates, NotDifferentiable
from compare.scene.scene import Scene

FloatArray = NDArray[np.float64]

#: Points of the centreline.
_POINTS = 201


@dataclass(frozen=True)
class InputUncertainty:
    """Standard uncertainty of the centreline (of lengths in l) that the inputs bring; None where it is not known.

    total: largest along the strip; rms: root of its mean square along the strip; parts: the largest of each key alone;
    why: the reason where it is not known.
    """

    total: float | None
    rms: float | None = None
    parts: Mapping[str, float] = field(default_factory=dict)
    why: str = ""

    def to_dict(self) -> dict[str, Any]:
        """The entry `u_input` of result.json."""
        return {"total": self.total, "rms": self.rms, "parts": dict(self.parts), "why": self.why or None}


def uncertain(scene: Scene) -> dict[str, float]:
    """Standard uncertainties by the keys that they are about ("strip.young"), in their units; those above zero."""
    given = {f"strip.{item.name}": getattr(scene.uncertainty, item.name) for item in fields(scene.uncertainty)}
    return {key: value for key, value in given.items() if value}


def input_uncertainty(scene: Scene, state: State) -> InputUncertainty | None:
    """u_input of a state of the scene; None where the scene says nothing about how sure its inputs are."""
    unsure = uncertain(scene)
    if not unsure:
        return None
    found = model(state.model)
    if not isinstance(found, Differentiates) or state.shape is None:
        return InputUncertainty(None, why=f"the model {state.model} has no derivatives by its inputs")
    s = np.linspace(0.0, 1.0, _POINTS)
    try:
        by = found.derivatives(scene, state, tuple(unsure), lambda g: g.position(s))
    except NotDifferentiable as error:
        return InputUncertainty(None, why=str(error))
    shape = state.shape.centreline(s)
    squares = {
        key: (without_motions(moved, shape, state.motions) ** 2).sum(axis=1) * unsure[key] ** 2
        for key, moved in by.items()
    }
    total = np.sum(list(squares.values()), axis=0)
    return InputUncertainty(
        float(np.sqrt(total.max())),
        float(np.sqrt(scipy.integrate.trapezoid(total, s))),
        {key: float(np.sqrt(values.max())) for key, values in squares.items()},
    )


def without_motions(moved: FloatArray, shape: FloatArray, motions: Motions | None) -> FloatArray:
    """Displacements (k, 3) of the points `shape` (k, 3) less the free rigid motion that fits them best."""
    if motions is None:
        return moved
    turns = [np.broadcast_to(direction, shape.shape) for direction in motions.translations]
    centre = shape.mean(axis=0) if motions.pivot is None else motions.pivot
    turns += [np.cross(axis, shape - centre) for axis in motions.axes]
    basis = np.stack([field_.ravel() for field_ in turns], axis=1)
    fit, *_ = np.linalg.lstsq(basis, moved.ravel(), rcond=None)
    return moved - (basis @ fit).reshape(moved.shape)
