"""How far a shell would be from a strip with energy "finite", from that strip alone: what the energy leaves out.

Every neglected term that has a gradient (`ribbon.energies.section.dropped`, no constant is fitted) is added to the
energy for itself, and the strip goes where it pulls (`ribbon.find.drift`); bending in the strip's own plane is solved
with. The estimate is the sum of these distances (largest of any particle, over l), not their resultant. Beside them:

- section: at a held edge the shell is flat where the model's section is curved: its deflection there;
- corners: a strip held at two corners alone turns at its clamp, which no model of lines knows; how far is not known,
  and is told as the turn of the last length w / 2 at the curvature of the clamp.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from compare.measure.align import aligned
from compare.measure.grid import Grid
from compare.models.ribbon.build import relative_thickness
from compare.models.ribbon.state import motions_of

if TYPE_CHECKING:
    from compare.scene.scene import Scene
    from ribbon import Equilibrium

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Beyond:
    """Distances over l by cause; `unknown`: causes whose strip was not found (their distance is not in `parts`)."""

    parts: Mapping[str, float]
    unknown: tuple[str, ...] = ()

    @property
    def distance(self) -> float:
        """Their sum; infinite where one is not known."""
        return float("inf") if self.unknown else float(sum(self.parts.values()))


def beyond(scene: Scene, found: Equilibrium, grid: Grid) -> Beyond:
    """The estimate for a scene whose strip with energy "finite" is `found`."""
    from ribbon.energies.section.dropped import Dropped, terms
    from ribbon.find.drift import drifted

    thickness = relative_thickness(scene)
    assert thickness is not None, "the energy needs it"
    ends = held_ends(scene)
    corners = scene.shell.clamp == "corners"
    here = points(found, grid)
    parts: dict[str, float] = {}
    unknown = []
    for term in terms(found, thickness, () if corners else ends):
        moved = drifted(found, term.gradient)
        if moved is None:
            unknown.append(term.name)
            continue
        parts[term.name] = parts.get(term.name, 0.0) + _apart(here, moved, grid)
    bent = in_plane(found)
    if bent is None:
        unknown.append("in_plane")
    else:
        parts["in_plane"] = _apart(here, bent, grid)
    dropped = Dropped(scene.width, thickness, scene.strip.poisson)
    at = np.array(ends)
    if at.size:
        start, end = scene.curvature
        k, t = found.omega(at), found.tau(at)
        if corners:
            parts["corners"] = float(np.abs(k).max()) * 0.5 * scene.width
        else:
            parts["section"] = float(dropped.deflection(k, t, start + (end - start) * at).max())
    return Beyond(parts, tuple(unknown))


def held_ends(scene: Scene) -> tuple[float, ...]:
    """Abscissae of the clamps that hold a frame."""
    clamps = ((0.0, scene.clamp_start), (1.0, scene.clamp_end))
    return tuple(at for at, clamp in clamps if clamp is not None and clamp.tangent is not None)


def points(equilibrium: Equilibrium, grid: Grid) -> FloatArray:
    """Positions (k, m, 3) of the particles of a grid."""
    from compare.models.ribbon.state import RibbonShape

    return grid.of(RibbonShape(equilibrium))


def in_plane(found: Equilibrium) -> Equilibrium | None:
    """The same strip free to bend in its plane, beside `found`; None where it was not found."""
    from ribbon.find.solve import solve_from

    problem: Any = found.problem
    if problem.fields.count == 3:
        return found
    freed = problem.with_changes(in_plane=True)
    k, t = problem.joint_values(found.x)
    there = solve_from(freed, freed.state(k, t), check=False)
    return there if there.residual < 1e-6 else None


def _apart(here: FloatArray, moved: Equilibrium, grid: Grid) -> float:
    """Largest distance over l of a particle from where it was."""
    there = aligned(points(moved, grid), here, motions_of(moved))
    return float(np.linalg.norm(there - here, axis=-1).max())
