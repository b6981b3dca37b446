"""What accuracy costs: error against time of ribbon, elastica and shell, for the curl of 4.3 and a flat cantilever."""

from __future__ import annotations

import re
import statistics
import tempfile
from pathlib import Path

from compare.models import solve
from compare.models.base import Size
from compare.models.scope import require_shell
from compare.page.markdown import as_markdown
from compare.pages import cost as cost_write
from compare.scene.scene import load
from compare.store.progress import Reporter
from compare.studies.cost import measure
from compare.studies.cost_plan import Cost, Plan
from tests.validation import one_core, page
from tests.validation.number import Number

SCENES = ("curl_4_3", "cantilever")
BUDGET = 400.0


#: Segments of the ribbons whose energies `make test` computes again.
PROBED = (20, 40)


def energy(segments: int) -> float:
    """Total energy (D w / l) of the first scene's ribbon on so many segments, as its ladder has it."""
    return float(solve(load(SCENES[0]), "ribbon", size=Size("chained", (float(segments),))).energy.total)


PROBES = {f"energy_{count}": lambda count=count: energy(count) for count in PROBED}


def _numbers(name: str, found: Cost) -> dict[str, Number]:
    """Errors of the references, and of every run with its reference's; times."""
    own = {reference.model: reference.error for reference in found.references}
    numbers = {f"reference_{name}_{model}": Number(e, e, "l", ".1e") for model, e in own.items() if e is not None}
    for row in found.rows:
        at = re.sub(r"[^a-z0-9]+", "_", f"{name} {row.label}".lower()).strip("_")
        if row.error is not None and row.shown:
            numbers[f"error_{at}"] = Number(row.error, own[row.model], "l", ".1e")
        if row.run.seconds:
            warm = 1e3 * statistics.median(row.run.seconds)
            numbers[f"ms_{at}"] = Number(warm, None, "ms", ".3g", "wall times of one run")
    return numbers | _reached(name, found)


def _reached(name: str, found: Cost) -> dict[str, Number]:
    """What reaching each error of the discretisation takes by party, and over the ribbon; how far the ribbon stays from
    the common reference."""
    numbers: dict[str, Number] = {}
    for kind, target, party, seconds, _, _, best in cost_write.reach_table(found).rows:
        word = "_".join(re.findall(r"[a-z0-9]+", f"{name} {party}".lower()))
        own = kind.startswith("discretisation")
        if own and seconds:
            at = f"{word}_{target:.0e}".replace("-0", "")
            numbers[f"reach_{at}"] = Number(1e3 * seconds, None, "ms", ".3g", "wall times of one run")
            ribbon = numbers.get(f"reach_{name}_ribbon_{target:.0e}".replace("-0", ""))
            if ribbon is not None and party != "ribbon":
                factor = 1e3 * seconds / ribbon.value
                numbers[f"factor_{at}"] = Number(factor, None, "", ".3g", "wall times of one run")
        if not own:
            why = "a distance of models; the references have errors of their own"
            numbers[f"apart_{word}"] = Number(best, None, "l", ".1e", why)
    return numbers


def measured(name: str, plan: Plan, picture: str) -> tuple[tuple[str, ...], dict[str, Number]]:
    """Parts of the page for one scene, and its picture; its numbers."""
    scene = load(name)
    with tempfile.TemporaryDirectory() as folder:
        found = measure(scene, plan, Path(folder), Reporter(quiet=True))
    cost_write.picture(Path(picture), found)
    if not found.ok:
        raise AssertionError(f"{name}: {'; '.join(found.left_out)}")
    runs, reached = cost_write.table(found), cost_write.reach_table(found)
    parts = (
        f"## {scene.title}", "\n".join(f"- {text}" for text in cost_write.sentences(found)),
        f"![{name}: error against time]({Path(picture).name})", "### Time to reach an error", as_markdown(reached),
        "### Runs", as_markdown(runs),
    )  # fmt: skip
    return parts, _numbers(name, found)


def run(out: Path, scenes: tuple[str, ...] = SCENES, plan: Plan | None = None) -> dict[str, Number]:
    """Writes cost.md and cost_SCENE.png."""
    parts: list[str] = []
    numbers = {
        f"energy_{count}": Number(energy(count), abs(energy(count) - energy(2 * count)), "D w / l", ".6g")
        for count in PROBED
    }
    for name in scenes:
        chosen = plan or Plan(ratio=max(require_shell(load(name))), budget=BUDGET)
        more, found = one_core.call(measured, name, chosen, str(out / f"cost_{name}.png"))
        parts += more
        numbers |= found
    page.write(
        out / "cost.md", "What accuracy costs", "python -m tests.validation cost",
        "As `ribbonbench cost SCENE`, one thread. Two errors that are not mixed: of the discretisation (to a finer "
        "solution of the same model) and the distance to one common reference, the shell, on which ribbon and elastica "
        "end at the difference of the models.",
        *parts,
    )  # fmt: skip
    return numbers
