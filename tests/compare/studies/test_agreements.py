"""Ribbon and shell of the shipped scenes are as near to each other as `compare/studies/agreements.toml` claims."""

from __future__ import annotations

import pytest

from compare.check import assert_pin, read_pins
from compare.models.scope import has_shell
from compare.scene.scene import load, shipped

PINS = read_pins()


def _marked(pin):
    return pytest.param(pin, marks=[pytest.mark.validate] if pin.validate else [], id=pin.label.replace(" ", "-"))


@pytest.mark.shell
@pytest.mark.parametrize("pin", [_marked(pin) for pin in PINS])
def test_agreement(pin, kept):
    pytest.importorskip("dolfinx")
    assert_pin(pin, kept)


def test_every_scene_with_a_shell_has_a_pin():
    with_shell = {name for name in shipped() if has_shell(load(name))}
    assert len(with_shell) >= 9
    assert {pin.scene.name for pin in PINS} == with_shell


def test_the_quick_pins_are_some_and_have_bounds():
    quick = [pin for pin in PINS if not pin.validate]
    assert 4 <= len(quick) <= 6
    assert all(pin.distance is not None and pin.share is not None for pin in quick)
