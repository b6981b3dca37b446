"""Compiled kernels are kept between runs, and never outlive the sources they were made from."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
CODE = (
    "from ribbon.element.element import bending_value, bending_jet; import ribbon.problems.chained_kernels as k; "
    "print(bending_value(1, 0.0, 2.0, 0.5, 0.1, 1.0, (0.2, 1e-3, 0.3)), sum(bending_value.stats.cache_hits.values()))"
)


def run(source: Path, cache: Path) -> list[str]:
    environment = {**os.environ, "PYTHONPATH": str(source), "RIBBONBENCH_CACHE": str(cache)}
    environment.pop("NUMBA_CACHE_DIR", None)
    done = subprocess.run(
        [sys.executable, "-c", CODE], capture_output=True, text=True, env=environment, check=True, cwd=source
    )
    return done.stdout.split()


def copied(place: Path) -> None:
    """The ribbon's sources, and what reads them, in another place."""
    for package in ("ribbon", "ribbonbench"):
        shutil.copytree(ROOT / package, place / package, ignore=shutil.ignore_patterns("__pycache__"))


@pytest.fixture(scope="module")
def compiled(tmp_path_factory):
    """Sources in a place of their own, the folder of their kernels, and what the run said that compiled them."""
    place = tmp_path_factory.mktemp("compiled")
    copied(place / "source")
    return place / "source", place / "cache", run(place / "source", place / "cache")


def test_kernels_are_reused_until_any_source_changes(compiled, tmp_path):
    source, cache = tmp_path / "source", tmp_path / "cache"
    first, kernels, (value, hits) = compiled
    assert hits == "0"
    shutil.copytree(first, source)
    shutil.copytree(kernels, cache)
    assert run(source, cache) == [value, "1"]
    # a callee in another file changes: the caller must follow
    callee = source / "ribbon" / "energies" / "wunderlich.py"
    text = callee.read_text()
    assert "            h = h * y + _COEFFICIENTS[k]" in text
    callee.write_text(
        text.replace("            h = h * y + _COEFFICIENTS[k]", "            h = h * y + 2 * _COEFFICIENTS[k]")
    )
    changed, hits = run(source, cache)
    assert hits == "0"
    assert float(changed) == 2 * float(value)
    assert not list(source.rglob("*.nbi"))


