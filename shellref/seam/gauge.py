"""Where a closed strip that nothing holds is held: at components of positions that no force resists. NumPy and SciPy.

At an equilibrium of a free band the tangent has null vectors: three translations (t, 0), three rotations
(w x (phi - c), w x d), and of a uniform band the sliding along itself (phi_,S, d_,S), under which every particle takes
the place of the next. (Of a planar circle that is a rotation; of any other band it is a seventh motion.) Let N be these
motions, k = 6 or 7 of them. Holding k components on which N is regular removes the null space and nothing else: what is
left is a complement of it, and the tangent there has the inertia of the whole one without its k zeros (docs/theory.md,
eq. (7.23)). The reactions vanish, as the energy does not change along N.

Which components: the pivots of a QR factorisation with column exchange of N^T (Businger & Golub 1965,
doi:10.1007/BF01436084), those by which the motions are told best. Where symmetry makes several as good (a ring) the
first on the grid is taken, by weights that fall a little along it (`FIRST`): rounding, and how many processes there
are, choose nothing.

A mesh is not uniform to a particle that slides through it: between one element and the next the energy changes by its
discretisation error. The reaction at the seventh component is that, and nothing of the band's; moved by one whole
element of a uniform mesh a state is a state again, which is how sliding is told from turning.
"""

from __future__ import annotations

import numpy as np

from shellref.kernels import lagrange

#: Part of the way of a band slid by one element that no rigid motion makes (2-norms over the nodes), from which sliding
#: is a motion of its own: shapes that are interpolated from other meshes are circles to less.
OWN = 0.03
#: By how much of itself the last component counts less than the first.
FIRST = 1e-6


def slid(field: np.ndarray, rows: int, sign: int) -> np.ndarray:
    """A closed band's field (n + 1, m, 6) slid by `rows` rows of nodes along itself; without its last row (n, m, 6)."""
    own = field[:-1]
    beyond = own[:rows, ::sign].copy()
    beyond[..., 3:] *= sign
    return np.concatenate([own[rows:], beyond])


def sliding(field: np.ndarray, s_nodes: np.ndarray, degree: int, sign: int) -> np.ndarray:
    """d/dS of positions and directors (n + 1, m, 6) at the nodes of all rows but the last (n, m, 6); between elements
    the mean of both sides, at the seam too."""
    ends = s_nodes[::degree]
    slopes = lagrange.slopes(degree, (s_nodes[: degree + 1] - ends[0]) / (ends[1] - ends[0]))
    out, count = np.zeros_like(field), np.zeros(len(field))
    for first in range(0, len(field) - 1, degree):
        rows = slice(first, first + degree + 1)
        out[rows] += np.tensordot(slopes, field[rows], axes=1) / (s_nodes[first + degree] - s_nodes[first])
        count[rows] += 1.0
    last = out[-1, ::sign].copy()
    last[..., 3:] *= sign
    out[0], count[0] = out[0] + last, 2.0
    return np.asarray((out / count[:, None, None])[:-1])


def turns(field: np.ndarray, degree: int, sign: int) -> bool:
    """Whether sliding of a band on equal elements turns it: by one element it goes where a rigid motion takes it too.

    The best motion is that of Kabsch (1976, doi:10.1107/S0567739476001873).
    """
    here, there = field[:-1, :, :3].reshape(-1, 3), slid(field, degree, sign)[..., :3].reshape(-1, 3)
    a, b = here - here.mean(axis=0), there - there.mean(axis=0)
    left, _, right = np.linalg.svd(a.T @ b)
    flip = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    return bool(np.linalg.norm(a @ left @ flip @ right - b) <= OWN * np.linalg.norm(there - here))


def motions(state: np.ndarray, slide: np.ndarray | None) -> np.ndarray:
    """N (k, n, 6) of nodes with positions and directors (n, 6): rigid motions, and the slide (n, 6) if there is one."""
    arms, directors = state[:, :3] - state[:, :3].mean(axis=0), state[:, 3:]
    found = [np.hstack([np.tile(axis, (len(state), 1)), np.zeros_like(arms)]) for axis in np.eye(3)]
    found += [np.hstack([np.cross(axis, arms), np.cross(axis, directors)]) for axis in np.eye(3)]
    return np.stack(found if slide is None else [*found, slide])


def held(found: np.ndarray) -> np.ndarray:
    """Mask (n, 3) of the components of positions that are held, as many as there are motions (k, n, 6) of nodes in the
    order of the grid."""
    from scipy.linalg import qr

    mask = np.zeros(found.shape[1] * 3, dtype=bool)
    if len(found):
        rows = found[..., :3].reshape(len(found), -1)
        rows = np.linalg.qr(rows.T)[0].T
        _, order = qr(rows * np.linspace(1.0, 1.0 - FIRST, rows.shape[1]), mode="r", pivoting=True)
        mask[order[: len(found)]] = True
    return mask.reshape(-1, 3)
