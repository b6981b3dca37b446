"""The hidden half: drawn by a seed, references in two ways; programs of others are asked as JSON, or skipped."""

from __future__ import annotations

import numpy as np
import pytest

from compare import cli
from compare.suite import ours
from compare.suite.answers import ANSWERED, Absent, NotRepresentable
from compare.suite.case import first_scene, load
from compare.suite.hidden import drawn
from compare.suite.peers import call
from compare.suite.peers.runners import exudyn, mujoco
from compare.suite.reading import read_off
from compare.suite.reference import both_ways
from compare.suite.runners import answered
from compare.suite.score import MET, scored
from compare.suite.section import bar_of, saint_venant


def test_a_seed_draws_the_same_cases_and_another_one_others():
    first, again, other = drawn(11), drawn(11), drawn(12)
    assert [case.digest for case in first] == [case.digest for case in again]
    assert not {case.digest for case in first} & {case.digest for case in other}
    assert [case.name for case in first] == ["hidden_heavy", "hidden_curl", "hidden_pulled", "hidden_arch"]
    for case in first:
        for ask in case.asks:
            one, two = (np.asarray(way.value, dtype=float) for way in ask.ways)
            assert abs(one - two) < 1e-6 * max(1.0, abs(one))


@pytest.mark.parametrize(("name", "way"), [("heavy", "wunderlich"), ("curl", "antman"), ("pulled", "antman")])
def test_ours_meets_what_it_has_never_seen(name, way):
    (case,) = [case for case in drawn(5) if case.name == f"hidden_{name}"]
    (kept,) = [one for one in ours.WAYS if one.name == way]
    for score in scored(case, "ours", ours.answered_by(case, kept, 100.0)):
        assert score.outcome == MET, f"{score.ask}: {score.told}, {score.why}"


def test_the_section_is_saint_venants():
    """Timoshenko and Goodier, article 109: 0.1406 a^4 of a square, 0.2289, 0.2808 b^3 a of 2 and 4 to 1."""
    for ratio, known in ((1.0, 0.1406), (0.5, 0.229), (0.25, 0.281)):
        assert saint_venant(ratio) / 3.0 == pytest.approx(known, abs=4e-4)


def test_collocation_and_shooting_agree_on_the_bend():
    case = load("bend_45")
    one, two = both_ways(bar_of(first_scene(case), case.theory).free_rod)
    np.testing.assert_allclose(one, two, atol=1e-8)
    for ask in case.asks:
        assert ask.distance(float(one["xyz".index(ask.axis)] * case.length)) <= 1.0


@pytest.mark.parametrize(
    "name", ["michell_ring", "roman_fold", "elastica_arch", "figure_4_1", "tape_fold", "fallen_over"]
)
def test_what_an_adapter_does_not_make_it_refuses(name):
    case = load(name)
    with pytest.raises(NotRepresentable):
        bar_of(first_scene(case), case.theory)


def test_points_are_read_off_between_nodes():
    case = load("cantilever_10")
    (ask,) = case.asks
    points = np.array([[0.0, 0.0, 0.0], [0.0, -1.0, 2.0], [0.0, -3.0, 3.0]])
    assert read_off(ask, points) == pytest.approx(1.0)


def test_a_library_that_is_nowhere_is_absent(monkeypatch):
    monkeypatch.delenv(call.VARIABLE, raising=False)
    call.interpreter.cache_clear()
    with pytest.raises(Absent, match="RIBBONBENCH_PEERS"):
        call.interpreter("no-such-library-at-all")


@pytest.mark.peers
@pytest.mark.parametrize(
    ("library", "run", "names", "order"),
    [("mujoco", mujoco, ("cantilever_10", "bend_45"), 1.7), ("exudyn", exudyn, ("tang_dowell_45",), 1.5)],
)
def test_a_program_of_others_comes_nearer_by_refinement(library, run, names, order):
    """Where the program is there: its own refinement tends to the reference, by about its order."""
    try:
        call.interpreter(library)
    except Absent as why:
        pytest.skip(str(why))
    for name in names:
        case = load(name)
        (said,) = answered(run, case, 300.0)
        assert said.ended == ANSWERED, said.why
        bar = bar_of(first_scene(case), case.theory)
        end = case.length * both_ways(bar.free_rod)[0]
        for ask in case.asks:
            answer = said.answers[ask.name]
            assert answer.error is not None
            off = abs(float(answer.value) - read_off(ask, end[None, :]))
            assert off < 1.5 * answer.error / (2.0**order - 1.0) + 1e-9


def test_absent_programs_are_said_and_end_with_3(capsys, tmp_path, monkeypatch):
    def absent(library):
        raise Absent(f"{library} is in no interpreter here")

    monkeypatch.setattr(call, "interpreter", absent)
    words = ["suite", "run", "cantilever_10", "--runner", "mujoco", "--out", str(tmp_path / "o")]
    assert cli.main(words) == cli.MISSING
    assert "mujoco is in no interpreter here" in capsys.readouterr().err
    assert cli.main([*words, "--runner", "ours", "--seconds", "1e-9", "--json"]) == cli.DONE
