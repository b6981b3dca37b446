"""The one store of finished shells and interrupted ways that all commands of a user share."""

from __future__ import annotations

import os
from pathlib import Path

from compare.store.store import CaseStore, check_writable

STORE = "RIBBONBENCH_STORE"
"""Environment variable: the folder of the store; a relative one stands in the folder of the results ("cases": beside
them, as for results that are to be moved to another machine with all that they need)."""
CASES = "cases"


def cache_root() -> Path:
    """The user's folder for what can be made again: ``RIBBONBENCH_CACHE``, else `ribbonbench` among all caches."""
    own = os.environ.get("RIBBONBENCH_CACHE")
    if own:
        return Path(own).expanduser()
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache").expanduser() / "ribbonbench"


def shared_store(out: Path) -> CaseStore:
    """The store of a run whose results go into the folder `out`; `BadInput` where it cannot be written."""
    own = os.environ.get(STORE)
    place = cache_root() / CASES if not own else out / Path(own).expanduser()
    return CaseStore(place if place.is_relative_to(out) else check_writable(place, STORE))
