"""Energy, glue, Jacobian and Hessian of the mixed (glued) ribbon, segment by segment (numba), cost linear in p.

Unknowns. Joint j = 0 ... p carries a position r (3), a quaternion q (4, `ribbon.element.quaternion`), omega and eta; segment i
carries its slope n of eta. They are stored joint by joint, ten per segment, so that a segment and its two joints see 19
consecutive numbers::

    r_i (0..2) | q_i (3..6) | omega_i (7) | eta_i (8) | n_i (9) | r_(i+1) (10..12) | q_(i+1) (13..16) | omega_(i+1) (17) | eta_(i+1) (18)

The places have names in `ribbon.problems.layout`. Segment parameters: ``a = (omega_(i+1) - omega_i) / L, b = omega_i, n = n_i, m = eta_i``. Glue (thesis, eq. 5.6), eight
rows a segment, with the end quaternion Q, the chord u and the weight integral v of `ribbon.element.body_series`
(docs/theory.md, eq. (4.5))::

    r_(i+1) - r_i - R(q_(i+1)) u(a, b, n, m) = 0        (multipliers: the internal force, fixed frame)
    q_(i+1) - q_i o Q(a, b, n, m) = 0
    eta_(i+1) - eta_i - L n_i = 0

A quaternion needs no normalisation: |Q| = 1, so that the glue hands the length of q_0 on. It has no singular rotation
either (a rotation vector has one at a full turn, and coils unwind by many turns in one solve) and no flipped frames (the
off-diagonal products of the thesis have).

Weight: ``Gamma (L <r_i, e> + <R(q_(i+1)) V, e>)`` with V = v, and for the exact one (thesis, eq. 2.9) with
``V = v + n w^2/12 (t + eta_(i+1) u - n v)``, because ``int q ds = R (t + [eta p] - n J)`` (docs/theory.md, eq. (4.7),
(2.10)). Eq. 2.9 weighs the surface between the rulings of both ends, not the strip: where they are oblique a triangle
is missing on one side and one too many on the other, and a straight strip could lower its energy without bound by
turning them. `end_weight` corrects it::

    Gamma w^2/12 ( [eta <t_x, e> + eta^2/2 <t_z, e>]_(s=0) - [the same]_(s=l) )  + O(w^4)

Where the twist is free (`free`) it stands in the place of eta, its slope in that of eta's, and an in-plane curvature
kappa_2 at joint i in column `sideways` + i; parameters and jets are then those of `ribbon.element.free_series`, and six
unknowns bend a segment instead of four.
"""  # noqa: E501

from __future__ import annotations

import numpy as np
from numba import njit

from ribbon.element.element import elastic_value
from ribbon.element.free_series import parameter_count
from ribbon.element.kinematics import body_values
from ribbon.element.quaternion import form, product, rotate, rotate_by_q, unrotate
from ribbon.energies.codes import has_free_twist
from ribbon.problems.layout import ETA, NEXT, OMEGA, QUATERNION, SLOPE, STRIDE

#: Rows of the glue per segment.
ROWS = 8
# local places of z = (omega_i, eta_i, n_i, omega_(i+1)), the parameters that bend a segment
Z = np.array([OMEGA, ETA, SLOPE, NEXT + OMEGA])
# the quaternions of a segment's joints
_Q = range(QUATERNION, OMEGA)
_NEXT_Q = range(NEXT + QUATERNION, NEXT + OMEGA)


def _columns(p: int, sideways: int) -> np.ndarray:
    """Columns (p, 19 or 21) of the places of every segment: its own, then its in-plane curvatures, if it has any."""
    i = np.arange(p)[:, None]
    own = STRIDE * i + np.arange(NEXT + ETA + 1)
    return own if sideways < 0 else np.hstack([own, sideways + i + np.arange(2)])


def _bending(sideways: int) -> list[int]:
    """Places of a segment that bend it: z, and those of its in-plane curvatures."""
    return [*map(int, Z), *((NEXT + ETA + 1, NEXT + ETA + 2) if sideways >= 0 else ())]


