"""results/README.md: every number of an entry stands on a page that it links, with its command and its day."""

from __future__ import annotations

import json
import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import pytest

from compare.battery.groups import GROUPS, cases_of
from compare.pages.limits import answer
from compare.studies.limits import Thresholds, quick
from tests.docs_blocks import ROOT
from tests.validation import readme
from tests.validation.record import Pages
from tests.validation.workbench.drawn import unseen
from tests.validation.workbench.unseen import BOLD, CAUTIOUS, FALSELY_SAFE, OUTCOMES, SAME

RESULTS = ROOT / "results"
PAGE = RESULTS / "README.md"
#: Not preceded by a letter, a digit or a stroke (table 5.1, w/l = 1/30, Q2 100 x 8 are names of things).
NUMBER = re.compile(r"(?<![\w./^])[-+]?\d+\.?\d*(?:e[-+]?\d+)?(?![\w/]|\.\d)")
KINDS = ("number", "error", "remade by")


@dataclass(frozen=True)
class Entry:
    """A heading of the third level and what stands below it."""

    title: str
    text: str

    def lines(self, kind: str) -> str:
        """The item `- KIND: ...`, joined to one line; empty where there is none."""
        found = re.search(rf"^- {kind}\b(.*?)(?=^- |^$|\Z)", self.text, re.M | re.S)
        return " ".join(found[1].split()) if found else ""

    def pages(self) -> list[Path]:
        return [RESULTS / name for name in re.findall(r"\]\(([^)#]*\.md)\)", self.lines("remade by"))]

    def numbers(self) -> list[str]:
        """Numbers with a point or an exponent anywhere, and every one of the items "number" and "error"."""
        prose = re.sub(r"^- remade by.*|!?\[[^\]]*\]\([^)]*\)|`[^`]*`", "", self.text, flags=re.M)
        decimal = [n for n in NUMBER.findall(prose) if re.search(r"[.e]", n.rstrip("."))]
        stated = NUMBER.findall(re.sub(r"`[^`]*`", "", self.lines("number") + " " + self.lines("error")))
        return [n.rstrip(".").removeprefix("+") for n in (*decimal, *stated)]


def entries(text: str) -> list[Entry]:
    parts = re.split(r"^### (.*)$", re.sub(r"^## .*$", "", text, flags=re.M), flags=re.M)[1:]
    return [Entry(title, body) for title, body in zip(parts[::2], parts[1::2], strict=True)]


ENTRIES = entries(PAGE.read_text())


def missing(entry: Entry) -> list[str]:
    """Numbers of the entry that its pages do not have."""
    there = "\n".join(page.read_text() for page in entry.pages()).replace(",", "")
    return [n for n in entry.numbers() if not re.search(rf"(?<![\d.]){re.escape(n)}(?![\d]|\.\d)", there)]


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry.title)
def test_an_entry_is_whole_and_its_numbers_are_on_its_pages(entry):
    assert all(entry.lines(kind) for kind in KINDS), [kind for kind in KINDS if not entry.lines(kind)]
    assert entry.pages()
    assert len(entry.numbers()) >= 2
    assert missing(entry) == []


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry.title)
def test_command_and_day_are_those_of_the_pages(entry):
    shown = entry.lines("remade by")
    (day,) = re.findall(r"20\d\d-\d\d-\d\d", shown)
    names = re.findall(r"`python -m tests\.validation ([a-z_0-9 ]+)`", shown)[0].split()
    for page in entry.pages():
        text = page.read_text()
        assert re.search(rf"python -m tests\.validation ({'|'.join(names)})\b", text), page.name
        made = re.findall(r"^Made (20\d\d-\d\d-\d\d)", text, re.M)
        assert made in ([day], []), page.name


@pytest.mark.parametrize("page", readme.RENDERED)
def test_a_page_is_what_its_template_and_the_data_give(page):
    """After a change of template or data: python -m tests.validation --readme."""
    assert (ROOT / page).read_text() == readme.rendered(Pages(), page)


@pytest.mark.parametrize("page", readme.RENDERED)
def test_nothing_is_typed_for_a_page_that_has_data(page):
    """python -m tests.validation --readme takes it out of the template."""
    typed = readme.typed(readme.template(ROOT / page).read_text())
    assert [name for name in sorted(typed) if Pages().read(name) is not None] == []


def test_every_page_of_results_has_its_entry():
    named = {page.resolve() for entry in ENTRIES for page in entry.pages()}
    pages = {page for page in RESULTS.rglob("*.md") if page != PAGE and page.name != "table.md"}
    assert {page.name for page in pages if page.resolve() not in named} == set()


def test_a_wrong_number_is_seen():
    (first, *_) = ENTRIES
    assert missing(first) == []
    assert (
        missing(Entry(first.title, first.text.replace("slope 0.63", "slope 0.64"))) == ["0.64"] * 2
    )  # as a decimal and as stated
    assert "17" in missing(Entry("x", "- number: 17 of 18\n- error: 1\n- remade by [t](curl_4_3/README.md)\n"))


def test_the_promise_of_readme_is_the_number_that_was_counted():
    """`limits --quick` on the unseen scenes: counts of results/unseen.json, which its rows bear out."""
    data = json.loads((RESULTS / "unseen.json").read_text())
    found = Counter(row["outcome"] for row in data["scenes"])
    assert {name: data["counts"][name] for name in OUTCOMES} == {name: found[name] for name in OUTCOMES}
    line = next(line for line in (ROOT / "README.md").read_text().splitlines() if "results/unseen.md" in line)
    promised = [int(number) for number in re.findall(r"\b\d+\b", line.split("]", maxsplit=1)[0])]
    counts = data["counts"]
    assert promised == [
        counts["scenes"], counts["judged"], *(counts[name] for name in (SAME, CAUTIOUS, BOLD, FALSELY_SAFE)),
    ]  # fmt: skip


def test_an_unseen_scene_gives_its_row_again():
    """The first of them that was held at one end and estimated good: the estimate of today is that of the page."""
    data = json.loads((RESULTS / "unseen.json").read_text())
    row = next(row for row in data["scenes"] if row["estimated"] == "good")
    estimates = quick(dict(unseen())[row["name"]], Thresholds())
    assert answer(estimates).grade == row["estimated"]
    assert estimates[0].distance == pytest.approx(row["estimate"], rel=1e-4)


def test_readme_counts_the_ladders_of_the_battery():
    (count,) = re.findall(r"`ribbonbench battery`, (\d+) ladders", (ROOT / "README.md").read_text())
    assert int(count) == sum(len(cases_of(group)) for group in GROUPS)
