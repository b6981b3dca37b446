"""`result.json`: the contract that every command keeps (design document, Contracts)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from compare.models.base import Seconds, State
from compare.models.quantities import Answered
from compare.page.pair import PAIR, PLANAR, Row
from compare.page.state import STATE, own_of
from compare.record.quantity import ABSENT, DATA, Quantity, joined, pick
from compare.record.views import document, in_si
from compare.scene.scene import Scene
from compare.store.made_by import SHELL_RUN
from compare.studies.inputs import input_uncertainty

if TYPE_CHECKING:
    from compare.studies.compare import Comparison


def spent(seconds: Seconds) -> str:
    """What a solve took, in words; a warm time only where it was measured."""
    if not seconds.repeats:
        return f"{seconds.first:.3g} s, loading included (--time measures the warm solve)"
    return f"{seconds.warm * 1e3:.3g} ms warm, {seconds.first:.3g} s for the first solve"


#: What a scene's uncertainties leave open of a state, where it gives them.
_UNSURE = Quantity[Answered]("u_input", kind=DATA, of=lambda a: _unsure(a))


def _unsure(a: Answered) -> Any:
    found = input_uncertainty(a.scene, a.state)
    return ABSENT if found is None else found.to_dict()


def state_result(scene: Scene, state: State) -> dict[str, Any]:
    """The contract's keys of a state and what its model adds (`compare.page.state`); what has a unit again under `si`,
    in m, N, N m and J."""
    quantities = joined((*STATE, _UNSURE), own_of(state.model))
    found = document(quantities, Answered(scene, state))
    return {**found, "si": in_si(quantities, found, scene.units)}


def row_result(row: Row, scene: Scene) -> dict[str, Any]:
    """A row of a comparison, with `si`."""
    found = document(PAIR, row)
    return {**found, "si": in_si(PAIR, found, scene.units)}


#: What a comparison says of the elastica in planar scenes.
_THIRD = pick(
    STATE, "status", "message", "stable", "start", "energy", "forces", "moments", "energy_error", "forces_error",
    "moments_error", "discretisation_error", "seconds.first", "seconds.warm",
)  # fmt: skip


def comparison_result(comparison: Comparison) -> dict[str, Any]:
    """The keys of the model beside the shells with one row per shell, the slope and, in planar scenes, the elastica."""
    scene, units = comparison.scene, comparison.scene.units
    result = state_result(scene, comparison.fast)
    si = result.pop("si")
    result["rows"] = [row_result(row, scene) for row in comparison.rows]
    result["slope"] = comparison.slope
    result["distance_falls"] = comparison.falls
    result["complete"] = comparison.ok
    result["provenance"][SHELL_RUN] = next(
        (s.native.data["provenance"] for s in comparison.shells if "provenance" in s.native.data), None
    )
    if comparison.elastica is not None:
        apart = Quantity[Answered]("ribbon_centreline", unit="l", kind=DATA, of=lambda _: comparison.elastica_distance)
        third = (*_THIRD, apart)
        result[PLANAR.key] = document(third, Answered(scene, comparison.elastica))
        if si is not None:
            si[PLANAR.key] = in_si(third, result[PLANAR.key], units)
    return {**result, "si": si}
