"""Headless Chromium driven over its debugging pipe (DevTools protocol): JSON texts, each ended by a NUL byte."""

from __future__ import annotations

import base64
import contextlib
import fcntl
import json
import os
import select
import shutil
import signal
import subprocess
import time
from pathlib import Path

from tests.patience import PATIENCE

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


class Browser:
    """One browser with one page; a context manager. `events` keeps every event of the page."""

    def __init__(self, profile: Path, webgl: bool = True) -> None:
        assert CHROMIUM is not None
        self.profile, self.events, self._number, self._rest = profile, [], 0, b""
        drawing = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"] if webgl else ["--disable-3d-apis"]
        ours = [*os.pipe(), *os.pipe()]  # read, write of commands; read, write of answers
        ends = [fcntl.fcntl(end, fcntl.F_DUPFD_CLOEXEC, 20) for end in ours]
        for end in ours:
            os.close(end)
        theirs = (ends[0], ends[3])
        command = [
            CHROMIUM, "--headless", "--no-sandbox", "--remote-debugging-pipe", f"--user-data-dir={profile}",
            "--no-first-run", "--disable-extensions", "--disable-background-networking", "--disable-sync",
            "--disable-component-update", "--disable-crash-reporter", "--disable-dev-shm-usage", "--hide-scrollbars",
            *drawing, "about:blank",
        ]  # fmt: skip
        self.process = subprocess.Popen(
            ["bash", "-c", f'exec "$0" "$@" 3<&{theirs[0]} 4>&{theirs[1]}', *command],
            pass_fds=theirs, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            start_new_session=True, env={**os.environ, "HOME": str(profile), "XDG_CONFIG_HOME": str(profile)},
        )  # fmt: skip
        for end in theirs:
            os.close(end)
        self._to, self._from = ends[1], ends[2]
        self._session = None
        target = self("Target.createTarget", url="about:blank")["targetId"]
        self._session = self("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self(f"{domain}.enable")

    def __enter__(self) -> Browser:
        return self

    def __exit__(self, *_) -> None:
        try:
            self._session = None
            with contextlib.suppress(OSError, RuntimeError, TimeoutError, subprocess.TimeoutExpired):
                self("Browser.close")
                self.process.wait(timeout=10)
        finally:
            if self.process.poll() is None or self.processes():
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()
            os.close(self._to)
            os.close(self._from)
            end = time.monotonic() + PATIENCE
            while self.processes() and time.monotonic() < end:
                time.sleep(0.05)

    def processes(self) -> list[int]:
        """Living processes of this browser (its profile stands on their command lines)."""
        mark, found = str(self.profile).encode(), []
        for entry in Path("/proc").iterdir():
            if entry.name.isdigit() and int(entry.name) != os.getpid():
                try:
                    if mark in (entry / "cmdline").read_bytes():
                        found.append(int(entry.name))
                except OSError:
                    continue
        return found

    def __call__(self, method: str, **parameters):
        """Sends a command and returns its result."""
        self._number += 1
        message = {"id": self._number, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._to, json.dumps(message).encode() + b"\0")
        end = time.monotonic() + PATIENCE
        while True:
            answer = self._read(end)
            if answer.get("id") == self._number:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']}")
                return answer["result"]
            self.events.append(answer)

    def _read(self, end: float):
        while b"\0" not in self._rest:
            ready, _, _ = select.select([self._from], [], [], max(0.0, end - time.monotonic()))
            if not ready:
                raise TimeoutError("the browser does not answer")
            more = os.read(self._from, 1 << 20)
            if not more:
                raise RuntimeError("the browser has gone")
            self._rest += more
        text, _, self._rest = self._rest.partition(b"\0")
        return json.loads(text)

    def open(self, path: Path, width: int = 1200, height: int = 900, phone: bool = False, dark: bool = False) -> None:
        """Shows a file and waits until it is loaded; `events` begins anew."""
        self.visit(path.resolve().as_uri(), width, height, phone, dark)

    def visit(
        self, address: str, width: int = 1200, height: int = 900, phone: bool = False, dark: bool = False
    ) -> None:
        """Shows an address and waits until it is loaded; `events` begins anew."""
        self("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=phone)
        scheme = [{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]
        self("Emulation.setEmulatedMedia", features=scheme)
        self.events.clear()
        self("Page.navigate", url=address)
        kind = address.partition(":")[0]
        self.until(f"document.readyState === 'complete' && location.protocol === '{kind}:'")

    def run(self, expression: str):
        """The value of a JavaScript expression."""
        found = self("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in found:
            raise RuntimeError(found["exceptionDetails"])
        return found["result"].get("value")

    def until(self, expression: str) -> None:
        """Waits until an expression is true."""
        end = time.monotonic() + PATIENCE
        while not self.run(expression):
            if time.monotonic() > end:
                raise TimeoutError(expression)
            time.sleep(0.05)

    def complaints(self) -> list[str]:
        """Errors and warnings of the console, exceptions, reports of the security policy."""
        self.run("1")
        found = []
        for event in self.events:
            values = event.get("params", {})
            if event["method"] == "Runtime.exceptionThrown":
                found.append(str(values["exceptionDetails"]))
            elif event["method"] == "Runtime.consoleAPICalled" and values["type"] in ("error", "warning", "assert"):
                found.append(str(values["args"]))
            elif event["method"] == "Log.entryAdded" and values["entry"]["level"] in ("error", "warning"):
                found.append(values["entry"]["text"])
        return found

    def requests(self) -> list[str]:
        """Addresses asked for since the page was opened, pictures within the page left out."""
        urls = [e["params"]["request"]["url"] for e in self.events if e["method"] == "Network.requestWillBeSent"]
        return [url for url in urls if not url.startswith("data:")]

    def screenshot(self, path: Path, whole: bool = False) -> Path:
        """PNG of what is seen, or of the whole page."""
        more = {}
        if whole:
            size = self("Page.getLayoutMetrics")["cssContentSize"]
            clip = {"x": 0, "y": 0, "width": size["width"], "height": min(size["height"], 12000), "scale": 1}
            more = {"captureBeyondViewport": True, "clip": clip}
        path.write_bytes(base64.b64decode(self("Page.captureScreenshot", format="png", **more)["data"]))
        return path

    def drag(self, start: tuple[float, float], by: tuple[float, float]) -> None:
        """Presses the left button at `start`, moves and lets go."""
        (x, y), steps = start, 5
        self("Input.dispatchMouseEvent", type="mousePressed", x=x, y=y, button="left", buttons=1, clickCount=1)
        for k in range(1, steps + 1):
            place = {"x": x + by[0] * k / steps, "y": y + by[1] * k / steps}
            self("Input.dispatchMouseEvent", type="mouseMoved", button="left", buttons=1, **place)
        self("Input.dispatchMouseEvent", type="mouseReleased", x=x + by[0], y=y + by[1], button="left", clickCount=1)
