"""The promise of `limits --quick` on two hundred scenes more, drawn when it had been mended with the first in view.

The hundred of `unseen` were drawn after every constant; but what a strip may stretch where its curvature passes zero,
and where a shell begins a second time, were built with them in view. These were drawn afterwards, by the same
generator, and are asked in the same way; row by row is kept, and the page says how many were run.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from tests.validation import page
from tests.validation.number import Number
from tests.validation.workbench import unseen
from tests.validation.workbench.drawn import AGAIN_ARCHES, AGAIN_HELD, AGAIN_SEED, AGAIN_TURNED, unseen_again

COMMAND = "python -m tests.validation unseen_again"
PROBED = ("held_002", "held_003")
PROBES = {f"estimate_{name}": partial(unseen.estimated, name, unseen_again) for name in PROBED}


#: No scene is begun when a run has taken so long (s): the next goes on with the rest.
SECONDS = 600.0


def run(out: Path, most: int | None = None) -> dict[str, Number]:
    """Writes unseen_again.md; its numbers by name. most: scenes to run, all by default."""
    rows = unseen.measured(out, "unseen_again", unseen_again, most, SECONDS)
    write(out, rows)
    drawn = {"drawn": Number(len(unseen_again()), 0, shown="d")}
    return unseen.numbers(rows, PROBED) | drawn


def write(out: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """The page."""
    page.write(
        out / "unseen_again.md",
        "The estimate on two hundred scenes more, drawn when it had been mended",
        COMMAND,
        f"Drawn once (seed {AGAIN_SEED}), after the mends that were made with the [first hundred](unseen.md) in view: "
        f"pose, width, w/h from 15 to 400, nu, K, Gamma; {AGAIN_HELD} held at one end, {AGAIN_ARCHES} arches, "
        f"{AGAIN_TURNED} between clamps that are shifted, turned and leaning. (One of them, turned_009, was looked at "
        "while the rule for passages of zero curvature was made.) Asked as those. Of "
        f"{len(unseen_again())} drawn {len(rows)} were run so far, in this order; none of these is left out.",
        f"Falsely safe: {unseen.named(rows, unseen.FALSELY_SAFE)}. Too bold: {unseen.named(rows, unseen.BOLD)}. "
        "Scenes without a shell to compare with: it rests in another state than the ribbon, as the answer then says, "
        "or its share is not known.",
        *unseen.tables(rows),
    )
