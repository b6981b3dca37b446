"""What a shell's result holds beside that of every model; it stands at its own load, arrived or not."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from compare.models.quantities import Answered, with_error
from compare.record.quantity import ABSENT, DATA, Part, Quantity

if TYPE_CHECKING:
    from compare.models.shell_process import Report


def _report(a: Answered) -> Report:
    found: Report = a.state.native.report
    return found


def _energy(a: Answered) -> dict[str, Any]:
    own = {} if a.state.energy is None else a.state.energy.to_dict()
    return {**own, "elastic_with_constant": _report(a).energy["elastic"]}


def _held(a: Answered, kind: str) -> dict[str, Any]:
    held = a.state.supports
    return {name: None if found is None else getattr(found, kind)
            for name, found in (("start", held.start), ("end", held.end))}  # fmt: skip


def _walls(a: Answered) -> list[dict[str, Any]]:
    """Every wall with its pressures and their errors."""
    state = a.state
    return [
        dict(wall) | with_error(wall, "mean_pressure", state.errors, k, state.error_why)
        | with_error(wall, "greatest_pressure", state.errors, k, state.error_why)
        for k, wall in enumerate(state.supports.walls)
    ]  # fmt: skip


def _pairs(a: Answered) -> list[dict[str, Any]]:
    """Where parts of the shell push each other, as of a ribbon."""
    return [dict(pair) for pair in a.state.native.data.get("pairs") or ()]


def _reported(quantity: Quantity[Answered]) -> Quantity[Answered]:
    """`ABSENT` where the worker died without a report."""
    return replace(quantity, of=lambda a: ABSENT if a.state.shape is None else quantity.of(a))


_QUANTITIES: tuple[Quantity[Answered], ...] = (
    Quantity("width_to_thickness", "w/h", kind="digits", rank=0,
             of=lambda a: _report(a).width_to_thickness),
    Quantity("negative_eigenvalues", kind=DATA, of=lambda a: _report(a).negative_eigenvalues),
    Quantity("residual_absolute", kind=DATA, of=lambda a: _report(a).residual["absolute"]),
    Quantity("factorisations", kind=DATA, of=lambda a: _report(a).factorisations),
    Quantity("energy", unit="D w / l", kind="digits:6", of=_energy, parts=(
        Part("elastic", heading="elastic"), Part("gravity", heading="gravity"))),
    Quantity("share", kind="share", of=lambda a: _report(a).share, parts=(
        Part("membrane", heading="membrane %", rank=1, legend="share of the elastic energy"),
        Part("shear", heading="shear %", rank=4, legend="the same"))),
    Quantity("middle", unit="l", kind="decimals:5", of=lambda a: _report(a).middle, parts=(
        Part("position", "middle", "middle / l", rank=7),)),
    Quantity("end", unit="l", kind="decimals:5", of=lambda a: _report(a).end, parts=(
        Part("position", "end", "end / l", rank=6),)),
    Quantity("forces", unit="D w / l^2", kind=DATA, of=lambda a: {
        **_held(a, "force"), "walls": [wall["force"] for wall in a.state.supports.walls]}),
    Quantity("moments", unit="moment", kind=DATA, of=lambda a: _held(a, "moment")),
    Quantity("walls", kind=DATA, of=lambda a: _walls(a)),
    Quantity("contacts", kind=DATA, of=lambda a: ABSENT if a.scene.apart is None else _pairs(a)),
    Quantity("contact", kind=DATA, of=lambda a: a.state.native.data.get("contact", ABSENT) or ABSENT),
    Quantity("load_factor", kind=DATA, of=lambda a: _report(a).load_factor),
    Quantity("path_factor", kind=DATA, of=lambda a: _report(a).path_factor),
    Quantity("discretisation", kind=DATA, of=lambda a: _report(a).discretisation),
    Quantity("discretisation_error_why", kind=DATA, of=lambda a: a.state.error_why),
    Quantity("seconds.first", unit="s", kind=DATA, of=lambda a: _report(a).seconds["total"]),
    Quantity("seconds.warm", "s", "s", "seconds:3", name="seconds", rank=3,
             legend="of the solve, compilation apart", of=lambda a: a.state.seconds.warm),
    Quantity("seconds.parts", unit="s", kind=DATA, of=lambda a: _report(a).seconds),
    Quantity("memory_mb", kind=DATA, of=lambda a: _report(a).memory_mb),
    Quantity("model.energy", kind=DATA, of=lambda a: "naghdi"),
    Quantity("model.formulation", kind=DATA, of=lambda a: _report(a).options.iteration),
    Quantity("model.elements", kind="sizes", name="elements", rank=2, of=lambda a: _report(a).elements),
    Quantity("model.clamp", kind=DATA, of=lambda a: _report(a).problem.clamp),
    Quantity("model.corner", kind=DATA, of=lambda a: _report(a).problem.corner),
    Quantity("model.start_curvature", kind=DATA, of=lambda a: _report(a).problem.start_curvature),
    Quantity("start", kind=DATA, of=lambda a: a.state.native.start),
    Quantity("reused", "kept", kind="truth", legend="solved by an earlier run", rank=6, of=lambda a: a.state.reused),
)  # fmt: skip
QUANTITIES = tuple(map(_reported, _QUANTITIES))
