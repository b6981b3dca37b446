"""What is kept beside a page: results/data/NAME.json, written by the runner after a measurement's `run` has returned.

How a measurement keeps its numbers (tests/validation/*/NAME.py):

1. `run(out)` returns a mapping of names (a-z, 0-9, _) to `Number(value, error, unit, shown)` of `number.py`: each
   number that another page quotes, with the error that its measurement leaves, not a wish. Counts have the error 0.
   Times have none: `Number(ms, None, "ms", ".3g", why="wall time of one run")`. A distance to a reference has the
   reference's error. What is rounding itself (1.3e-13) is `rounding(value)`.
2. `PROBES = {name: function}`, two or more of these names: each function computes its number again by the program, in
   about a second, on the same path as `run` (share the code; no file is read), and returns a float.
   tests/test_probes.py holds it to the error. The error of a probed number is not above the number itself (but for
   rounding): such a probe could not fail. What takes seconds is shared between probes (`functools.cache`).
3. Optional: `READS = ("curl_4_3/table.csv",)`, files under results/ of *another* measurement that `run` reads: they
   belong to the key. `absent()`: what it needs from outside and is not here, in words, else None.
4. What `run` keeps to go on after an interruption (a CSV, a JSON) is as good as the code that made it: keep it under
   `Pages().key(NAME)`, or in the store of cases, never by name alone.
5. A measurement that times anything, or lets other processes work for it, has the machine for itself: this is derived
   from the words of its files (`Pages.alone`), and `ALONE = True` or `False` in the module says otherwise.
6. `nice -n 5 timeout 600 .venv/bin/python -m tests.validation NAME` from a committed tree. Then take NAME from WAITING
   in tests/test_probes.py, put `{NAME.number}`, `{NAME.number.error}`, `{NAME.number:.1e}` and `{NAME.remade}` into its
   entry of results/README.md.in, `python -m tests.validation --readme`, and run tests/test_probes.py and
   tests/test_docs_results.py. A number that changed by more than its error is a finding: say why, on the page.
"""

from __future__ import annotations

import ast
import contextlib
import fcntl
import hashlib
import os
import re
import resource
import subprocess
import time
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from compare import registry
from compare.store.provenance import now, versions
from compare.store.store import atomic_write_json, read_json
from ribbonbench import sources
from tests.validation import loaded, written
from tests.validation.number import Number

ROOT = Path(__file__).resolve().parents[2]
#: Cores that others may keep busy while a measurement counts as quiet.
QUIET = 0.1
#: What measurements write, as git leaves it out.
WRITTEN = (":!results", ":!docs/gallery", ":!docs/gallery.md", ":!docs/which_model.md*", ":!README.md*")
_NAME = re.compile(r"[a-z][a-z0-9_]*")
#: Files that keep and never measure, and the words of those that take times or start processes.
KEEPING = ("record.py", "pieces.py", "stale.py", "remake.py", "loaded.py", "__main__.py")
#: Modules that write and keep what was measured, and give no number: they and what only they import are in no key.
WRITING = tuple(f"tests.validation.{name}" for name in ("page", "pieces", "record", "written"))
_TIMES = re.compile(r"\b(perf_counter|process_time|one_core|subprocess|ProcessPoolExecutor)\b")
#: Words of a placeholder that are no number's name.
RESERVED = ("day", "command", "remade", "seconds")


@dataclass(frozen=True)
class Before:
    """What a page said before it was last made again."""

    time: str
    commit: str | None
    numbers: Mapping[str, Number]


