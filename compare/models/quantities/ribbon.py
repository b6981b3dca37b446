"""What a ribbon's result holds beside that of every model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from typing import Any

from compare.models.quantities import Answered, walls_of
from compare.record.quantity import ABSENT, DATA, Quantity
from compare.store.made_by import provenance

#: What solves the linear systems of each minimiser.
LINEAR_SOLVERS = {
    "Ipopt": "MUMPS (sequential, in Ipopt)", "Newton": "L D L^T along the strip", "Newton, dense": "LAPACK, dense",
    "none": "none: the state was known",
}  # fmt: skip


def _why(a: Answered) -> str:
    from compare.models.ribbon.build import formulation_why

    return formulation_why(a.scene, a.state.native.problem.formulation)


def _made(a: Answered) -> dict[str, Any]:
    e = a.state.native
    return {**provenance(a.scene, e.options), "solver": e.solver, "linear_solver": LINEAR_SOLVERS[e.solver]}


def _minima(a: Answered) -> Any:
    found = a.state.native.minima
    return None if found is None else {**asdict(found), "lowest": found.lowest}


def _contacts(a: Answered) -> Any:
    """Where parts of the strip that are kept apart touch: both particles (s, v), over l, the force on the first and the
    distance; of a scene that keeps them."""
    return ABSENT if a.scene.apart is None else [asdict(pair) for pair in a.state.native.pairs]


def _touches(name: str) -> Callable[[Answered], Any]:
    """A number of `compare.models.drawn.touches`."""

    def of(a: Answered) -> Any:
        from compare.models.drawn import touches

        return getattr(touches, name)(a.scene, a.state)

    return of


def _taut(a: Answered, name: str) -> Any:
    """Of a straight strip whose forces are not determined: what its tension and sag would be (`taut`)."""
    from compare.models.ribbon.taut import taut

    if not a.state.native.forces_why:
        return ABSENT
    found = taut(a.scene)
    return None if found is None else getattr(found, name)


def _stretching(a: Answered, name: str) -> Any:
    """Of a strip with free twist: the parts' shares of its energy, and where it stretches."""
    from compare.models.ribbon.fields import stretching

    if not a.state.native.has_free_twist:
        return ABSENT
    found = stretching(a.scene, a.state) if a.state.is_equilibrium else None
    return None if found is None else getattr(found, name)


def _along(of: Callable[[Answered], Any]) -> Callable[[Answered], Any]:
    """Of a scene with a path; `ABSENT` of another."""
    return lambda a: of(a) if a.scene.path else ABSENT


def _accepted(a: Answered) -> int:
    return sum(bool(entry["accepted"]) for entry in a.state.log)


#: The steps of a way; `log` has one entry for each of them, the rejected ones too.
PATH: tuple[Quantity[Answered], ...] = (
    Quantity("path.stages", kind=DATA, of=_along(lambda a: len(a.scene.path) + 1)),
    Quantity("path.steps", kind=DATA, of=_along(_accepted)),
    Quantity("path.rejected", kind=DATA, of=_along(lambda a: len(a.state.log) - _accepted(a))),
    Quantity("path.jumps", kind=DATA, of=_along(lambda a: sum(bool(e["accepted"] and e["jump"]) for e in a.state.log))),
    Quantity("path.resumed", kind=DATA, of=_along(lambda a: a.state.reused)),
    Quantity(
        "path.friction_lost",
        unit="D w / l",
        kind=DATA,
        note="work that friction took away along the path",
        of=_along(lambda a: ABSENT if a.state.native.rubbed is None else a.state.native.rubbed),
    ),
    Quantity("path.log", kind=DATA, of=_along(lambda a: a.state.log)),
)
QUANTITIES: tuple[Quantity[Answered], ...] = (
    Quantity("evaluations", kind=DATA, of=lambda a: a.state.native.evaluations),
    Quantity("unstable_modes", kind=DATA, note="negative eigenvalues of the second variation, by inertia",
             of=lambda a: ABSENT if a.state.native.unstable_modes is None else a.state.native.unstable_modes),
    Quantity("active_bounds", kind=DATA, of=lambda a: a.state.native.active_bounds),
    Quantity("tolerance_error", unit="l", kind=DATA, of=lambda a: a.state.native.tolerance_error),
    Quantity("lowest_eigenvalue_limit", kind=DATA, of=lambda a: a.state.numbers.get("eigenvalue_limit")),
    Quantity("neutral", kind=DATA, of=lambda a: a.state.numbers.get("neutral", ABSENT)),
    Quantity("walls", kind=DATA, of=lambda a: walls_of(a.state)),
    Quantity("minima", kind=DATA, of=_minima),
    Quantity("model.energy", kind=DATA, of=lambda a: a.state.native.problem.energy),
    Quantity("model.formulation", kind=DATA, of=lambda a: a.state.native.problem.formulation),
    Quantity("model.why", kind=DATA, of=_why),
    Quantity("model.elements", kind=DATA, of=lambda a: int(a.state.native.problem.lengths.size)),
    Quantity("model.element_lengths", kind=DATA, of=lambda a: a.state.native.problem.lengths),
    Quantity("model.constraints", kind=DATA, of=lambda a: int(a.state.native.problem.row_count)),
    Quantity("provenance", kind=DATA, of=_made),
    Quantity("auto", kind=DATA, of=lambda a: a.state.numbers.get("auto", ABSENT)),
    Quantity("chosen", kind="word", note="the energy that `model.accuracy` chose",
             of=lambda a: (a.state.numbers.get("auto") or {}).get("chosen", ABSENT)),
    Quantity("thickness", kind=DATA, of=lambda a: a.state.numbers.get("thickness", ABSENT)),
    Quantity("penetration", unit="l", kind=DATA,
             of=lambda a: ABSENT if a.state.native.penetration is None else a.state.native.penetration),
    Quantity("contacts", kind=DATA, of=_contacts),
    Quantity("contact_lines", kind=DATA, note="lines of contact of a round rod whose segments follow them",
             of=_touches("lines")),
    Quantity("contact_places", kind=DATA, note="places of contact of such a rod", of=_touches("places")),
    Quantity("contact_penetration", unit="l", kind=DATA, note="how much nearer parts are than `contact.distance`",
             of=_touches("penetration")),
    Quantity("contact_complementarity", unit="D w / l", kind=DATA, note="largest push times its gap",
             of=_touches("complementarity")),
    Quantity("wound", kind=DATA, of=_touches("wound"),
             note="turns of twist, writhe and link of a strip from a drawn curve"),
    Quantity("taut_tension", unit="D w / l^2", kind=DATA, of=lambda a: _taut(a, "tension")),
    Quantity("taut_sag", unit="l", kind=DATA, of=lambda a: _taut(a, "sag")),
    Quantity("share", kind=DATA, of=lambda a: _stretching(a, "share")),
    Quantity("zones", kind=DATA, of=lambda a: _stretching(a, "zones")),
    *PATH,
)  # fmt: skip
