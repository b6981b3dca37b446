"""Files that a reader sees whole or not at all: written beside their place, put there by one rename."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Iterator
from io import BufferedWriter
from pathlib import Path


@contextlib.contextmanager
def replacing(
    path: str | os.PathLike[str], sole: bool = False, lasting: bool = True, own: bool = False
) -> Iterator[BufferedWriter]:
    """A stream whose content is the file `path` once the block ends, and nothing if it raises; its folder is made.

    sole: this process alone writes it, so that what a killed one left is written over (`.NAME.tmp`); otherwise each
    writer has a name of its own. lasting: on the disk before the rename (fsync). own: readable by its owner alone,
    as it stays in a cache; otherwise as the umask has it. Raises OSError.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    if sole:
        partial = path.with_name(f".{path.name}.tmp")
    else:
        handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=".tmp", dir=path.parent)
        os.close(handle)
        partial = Path(name)
    try:
        with partial.open("wb") as stream:
            yield stream
            stream.flush()
            if lasting:
                os.fsync(stream.fileno())
        if not (own or sole):
            os.chmod(partial, 0o666 & ~umask())  # mkstemp makes files for the owner alone
        os.replace(partial, path)
    except BaseException:
        with contextlib.suppress(OSError):
            partial.unlink()
        raise


def umask() -> int:
    """The process's file creation mask (reading it means setting it twice)."""
    mask = os.umask(0o022)
    os.umask(mask)
    return mask
