"""The house itself: pins, make targets, files without paths of a machine, and who may import whom."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import os
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest

from ribbonbench.sources import absolute, read

ROOT = Path(__file__).resolve().parents[1]
LOCK = ROOT / ".ci" / "requirements.lock"


def _canonical(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def _pins(lock: Path = LOCK) -> dict[str, str]:
    lines = [line.strip() for line in lock.read_text().splitlines() if line.strip() and not line.startswith("#")]
    assert all(re.fullmatch(r"[A-Za-z0-9._-]+==[A-Za-z0-9.+!]+", line) for line in lines)  # no hosts, no hashes
    return {_canonical(name): version for name, version in (line.split("==") for line in lines)}


# --- pins ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "version"), _pins().items())
def test_pins_are_what_is_installed(name, version):
    assert importlib.metadata.version(name) == version


def test_every_dependency_of_a_pinned_package_is_pinned():
    requirements = pytest.importorskip("packaging.requirements")
    pins = _pins()
    loose = set()
    for name in pins:
        for text in importlib.metadata.requires(name) or []:
            needed = requirements.Requirement(text)
            if needed.marker is None or needed.marker.evaluate({"extra": ""}):
                loose |= {_canonical(needed.name)} - set(pins)
    assert loose == set()


def test_pins_satisfy_the_project_s_own_requirements():
    requirements = pytest.importorskip("packaging.requirements")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    pins = _pins() | _pins(LOCK.with_name("docs.lock"))  # that of `make docs`
    extras = [text for texts in project["optional-dependencies"].values() for text in texts]
    for text in [*project["dependencies"], *extras]:
        needed = requirements.Requirement(text)
        if needed.name == project["name"]:  # one extra brings others
            continue
        assert needed.specifier.contains(pins[_canonical(needed.name)]), text


@pytest.mark.skipif(not (Path(sys.prefix) / "setup-complete").exists(), reason="make setup has not been run here")
@pytest.mark.parametrize("name", ["dolfinx", "slepc4py", "setuptools", "wheel", "pip", "mpirun", "chromium"])
def test_what_set_up_promises_is_there(name):
    """Other tests are skipped without these; on a machine that is set up that would hide a fault."""
    assert shutil.which(name) or importlib.util.find_spec(name)


# --- make ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("target", ["setup", "demo", "test", "portable", "validate", "lint", "clean", "help"])
def test_make_knows_the_target(target):
    done = subprocess.run(["make", "-n", "-C", ROOT, target], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert target == "help" or f"make {target} " in _help()


def _help() -> str:
    return subprocess.run(["make", "-s", "-C", ROOT, "help"], capture_output=True, text=True, check=True).stdout


@pytest.mark.parametrize("name", [".ci/run", ".ci/setup.sh"])
def test_scripts_are_executable_bash(name):
    script = ROOT / name
    assert os.access(script, os.X_OK)
    assert script.read_text().startswith("#!/usr/bin/env bash\n")
    assert subprocess.run(["bash", "-n", script], check=False).returncode == 0


def test_what_set_up_compiles_is_kept_for_no_other_venv():
    """cyipopt is built for the NumPy of this venv, past the wheels that pip keeps for all."""
    lines = (ROOT / ".ci" / "setup.sh").read_text().splitlines()
    installs = [line for line in lines if line.strip().startswith("pip install") and ".ci/requirements.lock" in line]
    pinned, built = installs
    assert "grep -v '^cyipopt=='" in pinned
    assert {"--no-cache-dir", "--no-deps", "--no-binary"} <= set(built.split())


def test_the_default_run_of_pytest_leaves_the_long_validation_out():
    options = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["pytest"]["ini_options"]
    assert "-m 'not validate'" in options["addopts"]


# --- files -----------------------------------------------------------------------------------------------------------


def _project_files() -> list[Path]:
    """What is tracked, or would be by `git add`; every file where there is no git."""
    command = ["git", "-C", str(ROOT), "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    try:
        names = subprocess.run(command, capture_output=True, check=True).stdout.decode().split("\0")
    except (OSError, subprocess.CalledProcessError):
        skipped = {".venv", ".git", "out", "build", "__pycache__", ".mypy_cache", ".ruff_cache", ".pytest_cache"}
        names = [
            str(path.relative_to(ROOT))
            for path in ROOT.rglob("*")
            if not (skipped | {"ribbonbench.egg-info", ".hypothesis"}) & set(path.relative_to(ROOT).parts)
        ]
    return [ROOT / name for name in names if name and (ROOT / name).is_file()]


_MACHINE = re.compile(rb"(?<![\w.~])/(?:work|root|home)/\w|[\w.-]*pypi[.]org|pythonhosted[.]org|deb[.]debian[.]org")


def _machine_words(text: bytes) -> list[bytes]:
    """Paths of a machine, and package registries' hosts, in `text`."""
    own = [os.fsencode(path) for path in (ROOT, Path.home()) if len(path.parts) > 2]
    return [match[0] for match in _MACHINE.finditer(text)] + [word for word in own if word in text]


