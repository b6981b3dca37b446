"""`ribbonbench new`: every combination of options is a scene that loads, carries its units, and (some) solves."""

from __future__ import annotations

import itertools
import json
import os
import pty
import re
import subprocess
import sys
import tomllib

import numpy as np
import pytest

from compare.cli import BAD_INPUT, DONE, main
from compare.models.scope import has_shell
from compare.scene.begin.materials import MATERIALS
from compare.scene.begin.quantities import UNITS, value_of
from compare.scene.begin.questions import answers
from compare.scene.begin.start import asked, checked, started
from compare.scene.begin.template import HELD
from compare.scene.keys import KEYS
from compare.scene.scene import load, loads
from ribbonbench.errors import BadInput
from tests.compare.scenes.test_scenes_shipped import UNITS as SAID
from tests.patience import PATIENCE

#: Parts of the options that combine freely, each a list of choices.
_UNITS = (["--si"], ["--si", "--material", "pet", "--length", "20cm", "--width", "8mm", "--thickness", "0.1mm"], [])
_CURVED = ([], ["--natural-curvature", "5"], ["--natural-curvature=-2,3"])
_WEIGHT = ([], ["--weightless"])
_COMBINED = [
    [*units, "--held", held, *curved, *weight]
    for units, held, curved, weight in itertools.product(_UNITS, HELD, _CURVED, _WEIGHT)
]


def made(tmp_path, words, name="my"):
    file = tmp_path / f"{name}.toml"
    assert main(["new", str(file), *words, "--quiet"]) == DONE
    return load(file)


@pytest.mark.parametrize("words", _COMBINED, ids=" ".join)
def test_every_combination_is_a_scene(words, tmp_path):
    scene = made(tmp_path, words)
    text = (tmp_path / "my.toml").read_text()
    assert all(len(line) <= 120 for line in text.splitlines())
    assert loads(scene.to_toml(), scene.source) == scene
    assert (scene.gravity is None) == ("--weightless" in words or "moebius" in words)
    assert (scene.strip.young is None) == ("--si" not in words)
    assert not scene.notes() or scene.gravity is None
    assert has_shell(scene)


@pytest.mark.parametrize("si", [["--si"], []], ids=["si", "dimensionless"])
@pytest.mark.parametrize("held", HELD)
def test_every_key_carries_unit_and_meaning(si, held, tmp_path):
    made(tmp_path, [*si, "--held", held])
    keys = 0
    for line in (tmp_path / "my.toml").read_text().splitlines():
        found = re.match(r"(?:# )?(\w+) = [^#]*(#.*)?$", line)
        if found and found[1] not in ("title", "t_x"):
            keys += 1
            assert found[2], line
            assert len(found[2]) > 8, line
            assert re.search(SAID.get(found[1], ""), found[2]), line
    assert keys >= 6


@pytest.mark.parametrize("material", MATERIALS)
def test_materials(material, tmp_path):
    """What the material says stands in the scene, and an option beside it goes before."""
    known = MATERIALS[material]
    strip = made(tmp_path, ["--material", material]).strip
    assert (strip.young, strip.density, strip.poisson) == (known.young, known.density, known.poisson)
    strip = made(tmp_path, ["--material", material, "--young", "5GPa"], "other").strip
    assert (strip.young, strip.density) == (5e9, known.density)
    assert 0.1 * known.young < 1e12
    assert 10.0 <= known.density <= 25_000.0


@pytest.mark.parametrize(
    ("words", "where"),
    [
        (["--si", "--held", "two", "--apart", "0.8"], 0.8),
        (["--held", "two"], 0.9),
        (["--held", "two", "--natural-curvature", "3"], 0.9),
    ],
    ids=["si", "dimensionless", "curved"],
)
def test_two_clamps_solve_to_an_arch(words, where, tmp_path):
    """Up, by symmetry straight above the middle, and stable."""
    made(tmp_path, words)
    solve = ["solve", str(tmp_path / "my.toml"), "--out", str(tmp_path / "o"), "--quiet", "--leave-saddle"]
    assert main(solve) == DONE
    result = json.loads(next((tmp_path / "o").rglob("result.json")).read_text())
    assert result["stable"] is True
    assert result["middle"]["position"][2] == pytest.approx(where / 2, abs=1e-3)
    assert result["middle"]["position"][1] > 0.1


@pytest.mark.parametrize("held", ["one", "ring"])
def test_others_solve(held, tmp_path):
    made(tmp_path, ["--si", "--held", held])
    assert main(["solve", str(tmp_path / "my.toml"), "--out", str(tmp_path / "o"), "--quiet"]) == DONE


def test_nothing_is_written_over(tmp_path, capsys):
    file = tmp_path / "my.toml"
    file.write_text("mine")
    assert main(["new", str(file), "--si"]) == BAD_INPUT
    assert file.read_text() == "mine"
    assert "--force" in capsys.readouterr().err
    assert main(["new", str(file), "--si", "--force"]) == DONE
    assert load(file).strip.young == 2.1e11


