"""A case as a surface: what a program that has shells can take of it.

The rest shape is a plane, an arc of a cylinder, an arc of a flat ring or a helicoid about one axis: whatever a constant
curvature makes of a strip. Lengths in l; D = Y h^3 / (12 (1 - nu^2)) = 1 and mass per area 1, so that weights are Gamma
and a force over w is in D w / l^2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from compare.suite.answers import NotRepresentable
from compare.suite.section import PLANE, THEORIES, bar_of

if TYPE_CHECKING:
    from compare.scene.scene import Scene

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Plate:
    """A strip that is clamped at s = 0: width, thickness (l), Poisson's ratio; constant curvatures at rest about t_x
    and t_y and twist; place and frame (columns t_x across, t_y normal, t_z along) of the clamp; weight per area, in
    D / l^3; force on the free end, in D w / l^2."""

    width: float
    thickness: float
    poisson: float
    rest: tuple[float, ...]
    start: tuple[float, ...]
    frame: tuple[tuple[float, ...], ...]
    weight: tuple[float, ...]
    force: tuple[float, ...]

    def points(self, along: FloatArray, across: FloatArray) -> FloatArray:
        """Places (k, m, 3) of the rest shape at abscissae along (k,) and across (m,) it."""
        rest, frame = np.array(self.rest), np.array(self.frame)
        axes = frame @ Rotation.from_rotvec(along[:, None] * rest).as_matrix()
        # The tangent's integral: Gauss's rule of eight points on each piece, which is exact to rounding.
        nodes, weights = np.polynomial.legendre.leggauss(8)
        pieces = np.diff(along)
        at = along[:-1, None] + 0.5 * pieces[:, None] * (nodes + 1.0)
        tangents = Rotation.from_rotvec(at.reshape(-1, 1) * rest).as_matrix()[:, :, 2].reshape(*at.shape, 3)
        steps = 0.5 * pieces[:, None] * np.einsum("q,kqi->ki", weights, tangents)
        line = np.array(self.start) + np.vstack([np.zeros(3), np.cumsum(steps, axis=0)]) @ frame.T
        found: FloatArray = line[:, None] + across[None, :, None] * axes[:, None, :, 0]
        return found


def plate_of(scene: Scene, theory: str) -> Plate:
    """The plate of a scene. Raises `NotRepresentable` for what is none."""
    if theory not in (PLANE, THEORIES[-1]):
        raise NotRepresentable(f'a shell has not the theory "{theory}"')
    bar, thickness = bar_of(scene, theory), scene.thickness
    if thickness is None or scene.strip.second_moment is not None:
        raise NotRepresentable("the case has no thickness, which a shell needs")
    if scene.rod is not None:
        raise NotRepresentable("a section by its stiffnesses, of which a shell has none")
    if any(bar.moment):
        raise NotRepresentable("this adapter makes no moment on an end")
    return Plate(
        float(scene.width), float(thickness), float(scene.strip.poisson), bar.rest, bar.start, bar.frame, bar.weight,
        bar.force,
    )  # fmt: skip


def knots(width: float, m: int) -> FloatArray:
    """Abscissae across (m + 1,) of the elements' corners: nearer to each other towards both edges."""
    found: FloatArray = -0.5 * width * np.cos(np.pi * np.linspace(0.0, 1.0, m + 1))
    return found