def jacobian_structure(p: int, sideways: int = -1) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns (69 p,), or (83 p,), of the glue's Jacobian, in the order in which `jacobian` fills them."""
    z = _bending(sideways)
    rows: list[int] = []
    columns: list[int] = []
    for k in range(3):
        rows += [k] * (6 + len(z))
        columns += [k, NEXT + k, *_NEXT_Q, *z]
    for k in range(4):
        rows += [3 + k] * (5 + len(z))
        columns += [_NEXT_Q[k], *_Q, *z]
    rows += [7] * 3
    columns += [NEXT + ETA, ETA, SLOPE]
    return (ROWS * np.arange(p)[:, None] + np.array(rows)).ravel(), _columns(p, sideways)[:, columns].ravel()


def hessian_structure(p: int, sideways: int = -1) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns (52 p,), or (79 p,), of the lower triangle, in the order in which `hessian` fills the values."""
    z = _bending(sideways)
    pairs = [(a, b) for i, a in enumerate(z) for b in z[i:]]
    pairs += [(_NEXT_Q[i], _NEXT_Q[j]) for i in range(4) for j in range(i + 1)]
    pairs += [(_NEXT_Q[i], a) for a in z for i in range(4)]
    pairs += [(_Q[i], a) for a in z for i in range(4)]
    found = _columns(p, sideways)
    one, other = found[:, [a for a, _ in pairs]].ravel(), found[:, [b for _, b in pairs]].ravel()
    return np.maximum(one, other), np.minimum(one, other)


def jacobian_entries(components: int) -> int:
    """Entries of the glue's Jacobian per segment, for jets of so many components."""
    return 41 + 7 * int(parameter_count(components))


def hessian_entries(components: int) -> int:
    """Entries of the lower triangle of the Hessian per segment, for jets of so many components."""
    count = int(parameter_count(components))
    return components - 1 - count + 10 + 8 * count


@njit(cache=True)
def bending_column(i, z, sideways):
    """Column of the z-th unknown that bends segment i."""
    return STRIDE * i + Z[z] if z < 4 else sideways + i + z - 4


@njit(cache=True)
def parameters(x, lengths, sideways, q):
    """q (p, 4) = (a, b, n, m), or with (c, d) (p, 6), of every segment from the unknowns."""
    for i in range(lengths.size):
        own_parameters(x, lengths, i, sideways, q[i])


@njit(cache=True)
def own_parameters(x, lengths, i, sideways, q):
    """Parameters q (4 or 6,) of segment i."""
    k = STRIDE * i
    q[0] = (x[k + NEXT + OMEGA] - x[k + OMEGA]) / lengths[i]
    q[1] = x[k + OMEGA]
    q[2] = x[k + SLOPE]
    q[3] = x[k + ETA]
    if sideways >= 0:
        q[4] = (x[sideways + i + 1] - x[sideways + i]) / lengths[i]
        q[5] = x[sideways + i]


@njit(cache=True)
def by_unknowns(jet, length):
    """A jet by (a, b, n, m) turned, in place, into one by z = (omega_0, eta_0, n, omega_1), pairs in order; one by (a,
    b, n, m, c, d) into one by z and the in-plane curvatures at both joints."""
    f = 1.0 / length
    if jet.size == 28:
        _six_by_unknowns(jet, f)
        return
    a, b, n, m = jet[1], jet[2], jet[3], jet[4]
    aa, ab, an, am = jet[5], jet[6], jet[7], jet[8]
    bb, bn, bm = jet[9], jet[10], jet[11]
    nn, nm, mm = jet[12], jet[13], jet[14]
    jet[1] = b - f * a
    jet[2] = m
    jet[3] = n
    jet[4] = f * a
    jet[5] = bb - f * (2.0 * ab - f * aa)
    jet[6] = bm - f * am
    jet[7] = bn - f * an
    jet[8] = f * (ab - f * aa)
    jet[9] = mm
    jet[10] = nm
    jet[11] = f * am
    jet[12] = nn
    jet[13] = f * an
    jet[14] = f * f * aa


