"""The picture of the README: the report of its scene beside three shells, as a browser shows it."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np

from compare import cli
from tests.compare.report.browser import Browser
from tests.docs_blocks import ROOT, blocks

#: Pixels of the window; shells beside the ribbon, and their mesh.
WIDTH, HEIGHT = 1000, 960
SHELLS = ("shell.width_to_thickness=[50,100,200]", "shell.elements=[60,4]")
#: What is shown, one below the other: what the window is scrolled to, and the part that ends the piece.
PIECES = (("body", ".answer"), ("figure.view", "figure.view"))
PLACE = """(() => {{
  document.querySelector('{head}').scrollIntoView();
  const part = name => document.querySelector(name).getBoundingClientRect();
  return [Math.max(0, part('{head}').top), part('{foot}').bottom + 20];
}})()"""


def pieces(browser: Browser, folder: Path) -> np.ndarray:
    """The pieces of the page in the window, (rows, columns, colours)."""
    found = []
    for k, (head, foot) in enumerate(PIECES):
        top, end = browser.run(PLACE.format(head=head, foot=foot))
        browser.run("new Promise(done => setTimeout(done, 1500))")
        found.append(plt.imread(browser.screenshot(folder / f"piece_{k}.png"))[int(top) : int(end)])
    return np.concatenate(found)


#: Why `make test` computes no number of it again.
NO_PROBES = "a picture of a report; the numbers in it are those of the scene in README.md, which its own tests hold"


def run(out: Path) -> None:
    """Writes report.png."""
    (scene,) = (block for block in blocks((ROOT / "README.md").read_text()) if block.info == "toml scene")
    work = out.parent / "out" / "validate" / "readme"
    work.mkdir(parents=True, exist_ok=True)
    (work / scene.file).write_text(scene.text)
    sets = [word for shells in SHELLS for word in ("--set", shells)]
    code = cli.main(["compare", str(work / scene.file), *sets, "--out", str(work / "report")])
    if code != 0:
        raise AssertionError(f"the README's scene beside its shells: exit code {code}")
    page = next((work / "report").rglob("report.html"))
    with TemporaryDirectory() as profile, Browser(Path(profile)) as browser:
        browser.open(page, WIDTH, HEIGHT)
        browser.until("document.querySelector('canvas') !== null")
        shown = pieces(browser, work)
        complaints = browser.complaints()
    if complaints:
        raise AssertionError(f"the report complains: {complaints}")
    plt.imsave(out / "report.png", shown)
