"""Sweeps as data: what is read is what was written, every fault is named before anything is computed."""

from __future__ import annotations

import pytest

from compare.scene.scene import load
from compare.studies.axes import parse_axis
from compare.sweep.file import load_sweep, shipped, solvers
from compare.sweep.run import check
from ribbonbench.errors import BadInput

PLAIN = """
title = "A sweep"
scene = "cantilever"
[set]
strip.poisson = 0.3
"model.elements" = 8
[[axis]]
key = "strip.gamma"
spacing = "log"
first = 1.0
last = 100.0
count = 3
[[axis]]
keys = ["strip.width", "model.energy"]
values = [[0.05, "sadowsky"], [0.1, "wunderlich"]]
"""


def written(tmp_path, text=PLAIN, name="mine.toml"):
    path = tmp_path / name
    path.write_text(text)
    return str(path)


def read(tmp_path, text=PLAIN):
    return load_sweep(written(tmp_path, text), {}, [])


def test_a_file_is_read(tmp_path):
    sweep = read(tmp_path)
    assert (sweep.name, sweep.title, sweep.solver) == ("mine", "A sweep", "ribbon")
    assert (sweep.scene.strip.poisson, sweep.scene.model.elements) == (0.3, 8)
    assert sweep.keys == ("strip.gamma", "strip.width", "model.energy")
    points = check(sweep)
    assert [p.number for p in points] == list(range(6))
    assert [(p.scene.gamma, p.scene.strip.width) for p in points[:3]] == [(1.0, 0.05), (1.0, 0.1), (10.0, 0.05)]
    assert points[1].scene.model.energy == "wunderlich"


def test_assignments_and_axes_of_the_command_line(tmp_path):
    path = written(tmp_path)
    axes = [parse_axis("strip.gamma=5,6"), parse_axis("strip.poisson=0,0.5")]
    sweep = load_sweep(path, {"model.elements": 4}, axes)
    assert sweep.scene.model.elements == 4
    assert sweep.keys == ("strip.gamma", "strip.width", "model.energy", "strip.poisson")
    assert len(check(sweep)) == 8


def test_a_scene_with_vary_is_a_sweep(tmp_path):
    axes = [parse_axis("strip.gamma=log(1,1e4,9)")]
    found = load_sweep("cantilever", {}, axes)
    assert (found.name, found.solver, len(check(found))) == ("cantilever", "ribbon", 9)
    file = written(tmp_path, load("cantilever").to_toml(), "own.toml")
    assert len(check(load_sweep(file, {}, axes))) == 9
    with pytest.raises(BadInput, match="varies nothing"):
        load_sweep("cantilever", {}, [])


def test_a_scene_beside_the_file(tmp_path):
    (tmp_path / "own.toml").write_text(load("curl_4_3").to_toml())
    sweep = read(tmp_path, PLAIN.replace('"cantilever"', '"own.toml"'))
    assert sweep.scene.strip.natural_curvature == (10.0, 10.0)


def test_the_thesis_sweep():
    sweep = load_sweep("cantilever_4_5", {}, [])
    points = check(sweep)
    assert len(points) == 2500
    gammas = [point.scene.gamma for point in points]
    # rho g h l^3 / D with D = Y h^3 / (12 (1 - nu^2)), the ends of the thesis's ranges
    assert min(gammas) == pytest.approx(1200 * 9.81 * 1e-3 * 0.05**3 * 9 / (10e6 * 1e-9), rel=1e-12)
    assert max(gammas) == pytest.approx(1200 * 9.81 * 1e-3 * 0.9**3 * 9 / (0.5e6 * 1e-9), rel=1e-12)
    assert {(p.scene.strip.poisson, p.scene.strip.thickness, p.scene.strip.density) for p in points} == {
        (0.5, 1e-3, 1200.0)
    }


def test_every_shipped_sweep_is_read():
    assert shipped()
    for name in shipped():
        sweep = load_sweep(name, {}, [])
        assert sweep.solver in solvers()
        assert check(sweep)


