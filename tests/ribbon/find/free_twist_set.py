"""Random strips of free twist between two clamps, or held by one: scenes in which curvature passes zero, twisted."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ribbon import Clamp, Gravity, Strip

SEED = 26011
ENERGIES = ("finite", "extensible", "sano", "sadowsky_kt", "kirchhoff")


def drawn(number: int) -> dict[str, Any]:
    """Keywords of `ribbon.solve` of the scene `number`, the energies in turn: w/l 0.02 to 0.15, h/w 1e-4 to 1e-2, ends
    0.5 to 0.95 l apart and turned by up to 1 rad, every fifth with a free end, every third naturally curved."""
    rng = np.random.default_rng((SEED, number))
    width = rng.uniform(0.02, 0.15)
    natural = rng.uniform(-4.0, 4.0) if number % 3 == 0 else 0.0
    thickness = width * 10.0 ** rng.uniform(-4.0, -2.0)
    strip = Strip(1.0, width, rng.uniform(0.0, 0.45), natural, rng.uniform(0.0, 10.0), thickness)
    turn = Rotation.from_rotvec(rng.uniform(-1.0, 1.0) * _unit(rng)).as_matrix()
    place = rng.uniform(0.5, 0.95) * _unit(rng, np.array([0.0, 0.0, 3.0]))
    end = Clamp(tuple(place), tangent=tuple(turn[:, 2]), normal=tuple(turn[:, 1]))
    return {
        "strip": strip,
        "clamp": Clamp(),
        "gravity": Gravity(tuple(_unit(rng))),
        "end": end if number // 5 % 5 else None,
        "energy": ENERGIES[number % len(ENERGIES)],
        "segments": int(rng.integers(12, 33)),
    }


def _unit(rng: np.random.Generator, towards: Any = 0.0) -> Any:
    direction = rng.normal(size=3) + towards
    return direction / np.linalg.norm(direction)
