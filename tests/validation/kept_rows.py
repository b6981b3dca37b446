"""Rows of a page, each kept as soon as it is known: an interrupted measurement goes on where it was."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from compare.store.provenance import software
from compare.store.store import atomic_write_json, case_key, read_json


@dataclass(frozen=True)
class KeptRows:
    """JSON objects by name in the folder `place`."""

    place: Path

    @classmethod
    def of(cls, place: Path, *entries: str) -> KeptRows:
        """In a folder of `place` that belongs to the code behind the modules `entries`."""
        return cls(place / f"rows_{case_key(software(*entries))[:12]}")

    def has(self, name: str) -> bool:
        """Whether this row is known."""
        return self._file(name).is_file()

    def row(self, name: str, make: Callable[[], dict[str, Any]]) -> dict[str, Any]:
        """The row of this name, made if it is not known, and as it is read back."""
        file = self._file(name)
        if not file.is_file():
            atomic_write_json(file, make())
        return dict(read_json(file))

    def _file(self, name: str) -> Path:
        return self.place / f"{name}.json"
