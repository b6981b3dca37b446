"""No number that is not finite leaves without a name: what stands for it in result.json, and why.

JSON has no word for NaN and infinities. They are null there, and beside the key whose value holds one stands KEY_why:
the reason that the result gives itself, or that its number is not finite. A null alone is what a scene does not have.
"""

from __future__ import annotations

from typing import Any

from compare.store.store import plain

#: The reason where a result gives none.
NOT_FINITE = "not a finite number"
_MARK: dict[str, Any] = {}


def explained(value: Any) -> Any:
    """`compare.store.store.jsonable` of a result, with KEY_why beside each key whose value, or a list in it, holds a
    number that is not finite."""
    return _named(plain(value, lambda number: _MARK))[0]


def _named(value: Any) -> tuple[Any, bool]:
    """A plain value with None for every mark, and whether a mark stood in it outside of any mapping."""
    if value is _MARK:
        return None, True
    if isinstance(value, list):
        parts = [_named(part) for part in value]
        return [part for part, _ in parts], any(marked for _, marked in parts)
    if not isinstance(value, dict):
        return value, False
    found: dict[str, Any] = {}
    for key, item in value.items():
        found[key], marked = _named(item)
        if marked and not value.get(f"{key}_why"):
            found[f"{key}_why"] = NOT_FINITE
    return found, False
