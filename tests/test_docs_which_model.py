"""docs/which_model.md: every number in a table stands on a page of results that its row links."""

from __future__ import annotations

import re

from tests.docs_blocks import DOCS
from tests.validation.workbench import which_model

PAGE = (DOCS / "which_model.md").read_text()
NUMBER = re.compile(r"-?\d+\.\d+(?:e[-+]?\d+)?")


def test_what_is_made_from_data_is_what_the_data_says():
    """Remake: python -m tests.validation which_model."""
    assert which_model.written(PAGE) == PAGE


def test_finite_is_told_where_it_is_near_the_shell():
    """Nobody is sent to a shell or a rod where `finite` is as near as the shell's own mesh."""
    assert max(abs(which_model.off("finite, straight", width)) for width in (0.05, 0.1)) < 5e-4
    assert max(which_model.distance(scene, "20", "finite") for scene in ("curl_4_3", "curl_4_3_down")) < 2e-3
    for ratio in ("10", "20", "50", "100", "200", "400"):
        wide, near = (which_model.distance("curl_4_3", ratio, model) for model in ("wunderlich", "finite"))
        assert near < 0.1 * wide
    advice = PAGE[PAGE.index("## 5 In one table") :]
    for subject in ("w/h = 10", "from 20 on", "buckling in twist"):
        row = next(line for line in advice.splitlines() if subject in line)
        assert "finite" in row.split("|")[2]


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
