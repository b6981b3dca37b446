"""docs/extend.md: what the page adds works where the page says: energy and command in a copy, the model beside it.

The copy runs in a process of its own with numba's compiler off: few segments, no compilation.
"""

from __future__ import annotations

import csv
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import pyvista

from compare import registry
from compare.cli import main
from compare.models import solve
from compare.scene.scene import load
from tests.docs_blocks import DOCS, ROOT, blocks
from tests.patience import PATIENCE

PAGE = (DOCS / "extend.md").read_text()

SOLVES = """
import numpy as np
from ribbon import Clamp, Gravity, RibbonInputError, Strip, solve
from ribbon.energies import threaded

assert "copy" in threaded.__file__, threaded.__file__
up, factor = Gravity(up=(0, 1, 0)), 1.0 + threaded.BENDING
plain = solve(Strip(1.0, 0.05, gamma=4.0), Clamp(), up, energy="sadowsky", segments=4)
stiff = solve(Strip(1.0, 0.05, gamma=4.0 * factor), Clamp(), up, energy="threaded", segments=4)
assert plain.ok and stiff.ok, (plain.message, stiff.message)
gap = np.abs(plain.end.position - stiff.end.position).max()
assert gap < 1e-9, gap
assert abs(stiff.energy.total - factor * plain.energy.total) < 1e-9
softer = solve(Strip(1.0, 0.05, gamma=4.0), Clamp(), up, energy="threaded", segments=4)
assert softer.end.position[1] > plain.end.position[1] + 0.02  # the thread stiffens
print("threaded", gap)
"""

#: The same energy in a scene: exported, estimated and explained with its own terms.
OWN_TERMS = """
import compare.models.effects.ribbon_off as timed
import numpy as np
from compare.studies.effects import explain
from compare.models import solve as solve_scene
from compare.models.ribbon.estimate import CORNER_CLAMP, estimate
from compare.scene import load
from ribbon.energies import threaded
from ribbon.find.softened import soften
from tests.energy_integrals import over_s, over_surface

assert "copy" in threaded.__file__, threaded.__file__
scene = load("curl_4_3").replace({"model.energy": "threaded", "model.elements": 3, "shell.clamp": "corners"})
e = solve_scene(scene, "ribbon").native
assert e.ok and e.problem.energy == "threaded" and e.max_abs_eta > 0.1, (e.message, e.max_abs_eta)
assert abs(over_s(e) - e.energy.elastic) < 1e-9 * abs(e.energy.elastic), (over_s(e), e.energy.elastic)
assert abs(over_surface(e) - e.energy.elastic) < 1e-9 * abs(e.energy.elastic), (over_surface(e), e.energy.elastic)

# the share near the held corners, from the formula on the page
h, s = scene.width / 100.0, (np.arange(1000) + 0.5) / 1000
there = soften(e, h)
omega, eta, natural = there.omega(s), there.eta(s), scene.curvature[0]
bending = 0.5 * omega**2 * ((1 + eta**2) ** 2 + threaded.BENDING + threaded.TORSION * eta**2)
density = bending - natural * omega * (1 + scene.strip.poisson * eta**2) + 0.5 * natural**2
near = density[s < 0.5 * scene.width].sum() / density.sum()
expected = CORNER_CLAMP * near * (scene.width * h) ** 0.5 / (scene.width / 8.0)
expected = expected / (1.0 + expected)  # it is in the whole too
found = estimate(scene, e, 100.0)
assert abs(found.parts["clamps"] - expected) < 1e-9 * expected, (found.parts, expected)

timed._SAMPLES = 2  # kernels are interpreted here
effects = {effect.key: effect for effect in explain(scene).effects}
assert effects["thread"].on and effects["thread"].seconds is not None and "threaded" in effects["thread"].why
assert not effects["finite width (Wunderlich)"].on
assert effects["thread"].changes["model.energy"] == "sadowsky"
plain = explain(scene.replace({"model.energy": "wunderlich"})).effects
assert [effect.on for effect in plain if effect.key in ("finite width (Wunderlich)", "thread")] == [True, False]
print("own terms")
"""


def patched(text: str, hunk: list[str], name: str) -> str:
    """`text` with one replacement: the lines "-" (found once) become the lines "+"."""
    old = "\n".join(line[1:] for line in hunk if line.startswith("-"))
    new = "\n".join(line[1:] for line in hunk if line.startswith("+"))
    assert text.count(old) == 1, f"{name} has changed: {old!r}"
    return text.replace(old, new)


