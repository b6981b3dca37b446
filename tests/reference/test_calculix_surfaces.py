"""Decks of surfaces for CalculiX: meshes by themselves; where the program is installed, a ring beside the elastica."""

from __future__ import annotations

import numpy as np
import pytest

from tests.reference import calculix
from tests.reference.calculix_band import _forces, _work, motion
from tests.reference.calculix_fold import _bending, fold
from tests.reference.calculix_surfaces import Surface, circle, flat, numbers, ring, shown
from tests.reference.squeezed_ring import squeezed
from tests.reference.test_calculix import block
from tests.reference.touching_fold import folds


def corners(surface: Surface):
    """Points (elements, nodes, 3) of the mesh as the program reads it."""
    deck = "\n".join(surface.mesh())
    nodes = {int(row[0]): np.array(row[1:]) for row in block(deck, "*NODE,")}
    per = 20 if surface.solid else 8
    elements = np.array([int(x) for row in block(deck, "*ELEMENT,") for x in row]).reshape(-1, per + 1)[:, 1:]
    assert set(elements.ravel()) == set(nodes)  # no node is loose
    return np.array([[nodes[n] for n in row] for row in elements])


def test_a_circle_closes_and_faces_outwards():
    points = corners(circle((12, 2), 1e-3, 0.1))
    normals = np.cross(points[:, 1] - points[:, 0], points[:, 3] - points[:, 0])
    outwards = points.mean(axis=1) * [1.0, 1.0, 0.0]
    assert np.einsum("ij,ij->i", normals, outwards).min() > 0
    assert np.linalg.norm(points[..., :2], axis=-1) == pytest.approx(0.5 / np.pi)
    area = np.linalg.norm(normals, axis=1).sum()  # of the chords: all 12, none twice
    assert area == pytest.approx(0.1 * 12 * np.sin(np.pi / 12) / np.pi)


def test_solids_fill_the_strip():
    points = corners(flat(1.0, 0.1, 1e-3, 0.3, (6, 2), element="C3D20R"))
    one, two, four = (points[:, k] - points[:, 0] for k in (1, 3, 4))
    volume = np.einsum("ij,ij->i", np.cross(one, two), four)
    assert volume.min() > 0
    assert volume.sum() == pytest.approx(0.1e-3)


@pytest.mark.parametrize("x", [-9.74542958129844e-18, -1.23456789012345e-8, -0.159154943091895, 0.0, 1e6])
def test_a_number_fits_the_field_that_the_program_reads(x):
    assert len(shown(x)) <= 20
    assert float(shown(x)) == pytest.approx(x, abs=1e-15, rel=1e-11)


