"""The picture of the README: the report of its scene beside three shells, as a browser shows it."""

from __future__ import annotations

import shutil
from pathlib import Path
from tempfile import TemporaryDirectory

from compare import cli
from tests.compare.report.browser import Browser
from tests.docs_blocks import ROOT, blocks

#: Pixels of the window, which is as high as what is shown; shells beside the ribbon, and their mesh.
WIDTH, HEIGHT = 1000, 800
#: The foot of the 3-D view, from the top of the page.
FOOT = "document.querySelector('.stage').getBoundingClientRect().bottom + window.scrollY"
SHELLS = ("shell.width_to_thickness=[50,100,200]", "shell.elements=[60,4]")


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
        browser.run("new Promise(done => setTimeout(done, 1500))")
        browser("Emulation.setDeviceMetricsOverride", width=WIDTH, height=int(browser.run(FOOT)) + 16,
                deviceScaleFactor=1, mobile=False)  # fmt: skip
        browser.run("new Promise(done => setTimeout(done, 1500))")
        browser.screenshot(work / "report.png")
        complaints = browser.complaints()
    if complaints:
        raise AssertionError(f"the report complains: {complaints}")
    shutil.copyfile(work / "report.png", out / "report.png")
