"""A scene is data: a TOML file, strictly read into a frozen dataclass, changed by keys, written back.

The names are loaded when they are asked for: the help of a command reads rooms beside them, and does without NumPy.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from compare.scene.scene import Scene, load, loads, parse_assignment, shipped

__all__ = ["Scene", "load", "loads", "parse_assignment", "shipped"]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from compare.scene import scene

    return getattr(scene, name)
