"""Minima of a strip between two clamps with a quarter of a turn (thesis, 5.3.2): how many each model has."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from compare.scene.scene import load
from tests.validation import one_core, page
from tests.validation.number import Number

#: It takes no times that its page rests on.
ALONE = False

NAME = "two_clamps_5_3_2_twist"
RATIO = 100.0
SEEDS = 30
#: Seeds of the states that `make test` computes again.
FEW = 6
ELEMENTS = (20, 40, 80)
MODELS = ("wunderlich", "kirchhoff", "extensible", "finite")
#: Two states are one where energies agree to this part and shapes (both on 101 points) to this part of l.
SAME_ENERGY, SAME_SHAPE = 1e-6, 1e-4
S = np.linspace(0.0, 1.0, 101)


@dataclass
class Minimum:
    """A stable state: total energy in D w / l, centreline (101, 3) in l, and how many seeds led there."""

    energy: float
    points: NDArray[np.float64]
    count: int = 1

    def is_near(self, energy: float, points: NDArray[np.float64]) -> bool:
        """Whether this energy and these points are of the same state."""
        same = abs(energy - self.energy) < SAME_ENERGY * max(1.0, abs(energy))
        return same and float(np.abs(points - self.points).max()) < SAME_SHAPE


def minima(model: str, elements: int, seeds: int = SEEDS) -> tuple[list[Minimum], int]:
    """Stable states, lowest first, from seeds around the scene's own, and how many solves did not end in one.

    A seed: curvature and second field (ruling or twist) piecewise linear through five random values, the same for all
    models up to the field's scale (a quarter of a turn over l as twist; rulings of that order).
    """
    from compare.models.ribbon.build import ribbon_arguments
    from ribbon import solve

    changes = {"model.energy": model, "model.elements": elements, "shell.width_to_thickness": [RATIO]}
    changes |= {"model.budget": 20.0}
    arguments = {**ribbon_arguments(load(NAME).replace(changes)), "budget": 20.0}
    found: list[Minimum] = []
    lost = 0
    rng = np.random.default_rng(532)
    for _ in range(seeds):
        bend, turn = rng.normal(size=(2, 5))
        arguments["seed_curvature"] = tuple(2.0 * bend)
        arguments["seed_ruling"] = tuple(0.5 * turn if model == "wunderlich" else 1.5 + turn)
        e = solve(**arguments)
        if not e.ok:
            lost += 1
            continue
        points = e.position(S)
        for state in found:
            if state.is_near(e.energy.total, points):
                state.count += 1
                break
        else:
            found.append(Minimum(e.energy.total, points))
    return sorted(found, key=lambda state: state.energy), lost


def row(model: str, elements: int) -> tuple[list[str], float]:
    """One line of the table, and the lowest energy."""
    found, lost = minima(model, elements)
    energies = ", ".join(f"{state.energy:.5f} ({state.count})" for state in found[:4])
    spread = 0.0 if not found else max(float(np.abs(s.points - found[0].points).max()) for s in found)
    line = [model, str(elements), str(len(found)), str(lost), energies + (", ..." if len(found) > 4 else "")]
    print("  ", *line, f"{spread:.1e}", flush=True)
    return [*line, f"{spread:.1e}"], found[0].energy


def second(model: str, elements: int) -> float:
    """Total energy of the lowest state to which the first `FEW` seeds lead: the second of all."""
    return minima(model, elements, FEW)[0][0].energy


PROBES = {
    "second_finite_20": lambda: second("finite", ELEMENTS[0]),
    "second_extensible_20": lambda: second("extensible", ELEMENTS[0]),
}


def measured(models: Sequence[str], elements: Sequence[int]) -> list[tuple[list[str], float]]:
    """All lines."""
    return [row(model, number) for model in models for number in elements]


def run(out: Path) -> dict[str, Number]:
    """Writes models_minima.md."""
    found = one_core.call(measured, MODELS, ELEMENTS)
    rows, lowest = [line for line, _ in found], {(line[0], int(line[1])): energy for line, energy in found}
    heads = ["model", "elements", "stable states", "not stable or not found", "energies (seeds)", "farthest / l"]
    told = ", ".join(line[2] for line in rows if line[0] == "wunderlich")
    page.write(
        out / "models_minima.md", "How many states a twisted strip has, by model",
        "python -m tests.validation models_minima",
        f"Scene `{NAME}` at w/h = {RATIO:g}: w/l = 0.01, a quarter of a turn over 0.95 l. {SEEDS} random starting "
        "shapes, the same for every model; stable states apart by energy (one part in 1e6) or shape (1e-4 l). The "
        "strip is of one thickness; `wunderlich` has none and its element fields are curvature and ruling, "
        "the others' curvature and twist.",
        "With curvature and twist apart, extensible and finite have four states on any number of elements: a quarter "
        "of a turn one way (0.262 turns in the strip) or three quarters the other way (0.773), each bowed to one "
        "side or the other, which weight tells apart. On curvature and ruling most minima are the elements' "
        "own, and `solve` goes on from what it finds to the lowest that it meets beside it (`ribbon.find.minima`): "
        f"{told} states are left on {', '.join(map(str, ELEMENTS))} elements. Their energies go on falling with the "
        "elements.",
        page.table(heads, rows),
        "energies: total, in D w / l, lowest first, with the number of seeds that led there; farthest: largest "
        "distance of a stable state from the one of lowest energy.",
    )  # fmt: skip
    numbers = {f"states_{line[0]}_{line[1]}": Number(int(line[2]), 0, shown="d") for line in rows}
    for model in MODELS:
        for coarse, fine in pairwise(ELEMENTS):
            value = lowest[model, coarse]
            error = abs(lowest[model, fine] - value)
            numbers[f"lowest_{model}_{coarse}"] = Number(value, error, "D w / l", ".5f")
        # the last change, which the next is below where energies settle with the elements
        numbers[f"lowest_{model}_{fine}"] = Number(lowest[model, fine], error, "D w / l", ".5f")
    for model in ("finite", "extensible"):
        value = second(model, ELEMENTS[0])
        numbers[f"second_{model}_20"] = Number(value, abs(second(model, ELEMENTS[1]) - value), "D w / l", ".5f")
    return numbers
