"""The beam whose clamp holds warping: against the classical numbers without it, and the shell that it explains."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.reference.warping_cantilever import critical, torsion
from tests.validation.record import Pages

STRIP = (30.0, 0.5, 4.0, 1e6, 0.3)


def test_without_warping_it_is_the_classical_one():
    """4.0126 and 10.246 times sqrt(E I_y G J) / l^2 (Timoshenko and Gere, section 6.3)."""
    length, b, h, young, poisson = STRIP
    unit = math.sqrt(young * h * b**3 / 12.0 * young / (2.0 * (1.0 + poisson)) * torsion(b, h)) / length**2
    np.testing.assert_allclose(critical(*STRIP, warping=False, bends=False) / unit, [4.0126, 10.2461], rtol=1e-4)


def test_held_warping_counts_less_the_longer_the_beam_is():
    more = []
    for times in (1.0, 2.0, 4.0):
        length, *rest = times * STRIP[0], *STRIP[1:]
        held, free = (critical(length, *rest, warping=warping, bends=False)[0] for warping in (True, False))
        more.append(held / free - 1.0)
    assert more[0] == pytest.approx(0.0705, abs=1e-3)
    assert more[0] > 1.9 * more[1] > 3.3 * more[2] > 0.0


def test_it_is_what_the_shell_is_above_the_beams_by():
    """The shell (results/rest_shapes.md) is 9 and 11 % above beams that warp freely, less than 1 % above this one."""
    record = Pages().read("rest_shapes")
    assert record is not None
    for k, force in enumerate(critical(*STRIP)):
        assert record.numbers[f"edge_{k + 1}"].value == pytest.approx(force, rel=8e-3)
