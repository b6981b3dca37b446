"""A ribbon's shape as arrays: its own segments and its centreline.

Stored beside the results as `ribbon.npz`, so that an export needs no solver. Lengths in l, curvatures in 1/l.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from compare.store.arrays import npz_bytes
from compare.store.store import atomic_write_bytes
from ribbon import Equilibrium
from ribbon.analysis.along import line_density, segment_of
from ribbon.analysis.parts import PARTS, line_parts

FloatArray = NDArray[np.float64]

ARRAYS = "ribbon.npz"
#: Of the columns of a centreline that have one.
UNITS = {**dict.fromkeys(("s", "x", "y", "z"), "l"), "omega": "1/l", "tau": "1/l"}
#: Points of the stored centreline.
LINE_POINTS = 401


def arrays(equilibrium: Equilibrium) -> dict[str, FloatArray]:
    """What `ribbon.npz` holds.

    segment_lengths (p,), joints (p + 1,): abscissae; parameters (p, 4): a, b, n, m of omega = a s + b, eta = n s + m
    on each segment, s from its start; joint_positions (p + 1, 3), joint_frames (p + 1, 3, 3), columns t_x t_y t_z;
    line_s (k,) and line_position, line_frame, line_ruling, line_omega, line_eta, line_segment, line_energy_density
    (`line_density`) of the centreline; width ().

    Where the twist is free: curvature_parameters (p, 4 or 6), a, b, n, m, c, d of omega = a s + b, tau = n s + m and,
    bent in its own plane, kappa_2 = c s + d, in place of parameters; line_tau of line_eta and line_ruling; beside
    line_energy_density its parts line_bending_energy, line_membrane_energy, line_shear_energy, with the constant.
    """
    lengths = equilibrium.problem.lengths
    points, frames = equilibrium.joints
    line = np.linspace(0.0, 1.0, LINE_POINTS)
    frame = equilibrium.frame(line)
    return {
        "segment_lengths": np.asarray(lengths),
        "joints": np.concatenate([[0.0], np.cumsum(lengths)]),
        "joint_positions": points,
        "joint_frames": frames,
        "line_s": line,
        "line_position": equilibrium.position(line),
        "line_frame": frame,
        "line_omega": equilibrium.omega(line),
        "line_segment": segment_of(equilibrium, line).astype(float),
        "line_energy_density": line_density(equilibrium, line),
        "width": np.array(2.0 * equilibrium.problem.half_width),
        **(_twisted(equilibrium, line) if equilibrium.has_free_twist else _ruled(equilibrium, line, frame)),
    }


def _ruled(equilibrium: Equilibrium, line: FloatArray, frame: FloatArray) -> dict[str, FloatArray]:
    eta = equilibrium.eta(line)
    ruling = frame[:, :, 0] + eta[:, None] * frame[:, :, 2]
    return {"parameters": equilibrium.parameters, "line_ruling": ruling, "line_eta": eta}


def _twisted(equilibrium: Equilibrium, line: FloatArray) -> dict[str, FloatArray]:
    density = line_parts(equilibrium, line)
    return {
        "curvature_parameters": equilibrium.parameters,
        "line_tau": equilibrium.tau(line),
        **{f"line_{name}_energy": density[:, k] for k, name in enumerate(PARTS)},
    }


def centreline(equilibrium: Equilibrium) -> tuple[list[str], FloatArray]:
    """Names of the columns, and the centreline as rows: s, x, y, z (in l), omega (1/l), eta, or the twist tau (1/l)
    where it is free, t_x, t_y, t_z by components; units as in `UNITS`."""
    s = np.linspace(0.0, 1.0, LINE_POINTS)
    frame = equilibrium.frame(s)
    free = equilibrium.has_free_twist
    second = equilibrium.tau(s) if free else equilibrium.eta(s)
    columns = [s, equilibrium.position(s), equilibrium.omega(s), second]
    names = ["s", "x", "y", "z", "omega", "tau" if free else "eta"]
    names += [f"{axis}_{component}" for axis in ("tx", "ty", "tz") for component in "xyz"]
    table = np.column_stack(columns + [frame[:, :, column] for column in range(3)])
    return names, table


def write_arrays(path: Path, equilibrium: Equilibrium) -> Path:
    """`arrays` as a file."""
    return atomic_write_bytes(path, npz_bytes(arrays(equilibrium)))
