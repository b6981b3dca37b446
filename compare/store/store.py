"""Where results live: atomic files, folders of finished cases found again by what determines them, provenance.

Three promises:

- a file or a case folder is either complete or not there (written beside its place, then renamed);
- a case is found again only under the SHA-256 of everything that determines it, and only while every file of it is
  still what was written (sizes and digests stand in its manifest), otherwise it is made anew;
- no file names a path of the machine it was made on.

Only the standard library is imported here, so that reading a stored result never loads a solver.
"""

from __future__ import annotations

import contextlib
import dataclasses
import enum
import errno
import hashlib
import json
import math
import os
import re
import shutil
import socket
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import Any

from compare.store.provenance import now
from ribbonbench import system
from ribbonbench.errors import BadInput
from ribbonbench.numbers import NamedTuple, of_numpy
from ribbonbench.replacing import replacing, umask

MANIFEST = "case.json"
"""Name of the file that makes a case folder complete: key, time, and size and SHA-256 of every other file."""

_PARTIAL = ".partial"  # folder under the store's root where cases are written before they are renamed
_PARTIAL_AGE = 7 * 86400.0  # s; leftovers of another machine, and what nobody went on with, are removed after this time
_UNFINISHED = ".unfinished"  # folder under the store's root where cases keep what they need to go on
_WAYS = ".ways"  # folder under the store's root where interrupted ways of the ribbon keep their place
_BUSY = ".busy"  # folder with the lock of a folder of results, held by the run that writes there
_LOCK = "lock"  # file of an unfinished case, locked by whoever works on it
_POLL = 0.2  # s between two looks at a lock that another process holds


_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def disk_full(error: BaseException) -> OSError | None:
    """The error of a disk that takes nothing more (or a quota, or a limit on files), in `error` or behind it."""
    seen: set[int] = set()
    found: BaseException | None = error
    while found is not None and id(found) not in seen:
        if isinstance(found, OSError) and found.errno in _FULL:
            return found
        seen.add(id(found))
        found = found.__cause__ or found.__context__
    return None


# ---------------------------------------------------------------------------------------------------------------------
# Values to JSON


def jsonable(value: Any) -> Any:
    """`value` in terms of dict, list, str, int, float, bool and None, ready for strict JSON.

    Dataclasses and named tuples become objects, enumerations their value if that is text and their name otherwise,
    NumPy scalars and arrays numbers and nested lists, paths text, sets sorted lists. NaN and infinities become None
    (JSON has no word for them). Anything else raises TypeError: nothing is stored as an unreadable ``repr``.
    """
    return plain(value, lambda number: None)


def canonical_json(value: Any) -> str:
    """One spelling per value: sorted keys, no blanks, floats by ``repr``; NaN and infinities keep their names."""
    spelled = plain(value, lambda number: {"nonfinite": repr(number)})
    return json.dumps(spelled, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)