@njit(cache=True)
def _six_by_unknowns(jet, f):
    """As `by_unknowns`, with f = 1 / L: slope and value of a field at its start become its values at both joints."""
    # z_k is made of at most two parameters: omega_0 = b - f a, eta_0 = m, n, omega_1 = f a, d - f c, f c
    first = (1, 3, 2, 0, 5, 4)
    second = (0, -1, -1, -1, 4, -1)
    scale = (1.0, 1.0, 1.0, f, 1.0, f)
    old = jet.copy()
    at = 7
    for i in range(6):
        jet[1 + i] = scale[i] * old[1 + first[i]]
        if second[i] >= 0:
            jet[1 + i] -= f * old[1 + second[i]]
        for j in range(i, 6):
            total = scale[i] * scale[j] * old[_place(first[i], first[j])]
            if second[i] >= 0:
                total -= f * scale[j] * old[_place(second[i], first[j])]
            if second[j] >= 0:
                total -= f * scale[i] * old[_place(first[i], second[j])]
                if second[i] >= 0:
                    total += f * f * old[_place(second[i], second[j])]
            jet[at] = total
            at += 1


@njit(cache=True)
def _place(i, j):
    """Place in a jet (28,) of the second derivative by the parameters i and j."""
    if i > j:
        i, j = j, i
    return 7 + 6 * i - i * (i - 1) // 2 + j - i


@njit(cache=True)
def energy_and_glue(x, lengths, material, gamma, up, exact, limit, sideways, want_glue, parts, glue):
    """Fills `parts` (3,) with bending, natural-curvature and gravity energy and, if wanted, `glue` (8 p,)."""
    parts[:] = 0.0
    half_width = material.section[0]
    free = has_free_twist(material.code)
    out = np.empty(13)
    v = np.empty(3)
    rotated = np.empty(3)
    turned = np.empty(4)
    own = np.empty(4 if sideways < 0 else 6)
    jet = np.empty(15 if sideways < 0 else 28)
    level = 0
    if gamma != 0.0:
        level = 2 if exact else 1
    for i in range(lengths.size):
        k = STRIDE * i
        length = lengths[i]
        own_parameters(x, lengths, i, sideways, own)
        n = own[2]
        m = own[3]
        bending, apart = elastic_value(
            material.code, own, length, material.section, material.natural, material.curvature[i, 0],
            material.curvature[i, 1], material.poisson, material.rest[i], jet,
        )  # fmt: skip
        parts[0] += bending
        parts[1] += apart
        if not (want_glue or gamma != 0.0):
            continue
        body_values(free, own, length, limit, level, out)
        if gamma != 0.0:
            for c in range(3):
                v[c] = out[7 + c]
            if exact:
                f = half_width * half_width / 3.0 * n
                for c in range(3):
                    v[c] += f * (out[10 + c] + (m + n * length) * out[4 + c] - n * out[7 + c])
            rotate(x[k + NEXT + QUATERNION : k + NEXT + OMEGA], v, rotated)
            for c in range(3):
                parts[2] += gamma * up[c] * (length * x[k + c] + rotated[c])
        if want_glue:
            g = ROWS * i
            rotate(x[k + NEXT + QUATERNION : k + NEXT + OMEGA], out[4:7], rotated)
            for c in range(3):
                glue[g + c] = x[k + NEXT + c] - x[k + c] - rotated[c]
            product(x[k + QUATERNION : k + OMEGA], out[0:4], turned)
            for c in range(4):
                glue[g + 3 + c] = x[k + NEXT + QUATERNION + c] - turned[c]
            glue[g + 7] = x[k + NEXT + ETA] - m - n * length


@njit(cache=True)
def weight_jets(jets, q, lengths, half_width, exact, weight):
    """Fills `weight` (p, 3, components) with the jets of V by the parameters, from the body jets (p, 13, components);
    the exact ones by (a, b, n, m) only."""
    c = half_width * half_width / 3.0
    f = np.zeros(15)
    for i in range(lengths.size):
        for r in range(3):
            weight[i, r] = jets[i, 7 + r]
        if not exact:
            continue
        n = q[i, 2]
        m = q[i, 3]
        length = lengths[i]
        # V += c n t + c n (m + n L) u - c n^2 v, factors with their own derivatives by n and m
        f[:] = 0.0
        f[0] = c * n
        f[3] = c
        for r in range(3):
            _add_product(f, jets[i, 10 + r], weight[i, r])
        f[0] = c * n * (m + n * length)
        f[3] = c * (m + 2.0 * n * length)
        f[4] = c * n
        f[12] = 2.0 * c * length
        f[13] = c
        for r in range(3):
            _add_product(f, jets[i, 4 + r], weight[i, r])
        f[:] = 0.0
        f[0] = -c * n * n
        f[3] = -2.0 * c * n
        f[12] = -2.0 * c
        for r in range(3):
            _add_product(f, jets[i, 7 + r], weight[i, r])


