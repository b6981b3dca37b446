"""Options of all commands side by side: one name is one thing; help and an example everywhere; lists in any way."""

from __future__ import annotations

import shlex
from collections import defaultdict

import pytest

from compare import commands
from compare.commands.lists import ListOf, joined
from compare.commands.parser import commands_of, options_of
from compare.commands.parser import whole as _parser

COMMANDS = commands_of(_parser())

#: Options that are said of something else in some commands, each with why.
EXCEPTIONS = {
    "--distance": "a threshold in percent (limits), a claim as a part of the length (check)",
    "--errors": "measure them (sweep), of which points (branches)",
    "--share": "as --distance",
    "--to": "the last value of a number (branches), the program that a scene is written for (export)",
    "--width-to-thickness": "of the one shell whose cost is measured (cost)",
}
#: Parts of the help that a command adds of its own: where the default folder is, which scene is changed.
OWN_HELP = {
    "--all",
    "--out",
    "--set",
    "--width-to-thickness",
    "--elements",
    "--fresh",
    "--vary",
    "--quiet",
    "--json",
} | set(EXCEPTIONS)


def _kind(action):
    values = action.type
    return (type(action).__name__, (values.kind, values.count) if isinstance(values, ListOf) else values, action.nargs)


def test_one_name_is_one_thing():
    said = defaultdict(set)
    for name, parser in COMMANDS.items():
        for action in options_of(parser):
            for option in action.option_strings:
                said[option].add((action.metavar, _kind(action), None if option in OWN_HELP else action.help))
        assert name in commands.NAMES
    different = {option for option, found in said.items() if len(found) > 1}
    assert different - set(EXCEPTIONS) == set()
    assert set(EXCEPTIONS) <= different | {"--share"}


@pytest.mark.parametrize("name", commands.NAMES)
def test_every_option_has_help_and_the_example_parses(name):
    for action in options_of(COMMANDS[name]):
        assert action.help, action.option_strings or action.dest
        if action.option_strings and action.nargs != 0 and action.choices is None:
            assert action.metavar, action.option_strings
    words = shlex.split(commands.module(name).EXAMPLE)
    assert words[:2] == ["ribbonbench", name]
    assert _parser().parse_args(words[1:]).command == name
    assert commands.module(name).EXAMPLE in " ".join(COMMANDS[name].format_help().split())


@pytest.mark.parametrize("said", [["20,50"], ["20", "50"], ["[20, 50]"], ["[20,", "50]"], ["20, 50"], ["2e1", "50.0"]])
@pytest.mark.parametrize("name", ["shell", "converge", "check", "limits"])
def test_a_list_is_said_in_any_way(name, said):
    options = _parser().parse_args([name, "--width-to-thickness", *said, "curl_4_3"])
    assert options.width_to_thickness == [20.0, 50.0]
    assert options.scene == "curl_4_3"


@pytest.mark.parametrize("said", [["100", "8"], ["100,8"], ["[100, 8]"], ["100x8"]])
def test_a_mesh(said):
    assert _parser().parse_args(["shell", "curl_4_3", "--elements", *said]).elements == [100, 8]


def test_slopes_may_be_negative():
    assert _parser().parse_args(["check", "x", "--slope", "-1.5", "2"]).slope == [-1.5, 2.0]


@pytest.mark.parametrize(
    "words", [["--elements", "100"], ["--elements", "a,b"], ["--elements", "1,2,3"], ["--width-to-thickness", "[]"]]
)
def test_what_is_no_such_list_is_refused(words, capsys):
    with pytest.raises(SystemExit) as stop:
        _parser().parse_args(["shell", "curl_4_3", *words])
    assert stop.value.code == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert words[0] in err


def test_words_behind_a_list_that_are_no_values_stay():
    assert joined(["--a", "1", "2", "x", "3"], ["--a"]) == ["--a=1,2", "x", "3"]
    assert joined(["--b", "1", "2"], ["--a"]) == ["--b", "1", "2"]
    assert joined(["--", "--a", "1", "2"], ["--a"]) == ["--", "--a", "1", "2"]
