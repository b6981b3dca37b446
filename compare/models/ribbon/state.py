"""A ribbon's equilibrium as a state: its shape, energy, supports and the motions that nothing resists."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from compare.measure.align import Motions, even_along
from compare.models.base import (
    Energy,
    Force,
    Pose,
    Rivals,
    Seconds,
    Size,
    State,
    Status,
    Supports,
    between_parts,
    natural_constant,
    on_strip,
)
from compare.models.holds import friction
from compare.models.holds.touches import pushed
from compare.scene.inputs.law import values

if TYPE_CHECKING:
    from compare.models.ribbon.stages import LoadPath
    from compare.scene.scene import Scene
    from ribbon import Equilibrium

FloatArray = NDArray[np.float64]

#: Abscissae at which the largest curvature is looked for.
_SAMPLES = np.linspace(0.0, 1.0, 2001)

_STATUS = {
    "converged": Status.CONVERGED,
    "saddle": Status.UNSTABLE,
    "not_converged": Status.NOT_CONVERGED,
    "failed": Status.FAILED,
    "infeasible": Status.INFEASIBLE,
    "flipped": Status.FAILED,
    "rulings_cross": Status.RULINGS_CROSS,
}


@dataclass(frozen=True)
class RibbonShape:
    """A ribbon's surface (`compare.models.base.Shape`): straight rulings through its centreline, which is the surface's
    own middle line; where the twist is free the sections of the model (`ribbon.sections`)."""

    equilibrium: Equilibrium

    @property
    def bend(self) -> float:
        """Largest normal curvature, 1/l."""
        return float(np.abs(self.equilibrium.omega(_SAMPLES)).max())

    def points(self, s: FloatArray, v: FloatArray) -> FloatArray:
        """Positions (k, m, 3)."""
        grid_s, grid_v = np.meshgrid(on_strip(s), v, indexing="ij")
        _, place, _ = self.equilibrium.rulings(np.column_stack([grid_s.ravel(), grid_v.ravel()]))
        return place.reshape(*grid_s.shape, 3)

    def centreline(self, s: FloatArray) -> FloatArray:
        """Positions (k, 3)."""
        return self.equilibrium.position(on_strip(s))

    def frames(self, s: FloatArray) -> FloatArray:
        """Frames (k, 3, 3), columns t_x t_y t_z."""
        return self.equilibrium.frame(on_strip(s))

    def pose(self, s: float) -> Pose:
        """Position and frame at one abscissa; at s = 1 those of the last joint, where a clamp holds them."""
        found = self.equilibrium.end if s == 1.0 else self.equilibrium.pose(float(on_strip(s)))
        return Pose(found.position, found.frame)

    def fields(self, s: FloatArray, v: FloatArray) -> dict[str, FloatArray]:
        """`compare.models.ribbon.fields.fields`: S, v, omega, eta or tau, normal, energy_density and others."""
        from compare.models.ribbon.fields import fields

        return fields(self.equilibrium, on_strip(s), v)


def own_size(equilibrium: Equilibrium) -> Size:
    """The size that a ribbon has."""
    return Size(equilibrium.problem.formulation, (float(equilibrium.problem.lengths.size),))


def state_of(scene: Scene | None, e: Equilibrium, size: Size, seconds: Seconds, way: LoadPath | None = None) -> State:
    """A ribbon's equilibrium as a state; scene: names its walls."""
    lower, upper = e.problem.bounds()  # type: ignore[attr-defined]
    plates = any(wall.stiffness is not None for wall in scene.walls) if scene is not None else bool(e.energy.plates)
    lowest = e.lowest_eigenvalue
    return State(
        model="ribbon",
        size=size,
        status=_STATUS[e.status.code],
        word=e.status.code,
        stable=e.stable,
        message=e.message,
        energy=Energy(
            elastic=e.energy.elastic,
            gravity=e.energy.gravity,
            tip=None if e.problem.tip is None else e.energy.tip,
            plates=e.energy.plates if plates else None,
            constant=natural_constant(e.problem.strip.curvature),
            parts=_parts(e),
        ),
        shape=RibbonShape(e) if np.all(np.isfinite(e.x)) else None,
        residual=float(e.residual),
        iterations=int(e.iterations),
        lowest_eigenvalue=float(lowest) if math.isfinite(lowest) else None,
        supports=_supports(scene, e),
        error=e.tolerance_error,
        seconds=seconds,
        unknowns=int(np.sum(np.asarray(lower) < np.asarray(upper))),
        numbers={"segments": int(e.problem.lengths.size), **_numbers(e), **_beyond_walls(e)},
        motions=motions_of(e),
        log=e.log,
        states=None if way is None else way.states,
        start="path" if way is not None else "seed",
        reused=way.resumed if way is not None else False,
        native=e,
        whys=_whys(e),
        left_saddle=None if e.left is None else asdict(e.left),
        branch=None if e.branch is None or way is not None else e.branch.name.lower(),
        rivals=None if e.minima is None else Rivals(e.minima.tries, e.minima.above, str(e.minima)),
        quadrature=e.quadrature_error,
        nonconvex=e.nonconvex,
    )


