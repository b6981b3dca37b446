r"""Strains of the shearable rod from interpolated positions and quaternions, with both derivatives.

With q^ = sum N_a q_a (not of unit length), q^' and r' likewise, and R the rotation of q = q^ / |q^|
(docs/theory.md, eq. (12.5))::

    Gamma + e_3 = R^T r' = Im(q^* r' q^) / |q^|^2        kappa = 2 Im(q* q') = 2 Im(q^* q^') / |q^|^2

Both numerators are polynomials f(z) of z = (q^, q^', r') (11 numbers), the rest is division by n = |q^|^2. A quaternion
of a rigid turn multiplies all q_a from the left and r_a are turned by it: q^* r' q^ and q^* q^' do not change, so the
strains are objective, and they depend on nothing but the nodes: no path (I. Romero 2004, doi:10.1007/s00466-004-0559-z;
E. Zupan, M. Saje, D. Zupan 2009, doi:10.1016/j.cma.2009.09.002).
"""

from __future__ import annotations

import numpy as np

from shellref.rod.quaternion import CONJUGATE, PRODUCT, Array

SIZE = 11
"""Numbers in z: q^ (4), q^' (4), r' (3)."""

Q, DQ, DR = slice(0, 4), slice(4, 8), slice(8, 11)

_half = np.einsum("imk,mnl,nj->ijkl", PRODUCT[1:], PRODUCT[:, :, 1:], CONJUGATE)
FORCE = 0.5 * (_half + _half.transpose(0, 2, 1, 3))
"""(3, 4, 4, 3): Im(q* r q)_i = FORCE_ijkl q_j q_k r_l, with r a vector."""

MOMENT = 2.0 * np.einsum("imk,mj->ijk", PRODUCT[1:], CONJUGATE)
"""(3, 4, 4): 2 Im(q* p)_i = MOMENT_ijk q_j p_k."""


def _flat(tensor: Array) -> Array:
    return np.ascontiguousarray(tensor.reshape(tensor.shape[0], -1))


def strains(z: Array) -> tuple[Array, Array]:
    """(Gamma, kappa) as (..., 6), and its derivative by z (..., 6, 11)."""
    q, dq, dr = z[..., Q], z[..., DQ], z[..., DR]
    force_q = np.einsum("ijkl,...l->...ijk", FORCE, dr)
    force_q = np.einsum("...ijk,...k->...ij", force_q, q)  # half the derivative by q
    moment_q = np.einsum("ijk,...k->...ij", MOMENT, dq)
    moment_p = np.einsum("ijk,...j->...ik", MOMENT, q)
    force_r = np.einsum("ijkl,...j,...k->...il", FORCE, q, q)
    n = np.sum(q * q, axis=-1)[..., None]
    ratio = (
        np.concatenate([np.einsum("...ij,...j->...i", force_q, q), np.einsum("...ij,...j->...i", moment_q, q)], axis=-1)
        / n
    )
    slope = np.zeros((*z.shape[:-1], 6, SIZE), dtype=z.dtype)
    slope[..., :3, Q] = 2.0 * force_q
    slope[..., 3:, Q] = moment_q
    slope[..., 3:, DQ] = moment_p
    slope[..., :3, DR] = force_r
    slope[..., Q] -= 2.0 * ratio[..., :, None] * q[..., None, :]
    slope /= n[..., None]
    ratio[..., 2] -= 1.0
    return ratio, slope


def second(z: Array, stress: Array, strain: Array, slope: Array) -> Array:
    """The second derivative (..., 11, 11) of stress . strain by z, stress (..., 6) fixed; as `strains` gave them.

    With F = stress . f and phi = F / n:  phi_zz = [F_zz - phi_z n_z^T - n_z phi_z^T - phi n_zz] / n.
    """
    q, dr = z[..., Q], z[..., DR]
    n = np.sum(q * q, axis=-1)[..., None, None]
    force, moment = stress[..., :3], stress[..., 3:]
    out = np.zeros((*z.shape[:-1], SIZE, SIZE), dtype=np.result_type(z, stress))
    bilinear = np.einsum("...i,ijkl->...jkl", force, FORCE)
    out[..., Q, Q] = 2.0 * np.einsum("...jkl,...l->...jk", bilinear, dr)
    mixed = 2.0 * np.einsum("...jkl,...k->...jl", bilinear, q)
    out[..., Q, DR] = mixed
    out[..., DR, Q] = np.swapaxes(mixed, -1, -2)
    couple = np.einsum("...i,ijk->...jk", moment, MOMENT)
    out[..., Q, DQ] = couple
    out[..., DQ, Q] = np.swapaxes(couple, -1, -2)
    phi = np.sum(stress * strain, axis=-1) + stress[..., 2]
    phi_z = np.einsum("...i,...iz->...z", stress, slope)
    product = 2.0 * phi_z[..., :, None] * q[..., None, :]
    out[..., :, Q] -= product
    out[..., Q, :] -= np.swapaxes(product, -1, -2)
    out[..., Q, Q] -= 2.0 * phi[..., None, None] * np.eye(4)
    return np.asarray(out / n)
