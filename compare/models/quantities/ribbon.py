"""What a ribbon's result holds beside that of every model."""

from __future__ import annotations

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


def _model(a: Answered) -> dict[str, Any]:
    from compare.models.ribbon.build import formulation_why

    e = a.state.native
    return {
        "energy": e.problem.energy,
        "formulation": e.problem.formulation,
        "why": formulation_why(a.scene, e.problem.formulation),
        "elements": int(e.problem.lengths.size),
        "element_lengths": e.problem.lengths,
        "unknowns": a.state.unknowns,
        "constraints": int(e.problem.row_count),
    }


def _made(a: Answered) -> dict[str, Any]:
    e = a.state.native
    return {**provenance(a.scene, e.options), "solver": e.solver, "linear_solver": LINEAR_SOLVERS[e.solver]}


def _minima(a: Answered) -> Any:
    found = a.state.native.minima
    return None if found is None else {**asdict(found), "lowest": found.lowest}


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


def path(a: Answered) -> dict[str, Any]:
    """The steps of a way; `log` has one entry for each of them, the rejected ones too."""
    log = a.state.log
    accepted = sum(bool(entry["accepted"]) for entry in log)
    return {
        "stages": len(a.scene.path) + 1,
        "steps": accepted,
        "rejected": len(log) - accepted,
        "jumps": sum(bool(entry["accepted"] and entry["jump"]) for entry in log),
        "resumed": a.state.reused,
        "log": log,
    }


QUANTITIES: tuple[Quantity[Answered], ...] = (
    Quantity("evaluations", kind=DATA, of=lambda a: a.state.native.evaluations),
    Quantity("active_bounds", kind=DATA, of=lambda a: a.state.native.active_bounds),
    Quantity("tolerance_error", unit="l", kind=DATA, of=lambda a: a.state.native.tolerance_error),
    Quantity("lowest_eigenvalue_limit", kind=DATA, of=lambda a: a.state.numbers.get("eigenvalue_limit")),
    Quantity("neutral", kind=DATA, of=lambda a: a.state.numbers.get("neutral", ABSENT)),
    Quantity("walls", kind=DATA, of=lambda a: walls_of(a.state)),
    Quantity("minima", kind=DATA, of=_minima),
    Quantity("model", kind=DATA, of=_model),
    Quantity("provenance", kind=DATA, of=_made),
    Quantity("auto", kind=DATA, of=lambda a: a.state.numbers.get("auto", ABSENT)),
    Quantity("penetration", unit="l", kind=DATA,
             of=lambda a: ABSENT if a.state.native.penetration is None else a.state.native.penetration),
    Quantity("taut_tension", unit="D w / l^2", kind=DATA, of=lambda a: _taut(a, "tension")),
    Quantity("taut_sag", unit="l", kind=DATA, of=lambda a: _taut(a, "sag")),
    Quantity("share", kind=DATA, of=lambda a: _stretching(a, "share")),
    Quantity("zones", kind=DATA, of=lambda a: _stretching(a, "zones")),
    Quantity("path", kind=DATA, of=lambda a: path(a) if a.scene.path else ABSENT),
)  # fmt: skip
