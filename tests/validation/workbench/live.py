"""How fast a strip in the hand answers: start-up, answers a second over HTTP, frames a second in Chromium.

The server is a process of its own, as it is for a user, and asked as the page asks it. Wall times need a machine that
does nothing else, the processor time of an answer does not: both are told, with the load while they were taken.
"""

from __future__ import annotations

import functools
import json
import math
import os
import statistics
import tempfile
import time
from pathlib import Path

from compare.pages.live.desk import Beginning, Desk
from compare.scene.scene import load
from tests.compare.live.served import Served
from tests.compare.report.browser import CHROMIUM, Browser
from tests.validation import page
from tests.validation.number import Number

ELEMENTS, MOVES, REPEATS, STARTS = 40, 100, 3, 5
#: Scene -> the slider that moves, and how far it goes there and back.
SCENES = {
    "curl_4_3": ("strip.gamma", 40.0),
    "two_clamps_5_3_2": ("clamp.end.position.0", -0.2),
    "shift_7_2": ("clamp.end.position.1", -0.2),
    "moebius_6_1": ("strip.width", 0.02),
}
#: Frames a second that a hand does not feel; seconds of a drag in the browser, and how far (of 1000) it goes.
WANTED, DRAG, FAR = 30.0, 4.0, 120.0
#: Whose frames are counted in the browser.
SEEN = "shift_7_2"
#: Part of an energy within which a hand's state and a fresh solve's are one.
SAME = 1e-9
DRAGGED = """new Promise((done) => {
  const slide = document.querySelector('.slider[data-name="NAME"] input'), start = Number(slide.value);
  const shown = () => Number(document.body.dataset.shown), before = shown(), began = performance.now();
  const step = () => {
    const t = (performance.now() - began) / 1000;
    if (t >= SECONDS) { done({ frames: shown() - before, seconds: t }); return; }
    slide.value = start + FAR * Math.sin(t) ** 2;
    slide.dispatchEvent(new Event("input"));
    requestAnimationFrame(step);
  };
  step();
})"""


def absent() -> str | None:
    """Why it cannot be measured here."""
    return None if CHROMIUM is not None else "no chromium"


def served(scene: str, folder: Path) -> Served:
    """A server of the scene on `ELEMENTS` equal elements."""
    return Served(scene, folder, "--set", f"model.elements={ELEMENTS}", "--quiet")


def started(scene: str, folder: Path) -> tuple[float, float]:
    """Seconds from the start of a process to its page, and to its first state."""
    clock = time.perf_counter()
    with served(scene, folder) as server:
        assert server.request("GET", f"/{server.token}/")[0] == 200
        there = time.perf_counter() - clock
        assert server.ask("begin")["ok"]
        return there, time.perf_counter() - clock


def processor(process: int) -> float:
    """Processor time (s) that a living process has taken."""
    words = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")


def moved(scene: str, steps: int = 6) -> float:
    """Total energy (D w / l) where the slider of a scene is at its farthest, moved there in so many steps."""
    slider, far = SCENES[scene]
    found = load(scene).replace({"model.elements": ELEMENTS})
    desk = Desk(Beginning.of(found, found.units), Path(), str)
    own = next(one.value for one in desk.begun.sliders if one.name == slider)
    for k in range(1, steps + 1):
        told = desk.moved({slider: own + far * k / steps}, gesture=1)
    return float(told["numbers"]["energy.total"])


PROBES = {f"{scene}_energy": functools.partial(moved, scene) for scene in ("curl_4_3", "shift_7_2", "moebius_6_1")}


def answers(server: Served, slider: str, far: float) -> tuple[list[float], float, float]:
    """Seconds of each answer to MOVES moves, there and back, processor time (s) an answer, and the total energy at the
    farthest place."""
    begun = server.ask("begin")
    own = begun["values"][slider]
    before = processor(server.process.pid)
    seconds = []
    energy = math.nan
    for k in range(MOVES):
        value = own + far * (1.0 - abs(2.0 * (k + 1) / MOVES - 1.0))
        clock = time.perf_counter()
        found = server.ask("move", begun["tab"], values={slider: value}, gesture=1)
        seconds.append(time.perf_counter() - clock)
        assert found["reached"] == 1.0
        assert found["ok"]
        if 2 * (k + 1) == MOVES:
            energy = float(found["numbers"]["energy.total"])
    return seconds, (processor(server.process.pid) - before) / MOVES, energy


