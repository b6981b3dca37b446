"""A case as a rod: what a program that knows strips by their stiffnesses alone can take of it.

Units: lengths in l, stiffnesses in D w, forces in D w / l^2, moments in D w / l. The frame's columns are t_x (across),
t_y (normal), t_z (along). A strip of the theory "elastica" bends with D w; one of "body" as a narrow beam of the
section w x h, with Y I = (1 - nu^2) D w, and twists with Saint-Venant's constant.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from compare.scene.inputs.law import values
from compare.suite.answers import NotRepresentable
from compare.suite.reference import FreeRod
from compare.suite.schema import schema

if TYPE_CHECKING:
    from compare.scene.scene import Scene

FloatArray = NDArray[np.float64]
#: Theories of cases that a rod has: strips that bend in one plane, with D w; rods; bodies.
_NAMES = schema()["properties"]["theory"]["enum"]
THEORIES = PLANE, _, _ = (_NAMES[0], _NAMES[1], _NAMES[-1])
#: Of a strip without a thickness, which bends in one plane: in its own plane and in twist, against D w.
_STIFF, _TWIST = 1e3, 1.0


@dataclass(frozen=True)
class Bar:
    """stiffness: bending about t_x and t_y, torsion; shear along t_x, t_y and stretch (None: rigid); rest: curvatures
    about t_x, t_y and twist; start, frame: of the clamp s = 0; weight per length, force and moment on the free end."""

    stiffness: tuple[float, float, float]
    shear: tuple[float, float, float] | None
    rest: tuple[float, float, float]
    start: tuple[float, ...]
    frame: tuple[tuple[float, ...], ...]
    weight: tuple[float, ...]
    force: tuple[float, ...]
    moment: tuple[float, ...]

    def to_dict(self) -> dict[str, Any]:
        """For JSON; the frame row by row."""
        return asdict(self)

    @property
    def free_rod(self) -> FreeRod:
        """The same in units of its softer bending stiffness, for `compare.suite.reference`."""
        unit = self.stiffness[0]
        compliance = np.zeros(3) if self.shear is None else unit / np.array(self.shear)
        return FreeRod(
            np.array(self.stiffness) / unit, np.array(self.rest), np.array(self.frame), np.array(self.weight) / unit,
            np.array(self.force) / unit, np.array(self.moment) / unit, compliance,
        )  # fmt: skip


def saint_venant(ratio: float) -> float:
    """The torsion constant of a rectangle over w h^3 / 3; ratio: h / w."""
    total = sum(math.tanh((2 * k + 1) * math.pi / (2.0 * ratio)) / (2 * k + 1) ** 5 for k in range(60))
    return 1.0 - 192.0 / math.pi**5 * ratio * total


def _even(law: Any, what: str) -> float:
    found = set(map(float, values(law)))
    if len(found) != 1:
        raise NotRepresentable(f"{what} that varies along the strip")
    return found.pop()


def bar_of(scene: Scene, theory: str) -> Bar:
    """The rod of a scene that is clamped at its start and free at its end. Raises `NotRepresentable` for any other."""
    if theory not in THEORIES:
        raise NotRepresentable(f'a rod has not the theory "{theory}"')
    for there, what in (
        (scene.closure is not None, "closed strips"), (bool(scene.walls), "walls"),
        (bool(scene.obstacles), "round obstacles"),
        (scene.clamp_end is not None, "a second clamp"), (not scene.start_clamped, "a start that is not clamped"),
        (scene.transverse_curvature != 0.0, "sections that are curved at rest"),
        (scene.several_equilibria, "a path to one of several equilibria"),
    ):  # fmt: skip
        if there:
            raise NotRepresentable(f"this adapter makes no {what}")
    stiffness, shear = _section(scene, theory)
    weight = np.zeros(3) if scene.up is None else -scene.gamma * scene.up
    rest = (_even(scene.curvature, "a curvature"), _even(scene.geodesic, "a curvature"), _even(scene.twist, "a twist"))
    return Bar(
        stiffness, shear, rest, tuple(map(float, scene.position)), tuple(tuple(map(float, row)) for row in scene.frame),
        tuple(map(float, weight)), tuple(map(float, scene.tip_force)), tuple(map(float, scene.tip_moment)),
    )  # fmt: skip


def _section(scene: Scene, theory: str) -> tuple[tuple[float, float, float], tuple[float, float, float] | None]:
    rod, nu, h, w = scene.rod, scene.strip.poisson, scene.thickness, scene.width
    bending: tuple[float, float] | None = None if rod is None else rod.bending
    torsion = None if rod is None else rod.torsion
    shear = None
    if rod is not None and rod.shear is not None and rod.stretch is not None:
        shear = (*map(float, rod.shear), float(rod.stretch))
    if bending is None or torsion is None:
        if scene.strip.second_moment is not None or h is None:
            own = ((1.0, _STIFF), _TWIST)
        else:
            soft = 1.0 if theory == PLANE else 1.0 - nu**2
            own = ((soft, soft * (w / h) ** 2), 2.0 * (1.0 - nu) * saint_venant(h / w))
        bending, torsion = bending or own[0], torsion or own[1]
    return (float(bending[0]), float(bending[1]), float(torsion)), shear  # type: ignore[return-value]
