"""`ribbonbench doctor`: which versions and which linear algebra are at work here, what is missing, what mends it.

The libraries are looked at in processes of their own (`probes`), all at once and each with a time limit, so
that a missing, broken, crashing or hanging one is a row of the table; Ipopt and dolfinx never share a process. A busy
machine is slow, not ill: what does not answer in time is not known, and nothing is proposed for it.
"""

from __future__ import annotations

import contextlib
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from compare.commands.installed.probes import APT, ELASTICA, IPOPT, JUDGE, MARK, PICTURES, SETUP, SHELL
from compare.store.shared import STORE, shared_store
from ribbonbench import system
from ribbonbench.errors import BadInput
from ribbonbench.start import THREADS

TIMEOUT = 300.0
"""Seconds a probe may take; all run at the same time."""

SLOW = 5.0
"""Seconds after which what is still looked at is named, then again whenever the time has doubled."""

_POLL = 0.05  # s between two looks at the probes

Say = Callable[[str], object]

# What each probe's rows are called when it yields none at all, and what then mends it.
_PROBES = {
    "python": ("Python packages", SETUP),
    "ipopt": (
        "cyipopt, Ipopt",
        f"{APT} {IPOPT}; {SETUP}",
    ),
    "dolfinx": (
        "dolfinx, PETSc, SLEPc",
        f"sudo apt-get install --no-install-recommends python3-dolfinx python3-slepc4py; {SETUP}",
    ),
    "pictures": ("off-screen pictures", "sudo apt-get install --no-install-recommends libegl1 libgl1-mesa-dri"),
    "compiler": ("C compiler", "sudo apt-get install --no-install-recommends gcc libc6-dev python3-dev"),
}


#: What is not to be had without optional parts -> what mends it, for users of Debian's packages and for those of pip.
_OPTIONAL = {
    SHELL: (
        f"Debian, Ubuntu: {APT} python3-dolfinx python3-slepc4py gcc libc6-dev python3-dev",
        f"    then {SETUP} in the project, or a venv made by /usr/bin/python3 -m venv --system-site-packages",
        "pip: it has no dolfinx; conda-forge has (fenics-dolfinx, slepc4py): pip install ribbonbench there",
    ),
    PICTURES: ("pip install 'ribbonbench[plot]', in the project: " + SETUP,),
    JUDGE: (f"{APT} {IPOPT}; pip install 'ribbonbench[judge]', in the project: {SETUP}",),
    ELASTICA: ("pip install 'ribbonbench[elastica]', in the project: " + SETUP,),
}


@dataclass(frozen=True)
class Row:
    """One thing looked at: its name, version or state, whether it is as it should be (None: not known), and what mends
    it if not. without: of something optional that is not installed, what is not to be had without it."""

    name: str
    what: str
    ok: bool | None
    remedy: str = ""
    without: str = ""


@dataclass(frozen=True)
class Diagnosis:
    """Everything the doctor saw."""

    rows: tuple[Row, ...]

    @property
    def missing(self) -> tuple[Row, ...]:
        """The rows that need mending."""
        return tuple(row for row in self.rows if row.ok is False and not row.without)

    @property
    def left_out(self) -> dict[str, tuple[Row, ...]]:
        """What is not to be had here -> the optional parts that it would need."""
        rows = [row for row in self.rows if row.ok is False and row.without]
        return {
            what: tuple(row for row in rows if row.without == what) for what in dict.fromkeys(r.without for r in rows)
        }

    @property
    def unknown(self) -> tuple[Row, ...]:
        """The rows of what did not answer in time."""
        return tuple(row for row in self.rows if row.ok is None)

    @property
    def ok(self) -> bool:
        """Everything was seen, and all but optional parts are as they should be."""
        return not self.missing and not self.unknown

    @property
    def exit_code(self) -> int:
        """3 if something is missing; 1 if nothing is known to be, but something did not answer; 0 otherwise."""
        return 3 if self.missing else 1 if self.unknown else 0


def diagnose(say: Say | None = None) -> Diagnosis:
    """Looks at this machine; takes a few seconds where it is quiet, never longer than about `TIMEOUT`."""
    probed = _look(tuple(_PROBES), say)
    return Diagnosis((_interpreter(), *(row for rows in probed for row in rows), _cores(), *_caches()))


