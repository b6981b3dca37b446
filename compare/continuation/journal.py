"""What has been solved of a diagram, kept as it comes, so that one that was killed goes on where it was.

A diagram is followed again from its beginning, by the same code, and every equation that is in the journal is answered
from it and not solved: so the result is that of a run that nothing stopped, to the bit. A record is found by a digest
of all that was asked before it and of its own question; what differs (other sources, another processor) is solved.

File: the key of what is followed, 32 bytes; records (digest 16, length 8, checksum of both and of the data 4, data: an
.npz file, nothing for "none"). What follows the last whole record is cut off.
"""

from __future__ import annotations

import functools
import hashlib
import io
import os
import struct
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any, BinaryIO, ParamSpec, TypeVar

import numpy as np
from numpy.typing import NDArray

P = ParamSpec("P")
R = TypeVar("R")
Packed = list[NDArray[Any]]
_HEAD = struct.Struct("<16sQI")
_KEY = 32


class Journal:
    """Answers by digest; a file that ends within a record, or is of another key, is taken for what it is worth.

    used, made: how many answers came from it, and how many were written to it."""

    def __init__(self, file: BinaryIO, key: str) -> None:
        self._file = file
        self._places: dict[bytes, tuple[int, int]] = {}
        self._chain = hashlib.blake2b(digest_size=16)
        self.used = self.made = 0
        own = hashlib.sha256(key.encode()).digest()
        file.seek(0)
        if file.read(_KEY) != own:
            file.seek(0)
            file.truncate()
            file.write(own)
            return
        end = _KEY
        while True:
            head = file.read(_HEAD.size)
            if len(head) < _HEAD.size:
                break
            digest, length, check = _HEAD.unpack(head)
            data = file.read(length)
            if len(data) < length or _checksum(digest, data) != check:
                break
            self._places[digest] = (end + _HEAD.size, length)
            end += _HEAD.size + length
        file.seek(end)
        file.truncate()

    def asked(self, *parts: Any) -> bytes:
        """The digest of a question behind all that were asked before."""
        for part in parts:
            self._chain.update(_bytes(part))
        return self._chain.digest()

    def found(self, digest: bytes) -> Packed | None:
        """The kept answer to it: [] for "none", None where there is none kept."""
        place = self._places.get(digest)
        if place is None:
            return None
        self.used += 1
        self._file.seek(place[0])
        data = self._file.read(place[1])
        if not data:
            return []
        with np.load(io.BytesIO(data), allow_pickle=False) as stored:
            return [stored[f"arr_{k}"] for k in range(len(stored.files))]

    def keep(self, digest: bytes, answer: Packed) -> None:
        """Written at once: what is killed behind this has it."""
        data = b""
        if answer:
            out = io.BytesIO()
            np.savez(out, *answer)
            data = out.getvalue()
        place = self._file.seek(0, os.SEEK_END)
        self._file.write(_HEAD.pack(digest, len(data), _checksum(digest, data)) + data)
        self._places[digest] = (place + _HEAD.size, len(data))
        self.made += 1


def _checksum(digest: bytes, data: bytes) -> int:
    return zlib.crc32(data, zlib.crc32(digest + struct.pack("<Q", len(data))))


def _bytes(part: Any) -> bytes:
    if isinstance(part, tuple):
        return b"(" + b"".join(_bytes(one) for one in part) + b")"
    if isinstance(part, str):
        return part.encode()
    return np.ascontiguousarray(part).tobytes()


_NOW: ContextVar[Journal | None] = ContextVar("journal", default=None)


@contextmanager
def kept(place: Path | None, key: str) -> Iterator[Journal | None]:
    """Answers of `journalled` functions are those in the file, and new ones go there; place None: nothing is kept."""
    if place is None:
        yield None
        return
    place.parent.mkdir(parents=True, exist_ok=True)
    with os.fdopen(os.open(place, os.O_RDWR | os.O_CREAT, 0o666), "r+b", buffering=0) as file:
        journal = Journal(file, key)
        token = _NOW.set(journal)
        try:
            yield journal
        finally:
            _NOW.reset(token)


def journalled(
    asks: Callable[P, tuple[Any, ...]], pack: Callable[[R], Packed], unpack: Callable[[Packed], R]
) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """A function whose answers are kept; asks: what of its arguments decides the answer; pack, unpack: the answer as
    arrays, [] for "none", and back, to the bit."""

    def made(function: Callable[P, R]) -> Callable[P, R]:
        @functools.wraps(function)
        def answered(*arguments: P.args, **keywords: P.kwargs) -> R:
            journal = _NOW.get()
            if journal is None:
                return function(*arguments, **keywords)
            digest = journal.asked(function.__name__, *asks(*arguments, **keywords))
            found = journal.found(digest)
            if found is not None:
                return unpack(found)
            answer = function(*arguments, **keywords)
            journal.keep(digest, pack(answer))
            return answer

        return answered

    return made
