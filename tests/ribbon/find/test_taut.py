"""Ends held one length apart, or hardly less: what is determined is solved, and what is not is said."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from ribbon import Clamp, Gravity, Session, Strip, Wall, solve
from ribbon.find.continuation import follow
from ribbon.find.solve import build
from ribbon.result import Status

UP = Gravity((0, 1, 0))


def held(slack: float, gamma: float = 0.0, **more):
    strip = Strip(1.0, 0.05, gamma=gamma, thickness=more.pop("thickness", None))
    return solve(strip, Clamp(), UP if gamma else None, end=Clamp((0, 0, 1.0 - slack)), segments=20, **more)


def clamped_string(slack: float, weight: float) -> tuple[float, float]:
    """Tension T and sag of v'''' - T v'' = q, v = v' = 0 at both ends, half of int v'^2 = slack, by quadrature."""

    def slope(y: float, k: float) -> float:
        return 0.5 * weight / k**2 * (math.copysign(math.exp(k * (abs(y) - 0.5)), y) - 2.0 * y)  # of large k

    def left(logarithm: float) -> float:
        k = math.exp(0.5 * logarithm)
        edges = [0.5 - 20.0 / k, 0.5 - 5.0 / k]
        return quad(lambda y: slope(y, k) ** 2, 0.0, 0.5, points=edges, limit=200)[0] - slack

    guess = math.log(weight / math.sqrt(24.0 * slack))
    tension = math.exp(brentq(left, guess - 1.0, guess + 1.0))
    return tension, 0.5 * weight / tension * (0.25 - 1.0 / math.sqrt(tension))


@pytest.mark.parametrize("slack", [1e-8, 1e-9, 1e-10, 1e-11, 1e-12])
def test_the_least_slack_is_an_arch(slack):
    """A clamped column: energy 4 pi^2 d and thrust 4 pi^2, to the first order in d."""
    found = held(slack)
    assert found.ok
    assert found.energy.elastic == pytest.approx(4.0 * math.pi**2 * slack, rel=1e-3)
    assert found.end_support.force[2] == pytest.approx(-4.0 * math.pi**2, rel=1e-3)
    assert abs(found.middle.position[1]) == pytest.approx(2.0 / math.pi * math.sqrt(slack), rel=1e-3)


@pytest.mark.parametrize("energy", ["wunderlich", "finite"])
@pytest.mark.parametrize("slack", [1e-8, 1e-9, 1e-10, 1e-11])
def test_the_least_slack_hangs_as_a_string_does(slack, energy):
    found = held(slack, 1000.0, energy=energy, thickness=1e-3)
    tension, sag = clamped_string(slack, 1000.0)
    assert found.ok
    assert found.end_support.force[2] == pytest.approx(tension, rel=0.05)  # layers of 1e-3 l on segments of 0.05 l
    assert found.middle.position[1] == pytest.approx(-sag, rel=0.01)
    assert found.energy.gravity == pytest.approx(-1000.0 * 2.0 / 3.0 * sag, rel=0.03)
    np.testing.assert_allclose(found.end_support.force[1], 500.0, rtol=1e-6)


@pytest.mark.parametrize("slack", [1e-8, 1e-9])
def test_with_its_layers_resolved_it_is_the_string(slack):
    tension, sag = clamped_string(slack, 1000.0)
    side = 0.2 / math.sqrt(tension) * 1.7 ** np.arange(40)
    side = side[np.cumsum(side) < 0.4]
    lengths = np.concatenate([side, np.full(8, (1.0 - 2.0 * side.sum()) / 8), side[::-1]])
    strip = Strip(1.0, 0.05, gamma=1000.0)
    found = solve(strip, Clamp(), UP, end=Clamp((0, 0, 1.0 - slack)), segments=lengths / lengths.sum())
    assert found.ok
    assert found.end_support.force[2] == pytest.approx(tension, rel=3e-3)
    assert found.middle.position[1] == pytest.approx(-sag, rel=3e-3)


@pytest.mark.parametrize("gamma", [0.0, 1000.0])
@pytest.mark.parametrize(
    "slack",
    [3e-14, *(pytest.param(slack, marks=pytest.mark.validate) for slack in (1e-13, 1e-14, 4e-15))],
)
def test_a_slack_that_rounding_eats_is_no_equilibrium_of_energy_zero(slack, gamma):
    found = held(slack, gamma)
    assert not (found.ok and found.energy.total == 0.0)
    if found.ok:
        exact = 4.0 * math.pi**2 * slack if not gamma else -1000.0 * 2.0 / 3.0 * clamped_string(slack, 1000.0)[1]
        assert found.energy.total == pytest.approx(exact, rel=0.02)


@pytest.mark.parametrize(
    ("length", "start", "end"),
    [
        (1.0, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
        (0.3, (0.0, 0.0, 0.0), (0.0, 0.0, 0.1 + 0.2)),
        (1.0, (0.0, 0.0, 0.0), (0.0, 0.6000000000000001, 0.8)),
        (0.7, (0.0, 0.0, 1234.5), (0.0, 0.0, 1234.5 + 0.7)),
    ],
)
@pytest.mark.parametrize("gamma", [0.0, 1000.0])
def test_at_its_length_the_tension_is_undetermined_and_nothing_is_a_number_that_is_none(
    length, start, end, gamma, tmp_path
):
    free = {"tangent": None, "normal": None}
    strip = Strip(length, 0.05 * length, gamma=gamma)
    found = solve(strip, Clamp(start, **free), UP if gamma else None, end=Clamp(end, **free), segments=8)
    assert found.ok
    assert found.forces_why
    assert (found.start, found.end_support, found.walls) == (None, None, ())
    told = json.loads(found.save(tmp_path / "taut.json").read_text())
    assert told["forces"] == {"start": None, "end": None, "walls": []}
    assert told["forces_why"] == found.forces_why
    assert "nan" not in found._repr_html_()


def test_what_is_determined_has_no_reason_to_be_unknown():
    found = held(0.1, 10.0)
    assert found.forces_why == ""
    assert np.all(np.isfinite(found.start.force))


def test_held_to_its_length_beside_a_wall():
    found = held(0.0, 10.0, walls=(Wall((0.0, -0.1, 0.0), (0.0, 1.0, 0.0)),))
    assert found.ok
    assert found.penetration == 0.0
    assert found.walls == ()


def test_a_way_to_the_full_length_and_back_hangs_again():
    strip = Strip(1.0, 0.05, gamma=10.0)

    def at(slack: float):
        return build(strip, Clamp(), UP, end=Clamp((0, 0, 1.0 - slack)), segments=10)

    hanging = solve(strip, Clamp(), UP, end=Clamp((0, 0, 0.9)), segments=10)
    taut = follow(lambda t: at(0.1 * (1.0 - t)), hanging)
    assert taut.ok
    assert taut.end_support is None
    back = follow(lambda t: at(0.1 * t), taut)
    assert back.ok
    assert back.energy.total == pytest.approx(hanging.energy.total, abs=1e-8)
    assert back.middle.position[1] < -0.1


def test_a_session_at_the_full_length_has_no_forces():
    taut = Session(Strip(1.0, 0.05, gamma=10.0), Clamp(), UP, end=Clamp((0, 0, 1.0)), segments=8)
    assert taut.forces == {"start": None, "end": None}


def test_frames_that_a_straight_strip_cannot_have():
    turned = Clamp((0, 0, 1.0), tangent=(0, 0, 1), normal=(1, 0, 0))
    assert solve(Strip(1.0, 0.05), Clamp(), end=turned, segments=8).status is Status.INFEASIBLE
