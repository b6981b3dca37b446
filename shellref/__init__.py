"""Independent nonlinear references for thin elastic strips.

A Naghdi (Reissner-Mindlin) shell on dolfinx and a planar elastica. This package never imports `ribbon` or `compare`,
and importing it does not import dolfinx: only `shellref.fenics.dolfinx_api` does, and only when a solve starts.

Everything is dimensionless: length l = 1, bending stiffness D = 1 per unit width, energies in D w / l,
forces in D w / l^2, moments in D w / l.
"""

from shellref.inputs import ShellInputError
from shellref.shell.options import ShellOptions
from shellref.shell.problem import Pose, ShellProblem, Waypoint
from shellref.shell.result import ShellResult, ShellStatus
from shellref.shell.surface import ShellSurface

__all__ = [
    "Pose",
    "ShellInputError",
    "ShellOptions",
    "ShellProblem",
    "ShellResult",
    "ShellStatus",
    "ShellSurface",
    "Waypoint",
]
