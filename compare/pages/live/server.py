"""The server of a strip in the hand: 127.0.0.1 alone, a random token in the address, one thread that computes.

Requests are answered by threads that only read, wait and write; whatever computes is a `Job` that the thread of
`Live.serve` runs, one at a time. A job of a slider replaces an older one of the same tab that still waits, which is
answered as dropped: the newest value wins. What takes longer (verdict, estimate) is done in pieces and dropped between
two of them when a hand moves.

Who may ask: whoever names the token, by an address of this machine (the header Host, so that no other name may be
pointed here), from a page of this server (the header Origin). All else is answered 403 or 404, without a word of what
is here. Bodies are JSON objects of at most MOST bytes.
"""

from __future__ import annotations

import json
import secrets
import sys
import threading
import traceback
from collections import OrderedDict, deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from compare.pages.live.desk import Desk
from compare.store.store import jsonable
from ribbonbench.errors import BadInput, RibbonbenchError

#: Largest body of a request (bytes), seconds that one may take to arrive, tabs that are remembered.
MOST, PATIENCE, TABS = 65_536, 10.0, 16
#: What a tab may ask for by POST.
ASKS = ("begin", "move", "judge", "back", "keep", "film", "lay", "laid")

Answer = dict[str, Any]


@dataclass(eq=False)
class Job:
    """Something to compute for a tab: what is asked, with what; `answer` once it is done."""

    ask: str
    tab: str
    body: Mapping[str, Any]
    done: threading.Event = field(default_factory=threading.Event)
    answer: Answer = field(default_factory=dict)

    def end(self, answer: Answer) -> None:
        """Answers it."""
        self.answer = answer
        self.done.set()


class Queue:
    """The jobs that wait: moves first, of each tab the newest alone."""

    def __init__(self) -> None:
        self._moves: OrderedDict[str, Job] = OrderedDict()
        self._others: deque[Job] = deque()
        self._changed = threading.Condition()
        self._closed = False

    def put(self, job: Job) -> None:
        """Adds a job; an older move, or an older judgement, of the same tab is dropped."""
        with self._changed:
            if self._closed:
                job.end({"gone": "the server is closing"})
                return
            if job.ask == "move":
                self._drop(self._moves.get(job.tab))
                self._moves[job.tab] = job
            else:
                if job.ask == "judge":
                    for old in [one for one in self._others if one.ask == "judge" and one.tab == job.tab]:
                        self._others.remove(old)
                        self._drop(old)
                self._others.append(job)
            self._changed.notify_all()

    @staticmethod
    def _drop(job: Job | None) -> None:
        if job is not None:
            job.end({"dropped": True})

    def take(self, patience: float) -> Job | None:
        """The next job; None where none came within so many seconds. What a tab asks for behind its move waits for
        that."""
        with self._changed:
            self._changed.wait_for(lambda: self._moves or self._others, patience)
            if self._moves:
                return self._moves.popitem(last=False)[1]
            return self._others.popleft() if self._others else None

    @property
    def hurried(self) -> bool:
        """Whether a hand moves."""
        return bool(self._moves)

    def close(self) -> None:
        """Answers all that wait, and whatever comes, that there is nobody any more."""
        with self._changed:
            self._closed = True
            for job in (*self._moves.values(), *self._others):
                job.end({"gone": "the server is closing"})
            self._moves.clear()
            self._others.clear()


class Live:
    """The server of a page and of the strips of its tabs.

    document: the page; begin: makes the strip of a new tab (slow the first time); port: 0 for a free one.
    """

    def __init__(self, document: bytes, headers: Mapping[str, str], begin: Callable[[], Desk], port: int = 0) -> None:
        self.document, self.headers, self.begin = document, dict(headers), begin
        self.token = secrets.token_urlsafe(24)
        self.queue = Queue()
        self.desks: OrderedDict[str, Desk] = OrderedDict()
        self._stop = threading.Event()
        self._http = _Server(("127.0.0.1", port), _Handler)
        self._http.live = self

    @property
    def port(self) -> int:
        """Where it listens."""
        return int(self._http.server_address[1])

    @property
    def hosts(self) -> tuple[str, str]:
        """The names by which it may be asked."""
        return f"127.0.0.1:{self.port}", f"localhost:{self.port}"

    @property
    def address(self) -> str:
        """The address of the page."""
        return f"http://{self.hosts[0]}/{self.token}/"

    def serve(self, until: Callable[[], bool] = lambda: False) -> None:
        """Answers until it is stopped (ctrl-C, `until`); computes in the thread that calls it."""
        listens = threading.Thread(target=self._http.serve_forever, kwargs={"poll_interval": 0.1}, daemon=True)
        listens.start()
        try:
            while not until():
                job = self.queue.take(0.2)
                if job is not None:
                    self._do(job)
        finally:
            self.queue.close()
            self._http.shutdown()
            self._http.server_close()
            listens.join()
            for desk in self.desks.values():
                desk.end()

    def _do(self, job: Job) -> None:
        """Runs a job and answers it, whatever comes."""
        try:
            job.end(jsonable(self._answer(job)))
        except RibbonbenchError as error:
            job.end({"refused": str(error)})
        except Exception as error:  # the page says it, and the strip stands where it stood
            traceback.print_exc(file=sys.stderr)
            job.end({"refused": f"this could not be computed ({type(error).__name__}: {error})"})
        except BaseException:
            job.end({"gone": "the server is closing"})
            raise

    def _answer(self, job: Job) -> Answer:
        if job.ask == "begin":
            return self._begun(job)
        desk = self.desks.get(job.tab)
        if desk is None:
            return {"unknown": "this tab is not known any more"}
        self.desks.move_to_end(job.tab)
        if job.ask == "move":
            return desk.moved(*_move(job.body))
        if job.ask == "judge":
            return self._judged(desk)
        plain: dict[str, Callable[[], Answer]] = {
            "back": desk.back, "keep": desk.kept, "film": desk.filmed, "lay": desk.shell_begun,
            "laid": desk.shell_now,
        }  # fmt: skip
        return plain[job.ask]()

    def _begun(self, job: Job) -> Answer:
        """A new tab, or one that was here before (a page that was loaded again) where it stood; with what a tab needs
        once. values: where a tab stood that is not known any more."""
        tab = job.tab if job.tab in self.desks else secrets.token_urlsafe(9)
        desk = self.desks.get(tab)
        if desk is None:
            desk = self.desks[tab] = self.begin()
            while len(self.desks) > TABS:
                self.desks.popitem(last=False)[1].end()
            values = job.body.get("values")
            if isinstance(values, dict) and values:
                try:
                    desk.moved(values, 1)
                except RibbonbenchError as error:
                    return {"tab": tab, **desk.once(), **desk.told(), "why": str(error)}
        return {"tab": tab, **desk.once(), **desk.told()}

    def _judged(self, desk: Desk) -> Answer:
        found: Answer = {}
        pieces: Iterator[Answer] = desk.judged()
        for piece in pieces:
            found |= piece
            if self.queue.hurried:
                return {**found, "dropped": True}
        return found


