"""The parts of a table: Parquet files of neighbouring cases, written from a journal, whole or not there.

Every function here that reads or writes Parquet is called in a process of its own (`compare.sweep.large.aside`);
pyarrow is imported when it is needed, and given one thread. A part is written beside its place, forced to the disk and
renamed, and the digest of its bytes beside it (.part-000000.sha256). What a part holds follows from its cases alone:
the same cases, the same bytes. Times, which do not, stand beside it in a table of their own.
"""

from __future__ import annotations

import hashlib
import importlib.util
import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from compare.store.store import atomic_write_text
from compare.sweep.case import PASSING
from compare.sweep.journal import value_in
from compare.sweep.large.columns import Field
from compare.sweep.shapes import flat
from ribbonbench.errors import Missing
from ribbonbench.replacing import replacing

if TYPE_CHECKING:
    import pyarrow as pa

#: Rows of a part at least, of all but the last of a small table; and of a group in it, which is read at once.
ROWS, GROUP = 100_000, 25_000
#: Folders of the table, of the times, of the centrelines, of what is not in a part yet.
TABLE, TIMES, SHAPES, JOURNALS = "table", "times", "shapes", "journal"
FORMAT = 1
_HEAD = b"ribbonbench"
_TIMES = (Field("case", "integer"), Field("seconds", "number", "s", "of the whole case"))
_SHAPES = (Field("case", "integer"), Field("shape", "shape", "l", "x y z of places at equal distances, one by one"))


def check_parquet() -> None:
    """`Missing` where Parquet cannot be written here."""
    if importlib.util.find_spec("pyarrow") is None:
        raise Missing("pyarrow, for a table of so many cases,", "pip install 'ribbonbench[table]', or --table csv")


def _arrow() -> Any:
    import pyarrow

    pyarrow.set_cpu_count(1)
    pyarrow.set_io_thread_count(1)
    return pyarrow


@dataclass(frozen=True)
class Layout:
    """What all parts of a table have in common: its columns, and what stands in the schema's metadata.

    key: of the sweep (`compare.sweep.shard.sweep_key`); units: of the dimensionless numbers in SI, None: they differ;
    shapes: points of each centreline that is kept, 0: none.
    """

    key: str
    name: str
    title: str
    solver: str
    fields: tuple[Field, ...]
    units: dict[str, Any] | None
    shapes: int = 0

    @property
    def kinds(self) -> tuple[str, ...]:
        """The tables that a part is made of."""
        return (TABLE, TIMES, SHAPES) if self.shapes else (TABLE, TIMES)

    def schema(self, fields: Sequence[Field]) -> pa.Schema:
        """With units and meanings in the metadata."""
        pa = _arrow()

        def several(of: Any) -> Any:
            return pa.list_(pa.field("element", of))  # as Parquet names it, so that what is read is written as it was

        types = {
            "number": pa.float64(), "integer": pa.int64(), "truth": pa.bool_(), "text": pa.string(),
            "numbers": several(pa.float64()), "json": pa.string(), "shape": several(pa.float32()),
        }  # fmt: skip
        head = {"format": FORMAT, "key": self.key, "sweep": self.name, "title": self.title, "solver": self.solver}
        return pa.schema(
            [
                pa.field(f.key, types[f.kind], metadata={"unit": f.unit, "meaning": f.note, "holds": f.kind})
                for f in fields
            ],
            metadata={_HEAD: json.dumps(head), b"units": json.dumps(self.units)},
        )


def part(folder: Path, kind: str, block: int) -> Path:
    """Where a part stands. kind: `TABLE`, `TIMES` or `SHAPES`."""
    return folder / kind / f"part-{block:06d}.parquet"


def journal(folder: Path, block: int) -> Path:
    """Where the cases of a part stand before it is written."""
    return folder / JOURNALS / f"{block:06d}.jsonl"


def blocks(folder: Path, kind: str = TABLE) -> list[int]:
    """The parts that are there."""
    found = (re.fullmatch(r"part-(\d{6,})\.parquet", path.name) for path in (folder / kind).glob("part-*.parquet"))
    return sorted(int(name[1]) for name in found if name)