@njit(cache=True)
def _add_product(f, g, out):
    """out (15,) += jet of f g."""
    for c in range(15):
        out[c] += f[0] * g[c]
    for c in range(1, 15):
        out[c] += g[0] * f[c]
    k = 5
    for i in range(1, 5):
        for j in range(i, 5):
            out[k] += f[i] * g[j] + f[j] * g[i]
            k += 1


@njit(cache=True)
def all_by_unknowns(lengths, local, jets, rows, weight, weighted):
    """Turns the elastic jets (p, 15), the first `rows` body jets and, if `weighted`, the weight's by z, in place."""
    for i in range(lengths.size):
        by_unknowns(local[i], lengths[i])
        for r in range(rows):
            by_unknowns(jets[i, r], lengths[i])
        if weighted:
            for r in range(3):
                by_unknowns(weight[i, r], lengths[i])


@njit(cache=True)
def gradient(x, lengths, local, gamma, up, weight, sideways, out):
    """Gradient (>= 10 p + 9,) of the energy; `out` is zeroed first. Jets by z."""
    out[:] = 0.0
    count = parameter_count(local.shape[1])
    n = np.empty((4, 4))
    e = np.empty(3)
    for i in range(lengths.size):
        k = STRIDE * i
        for z in range(count):
            out[bending_column(i, z, sideways)] += local[i, 1 + z]
        if gamma == 0.0:
            continue
        q = x[k + NEXT + QUATERNION : k + NEXT + OMEGA]
        for c in range(3):
            out[k + c] += gamma * lengths[i] * up[c]
        form(up, weight[i, :, 0], n)
        for r in range(4):
            out[k + NEXT + QUATERNION + r] += (
                2.0 * gamma * (n[r, 0] * q[0] + n[r, 1] * q[1] + n[r, 2] * q[2] + n[r, 3] * q[3])
            )
        unrotate(q, up, e)
        for z in range(count):
            out[bending_column(i, z, sideways)] += gamma * (
                e[0] * weight[i, 0, 1 + z] + e[1] * weight[i, 1, 1 + z] + e[2] * weight[i, 2, 1 + z]
            )


@njit(cache=True)
def jacobian(x, lengths, jets, out):
    """Values of the glue's Jacobian in the order of `jacobian_structure`. Jets by z."""
    count = parameter_count(jets.shape[2])
    wide = 6 + count
    high = 5 + count
    rotated = np.empty(3)
    turned = np.empty(4)
    block = np.empty((3, 4))
    at = 0
    for i in range(lengths.size):
        k = STRIDE * i
        q0 = x[k + QUATERNION : k + OMEGA]
        q1 = x[k + NEXT + QUATERNION : k + NEXT + OMEGA]
        jet = jets[i]
        rotate_by_q(q1, jet[4:7, 0], block)
        for r in range(3):
            base = at + wide * r
            out[base] = -1.0
            out[base + 1] = 1.0
            for c in range(4):
                out[base + 2 + c] = -block[r, c]
        for z in range(count):
            rotate(q1, jet[4:7, 1 + z], rotated)
            for r in range(3):
                out[at + wide * r + 6 + z] = -rotated[r]
        at += 3 * wide
        w, a, b, c = jet[0, 0], jet[1, 0], jet[2, 0], jet[3, 0]
        # - right matrix of Q
        for r in range(4):
            out[at + high * r] = 1.0
        out[at + 1], out[at + 2], out[at + 3], out[at + 4] = -w, a, b, c
        to = at + high
        out[to + 1], out[to + 2], out[to + 3], out[to + 4] = -a, -w, -c, b
        to += high
        out[to + 1], out[to + 2], out[to + 3], out[to + 4] = -b, c, -w, -a
        to += high
        out[to + 1], out[to + 2], out[to + 3], out[to + 4] = -c, -b, a, -w
        for z in range(count):
            product(q0, jet[0:4, 1 + z], turned)
            for r in range(4):
                out[at + high * r + 5 + z] = -turned[r]
        at += 4 * high
        out[at] = 1.0
        out[at + 1] = -1.0
        out[at + 2] = -lengths[i]
        at += 3


