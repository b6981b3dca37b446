"""What is installed: three packages and a thin one of the distribution's name, which imports no solver."""

from __future__ import annotations

import email
import importlib.util
import json
import os
import re
import shutil
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
#: What stands in the tree and belongs to no distribution.
SKIPPED = (".git", ".venv", "out", "build", ".pytest_cache", ".mypy_cache", ".ruff_cache", ".hypothesis", "__pycache__")
SOLVERS = ("ribbon", "shellref", "numba", "cyipopt", "dolfinx", "petsc4py", "skfem", "numpy")


def stamps():
    """Where a build would leave something: path -> when it was changed."""
    made = [*ROOT.iterdir(), *ROOT.glob("build/**/*"), *ROOT.glob("*.egg-info/**/*")]
    return {path: path.stat().st_mtime_ns for path in made if path.name not in SKIPPED and not path.is_dir()} | {
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
    assert plain == {"numpy", "scipy", "numba", "meshio", "rich"}
    assert not any("<" in line for line in said)
    for extra, names in {"plot": ("pyvista", "matplotlib"), "elastica": ("scikit-fem",), "judge": ("cyipopt",)}.items():
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


# -- another venv, other folders --------------------------------------------------------------------------------------

REBUILD = "pip install --force-reinstall --no-cache-dir --no-binary cyipopt cyipopt"
#: What a module that was compiled for NumPy 1 does under NumPy 2.
MISMATCH = """
import sys
for _ in range(60):
    print("A module that was compiled using NumPy 1.x cannot be run in NumPy 2", file=sys.stderr)
raise ImportError("numpy.core.multiarray failed to import")
"""


def package(folder, name, text=""):
    """A package called `name` in `folder`, whose import runs `text`; returns the folder to put on the path."""
    (folder / name).mkdir(parents=True)
    (folder / name / "__init__.py").write_text(text)
    return folder


def run(*words, paths=(), cwd=None):
    """Python as a user has it, with `paths` in front of the tree."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, (*paths, ROOT)))}
    return subprocess.run(
        [sys.executable, *words], cwd=cwd, capture_output=True, text=True, check=False, env=environment
    )


def test_a_cyipopt_of_another_numpy(tmp_path):
    """Who needs no Ipopt does not meet it; who does gets one line with what mends it, and so does doctor."""
    place = package(tmp_path / "p", "cyipopt", MISMATCH)
    words = ("-m", MODULE, "solve", "coil_10_100", *SMALL, "--out", str(tmp_path / "o"))
    done = run(*words, paths=[place])
    assert (done.returncode, done.stderr) == (0, "")
    done = run(*words, "--set", "model.solver=ipopt", paths=[place])
    assert done.returncode == 3
    assert done.stderr.count("\n") == 1
    assert REBUILD in done.stderr
    code = "from compare.commands.installed import probes; row, = probes.ipopt(); print(row['ok'], row['remedy'])"
    done = run("-c", code, paths=[place])
    assert done.stdout.startswith("False " + REBUILD)


def test_a_solve_by_newton_loads_no_ipopt():
    code = (
        "import sys\nfrom ribbon import Clamp, Gravity, Strip, solve\n"
        "assert solve(Strip(1.0, 0.05, gamma=5.0), Clamp(), Gravity((0, 1, 0)), segments=6).ok\n"
        "print([name for name in sys.modules if name.startswith('cyipopt')])"
    )
    done = run("-c", code)
    assert done.stdout == "[]\n", done.stderr


def test_without_cyipopt_the_judge_alone_is_missing():
    code = (
        "import sys\nsys.modules['cyipopt'] = None\nfrom ribbon import Strip, solve\n"
        "assert solve(Strip(1.0, 0.05, natural_curvature=1.0), segments=4).ok\n"
        "try:\n    solve(Strip(1.0, 0.05, natural_curvature=1.0), segments=4, solver='ipopt')\n"
        "except ImportError as error:\n    print(error.name)\n"
    )
    done = run("-c", code)
    assert done.stdout == "cyipopt\n", done.stderr


@pytest.mark.parametrize("others", [(), ("skfem", "matplotlib")])
def test_without_a_shell_compare_keeps_the_ribbon(tmp_path, others):
    place = tmp_path / "p"
    for name in ("dolfinx", *others):
        package(place, name, f'raise ModuleNotFoundError("No module named {name}", name="{name}")')
    without = (
        "import importlib.util, sys; found = importlib.util.find_spec; "
        "importlib.util.find_spec = lambda name, *p: None if name == 'dolfinx' else found(name, *p); "
        "import ribbonbench; sys.exit(ribbonbench.main())"
    )
    words = ("compare", "cantilever", "--set", "model.elements=6", "--set", "shell.width_to_thickness=[50]")
    done = run("-c", without, *words, "--out", str(tmp_path / "o"), paths=[place])
    assert done.returncode == 3
    assert done.stderr.count(" is missing") == 1
    assert not (tmp_path / "o" / "result.json").exists()  # that is a comparison's
    kept = json.loads((tmp_path / "o" / "ribbon" / "result.json").read_text())
    assert kept["status"] == "converged"
    assert "stable" in done.stdout
    assert (tmp_path / "o" / "ribbon" / "page.json").exists()


@pytest.mark.parametrize(
    ("name", "script"),
    [
        ("ribbon", "import ribbonbench\nribbonbench.Strip"),
        ("compare", "import ribbonbench\nribbonbench.assert_agreement"),
        ("ribbon", "from compare.check import assert_agreement"),
        ("shellref", "from compare.scene import load"),
    ],
)
def test_a_package_beside_a_script_is_named(tmp_path, name, script):
    package(tmp_path, name)
    (tmp_path / "script.py").write_text(script)
    done = run(str(tmp_path / "script.py"))
    last = done.stderr.strip().splitlines()[-1]
    assert done.returncode == 1
    assert last.startswith("ImportError: ")
    assert str(tmp_path / name) in last


def test_an_editable_installation_is_on_the_path(tmp_path):
    """By a file .pth with the tree in it: there a mere folder beside a script, as of results, hides no package."""
    if importlib.util.find_spec("setuptools") is None:
        pytest.skip("setuptools is not installed")
    tree = tmp_path / "tree"
    shutil.copytree(ROOT, tree, ignore=lambda folder, names: [n for n in names if n in SKIPPED or n == "tests"])
    code = "import sys; sys.path.insert(0, '.ci'); import backend; print(backend.build_editable(sys.argv[1]))"
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path)], cwd=tree, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    with zipfile.ZipFile(tmp_path / done.stdout.split()[-1]) as archive:
        (pth,) = (name for name in archive.namelist() if name.endswith(".pth"))
        assert [Path(line) for line in archive.read(pth).decode().split("\n") if line] == [tree]
    for name in PACKAGES:
        (tmp_path / "mine" / name).mkdir(parents=True)
    (tmp_path / "mine" / "script.py").write_text("import ribbon, compare, shellref\nprint(ribbon.__file__)")
    done = run(str(tmp_path / "mine" / "script.py"))
    assert done.stdout == f"{ROOT / 'ribbon' / '__init__.py'}\n", done.stderr
