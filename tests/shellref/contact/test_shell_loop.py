"""The loop of a twisted ribbon as a shell: edge on edge, in balance, beside the ribbon."""

from __future__ import annotations

import numpy as np
import pytest

from tests.validation.shell import loop_shell as page

MESH = page.MESHES[0]


@pytest.mark.validate
def test_a_loop_lies_on_itself_edge_on_edge():
    """Place and push beside the ribbon's; from the surface alone nothing is nearer than the thickness; both clamps
    balance."""
    found, ribbon = page.lying(MESH), page.of_ribbon(page.ribbon_lying())
    loop, (pair,) = page.of_shell(found), found.pairs
    assert (pair["v"], pair["v_other"]) == (pytest.approx(0.01), pytest.approx(-0.01))
    np.testing.assert_allclose([loop.s, loop.other], [ribbon.s, ribbon.other], atol=3e-3)
    assert loop.push == pytest.approx(ribbon.push, rel=0.3)
    assert loop.energy == pytest.approx(ribbon.energy, rel=0.03)
    thick = page.LYING.width / page.LYING.slender
    assert pair["gap"] == pytest.approx(thick, abs=1e-10)
    assert page.nearest(found.surface) == pytest.approx(thick, rel=0.05)
    assert page.unbalanced(found) < 1e-6
    assert found.contact["product"] < 1e-10


@pytest.mark.validate
def test_a_shell_snaps_where_the_ribbon_does():
    """Its fold, on a coarse mesh, within three hundredths of the ribbon's; one mode grows unstable there."""
    run = page.branch(MESH)
    fold = next(one for one in run.specials if one.kind == "fold")
    assert page.at(fold.point) == pytest.approx(page.ribbon_folded()[0], abs=0.02)
    assert abs(fold.change) == 1
    assert run.points[0].unstable == 0
