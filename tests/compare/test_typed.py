"""What is typed, slips included: options and commands that are not there, scenes from a pipe, `keys`, `scenes NAME`."""

from __future__ import annotations

import io
import json
import re
import shlex
import subprocess
import sys

import pytest

from compare.cli import BAD_INPUT, DONE, main
from compare.pages.keys import described, matching, table_of
from compare.scene.inputs.source import name_of
from compare.scene.keys import KEYS, LISTED
from compare.scene.scene import load, loads, shipped


def run(capsys, *words):
    try:
        code = main([str(word) for word in words])
    except SystemExit as stop:
        code = stop.code
    told = capsys.readouterr()
    return code, told.out, told.err


# -- slips ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "near"),
    [
        ("slove curl_4_3", "solve"),
        ("solve curl_4_3 --ste strip.gamma=3", "--set"),
        ("solve curl_4_3 --quite", "--quiet"),
        ("limits curl_4_3 --clamp egde", "edge"),
        ("limits curl_4_3 --vari strip.gamma=1,2", "--vary"),
        ("solve curl_4_3 --set strip.gama=3", "strip.gamma"),
        ("solve curl_4_3 --set model.energy=wunderlch", "wunderlich"),
        ("solve curl_43", "curl_4_3"),
        ("scenes curl_43", "curl_4_3"),
        ("keys strip.yung", "strip.young"),
        ("sweep cantilever_45", "cantilever_4_5"),
    ],
)
def test_a_slip_is_one_line_that_names_what_is_near(words, near, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, out, err = run(capsys, *shlex.split(words))
    assert code == BAD_INPUT
    assert out == ""
    assert err.count("\n") == 1
    assert re.search(rf"(?<![\w.-]){re.escape(near)}(?!\w)", err.partition(";")[2] or err), err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("words", ["solve", "solve a b", "solve a --set", "check a --distance far", "--nothing"])
def test_what_cannot_be_parsed_is_one_line(words, capsys):
    code, out, err = run(capsys, *words.split())
    assert (code, out, err.count("\n")) == (BAD_INPUT, "", 1)
    assert "usage:" not in err


@pytest.mark.parametrize(
    ("line", "near"),
    [("length = 30 cm", "length = 30 cm"), ("length = 0,3", "length = 0,3"), ("youngs_modulus = 2e11", "strip.young?")],
)
def test_a_slip_in_a_file_shows_the_line_or_the_key(line, near, capsys, tmp_path):
    (tmp_path / "my.toml").write_text(f"[strip]\n{line}  # what I mean\nwidth = 0.01\n")
    code, _, err = run(capsys, "solve", tmp_path / "my.toml")
    assert (code, err.count("\n")) == (BAD_INPUT, 1)
    assert near in err


def test_a_file_that_is_not_there_names_its_neighbours(capsys, tmp_path):
    (tmp_path / "tape_spring.toml").write_text("")
    code, _, err = run(capsys, "solve", tmp_path / "tapespring.toml")
    assert code == BAD_INPUT
    assert str(tmp_path / "tape_spring.toml") in err
    code, _, err = run(capsys, "export", tmp_path / "tapespring.toml")
    assert code == BAD_INPUT
    assert str(tmp_path / "tape_spring.toml") in err


def test_as_a_module():
    done = subprocess.run(
        [sys.executable, "-m", "ribbonbench", "--version"], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (DONE, "")
    assert done.stdout.startswith("ribbonbench ")


# -- the standard input -----------------------------------------------------------------------------------------------


@pytest.fixture
def pipe(monkeypatch):
    """Puts a text into the standard input."""

    def fill(text):
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(text.encode()), encoding="utf-8"))

    return fill


