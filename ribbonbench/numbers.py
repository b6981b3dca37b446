"""What a value is, asked without importing the library that it may come from."""

from __future__ import annotations

import sys
from typing import Any, Protocol, runtime_checkable


@runtime_checkable
class NamedTuple(Protocol):
    """A tuple with names, of whatever class."""

    def _asdict(self) -> dict[str, Any]: ...


def of_numpy(value: Any) -> bool:
    """Whether a value is an array or a scalar of NumPy's. NumPy is not imported: without it, no value is."""
    numpy = sys.modules.get("numpy")
    return numpy is not None and isinstance(value, (numpy.ndarray, numpy.generic))
