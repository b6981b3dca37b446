"""Unit directors at the nodes: tangent bases, the projection P from 5 to 6 components, and the update.

A node carries (phi, d), six components with |d| = 1. Its admissible increments are three translations and two
components in the plane normal to d. For the energy E(phi, d) the Riemannian Hessian on the sphere is

    P^T (E'' - (d . dE/dd) I_d) P ,   I_d: identity on the director components only

(Absil, Mahony & Sepulchre 2008, section 5.5, embedded submanifold). There is no singular rotation.
"""

from __future__ import annotations

import numpy as np


def tangent_bases(directors: np.ndarray) -> np.ndarray:
    """Two orthonormal vectors normal to each unit director: (n, 3) -> (n, 3, 2).

    Householder reflection that sends e_k to -+d, with k the largest component: its other two columns.
    """
    n = len(directors)
    rows = np.arange(n)
    k = np.argmax(np.abs(directors), axis=1)
    sign = np.where(directors[rows, k] < 0, -1.0, 1.0)
    u = directors.copy()
    u[rows, k] += sign
    h = np.eye(3) - 2.0 * u[:, :, None] * u[:, None, :] / np.einsum("ni,ni->n", u, u)[:, None, None]
    columns = np.stack([(k + 1) % 3, (k + 2) % 3], axis=1)
    return np.stack([h[rows, :, columns[:, 0]], h[rows, :, columns[:, 1]]], axis=2)


def projection_csr(bases: np.ndarray, free: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """P as CSR arrays (indptr, indices, values), shape (6 n, 5 m): n nodes, m of them free (fixed rows are empty).

    bases (n, 3, 2); free (m,): node numbers, sorted. Columns of the j-th free node: 5 j + (3 positions, 2 rotations).
    """
    n, m = len(bases), len(free)
    counts = np.zeros((n, 6), dtype=np.int32)
    counts[free] = (1, 1, 1, 2, 2, 2)
    indptr = np.concatenate([[0], np.cumsum(counts.ravel())]).astype(np.int32)
    first = 5 * np.arange(m)[:, None]
    indices = np.concatenate([first + np.array([[0, 1, 2]]), np.tile(first + np.array([[3, 4]]), (1, 3))], axis=1)
    values = np.concatenate([np.ones((m, 3)), bases[free].reshape(m, 6)], axis=1)
    return indptr, indices.astype(np.int32).ravel(), values.ravel()


def reduce_vector(full: np.ndarray, bases: np.ndarray, free: np.ndarray) -> np.ndarray:
    """P^T f: nodal 6-vectors (n, 6) -> (5 m,)."""
    f = full[free]
    rotations = np.einsum("nik,ni->nk", bases[free], f[:, 3:])
    return np.concatenate([f[:, :3], rotations], axis=1).ravel()


def expand_vector(reduced: np.ndarray, bases: np.ndarray, free: np.ndarray) -> np.ndarray:
    """P q: (5 m,) -> nodal 6-vectors (n, 6), zero at held nodes."""
    q = reduced.reshape(-1, 5)
    full = np.zeros((len(bases), 6))
    full[free, :3] = q[:, :3]
    full[free, 3:] = np.einsum("nik,nk->ni", bases[free], q[:, 3:])
    return full


def retract(state: np.ndarray, increment: np.ndarray) -> np.ndarray:
    """State plus increment (n, 6), directors brought back to unit length."""
    new = state + increment
    new[:, 3:] /= np.linalg.norm(new[:, 3:], axis=1)[:, None]
    return new


def constraint_curvature(state: np.ndarray, force: np.ndarray, free: np.ndarray) -> np.ndarray:
    """-d . dE/dd at the free nodes (m,): state and force (= dE/d(phi, d)) are (n, 6)."""
    return -np.einsum("ni,ni->n", state[free, 3:], force[free, 3:])


def as_rotation_diagonal(values: np.ndarray) -> np.ndarray:
    """One number per free node (m,) spread on the two rotation components: (5 m,)."""
    diagonal = np.zeros((len(values), 5))
    diagonal[:, 3:] = values[:, None]
    return diagonal.ravel()
