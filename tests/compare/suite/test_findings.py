"""The findings on MuJoCo, CalculiX and PyElastica, made again where those are; the others are blocks of
docs/findings.md, which run there."""

from __future__ import annotations

import json
import re
import subprocess

import numpy as np
import pytest

from compare.suite.answers import Absent
from compare.suite.case import load
from compare.suite.peers import calculix, call
from compare.suite.peers.models import mujoco_text
from compare.suite.section import Bar
from tests.test_setup import ROOT

PAGE = (ROOT / "docs" / "findings.md").read_text(encoding="utf-8")
#: Newton's tangent of the plugin at rest: three joints of 2.5 rad each, stiffnesses 1, columns of the middle one.
TANGENT = """
import json, sys
import mujoco, numpy as np
model = mujoco.MjModel.from_xml_string(sys.argv[1])
data = mujoco.MjData(model)
columns = []
for i in (6, 8):
    mujoco.mj_resetData(model, data)
    away = np.zeros(model.nv)
    away[i] = 1e-5
    mujoco.mj_integratePos(model, data.qpos, away, 1.0)
    mujoco.mj_forward(model, data)
    columns.append((data.qfrc_smooth[[6, 8]] / 4e-5).tolist())
print(json.dumps(columns))
"""

pytestmark = pytest.mark.peers


@pytest.fixture(scope="module")
def python():
    """A python with a MuJoCo that has cables."""
    try:
        found, version = call.interpreter("mujoco")
    except Absent as why:
        pytest.skip(str(why))
    if int(version.split(".")[0]) >= 4:
        pytest.skip(f"mujoco {version} has no plugin mujoco.elasticity.cable")
    return found


def block(opening):
    """The one block of the page that begins with these words."""
    (found,) = re.findall(rf"```text\n({re.escape(opening)}.*?)```", PAGE, re.DOTALL)
    return found


def said(python, script, *words):
    done = subprocess.run([python, "-c", script, *words], capture_output=True, text=True, check=True)
    return done.stdout.strip()


def test_a_body_at_its_parents_place_makes_every_force_nan(python):
    assert said(python, block("import mujoco\n")) == "[nan nan nan]"


def test_a_cable_curved_at_rest_turns_its_moments(python):
    zero, frame = (0.0, 0.0, 0.0), ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    straight, curved = (
        json.loads(
            said(python, TANGENT, mujoco_text(Bar((1.0, 1.0, 1.0), None, rest, zero, frame, zero, zero, zero), 4))
        )
        for rest in (zero, (10.0, 0.0, 0.0))
    )
    assert [abs(v) for row in straight for v in row] == pytest.approx([1.0, 0.0, 0.0, 1.0], abs=1e-3)
    assert abs(curved[0][1]) > 0.5
    assert abs(curved[0][1] + curved[1][0]) < 0.2


def test_the_thinner_a_shell_the_fewer_digits_its_forces_have(capsys):
    try:
        calculix.version()
    except Absent as why:
        pytest.skip(str(why))
    exec(block("from dataclasses import replace\n"), {})  # the page's own words
    thick, loose, *stopped = capsys.readouterr().out.splitlines()
    (ask,) = load("cantilever_10").asks
    for line in (thick, loose):
        assert float(line.split(": ")[1]) == pytest.approx(ask.reference, rel=3e-4)
    assert len(stopped) == 4
    for line in stopped:
        assert "its increments ended at" in line


def test_a_clamp_at_an_elements_middle_is_of_first_order_and_old_damping_creeps():
    try:
        python, _ = call.interpreter("pyelastica")
    except Absent as why:
        pytest.skip(str(why))
    coarse, fine, steps = said(python, block("import elastica as ea\n")).splitlines()
    ends = np.array([re.findall(r"-?0\.\d+", line) for line in (coarse, fine)], dtype=float).reshape(2, 2, 2)
    (ask,) = load("cantilever_10").asks
    exact = np.array([-0.70007, 0.65625])  # of the same length, from which the suite's ratio follows
    assert -exact[0] / exact[1] == pytest.approx(ask.reference, abs=1e-4)
    ahead, behind = np.linalg.norm(ends - exact, axis=2).T
    assert ahead[0] / ahead[1] == pytest.approx(2.0, abs=0.1)
    assert behind[0] < 0.05 * ahead[0]
    assert behind[1] < 0.02 * ahead[1]
    uniform, older = map(int, steps.split())
    assert older > 3 * uniform
