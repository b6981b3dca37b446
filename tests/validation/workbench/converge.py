"""Convergence as h/w falls: slopes with intervals, limits, and the ribbon's place in them."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from compare.page.markdown import as_markdown
from compare.pages import converge as convergence_write
from compare.scene.scene import load
from compare.store.progress import Reporter
from compare.store.store import CaseStore
from compare.studies import converge_run as convergence_run
from tests.validation import one_core, page

RATIOS = (10.0, 20.0, 50.0, 100.0, 200.0, 400.0)
#: Title, scene, keys replaced, rulings of the ribbon at the clamp ("": the scene's own).
STUDIES: tuple[tuple[str, str, Mapping[str, Any], tuple[str, ...]], ...] = (
    ("Curl of 4.3, K = 10", "curl_4_3", {}, ("straight", "free")),
    ("Curl of 4.3, K = -10", "curl_4_3_down", {}, ()),
    ("Flat cantilever, nu = 0", "cantilever", {"strip.poisson": 0.0}, ()),
    ("Flat cantilever, nu = 0.3", "cantilever", {"strip.poisson": 0.3}, ()),
)


def studied(
    number: int, ratios: tuple[float, ...], elements: tuple[int, int] | None, folder: str, picture: str
) -> tuple[str, ...]:
    """Parts of the page for one study, and its picture."""
    title, name, keys, rulings = STUDIES[number]
    scene = convergence_run.prepared(load(name).replace(dict(keys)) if keys else load(name), ratios, elements)
    found = convergence_run.studies(scene, rulings, CaseStore(Path(folder)), Reporter(quiet=True))
    if not all(one.comparison.ok for one in found):
        raise AssertionError(f"{title}: a solve did not converge to a stable state")
    convergence_write.picture(Path(picture), found)
    parts = [f"## {title}", "\n".join(f"- {text}" for text in convergence_write.sentences(found))]
    parts.append(f"![{title}: distance against h/w]({Path(picture).name})")
    for one in found:
        for table in (
            convergence_write.row_table(one, len(found) > 1),
            convergence_write.scalar_table(one, len(found) > 1),
        ):
            if table.rows:
                parts += [f"**{table.title}**", as_markdown(table)]
    return tuple(parts)


def run(
    out: Path,
    ratios: tuple[float, ...] = RATIOS,
    elements: tuple[int, int] | None = None,
    numbers: tuple[int, ...] = tuple(range(len(STUDIES))),
) -> None:
    """Writes converge.md and converge_N.png; elements: of the shells, by default the scenes'."""
    parts: list[str] = []
    with tempfile.TemporaryDirectory() as folder:
        for number in numbers:
            picture = out / f"converge_{number + 1}.png"
            parts += one_core.call(studied, number, ratios, elements, folder, str(picture))
    page.write(
        out / "converge.md", "Convergence as h/w falls", "python -m tests.validation converge",
        "As `ribbonbench converge SCENE`: three numbers in every row; rows whose distance is not above both errors "
        "take no part. How the intervals are made: docs/commands/converge.md.",
        *parts,
    )  # fmt: skip
