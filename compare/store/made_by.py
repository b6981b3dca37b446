"""Provenance of a result that belongs to a scene."""

from __future__ import annotations

from typing import Any

from compare.scene.scene import Scene
from compare.store.provenance import versions
from compare.store.store import case_key


def provenance(scene: Scene, options: dict[str, Any] | None = None) -> dict[str, Any]:
    """Versions, machine, the scene with its hash, the options of the solver."""
    canonical = scene.canonical()
    return {**versions(), "scene": canonical, "scene_hash": case_key(canonical), "options": options or {}}
