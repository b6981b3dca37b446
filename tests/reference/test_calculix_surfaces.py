"""Decks of surfaces for CalculiX: meshes by themselves; where the program is installed, a ring beside the elastica."""

from __future__ import annotations

import numpy as np
import pytest

from tests.reference import calculix
from tests.reference.calculix_band import motion
from tests.reference.calculix_surfaces import Surface, circle, flat, numbers, ring, shown
from tests.reference.squeezed_ring import squeezed
from tests.reference.test_calculix import block


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


@pytest.mark.validate
@pytest.mark.skipif(not calculix.available(), reason="CalculiX is not installed (Debian: calculix-ccx)")
def test_a_squeezed_ring_is_the_elastica(tmp_path):
    found, known = ring(0.28, (20, 2), tmp_path), squeezed(0.28)
    assert found.force == pytest.approx(known.force, rel=5e-3)
    assert found.energy == pytest.approx(known.energy, rel=1e-3)
