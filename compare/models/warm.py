"""What a first solve compiles, compiled beforehand: the ribbon's kernels, and the shell's forms where it is installed.

Every kind of ribbon is solved once on a few elements, since a kernel is compiled when it is first called: held at one
end and at both, closed, at a wall, both energies, by Ipopt, as a batch and as a line of neighbours, weight over the
surface, derivatives, errors, the estimate of `limits`.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from compare import registry
from compare.models.base import Model, Options, State
from compare.models.capabilities import Batches, Differentiates, Estimates, FloatArray, Lines, Moves
from compare.models.timing import compiled
from compare.scene.scene import Scene, load
from compare.store.progress import Reporter
from ribbonbench.errors import Missing, RibbonbenchError

#: Elements of the ribbons: as few as a closed band needs, and some more.
ELEMENTS = 6
#: Shipped scene -> what is changed in it: between them all kernels of the two formulations.
RIBBONS: tuple[tuple[str, Mapping[str, Any]], ...] = (
    ("curl_4_3", {}),
    ("curl_4_3", {"model.energy": "sadowsky"}),
    ("curl_4_3", {"model.solver": "ipopt"}),
    ("curl_4_3", {"model.formulation": "mixed", "gravity.exact": True}),
    ("curl_4_3", {"model.formulation": "mixed", "model.energy": "sadowsky"}),
    ("two_clamps_5_3_2", {}),
    ("roman_6_2", {"path": None}),
    ("moebius_6_1", {}),
)
#: Whose estimate, derivatives and shell are asked for.
BESIDE = "curl_4_3"


@dataclass(frozen=True)
class Warmed:
    """kernels: how many were compiled now; shell: whether its forms are ready, None: it is not installed; seconds: for
    all of it."""

    kernels: int
    shell: bool | None
    seconds: float


def warm(say: Reporter | None = None, shell: bool = True) -> Warmed:
    """Compiles what is not kept yet; what is kept takes a few seconds to be looked at. shell: its forms too."""
    began = time.perf_counter()
    with compiled() as count:
        ribbons(say)
    ready = forms(say) if shell else None
    return Warmed(count(), ready, time.perf_counter() - began)


def _places(moves: Moves) -> dict[str, FloatArray]:
    """How the centreline moves."""
    return moves.position(np.linspace(0.0, 1.0, 201))


def _line(found: Batches, scene: Scene) -> None:
    """Solves a line of neighbours."""
    curvature = scene.curvature[0] + np.linspace(0.0, 0.1, 9)  # type: ignore[operator]

    def solved(places: Sequence[int]) -> list[State]:
        keys = [{"strip.natural_curvature": float(curvature[place]) / scene.strip.length} for place in places]
        return found.solve_together([scene.replace(one) for one in keys])

    if isinstance(found, Lines):
        found.solve_line(np.full(curvature.size, scene.gamma), curvature, solved)


def ribbons(say: Reporter | None = None) -> None:
    """Solves the kinds of ribbons; what comes of them is nobody's concern."""
    found: Model = registry.model(registry.USUAL)
    for name, keys in RIBBONS:
        scene = load(name).replace({"model.elements": ELEMENTS, **keys})
        state = found.solve(scene, options=Options(error=True), say=say)
        if state.shape is not None:
            state.shape.fields(np.linspace(0.0, 1.0, 5), scene.width * np.linspace(-0.5, 0.5, 3))
        if isinstance(found, Batches) and found.together(scene) is not None:
            found.solve_together([scene])
            _line(found, scene)
        if name == BESIDE and not keys:
            if isinstance(found, Estimates):
                found.estimate(scene, state, 100.0, say)
            if isinstance(found, Differentiates):
                found.derivatives(scene, state, ("strip.poisson", "strip.width"), _places)


def forms(say: Reporter | None = None) -> bool | None:
    """Solves one coarse shell, which compiles its forms; None: no shell is installed here."""
    scene = load(BESIDE).replace({"shell.width_to_thickness": [10.0], "shell.elements": [8, 1]})
    try:
        state = registry.model(registry.RICHEST).solve(scene, say=say)
    except Missing:
        return None
    except RibbonbenchError:
        return False
    return state.shape is not None
