"""What every effect, on or off, changes of a ribbon's state, to first order: one tangent, one back-substitution each.

The other theory is asked at the state itself (`ribbon.sensitivity.theories`): which energy, weight or rest curvature
the strip would have instead, and which strains its theory holds at zero. Beside them stands what the energy `finite`
drops (`ribbon.energies.section.dropped`), what clamps do that no line knows (`compare.models.ribbon.neglected`), what
the elements do, and whether the strip comes near itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from compare.measure.nearness import nearest
from compare.models.base import natural_constant
from compare.models.capabilities import NotDifferentiable, Priced
from compare.models.ribbon.neglected import FOLD, beside, corner_turn, crowded, crowding, held_ends
from compare.models.ribbon.state import motions_of
from compare.scene.inputs.law import values
from ribbon import errors, law
from ribbon.energies import FREE_ENERGIES
from ribbon.energies.section.dropped import Dropped, terms
from ribbon.sensitivity import theories
from ribbon.sensitivity.parameters import Load
from ribbon.sensitivity.system import Point
from ribbon.sensitivity.theories import Response, Theory

if TYPE_CHECKING:
    from compare.models.base import State
    from compare.scene.scene import Scene
    from ribbon import Equilibrium

FloatArray = NDArray[np.float64]

#: Rest curvature K l whose move is told of a strip that is naturally flat, as Gamma is of one in any direction.
REST = 0.01
WIDTH, SADOWSKY, FINITE = "wunderlich", "sadowsky", "finite"
#: Names of effects that the scene's own list (`compare.models.effects.ribbon`) has too.
GRAVITY, SURFACE, TIP = "gravity", "gravity over the surface", "load at the tip"
NATURAL, FINITE_WIDTH = "natural curvature", "finite width (Wunderlich)"
THICKNESS, IN_PLANE = "finite thickness", "bending in the strip's plane"
STRETCHING, SHEAR, CURLING = "stretching", "transverse shear", "transverse opening (curling section)"
CROWDING = "rulings that crowd at a clamp's corner"
ITSELF, ELEMENTS = "contact with itself", "elements"
_TERMS = {
    "along": "twist of a changing section",
    "odd": "odd curling of a twisted section",
    "between": "section between soft and stiff",
    "clamp": "section held flat at a clamp (layer)",
}
_ALONG = np.linspace(0.0, 1.0, 121)
_ACROSS = np.array([-0.5, 0.0, 0.5])
#: Cells along and across on which a strip is looked at for contact with itself.
_ROWS, _COLUMNS = 161, 3
#: Elastic energy over the weight below which a strip is straight, and no share of it means anything.
_STRAIGHT = 1e-9
#: Move (l) that is rounding, and has nothing that would follow.
_ROUNDING = 1e-12
#: Part of a step by which the next one may be as long for the first to mean something.
_HOLDS = 0.5


#: Keys of the scene without an effect and with it.
Pair = tuple[Mapping[str, Any], Mapping[str, Any]]


def _with(keys: Mapping[str, Any]) -> Pair:
    """The scene as it is, and with these keys."""
    return {}, keys


@dataclass(frozen=True)
class _Row:
    """An effect that one theory tells: `load`, the work counts as its energy; constant: D w / l that the theory's
    energy has beside its own number."""

    effect: str
    on: bool
    theory: Theory
    why: str
    pair: Pair | None = None
    load: bool = False
    constant: float = 0.0


def prices(scene: Scene, state: State) -> tuple[Priced, ...]:
    """Every effect of a ribbon's state, in no order. Raises `NotDifferentiable` for a state without a tangent."""
    e: Equilibrium = state.native
    if e.before is not None:
        raise NotDifferentiable("how it lies depends on its way there, by friction")
    thickness = _thickness(scene)
    rows = [*_loads(scene, e), *_energies(scene, e, thickness), *_strains(scene, e, thickness)]
    rows += _dropped(scene, e, thickness)
    try:
        found = theories.responses(e, {row.effect: row.theory for row in rows}, unstable=state.stable is False)
    except errors.NotDifferentiable as refusal:
        raise NotDifferentiable(str(refusal)) from None
    told = [_told(scene, e, row, found[row.effect]) for row in rows]
    told += _missing(scene, thickness, {row.effect for row in rows})
    return (*told, *_clamps(scene, e, thickness), _itself(scene, e, thickness), _elements(state))


def _thickness(scene: Scene) -> float | None:
    """h / l: of the thickest shell, else the strip's own."""
    ratios = scene.shell.width_to_thickness
    return float(scene.width / min(ratios)) if ratios else scene.thickness