def hunks(diff: str) -> tuple[str, list[list[str]]]:
    """The file of a diff block, and its runs of "-" lines with the "+" lines that follow."""
    lines = diff.splitlines()
    name = lines[1].removeprefix("+++ b/")
    found: list[list[str]] = []
    for line in lines[2:]:
        if line.startswith("-") and (not found or any(x.startswith("+") for x in found[-1])):
            found.append([])
        found[-1].append(line)
    return name, found


@pytest.fixture
def copy(tmp_path):
    """A copy of the sources with what the page adds."""
    root = tmp_path / "copy"
    for package in ("ribbonbench", "ribbon", "compare", "shellref"):
        shutil.copytree(ROOT / package, root / package, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", root)
    added = 0
    for block in blocks(PAGE):
        named = re.match(r"# ((?:ribbon|compare)/\S+\.py)\n", block.text)
        if block.info == "python" and named:
            (root / named[1]).write_text(block.text)
            added += 1
        elif block.info == "diff":
            name, changes = hunks(block.text)
            for hunk in changes:
                (root / name).write_text(patched((root / name).read_text(), hunk, name))
            added += 1
    assert added == 5
    return root


@pytest.mark.parametrize("code", [SOLVES, OWN_TERMS], ids=["solves", "own terms"])
def test_the_energy_of_the_page(copy, tmp_path, code):
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "OMP_NUM_THREADS": "1"}
    environment["PYTHONPATH"] = os.pathsep.join([str(copy), str(ROOT)])  # the copy before the sources, tests from there
    environment["NUMBA_CACHE_DIR"] = str(tmp_path / "cache")
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=copy, env=environment, capture_output=True, text=True, timeout=PATIENCE
    )
    assert done.returncode == 0, done.stderr[-3000:]


#: What the page adds of a study: the files of one name.
STUDY = {f"compare/{room}/reach.py" for room in ("commands", "studies", "pages")}


def test_the_command_of_the_page(copy, tmp_path):
    """The page's study runs on the scene's own model, whatever that is, and writes what every study writes; it is three
    files, and no other file knows it."""
    environment = {**os.environ, "PYTHONPATH": str(copy), "OMP_NUM_THREADS": "1", "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-m", "compare.cli", "reach", "cantilever", "--quiet"]
    done = subprocess.run(
        [*command, "--set", "model.energy=elastica"], cwd=tmp_path, env=environment, capture_output=True, text=True,
        timeout=PATIENCE,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
    out = tmp_path / "out/cantilever/reach"
    result = json.loads((out / "result.json").read_text())
    assert [row["size"] for row in result["rows"]] == ["5", "10", "20"]
    assert [check["name"] for check in result["answer"]["checks"]] == ["finite", "residual"]
    with (out / "table.csv").open() as stream:
        assert [float(row["reach"]) for row in csv.DictReader(stream)] == [row["reach"] for row in result["rows"]]
    assert json.loads((out / "page.json").read_text())["command"] == "reach"
    fine = solve(load("cantilever"), "elastica").end.position
    apart = [abs(row["reach"] - float(np.linalg.norm(fine))) for row in result["rows"]]
    assert apart[0] > 3.0 * apart[1] > 9.0 * apart[2]  # order 2
    before = {name: text for name, text in files_of(ROOT / "compare").items() if "__pycache__" not in name}
    after = files_of(copy / "compare")
    assert {f"compare/{name}" for name in after if after[name] != before.get(name)} == STUDY


@pytest.fixture
def arc(tmp_path, monkeypatch, kept_shells):
    """The model of the page, installed in a folder of its own: three files."""
    folder = tmp_path / "site"
    written = 0
    for block in blocks(PAGE):
        named = re.match(r"# (arc_model\S*)\n", block.text)
        if named:
            path = folder / named[1]
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(block.text if path.suffix == ".py" else block.text.partition("\n")[2])
            written += 1
    assert written == 3
    monkeypatch.syspath_prepend(str(folder))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(folder), str(ROOT)]))
    monkeypatch.chdir(tmp_path)
    registry.entries.cache_clear()
    registry.model.cache_clear()
    yield
    registry.entries.cache_clear()
    registry.model.cache_clear()
    sys.modules.pop("arc_model", None)


