"""What a shell's result holds beside that of every model; it stands at its own load, arrived or not."""

from __future__ import annotations

from typing import Any

from compare.models.quantities import Answered
from compare.record.quantity import DATA, Part, Quantity


def ratio_of(a: Answered) -> float:
    """w/h of a shell, as its problem has it."""
    problem = a.state.native.data["problem"]
    return float(f"{problem['width'] / problem['thickness']:.12g}")  # 50 and not 50.00000000000001


def _energy(a: Answered) -> dict[str, Any]:
    own = {} if a.state.energy is None else a.state.energy.to_dict()
    return {**own, "elastic_with_constant": a.state.native.data["energy"]["elastic"]}


def _held(a: Answered, kind: str) -> dict[str, Any]:
    held = a.state.supports
    return {name: None if found is None else getattr(found, kind)
            for name, found in (("start", held.start), ("end", held.end))}  # fmt: skip


def _seconds(a: Answered) -> dict[str, Any]:
    spent = a.state.native.data["seconds"]
    return {"first": spent["total"], "warm": a.state.seconds.warm, "parts": spent}


def _model(a: Answered) -> dict[str, Any]:
    data = a.state.native.data
    return {
        "energy": "naghdi",
        "formulation": data["options"]["iteration"],
        "elements": data["elements"],
        "unknowns": a.state.unknowns,
        **{name: data["problem"][name] for name in ("clamp", "corner", "start_curvature")},
    }


QUANTITIES: tuple[Quantity[Answered], ...] = (
    Quantity("width_to_thickness", "w/h", kind="digits", rank=0, of=ratio_of),
    Quantity("negative_eigenvalues", kind=DATA, of=lambda a: a.state.native.data["negative_eigenvalues"]),
    Quantity("residual_absolute", kind=DATA, of=lambda a: a.state.native.data["residual"]["absolute"]),
    Quantity("factorisations", kind=DATA, of=lambda a: a.state.native.data["factorisations"]),
    Quantity("energy", unit="D w / l", kind="digits:6", of=_energy, parts=(
        Part("elastic", heading="elastic"), Part("gravity", heading="gravity"))),
    Quantity("share", kind="share", of=lambda a: a.state.native.data["share"], parts=(
        Part("membrane", heading="membrane %", rank=1, legend="share of the elastic energy"),
        Part("shear", heading="shear %", rank=4, legend="the same"))),
    Quantity("middle", unit="l", kind="decimals:5", of=lambda a: a.state.native.data["middle"], parts=(
        Part("position", "middle", "middle / l", rank=7),)),
    Quantity("end", unit="l", kind="decimals:5", of=lambda a: a.state.native.data["end"], parts=(
        Part("position", "end", "end / l", rank=6),)),
    Quantity("forces", unit="D w / l^2", kind=DATA, of=lambda a: {**_held(a, "force"), "walls": []}),
    Quantity("moments", unit="moment", kind=DATA, of=lambda a: _held(a, "moment")),
    Quantity("load_factor", kind=DATA, of=lambda a: a.state.native.data["load_factor"]),
    Quantity("path_factor", kind=DATA, of=lambda a: a.state.native.data["path_factor"]),
    Quantity("discretisation", kind=DATA, of=lambda a: a.state.native.data["discretisation"]),
    Quantity("discretisation_error_why", kind=DATA, of=lambda a: a.state.error_why),
    Quantity("seconds", unit="s", kind="seconds:3", of=_seconds, parts=(
        Part("warm", "seconds", "s", rank=3, legend="of the solve, compilation apart"),)),
    Quantity("memory_mb", kind=DATA, of=lambda a: a.state.native.data["memory_mb"]),
    Quantity("model", kind="sizes", of=_model, parts=(Part("elements", "elements", "elements", rank=2),)),
    Quantity("start", kind=DATA, of=lambda a: a.state.native.start),
    Quantity("reused", "kept", kind="truth", legend="solved by an earlier run", rank=6, of=lambda a: a.state.reused),
)  # fmt: skip
