"""`model.budget` holds in every model: one that has no time left says so, and what it has is no equilibrium."""

import time

import pytest

from compare.models import solve
from compare.scene.scene import load

#: Scene and keys of a model; the steps that it takes there are many enough for a budget to end among them.
SCENES = {
    "elastica": ("daisy_5g", {"model.energy": "elastica"}),
    "elastica, arc length": ("daisy_5g", {"model.energy": "elastica", "model.arc_length": "always"}),
    "antman": ("bend_45", {}),
    "tape": ("tape_4_1", {"model.elements": 100}),
    "curve_angle": ("rod_4_5", {}),
}


@pytest.mark.parametrize("name", SCENES)
def test_a_model_without_time_stops_and_says_so(name):
    scene, keys = SCENES[name]
    scene = load(scene).replace({**keys, "model.budget": 1e-6})
    state = solve(scene)
    assert not state.is_equilibrium
    assert state.word == "not_converged"
    assert "budget" in state.message


@pytest.mark.parametrize("name", ["elastica", "antman"])
def test_with_time_it_is_there(name):
    scene, keys = SCENES[name]
    assert solve(load(scene).replace(keys)).ok


def test_the_time_is_the_thread_s_and_the_shorter_one_counts():
    from ribbonbench.clock import spent, within

    assert not spent()
    with within(10.0):
        assert not spent()
        with within(1e-9):
            time.sleep(1e-6)
            assert sum(range(1000)) == 499500
            assert spent()
            with within(10.0):
                assert spent()
        assert not spent()
    assert not spent()


def test_a_look_at_the_wall_is_no_earlier_than_the_thread_s_clock():
    """It may stand in for the clock of the thread, which takes long to read on some machines, for 10 ms at most."""
    from ribbonbench import clock

    for _ in range(200):
        early, late = clock._now(), clock._at_most_now()
        sum(range(2000))
        assert early <= late + 1e-4
        time.sleep(1e-4)
    with clock.within(0.05):
        while not clock.spent():
            sum(range(1000))


def test_what_chooses_the_energy_has_no_more_time(monkeypatch):
    from compare.models.ribbon import auto
    from ribbonbench.clock import spent

    chosen, seen = auto.choose, []

    def choose(*told):
        seen.append(spent())
        return chosen(*told)

    monkeypatch.setattr(auto, "choose", choose)
    keys = {"model.energy": "auto", "model.accuracy": 0.01, "strip.thickness": 1e-3}
    for budget in (1e-9, 60.0):
        solve(load("moebius_6_1").replace({**keys, "model.budget": budget}))
    assert seen == [True, False]
