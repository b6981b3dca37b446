"""Container, conda and the page about installing say what pyproject.toml and `make setup` say."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from compare import __version__
from compare.commands.parser import whole
from tests.test_setup import LOCK, ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
#: Names that conda-forge has for what pip and Debian call otherwise.
CONDA = {"matplotlib": "matplotlib-base", "python3-dolfinx": "fenics-dolfinx", "python3-slepc4py": "slepc4py"}
#: What only the shell needs of the environment; the rest of it is pip's.
SHELL = {"fenics-dolfinx", "petsc", "petsc4py", "slepc4py", "mpi4py", "c-compiler"}


def conda_name(requirement: str) -> str:
    """`matplotlib>=3.6` as conda writes it: `matplotlib-base >=3.6`."""
    name, bound = re.fullmatch(r"([\w.-]+)(.*)", requirement).groups()
    return f"{CONDA.get(name, name)} {bound}".strip()


def debian_packages() -> list[str]:
    """The packages that `make setup` installs."""
    (listed,) = re.findall(r"^PACKAGES=\(\n(.*?)^\)", (ROOT / ".ci" / "setup.sh").read_text(), re.M | re.S)
    return [name for line in listed.splitlines() for name in line.partition("#")[0].split()]


# --- the container ---------------------------------------------------------------------------------------------------


def steps() -> list[tuple[str, str]]:
    """The instructions of the Containerfile, in order."""
    text = re.sub(r"\\\n\s*", " ", (ROOT / "Containerfile").read_text())
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    return [(line.partition(" ")[0], line.partition(" ")[2]) for line in lines]


def copies() -> list[tuple[str, str]]:
    """What is copied, and where to in the folder of work."""
    found = []
    for kind, words in steps():
        if kind == "COPY":
            *sources, target = [word for word in words.split() if not word.startswith("--")]
            found += [(source, target) for source in sources]
    return found


@pytest.fixture(scope="module")
def copied(tmp_path_factory):
    """The folder of work of the container, as its COPY lines make it."""
    place = tmp_path_factory.mktemp("container")
    for source, target in copies():
        there = ROOT / source
        if there.is_dir():
            shutil.copytree(there, place / target, ignore=shutil.ignore_patterns("__pycache__"), dirs_exist_ok=True)
        else:
            to = place / target / there.name if target.endswith("/") else place / target
            to.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(there, to)
    return place


def test_the_container_is_the_debian_of_the_pins():
    kinds = [kind for kind, _ in steps()]
    assert kinds[0] == "FROM"
    assert kinds.count("FROM") == kinds.count("CMD") == kinds.count("USER") == 1
    (release,) = re.findall(r"debian:(\d+)-slim$", steps()[0][1])
    assert f"Debian {release}:" in LOCK.read_text()


def test_the_container_lists_no_package_that_set_up_lists():
    installs = re.findall(r"apt-get install ([^&]*)", (ROOT / "Containerfile").read_text())
    named = {word for line in installs for word in line.split() if not word.startswith("-")}
    assert named == {"ca-certificates", "make"}
    assert not named & set(debian_packages())
    assert "pip install" not in (ROOT / "Containerfile").read_text()


def test_what_the_container_copies_is_what_set_up_reads(copied):
    """Set-up reads these; the demo's target exists; a wheel of the copy would be that of the tree."""
    script = (copied / ".ci" / "setup.sh").read_text()
    (hashed,) = re.findall(r"^\s*sha256sum (.*)$", script, re.M)
    assert all((copied / name).is_file() for name in hashed.split())
    parts = re.findall(
        r'"([\w./-]+)"', re.search(r"^PARTS = \((.*?)^\)", (ROOT / ".ci/backend.py").read_text(), re.M | re.S)[1]
    )
    assert len(parts) > 8
    assert all((copied / part).exists() for part in parts)
    for package in ("ribbonbench", "ribbon", "shellref", "compare"):
        mine = {path.relative_to(ROOT) for path in (ROOT / package).rglob("*") if path.is_file()}
        there = {path.relative_to(copied) for path in (copied / package).rglob("*") if path.is_file()}
        assert there == {path for path in mine if "__pycache__" not in path.parts}
    done = subprocess.run(["make", "-n", "demo"], cwd=copied, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "ribbonbench compare curl_4_3" in done.stdout


def test_the_container_s_command_and_runs_are_there(copied):
    commands = {kind: words for kind, words in steps() if kind == "CMD"}
    assert commands["CMD"] == '["make", "demo"]'
    runs = [words for kind, words in steps() if kind == "RUN"]
    order = [kind for kind, words in steps() if kind == "USER" or (kind, words) == ("RUN", "make setup")]
    assert order == ["USER", "RUN"]  # nothing of the project runs as root
    assert any(words.startswith(".ci/setup.sh packages") for words in runs)


@pytest.mark.skipif(not (Path(sys.prefix) / "setup-complete").exists(), reason="make setup has not been run here")
def test_set_up_can_stop_behind_the_packages(copied):
    """Where none is missing it installs none, and makes no environment."""
    before = sorted(path.name for path in copied.iterdir())
    done = subprocess.run(["bash", ".ci/setup.sh", "packages"], cwd=copied, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert sorted(path.name for path in copied.iterdir()) == before


# --- conda -----------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def recipe():
    yaml = pytest.importorskip("yaml", reason="no PyYAML (Debian: python3-yaml)")
    return yaml.safe_load((ROOT / ".ci" / "conda" / "recipe.yaml").read_text())


@pytest.fixture(scope="module")
def outputs(recipe):
    return {one["package"]["name"]: one for one in recipe["outputs"]}


def test_the_recipe_is_of_this_version(recipe, outputs):
    assert recipe["schema_version"] == 1
    assert recipe["context"] == {
        "version": __version__,
        "python_min": PROJECT["requires-python"].removeprefix(">="),
    }
    assert recipe["recipe"]["name"] == PROJECT["name"]
    assert set(outputs) == {"ribbonbench", "ribbonbench-shell"}
    assert (ROOT / ".ci" / "conda" / recipe["source"]["path"]).resolve() == ROOT
    assert recipe["about"]["license"] == PROJECT["license"]["text"]


def test_the_recipe_needs_what_the_wheel_needs(outputs):
    made = outputs["ribbonbench"]
    assert made["build"]["noarch"] == "python"
    python, *run = made["requirements"]["run"]
    assert python == "python >=${{ python_min }}"
    assert run == [conda_name(text) for text in PROJECT["dependencies"]]
    extras = PROJECT["optional-dependencies"]
    optional = [conda_name(text) for name in ("plot", "elastica", "judge", "table") for text in extras[name]]
    assert sorted(made["requirements"]["run_constraints"]) == sorted(optional)
    builds = tomllib.loads((ROOT / "pyproject.toml").read_text())["build-system"]["requires"]
    assert set(map(conda_name, builds)) <= set(made["requirements"]["host"])
    assert made["build"]["python"]["entry_points"] == [f"{n} = {at}" for n, at in PROJECT["scripts"].items()]


def test_the_recipe_s_shell_is_one_that_the_shell_knows(outputs):
    run = outputs["ribbonbench-shell"]["requirements"]["run"]
    assert run[0] == '${{ pin_subpackage("ribbonbench", exact=True) }}'
    bounds = {line.partition(" ")[0]: line.partition(" ")[2] for line in run[1:]}
    major, minor = re.fullmatch(r"(\d+)\.(\d+)\.\*", bounds["fenics-dolfinx"]).groups()
    known = re.findall(r"VERSION == \((\d+), (\d+)\)", (ROOT / "shellref/fenics/dolfinx_api.py").read_text())
    assert (major, minor) in known
    assert bounds["petsc"] == "* real_*"  # complex builds stand beside them
    wanted = {CONDA[name] for name in debian_packages() if name in CONDA}
    assert wanted == {"fenics-dolfinx", "slepc4py"}
    assert wanted <= set(bounds)
    assert set(bounds) >= SHELL
    optional = [conda_name(text) for name in ("plot", "elastica") for text in PROJECT["optional-dependencies"][name]]
    assert [line for line in run[1:] if line.partition(" ")[0] not in SHELL] == optional


def test_commands_of_the_recipe_parse(outputs):
    lines = [line for one in outputs.values() for test in one["tests"] for line in test.get("script", [])]
    assert len(lines) >= 5
    for line in lines:
        name, *words = shlex.split(line)
        assert name == "ribbonbench"
        if words != ["--version"]:
            whole().parse_args(words)


# --- the page --------------------------------------------------------------------------------------------------------


def test_the_page_names_every_extra_and_every_way():
    page = (ROOT / "docs" / "install.md").read_text()
    named = set(re.findall(r"the extra `(\w+)`", page))
    assert named == set(PROJECT["optional-dependencies"]) - {"docs", "test"}
    known = re.findall(r"VERSION == \((\d+), (\d+)\)", (ROOT / "shellref/fenics/dolfinx_api.py").read_text())
    assert f"dolfinx {' or '.join('.'.join(pair) for pair in sorted(set(known)))} with real scalars" in page
    assert f"Python {PROJECT['requires-python'].removeprefix('>=')} or newer" in page
    for path in (".ci/setup.sh", ".ci/requirements.lock", ".ci/debian13.sh", "Containerfile", ".ci/conda/recipe.yaml"):
        assert path in page
        assert (ROOT / path).is_file()


def test_the_container_s_folder_is_that_of_the_page():
    (folder,) = [words for kind, words in steps() if kind == "WORKDIR"]
    for text in ((ROOT / "docs" / "install.md").read_text(), (ROOT / "Containerfile").read_text()):
        mounted = re.findall(r'-v "\$PWD(?:/out)?:([^"]*)"', text)
        assert len(mounted) == 2
        assert all(place.startswith(f"{folder}/") for place in mounted)
