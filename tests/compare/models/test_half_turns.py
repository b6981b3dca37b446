"""Bands of several half turns: found, counted by linking numbers, or refused with the reason."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from compare import registry
from compare.models.base import Options, Status
from compare.models.half_turns import counted, seed
from compare.models.scope import require_shell
from compare.models.shell_build import shell_problem
from compare.scene.scene import loads
from ribbonbench.errors import BadInput

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
    """Steeper rulings than those of `seed` lose two half turns on the way."""
    wave = np.sin(3.0 * np.pi * np.linspace(0.0, 1.0, 61))
    seeded = {"seed.curvature": (18.0 * wave).tolist(), "seed.ruling": wave.tolist()}
    found = solved(band("half_turns = 3").replace(seeded))
    assert found.ok == (abs(found.energy.elastic - THREE) < 0.5)
    assert found.ok or "1 half turns" in found.message


@pytest.mark.parametrize(
    ("kind", "turns", "why"),
    [
        ("moebius", "half_turns = 2", "odd"),
        ("circle", "half_turns = 3", "even"),
        ("circle", "half_turns = 2\nturns = 2", "several turns"),
        ("moebius", "half_turns = 0", "1"),
        ("circle", "half_turns = 2", "doubly wound circle"),
        ("moebius", "half_turns = 5", "doubly wound circle"),
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


def test_wide_bands_begin_with_rulings_that_do_not_cross():
    _, ruling = seed(band("half_turns = 3").replace({"strip.width": 0.4}), False)
    steepest = max(abs(b - a) for a, b in pairwise(ruling)) * (len(ruling) - 1)
    assert 0.5 < steepest * 0.2 < 1.0
