"""A picture while a sweep runs: when one is begun, and what it is of."""

from __future__ import annotations

import numpy as np
import pytest

from compare.store.progress import Reporter
from compare.studies.axes import parse_axis
from compare.sweep import page, picture, run
from compare.sweep.file import load_sweep
from compare.sweep.large import meanwhile
from compare.sweep.large.aside import Aside
from compare.sweep.workers import LocalCrew


class Drawing:
    """In place of a process that draws."""

    def __init__(self) -> None:
        self.done = self.ended = False

    def over(self) -> bool:
        return self.done

    def end(self) -> None:
        self.ended = True


def test_one_picture_at_a_time_and_as_much_time_between_as_it_is_worth(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(meanwhile.time, "monotonic", lambda: now[0])
    begun: list[Drawing] = []

    def begin():
        begun.append(Drawing())
        return begun[-1]

    watch = meanwhile.Meanwhile()
    for seconds, count in ((9.0, 0), (1.0, 1), (60.0, 1)):  # not before the first ten seconds; one is being drawn
        now[0] += seconds
        watch.look(begin)
        assert len(begun) == count
    begun[0].done = True
    watch.look(begin)  # it took 60 s: fifty times that until the next
    for seconds, count in ((2999.0, 1), (2.0, 2)):
        now[0] += seconds
        watch.look(begin)
        assert len(begun) == count
    watch.end()
    assert [one.ended for one in begun] == [True, True]


@pytest.fixture
def sweep():
    axes = [parse_axis("strip.gamma=1,2,3"), parse_axis("strip.natural_curvature=0,2")]
    found = load_sweep("cantilever", {"model.elements": 6}, axes)
    return run.replace(found, solver="ribbon", show="end.y")


def test_it_is_of_the_cases_that_are_there(sweep, tmp_path, monkeypatch):
    monkeypatch.setattr(run, "Meanwhile", lambda: meanwhile.Meanwhile(0.0, 0.0))
    monkeypatch.setattr(meanwhile, "SHARE", 1e9)
    monkeypatch.setattr(run, "sliced", lambda tasks, size: tasks)  # one by one
    seen: list[list[int]] = []

    def begin(so_far):
        seen.append([case.point.number for case in so_far.cases])
        page.draw_so_far(str(tmp_path), so_far)
        drawing = Drawing()
        drawing.done = True
        return drawing

    finished = run.run(sweep, run.check(sweep), tmp_path, LocalCrew(1), Reporter(quiet=True), picture=begin)
    assert finished.ok
    assert [len(one) for one in seen][:2] == [1, 3]  # every other look ends the one before
    assert (tmp_path / "sweep.png").read_bytes().startswith(b"\x89PNG")


def test_a_map_of_some_cases_has_them_in_their_places(sweep, tmp_path, monkeypatch):
    grids = []
    monkeypatch.setattr(picture, "save", lambda figure, path: grids.append(figure.axes[0].collections[0].get_array()))
    rows = [
        {"status": "converged", "stable": True, "strip.gamma": gamma, "strip.natural_curvature": curl, "end.y": height}
        for gamma, curl, height in ((3, 0, 5.0), (1, 2, 7.0))
    ]
    picture.draw_rows(tmp_path / "x.png", sweep, rows, "end.y", "", (0, 2))
    assert np.ma.filled(grids[0], np.nan).reshape(3, 2) == pytest.approx(
        np.array([[np.nan, 7.0], [np.nan, np.nan], [5.0, np.nan]]), nan_ok=True
    )


def test_a_process_of_its_own_draws(sweep, tmp_path):
    finished = run.run(sweep, run.check(sweep), tmp_path, LocalCrew(1), Reporter(quiet=True))
    so_far = run.replace(finished, cases=finished.cases[:3], part="so far")
    drawing = Aside(page.draw_so_far, str(tmp_path), so_far)
    assert drawing.result() is None
    assert (tmp_path / "sweep.png").read_bytes().startswith(b"\x89PNG")
