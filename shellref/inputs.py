"""Checks of input shared by the shell's problem and options: every error names the key, the value and the remedy."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import fields
from typing import Any, SupportsIndex

FRAME_TOLERANCE = 1e-9

Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]


class ShellInputError(ValueError):
    """A request that cannot be solved as stated.

    Attributes: `key` (the field at fault), `value` (what was given), `remedy` (what would be right).
    """

    def __init__(self, key: str, value: object, remedy: str):
        self.key, self.value, self.remedy = key, value, remedy
        super().__init__(f"{key} = {value!r}: {remedy}")

    def __reduce__(self) -> tuple[Any, ...]:
        # an exception is pickled by its args (the finished line); these are what __init__ takes
        return type(self), (self.key, self.value, self.remedy)


def number(key: str, value: Any, remedy: str = "must be a finite number") -> float:
    """`value` as a finite float."""
    if isinstance(value, (bool, str)):
        raise ShellInputError(key, value, remedy)
    try:
        result = float(value)
    except (TypeError, ValueError) as error:
        raise ShellInputError(key, value, remedy) from error
    if not math.isfinite(result):
        raise ShellInputError(key, value, remedy)
    return result


def positive(key: str, value: Any) -> float:
    """`value` as a finite float > 0."""
    result = number(key, value, "must be a finite number above 0")
    if result <= 0:
        raise ShellInputError(key, value, "must be above 0")
    return result


def integer(key: str, value: Any, least: int) -> int:
    """`value` as an int >= least; floats, booleans and strings are refused."""
    whole = isinstance(value, SupportsIndex) and not isinstance(value, bool)
    if not whole or int(value) < least:
        raise ShellInputError(key, value, f"must be a whole number, {least} or more")
    return int(value)


def numbers(key: str, value: Any, count: int) -> tuple[float, ...]:
    """`value` as a tuple of `count` finite floats."""
    remedy = f"must be {count} finite numbers"
    if isinstance(value, (str, bytes, Mapping)):
        raise ShellInputError(key, value, remedy)
    try:
        items = list(value)
    except TypeError as error:
        raise ShellInputError(key, value, remedy) from error
    if len(items) != count:
        raise ShellInputError(key, value, remedy)
    return tuple(number(key, item, remedy) for item in items)


def choice(key: str, value: Any, known: tuple[str, ...]) -> str:
    """`value`, one of the known words."""
    if value not in known:
        raise ShellInputError(key, value, f"must be one of {', '.join(known)}")
    return str(value)


def frame(key: str, value: Any) -> Matrix:
    """`value` as a right-handed orthonormal 3x3 matrix (rows of tuples; columns t_x, t_y, t_z)."""
    try:
        items = list(value)
    except TypeError as error:
        raise ShellInputError(key, value, "must be a 3x3 matrix with columns t_x, t_y, t_z") from error
    if len(items) != 3:
        raise ShellInputError(key, value, "must be a 3x3 matrix with columns t_x, t_y, t_z")
    m = [numbers(key, row, 3) for row in items]
    for i in range(3):
        for j in range(3):
            product = sum(m[k][i] * m[k][j] for k in range(3))
            if abs(product - (i == j)) > FRAME_TOLERANCE:
                raise ShellInputError(key, value, "its columns t_x, t_y, t_z must be orthonormal to 1e-9")
    determinant = (
        m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1])
        - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
        + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
    )
    if determinant < 0:
        raise ShellInputError(key, value, "is left-handed: t_x must be t_y x t_z")
    return (m[0], m[1], m[2])  # type: ignore[return-value]


def build(cls: Any, section: str, data: Any, required: tuple[str, ...] = ()) -> Any:
    """The dataclass `cls` from the mapping `data`, strictly."""
    if not isinstance(data, Mapping):
        raise ShellInputError(section, data, "must be a table of keys and values")
    known = [f.name for f in fields(cls)]
    for key in data:
        if key not in known:
            raise ShellInputError(f"{section}.{key}", data[key], f"unknown key; known: {', '.join(known)}")
    for key in required:
        if key not in data:
            raise ShellInputError(f"{section}.{key}", None, "is needed")
    return cls(**data)


def plain(value: Any) -> Any:
    """Tuples to lists, recursively."""
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, (tuple, list)):
        return [plain(item) for item in value]
    return value
