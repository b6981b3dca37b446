"""The parser of the command line: what cannot be parsed is one line on stderr with the nearest option, exit code 2."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from difflib import get_close_matches
from typing import Any, NoReturn

from compare import commands
from compare.commands.lists import ListOf, joined
from ribbonbench.errors import BadInput


class Parser(argparse.ArgumentParser):
    """argparse's parser with errors of one line that name what is near; parsers of commands are of this class too."""

    def error(self, message: str) -> NoReturn:
        """One line on stderr, and exit code 2."""
        where = message.removeprefix("argument ")
        hint = "" if ";" in where else f"; {self.prog} --help shows how"
        print(f"ribbonbench: {where}{hint}", file=sys.stderr)
        raise SystemExit(BadInput.exit_code)

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        """argparse's hook for choices."""
        if action.choices is None or value in action.choices:
            return
        named = action.option_strings[0] if action.option_strings else str(action.metavar or action.dest)
        known = list(map(str, action.choices))
        close = get_close_matches(str(value), known, n=2, cutoff=0.6)
        hint = f"did you mean {' or '.join(close)}?" if close else f"choose from {', '.join(known)}"
        self.error(str(BadInput(named, value, "is not known", hint)))

    def parse_known_args(  # type: ignore[override]
        self, args: Sequence[str] | None = None, namespace: Any = None
    ) -> tuple[Any, list[str]]:
        """As argparse's; the values of a list may stand in several words."""
        lists = [o for action in self._actions if isinstance(action.type, ListOf) for o in action.option_strings]
        return super().parse_known_args(joined(sys.argv[1:] if args is None else args, lists), namespace)

    def parse_args(  # type: ignore[override]
        self, args: Sequence[str] | None = None, namespace: Any = None
    ) -> Any:
        """As argparse's; what no option takes is named with the nearest option."""
        options, left = self.parse_known_args(args, namespace)
        if left:
            chosen = commands_of(self).get(getattr(options, "command", None) or "", self)
            chosen.error(_not_taken(chosen, left))
        return options


def whole() -> Parser:
    """The parser with all commands."""
    parser = Parser(
        prog="ribbonbench",
        description="Thin elastic ribbons cross-validated: curvature-element ribbon, Naghdi shell, planar elastica.",
        epilog="Exit codes: 0 done, 1 computed but not converged or not stable, 2 bad input, 3 something missing.",
    )
    parser.add_argument("--version", action="store_true", help="print the version and stop")
    found = parser.add_subparsers(dest="command", metavar="COMMAND")
    for name in commands.NAMES:
        command = commands.module(name)
        command.register(
            found.add_parser(name, help=command.HELP, description=command.HELP, epilog=f"Example: {command.EXAMPLE}")
        )
    return parser


def commands_of(parser: argparse.ArgumentParser) -> dict[str, Parser]:
    """Name -> parser of each command."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            return dict(action.choices)
    return {}


def options_of(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    """Options and positionals that a user is told of, --help left out."""
    for action in parser._actions:
        if action.help != argparse.SUPPRESS and not isinstance(
            action, argparse._HelpAction | argparse._SubParsersAction
        ):
            yield action


def _not_taken(parser: argparse.ArgumentParser, left: Sequence[str]) -> str:
    """What to say of words that no option takes."""
    first = next((word for word in left if word.startswith("--")), left[0])
    name = first.partition("=")[0]
    known = [option for action in options_of(parser) for option in action.option_strings]
    if not name.startswith("-"):
        takes = ", ".join(str(a.metavar or a.dest) for a in options_of(parser) if not a.option_strings)
        return f"{first!r} is one word too many; {parser.prog} takes {takes or 'no word'}"
    close = get_close_matches(name, known, n=2, cutoff=0.6)
    hint = f"did you mean {' or '.join(close)}?" if close else f"{parser.prog} --help lists them"
    return f"{name} is no option of {parser.prog}; {hint}"
