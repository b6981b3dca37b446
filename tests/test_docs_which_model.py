"""docs/which_model.md: every number in a table stands on a page of results that its row links."""

from __future__ import annotations

import re

from tests.docs_blocks import DOCS

PAGE = (DOCS / "which_model.md").read_text()
NUMBER = re.compile(r"-?\d+\.\d+(?:e[-+]?\d+)?")


def rows() -> list[tuple[str, list[str]]]:
    """Rows of tables with the pages of results they link."""
    lines = [line for line in PAGE.splitlines() if line.startswith("|") and "](../results/" in line]
    return [(line, re.findall(r"\]\((\.\./results/[^)]*)\)", line)) for line in lines]


def test_numbers_of_the_tables_are_measured():
    checked = 0
    for line, targets in rows():
        pages = "\n".join((DOCS / target).read_text() for target in targets)
        cells = [cell.strip() for cell in line.strip("|").split("|")][1:]
        for cell in cells:
            for number in NUMBER.findall(re.sub(r"\[.*", "", cell)):
                assert re.search(rf"(?<![\d.]){re.escape(number)}(?![\d.])", pages), f"{number}: {line}"
                checked += 1
    assert checked >= 30


def test_numbers_in_sentences_with_a_link_are_measured():
    """Those in scientific notation, in paragraphs that link a page of results."""
    checked = 0
    for paragraph in re.split(r"\n\n+", PAGE):
        targets = re.findall(r"\]\((\.\./results/[^)]*)\)", paragraph)
        if paragraph.startswith("|") or not targets:
            continue
        pages = "\n".join((DOCS / target).read_text() for target in targets)
        for number in re.findall(r"\d\.\d+e-\d\d", paragraph):
            assert number in pages, f"{number}: {targets}"
            checked += 1
    assert checked >= 4


def test_the_measured_hit_rate_is_there_with_its_false_safe_verdicts():
    rows = [line for line in PAGE.split("\n") if "limits/README.md" in line]
    assert "false safe" in PAGE
    assert len(rows) == 3
    measured = (DOCS.parent / "results" / "limits" / "README.md").read_text()
    for row, name in zip(rows, ("grid, edge", "grid, corners", "other scenes"), strict=True):
        numbers = [cell.strip() for cell in row.split("|")[2:8]]
        assert f"| {name} | 1 % | {' | '.join(numbers)} |" in measured
