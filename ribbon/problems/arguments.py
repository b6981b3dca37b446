"""What the kernels of a ribbon are given, as named tuples: what its energy depends on, and what loads it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ribbon import law
from ribbon.problems.fields import Fields
from ribbon.strip import Strip

FloatArray = NDArray[np.float64]


class Material(NamedTuple):
    """What the elastic energy of a segment depends on beside its shape.

    code, section: `Fields`; natural: whether the natural curvature is there, curvature (p, 2): K l at the start of
    every segment and its slope; poisson; rest (p, 4): natural twist and natural curvature in the plane there,
    each with its slope.
    """

    code: int
    section: tuple[float, ...]
    natural: bool
    curvature: FloatArray
    poisson: float
    rest: FloatArray

    @classmethod
    def of(cls, strip: Strip, fields: Fields, lengths: FloatArray) -> Material:
        """That of a strip with these fields on segments of `lengths` (p,)."""
        curvature = law.pieces(strip.curvature, lengths)
        rest = np.hstack([law.pieces(one, lengths) for one in (strip.twist, strip.geodesic)])
        return cls(fields.code, fields.section, strip.curvature != (0.0, 0.0), curvature, strip.poisson, rest)


class Loads(NamedTuple):
    """Dead loads on a ribbon that is clamped at s = 0, and where that is.

    gamma: weight in D w / l^2, 0 for none, up (3,); force (3,) at s = l in D w / l^2, where `pulled`; frame (3, 3) of
    the clamp; limit: of the series' exponents (`ribbon.element.series`).
    """

    gamma: float
    up: FloatArray
    force: FloatArray
    pulled: bool
    frame: FloatArray
    limit: float
