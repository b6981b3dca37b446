"""How far a shell would be from a strip with energy "finite", from that strip alone: what the energy leaves out.

Every neglected term that has a gradient (`ribbon.energies.section.dropped`, no constant is fitted) is added to the
energy for itself, and the strip goes where it pulls, to first order (`ribbon.sensitivity.pulled`); bending in the
strip's own plane likewise. Beside them, at held ends:

- section: where the edge is held the shell is flat, the model's section is curved: its deflection there;
- fold: rulings that crowd in a corner of a held edge let the shell turn about its own axis by more than the model; how
  far is FOLD w x / (1 - x), x = |eta'| w / 2 near the clamp, FOLD fitted to shells;
- corners: a strip held at two corners alone turns at its clamp, which no model of lines knows; by how much is fitted to
  the same shells: the smaller of CORNER_TURN[0] kappa l and CORNER_TURN[1], times w.

The estimate is the sum of these distances (largest of any particle, over l), not their resultant. Of its energy it may
be wrong where the curvature passes zero: `passages`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from compare.measure.align import aligned
from compare.measure.distance import grid_hausdorff
from compare.measure.grid import Grid
from compare.models.ribbon.build import relative_thickness, ribbon_arguments, ribbon_problem
from compare.models.ribbon.free import FINITE
from compare.models.ribbon.state import motions_of
from compare.scene.inputs import law

if TYPE_CHECKING:
    from compare.scene.scene import Scene
    from ribbon import Equilibrium
    from ribbon.energies.section.dropped import Dropped

FloatArray = NDArray[np.float64]

#: Fitted to shells of section 7.3 and to the scenes of results/auto, on the side of caution: so large that none of
#: those was judged near enough that is not (with 2.7e-3 and 0.1, found on 7.3 alone, three of 119 were).
FOLD = 4.2e-3
CORNER_TURN = (0.12, 0.6)
#: Closest that x is taken to 1.
_NEAREST = 0.02
IN_PLANE = "in_plane"
#: The energy that has `finite`'s section, and none of its terms of what varies along the strip.
PLAIN = "extensible"
_SAMPLES = np.linspace(0.0, 1.0, 2001)
#: Points of a mean along the strip.
_POINTS = (np.arange(8000) + 0.5) / 8000
_ALONG = np.linspace(0.0, 1.0, 401)


@dataclass(frozen=True)
class Beyond:
    """Distances over l by cause; `unknown`: causes whose strip was not found (their distance is not in `parts`)."""

    parts: Mapping[str, float]
    unknown: tuple[str, ...] = ()

    @property
    def distance(self) -> float:
        """Their sum; infinite where one is not known."""
        return self.behind(0.0)

    def behind(self, moved: float) -> float:
        """Distance to the shell of a strip that is `moved` (over l) away from the one with energy "finite"; corners
        that turn the strip hide what is smaller."""
        if self.unknown:
            return float("inf")
        turned = self.parts.get("corners", 0.0)
        return max(moved, turned) + float(sum(self.parts.values())) - turned


def beyond(scene: Scene, equilibrium: Equilibrium) -> Beyond:
    """The estimate for a scene whose strip with energy "finite" is `equilibrium`."""
    from ribbon.energies.section.dropped import Dropped, terms
    from ribbon.errors import NotDifferentiable
    from ribbon.sensitivity.pulled import pulled

    thickness = relative_thickness(scene)
    assert thickness is not None, "the energy needs it"
    ends = held_ends(scene)
    corners = scene.shell.clamp == "corners"
    parts: dict[str, float] = {}
    neglected = terms(equilibrium, thickness, () if corners else ends)
    try:
        there = pulled(equilibrium, [term.gradient for term in neglected])
    except NotDifferentiable:
        return Beyond({}, tuple(dict.fromkeys([*(term.name for term in neglected), IN_PLANE])))
    here = _lines(equilibrium, scene.width)
    for term, moved in zip(neglected, there.terms, strict=True):
        parts[term.name] = parts.get(term.name, 0.0) + _apart(here, moved, scene.width)
    bends = equilibrium.problem.fields.count == 3
    parts[IN_PLANE] = 0.0 if bends else _apart(here, there.in_plane, scene.width)
    dropped = Dropped(scene.width, thickness, scene.strip.poisson)
    at = np.array(ends)
    if at.size:
        k, t = equilibrium.omega(at), equilibrium.tau(at)
        if corners:
            parts["corners"] = corner_turn(scene, equilibrium, ends)
        else:
            parts["section"] = float(dropped.deflection(k, t, law.at(scene.curvature, at)).max())
            parts["fold"] = FOLD * scene.width * crowding(crowded(equilibrium, dropped, ends))
    return Beyond(parts)


def passages(scene: Scene, equilibrium: Equilibrium) -> float:
    """Energy (D w / l) that a strip with energy "finite" has beyond `extensible` where its curvature passes zero.

    Two ways lead a twisted strip through zero curvature (docs/theory.md, chapter 10): it bends where rulings crowd, as
    the developable strip, or keeps its twist, is no developable surface, and stretches. Which one a shell takes this
    energy does not decide; but as bending is open to the shell too, it stretches by no more than the bending that it
    saves. Counted within w of every such place (rulings crowd over lengths that go with w), without what is within w/2
    of a held end, whose crowding the clamps have.
    """
    width, lengths = scene.width, equilibrium.problem.lengths
    joints = np.concatenate([[0.0], np.cumsum(lengths)])
    omega, _ = equilibrium.problem.joint_values(equilibrium.x)
    at = np.flatnonzero(omega[1:] * omega[:-1] < 0.0)
    if not at.size:
        return 0.0
    places = joints[at] + lengths[at] * omega[at] / (omega[at] - omega[at + 1])
    near = np.any(np.abs(_POINTS[:, None] - places) < width, axis=1)
    for end in held_ends(scene):
        near &= np.abs(_POINTS - end) >= 0.5 * width
    return _bent_sharply(scene, equilibrium, near)


def crowded_energy(scene: Scene, equilibrium: Equilibrium) -> float:
    """Energy (D w / l) that a strip with energy "finite" has beyond `extensible` within w/2 of its held edges.

    There its rulings crowd, and what the shell does about it is estimated by a formula that has a pole where they meet.
    By the argument of `passages` it stretches by no more than this. 0 where corners are held: their rulings are free.
    """
    ends = () if scene.shell.clamp == "corners" else held_ends(scene)
    near = np.zeros(_POINTS.size, dtype=bool)
    for end in ends:
        near |= np.abs(_POINTS - end) < 0.5 * scene.width
    return _bent_sharply(scene, equilibrium, near)


def _bent_sharply(scene: Scene, equilibrium: Equilibrium, near: NDArray[np.bool_]) -> float:
    """Energy (D w / l) that a strip with energy "finite" has beyond `extensible` on the points `near`."""
    from ribbon.analysis.parts import line_density, line_density_of

    thickness = relative_thickness(scene)
    assert thickness is not None, "the energy needs it"
    s = _POINTS[near]
    more = line_density(equilibrium, s) - line_density_of(PLAIN, equilibrium, s, thickness)
    return max(float(more.sum()) / _POINTS.size, 0.0)


def crowded(equilibrium: Equilibrium, dropped: Dropped, ends: tuple[float, ...]) -> float:
    """Largest |eta'| w / 2 at the middles of segments within w of the held ends (0 without any)."""
    lengths, q = equilibrium.problem.lengths, equilibrium.parameters
    s = np.cumsum(lengths) - 0.5 * lengths
    near = np.any([np.abs(s - end) < dropped.width for end in ends], axis=0)
    k, t = (q[:, i] * 0.5 * lengths + q[:, i + 1] for i in (0, 2))
    return float(np.abs(dropped.crossing(k, t, q[:, 0], q[:, 2]))[near].max(initial=0.0))


