"""cyipopt's wrapper of Ipopt without its interface for scipy.optimize, whose import takes longer than a solve.

Nothing is loaded before Ipopt is asked for: Newton's methods, which solve nearly all, do without.
"""

from __future__ import annotations

import contextlib
import functools
import importlib
import importlib.util
import io
import sys
import types
from typing import Any

import numpy

#: What stands in the errors of a library that was compiled for another NumPy, in small letters.
_OTHER_NUMPY = ("numpy", "multiarray", "_array_api", "api version")


class IpoptMissing(ImportError):
    """Ipopt cannot be used. Attributes: ``name`` "cyipopt"; ``reason``: "absent" (not installed), "numpy" (built for
    another NumPy than the one installed) or "broken"."""

    def __init__(self, reason: str, message: str) -> None:
        super().__init__(message, name="cyipopt")
        self.reason = reason

    def __reduce__(self) -> tuple[Any, ...]:
        # an exception is pickled by its args (the finished line); these are what __init__ takes
        return type(self), (self.reason, self.msg)


@functools.cache
def wrapper() -> Any:
    """The module with `Problem` and `CyIpoptEvaluationError`: the same objects that `import cyipopt` gives, before or
    afterwards. Raises `IpoptMissing` where cyipopt or Ipopt cannot be loaded."""
    if sys.modules.get("cyipopt") is not None:
        return sys.modules["cyipopt"]
    said = io.StringIO()  # NumPy writes sixty lines of its own about what was built for another one
    try:
        with contextlib.redirect_stderr(said):
            found = _loaded()
    except Exception as error:
        raise _why(error) from error
    sys.stderr.write(said.getvalue())
    return found


def is_there() -> bool:
    """Whether Ipopt can be used."""
    try:
        wrapper()
    except IpoptMissing:
        return False
    return True


def _why(error: Exception) -> IpoptMissing:
    if isinstance(error, ModuleNotFoundError) and (error.name or "").startswith("cyipopt"):
        return IpoptMissing("absent", "cyipopt is not installed")
    words = " ".join(str(error).split()).partition(" (")[0]
    if any(part in words.lower() for part in _OTHER_NUMPY):
        return IpoptMissing("numpy", f"cyipopt was built for another NumPy than {numpy.__version__} ({words})")
    return IpoptMissing("broken", f"cyipopt cannot be loaded ({words})")


def _loaded() -> Any:
    spec = importlib.util.find_spec("cyipopt")
    if spec is None or not spec.submodule_search_locations:
        return importlib.import_module("cyipopt")
    package = types.ModuleType("cyipopt")  # stands for the package while its wrapper alone is imported
    package.__path__ = list(spec.submodule_search_locations)
    sys.modules["cyipopt"] = package
    try:
        found = importlib.import_module("cyipopt.ipopt_wrapper")
    except ModuleNotFoundError:  # another layout of the package: take all of it
        found = None
    finally:
        del sys.modules["cyipopt"]
    return importlib.import_module("cyipopt") if found is None else found
