"""Axes of --vary: numbers and vectors, lists and ranges, written one way everywhere."""

import pytest

from compare.studies.axes import parse_axis
from compare.sweep.file import load_sweep
from compare.sweep.run import check
from ribbonbench.errors import BadInput

FIRST, LAST = [0.0, 0.0, 0.9], [0.0, 0.0, 0.8]


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("clamp.end.position=[[0, 0, 0.9], [0, 0, 0.8]]", [FIRST, LAST]),
        ("clamp.end.position=[0,0,0.9],[0,0,0.8]", [FIRST, LAST]),
        ("clamp.end.position=[0, 0, 0.9]", [FIRST]),
        ("clamp.end.position=[0,0,0.9]:[0,0,0.8]:3", [FIRST, [0.0, 0.0, 0.85], LAST]),
        ("clamp.end.position=linear([0,0,0.9], [0,0,0.8], 3)", [FIRST, [0.0, 0.0, 0.85], LAST]),
        ("wall.floor.normal=[0,0,1]", [[0.0, 0.0, 1.0]]),
        ("strip.gamma=1:3:3", [1.0, 2.0, 3.0]),
        ("strip.gamma=linear(1,3,3)", [1.0, 2.0, 3.0]),
        ("strip.gamma=log(1., 1e4, 3)", [1.0, 100.0, 1e4]),
        ("strip.gamma=.5,2.", [0.5, 2.0]),
        ("strip.gamma=[1, 2]", [1, 2]),
        ("strip.natural_curvature=[1, 2]", [1, 2]),
        ("strip.natural_curvature=[[1, 2], [3, 4]]", [[1, 2], [3, 4]]),
        ('model.energy="sadowsky","wunderlich"', ["sadowsky", "wunderlich"]),
    ],
)
def test_values_of_an_axis(text, values):
    axis = parse_axis(text)
    assert axis.keys == (text.partition("=")[0],)
    assert [value for (value,) in axis.values] == values


@pytest.mark.parametrize(
    "text",
    [
        "clamp.end.position=[0,0,0.9]:[0,0.8]:3", "clamp.end.position=log([0,0,0.9],[0,0,0.8],3)", "strip.gamma=1:3",
        "strip.gamma=1:3:0", "strip.gamma=1:x:3", "strip.gamma=1:2.5:2.5", "strip.gamma=linear(1,3)", "strip.gamma=1,1",
        "clamp.end.position=[0,0,0.9]:0.8:3", "strip.gamma=log(0,1,3)", "strip.gamma=1:inf:3",
    ],
)  # fmt: skip
def test_no_axis(text):
    with pytest.raises(BadInput) as caught:
        parse_axis(text)
    assert caught.value.key == "--vary"


def test_a_file_takes_vectors_too(tmp_path):
    (tmp_path / "moved.toml").write_text(
        'scene = "two_clamps_5_3_2"\n[[axis]]\nkey = "clamp.end.position"\nfirst = [0.6, 0.0, 0.6]\n'
        "last = [0.5, 0.0, 0.6]\ncount = 5\n"
    )
    scenes = [point.scene for point in check(load_sweep(str(tmp_path / "moved.toml"), {}, []))]
    assert [scene.clamp_end.position[0] for scene in scenes] == pytest.approx([0.6, 0.575, 0.55, 0.525, 0.5])
