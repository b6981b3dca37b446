"""The keeping of pages on a small tree: what moves a key, what is made again and in which order, what is said of it."""

from __future__ import annotations

import datetime
import json
import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from compare import registry
from tests.patience import PATIENCE
from tests.validation import readme, remake, stale
from tests.validation.__main__ import main
from tests.validation.kept_rows import KeptRows
from tests.validation.number import Number
from tests.validation.record import Pages, checked
from tests.waiting import comes

FILES = {
    "ribbon/__init__.py": "",
    "ribbon/law.py": "MODULUS = 3.0\n",
    "ribbon/other.py": "X = 1\n",
    "compare/__init__.py": "",
    "compare/scenes/arc.toml": "a = 1\n",
    "compare/scenes/coil.toml": "a = 2\n",
    "tests/__init__.py": "",
    "tests/validation/__init__.py": "",
    "tests/validation/room/__init__.py": "",
    "tests/validation/room/first.py": 'from ribbon.law import MODULUS\nSCENE = "arc"\n\n\ndef run(out):\n    pass\n',
    "tests/validation/room/second.py": 'READS = ("first.csv",)\n\n\ndef run(out):\n    pass\n',
    "tests/validation/room/third.py": "import ribbon.other\n\n\ndef run(out):\n    pass\n",
    "results/first.csv": "1\n",
    "results/README.md.in": "E = {first.modulus}\n",
    "README.md.in": "E = {first.modulus:.1e}\n",
    "docs/which_model.md.in": "{first.modulus|2.9}\n",
}
NAMES = ("first", "second", "third")


@pytest.fixture
def root(tmp_path: Path) -> Path:
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    return tmp_path


def measure(root: Path, name: str, value: float = 3.0, error: float = 0.1, seconds: float | None = None):
    """A measurement that writes a page and returns one number."""

    def run(out: Path) -> dict[str, Number]:
        (out / f"{name}.md").write_text(f"{name}: {value}\n")
        return {"modulus": Number(value, error, shown=".2f"), "count": Number(7, 0, shown="d")}

    record = Pages(root).measure(name, run, f"python -m tests.validation {name}")
    if seconds is not None:
        path = Pages(root).data(name)
        path.write_text(json.dumps(json.loads(path.read_text()) | {"seconds": seconds}))
    return record


def test_a_record_is_read_back_as_it_was_written(root):
    record = measure(root, "first")
    assert Pages(root).read("first") == record
    assert record.key == Pages(root).key("first")
    assert set(record.files) == {"results/first.md"}
    assert record.numbers["count"].value == 7
    assert {"ribbon.law", "tests.validation.room.first", "compare/scenes/arc.toml"} <= set(record.modules)
    assert record.seconds >= 0.0
    assert len(record.load) == 2
    assert record.before is None
    assert Pages(root).read("third") is None


@pytest.mark.parametrize(
    ("file", "text", "moved"),
    [
        ("ribbon/law.py", "MODULUS = 4.0\n", ("ribbon.law",)),
        ("ribbon/law.py", '"""In words."""\nMODULUS = 3.0  # the same\n', ("ribbon.law",)),
        ("ribbon/law.py", "MODULUS = 3.0  # the same\n", ()),
        ("ribbon/other.py", "X = 2\n", ()),
        ("compare/scenes/arc.toml", "a = 3\n", ("compare/scenes/arc.toml",)),
        ("compare/scenes/coil.toml", "a = 3\n", ()),
        ("results/first.csv", "2\n", ()),
    ],
)
def test_a_change_of_what_a_page_depends_on_makes_it_stale_and_no_other(root, file, text, moved):
    measure(root, "first")
    assert not stale.status(Pages(root), "first").stale
    (root / file).write_text(text)
    found = stale.status(Pages(root), "first")
    assert found.moved == moved
    assert found.stale == bool(moved)


def test_what_only_writes_a_page_is_in_no_key(root):
    (root / "tests/validation/page.py").write_text("import ribbon.other\n")
    first = root / "tests/validation/room/first.py"
    first.write_text("from tests.validation import page\n" + first.read_text())
    measure(root, "first")
    assert "tests.validation.page" not in Pages(root).modules("first")
    for file in ("tests/validation/page.py", "ribbon/other.py"):
        (root / file).write_text("X = 7\n")
        assert not stale.status(Pages(root), "first").stale
    first.write_text("import ribbon.other\n" + first.read_text())
    measure(root, "first")
    (root / "ribbon/other.py").write_text("X = 8\n")
    assert stale.status(Pages(root), "first").moved == ("ribbon.other",)