@dataclass(frozen=True)
class Record:
    """The data of a page.

    time: UTC, ISO 8601. commit, modified: of the tree, and whether it differs from that in more than in pages. key:
    digest of `modules`, name -> first digits of the SHA-256 of its code. seconds, cpu_seconds: wall and CPU time of
    `run` with its processes. load: averages over a minute at begin and end. others: cores that other processes kept
    busy meanwhile, None where the system does not tell; quiet: fewer than `QUIET`. files: path from the root -> SHA-256
    of what `run` wrote. before: the record that this one replaced. wide: why `modules` are all that the page may depend
    on, and not what was loaded alone (loaded.py); "" where they are the latter.
    """

    command: str
    time: str
    commit: str | None
    modified: bool | None
    key: str
    python: str
    packages: Mapping[str, str]
    debian: Mapping[str, str]
    system: str
    cpu: str
    cores: int
    threads: Mapping[str, str]
    seconds: float
    cpu_seconds: float
    load: tuple[float, float]
    others: float | None
    quiet: bool
    numbers: Mapping[str, Number]
    files: Mapping[str, str]
    before: Before | None
    modules: Mapping[str, str]
    wide: str = "its record is of an earlier form"

    @classmethod
    def of(cls, data: Mapping[str, Any]) -> Record:
        """From its JSON. Raises TypeError for fields that are not a record's."""
        before = data["before"]
        return cls(**{
            **data,
            "load": tuple(data["load"]),
            "numbers": _numbers(data["numbers"]),
            "before": None if before is None else Before(**{**before, "numbers": _numbers(before["numbers"])}),
        })  # fmt: skip

    def changes(self) -> dict[str, float]:
        """Number -> its change since `before` in units of the error that was stated then; those that had one."""
        old = {} if self.before is None else self.before.numbers
        found = {name: old[name].apart(new.value) for name, new in self.numbers.items() if name in old}
        return {name: times for name, times in found.items() if times is not None}


def _numbers(data: Mapping[str, Any]) -> dict[str, Number]:
    return {name: Number(**fields) for name, fields in data.items()}


def checked(found: Any) -> dict[str, Number]:
    """What `run` returned, as numbers by name; nothing where it returned None. Raises TypeError and ValueError."""
    if found is None:
        return {}
    if not isinstance(found, Mapping) or not all(isinstance(number, Number) for number in found.values()):
        raise TypeError("run returns a mapping of names to Number, or None")
    for name in found:
        if not _NAME.fullmatch(name) or name in RESERVED:
            raise ValueError(f"{name!r}: a number's name has small letters, digits and _, and is none of {RESERVED}")
    return {name: _plain(number) for name, number in found.items()}


def _plain(number: Number) -> Number:
    """With numbers of Python for NumPy's."""
    value = number.value.item() if hasattr(number.value, "item") else number.value
    return Number(value, None if number.error is None else float(number.error), number.unit, number.shown, number.why)