def main(console: Any, as_json: bool = False) -> int:
    """Prints the diagnosis to a rich `console` (or as JSON on standard output) and returns the exit code.

    JSON: {"ok": bool, "rows": [{"name", "what", "ok", "remedy", "without"}, ...]}; ok of a row: null where it is not
    known.
    Progress of a slow machine goes to standard error.
    """
    if as_json:
        diagnosis = diagnose(_say)
        print(json.dumps({"ok": diagnosis.ok, "rows": [asdict(row) for row in diagnosis.rows]}, indent=2))
        return diagnosis.exit_code
    from rich.table import Table
    from rich.text import Text

    with console.status("looking at the machine"):
        diagnosis = diagnose(_say)
    verdicts = {True: ("ok", "green"), False: ("missing", "bold red"), None: ("too slow to tell", "yellow")}
    table = Table(box=None, pad_edge=False)
    table.add_column("")
    table.add_column("part", no_wrap=True)
    table.add_column("version, state", overflow="fold")
    for row in diagnosis.rows:
        verdict = ("optional", "dim") if row.ok is False and row.without else verdicts[row.ok]
        table.add_row(Text(*verdict), Text(row.name), Text(row.what))
    console.print(table, highlight=False)
    console.print()
    if diagnosis.ok and not diagnosis.left_out:
        console.print(Text("Nothing is missing."))
    for what, rows in diagnosis.left_out.items():
        console.print(Text(f"Without {', '.join(row.name for row in rows)} everything works but {what}. For {what}:"))
        for remedy in _OPTIONAL[what]:
            console.print(Text(f"    {remedy}"), soft_wrap=True)
    for row in diagnosis.missing:
        console.print(Text.assemble((row.name, "bold"), f": {row.what}; mend it with:"))
        console.print(Text(f"    {row.remedy}"), soft_wrap=True)
    for row in diagnosis.unknown:
        console.print(Text.assemble((row.name, "bold"), f": {row.what}; look again when the machine is less busy"))
    return diagnosis.exit_code


def _say(words: str) -> None:
    print(f"ribbonbench: {words}", file=sys.stderr, flush=True)


# ---------------------------------------------------------------------------------------------------------------------
# Probes in processes of their own


def _look(names: Sequence[str], say: Say | None = None) -> list[list[Row]]:
    """The rows of every probe, all run at once; `say` is told now and then which of them are still at work."""
    clock = time.monotonic()
    spoken = SLOW
    with contextlib.ExitStack() as stack:
        probes = [stack.enter_context(_Running(name)) for name in names]
        while working := [probe for probe in probes if probe.works()]:
            spent = time.monotonic() - clock
            if spent > TIMEOUT:
                break
            if say is not None and spent > spoken:
                say(f"still looking at {', '.join(_PROBES[probe.name][0] for probe in working)} ({spent:.0f} s)")
                spoken *= 2.0
            time.sleep(_POLL)
        return [probe.rows() for probe in probes]


class _Running:
    """A probe at work in a process of its own, which ends, with whatever it started, when the block does."""

    def __init__(self, name: str) -> None:
        self.name = name
        self._trouble: str | None = None

    def __enter__(self) -> _Running:
        self._files = tempfile.TemporaryFile(), tempfile.TemporaryFile()
        environment = {**os.environ, "MPLBACKEND": "Agg", "VTK_DEFAULT_OPENGL_WINDOW": "vtkEGLRenderWindow"}
        if os.environ.get("DISPLAY"):
            del environment["VTK_DEFAULT_OPENGL_WINDOW"]
        self._process: subprocess.Popen[bytes] | None = None
        script = Path(__file__).with_name("probes.py")
        try:
            self._process = subprocess.Popen(
                [sys.executable, "-P", str(script), self.name], stdin=subprocess.DEVNULL, stdout=self._files[0],
                stderr=self._files[1], env=environment, start_new_session=True,
            )  # fmt: skip
        except OSError as error:
            self._trouble = f"cannot be looked at: {error}"
        return self

    def __exit__(self, *_: object) -> None:
        if self._process is not None and self.works():
            system.end_tree(self._process)
            self._process.wait()
        for file in self._files:
            file.close()

    def works(self) -> bool:
        """Whether it has not ended yet."""
        return self._process is not None and self._process.poll() is None

    def rows(self) -> list[Row]:
        """What it has found up to now."""
        output, said = (self._text(file) for file in self._files)
        if self.works():
            return _rows(self.name, output, None)
        code = 0 if self._process is None else self._process.returncode
        if code < 0:
            return _rows(self.name, output, f"crashes (signal {-code})")
        if code > 0:
            last = next((line for line in reversed(said.split("\n")) if line.strip()), "no message")
            return _rows(self.name, output, f"fails: {last}")
        return _rows(self.name, output, self._trouble or "")

    @staticmethod
    def _text(file: Any) -> str:
        file.seek(0)
        return str(file.read().decode(errors="replace"))


