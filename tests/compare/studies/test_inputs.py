"""u_input: derivatives by scene keys against scenes solved again, and what is said of how sure inputs are."""

from __future__ import annotations

import json

import numpy as np
import pytest

from compare import cli, registry
from compare.models.base import check_keys
from compare.models.ribbon.inputs import derivatives
from compare.scene.scene import loads
from compare.studies.inputs import InputUncertainty, input_uncertainty
from ribbonbench.errors import BadInput

STRIP = """
[strip]
length = 0.3
width = 0.02
thickness = 2e-4
poisson = 0.3
young = 2e9
density = 1200.0
natural_curvature = 2.0
[gravity]
up = [1.0, 0.0, 0.0]
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [0.0, 0.0, 1.0]
normal = [-0.7071067811865476, 0.7071067811865476, 0.0]
ruling = "straight"
[model]
energy = "wunderlich"
elements = 6
[uncertainty]
young = 5e7
thickness = 2e-6
natural_curvature = 0.05
poisson = 0.02
"""
S = np.linspace(0.0, 1.0, 11)


@pytest.fixture(scope="module")
def strip():
    return loads(STRIP, "strip")


def solved(scene):
    state = registry.model("ribbon").solve(scene)
    assert state.ok
    return state


@pytest.fixture(scope="module")
def state(strip):
    return solved(strip)


@pytest.mark.parametrize(
    "key",
    ["strip.young", "strip.density", "strip.thickness", "strip.poisson", "strip.width", "strip.natural_curvature"],
)
def test_chain_rule_from_si_keys(strip, state, key):
    exact = derivatives(strip, state, [key], lambda g: g.position(S))[key]
    value = getattr(strip.strip, key.removeprefix("strip."))
    value = value[0] if isinstance(value, tuple) else value
    step = 1e-3 * value

    def line(k):
        return solved(strip.replace({key: value + k * step})).shape.centreline(S)

    fourth = (8.0 * (line(1) - line(-1)) - line(2) + line(-2)) / (12.0 * step)
    assert np.abs(exact - fourth).max() < 1e-5 * np.abs(exact).max()


def test_total_is_the_root_of_the_sum_of_squares(strip, state):
    found = input_uncertainty(strip, state)
    assert set(found.parts) == {"strip.young", "strip.thickness", "strip.natural_curvature", "strip.poisson"}
    assert max(found.parts.values()) <= found.total <= 1.000001 * np.sqrt(sum(v**2 for v in found.parts.values()))
    alone = strip.replace({"uncertainty": {"young": 5e7}})
    assert input_uncertainty(alone, state).total == pytest.approx(found.parts["strip.young"], rel=1e-12)
    twice = alone.replace({"uncertainty.young": 1e8})
    assert input_uncertainty(twice, state).total == pytest.approx(2.0 * found.parts["strip.young"], rel=1e-12)


def test_young_and_density_act_through_gamma_alone(strip, state):
    by = derivatives(strip, state, ["strip.young", "strip.density"], lambda g: g.position(S))
    ratio = -strip.strip.density / strip.strip.young
    np.testing.assert_allclose(by["strip.young"], ratio * by["strip.density"], rtol=1e-9, atol=1e-20)


def test_a_first_order_spread_is_that_of_random_inputs(strip, state):
    """40 scenes with inputs drawn from their uncertainties: the spread of their ends."""
    rng = np.random.default_rng(5)
    ends = []
    for _ in range(40):
        moved = {
            f"strip.{name}": value + unsure * rng.normal()
            for name, value, unsure in (("young", 2e9, 5e7), ("thickness", 2e-4, 2e-6), ("poisson", 0.3, 0.02))
        }
        moved["strip.natural_curvature"] = 2.0 + 0.05 * rng.normal()
        ends.append(solved(strip.replace(moved)).end.position)
    spread = np.sqrt(np.array(ends).var(axis=0, ddof=1).sum())
    by = derivatives(
        strip, state, ["strip.young", "strip.thickness", "strip.natural_curvature", "strip.poisson"],
        lambda g: g.position(1.0),
    )  # fmt: skip
    unsure = {"strip.young": 5e7, "strip.thickness": 2e-6, "strip.natural_curvature": 0.05, "strip.poisson": 0.02}
    told = np.sqrt(sum((by[key] ** 2).sum() * unsure[key] ** 2 for key in by))
    assert 0.7 < spread / told < 1.35


def test_nothing_said_nothing_told(strip, state):
    assert input_uncertainty(strip.replace({"uncertainty": None}), state) is None
    assert input_uncertainty(strip.replace({"uncertainty": {"young": 0.0}}), state) is None
    check_keys(registry.model("shell"), strip)
    check_keys(registry.model("elastica"), strip.replace({"clamp.start.normal": [1.0, 0.0, 0.0]}))


def test_what_is_not_given_cannot_be_unsure(strip):
    with pytest.raises(BadInput) as caught:
        strip.replace({"uncertainty.gamma": 1.0})
    assert caught.value.key == "uncertainty.gamma"
    with pytest.raises(BadInput):
        derivatives(strip, None, ["strip.gamma"], lambda g: g.position(S))
    with pytest.raises(BadInput):
        derivatives(strip, None, ["strip.length"], lambda g: g.position(S))
    # it moves no result: kept cases stay right
    assert strip.canonical() == strip.replace({"uncertainty": None}).canonical()


def test_a_state_without_derivatives_says_why(strip, state):
    from dataclasses import replace

    broken = replace(state.native, status=type(state.native.status).NOT_CONVERGED, message="too few steps")
    found = input_uncertainty(strip, replace(state, native=broken))
    assert isinstance(found, InputUncertainty)
    assert found.total is None
    assert found.why


def test_solve_writes_it(tmp_path, strip):
    path = tmp_path / "strip.toml"
    path.write_text(STRIP)
    assert cli.main(["solve", str(path), "--out", str(tmp_path / "out"), "--quiet"]) == 0
    found = list((tmp_path / "out").rglob("result.json"))
    told = json.loads(found[0].read_text())["u_input"]
    assert told["total"] > 0.0
    assert told["rms"] < told["total"]
    assert set(told["parts"]) == {"strip.young", "strip.thickness", "strip.natural_curvature", "strip.poisson"}
