"""The errors of all numbers that are told of a state: each by its own change between meshes.

Numbers go by dotted names, as in `result.json`: "forces.start", "forces.walls.0" (D w / l^2), "moments.end" (D w / l),
"energy.elastic" (D w / l), "lowest_eigenvalue", "max_abs_eta". Of a force or moment (3,) the error is one number, in
the Euclidean norm. "moments.walls.0" (about the origin), "gaps.walls.0" (l), "mean_pressures.walls.0" and
"greatest_pressures.walls.0" (D / l^3) are there of models that tell them.
"forces.itself" is what parts of the strip that keep apart exert on each other.
"lines.0.2" (4,) are the ends (l) of the two lines along which the strip touches wall 0: on elements
on which it touches in more or fewer lines that is another number, and there is no error.
"friction.0" (3,) is the friction of wall 0 (D w / l^2), where it rubs.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]

#: Part of a number that is rounding.
ROUNDING = 1e-14
#: Energies that have an error, as `result.json` names them, and numbers of a state that stand by themselves.
ENERGIES = ("elastic", "gravity", "tip", "plates", "total")
#: What else models may tell of a wall.
OF_WALLS = ("moment", "gap", "mean_pressure", "greatest_pressure")
ALONE = ("lowest_eigenvalue", "max_abs_eta", "max_abs_eta_prime_w_half", "max_abs_tau")


def numbers_of(state: Any) -> dict[str, FloatArray]:
    """The numbers of a state (`compare.models.base.State`) by name; those that it does not have are left out."""
    found: dict[str, Any] = {}
    for name in ("start", "end"):
        held = getattr(state.supports, name)
        if held is not None:
            found |= {f"forces.{name}": held.force, f"moments.{name}": held.moment}
    found |= {f"forces.walls.{k}": wall["force"] for k, wall in enumerate(state.supports.walls)}
    for name in OF_WALLS:
        found |= {f"{name}s.walls.{k}": wall.get(name) for k, wall in enumerate(state.supports.walls)}
    found |= {f"lines.{k}.{len(wall['lines'])}": wall["lines"].ravel() for k, wall in enumerate(state.supports.walls)}
    found["forces.itself"] = state.supports.itself
    if state.energy is not None:
        found |= {f"energy.{name}": getattr(state.energy, name) for name in ENERGIES}
    found["lowest_eigenvalue"] = state.lowest_eigenvalue
    found |= {name: state.numbers.get(name) for name in ALONE[1:]}
    return {name: np.asarray(value, dtype=float) for name, value in found.items() if value is not None}


def errors_of(
    chain: Sequence[Mapping[str, ArrayLike]],
    estimate: Callable[[Sequence[ArrayLike]], float | None],
    least: float = 0.0,
) -> dict[str, Any]:
    """The errors of the numbers that all of a chain of meshes have, nested as `result.json` has the numbers.

    estimate: `compare.measure.error.error_of_first` or `error_of_last`, whichever of the chain is the state; least: no
    error is less (the residual, up to which the forces of the state balance). The names of the state's own numbers are
    all there, those without an error as None. None is less than `ROUNDING` of its number either.
    """
    own = chain[0] if chain else {}
    flat: dict[str, float | None] = {}
    for name in own:
        values = [one[name] for one in chain if name in one]
        error = estimate(values) if len(values) == len(chain) else None
        rounding = ROUNDING * float(np.linalg.norm(np.atleast_1d(np.asarray(own[name], dtype=float))))
        flat[name] = None if error is None else max(error, least, rounding)
    return nested(flat)


def nested(flat: Mapping[str, float | None]) -> dict[str, Any]:
    """Errors by dotted name as the nested ``forces``, ``moments``, ``energy`` of `result.json`, others as they are."""
    walls = sorted((name for name in flat if name.startswith("forces.walls.")), key=lambda name: int(name[13:]))
    lines = [name for name in flat if name.startswith("lines.")]
    kinds = [f"{name}s" for name in OF_WALLS if any(known.startswith(f"{name}s.walls.") for known in flat)]
    of_walls = {kind: {"walls": [flat.get(f"{kind}.walls.{name[13:]}") for name in walls]} for kind in kinds}
    moments = of_walls.pop("moments", {})
    rubbed = {name[9:]: error for name, error in flat.items() if name.startswith("friction.")}
    itself = {"itself": flat["forces.itself"]} if "forces.itself" in flat else {}
    return {
        "forces": {
            **{end: flat.get(f"forces.{end}") for end in ("start", "end")},
            "walls": [flat[w] for w in walls],
            **itself,
        },
        "moments": {**{end: flat.get(f"moments.{end}") for end in ("start", "end")}, **moments},
        **of_walls,
        "energy": {name[7:]: error for name, error in flat.items() if name.startswith("energy.")},
        **({"friction": rubbed} if rubbed else {}),
        "lines": [flat[name] for name in sorted(lines, key=lambda name: int(name.split(".")[1]))],
        **{name: flat[name] for name in ALONE if name in flat},
    }
