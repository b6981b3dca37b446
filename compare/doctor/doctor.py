"""`ribbonbench doctor`: which versions and which linear algebra are at work here, what is missing, what mends it.

The libraries are looked at in processes of their own (`doctor_probes`), all at once and each with a time limit, so
that a missing, broken, crashing or hanging one is a row of the table; Ipopt and dolfinx never share a process.
"""

from __future__ import annotations

import contextlib
import json
import os
import platform
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from compare.doctor.probes import MARK, SETUP

TIMEOUT = 9.0
"""Seconds a probe may take; all run at the same time."""

# What each probe's rows are called when it yields none at all, and what then mends it.
_PROBES = {
    "python": ("Python packages", SETUP),
    "ipopt": ("Ipopt", f"sudo apt-get install --no-install-recommends coinor-libipopt-dev pkg-config; {SETUP}"),
    "dolfinx": ("dolfinx", f"sudo apt-get install --no-install-recommends python3-dolfinx python3-slepc4py; {SETUP}"),
    "pictures": ("off-screen pictures", "sudo apt-get install --no-install-recommends libegl1 libgl1-mesa-dri"),
    "compiler": ("C compiler", "sudo apt-get install --no-install-recommends gcc libc6-dev python3-dev"),
}


@dataclass(frozen=True)
class Row:
    """One thing looked at: its name, version or state, whether it is as it should be, and what mends it if not."""

    name: str
    what: str
    ok: bool
    remedy: str = ""


@dataclass(frozen=True)
class Diagnosis:
    """Everything the doctor saw."""

    rows: tuple[Row, ...]

    @property
    def missing(self) -> tuple[Row, ...]:
        """The rows that need mending."""
        return tuple(row for row in self.rows if not row.ok)

    @property
    def ok(self) -> bool:
        return not self.missing

    @property
    def exit_code(self) -> int:
        """0 if nothing is missing, 3 otherwise."""
        return 0 if self.ok else 3


def diagnose() -> Diagnosis:
    """Looks at this machine; takes a few seconds, never longer than about `TIMEOUT`."""
    with ThreadPoolExecutor(len(_PROBES)) as pool:
        probed = list(pool.map(_probe, _PROBES))
    return Diagnosis((_interpreter(), *(row for rows in probed for row in rows), _cores(), *_caches()))


def main(console: Any, as_json: bool = False) -> int:
    """Prints the diagnosis to a rich `console` (or as JSON on standard output) and returns the exit code.

    JSON: {"ok": bool, "rows": [{"name", "what", "ok", "remedy"}, ...]}.
    """
    if as_json:
        diagnosis = diagnose()
        print(json.dumps({"ok": diagnosis.ok, "rows": [asdict(row) for row in diagnosis.rows]}, indent=2))
        return diagnosis.exit_code
    from rich.table import Table
    from rich.text import Text

    with console.status("looking at the machine"):
        diagnosis = diagnose()
    table = Table(box=None, pad_edge=False)
    table.add_column("")
    table.add_column("part", no_wrap=True)
    table.add_column("version, state", overflow="fold")
    for row in diagnosis.rows:
        verdict = Text("ok", "green") if row.ok else Text("missing", "bold red")
        table.add_row(verdict, Text(row.name), Text(row.what))
    console.print(table, highlight=False)
    console.print()
    if diagnosis.ok:
        console.print(Text("Nothing is missing."))
    for row in diagnosis.missing:
        console.print(Text.assemble((row.name, "bold"), f": {row.what}; mend it with:"))
        console.print(Text(f"    {row.remedy}"), soft_wrap=True)
    return diagnosis.exit_code


# ---------------------------------------------------------------------------------------------------------------------
# Probes in processes of their own


def _probe(name: str) -> list[Row]:
    """Rows of one probe; a probe that crashes or hangs keeps the rows it had, and gets one that says so."""
    title, remedy = _PROBES[name]
    script = Path(__file__).with_name("probes.py")
    environment = {**os.environ, "MPLBACKEND": "Agg", "VTK_DEFAULT_OPENGL_WINDOW": "vtkEGLRenderWindow"}
    if os.environ.get("DISPLAY"):
        del environment["VTK_DEFAULT_OPENGL_WINDOW"]
    trouble = ""
    try:
        done = subprocess.run(
            [sys.executable, "-P", str(script), name],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            env=environment,
            timeout=TIMEOUT,
            check=False,
        )
        output = done.stdout
        if done.returncode < 0:
            trouble = f"crashes (signal {-done.returncode})"
        elif done.returncode > 0:
            said = done.stderr.decode(errors="replace").split("\n")
            trouble = f"fails: {next((line for line in reversed(said) if line.strip()), 'no message')}"
    except subprocess.TimeoutExpired as expired:
        output = expired.stdout or b""
        trouble = f"does not answer within {TIMEOUT:g} s"
    except OSError as error:
        return [Row(title, f"cannot be looked at: {error}", False, remedy)]
    rows: dict[str, Row] = {}  # a later row of the same name replaces the earlier one
    for line in output.decode(errors="replace").splitlines():
        if line.startswith(MARK):
            with contextlib.suppress(ValueError, TypeError):  # the last line of a killed process may be cut
                rows.update((entry["name"], Row(**entry)) for entry in json.loads(line.removeprefix(MARK)))
    if trouble and all(row.ok for row in rows.values()):
        rows[title] = Row(title, trouble, False, remedy)
    return list(rows.values()) or [Row(title, "yields no answer", False, remedy)]


# ---------------------------------------------------------------------------------------------------------------------
# What can be seen from here


def _interpreter() -> Row:
    """Python itself; a venv that does not see Debian's packages is a fault of its own."""
    inside = sys.prefix != sys.base_prefix
    version = platform.python_version()
    if inside and not any(part.endswith("dist-packages") for part in sys.path):
        return Row("Python", f"{version}, in a venv that does not see Debian's packages", False, SETUP)
    return Row("Python", f"{version}, {'in a venv' if inside else 'not in a venv'}", True)


def _cores() -> Row:
    """Cores this process may use, and the variables that limit threads."""
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
    limits = [f"{name}={os.environ[name]}" for name in names if name in os.environ]
    return Row("cores", ", ".join([str(len(os.sched_getaffinity(0))), *limits]), True)


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
