"""docs/extend.md: the energy of the page, added to a copy of the package as the page says, is solved there.

The copy runs in a process of its own with numba's compiler off: few segments, no compilation.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys

import pytest

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
from compare.models.ribbon_estimate import CORNER_CLAMP, estimate
from compare.models import solve as solve_scene
from compare.scene import load
from ribbon.energies import threaded
from ribbon.energies.softened import soften
from tests.energy_integrals import over_s, over_surface

assert "copy" in threaded.__file__, threaded.__file__
scene = load("curl_4_3").replace({"model.energy": "threaded", "model.elements": 3, "shell.clamp": "corners"})
e = solve_scene(scene).native
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
found = estimate(scene, e, 100.0)
assert abs(found.parts["clamps"] - expected) < 1e-9 * expected, (found.parts, expected)

timed._SAMPLES = 2  # kernels are interpreted here
effects = {effect.key: effect for effect in explain(scene).effects}
assert effects["thread"].on and effects["thread"].seconds is not None and "threaded" in effects["thread"].why
assert not effects["finite width (Wunderlich)"].on
assert scene.replace(effects["thread"].changes).model.energy == "sadowsky"
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
    for package in ("ribbon", "compare", "shellref"):
        shutil.copytree(ROOT / package, root / package, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", root)
    added = 0
    for block in blocks(PAGE):
        named = re.match(r"# (ribbon/\S+\.py)\n", block.text)
        if block.info == "python" and named:
            (root / named[1]).write_text(block.text)
            added += 1
        elif block.info == "diff":
            name, changes = hunks(block.text)
            for hunk in changes:
                (root / name).write_text(patched((root / name).read_text(), hunk, name))
            added += 1
    assert added == 2
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
