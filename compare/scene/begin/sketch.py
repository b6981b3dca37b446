"""The frame of a strip in letters, for the comments of a scene."""

FRAME = r"""
                         t_y (normal, out of the surface)
                          ^
                          |     ^ t_x (across, away from you)
                __________|____/_____________________
               /          |   /                     /
              /           |  /                     /
             /            | /                     /
    s = 0   /             o-------> t_z          /  s = length
           /             (tangent, along)       /
          /____________________________________/

  t_z points where s grows, at both ends: at s = length it points out of the strip.
  t_x = t_y x t_z (a right-handed frame, all of length 1).
  natural_curvature > 0: without load the strip bends away from t_y (here: down); < 0: towards it (up).
"""
"""A strip seen from the side and a little from above; every line fits a comment."""


def commented() -> str:
    """The sketch as comment lines of TOML."""
    return "\n".join(f"# {line}".rstrip() for line in FRAME.strip("\n").split("\n"))
