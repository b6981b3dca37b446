"""Half turns of a closed band: the shape from which a ribbon begins, and whether a state has as many as were asked for.

The equations of a band of three half turns are those of one of a single one, its end faces joined upside down: which of
them is found is a matter of the start, and no equation keeps a strip from passing through itself on the way. So they
are counted at the end, by linking numbers of the surface.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from compare.measure.linking import half_turns
from compare.models.base import State, Status
from ribbonbench.errors import BadInput

if TYPE_CHECKING:
    from compare.scene.scene import Scene

#: Of the starting ribbon omega = BENT sin(pi n s), eta = RULED sin(pi n s): n folds of one hand, each of them turning
#: the strip over, over l. Found by trial over BENT 12 to 24 and RULED 0.6 to 1 (w/l = 0.05).
BENT, RULED, JOINTS = 16.0, 0.6, 61
#: Part of the slope eta' = 2 / w of rulings that meet at the edge.
STEEP = 0.7
#: Most half turns of a ribbon, and stations around a band at which they are counted.
MOST, AROUND = 3, 300


def beyond_the_ribbon(scene: Scene) -> BadInput | None:
    """Half turns that no start is known for."""
    if scene.closure is None or scene.closure.half_turns is None:
        return None
    turned = scene.closure.turned
    if turned in (1, MOST):
        return None
    why = (
        "is not found by the ribbon: an end that is turned by two half turns undoes them through the doubly wound "
        "circle (8 pi^2 D w / l), and twisted starts settle with fewer"
    )
    remedy = 'use 1 or 3 with kind = "moebius", or the shell alone (ribbonbench shell)'
    return BadInput("closure.half_turns", turned, why, remedy)


def seed(scene: Scene, free: bool) -> tuple[tuple[float, ...], tuple[float, ...]] | None:
    """Curvature (1 / l) and ruling (where the twist is `free` the twist) of the starting ribbon, from its start to its
    end; None: the usual one does."""
    closure = scene.closure
    if closure is None or closure.turned < MOST or scene.seed.curvature is not None:
        return None
    wave = np.sin(math.pi * closure.turned * np.linspace(0.0, 1.0, JOINTS))
    ruled = min(RULED, STEEP * 2.0 / (scene.width * math.pi * closure.turned))  # rulings do not cross within the strip
    return tuple((BENT * wave).tolist()), tuple((RULED * BENT * wave**2 if free else ruled * wave).tolist())


def counted(scene: Scene, state: State) -> State:
    """The state; failed where it has other half turns than `closure.half_turns` asks for."""
    closure = scene.closure
    if closure is None or closure.half_turns is None or state.shape is None:
        return state
    s = np.linspace(0.0, 1.0, AROUND, endpoint=False)
    lines = state.shape.points(s, np.array([0.25, 0.0, -0.25]) * scene.width)
    found = abs(half_turns(lines, closure.turned % 2 == 1))
    if abs(found - closure.turned) < 0.5:
        return state
    why = f"the band has {found:.0f} half turns, by its linking number, and closure.half_turns = {closure.turned}"
    return replace(state, status=Status.FAILED, word="failed", message=why)
