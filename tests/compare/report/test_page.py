"""Pages as data: stored and read back, tables as text."""

from __future__ import annotations

import json

import pytest

from compare.page.markdown import markdown_text as literal
from compare.page.page import (
    FORMAT,
    PAGE,
    Page,
    Picture,
    Surface,
    read_page,
    write_page,
)
from compare.page.table import LAST, USUAL, Column, Table
from compare.page.verdict import Verdict
from ribbonbench.errors import BadInput


def page():
    columns = (
        Column("a", "A", "l", "decimals:2", legend="what a is"),
        Column("b", "B", rank=LAST, words={"true": "ja"}),
        Column("c", "C", "l", "decimals:1"),
    )
    rows = ((1.0, "x", (0.5, -1.0, 2.0)), (None, True, None))
    table = Table("T", columns, rows, "legend", ((0.0, None, None),))
    return Page(
        "solve", "Title", Verdict("One", "poor"), ("Two.",), (table,), (Picture("p.png", "alt", "caption"),),
        (Surface("s.vtu", "s", "shell", "omega", 20.0),), {"f": "what"}, "scene", (0.0, 0.0, 1.0), {"time": "now"},
        "again",
    )  # fmt: skip


def test_a_page_comes_back_as_it_was(tmp_path):
    write_page(tmp_path, page())
    assert read_page(tmp_path) == page()


#: A table of page.json as versions before the second format wrote it: of a comparison, made text already, and with
#: formats.
OLD = [
    {"title": "Ribbon against shell", "headings": ["w/h", "shell", "distance"], "formats": [],
     "legend": "Lengths in l.", "rows": [["10", "converged", "1.01e-01"], ["ribbon", "converged", ""]]},
    {"title": "Limits", "headings": ["width", "level", "distance % l", "n", "ok", "s", "bound"], "legend": "",
     "formats": ["g", "", ".2f", "d", "", ".3g", ""],
     "rows": [[0.05, "fair", 5.7412, 12, True, 0.12345, "0.1 to 0.2"], [0.2, None, None, None, None, 20.0, 0.5]]},
]  # fmt: skip


def test_a_page_of_the_first_format_is_drawn_as_it_was(tmp_path):
    write_page(tmp_path, page())
    data = json.loads((tmp_path / PAGE).read_text()) | {"format": 1, "tables": OLD, "verdict": ["One.", "Two."]}
    (tmp_path / PAGE).write_text(json.dumps(data))
    assert read_page(tmp_path).verdict is None
    assert read_page(tmp_path).sentences == ("One.", "Two.")
    first, second = read_page(tmp_path).tables
    assert [column.heading for column in first.columns] == OLD[0]["headings"]
    assert first.texts() == [("10", "converged", "1.01e-01"), ("ribbon", "converged", "")]
    assert first.explanation() == "Lengths in l."
    assert second.texts() == [
        ("0.05", "fair", "5.74", "12", "yes", "0.123", "0.1 to 0.2"), ("0.2", "-", "-", "-", "-", "20", "0.5"),
    ]  # fmt: skip
    assert second.right_aligned() == [True, False, True, True, True, True, False]


def test_a_page_of_the_second_format_keeps_what_a_terminal_had_no_room_for(tmp_path):
    write_page(tmp_path, page())
    data = json.loads((tmp_path / PAGE).read_text()) | {"format": 2, "verdict": []}
    for column in data["tables"][0]["columns"]:
        column["terminal"] = column.pop("rank") != LAST
    (tmp_path / PAGE).write_text(json.dumps(data))
    assert read_page(tmp_path).tables == page().tables
    assert [column.rank for column in read_page(tmp_path).tables[0].columns] == [USUAL, LAST, USUAL]


def test_a_page_of_a_later_format_is_refused(tmp_path):
    write_page(tmp_path, page())
    data = json.loads((tmp_path / PAGE).read_text()) | {"format": FORMAT + 1}
    (tmp_path / PAGE).write_text(json.dumps(data))
    with pytest.raises(BadInput, match="format"):
        read_page(tmp_path)


def test_a_surface_without_its_ratio_is_read(tmp_path):
    write_page(tmp_path, page())
    data = json.loads((tmp_path / PAGE).read_text())
    del data["surfaces"][0]["width_to_thickness"]
    (tmp_path / PAGE).write_text(json.dumps(data))
    assert read_page(tmp_path).surfaces == (Surface("s.vtu", "s", "shell", "omega", None),)


@pytest.mark.parametrize(
    "change",
    [
        {"tables": 3},
        {"verdict": {"text": "x", "grade": "superb"}},
        {"sentences": None},
        {"surfaces": [{"no": 1}]},
        {"pictures": None},
        {"again": 1, "tables": [{}]},
        {"format": 1},
    ],
)
def test_a_damaged_page(tmp_path, change):
    write_page(tmp_path, page())
    data = json.loads((tmp_path / PAGE).read_text()) | change
    (tmp_path / PAGE).write_text(json.dumps(data))
    with pytest.raises(BadInput, match="damaged"):
        read_page(tmp_path)


def test_markdown_takes_words_literally():
    assert literal("a\n b") == "a b"
    assert literal("<script> & ![x](y) `c` *d*") == "&lt;script> &amp; !\\[x](y) \\`c\\` \\*d\\*"
