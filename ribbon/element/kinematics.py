"""Kinematics of a segment, whichever fields bend it: a ruling (`ribbon.element.series`, `ribbon.element.body_series`)
or a free twist (`ribbon.element.free_series`), chosen inside compiled code by `free`.

Parameters q of a segment: (a, b, n, m) with kappa_1 = a s + b and the ruling eta = n s + m; free: with the twist
kappa_3 = n s + m, and (a, b, n, m, c, d) with kappa_2 = c s + d besides. Quantities, jets and units are those modules'.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from ribbon.element import body_series, free_series, free_values, series

#: Components of a jet by the number of parameters of a segment.
COMPONENTS = {4: free_series.COMPONENTS[0], 6: free_series.COMPONENTS[1]}


@njit(cache=True)
def segment_values(free, q, length, limit, frame, p, j):
    """End frame (3, 3), chord p (3,) and its integral J (3,) of a segment with parameters q (4 or 6,)."""
    if free:
        return free_values.segment_values(q, length, limit, frame, p, j)
    return series.segment_values(q[0], q[1], q[2], q[3], length, limit, frame, p, j)


@njit(cache=True)
def body_values(free, q, length, limit, level, out):
    """Quaternion, u, v, t (13,) seen from the end (`ribbon.element.body_series.body_values`)."""
    if free:
        return free_values.body_values(q, length, limit, level, out)
    return body_series.body_values(q[0], q[1], q[2], q[3], length, limit, level, out)


@njit(cache=True)
def walk(free, q, lengths, limit, states):
    """Jets (p, 12, 15 or 18, components) at the ends of segments (`ribbon.element.series.walk`)."""
    if free:
        return free_series.walk(q, lengths, limit, states)
    return series.walk(q, lengths, limit, states)


@njit(cache=True)
def body_jets_many(free, q, lengths, limit, level, jets):
    """Jets (p, 13, components) seen from the ends (`ribbon.element.body_series.body_jets_many`)."""
    p = lengths.size
    states = np.empty((p, series.STATES[level], jets.shape[2]))
    count = walk(free, q, lengths, limit, states)
    phi = np.empty((3, jets.shape[2]))
    out = np.empty(body_series.BODY_QUANTITIES)
    for i in range(p):
        body_values(free, q[i], lengths[i], limit, 0, out)
        for k in range(4):
            jets[i, k, 0] = out[k]
        body_series.to_body(states[i], phi, level, jets[i])
    return count
