"""The command `ribbonbench`.

Exit codes: 0 done, 1 computed but not converged or not stable, 2 bad input, 3 something missing on this machine.
"""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Sequence

from rich.console import Console

from compare import commands
from compare.commands.common import BAD_INPUT, DONE, MISSING, NOT_CONVERGED, print_json
from compare.commands.line import recorded
from compare.commands.parser import whole as _parser
from ribbonbench import start
from ribbonbench.accepted import accepting
from ribbonbench.errors import BadInput, RibbonbenchError

__all__ = ["BAD_INPUT", "DONE", "MISSING", "NOT_CONVERGED", "main"]


#: Optional libraries -> the extra of the distribution that brings them.
_EXTRAS = {"matplotlib": "plot", "mpl_toolkits": "plot", "pyvista": "plot", "vtkmodules": "plot", "skfem": "elastica"}


def _console() -> Console:
    """Plain text (no markup in our words), as wide as the terminal or COLUMNS says; 80 letters where nothing does.

    In a pipe sentences stay on one line each, for whoever searches them; tables fit all the same.
    """
    console = Console(markup=False)
    return console if console.is_terminal else Console(markup=False, highlight=False, soft_wrap=True)


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and returns the exit code; errors of the user's making are one line on stderr.

    Of several processes (mpirun) only the first speaks, and all end with the same code.
    """
    from ribbonbench.world import placed, quiet_but_first, world

    start.one_thread()
    if placed()[1] == 1:
        return _main(arguments)
    with quiet_but_first():
        try:
            code = _main(arguments)
        except SystemExit as stop:  # argparse: a usage line was printed
            code = stop.code if isinstance(stop.code, int) else BAD_INPUT
        sys.stdout.flush()
        sys.stderr.flush()
        world().together()
    return code


def _main(arguments: Sequence[str] | None) -> int:
    parser = _parser()
    words = list(sys.argv[1:] if arguments is None else arguments)
    options = parser.parse_args(words)
    options.line = recorded(words)
    console = _console()
    if options.version:
        from ribbonbench import __version__

        console.print(f"ribbonbench {__version__}")
        return DONE
    if options.command is None:
        parser.print_help()
        return BAD_INPUT
    try:
        _check_alone(options.command)
        with accepting(getattr(options, "yes", False)):
            code = commands.module(options.command).run(options, console)
        print_json(options)
        return code
    except RibbonbenchError as error:
        if (stop := start.behind(error)) is not None:
            return start.said(stop)
        print(f"ribbonbench: {error}", file=sys.stderr)
        return error.exit_code
    except KeyboardInterrupt as stop:
        return start.said(stop)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return DONE
    except ImportError as error:
        absent = _absent_words(error)
        if absent is None:
            raise
        print(f"ribbonbench: {absent}", file=sys.stderr)
        return MISSING
    except Exception as error:
        from compare.store.store import disk_full

        full = disk_full(error)
        if full is None:
            raise
        with contextlib.suppress(OSError):  # what stderr goes into may be full too
            print(f"ribbonbench: {_full_words(full)}", file=sys.stderr)
        return MISSING


def _absent_words(error: ImportError) -> str | None:
    """What is said of a library that is not there or does not fit; None for one that we do not know."""
    name = (error.name or "").partition(".")[0]
    if name == "cyipopt":
        from compare.commands.installed.probes import APT, IPOPT, REBUILD

        if getattr(error, "reason", "") == "numpy":
            return f"{error}, and Ipopt is needed here; {REBUILD}"
        return f"{error}, and Ipopt is needed here; {APT} {IPOPT}; pip install 'ribbonbench[judge]'"
    if isinstance(error, ModuleNotFoundError) and name in _EXTRAS:
        return f"{error.name} is missing; pip install 'ribbonbench[{_EXTRAS[name]}]'"
    return None


def _full_words(error: OSError) -> str:
    """What is said when the disk takes nothing more."""
    return (
        f"disk full ({(error.strerror or 'no space').lower()}): what is finished is kept; free space and run the same "
        "command again"
    )


def _check_alone(command: str) -> None:
    """Only some commands share their work among processes."""
    from ribbonbench.world import placed

    if placed()[1] > 1 and not commands.parallel(command):
        able = ", ".join(f"ribbonbench {name}" for name in commands.NAMES if commands.parallel(name))
        raise BadInput(
            "mpirun", None, f"cannot run ribbonbench {command}: its work is not shared among processes",
            f"run it without mpirun; what can be run so: {able}",
        )  # fmt: skip
