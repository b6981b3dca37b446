"""The names of ribbonbench under one roof: `import ribbonbench`; `python -m ribbonbench` is the command.

The work is done by the three packages that come with it: `ribbon` (the ribbon), `shellref` (shell and elastica, the
references) and `compare` (scenes, studies, the command line). A name is looked up there when it is first used, so that
importing this package imports no solver. What these three share, and is no mechanics of a solution, stands here:
`sources`, `statics`.
"""

from __future__ import annotations

import importlib
import importlib.util
import os
from typing import TYPE_CHECKING, Any, NoReturn

if TYPE_CHECKING:
    from compare import __version__ as __version__
    from compare.check import assert_agreement as assert_agreement
    from ribbon import Clamp as Clamp
    from ribbon import Gravity as Gravity
    from ribbon import Strip as Strip
    from ribbon import refine as refine
    from ribbon import solve as solve

#: The packages of the solvers.
SOLVERS = ("ribbon", "shellref")
#: Name -> the module that has it.
_FROM = {
    "Clamp": "ribbon",
    "Gravity": "ribbon",
    "Strip": "ribbon",
    "__version__": "compare",
    "assert_agreement": "compare.check",
    "refine": "ribbon",
    "solve": "ribbon",
}

__all__ = list(_FROM)


def __getattr__(name: str) -> Any:
    if name not in _FROM:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    alone(_FROM[name].partition(".")[0])
    return getattr(importlib.import_module(_FROM[name]), name)


def alone(*packages: str) -> None:
    """Raises ImportError, which names it, where a folder of the user's stands in the place of one of our packages."""
    for package in packages:
        _alone(package)


def _alone(package: str) -> None:
    spec = importlib.util.find_spec(package)
    places = [] if spec is None else [*(spec.submodule_search_locations or [spec.origin or ""])]
    here = os.path.dirname(os.path.dirname(os.path.realpath(__file__)))
    if places and here not in [os.path.dirname(os.path.realpath(place)) for place in places]:
        words = f"{places[0]} stands in the place of ribbonbench's own package {package!r}: rename that folder"
        raise ImportError(words, name=package, path=places[0])


def __dir__() -> list[str]:
    return sorted({*globals(), *_FROM})


def main() -> int:
    """The command `ribbonbench`: the process's exit code. Signals and threads are seen to before anything is loaded."""
    alone("compare")
    from ribbonbench import start

    def command() -> int:
        from compare.cli import main as run

        return run()

    return start.run(command)


def command() -> NoReturn:
    """The installed command: `main` in a process of its own, which ends with it."""
    from ribbonbench import start

    start.command(main)
