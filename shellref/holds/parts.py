"""Which parts of an end are held. NumPy only.

The section of a ribbon's end is a point and a frame. Of a shell's edge, a row of nodes x_i with directors d_i and its
middle node x_m, they are (docs/theory.md, eq. (7.24)):

    "all"        point and frame: x_i = p + v_i t_x, d_i = t_y (the edge does not move)
    "frame"      the frame: the same, p free (three unknowns; a guide)
    "position"   the point: x_m = p, all else of the edge free; of a straight section the edge is rigid, turning about p
    "section"    nothing but that the section is straight: a rigid edge with six unknowns
    "nothing"    a free end

A ribbon whose frame is free at a clamp is held at a point of its centreline. Its ruling there is free (the edge bends
with the strip), or straight (the edge is a generator): the two kinds of "position".
"""

from __future__ import annotations

ALL, FRAME, POSITION, SECTION, NOTHING = PARTS = ("all", "frame", "position", "section", "nothing")


def at_a_point(part: str) -> bool:
    """Whether the point of the end is held."""
    return part in (ALL, POSITION)


def has_frame(part: str) -> bool:
    """Whether the frame of the end is held."""
    return part in (ALL, FRAME)
