"""How often closed lines are linked, and how often a closed strip is turned."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def linking(one: Array, other: Array) -> float:
    """How often two closed polygons (n, 3) and (m, 3) are linked: Gauss's integral, exact for their edges as sums of
    solid angles (Klenin and Langowski 2000, doi:10.1002/1097-0282(20001015)54:5<307::AID-BIP20>3.0.CO;2-Y)."""
    begins, ends = other, np.roll(other, -1, axis=0)
    total = 0.0
    for begin, end in zip(one, np.roll(one, -1, axis=0), strict=True):
        corners = (begin - begins, begin - ends, end - ends, end - begins)
        normals = [np.cross(corners[k], corners[(k + 1) % 4]) for k in range(4)]
        normals = [normal / np.linalg.norm(normal, axis=1, keepdims=True) for normal in normals]
        dots = [np.clip((normals[k] * normals[(k + 1) % 4]).sum(axis=1), -1.0, 1.0) for k in range(4)]
        side = np.sign((np.cross(ends - begins, end - begin) * corners[0]).sum(axis=1))
        total += float((side * sum(np.arcsin(dot) for dot in dots)).sum())
    return total / (4.0 * np.pi)


def half_turns(lines: Array, odd: bool) -> float:
    """Half turns of a closed strip with points (n, 3, 3) along three lines, its middle and those to both sides: the
    middle linked with the line beside it, which closes after one round, or after two where the half turns are odd."""
    beside = np.vstack([lines[:, 0], lines[:, 2]]) if odd else lines[:, 0]
    return (1.0 if odd else 2.0) * linking(lines[:, 1], beside)