def test_models_that_the_registry_loads_count_where_they_are_named(root):
    """They are imported by no name: the usual one and the richest always, another where a scene or a file names it."""
    (root / "compare/registry.py").write_text("")
    homes = {entry.name: entry.target.partition(":")[0] for entry in registry.BUILT_IN}
    for home in homes.values():
        file = root / f"{home.replace('.', '/')}.py"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text("X = 1\n")
    first = root / "tests/validation/room/first.py"
    first.write_text("import compare.registry\n" + first.read_text())
    (root / "compare/scenes/arc.toml").write_text('energy = "tape_plain"\n')
    measure(root, "first")
    measure(root, "third")
    moved = {}
    for name, home in homes.items():
        (root / f"{home.replace('.', '/')}.py").write_text("X = 2\n")
        moved[name] = stale.status(Pages(root), "first").moved
        (root / f"{home.replace('.', '/')}.py").write_text("X = 1\n")
    assert {name for name, modules in moved.items() if modules == (homes[name],)} == {"ribbon", "shell", "tape"}
    assert [name for name, modules in moved.items() if modules] == ["ribbon", "shell", "tape"]
    assert not {*homes.values()} & set(Pages(root).modules("third"))


def test_what_a_page_reads_of_another_and_its_own_files_count(root):
    measure(root, "second")
    (root / "results/first.csv").write_text("2\n")
    assert stale.status(Pages(root), "second").moved == ("results/first.csv",)
    measure(root, "second")
    (root / "results/second.md").write_text("typed by hand\n")
    found = stale.status(Pages(root), "second")
    assert found.stale
    assert found.edited == ("results/second.md",)
    assert found.moved == ()


def test_a_measurement_that_fails_leaves_the_record_as_it_is(root):
    before = measure(root, "first")

    def run(out: Path) -> None:
        (out / "first.md").write_text("half\n")
        raise AssertionError("above the promise")

    with pytest.raises(AssertionError, match="above the promise"):
        Pages(root).measure("first", run, "")
    assert Pages(root).read("first") == before
    assert stale.status(Pages(root), "first").edited == ("results/first.md",)


def again(root: Path, made: list[str], failing: str = "", stopped: str = ""):
    """What stands for a process: makes a page on the small tree."""

    def make(name: str) -> tuple[int, str]:
        made.append(name)
        if name == stopped:
            raise KeyboardInterrupt
        if name == failing:
            return stale.FAILED, ""
        measure(root, name)
        return stale.DONE, ""

    return make


def test_only_stale_pages_are_made_cheap_ones_first_and_a_failure_stops_no_other(root):
    measure(root, "first", seconds=50.0)
    measure(root, "second", seconds=2.0)
    made: list[str] = []
    outcomes = remake.remake(NAMES, False, again(root, made), lambda: Pages(root))
    assert made == ["third"]
    assert outcomes["first"].done == ""
    made.clear()
    for name in NAMES:
        (root / f"tests/validation/room/{name}.py").write_text(FILES[f"tests/validation/room/{name}.py"] + "X = 2\n")
    outcomes = remake.remake(NAMES, False, again(root, made, failing="third"), lambda: Pages(root))
    assert made == ["third", "first", "second"]  # the second reads a file of another, so it waits
    assert {name: outcome.failed for name, outcome in outcomes.items()} == {
        "first": False, "second": False, "third": True,
    }  # fmt: skip
    made.clear()
    remake.remake(NAMES, True, again(root, made), lambda: Pages(root))
    assert sorted(made) == sorted(NAMES)


def test_after_an_interruption_it_goes_on_with_the_rest(root):
    made: list[str] = []
    with pytest.raises(KeyboardInterrupt):
        remake.remake(NAMES, False, again(root, made, stopped="third"), lambda: Pages(root))
    assert made == ["first", "third"]
    made.clear()
    remake.remake(NAMES, False, again(root, made), lambda: Pages(root))
    assert made == ["second", "third"]  # what the second reads is there


def test_cheap_tiers_go_first_and_in_them_what_the_front_pages_quote(root):
    names = ("first", "third", "fourth", "fifth")
    for name, seconds in zip(names, (19.0, 2.0, 30.0, 21.0), strict=True):
        (root / f"tests/validation/room/{name}.py").write_text("import ribbon.law\n\n\ndef run(out):\n    pass\n")
        measure(root, name, seconds=seconds)
    (root / "ribbon/law.py").write_text("MODULUS = 4.0\n")
    made: list[str] = []
    remake.remake(names, False, again(root, made), lambda: Pages(root))
    assert made == ["first", "third", "fifth", "fourth"]  # README takes a number of the first


