"""Other people's programs as runners: what is given to them, and what is made of how they end."""

from __future__ import annotations

import importlib
import json
import math
import os
import re
import shutil
import subprocess
import time
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from compare.suite import runners
from compare.suite.answers import ANSWERED, NOT_REPRESENTABLE, Absent, BrokeDown, NotRepresentable
from compare.suite.case import first_scene, load
from compare.suite.peers import auto, calculix, call
from compare.suite.peers.models import rest_shape
from compare.suite.peers.runners import PROGRAMS, opensees, pyelastica
from compare.suite.reference import both_ways
from compare.suite.score import MET, scored
from compare.suite.section import bar_of
from tests.test_setup import ROOT

here = pytest.mark.skipif(shutil.which(calculix.PROGRAM) is None, reason="no CalculiX (Debian: calculix-ccx)")


def block(text, keyword):
    """Rows of numbers below the first line that begins with the keyword."""
    rows = text.split(keyword, 1)[1].split("\n", 1)[1].split("*", 1)[0]
    return [[float(x) for x in row.split(",") if x.strip()] for row in rows.strip().splitlines()]


def plate(name):
    case = load(name)
    return calculix.plate_of(first_scene(case), case.theory)


# -- runners


def test_the_distributions_entry_points_are_runners_that_no_built_in_one_hides():
    points = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["entry-points"][runners.GROUP]
    assert set(points) == {"auto", "calculix", "fedoo", "newton", "opensees"}
    assert not set(points) & set(runners.BUILT_IN)
    assert set(PROGRAMS) | {"ours", "auto", "calculix", "fedoo"} == set(points) | set(runners.BUILT_IN)
    for target in points.values():
        module, _, name = target.partition(":")
        assert callable(getattr(importlib.import_module(module), name))


def test_a_mesh_is_asked_once_and_the_change_from_half_as_fine_is_the_error():
    case = load("bend_45")
    seen = []

    def reply(ask, size):
        seen.append(size)
        return call.Reply((np.linspace(0.0, 1.0, 5)[:, None] * (1.0 + 1.0 / size) * np.ones(3),), None, f"{size} steps")

    said = call.answers_of(case, (10, 20), reply, "none 1")
    assert seen == [10, 20]  # three questions about one state
    answer = said.answers["x of the end"]
    assert answer.value == pytest.approx(1.05 * case.length)
    assert answer.error == pytest.approx(0.05 * case.length)
    assert said.settings == "elements: 10, 20; 20 steps"


@pytest.mark.parametrize(
    ("script", "fault", "word"),
    [
        ("sleep 5", BrokeDown, "out of budget"), ("""echo '{"broke": "at 0.3 of the load"}'""", BrokeDown, "at 0.3"),
        ("""echo '{"not": "no rings"}'""", NotRepresentable, "no rings"), ("exit 3", RuntimeError, "no word"),
    ],
)  # fmt: skip
def test_how_a_script_ends_is_told_apart(tmp_path, script, fault, word):
    python = tmp_path / "python"
    python.write_text(f"#!/bin/sh\n{script}\n")
    python.chmod(0o755)
    with pytest.raises(fault, match=word):
        call.points_of(str(python), "with_opensees.py", {"bars": []}, 1.0)
    with pytest.raises(BrokeDown, match="out of budget"):
        call.points_of(str(python), "with_opensees.py", {"bars": []}, 0.0)


@pytest.mark.peers
@pytest.mark.parametrize(
    ("run", "names", "order"),
    [
        (pyelastica, ("cantilever_10", "bend_45", "curl_up"), 1.0),
        (opensees, ("cantilever_10", "bend_45", "curl_up"), 1.5),
    ],
)
def test_others_come_to_rest_near_the_reference_by_their_own_error(run, names, order):
    """Three cases each: planar, spatial, curved at rest."""
    for name in names:
        case = load(name)
        try:
            (said,) = runners.answered(run, case, 600.0)
        except Absent as why:
            pytest.skip(str(why))
        assert said.ended == ANSWERED, f"{name}: {said.why}"
        end = case.length * both_ways(bar_of(first_scene(case), case.theory).free_rod)[0]
        for ask in case.asks:
            answer = said.answers[ask.name]
            known = call.read_off(ask, end[None, :])
            assert abs(float(answer.value) - known) < 1.5 * answer.error / (2.0**order - 1.0) + 5e-4 * case.length


