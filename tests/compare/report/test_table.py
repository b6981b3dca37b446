"""Tables as data: kinds, what is refused, the one dialect of CSV, what a terminal shows."""

from __future__ import annotations

import csv
import io

import numpy as np
import pytest

from compare.page.csv import as_csv
from compare.page.markdown import as_markdown
from compare.page.table import LAST, Column, Table
from compare.record.quantity import Quantity

COLUMNS = (
    Column("ratio", "w/h", kind="digits"),
    Column("status", "shell", kind="word"),
    Column("error", "error", "l", "exponent:1", legend="of the shell"),
    Column("claimed", "models differ", kind="truth", words={"false": "not shown"}),
    Column("hidden", "hidden", "s", "seconds:2", rank=LAST, legend="of no use on a terminal"),
)
ROWS = ((10.0, "converged", 1.0 / 3.0, True, 0.5), (20.0, "a, b", None, False, 2.0 / 3.0))
TABLE = Table("T", COLUMNS, ROWS, "Lengths in l.", (("ribbon", None, 2e-9, None, None),))


@pytest.mark.parametrize(
    ("kind", "value", "text"),
    [
        ("digits", 20.0, "20"),
        ("digits:3", 1234.5, "1.23e+03"),
        ("exponent:2", 1.016e-5, "1.02e-05"),
        ("decimals:2", -0.0, "0.00"),
        ("decimals:2", (0.5, -0.125, 2), "0.50 -0.12 2.00"),
        ("share", 0.0123456, "1.23"),
        ("percent:1", 0.0123456, "1.2"),
        ("seconds:2", 0.1234, "0.12"),
        ("milliseconds:3", 0.12345, "123"),
        ("microseconds:1", 1.2345e-4, "123.4"),
        ("interval", (0.5, 2.0), "0.5 to 2"),
        ("interval", 0.02, "0.02"),
        ("integer", 12345678, "12345678"),
        ("sizes", (100, 8), "100 x 8"),
        ("truth", True, "yes"),
        ("truth", False, "no"),
        ("word", "wunderlich", "wunderlich"),
        ("plain", 1234567, "1234567"),
        ("plain", 0.1, "0.1"),
        ("digits", float("nan"), "-"),
        *((kind, None, "-") for kind in ("digits", "word", "truth", "integer", "plain")),
    ],
)
def test_how_a_reader_sees_a_value(kind, value, text):
    assert Column("k", "h", kind=kind).text(value) == text


@pytest.mark.parametrize(
    ("kind", "value"),
    [
        ("exponent:2", "1.02e-05"), ("exponent:2", True), ("share", "1.23"), ("digits", ("a", "b")), ("integer", 1.5),
        ("integer", "3"), ("truth", "yes"), ("truth", 1), ("word", 1.0), ("plain", {"a": 1}), ("sizes", "8 x 2"),
    ],
)  # fmt: skip
def test_text_in_the_place_of_a_value_is_refused(kind, value):
    with pytest.raises(ValueError, match=r"is no|value"):
        Table("T", (Column("k", "h", kind=kind),), ((value,),))


def test_rows_and_keys_must_fit():
    with pytest.raises(ValueError, match="cells"):
        Table("T", COLUMNS, ((1.0,),))
    with pytest.raises(ValueError, match="cells"):
        Table("T", COLUMNS, below=(("ribbon",),))
    with pytest.raises(ValueError, match="one key"):
        Table("T", (Column("a", "A"), Column("a", "B")))
    with pytest.raises(ValueError, match="kind"):
        Column("a", "A", kind=".2e")


def test_csv_has_one_dialect():
    text = as_csv(TABLE)
    assert text.splitlines()[0] == "ratio,status,error,claimed,hidden"
    first, second = csv.DictReader(io.StringIO(text))  # what stands below is not in it
    assert float(first["error"]) == 1.0 / 3.0  # every digit
    assert float(second["hidden"]) == 2.0 / 3.0
    assert (first["claimed"], second["claimed"]) == ("true", "false")
    assert second["error"] == ""
    assert second["status"] == "a, b"
    assert "\r" not in text


def test_numpy_is_written_as_python():
    row = (np.float64(0.1), np.str_("x"), np.bool_(True), np.int64(3), np.array([0.5, 1.5]))
    columns = [Column(f"{k}", "", kind=kind) for k, kind in enumerate(("digits", "word", "truth", "integer", "digits"))]
    assert as_csv(Table("T", tuple(columns), (row,))).splitlines()[1] == '0.1,x,true,3,"[0.5, 1.5]"'


def test_a_column_takes_its_own_value():
    quantities = Quantity("a", "A", of=lambda item: item.real), Quantity("b", "B", of=lambda item: item.imag)
    table = Table.of("T", quantities, [1 + 2j, 3 + 4j])
    assert (table.values("a"), table.values("b")) == ((1.0, 3.0), (2.0, 4.0))
    assert table.select(("b", "a")).records() == [{"b": 2.0, "a": 1.0}, {"b": 4.0, "a": 3.0}]
    assert Table.of_records("T", table.columns, [{"b": 5, "c": 6}]).rows == ((None, 5),)


def test_markdown_and_its_sides():
    lines = as_markdown(TABLE).splitlines()
    assert lines[1] == "|---:|---|---:|---:|---:|"
    assert lines[3] == "| 20 | a, b | - | not shown | 0.67 |"
    assert lines[4] == "| ribbon |  | 2.0e-09 |  |  |"
    assert lines[-1] == TABLE.explanation()
    plain = Table("T", (Column("a", "a|b"), Column("n", "n")), (("<b>\nx|y", "1e3"), ("2", 5)))
    assert as_markdown(plain).splitlines() == ["| a\\|b | n |", "|---|---:|", "| &lt;b> x\\|y | 1e3 |", "| 2 | 5 |"]


def test_no_text_is_a_formula():
    """A spreadsheet computes what begins with =, +, - or @; numbers stay numbers."""
    texts = ("=1+1", "+SUM(A1)", "@x", "-cmd|' /c calc'!A1", " =1", "-0.5", "+1e3", "plain", "a=b")
    table = Table("T", (Column("a", "A"),), tuple((text,) for text in texts))
    found = [row[0] for row in csv.reader(io.StringIO(as_csv(table)))][1:]
    assert found == ["'=1+1", "'+SUM(A1)", "'@x", "'-cmd|' /c calc'!A1", "' =1", "-0.5", "+1e3", "plain", "a=b"]