def test_no_file_names_a_path_of_a_machine_or_a_registry():
    files = _project_files()
    assert len(files) > 20
    found = {str(path.relative_to(ROOT)): words for path in files if (words := _machine_words(path.read_bytes()))}
    assert found == {}


# The bar stands for the stroke or the dot, so that this file passes its own test.
@pytest.mark.parametrize("text", ["see |root|x.py", '"|home|joe|a"', "(|work|a)", "-i https:||pypi!org|simple"])
def test_the_search_for_machine_words_can_fail(text):
    assert _machine_words(text.replace("|", "/").replace("!", ".").encode())


@pytest.mark.parametrize("text", [b"/usr/bin/python3", b"/proc/self/maps", b"frame/work/x", b"~/.cache", b"homework/a"])
def test_the_search_for_machine_words_has_no_false_alarm(text):
    assert not _machine_words(text)


# --- who imports whom ------------------------------------------------------------------------------------------------

Modules = Mapping[str, str]  # dotted name -> source text
_PACKAGES = ("ribbon", "shellref", "compare")
_GROUND = "ribbonbench"
_GROUND_FILES = sorted(path for path in (ROOT / _GROUND).glob("*.py") if not path.stem.startswith("__"))
#: Checks of what is given and of what came out (how often a band is turned), from which no solution is computed, and
#: messages between processes, which carry arrays.
_CHECKS = {"ribbonbench.statics", "ribbonbench.linking", "ribbonbench.messages"}
#: What the workbench tells its users, and the processes that it does so from: a solver has its own errors and codes.
_TO_USERS = {"ribbonbench.errors", "ribbonbench.world"}
_SOLVERS = ("ribbon", "shellref")
#: Who computes: ground does not.
_NUMERICS = {"numpy", "scipy", "skfem", "dolfinx", "petsc4py", "cyipopt"}


def _modules() -> dict[str, str]:
    """Every module of the three packages, and their ground; a package's own name stands for its __init__."""
    found = {f"{_GROUND}.{path.stem}": path.read_text() for path in _GROUND_FILES}
    for package in _PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            parts = path.relative_to(ROOT).with_suffix("").parts
            found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path.read_text()
    return found


def imported(name: str, source: str, is_package: bool = False) -> set[str]:
    """Dotted names that the module `name` imports, wherever in it, for types too, relative ones resolved.

    `from a import b` yields a and a.b (b may be a module). `importlib.import_module` and `__import__` count where the
    name is written out.
    """
    package = name.split(".") if is_package else name.split(".")[:-1]
    seen: set[str] = set()
    for one in read(source.encode()).imports:
        if one[0] not in "=*":
            base, _, attribute = absolute(one.lstrip("~!"), package).partition(":")
            seen |= {base, f"{base}.{attribute}"} if attribute else {base}
    return seen


def _ground_only(targets: set[str]) -> bool:
    """Whether nothing of the common package is imported but its modules of ground."""
    own = {target for target in targets if target.partition(".")[0] == _GROUND} - {_GROUND}
    bare = _GROUND in targets and not own
    return not bare and all(target.split(".")[1] in {path.stem for path in _GROUND_FILES} for target in own)