def plain(value: Any, nonfinite: Callable[[float], Any]) -> Any:
    """`jsonable` where `nonfinite` says what stands for NaN, inf and -inf."""
    kind = type(value)
    if kind is str or kind is int or kind is bool or value is None:  # nearly all
        return value
    if kind is float:
        return value if math.isfinite(value) else nonfinite(value)
    if isinstance(value, enum.Enum):  # before int and str: IntEnum and StrEnum are both
        return value.value if isinstance(value.value, str) else value.name
    if value is None or isinstance(value, bool | str):
        return str(value) if isinstance(value, str) else value  # str(): numpy.str_ is a str too
    if isinstance(value, int):
        return int(value)
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else nonfinite(float(value))
    if isinstance(value, PurePath):
        return str(value)
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {f.name: plain(getattr(value, f.name), nonfinite) for f in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        items: dict[str, Any] = {}
        for key, item in value.items():
            name = key if type(key) is str else plain(key, nonfinite)
            name = name if isinstance(name, str) else json.dumps(name, sort_keys=True)
            if name in items:
                raise TypeError(f"two keys of a mapping read {name!r} in JSON")
            items[name] = plain(item, nonfinite)
        return items
    if of_numpy(value):
        listed = value.tolist()
        if of_numpy(listed):  # e.g. numpy.longdouble: tolist() returns itself
            listed = float(listed)
        return plain(listed, nonfinite)
    if isinstance(value, NamedTuple):
        return {name: plain(item, nonfinite) for name, item in value._asdict().items()}
    if isinstance(value, list | tuple):
        return [plain(item, nonfinite) for item in value]
    if isinstance(value, set | frozenset):
        return sorted((plain(item, nonfinite) for item in value), key=lambda item: json.dumps(item, sort_keys=True))
    raise TypeError(f"no JSON form for {type(value).__module__}.{type(value).__qualname__}")


# ---------------------------------------------------------------------------------------------------------------------
# Files


def atomic_write_bytes(path: str | os.PathLike[str], data: bytes) -> Path:
    """Write `data` to `path` so that a reader sees the old file or the whole new one; parents are created."""
    with replacing(path) as stream:
        stream.write(data)
    return Path(path)


def atomic_write_text(path: str | os.PathLike[str], text: str) -> Path:
    """`atomic_write_bytes` for UTF-8 text."""
    return atomic_write_bytes(path, text.encode("utf-8"))


def atomic_write_json(path: str | os.PathLike[str], value: Any) -> Path:
    """`atomic_write_text` of `jsonable(value)`, indented, keys in the order given, newline at the end."""
    return atomic_write_text(path, json.dumps(jsonable(value), indent=2, ensure_ascii=False, allow_nan=False) + "\n")


def read_json(path: str | os.PathLike[str]) -> Any:
    """The value stored in a JSON file."""
    return json.loads(Path(path).read_text(encoding="utf-8"))


def check_writable(out: str | os.PathLike[str], key: str = "--out") -> Path:
    """The folder `out`, created with its parents and proved writable by writing; otherwise `BadInput` names `key`.

    Permission bits alone say nothing (root, read-only file systems, quotas), so a file is really made, and removed.
    When it fails, folders created on the way are removed again.
    """
    folder = Path(out).expanduser()
    created: list[Path] = []
    try:
        for parent in [*reversed(folder.parents), folder]:
            if not parent.is_dir():
                parent.mkdir(exist_ok=True)
                created.append(parent)
        with tempfile.NamedTemporaryFile(prefix=".ribbonbench-", dir=folder) as probe:
            probe.write(b"probe")
            probe.flush()
    except (OSError, ValueError) as error:
        for parent in reversed(created):
            with contextlib.suppress(OSError):
                parent.rmdir()
        if disk_full(error) is not None:
            raise
        raise BadInput(key, str(out), *_why_not_writable(folder, error)) from None
    return folder


def _why_not_writable(folder: Path, error: OSError | ValueError) -> tuple[str, str]:
    """(problem, remedy) for an output folder that could not be made or written to."""
    if not isinstance(error, OSError):  # e.g. a null byte in the path
        return f"not a usable path ({error})", "give the path of a folder"
    for parent in [folder, *folder.parents]:
        with contextlib.suppress(OSError):
            if parent.exists() and not parent.is_dir():
                return f"{str(parent)!r} is a file, not a folder", "give another folder or move the file away"
    reason = os.strerror(error.errno).lower() if error.errno else str(error)
    if error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
        return f"the folder cannot be written ({reason})", "give a folder you may write to"
    return f"the folder cannot be written ({reason})", "give another folder"


# ---------------------------------------------------------------------------------------------------------------------
# Cases


def case_key(*parts: Any) -> str:
    """SHA-256 (64 hexadecimal digits) of the canonical JSON of `parts`: scene, options, versions, in that order."""
    return hashlib.sha256(canonical_json(list(parts)).encode("utf-8")).hexdigest()


@dataclass(frozen=True)
class Unfinished:
    """What is kept of a case that is being made: a folder for checkpoints, and the descriptor of its lock.

    The lock ends with the last process that has the descriptor open: a child that inherits it holds it too.
    """

    folder: Path
    lock: int


class CaseStore:
    """Finished cases under `root`, one folder each, named by `case_key`.

    Several processes may use one store: the first to finish a case wins, the others take its folder.
    """

    def __init__(self, root: str | os.PathLike[str]) -> None:
        self.root = Path(root)

    def get(self, key: str, damaged: Callable[[str], object] | None = None) -> Path | None:
        """The folder of the case, or None if there is none, or it is incomplete or altered: `damaged` is told that."""
        folder = self._folder(key)
        if _intact(folder, key):
            return folder
        if damaged is not None and folder.exists():
            damaged("what is stored of this case is damaged: it is computed again")
        return None

    def put(self, key: str, writer: Callable[[Path], object]) -> Path:
        """Let `writer` fill an empty folder, then make it the case of `key`; returns the folder at its final place.

        If `writer` raises, nothing is stored and the exception passes. An intact case already there is kept (the
        key stands for everything that determines it); a damaged one is replaced.
        """
        final = self._folder(key)
        partial = self._place(_PARTIAL)
        self._sweep()
        work = Path(tempfile.mkdtemp(prefix=f"{_owner()}.", dir=partial))
        try:
            os.chmod(work, 0o777 & ~umask())
            writer(work)
            manifest = {"key": key, "finished": now(), "files": _digests(work)}
            atomic_write_json(work / MANIFEST, manifest)
            for _ in range(5):
                try:
                    os.rename(work, final)
                    return final
                except OSError as error:
                    if error.errno not in (errno.ENOTEMPTY, errno.EEXIST, errno.ENOTDIR):
                        raise
                if _intact(final, key):  # another process was faster
                    return final
                aside = Path(tempfile.mkdtemp(prefix=f"{_owner()}.", dir=partial)) / "damaged"
                with contextlib.suppress(FileNotFoundError):
                    os.rename(final, aside)
                shutil.rmtree(aside.parent, ignore_errors=True)
            raise OSError(errno.EBUSY, f"case {key[:12]} is being replaced by other processes again and again")
        finally:
            shutil.rmtree(work, ignore_errors=True)

    @contextlib.contextmanager
    def unfinished(self, key: str, waiting: Callable[[], object] | None = None) -> Iterator[Unfinished]:
        """The case's folder for checkpoints, locked: one process at a time works on a case.

        It is removed when the block ends without an exception (the case is finished) or nothing but the lock is in it,
        and kept otherwise, also when the process is killed: the next one goes on from it. `waiting` is called once if
        another process works on the case; look at `get` again after that.
        """
        folder = self._place(_UNFINISHED) / self._folder(key).name
        handle = _locked(folder, waiting)
        finished = False
        try:
            yield Unfinished(folder, handle)
            finished = True
        finally:
            if finished or {path.name for path in folder.iterdir()} <= {_LOCK}:
                shutil.rmtree(folder, ignore_errors=True)
            os.close(handle)

    def way(self, key: str) -> Path:
        """Where an interrupted way of this key keeps its place: a folder of its own, which need not be there yet."""
        return self.root / _WAYS / self._folder(key).name

    def size(self) -> tuple[int, int]:
        """Finished cases, and bytes of everything in the store."""
        if not self.root.is_dir():
            return 0, 0
        found = [path for path in self.root.rglob("*") if path.is_file()]
        return len(list(self.root.glob(f"*/{MANIFEST}"))), sum(path.stat().st_size for path in found)

    def clear(self) -> None:
        """Removes the finished cases and interrupted ways; what another process works on stays."""
        partial = self._place(_PARTIAL)
        self._sweep()
        for folder in [*self.root.glob(f"*/{MANIFEST}")]:
            aside = Path(tempfile.mkdtemp(prefix=f"{_owner()}.", dir=partial))
            with contextlib.suppress(FileNotFoundError):
                os.rename(folder.parent, aside / "gone")  # whole or gone, for whoever looks
            shutil.rmtree(aside, ignore_errors=True)
        shutil.rmtree(self.root / _WAYS, ignore_errors=True)
        for folder in [*(self.root / _UNFINISHED).glob("*")]:
            with contextlib.suppress(OSError):
                _remove_unlocked(folder)

    def _place(self, name: str) -> Path:
        """A folder of the store's own, made when absent; `BadInput` where something else stands in its place."""
        place = self.root / name
        try:
            place.mkdir(parents=True, exist_ok=True)
        except (FileExistsError, NotADirectoryError):
            raise BadInput(
                "--out", self.root.parent.name or ".", f"{self.root.name!r} in it is no store of cases: {name} or a "
                "folder above it is a file", "give another folder or move that file away",
            ) from None  # fmt: skip
        return place

    def _folder(self, key: str) -> Path:
        if not re.fullmatch(r"[0-9a-f]{64}", key):
            raise ValueError(f"not a case key: {key!r}")
        return self.root / key

    def _sweep(self) -> None:
        """Remove partial folders whose process has died (on this machine) or that are a week old (on another), and what
        nobody has gone on with for a week."""
        host = _host()
        for entry in (self.root / _WAYS).glob("*"):
            with contextlib.suppress(OSError):
                if time.time() - entry.stat().st_mtime > _PARTIAL_AGE:
                    shutil.rmtree(entry, ignore_errors=True)
        for entry in (self.root / _UNFINISHED).glob("*"):
            with contextlib.suppress(OSError):
                if time.time() - entry.stat().st_mtime > _PARTIAL_AGE:
                    _remove_unlocked(entry)  # a clock that jumps ends nobody's work
        for entry in (self.root / _PARTIAL).iterdir():
            owner, _, pid = entry.name.rpartition(".")[0].rpartition("-")
            with contextlib.suppress(OSError, ValueError):
                old = time.time() - entry.stat().st_mtime > _PARTIAL_AGE
                if (not system.alive(int(pid))) if owner == host else old:
                    shutil.rmtree(entry, ignore_errors=True)


def _remove_unlocked(folder: Path) -> None:
    """Removes an unfinished case unless somebody works on it (OSError)."""
    with (folder / _LOCK).open("a") as lock:
        system.lock(lock.fileno(), wait=False)
        shutil.rmtree(folder, ignore_errors=True)


@contextlib.contextmanager
def occupied(folder: str | os.PathLike[str], waiting: Callable[[], object] | None = None) -> Iterator[None]:
    """One run at a time writes into `folder`: whoever comes later waits, and `waiting` is called once.

    The lock ends with the process, however it ends.
    """
    busy = Path(folder) / _BUSY
    handle = _locked(busy, waiting)
    for partial in Path(folder).glob(".*.tmp"):  # of a run that was killed while it wrote
        with contextlib.suppress(OSError):
            partial.unlink()
    try:
        yield
    finally:
        shutil.rmtree(busy, ignore_errors=True)
        os.close(handle)


def _locked(folder: Path, waiting: Callable[[], object] | None) -> int:
    """The descriptor of the lock file in `folder` (made when absent), locked; waits for whoever holds it.

    Whoever held it may have removed the folder meanwhile: the lock counts only on the file that is there now.
    """
    while True:
        folder.mkdir(parents=True, exist_ok=True)
        try:
            handle = os.open(folder / _LOCK, os.O_RDWR | os.O_CREAT | system.NOT_FOR_CHILDREN, 0o666)
        except FileNotFoundError:
            continue
        try:
            while True:
                try:
                    system.lock(handle, wait=False)
                    break
                except BlockingIOError:
                    if waiting is not None:
                        waiting()
                        waiting = None
                    time.sleep(_POLL)
            if os.fstat(handle).st_ino == (folder / _LOCK).stat().st_ino:
                return handle
        except FileNotFoundError:
            pass
        except BaseException:
            os.close(handle)
            raise
        os.close(handle)


def _host() -> str:
    """This machine in eight hexadecimal digits (its name itself is nobody's business)."""
    return hashlib.sha256(socket.gethostname().encode()).hexdigest()[:8]


def _owner() -> str:
    """Prefix of a partial folder: machine and process."""
    return f"{_host()}-{os.getpid()}"


def _files(folder: Path) -> Iterable[Path]:
    """Every file under `folder` except the manifest, in order of name."""
    return sorted(p for p in folder.rglob("*") if p.is_file() and p != folder / MANIFEST)


def _digests(folder: Path) -> dict[str, dict[str, Any]]:
    """Relative name -> {bytes, sha256} of every file of a case."""
    return {
        path.relative_to(folder).as_posix(): {"bytes": path.stat().st_size, "sha256": _sha256(path)}
        for path in _files(folder)
    }


def _sha256(path: Path) -> str:
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _intact(folder: Path, key: str) -> bool:
    """Whether `folder` holds the complete, unaltered case `key`. Files added later do no harm."""
    try:
        manifest = read_json(folder / MANIFEST)
        files = manifest["files"]
        return manifest["key"] == key and all(
            (folder / name).stat().st_size == entry["bytes"] and _sha256(folder / name) == entry["sha256"]
            for name, entry in files.items()
        )
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return False
