"""Scenes whose clamps hold a part: what the shell is asked to hold, the motions that are left, the forces beside."""

from __future__ import annotations

import numpy as np
import pytest

from compare import registry
from compare.models.base import Options
from compare.models.holds import shell as shell_holds
from compare.models.holds.words import at_ends, briefly
from compare.models.shell_build import shell_problem
from compare.scene.scene import load, loads
from compare.store.progress import Reporter
from compare.store.store import CaseStore
from compare.studies.compare import compare
from ribbonbench.errors import BadInput

STRIP = """
[strip]
length = 2.0
width = 0.1
thickness = 1e-3
poisson = 0.3
natural_curvature = 1.0
gamma = {gamma}
{gravity}
{held}
[model]
elements = 12
[shell]
elements = [12, 2]
"""
GRAVITY = "[gravity]\nup = [0.0, 0.0, 1.0]\n"
START, END = "[clamp.start]\n", "[clamp.end]\n"
HERE, THERE = "position = [0.0, 0.0, 0.0]\n", "position = [1.6, 0.2, 0.0]\n"
FRAME = "tangent = [1.0, 0.0, 0.0]\nnormal = [0.0, 0.0, 1.0]\n"
FREE = 'position = "free"\n'
STRAIGHT = 'ruling = "straight"\n'
RING = '[closure]\nkind = "circle"\n'
#: What is held, whether it weighs, and what the shell holds of its ends, and how the sections are.
HELD = {
    "hinge": (START + HERE, True, ("position", "all"), ("free", "undeformed")),
    "straight hinge": (START + HERE + STRAIGHT, True, ("position", "all"), ("undeformed", "undeformed")),
    "frame": (START + FREE + FRAME, False, ("frame", "all"), ("undeformed", "undeformed")),
    "edge": (START + FREE + STRAIGHT, False, ("section", "all"), ("undeformed", "undeformed")),
    "free start": (END + THERE + FRAME, True, ("nothing", "all"), ("undeformed", "undeformed")),
    "hung from its end": (END + THERE, True, ("nothing", "position"), ("undeformed", "free")),
    "two hinges": (START + HERE + END + THERE, True, ("position", "position"), ("free", "free")),
    "two hinges, light": (START + HERE + END + THERE, False, ("position", "position"), ("free", "free")),
    "hinge and clamp": (START + HERE + END + THERE + FRAME, True, ("position", "all"), ("free", "undeformed")),
    "hinge and guide": (START + HERE + END + FREE + FRAME, True, ("position", "frame"), ("free", "undeformed")),
    "guide and clamp": (START + FREE + FRAME + END + THERE + FRAME, True, ("frame", "all"), ("undeformed",) * 2),
    "clamp": (START + HERE + FRAME, True, ("all", "all"), ("undeformed", "undeformed")),
    "ring on a nail": (START + HERE + RING, True, ("position", "all"), ("free", "undeformed")),
}  # fmt: skip


def scene(name):
    held, heavy, *_ = HELD[name]
    return loads(STRIP.format(gamma=20.0 if heavy else 0.0, gravity=GRAVITY if heavy else "", held=held), "held")


@pytest.mark.parametrize("name", HELD)
def test_a_scene_says_what_the_shell_holds(name):
    """Poses where they are held; the motions are those of the ribbon, whose rows say them on their own."""
    from compare.models.effects.ribbon_off import explained_problem

    one = scene(name)
    problem = shell_problem(one, 100.0)
    assert (problem.holds, problem.sections) == HELD[name][2:]
    for pose, place, frame in (
        (problem.start, one.start_position, one.start_frame),
        (problem.end, one.end_position, one.end_frame),
    ):
        if place is not None:
            np.testing.assert_allclose(pose.position, place)
        if frame is not None:
            np.testing.assert_allclose(pose.frame, frame)
    translations, axes = explained_problem(one).free_motions()
    found = shell_holds.motions_of(one)
    own = (np.zeros((0, 3)),) * 2 if found is None else (found.translations, found.axes)
    for mine, others in zip(own, (translations, axes), strict=True):
        np.testing.assert_allclose(mine.T @ mine, others.T @ others, atol=1e-12)


