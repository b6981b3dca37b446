"""Force against displacement: what a support exerts along the way on which it is moved.

Along a way of equilibria the support's work on the strip is the change of energy: dE = force . dr + moment . dphi
(theory sheet, eq. (5.5), (5.6)), for the force and moment that the support exerts on the strip. Lengths in l, forces in
D w / l^2, moments in D w / l, angles in rad.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
POSITION, TURN, NUMBER = "position", "turn", "number"
#: What has moved less has not moved.
_STILL = 1e-12


@dataclass(frozen=True)
class LoadPoint:
    """Where a state of a way stands: the keys that vary with their values (in the scene's unit), and what start, end
    and "wall.NAME" exert, force (3,) and moment (3,); one that holds nothing is absent."""

    values: Mapping[str, Any]
    forces: Mapping[str, FloatArray]
    moments: Mapping[str, FloatArray]


@dataclass(frozen=True)
class LoadCurve:
    """The curve of one key: of a `kind` "position", way (n,) gone from the first state and force (n,) along it; "turn",
    angle and moment about its axis; "number", the key's value and the size of the force of `support`. states (n,): the
    numbers of the states that have both."""

    key: str
    kind: str
    support: str
    states: NDArray[np.int64]
    way: FloatArray
    force: FloatArray


def watched(keys: Sequence[str]) -> tuple[str, ...]:
    """The keys whose values tell how what they change has moved: of a clamp's direction both of the frame."""
    found: dict[str, None] = {}
    for key in keys:
        section, _, name = key.rpartition(".")
        turned = section.startswith("clamp.") and name in ("tangent", "normal", "across", "frame")
        found |= dict.fromkeys((f"{section}.tangent", f"{section}.normal") if turned else (key,))
    return tuple(found)


def load_curve_of(stands: Sequence[LoadPoint], length: float) -> LoadCurve | None:
    """The curve of the first key that moves: a held position (the end's before the start's), a wall, a held frame, any
    other number; None where nothing does, or no force is known. length: l in the scene's unit."""
    keys = list(dict.fromkeys(key for stand in stands for key in stand.values))
    for key in sorted(keys, key=_rank):
        rank, section = _rank(key), key.rpartition(".")[0]
        held = (section.removeprefix("clamp."),) if rank < 4 else ("end", "start")
        needed = (f"{section}.normal", f"{section}.tangent") if rank == 3 else (key,)
        for support in held:
            kind = "moments" if rank == 3 else "forces"
            states = [k for k, at in enumerate(stands) if support in getattr(at, kind) and _known(at, needed)]
            if len(states) < 2:
                continue
            there = [stands[k] for k in states]
            values = [np.array([at.values[name] for at in there], dtype=float) for name in needed]
            loads = np.array([getattr(at, kind)[support] for at in there], dtype=float)
            if rank == 4:
                curve = _numbered(values[0], loads)
            else:
                curve = _turned(values[0], values[1], loads) if rank == 3 else _moved(values[0] / length, loads)
            if curve is not None:
                name, kind = (section, TURN) if rank == 3 else (key, POSITION if rank < 3 else NUMBER)
                return LoadCurve(name, kind, support, np.array(states), *curve)
    return None


def _known(stand: LoadPoint, keys: Sequence[str]) -> bool:
    """Whether a state has numbers of these keys: a vector of a place or direction, one number of another."""
    for key in keys:
        value = stand.values.get(key)
        one = isinstance(value, int | float) and not isinstance(value, bool)
        vector = isinstance(value, list | tuple | np.ndarray) and np.shape(value) == (3,)
        if not (vector if _rank(key) < 4 else one):
            return False
    return True


def _rank(key: str) -> int:
    if key.endswith(".position"):
        return 0 if key.startswith("clamp.end") else 1
    if key.startswith(("wall.", "obstacle.")) and key.endswith(".point"):
        return 2
    return 3 if key.startswith("clamp.") and key.endswith((".tangent", ".normal")) else 4


Curve = tuple[FloatArray, FloatArray]


def _moved(places: FloatArray, forces: FloatArray) -> Curve | None:
    """Way gone and force along it, of places (n, 3)."""
    steps = np.diff(places, axis=0)
    sizes = np.linalg.norm(steps, axis=1)
    if sizes.max() < _STILL:
        return None
    directions = _directions(steps, sizes)
    return np.concatenate([[0.0], np.cumsum(sizes)]), np.einsum("ki,ki->k", directions, forces)


def _directions(steps: FloatArray, sizes: FloatArray) -> FloatArray:
    """Unit directions (n, 3) at n states from their n - 1 steps: of the step that led there, of the last that moved
    where none did, of the first one before."""
    moved = np.flatnonzero(sizes >= _STILL)
    latest = np.maximum.accumulate(np.where(sizes >= _STILL, np.arange(len(sizes)), -1))
    chosen = np.concatenate([[moved[0]], np.where(latest < 0, moved[0], latest)])
    return np.asarray(steps[chosen] / sizes[chosen][:, None])


def _turned(normals: FloatArray, tangents: FloatArray, moments: FloatArray) -> Curve | None:
    """Angle gone and moment about the axis, of frames t_x = t_y x t_z, t_y, t_z (n, 3 each)."""
    from scipy.spatial.transform import Rotation  # not before it is needed: it loads half of scipy

    frames = Rotation.from_matrix(np.stack([np.cross(normals, tangents), normals, tangents], axis=2))
    steps = (frames[1:] * frames[:-1].inv()).as_rotvec()
    sizes = np.linalg.norm(steps, axis=1)
    if sizes.max() < 1e-9:
        return None
    directions = _directions(steps, np.where(sizes < 1e-9, 0.0, sizes))
    return np.concatenate([[0.0], np.cumsum(sizes)]), np.einsum("ki,ki->k", directions, moments)


def _numbered(values: FloatArray, forces: FloatArray) -> Curve | None:
    """The values themselves and the sizes of the forces."""
    return None if np.ptp(values) == 0.0 else (values, np.linalg.norm(forces, axis=1))
