"""`ribbonbench live` in a process of its own, asked over HTTP as a page asks it."""

from __future__ import annotations

import http.client
import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from urllib.parse import urlsplit

from tests.patience import PATIENCE
from tests.test_setup import ROOT


def heard() -> None:
    """A shell that starts us in the background has ctrl-C ignored in all that we start."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


class Served:
    """A running server; a context manager that ends it as ctrl-C does. `code`: its exit code, then."""

    def __init__(self, scene: Path | str, folder: Path, *words: str) -> None:
        command = [sys.executable, "-m", "ribbonbench", "live", str(scene), "--no-browser", "--out", "kept", *words]
        self.errors = (folder / "stderr").open("w")
        self.process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=self.errors, text=True, cwd=folder,
            env={**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "80"}, preexec_fn=heard,
        )  # fmt: skip
        self.folder, self.code = folder, None
        assert self.process.stdout is not None
        self.address = self.process.stdout.readline().strip()
        parts = urlsplit(self.address)
        self.port, self.token = parts.port, parts.path.strip("/")

    def __enter__(self) -> Served:
        return self

    def __exit__(self, *_) -> None:
        self.process.send_signal(signal.SIGINT)
        try:
            self.code = self.process.wait(timeout=PATIENCE)
        finally:
            self.process.kill()
            self.process.wait()
            self.process.stdout.close()
            self.errors.close()

    @property
    def origin(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    def request(self, method, path, body=None, **headers) -> tuple[int, dict[str, str], bytes]:
        """Status, headers and content; a header that is None is left out."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE)
        own = {"Host": f"127.0.0.1:{self.port}"}
        if method == "POST":
            own |= {"Origin": self.origin, "Content-Type": "application/json"}
            own["Content-Length"] = str(len(body or b""))
        own |= headers
        try:
            connection.putrequest(method, path, skip_host=True, skip_accept_encoding=True)
            for name, value in own.items():
                if value is not None:
                    connection.putheader(name, value)
            connection.endheaders(body)
            found = connection.getresponse()
            return found.status, dict(found.getheaders()), found.read()
        finally:
            connection.close()

    def ask(self, what, tab="", **body):
        """What a tab's request is answered."""
        text = json.dumps({"tab": tab, **body}).encode()
        status, _, content = self.request("POST", f"/{self.token}/{what}", text)
        assert status == 200, (status, content)
        return json.loads(content)
