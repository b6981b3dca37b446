"""How far a shell would be from the ribbon, from the ribbon alone: an estimate before any shell is solved.

Five effects that an inextensible ribbon leaves out, each from the ribbon's own curvatures and loads:

- edges: across its width the strip bends and, near its free edges, stretches; no constant is fitted;
- shear: the twisting moment ends in transverse shear there;
- in-plane bending, M_y^2 / (2 (1 - nu^2) w^2 / h^2) per length, M_y the moment about the surface's normal;
- tension, N^2 h^2 / (24 (1 - nu^2)) per length;
- clamps: what holds the edge, or two corners, stretches the strip over a length of about w / 2. Nothing here predicts
  how much: EDGE_CLAMP and CORNER_CLAMP are fitted to shells of section 7.3 (results/limits measures how often the
  verdict is right, on those and on others).

In-plane bending and tension follow from the weight beyond each section, and from the support at s = l.

Edges and shear are those of the strip with energy "finite", which starts from the ribbon's own shape: rulings tie the
twist to the curvature, tau = eta kappa, so that a ribbon does not twist where its curvature passes zero; a strip of
some thickness does, is no developable surface there, and stretches most of all. How far the shape moves is the distance
to that strip, and what it leaves out (`compare.models.ribbon.neglected`). An energy of the user's own is no neighbour
of it, and not every ribbon has one: then the ribbon, softened by its edges (`ribbon.energies.edge_layer`, or what its
energy brings in their place), says both.

An energy with a free twist has some of this itself (`compare.models.ribbon.neglected_free`).
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from compare.measure.distance import grid_hausdorff
from compare.models.base import natural_constant
from compare.models.capabilities import Estimate, Sides
from compare.models.ribbon.neglected import (
    FOLD,
    beside,
    corner_turn,
    crowded_energy,
    crowding,
    held_ends,
    passages,
    thin,
    to_shell,
)
from compare.models.ribbon.rivals import RULED, either_side, probe_once
from compare.models.ribbon.taut import taut
from compare.scene.inputs import law
from compare.scene.scene import Scene
from ribbon import Equilibrium
from ribbon.analysis.along import line_density
from ribbon.analysis.parts import parts as own_parts
from ribbon.energies import ENERGIES
from ribbon.find.softened import soften

if TYPE_CHECKING:
    from compare.models.ribbon.rivals import Probed

FloatArray = NDArray[np.float64]

#: Energy over the elastic energy without it: EDGE_CLAMP x / (1 - x), x = |eta'| w / 2 near the clamp; CORNER_CLAMP f
#: sqrt(w h) / c, c the size of the held corners, f the share of the bending energy within w / 2 of the clamp.
EDGE_CLAMP = 3e-4
CORNER_CLAMP = 2.4e-2
#: x from which EDGE_CLAMP x / (1 - x) is too near its pole to be told without a bound: 0.01 in x changes it by a fifth.
POLE = 0.95
#: Elastic energy over the weight below which a strip is straight.
_STRAIGHT = 1e-9
_SAMPLES = 1000
_ALONG, _ACROSS = 200, 4


@dataclass(frozen=True)
class LocalState:
    """A ribbon on a grid s (k,): curvatures, natural curvature, frames; M_y and N (k,), zero where not known."""

    s: FloatArray
    omega: FloatArray
    eta: FloatArray
    natural: FloatArray
    normal: FloatArray
    position: FloatArray
    moment: FloatArray
    tension: FloatArray


def estimate(
    scene: Scene, equilibrium: Equilibrium, width_to_thickness: float, probed: Probed | None = None
) -> Estimate:
    """The estimate for a scene whose ribbon is `equilibrium`, with rulings; probed: as `rivals.probe_once` takes it."""
    clock = time.perf_counter()
    if equilibrium.forces_why:
        return of_a_straight_strip(scene, equilibrium, width_to_thickness)
    softened = soften(equilibrium, scene.width / width_to_thickness)
    ruled = equilibrium.problem.energy in RULED
    own = thin(scene, width_to_thickness) if ruled and equilibrium.ok else None
    best = None if own is None else beside(own, equilibrium, width_to_thickness)
    seen: dict[int, float] = {}
    near = (best,) if best is None or not best.ok else either_side(scene, equilibrium, best, seen)
    each = [_estimated(scene, equilibrium, softened, one, own, width_to_thickness, seen) for one in near]
    found = max(each, key=lambda one: one.worst)
    rival = probe_once(scene, equilibrium, probed)
    return replace(found, rival=rival, sides=sides(near, each), seconds=time.perf_counter() - clock)


def sides(near: Sequence[Equilibrium | None], each: Sequence[Estimate]) -> Sides | None:
    """Both sides, the worse one first; None where there is one."""
    first, *rest = sorted(zip(near, each, strict=True), key=lambda one: -one[1].worst)
    if not rest:
        return None
    (there, estimated), (other, also) = first, rest[0]
    assert there is not None
    assert other is not None
    return Sides((there.energy.total, other.energy.total), (estimated.distance, also.distance))


def _estimated(
    scene: Scene,
    equilibrium: Equilibrium,
    softened: Equilibrium | None,
    best: Equilibrium | None,
    own: Scene | None,
    width_to_thickness: float,
    seen: Mapping[int, float],
) -> Estimate:
    """The estimate by way of a neighbour with energy "finite", `best` (None: it has none), which is of the scene `own`;
    seen: as `to_shell`."""
    h, nu = scene.width / width_to_thickness, scene.strip.poisson
    section = ENERGIES[equilibrium.problem.energy].relaxed(nu, scene.width, h)
    there = softened if softened is not None else equilibrium
    state = local_state(scene, there)
    if best is not None and best.ok:
        held = own_parts(best)
        elastic = float(best.energy.elastic) + natural_constant(scene.curvature)
    else:
        arguments = state.omega, state.eta, state.natural
        held = {
            "membrane": float(section.membrane(*arguments).mean()),
            "shear": float(section.shear(state.omega, state.eta).mean()),
        }
        elastic = _elastic(scene, there) + float(section.softening(*arguments)[0].mean())
    in_plane = in_plane_density(state.moment, nu, scene.width, h)
    tension = tension_density(state.tension, nu, h)
    whole = elastic + float(in_plane.mean()) + float(tension.mean())
    bends = not elastic <= _STRAIGHT * scene.gamma or bool(in_plane.mean() > tension.mean())
    whole += 0.0 if bends else 0.5 * scene.gamma  # of the weight Gamma, half a length below its clamp
    # what stretches is in the whole too: no share is above 1, however heavy the strip (tension) or steep the clamp
    clamps = _clamps(scene, there, state, h) * whole
    whole += clamps
    whole = whole if whole > 0.0 else 1.0
    parts = {
        "edges": held["membrane"] / whole,
        "shear": held["shear"] / whole,
        "in_plane": float(in_plane.mean()) / whole,
        "tension": float(tension.mean()) / whole,
        "clamps": clamps / whole,
    }
    if equilibrium.problem.energy in RULED:
        distance = to_shell(own or scene, equilibrium, best, width_to_thickness, seen)
    else:
        distance = None if softened is None else _distance(scene, equilibrium, softened, state, h)
    scale = section.scale * float(np.sqrt(np.mean(state.omega**2))) ** 0.5
    more = crowd = 0.0
    if own is not None and best is not None and best.ok:
        more = passages(own, best) / whole
        if _steepest(scene, there, *held_ends(scene)) > POLE:
            crowd = max(crowded_energy(own, best) - clamps, 0.0) / whole
    return Estimate(
        width_to_thickness, parts, distance, scale, 0.0, None, bends=bends, passages=more, crowded=crowd
    )  # fmt: skip


def of_a_straight_strip(scene: Scene, equilibrium: Equilibrium, width_to_thickness: float) -> Estimate:
    """The estimate for a strip whose tension is not determined: from one that stretches (`compare.models.ribbon.taut`),
    whose middle sags from the straight one; where that is not known there is none, and it says why."""
    clock = time.perf_counter()
    found = taut(scene, scene.width / width_to_thickness)
    if found is None:
        spent = time.perf_counter() - clock
        return Estimate(width_to_thickness, {}, None, 0.0, spent, None, why=f"not determined: {equilibrium.forces_why}")
    parts = {**dict.fromkeys(("edges", "shear", "in_plane", "clamps"), 0.0), "tension": found.share["membrane"]}
    return Estimate(width_to_thickness, parts, found.sag, 0.0, time.perf_counter() - clock, None)


def in_plane_density(moment: FloatArray, poisson: float, width: float, thickness: float) -> FloatArray:
    """Energy (k,) per length of bending in the strip's own plane, D w / l^2, from its moment (k,) in D w / l."""
    return np.asarray(moment**2 * (thickness / width) ** 2 / (2.0 * (1.0 - poisson**2)))


