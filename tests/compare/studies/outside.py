"""A model from outside, for tests: an arc of the strip's natural curvature, with an error that falls with order 2.

`Arc` has what every model must have, and refines; `Coarse` does not; `Apart` says that every solve is a process of its
own. `registered` puts them among the models as an installed distribution does: by entry points.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from compare import registry
from compare.models import keys
from compare.models.base import BESIDE, Energy, Ladder, Options, Pose, Seconds, Size, State, Status, Variant, pose_of
from compare.models.timing import clocked

SIZES = (4, 8, 16, 32)


@dataclass(frozen=True)
class ArcShape:
    """An arc of curvature (1 + 1 / count^2) `curvature` (1/l) in the plane of t_y and t_z."""

    count: int
    position: np.ndarray
    frame: np.ndarray
    curvature: float

    @property
    def bend(self) -> float:
        """Its curvature, 1/l."""
        return self.curvature * (1.0 + self.count**-2.0)

    def centreline(self, s: np.ndarray) -> np.ndarray:
        """Positions (k, 3)."""
        k = self.bend
        along, across = np.sin(k * s) / k, (1.0 - np.cos(k * s)) / k
        return self.position + along[:, None] * self.frame[:, 2] + across[:, None] * self.frame[:, 1]

    def frames(self, s: np.ndarray) -> np.ndarray:
        """Frames (k, 3, 3)."""
        x, y, z = self.frame.T
        sine, cosine = np.sin(self.bend * s)[:, None], np.cos(self.bend * s)[:, None]
        return np.stack([np.broadcast_to(x, (s.size, 3)), cosine * y - sine * z, cosine * z + sine * y], axis=2)

    def points(self, s: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Straight across."""
        return self.centreline(s)[:, None, :] + v[None, :, None] * self.frame[:, 0]

    def pose(self, s: float) -> Pose:
        """Of the centreline."""
        return pose_of(self, s)

    def fields(self, s: np.ndarray, v: np.ndarray) -> dict[str, np.ndarray]:
        """The normal."""
        return {"normal": np.broadcast_to(self.frames(s)[:, None, :, 1], (s.size, v.size, 3))}


class Arc:
    """`compare.models.base.Model` without a `reference` of its own."""

    name = "arc"
    reads = keys.STRIP | keys.WEIGHT | keys.OVER_THE_SURFACE | keys.BOTH_CLAMPS | keys.MODEL | keys.SEED | keys.SHELL
    without_effect: Mapping[str, str] = {}
    presenter = None

    def refusal(self, scene):
        return None

    def variants(self, scene):
        return (Variant({}, scene),)

    def ladders(self, scene):
        return (Ladder(self.name, tuple(Size(self.name, (float(n),)) for n in SIZES)),)

    def solve(self, scene, size=None, *, near=None, options=None, say=None) -> State:
        options = options or Options()
        count = 8 if size is None else int(size.values[0])
        bend = scene.curvature[0] or 1.0
        shape, seconds = clocked(lambda: ArcShape(count, scene.position, scene.frame, bend), options.repeats)
        return State(
            model=self.name, size=Size(self.name, (float(count),)), status=Status.CONVERGED, word="converged",
            stable=True, message="", energy=Energy(elastic=-0.5 * bend**2), shape=shape, seconds=seconds,
            unknowns=count, error=count**-2.0 if options.error else None, start=BESIDE if near else "own",
        )  # fmt: skip

    def refined(self, state: State) -> State | None:
        finer = replace(state.shape, count=2 * state.shape.count)
        return replace(state, shape=finer, size=Size(self.name, (float(finer.count),)))

    def effects(self, scene):
        return ()


class Coarse(Arc):
    name = "coarse"

    def refined(self, state):
        return None


class Apart(Coarse):
    """A solve of 1/count s in a process that adds 0.25 s."""

    name = "apart"
    calls = 0

    def solve(self, scene, size=None, **more) -> State:
        state = super().solve(scene, size, **more)
        type(self).calls += 1
        first = 1.0 / state.unknowns
        return replace(state, seconds=Seconds(first, process=first + 0.25))


@contextlib.contextmanager
def registered(folder: Path, *classes: type) -> Iterator[None]:
    """These classes among the models, for this process and for those that it starts."""
    place = folder / "arc_for_tests-1.0.dist-info"
    place.mkdir(parents=True)
    (place / "METADATA").write_text("Metadata-Version: 2.1\nName: arc-for-tests\nVersion: 1.0\n")
    lines = [f"{one.name} = {one.__module__}:{one.__name__}" for one in classes]
    (place / "entry_points.txt").write_text("\n".join([f"[{registry.GROUP}]", *lines, ""]))
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(folder))
        path = [str(folder), str(Path(__file__).resolve().parents[3]), os.environ.get("PYTHONPATH", "")]
        patch.setenv("PYTHONPATH", os.pathsep.join(p for p in path if p))
        forget()
        try:
            yield
        finally:
            forget()


def forget() -> None:
    """What the registry has found is looked for again."""
    registry.entries.cache_clear()
    registry.model.cache_clear()
