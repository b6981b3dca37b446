"""What accuracy costs: error against time of ribbon, elastica and shell, for the curl of 4.3 and a flat cantilever."""

from __future__ import annotations

import tempfile
from pathlib import Path

from compare.page.markdown import as_markdown
from compare.pages import cost as cost_write
from compare.scene.scene import load
from compare.store.progress import Reporter
from compare.studies.cost import measure
from compare.studies.cost_plan import Plan
from tests.validation import one_core, page

SCENES = ("curl_4_3", "cantilever")
BUDGET = 400.0


def measured(name: str, plan: Plan, picture: str) -> tuple[str, ...]:
    """Parts of the page for one scene, and its picture."""
    scene = load(name)
    with tempfile.TemporaryDirectory() as folder:
        found = measure(scene, plan, Path(folder), Reporter(quiet=True))
    cost_write.picture(Path(picture), found)
    if not found.ok:
        raise AssertionError(f"{name}: {'; '.join(found.left_out)}")
    runs, reached = cost_write.table(found), cost_write.reach_table(found)
    return (
        f"## {scene.title}", "\n".join(f"- {text}" for text in cost_write.sentences(found)),
        f"![{name}: error against time]({Path(picture).name})", "### Time to reach an error", as_markdown(reached),
        "### Runs", as_markdown(runs),
    )  # fmt: skip


def run(out: Path, scenes: tuple[str, ...] = SCENES, plan: Plan | None = None) -> None:
    """Writes cost.md and cost_SCENE.png."""
    parts: list[str] = []
    for name in scenes:
        chosen = plan or Plan(ratio=max(load(name).require_shell()), budget=BUDGET)
        parts += one_core.call(measured, name, chosen, str(out / f"cost_{name}.png"))
    page.write(
        out / "cost.md", "What accuracy costs", "python -m tests.validation cost",
        "As `ribbonbench cost SCENE`, one thread. Two errors that are not mixed: of the discretisation (to a finer "
        "solution of the same model) and the distance to one common reference, the shell, on which ribbon and elastica "
        "end at the difference of the models.",
        *parts,
    )  # fmt: skip
