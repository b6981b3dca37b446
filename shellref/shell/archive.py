"""Arrays in an .npz file that is whole or not there, also when the process is interrupted while it is written."""

from __future__ import annotations

import io
import os
import zipfile

import numpy as np

from ribbonbench.replacing import replacing


class _InMemory(zipfile.ZipFile):
    """An archive that is closed by `close` alone: thrown away half-written, it has nothing to put in order.

    ZipFile closes itself when it is collected. After ctrl-C in the middle of an array that fails, and Python then
    prints the failure on stderr, since nobody is there to be told.
    """

    def __del__(self) -> None:
        pass


def npz(**arrays: np.ndarray) -> bytes:
    """The bytes of the .npz file that `numpy.savez` would write (no pickles)."""
    buffer = io.BytesIO()
    archive = _InMemory(buffer, "w")
    for name, values in arrays.items():
        with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
            np.lib.format.write_array(member, np.asanyarray(values), allow_pickle=False)
    archive.close()
    return buffer.getvalue()


def write(path: str | os.PathLike[str], content: bytes) -> None:
    """`content` as the file `path`, whole or not there."""
    with replacing(path, lasting=False) as stream:
        stream.write(content)
