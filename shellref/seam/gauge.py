"""Where a closed strip that nothing holds is held: at components of positions that no force resists. NumPy and SciPy.

At an equilibrium of a free band the tangent has null vectors: three translations t, three rotations w x (x - c), and of
a uniform band the sliding along itself,

    phi'(S, v) = d/de phi(S + e, v) ,

under which every particle takes the place of the next. (Of a planar circle that is a rotation; of any other band it is
a seventh motion.) Let N (m, k) be these motions at all m components of the positions, k = 6 or 7. Holding k components
on which N is regular removes the null space and nothing else: the tangent on the rest has the inertia of the whole
tangent without its k zeros (the energy's second variation is one on the space modulo its null space, and what is left
is a complement of it), and the reactions vanish, as the energy does not change along N.

Which components: the pivots of a QR factorisation with column exchange of N^T (Businger & Golub 1965,
doi:10.1007/BF01436084), those by which the motions are told best.

A mesh is not uniform to a particle that slides through it: the energy changes by its discretisation error from element
to element. The reaction at the seventh component is that, and nothing of the band's.
"""

from __future__ import annotations

import numpy as np

#: Part of the sliding that must be no rigid motion (2-norms over the nodes), for it to be one motion more.
OWN = 1e-2


def motions(points: np.ndarray, slide: np.ndarray | None) -> np.ndarray:
    """N (3 n, 6 or 7), orthonormal columns: the rigid motions of points (n, 3), and the slide (n, 3) where it is
    another motion."""
    arms = points - points.mean(axis=0)
    rigid = [np.tile(axis, (len(points), 1)) for axis in np.eye(3)]
    rigid += [np.cross(axis, arms) for axis in np.eye(3)]
    found, _ = np.linalg.qr(np.stack([motion.ravel() for motion in rigid], axis=1))
    if slide is None:
        return found
    rest = slide.ravel() - found @ (found.T @ slide.ravel())
    if np.linalg.norm(rest) <= OWN * np.linalg.norm(slide):
        return found
    return np.column_stack([found, rest / np.linalg.norm(rest)])


def held(points: np.ndarray, slide: np.ndarray | None) -> np.ndarray:
    """Mask (n, 3) of the components of points (n, 3) that are held, as many as there are motions."""
    from scipy.linalg import qr

    found = motions(points, slide)
    _, order = qr(found.T, mode="r", pivoting=True)
    mask = np.zeros(points.size, dtype=bool)
    mask[order[: found.shape[1]]] = True
    return mask.reshape(points.shape)
