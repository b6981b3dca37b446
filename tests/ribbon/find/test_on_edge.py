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


def upright(width, gamma, **keywords):
    """The straight strip, on segments that grow from w/8 at the clamp."""
    lengths = 1.25 ** np.arange(40)
    lengths *= 0.125 * width / lengths[0]
    lengths = lengths[: np.searchsorted(np.cumsum(lengths), 1.0) + 1]
    clamp = Clamp((0, 0, 0), (1, 0, 0), (0, 1, 0), "straight")
    strip = Strip(1.0, width, 0.35, 0.0, gamma, 1e-3)
    return solve(
        strip, clamp, Gravity((0, 0, 1)), segments=lengths / lengths.sum(), seed_curvature=0.0, **keywords
    )  # fmt: skip


@pytest.mark.parametrize("width", [0.02, 0.05, 0.1])
def test_finite_falls_over_within_one_percent_of_the_shell(width):
    assert upright(width, 0.99 * SHELL[width], energy="finite").status is Status.CONVERGED
    assert upright(width, 1.01 * SHELL[width], energy="finite").status is Status.SADDLE
