"""Runners: functions (case, budget) -> answers, found by entry point, and how one is called.

A runner of one's own is named by an installed distribution, or any folder on the Python path with a ``NAME.dist-info``,
in its entry points::

    [ribbonbench.suite]
    mine = my_module:run

`run(case, budget)` gets a `compare.suite.case.Case` and seconds, and returns `Answers`, or several, one for each of its
models. It raises `Absent` where its program is not there, `NotRepresentable` and `BrokeDown` with a reason; whatever
else it raises is counted as a mistake of the adapter, not of the program.
"""

from __future__ import annotations

import functools
import importlib
import importlib.metadata
import time
from collections.abc import Callable, Mapping
from dataclasses import replace

from compare.suite.answers import BROKE_DOWN, MISTAKE, NOT_REPRESENTABLE, Absent, Answers, BrokeDown, NotRepresentable
from compare.suite.case import Case
from ribbonbench.errors import BadInput

GROUP = "ribbonbench.suite"
Runner = Callable[[Case, float], "Answers | tuple[Answers, ...]"]
#: The runners of the package: name -> where its function stands.
BUILT_IN: Mapping[str, str] = {
    "ours": "compare.suite.ours:run",
    **{name: f"compare.suite.peers.runners:{name}" for name in ("mujoco", "exudyn", "pyelastica")},
}


@functools.cache
def targets() -> Mapping[str, str]:
    """Names of all runners, the built-in ones first, with where each stands as ``module:function``."""
    found = dict(BUILT_IN)
    for point in importlib.metadata.entry_points(group=GROUP):
        found.setdefault(point.name, point.value)
    return found


def runner(name: str) -> Runner:
    """The runner of this name. `BadInput` for a name that none has, or whose function cannot be had."""
    if name not in targets():
        raise BadInput("--runner", name, "is no runner", f"known are {', '.join(targets())} (docs/suite.md adds one)")
    module, _, attribute = targets()[name].partition(":")
    try:
        found: Runner = getattr(importlib.import_module(module), attribute)
    except (ImportError, AttributeError) as fault:
        raise BadInput("--runner", name, f"cannot be loaded: {fault}", "mend its entry point (docs/suite.md)") from None
    return found


def answered(run: Runner, case: Case, budget: float) -> tuple[Answers, ...]:
    """What a runner says of a case, with its seconds. Raises `Absent` alone."""
    begun = time.perf_counter()
    try:
        said = run(case, budget)
        found = said if isinstance(said, tuple) else (said,)
        if not all(isinstance(one, Answers) for one in found):
            raise TypeError(f"returned {type(said).__name__}, not Answers")
    except Absent:
        raise
    except NotRepresentable as why:
        found = (Answers(ended=NOT_REPRESENTABLE, why=str(why)),)
    except BrokeDown as why:
        found = (Answers(ended=BROKE_DOWN, why=str(why)),)
    except Exception as fault:
        found = (Answers(ended=MISTAKE, why=f"{type(fault).__name__}: {fault}"),)
    seconds = time.perf_counter() - begun
    return tuple(one if one.seconds is not None else replace(one, seconds=seconds / len(found)) for one in found)