def _rows(name: str, output: str, trouble: str | None) -> list[Row]:
    """The rows in the `output` of a probe. trouble: how its process ended, "" as it should, None not in time.

    A probe that crashes or fails keeps the rows it had; what it was at, or else one row of its own, says so. Of one
    that is out of time nothing is said to be missing but what it had found missing.
    """
    title, remedy = _PROBES[name]
    rows: dict[str, Row] = {}  # a later row of the same name replaces the earlier one
    for line in output.splitlines():
        if line.startswith(MARK):
            with contextlib.suppress(ValueError, TypeError):  # the last line of a killed process may be cut
                rows.update((entry["name"], Row(**entry)) for entry in json.loads(line.removeprefix(MARK)))
    begun = [row for row in rows.values() if row.ok is None]
    if trouble is None:
        for row in begun or [Row(title, "", None)]:
            rows[row.name] = Row(row.name, f"no answer within {TIMEOUT:g} s", None)
    else:
        for row in begun:
            rows[row.name] = Row(row.name, trouble or "yields no answer", False, row.remedy)
        if trouble and not begun and all(row.ok for row in rows.values()):
            rows[title] = Row(title, trouble, False, remedy)
    return list(rows.values()) or [Row(title, "yields no answer", False, remedy)]


# ---------------------------------------------------------------------------------------------------------------------
# What can be seen from here


def _interpreter() -> Row:
    """Python itself."""
    inside = sys.prefix != sys.base_prefix
    version = platform.python_version()
    if inside and not any(part.endswith("dist-packages") for part in sys.path):
        return Row("Python", f"{version}, in a venv that does not see Debian's packages", True)
    return Row("Python", f"{version}, {'in a venv' if inside else 'not in a venv'}", True)


def _cores() -> Row:
    """Cores this process may use, and the variables that limit threads."""
    limits = [f"{name}={os.environ[name]}" for name in THREADS if name in os.environ]
    return Row("cores", ", ".join([str(system.cores()), *limits]), True)


def _caches() -> Iterator[Row]:
    """Folders where compiled code is kept between runs."""
    home = Path.home()
    cache = Path(os.environ.get("XDG_CACHE_HOME") or home / ".cache")
    own = os.environ.get("RIBBONBENCH_CACHE")
    forms = Path(own).expanduser() / "forms" if own else cache / "ribbonbench" / "forms"
    yield _cache("cache of compiled forms", [forms], "RIBBONBENCH_CACHE")
    # as ribbon.element.kernel_cache.root, which cannot be asked where cyipopt is missing
    numba = os.environ.get("NUMBA_CACHE_DIR") or own
    kernels = Path(numba).expanduser() if numba else cache / "ribbonbench"
    yield _cache("cache of compiled kernels", [kernels / "kernels"], "RIBBONBENCH_CACHE")
    yield _store()


def _store() -> Row:
    """The user's store of finished shells: how much is in it."""
    remedy = f"export {STORE}=FOLDER, one you may write to"
    try:
        store = shared_store(Path())  # the one that --clean-store empties
    except BadInput as error:
        return Row("store of finished shells", str(error), False, remedy)
    if not _takes_files(store.root):
        return Row("store of finished shells", f"{store.root} cannot be written", False, remedy)
    count, size = store.size()
    what = f"{count} shells, {size / 1e6:.3g} MB in {store.root} (ribbonbench doctor --clean-store empties it)"
    return Row("store of finished shells", what, True)


def _cache(name: str, folders: list[Path], variable: str) -> Row:
    """Writable if one of `folders`, or its nearest parent that exists, takes a file."""
    for folder in folders:
        if _takes_files(folder):
            return Row(name, "writable", True)
    return Row(name, f"{folders[0]} cannot be written", False, f"export {variable}=FOLDER, one you may write to")


def _takes_files(folder: Path) -> bool:
    """Tries: a temporary file in the folder, or in its nearest existing parent."""
    try:
        while not folder.exists():
            folder = folder.parent
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False
