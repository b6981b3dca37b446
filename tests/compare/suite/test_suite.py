"""The suite: every case keeps its schema, its ways agree, outcomes are told apart, one file adds a case or a runner."""

from __future__ import annotations

import json
import math
import re
import subprocess
import sys
import tomllib
from types import SimpleNamespace

import numpy as np
import pytest

from compare import cli
from compare.suite import ours, runners, schema
from compare.suite.answers import BROKE_DOWN, MISTAKE, NOT_REPRESENTABLE, Absent, Answer, Answers, BrokeDown
from compare.suite.case import chosen, load, read, shipped
from compare.suite.reference import FreeRod, buckled_cantilever, clamped_arch, free_rod
from compare.suite.score import ELSEWHERE, MET, OFF, scored
from ribbonbench.errors import BadInput
from tests.reference import elastica_closed
from tests.test_setup import ROOT

PAGE = (ROOT / "docs" / "suite.md").read_text(encoding="utf-8")


def block(head: str) -> str:
    """The text of the page's code block whose first line is `head`."""
    found = re.search(rf"```{re.escape(head)}\n(.*?)```", PAGE, re.DOTALL)
    assert found
    return found.group(1)


def scores_of(name: str, *ways: str):
    """Scores of a shipped case by some ways of `ours`, by way and question."""
    kept = tuple(way for way in ours.WAYS if way.name in ways)
    case = load(name)
    said = [(way.name, ours.answered_by(case, way, 60.0)) for way in kept]
    return {(way, s.ask): s for way, one in said for s in scored(case, "ours", one)}


# -- cases


@pytest.mark.parametrize("name", shipped())
def test_the_ways_of_every_case_agree_within_its_interval(name):
    case = load(name)
    for ask in case.asks:
        for way in ask.ways:
            assert ask.distance(way.value) <= 1.0 + 1e-9, f"{ask.name}: {way.by}"
        if not isinstance(ask.reference, bool):
            size = max(np.abs(np.atleast_1d(ask.reference)).max(), case.length if ask.of == "position" else 0.0)
            assert min(ask.interval) >= 0.9e-5 * size or ask.of in ("position", "radius", "ratio")


def test_there_are_cases_of_every_level():
    assert len(shipped()) >= 35
    levels = set(schema.schema()["properties"]["level"]["enum"])
    assert {load(name).level for name in shipped()} == levels


@pytest.mark.parametrize(
    ("key", "value", "named"),
    [
        ("version", 2, "version"), ("level", "rope", "level"), ("says", "", "says"), ("fast", 1, "fast"),
        ("solver", "ipopt", "solver"), ("units", "si", "units"), ("cite", [], "cite"),
    ],
)  # fmt: skip
def test_a_case_that_breaks_the_schema_is_refused_by_the_key(key, value, named):
    text = block("toml ring_of_mine.toml")
    line = f"{key} = {json.dumps(value)}"
    changed = re.sub(rf"(?m)^{key} = .*$", line, text) if re.search(rf"(?m)^{key} = ", text) else f"{line}\n{text}"
    with pytest.raises(BadInput) as told:
        read(changed, "mine")
    assert told.value.key == f"mine.{named}"


@pytest.mark.parametrize(
    ("was", "becomes", "named"),
    [
        ('of = "energy"', 'of = "position"', "axis"), ('of = "energy"', 'of = "energy"\naxis = "x"', "axis"),
        ('of = "energy"', 'of = "stable"', "reference"), ("interval = 2e-4", "interval = 0.0", "interval"),
        ("reference = 19.7392088", "reference = [1.0, 2.0]", "reference"),
        ("value = 19.7392 }", "value = true }", "value"), ("length = 1.0", "length = -1.0", "strip.length"),
    ],
)  # fmt: skip
def test_a_question_that_is_none_is_refused_by_the_key(was, becomes, named):
    text = block("toml ring_of_mine.toml")
    assert was in text
    with pytest.raises(BadInput) as told:
        read(text.replace(was, becomes), "mine")
    assert told.value.key.endswith(named)


def test_the_schema_uses_no_keyword_that_is_not_checked():
    """A keyword that the validator does not know is an error of its own, wherever it stands."""

    def rules(node):
        yield node
        for child in node.get("properties", {}).values():
            yield from rules(child)
        if "items" in node:
            yield from rules(node["items"])

    known = {*schema._RULES, *schema._WORDS, "type", "required", "properties", "additionalProperties", "items"}
    for node in rules(schema.schema()):
        assert set(node) <= known
    with pytest.raises(ValueError, match="pattern"):
        schema.check("a", {"pattern": "b"})


# -- references that the suite computes itself


