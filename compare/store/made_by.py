"""Provenance of a result that belongs to a scene."""

from __future__ import annotations

from typing import Any, Protocol

from compare.store.provenance import versions
from compare.store.store import case_key

#: Where the provenance of a page holds that of the process a shell was solved in.
SHELL_RUN = "shell"


class Canonical(Protocol):
    """What says all that can influence a result, as plain data: a scene (`compare.scene`)."""

    def canonical(self) -> dict[str, Any]: ...


def provenance(scene: Canonical, options: dict[str, Any] | None = None) -> dict[str, Any]:
    """Versions, machine, the scene with its hash, the options of the solver."""
    canonical = scene.canonical()
    return {**versions(), "scene": canonical, "scene_hash": case_key(canonical), "options": options or {}}
