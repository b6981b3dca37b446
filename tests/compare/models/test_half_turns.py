"""Bands of several half turns: found, counted by linking numbers, or refused with the reason."""

from __future__ import annotations

import numpy as np
import pytest

from compare import registry
from compare.models.base import Options, Status
from compare.models.half_turns import counted, nearest
from compare.models.scope import require_shell
from compare.models.shell_build import shell_problem
from compare.page.remedies import message
from compare.scene.scene import loads
from ribbonbench.errors import BadInput
from ribbonbench.linking import half_turns

BAND = """
[strip]
length = 1.0
width = 0.05
poisson = 0.3
[closure]
kind = "{kind}"
{turns}
[model]
energy = "wunderlich"
elements = {elements}
"""
ONE, THREE = 59.17, 132.94  # D w / l, w / l = 0.05


def band(turns: str = "", kind: str = "moebius", elements: int = 120):
    return loads(BAND.format(kind=kind, turns=turns, elements=elements), "band")


def solved(scene):
    return registry.model("ribbon").solve(scene, options=Options(repeats=0, error=False))


def test_a_ribbon_of_three_half_turns_is_found_and_is_stable():
    state = solved(band("half_turns = 3"))
    assert state.ok
    assert state.stable
    assert state.energy.elastic == pytest.approx(THREE, abs=0.02)


@pytest.mark.parametrize(("kind", "turns", "energy", "modes"), [("circle", 4, 286.86, 2), ("moebius", 5, 581.8, 2)])
def test_more_half_turns_are_saddles_that_say_so(kind, turns, energy, modes):
    """Of as many half turns as asked for, unstable, with their ways down counted, also on finer segments."""
    scene = band(f"half_turns = {turns}", kind, elements=60)
    state = registry.model("ribbon").solve(scene, options=Options(repeats=0, error=True))
    assert (state.status, state.stable, state.word) == (Status.UNSTABLE, False, "saddle")
    assert state.native.unstable_modes == modes
    assert state.energy.elastic == pytest.approx(energy, abs=0.1)
    assert [one.status for one in state.refinements] == ["saddle"] * 3
    assert 0.0 < state.error < 1e-3
    assert "fewer half turns" in message(state)
    lines = state.shape.points(np.linspace(0.0, 1.0, 200, endpoint=False), np.array([0.25, 0.0, -0.25]) * scene.width)
    assert abs(half_turns(lines, turns % 2 == 1)) == pytest.approx(turns, abs=1e-6)


def test_two_half_turns_cross_themselves():
    """The figure of eight, the only band of two folds, has none."""
    state = solved(band("half_turns = 2", "circle", elements=60))
    assert state.status is Status.FAILED
    assert state.stable is None
    assert "crosses itself" in state.message
    assert state.energy.elastic == pytest.approx(56.22, abs=0.05)


def test_where_no_band_of_so_many_folds_can_be_the_reason_is_told():
    state = solved(band("half_turns = 9", elements=90))
    assert state.status is Status.INFEASIBLE
    assert "0.9 times as wide as long" in state.message
    assert message(state) == state.message


def test_a_band_with_other_half_turns_than_asked_for_is_no_answer():
    one, three = band("half_turns = 1", elements=60), band("half_turns = 3", elements=60)
    state = solved(one)
    assert state.ok
    assert state.energy.elastic == pytest.approx(ONE, abs=0.5)
    wrong = counted(three, state)
    assert wrong.status is Status.FAILED
    assert "1 half turns" in wrong.message
    assert "closure.half_turns = 3" in wrong.message
    assert counted(one, state) is state
    assert counted(band(), state) is state  # nothing was asked


def test_a_seed_that_leads_to_one_half_turn_is_no_band_of_three():
    """Waves steep enough lose two half turns on the way."""
    wave = np.sin(3.0 * np.pi * np.linspace(0.0, 1.0, 61))
    seeded = {"seed.curvature": (18.0 * wave).tolist(), "seed.ruling": wave.tolist()}
    found = solved(band("half_turns = 3").replace(seeded))
    assert found.ok == (abs(found.energy.elastic - THREE) < 0.5)
    assert found.ok or "1 half turns" in found.message


def test_the_nearest_places_of_a_closed_line():
    """Two circles' worth of a figure of eight, lifted where it crosses."""
    t = np.linspace(0.0, 2.0 * np.pi, 400, endpoint=False) + 0.001
    eight = np.stack([np.sin(t), np.sin(t) * np.cos(t), 0.01 * np.cos(t)], axis=1)
    assert nearest(eight) == pytest.approx(0.02, rel=1e-2)
    assert nearest(eight * [1.0, 1.0, 0.0]) < 1e-12


@pytest.mark.parametrize(
    ("kind", "turns", "why"),
    [
        ("moebius", "half_turns = 2", "odd"),
        ("circle", "half_turns = 3", "even"),
        ("circle", "half_turns = 2\nturns = 2", "several turns"),
        ("moebius", "half_turns = 0", "1"),
    ],
)
def test_half_turns_that_cannot_be_are_refused(kind, turns, why):
    with pytest.raises(BadInput, match=why) as caught:
        solved(band(turns, kind))
    assert caught.value.key == "closure.half_turns"


@pytest.mark.parametrize(("kind", "turns", "expected"), [("moebius", 3, 3), ("circle", 2, 2), ("moebius", None, 1)])
def test_a_shell_is_asked_for_them(kind, turns, expected):
    scene = band("" if turns is None else f"half_turns = {turns}", kind).replace({"shell.width_to_thickness": 25.0})
    (ratio,) = require_shell(scene)
    assert shell_problem(scene, ratio).half_turns == expected
