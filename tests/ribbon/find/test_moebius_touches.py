"""A wide Moebius band kept farther from itself than it leaves: pushes beside the change of its energy."""

from __future__ import annotations

import pytest

from tests.validation.ribbon import moebius_touches as band

FEW = 40


def test_the_energy_grows_with_the_distance_kept_as_its_places_push():
    """And the two places are images of each other by half a turn."""
    places = band.pushes(band.touching(0.06, FEW))
    assert len(places) == 2
    (one, facing, push), (other, faced, pushed) = sorted(places)
    assert pushed == pytest.approx(push, rel=1e-6)
    assert (other, faced) == pytest.approx((1.0 - facing + 0.0, 1.0 - one), abs=1e-6)
    assert band.rise(0.06, FEW) == pytest.approx(push + pushed, rel=1e-3)


def test_it_begins_to_push_where_the_free_band_stops_leaving_room():
    left = band.left(band.WIDE, FEW)
    first, second = (band.pushed(kept, FEW) for kept in (0.056, 0.06))
    assert left < 0.056
    begins = 0.056 - first * (0.06 - 0.056) / (second - first)
    assert begins == pytest.approx(left, abs=2e-4)