def test_every_kernel_is_kept_in_the_one_folder():
    """Whatever module is asked for first: numba's own cache, beside the source, would hold old kernels and load the
    whole compiler."""
    code = (
        "import importlib, pathlib, sys; from numba.core.dispatcher import Dispatcher; import ribbon\n"
        "names = ['.'.join(path.with_suffix('').parts) for path in sorted(pathlib.Path('ribbon').rglob('*.py'))\n"
        "         if '@njit' not in path.read_text() and path.stem != '__init__']\n"
        "[importlib.import_module(name) for name in names]\n"
        "from ribbon.element import kernel_cache\n"
        "home = str(kernel_cache.root())\n"
        "print(*sorted({f'{name}.{key}' for name, module in list(sys.modules.items()) if name.startswith('ribbon.')\n"
        "    for key, value in vars(module).items() if isinstance(value, Dispatcher) and value.targetoptions\n"
        "    and not str(getattr(value._cache, '_cache_path', home)).startswith(home)}), len(names))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    elsewhere = done.stdout.split()
    assert int(elsewhere.pop()) > 100
    assert elsewhere == []


def test_other_users_of_numba_keep_their_cache_folder():
    from numba.core import config

    import ribbon.element.kernel_cache as kernel_cache

    before = config.CACHE_DIR
    with kernel_cache.in_use():
        assert before != config.CACHE_DIR
        assert kernel_cache.digest() in config.CACHE_DIR
    assert before == config.CACHE_DIR


def test_old_states_are_removed_but_never_the_present_one(tmp_path):
    from ribbon.element.kernel_cache import CACHE
    from ribbonbench.kernel_cache import KEPT

    for number in range(KEPT + 3):
        (tmp_path / f"ribbon-{number}").mkdir()
        os.utime(tmp_path / f"ribbon-{number}", (number, number))
    others = ("shellref-0", "mine", "0123456789abcde")
    nameless = "0123456789abcdef"  # of a version that did not name packages
    for name in (*others, nameless):
        (tmp_path / name).mkdir()
        os.utime(tmp_path / name, (0, 0))
    CACHE.prune(tmp_path, "ribbon-0")
    left = {entry.name for entry in tmp_path.iterdir()}
    assert left == {
        *others,
        "ribbon-0",
        *(f"ribbon-{number}" for number in range(KEPT + 3 - (KEPT - 1), KEPT + 3)),
    }
    CACHE.prune(tmp_path / "nowhere", "x")


#: A kernel called twice: its sum, what was told of compilations, and whether numba's typed dictionaries were imported.
CALLED = (
    "import sys\n"
    "import numpy as np\n"
    "from ribbon.element.kernel_cache import told\n"
    "from ribbon.surface import centreline\n"
    "q, line = np.array([[0.1, 1.0, 0.0, 0.2]]), np.zeros((2, 3))\n"
    "args = q, np.ones(1), line, np.array([np.eye(3)] * 2), np.linspace(0, 1, 5), 6.0\n"
    "said = []\n"
    "with told(said.append):\n"
    "    found = centreline(*args)\n"
    "    centreline(*args)\n"
    "assert said == list(range(1, len(said) + 1)), said\n"
    "print(float(sum(part.sum() for part in found)), len(said), 'numba.typed.typedobjectutils' in sys.modules)\n"
)


@pytest.fixture(scope="module")
def called(tmp_path_factory):
    """What `CALLED` prints with no kernel kept, and then with all."""
    environment = {**os.environ, "RIBBONBENCH_CACHE": str(tmp_path_factory.mktemp("kernels"))}
    environment.pop("NUMBA_CACHE_DIR", None)
    words = [sys.executable, "-c", CALLED]
    return tuple(
        subprocess.run(words, capture_output=True, text=True, env=environment, check=True, cwd=ROOT).stdout.split()
        for _ in range(2)
    )


def test_a_kept_kernel_is_loaded_without_what_compiles(called):
    """What numba needs to compile (its typed dictionaries, say) is not imported for kernels that are kept."""
    first, second = called
    assert (first[2], second[2]) == ("True", "False")
    assert float(first[0]) == float(second[0])


def test_compilations_are_told(called):
    """Once for each kernel that is compiled, callees included, and never for one that is kept."""
    first, second = called
    assert int(first[1]) > 1
    assert int(second[1]) == 0


def test_a_solve_with_kept_kernels_imports_no_linear_algebra_and_nothing_that_compiles():
    code = (
        "import sys\n"
        "from ribbon import Clamp, Gravity, Strip, solve\n"
        "found = solve(Strip(1.0, 0.03, 0.4, 10.0, 100.0), Clamp(), Gravity((1, 0, 0)), segments=20)\n"
        "names = 'scipy.linalg', 'scipy.sparse', 'numba.np.linalg', 'numba.cpython.unicode', 'cyipopt'\n"
        "print(found.ok, found.stable, [name for name in names if name in sys.modules])\n"
    )
    words = [sys.executable, "-c", code]
    for _ in range(2):  # the first compiles what is not kept yet
        found = subprocess.run(words, capture_output=True, text=True, check=True, cwd=ROOT).stdout
    assert found.strip() == "True True []"


def test_llvm_code_of_kept_kernels_waits_for_a_compilation():
    """A solve reads none; a function of the user's own that calls a kept kernel is compiled with it, and is right; and
    then numba knows of all that was loaded."""
    code = (
        "import numba, numpy as np\n"
        "from ribbon import Clamp, Gravity, Strip, solve\n"
        "from ribbon.element.element import bending_value\n"
        "from ribbonbench import kernel_late\n"
        "found = solve(Strip(1.0, 0.03, 0.4, 10.0, 100.0), Clamp(), Gravity((1, 0, 0)), segments=20)\n"
        "args = 1, 0.0, 2.0, 0.5, 0.1, 1.0, (0.2, 1e-3, 0.3)\n"
        "plain = bending_value(*args)\n"
        "waiting = kernel_late.waiting()\n"
        "twice = numba.njit(lambda x: 2.0 * bending_value(1, x, 2.0, 0.5, 0.1, 1.0, (0.2, 1e-3, 0.3)))\n"
        "print(found.ok, waiting > 5, twice(0.0) == 2.0 * plain)\n"
        "kernel_late.read_all()\n"
        "print(kernel_late.waiting(), solve(Strip(1.0, 0.03), Clamp(), segments=8).ok)\n"
    )
    words = [sys.executable, "-c", code]
    for _ in range(2):  # the first compiles what is not kept yet
        found = subprocess.run(words, capture_output=True, text=True, check=True, cwd=ROOT).stdout
    assert found.split() == ["True", "True", "True", "0", "True"]


@pytest.mark.parametrize("more", ["", ", end=Clamp((0, 0, 0.9)), seed_ruling=0.01"])
@pytest.mark.parametrize("energy", ["sadowsky", "wunderlich", "finite"])
def test_with_kept_kernels_nothing_is_compiled(energy, more):
    """A kernel that is not kept but called from Python would be, in every process: the half of a solve's time."""
    code = (
        "from ribbon import Clamp, Gravity, Strip, solve\n"
        "from ribbon.element.kernel_cache import told\n"
        "said = []\n"
        "with told(said.append):\n"
        "    strip = Strip(1.0, 0.03, 0.4, 3.0, 10.0, thickness=1e-3)\n"
        f"    found = solve(strip, Clamp(), Gravity((1, 0, 0)), segments=20, energy='{energy}'{more})\n"
        "    found.start.moment, found.surface(10, 2)\n"
        "print(found.ok, len(said))\n"
    )
    words = [sys.executable, "-c", code]
    for _ in range(2):  # the first compiles what is not kept yet
        found = subprocess.run(words, capture_output=True, text=True, check=True, cwd=ROOT).stdout
    assert found.split() == ["True", "0"]


def test_a_state_of_the_sources_is_that_of_the_kernels_and_what_they_use(tmp_path):
    """What only calls kernels belongs to no state; what kernels are made from does, constants included."""
    from ribbon.element.kernel_cache import CACHE

    package = tmp_path / "ribbon"
    shutil.copytree(ROOT / "ribbon", package, ignore=shutil.ignore_patterns("__pycache__"))
    found = CACHE.sources(package)
    kernels = {
        ".".join(path.relative_to(tmp_path).with_suffix("").parts)
        for path in package.rglob("*.py")
        if "@njit" in path.read_text()
    }
    assert len(kernels) > 10
    assert kernels <= set(found)
    assert "ribbon.problems.layout" in found  # numbers of columns, constants in the kernels
    only_call = {name for name in found if name.startswith(("ribbon.find.", "ribbon.solvers."))} - kernels
    assert not only_call


def test_a_kept_kernel_that_is_damaged_or_anothers_is_none(tmp_path):
    from ribbonbench.kernel_files import _File

    kernel = _File(str(tmp_path), "kernel", "source")
    keys = ["float64", "int64"]
    for key in keys:
        kernel.save(key, {"code": key})
    paths = {key: kernel._path(key)[0] for key in keys}
    assert [kernel.load(key) for key in keys] == [{"code": key} for key in keys]
    whole = paths["int64"].read_bytes()
    for damaged in (whole[:-1], whole[:20], b"", whole[:40] + bytes([whole[40] ^ 1]) + whole[41:]):
        paths["int64"].write_bytes(damaged)
        assert kernel.load("int64") is None
    paths["int64"].write_bytes(paths["float64"].read_bytes())
    assert kernel.load("int64") is None
    assert _File(str(tmp_path), "kernel", "another source").load("float64") is None
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]


def test_who_may_write_a_folder_may_run_code(tmp_path):
    from ribbonbench.trusted import fault, made

    place = made(tmp_path / "a" / "b")
    assert fault(place) is None
    assert fault(tmp_path / "not there") is None
    (place / "kernel").write_bytes(b"x")
    (place / "kernel").chmod(0o600)
    assert fault(place) is None
    for path, mode in ((place / "kernel", 0o666), (place / "kernel", 0o620), (place, 0o770), (place.parent, 0o777)):
        before = path.stat().st_mode
        path.chmod(mode)
        assert fault(place) is not None
        path.chmod(before)
    assert fault(place) is None
    (place / "link").symlink_to(place / "kernel")
    assert "link" in (fault(place) or "")
    if os.geteuid() == 0:
        (place / "link").unlink()
        os.chown(place / "kernel", 12345, 12345)
        assert "another user" in (fault(place) or "")


def test_every_place_of_the_same_sources_shares_its_kernels(compiled, tmp_path):
    """An installed wheel, a second checkout: nothing is compiled again."""
    _, cache, (value, _) = compiled
    copied(tmp_path)
    assert run(tmp_path, cache) == [value, "1"]
