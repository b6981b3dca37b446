"""An `Equilibrium` as arrays, and back: beside its class, and over its fields, so that none can be forgotten.

What is no array stands as JSON text under "about"; the problem is the caller's, who knows the scene it comes from. A
field that is not among what was packed is an error, never a default: a state that is half known is none.
"""

from __future__ import annotations

import dataclasses
import json
import types
import typing
from collections.abc import Mapping
from enum import Enum
from typing import Any, TypeVar

import numpy as np

from ribbon.problems.protocol import Problem
from ribbon.result import Equilibrium, FloatArray

ABOUT = "about"
_PROBLEM = "problem"

T = TypeVar("T", bound=Equilibrium)


def pack(equilibrium: Equilibrium) -> dict[str, FloatArray]:
    """Name -> array of all that is known of an equilibrium but its problem.

    Raises TypeError for a field that holds what cannot be written.
    """
    arrays: dict[str, FloatArray] = {}
    about: dict[str, Any] = {}
    for field in dataclasses.fields(equilibrium):
        value = getattr(equilibrium, field.name)
        if isinstance(value, np.ndarray):
            arrays[field.name] = value
        elif field.name != _PROBLEM:
            about[field.name] = _plain(value, field.name)
    return {**arrays, ABOUT: np.array(json.dumps(about))}


def unpack(arrays: Mapping[str, FloatArray], problem: Problem, kind: type[T] = Equilibrium) -> T:  # type: ignore[assignment]
    """The equilibrium of `pack`, of this problem; exactly what was packed, to the last bit.

    Raises KeyError for a field that is missing, ValueError or TypeError for one that is damaged.
    """
    about = json.loads(str(arrays[ABOUT]))
    hints = typing.get_type_hints(kind)
    values: dict[str, Any] = {_PROBLEM: problem}
    for field in dataclasses.fields(kind):
        if field.name in arrays:
            values[field.name] = arrays[field.name]
        elif field.name != _PROBLEM:
            values[field.name] = _made(hints[field.name], about[field.name], field.name)
    return kind(**values)


def _plain(value: Any, name: str) -> Any:
    """A value as JSON knows it; TypeError names the field whose value is none such."""
    if isinstance(value, np.generic):
        value = value.item()
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, Enum):
        return value.name
    if dataclasses.is_dataclass(value):
        return {one.name: _plain(getattr(value, one.name), f"{name}.{one.name}") for one in dataclasses.fields(value)}
    if isinstance(value, np.ndarray):
        return {"array": value.tolist(), "dtype": str(value.dtype)}
    if isinstance(value, list | tuple):
        return [_plain(one, name) for one in value]
    if isinstance(value, Mapping) and all(isinstance(key, str) for key in value):
        return {key: _plain(one, f"{name}.{key}") for key, one in value.items()}
    raise TypeError(f"{name} holds a {type(value).__name__}, which cannot be written")


def _made(kind: Any, value: Any, name: str) -> Any:
    """The value of a field of type `kind` from what `_plain` made of it."""
    origin, parts = typing.get_origin(kind), typing.get_args(kind)
    if kind is Any or kind is object:
        return value
    if origin in (typing.Union, types.UnionType):
        if value is None and type(None) in parts:
            return None
        return _made(next(one for one in parts if one is not type(None)), value, name)
    if origin is tuple:
        kinds = [parts[0]] * len(value) if parts[1:] == (...,) else parts
        return tuple(_made(one, each, name) for one, each in zip(kinds, value, strict=True))
    if origin is np.ndarray:
        return np.array(value["array"], dtype=value["dtype"])
    if origin is dict:
        return {key: _made(parts[1], each, f"{name}.{key}") for key, each in value.items()}
    if isinstance(kind, type) and issubclass(kind, Enum):
        return kind[value]
    if dataclasses.is_dataclass(kind):
        hints = typing.get_type_hints(kind)
        fields = dataclasses.fields(kind)
        return kind(**{one.name: _made(hints[one.name], value[one.name], f"{name}.{one.name}") for one in fields})  # type: ignore[operator]
    if kind is float and isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    if isinstance(kind, type) and isinstance(value, kind):
        return value
    raise TypeError(f"{name} is {value!r}, which is no {kind}")