def _whys(e: Equilibrium) -> dict[str, str]:
    """Why the shape's forces, or its lowest eigenvalue, are not known."""
    found = dict.fromkeys(("forces", "moments"), e.forces_why) if e.forces_why else {}
    if e.lowest_eigenvalue == math.inf:
        found["lowest_eigenvalue"] = "no freedom is left, so that nothing can be unstable"
    elif not math.isfinite(e.lowest_eigenvalue):
        found["lowest_eigenvalue"] = "the state was not judged"
    return found


def _parts(e: Equilibrium) -> dict[str, float]:
    """Parts of the elastic energy: bending and the natural term; with a free twist bending, membrane, shear."""
    if not e.has_free_twist:
        return {"bending": e.energy.bending, "natural": e.energy.natural}
    from ribbon.analysis.parts import parts

    return parts(e)


def _numbers(e: Equilibrium) -> dict[str, bool | float]:
    """Whether the energy knows the width; how steep the rulings are, or how large the twist is that is free of them."""
    if e.has_free_twist:
        return {"knows_width": knows_width(e.problem.energy), "max_abs_tau": float(np.abs(e.tau(_SAMPLES)).max())}
    return {
        "knows_width": knows_width(e.problem.energy),
        "max_abs_eta": float(e.max_abs_eta),
        "max_abs_eta_prime_w_half": float(e.max_abs_eta_prime_w_half),
    }


def _beyond_walls(e: Equilibrium) -> dict[str, float]:
    """How far the strip reaches beyond a wall, over l, where there are walls."""
    return {} if e.penetration is None else {"penetration": float(e.penetration)}


def knows_width(energy: str) -> bool:
    """Whether the width changes the ribbon's shape with this energy."""
    from ribbon.energies import ENERGIES, FREE_ENERGIES

    return ENERGIES[energy].knows_width if energy in ENERGIES else bool(FREE_ENERGIES[energy].needs)


def motions_of(e: Equilibrium) -> Motions | None:
    """The motions that nothing resists: rigid ones, and a free band's along itself."""
    problem: Any = e.problem
    translations, axes = problem.free_motions()
    if not len(translations) and not len(axes):
        return None
    held = [r for r in (problem.start_position, problem.end_position) if r is not None]
    seam = 0
    if problem.closure is not None and len(translations) == len(axes) == 3:
        seam = problem.closure.sign if even_along(values(problem.strip.curvature), problem.closure.sign) else 0
    mirror = bool(seam) and not any(values(problem.strip.curvature))
    return Motions(translations, axes, held[0] if held else None, seam, mirror)


def _supports(scene: Scene | None, e: Equilibrium) -> Supports:
    """Forces and moments of clamps and walls.

    The walls of a way that stopped before its last stage may be others than the scene's: they are then not listed. A
    wall without a name goes by its number, as in the keys of the scene.
    """
    end = e.end_support
    walls: tuple[Mapping[str, Any], ...] = ()
    if scene is not None and len(e.walls) == len(scene.barriers):
        walls = tuple(
            {
                "name": name,
                "force": found.force,
                "contacts": found.contacts,
                "lines": found.lines,
                "points": pushed(e, found.ends),
                "pushes": found.pushes,
                "mean_pressure": found.mean_pressure,
                "height": found.height,
                **({} if found.moment is None else {"moment": found.moment}),
                **friction.entry(found),
            }
            for name, found in zip(scene.barrier_names, e.walls, strict=True)
        )
    start = None if e.start is None else Force(e.start.force, e.start.moment)
    itself = None
    if scene is not None and scene.apart is not None:
        itself = between_parts((pair.s, pair.s_other, pair.force) for pair in e.pairs)
    return Supports(start, None if end is None else Force(end.force, end.moment), walls, itself)
