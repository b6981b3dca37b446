"""`ribbonbench keys`: what a scene can say."""

from __future__ import annotations

import argparse

from rich.console import Console

from compare.commands import common
from ribbonbench.errors import BadInput

HELP = "the keys of a scene, with unit, range, default and meaning"
EXAMPLE = "ribbonbench keys clamp"

#: So many keys at most are told in full, each in a table of its own.
_IN_FULL = 2


def register(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument(
        "pattern", metavar="PATTERN", nargs="?", default=None,
        help="a key, a part of its name or meaning, or with * and ?: strip.young, clamp, 'shell.*' (default: all)",
    )  # fmt: skip
    common.wide_argument(parser)
    common.json_argument(parser)


def run(options: argparse.Namespace, console: Console) -> int:
    """Tells."""
    from compare.page.terminal import print_pairs, print_table
    from compare.pages.keys import described, matching, table_of

    names, exactly = matching(options.pattern)
    if not names:
        raise BadInput("PATTERN", options.pattern, "is in no key", "ribbonbench keys shows all")
    if not exactly:
        raise BadInput("PATTERN", options.pattern, "is in no key", f"did you mean {' or '.join(names)}?")
    options.result = table_of(names).records()
    if options.json:
        return common.DONE
    if len(names) <= _IN_FULL:
        for name in names:
            print_pairs(console, name, described(name))
    else:
        print_table(console, table_of(names), wide=options.wide)
    return common.DONE