@pytest.mark.shell
def test_the_forces_of_the_parts_stand_beside_the_ribbons(tmp_path):
    """A hinge and a clamp, from the ribbon's surface: both carry the weight, the hinge no moment, in the row."""
    pytest.importorskip("dolfinx")
    result = compare(scene("hinge and clamp"), CaseStore(tmp_path / "cases"), Reporter(quiet=True), bare=True)
    (row,) = result.rows
    assert row.stable
    assert row.same_state
    total = row.shell_forces["start"] + row.shell_forces["end"]
    np.testing.assert_allclose(total, [0.0, 0.0, 20.0], atol=1e-6)
    assert np.abs(row.shell_moments["start"]).max() < 1e-6
    fast = result.fast.supports
    assert np.linalg.norm(row.shell_forces["start"] - fast.start.force) < 0.1 * np.linalg.norm(fast.start.force)
    assert np.linalg.norm(row.shell_moments["end"] - fast.end.moment) < 0.3 * np.linalg.norm(fast.end.moment)


@pytest.mark.parametrize("name", ["tape_4_1", "tape_4_1_equal", "tape_4_2"])
def test_the_ends_of_a_tape_spring_turn_as_a_whole(name):
    """A point that slides, with its frame free in one of them; the section keeps its shape whatever the ruling."""
    problem = shell_problem(load(name), 100.0)
    assert problem.holds == ("all", "all")
    assert problem.sections == ("undeformed", "undeformed")
    assert problem.turns == (name == "tape_4_2")


@pytest.mark.shell
def test_a_force_at_an_end_that_slides_is_the_ribbons_reaction_where_it_comes_to():
    """A strip whose end slides along z under a force that is no multiple of that comes to rest somewhere. A ribbon that
    is clamped there exerts that force along the slide; what is across is the clamp's in both."""
    pytest.importorskip("dolfinx")
    there = "position = [1.7, 0.0, 0.0]\n"
    slides = START + HERE + FRAME + END + there + FRAME + "slide = [0.0, 0.0, 1.0]\n[tip]\nforce = [3.0, 0.0, 8.0]\n"
    text = STRIP.format(gamma=0.0, gravity="", held=slides).replace("poisson = 0.3", "poisson = 0.0")
    one = loads(text.replace("natural_curvature = 1.0", "natural_curvature = 0.3"), "slides")
    shell = registry.model("shell").solve(one, options=Options(error=False))
    assert shell.ok
    place = shell.shape.pose(1.0).position
    np.testing.assert_allclose(place[:2], one.end_position[:2], atol=1e-9)
    assert abs(place[2] - one.end_position[2]) > 0.02
    held = one.replace({"clamp.end.slide": None, "tip": False, "clamp.end.position": (2.0 * place).tolist()})
    ribbon = registry.model("ribbon").solve(held, near=shell.shape, options=Options(error=False))
    assert ribbon.ok
    own, other = shell.supports.end.force, ribbon.supports.end.force
    assert abs(own[2]) < 1e-5
    assert other[2] == pytest.approx(8.0, rel=1e-3)
    assert own[0] + 3.0 == pytest.approx(other[0], rel=1e-3)
    np.testing.assert_allclose(shell.supports.start.force, -own - [3.0, 0.0, 8.0], atol=1e-4)


@pytest.mark.parametrize("force", ["[0.0, -1.0, 0.0]", "[1.0, 0.0, 0.0]"])
def test_a_force_across_the_slide_is_refused(force):
    held = START + HERE + FRAME + END + THERE + FRAME + f"slide = [0.0, 0.0, 1.0]\n[tip]\nforce = {force}\n"
    with pytest.raises(BadInput) as caught:
        loads(STRIP.format(gamma=0.0, gravity="", held=held), "across")
    assert caught.value.key == "tip"


def test_a_path_is_refused_by_its_key():
    one = scene("hinge and clamp").replace({"path": [{"clamp.end.position": [1.7, 0.2, 0.0]}]})
    with pytest.raises(BadInput) as caught:
        shell_problem(one, 100.0)
    assert caught.value.key == "path"
    assert registry.model("shell").refusal(one) is None  # from the ribbon's surface it has no path to follow


@pytest.mark.parametrize("name", HELD)
def test_words_say_what_is_held(name):
    """As the shell is asked: a point is no edge, and where no clamp is none is said to hold."""
    there = scene(name)
    (start, end), said, short = shell_holds.holds(there), at_ends(there, "the whole edge"), briefly(there)
    assert ("the middle of the edge" in said) == ("position" in (start, end))
    whole = any(clamp is not None and clamp.tangent is not None for clamp in (there.clamp_start, there.clamp_end))
    assert ("the whole edge" in said) == whole
    assert (short == "whole edge") == whole
    assert (said == "") == (there.clamp_start is None and there.clamp_end is None)