def test_a_scene_from_a_pipe_and_the_line_that_makes_it_again(capsys, pipe, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = load("coil_10_100").to_toml()
    pipe(text)
    assert run(capsys, "solve", "-", "--set", "strip.gamma=50", "--out", "o", "--quiet")[0] == DONE
    first = json.loads((tmp_path / "o" / "result.json").read_text())
    again = json.loads((tmp_path / "o" / "page.json").read_text())["again"]
    typed, file = again.split(" < ")
    assert (tmp_path / file).read_text() == text
    pipe((tmp_path / file).read_text())
    assert run(capsys, *shlex.split(typed)[1:])[0] == DONE
    second = json.loads((tmp_path / "o" / "result.json").read_text())
    assert second["end"] == first["end"]
    assert second["provenance"]["scene_hash"] == first["provenance"]["scene_hash"]


@pytest.mark.parametrize("command", [["explain", "-", "--no-run"], ["limits", "-", "--quick", "--out", "o"]])
def test_other_commands_read_it_too(command, capsys, pipe, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    pipe(shipped()["curl_4_3"].read_text())
    assert run(capsys, *command)[0] == DONE


@pytest.mark.parametrize("text", ["", "  \n", "[strip", "\0"])
def test_a_pipe_without_a_scene(text, capsys, pipe):
    pipe(text)
    code, _, err = run(capsys, "solve", "-")
    assert (code, err.count("\n")) == (BAD_INPUT, 1)


@pytest.mark.parametrize(
    ("title", "name"),
    [
        ("Möbius: a test", "mobius_a_test"),
        ("", "stdin"),
        ("日本", "stdin"),
        ("x" * 200, "x" * 40),
        ("../../etc", "etc"),
    ],
)
def test_the_name_of_a_scene_without_a_file(title, name):
    assert name_of("<stdin>", title) == name
    assert name_of("some/my.toml", title) == "my"


# -- scenes NAME ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["curl_4_3", "daisy_5g", "moebius_6_1"])
def test_a_shipped_scene_is_printed_as_it_is(name, capsys):
    code, out, err = run(capsys, "scenes", name)
    assert (code, err) == (DONE, "")
    assert out == shipped()[name].read_text()
    assert loads(out, f"{name}.toml") == loads(shipped()[name].read_text(), f"{name}.toml")


# -- keys -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("pattern", "found"),
    [
        (None, set(KEYS)),
        ("strip.young", {"strip.young"}),
        ("Strip.YOUNG", {"strip.young"}),
        ("tip.*", {"tip.mass", "tip.load", "tip.force", "tip.tension", "tip.moment"}),
        ("[tip]", {"tip.mass", "tip.load", "tip.force", "tip.tension", "tip.moment"}),
        ("tang", {"clamp.start.tangent", "clamp.end.tangent"}),
        ("you?g", {name for name in KEYS if name.endswith("young")}),
        ("second moment of area", {"strip.second_moment"}),
    ],
)
def test_what_a_pattern_means(pattern, found):
    names, exactly = matching(pattern)
    assert exactly
    assert set(names) == found


def test_a_key_is_told_in_full(capsys):
    told = dict(described("strip.young"))
    assert set(told) == {"meaning", "kind", "range", "unit", "default", "example", "on a command line", "read by"}
    assert told["unit"] == "Pa"
    assert {"ribbon", "shell"} <= set(told["read by"].split(", "))
    assert described("strip.second_moment")[-1] == ("read by", "elastica, curve_angle, antman")
    code, out, _ = run(capsys, "keys", "strip.young")
    assert code == DONE
    assert "1.8e9" in out


@pytest.mark.parametrize("name", [name for name in KEYS if name.partition(".")[0] not in (*LISTED, "path")])
def test_the_example_of_a_key_can_be_read(name):
    """As the line for --set gives it."""
    from compare.scene.scene import parse_assignment

    line = dict(described(name))["on a command line"]
    _, assignment = shlex.split(line)
    assert parse_assignment(assignment)[0] == name


@pytest.mark.parametrize("width", [60, 80, 120])
def test_the_table_fits(width, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", str(width))
    code, out, _ = run(capsys, "keys")
    assert code == DONE
    assert max(map(len, out.splitlines())) <= width
    assert len(table_of(list(KEYS)).columns) <= 6
    for name in KEYS:
        assert name in out