def crowding(steep: float) -> float:
    """x / (1 - x) of x = |eta'| w / 2."""
    return steep / max(1.0 - steep, _NEAREST)


def corner_turn(scene: Scene, equilibrium: Equilibrium, ends: tuple[float, ...]) -> float:
    """How far (over l) two held corners let a strip turn at its clamps."""
    bent = float(np.abs(equilibrium.omega(np.array(ends))).max(initial=0.0))
    return min(CORNER_TURN[0] * bent, CORNER_TURN[1]) * scene.width


def beside(scene: Scene, equilibrium: Equilibrium, ratio: float | None = None) -> Equilibrium | None:
    """The strip with energy "finite" on the segments of another strip of the scene, from its shape where it lies;
    ratio: w/h, None: the scene's own thickness. None where the scene has no such strip.

    A curvature that has jumped through zero on the way may be held by its elements: then the scene's own seed is tried
    too, and the lower one kept; not where the seed is none (parts that are kept apart go through each other there).
    """
    from ribbon import solve
    from ribbon.errors import RibbonInputError
    from ribbon.find.continuation import anchored
    from ribbon.find.solve import solve_from
    from ribbonbench.errors import BadInput

    own = thin(scene, ratio)
    try:
        problem: Any = ribbon_problem(own, _form(own)).with_changes(lengths=equilibrium.problem.lengths)
    except (BadInput, RibbonInputError):
        return None
    problem = anchored(problem, equilibrium)
    omega, eta = equilibrium.problem.joint_values(equilibrium.x)
    twist = eta if equilibrium.problem.fields.free else eta * omega
    there = _lain(problem, problem.state(omega, twist), equilibrium)
    there = there or solve_from(problem, problem.state(omega, twist), leave_saddle=True)
    if there.ok and inflections(there) <= inflections(equilibrium):
        return there
    keys = {"segments": equilibrium.problem.lengths, "formulation": _form(own), "leave_saddle": True}
    try:
        again = solve(**{**ribbon_arguments(own), **keys})
    except RibbonInputError:  # at rest a curl goes through itself: there is no beginning but the other strip's shape
        return there
    better = again.ok and not (there.ok and there.energy.total <= again.energy.total)
    return again if better else there


