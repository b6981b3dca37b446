"""A strip on edge under its weight falls over where the shell does (thesis 7.1; results/on_edge)."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from ribbon import Clamp, Gravity, Status, Strip, solve

FRONTIER = Path(__file__).resolve().parents[3] / "results" / "on_edge" / "frontier.csv"
#: Critical weights of the shell, h/l = 1e-3, nu = 0.35: width -> Gamma (`python -m tests.validation on_edge`).
SHELL = {
    float(row["width"]): float(row["eigenvalue"])
    for row in csv.DictReader(FRONTIER.read_text().splitlines())
    if row["model"] == "shell"
}


def upright(width, gamma, ruling="straight", **keywords):
    """The straight strip, on segments that grow from w/8 at the clamp."""
    lengths = 1.25 ** np.arange(40)
    lengths *= 0.125 * width / lengths[0]
    lengths = lengths[: np.searchsorted(np.cumsum(lengths), 1.0) + 1]
    clamp = Clamp((0, 0, 0), (1, 0, 0), (0, 1, 0), ruling)
    strip = Strip(1.0, width, 0.35, 0.0, gamma, 1e-3)
    return solve(
        strip, clamp, Gravity((0, 0, 1)), segments=lengths / lengths.sum(), seed_curvature=0.0, **keywords
    )  # fmt: skip


@pytest.mark.parametrize("width", [0.02, 0.05, 0.1])
def test_finite_falls_over_within_one_percent_of_the_shell(width):
    assert upright(width, 0.99 * SHELL[width], energy="finite").status is Status.CONVERGED
    assert upright(width, 1.01 * SHELL[width], energy="finite").status is Status.SADDLE


#: Energy, ruling, w/l, critical weight of the linearised problem (results/on_edge): both far above the shell's.
INEXTENSIBLE = [
    ("sadowsky", "free", 0.02, 21.491), ("wunderlich", "free", 0.02, 21.494), ("wunderlich", "free", 0.1, 21.552),
    ("wunderlich", "straight", 0.02, 21.889), ("wunderlich", "straight", 0.1, 23.505),
]  # fmt: skip


@pytest.mark.parametrize(("energy", "ruling", "width", "gamma"), INEXTENSIBLE)
def test_frontiers_of_wunderlich_and_sadowsky(energy, ruling, width, gamma):
    """Thesis 7.1: half as much weight again as a shell, and with a free ruling hardly more for a wide strip."""
    assert upright(width, 0.985 * gamma, ruling, energy=energy).status is Status.CONVERGED
    assert upright(width, 1.015 * gamma, ruling, energy=energy).status is Status.SADDLE
    assert gamma > 1.4 * SHELL[width]
