"""A diagram that was stopped anywhere, within a write too, is the same to the bit when it goes on."""

import numpy as np
import pytest

from compare.battery.cases.branches.scenes import CLAMPS, SHIFT
from compare.continuation import journal
from compare.scene.scene import loads
from compare.studies.branches.run import Asked, diagram


def followed(place, made=None):
    asked = Asked(branches=1, errors=False, steps=12)
    found = diagram(loads(CLAMPS, "arch"), SHIFT, 0.4, 0.5, asked=asked, keep=place)
    return [(b.ended, p.kind, p.parameter, p.unstable, p.energy, p.arc, p.centreline.tobytes())
            for b in found.branches for p in b.points]  # fmt: skip


@pytest.fixture
def counted(monkeypatch):
    """How many answers were written since."""
    written = []
    keep = journal.Journal.keep

    def kept(self, digest, answer):
        written.append(len(answer))
        keep(self, digest, answer)

    monkeypatch.setattr(journal.Journal, "keep", kept)
    return written


def test_what_was_cut_off_anywhere_goes_on_to_the_same_bits(tmp_path, counted):
    plain = followed(None)
    assert not counted
    place = tmp_path / "a.journal"
    assert followed(place) == plain
    whole, data = len(counted), place.read_bytes()
    rng = np.random.default_rng(1)
    for length in (*rng.integers(33, len(data), 2), len(data) - 1, 20):
        place.write_bytes(data[:length])
        counted.clear()
        assert followed(place) == plain
        assert len(counted) <= whole
        assert place.read_bytes() == data
    counted.clear()
    assert followed(place) == plain
    assert not counted  # nothing is solved twice


def test_a_damaged_record_and_another_question_are_not_believed(tmp_path, counted):
    place = tmp_path / "a.journal"
    plain = followed(place)
    data = bytearray(place.read_bytes())
    data[len(data) // 2] ^= 1
    place.write_bytes(data)
    counted.clear()
    assert followed(place) == plain
    assert counted
    asked = Asked(branches=1, errors=False, steps=12)
    counted.clear()
    diagram(loads(CLAMPS, "arch"), SHIFT, 0.4, 0.49, asked=asked, keep=place)
    assert len(counted) > 20