def _thick(scene: Scene) -> dict[str, Any]:
    """The key that leaves a scene with one thickness, where it has several."""
    ratios = scene.shell.width_to_thickness
    return {"shell.width_to_thickness": [float(min(ratios))]} if ratios else {}


# -- the theories -----------------------------------------------------------------------------------------------------


def _loads(scene: Scene, e: Equilibrium) -> list[_Row]:
    """Weight, over the surface too, what pulls at the end, rest curvature."""
    problem: Any = e.problem
    strip = problem.strip
    found = []
    if problem.has_gravity:
        found.append(_Row(GRAVITY, True, theories.towards(gravity=None), "without weight", load=True))
        if not problem.fields.free:
            exact = problem.gravity.exact
            other = theories.towards(gravity=replace(problem.gravity, exact=not exact))
            why = "along the centreline instead" if exact else "gravity.exact = true"
            found.append(_Row(SURFACE, exact, other, why, None if exact else _with({"gravity.exact": True}), load=True))
    if problem.tip is not None:
        found.append(_Row(TIP, True, theories.towards(tip=None), "without it", load=True))
    if any(values(scene.curvature)):
        flat = theories.towards(strip=replace(strip, natural_curvature=0.0))
        constant = -natural_constant(scene.curvature)
        found.append(_Row(NATURAL, True, flat, "naturally flat", constant=constant))
    else:
        bent = theories.towards(strip=replace(strip, natural_curvature=REST / strip.length))
        pair = _with({"strip.natural_curvature": REST / scene.strip.length})
        found.append(_Row(NATURAL, False, bent, f"as if K l were {REST:g}", pair, constant=0.5 * REST**2))
    if any(values(scene.twist)):
        found.append(_Row("natural twist", True, theories.towards(strip=replace(strip, natural_twist=0.0)), "without"))
    return found


def _energies(scene: Scene, e: Equilibrium, thickness: float | None) -> list[_Row]:
    """Finite width and thickness: the other energies on the state's own fields."""
    own = e.problem.energy
    free = own in FREE_ENERGIES
    found = []
    if own == WIDTH:
        found.append(_Row(FINITE_WIDTH, True, theories.towards(energy=SADOWSKY), "Sadowsky's energy instead"))
    elif not free:
        pair = _with({"model.energy": WIDTH})
        found.append(
            _Row(FINITE_WIDTH, False, theories.towards(energy=WIDTH), "Wunderlich's energy instead", pair)
        )  # fmt: skip
    if own != FINITE and thickness is not None and not scene.shaped:
        thick = {"model.energy": FINITE, "model.stiffness": None, **_thick(scene)}
        found.append(
            _Row(
                THICKNESS,
                False,
                theories.of_energy(FINITE, thickness),
                f"w/h = {scene.width / thickness:.3g}",
                _with(thick),
            )
        )
    if free and not scene.shaped:
        thin = {"model.energy": WIDTH, "model.in_plane": None, "model.stiffness": None}
        why = "Wunderlich's energy, without thickness, instead"
        if own == FINITE:
            found.append(_Row(THICKNESS, True, theories.of_energy(WIDTH, thickness), why, (thin, {})))
    return found


def _strains(scene: Scene, e: Equilibrium, thickness: float | None) -> list[_Row]:
    """Strains of the middle line that the theory may hold at zero."""
    if thickness is None:
        return []
    nu, w = scene.strip.poisson, scene.width
    bends = e.problem.fields.count == 3  # type: ignore[attr-defined]
    thick: dict[str, Any] = {"model.energy": FINITE, **_thick(scene)}
    own = e.problem.energy in FREE_ENERGIES
    free: Pair = ({"model.in_plane": False}, {}) if bends else _with({"model.in_plane": True})
    pair = free if own else ({**thick, "model.in_plane": False}, {**thick, "model.in_plane": True})
    soft = theories.softer
    return [
        _Row(IN_PLANE, bends, soft(theories.in_plane(thickness, nu, w)), "by the moment about the normal", pair),
        _Row(STRETCHING, False, soft(theories.stretching(thickness, nu)), "by the internal tension; a shell has it"),
        _Row(SHEAR, False, soft(theories.shear(thickness, nu)), "by the internal shear force; a shell has it"),
    ]


def _dropped(scene: Scene, e: Equilibrium, thickness: float | None) -> list[_Row]:
    """What even `finite` leaves out (`ribbon.energies.section.dropped`)."""
    if thickness is None or law.is_table(e.problem.strip.curvature):
        return []
    ends = () if scene.shell.clamp == "corners" else held_ends(scene)
    names = ["along", "odd", "between", *(["clamp"] if ends else [])]
    known: dict[str, Load] = {}
    return [_Row(_TERMS[name], False, _term(name, thickness, ends, known), "a shell has it") for name in names]


