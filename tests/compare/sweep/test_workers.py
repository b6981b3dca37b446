"""A worker of a sweep ends when it is told to, also inside what no exception leaves."""

from __future__ import annotations

import time

import pytest

from compare.store.progress import Reporter
from compare.sweep.large.pace import Pace, progress
from compare.sweep.workers import Died, LocalCrew, Worker


class Slow:
    """Its finaliser says that it has begun, and takes long: an exception that is raised in it goes nowhere."""

    def __init__(self, place):
        self.place = place

    def __del__(self, clock=time.monotonic):
        self.place.touch()
        until = clock() + 1.0
        while clock() < until:
            pass


class Dropped:
    """A job that drops a `Slow`, after which it would go on."""

    def __init__(self, place):
        self.place = place

    def work(self):
        Slow(self.place)
        time.sleep(30.0)


def test_sigterm_inside_a_finaliser_is_not_lost(tmp_path, capfd):
    worker, place = Worker(), tmp_path / "begun"
    worker.give(Dropped(place))
    while not place.exists():
        time.sleep(0.01)
    worker.process.terminate()
    with pytest.raises(Died, match="code 1"):
        worker.take()
    assert capfd.readouterr().err == ""
    assert worker.process.exitcode == 1


class Compiles:
    """A job for which numba says that it compiles a kernel of this package, and then another."""

    def __init__(self, package):
        self.package = package

    def work(self):
        from types import SimpleNamespace

        from numba.core import event

        import ribbon.element.kernel_cache  # noqa: F401

        kernel = SimpleNamespace(py_func=SimpleNamespace(__module__=f"{self.package}.kernels"))
        for _ in range(2):
            with event.trigger_event("numba:compile", data={"dispatcher": kernel, "args": (), "return_type": None}):
                pass
        return 7

    def apart(self):
        return []


def test_a_crew_tells_once_that_kernels_are_compiled_for_a_job_and_when_it_is_over():
    crew, told = LocalCrew(1), []
    crew.compiles = told.append
    for end in crew.flow([Compiles("ribbon"), Compiles("another")]):
        assert end.outcome == 7
        assert end.compiled == (end.job.package == "ribbon")
        told.append(end.job.package)
    assert told == [True, "ribbon", False, "another"]


class Said(Reporter):
    """Keeps what is said."""

    def __init__(self):
        super().__init__(quiet=True)
        self.lines = []

    aside = detail = lambda self, text: self.lines.append(text)


def test_the_rate_leaves_out_what_was_compiled():
    said = Said()
    pace = Pace(said)
    pace.compiles(True)
    pace.ended(64, 1000, 0)
    pace.compiles(False)
    pace.ended(64, 1000, 0)
    pace.ended(128, 1000, 1)
    assert said.lines[0].startswith("compiling the ribbon's kernels")
    assert said.lines[1:3] == ["64 of 1000 cases"] * 2
    assert "128 of 1000 cases, 1 not converged, " in said.lines[3]
    assert progress(128, 1000, 0, 2.0, 64) == "128 of 1000 cases, 32 a second, about 27 s left"
