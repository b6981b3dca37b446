"""4.3, both signs, w/h from 10 to 400: the strip of finite thickness beside nine points of the shell's centreline."""

from __future__ import annotations

import csv
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest

from compare.models import solve
from compare.scene.scene import load

SHELLS = Path(__file__).resolve().parents[3] / "results" / "models_4_3" / "shell.csv"
#: Largest distance allowed to `finite`, in l, by w/h.
LIMITS = {10.0: 6e-3, 20.0: 3e-3, 50.0: 2e-3, 100.0: 2e-3, 200.0: 1.5e-3, 400.0: 1e-3}


def shells() -> dict[tuple[str, float], np.ndarray]:
    """Points (9, 3) at s = 0, 1/8, ... 1 by scene and w/h."""
    found = defaultdict(list)
    with SHELLS.open() as lines:
        for row in csv.DictReader(lines):
            found[row["scene"], float(row["w/h"])].append([float(row[axis]) for axis in "xyz"])
    return {key: np.array(points) for key, points in found.items()}


def distance(name: str, ratio: float, energy: str, points: np.ndarray) -> float:
    """Largest distance of the ribbon's points to the shell's, in l."""
    state = solve(load(name).replace({"model.energy": energy, "shell.width_to_thickness": [ratio]}), "ribbon")
    assert state.ok
    return float(np.linalg.norm(state.shape.centreline(np.linspace(0.0, 1.0, 9)) - points, axis=1).max())


@pytest.mark.parametrize("name", ["curl_4_3", "curl_4_3_down"])
def test_finite_lands_on_the_shell_and_wunderlich_does_not(name):
    own = {ratio: points for (scene, ratio), points in shells().items() if scene == name}
    assert set(own) == set(LIMITS)
    away = {ratio: distance(name, ratio, "finite", points) for ratio, points in own.items()}
    for ratio, limit in LIMITS.items():
        assert away[ratio] < limit, (ratio, away)
        # Wunderlich's energy knows no thickness: one shape for all w/h, farther from every shell
        assert distance(name, ratio, "wunderlich", own[ratio]) > 2.0 * limit, ratio
        assert distance(name, ratio, "wunderlich", own[ratio]) > 5.0 * away[ratio], ratio
