"""What is computed only on demand: `--yes`, in Python `Options(yes=True)`, or the environment variable `YES`."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator

YES = "RIBBONBENCH_YES"
"""Environment variable: "1" computes what looks like a slip of units, or is dear, in this process and its workers."""


def accepted() -> bool:
    """Whether all is to be computed, however implausible or dear."""
    return os.environ.get(YES) == "1"


@contextlib.contextmanager
def accepting(yes: bool) -> Iterator[None]:
    """With `yes`, what is done within is `accepted`."""
    before = os.environ.get(YES)
    if yes:
        os.environ[YES] = "1"
    try:
        yield
    finally:
        if yes:
            os.environ.pop(YES)
            if before is not None:
                os.environ[YES] = before