def frames(server: Served, slider: str, far: float, profile: Path) -> float:
    """Frames a second of the page while a slider is dragged to and fro, towards where `far` has its sign."""
    with Browser(profile) as browser:
        browser.visit(server.address)
        browser.until("document.body.dataset.judged")
        script = DRAGGED.replace("NAME", slider).replace("SECONDS", str(DRAG))
        script = script.replace("FAR", str(math.copysign(FAR, far)))
        found = json.loads(json.dumps(browser.run(script)))
    return float(found["frames"] / found["seconds"])


def run(out: Path) -> dict[str, Number]:
    numbers: dict[str, Number] = {}
    rows = []
    load = os.getloadavg()[0] / (os.cpu_count() or 1)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        starts = [started("two_clamps_5_3_2", folder) for _ in range(STARTS)]
        for key, times in zip(("page", "state"), zip(*starts, strict=True), strict=True):
            spread = (max(times) - min(times)) / 2.0
            numbers[f"start_{key}"] = Number(statistics.median(times), spread, "s", ".2f")
        for scene, (slider, far) in SCENES.items():
            with served(scene, folder) as server:
                answers(server, slider, far)
                taken = [answers(server, slider, far) for _ in range(REPEATS)]
                if scene == SEEN:
                    shown = frames(server, slider, far, folder / "profile")
                    numbers["frames"] = Number(shown, None, "1/s", ".0f", "one drag of one run")
            medians = [statistics.median(seconds) for seconds, _, _ in taken]
            slow = [sorted(seconds)[int(0.95 * MOVES) - 1] for seconds, _, _ in taken]
            spent = [cpu for _, cpu, _ in taken]
            energies = [energy for _, _, energy in taken]
            apart = max(abs(energies[0] - other) for other in (*energies[1:], moved(scene)))
            if apart > SAME * max(1.0, abs(energies[0])):
                raise AssertionError(f"{scene}: the energy depends on the way by {apart:.1e} D w / l")
            found = {
                "answer": Number(1e3 * statistics.median(medians), 5e2 * (max(medians) - min(medians)), "ms", ".1f"),
                "slow": Number(1e3 * statistics.median(slow), 5e2 * (max(slow) - min(slow)), "ms", ".1f"),
                "cpu": Number(1e3 * statistics.median(spent), 5e2 * (max(spent) - min(spent)), "ms", ".1f"),
                "energy": Number(energies[0], SAME * abs(energies[0]), "D w / l", ".6f"),
            }
            numbers |= {f"{scene}_{key}": number for key, number in found.items()}
            rows.append([
                scene, slider, f"{found['answer']}", f"{found['slow']}", f"{found['cpu']}",
                f"{1e3 / found['cpu'].value:.0f}",
            ])  # fmt: skip
            print("  ", *rows[-1], flush=True)
    load = max(load, os.getloadavg()[0] / (os.cpu_count() or 1))
    numbers["load"] = Number(load, None, "", ".1f", "of this moment")
    behind = [scene for scene in SCENES if 1e3 / numbers[f"{scene}_cpu"].value < WANTED]
    numbers["behind"] = Number(len(behind), None, "", "d", "scenes that a core answers less often than a hand feels")
    page.write(
        out / "live.md", "How fast a strip in the hand answers", "python -m tests.validation live",
        f"{WANTED:g} answers a second, which a hand does not feel, are given by one core in "
        f"{len(SCENES) - len(behind)} of {len(SCENES)} scenes, on average of all moves" + (
            f"; not in {', '.join(behind)}, where some moves are followed by steps." if behind else "."
        ),
        f"`ribbonbench live` on {ELEMENTS} equal elements, a process of its own, asked over HTTP as the page asks: "
        f"{MOVES} moves there and back, {REPEATS} times; the answer is the solved state with its surface, forces, "
        "stability and the check for jumps. Processor time: of the server's process, an answer; with it the answers a "
        "second of a core that does nothing else. While this was taken "
        f"{numbers['load']} processes were runnable for each core of the machine, which wall times contain.",
        page.table(
            ["scene", "slider", "answer, median, ms", "95 %, ms", "processor, ms", "answers/s of a core"],
            rows,
        ),
        f"From the start of the command to its page {numbers['start_page']} s, to the first state "
        f"{numbers['start_state']} s (two clamps, median of {STARTS}). Chromium (software "
        f"rendering, on the same cores) shows {numbers['frames']} frames a second of {SEEN}, its slider dragged.",
    )  # fmt: skip
    return numbers