BAD = [
    ('title = "A', 'tilte = "A', "tilte", "did you mean title"),
    ("[set]", "solver = 3\n[set]", "solver", "not a text"),
    ("[set]", 'solver = "shel"\n[set]', "solver", "ribbon, elastica, curve_angle, antman, shell, tape, compare"),
    ("[set]", 'errors = "yes"\n[set]', "errors", "true nor false"),
    ('scene = "cantilever"', "", "scene", "missing"),
    ('scene = "cantilever"', 'scene = "cantilver"', "scene", "did you mean cantilever"),
    ("strip.poisson = 0.3", "strip.poison = 0.3", "strip.poison", "not a known key"),
    ("strip.poisson = 0.3", "strip.poisson = 3", "strip.poisson", "0.5"),
    ('key = "strip.gamma"', 'key = "strip.gama"', "strip.gama", "point 0"),
    ('key = "strip.gamma"', "", "axis.0", "needs key or keys"),
    ('key = "strip.gamma"', "key = 3", "axis.0.key", "names no key"),
    ('spacing = "log"', 'spacing = "cubic"', "axis.0.spacing", "linear"),
    ("first = 1.0", "first = 0.0", "axis.0.spacing", "above zero"),
    ("first = 1.0", "", "axis.0.first", "missing"),
    ("first = 1.0", "first = nan", "axis.0.first", "finite"),
    ("count = 3", "count = 0", "axis.0.count", "whole number"),
    ("count = 3", "count = 2.5", "axis.0.count", "whole number"),
    ("count = 3", "count = 3\nvalues = [1.0]", "axis.0.spacing", "beside values"),
    ("count = 3", "counts = 3", "axis.0.counts", "did you mean count"),
    ('[0.05, "sadowsky"]', "[0.05]", "axis.1.values", "list of 2"),
    ("[0.05, ", "[-0.05, ", "strip.width", "point 0: strip.gamma = 1.0, strip.width = -0.05"),
    ("[0.1, ", "[2.0, ", "strip.width", "point 1"),
    ("strip.width", "strip.gamma", "strip.gamma", "varied twice"),
    ("[set]", "[[curve]]\nfactor = 1.0\npwr = 2\n[set]", "curve.0.pwr", "did you mean power"),
    ("[set]", "set = 3\n[sett]", "sett", ""),
    ("[[axis]]", "[[axis", "SWEEP", "not valid TOML"),
]


@pytest.mark.parametrize(("old", "new", "key", "words"), BAD)
def test_bad_input_names_the_key(tmp_path, old, new, key, words):
    assert old in PLAIN
    with pytest.raises(BadInput) as raised:
        check(read(tmp_path, PLAIN.replace(old, new, 1)))
    assert key in raised.value.key
    assert words in str(raised.value)


def test_the_same_values_twice(tmp_path):
    with pytest.raises(BadInput, match="twice"):
        read(tmp_path, PLAIN.replace('[0.1, "wunderlich"]', '[0.05, "sadowsky"]'))


@pytest.mark.parametrize("raw", [b"\xff\xfe\x00", b"x" * 6_000_000])
def test_files_that_are_none(tmp_path, raw):
    (tmp_path / "x.toml").write_bytes(raw)
    with pytest.raises(BadInput):
        load_sweep(str(tmp_path / "x.toml"), {}, [])
    with pytest.raises(BadInput, match="folder"):
        load_sweep(str(tmp_path), {}, [])
    with pytest.raises(BadInput, match="did you mean cantilever_4_5"):
        load_sweep("cantilever_45", {}, [])


def test_what_a_solver_cannot_take_is_said_with_the_point():
    def requested(scene, solver, *axes, **more):
        import dataclasses

        sweep = load_sweep(scene, {}, [parse_axis(axis) for axis in axes])
        return check(dataclasses.replace(sweep, solver=solver, **more))

    with pytest.raises(BadInput, match=r"planar.*point 0"):
        requested("curl_4_3", "elastica", "strip.gamma=1,2")
    with pytest.raises(BadInput, match="point 0"):
        requested("moebius_6_1", "shell", "strip.width=0.05,0.06")
    with pytest.raises(BadInput, match="leave-saddle"):
        requested("cantilever", "elastica", "strip.gamma=1,2", leave_saddle=True)
    assert len(requested("cantilever", "elastica", "strip.gamma=1,2")) == 2