def test_closed_forms_are_those_of_many_digits():
    for alpha in (0.5, 2.0):
        np.testing.assert_allclose(buckled_cantilever(alpha), elastica_closed.buckled_cantilever(alpha), rtol=1e-12)
    for shortening in (0.05, 0.4):
        thrust, rise = clamped_arch(shortening)
        again = math.sqrt(thrust) / 4.0  # K(k)
        assert rise == pytest.approx(float(elastica_closed.mpmath.ellipk((rise * again) ** 2) ** 0 * rise))
        assert 2.0 * (1.0 - float(elastica_closed.mpmath.ellipe((rise * again) ** 2)) / again) == pytest.approx(
            shortening
        )


def test_the_collocated_rod_is_the_elastica_and_the_helix():
    zero, one = np.zeros(3), np.ones(3)
    heavy = FreeRod(one, zero, np.eye(3), np.array([0.0, -10.0, 0.0]), zero, zero, zero)
    _x, y, z = free_rod(heavy)[0]
    assert -y / z == pytest.approx(
        elastica_closed.heavy_cantilever(10.0)[1] / elastica_closed.heavy_cantilever(10.0)[0]
    )
    helix = FreeRod(one, np.array([3.0, 0.0, 4.0]), np.eye(3), zero, zero, zero, zero)
    turned = free_rod(helix, (0.25, 1.0))
    axis = np.array([0.6, 0.0, 0.8])
    for s, point in zip((0.25, 1.0), turned, strict=True):
        assert point @ axis == pytest.approx(0.8 * s, abs=1e-7)
        assert np.linalg.norm(point - (point @ axis) * axis) == pytest.approx(
            2 * 0.12 * abs(math.sin(2.5 * s)), abs=1e-7
        )


# -- the runner ours


@pytest.mark.parametrize(
    ("name", "ways"),
    [
        ("cantilever_10", ("elastica", "wunderlich", "sadowsky")), ("elastica_arch", ("elastica", "wunderlich")),
        ("elastica_leaning", ("elastica",)), ("daisy_critical", ("elastica",)), ("daisy_10g", ("elastica",)),
        ("rod_4_4", ("antman",)), ("bend_45", ("antman",)), ("princeton_8_9", ("antman",)), ("pretwisted", ("antman",)),
        ("tang_dowell_0", ("antman",)), ("figure_4_1", ("sadowsky",)), ("curl_up", ("finite",)),
        ("curl_down", ("finite",)), ("forceless", ("sadowsky",)), ("roman_fold", ("wunderlich",)),
        ("squeezed_ring", ("sadowsky", "wunderlich")), ("circle", ("wunderlich",)), ("sze_end_shear", ("finite",)),
        ("moebius_5", ("wunderlich",)), ("thickness_up", ("finite",)), ("coil_in_tube", ("sadowsky",)),
        ("folded_ring", ("sadowsky", "wunderlich")), ("band_on_table", ("wunderlich",)),
    ],
)  # fmt: skip
def test_ours_meets_the_fast_cases(name, ways):
    for (way, ask), score in scores_of(name, *ways).items():
        assert score.outcome == MET, f"{name}, {way}, {ask}: {score.told}, {score.why}"


def test_a_developable_strip_is_off_where_a_body_is_asked():
    """curl_up is 2.5 % of l away for Wunderlich's energy: tens of intervals, and no mesh."""
    score = scores_of("curl_up", "wunderlich")["wunderlich", "x of the end"]
    assert score.outcome == OFF
    assert score.off > 5.0
    assert score.mesh is not None
    assert score.mesh < 0.5 * score.off


def test_another_theory_is_not_representable():
    assert scores_of("figure_4_1", "elastica")["elastica", "x of the end"].outcome == NOT_REPRESENTABLE


def test_a_critical_value_that_no_solve_comes_near_is_where_the_eigenvalue_vanishes():
    """Stable up to 14 with a free motion's zero, lost from 14.25 on, no equilibrium between."""
    (ask,) = load("michell_ring").asks

    def at(value):
        far = value - 14.1
        lost = value > 14.25
        return SimpleNamespace(
            is_equilibrium=lost or value <= 14.0,
            stable=not lost,
            lowest_eigenvalue=-far - 0.3 * far**2 if lost else 0.0,
        )

    found, (low, high) = ours._critical(ask, at)
    assert low <= 14.0 < 14.25 < high < 14.35
    assert found == pytest.approx(14.1, abs=3e-3)
    near, (low, high) = ours._critical(ask, lambda value: SimpleNamespace(
        is_equilibrium=True, stable=value < 14.2, lowest_eigenvalue=14.2 - value
    ))  # fmt: skip
    assert high - low <= 0.1 * ask.interval[0]
    assert near == pytest.approx(14.2, abs=0.1 * ask.interval[0])


