"""Pages as data: stored and read back, tables as text."""

from __future__ import annotations

import json

import pytest

from compare.errors import BadInput
from compare.page.page import PAGE, Page, Picture, Surface, Table, as_markdown, read_page, right_aligned, write_page
from compare.page.page import markdown_text as literal


def page():
    table = Table("T", ("a", "b"), ((1.0, "x"), (None, True)), (".2f", ""), "legend")
    return Page(
        "solve", "Title", ("One.", "Two."), (table,), (Picture("p.png", "alt", "caption"),),
        (Surface("s.vtu", "s", "shell", "omega", 20.0),), {"f": "what"}, "scene", (0.0, 0.0, 1.0), {"time": "now"},
        "again",
    )  # fmt: skip


def test_a_page_comes_back_as_it_was(tmp_path):
    write_page(tmp_path, page())
    assert read_page(tmp_path) == page()


def test_a_surface_without_its_ratio_is_read(tmp_path):
    write_page(tmp_path, page())
    data = json.loads((tmp_path / PAGE).read_text())
    del data["surfaces"][0]["width_to_thickness"]
    (tmp_path / PAGE).write_text(json.dumps(data))
    assert read_page(tmp_path).surfaces == (Surface("s.vtu", "s", "shell", "omega", None),)


@pytest.mark.parametrize(
    "change", [{"tables": 3}, {"surfaces": [{"no": 1}]}, {"pictures": None}, {"again": 1, "tables": [{}]}]
)
def test_a_damaged_page(tmp_path, change):
    write_page(tmp_path, page())
    data = json.loads((tmp_path / PAGE).read_text()) | change
    (tmp_path / PAGE).write_text(json.dumps(data))
    with pytest.raises(BadInput, match="damaged"):
        read_page(tmp_path)


def test_tables_must_fit():
    with pytest.raises(ValueError, match="cells"):
        Table("T", ("a", "b"), ((1,),))
    with pytest.raises(ValueError, match="formats"):
        Table("T", ("a",), ((1,),), ("", ""))


def test_text_and_sides():
    rows = ((10, True, 1.5e-7, "1.2e-3"), (20.5, None, None, "-"))
    table = Table("T", ("w/h", "ok", "error", "text"), rows, ("g", "", ".1e", ""))
    assert table.texts() == [("10", "yes", "1.5e-07", "1.2e-3"), ("20.5", "-", "-", "-")]
    assert right_aligned(table) == [True, True, True, True]
    assert right_aligned(Table("T", ("a", "b"), (("x", 1), ("2", 3)))) == [False, True]
    assert right_aligned(Table("T", ("a", "b"), ())) == [True, True]
    markdown = as_markdown(Table("T", ("a|b",), (("<b>\nx|y",),)))
    assert markdown.splitlines() == ["| a\\|b |", "|---|", "| &lt;b> x\\|y |"]


def test_markdown_takes_words_literally():
    assert literal("a\n b") == "a b"
    assert literal("<script> & ![x](y) `c` *d*") == "&lt;script> &amp; !\\[x](y) \\`c\\` \\*d\\*"
