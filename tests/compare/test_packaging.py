"""What is installed: three packages and one thin module, nothing else; the module imports no solver."""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

import compare

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("ribbon", "shellref", "compare")
MODULE = "ribbonbench"
#: Names that `import ribbonbench` offers, and the module where each is at home.
NAMES = {
    "Strip": "ribbon", "Clamp": "ribbon", "Gravity": "ribbon", "solve": "ribbon", "refine": "ribbon",
    "assert_agreement": "compare.check", "__version__": "compare",
}  # fmt: skip
SOLVERS = ("ribbon", "shellref", "numba", "cyipopt", "dolfinx", "petsc4py", "skfem", "numpy")


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """The wheel of a copy of the tree (building leaves files), without a network."""
    for needed in ("pip", "setuptools", "wheel"):
        if importlib.util.find_spec(needed) is None:
            pytest.skip(f"a wheel cannot be built without a network: {needed} is not installed")
    place = tmp_path_factory.mktemp("wheel")
    leave = shutil.ignore_patterns(".*", "out", "build", "*.egg-info", "__pycache__")
    shutil.copytree(ROOT, place / "tree", ignore=leave)
    words = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--no-input", "wheel", "--quiet", "--no-index"]
    words += ["--no-deps", "--no-build-isolation", "--wheel-dir", str(place / "out"), "."]
    done = subprocess.run(words, cwd=place / "tree", capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    (found,) = (place / "out").iterdir()
    return found


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory):
    """The folder into which the wheel is unpacked: what site-packages would hold."""
    place = tmp_path_factory.mktemp("site")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(place)
    return place


def python(folder, *words):
    """Python with `folder` in front of everything that is installed, somewhere else than in the tree."""
    environment = {**os.environ, "PYTHONPATH": str(folder)}
    return subprocess.run(
        [sys.executable, "-P", *words], cwd=folder, capture_output=True, text=True, check=False, env=environment
    )


def test_nothing_else_lands_in_site_packages(installed):
    about = f"{MODULE}-{compare.__version__}.dist-info"
    assert {path.name for path in installed.iterdir()} == {*PACKAGES, f"{MODULE}.py", about}


def test_every_file_of_the_packages_is_there(installed):
    for package in PACKAGES:
        there = {path.relative_to(installed) for path in (installed / package).rglob("*") if path.is_file()}
        wanted = {path.relative_to(ROOT) for path in (ROOT / package).rglob("*") if path.is_file()}
        assert there == {path for path in wanted if "__pycache__" not in path.parts}


def test_the_distribution_says_what_it_installs():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert all(name in project["description"] for name in (*PACKAGES, MODULE))


def test_the_module_is_the_command(installed):
    done = python(installed, "-m", MODULE, "--version")
    assert (done.returncode, done.stdout) == (0, f"ribbonbench {compare.__version__}\n"), done.stderr
    assert python(installed, "-m", MODULE, "solve", "no such scene").returncode == 2


def test_importing_the_module_imports_no_solver(installed):
    code = (
        "import sys, ribbonbench\n"
        "assert ribbonbench.__file__.startswith(sys.argv[1]), ribbonbench.__file__\n"
        f"assert set(dir(ribbonbench)) >= {set(NAMES)!r}\n"
        f"found = [name for name in {SOLVERS!r} if name in sys.modules]\n"
        "assert not found, found\n"
        "ribbonbench.__version__\n"
        f"assert not [name for name in {SOLVERS!r} if name in sys.modules]\n"
    )
    done = python(installed, "-c", code, str(installed))
    assert done.returncode == 0, done.stderr


def test_the_names_are_those_of_the_packages():
    import ribbonbench

    assert set(ribbonbench.__all__) == set(NAMES)
    for name, home in NAMES.items():
        assert getattr(ribbonbench, name) is getattr(importlib.import_module(home), name)
    with pytest.raises(AttributeError, match="nonsense"):
        ribbonbench.nonsense  # noqa: B018
