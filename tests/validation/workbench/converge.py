"""Convergence as h/w falls: slopes with intervals, limits, and the ribbon's place in them."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from compare.models.base import Options
from compare.models.choice import beside_the_shell
from compare.page.markdown import as_markdown
from compare.pages import converge as convergence_write
from compare.scene.scene import load
from compare.store.progress import Reporter
from compare.store.store import CaseStore
from compare.studies import converge_run as convergence_run
from tests.validation import one_core, page
from tests.validation.number import Number

#: It takes no times that its page rests on.
ALONE = False

#: What the ribbons of the two curls have, computed again by `make test`.
PROBED = (0, 1)
RATIOS = (10.0, 20.0, 50.0, 100.0, 200.0, 400.0)
#: Title, scene, keys replaced, rulings of the ribbon at the clamp ("": the scene's own).
STUDIES: tuple[tuple[str, str, Mapping[str, Any], tuple[str, ...]], ...] = (
    ("Curl of 4.3, K = 10", "curl_4_3", {}, ("straight", "free")),
    ("Curl of 4.3, K = -10", "curl_4_3_down", {}, ()),
    ("Flat cantilever, nu = 0", "cantilever", {"strip.poisson": 0.0}, ()),
    ("Flat cantilever, nu = 0.3", "cantilever", {"strip.poisson": 0.3}, ()),
)


def total(study: int, finer: int = 1) -> float:
    """Total energy (D w / l) of the ribbon beside a study's shells, on `finer` times the scene's elements."""
    scene = load(STUDIES[study][1])
    scene = scene.replace({**STUDIES[study][2], "model.elements": finer * scene.model.elements})
    return float(beside_the_shell(scene).solve(scene, options=Options()).energy.total)


PROBES = {f"ribbon_total_{k + 1}": lambda k=k: total(k) for k in PROBED}


def _numbers(study: int, found: Sequence[convergence_run.Study]) -> dict[str, Number]:
    """Slopes and what is left at h/w = 0 with half their 95 % intervals."""
    numbers = {}
    for one in found:
        name = f"{study + 1}_{one.ruling}" if one.ruling else f"{study + 1}"
        fitted = {"slope": one.slope, "left": None if one.limit is None else one.limit.d0}
        for kind, fit in fitted.items():
            if fit is not None:
                low, high = fit.both
                error = max(high - fit.value, fit.value - low)
                numbers[f"{kind}_{name}"] = Number(fit.value, error, "" if kind == "slope" else "l", ".3g")
                for word, value in (("low", low), ("high", high)):
                    numbers[f"{kind}_{name}_{word}"] = Number(value, None, why="an end of the interval")
    return numbers


def studied(
    number: int, ratios: tuple[float, ...], elements: tuple[int, int] | None, folder: str, picture: str
) -> tuple[tuple[str, ...], dict[str, Number]]:
    """Parts of the page for one study, and its picture; its numbers."""
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
    return tuple(parts), _numbers(number, found)


def run(
    out: Path,
    ratios: tuple[float, ...] = RATIOS,
    elements: tuple[int, int] | None = None,
    numbers: tuple[int, ...] = tuple(range(len(STUDIES))),
) -> dict[str, Number]:
    """Writes converge.md and converge_N.png; elements: of the shells, by default the scenes'."""
    parts: list[str] = []
    values = {f"ribbon_total_{k + 1}": Number(total(k), abs(total(k) - total(k, 2)), "D w / l", ".6g") for k in PROBED}
    with tempfile.TemporaryDirectory() as folder:
        for number in numbers:
            picture = out / f"converge_{number + 1}.png"
            more, found = one_core.call(studied, number, ratios, elements, folder, str(picture))
            parts += more
            values |= found
    page.write(
        out / "converge.md", "Convergence as h/w falls", "python -m tests.validation converge",
        "As `ribbonbench converge SCENE`: three numbers in every row; rows whose distance is not above both errors "
        "take no part. How the intervals are made: docs/commands/converge.md.",
        *parts,
    )  # fmt: skip
    return values