def tension_density(tension: FloatArray, poisson: float, thickness: float) -> FloatArray:
    """Energy (k,) per length of a tension (k,) in D w / l^2, in D w / l^2."""
    return np.asarray((tension * thickness) ** 2 / (24.0 * (1.0 - poisson**2)))


def _elastic(scene: Scene, e: Equilibrium) -> float:
    """Elastic energy of the ribbon's own density, D w / l, with the constant of the natural curvature."""
    bending, natural = e.problem.energy_parts(e.x)[:2]  # type: ignore[attr-defined]
    return float(bending + natural) + natural_constant(scene.curvature)


def local_state(scene: Scene, e: Equilibrium) -> LocalState:
    s = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    position, frame, omega, eta = e.continued(s)
    force, moment = np.zeros((s.size, 3)), np.zeros((s.size, 3))
    if scene.up is not None and scene.gamma:
        weight = -scene.gamma * scene.up
        beyond = (1.0 - s)[:, None]
        centre = (np.cumsum(position[::-1], axis=0)[::-1] - 0.5 * position) / _SAMPLES  # int of r beyond s
        force = force + beyond * weight
        moment = moment + np.cross(centre - beyond * position, weight)
    support = e.end_support
    if support is not None:
        force = force + support.force
        moment = moment + support.moment + np.cross(e.position(np.array([1.0])) - position, support.force)
    known = not scene.barriers and scene.closure is None
    return LocalState(
        s=s,
        omega=omega,
        eta=np.zeros_like(eta) if e.has_free_twist else eta,
        natural=law.at(scene.curvature, s),
        normal=frame[:, :, 1],
        position=position,
        moment=np.einsum("ki,ki->k", moment, frame[:, :, 1]) * known,
        tension=np.einsum("ki,ki->k", force, frame[:, :, 2]) * known,
    )


