"""Branches of the shell in its own process: the clamped strut's loads, what it is refused, its picture with others."""

import numpy as np
import pytest

from compare.continuation.correct import first_point
from compare.continuation.follow import follow
from compare.continuation.point import Options
from compare.models.shell import ShellModel
from compare.scene.scene import loads
from compare.studies.branches.along import Along
from compare.studies.branches.run import Asked, diagram
from ribbonbench.errors import BadInput
from tests.validation.shell.branches_shell import STRUT, begun, closed_forms, located

pytest.importorskip("dolfinx")
pytestmark = pytest.mark.shell

SHORT = 1e-6 / 12.0  # shortening of a strut of h = 1e-3 under the unit of load
KEY = "clamp.end.position[0]"


@pytest.fixture(scope="module")
def strut():
    scene = loads(STRUT).replace({"shell.elements": [12, 1]})
    return Along.of(scene, KEY, 1.0 - 24.0 * SHORT, 1.0 - 120.0 * SHORT)


def test_the_clamped_strut_buckles_where_the_closed_form_says(strut):
    start = ShellModel().branch_start(strut.scene_at)
    run = follow(first_point(start.system, start.z, 0.0, Options().tolerance))
    found = [(1.0 - strut.value(special.point.t)) / SHORT for special in run.specials]
    assert [special.kind for special in run.specials] == ["branch_point"] * 2
    assert found == pytest.approx(closed_forms(), rel=2e-3)
    assert [point.unstable for point in (run.points[0], run.points[-1])] == [0, 2]


MAST = """
title = "Mast"
[strip]
length = 1.0
width = 0.02
thickness = 1e-3
poisson = 0.0
gamma = 5.0
[gravity]
up = [1.0, 0.0, 0.0]
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
[shell]
elements = [8, 1]
grading = [1.0, 1.0]
[model]
energy = "elastica"
elements = 6
"""
GREENHILL = 7.8373474


@pytest.fixture(scope="module")
def masts():
    return diagram(loads(MAST), "strip.gamma", 5.0, 10.0, ("elastica", "shell"), Asked(branches=3, errors=False))


def test_several_models_stand_in_one_diagram(masts):
    assert list(masts.starts) == ["elastica", "shell"]
    ends = {}
    for model in masts.starts:
        own, up, down = (branch for branch in masts.branches if branch.model == model)
        (fork,) = own.special
        assert fork.kind == "branch_point"
        assert fork.parameter == pytest.approx(GREENHILL, rel=5e-4)
        assert [p.unstable for p in own.points if p.kind == "regular" and p.parameter > GREENHILL + 0.1] != []
        assert {p.unstable for p in own.points if p.parameter > GREENHILL + 0.1} == {1}
        assert {p.unstable for p in up.points} == {0}
        assert up.points[-1].end[2] == pytest.approx(-down.points[-1].end[2], abs=1e-6)
        ends[model] = np.abs(up.points[-1].end)
        assert up.points[-1].energy == pytest.approx(down.points[-1].energy, rel=1e-8)
    assert ends["shell"] == pytest.approx(ends["elastica"], abs=2e-3)


@pytest.mark.validate
def test_a_branch_point_has_the_error_of_finer_meshes():
    scene = loads(MAST).replace({"shell.elements": [6, 1]})
    along = Along.of(scene, "strip.gamma", 7.0, 9.0)
    _, first = begun(scene, "shell", along)
    (fork,) = follow(first, options=Options(most=0.5)).specials
    found = located(fork, along, finer=2)
    assert found.limit.settles
    assert abs(found.limit.value - GREENHILL) <= max(found.limit.error, 2e-5)  # 2e-5: h^2 of the shell itself
    coarse, finer, finest = (abs(value - GREENHILL) for value in found.values)
    assert finest < finer < coarse


def test_a_hinge_is_refused(strut):
    held = strut.scene_at(0.0).replace({"clamp.end": {"position": [0.9, 0.0, 0.0]}})
    with pytest.raises(BadInput) as refused:
        diagram(held, "strip.width", 0.02, 0.03, ("shell",), Asked(branches=1))
    assert refused.value.key == "--model"


def test_moving_elements_are_refused(strut):
    with pytest.raises(BadInput) as refused:
        ShellModel().branch_start(strut.scene_at, moving=True)
    assert refused.value.key == "--moving"
