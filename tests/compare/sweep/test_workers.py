"""A worker of a sweep ends when it is told to, also inside what no exception leaves."""

from __future__ import annotations

import time

import pytest

from compare.sweep.workers import Died, Worker


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
