"""Arrays as the bytes of an .npz file; `store.atomic_write_bytes` makes the file."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping
from typing import Any

import numpy as np


class _Unclosed(zipfile.ZipFile):
    """A ZIP file in memory that is not closed when it is collected, only by `close`.

    Interrupted in the middle of an array, ZipFile cannot close itself and says so on stderr, after the error that
    matters; here nothing needs closing.
    """

    def __del__(self) -> None:
        pass


def npz_bytes(content: Mapping[str, Any]) -> bytes:
    """Arrays as a compressed .npz file, without pickles; the same arrays are always the same bytes."""
    out = io.BytesIO()
    archive = _Unclosed(out, "w", zipfile.ZIP_DEFLATED)
    for name, values in content.items():
        with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
            np.lib.format.write_array(member, np.asanyarray(values), allow_pickle=False)
    archive.close()
    return out.getvalue()
