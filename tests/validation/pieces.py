"""Results of long measurements, kept piece by piece under out/validate, so that what was interrupted goes on."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from compare.store.store import atomic_write_text
from tests.validation.record import Pages

FOLDER = Path(__file__).resolve().parents[2] / "out" / "validate"


def key(measurement: str) -> str:
    """Digest of all that a measurement depends on; what finds it is a part of that for whoever keeps pieces by it."""
    return Pages().key(measurement)


class Pieces:
    """Plain values (what JSON holds) by name in the folder of one measurement, under the key of all that it depends on:
    after a change of the code nothing is taken from there. by: the module beside it that makes these pieces, where what
    else the measurement does (tables, sentences) gives them no number."""

    def __init__(self, measurement: str, folder: Path = FOLDER, by: str = "") -> None:
        self.folder = folder / measurement / key(by or measurement)

    def get(self, name: str, make: Callable[[], Any]) -> Any:
        """What is kept under `name`, or what `make` gives, kept from then on."""
        path = self.folder / f"{name}.json"
        if not path.exists():
            began = time.perf_counter()
            value = make()
            self.folder.mkdir(parents=True, exist_ok=True)
            atomic_write_text(path, json.dumps(value))
            print(f"  {name}: {time.perf_counter() - began:.1f} s", flush=True)
        return json.loads(path.read_text())