#: The arc of the page within the package: asked for by `model.energy`, as every model of the house is.
OF_THE_HOUSE = """
import numpy as np
from compare import registry
from compare.models import solve
from compare.scene.scene import load

assert "copy" in registry.__file__ and registry.home("arc") == "compare.models.arc"
scene = load("curl_4_3").replace({"model.energy": "arc", "strip.natural_curvature": 2.0, "model.grading": "uniform"})
state = solve(scene)
assert state.ok and state.model == "arc", state
assert abs(state.shape.bend - 2.0 * (1.0 + 20.0**-2)) < 1e-12
assert [ladder.name for ladder in registry.model("arc").ladders(scene)] == ["arc"]
assert registry.model("arc").effects(scene)[0].changes == {"strip.natural_curvature": 0.0}
"""


def files_of(root: Path) -> dict[str, bytes]:
    return {str(path.relative_to(root)): path.read_bytes() for path in root.rglob("*") if path.is_file()}


def test_a_model_of_the_house_is_one_module_and_one_line(copy):
    """The module of the page, put into the package, and its line in the registry: two files, and nothing else names
    it."""
    before = files_of(copy)
    block = next(block for block in blocks(PAGE) if block.text.startswith("# arc_model.py"))
    (copy / "compare/models/arc.py").write_text(block.text)
    place = copy / "compare/registry.py"
    line = '    Entry("arc", ("arc",), "compare.models.arc:Arc"),\n'
    place.write_text(place.read_text().replace("BUILT_IN = (\n", f"BUILT_IN = (\n{line}"))
    environment = {**os.environ, "PYTHONPATH": str(copy), "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run(
        [sys.executable, "-c", OF_THE_HOUSE], cwd=copy, env=environment, capture_output=True, text=True,
        timeout=PATIENCE,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
    after = files_of(copy)
    touched = {name for name in after if after[name] != before.get(name)}
    assert touched == {"compare/models/arc.py", "compare/registry.py"}
    assert place.read_text().count("arc") == line.count("arc") + before["compare/registry.py"].decode().count("arc")


#: A key of [tip] that nobody has heard of.
SPIN = """    spin: float | None = key(
        Kind.NUMBER, "planted: turns of the end", "turn", ">= 0", "2.0", default=None, newer=True, known="s <= 10"
    )
"""
#: What then holds of it, and of a model that reads it.
OF_A_KEY = """
from compare import registry
from ribbonbench.errors import BadInput
from compare.models.base import check_keys
from compare.scene.keys import KEYS
from compare.scene.scene import load, loads

assert "copy" in registry.__file__ and KEYS["tip.spin"].unit == "turn"
plain = load("curl_4_3").replace({"model.energy": "arc", "model.grading": "uniform", "seed": {}})
spun = plain.replace({"tip.spin": 2.0})
assert spun.tip.spin == 2.0 and plain.tip is None
assert loads(spun.to_toml()).tip.spin == 2.0
assert spun.canonical()["tip"]["spin"] == 2.0 and "spin" not in str(plain.canonical())
for wrong in (-1.0, 11.0, "two"):
    try:
        plain.replace({"tip.spin": wrong})
    except BadInput as refused:
        assert refused.key == "tip.spin", refused
    else:
        raise AssertionError(wrong)
for name in registry.names():
    model = registry.model(name)
    unread = [key for key in spun.given() if key not in model.reads and key not in model.without_effect]
    assert ("tip.spin" in unread) == (name != "arc"), (name, unread)
check_keys(registry.model("arc"), spun)
try:
    check_keys(registry.model("ribbon"), spun.replace({"model.energy": "sadowsky"}))
except BadInput as refused:
    assert refused.key == "tip.spin", refused
else:
    raise AssertionError("read by no one")
"""


def test_a_scene_key_is_one_declaration_and_a_model_that_reads_it(copy):
    """A key is a field of its section; reading, ranges, TOML, the scene's hash and the help have it then, and every
    model refuses it by name but the one that says that it reads it."""
    block = next(block for block in blocks(PAGE) if block.text.startswith("# arc_model.py"))
    own = block.text.replace(
        "keys.BOTH_CLAMPS | keys.ENERGY", 'keys.BOTH_CLAMPS | keys.ENERGY | keys.inside("tip", "spin")'
    )
    (copy / "compare/models/arc.py").write_text(own)
    place = copy / "compare/registry.py"
    line = '    Entry("arc", ("arc",), "compare.models.arc:Arc"),\n'
    place.write_text(place.read_text().replace("BUILT_IN = (\n", f"BUILT_IN = (\n{line}"))
    before = files_of(copy)
    spec = copy / "compare/scene/spec.py"
    section = spec.read_text().index("class TipSpec")
    at = spec.read_text().index("    moment: Vector | None = key(", section)
    spec.write_text(spec.read_text()[:at] + SPIN + spec.read_text()[at:])
    environment = {**os.environ, "PYTHONPATH": str(copy), "PYTHONDONTWRITEBYTECODE": "1"}

    def run(*arguments: str) -> str:
        done = subprocess.run(
            [sys.executable, *arguments], cwd=copy, env=environment, capture_output=True, text=True, timeout=PATIENCE
        )
        assert done.returncode == 0, done.stderr[-3000:]
        return done.stdout

    run("-c", OF_A_KEY)
    assert "planted: turns of the end" in run("-m", "compare.cli", "keys", "tip.spin")
    after = files_of(copy)
    assert {name for name in after if after[name] != before.get(name)} == {"compare/scene/spec.py"}


#: curl_4_3 for the arc: a quarter of a turn, one small shell.
OWN = [
    "--set", "model.energy=arc", "--set", "strip.natural_curvature=1.5707963267948966",
    "--set", "strip.gamma=0", "--set", "model.grading=uniform",
    "--set", "shell.width_to_thickness=[10, 20]", "--set", "shell.elements=[8, 1]",
    "--quiet",
]  # fmt: skip


def result_of(command: str, *more: str, own: list[str] = OWN) -> dict:
    assert main([command, "curl_4_3", *own, *more, "--out", f"out/{command}"]) in (0, 1)
    return json.loads(Path(f"out/{command}/result.json").read_text())


def test_the_model_of_the_page_is_solved_swept_explained_and_exported(arc):
    """Everywhere the same end: the arc's, (1 - 1/n^2) from that of a quarter turn."""
    solved = result_of("solve")
    curvature = 0.5 * np.pi * (1.0 + 20.0**-2)
    scene = load("curl_4_3")
    end = (
        np.array([np.sin(curvature), np.cos(curvature) - 1.0])
        / curvature
        @ np.array([scene.frame[:, 2], scene.frame[:, 1]])
    )
    assert solved["end"]["position"] == pytest.approx(end, abs=1e-12)
    assert solved["energy"]["elastic"] == pytest.approx(-0.5 * curvature**2)
    assert solved["status"] == "converged"
    assert main(["sweep", "curl_4_3", *OWN, "--solver", "arc", "--vary", "model.elements=20,40", "--workers", "1"]) == 0
    with Path("out/curl_4_3/sweep/cases.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert [row["status"] for row in rows] == ["converged"] * 2
    assert [float(rows[0][f"end.{axis}"]) for axis in "xyz"] == pytest.approx(end, abs=1e-12)
    explained = result_of("explain")
    assert next(effect["name"] for effect in explained["explanation"]["effects"]) == "natural curvature"
    assert main(["export", "out/solve", "--format", "obj,vtu,gltf", "--out", "out/export", "--quiet"]) == 0
    points = pyvista.read("out/export/arc.vtu").points
    assert np.linalg.norm(points - end, axis=1).min() < 1e-6
    assert main(["solve", "curl_4_3", *OWN, "--set", "seed.curvature=3.0", "--out", "out/x"]) == 2  # it has no seed


@pytest.mark.shell
def test_the_model_of_the_page_is_compared_converged_and_timed(arc):
    pytest.importorskip("dolfinx")
    row = result_of("compare")["rows"][0]
    assert row["status"] == "converged"
    assert row["ribbon_error"] == pytest.approx(0.5 * np.pi * (1 + 1 / 400) / 400)
    assert 0.0 < row["hausdorff"] < row["ribbon_error"]  # weightless both are the arc, but for the model's own error
    assert row["claimed"] is False
    assert [one["status"] for one in result_of("converge")["rows"]] == ["converged"] * 2
    cost = result_of("cost", "--meshes", "4x1", "8x1", "--repeats", "1", "--width-to-thickness", "10")
    arcs = [one for one in cost["cost"]["rows"] if one["solver"] == "arc"]
    assert len(arcs) == 4
    errors = [one["error"] for one in arcs]
    assert errors[0] > 3.0 * errors[1] > 9.0 * errors[2]
