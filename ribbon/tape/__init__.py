"""A tape spring as a planar rod with a flexible section (Martin et al. 2017, hal-01923675; Guinot et al. 2012,
10.1016/j.ijsolstr.2011.09.011).

The centroids' line is bent and stretched in its plane; the section stays plane, normal to the line and inextensible.
It has one curvature (plain) or even Legendre terms of it (enriched) as fields of s. Lengths in l, energies in D w / l.
"""
