"""Section 4.3 for both signs of K: the full table, the slope, and what clamp and energy the shell tends to."""

from __future__ import annotations

import shutil
from pathlib import Path

from rich.console import Console

from compare.page.markdown import as_markdown
from compare.pages import compare as report
from compare.pages import comparison as tables
from compare.scene.scene import load
from compare.store.progress import Reporter
from compare.store.store import CaseStore, atomic_write_text
from compare.studies.compare import compare

NAMES = ("curl_4_3", "curl_4_3_down")
KEPT = ("table.md", "table.csv", "convergence.png", "shapes.png")


def run(out: Path) -> None:
    work = out.parent / "out" / "validate"
    for name in NAMES:
        scene = load(name)
        with Reporter(Console(stderr=True)) as reporter:
            found = compare(scene, CaseStore(work / name / "cases"), reporter)
        report.write(work / name, found)
        target = out / name
        target.mkdir(parents=True, exist_ok=True)
        for file in KEPT:
            shutil.copyfile(work / name / file, target / file)
        words = "\n".join(f"- {sentence}" for sentence in tables.verdict(found))
        atomic_write_text(
            target / "README.md",
            f"# {scene.title}\n\nRemake: `python -m tests.validation curl`, or `ribbonbench compare {name}`.\n\n"
            f"{words}\n\n"
            f"{as_markdown(tables.table(found))}\n![distance against h/w](convergence.png)\n\n"
            "![shapes](shapes.png)\n",
        )
        if not (found.ok and found.falls and all(row.claimed for row in found.rows)):
            raise AssertionError(f"{name}: the distance does not fall, or is not above the errors, on every row")
