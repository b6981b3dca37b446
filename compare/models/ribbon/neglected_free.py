"""How far a shell would be from a strip with a free twist: what its energy leaves out, from the strip alone.

Layers along the edges and shear are in the energy itself (`Estimate.own`). Left out are, as for the ribbon with rulings
(`compare.models.ribbon.estimate`), tension and in-plane bending unless it is a field; and, of all energies but
`finite`, what that one has beyond: its energy in the same state, and the distance to its equilibrium. How far `finite`
itself is from the shell is told by what it drops (`compare.models.ribbon.neglected`).
"""

from __future__ import annotations

import math
import time
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from compare.models.base import natural_constant
from compare.models.capabilities import Estimate
from compare.models.ribbon.estimate import in_plane_density, local_state, of_a_straight_strip, sides, tension_density
from compare.models.ribbon.free import FINITE
from compare.models.ribbon.neglected import PLAIN, beside, passages, thin, to_shell
from compare.models.ribbon.rivals import either_side, probe_once
from compare.scene.scene import Scene
from ribbon import Equilibrium
from ribbon.analysis import parts as own

if TYPE_CHECKING:
    from compare.models.ribbon.rivals import Probed

FloatArray = NDArray[np.float64]


def remaining(
    scene: Scene, equilibrium: Equilibrium, width_to_thickness: float, probed: Probed | None = None
) -> Estimate:
    """The estimate for a scene whose strip with a free twist is `equilibrium`; probed: as `rivals.probe_once` takes
    it."""
    clock = time.perf_counter()
    if equilibrium.forces_why:
        return of_a_straight_strip(scene, equilibrium, width_to_thickness)
    e, nu = equilibrium, scene.strip.poisson
    h = scene.width / width_to_thickness
    state = local_state(scene, e)
    with_thickness = e.problem.strip.thickness is not None
    held = own.parts(e) if with_thickness else {"membrane": 0.0, "shear": 0.0}
    bends_in_plane = e.problem.fields.count == 3
    in_plane = 0.0 if bends_in_plane else float(in_plane_density(state.moment, nu, scene.width, h).mean())
    tension = float(tension_density(state.tension, nu, h).mean())
    more = 0.0
    if e.problem.energy != FINITE:
        added = own.line_density_of(FINITE, e, state.s, h) - own.line_density(e, state.s)
        more = abs(float(added.mean()))
    elastic = float(e.energy.elastic) + natural_constant(scene.curvature)
    whole = elastic + in_plane + tension + more  # all that stretches is in it: no share is above 1
    whole = whole if whole > 0.0 else 1.0
    warps = e.problem.energy == PLAIN  # it has the layers of `finite`, but not what clamps do
    parts = {
        "edges": (held["membrane"] + (0.0 if warps else more)) / whole,
        "shear": held["shear"] / whole,
        "in_plane": in_plane / whole,
        "tension": tension / whole,
        "clamps": (more if warps else 0.0) / whole,
    }
    scale = (3.0 * (1.0 - nu * nu)) ** 0.25 * scene.width / math.sqrt(h) * float(np.mean(state.omega**2)) ** 0.25
    known = (held["membrane"] + held["shear"]) / whole
    best = e if e.problem.energy == FINITE else beside(scene, e, width_to_thickness)
    seen: dict[int, float] = {}
    near = (best,) if best is None or best is e or not best.ok else either_side(scene, e, best, seen)
    each = [to_shell(scene, e, one, width_to_thickness, seen) for one in near]
    rival = probe_once(scene, e, probed)
    more = 0.0 if best is None or not best.ok else passages(thin(scene, width_to_thickness), best) / whole
    estimate = Estimate(width_to_thickness, parts, each[0], scale, 0.0, rival, known, passages=more)
    told = sides(near, [replace(estimate, distance=one) for one in each])
    distance = each[0] if told is None else told.distances[0]
    return replace(estimate, distance=distance, sides=told, seconds=time.perf_counter() - clock)
