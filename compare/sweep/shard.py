"""A part of a sweep for one job of many: which cases it takes, and what tells it from parts of other sweeps.

A case goes by the hash of its varied values alone, so that every job knows its own without asking another, whatever
version made it and whatever else is in the grid.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from compare.store.store import atomic_write_json, canonical_json, case_key
from compare.studies.axes import Grid
from compare.sweep.file import Sweep
from ribbonbench.errors import BadInput

#: The file of a folder of results that says whose it is, and its format.
IDENTITY, FORMAT = "sweep.json", 1
#: Most parts of a sweep.
MOST = 1_000_000
_KIND = "ribbonbench sweep"


@dataclass(frozen=True)
class Shard:
    """Part `number` (from 1) of `of`."""

    number: int = 1
    of: int = 1

    @classmethod
    def parse(cls, text: str) -> Shard:
        """From "3/64". `BadInput` for anything else."""
        found = re.fullmatch(r"(\d{1,7})/(\d{1,7})", text.strip())
        if found is None or not 1 <= int(found[1]) <= int(found[2]) <= MOST:
            raise BadInput("--shard", text, "is no part of a whole", "give e.g. 3/64: the third of 64, from 1/64 on")
        return cls(int(found[1]), int(found[2]))

    def __str__(self) -> str:
        return f"{self.number}/{self.of}"

    @property
    def whole(self) -> bool:
        """All cases are in it."""
        return self.of == 1

    def takes(self, values: Mapping[str, Any]) -> bool:
        """Whether the case with these values of the varied keys is in it."""
        return self.whole or _place(values) % self.of == self.number - 1


def _place(values: Mapping[str, Any]) -> int:
    text = json.dumps(values, sort_keys=True) if _plain(values) else canonical_json(values)
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "big")


def _plain(values: Mapping[str, Any]) -> bool:
    return all(type(value) in (float, int, str, bool) for value in values.values())


@dataclass(frozen=True)
class Identity:
    """Whose a folder of results is. key: of the sweep with all that determines its table; table: "csv" or "parquet";
    rows: of a part of the table."""

    key: str
    name: str
    cases: int
    shard: Shard
    table: str
    rows: int

    def write(self, folder: Path) -> None:
        """Into a folder of results."""
        atomic_write_json(
            folder / IDENTITY,
            {
                "kind": _KIND, "format": FORMAT, "key": self.key, "sweep": self.name, "cases": self.cases,
                "shard": str(self.shard), "table": self.table, "rows": self.rows,
            },
        )  # fmt: skip


def identity_of(folder: Path, option: str) -> Identity | None:
    """Of a folder of results; None: it has none. `BadInput` names `option` where the file is damaged."""
    try:
        found = json.loads((folder / IDENTITY).read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    except (OSError, ValueError):
        found = None
    try:
        if found["kind"] != _KIND or found["format"] != FORMAT:
            raise ValueError
        return Identity(
            str(found["key"]), str(found["sweep"]), int(found["cases"]), Shard.parse(found["shard"]),
            str(found["table"]), int(found["rows"]),
        )  # fmt: skip
    except (TypeError, KeyError, ValueError, BadInput):
        raise BadInput(
            option, folder.name or ".", f"its {IDENTITY} is damaged, or of another version", "run that one again"
        ) from None


def sweep_key(sweep: Sweep, grid: Grid, digest: str) -> str:
    """What determines the table of a sweep: scene, axes, solver, options, versions and sources (`digest`)."""
    axes = [{"keys": axis.keys, "values": axis.values} for axis in grid.axes]
    return case_key("sweep", FORMAT, sweep.solver, sweep.options, sweep.scene.canonical(), axes, digest)


def joinable(folders: Sequence[str], mine: Identity) -> list[tuple[Path, Identity]]:
    """The folders with the shards of a sweep. `BadInput` for one that holds none, or a shard of another sweep or
    version, or of another count of parts than the first."""
    found: list[tuple[Path, Identity]] = []
    for name in folders:
        folder = Path(name)
        own = identity_of(folder, "--join") if folder.is_dir() else None
        if own is None:
            problem = f"holds no shard of a sweep (no {IDENTITY} in it)" if folder.is_dir() else "is no folder"
            raise BadInput("--join", name, problem, "give the --out folders of ribbonbench sweep ... --shard K/N")
        if own.key != mine.key:
            what = "of other sources, or of another grid, option or version" if own.name == mine.name else own.name
            raise BadInput(
                "--join", name, f"is a shard of another sweep ({what})", "join with the command that made the shards"
            )
        if found and own.shard.of != found[0][1].shard.of:
            raise BadInput(
                "--join", name, f"is part {own.shard}, and the first one is {found[0][1].shard}",
                "give parts of one division",
            )  # fmt: skip
        if own.table != mine.table:
            raise BadInput("--join", name, f"has a table in {own.table}", f"give --table {own.table}")
        if any(own.shard == other.shard for _, other in found):
            raise BadInput("--join", name, f"is part {own.shard} a second time", "give each part once")
        found.append((folder, own))
    return found
