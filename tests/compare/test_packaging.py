"""What is installed: three packages and a thin one of the distribution's name, which imports no solver."""

from __future__ import annotations

import email
import importlib.util
import os
import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

import compare
from ribbonbench import sources

ROOT = Path(__file__).resolve().parents[2]
MODULE = "ribbonbench"
PACKAGES = ("ribbon", "shellref", "compare", MODULE)
#: Names that `import ribbonbench` offers, and the module where each is at home.
NAMES = {
    "Strip": "ribbon", "Clamp": "ribbon", "Gravity": "ribbon", "solve": "ribbon", "refine": "ribbon",
    "assert_agreement": "compare.check", "__version__": "compare",
}  # fmt: skip
SOLVERS = ("ribbon", "shellref", "numba", "cyipopt", "dolfinx", "petsc4py", "skfem", "numpy")


def stamps():
    """Where a build would leave something: path -> when it was changed."""
    made = [*ROOT.iterdir(), *ROOT.glob("build/**/*"), *ROOT.glob("*.egg-info/**/*")]
    skipped = (".git", ".venv", "out", ".pytest_cache", ".mypy_cache", ".ruff_cache", ".hypothesis", "__pycache__")
    return {path: path.stat().st_mtime_ns for path in made if path.name not in skipped and not path.is_dir()} | {
        path: 0 for path in made if path.is_dir()
    }


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """The wheel of the tree, without a network; nothing is left behind in the tree."""
    for needed in ("pip", "setuptools", "wheel"):
        if importlib.util.find_spec(needed) is None:
            pytest.skip(f"a wheel cannot be built without a network: {needed} is not installed")
    place = tmp_path_factory.mktemp("wheel")
    before = stamps()
    words = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--no-input", "wheel", "--quiet", "--no-index"]
    words += ["--no-deps", "--no-build-isolation", "--wheel-dir", str(place / "out"), "."]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert stamps() == before
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
    assert {path.name for path in installed.iterdir()} == {*PACKAGES, about}


def test_every_file_of_the_packages_is_there(installed):
    for package in PACKAGES:
        there = {path.relative_to(installed) for path in (installed / package).rglob("*") if path.is_file()}
        wanted = {path.relative_to(ROOT) for path in (ROOT / package).rglob("*") if path.is_file()}
        assert there == {path for path in wanted if "__pycache__" not in path.parts}


def test_the_distribution_says_what_it_installs():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert all(name in project["description"] for name in PACKAGES)


def test_packages_say_that_they_are_typed(installed):
    assert all((installed / package / "py.typed").is_file() for package in PACKAGES)


def test_what_is_needed_is_what_the_ribbon_needs(installed):
    """Pictures and the elastica are extras; numpy is as new as the other libraries take it."""
    (about,) = installed.glob("*.dist-info")
    said = email.message_from_string((about / "METADATA").read_text()).get_all("Requires-Dist")
    plain = {re.split(r"[^a-z]", line)[0] for line in said if "extra ==" not in line}
    assert plain == {"numpy", "scipy", "numba", "cyipopt", "meshio", "rich"}
    assert not any("<" in line for line in said)
    for extra, names in {"plot": ("pyvista", "matplotlib"), "elastica": ("scikit-fem",)}.items():
        assert {re.split(r"[ (>]", line)[0] for line in said if f"extra == '{extra}'" in line.replace('"', "'")} == set(
            names
        )


#: The command of argv[1:] where the optional libraries are not installed.
WITHOUT = """
import sys
from importlib.abc import MetaPathFinder
class Absent(MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ("matplotlib", "mpl_toolkits", "pyvista", "vtkmodules", "skfem", "dolfinx"):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
sys.meta_path.insert(0, Absent())
from compare.cli import main
sys.exit(main(sys.argv[1:]))
"""
SMALL = ("--set", "model.elements=6", "--quiet")


@pytest.mark.parametrize(
    ("words", "files"),
    [
        (("solve", "coil_10_100", *SMALL), {"result.json", "page.json", "ribbon.vtu", "centreline.csv"}),
        (("limits", "curl_4_3", "--quick", *SMALL), {"result.json", "limits.csv"}),
        (("export", "coil_10_100", *SMALL, "--format", "ply,gltf,obj"), set()),
    ],
)
def test_without_extras_all_but_pictures_is_there(installed, tmp_path, words, files):
    done = python(installed, "-c", WITHOUT, *words, "--out", str(tmp_path / "o"))
    assert done.returncode == 0, done.stderr
    there = {path.name for path in (tmp_path / "o").rglob("*")}
    assert files <= there
    assert not [name for name in there if name.endswith(".png")]
    assert "Traceback" not in done.stderr


def test_what_needs_an_extra_says_which(installed, tmp_path):
    scene = ("cantilever", "--set", 'model.energy="elastica"', "--quiet")
    done = python(installed, "-c", WITHOUT, "solve", *scene, "--out", str(tmp_path / "o"))
    assert done.returncode == 3
    assert done.stderr.count("\n") == 1
    assert "ribbonbench[elastica]" in done.stderr


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


def test_an_installed_shell_has_the_key_of_the_tree(installed):
    """What a kept result depends on is computed from the files that are installed."""
    code = (
        "from ribbonbench import sources\n"
        "import sys\n"
        "found = sources.closure('compare.models.shell')\n"
        "assert all(str(path).startswith(sys.argv[1]) for path in found.values()), found\n"
        "print(sources.digest('compare.models.shell'))\n"
    )
    done = python(installed, "-c", code, str(installed))
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == sources.digest("compare.models.shell")


def test_the_names_are_those_of_the_packages():
    import ribbonbench

    assert set(ribbonbench.__all__) == set(NAMES)
    for name, home in NAMES.items():
        assert getattr(ribbonbench, name) is getattr(importlib.import_module(home), name)
    with pytest.raises(AttributeError, match="nonsense"):
        ribbonbench.nonsense  # noqa: B018
