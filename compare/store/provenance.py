"""Provenance of a result: what ran, on what, when. No solver is imported and no path is recorded."""

from __future__ import annotations

import ast
import contextlib
import datetime
import functools
import hashlib
import importlib.metadata
import json
import os
import platform
import subprocess
import tempfile
from pathlib import Path
from typing import Any

from compare.start import THREADS

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
        "cores": len(os.sched_getaffinity(0)),
        "threads": _threads(),
        "time": now(),
    }


#: Our own packages.
OWN = ("ribbon", "shellref", "compare")


def software(*sources: str) -> dict[str, Any]:
    """The part of `versions` that belongs into a `case_key`: packages, Debian packages, Python, and the digest of our
    own `sources` (folders and modules, see `source_digest`; all of `OWN` when none is named)."""
    fixed = _fixed_versions()
    return {
        "packages": fixed["packages"],
        "debian": fixed["debian"],
        "python": fixed["python"],
        "source": source_digest(*(sources or OWN)),
    }


@functools.cache
def source_digest(*sources: str) -> str:
    """SHA-256 over the names and the code of all modules of our own `sources`: folders with all below them ("ribbon",
    "shellref/shell") or single modules ("shellref/worker.py"), relative to the root of the project.

    A version number does not change while one works on the code; this does, but not with comments, docstrings and line
    breaks. A source that is not there counts as empty. Digest once per process (cached).
    """
    root = Path(__file__).resolve().parents[2]
    known = _known_code()
    seen: dict[str, str] = {}
    digest = hashlib.sha256()
    for source in sources:
        place = root / source
        for path in [place] if place.is_file() else sorted(place.rglob("*.py")):
            digest.update(path.relative_to(root).as_posix().encode() + b"\0")
            text = path.read_bytes()
            name = hashlib.sha256(text).hexdigest()
            seen[name] = known.get(name) or hashlib.sha256(_code(text)).hexdigest()
            digest.update(bytes.fromhex(seen[name]))
    if not seen.keys() <= known.keys():
        _keep_code({**known, **seen})
    return digest.hexdigest()


def _code_file() -> Path:
    """Where the digests of modules' code are kept by those of their texts: syntax trees take a second to make."""
    own = os.environ.get("RIBBONBENCH_CACHE")
    home = Path(own).expanduser() if own else Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    name = f"code-{platform.python_version()}.json"
    return home / name if own else home / "ribbonbench" / name


def _known_code() -> dict[str, str]:
    """SHA-256 of a module's text -> that of its code; what cannot be read is not known."""
    with contextlib.suppress(OSError, ValueError, AttributeError):
        found = json.loads(_code_file().read_text())
        return {
            text: code for text, code in found.items() if len(bytes.fromhex(text)) == len(bytes.fromhex(code)) == 32
        }
    return {}


def _keep_code(found: dict[str, str]) -> None:
    """Keeps the latest digests, whole or not at all; a folder that cannot be written is no fault."""
    with contextlib.suppress(OSError):
        place = _code_file()
        place.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=f".{place.name}.", dir=place.parent)
        with os.fdopen(handle, "w") as stream:
            json.dump(dict(list(found.items())[-_MOST_CODE:]), stream)
        os.replace(name, place)


#: Modules whose digests are kept.
_MOST_CODE = 4000


def _code(text: bytes) -> bytes:
    """The syntax tree of a module without its docstrings, as text; the module's own text where it cannot be parsed."""
    try:
        tree = ast.parse(text)
    except (SyntaxError, ValueError):
        return text
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) and node.body:
            first = node.body[0]
            if isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant):
                first.value.value = ""
    return ast.dump(tree).encode()


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
        "cpu": _cpu(),
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


def _cpu() -> str:
    """The processor's model name, or its architecture where the kernel does not tell."""
    with contextlib.suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines():
            name, _, value = line.partition(":")
            if name.strip() == "model name":
                return value.strip()
    return platform.machine()


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
