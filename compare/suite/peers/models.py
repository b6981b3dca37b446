"""Models of a bar for other programs, as text: what each makes of stiffnesses, rest shape, clamp and loads.

Units: l, D w, D w / l^2. Rest shape and start shape are apart: a model is built in its rest shape, its loads are
applied by the program.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from compare.suite.section import Bar

FloatArray = NDArray[np.float64]


def rest_shape(bar: Bar, elements: int) -> tuple[FloatArray, FloatArray]:
    """Nodes (n + 1, 3) and frames (n, 3, 3) of the elements' middles of the unloaded bar, a helix or straight: one
    rotation about a fixed axis of its own frame."""
    rest, frame = np.array(bar.rest), np.array(bar.frame)
    size = float(np.linalg.norm(rest))

    def turned(s: float) -> FloatArray:
        if size == 0.0:
            return frame
        x, y, z = rest / size
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        angle = size * s
        found: FloatArray = frame @ (np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross)
        return found

    def position(s: float) -> FloatArray:
        if size == 0.0:
            return np.array(bar.start) + s * frame[:, 2]
        axis, along = rest / size, np.array([0.0, 0.0, 1.0])
        angle = size * s
        straight = axis * (axis @ along)
        off = along - straight
        # The integral of the turned tangent.
        local = s * straight + math.sin(angle) / size * off + (1.0 - math.cos(angle)) / size * np.cross(axis, along)
        found: FloatArray = np.array(bar.start) + frame @ local
        return found

    nodes = np.array([position(k / elements) for k in range(elements + 1)])
    frames = np.array([turned((k + 0.5) / elements) for k in range(elements)])
    return nodes, frames


def of_rotation(frame: FloatArray) -> FloatArray:
    """Quaternion (4,), scalar first, of a rotation (3, 3)."""
    found: FloatArray = Rotation.from_matrix(frame).as_quat()[[3, 0, 1, 2]]
    return found


def _words(values: FloatArray) -> str:
    return " ".join(repr(float(v)) for v in values)


def mujoco_text(bar: Bar, n: int, length: float = 1.0, stiffness: float = 1.0, start: FloatArray | None = None) -> str:
    """MJCF of the bar for the plugin mujoco.elasticity.cable: n boxes on ball joints, built in the rest shape.

    length (m or l) and stiffness (N m^2 or D w) are the units of the numbers; start: frames (n, 3, 3) of the elements
    of another shape, kept as the keyframe "start". Along the box x = t_z, y = t_x, z = t_y: the bending modulus and the
    box's proportion give both bending stiffnesses, the twisting modulus the torsion with the plugin's own torsion
    constant of a box. The fixed body stands half an element behind the clamp, for whose joint half an element bends.
    Weight is mass times gravity of 1 along it; the end's dead load stands as <custom>, to be applied as xfrc.
    """
    axes = [2, 0, 1]
    b1, b2, gj = (stiffness * value for value in bar.stiffness)
    half_z = 0.01 * length
    half_y = math.sqrt(b2 / b1) * half_z
    bend = b1 / (4.0 * half_y * half_z**3 / 3.0)
    long, short = max(half_y, half_z), min(half_y, half_z)
    constant = long * short**3 * (16.0 / 3.0 - 3.36 * short / long * (1.0 - short**4 / (12.0 * long**4)))
    frame = np.array(bar.frame)
    step = length / n
    turn = np.array(bar.rest)[axes] / n
    whole, half = (Rotation.from_rotvec(part * turn).as_quat()[[3, 0, 1, 2]] for part in (1.0, 0.5))
    pull = stiffness / length**3 * np.array(bar.weight)
    size = float(np.linalg.norm(pull))
    bodies = []
    for k in range(n + 1):
        if k == 0:
            place, turned = length * np.array(bar.start) - 0.5 * step * frame[:, 2], of_rotation(frame[:, axes])
        else:
            place, turned = np.array([0.5 * step if k == 1 else step, 0.0, 0.0]), half if k == 1 else whole
        mass = (size if size else 1.0) * step
        joint = "" if k == 0 else f'<joint name="j{k}" type="ball"/>'
        bodies.append(
            f'<body name="b{k}" pos="{_words(place)}" quat="{_words(turned)}">{joint}<geom type="box" '
            f'size="{_words(np.array([0.5 * step, half_y, half_z]))}" pos="{0.5 * step!r} 0 0" mass="{mass!r}" '
            'contype="0" conaffinity="0"/><plugin instance="strip"/>\n'
        )
    key = "" if start is None else f'<keyframe><key name="start" qpos="{_words(_joints(bar, start))}"/></keyframe>\n'
    ends = ((stiffness / length**2, bar.force, "end_force"), (stiffness / length, bar.moment, "end_moment"))
    load = "".join(f'<numeric name="{name}" data="{_words(unit * np.array(v))}"/>' for unit, v, name in ends)
    gravity = pull / size if size else pull
    return (
        f'<mujoco><option gravity="{_words(gravity)}"/>\n<extension><plugin plugin="mujoco.elasticity.cable">'
        f'<instance name="strip"><config key="twist" value="{gj / constant!r}"/><config key="bend" value="{bend!r}"/>'
        f'<config key="flat" value="false"/></instance></plugin></extension>\n<custom>{load}</custom>\n<worldbody>\n'
        + "".join(bodies) + "</body>" * (n + 1) + f"\n</worldbody>\n{key}</mujoco>\n"
    )  # fmt: skip


def _joints(bar: Bar, frames: FloatArray) -> FloatArray:
    """qpos (4 n,) of the ball joints that turn the rest shape into elements of these frames."""
    axes = [2, 0, 1]
    turn = np.array(bar.rest)[axes] / len(frames)
    before = np.array(bar.frame)[:, axes]
    found = []
    for k, frame in enumerate(frames[:, :, axes]):
        rest = Rotation.from_rotvec((0.5 if k == 0 else 1.0) * turn).as_matrix()
        found.append(of_rotation((before @ rest).T @ frame))
        before = frame
    return np.concatenate(found)
