"""The scene contract: every key with its kind, range, unit, default and meaning, as the sections declare it.

The reader takes from here what is right, `Scene.to_toml` its comments, a model the keys that it reads (`within`), and
docs/scenes.md its tables (`compare.pages.keys`).
"""

from __future__ import annotations

from collections.abc import Mapping

from compare.scene.declare import Key, collected, keys_of
from compare.scene.spec import (
    ClampSpec,
    ClosureSpec,
    ContactSpec,
    GravitySpec,
    ModelSpec,
    ObstacleSpec,
    RodSpec,
    SceneSpec,
    SeedSpec,
    ShellSpec,
    StageSpec,
    StripSpec,
    TipSpec,
    UncertaintySpec,
    WallSpec,
)

SHELL = "shell"
"""The section of the shells beside the strip."""

SPECS: Mapping[str, type] = {
    "": SceneSpec,
    "strip": StripSpec,
    "tip": TipSpec,
    "gravity": GravitySpec,
    "clamp.start": ClampSpec,
    "clamp.end": ClampSpec,
    "closure": ClosureSpec,
    "wall": WallSpec,
    "contact": ContactSpec,
    "obstacle": ObstacleSpec,
    "rod": RodSpec,
    "model": ModelSpec,
    "seed": SeedSpec,
    "path": StageSpec,
    SHELL: ShellSpec,
    "uncertainty": UncertaintySpec,
}
"""The sections, each with its dataclass."""

LISTED = ("wall", "obstacle")
"""Sections that a scene has any number of, by number or name."""

SINGLE = tuple(name for name in SPECS if name not in ("", *LISTED, "path"))
"""Sections that a scene has once or not at all."""

KEYS: Mapping[str, Key] = collected(
    keys_of(spec, section, {"clamp.start": "s = 0", "clamp.end": "s = length"}.get(section, ""))
    for section, spec in SPECS.items()
)
"""Every key of the contract that this version reads, by its dotted name."""

SECTIONS = ("clamp.start", "clamp.end", "closure", "gravity", "tip")
"""Sections that a stage of a path can leave out: their value is then false."""

FIXED_ON_PATH = ("title", "path", SHELL, "uncertainty", "contact")
"""What no stage of a path can change."""

FREE = "free"
"""The value of `position` or `frame` of a clamp that does not hold it."""


DEEPEST = 4
"""More dots than any key has: a bound for the nesting of tables."""


def contract_name(dotted: str) -> str:
    """The name in the contract of a key as a scene says it, a wall without its number or name: "wall.roof.point"."""
    section, _, rest = dotted.partition(".")
    return f"{section}.{rest.rpartition('.')[2]}" if section in LISTED and rest else dotted


def within(*parts: str) -> frozenset[str]:
    """All keys of the sections named ("strip", "clamp"), and the keys named; ValueError for what is neither.

    "path" is a name of `Scene.given` too: that the scene has a path.
    """
    found: set[str] = set()
    for part in parts:
        inside = {name for name in KEYS if name == part or name.startswith(f"{part}.")}
        if not inside:
            raise ValueError(f"{part!r} is no key and no section of a scene")
        found |= {"path"} if part == "path" else inside
    return frozenset(found)
