"""cyipopt's wrapper of Ipopt without its interface for scipy.optimize, whose import takes longer than a solve."""

from __future__ import annotations

import importlib
import importlib.util
import sys
import types
from typing import Any


def wrapper() -> Any:
    """The module with `Problem` and `CyIpoptEvaluationError`: the same objects that `import cyipopt` gives, before or
    afterwards. Raises ImportError where cyipopt or Ipopt is not there."""
    if "cyipopt" in sys.modules:
        return sys.modules["cyipopt"]
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
