"""Tape springs from a scene to the shell: what holds them, how they are driven, what is refused."""

import numpy as np
import pytest

from compare.models.scope import require_shell
from compare.models.shell_build import shell_options, shell_problem
from compare.scene.scene import loads
from ribbonbench.errors import BadInput

STRAIGHT = """
[[path]]
"clamp.start.tangent" = [0.0, 0.0, 1.0]
"clamp.start.normal" = [0.0, 1.0, 0.0]
"clamp.end.tangent" = [0.0, 0.0, 1.0]
"clamp.end.normal" = [0.0, 1.0, 0.0]
"""


def text(turn=0.25, end="", path=STRAIGHT, frame=True):
    c, s = np.cos(turn), np.sin(turn)
    held = f"tangent = [0.0, {s}, {c}]\nnormal = [0.0, {c}, {-s}]" if frame else ""
    return f"""
[strip]
length = 1000.0
width = 60.0
thickness = 0.15
poisson = 0.3
transverse_curvature = 0.02
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [0.0, {-s}, {c}]
normal = [0.0, {c}, {s}]
[clamp.end]
position = [0.0, 0.0, 1000.0]
{held}
{end}
[shell]
elements = [16, 4]
{path}
"""


SLIDING = "slide = [0.0, 0.0, 1.0]"


def test_a_scene_gives_the_tape_and_what_holds_it():
    scene = loads(text(end=SLIDING + '\nsection = "free"'))
    problem = shell_problem(scene, *require_shell(scene))
    assert problem.transverse_curvature == pytest.approx(20.0)
    assert problem.slide == (None, (0.0, 0.0, 1.0))
    assert problem.sections == ("undeformed", "free")
    assert problem.start_curvature is None
    assert not problem.turns
    first = problem.path[0]
    np.testing.assert_allclose(first.start.frame, np.eye(3), atol=1e-12)
    assert problem.path[-1].end.position == pytest.approx((0.0, 0.0, 1.0))
    assert shell_options(scene).arc_length == "always"
    flat = loads(text(end=SLIDING).replace("transverse_curvature = 0.02", ""))
    assert shell_options(flat).arc_length == "auto"


def test_an_end_without_a_frame_turns():
    scene = loads(text(0.0, SLIDING, "", frame=False))
    problem = shell_problem(scene, *require_shell(scene))
    assert problem.turns
    assert np.array(problem.end.frame)[:, 0] == pytest.approx([1.0, 0.0, 0.0])


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"end": SLIDING + '\nsection = "free"', "frame": False, "path": ""}, "clamp.end.section"),
        ({"end": SLIDING, "path": STRAIGHT + '"clamp.end.slide" = [0.0, 1.0, 0.0]\n'}, "path[0].clamp.end.slide"),
        ({"end": SLIDING, "path": STRAIGHT + '"strip.transverse_curvature" = 0.01\n'},
         "path[0].strip.transverse_curvature"),
    ],
)  # fmt: skip
def test_what_the_shell_cannot_hold_is_refused(changes, key):
    scene = loads(text(**changes))
    with pytest.raises(BadInput) as caught:
        shell_problem(scene, *require_shell(scene))
    assert caught.value.key == key


def test_points_that_cannot_come_within_the_length_are_refused():
    with pytest.raises(BadInput) as caught:
        loads(text(end=SLIDING).replace("[0.0, 0.0, 1000.0]", "[0.0, 1200.0, 1000.0]"))
    assert caught.value.key == "clamp.end.position"
    assert "1200" in caught.value.problem


@pytest.mark.shell
def test_a_moderately_bent_tape_through_the_model():
    """Both ends turned by 0.03: the moment is the section's own at that curvature, but for the ends and a coarse mesh;
    the end that slides carries no force along it."""
    pytest.importorskip("dolfinx")
    from compare.models.shell import ShellModel
    from tests.reference.tape_section import Section

    scene = loads(text(0.03, SLIDING))
    model = ShellModel()
    assert model.refusal(scene) is None
    found = model.solve(scene)
    assert found.ok
    assert found.stable
    section = Section(0.03, 1.5e-4, 20.0, 0.3)
    moment = found.supports.start.moment[0] * 0.06
    assert moment == pytest.approx(-section.moment(-0.06), rel=0.02)
    assert moment < 0.95 * 0.06 * section.stiffness()
    assert abs(found.supports.end.force[2]) < 1e-4
    observed = found.native.data["steps"][-1]["values"]["clamps"]["start"]["moment"][0]
    assert observed == pytest.approx(found.supports.start.moment[0], rel=1e-9)
