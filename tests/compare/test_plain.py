"""The wheel in an environment that has wheels of pip and nothing else: no compiler, no system packages, no Ipopt."""

from __future__ import annotations

import json
import os
import shutil
import subprocess

import pytest

from compare.cli import main
from tests.compare.test_packaging import wheel as wheel
from tests.ground.test_system import SCENE

pytestmark = pytest.mark.validate
#: Interpreters that are looked for; each that is there is tried.
PYTHONS = ("python3.11", "python3.12", "python3.13")


def run(*words, cwd, **environment):
    """The finished process, without this environment's packages."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "VIRTUAL_ENV"))}
    return subprocess.run(
        [str(word) for word in words], cwd=cwd, env={**kept, **environment}, capture_output=True, text=True, check=False
    )


@pytest.fixture(scope="module", params=PYTHONS)
def plain(request, wheel, tmp_path_factory):
    """A venv with the wheel and what pip brings for it."""
    interpreter = shutil.which(request.param)
    works = interpreter and run(interpreter, "-c", "import venv, ensurepip", cwd="/").returncode == 0
    if not works:
        pytest.skip(f"{request.param} is not on this machine")
    place = tmp_path_factory.mktemp("plain")
    assert run(interpreter, "-m", "venv", place / "venv", cwd=place).returncode == 0
    pip = run(place / "venv/bin/python", "-m", "pip", "install", "--only-binary=:all:", "--quiet", wheel, cwd=place)
    if "No matching distribution" in pip.stderr or "Connection" in pip.stderr:
        pytest.skip("pip reaches no index of packages")
    assert pip.returncode == 0, pip.stderr
    return place


def ask(place, *words):
    """The command's answer (result.json) and its process."""
    (place / "strip.toml").write_text(SCENE)
    done = run(place / "venv/bin/ribbonbench", *words, "--out", "out", cwd=place, XDG_CACHE_HOME=str(place / "cache"))
    return done, json.loads((place / "out" / "result.json").read_text()) if done.returncode == 0 else {}


def test_a_strip_is_solved_judged_and_swept_by_wheels_alone(plain):
    assert run(plain / "venv/bin/python", "-c", "import cyipopt", cwd=plain).returncode != 0
    done, solved = ask(plain, "solve", "strip.toml")
    assert done.returncode == 0, done.stderr
    assert (solved["status"], solved["stable"]) == ("converged", True)
    assert solved["residual"] <= 1e-8
    done, limits = ask(plain, "limits", "strip.toml", "--quick")
    assert done.returncode == 0, done.stderr
    (row,) = limits["rows"]
    here = main(["limits", str(plain / "strip.toml"), "--quick", "--quiet", "--out", str(plain / "here")])
    assert here == 0
    (own,) = json.loads((plain / "here" / "result.json").read_text())["rows"]
    assert row["estimate"]["distance"] == pytest.approx(own["estimate"]["distance"], rel=1e-6)
    done, _ = ask(plain, "solve", "rod_wrung")
    assert done.returncode == 3
    said = [line for line in done.stderr.splitlines() if line.startswith("ribbonbench: ")]
    assert len(said) == 1
    assert "ribbonbench[judge]" in said[0]
    assert "Traceback" not in done.stderr