@pytest.mark.parametrize(
    ("words", "option"),
    [
        (["my.txt"], "FILE"),
        (["nowhere/my.toml"], "FILE"),
        (["my.toml", "--length", "long"], "--length"),
        (["my.toml", "--si", "--length", "30 furlongs"], "--length"),
        (["my.toml", "--si", "--length=-1"], "--length"),
        (["my.toml", "--si", "--width", "2"], "--width"),
        (["my.toml", "--si", "--thickness", "2cm"], "--thickness"),
        (["my.toml", "--poisson", "0.6"], "--poisson"),
        (["my.toml", "--held", "three"], "--held"),
        (["my.toml", "--material", "stel"], "--material"),
        (["my.toml", "--si", "--gamma", "10"], "--gamma"),
        (["my.toml", "--apart", "0.5"], "--apart"),
        (["my.toml", "--held", "two", "--apart", "1.5"], "--apart"),
        (["my.toml", "--natural-curvature", "1,2,3"], "--natural-curvature"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_what_cannot_be_is_one_line_that_names_the_option(words, option, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["new", *words]) == BAD_INPUT
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert f" {option}" in err
    assert list(tmp_path.iterdir()) == []


def test_to_the_output(capsys):
    """`-`: the scene alone, so that it can go into a pipe."""
    assert main(["new", "-", "--si"]) == DONE
    assert tomllib.loads(capsys.readouterr().out)["strip"]["young"] == 2.1e11


def test_the_clamps_of_a_strip_have_right_handed_frames():
    for held in ("one", "hanging", "two"):
        _, scene = started({"held": held}, True, "x")
        for frame in (scene.start_frame, scene.end_frame):
            if frame is not None:
                assert np.linalg.det(frame) == pytest.approx(1.0)
                assert frame[:, 0] == pytest.approx([1.0, 0.0, 0.0])  # as the comments say


# -- numbers with units -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "kind", "value"),
    [
        ("0.3", "length", 0.3), ("30cm", "length", 0.3), ("30 cm", "length", 0.3), (".1 mm", "length", 1e-4),
        ("1 in", "length", 0.0254), ("2.1e11", "stress", 2.1e11), ("210 GPa", "stress", 2.1e11),
        ("7.85g/cm3", "density", 7850.0), ("-0.1/mm", "curvature", -100.0), ("0.1 1/mm", "curvature", 100.0),
    ],
)  # fmt: skip
def test_numbers_with_units(text, kind, value):
    assert value_of(text, kind, "--x") == value


@pytest.mark.parametrize(
    ("text", "kind"), [("30 kg", "length"), ("1e999", "number"), ("0.3 m", "number"), ("", "length")]
)
def test_what_is_no_number_with_a_unit(text, kind):
    with pytest.raises(BadInput):
        value_of(text, kind, "--x")


@pytest.mark.parametrize("kind", [kind for kind in UNITS if UNITS[kind]])
def test_units_of_a_kind_are_in_order(kind):
    """The base unit is 1, and no unit is twice there with another size."""
    assert next(iter(UNITS[kind].values())) == 1.0


# -- questions --------------------------------------------------------------------------------------------------------


def test_questions_are_asked_again_until_the_answer_is_right():
    typed = iter(["long", "-1", "25 cm", "", "pet", "", "", "", "0.7", "0.4", "", "two", "0.8"])
    lines: list[str] = []
    found = answers(True, lambda question: next(typed), lines.append)
    assert found == {"length": "25 cm", "material": "pet", "poisson": "0.4", "held": "two", "apart": "0.8"}
    assert next(typed, None) is None
    _, scene = started(found, True, "x")
    assert (scene.strip.length, scene.strip.young, scene.strip.poisson) == (0.25, 4e9, 0.4)


@pytest.mark.parametrize("si", [True, False])
def test_every_question_has_a_default_that_is_right(si):
    from compare.scene.begin.start import default_of

    for ask in asked(si):
        assert checked(ask, default_of(ask, {})) is not None
    names = {ask.name for ask in asked(si)} - {"material", "held", "apart"}
    assert {f"strip.{name}" for name in names} <= set(KEYS)


def test_the_end_of_the_input_is_the_defaults():
    def ended(question):
        raise EOFError

    assert answers(True, ended, lambda line: None) == {}


def test_on_a_terminal_it_asks(tmp_path):
    """A real terminal: three answers, the material's default between them, then lines that take the defaults."""
    leader, follower = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, "-m", "compare.cli", "new", "my.toml", "--si"],
        stdin=follower, stdout=follower, stderr=follower, cwd=tmp_path, close_fds=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    )  # fmt: skip
    os.close(follower)
    os.write(leader, b"25cm\n8mm\n\n0.2 mm\n" + b"\n" * 12)
    try:
        while os.read(leader, 4096):
            pass
    except OSError:  # the other side is gone
        pass
    assert process.wait(timeout=PATIENCE) == DONE
    os.close(leader)
    strip = load(tmp_path / "my.toml").strip
    assert (strip.length, strip.width, strip.thickness) == (0.25, 0.008, 0.0002)


def test_in_a_pipe_it_does_not_ask(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "compare.cli", "new", "my.toml", "--si"], cwd=tmp_path, capture_output=True, text=True,
        stdin=subprocess.DEVNULL, env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}, check=False,
    )  # fmt: skip
    assert done.returncode == DONE
    assert load(tmp_path / "my.toml").strip.length == 0.3