def _term(name: str, thickness: float, ends: tuple[float, ...], known: dict[str, Load]) -> Theory:
    """The theory with one term that `finite` drops (all of that name); its load is that of the state, on the way too.

    known: the loads of all names, filled by the first that is asked for.
    """

    def theory(here: Point) -> Load:
        if not known:
            given, chain = _as_twisted(here)
            found = terms(given, thickness, ends)
            for one in {term.name for term in found}:
                same = [term for term in found if term.name == one]
                local = sum(np.einsum("pi,pij->pj", term.gradient, chain) for term in same)
                known[one] = theories.by_parameters(here, sum(term.energy for term in same), np.asarray(local))
        return known[name]

    return theory


def _as_twisted(here: Point) -> tuple[Any, FloatArray]:
    """A state with what its terms are asked by, its segments' parameters in curvature and twist, and their derivatives
    (p, 4, 4) by its own: the twist eta omega is taken as linear between the joints."""
    problem = here.problem
    q = problem.parameters(here.x)[:, :4]
    chain = np.broadcast_to(np.eye(4), (len(q), 4, 4)).copy()
    if not problem.fields.free:
        a, b, n, m = q.T
        ell = problem.lengths
        chain[:, 2] = np.column_stack([m + n * ell, n, b + a * ell, a])
        chain[:, 3] = np.column_stack([np.zeros_like(m), m, np.zeros_like(m), b])
        q = np.column_stack([a, b, n * b + a * m + n * a * ell, m * b])
    return SimpleNamespace(problem=problem, parameters=q), chain


# -- what is told of them ---------------------------------------------------------------------------------------------


def _told(scene: Scene, e: Equilibrium, row: _Row, response: Response | errors.NotDifferentiable) -> Priced:
    if isinstance(response, errors.NotDifferentiable):
        return Priced(row.effect, row.on, None, why=response.message, pair=row.pair)
    moves = _moves(scene, e, response.position(_ALONG), response.rotation(_ALONG))
    error = _beyond(scene, e, response, moves)
    whole = float(e.energy.elastic) + natural_constant(scene.curvature)
    held = response.work if row.load else abs(response.energy + row.constant)
    force, share = _force(e, response)
    energy = held / whole if whole > _STRAIGHT * scene.gamma else None
    energy, why = (energy, row.why) if row.load else _of_whole(energy, row.why)
    return Priced(row.effect, row.on, moves, error, energy, force, share, why, row.pair, doubtful=error is None)


def _of_whole(energy: float | None, why: str) -> tuple[float | None, str]:
    """The share of the elastic energy that a term holds, None above one: a strip all but in its rest shape has next to
    no elastic energy, of which what makes that shape is no share."""
    if energy is None or energy <= 1.0:
        return energy, why
    return None, f"{why}: {energy:.2g} times the elastic energy of this state, of which it is no share"


def _beyond(scene: Scene, e: Equilibrium, response: Response, moves: float) -> float | None:
    """How far first order may be off (l); None where the step that would follow is as long, or has no tangent."""
    if moves <= _ROUNDING:
        return moves
    if response.beyond is None:
        return None
    name = response.name
    step = _moves(scene, e, response.beyond.position(_ALONG)[name], response.beyond.rotation(_ALONG)[name])
    # the steps that would follow fall off as this one does: twice their sum
    return 2.0 * step / (1.0 - step / moves) if step < _HOLDS * moves else None


def _moves(scene: Scene, e: Equilibrium, moved: FloatArray, turned: FloatArray) -> float:
    """Largest distance that a particle of the middle line and both edges moves, sections taken as straight, without
    motions that nothing resists."""
    across = scene.width * e.frame(_ALONG)[:, :, 0]
    shift = moved[:, None] + _ACROSS[:, None] * np.cross(turned, across)[:, None]
    still = _motions(e, e.position(_ALONG)[:, None] + _ACROSS[:, None] * across[:, None])
    if len(still):
        share = np.linalg.lstsq(still.reshape(len(still), -1).T, shift.ravel(), rcond=None)[0]
        shift = shift - np.einsum("i,i...->...", share, still)
    return float(np.linalg.norm(shift, axis=-1).max())


def _motions(e: Equilibrium, lines: FloatArray) -> FloatArray:
    """Fields (i, k, 3, 3) on the middle line and edges (k, 3, 3) of the small motions that nothing resists."""
    motions = motions_of(e)
    if motions is None:
        return np.empty((0, *lines.shape))
    pivot = np.zeros(3) if motions.pivot is None else motions.pivot
    found = [np.broadcast_to(axis, lines.shape) for axis in motions.translations]
    found += [np.cross(axis, lines - pivot) for axis in motions.axes]
    if motions.seam:
        found.append(np.gradient(lines, _ALONG, axis=0))
    return np.array(found)