def test_a_collocations_polynomials_are_read_between_its_points():
    mesh = np.sort(np.concatenate([np.linspace(0.0, 1.0, 4), np.random.default_rng(3).uniform(size=9)]))
    cubic = np.stack([mesh**3, 1.0 - mesh, mesh**4], axis=1)
    table = np.column_stack([mesh, cubic, np.zeros((13, 10))])
    s = np.linspace(0.0, 1.0, auto.READ)
    assert auto.line(table) == pytest.approx(np.stack([s**3, 1.0 - s, s**4], axis=1), abs=1e-12)


def test_of_a_continuations_solutions_the_one_under_the_whole_load_is_read():
    heads = [f"1 {k} {kind} {k} 1 1 2 14 3 2 3 13 1" for k, kind in ((1, 9), (2, -4), (3, 1))]
    rows = ["0.0 " + " ".join(["1.0D0"] * 13), "1.0 " + " ".join(["2.0D0"] * 13)]
    blocks = [
        "\n".join([head, *rows, f" {share}"]) for head, share in zip(heads, ("0.4D0", "1.0D0", "1.2D0"), strict=True)
    ]
    table, share = auto.last("\n".join(blocks) + "\n")
    assert (table[:, 0].tolist(), share) == ([0.0, 1.0], 1.2)
    assert auto.last(blocks[0])[0] is None
    assert auto.last(blocks[0])[1] == 0.4


def test_auto_meets_what_its_equations_have():
    """Planar, over weights, spatial, curled at rest, with shear: by the references, and by another collocation."""
    for name in ("cantilever_10", "cantilever_weights", "bend_45", "rod_4_4", "princeton_8_9"):
        case = load(name)
        try:
            (said,) = runners.answered(auto.auto, case, 60.0)
        except Absent as why:
            pytest.skip(str(why))
        assert said.ended == ANSWERED, f"{name}: {said.why}"
        if case.theory != "body":  # of which a rod is a model of some error
            assert {score.outcome for score in scored(case, "auto", said)} == {MET}
        scenes = [list(call.scenes(case, ask)) for ask in case.asks]
        for ask, own in zip(case.asks, scenes, strict=True):
            ends = [case.length * both_ways(bar_of(scene, case.theory).free_rod)[0] for scene in own]
            known = [call.read_off(ask, end[None, :]) for end in ends]
            assert np.ravel(said.answers[ask.name].value) == pytest.approx(known, abs=1e-5 * case.length)


@pytest.mark.peers
def test_a_program_that_has_too_little_time_says_how_far_it_came():
    try:
        python, _ = call.interpreter("pyelastica")
    except Absent as why:
        pytest.skip(str(why))
    bar = bar_of(first_scene(load("cantilever_10")), "elastica").to_dict()
    script = "import json, sys; import with_pyelastica as w; print(w.at_rest(json.load(sys.stdin), 40, 0.0)[0])"
    done = subprocess.run(
        [python, "-c", script], input=json.dumps(bar), capture_output=True, text=True, check=True,
        cwd=Path(call.__file__).parent,
    )  # fmt: skip
    assert re.search(r"out of budget: after \d+ steps .* a node still moves by .* end \(", done.stdout)


# -- CalculiX


def test_the_rest_surface_is_that_of_the_rod():
    """A helix of the same curvatures by closed forms; across, straight lines of the width along t_x."""
    case = load("bend_45")
    bar = replace(bar_of(first_scene(case), case.theory), rest=(3.0, -1.0, 2.0), start=(0.1, 0.2, 0.3))
    one = calculix.Plate(0.2, 0.01, 0.3, bar.rest, bar.start, bar.frame, (0.0,) * 3, (0.0,) * 3)
    points = one.points(np.linspace(0.0, 1.0, 9), np.array([-0.1, 0.0, 0.1]))
    nodes, frames = rest_shape(bar, 8)
    np.testing.assert_allclose(points[:, 1], nodes, atol=1e-12)
    middle = one.points(np.linspace(0.0, 1.0, 17), np.array([-0.1, 0.1]))[1::2]
    np.testing.assert_allclose(middle[:, 1] - middle[:, 0], 0.2 * frames[:, :, 0], atol=1e-12)


