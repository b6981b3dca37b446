"""Tests about permissions also run for root, who has every permission: as nobody, for a while, in a public folder."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

NOBODY = 65534


@contextlib.contextmanager
def public_folder() -> Iterator[Path]:
    """A new folder that every user may enter and read."""
    folder = Path(tempfile.mkdtemp(prefix="ribbonbench-test-"))
    folder.chmod(0o755)
    try:
        yield folder
    finally:
        shutil.rmtree(folder)


@contextlib.contextmanager
def not_root() -> Iterator[None]:
    """Without root's permissions inside; the same user as before where that is not root."""
    if os.geteuid() != 0:
        yield
        return
    os.seteuid(NOBODY)
    try:
        yield
    finally:
        os.seteuid(0)
