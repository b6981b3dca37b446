"""A scene back to TOML text, every key followed by its unit and meaning. Reading the text gives the same scene."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from compare.scene.declare import literal
from compare.scene.keys import KEYS, SECTIONS, contract_name


def toml_text(document: Mapping[str, Any]) -> str:
    """The nested dictionary `document` as TOML.

    Values are numbers, texts, truth values and lists of numbers; a list of tables becomes sections in double brackets.
    """
    lines: list[str] = []
    _write_table(document, "", lines)
    return "\n".join(lines).strip() + "\n"


def _write_table(table: Mapping[str, Any], path: str, lines: list[str]) -> None:
    plain = {name: value for name, value in table.items() if not (isinstance(value, Mapping) or _is_array(value))}
    if path and plain:
        lines.extend(["", f"[{path}]"])
    for name, value in plain.items():
        lines.append(f"{name} = {literal(value)}  # {_meaning(f'{path}.{name}' if path else name, value)}")
    for name, value in table.items():
        inner = f"{path}.{name}" if path else name
        if isinstance(value, Mapping):
            _write_table(value, inner, lines)
            if not value:
                lines.extend(["", f"[{inner}]"])
        elif _is_array(value):
            for entry in value:
                lines.extend(["", f"[[{inner}]]"])
                lines.extend(_entry_line(inner, key, item) for key, item in entry.items())


def _is_array(value: Any) -> bool:
    """An array of tables."""
    return isinstance(value, (list, tuple)) and bool(value) and all(isinstance(item, Mapping) for item in value)


def _entry_line(array: str, key: str, value: Any) -> str:
    """One line of a `[[wall]]` or `[[path]]`; the keys of a path are dotted, so they stand in quotes."""
    if array == "path" and key != "steps":
        return f"{literal(key)} = {literal(value)}  # {_meaning(key, value)}"
    return f"{key} = {literal(value)}  # {_meaning(f'{array}.{key}', value)}"


def _meaning(dotted: str, value: Any) -> str:
    if dotted in SECTIONS and value is False:
        return "absent in this stage"
    return KEYS[contract_name(dotted)].meaning
