"""Closed bands in the 3-D view: how their ends meet, and one normal where points are one."""

from __future__ import annotations

import numpy as np
import pytest

from compare.page.page import Surface
from compare.pages.export.vtu import grid_sheet, seam
from compare.pages.report.surfaces import as_data, view


def band(half_turns, end=1.0):
    """A band of so many half turns about a circle; its exact unit normals at v = 0."""
    s, v = np.meshgrid(np.linspace(0.0, end, 121), np.linspace(-0.02, 0.02, 5), indexing="ij")
    turn, angle = 2.0 * np.pi * s, np.pi * half_turns * s
    out = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=-1)
    up = np.broadcast_to([0.0, 0.0, 1.0], out.shape)
    across = np.cos(angle)[..., None] * up + np.sin(angle)[..., None] * out
    points = out / (2.0 * np.pi) + v[..., None] * across
    return grid_sheet(points, {"S": s, "v": v}), (np.cos(angle)[..., None] * out - np.sin(angle)[..., None] * up)[:, 2]


@pytest.mark.parametrize(("half_turns", "expected"), [(0, 1), (1, -1), (2, 1), (3, -1)])
def test_ends_that_meet_have_one_normal(half_turns, expected):
    sheet, exact = band(half_turns)
    grid = sheet.points.reshape(121, 5, 3)
    assert seam(grid) == expected
    normals = sheet.normals().reshape(121, 5, 3)
    np.testing.assert_allclose(normals[0], expected * normals[-1, ::expected], atol=1e-12)
    along = np.abs(np.sum(normals[:, 2] * exact, axis=1))
    assert along[0] > 0.999
    (entry,) = as_data(view([(Surface("x.vtu", "x", "ribbon"), sheet)], None, 8000), "")["surfaces"]
    assert entry["seam"] == expected


def test_an_open_strip_has_none():
    sheet, _ = band(1, end=0.9)
    assert seam(sheet.points.reshape(121, 5, 3)) == 0
    (entry,) = as_data(view([(Surface("x.vtu", "x", "ribbon"), sheet)], None, 8000), "")["surfaces"]
    assert entry["seam"] == 0
