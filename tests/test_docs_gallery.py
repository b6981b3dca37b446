"""docs/gallery.md: every shipped scene with its picture, its command and a headline number that is still so."""

from __future__ import annotations

import re
import shlex
from typing import Any

import numpy as np
import pytest
from PIL import Image

from compare.commands.parser import whole as _parser
from compare.models import solve as solve_scene
from compare.models.base import Options
from compare.models.scope import has_shell
from compare.scene.scene import load, shipped
from tests.docs_blocks import DOCS
from tests.validation.record import Pages
from tests.validation.workbench.gallery import LARGEST, PIXELS
from tests.validation.workbench.gallery_headlines import HEADLINES, written

PAGE = (DOCS / "gallery.md").read_text()


def section(name: str) -> str:
    """The scene's part of the page."""
    found = re.search(rf"^## {name}\n(.*?)(?=^## |\Z)", PAGE, re.S | re.M)
    assert found, f"{name} is not on the page: python -m tests.validation gallery"
    return found[1]


def headline(name: str) -> tuple[str, str]:
    """(quantity, number) as printed."""
    found = re.search(r"^\*\*(.*): (-?[\d.]+)\*\*", section(name), re.M)
    assert found, name
    return found[1], found[2]


def test_every_scene_is_on_the_page_once():
    assert sorted(re.findall(r"^## (\w+)$", PAGE, re.M)) == sorted(shipped())
    assert set(HEADLINES) == set(shipped())


@pytest.mark.parametrize("name", sorted(shipped()))
def test_picture_command_and_source(name):
    text = section(name)
    file = re.search(r"!\[(.+)\]\((.*)\)", text)
    assert file
    path = DOCS / file[2]
    assert load(name).title in file[1]
    assert path.stat().st_size < LARGEST
    with Image.open(path) as image:
        pixels = np.asarray(image.convert("RGB"))
    assert max(pixels.shape[:2]) <= PIXELS
    drawn = (pixels < 200).any(axis=2).mean()
    assert 0.001 < drawn < 0.9, f"{drawn:.1%} of the picture is drawn"
    parsed = 0
    for command in re.findall(r"`(ribbonbench [^`]*)`", text):
        options = _parser().parse_args(shlex.split(command)[1:])
        assert options.scene == name
        parsed += 1
    assert parsed == 1 + has_shell(load(name))
    quantity, _ = headline(name)
    assert quantity == HEADLINES[name].quantity
    assert HEADLINES[name].beside(Pages()) in text
    assert f"{load(name).title}. " in text


@pytest.mark.parametrize("name", ["cantilever", "curl_4_3", "arc_5_1", "start_5_3_3_2", "daisy_5g"])
def test_headline_numbers_are_still_so(name):
    e: Any
    if name.startswith("daisy"):
        e = solve_scene(load(name), "elastica", options=Options(error=True))
        assert e.word == "converged"
    else:
        e = solve_scene(load(name), "ribbon").native
        assert e.ok
    printed = headline(name)[1]
    unit = 10.0 ** -len(printed.partition(".")[2])  # of the last digit
    assert abs(HEADLINES[name].value(e) - float(printed)) < 0.6 * unit


FLOAT = re.compile(r"(?<![\w.])-?\d+\.\d+(?:e[-+]?\d+)?(?![\w.])")


@pytest.mark.parametrize("name", sorted(shipped()))
def test_what_the_headline_stands_beside_is_measured(name):
    """Every decimal number of the sentence is a number of a page that it links, rounded to its digits."""
    source = HEADLINES[name].beside(Pages())
    pages = [(DOCS / target).read_text() for target in re.findall(r"\]\((\.\./results/[^)]*)\)", source)]
    assert pages or "`tests/" in source
    known = np.array([float(number) for page in pages for number in FLOAT.findall(page)])
    sentence = re.sub(r"reading [AB] of [\d.]+|table [\d.]+|\]\([^)]*\)|`[^`]*`", "", source)
    for number in FLOAT.findall(sentence):
        if not pages:
            continue
        digits, _, power = number.partition("e")
        half = 0.5 * 10.0 ** (int(power or 0) - len(digits.partition(".")[2]))
        assert np.abs(known - float(number)).min() <= half * (1 + 1e-9), number


def test_what_stands_beside_follows_the_pages():
    """With other numbers of a page the gallery says others, and as the data are it is what it is."""
    page = (DOCS / "gallery.md").read_text()
    assert written(page, Pages()) == page
    told = HEADLINES["moebius_wide"].beside(Pages())
    assert written(page.replace(told, told.replace(".", ";", 1)), Pages()) == page
