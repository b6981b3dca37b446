"""Models from outside: a distribution of their own in a folder, found by its entry points as if a user installed it.

Both are arcs of the strip's natural curvature K (over l), in closed form. "arc" is a surface and says what it
evaluates; "thread" does not read the strip's width and has no evaluation. Neither has a state without weight.
"""

from __future__ import annotations

import contextlib
import importlib
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from compare import registry

#: A scene of these models: K = 1, so that the arc's height is 1 - cos 1 and its end stands at sin 1.
SCENE = """
title = "An arc"
[strip]
length = 2.0
width = 0.2
poisson = 0.3
natural_curvature = 0.5
gamma = 3.0
[gravity]
up = [0.0, 0.0, 1.0]
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
[model]
energy = "{energy}"
"""
PULL = (0.0, 0.0, -3.0)

_MODULE = """
import numpy as np

from compare.errors import BadInput
from compare.models.base import Effect, Energy, Evaluation, Seconds, Size, State, Status, Variant, pose_of


class Bow:
    def __init__(self, curvature):
        self.curvature, self.bend = curvature, abs(curvature)

    def centreline(self, s):
        k, s = self.curvature, np.asarray(s, dtype=float)
        x, z = (s, 0.0 * s) if k == 0.0 else (np.sin(k * s) / k, (np.cos(k * s) - 1.0) / k)
        return np.column_stack([x, 0.0 * s, z])

    def frames(self, s):
        angle, zero = self.curvature * np.asarray(s, dtype=float), 0.0 * np.asarray(s)
        along = np.column_stack([np.cos(angle), zero, -np.sin(angle)])
        normal = np.column_stack([np.sin(angle), zero, np.cos(angle)])
        return np.stack([np.cross(normal, along), normal, along], axis=2)

    def points(self, s, v):
        return self.centreline(s)[:, None, :] + v[None, :, None] * self.frames(s)[:, None, :, 0]

    def pose(self, s):
        return pose_of(self, s)

    def fields(self, s, v):
        ones = np.ones((len(s), len(v)))
        return {
            "normal": ones[:, :, None] * self.frames(s)[:, None, :, 1],
            "energy_density": -0.5 * self.curvature**2 * s[:, None] * ones,
            "x": 2.0 * s[:, None] * ones,
            "pull of weight": ones[:, :, None] * np.array([0.0, 0.0, -3.0]),
        }


class Thread:
    name = "thread"
    presenter = None
    wing = ()
    reads = frozenset(
        {"title", "strip.length", "strip.natural_curvature", "strip.gamma", "gravity.*", "clamp.*", "model.energy"}
    )
    without_effect = {"strip.width": "a thread has none", "strip.poisson": "it bends in a plane"}

    def refusal(self, scene):
        return None

    def variants(self, scene):
        return (Variant({}, scene),)

    def ladders(self, scene):
        return ()

    def solve(self, scene, size=None, *, near=None, options=None, say=None):
        if not scene.gamma:
            raise BadInput("strip.gamma", 0.0, "is too light")
        curvature = float(scene.curvature[0])
        return State(
            model=self.name, size=size or Size(self.name, (7.0,)), status=Status.CONVERGED, word="converged",
            stable=True, message="it is an arc", energy=Energy(-0.5 * curvature**2, constant=0.5 * curvature**2),
            shape=Bow(curvature), residual=1e-16, iterations=3, error=1e-9, seconds=Seconds(0.25, (0.125,)), unknowns=1,
        )

    def refined(self, state):
        return None

    def effects(self, scene):
        return (
            Effect("weight", "a refusal", True, "[gravity]", {"gravity": None, "strip.gamma": None}),
            Effect("natural curvature", "all of its shape", True, "K", {"strip.natural_curvature": None},
                   unknowns=1, constraints=0, seconds=2e-6),
            Effect("being an arc", "nothing else", True, "it is one", fixed="no switch: it is all there is"),
            Effect("walls", "nothing", False, "it passes through them"),
        )


class Arc(Thread):
    name = "arc"
    reads = Thread.reads | {"strip.width"}
    without_effect = {"strip.poisson": "it bends in a plane"}

    def evaluation(self, scene):
        return Evaluation("closed", "nothing to solve", 1, 0, 2, "sine and cosine", 1e-5)
"""


def arc(s: np.ndarray) -> np.ndarray:
    """Positions (k, 3) of the arc of `SCENE` at abscissae s (k,), over l."""
    return np.column_stack([np.sin(s), 0.0 * s, np.cos(s) - 1.0])


def _forget() -> None:
    registry.entries.cache_clear()
    registry.model.cache_clear()
    sys.modules.pop("bows", None)
    importlib.invalidate_caches()


@contextlib.contextmanager
def installed(folder: Path) -> Iterator[None]:
    """The distribution `bows` in `folder`, on the Python path and known to the registry."""
    (folder / "bows-1.0.dist-info").mkdir(parents=True)
    (folder / "bows.py").write_text(_MODULE)
    (folder / "bows-1.0.dist-info" / "METADATA").write_text("Metadata-Version: 2.1\nName: bows\nVersion: 1.0\n")
    points = "[ribbonbench.models]\narc = bows:Arc\nthread = bows:Thread\n"
    (folder / "bows-1.0.dist-info" / "entry_points.txt").write_text(points)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(folder))
        _forget()
        try:
            yield
        finally:
            _forget()
    _forget()