def test_the_end_of_a_band_moves_rigidly_to_the_start_upside_down():
    poses = motion()
    np.testing.assert_allclose(
        np.einsum("tai,tbi->tab", poses[:, 1:], poses[:, 1:]), np.tile(np.eye(3), (len(poses), 1, 1)), atol=1e-14
    )
    np.testing.assert_allclose(poses[0], [[1, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], atol=1e-15)
    np.testing.assert_allclose(poses[-1], [[0, 0, 0], [1, 0, 0], [0, -1, 0], [0, 0, -1]], atol=1e-15)
    assert np.linalg.norm(np.diff(poses[:, 0], axis=0), axis=1).max() < 0.01


def test_the_last_table_of_the_output_is_read():
    text = (
        "\n displacements (vx,vy,vz) for set A and time  0.5\n\n 1  1.0 2.0 3.0\n"
        "\n displacements (vx,vy,vz) for set A and time  1.0\n\n 1  4.0 5.0 6.0\n 2  7.0 8.0 9.0\n"
        "\n total internal energy for set STRIP and time  1.0\n\n 0.25\n"
    )
    assert [list(row) for row in numbers(text, "displacements")] == [[1, 4, 5, 6], [2, 7, 8, 9]]
    assert numbers(text, "internal energy")[-1][-1] == 0.25
    with pytest.raises(calculix.Failed, match="no forces"):
        numbers(text, "forces")


def test_the_work_of_a_moved_end_is_read_off_all_increments():
    """u = t (1, 2, 0), f = (3 t, 0, 1) on one node of two, that on the other is held: work 3/2."""
    text = "".join(
        f"\n forces (fx,fy,fz) for set MOVED and time  {t:.7E}\n\n"
        f"         7  {3 * t:.6E}  0.000000E+00  1.000000E+00\n         9  5.000000E+00 -1.000000E+00  2.000000E+00\n"
        f"\n displacements (vx,vy,vz) for set MIDDLE and time  {t:.7E}\n\n         7  1.0E+00 -1.0E-01  0.0E+00\n"
        for t in (0.25, 0.5, 1.0)
    )
    at, forces = _forces(text, [7, 9])
    np.testing.assert_array_equal(at, [0.0, 0.25, 0.5, 1.0])
    assert forces.shape == (2, 4, 3)
    np.testing.assert_allclose(forces[0, :, 0], [0.0, 0.75, 1.5, 3.0])
    times = np.linspace(0.0, 1.0, 11)
    paths = np.stack([times[:, None] * [1.0, 2.0, 0.0], np.zeros((11, 3))])
    fine, error = _work(times, paths, at, forces)
    assert fine == pytest.approx(1.5)
    assert error == pytest.approx(0.0, abs=1e-12)
    fine, error = _work(times, paths, at, forces**2)
    assert 0.0 < abs(fine - 3.0) < 1.01 * error < 0.5  # int 9 t^2


def test_the_bending_of_half_an_s_is_that_of_its_curve():
    """a = 1.3 sin(4 pi s), upright at both ends: 1/2 int a'^2 over s of 1 is (1.3 . 4 pi)^2 / 4."""
    fine = np.linspace(0.0, 0.5, 160001)
    angle = 1.3 * np.sin(4.0 * np.pi * fine)
    rates = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    points = np.concatenate([[[0.0, 0.0]], np.cumsum(0.5 * (rates[1:] + rates[:-1]), axis=0) * fine[1]])
    assert _bending(points[::2000]) == pytest.approx((1.3 * 4.0 * np.pi) ** 2 / 4.0, rel=1e-4)


@pytest.mark.validate
@pytest.mark.skipif(not calculix.available(), reason="CalculiX is not installed (Debian: calculix-ccx)")
def test_the_sides_of_a_fold_push_each_other_as_by_shooting(tmp_path):
    """Lines of nodes touch, half an element apart: within some per cent on 40 elements, as our own shell's nodes."""
    found, known = fold(0.15, 0.02, 20, tmp_path), folds(np.array([0.15]), 0.02)[0]
    assert found.lines == 1
    assert found.push == pytest.approx(known.push, rel=5e-2)
    assert found.energy == pytest.approx(known.energy, rel=2e-4)
    assert found.place == pytest.approx(known.s, abs=0.25 / 20)


@pytest.mark.validate
@pytest.mark.skipif(not calculix.available(), reason="CalculiX is not installed (Debian: calculix-ccx)")
def test_a_squeezed_ring_is_the_elastica(tmp_path):
    found, known = ring(0.28, (20, 2), tmp_path), squeezed(0.28)
    assert found.force == pytest.approx(known.force, rel=5e-3)
    assert found.energy == pytest.approx(known.energy, rel=1e-3)


@pytest.mark.validate
@pytest.mark.skipif(not calculix.available(), reason="CalculiX is not installed (Debian: calculix-ccx)")
def test_a_ring_that_is_flat_on_the_planes_touches_where_the_elastica_does(tmp_path):
    found, known = ring(0.2, (20, 2), tmp_path), squeezed(0.2)
    assert found.force == pytest.approx(known.force, rel=1e-2)
    assert found.energy == pytest.approx(known.energy, rel=2e-3)
    assert abs(found.flat - known.flat) < 1 / 40  # a step of the lines
    assert found.solves > 1
    assert found.through < 1e-7
