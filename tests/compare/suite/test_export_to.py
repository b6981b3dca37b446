"""A scene as a model of another program: what its file says is the scene; round trips where the program is there."""

from __future__ import annotations

import ast
import json
import re
import subprocess
import xml.etree.ElementTree as xml

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from compare import cli
from compare.models import solve
from compare.scene.scene import load
from compare.suite.answers import Absent
from compare.suite.peers import call

#: A curl in SI that hangs: every kind of number that a model has.
SCENE = "jfig_5_2"
CHANGED = {"model.energy": "kirchhoff"}


@pytest.fixture(scope="module")
def state():
    return solve(load(SCENE).replace(CHANGED))


@pytest.fixture
def written(tmp_path):
    def write(program, *more):
        words = ["export", SCENE, "--set", "model.energy=kirchhoff", "--to", program, "--out", str(tmp_path), "--quiet"]
        assert cli.main([*words, *more]) == cli.DONE
        result = json.loads((tmp_path / "result.json").read_text())
        return tmp_path / result["file"]

    return write


def bending():
    """D w (N m^2) of the scene: 1.8e9 h^3 w / (12 (1 - nu^2)), by hand."""
    return 1.8e9 * 1e-4**3 * 0.015 / (12 * 0.75)


def numbers(words):
    return np.array(words.split(), dtype=float)


def test_mujoco_has_moduli_mass_and_both_shapes(written, state):
    model = xml.fromstring(written("mujoco").read_text())
    config = {c.get("key"): c.get("value") for c in model.iter("config")}
    bodies = list(model.iter("body"))
    assert len(bodies) == 41
    _, a, b = numbers(bodies[1].find("geom").get("size"))
    assert float(config["bend"]) * 4 * a * b**3 / 3 == pytest.approx(bending())
    assert (a / b) ** 2 == pytest.approx(150.0**2)  # in its plane (w / h)^2 times as stiffly
    masses = sum(float(body.find("geom").get("mass")) for body in bodies[1:])
    pull = masses * numbers(model.find("option").get("gravity"))
    np.testing.assert_allclose(pull, [-150.0 * 1e-4 * 0.015 * 0.5 * 9.81, 0.0, 0.0], atol=1e-12)
    # The start shape by hand: bodies' rotations at rest, then the joints'.
    joints = numbers(model.find("keyframe").find("key").get("qpos")).reshape(-1, 4)
    turn = Rotation.from_quat(numbers(bodies[0].get("quat")), scalar_first=True)
    place = numbers(bodies[0].get("pos"))
    for body, joint in zip(bodies[1:], joints, strict=True):
        place = place + turn.apply(numbers(body.get("pos")))
        turn = turn * Rotation.from_quat(numbers(body.get("quat")), scalar_first=True)
        turn = turn * Rotation.from_quat(joint, scalar_first=True)
    end = place + turn.apply([0.5 / 40, 0.0, 0.0])
    np.testing.assert_allclose(end, 0.5 * state.end.position, atol=2e-3)


def test_python_models_have_every_number_in_si(written):
    for program in ("pyelastica", "exudyn", "newton"):
        tree = ast.parse(written(program).read_text())
        (told,) = [ast.literal_eval(node.value) for node in tree.body if isinstance(node, ast.Assign)]
        assert told["bending_about_width"] == pytest.approx(bending())
        assert told["rest_curvatures"] == pytest.approx([30.0, 0.0, 0.0])
        np.testing.assert_allclose(told["weight_per_length"], [-150.0 * 1e-4 * 0.015 * 9.81, 0.0, 0.0], atol=1e-12)
        rest = np.array(told["rest_nodes"])
        assert np.linalg.norm(rest[-1] - rest[0]) == pytest.approx(2 * abs(np.sin(7.5)) / 30.0)
        assert len(told["start_nodes"]) == 41


def test_newtons_frames_are_the_states_and_the_clamps(written, state):
    tree = ast.parse(written("newton").read_text())
    (told,) = [ast.literal_eval(node.value) for node in tree.body if isinstance(node, ast.Assign)]
    at = (np.arange(40) + 0.5) / 40
    for when in ("start", "rest"):
        turns = Rotation.from_quat(told[f"{when}_quaternions"])  # (x, y, z, w)
        nodes = np.array(told[f"{when}_nodes"])
        along = np.diff(nodes, axis=0)
        tangents = along / np.linalg.norm(along, axis=1)[:, None]
        assert np.sum(turns.apply([0.0, 0.0, 1.0]) * tangents, axis=1).min() > 0.999  # as add_rod asks
    np.testing.assert_allclose(turns[0].as_matrix(), np.array(told["rest_frames"])[0], atol=1e-12)
    np.testing.assert_allclose(
        Rotation.from_quat(told["start_quaternions"]).as_matrix(), state.shape.frames(at), atol=1e-12
    )


def test_usd_has_both_curves(written, state):
    text = written("usd").read_text()
    assert text.startswith("#usda 1.0\n")
    assert text.count("{") == text.count("}")
    curves = [np.array(ast.literal_eval(f"[{c}]")) for c in re.findall(r"points = \[(.*)\]", text)]
    assert [len(curve) for curve in curves] == [41, 41]
    np.testing.assert_allclose(curves[1][-1], 0.5 * state.end.position, atol=1e-8)


@pytest.mark.parametrize("source", ["elastica_of_two", "moebius_6_1", "two_clamps_5_3_2"])
def test_what_is_not_clamped_at_one_end_is_refused(source, tmp_path, capsys):
    assert cli.main(["export", source, "--to", "usd", "--out", str(tmp_path / "o")]) == cli.BAD_INPUT
    assert not (tmp_path / "o" / "strip.usda").exists()


@pytest.mark.peers
@pytest.mark.parametrize(
    ("library", "program", "script"),
    [
        ("mujoco", "mujoco", "import mujoco, sys; m = mujoco.MjModel.from_xml_path(sys.argv[1]); print(m.nkey, m.nq)"),
        ("pyelastica", "pyelastica", "import runpy, sys; r = runpy.run_path(sys.argv[1])['rod'](); print(1, 160)"),
        ("newton", "newton", "import newton, runpy, sys; r = runpy.run_path(sys.argv[1])['rod'](); "
         "print(1, 4 * len(newton.ModelBuilder().add_rod(rod=r)[0]))"),
        ("exudyn", "exudyn", "import runpy, sys; s = runpy.run_path(sys.argv[1])['section'](); print(1, 160)"),
    ],
)  # fmt: skip
def test_the_program_takes_its_model(library, program, script, written):
    try:
        python, version = call.interpreter(library)
    except Absent as why:
        pytest.skip(str(why))
    if library == "mujoco" and version.startswith("4"):
        pytest.skip("mujoco 4 has no cable")
    done = subprocess.run([python, "-c", script, str(written(program))], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split()[-2:] == ["1", "160"]