# --- from the journal to a part ---------------------------------------------------------------------------------------
def lines_of(path: Path) -> Iterator[dict[str, Any]]:
    """The lines of a journal, without those that are torn or altered."""
    try:
        stream = path.open("rb")
    except FileNotFoundError:
        return
    with stream:
        for raw in stream:
            value = value_in(raw.rstrip(b"\n"))
            if isinstance(value, dict) and "columns" in value:
                yield value


def finished_in(path: Path) -> set[int]:
    """The cases in a journal that are finished for good."""
    found: set[int] = set()
    for line in lines_of(path):
        columns = line["columns"]
        passing = {c for c, status in zip(columns["case"], columns["status"], strict=True) if status in PASSING}
        found -= set(columns["case"])
        found |= set(columns["case"]) - passing
    return found


class _Gathered:
    """The values of columns, chunk by chunk; numbers as arrays."""

    def __init__(self, fields: Sequence[Field]) -> None:
        self.fields = fields
        self.values: dict[str, list[Any]] = {field.key: [] for field in fields}
        self.rows = 0

    def add(self, columns: dict[str, list[Any]]) -> None:
        count = len(columns["case"])
        for field in self.fields:
            values = columns.get(field.key, [None] * count)
            own = self.values[field.key]
            if field.kind == "number":
                own.append(np.array([np.nan if v is None else v for v in values], dtype=float))
            else:
                own.extend(values)
        self.rows += count

    def table(self, schema: pa.Schema) -> pa.Table:
        pa = _arrow()
        arrays = []
        for field, of in zip(self.fields, schema, strict=True):
            values = self.values.pop(field.key)
            if field.kind == "number":
                numbers = np.concatenate(values) if values else np.empty(0)
                arrays.append(pa.array(numbers, of.type, mask=np.isnan(numbers)))
            else:
                arrays.append(pa.array(values, of.type))
        return pa.Table.from_arrays(arrays, schema=schema)


def compact(folder: Path, block: int, layout: Layout) -> None:
    """Writes a part and its times from the journal, and from the part itself where it was there before; the journal
    goes. Where a case was made twice, the later one counts."""
    pa = _arrow()
    table = _Gathered(layout.fields)
    times, shapes = _Gathered(_TIMES), _Gathered(_SHAPES)
    order: list[np.ndarray[Any, Any]] = []
    for number, line in enumerate(lines_of(journal(folder, block)), start=1):
        table.add(line["columns"])
        times.add({"case": [c for c, _ in line["seconds"]], "seconds": [s for _, s in line["seconds"]]})
        order.append(np.full(len(line["columns"]["case"]), number))
        if layout.shapes:
            lines = [flat(text, layout.shapes) for text in line["shapes"]]
            shapes.add({"case": line["columns"]["case"], "shape": lines})
    made = np.concatenate(order) if order else np.empty(0, dtype=int)
    new = {TIMES: (times.table(layout.schema(_TIMES)), None), TABLE: (table.table(layout.schema(layout.fields)), made)}
    if layout.shapes:
        new[SHAPES] = (shapes.table(layout.schema(_SHAPES)), made)
    for kind in reversed(layout.kinds):  # the table last: what it says is there
        found, when = new[kind]
        path = part(folder, kind, block)
        before = whole(path, layout.key)
        if before is not None:
            found = pa.concat_tables([before, found])
            when = None if when is None else np.concatenate([np.zeros(before.num_rows, dtype=int), when])
        write(_sorted(found, when), path)
    journal(folder, block).unlink(missing_ok=True)


def _sorted(table: pa.Table, when: np.ndarray[Any, Any] | None) -> pa.Table:
    """By case, each as it was made last; when: the moment of each row (rows of one case made at once all stay), None:
    the later row."""
    cases = table["case"].to_numpy()
    when = np.arange(len(cases)) if when is None else when
    numbers, place = np.unique(cases, return_inverse=True)
    last = np.zeros(len(numbers), dtype=when.dtype)
    np.maximum.at(last, place, when)
    kept = np.flatnonzero(when == last[place])
    return table.take(kept[np.argsort(cases[kept], kind="stable")])


def sorted_by_case(pieces: Sequence[pa.Table]) -> pa.Table | None:
    """Tables of different cases as one; None where they hold no row."""
    pa = _arrow()
    if not pieces:
        return None
    table = pa.concat_tables(pieces)
    return table.take(np.argsort(table["case"].to_numpy(), kind="stable"))


