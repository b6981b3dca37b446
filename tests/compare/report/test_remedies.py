"""Remedies are written once, in the words of scenes and commands; solvers know none of these."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from compare import registry
from compare.models import solve
from compare.models.base import Options
from compare.models.capabilities import Advises
from compare.page.remedies import message
from compare.pages.result import state_result
from compare.scene.scene import loads
from ribbon import Status
from tests.compare.scene import held_scenes
from tests.test_setup import ROOT

REMEDIES = {
    (name, word): text
    for name in registry.names()
    if isinstance(registry.model(name), Advises)
    for word, text in registry.model(name).remedies.items()
}


@dataclass(frozen=True)
class End:
    model: str
    word: str
    message: str
    remedy: str | None = None


@pytest.mark.parametrize(("model", "word"), REMEDIES)
def test_a_remedy_stands_once_at_the_end(model, word):
    said = message(End(model, word, "it ended: so"))
    assert said.count(REMEDIES[model, word]) == 1
    assert said.endswith(REMEDIES[model, word])
    assert message(End(model, "converged", "it ended: so")) == "it ended: so"


def test_every_ribbon_s_end_has_a_word_here_or_needs_none():
    known = {word for model, word in REMEDIES if model == "ribbon"}
    assert known | {"converged", "rulings_cross"} == {status.code for status in Status}


def test_a_saddle_s_remedy_reaches_the_result():
    scene = loads(held_scenes.ON_EDGE)
    state = solve(scene, options=Options(leave_saddle=False))
    assert state.word == "saddle"
    assert state_result(scene, state)["message"] == state.message + REMEDIES["ribbon", "saddle"]


@pytest.mark.parametrize("package", ["ribbon", "shellref"])
def test_solvers_do_not_speak_of_flags_or_sections(package):
    for path in (ROOT / package).rglob("*.py"):
        text = path.read_text()
        assert not [word for word in ("--leave-saddle", "--set", "[seed]", "[[path]]") if word in text], path.name