def test_what_would_not_be_done_in_time_is_not_begun(root):
    for name in NAMES:
        measure(root, name, seconds={"first": 90.0}.get(name, 1.0))
        (root / f"tests/validation/room/{name}.py").write_text("X = 2\n\n\ndef run(out):\n    pass\n")
    made: list[str] = []
    outcomes = remake.remake(NAMES, False, again(root, made), lambda: Pages(root), left=lambda: 60.0)
    assert made == ["second", "third"]
    assert outcomes["first"].done == "no time left: 90 s"
    assert not outcomes["first"].failed
    made.clear()
    outcomes = remake.remake(NAMES, True, again(root, made), lambda: Pages(root), left=lambda: 0.0)
    assert made == []
    assert {outcome.done.partition(":")[0] for outcome in outcomes.values()} == {"no time left"}


def _python(code: str) -> list[str]:
    return [sys.executable, "-c", code]


def test_a_measurement_is_ended_with_its_own_processes(tmp_path):
    """The child of the child writes its number and sleeps: it is gone with its parent."""
    mark = tmp_path / "child"
    inner = f"import os, time; open({str(mark)!r}, 'w').write(str(os.getpid()) + '.'); time.sleep(600)"
    outer = f"import subprocess, sys; subprocess.run([sys.executable, '-c', {inner!r}])"
    work = remake.Processes()
    ended: list[tuple[int, str]] = []
    thread = threading.Thread(target=lambda: ended.append(work.run(_python(outer), os.environ)))
    thread.start()
    while not (mark.exists() and mark.read_text().endswith(".")):
        assert thread.is_alive()
        time.sleep(0.05)
    work.stop()
    thread.join()
    assert [code < 0 for code, _ in ended] == [True]
    assert comes(lambda: not _alive(int(mark.read_text().removesuffix("."))))


def test_a_measurement_whose_time_is_over_is_ended_and_says_so():
    work = remake.Processes(time.monotonic() + 0.2)
    code, why = work.run(_python("import time; time.sleep(600)"), os.environ)
    assert code < 0
    assert why == "no time left"
    assert work.left <= 0.0


