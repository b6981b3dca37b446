"""Slips of units are noted before the solve, with what was probably meant; what is usual is not."""

from __future__ import annotations

import json
import os

import pytest

from compare.cli import main
from compare.scene.begin.materials import MATERIALS
from compare.scene.begin.start import started
from compare.scene.inputs.plausible import HEAVIEST, certain, check_meant, implausible
from compare.scene.scene import load, shipped
from ribbonbench.accepted import YES, accepting
from ribbonbench.errors import BadInput

STEEL_TEXT, STEEL = started({"material": "steel"}, True, "steel")


@pytest.mark.parametrize("name", shipped())
def test_no_shipped_scene_is_implausible(name):
    assert implausible(load(name)) == ()


@pytest.mark.parametrize("material", MATERIALS)
@pytest.mark.parametrize("thickness", ["0.05mm", "0.1mm", "0.5mm"])
def test_no_usual_strip_is_implausible(material, thickness):
    _, scene = started({"material": material, "thickness": thickness, "length": "20cm"}, True, "x")
    # rubber of 50 micrometres does hang like a chain
    assert [note for note in implausible(scene) if "Gamma" not in note] == []
    assert len(implausible(scene)) == (scene.gamma > HEAVIEST)


@pytest.mark.parametrize(
    ("keys", "key", "meant"),
    [
        ({"strip.young": 210.0}, "strip.young", "2.1e11"),
        ({"strip.young": 3.5}, "strip.young", "3.5e9"),
        ({"strip.young": 4000.0}, "strip.young", "4e9"),
        ({"strip.young": 2.1e14}, "strip.young", "Pa"),
        ({"strip.density": 7.85}, "strip.density", "7850"),
        ({"strip.density": 7.85e-9}, "strip.density", "7850"),
        ({"strip.density": 7.85e6}, "strip.density", "7850"),
        ({"strip.length": 300.0, "strip.width": 10.0, "strip.thickness": 0.1}, "strip.length", "0.3"),
        ({"strip.length": 30.0, "strip.width": 1.0, "strip.thickness": 0.01}, "strip.length", "0.3"),
        ({"strip.length": 1.0, "strip.width": 0.5, "strip.thickness": 0.05}, "strip.thickness", "5e-5"),
        ({"strip.thickness": 4e-3}, "strip.thickness", "w/h"),
        ({"strip.thickness": 1e-7}, "strip.thickness", "w/h"),
        ({"gravity.acceleration": 9810.0}, "gravity.acceleration", "9.81"),
        ({"strip.gamma": 2e5}, "Gamma", "strip.gamma"),
    ],
)
def test_a_slip_names_its_key_and_what_was_meant(keys, key, meant):
    found = implausible(STEEL.replace(keys))
    assert any(note.startswith(key) and meant in note for note in found), found


def test_the_bounds_themselves_are_plausible():
    assert implausible(STEEL.replace({"strip.gamma": HEAVIEST})) == ()
    assert implausible(STEEL.replace({"strip.gamma": HEAVIEST * 1.01})) != ()
    assert implausible(STEEL.replace({"strip.density": 10.0})) == ()
    assert implausible(STEEL.replace({"strip.density": 9.9})) != ()


def test_a_heavy_tip():
    daisy = load("daisy_5g")
    assert any(note.startswith("tip.mass") for note in implausible(daisy.replace({"tip.mass": 50.0})))


def test_notes_come_before_the_solve_and_stand_in_the_result(tmp_path, capsys):
    words = ["solve", "coil_10_100", "--set", "strip.thickness=1e-8", "--out", str(tmp_path), "--quiet"]
    main(words)
    notes = json.loads((tmp_path / "result.json").read_text())["notes"]
    assert len(notes) == 1
    assert capsys.readouterr().err.count(notes[0]) == 1
    assert main([*words[:2], "--set", "strip.young=-1", "--set", "strip.density=1", *words[4:]]) == 2


CERTAIN = (
    ({"strip.young": 210.0}, "strip.young"),
    ({"strip.young": 2.1e14}, "strip.young"),
    ({"strip.density": 7.85}, "strip.density"),
    ({"gravity.acceleration": 9810.0}, "gravity.acceleration"),
    ({"strip.length": 300.0, "strip.width": 10.0, "strip.thickness": 0.1}, "strip.length"),
)


@pytest.mark.parametrize(("keys", "key"), CERTAIN)
def test_what_no_strip_can_be_meant_by_is_not_computed(keys, key, tmp_path, capsys):
    """Such scenes were solved for a quarter of a minute, to an answer that nobody asked for."""
    scene = tmp_path / "steel.toml"
    scene.write_text(STEEL_TEXT)
    words = [part for name, value in keys.items() for part in ("--set", f"{name}={value!r}")]
    for command in ("solve", "limits", "cost", "compare"):
        out = tmp_path / command
        assert main([command, str(scene), *words, "--out", str(out), "--quiet"]) == 2
        said = capsys.readouterr().err
        assert f"ribbonbench: {key} = " in said
        assert "--yes" in said
        assert not out.exists()


@pytest.mark.parametrize(
    "keys", [{"strip.thickness": 1e-7}, {"strip.gamma": 2e5}, {"strip.length": 30.0, "strip.width": 1.0}]
)
def test_what_may_be_meant_is_a_note_alone(keys):
    assert implausible(STEEL.replace(keys)) != ()
    assert certain(STEEL.replace(keys)) == ()
    check_meant(STEEL.replace(keys))


def test_with_yes_it_is_computed_and_nothing_stays_accepted(monkeypatch):
    monkeypatch.delenv(YES, raising=False)
    slip = STEEL.replace({"strip.young": 210.0})
    with pytest.raises(BadInput, match=r"strip\.young"):
        check_meant(slip)
    with accepting(True):
        check_meant(slip)
        assert os.environ[YES] == "1"
    assert YES not in os.environ
    with pytest.raises(BadInput), accepting(False):
        check_meant(slip)