def _move(body: Mapping[str, Any]) -> tuple[Mapping[str, Any], int]:
    """Values and gesture of a move; `BadInput` for what is none."""
    values, gesture = body.get("values"), body.get("gesture")
    if not isinstance(values, dict):
        raise BadInput("values", values, "are no sliders", "give an object of numbers by slider")
    if isinstance(gesture, bool) or not isinstance(gesture, int):
        raise BadInput("gesture", gesture, "is no whole number", "count gestures from 1")
    return values, gesture


def read_json(content: bytes) -> Mapping[str, Any]:
    """The object of a body. ValueError for what is none, and for numbers that JSON does not have."""

    def none(word: str) -> float:
        raise ValueError(f"{word} is no number of JSON")

    found = json.loads(content.decode("utf-8"), parse_constant=none)
    if not isinstance(found, dict):
        raise ValueError("no object")
    return found


class _Server(ThreadingHTTPServer):
    daemon_threads = True
    allow_reuse_address = False
    live: Live


class _Handler(BaseHTTPRequestHandler):
    """One request. HTTP/1.0: a connection ends with its answer, so that none stays open behind the server."""

    server: _Server
    timeout = PATIENCE
    server_version, sys_version = "ribbonbench", ""

    def log_message(self, format: str, *arguments: object) -> None:
        """Nothing: a terminal is no place for thirty lines a second."""

    def do_GET(self) -> None:
        """The page."""
        if self._ask() == "":
            self._send(HTTPStatus.OK, "text/html; charset=utf-8", self.server.live.document)

    def do_POST(self) -> None:
        """What a tab asks for."""
        live, ask = self.server.live, self._ask()
        if ask is None:
            return
        if ask not in ASKS:
            self._refuse(HTTPStatus.NOT_FOUND)
            return
        if self.headers.get("Origin") not in {f"http://{host}" for host in live.hosts}:
            self._refuse(HTTPStatus.FORBIDDEN)
            return
        if self.headers.get_content_type() != "application/json":
            self._refuse(HTTPStatus.UNSUPPORTED_MEDIA_TYPE)
            return
        length = self.headers.get("Content-Length", "")
        if not length.isascii() or not length.isdigit():
            self._refuse(HTTPStatus.LENGTH_REQUIRED)
            return
        if int(length) > MOST:
            self._refuse(HTTPStatus.REQUEST_ENTITY_TOO_LARGE)
            return
        try:
            body = read_json(self.rfile.read(int(length)))
            tab = body.get("tab") or ""
            if not isinstance(tab, str):
                raise ValueError("no tab")
        except (ValueError, RecursionError):
            self._refuse(HTTPStatus.BAD_REQUEST)
            return
        job = Job(ask, tab, body)
        live.queue.put(job)
        job.done.wait()
        text = json.dumps(job.answer, separators=(",", ":"), allow_nan=False)
        self._send(HTTPStatus.OK, "application/json", text.encode())

    def _ask(self) -> str | None:
        """What stands behind the token in the path; None: refused."""
        live = self.server.live
        if self.headers.get("Host") not in live.hosts:
            self._refuse(HTTPStatus.FORBIDDEN)
            return None
        first, _, rest = self.path.removeprefix("/").partition("/")
        if not secrets.compare_digest(first.encode(), live.token.encode()) or (rest == "" and self.path[-1] != "/"):
            self._refuse(HTTPStatus.NOT_FOUND)
            return None
        if self.command == "GET" and rest:
            self._refuse(HTTPStatus.NOT_FOUND)
            return None
        return rest

    def _refuse(self, status: HTTPStatus) -> None:
        self._send(status, "text/plain; charset=utf-8", f"{status.value} {status.phrase}\n".encode())

    def _send(self, status: HTTPStatus, kind: str, content: bytes) -> None:
        headers = {
            "Content-Type": kind, "Content-Length": str(len(content)), "Cache-Control": "no-store",
            "X-Content-Type-Options": "nosniff", "Referrer-Policy": "no-referrer",
            "Cross-Origin-Resource-Policy": "same-origin", **self.server.live.headers,
        }  # fmt: skip
        try:
            self.send_response(status)
            for name, value in headers.items():
                self.send_header(name, value)
            self.end_headers()
            self.wfile.write(content)
        except (BrokenPipeError, ConnectionError, TimeoutError):
            pass  # who asked has gone
