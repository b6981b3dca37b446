"""A strip that stretches between clamps one length apart: its closed form against collocation and against the shell."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy.integrate import solve_bvp, trapezoid

from compare.cli import DONE, main
from compare.models import solve
from compare.models.ribbon.taut import between_clamps, taut
from compare.scene.scene import loads

SCENE = """
[strip]
length = 0.5
width = 0.02
thickness = 1e-4
young = 2e11
density = 7850.0
poisson = 0.3
[gravity]
up = [0.0, 1.0, 0.0]
[clamp.start]
tangent = [0.0, 0.0, 1.0]
normal = [0.0, 1.0, 0.0]
[clamp.end]
position = [0.0, 0.0, 0.5]
tangent = [0.0, 0.0, 1.0]
normal = [0.0, 1.0, 0.0]
[model]
elements = 8
[shell]
elements = [40, 4]
"""


@pytest.mark.parametrize(("weight", "stretching"), [(0.1, 1e4), (1.0, 1e4), (50.0, 2.7e8), (100.0, 1e5), (1e4, 1e9)])
def test_tension_and_sag_are_those_of_the_boundary_value_problem(weight, stretching):
    found = between_clamps(weight, stretching)

    def slopes(x, y, p):
        return np.vstack([y[1], y[2], y[3], p[0] * y[2] + weight, 0.5 * y[1] ** 2])

    def ends(a, b, p):
        return np.array([a[0], a[1], b[0], b[1], a[4], b[4] - p[0] / stretching])

    x = np.linspace(0.0, 1.0, 1001)
    guess = np.zeros((5, x.size))
    size = 0.5 * weight / max(found.tension, 40.0)
    guess[0], guess[1] = size * x * (1.0 - x), size * (1.0 - 2.0 * x)
    apart = solve_bvp(slopes, ends, x, guess, p=[1.3 * found.tension], tol=1e-8, max_nodes=100000)
    assert apart.status == 0
    assert found.tension == pytest.approx(apart.p[0], rel=1e-5)
    assert found.sag == pytest.approx(apart.sol(0.5)[0], rel=1e-6)
    bent = apart.sol(x)[2]
    bending = float(trapezoid(0.5 * bent**2, x))
    membrane = 0.5 * apart.p[0] ** 2 / stretching
    assert found.share["membrane"] == pytest.approx(membrane / (bending + membrane), rel=1e-3, abs=1e-6)


def test_where_it_does_not_hold_there_is_none():
    scene = loads(SCENE)
    assert taut(scene) is not None
    assert taut(scene.replace({"gravity.up": [1.0, 0.0, 0.0]})) is None  # across its width it bends in its plane
    assert taut(scene.replace({"gravity.up": [0.0, 0.0, 1.0]})) is None  # along itself its tension varies
    assert taut(scene.replace({"strip.natural_curvature": 4.0})) is None
    unloaded = taut(scene.replace({"gravity": None}))
    assert unloaded is not None
    assert (unloaded.tension, unloaded.sag) == (0.0, 0.0)


def test_the_rod_that_stretches():
    scene = loads(SCENE).replace({"model.energy": "antman", "model.elements": 40})
    expected, rod = taut(scene), solve(scene)
    assert expected is not None
    assert rod.ok
    assert rod.supports.end is not None
    assert rod.supports.end.force[2] == pytest.approx(expected.tension, rel=5e-3)
    assert rod.middle is not None
    assert -rod.middle.position[1] == pytest.approx(expected.sag, rel=5e-3)


@pytest.mark.shell
def test_the_shell_of_a_tape_between_two_holders(tmp_path, capsys, monkeypatch):
    pytest.importorskip("dolfinx")
    monkeypatch.setenv("RIBBONBENCH_STORE", str(tmp_path / "store"))
    file = tmp_path / "tape.toml"
    file.write_text(SCENE)
    assert main(["shell", str(file), "--quiet", "--out", str(tmp_path / "s")]) == DONE
    shell = json.loads((tmp_path / "s" / "result.json").read_text())
    expected = taut(loads(SCENE))
    assert expected is not None
    assert shell["forces"]["end"][2] == pytest.approx(expected.tension, rel=5e-3)
    assert -shell["middle"]["position"][1] == pytest.approx(expected.sag, rel=2e-3)
    capsys.readouterr()
    assert main(["compare", str(file), "--out", str(tmp_path / "c")]) == DONE
    beside = json.loads((tmp_path / "c" / "result.json").read_text())
    assert beside["forces"]["end"] is None
    assert beside["forces_why"]
    assert beside["rows"][0]["hausdorff"] == pytest.approx(expected.sag, rel=1e-2)
    assert main(["limits", str(file), "--out", str(tmp_path / "l")]) == DONE
    row = json.loads((tmp_path / "l" / "result.json").read_text())["rows"][0]
    assert row["estimate"]["distance"] == pytest.approx(row["hausdorff"], rel=1e-2)
    assert row["estimate"]["level"] == row["level"] == "poor"
    assert row["reason"] == "tension"
    said = capsys.readouterr()
    assert " nan" not in said.out + said.err