@njit(cache=True)
def hessian(x, lengths, multipliers, factor, local, jets, gamma, up, weight, out):
    """Values of the lower triangle of ``factor d2E + sum multipliers d2 glue``, `hessian_structure`. Jets by z.

    multipliers (8 p,).
    """
    n = np.empty((4, 4))
    n_weight = np.empty((4, 4))
    force = np.empty(3)
    e = np.empty(3)
    lam = np.empty(3)
    spin = np.empty(4)
    back = np.empty(4)
    weigh = gamma != 0.0 and factor != 0.0
    g = factor * gamma
    components = jets.shape[2]
    count = parameter_count(components)
    begin = 1 + count
    at = 0
    for i in range(lengths.size):
        k = STRIDE * i
        row = ROWS * i
        q0 = x[k + QUATERNION : k + OMEGA]
        q1 = x[k + NEXT + QUATERNION : k + NEXT + OMEGA]
        jet = jets[i]
        for c in range(3):
            lam[c] = multipliers[row + c]
        unrotate(q1, lam, force)
        # conj(q0) o mu: the multiplier of the quaternion's glue seen from the joint
        m0, m1, m2, m3 = multipliers[row + 3], multipliers[row + 4], multipliers[row + 5], multipliers[row + 6]
        w, a, b, c0 = q0[0], q0[1], q0[2], q0[3]
        spin[0] = w * m0 + a * m1 + b * m2 + c0 * m3
        spin[1] = w * m1 - a * m0 - b * m3 + c0 * m2
        spin[2] = w * m2 + a * m3 - b * m0 - c0 * m1
        spin[3] = w * m3 - a * m2 + b * m1 - c0 * m0
        for c in range(begin, components):
            t = factor * local[i, c]
            t -= force[0] * jet[4, c] + force[1] * jet[5, c] + force[2] * jet[6, c]
            t -= spin[0] * jet[0, c] + spin[1] * jet[1, c] + spin[2] * jet[2, c] + spin[3] * jet[3, c]
            out[at + c - begin] = t
        if weigh:
            unrotate(q1, up, e)
            for c in range(begin, components):
                out[at + c - begin] += g * (e[0] * weight[i, 0, c] + e[1] * weight[i, 1, c] + e[2] * weight[i, 2, c])
        at += components - begin
        form(lam, jet[4:7, 0], n)
        if weigh:
            form(up, weight[i, :, 0], n_weight)
        for r in range(4):
            for c in range(r + 1):
                t = -2.0 * n[r, c]
                if weigh:
                    t += 2.0 * g * n_weight[r, c]
                out[at] = t
                at += 1
        for z in range(count):
            form(lam, jet[4:7, 1 + z], n)
            if weigh:
                form(up, weight[i, :, 1 + z], n_weight)
            for r in range(4):
                t = -2.0 * (n[r, 0] * q1[0] + n[r, 1] * q1[1] + n[r, 2] * q1[2] + n[r, 3] * q1[3])
                if weigh:
                    t += (
                        2.0
                        * g
                        * (
                            n_weight[r, 0] * q1[0]
                            + n_weight[r, 1] * q1[1]
                            + n_weight[r, 2] * q1[2]
                            + n_weight[r, 3] * q1[3]
                        )
                    )
                out[at] = t
                at += 1
        for z in range(count):
            # mu o conj(Q_z)
            d0, d1, d2, d3 = jet[0, 1 + z], jet[1, 1 + z], jet[2, 1 + z], jet[3, 1 + z]
            back[0] = m0 * d0 + m1 * d1 + m2 * d2 + m3 * d3
            back[1] = -m0 * d1 + m1 * d0 - m2 * d3 + m3 * d2
            back[2] = -m0 * d2 + m1 * d3 + m2 * d0 - m3 * d1
            back[3] = -m0 * d3 - m1 * d2 + m2 * d1 + m3 * d0
            for r in range(4):
                out[at] = -back[r]
                at += 1


