"""A scene back to TOML text, every key followed by its unit and meaning. Reading the text gives the same scene."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from compare.scene_keys import KEYS

_ESCAPES = {'"': '\\"', "\\": "\\\\"}


def toml_text(document: Mapping[str, Any]) -> str:
    """The nested dictionary `document` (tables of numbers, texts, truth values and lists of numbers) as TOML."""
    lines: list[str] = []
    _write_table(document, "", lines)
    return "\n".join(lines).strip() + "\n"


def _write_table(table: Mapping[str, Any], path: str, lines: list[str]) -> None:
    plain = {name: value for name, value in table.items() if not isinstance(value, Mapping)}
    if path and plain:
        lines.extend(["", f"[{path}]"])
    for name, value in plain.items():
        dotted = f"{path}.{name}" if path else name
        lines.append(f"{name} = {_literal(value)}  # {KEYS[dotted].meaning}")
    for name, value in table.items():
        if isinstance(value, Mapping):
            inner = f"{path}.{name}" if path else name
            _write_table(value, inner, lines)
            if not value:
                lines.extend(["", f"[{inner}]"])


def _literal(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return '"' + "".join(_ESCAPES.get(letter, letter) for letter in value) + '"'
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_literal(item) for item in value) + "]"
    return repr(value)
