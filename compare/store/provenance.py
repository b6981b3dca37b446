"""Provenance of a result: what ran, on what, when. No solver is imported and no path is recorded."""

from __future__ import annotations

import contextlib
import datetime
import functools
import importlib.metadata
import os
import platform
import subprocess
from pathlib import Path
from typing import Any

from ribbonbench import sources, system
from ribbonbench.start import THREADS

# Packages whose version goes into a result's provenance (distribution names).
_PACKAGES = (
    "ribbonbench",
    "numpy",
    "scipy",
    "numba",
    "llvmlite",
    "cyipopt",
    "scikit-fem",
    "meshio",
    "pyvista",
    "vtk",
    "matplotlib",
    "fenics-dolfinx",
    "fenics-basix",
    "fenics-ffcx",
    "fenics-ufl",
    "petsc4py",
    "slepc4py",
    "mpi4py",
    "rich",
)
# Debian packages that no Python metadata tells about (patterns of dpkg-query).
_DEBIAN_PACKAGES = ("python3-dolfinx*", "coinor-libipopt*", "libpetsc-real3*", "libslepc-real3*", "libmumps*-5*")


def versions() -> dict[str, Any]:
    """Provenance of a result: what ran, on what, when. No solver is imported, no path is recorded.

    Keys: ``packages`` {distribution: version}, ``debian`` {package: version}, ``python``, ``system``, ``cpu``,
    ``cores`` (usable by this process), ``threads`` (the OMP and BLAS variables that are set), ``git`` {``commit``,
    ``modified``} or None, ``time`` (UTC, ISO 8601).
    """
    git = _git(Path(__file__).resolve().parents[2])
    return {
        **_fixed_versions(),
        "git": git,
        "cores": system.cores(),
        "threads": _threads(),
        "time": now(),
    }


def software(*entries: str) -> dict[str, Any]:
    """The part of `versions` that belongs into a `case_key`: packages, Debian packages, Python, and the digest of the
    sources that the modules `entries` depend on (`ribbonbench.sources`; of all that are ours where none is named). With
    an entry from outside come the versions of what it imports beyond (`others`).

    A version number does not change while one works on the code; the digest does, but not with comments, docstrings and
    line breaks. Raises ModuleNotFoundError for an entry that is not there.
    """
    fixed = _fixed_versions()
    found = {
        "packages": fixed["packages"],
        "debian": fixed["debian"],
        "python": fixed["python"],
        "source": sources.digest(*entries),
    }
    outside = [entry for entry in entries if entry.partition(".")[0] not in sources.PACKAGES]
    return {**found, "others": _others(*outside)} if outside else found


@functools.cache
def _others(*entries: str) -> dict[str, str]:
    """Distribution -> version of what the modules `entries` import and is neither ours nor in `_PACKAGES`."""
    names = sources.ours().others(sources.closure(*entries))
    known = importlib.metadata.packages_distributions()
    wanted = {distribution for name in names for distribution in known.get(name, ())} - set(_PACKAGES)
    return {name: importlib.metadata.version(name) for name in sorted(wanted)}


@functools.cache
def _fixed_versions() -> dict[str, Any]:
    """What does not change within a process."""
    packages: dict[str, str] = {}
    for name in _PACKAGES:
        with contextlib.suppress(importlib.metadata.PackageNotFoundError):
            packages[name] = importlib.metadata.version(name)
    return {
        "packages": packages,
        "debian": _debian_versions(),
        "python": platform.python_version(),
        "system": _system(),
        "cpu": system.processor(),
    }


def now() -> str:
    """The time as ISO 8601, UTC, whole seconds."""
    return datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")


def _threads() -> dict[str, str]:
    return {name: os.environ[name] for name in THREADS if name in os.environ}


def _system() -> str:
    """E.g. ``Debian GNU/Linux 12 (bookworm), Linux x86_64``."""
    kernel = f"{platform.system()} {platform.machine()}"
    try:
        return f"{platform.freedesktop_os_release()['PRETTY_NAME']}, {kernel}"
    except (OSError, KeyError):
        return kernel


def _output(command: list[str], timeout: float = 10.0) -> str | None:
    """Standard output of a short command; None if it is missing, fails or hangs."""
    try:
        done = subprocess.run(
            command, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=timeout, check=False
        )
    except (OSError, subprocess.TimeoutExpired):
        return None
    return done.stdout if done.returncode == 0 else None


def _debian_versions() -> dict[str, str]:
    """Versions of the installed Debian packages that the solvers stand on; empty on another system."""
    try:
        done = subprocess.run(
            ["dpkg-query", "-W", "-f", "${db:Status-Status} ${Package} ${Version}\n", *_DEBIAN_PACKAGES],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=10.0,
            check=False,  # status 1 means: one of the patterns matched nothing
        )
    except (OSError, subprocess.TimeoutExpired):
        return {}
    rows = (line.split() for line in done.stdout.splitlines())
    return {row[1]: row[2] for row in rows if len(row) == 3 and row[0] == "installed"}


@functools.cache
def _git(root: Path) -> dict[str, Any] | None:
    """Commit of the checkout at `root` and whether files differ from it; None outside a checkout or without git."""
    if not (root / ".git").exists():
        return None
    commit = _output(["git", "-C", str(root), "rev-parse", "HEAD"])
    if commit is None:
        return None
    status = _output(["git", "-C", str(root), "status", "--porcelain", "--untracked-files=no"])
    return {"commit": commit.strip(), "modified": None if status is None else bool(status.strip())}