def _alive(pid: int) -> bool:
    """Whether a process runs; one that is dead and not yet waited for does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False


def test_an_interruption_ends_what_runs_and_begins_nothing_more(root):
    """Two at once, four to be made: the second is interrupted while the first runs."""
    names = ("first", "third", "fourth", "fifth")
    for name in names:
        (root / f"tests/validation/room/{name}.py").write_text("def run(out):\n    pass\n")
    begun: list[str] = []
    ended: list[int] = []
    running = threading.Event()

    class Made(remake.Processes):
        def __call__(self, name: str) -> tuple[int, str]:
            begun.append(name)
            if len(begun) == 1:
                running.set()
                code, why = self.run(_python(f"import time; time.sleep({PATIENCE})"), os.environ)
                ended.append(code)
                return code, why
            assert running.wait(PATIENCE)
            time.sleep(0.5)
            raise KeyboardInterrupt

    work = Made()
    outcomes: dict[str, remake.Outcome] = {}
    with pytest.raises(KeyboardInterrupt):
        remake.remake(names, False, work, lambda: Pages(root), jobs=2, outcomes=outcomes)
    assert comes(lambda: ended)
    assert [code < 0 for code in ended] == [True]
    assert len(begun) == 2
    assert set(outcomes) == set(names)
    assert work.run(_python("print(1)"), os.environ)[0] < 0


def test_a_failing_page_in_a_process_says_its_exit_code(root):
    work = remake.Processes()
    assert work.run(_python("raise SystemExit(7)"), os.environ) == (7, "")
    text = f"print({stale.MISSING + 'no auto-07p'!r}); raise SystemExit({stale.ABSENT})"
    assert work.run(_python(text), os.environ) == (stale.ABSENT, "no auto-07p")


def test_a_page_waits_for_those_alone_that_write_what_it_reads(root):
    measure(root, "third")
    pages = Pages(root)
    assert remake.sources_of(pages, "second", NAMES) == {"first"}
    assert remake.sources_of(pages, "first", NAMES) == set()
    (root / "tests/validation/room/second.py").write_text('READS = ("third.md", "data/first.json")\n')
    assert remake.sources_of(Pages(root), "second", NAMES) == {"first", "third"}


def test_a_page_that_reads_a_page_is_made_after_it(root):
    made: list[str] = []

    def make(name: str) -> tuple[int, str]:
        made.append(name)
        if name == "first":
            (root / "results/first.csv").write_text("new\n")
        measure(root, name)
        return stale.DONE, ""

    for name in NAMES:
        measure(root, name, seconds={"first": 9.0}.get(name, 1.0))
    (root / "ribbon/law.py").write_text("MODULUS = 5.0\n")
    remake.remake(NAMES, False, make, lambda: Pages(root))
    assert made == ["first", "second"]


def test_what_is_not_here_is_named_with_its_reason(root):
    outcomes = remake.remake(("third",), False, lambda name: (stale.ABSENT, "no auto-07p"), lambda: Pages(root))
    assert outcomes["third"].done == "not here: no auto-07p"
    assert not outcomes["third"].failed


def test_a_change_above_its_error_is_a_finding(root):
    measure(root, "first", 3.0, 0.1)
    record = measure(root, "first", 3.05, 1e-9)
    assert record.changes() == pytest.approx({"modulus": 0.5, "count": 0.0})
    assert stale.findings("first", record) == []
    assert stale.largest(record) == "0.5 (modulus)"
    measure(root, "first", 3.0, 0.01)
    record = measure(root, "first", 3.05, 10.0)
    assert record.changes()["modulus"] == pytest.approx(5.0)
    (said,) = stale.findings("first", record)
    assert "first.modulus: 3.00 -> 3.05" in said
    record = Pages(root).measure("first", lambda out: {"count": Number(8, 0)}, "")
    assert len(stale.findings("first", record)) == 2
    table = stale.summary(Pages(root), {"first": "1 s", "third": ""})
    assert table.count("finding: ") == 2
    assert table.splitlines()[1].startswith("first")


def test_age_counts_from_the_record(root):
    record = measure(root, "first")
    made = datetime.datetime.fromisoformat(record.time)
    assert stale.age(record, made + datetime.timedelta(days=2, hours=3)) == "2 d 3 h"
    assert stale.age(record, made + datetime.timedelta(hours=3, minutes=4)) == "3 h 04 min"


@pytest.mark.parametrize(
    ("value", "error", "key"),
    [(float("nan"), 1.0, "value"), (1.0, float("inf"), "error"), (1.0, -1.0, "error"), (1.0, None, "why")],
)
def test_a_number_without_a_meaning_is_refused(value, error, key):
    with pytest.raises(ValueError, match=key):
        Number(value, error)


def test_what_is_no_mapping_of_numbers_is_refused():
    assert checked(None) == {}
    with pytest.raises(TypeError):
        checked({"a": 1.0})
    for name in ("day", "Two words"):
        with pytest.raises(ValueError):
            checked({name: Number(1.0, 0.0)})


def test_a_template_takes_numbers_by_name(root):
    record = measure(root, "first")
    text = "{first.modulus}, {first.modulus:.1e}, {first.modulus.error}, {first.count:d}, {first.day}; {x} {first}"
    day = record.time[:10]
    assert readme.render(text, {"first": record}) == f"3.00, 3.0e+00, 1.0e-01, 7, {day}; {{x}} {{first}}"
    assert readme.render("{first.remade}", {"first": record}) == f"`python -m tests.validation first`, {day}"
    for wrong in ("{third.modulus}", "{first.nothing}"):
        with pytest.raises(ValueError, match=wrong):
            readme.render(wrong, {"first": record})
    readme.write(Pages(root))
    assert (root / "results/README.md").read_text() == "E = 3.00\n"
    assert (root / "README.md").read_text() == "E = 3.0e+00\n"


def test_what_is_typed_for_a_page_without_data_goes_with_its_first_data(root):
    text = "E = {first.modulus|2.90} +- {first.modulus.error:.1e|2e-1}, {second.count|9}; {first.remade|2026-11-21}\n"
    (root / "results/README.md.in").write_text(text)
    (root / "README.md.in").write_text("{third.count|1}\n")
    assert readme.typed(text) == {"first", "second"}
    assert readme.write(Pages(root)) == []
    shown = "E = 2.90 +- 2e-1, 9; `python -m tests.validation first`, 2026-11-21, before its data were kept\n"
    assert (root / "results/README.md").read_text() == shown
    assert (root / "results/README.md.in").read_text() == text
    day = measure(root, "first").time[:10]
    assert readme.write(Pages(root)) == []
    left = "E = {first.modulus} +- {first.modulus.error:.1e}, {second.count|9}; {first.remade}\n"
    assert (root / "results/README.md.in").read_text() == left
    shown = f"E = 3.00 +- 1.0e-01, 9; `python -m tests.validation first`, {day}\n"
    assert (root / "results/README.md").read_text() == shown
    assert (root / "README.md").read_text() == "1\n"


def test_a_page_whose_template_names_what_nobody_measured_stays_and_says_so(root):
    measure(root, "first")
    (root / "results/README.md").write_text("old\n")
    (root / "results/README.md.in").write_text("{first.height|2} {first.modulus} {third.count}\n")
    said = readme.write(Pages(root))
    assert [line.partition(":")[0] for line in said] == ["results/README.md"] * 2
    assert "first.height" in said[0]
    assert "third.count" in said[1]
    assert (root / "results/README.md").read_text() == "old\n"
    assert (root / "README.md").read_text() == "E = 3.0e+00\n"


def test_pages_that_take_no_times_are_made_two_at_once_and_the_others_alone(root):
    path = root / "tests/validation/room/second.py"
    path.write_text("from time import perf_counter\n" + path.read_text())
    assert [Pages(root).alone(name) for name in NAMES] == [False, True, False]
    path.write_text("ALONE = False\n" + path.read_text())
    assert not Pages(root).alone("second")
    path.write_text(path.read_text().replace("False", "True"))
    assert Pages(root).alone("second")
    running: set[str] = set()
    most: dict[str, int] = {}
    both, turn = threading.Barrier(2, timeout=PATIENCE), threading.Lock()

    def make(name: str) -> tuple[int, str]:
        running.add(name)
        if name != "second":
            both.wait()
        most[name] = len(running)
        if name != "second":
            both.wait()
        with turn:
            measure(root, name)
        running.discard(name)
        return stale.DONE, ""

    outcomes = remake.remake(NAMES, False, make, lambda: Pages(root), jobs=2)
    assert most == {"first": 2, "second": 1, "third": 2}
    assert not any(outcome.failed for outcome in outcomes.values())


@pytest.mark.parametrize(
    ("alone", "files"), [(False, {"mine.md", "put.md"}), (True, {"mine.md", "put.md", "other.md"})]
)
def test_what_a_process_beside_it_writes_is_no_file_of_a_page(root, alone, files):
    path = root / "tests/validation/room/third.py"
    path.write_text(f"ALONE = {alone}\n" + path.read_text())

    def run(out: Path) -> None:
        (out / "mine.md").write_text("1\n")
        (out.parent / "put.md").write_text("2\n")
        (out.parent / "put.md").replace(out / "put.md")
        other = f"open({str(out / 'other.md')!r}, 'w').write('3')"
        subprocess.run([sys.executable, "-c", other], check=True)

    record = Pages(root).measure("third", run, "")
    assert set(record.files) == {f"results/{name}" for name in files}


def test_pages_that_were_made_before_do_not_count_as_a_modified_tree(root):
    def git(*arguments: str) -> None:
        names = ("-c", "user.name=x", "-c", "user.email=x")
        subprocess.run(["git", "-C", str(root), *names, *arguments], check=True, capture_output=True)

    assert Pages(root).modified() is None
    git("init")
    git("add", "-A")
    git("commit", "-m", "x")
    (root / "results/first.csv").write_text("2\n")
    assert Pages(root).modified() is False
    (root / "ribbon/law.py").write_text("MODULUS = 4.0\n")
    assert Pages(root).modified() is True


def test_a_row_is_measured_once_and_again_under_other_code(tmp_path):
    kept, asked = KeptRows.of(tmp_path, "compare.studies.limits"), []

    def make() -> dict[str, float]:
        asked.append(1)
        return {"x": 1 / 3}

    assert not kept.has("one")
    assert kept.row("one", make) == kept.row("one", make) == {"x": 1 / 3}
    assert kept.has("one")
    assert KeptRows.of(tmp_path, "compare.studies.cost").row("one", make) == {"x": 1 / 3}
    assert len(asked) == 2


def test_an_unknown_name_ends_with_2(capsys):
    assert main(["--stale", "nothing"]) == 2
    assert "nothing" in capsys.readouterr().err
