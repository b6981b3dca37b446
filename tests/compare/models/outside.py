"""Models from outside with effects and fields of their own (`tests.compare.studies.outside.registered` registers them).

Both are arcs of the strip's natural curvature K (over l), in closed form. `Arc` is a surface and says what it
evaluates; `Thread` does not read the strip's width and has no evaluation. Neither has a state without weight.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from compare.models import keys
from compare.models.base import Effect, Energy, Pose, Seconds, Size, State, Status, Variant, pose_of
from compare.models.capabilities import Evaluation
from ribbonbench.errors import BadInput

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


@dataclass(frozen=True)
class Bow:
    """An arc in the plane of x and z, bent downwards."""

    bend: float

    def centreline(self, s: np.ndarray) -> np.ndarray:
        """Positions (k, 3)."""
        k = self.bend
        x, z = (s, 0.0 * s) if k == 0.0 else (np.sin(k * s) / k, (np.cos(k * s) - 1.0) / k)
        return np.column_stack([x, 0.0 * s, z])

    def frames(self, s: np.ndarray) -> np.ndarray:
        """Frames (k, 3, 3)."""
        angle = self.bend * s
        along = np.column_stack([np.cos(angle), 0.0 * s, -np.sin(angle)])
        normal = np.column_stack([np.sin(angle), 0.0 * s, np.cos(angle)])
        return np.stack([np.cross(normal, along), normal, along], axis=2)

    def points(self, s: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Straight across."""
        return self.centreline(s)[:, None, :] + v[None, :, None] * self.frames(s)[:, None, :, 0]

    def pose(self, s: float) -> Pose:
        """Of the centreline."""
        return pose_of(self, s)

    def fields(self, s: np.ndarray, v: np.ndarray) -> dict[str, np.ndarray]:
        """One field whose name files need for themselves, and one whose name has blanks."""
        ones = np.ones((len(s), len(v)))
        return {
            "normal": ones[:, :, None] * self.frames(s)[:, None, :, 1],
            "energy_density": -0.5 * self.bend**2 * s[:, None] * ones,
            "x": 2.0 * s[:, None] * ones,
            "pull of weight": ones[:, :, None] * np.array(PULL),
        }


class Thread:
    """`compare.models.base.Model`."""

    name = "thread"
    presenter = None
    reads = (
        keys.TITLE | keys.inside("strip", "length", "gamma") | keys.NATURAL
        | keys.inside("gravity", "up", "acceleration", "exact") | keys.BOTH_CLAMPS | keys.ENERGY
    )  # fmt: skip
    without_effect: Mapping[str, str] = {
        "strip.width": "a thread has none", "strip.poisson": "it bends in a plane",
    }  # fmt: skip

    def refusal(self, scene):
        return None

    def variants(self, scene):
        return (Variant({}, scene),)

    def ladders(self, scene):
        return ()

    def solve(self, scene, size=None, *, near=None, options=None, say=None):
        if not scene.gamma:
            raise BadInput("strip.gamma", 0.0, "is too light")
        bend = float(scene.curvature[0])
        return State(
            model=self.name, size=size or Size(self.name, (7.0,)), status=Status.CONVERGED, word="converged",
            stable=True, message="it is an arc", energy=Energy(-0.5 * bend**2, constant=0.5 * bend**2),
            shape=Bow(bend), residual=1e-16, iterations=3, error=1e-9, seconds=Seconds(0.25, (0.125,)), unknowns=1,
        )  # fmt: skip

    def refined(self, state):
        return None

    def effects(self, scene):
        return (
            Effect("weight", "a refusal", True, "[gravity]", {"gravity": None, "strip.gamma": None}),
            Effect(
                "natural curvature", "all of its shape", True, "K", {"strip.natural_curvature": None},
                unknowns=1, constraints=0, seconds=2e-6,
            ),
            Effect("being an arc", "nothing else", True, "it is one", fixed="no switch: it is all there is"),
            Effect("walls", "nothing", False, "it passes through them"),
        )  # fmt: skip


class Arc(Thread):
    """The same as a surface."""

    name = "arc"
    reads = Thread.reads | {"strip.width"}
    without_effect: Mapping[str, str] = {"strip.poisson": "it bends in a plane"}

    def evaluation(self, scene):
        return Evaluation("closed", "nothing to solve", 1, 0, 2, "sine and cosine", 1e-5)
