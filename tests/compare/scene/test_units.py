"""Units: from l, D w / l^2 and D w / l to metres, newtons, newton metres and joules, against formulas by hand."""

import pytest

from compare.cli import BAD_INPUT, main
from compare.scene.scene import load, loads
from compare.scene.units import Units, quantity
from ribbonbench.errors import BadInput
from tests.compare.scene.held_scenes import STEEL


def test_units_of_a_steel_strip():
    units = loads(STEEL).units
    bending = 2.1e11 * 1e-12 / (12.0 * (1.0 - 0.09))
    assert units.bending == pytest.approx(bending, rel=1e-14)
    assert units.force == pytest.approx(bending * 0.01 / 0.09, rel=1e-14)
    assert units.energy == pytest.approx(bending * 0.01 / 0.3, rel=1e-14)
    assert units.si(2.0, "l") == (0.6, "m")
    assert units.si(1.0, "D / l^2")[0] == pytest.approx(bending / 0.09, rel=1e-14)


def test_a_scene_with_gamma_has_no_units():
    units = load("curl_4_3").units
    assert not units.known
    assert units.si(1.0, "l") is None
    assert set(units.to_dict().values()) == {None}
    assert units.text(0.25, "l") == "0.25 l"


@pytest.mark.parametrize(
    ("value", "base", "text"),
    [
        (0.00096, "m", "0.96 mm"), (1.5, "m", "1.5 m"), (2e-7, "m", "0.2 µm"), (8.8e-10, "m", "0.88 nm"),
        (0.0123, "N", "12.3 mN"),
        (-2500.0, "N", "-2.5 kN"), (0.0, "N", "0 N"), (4.5e-3, "N m", "4.5 N mm"), (1.2e-3, "J", "1.2 mJ"),
    ],
)  # fmt: skip
def test_quantities_have_the_prefix_of_a_reader(value, base, text):
    assert quantity(value, base) == text


def test_si_is_asked_for_and_known():
    steel = loads(STEEL)
    assert Units.asked(steel.strip, "si") == Units.asked(steel.strip, "auto") == steel.units
    assert not Units.asked(steel.strip, "l").known
    assert not Units.asked(load("curl_4_3").strip, "auto").known


@pytest.mark.parametrize(
    ("text", "missing"),
    [
        (STEEL.replace("young = 2.1e11\ndensity = 7850.0", "gamma = 3.0"), ["strip.young", "strip.gamma"]),
        (STEEL.replace("young = 2.1e11\ndensity = 7850.0", "").split("[gravity]")[0] + "[clamp.start]"
         + STEEL.split("[clamp.start]")[1], ["strip.young"]),
    ],
)  # fmt: skip
def test_si_without_a_stiffness_names_the_keys_that_are_missing(text, missing):
    with pytest.raises(BadInput) as caught:
        Units.asked(loads(text).strip, "si")
    assert caught.value.key == "--units"
    assert all(key in caught.value.remedy for key in missing)


def test_the_command_refuses_si_of_a_scene_with_gamma(tmp_path, capsys):
    assert main(["solve", "curl_4_3", "--units", "si", "--out", str(tmp_path / "out")]) == BAD_INPUT
    assert not (tmp_path / "out").exists()
    assert capsys.readouterr().err.count("\n") == 1