class Pages:
    """The measurements of a tree and what they left under results/."""

    def __init__(self, root: Path = ROOT) -> None:
        self.root, self.results = root, root / "results"
        self.sources = sources.Sources(root, (*sources.PACKAGES, "tests"))
        self._quoted: dict[Path, set[str]] = {}

    def path(self, name: str) -> Path:
        """The file of a measurement's module: it stands in one of the rooms beside this file."""
        (path,) = (self.root / "tests" / "validation").glob(f"*/{name}.py")
        return path

    def module(self, name: str) -> str:
        """Its dotted name."""
        return ".".join(self.path(name).relative_to(self.root).with_suffix("").parts)

    def has(self, name: str, what: str) -> bool:
        """Whether its module defines `what` at the top, without importing it."""
        return re.search(rf"^(def )?{what}\b", self.path(name).read_text(), re.M) is not None

    def depends(self, name: str, only: Collection[str] | None = None) -> dict[str, Path]:
        """What a page may depend on: import closure of its module but for what only writes it (`WRITING`), with the
        models that it loads by the registry; shipped scenes and sweeps that are named in it, and what it reads of other
        measurements (`READS`). only: the modules that it loads; of all others none, but all data."""
        if only is not None:
            usual = self.depends(name)
            more = [one for one in only if one not in usual and self.sources.file(one) is not None]
            found = {**self.sources.closure(*more, without=WRITING), **usual}
            return {one: path for one, path in found.items() if path.suffix != ".py" or one in only}
        found = self.sources.closure(self.module(name), without=WRITING)
        data = self._data(found)
        if registry.__name__ in found:
            homes = [entry.target.partition(":")[0] for entry in self._models(found, data)]
            found = self.sources.closure(self.module(name), *homes, without=WRITING)
        found.update(data)
        found.update({f"results/{file}": self.results / file for file in self.reads(name)})
        return found

    def made_by(self, name: str, heard: loaded.Heard) -> set[str]:
        """The modules of this tree that made a page: those of `depends` that were loaded, and what was loaded by names
        that no import says (models by the registry), with what these import. Not what the runner loads, nor what the
        `__init__` of a package around them imports for others."""
        files = {one: file for one, file in heard.loaded().items() if self._is(one, file)}
        usual = files.keys() & self.depends(name).keys()
        homes = {entry.target.partition(":")[0] for entry in registry.BUILT_IN}
        runner = [one for one in ("tests.validation.__main__", *WRITING) if self.sources.file(one) is not None]
        other = {*self._beside(usual), *self.sources.closure(*runner, statements=True)} - homes
        named = files.keys() - usual - other
        return usual | (files.keys() & self.sources.closure(*named, without=WRITING).keys())

    def _is(self, name: str, file: str) -> bool:
        """Whether a module that was loaded from a file is the tree's of that name."""
        own = self.sources.file(name)
        return own is not None and file in ("", str(own), os.path.realpath(own))

    def _beside(self, modules: Collection[str]) -> set[str]:
        """What the `__init__` of packages around modules import, and that of those in turn."""
        found: set[str] = set()
        while True:
            parts = [one.split(".") for one in {*modules, *found}]
            around = {".".join(each[:count]) for each in parts for count in range(1, len(each))} - found
            around = {one for one in around if self.sources.file(one) is not None}
            if not around:
                return found
            found.update(around, self.sources.closure(*around, statements=True))

    def _data(self, modules: Mapping[str, Path]) -> dict[str, Path]:
        """The shipped scenes and sweeps that modules name; all of them where a test asks for all."""
        quoted = {word for path in modules.values() if path.suffix == ".py" for word in self._words(path)}
        tests = [path for dotted, path in modules.items() if dotted.startswith("tests.") and path.suffix == ".py"]
        every = any(one.endswith(":shipped") for path in tests for one in self.sources.module(path).imports)
        return {
            f"compare/{folder}/{path.name}": path
            for folder in ("scenes", "sweeps")
            for path in sorted((self.root / "compare" / folder).glob("*.toml"))
            if every or path.stem in quoted
        }

    def _models(self, modules: Mapping[str, Path], data: Mapping[str, Path]) -> list[registry.Entry]:
        """The models that a measurement with the registry may load, which imports none by name: the usual one and the
        richest, and those whose name or energy its scenes or its own files name."""
        own = [path for dotted, path in modules.items() if dotted.startswith("tests.") and path.suffix == ".py"]
        named = {word for path in (*own, *data.values()) for word in self._words(path)}
        always = (registry.USUAL, registry.RICHEST)
        return [
            entry
            for entry in registry.BUILT_IN
            if entry.name in always or not named.isdisjoint((entry.name, *entry.energies))
        ]

    def alone(self, name: str) -> bool:
        """Whether a measurement must have the machine for itself: its `ALONE`, else whether its files, or those of the
        tests that it imports, take times or start processes."""
        declared = re.search(r"^ALONE = (True|False)$", self.path(name).read_text(), re.M)
        if declared is not None:
            return declared[1] == "True"
        own = [path for one, path in self.sources.closure(self.module(name)).items() if one.startswith("tests.")]
        return any(_TIMES.search(path.read_text()) for path in own if path.name not in KEEPING)

    def reads(self, name: str) -> tuple[str, ...]:
        """`READS` of a measurement's module, without importing it."""
        for node in ast.parse(self.path(name).read_text()).body:
            if isinstance(node, ast.Assign) and [getattr(one, "id", "") for one in node.targets] == ["READS"]:
                return tuple(ast.literal_eval(node.value))
        return ()

    def _words(self, path: Path) -> set[str]:
        if path not in self._quoted:
            self._quoted[path] = set(re.findall(r"""["'](\w+)["']""", path.read_text()))
        return self._quoted[path]

    def key(self, name: str, only: Collection[str] | None = None) -> str:
        """Digest of all that a page may depend on (`depends`)."""
        return self.sources.sum(self.depends(name, only))

    def modules(self, name: str, only: Collection[str] | None = None) -> dict[str, str]:
        """What a page may depend on -> the first digits of its digest."""
        return {one: self.sources.module(path).code[:8] for one, path in sorted(self.depends(name, only).items())}

    def data(self, name: str) -> Path:
        return self.results / "data" / f"{name}.json"

    def read(self, name: str) -> Record | None:
        """The record of a page; None where there is none yet. Raises ValueError or TypeError for one that is spoilt."""
        path = self.data(name)
        return Record.of(read_json(path)) if path.exists() else None

    def files(self) -> Iterator[Path]:
        """What measurements may write: all under results/ but for records and the rendered page, the gallery, and the
        page on models."""
        own = {self.results / name for name in ("README.md", "README.md.in")}
        docs = self.root / "docs"
        for path in sorted(
            [
                *self.results.rglob("*"),
                *docs.glob("gallery.md"),
                *docs.glob("which_model.md.in"),
                *(docs / "gallery").glob("*"),
            ]
        ):
            if path.is_file() and path.parent != self.results / "data" and path not in own:
                yield path

    def digest(self, path: Path) -> str:
        """SHA-256 of a file's bytes."""
        return hashlib.sha256(path.read_bytes()).hexdigest()

    def modified(self) -> bool | None:
        """Whether the tree differs from its commit in more than what measurements write; None without git."""
        command = ["git", "-C", str(self.root), "status", "--porcelain", "--untracked-files=no", "--", "."]
        done = subprocess.run([*command, *WRITTEN], capture_output=True, text=True, check=False)
        return bool(done.stdout.strip()) if done.returncode == 0 else None

    def measure(self, name: str, run: Callable[[Path], Any], command: str, heard: loaded.Heard | None = None) -> Record:
        """Runs a measurement and keeps its record, whole or not at all; what `run` raises is passed on, and then the
        record stays the old one. One that has the machine for itself waits for all others in the tree, and they for
        it; the rest run beside each other. heard: while its module was imported."""
        with self._locked(fcntl.LOCK_EX if self.alone(name) else fcntl.LOCK_SH):
            return self._measure(name, run, command, loaded.Heard() if heard is None else heard)

    @contextlib.contextmanager
    def _locked(self, kind: int) -> Iterator[None]:
        """The lock of the tree's measurements, for one alone or shared."""
        place = self.root / "out" / "validate" / "lock"
        place.parent.mkdir(parents=True, exist_ok=True)
        with place.open("w") as lock:
            fcntl.flock(lock, kind)
            yield

    def _measure(self, name: str, run: Callable[[Path], Any], command: str, heard: loaded.Heard) -> Record:
        old = self.read(name)
        known, made, modified = self.depends(name).values(), versions(), self.modified()
        for path in (*known, *self.sources.every().values()):
            self.sources.module(path)  # as it is now
        stamps = {path: path.stat().st_mtime_ns for path in self.files()}
        load, busy, cpu, began = os.getloadavg()[0], _busy(), _own(), time.perf_counter()
        with loaded.hearing(heard), written.noted() as own:
            numbers = checked(run(self.results))
        seconds, cpu, ended = time.perf_counter() - began, _own() - cpu, now()  # pages tell the day of their end
        others = None if busy is None else max(0.0, ((_busy() or 0.0) - busy - cpu) / max(seconds, 1e-3))
        commit = None if made["git"] is None else made["git"]["commit"]
        changed = [path for path in self.files() if stamps.get(path) != path.stat().st_mtime_ns]
        if not self.alone(name):  # what a measurement beside it wrote meanwhile is not its own
            changed = [path for path in changed if path.resolve() in own]
        only, wide = self.made_by(name, heard), heard.why_not(self.root, known)
        if self.module(name) not in only:
            wide = wide or "its module is none of the tree's"
        narrow = None if wide else only
        record = Record(
            command, ended, commit, modified, self.key(name, narrow), made["python"], made["packages"],
            made["debian"], made["system"], made["cpu"], made["cores"], made["threads"], round(seconds, 2),
            round(cpu, 2), (round(load, 2), round(os.getloadavg()[0], 2)),
            None if others is None else round(others, 3), others is not None and others < QUIET, numbers,
            {path.relative_to(self.root).as_posix(): self.digest(path) for path in changed},
            None if old is None else Before(old.time, old.commit, old.numbers),
            self.modules(name, narrow), wide,
        )  # fmt: skip
        atomic_write_json(self.data(name), asdict(record))
        return record


def _own() -> float:
    """CPU time of this process and of those it has waited for (s)."""
    times = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in times)


def _busy() -> float | None:
    """CPU time of all processes of the machine (s), what is taken by other guests with it; None without /proc/stat."""
    try:
        first = Path("/proc/stat").read_text().splitlines()[0].split()
    except OSError:
        return None
    user, nice, system, _, _, irq, softirq, steal = (float(ticks) for ticks in first[1:9])
    return (user + nice + system + irq + softirq + steal) / os.sysconf("SC_CLK_TCK")
