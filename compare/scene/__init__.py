"""A scene is data: a TOML file, strictly read into a frozen dataclass, changed by keys, written back."""

from compare.scene.scene import Scene, load, loads, parse_assignment, shipped

__all__ = ["Scene", "load", "loads", "parse_assignment", "shipped"]
