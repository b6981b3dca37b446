"""How often a closed shell is turned over: by linking numbers of its surface. NumPy only."""

from __future__ import annotations

import numpy as np

from ribbonbench import linking
from shellref.shell.surface import ShellSurface

#: Stations around a band.
AROUND = 300


def half_turns(surface: ShellSurface, width: float, asked: int) -> float:
    """Half turns of a closed strip of `width` (l): its centreline linked with a line beside it, which closes after one
    round, or after two where those that were asked for are odd."""
    s = np.linspace(0.0, 1.0, AROUND, endpoint=False)
    return linking.half_turns(surface.grid(s, np.array([0.25, 0.0, -0.25]) * width), asked % 2 == 1)
