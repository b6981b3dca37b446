"""The recipes for clusters on the page of `sweep`, with stand-ins for Slurm and executorlib: the table of one run."""

from __future__ import annotations

import csv
import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from compare.cli import NOT_CONVERGED, main
from tests.docs_blocks import DOCS, blocks
from tests.patience import PATIENCE

PAGE = (DOCS / "commands" / "sweep.md").read_text()
SECTION = PAGE[PAGE.index("## On a cluster") : PAGE.index("## More than 100,000 cases")]
SCRIPTS = [block.text for block in blocks(SECTION) if block.info == "sh"]
#: Twelve light cantilevers; no stable state is found of some of them.
SWEEP = """
title = "Twelve"
scene = "cantilever"
leave_saddle = false
[set]
model.elements = 8
gravity.up = [0.0, 0.6, 0.8]
[[axis]]
key = "strip.gamma"
spacing = "log"
first = 1.0
last = 300.0
count = 4
[[axis]]
key = "strip.natural_curvature"
values = [0.0, 2.5, 5.0]
"""
#: Runs a job at once, an array of it with two parts; what it was called with goes into calls.txt.
SBATCH = """#!/bin/bash
echo "$@" >> calls.txt
script="${@: -1}"
if grep -q '^#SBATCH --array=' "$script"; then
    for k in 1 2; do SLURM_ARRAY_TASK_ID=$k SLURM_ARRAY_TASK_COUNT=2 bash "$script" >&2 || exit 9; done
else
    bash "$script" >&2 || exit 9
fi
echo 4711
"""
SRUN = '#!/bin/bash\nexec "$@"\n'
#: Runs each function when it is submitted; the arguments that the recipe gives must be those of executorlib.
EXECUTORLIB = """
from concurrent.futures import Future
class SlurmClusterExecutor:
    def __init__(self, *, resource_dict):
        assert set(resource_dict) == {"cores", "cwd", "run_time_max"} and resource_dict["cores"] == 1
    def __enter__(self):
        return self
    def __exit__(self, *_):
        pass
    def submit(self, function, *words):
        end = Future()
        end.set_result(function(*words))
        return end
"""


def rows(folder: Path) -> list[dict[str, str]]:
    with (folder / "cases.csv").open() as stream:
        return [{k: v for k, v in row.items() if k != "seconds"} for row in csv.DictReader(stream)]


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A folder with the sweep, the scripts and the stand-ins; the commands of this environment on the path."""
    (tmp_path / "million.toml").write_text(SWEEP)
    for name, text in (("part.sh", SCRIPTS[0]), ("join.sh", SCRIPTS[1]), ("alone.sh", SCRIPTS[3])):
        (tmp_path / name).write_text(text)
    (tmp_path / "bin").mkdir()
    for name, text in (("sbatch", SBATCH), ("srun", SRUN)):
        (tmp_path / "bin" / name).write_text(text)
        (tmp_path / "bin" / name).chmod(0o755)
    own = f'#!/bin/bash\nexec {sys.executable} -m ribbonbench "$@"\n'
    (tmp_path / "bin" / "ribbonbench").write_text(own)
    (tmp_path / "bin" / "ribbonbench").chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path / 'bin'}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(DOCS.parent), os.environ.get("PYTHONPATH", "")]))
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture(scope="module")
def one(tmp_path_factory):
    """The table of a run in one piece, which ends with 1."""
    out = tmp_path_factory.mktemp("one")
    (out / "million.toml").write_text(SWEEP)
    assert (
        main(["sweep", str(out / "million.toml"), "--workers", "1", "--quiet", "--out", str(out / "o")])
        == NOT_CONVERGED
    )
    return rows(out / "o")


def ran(*words, cwd):
    done = subprocess.run(words, cwd=cwd, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_page_has_four_scripts_for_slurm():
    assert len(SCRIPTS) == 4
    assert [text.startswith("#!/bin/bash\n#SBATCH ") for text in SCRIPTS] == [True, True, False, True]
    for text in SCRIPTS:
        for line in re.findall(r"^#SBATCH (.*)$", text, re.M):
            assert all(re.fullmatch(r"--[a-z-]+(=[\w:.-]+)?", word) for word in line.split()), line
        assert subprocess.run(["bash", "-n"], input=text, text=True, check=False).returncode == 0


def test_an_array_and_what_depends_on_it_give_the_table_of_one_run(place, one):
    ran("bash", "-e", "-c", SCRIPTS[2], cwd=place)
    calls = (place / "calls.txt").read_text().splitlines()
    assert calls == ["--parsable part.sh", "--dependency=afterany:4711 join.sh"]
    assert {path.name for path in (place / "parts").iterdir()} == {"1", "2"}
    assert rows(place / "all") == one


@pytest.mark.validate
def test_one_allocation_gives_the_table_of_one_run(place, one):
    ran("bash", "alone.sh", cwd=place)
    assert rows(place / "all") == one


def recipe(text: str, parts: int) -> str:
    assert text.count("OF = 64") == 1
    return text.replace("OF = 64", f"OF = {parts}")


@pytest.mark.validate
def test_executorlib_s_recipe_makes_the_parts(place, one):
    (text,) = [block.text for block in blocks(SECTION) if "executorlib" in block.text]
    (place / "executorlib.py").write_text(EXECUTORLIB)
    (place / "run.py").write_text(recipe(text, 2))
    codes = ran(sys.executable, "run.py", cwd=place)
    assert sorted(codes.strip("[]\n").split(", ")) in (["0", "1"], ["1", "1"])
    ran("bash", "join.sh", cwd=place)
    assert rows(place / "all") == one


@pytest.mark.validate
@pytest.mark.skipif(importlib.util.find_spec("executorlib") is None, reason="no executorlib")
def test_executorlib_itself_makes_the_parts(place, one):
    """Its executor of one machine, in place of the cluster's."""
    (text,) = [block.text for block in blocks(SECTION) if "executorlib" in block.text]
    here = (
        recipe(text, 2).replace("SlurmClusterExecutor", "SingleNodeExecutor").replace(', "run_time_max": 4 * 3600', "")
    )
    guarded = here.replace("with Single", 'if __name__ == "__main__":\n  with Single').replace(
        "\n    ends", "\n      ends"
    )
    (place / "run.py").write_text(guarded.replace("\n    print", "\n      print"))
    ran(sys.executable, "run.py", cwd=place)
    ran("bash", "join.sh", cwd=place)
    assert rows(place / "all") == one