def _lain(problem: Any, x: FloatArray, other: Equilibrium) -> Equilibrium | None:
    """The state whose layers lie on each other in a plane as another one's do, from x (n,); None: that one has none, or
    none are found. A search in space that knows of no plane takes minutes there."""
    from ribbon.find.layers import plane
    from ribbon.find.solving.request import How
    from ribbon.find.solving.verdict import judged
    from ribbon.problems.mixed import MixedProblem

    if not isinstance(other.problem, MixedProblem) or not plane.is_layered(other.problem, other.x):
        return None
    lain = plane.lain(problem, x)
    return None if lain is None else judged(*lain, How(leave_saddle=True))


def _form(scene: Scene) -> str:
    """The formulation of a strip that is begun at another one's shape: chained where that serves (it costs a fourth),
    but not along a path, nor under a weight that rounds its forces."""
    from ribbon.find.adaptive import HEAVY

    return "mixed" if scene.path or scene.gamma > HEAVY else "auto"


def inflections(equilibrium: Equilibrium) -> int:
    """How often the curvature at the joints changes its sign."""
    signs = np.sign(equilibrium.problem.joint_values(equilibrium.x)[0])
    return int(np.count_nonzero(np.diff(signs[signs != 0.0])))


def thin(scene: Scene, ratio: float | None = None) -> Scene:
    """The scene with energy "finite" and one thickness; itself where it is that already."""
    model = scene.model
    own = ratio is None or tuple(scene.shell.width_to_thickness) == (ratio,)
    if own and (model.energy, model.accuracy, model.stiffness) == (FINITE, None, None):
        return scene
    keys: dict[str, Any] = {"model.energy": FINITE, "model.accuracy": None, "model.stiffness": None}
    if ratio is not None:
        keys["shell.width_to_thickness"] = [ratio]
    return scene.replace(keys)


def held_ends(scene: Scene) -> tuple[float, ...]:
    """Abscissae of the clamps that hold a frame."""
    clamps = ((0.0, scene.clamp_start), (1.0, scene.clamp_end))
    return tuple(at for at, clamp in clamps if clamp is not None and clamp.tangent is not None)


def points(equilibrium: Equilibrium, grid: Grid) -> FloatArray:
    """Positions (k, m, 3) of the particles of a grid."""
    from compare.models.ribbon.state import RibbonShape

    return grid.of(RibbonShape(equilibrium))


def apart(equilibrium: Equilibrium, best: Equilibrium, grid: Grid) -> float:
    """Hausdorff distance over l of two strips, one moved as its free motions allow."""
    there = points(best, grid)
    return grid_hausdorff(aligned(points(equilibrium, grid), there, motions_of(equilibrium)), there)


def grid_of(scene: Scene, best: Equilibrium) -> Grid:
    """The particles on which a strip of the scene is compared with `best`."""
    return Grid.for_shape(scene, float(np.abs(best.omega(_SAMPLES)).max()))


def to_shell(
    scene: Scene,
    equilibrium: Equilibrium,
    best: Equilibrium | None,
    ratio: float | None = None,
    seen: Mapping[int, float] | None = None,
) -> float | None:
    """Estimated distance over l of a strip `equilibrium` to the shell, by way of `best`, its neighbour with energy
    "finite" (`beside`); None where there is none, or what it leaves out could not be told. seen: what is known of the
    distance to `best` by its id (`compare.models.ribbon.rivals.either_side`)."""
    if best is None or not best.ok:
        return None
    moved = 0.0 if equilibrium is best else (seen or {}).get(id(best))
    if moved is None:
        moved = apart(equilibrium, best, grid_of(scene, best))
    distance = beyond(thin(scene, ratio), best).behind(moved)
    return distance if math.isfinite(distance) else None


def _lines(equilibrium: Equilibrium, width: float) -> FloatArray:
    """Particles (k, 3, 3) of the middle line and both edges, the sections taken as straight."""
    r, frames, _, _ = equilibrium.continued(_ALONG)
    across = 0.5 * width * frames[:, :, 0]
    return np.stack([r - across, r, r + across], axis=1)


def _apart(here: FloatArray, there: Equilibrium, width: float) -> float:
    """Largest distance over l of a strip's `_lines` from some (k, 3, 3)."""
    moved = aligned(_lines(there, width), here, motions_of(there))
    return float(np.linalg.norm(moved - here, axis=-1).max())
