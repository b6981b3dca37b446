"""The record of a state: what result.json of every model holds, and the columns that a table of states has of it.

What one model adds stands with the model (`own_of`).
"""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from compare.measure.error import error_of_first
from compare.measure.numbers import ALONE, errors_of, nested, numbers_of
from compare.models import model
from compare.models.base import Pose, State, Supports
from compare.models.quantities import Answered, Declares, walls_of
from compare.page.remedies import message
from compare.record.quantity import ABSENT, DATA, Part, Quantity
from compare.scene.data import SceneData
from compare.store.made_by import provenance

FORCE, MOMENT, ENERGY = "D w / l^2", "moment", "D w / l"
NUMBER = "digits:5"
_ENDS = {"start": "that the clamp at s = 0 exerts on the strip", "end": "that the clamp at s = l exerts on the strip"}


def vector(path: str, name: str, note: str = "") -> tuple[Part, ...]:
    """The components of a vector inside a quantity as columns NAME.x, NAME.y, NAME.z."""
    return tuple(Part(f"{path}.{axis}", f"{name}.{axis}", note=note if axis == "x" else "") for axis in "xyz")


def _supports(kind: str) -> tuple[Part, ...]:
    return tuple(part for end, note in _ENDS.items() for part in vector(end, f"{kind}.{end}", note))


def _ends(kind: str, note: str) -> tuple[Part, ...]:
    return Part("start", f"{kind}.start", note=note), Part("end", f"{kind}.end")


def _pose(state: State, pose: Pose | None) -> dict[str, Any] | None:
    known = pose is not None and state.is_equilibrium
    return {"position": pose.position, "frame": pose.frame} if known else None  # type: ignore[union-attr]


def _held(state: State) -> Supports:
    return state.supports if state.is_equilibrium else Supports()


def _forces(state: State) -> dict[str, Any]:
    """Forces that clamps and walls exert on the strip; None at an end that nothing holds."""
    held = _held(state)
    ends = {name: None if found is None else found.force for name, found in (("start", held.start), ("end", held.end))}
    return {**ends, "walls": [wall["force"] for wall in held.walls]}


def _moments(state: State) -> dict[str, Any]:
    held = _held(state)
    return {name: None if found is None else found.moment for name, found in (("start", held.start), ("end", held.end))}


def _errors(state: State) -> dict[str, Any]:
    """The errors of the numbers of a state, nested as these are, None where one is not known; of an end that nothing
    holds None, as its force is."""
    if not state.is_equilibrium:
        return nested({})
    return dict(state.errors) or errors_of([numbers_of(state)], error_of_first)


def _crossings(answered: Answered) -> Any:
    """Where the surface passes through itself: pairs of particles (s, v) at one place, over l; None: not known."""
    state = answered.state
    found = state.crossing(answered.scene.width) if state.is_equilibrium else None
    if found is None or (found.within is not None and not found.places):
        return None
    return [[[place.s, place.v], [place.s_other, place.v_other]] for place in found.places]


def _why(state: State, key: str) -> Any:
    return state.whys.get(key, ABSENT) if state.is_equilibrium else ABSENT


def _units(scene: SceneData) -> dict[str, Any]:
    units = scene.units
    return {**units.to_dict(), "known": units.known}


def _error_of(name: str, unit: str) -> Quantity[Answered]:
    """The error of a number that stands by itself (`compare.measure.numbers.ALONE`)."""
    kind = NUMBER if name == "lowest_eigenvalue" else DATA
    return Quantity(f"{name}_error", unit=unit, kind=kind, of=lambda a: _errors(a.state).get(name, ABSENT))


