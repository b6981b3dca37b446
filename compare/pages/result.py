"""`result.json`: the contract that every command keeps (design document, Contracts)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

from compare.measure.error import error_of_first
from compare.measure.numbers import ALONE, errors_of, nested, numbers_of
from compare.models.base import Force, Pose, Seconds, State, Supports
from compare.page.remedies import message
from compare.page.si import dimensions, si_of
from compare.pages.presenter import presenter
from compare.scene.scene import Scene
from compare.scene.units import Units
from compare.store.made_by import provenance
from compare.studies.compare import Comparison, Row
from compare.studies.inputs import input_uncertainty


def _pose(pose: Pose | None) -> dict[str, Any] | None:
    return None if pose is None else {"position": pose.position, "frame": pose.frame}


def spent(seconds: Seconds) -> str:
    """What a solve took, in words; a warm time only where it was measured."""
    if not seconds.repeats:
        return f"{seconds.first:.3g} s, loading included (--time measures the warm solve)"
    return f"{seconds.warm * 1e3:.3g} ms warm, {seconds.first:.3g} s for the first solve"


def supports_result(state: State) -> dict[str, Any]:
    """Forces (D w / l^2) and moments (D w / l) that clamps and walls exert on the strip; None at an end that nothing
    holds."""
    found = state.supports if state.is_equilibrium else Supports()
    start, end, walls = found.start, found.end, list(found.walls)

    def part(found: Force | None, name: str) -> Any:
        return None if found is None else getattr(found, name)

    return {
        "forces": {
            "start": part(start, "force"),
            "end": part(end, "force"),
            "walls": [wall["force"] for wall in walls],
        },
        "moments": {"start": part(start, "moment"), "end": part(end, "moment")},
        **({"walls": _walls(state, walls)} if walls or state.model == "ribbon" else {}),
    }


def _walls(state: State, walls: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """The walls with the errors of the ends of their `lines` (l), None with the reason where one is not known."""
    known = state.errors.get("lines") or [None] * len(walls)
    unlike = "on finer elements it touches in more or fewer lines" if state.errors else "not asked for"
    found = []
    for wall, error in zip(walls, known, strict=True):
        nowhere = not len(wall["lines"])
        why = "it touches nowhere" if nowhere else f"{unlike} ({state.error_why})" if state.error_why else unlike
        told = None if nowhere else error
        found.append({**wall, "lines_error": told, **({} if told is not None else {"lines_error_why": why})})
    return found


def errors_result(state: State) -> dict[str, Any]:
    """The errors of all that is told of a state, each in the unit of its number and nested as that is (`forces_error`
    beside `forces`), None where it is not known; `errors_why`: how they were found, or why they are not known. Of an
    end that nothing holds None, as its force is."""
    known = state.errors or errors_of([numbers_of(state)], error_of_first)
    parts = known if state.is_equilibrium else nested({})
    return {
        **{f"{name}_error": parts[name] for name in ("forces", "moments", "energy")},
        **{f"{name}_error": parts[name] for name in ALONE if name in parts},
        "errors_why": state.error_why or "not asked for",
    }


def state_result(scene: Scene, state: State) -> dict[str, Any]:
    """The contract's keys of a state, what its model's own page adds, and the scene's dimensions; what has a unit again
    under `si`, in m, N, N m and J."""
    result = {
        "scene": scene.name,
        "title": scene.title,
        "status": state.word,
        "message": message(state),
        "stable": state.stable,
        "lowest_eigenvalue": state.lowest_eigenvalue,
        "residual": state.residual,
        "iterations": state.iterations,
        "energy": None if state.energy is None else state.energy.to_dict(),
        "end": _pose(state.end) if state.is_equilibrium else None,
        "middle": _pose(state.middle) if state.is_equilibrium else None,
        "max_abs_eta": state.numbers.get("max_abs_eta"),
        "max_abs_eta_prime_w_half": state.numbers.get("max_abs_eta_prime_w_half"),
        **supports_result(state),
        **errors_result(state),
        **{f"{key}_why": why for key, why in state.whys.items() if state.is_equilibrium},
        "discretisation_error": state.error,
        "discretisation_error_why": state.error_why or ("it was not asked for" if state.error is None else ""),
        "refinements": [asdict(one) for one in state.refinements],
        "seconds": {"first": state.seconds.first, "warm": state.seconds.warm},
        "model": {
            "energy": scene.model.energy,
            "formulation": state.size.ladder,
            "elements": state.numbers.get("segments", state.size.label),
            "unknowns": state.unknowns,
        },
        "start": state.start,
        "branch": state.branch,
        "left_saddle": state.left_saddle,
        **dimensions(scene),
        "provenance": provenance(scene),
    }
    unsure = input_uncertainty(scene, state)
    if unsure is not None:
        result["u_input"] = unsure.to_dict()
    result.update(presenter(state).result(scene, state))
    result["si"] = si_of(result, Units.of(scene))
    return result


def row_result(row: Row, scene: Scene) -> dict[str, Any]:
    """A row of a comparison, with `si`; its energy in the convention of every model, with the constant left out
    beside it."""
    fields = {name: getattr(row, name) for name in row.__dataclass_fields__}
    energy = None if row.energy is None else {**row.energy.to_dict(), "constant": row.energy.constant}
    found = {**fields, "energy": energy, "ratio": row.ratio}
    return {**found, "si": si_of(found, Units.of(scene))}


def comparison_result(comparison: Comparison) -> dict[str, Any]:
    """The keys of the model beside the shells with one row per shell, the slope and, in planar scenes, the elastica."""
    result = state_result(comparison.scene, comparison.fast)
    result["rows"] = [row_result(row, comparison.scene) for row in comparison.rows]
    result["slope"] = comparison.slope
    result["distance_falls"] = comparison.falls
    result["complete"] = comparison.ok
    result["provenance"]["shell"] = next(
        (s.native.data["provenance"] for s in comparison.shells if "provenance" in s.native.data), None
    )
    if comparison.elastica is not None:
        state = comparison.elastica
        whole = state_result(comparison.scene, state)
        names = (
            "status",
            "message",
            "stable",
            "start",
            "energy",
            "forces",
            "moments",
            "energy_error",
            "forces_error",
            "moments_error",
            "discretisation_error",
            "seconds",
        )
        result["elastica"] = {
            **{name: whole[name] for name in names},
            "ribbon_centreline": comparison.elastica_distance,
        }
    result["si"] = si_of(result, Units.of(comparison.scene))
    return result
