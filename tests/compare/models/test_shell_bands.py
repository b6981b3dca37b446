"""Closed scenes beside their shells: what a shell is given of them, and a Moebius band compared with the ribbon."""

from dataclasses import replace

import numpy as np
import pytest

from compare.models import solve
from compare.models.base import Options
from compare.models.scope import require_shell
from compare.models.shell import motions_of
from compare.models.shell_build import shell_problem, shell_words
from compare.pages.comparison import verdict
from compare.scene.scene import loads
from compare.store.progress import Reporter
from compare.store.store import CaseStore
from compare.studies.compare import compare
from ribbonbench.errors import BadInput

BAND = """
title = "Band"
[strip]
length = 30.0
width = 1.0
poisson = 0.3
[closure]
kind = "moebius"
[model]
elements = 80
[shell]
width_to_thickness = [10, 40]
elements = [60, 4]
"""
CLAMP = """
[clamp.start]
position = [1.0, 0.0, 0.0]
tangent = [0.0, 0.0, 1.0]
normal = [0.0, 1.0, 0.0]
"""
SCENE = loads(BAND)
RING = SCENE.replace({"closure.kind": "circle", "closure.turns": 2})


def test_what_the_shell_is_given():
    free = shell_problem(SCENE, 10.0)
    assert (free.half_turns, free.clamp, free.end, free.clamp_position) == (1, "free", None, (0.0, 0.0, 0.0))
    assert free.start_curvature == pytest.approx(-2.0 * np.pi)  # the way in which the ribbon's circle bends
    ring = shell_problem(RING, 10.0)
    assert (ring.half_turns, ring.start_curvature) == (0, pytest.approx(-4.0 * np.pi))
    bent = shell_problem(RING.replace({"strip.natural_curvature": 0.1}), 10.0)
    assert bent.start_curvature == pytest.approx(4.0 * np.pi)
    held = loads(BAND + CLAMP)
    problem = shell_problem(held, 10.0)
    assert (problem.clamp, problem.clamp_position) == ("edge", pytest.approx((1.0 / 30.0, 0.0, 0.0)))
    assert "joined node to node, and nothing holds it" in shell_words(SCENE)
    assert "its clamp holds the whole edge at the seam" in shell_words(held)
    assert "from a circle whose end is turned and joined" in shell_words(SCENE)


def test_what_nothing_resists():
    assert motions_of(loads(BAND + CLAMP)) is None
    free = motions_of(SCENE)
    assert (len(free.translations), len(free.axes), free.seam, free.mirror) == (3, 3, -1, True)
    bent = SCENE.replace({"strip.natural_curvature": 0.1})
    assert (motions_of(bent).seam, motions_of(bent).mirror) == (0, False)
    assert motions_of(bent.replace({"closure.kind": "circle"})).seam == 1


@pytest.mark.parametrize(
    ("change", "key", "words"),
    [
        ({"shell.start_curvature": 1.0}, "shell.start_curvature", "multiple of 2 pi"),
        ({"shell.clamp": "corners", "clamp.start": {"position": [0, 0, 0], "tangent": [0, 0, 1], "normal": [0, 1, 0]}},
         "shell.clamp", "seam"),
        ({"shell.elements": [4, 2]}, "shell.elements", "6 along"),
        ({"shell.tolerance": 1e-3, "shell.goal": "middle"}, "shell.goal", "closed strip"),
        ({"closure.kind": "circle", "closure.twist": 1.0}, "closure.twist", "turned end"),
    ],
)  # fmt: skip
def test_what_the_shell_cannot_close(change, key, words):
    def requested():
        scene = SCENE.replace(change)
        require_shell(scene)
        return shell_problem(scene, 10.0)

    with pytest.raises(BadInput, match=words) as caught:
        requested()
    assert caught.value.key == key
    assert "\n" not in str(caught.value)


@pytest.mark.shell
def test_a_moebius_band_beside_its_shell(tmp_path):
    """The ribbon is the limit: the distance falls, the energy rises to its own, both stable; laid on each other."""
    pytest.importorskip("dolfinx")
    found = compare(SCENE, CaseStore(tmp_path), Reporter(quiet=True), bare=True)
    assert found.ok
    thick, thin = found.rows
    assert found.fast.energy.elastic == pytest.approx(58.5267, rel=2e-3)
    assert 40.0 < thick.energy.elastic < thin.energy.elastic < found.fast.energy.elastic
    assert thick.hausdorff == pytest.approx(2.0e-2, rel=0.1)
    assert thin.hausdorff == pytest.approx(7.8e-3, rel=0.15)
    for row in found.rows:
        assert (row.start, row.same_state, row.claimed) == ("ribbon", True, True)
        assert row.stable is True
        assert row.laid.free
        assert not row.laid.mirrored
        assert row.shell_error < 3e-3
        assert 0.02 < row.share["membrane"] < 0.08
    said = " ".join(verdict(found))
    assert "Nothing holds the band: the ribbon is laid on the shell by least squares" in said
    assert "slid along itself" in said


@pytest.mark.shell
def test_the_shell_alone_finds_the_same_band(tmp_path):
    """By its own path, without the ribbon: the same energy as from the ribbon's surface, and no other hand."""
    pytest.importorskip("dolfinx")
    scene = SCENE.replace({"shell.width_to_thickness": [10.0]})
    ribbon = solve(scene, "ribbon")
    options = Options(store=CaseStore(tmp_path), selects=True)
    near = solve(scene, "shell", near=ribbon.shape, options=options)
    alone = solve(scene, "shell", options=replace(options, selects=False))
    assert (near.start, alone.start) == ("ribbon", "path")
    assert alone.energy.elastic == pytest.approx(near.energy.elastic, rel=1e-3)
    assert alone.lowest_eigenvalue == pytest.approx(near.lowest_eigenvalue, rel=1e-2)
    assert alone.stable
    assert near.stable


@pytest.mark.shell
def test_saddles_of_four_half_turns_are_compared(tmp_path):
    """Ribbon and shell have the same half turns, both unstable, and a distance with its errors."""
    pytest.importorskip("dolfinx")
    scene = loads(BAND).replace({
        "closure.kind": "circle", "closure.half_turns": 4, "strip.width": 1.5, "shell.width_to_thickness": [25],
        "shell.elements": [64, 4],
    })  # fmt: skip
    found = compare(scene, CaseStore(tmp_path), Reporter(quiet=True), bare=True)
    (row,) = found.rows
    assert not found.ok
    assert (found.fast.stable, row.stable, row.status, row.start) == (False, False, "unstable", "ribbon")
    assert row.same_state is True
    assert row.hausdorff == pytest.approx(5.5e-3, rel=0.3)
    assert row.shell_error < 0.5 * row.hausdorff