def violations(modules: Modules) -> Iterator[str]:
    """Breaches of the house's import rules: packages know only what they may; the elastica never meets dolfinx.

    The modules of `ribbonbench` are ground for all three: they know none of them, and compute nothing."""
    allowed = {"ribbon": {"ribbon"}, "shellref": {"shellref"}, "compare": set(_PACKAGES), _GROUND: set()}
    packages = {name for name in modules if any(other.startswith(name + ".") for other in modules)}
    packages |= set(_PACKAGES) & set(modules)
    graph = {name: imported(name, source, name in packages) for name, source in modules.items()}
    for name, targets in graph.items():
        top = name.split(".")[0]
        for target in sorted(targets):
            if target.split(".")[0] in set(_PACKAGES) - allowed[top]:
                yield f"{name} imports {target}"
        if top in _SOLVERS and _TO_USERS & targets:
            yield f"{name} speaks to the user"
        if top != "compare" and not _ground_only(targets):
            yield f"{name} imports more of {_GROUND} than its ground"
        if top == _GROUND and name not in _CHECKS and _NUMERICS & {target.split(".")[0] for target in targets}:
            yield f"{name} computes"
    # With a module come its parents' __init__, and everything these import in turn.
    todo = [name for name in graph if name.startswith("shellref.elastica")]
    reached: set[str] = set()
    while todo:
        name = todo.pop()
        if name in reached or name not in graph:
            continue
        reached.add(name)
        for target in sorted(graph[name]):
            if target.split(".")[0] in ("dolfinx", "petsc4py", "slepc4py", "mpi4py", "ufl", "basix", "ffcx"):
                yield f"shellref.elastica reaches {target} through {name}"
        todo += [*graph[name], *(name.rsplit(".", k)[0] for k in range(1, name.count(".") + 1))]


def test_the_solvers_are_independent():
    modules = _modules()
    assert {"ribbon", "shellref", "ribbonbench.errors", "shellref.elastica.solve"} <= set(modules)
    assert list(violations(modules)) == []


CLEAN = {
    "ribbon": "from ribbon.strip import Strip",
    "ribbon.strip": "import numpy",
    "shellref": "",
    "shellref.elastica": "",
    "shellref.elastica.solve": "import skfem\nfrom shellref.shell.result import Result",
    "shellref.shell.result": "import numpy",
    "shellref.shell.naghdi": "import dolfinx",
    "compare": "",
    "compare.models.ribbon": "import ribbon\nfrom shellref.shell import naghdi",
    "ribbonbench.sources": "import ast",
    "ribbon.kernels": "from ribbonbench.sources import Sources",
    "shellref.journal": "from ribbonbench import clock, sources",
    "ribbonbench.kernel_cache": "from ribbonbench.trusted import fault\nfrom numba.core import event",
}


def test_the_import_checker_passes_a_clean_house():
    assert list(violations(CLEAN)) == []


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("ribbon.strip", "import shellref"),
        ("ribbon.strip", "from shellref.shell.result import Result"),
        ("ribbon.strip", "import numpy, ribbonbench.errors"),
        ("ribbon.strip", "def f():\n    from compare import errors"),
        ("ribbon.strip", "if TYPE_CHECKING:\n    import shellref.shell.result"),
        ("ribbon.energies.sadowsky", "import importlib\nimportlib.import_module('shellref.shell.result')"),
        ("shellref.shell.naghdi", "import ribbon"),
        ("shellref.shell.naghdi", "from ribbonbench.errors import BadInput"),
        ("shellref.elastica.solve", "import dolfinx.fem"),
        ("shellref.elastica", "import ufl"),
        ("shellref.elastica.solve", "from ..shell import naghdi"),
        ("shellref.elastica.solve", "from ..shell.naghdi import Shell"),
        ("shellref.elastica.solve", "from shellref.shell.naghdi import Shell"),
        ("shellref.shell.result", "from petsc4py import PETSc"),
        ("shellref", "from .shell.naghdi import Shell"),
        ("shellref", "import dolfinx"),
        ("ribbon.strip", "import ribbonbench"),
        ("shellref.shell.naghdi", "from ribbonbench import solve"),
        ("ribbonbench.sources", "from ribbon.strip import Strip"),
        ("ribbonbench.sources", "def f():\n    import compare.record"),
        ("shellref.shell.result", "def f():\n    from ribbonbench.world import world"),
        ("ribbon.strip", "import numpy, compare.record"),
        ("shellref.shell.naghdi", "from compare.record import Quantity"),
        ("ribbonbench.clock", "from ribbonbench import solve"),
        ("ribbonbench.clock", "import numpy"),
    ],
)
def test_the_import_checker_can_fail(module, source):
    assert list(violations({**CLEAN, module: source}))
