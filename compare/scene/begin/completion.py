"""Completion scripts for shells, from the command line's own parser: all words stand in the script, nothing is asked of
Python while one types.

Every shell gets the same table: for a command and the option before the word, the words that may stand there. Words
that are files of the user are left to the shell. zsh runs bash's function.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from compare.scene.declare import Key
from compare.scene.keys import LISTED

#: Options and positionals (by what their help calls them) whose words are those of `Words`.
_KEYED = ("KEY=VALUE", "KEY=VALUES")
_SCENES = ("SCENE", "WHAT", "SOURCE", "SWEEP", "NAME")
_FOLDERS = ("FOLDER",)


@dataclass(frozen=True)
class Entry:
    """What may stand behind `option` of a command (behind the command itself: option "").

    words: complete ones; keys: also KEY=; files: also files of the user, folders: folders alone.
    """

    command: str
    option: str
    words: tuple[str, ...] = ()
    keys: bool = False
    files: bool = False
    folders: bool = False


def entries(parser: argparse.ArgumentParser, scenes: Sequence[str]) -> Iterator[Entry]:
    """All that can be completed: commands, options, choices, scenes."""
    commands = _commands(parser)
    yield Entry("", "", (*commands, *_options(parser)))
    for name, command in commands.items():
        words: list[str] = _options(command)
        files = folders = False
        for action in _shown(command):
            entry = _of(name, action, scenes)
            if action.option_strings:
                if action.nargs != 0:
                    yield from (Entry(name, o, entry.words, entry.keys, entry.files, entry.folders)
                                for o in action.option_strings)  # fmt: skip
            else:
                words += entry.words
                files, folders = files or entry.files, folders or entry.folders
        yield Entry(name, "", tuple(words), files=files, folders=folders)


def _of(command: str, action: argparse.Action, scenes: Sequence[str]) -> Entry:
    """What an option or a positional takes, by its choices or by what its help calls it."""
    called = action.metavar if isinstance(action.metavar, str) else ""
    option = action.option_strings[0] if action.option_strings else ""
    if action.choices is not None:
        return Entry(command, option, tuple(map(str, action.choices)))
    if called in _KEYED:
        return Entry(command, option, keys=True)
    if called in _FOLDERS:
        return Entry(command, option, folders=True)
    if called in _SCENES and not option:
        return Entry(command, option, tuple(scenes), files=called != "NAME")
    return Entry(command, option, files=not option and called == "FILE")


def _commands(parser: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    return next((dict(a.choices) for a in parser._actions if isinstance(a, argparse._SubParsersAction)), {})


def _shown(parser: argparse.ArgumentParser) -> list[argparse.Action]:
    return [action for action in parser._actions if action.help != argparse.SUPPRESS]


def _options(parser: argparse.ArgumentParser) -> list[str]:
    return [option for action in _shown(parser) for option in action.option_strings if option.startswith("--")]


def values_of(keys: Mapping[str, Key]) -> dict[str, tuple[str, ...]]:
    """Key -> the words that may stand behind it, for --set; keys of walls and paths have no name of their own."""
    found = {}
    for name, about in keys.items():
        if name.partition(".")[0] not in (*LISTED, "path"):
            truth = ("true", "false") if about.kind.value == "true or false" else ()
            found[name] = (*about.choices, *about.words, *truth)
    return found


def script(shell: str, parser: argparse.ArgumentParser, scenes: Sequence[str], keys: Mapping[str, Key]) -> str:
    """The script for "bash", "zsh" or "fish"."""
    table, values = list(entries(parser, scenes)), values_of(keys)
    if shell == "fish":
        return _fish(table, values)
    body = _bash(table, values)
    return body if shell == "bash" else _ZSH + body


_ZSH = """#compdef ribbonbench
autoload -U +X compinit && compinit -u
autoload -U +X bashcompinit && bashcompinit
"""

_BASH = """# ribbonbench: completion for bash, made by `ribbonbench completion bash`. Load it with
#   source <(ribbonbench completion bash)
_ribbonbench() {{
    local line="${{COMP_LINE:0:$COMP_POINT}}" cur prev cmd="" word key keys="" words="" files="" folders="" kept=""
    # the words as typed: bash takes = for the end of one, which KEY=VALUE is not
    local -a typed
    set -f
    typed=($line)
    set +f
    case "$line" in *[[:space:]]) typed+=("");; esac
    cur="${{typed[-1]}}"
    prev="${{typed[-2]:-}}"
    for word in "${{typed[@]:1:${{#typed[@]}}-2}}"; do
        case "$word" in -*) ;; *) cmd="$word"; break ;; esac
    done
    case "$cmd $prev" in
{options}
    *) case "$cmd" in
{commands}
       esac ;;
    esac
    if [ -n "$keys" ]; then
        case "$cur" in
        *=*)
            key="${{cur%%=*}}"
            case "$key" in
{values}
            esac
            cur="${{cur#*=}}"
            COMPREPLY=( $(compgen -W "$words" -- "$cur") )
            return ;;
        *)
            words="{keys}"
            compopt -o nospace 2>/dev/null ;;
        esac
    fi
    case "$cur" in
    -*) ;;
    *)  # options only where one is begun
        for word in $words; do case "$word" in -*) ;; *) kept="$kept $word" ;; esac; done
        words="$kept" ;;
    esac
    COMPREPLY=( $(compgen -W "$words" -- "$cur") )
    if [ -n "$files" ]; then COMPREPLY+=( $(compgen -f -X '!*.toml' -- "$cur") $(compgen -d -- "$cur") ); fi
    if [ -n "$folders" ]; then COMPREPLY+=( $(compgen -d -- "$cur") ); fi
}}
complete -o filenames -F _ribbonbench ribbonbench
"""


def _bash(table: Sequence[Entry], values: Mapping[str, Sequence[str]]) -> str:
    def sets(entry: Entry) -> str:
        marks = [f'words="{" ".join(entry.words)}"']
        marks += [f"{name}=1" for name in ("keys", "files", "folders") if getattr(entry, name)]
        return "; ".join(marks)

    behind = [e for e in table if e.option and (e.words or e.keys or e.files or e.folders)]
    return _BASH.format(
        options="\n".join(f'    "{e.command} {e.option}") {sets(e)} ;;' for e in behind),
        commands="\n".join(f'       "{e.command}") {sets(e)} ;;' for e in table if not e.option),
        values="\n".join(f'            {key}) words="{" ".join(v)}" ;;' for key, v in values.items() if v),
        keys=" ".join(f"{key}=" for key in values),
    )


def _fish(table: Sequence[Entry], values: Mapping[str, Sequence[str]]) -> str:
    """One line for each entry: fish asks a condition, then offers the words."""
    first, *rest = [e for e in table if not e.option]
    commands = [word for word in first.words if not word.startswith("-")]
    assigned = " ".join(f"{key}={word}" for key, words in values.items() for word in (words or ("",)))
    lines = [
        "# ribbonbench: completion for fish, made by `ribbonbench completion fish`. Load it with",
        "#   ribbonbench completion fish | source",
        "complete -c ribbonbench -f",
        f"set -g __ribbonbench_commands {' '.join(commands)}",
        f"set -g __ribbonbench_keys {assigned}",
    ]
    none = "not __fish_seen_subcommand_from $__ribbonbench_commands"
    lines.append(f"complete -c ribbonbench -n '{none}' -a '{' '.join(commands)}'")
    for entry in rest:
        seen = f"__fish_seen_subcommand_from {entry.command}"
        behind = {e.option: e for e in table if e.command == entry.command and e.option}
        plain = [word for word in entry.words if not word.startswith("-")]
        if plain or entry.files or entry.folders:
            files = " -F" if entry.files or entry.folders else ""
            lines.append(f"complete -c ribbonbench -n '{seen}'{files} -a '{' '.join(plain)}'")
        for option in entry.words:
            if option.startswith("--"):
                lines.append(f"complete -c ribbonbench -n '{seen}' -l {option[2:]}{_takes(behind.get(option))}")
    return "\n".join(lines) + "\n"


def _takes(entry: Entry | None) -> str:
    """What an option of fish takes."""
    if entry is None:
        return ""
    if entry.keys:
        return " -x -a '$__ribbonbench_keys'"
    if entry.folders:
        return " -x -a '(__fish_complete_directories)'"
    return f" -x -a '{' '.join(entry.words)}'" if entry.words else " -r"
