"""Replacing keys in the document of a scene of several strips."""

from __future__ import annotations

from typing import Any

from ribbonbench.errors import BadInput


def assign(document: dict[str, Any], dotted: str, value: Any) -> None:
    """Replaces a key: "strip.left.width", "joint.0.angle", "gravity.up"."""
    at: Any = document
    words = dotted.split(".")
    for number, word in enumerate(words[:-1]):
        if isinstance(at, list):
            names = [entry.get("name") for entry in at]
            if word in names:
                at = at[names.index(word)]
            elif word.isdigit() and int(word) < len(at):
                at = at[int(word)]
            else:
                known = ", ".join(str(name) for name in names if name) or f"0 to {len(at) - 1}"
                raise BadInput(dotted, None, f"names no {words[number - 1]}", f"there is {known}")
        else:
            at = at.setdefault(word, {})
    if not isinstance(at, dict):
        raise BadInput(dotted, None, f"names no one of several {words[0]}s", f"say which: {words[0]}.NAME.{words[-1]}")
    if words[-1] in ("tangent", "normal"):  # a frame of another way to say it gives way
        at.pop("frame", None)
    at[words[-1]] = value
