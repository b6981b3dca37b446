"""What is inside the clocks: one solve for each time, and in a first call nothing but one solve."""

from __future__ import annotations

import json
import subprocess

import pytest

import compare.models.elastica
import compare.models.elastica.start
import compare.models.ribbon
import compare.models.shell
import ribbon
import ribbon.find.adaptive
from compare.models import solve, timing
from compare.models.base import BESIDE, Options, Size
from compare.models.shell_process import ShellCase
from compare.scene.scene import load, loads
from compare.studies import cost_start
from tests.compare.scene.scene_texts import PLANAR, text
from tests.compare.studies.test_cost import BOWED

SOLVES = (
    (ribbon, "solve"), (ribbon.find.adaptive, "solve_to_tolerance"), (compare.models.elastica.start, "solve_elastica"),
    (compare.models.elastica.start, "solve_near"), (compare.models.elastica.start, "solve_along"),
    (compare.models.shell, "run_shell"),
)  # fmt: skip
#: Seconds of a solve by the made-up clock: below `timing.LONG`.
TICK = 0.25
CASES = {
    "chained": ("cantilever", "ribbon", Size("chained", (5.0,))),
    "mixed": ("cantilever", "ribbon", Size("mixed", (5.0,))),
    "placed": ("cantilever", "ribbon", Size("placed", (1e-2,))),
    "elastica": ("cantilever", "elastica", Size("elastica 1", (5.0,), 1)),
    "elastica, seeded": ("bowed", "elastica", Size("elastica 2", (10.0,), 2)),
    "shell": ("cantilever", "shell", Size("shell", (10.0, 2.0), 2)),
}


class Clock:
    """A clock that only solves move on."""

    def __init__(self) -> None:
        self.now, self.solves, self.depth = 100.0, 0, 0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch):
    """Counts outermost solves of every solver, and lets each take `TICK` seconds. No shell is run: it is told to have
    crashed."""
    found = Clock()

    def counted(real):
        def once(*arguments, **options):
            found.depth += 1
            try:
                return real(*arguments, **options)
            finally:
                found.depth -= 1
                if not found.depth:
                    found.solves += 1
                    found.now += TICK

        return once

    crashed = ShellCase({"status": "crashed", "stable": None, "message": "not run", "seconds": {}}, None, False)
    monkeypatch.setattr(compare.models.shell, "run_shell", lambda *_, **__: crashed)
    for module, name in SOLVES:
        monkeypatch.setattr(module, name, counted(getattr(module, name)))
    monkeypatch.setattr(timing.time, "perf_counter", found)
    return found


def scene_of(name):
    return loads(text(PLANAR, BOWED)) if name == "bowed" else load(name)


@pytest.mark.parametrize("case", CASES)
def test_a_first_call_is_one_solve(case, clock):
    name, model, size = CASES[case]
    requested = json.loads(json.dumps(cost_start.request(scene_of(name), model, size)))
    assert cost_start.main(requested) == 0
    assert clock.solves == 1


@pytest.mark.parametrize("case", [case for case in CASES if case != "shell"])
def test_a_time_is_that_of_one_solve(case, clock, monkeypatch):
    """Four calls inside the clock, one solve in each; whatever is solved beside them is not in their times."""
    name, model, size = CASES[case]
    inside = []
    real = timing.repeated

    def watched(once, first, repeats=None):
        def counted():
            before = clock.solves
            result = once()
            inside.append(clock.solves - before)
            return result

        return real(counted, first, repeats)

    monkeypatch.setattr(timing, "repeated", watched)
    state = solve(scene_of(name), model, size=size, options=Options(repeats=3))
    assert state.ok
    assert inside == [1, 1, 1]
    assert state.seconds.first == TICK
    assert state.seconds.repeats == (TICK, TICK, TICK)


def test_beside_another_models_shape_the_search_for_the_branch_is_outside_the_clock(clock):
    scene = scene_of("bowed")
    near = solve(scene, "ribbon").shape
    before = clock.solves
    state = solve(scene, "elastica", size=Size("elastica 2", (10.0,), 2), near=near, options=Options(repeats=2))
    assert state.start == BESIDE
    assert clock.solves - before > 3
    assert (state.seconds.first, state.seconds.repeats) == (TICK, (TICK, TICK))


@pytest.mark.parametrize(
    ("spent", "repeats", "calls", "times"),
    [
        (0.25, 3, 4, (0.25,) * 3),
        (3.0, 3, 3, (3.0,) * 3),  # a long first call counts
        (3.0, 1, 1, (3.0,)),
        (3.0, 0, 1, ()),
        (0.25, 0, 1, ()),
        (0.25, None, 6, (0.25,) * 5),
        (0.75, None, 4, (0.75,) * 3),  # 2.25 s, above the budget
        (3.0, None, 1, ()),
    ],
)
def test_repeats_are_as_many_as_asked_for(spent, repeats, calls, times, monkeypatch):
    clock = Clock()
    monkeypatch.setattr(timing.time, "perf_counter", clock)
    made = []

    def once():
        clock.now += spent
        made.append(clock.now)
        return len(made)

    result, seconds = timing.clocked(once, repeats)
    assert (result, len(made)) == (1, calls)
    assert (seconds.first, seconds.repeats) == (spent, times)


def test_a_process_is_timed_from_its_start_to_its_end(monkeypatch):
    clock = Clock()
    real = subprocess.run

    def run(*arguments, **options):
        done = real(*arguments, **options)
        clock.now += 5.0
        return done

    monkeypatch.setattr(cost_start.time, "perf_counter", clock)
    monkeypatch.setattr(cost_start.subprocess, "run", run)
    name, model, size = CASES["elastica"]
    requested = cost_start.request(scene_of(name), model, size)
    assert cost_start.seconds_of_first(requested) == 5.0
    assert cost_start.seconds_of_first({**requested, "scene": "nothing"}) is None
