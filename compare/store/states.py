"""States along a path, as a film shows them: arrays, stored as `path.npz` beside the results. Lengths in l."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.store.arrays import npz_bytes
from compare.store.touches import Touches
from ribbonbench.errors import BadInput

FloatArray = NDArray[np.float64]

FILE = "path.npz"
#: Most states that are kept of a path; cells along and across of their surfaces.
MOST = 60
CELLS = (100, 4)
#: Seconds that a film gives to a stage, and least between two states.
STAGE_SECONDS, LEAST_SECONDS = 2.0, 1.0 / 30.0
#: Fields kept with every state: omega in 1/l, energy_density in D / l^2.
FIELDS = ("omega", "energy_density")


@dataclass(frozen=True)
class States:
    """K states of a path, in order: stage (K,), from 1, and t (K,) on the way to it; material coordinates s (k,) and
    v (m,); points (K, k, m, 3) in l; fields: name -> (K, k, m), with the names of `FIELDS`; touches: where each state
    touches something, None where none does."""

    stage: FloatArray
    t: FloatArray
    s: FloatArray
    v: FloatArray
    points: FloatArray
    fields: Mapping[str, FloatArray] = field(default_factory=dict)
    touches: tuple[Touches, ...] | None = None

    @property
    def labels(self) -> list[str]:
        """What each state is called."""
        return [f"stage {stage:g}, t = {t:.3g}" for stage, t in zip(self.stage, self.t, strict=True)]

    @property
    def seconds(self) -> FloatArray:
        """When a film shows each state (K,): from 0, growing, `STAGE_SECONDS` a stage."""
        path = np.where(self.stage > 1.0, self.stage - 2.0 + self.t, 0.0) * STAGE_SECONDS
        times = np.zeros_like(path)
        for k in range(1, len(path)):
            times[k] = max(times[k - 1] + LEAST_SECONDS, times[k - 1] + path[k] - path[k - 1])
        return times

    def arrays(self) -> dict[str, NDArray[Any]]:
        """What `path.npz` holds: stage, t, s, v, seconds, in single precision points and the fields, and where
        something touches, of all states one after another, touch_state, touch_point, touch_push, touch_friction."""
        found = {"stage": self.stage, "t": self.t, "s": self.s, "v": self.v, "seconds": self.seconds}
        if self.touches is not None:
            found["touch_state"] = np.repeat(np.arange(len(self.touches)), [len(one) for one in self.touches])
            for name, values in (("point", "points"), ("push", "push"), ("friction", "friction")):
                found[f"touch_{name}"] = np.concatenate([getattr(one, values) for one in self.touches])
        return found | {"points": self.points.astype("<f4")} | {n: f.astype("<f4") for n, f in self.fields.items()}

    def to_bytes(self) -> bytes:
        """`arrays` as a file."""
        return npz_bytes(self.arrays())


def read_states(path: Path) -> States:
    """The states of a `path.npz`; `BadInput` when it is damaged."""
    try:
        with np.load(path, allow_pickle=False) as data:
            found = states_of(data)
    except (OSError, ValueError, KeyError, EOFError, TypeError) as error:
        raise BadInput("FOLDER", str(path.parent), f"{path.name} cannot be read ({error})", "solve again") from None
    return found


def states_of(data: Mapping[str, NDArray[Any]]) -> States:
    """States from arrays as `States.arrays` gives them; KeyError, ValueError where they are others."""
    stage, t, s, v, points = (np.asarray(data[name], dtype=float) for name in ("stage", "t", "s", "v", "points"))
    fields = {name: np.asarray(data[name], dtype=float) for name in FIELDS if name in data}
    expected = (len(stage), len(s), len(v))
    if points.shape != (*expected, 3) or t.shape != stage.shape or not len(stage) or not np.isfinite(points).all():
        raise ValueError("its arrays do not fit each other")
    if any(values.shape != expected for values in fields.values()):
        raise ValueError("its fields do not fit its points")
    return States(stage, t, s, v, points, fields, _touches_of(data, len(stage)))


def _touches_of(data: Mapping[str, NDArray[Any]], count: int) -> tuple[Touches, ...] | None:
    if "touch_state" not in data:
        return None
    state = np.asarray(data["touch_state"]).astype(int)
    parts = [np.asarray(data[f"touch_{name}"], dtype=float) for name in ("point", "push", "friction")]
    if any(part.shape != (len(state), 3) or not np.isfinite(part).all() for part in parts):
        raise ValueError("its places of contact do not fit each other")
    found = []
    for k in range(count):
        own = state == k
        point, push, friction = (part[own] for part in parts)
        found.append(Touches(point, push, friction, ("",) * int(own.sum())))
    return tuple(found)


class Film:
    """Collects states while a path is gone: of more than `MOST` every second one is let go, but the first and the last
    stay, and the ends of stages while there is room."""

    def __init__(self, width: float, known: States | None = None) -> None:
        self.s = np.linspace(0.0, 1.0, CELLS[0] + 1)
        self.v = np.linspace(-0.5 * width, 0.5 * width, CELLS[1] + 1)
        self._taken: list[tuple[float, float, FloatArray, dict[str, FloatArray], Touches]] = []
        if known is not None:
            for k in range(len(known.stage)):
                fields = {name: values[k] for name, values in known.fields.items()}
                touches = Touches.of(()) if known.touches is None else known.touches[k]
                self._taken.append((float(known.stage[k]), float(known.t[k]), known.points[k], fields, touches))

    def add(
        self,
        stage: int,
        t: float,
        points: FloatArray,
        fields: Mapping[str, FloatArray],
        touches: Touches | None = None,
    ) -> None:
        """A state on the way to `stage` (from 1): points (k, m, 3), fields (k, m) at the particles s x v;
        touches: where it touches something, None: nowhere."""
        kept = {name: np.asarray(fields[name], dtype="<f4") for name in FIELDS if name in fields}
        self._taken.append((float(stage), float(t), points.astype("<f4"), kept, touches or Touches.of(())))
        if len(self._taken) > MOST:
            self._taken = self._thinned(self._taken)

    @staticmethod
    def _thinned(taken: Sequence[Any]) -> list[Any]:
        last = len(taken) - 1
        ends = sum(state[1] == 1.0 for state in taken)
        keep_ends = ends <= MOST // 4
        return [x for k, x in enumerate(taken) if k % 2 == 0 or k == last or (keep_ends and x[1] == 1.0)]

    @property
    def states(self) -> States | None:
        """What was collected; None: nothing."""
        if not self._taken:
            return None
        stage, t, points, fields, touches = zip(*self._taken, strict=True)
        names = [name for name in FIELDS if all(name in one for one in fields)]
        return States(
            np.array(stage), np.array(t), self.s, self.v, np.array(points),
            {name: np.array([one[name] for one in fields]) for name in names},
            tuple(touches) if any(map(len, touches)) else None,
        )  # fmt: skip
