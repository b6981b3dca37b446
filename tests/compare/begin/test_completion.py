"""The completion script of bash, run by bash: what it offers for lines as one types them."""

from __future__ import annotations

import shutil
import subprocess

import pytest

from compare import commands
from compare.commands.parser import commands_of, options_of
from compare.commands.parser import whole as _parser
from compare.scene.begin.completion import entries, script, values_of
from compare.scene.keys import KEYS
from compare.scene.scene import shipped

_ASK = """
ask() {
    COMP_LINE="$1"; COMP_POINT=${#COMP_LINE}; COMPREPLY=()
    _ribbonbench 2>/dev/null
    printf '%s\\n' "${COMPREPLY[*]}"
}
"""


@pytest.fixture(scope="module")
def offered(tmp_path_factory):
    """Asks bash for the completions of a line."""
    bash = shutil.which("bash")
    assert bash
    folder = tmp_path_factory.mktemp("completion")
    (folder / "mine.toml").write_text("")
    (folder / "mine.txt").write_text("")
    (folder / "minor").mkdir()
    text = script("bash", _parser(), list(shipped()), KEYS)
    (folder / "script.bash").write_text(text + _ASK)

    def ask(line):
        done = subprocess.run(
            [bash, "--norc", "-c", 'source ./script.bash; ask "$1"', "ask", line],
            cwd=folder, capture_output=True, text=True, check=True,
        )  # fmt: skip
        assert done.stderr == ""
        return set(done.stdout.split())

    return ask


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("ribbonbench ", set(commands.NAMES)),
        ("ribbonbench so", {"solve"}),
        ("ribbonbench solve curl_4_3", {"curl_4_3", "curl_4_3_down"}),
        ("ribbonbench scenes daisy_5", {"daisy_5g"}),
        ("ribbonbench solve min", {"mine.toml", "minor"}),
        ("ribbonbench report min", {"minor"}),
        ("ribbonbench solve x --lea", {"--leave-saddle"}),
        ("ribbonbench solve x --set strip.yo", {"strip.young="}),
        ("ribbonbench solve x --set model.energy=wund", {"wunderlich"}),
        ("ribbonbench sweep x --vary strip.gam", {"strip.gamma="}),
        ("ribbonbench limits x --clamp e", {"edge"}),
        ("ribbonbench solve x --units ", {"auto", "si", "l"}),
        ("ribbonbench solve x --out min", {"minor"}),
        ("ribbonbench completion f", {"fish"}),
        ("ribbonbench solve nothing_of_this_name", set()),
    ],
)
def test_what_bash_offers(offered, line, words):
    assert offered(line) == words


@pytest.mark.parametrize("name", commands.NAMES)
def test_every_option_of_every_command_is_offered(offered, name):
    known = {o for a in options_of(commands_of(_parser())[name]) for o in a.option_strings if o.startswith("--")}
    assert offered(f"ribbonbench {name} --") == known | {"--help"}


def test_other_shells_know_the_same_words():
    """zsh runs the function of bash; fish has a line for each option and each command's scenes."""
    parser = _parser()
    bash, zsh, fish = (script(shell, parser, list(shipped()), KEYS) for shell in ("bash", "zsh", "fish"))
    assert zsh.endswith(bash)
    lines = fish.splitlines()
    options = sum(e.words.count(o) for e in entries(parser, []) if e.command and not e.option for o in e.words
                  if o.startswith("--"))  # fmt: skip
    assert sum(" -l " in line for line in lines) == options
    assert all(line.startswith(("complete -c ribbonbench", "set -g __ribbonbench", "#")) for line in lines)


def test_the_words_of_a_key_are_read():
    """Every word offered behind KEY= is one that the key takes."""
    from compare.scene.scene import parse_assignment

    for key, words in values_of(KEYS).items():
        for word in words:
            assert parse_assignment(f"{key}={word}")[0] == key
