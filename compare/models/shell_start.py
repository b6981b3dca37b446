"""The ribbon's equilibrium surface as a place where the shell's solve may begin.

The shell settles there at the full load. Its equilibrium satisfies its own equations whatever it began with: the start
only selects the branch, where a strip with two clamps has several.
"""

from __future__ import annotations

import numpy as np

from ribbon import Equilibrium
from ribbon.surface import centreline, ruling_foot
from shellref.shell.problem import ShellProblem
from shellref.shell.strip import strip_grid
from shellref.shell.surface import ShellSurface


def ribbon_surface(equilibrium: Equilibrium, problem: ShellProblem) -> ShellSurface:
    """Positions and normals of the ribbon's particles at the nodes of the shell's mesh (units l)."""
    grid = strip_grid(problem)
    s, v = np.meshgrid(grid.s_nodes, grid.v_nodes, indexing="ij")
    material = np.column_stack([s.ravel(), v.ravel()])
    lengths = equilibrium.problem.lengths
    points, frames = equilibrium.joints
    foot = ruling_foot(equilibrium.parameters, lengths, material)
    place, frame, _, eta = centreline(
        equilibrium.parameters, lengths, points, frames, foot, equilibrium.problem.exponent_limit
    )
    ruling = frame[:, :, 0] + eta[:, None] * frame[:, :, 2]
    shape = (*s.shape, 3)
    position = (place + material[:, 1:] * ruling).reshape(shape)
    return ShellSurface(grid.s_nodes, grid.v_nodes, position, frame[:, :, 1].reshape(shape), grid.degree)