def write(table: pa.Table, path: Path) -> None:
    """A part: beside its place, forced to the disk, renamed."""
    _arrow()
    from pyarrow import parquet

    words = [field.name for field in table.schema if str(field.type) in ("string", "bool")]
    with replacing(path, sole=True) as stream:
        parquet.write_table(
            table.combine_chunks(), stream, compression="zstd", row_group_size=GROUP, use_dictionary=words,
            write_page_checksum=True,
        )  # fmt: skip
        stream.flush()
        known = [_digest(one) for one in (Path(stream.name), path) if one.exists()]
        atomic_write_text(_sums(path), "".join(f"{digest}\n" for digest in known))


def _sums(path: Path) -> Path:
    """Where the digests stand that a part may have: its own, and that of the one in whose place it comes."""
    return path.with_name(f".{path.stem}.sha256")


def _digest(path: Path) -> str:
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


# --- reading parts ----------------------------------------------------------------------------------------------------
def opened(path: Path, key: str) -> Any:
    """A part as a `ParquetFile` whose pages are checked. ValueError: it is damaged, or of another sweep."""
    pa = _arrow()
    from pyarrow import parquet

    try:
        if _digest(path) not in _sums(path).read_text(encoding="ascii").split():
            raise ValueError("its bytes are not those that were written")
        found = parquet.ParquetFile(path, page_checksum_verification=True)
        head = json.loads((found.schema_arrow.metadata or {}).get(_HEAD, b"{}"))
    except (pa.ArrowException, OSError, ValueError) as error:
        raise ValueError(f"{path.name}: {' '.join(str(error).split())[:120]}") from None
    if head.get("format") != FORMAT or head.get("key") != key:
        found.close()
        raise ValueError(f"{path.name}: of another sweep or version")
    return found


def batches(path: Path, key: str, columns: Sequence[str] | None = None) -> Iterator[pa.Table]:
    """The rows of a part, a group at a time. ValueError: it is damaged."""
    pa = _arrow()
    with opened(path, key) as found:
        try:
            for number in range(found.num_row_groups):
                yield found.read_row_group(
                    number, columns=None if columns is None else list(columns), use_threads=False
                )
        except (pa.ArrowException, OSError) as error:
            raise ValueError(f"{path.name}: {' '.join(str(error).split())[:120]}") from None


def whole(path: Path, key: str) -> pa.Table | None:
    """A part; None where it is not there, or damaged."""
    pa = _arrow()
    if not path.exists():
        return None
    try:
        return pa.concat_tables(list(batches(path, key)))
    except ValueError:
        return None


@dataclass(frozen=True)
class Stock:
    """What a part holds. cases: how many are finished for good; again: whether some are not; fault: why it cannot be
    read, "" where it can."""

    cases: int
    again: bool
    fault: str = ""


def stock(folder: Path, key: str, shapes: bool = False) -> dict[int, Stock]:
    """The parts of a folder; every number of them is looked at where only `case` and `status` are read. shapes: whether
    they have centrelines."""
    found = {}
    for block in blocks(folder):
        try:
            if shapes:
                opened(part(folder, SHAPES, block), key).close()
            cases, again = _finished(part(folder, TABLE, block), key)
            found[block] = Stock(len(cases), again)
        except ValueError as error:
            found[block] = Stock(0, True, str(error))
    return found


def finished_of(folder: Path, block: int, key: str, shapes: bool = False) -> set[int]:
    """The cases of a part that are finished for good; none where it, or with `shapes` their lines, are damaged."""
    try:
        if shapes:
            opened(part(folder, SHAPES, block), key).close()
        return set(_finished(part(folder, TABLE, block), key)[0].tolist())
    except ValueError:
        return set()


def _finished(path: Path, key: str) -> tuple[np.ndarray[Any, Any], bool]:
    cases, passing = [np.empty(0, dtype=np.int64)], [np.empty(0, dtype=np.int64)]
    for rows in batches(path, key, ("case", "status")):
        numbers = rows["case"].to_numpy()
        statuses = rows["status"].to_pylist()
        cases.append(numbers)
        passing.append(numbers[[status in PASSING for status in statuses]])
    again = np.concatenate(passing)
    return np.setdiff1d(np.unique(np.concatenate(cases)), again), again.size > 0
