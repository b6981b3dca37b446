"""Scenes of cases: a shipped one with keys replaced."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from compare.models.base import Options
from compare.scene.scene import Scene, load

if TYPE_CHECKING:
    from compare.models.base import State

#: Without a number of elements they are placed for the error that goes without saying (`model.tolerance`).
PLACED: Mapping[str, Any] = {"model.elements": None}


def changed(name: str, keys: Mapping[str, Any], placed: bool = False) -> Scene:
    """The shipped scene `name` with `keys` replaced; placed: its elements placed by an error estimate."""
    return load(name).replace({**(PLACED if placed else {}), **keys})


def solved(scene: Scene, leave_saddle: bool = False) -> State:
    """The state of the scene's own model."""
    from compare.models import solve

    return solve(scene, options=Options(leave_saddle=leave_saddle))