#: What a scene's numbers are made dimensionless with: what a unit is in SI, l in the scene's own unit, D in N m, and
#: the groups (w/h None: no thickness).
DIMENSIONS: tuple[Quantity[SceneData], ...] = (
    Quantity("units", kind=DATA, of=_units),
    Quantity("length", kind=DATA, of=lambda s: s.strip.length),
    Quantity("D", kind=DATA, of=lambda s: s.units.bending),
    Quantity("gamma", kind=DATA, of=lambda s: s.gamma),
    Quantity("width_to_thickness", kind=DATA,
             of=lambda s: None if s.strip.thickness is None else s.strip.width / s.strip.thickness),
    Quantity("width_to_length", kind=DATA, of=lambda s: s.width),
    Quantity("tip_force", unit=FORCE, kind=DATA, of=lambda s: ABSENT if s.tip is None else s.tip_force.tolist()),
)  # fmt: skip
#: The errors of what is told of a state, each in the unit of its number and nested as that is.
ERRORS: tuple[Quantity[Answered], ...] = (
    Quantity("forces_error", unit=FORCE, kind=NUMBER,
             parts=_ends("force_error", "of the force there, by its own change on other elements, with `--errors`"),
             of=lambda a: _errors(a.state)["forces"]),
    Quantity("moments_error", unit=MOMENT, kind=NUMBER, parts=_ends("moment_error", ""),
             of=lambda a: _errors(a.state)["moments"]),
    Quantity("energy_error", unit=ENERGY, kind=NUMBER, parts=("elastic", "total"),
             of=lambda a: _errors(a.state)["energy"]),
    *(_error_of(name, "1/l" if name == "max_abs_tau" else "") for name in ALONE),
    Quantity("errors_why", kind=DATA, of=lambda a: a.state.error_why or "not asked for"),
)  # fmt: skip
STATE: tuple[Quantity[Answered], ...] = (
    Quantity("scene", kind=DATA, of=lambda a: a.scene.name),
    Quantity("title", kind=DATA, of=lambda a: a.scene.title),
    Quantity("status", kind="word", note="of the case", of=lambda a: a.state.word),
    Quantity("message", kind=DATA, of=lambda a: message(a.state)),
    Quantity("stable", kind="truth", note="empty: not known", of=lambda a: a.state.stable),
    Quantity("lowest_eigenvalue", kind=NUMBER, note="on the tangent of the active constraints",
             of=lambda a: a.state.lowest_eigenvalue),
    Quantity("residual", kind=NUMBER, note="of the solver", of=lambda a: a.state.residual),
    Quantity("iterations", kind="integer", of=lambda a: a.state.iterations),
    Quantity("energy", unit=ENERGY, kind=NUMBER,
             of=lambda a: None if a.state.energy is None else a.state.energy.to_dict(),
             parts=("bending", "membrane", "shear", "elastic", "gravity",
                    Part("tip", note="of a load at the tip, where there is one"),
                    Part("plates", note="of the springs of pressure plates, where there are any"), "total")),
    Quantity("end", unit="l", kind=NUMBER, parts=vector("position", "end"), of=lambda a: _pose(a.state, a.state.end)),
    Quantity("middle", unit="l", kind=NUMBER, parts=vector("position", "middle"),
             of=lambda a: _pose(a.state, a.state.middle)),
    Quantity("crossings", unit="l", kind=DATA, of=_crossings),
    Quantity("max_abs_eta", kind=NUMBER, note="steepest ruling, of energies with rulings",
             of=lambda a: a.state.numbers.get("max_abs_eta")),
    Quantity("max_abs_eta_prime_w_half", kind=DATA, of=lambda a: a.state.numbers.get("max_abs_eta_prime_w_half")),
    Quantity("max_abs_tau", unit="1/l", kind=NUMBER, note="largest twist, of energies whose twist is free",
             of=lambda a: a.state.numbers.get("max_abs_tau", ABSENT)),
    Quantity("forces", unit=FORCE, kind=NUMBER, parts=_supports("force"), of=lambda a: _forces(a.state)),
    Quantity("moments", unit=MOMENT, kind=NUMBER, parts=_supports("moment"), of=lambda a: _moments(a.state)),
    Quantity("walls", kind=DATA, of=lambda a: walls_of(a.state) or ABSENT),
    *ERRORS,
    Quantity("forces_why", kind="word", note="why the forces are not determined, where they are not",
             of=lambda a: _why(a.state, "forces")),
    Quantity("moments_why", kind=DATA, of=lambda a: _why(a.state, "moments")),
    Quantity("lowest_eigenvalue_why", kind=DATA, of=lambda a: _why(a.state, "lowest_eigenvalue")),
    Quantity("discretisation_error", unit="l", kind=NUMBER, name="error", note="of the discretisation, with `--errors`",
             of=lambda a: a.state.error),
    Quantity("discretisation_error_why", kind=DATA,
             of=lambda a: a.state.error_why or ("it was not asked for" if a.state.error is None else "")),
    Quantity("refinements", kind=DATA, of=lambda a: [asdict(one) for one in a.state.refinements]),
    Quantity("seconds.first", unit="s", kind=DATA, of=lambda a: a.state.seconds.first),
    Quantity("seconds.warm", unit="s", kind=DATA, of=lambda a: a.state.seconds.warm),
    Quantity("model.energy", kind=DATA, of=lambda a: a.scene.model.energy),
    Quantity("model.formulation", kind=DATA, of=lambda a: a.state.size.ladder),
    Quantity("model.elements", kind=DATA, of=lambda a: a.state.numbers.get("segments", a.state.size.label)),
    Quantity("model.unknowns", kind=DATA, of=lambda a: a.state.unknowns),
    Quantity("start", kind=DATA, of=lambda a: a.state.start),
    Quantity("branch", kind="word", name="side", note="to its seed: `own`, `slid`, `left` (two clamps with a `[seed]`)",
             of=lambda a: a.state.branch),
    Quantity("left_saddle", kind=NUMBER,
             parts=(Part("above", "left_saddle", unit=ENERGY,
                         note="energy of the saddle that was left for the state, above it; empty: none was"),),
             of=lambda a: a.state.left_saddle),
    *(quantity.about(lambda a: a.scene) for quantity in DIMENSIONS),
    Quantity("provenance", kind=DATA, of=lambda a: provenance(a.scene)),
)  # fmt: skip


def own_of(name: str) -> tuple[Quantity[Answered], ...]:
    """What the model of this name adds to the record of a state."""
    found = model(name)
    return found.quantities if isinstance(found, Declares) else ()
