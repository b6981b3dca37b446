"""A scene is data: a TOML file, strictly read into a frozen dataclass, changed by keys, written back."""
