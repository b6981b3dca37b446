"""What `finite` leaves out of a strip whose natural curvature is a table."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from ribbon import Clamp, Strip, solve
from ribbon.energies.section.dropped import CLAMP, terms


def test_a_table_on_one_line_is_the_linear_law():
    """The same terms and derivatives, the clamp's at either end; another slope gives others."""
    strip = Strip(1.0, 0.1, 0.3, thickness=2e-3, natural_curvature=(2.0, 4.0))
    found = solve(strip, Clamp(), energy="finite", segments=10)
    assert found.ok

    def of(law):
        problem = SimpleNamespace(strip=SimpleNamespace(relative_width=0.1, poisson=0.3, curvature=law),
                                  lengths=found.problem.lengths)  # fmt: skip
        return terms(SimpleNamespace(problem=problem, parameters=found.parameters), 2e-3, (0.0, 1.0))

    linear, table = of((2.0, 4.0)), of(((0.0, 2.0), (0.3, 2.6), (1.0, 4.0)))
    kinked = of(((0.0, 2.0), (0.3, 2.0), (1.0, 4.0)))
    for one, other in zip(linear, table, strict=True):
        assert dataclasses.astuple(one)[0] == other.name
        assert one.energy == pytest.approx(other.energy, rel=1e-12, abs=1e-15)
        np.testing.assert_allclose(one.gradient, other.gradient, rtol=1e-9, atol=1e-12)
    assert [term.name for term in linear].count(CLAMP) == 2
    assert any(abs(a.energy - b.energy) > 1e-9 for a, b in zip(linear, kinked, strict=True))