@pytest.mark.parametrize(("name", "bend"), [("sze_annulus", math.pi / 10.0), ("curl_up", 0.25), ("sze_end_shear", 0.0)])
def test_a_deck_has_the_strip_its_loads_and_its_centreline(name, bend):
    """bend: angle whose sine over itself the flat cells of its corners lose, in their plane or out of it."""
    one, (n, m) = plate(name), calculix.lattice(20)
    text = calculix.deck(one, 20)
    nodes = {int(row[0]): np.array(row[1:]) for row in block(text, "*NODE,")}
    elements = np.array(block(text, "*ELEMENT,"), dtype=int)[:, 1:]
    assert elements.shape == (n * m, 8)
    assert set(elements.ravel()) == set(nodes)
    corners = np.array([[nodes[k] for k in row[:4]] for row in elements])
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]), axis=1)
    assert area.sum() == pytest.approx(one.width * np.sinc(bend / math.pi), rel=1e-6)
    middle = [int(row[0]) for row in block(text, "*NSET, NSET=MIDDLE")]
    line = one.points(np.linspace(0.0, 1.0, 2 * n + 1), np.zeros(1))[:, 0]
    np.testing.assert_allclose([nodes[k] for k in middle], line, atol=1e-11)
    held = [int(row[0]) for row in block(text, "*NSET, NSET=HELD")]
    assert len(held) == 2 * m + 1
    pulled = np.zeros(3)
    for _node, axis, force in block(text, "*CLOAD") if "*CLOAD" in text else []:
        pulled[int(axis) - 1] += force
    np.testing.assert_allclose(pulled, np.array(one.force) * one.width, atol=1e-9)
    ((young, poisson),) = block(text, "*ELASTIC")
    assert young * one.thickness**3 / (12.0 * (1.0 - poisson**2)) == pytest.approx(1.0)
    ((density,),) = block(text, "*DENSITY")
    assert density * one.thickness == pytest.approx(1.0)
    if name == "curl_up":
        (row,) = re.findall(r"STRIP, GRAV, (.*)", text)
        assert [float(x) for x in row.split(",")] == pytest.approx([100.0, -1.0, 0.0, 0.0])


@here
def test_only_a_straight_strip_under_its_weight_buckles_there():
    case = load("daisy_critical")
    said = runners.answered(calculix.calculix, replace(case, asks=(replace(case.asks[0], key="strip.gamma"),)), 1.0)
    assert said[0].ended == NOT_REPRESENTABLE


@pytest.mark.parametrize(
    "name", ["bend_45", "circle", "coil_in_tube", "tang_dowell_0", "fallen_over", "daisy_10g", "moebius_5"]
)
def test_what_no_plate_is_is_refused(name):
    with pytest.raises(NotRepresentable):
        plate(name)


@here
def test_calculix_meets_a_published_cantilever_and_says_where_it_stops():
    case = load("sze_end_shear")
    said = call.answers_of(case, (6, 12), lambda ask, size: calculix.solved(plate(case.name), size, 100.0), "ccx")
    assert {score.outcome for score in scored(case, "calculix", said)} == {MET}
    with pytest.raises(BrokeDown, match=r"out of budget: at [0-9.]+ of the load"):
        calculix.solved(plate(case.name), 12, 0.05)
    thinner = calculix.solved(replace(plate("cantilever_10"), thickness=1 / 4000), 20, 100.0)
    assert thinner.settings.endswith("tolerance 0.001")  # 1e-5 is beyond its digits
    y, z = thinner.points[0][-1][1:]
    assert -y / z == pytest.approx(load("cantilever_10").asks[0].reference, rel=3e-4)
    thin = replace(plate(case.name), thickness=2e-5)
    with pytest.raises(BrokeDown, match="its increments ended at 0 of the load"):
        calculix.solved(thin, 6, 100.0)


@here
def test_calculix_buckles_a_strip_on_edge_nearer_to_the_shells_weight_by_refinement():
    """14.192 +- 0.006 by two other codes; 14.290, 14.217 and 14.203 on 10, 20 and 40 elements."""
    case = load("on_edge")
    (ask,) = case.asks
    one = plate(case.name)
    coarse, fine = (
        case.physics["strip"]["gamma"] * calculix.critical(one, size, time.perf_counter() + 100.0) for size in (10, 20)
    )
    assert ask.distance(coarse) > 3.0 * ask.distance(fine)
    assert ask.distance(fine) * ask.interval[0] < 3e-3 * float(ask.reference)


def test_of_several_pythons_the_first_that_has_the_library_is_asked(tmp_path, monkeypatch):
    for name, line in (("none", "exit 1"), ("old", "echo 1.5"), ("new", "echo 2.0")):
        (tmp_path / name).write_text(f"#!/bin/sh\n{line}\n")
        (tmp_path / name).chmod(0o755)
    monkeypatch.setenv(call.VARIABLE, os.pathsep.join(str(tmp_path / name) for name in ("none", "old", "new")))
    call.interpreter.cache_clear()
    assert call.interpreter("anything") == (str(tmp_path / "old"), "1.5")
    call.interpreter.cache_clear()
    monkeypatch.delenv(call.VARIABLE)
    with pytest.raises(Absent, match=call.VARIABLE):
        call.interpreter("no-such-library-here")
    call.interpreter.cache_clear()
