"""A scene as a model of another program: MuJoCo, PyElastica, EXUDYN, Newton, USD. Text, made without the program.

Every model has the scene's stiffnesses per direction, its rest shape, its start shape (the equilibrium that the scene's
own model finds), a clamp that holds all six degrees, its weight and the dead load on its end. Units: SI where the scene
gives strip.young, else l and D w. What is not a strip clamped at one end is refused by name.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from compare.models.base import Shape
from compare.scene.scene import Scene
from compare.suite.answers import NotRepresentable
from compare.suite.peers.models import mujoco_text, rest_shape
from compare.suite.section import PLANE, THEORIES, Bar, bar_of
from ribbonbench.errors import BadInput

FloatArray = NDArray[np.float64]
#: Elements of an exported model where nothing else is said.
ELEMENTS = 40


@dataclass(frozen=True)
class Exported:
    """A bar with its units: length (m or l), stiffness (N m^2 or D w), and the nodes (n + 1, 3) and frames (n, 3, 3) of
    the elements' middles where it starts, in l."""

    name: str
    bar: Bar
    length: float
    stiffness: float
    nodes: FloatArray
    frames: FloatArray
    unit: str

    @property
    def elements(self) -> int:
        """How many."""
        return len(self.frames)


def exported(scene: Scene, shape: Shape) -> Exported:
    """A scene with the state that its model found. `BadInput` for what is no strip clamped at one end."""
    theory = THEORIES[-1] if scene.model.stiffness == "plate" else PLANE
    try:
        bar = bar_of(scene, theory)
    except NotRepresentable as why:
        raise BadInput("--to", None, f"cannot have this scene: {why}", "export its surface: --format") from None
    known = scene.units.bending is not None
    at = np.linspace(0.0, 1.0, ELEMENTS + 1)
    return Exported(
        scene.name, bar, scene.strip.length if known else 1.0, float(scene.units.force or 1.0)
        * (scene.strip.length**2 if known else 1.0), shape.centreline(at), shape.frames(0.5 * (at[1:] + at[:-1])),
        "m, N" if known else "l, D w",
    )  # fmt: skip


def _mujoco(item: Exported) -> str:
    return mujoco_text(item.bar, item.elements, item.length, item.stiffness, item.frames)


def _numbers(item: Exported) -> dict[str, object]:
    """The model's numbers in its own units, for a program that is told them in Python."""
    bar, l, b = item.bar, item.length, item.stiffness
    nodes, frames = rest_shape(bar, item.elements)
    shear = bar.shear or tuple(2e4 * bar.stiffness[0] for _ in range(3))
    return {
        "length": l, "elements": item.elements,
        "bending_about_width": b * bar.stiffness[0], "bending_about_normal": b * bar.stiffness[1],
        "torsion": b * bar.stiffness[2], "shear_along_width": b / l**2 * shear[0],
        "shear_along_normal": b / l**2 * shear[1], "stretch": b / l**2 * shear[2],
        "rest_curvatures": [v / l for v in bar.rest], "clamp_position": [l * v for v in bar.start],
        "clamp_frame": bar.frame, "weight_per_length": [b / l**3 * v for v in bar.weight],
        "end_force": [b / l**2 * v for v in bar.force], "end_moment": [b / l * v for v in bar.moment],
        "rest_nodes": (l * nodes).tolist(), "rest_frames": frames.tolist(),
        "start_nodes": (l * item.nodes).tolist(), "start_frames": item.frames.tolist(),
    }  # fmt: skip


_PYELASTICA = '''

def rod():
    """The rod of PyElastica 1.0 in its rest shape: directors d_1, d_2, d_3 are width, normal, tangent."""
    import elastica as ea
    import numpy as np

    frame = np.array(MODEL["clamp_frame"])
    found = ea.CosseratRod.straight_rod(
        MODEL["elements"], np.array(MODEL["clamp_position"], float), frame[:, 2], frame[:, 1], MODEL["length"],
        0.01 * MODEL["length"], 1.0, youngs_modulus=1.0, shear_modulus=1.0,
    )
    found.position_collection[...] = np.array(MODEL["start_nodes"]).T
    found.director_collection[...] = np.array(MODEL["start_frames"]).transpose(2, 1, 0)
    bend = [MODEL[key] for key in ("bending_about_width", "bending_about_normal", "torsion")]
    shear = [MODEL[key] for key in ("shear_along_width", "shear_along_normal", "stretch")]
    found.bend_matrix[...] = np.diag(bend)[:, :, None]
    found.shear_matrix[...] = np.diag(shear)[:, :, None]
    found.rest_kappa[...] = -np.array(MODEL["rest_curvatures"])[:, None]
    return found
'''
_EXUDYN = '''

def section():
    """The section of EXUDYN's beams: x is the tangent, y the width, z the normal. Its ANCF beam is straight at rest."""
    import exudyn as exu
    import numpy as np

    found = exu.BeamSection()
    first = ["stretch", "shear_along_width", "shear_along_normal"]
    then = ["torsion", "bending_about_width", "bending_about_normal"]
    found.stiffnessMatrix = np.diag([MODEL[key] for key in first + then])
    return found
'''