@njit(cache=True)
def costates(entries, components, slope, multipliers):
    """Multipliers (>= 8 p,) of the glue that balance r, q and eta of the joints 1 ... p, from the last to the first.

    entries: of the glue's Jacobian, as `jacobian` fills them, for jets of so many components; slope (>= 10 p + 9,): the
    gradient with what all other rows add to it, changed in place into what is left at joint 0.
    """
    wide = 6 + parameter_count(components)
    high = wide - 1
    own = 3 * wide + 4 * high + 3
    for i in range(multipliers.size // ROWS - 1, -1, -1):
        k, row, at = STRIDE * i, ROWS * i, own * i
        turns = at + 3 * wide
        for c in range(3):
            multipliers[row + c] = -slope[k + NEXT + c]
            slope[k + c] -= multipliers[row + c]
        steep = -slope[k + NEXT + ETA]
        multipliers[row + 7] = steep
        for r in range(4):
            v = -slope[k + NEXT + QUATERNION + r]
            for c in range(3):
                v -= entries[at + wide * c + 2 + r] * multipliers[row + c]
            multipliers[row + 3 + r] = v
        steep = -steep
        for r in range(4):
            v = multipliers[row + 3 + r]
            for c in range(4):
                slope[k + QUATERNION + c] += entries[turns + high * r + 1 + c] * v
            steep += entries[turns + high * r + 6] * v
        for c in range(3):
            steep += entries[at + wide * c + 7] * multipliers[row + c]
        slope[k + ETA] += steep


@njit(cache=True)
def end_weight(q, eta, up, factor, by, second):
    """``f = factor (eta <R e_x, up> + eta^2/2 <R e_z, up>)`` at one joint; returns f.

    Fills `by` (5,) with the derivatives by q (4) and eta, `second` (15,) with the lower triangle of the second ones in
    the order (q, eta).
    """
    n_x = np.empty((4, 4))
    n_z = np.empty((4, 4))
    axis = np.zeros(3)
    axis[0] = 1.0
    form(up, axis, n_x)
    axis[0], axis[2] = 0.0, 1.0
    form(up, axis, n_z)
    across = 0.0
    along = 0.0
    at = 0
    for r in range(4):
        d_x = n_x[r, 0] * q[0] + n_x[r, 1] * q[1] + n_x[r, 2] * q[2] + n_x[r, 3] * q[3]
        d_z = n_z[r, 0] * q[0] + n_z[r, 1] * q[1] + n_z[r, 2] * q[2] + n_z[r, 3] * q[3]
        across += q[r] * d_x
        along += q[r] * d_z
        by[r] = factor * (2.0 * eta * d_x + eta * eta * d_z)
        second[10 + r] = factor * 2.0 * (d_x + eta * d_z)
        for c in range(r + 1):
            second[at] = factor * (2.0 * eta * n_x[r, c] + eta * eta * n_z[r, c])
            at += 1
    by[4] = factor * (across + eta * along)
    second[14] = factor * along
    return factor * (eta * across + 0.5 * eta * eta * along)


@njit(cache=True)
def walk(free, x, lengths, limit, sideways):
    """Writes positions, quaternions and eta of joints 1 ... p from joint 0, the omegas, the n and the in-plane
    curvatures: glue satisfied."""
    out = np.empty(13)
    rotated = np.empty(3)
    turned = np.empty(4)
    own = np.empty(4 if sideways < 0 else 6)
    for i in range(lengths.size):
        k = STRIDE * i
        length = lengths[i]
        own_parameters(x, lengths, i, sideways, own)
        body_values(free, own, length, limit, 0, out)
        product(x[k + QUATERNION : k + OMEGA], out[0:4], turned)
        for c in range(4):
            x[k + NEXT + QUATERNION + c] = turned[c]
        rotate(turned, out[4:7], rotated)
        for c in range(3):
            x[k + NEXT + c] = x[k + c] + rotated[c]
        x[k + NEXT + ETA] = x[k + ETA] + length * x[k + SLOPE]