# -- outcomes


def test_outcomes_are_told_apart():
    case = load("daisy_10g")
    (ask,) = case.asks
    width, at = ask.interval[0], float(ask.reference)

    def outcome(said):
        return next(scored(case, "one", said)).outcome

    def number(value):
        return Answers(answers={ask.name: Answer(value)})

    assert outcome(number(at + 0.99 * width)) == MET
    assert outcome(number(at + 1.5 * width)) == OFF
    assert outcome(number(ask.elsewhere[0])) == ELSEWHERE
    assert (
        outcome(number(True))
        == outcome(number(math.nan))
        == outcome(number((1.0, 2.0)))
        == outcome(Answers())
        == MISTAKE
    )
    assert outcome(Answers(ended=BROKE_DOWN)) == BROKE_DOWN


def test_what_a_runner_raises_decides_whose_fault_it_is():
    case = load("circle")

    def raising(fault):
        def run(case, budget):
            raise fault

        return runners.answered(run, case, 1.0)[0]

    assert raising(BrokeDown("limit point")).ended == BROKE_DOWN
    assert raising(ZeroDivisionError("x")).ended == MISTAKE
    assert runners.answered(lambda case, budget: 3.0, case, 1.0)[0].ended == MISTAKE
    with pytest.raises(Absent):
        raising(Absent("not here"))


# -- one file each


@pytest.fixture
def place(tmp_path):
    """An empty folder with the two files of docs/suite.md, and the runner's entry point."""
    folder = tmp_path / "my_runner-1.dist-info"
    folder.mkdir()
    (tmp_path / "ring_of_mine.toml").write_text(block("toml ring_of_mine.toml"))
    (tmp_path / "my_runner.py").write_text(block("python my_runner.py"))
    (folder / "entry_points.txt").write_text(block("text"))
    (folder / "METADATA").write_text("Metadata-Version: 2.1\nName: my_runner\nVersion: 1\n")
    return tmp_path


def test_a_case_and_a_runner_are_added_by_one_file_each(place):
    words = ["suite", "run", "ring_of_mine.toml", "figure_4_1", "--runner", "mine", "--quiet", "--out", "o"]
    path = f"{ROOT}:{place}"
    done = subprocess.run(
        [sys.executable, "-m", "ribbonbench", *words], cwd=place, env={"PYTHONPATH": path, "PATH": "/usr/bin:/bin"},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == cli.DONE, done.stderr
    found = json.loads((place / "o" / "result.json").read_text())["scores"]
    assert {(row["case"], row["outcome"]) for row in found} == {
        ("ring_of_mine", "met"),
        ("figure_4_1", NOT_REPRESENTABLE),
    }


def test_answers_are_scored_from_their_file(tmp_path, capsys):
    case = load("circle")
    told = {"energy": {"value": 20.0, "error": 0.01}, "it is stable": {"value": True, "error": None}}
    entry = {"case": "circle", "digest": case.digest, "said": [{"way": "mine", "answers": told}]}
    file = tmp_path / "mine.json"
    file.write_text(json.dumps({"version": 1, "runner": "me", "cases": [entry]}))
    assert cli.main(["suite", "score", str(file), "--out", str(tmp_path / "o"), "--json"]) == cli.DONE
    rows = json.loads(capsys.readouterr().out)["scores"]
    assert [row["outcome"] for row in rows] == [
        f"off by {0.2607911978 / case.asks[0].interval[0]:.2g} intervals",
        "met",
    ]
    assert rows[0]["mesh"] == pytest.approx(0.01 / case.asks[0].interval[0])
    file.write_text("{}")
    assert cli.main(["suite", "score", str(file), "--out", str(tmp_path / "o")]) == cli.BAD_INPUT


def test_words_that_name_nothing_are_refused(capsys):
    for words in (["run", "no_such"], ["run", "circle", "--runner", "no_such"], ["show"], ["run", "--seconds", "0"]):
        assert cli.main(["suite", *words]) == cli.BAD_INPUT
        assert len(capsys.readouterr().err.strip().splitlines()) == 1
    assert {case.level for case in chosen(["planar"])} == {"planar"}
    assert all(case.fast for case in chosen([], fast=True))
    assert tomllib.loads(block("toml ring_of_mine.toml"))["version"] == 1


@pytest.mark.validate
def test_ours_meets_every_question():
    """Every question of the suite by one of our models at least, shells and tapes too."""
    missed = []
    for case in chosen([]):
        met = {
            s.ask
            for one in runners.answered(ours.run, case, math.inf)
            for s in scored(case, "ours", one)
            if s.outcome == MET
        }
        missed += [(case.name, ask.name) for ask in case.asks if ask.name not in met]
    assert missed == []
