"""Every measurement keeps its numbers, and two or more of each page come out again today, within their stated error."""

from __future__ import annotations

import importlib
import math

import pytest

from ribbonbench import sources
from tests.validation.__main__ import NAMES, absent
from tests.validation.number import PROCESSORS, Number
from tests.validation.record import Pages

#: Measurements that keep no numbers yet: this list only becomes shorter.
WAITING: tuple[str, ...] = ()
#: Numbers below this are rounding.
ROUNDED = 1e-9
PAGES = Pages()
#: Pages without a number that could come out again: their modules say why (`NO_PROBES`).
UNPROBED = [name for name in NAMES if PAGES.has(name, "NO_PROBES")]
#: Those that have their probes, and of them those whose data are still to be made (`--remake` takes them as stale).
PROBED = [name for name in NAMES if name not in (*WAITING, *UNPROBED)]
TO_RUN = [name for name in PROBED if PAGES.read(name) is None]
KEPT = [name for name in PROBED if name not in TO_RUN]


def miss(number: Number, value: float) -> float:
    """How many times its error a number that was computed again is away; 1 is the most it may."""
    times = number.apart(value)
    assert times is not None, "a probed number has an error"
    return times


def can_fail(number: Number) -> bool:
    """Whether a number's error leaves something to be seen: it is not above the number, or `PROCESSORS` times that for
    what is rounding."""
    most = PROCESSORS if abs(number.value) < ROUNDED else 1.0
    return number.error is not None and number.error <= most * abs(number.value)


def test_whoever_has_probes_waits_no_longer():
    assert set(WAITING) <= set(NAMES)
    assert [name for name in WAITING if PAGES.has(name, "PROBES")] == []
    assert [name for name in PROBED if not PAGES.has(name, "PROBES")] == []


@pytest.mark.parametrize("name", UNPROBED)
def test_a_page_without_probes_says_why_and_has_no_number_that_could_be_held(name):
    assert not PAGES.has(name, "PROBES")
    assert len(_module(name).NO_PROBES.split()) > 3
    record = PAGES.read(name)
    assert record is None or [number for number in record.numbers.values() if number.error is not None] == []


@pytest.mark.parametrize("name", TO_RUN)
def test_probes_of_a_page_without_data_run(name):
    """Their numbers are held to the data once there are any; until then they come out finite, and are two or more."""
    found = {probe: float(make()) for probe, make in _module(name).PROBES.items()}
    assert len(found) >= 2
    assert [probe for probe, value in found.items() if not math.isfinite(value)] == []


@pytest.mark.parametrize("name", KEPT)
def test_a_page_keeps_its_numbers_and_has_probes_that_can_fail(name):
    record = PAGES.read(name)
    assert record is not None
    assert record.numbers
    assert record.files
    assert record.command == f"python -m tests.validation {name}"
    probed = [record.numbers[probe] for probe in _module(name).PROBES]
    assert len(probed) >= 2
    assert [number for number in probed if not can_fail(number)] == []


@pytest.mark.parametrize("name", KEPT)
def test_probes_come_out_within_their_error(name):
    record = PAGES.read(name)
    assert record is not None
    found = {probe: make() for probe, make in _module(name).PROBES.items()}
    assert {
        probe: (value, str(record.numbers[probe]))
        for probe, value in found.items()
        if not miss(record.numbers[probe], value) <= 1.0
    } == {}


def _module(name: str):
    """A measurement's module; skips where something that it needs from outside is not here."""
    module = PAGES.module(name)
    if (why := absent(module)) is not None:
        pytest.skip(why)
    return importlib.import_module(module)


def test_the_sources_of_a_page_are_those_of_its_module():
    modules = PAGES.modules("series")
    assert {"tests.validation.ribbon.series", "ribbon.element.series", "tests.reference.ribbon_energy"} <= set(modules)
    assert not any(one.startswith(("shellref", "tests.validation.record", "tests.validation.stale")) for one in modules)
    assert "compare/scenes/coil_10_100.toml" in PAGES.modules("coils")
    assert "compare/scenes/daisy_5g.toml" not in PAGES.modules("coils")
    assert {f"compare/scenes/{name}.toml" for name in ("daisy_5g", "tape_4_1")} <= set(PAGES.modules("gallery"))
    assert set(sources.PACKAGES) == {"ribbonbench", "ribbon", "shellref", "compare"}


@pytest.mark.parametrize(
    ("number", "value", "holds"),
    [
        (Number(1.0, 1e-3), 1.0009, True),
        (Number(1.0, 1e-3), 1.0011, False),
        (Number(12, 0), 12, True),
        (Number(12, 0), 13, False),
        (Number(0.0, 0.0), 1e-300, False),
        (Number(3.0, 0.0), 3.0 + 4e-16, True),
        (Number(1.0, 1e-3), float("nan"), False),
    ],
)
def test_a_wrong_number_is_seen(number, value, holds):
    assert (miss(number, value) <= 1.0) == holds


def test_a_probe_that_cannot_fail_is_seen():
    assert can_fail(Number(1e-12, 9e-12))
    assert can_fail(Number(7, 0))
    assert not can_fail(Number(1e-3, 2e-3))
    assert not can_fail(Number(1e-12, 1e-10))
    assert not can_fail(Number(3.0, None, why="a time"))