def _clamps(scene: Scene, e: Equilibrium, state: LocalState, h: float) -> float:
    """Energy of what the clamps stretch, over the elastic energy without it."""
    density = line_density(e, state.s) + 0.5 * state.natural**2
    total = float(density.mean())
    if not total > 0.0:
        return 0.0
    part = 0.0
    for at in held_ends(scene):
        if scene.shell.clamp == "corners":
            near = float(density[np.abs(state.s - at) < 0.5 * scene.width].sum()) / (_SAMPLES * total)
            corner = scene.shell_corner or scene.width / 8.0
            part += CORNER_CLAMP * near * (scene.width * h) ** 0.5 / corner
        else:
            part += EDGE_CLAMP * crowding(_steepest(scene, e, at))
    return part


def _steepest(scene: Scene, e: Equilibrium, *ends: float) -> float:
    """Largest |eta'| w / 2 on segments within w of the ends."""
    lengths = e.problem.lengths
    middles = np.cumsum(lengths) - 0.5 * lengths
    near = np.any([np.abs(middles - at) < scene.width for at in ends], axis=0)
    return float((np.abs(e.parameters[:, 2]) * 0.5 * scene.width)[near].max(initial=0.0))


def _distance(scene: Scene, e: Equilibrium, softened: Equilibrium, state: LocalState, h: float) -> float:
    """Hausdorff distance over l of the ribbon to its softened shape, bent in its plane too, with what clamps add."""
    here, there = e.surface(_ALONG, _ACROSS).grid, softened.surface(_ALONG, _ACROSS).grid
    distance = grid_hausdorff(here, bent_in_plane(scene, there, state, h))
    ends = held_ends(scene)
    if not ends:
        return distance
    if scene.shell.clamp == "edge":
        return distance + FOLD * scene.width * crowding(_steepest(scene, softened, *ends))
    return max(distance, corner_turn(scene, softened, ends))


def bent_in_plane(scene: Scene, grid: FloatArray, state: LocalState, h: float) -> FloatArray:
    """The surface (n, m, 3) of a strip with a free end bent in its own plane too, to the first order."""
    if scene.clamp_end is not None:
        return grid
    bend = state.moment * (h / scene.width) ** 2 / (1.0 - scene.strip.poisson**2)
    turn = (bend[:, None] * state.normal) / _SAMPLES
    angle = np.vstack([np.zeros(3), np.cumsum(turn, axis=0)])
    first = np.vstack([np.zeros(3), np.cumsum(np.cross(turn, state.position), axis=0)])
    at = np.minimum((np.linspace(0.0, 1.0, len(grid)) * _SAMPLES).astype(int), _SAMPLES)
    return np.asarray(grid + np.cross(angle[at][:, None], grid) - first[at][:, None])
