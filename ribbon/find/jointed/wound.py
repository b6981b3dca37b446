"""How a strip is wound about itself: writhe of a polygon, and the link of a strip whose ends are held.

Writhe: the sum over pairs of edges of the solid angle from which they are seen to cross, with its sign, over 2 pi (K.
Klenin & J. Langowski 2000, method 1a); edges in one plane are seen so from nowhere. Twist: the integral of tau over 2
pi. Link: their sum, a curve with two ends closed far from the strip, in the plane of its tangents, by one that stays;
it does not change while nothing passes through anything (G. Calugareanu 1959, J. H. White 1969, doi:10.2307/2373348);
two strands that pass through each other change it by two turns. Of clamps that a turn-free frame along the closing
curve takes to each other it is a whole number.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ribbon.problems.mixed import MixedProblem

FloatArray = NDArray[np.float64]

#: How far (l) from the strip its curve is closed, and how near (l) its ends are to each other where it is a ring.
_FAR, _RING = 1e3, 1e-9
#: Cosine between the clamps' tangents from which these say no direction across.
_ALONG = 0.999
#: Sine of an angle that is none: of three corners in a line.
_IN_LINE = 1e-9


def writhe(points: FloatArray) -> float:
    """Of the open polygon points (k, 3), in turns; of a closed one, whose first point is its last too, the same."""
    a, b = points[:-1], points[1:]
    total = 0.0
    for i in range(len(a) - 2):
        j = slice(i + 2, None)
        sides = [a[j] - a[i], b[j] - a[i], b[j] - b[i], a[j] - b[i]]
        sizes = [np.maximum(np.linalg.norm(side, axis=1), 1e-300) for side in sides]
        sides = [side / size[:, None] for side, size in zip(sides, sizes, strict=True)]
        faces = [np.cross(one, other) for one, other in zip(sides, [*sides[1:], sides[0]], strict=True)]
        widths = [np.linalg.norm(face, axis=1) for face in faces]
        flat = np.min(widths, axis=0) < _IN_LINE  # what rounding leaves of a face has any direction
        faces = [face / np.maximum(width, 1e-300)[:, None] for face, width in zip(faces, widths, strict=True)]
        turned = zip(faces, [*faces[1:], faces[0]], strict=True)
        angle = sum(np.arcsin(np.clip((one * other).sum(axis=1), -1.0, 1.0)) for one, other in turned)
        side = (np.cross(b[j] - a[j], b[i] - a[i]) * sides[0]).sum(axis=1)
        total += float((np.where(flat, 0.0, angle) * np.sign(side)).sum())
    return total / (2.0 * np.pi)


def closed(r: FloatArray, first: FloatArray, last: FloatArray) -> FloatArray:
    """Polygon r (k, 3), in l, closed far away: it comes along the tangent of the frame `first` (3, 3) and leaves along
    the tangent `last` (3,); a ring's as it is."""
    if np.abs(r[0] - r[-1]).max() < _RING:
        return r
    across = np.cross(first[:, 2], last) if abs(first[:, 2] @ last) < _ALONG else first[:, 0]
    before, behind = r[0] - _FAR * first[:, 2], r[-1] + _FAR * last
    beside = 0.5 * (before + behind) + 2.0 * _FAR * across / np.linalg.norm(across)
    return np.vstack([beside, before, r, behind, beside])


def link(problem: MixedProblem, x: FloatArray) -> float:
    """Twist and writhe of unknowns x (n,), whose ends the problem holds whole, in turns."""
    assert problem.start is not None
    assert problem.end is not None
    tau, s = problem.joint_values(x)[1], np.concatenate([[0.0], np.cumsum(problem.lengths)])
    twist = float((0.5 * (tau[1:] + tau[:-1]) * np.diff(s)).sum() / (2.0 * np.pi))
    first, last = np.asarray(problem.start.frame), np.asarray(problem.end.frame)[:, 2]
    return twist + writhe(closed(problem.layout.positions(x), first, last))
