"""How far a shell would be from a strip with a free twist: what its energy leaves out, from the strip alone.

Layers along the edges and shear are in the energy itself (`Estimate.own`). Left out are, as for the ribbon with rulings
(`compare.models.ribbon.estimate`), tension, in-plane bending unless it is a field, the turn of held corners; and, of
all energies but `finite`, what that one has beyond: its energy in the same state, and the distance to its equilibrium.
And of every energy the next terms of what varies along the strip: a part NEXT of how far the leading ones move it.
"""

from __future__ import annotations

import math
import time

import numpy as np
from numpy.typing import NDArray

from compare.errors import BadInput
from compare.measure.distance import grid_hausdorff
from compare.models.base import natural_constant
from compare.models.ribbon.build import ribbon_arguments
from compare.models.ribbon.estimate import (
    Estimate,
    bent_in_plane,
    corner_turn,
    in_plane_density,
    local_state,
    tension_density,
)
from compare.models.ribbon.free import FINITE
from compare.scene.scene import Scene
from ribbon import Equilibrium, RibbonInputError, solve
from ribbon.energies import parts as own

FloatArray = NDArray[np.float64]

#: Part of the distance between `extensible` and `finite` by which terms beyond those of `finite` may still move the
#: strip: the largest of ten measured (scenes curl_4_3 and curl_4_3_down, w/h = 10 to 400: 0.39; 0.04 to 0.21 of the
#: others). An estimate is to err towards caution.
NEXT = 0.4
#: The energy that has `finite`'s section, and none of its terms of what varies along the strip.
PLAIN = "extensible"
_ALONG, _ACROSS = 200, 4


def remaining(scene: Scene, equilibrium: Equilibrium, width_to_thickness: float) -> Estimate:
    """The estimate for a scene whose strip with a free twist is `equilibrium`."""
    clock = time.perf_counter()
    e, nu = equilibrium, scene.strip.poisson
    h = scene.width / width_to_thickness
    state = local_state(scene, e)
    with_thickness = e.problem.strip.thickness is not None
    held = own.parts(e) if with_thickness else {"membrane": 0.0, "shear": 0.0}
    bends_in_plane = e.problem.fields.count == 3
    in_plane = 0.0 if bends_in_plane else float(in_plane_density(state.moment, nu, scene.width, h).mean())
    tension = float(tension_density(state.tension, nu, h).mean())
    beyond = 0.0
    if e.problem.energy != FINITE:
        more = own.line_density_of(FINITE, e, state.s, h) - own.line_density(e, state.s)
        beyond = abs(float(more.mean()))
    elastic = float(e.energy.elastic) + natural_constant(scene.curvature)
    whole = elastic + in_plane + tension
    whole = whole if whole > 0.0 else 1.0
    warps = e.problem.energy == PLAIN  # it has the layers of `finite`, but not what clamps do
    parts = {
        "edges": (held["membrane"] + (0.0 if warps else beyond)) / whole,
        "shear": held["shear"] / whole,
        "in_plane": in_plane / whole,
        "tension": tension / whole,
        "clamps": (beyond if warps else 0.0) / whole,
    }
    scale = (3.0 * (1.0 - nu * nu)) ** 0.25 * scene.width / math.sqrt(h) * float(np.mean(state.omega**2)) ** 0.25
    known = (held["membrane"] + held["shear"]) / whole
    distance = _distance(scene, e, h, bends_in_plane)
    return Estimate(width_to_thickness, parts, distance, scale, time.perf_counter() - clock, known)


def _distance(scene: Scene, e: Equilibrium, h: float, bends_in_plane: bool) -> float | None:
    """Hausdorff distance over l to the equilibrium of `finite`, bent in its plane too, with what its next terms and
    held corners add; None where it was not found."""
    lengths = e.problem.lengths
    best, plain = (e if e.problem.energy == name else _other(scene, name, h, lengths) for name in (FINITE, PLAIN))
    if best is None or plain is None:
        return None
    here, there = (found.surface(_ALONG, _ACROSS).grid for found in (e, best))
    moved = NEXT * float(grid_hausdorff(plain.surface(_ALONG, _ACROSS).grid, there))
    state = local_state(scene, best)
    if not bends_in_plane:
        there = bent_in_plane(scene, there, state, h)
    found = moved + float(grid_hausdorff(here, there))
    return found if scene.shell.clamp == "edge" else max(found, corner_turn(scene, state))


def _other(scene: Scene, energy: str, h: float, lengths: FloatArray) -> Equilibrium | None:
    """The scene's equilibrium with another energy and the thickness h (in l), on segments of the same lengths (p,);
    None where it was not found, or is on a path that would have to be gone again."""
    if scene.path:
        return None
    ends = (("clamp.start", scene.clamp_start), ("clamp.end", scene.clamp_end), ("closure", scene.closure))
    rulings = {f"{name}.ruling": None for name, held in ends if held is not None and energy != FINITE}
    keys = {"model.energy": energy, "model.stiffness": None, "shell.width_to_thickness": [scene.width / h], **rulings}
    try:
        found = solve(**{**ribbon_arguments(scene.replace(keys)), "segments": lengths})
    except (BadInput, RibbonInputError):
        return None
    return found if found.ok else None
