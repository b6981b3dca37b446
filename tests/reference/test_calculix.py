"""Decks for CalculiX; where the program is installed (Debian: calculix-ccx), its numbers beside our shell's."""

from __future__ import annotations

import re

import numpy as np
import pytest

from tests.reference import calculix
from tests.reference.calculix import OnEdge

#: Our shell's critical Gamma (results/shell_lateral.md, finest meshes), nu = 0.35, h / l = 1e-3.
OURS = {0.02: 13.7688, 0.05: 14.1917, 0.1: 14.8258}


def block(deck, keyword):
    """Rows of numbers below the first line that begins with the keyword."""
    text = deck.split(keyword, 1)[1].split("\n", 1)[1].split("*", 1)[0]
    return [[float(x) for x in row.split(",") if x.strip()] for row in text.strip().splitlines()]


@pytest.mark.parametrize("element", ["S8R", "C3D20R"])
def test_mesh(element):
    strip = OnEdge(0.05, 1e-3, 0.35, element, (10, 6))
    deck = strip.deck()
    nodes = {int(row[0]): np.array(row[1:]) for row in block(deck, "*NODE,")}
    numbers = [int(x) for row in block(deck, "*ELEMENT,") for x in row]
    per = {"S8R": 8, "C3D20R": 20}[element]
    elements = np.array(numbers).reshape(60, per + 1)[:, 1:]
    assert set(elements.ravel()) == set(nodes)  # no node is loose
    points = np.array([[nodes[n] for n in row] for row in elements])
    x = np.array(list(nodes.values()))
    assert np.ptp(x, axis=0) == pytest.approx([1.0, 0.0 if per == 8 else 1e-3, 0.05])
    one, two, four = (points[:, k] - points[:, 0] for k in (1, 3, 4))
    if per == 8:
        area = np.linalg.norm(np.cross(one, two), axis=1)
        assert area.sum() == pytest.approx(0.05)
    else:
        volume = np.einsum("ij,ij->i", np.cross(one, two), four)
        assert volume.min() > 0  # corners are counted as the program does
        assert volume.sum() == pytest.approx(0.05e-3)
    corners = 4 if per == 8 else 8  # each midside node is the middle of its edge
    edges = [(0, 1), (1, 2), (2, 3), (3, 0)]
    if per == 20:
        edges += [(4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
    for k, (a, b) in enumerate(edges):
        np.testing.assert_allclose(points[:, corners + k], 0.5 * (points[:, a] + points[:, b]), atol=1e-14)
    held = [nodes[int(n)] for (n,) in block(deck, "*NSET, NSET=HELD")]
    assert {float(p[0]) for p in held} == {0.0}
    assert len(held) == sum(p[0] == 0.0 for p in nodes.values())


def test_small_elements_where_the_twist_turns_around():
    along, across = OnEdge(0.05, 1e-3, 0.35, "S8R", (20, 8))._places()
    assert np.diff(along[::2])[:3] == pytest.approx([0.5e-3, 1e-3, 2e-3])
    assert np.diff(across[::2])[[0, 1, -2, -1]] == pytest.approx([0.5e-3, 1e-3, 1e-3, 0.5e-3])
    assert along[-1] == 1.0
    assert across[-1] == -across[0] == 0.025


def test_a_tip_needs_a_middle_node():
    with pytest.raises(ValueError, match="even"):
        calculix.deflection(OnEdge(0.05, 1e-3, 0.35, "C3D20R", (20, 7)), 1.0, None, 0.0)


def test_failure_is_told(tmp_path, monkeypatch):
    program = tmp_path / "ccx"
    program.write_text("#!/bin/sh\necho '*ERROR reading the deck'\n")
    program.chmod(0o755)
    monkeypatch.setattr(calculix, "PROGRAM", str(program))
    with pytest.raises(calculix.Failed, match=re.escape("*ERROR reading the deck")):
        calculix.run("", tmp_path / "work", "critical")


@pytest.mark.validate
@pytest.mark.skipif(not calculix.available(), reason="CalculiX is not installed (Debian: calculix-ccx)")
@pytest.mark.parametrize("width", OURS)
def test_critical_weights_are_our_shells(width, tmp_path):
    found = calculix.critical(OnEdge(width, 1e-3, 0.35, "C3D20R", (60, 8)), tmp_path)
    assert found == pytest.approx(OURS[width], rel=2e-3)


@pytest.mark.validate
@pytest.mark.skipif(not calculix.available(), reason="CalculiX is not installed (Debian: calculix-ccx)")
def test_deflection_is_our_shells(tmp_path):
    """w = 5.10 mm, l = 3.5 Leg (results/lateral_torsional); on this coarse mesh 0.3 % less."""
    l = 62.3 * 3.5
    found = calculix.deflection(OnEdge(5.10 / l, 0.0925 / l, 0.4, "C3D20R", (40, 6)), 0.84 * 3.5**3, tmp_path, 0.1)
    assert 3.5 * found[1] == pytest.approx(1.8393, rel=4e-3)
