"""Rows of cases that begin at their neighbours' states: those of cases alone, and the same however a run is cut."""

from __future__ import annotations

import tempfile
from dataclasses import replace

import pytest

from compare.models.ribbon import solving
from compare.studies.axes import Grid, parse_axis
from compare.sweep.file import load_sweep
from compare.sweep.journal import value_in
from compare.sweep.large import lines, stream, stretch
from compare.sweep.large.stretch import TRIES, Stretch, given
from compare.sweep.shard import Shard

AXES = ("strip.gamma=log(2,40,3)", "strip.natural_curvature=-1.5:1.5:30")


def swept(**more):
    axes = [parse_axis(axis) for axis in AXES]
    sweep = load_sweep("cantilever", {"model.elements": 6, "gravity.up": [0.6, 0.0, 0.8]}, axes)
    return replace(sweep, **{"neighbours": True, **more})


@pytest.fixture(scope="module")
def job():
    sweep = swept()
    return Stretch(0, tuple(range(90)), given(sweep, Grid(sweep.scene, sweep.axes)), tempfile.gettempdir())


def columns(job):
    return value_in(job.work().line.rstrip(b"\n"))["columns"]


def test_rows_are_those_of_cases_alone(job):
    along, alone = columns(job), columns(replace(job, tries=TRIES))
    assert alone == columns(replace(job, given=given(swept(neighbours=False), Grid(swept().scene, swept().axes))))
    warm = along.pop("warm")  # a case that was begun at its neighbours' names the one before it
    assert 60 < sum(case is not None for case in warm) < 90
    assert all(case in (None, number - 1) for number, case in enumerate(warm))
    assert along.keys() == alone.keys()
    assert sum(along.pop("iterations")) < 0.8 * sum(alone.pop("iterations"))
    for values in (along.pop("residual"), alone.pop("residual")):
        assert max(values) < 1e-10
    for name, values in along.items():
        if isinstance(values[0], float):
            assert values == pytest.approx(alone[name], rel=1e-7, abs=1e-7), name
        else:
            assert values == alone[name], name


def test_a_row_depends_on_its_block_alone(job):
    """Whatever is asked for beside it: as after a kill, or in another shard."""
    whole = columns(job)
    for numbers in ((3,), (17, 40, 63), (64, 89)):
        some = columns(replace(job, numbers=numbers))
        assert {name: [values[n] for n in numbers] for name, values in whole.items() if name in some} == some


def test_lines_end_at_blocks_and_at_the_ends_of_the_last_axis():
    sweep = swept()
    grid = Grid(sweep.scene, sweep.axes)
    found = [lines.line_with(grid, number) for number in range(90)]
    assert list(dict.fromkeys(found)) == [range(30), range(30, 60), range(60, 64), range(64, 90)]
    assert all(number in line for number, line in enumerate(found))


def test_a_number_that_differs_from_the_other_way_sends_all_cases_alone(job, monkeypatch):
    ordinary = solving._columns

    def wrong(*given):
        found = ordinary(*given)
        return {**found, "end.y": found["end.y"] + 1e-3}

    alone = columns(replace(job, tries=TRIES))
    monkeypatch.setattr(solving, "_columns", wrong)
    assert columns(job) == alone


def test_a_fault_of_the_program_is_not_taken_for_a_line_that_cannot_be_gone(job, monkeypatch):
    """It made all cases go alone, many times slower, without a word; what a case is refused for still does."""
    alone = columns(replace(job, numbers=(64, 70, 89), tries=TRIES))

    def refused(tasks):
        raise ValueError("refused")

    monkeypatch.setattr(lines, "states_of", refused)
    assert columns(replace(job, numbers=(64, 70, 89))) == alone

    def wrong(*given):
        raise TypeError("a fault")

    monkeypatch.setattr(lines, "states_of", wrong)
    with pytest.raises(TypeError, match="a fault"):
        job.work()


def test_what_goes_by_lines():
    sweep = swept()
    grid = Grid(sweep.scene, sweep.axes)
    assert lines.goes_by_lines(sweep, grid)
    for other in (
        swept(errors=True),
        swept(leave_saddle=True),
        swept(solver="compare"),
        swept(shapes=5),
        swept(neighbours=False),
    ):
        assert not lines.goes_by_lines(other, grid)
    short = Grid(sweep.scene, (sweep.axes[1], sweep.axes[0]))
    assert not lines.goes_by_lines(sweep, short)
    wide = Grid(sweep.scene, (parse_axis("strip.width=0.01:0.05:30"),))
    assert not lines.goes_by_lines(sweep, wide)


def test_shards_take_whole_blocks_of_a_great_grid(monkeypatch):
    sweep = swept()
    grid = Grid(sweep.scene, sweep.axes)
    for many in (1000, 0):
        monkeypatch.setattr(stream, "MANY", many)
        shards = [list(stream.cases_of(sweep, grid, Shard(k, 3))) for k in (1, 2, 3)]
        assert sorted(number for shard in shards for number in shard) == list(range(90))
        cut = [{n for n in shard if n < lines.BLOCK} for shard in shards]
        assert (sum(map(bool, cut)) == 1) == (many == 0)
    assert list(stream.cases_of(sweep, grid, Shard())) == list(range(90))


def test_a_block_whose_worker_dies_is_tried_again_whole(job):
    (again,) = job.apart()
    (last,) = again.apart()
    assert (again.numbers, last.tries) == (job.numbers, TRIES)
    assert [one.numbers for one in last.apart()][:2] == [(0,), (1,)]
    assert all(one.tries == TRIES for one in last.apart())
    assert stretch.by_lines(job.given)