def _force(e: Equilibrium, response: Response) -> tuple[float | None, float | None]:
    """Change of the force (D w / l^2) of what holds the end, or the start, and its share in that."""
    if e.forces_why:
        return None, None
    end = e.end_support is not None
    support = e.end_support if end else e.start
    if support is None:
        return None, None
    force = float(np.linalg.norm(response.support(end)))
    own = float(np.linalg.norm(support.force))
    return force, force / own if own > 0.0 else None


def _missing(scene: Scene, thickness: float | None, told: set[str]) -> list[Priced]:
    """Effects that nothing here can tell of, and why."""
    why = {
        GRAVITY: "the scene has no [gravity]",
        SURFACE: "no weight" if not scene.gamma else "sections square to the centreline have their middle on it",
        TIP: "the scene has no [tip]",
    }
    if thickness is None:
        none = "the scene has no thickness"
        why |= dict.fromkeys((THICKNESS, IN_PLANE, STRETCHING, SHEAR, CURLING), none)
    return [Priced(name, False, None, why=text) for name, text in why.items() if name not in told]


def _clamps(scene: Scene, e: Equilibrium, thickness: float | None) -> list[Priced]:
    """The section's own shape, and what held edges and corners do, which no line knows: distances, no loads."""
    if thickness is None:
        return []
    dropped = Dropped(scene.width, thickness, scene.strip.poisson)
    curl = dropped.deflection(e.omega(_ALONG), e.tau(_ALONG), law.at(e.problem.strip.curvature, _ALONG))
    on = e.problem.energy in (FINITE, "extensible")
    why = "how far its edges stand from a straight section" + ("" if on else "; the sections are straight here")
    found = [Priced(CURLING, on, float(curl.max()), why=why)]
    ends = held_ends(scene)
    if not ends:
        return found
    if scene.shell.clamp == "corners":
        turn = corner_turn(scene, e, ends)
        return [*found, Priced("corners held alone", False, turn, why="fitted to shells; a shell has it")]
    told = e if on else beside(scene, e)  # rulings of a strip without thickness crowd more than a shell's
    bent = e if told is None or not told.ok else told
    given = SimpleNamespace(problem=bent.problem, parameters=_as_twisted_of(bent))
    fold = FOLD * scene.width * crowding(crowded(given, dropped, ends))  # type: ignore[arg-type]
    return [
        *found,
        Priced(CROWDING, False, fold, why="fitted to shells; a shell has it"),
    ]


def _as_twisted_of(e: Equilibrium) -> FloatArray:
    """Parameters (p, 4) in curvature and twist of a state as it was solved."""
    q = e.parameters[:, :4]
    if e.has_free_twist:
        return np.asarray(q)
    a, b, n, m = q.T
    return np.column_stack([a, b, n * b + a * m + n * a * e.problem.lengths, m * b])


def _itself(scene: Scene, e: Equilibrium, thickness: float | None) -> Priced:
    """Whether the strip comes near itself; what contact would move is not known to any model here."""
    s = np.linspace(0.0, 1.0, _ROWS)
    frames, half = e.frame(s), 0.5 * scene.width
    lines = e.position(s)[:, None] + np.linspace(-half, half, _COLUMNS)[:, None] * frames[:, None, :, 0]
    found = nearest(lines, s, scene.closure is not None)
    if found is None:
        return Priced(ITSELF, False, 0.0, why="no turn comes near another")
    first, last = found.s
    where = f"s = {first:.2f} l and {last:.2f} l"
    if scene.apart is not None:
        touching = len(e.pairs)
        why = f"kept {scene.apart:.2g} l apart, {touching} pairs touch; nearest {where}, gap {found.gap:.2g} l"
        return Priced(ITSELF, True, None if touching else 0.0, why=why)
    if found.crosses:
        why = (
            f"this shape crosses itself at s = {first:.2f}, s' = {last:.2f} (over l): add [contact] with itself = true"
        )
        return Priced(ITSELF, False, None, why=why)
    touches = thickness is not None and found.gap < thickness
    if touches:
        return Priced(ITSELF, False, None, why=f"it would touch itself, {where}, gap {found.gap:.2g} l")
    return Priced(ITSELF, False, 0.0, why=f"nearest {where}, gap {found.gap:.2g} l")


def _elements(state: State) -> Priced:
    """What finer elements would move."""
    why = (
        f"{state.size.label} of them; moved by finer ones"
        if state.error is not None
        else state.error_why or "not asked for"
    )
    return Priced(ELEMENTS, True, state.error, why=why)