_NEWTON = '''

def rod():
    """The rod of NVIDIA Newton 1.8 in its start shape, with its rest shape. It bends alike in both directions, here as
    the strip does about its width: it is this strip as long as that stays in the plane of its tangent and normal."""
    import newton
    import numpy as np

    points, turns = ([np.array(MODEL[f"{when}_{what}"], np.float32) for when in ("start", "rest")]
                     for what in ("nodes", "quaternions"))
    return newton.Rod(
        points[0], quaternions=turns[0], rest_points=points[1], rest_quaternions=turns[1],
        radius=0.2 * MODEL["length"] / MODEL["elements"], stretch_rigidity=MODEL["stretch"],
        shear_rigidity=MODEL["shear_along_normal"], bend_rigidity=MODEL["bending_about_width"],
        twist_rigidity=MODEL["torsion"],
    )
'''


def _python(functions: str, more: Mapping[str, object] = MappingProxyType({})) -> Callable[[Exported], str]:
    def text(item: Exported) -> str:
        head = f'"""{item.name}: a strip clamped at one end, in {item.unit}; written by ribbonbench."""\n\n'
        return head + "MODEL = " + json.dumps({**_numbers(item), **more}, indent=1) + "\n" + functions

    return text


def _newton(item: Exported) -> str:
    """Frames as quaternions (x, y, z, w), as Newton takes them."""
    frames = {"rest": rest_shape(item.bar, item.elements)[1], "start": item.frames}
    turns = {f"{when}_quaternions": Rotation.from_matrix(one).as_quat().tolist() for when, one in frames.items()}
    return _python(_NEWTON, turns)(item)


def _usd(item: Exported) -> str:
    """USD: the rest shape and the start shape as curves, the stiffnesses as attributes of our own namespace."""
    numbers = _numbers(item)

    def curve(name: str, key: str) -> str:
        points = np.array(numbers[key])
        told = ", ".join(f"({x:.9g}, {y:.9g}, {z:.9g})" for x, y, z in points)
        return (
            f'    def BasisCurves "{name}"\n    {{\n        uniform token type = "linear"\n'
            f"        int[] curveVertexCounts = [{len(points)}]\n        point3f[] points = [{told}]\n    }}\n"
        )

    values = "".join(
        f"    custom double ribbonbench:{key} = {value!r}\n"
        for key, value in numbers.items()
        if isinstance(value, float)
    )
    vectors = "".join(
        f"    custom double3 ribbonbench:{key} = ({', '.join(repr(float(v)) for v in numbers[key])})\n"  # type: ignore[attr-defined]
        for key in ("rest_curvatures", "weight_per_length", "end_force", "end_moment")
    )
    per = "1" if item.unit.startswith("m") else repr(1.0)
    return (
        f'#usda 1.0\n(\n    defaultPrim = "strip"\n    metersPerUnit = {per}\n    upAxis = "Z"\n)\n\n'
        f'def Xform "strip"\n{{\n{values}{vectors}{curve("rest", "rest_nodes")}{curve("start", "start_nodes")}}}\n'
    )


#: Program -> ending of its file and what writes it.
PROGRAMS: Mapping[str, tuple[str, Callable[[Exported], str]]] = {
    "mujoco": ("mujoco.xml", _mujoco),
    "pyelastica": ("pyelastica.py", _python(_PYELASTICA)),
    "exudyn": ("exudyn.py", _python(_EXUDYN)),
    "newton": ("newton_rod.py", _newton),
    "usd": ("strip.usda", _usd),
}
