"""PyElastica's cantilever is the elastica, DER-JAX's energies are ours, and so is its arch; the tables are kept."""

from __future__ import annotations

import json
import os
import subprocess
from typing import Any

import numpy as np
import pytest

from ribbon import Clamp, Strip, solve
from ribbon.energies.free import FREE_CODES, free_numbers
from tests.peers import der, elastica, further, optimal
from tests.peers.cases import Run

pytestmark = pytest.mark.peers
needs_elastica = pytest.mark.skipif(elastica.absent() is not None, reason=str(elastica.absent()))
needs_der = pytest.mark.skipif(der.absent() is not None, reason=str(der.absent()))


def test_the_cantilevers_reference_is_ours_too():
    """Collocation of the elastica against the ribbon, which shares nothing with it."""
    rod = elastica.rods()[0]
    tip = np.asarray(rod.solved(40).end.position)
    np.testing.assert_allclose(tip, elastica.reference(rod.name), atol=1e-8)


@needs_elastica
def test_pyelasticas_cantilever_is_the_elastica():
    """In second order: the clamp holds the first element's middle, not its whole length."""
    rod = elastica.rods()[0]
    runs = [elastica.run(rod, elastica.Settings(n, 1e5, 4.0), 2e-2) for n in (6, 12)]
    last = [elastica.relaxed(rod, elastica.Settings(n, 1e5, 4.0), 0.0)["errors"][-1] for n in (6, 12)]
    assert all(np.isfinite(run.seconds) and run.error <= 2e-2 for run in runs), runs
    assert 3.2 < last[0] / last[1] < 4.8, last


@needs_elastica
def test_pyelasticas_curved_rod_is_ours():
    """Bending about both axes, torsion and the natural curvature: the rod leaves the plane."""
    found = elastica.run(elastica.rods()[1], elastica.Settings(30, 5e4, 4.0), 4e-3)
    assert np.isfinite(found.seconds), found
    assert found.error <= 4e-3


def test_an_unreached_error_takes_for_ever(monkeypatch):
    answer = {
        "errors": [0.3, 0.01, 0.2],
        "settled": False,
        "seconds": [1, 2, 3],
        "stepped": [1, 2, 3],
        "times": [0, 1, 2],
    }
    monkeypatch.setattr(elastica, "relaxed", lambda *_: answer)
    assert elastica.run(elastica.rods()[0], elastica.Settings(5, 1.0, 1.0), 0.1).seconds == np.inf
    answer |= {"errors": [0.3, 0.01, 0.02], "settled": True}
    found = elastica.run(elastica.rods()[0], elastica.Settings(5, 1.0, 1.0), 0.1)
    assert (found.seconds, found.error) == (2, 0.02)


@pytest.mark.parametrize("cut", [2, 3, 5])
def test_finer_edges_leave_the_length(cut):
    """What is free and one edge, between the thresholds of the clamps."""
    length = der.EXAMPLES[2]

    def free(nodes: int, low: float, high: float) -> float:
        x = np.linspace(0.0, length, nodes)
        return float(((x > low) & (x < high)).sum() + 2) * length / (nodes - 1)

    nodes, thresholds = der.finer(cut)
    assert free(nodes, *thresholds.values()) == pytest.approx(free(der.NODES, 0.01, 0.09), rel=1e-12)


_DENSITY = """
import json, sys
given = json.load(sys.stdin)
sys.path[:0] = [given["folder"] + "/src", given["folder"] + "/examples/shear_induced_bifurcation"]
out, sys.stdout = sys.stdout, sys.stderr
import numpy as np, simulate
config = simulate.load_config(given["folder"] + "/examples/shear_induced_bifurcation/config.yaml")
config["energy_model"]["name"] = given["energy"]
for section, values in given["changes"].items():
    config[section].update(values)
nodes = 45
model = simulate.setup_from_config(config, 1 / 12, nodes)[1]
length, h = 0.1 / (nodes - 1), 1e-3
plate = 1e10 * (0.1 / 12) * h**3 / 12
found = [float(model(np.array([0, 0, k * length, 0, t * length]))) / length / plate for k, t in given["strains"]]
json.dump(found, out)
"""


STRAINS = np.random.default_rng(5).uniform(2.0, 40.0, (20, 2))


def _theirs(energy: str, changes: dict[str, dict[str, Any]]) -> np.ndarray:
    """Densities over E w h^3 / 12 at STRAINS: curvatures and twists, 1 / m."""
    given = {"folder": os.environ["DER_DIR"], "energy": energy, "changes": changes, "strains": STRAINS.tolist()}
    words = [optimal.python(), "-P", "-c", _DENSITY]
    done = subprocess.run(words, input=json.dumps(given), capture_output=True, text=True, check=True)
    return np.array(json.loads(done.stdout))


SADOWSKY = der.Energy("sadowsky", "sadowsky_kt", {"material": {"poisson_rod": 0.0}})


@needs_der
@pytest.mark.parametrize("energy", [*der.energies(), SADOWSKY], ids=lambda e: e.theirs)
def test_ders_energy_is_ours(energy):
    """Its Sadowsky is regularised, by little."""
    width, thickness, _ = der.EXAMPLES
    out = np.zeros((20, 15))
    section = (0.5 * width, thickness, 0.0, 0.0)
    free_numbers(FREE_CODES[energy.ours], *STRAINS.T, *np.zeros((3, 20)), 0.0, section, out)
    np.testing.assert_allclose(_theirs(energy.theirs, energy.changes), out[:, 0], rtol=1e-5)


@pytest.mark.parametrize("segments", [10, 40])
def test_sadowsky_without_rulings_has_no_value_on_a_shifted_arch(segments):
    """Why its Sadowsky is left out: a rod's shifted arch has twist where its curvature passes zero; that density is
    infinite there."""
    strip = Strip(1.0, 1.0 / 12.0, 0.0, 0.0, 0.0, 0.01)
    clamps = Clamp((0, 0, 0), (1, 0, 0), (0, 0, 1)), Clamp((0.7, 0.01, 0), (1, 0, 0), (0, 0, 1))
    rod, found = (
        solve(
            strip, clamps[0], end=clamps[1], energy=energy, segments=segments,
            seed_curvature=[-8.0, 8.0, -8.0], seed_ruling=[1e-3, -1e-3],
        )
        for energy in ("kirchhoff", SADOWSKY.ours)
    )  # fmt: skip
    s = np.linspace(0.0, 1.0, 2001)
    omega = rod.omega(s)
    passed = np.flatnonzero(omega[1:] * omega[:-1] < 0.0)
    assert rod.ok
    assert passed.size == 2
    assert np.abs(rod.tau(s[passed])).min() > 1e-3
    assert not found.ok
    assert found.energy.bending == np.inf


@needs_der
def test_ders_wunderlich_does_not_resist_twist():
    """Why it is left out: so its stepper calls it, without eta'."""
    np.testing.assert_allclose(_theirs("wunderlich", {}), 0.5 * STRAINS[:, 0] ** 2, rtol=1e-12)


@needs_der
def test_ders_arch_is_ours(monkeypatch):
    """A short run on few nodes: second order leaves it half a per cent away; the shift is the one asked for."""
    energy = der.energies()[0]
    short = der.Energy(energy.theirs, energy.ours, energy.changes | {"simulation": {"total_time": 4.0}})
    found = der.shifted(short)
    assert found.along == pytest.approx(0.7, abs=0.01)
    assert found.forth[0, -1] == pytest.approx(0.0145 / (37 / 440), abs=0.01)
    monkeypatch.setattr(der, "LAST", 0.13)
    ours = der.followed(energy, found, 20)
    np.testing.assert_allclose(found.heights(ours.shifts)[0], ours.heights[0], rtol=5e-3)


@needs_der
def test_half_the_thickness_brings_the_limits_together(monkeypatch):
    """Sano's strip here neither stretches nor bends in its plane, there it does, by h^2: where it leans the heights
    come 4 times nearer."""
    width, thickness, _ = der.EXAMPLES
    monkeypatch.setattr(der, "LAST", 0.33)
    apart = []
    for h in (thickness, 0.5 * thickness):
        changes = {
            "material": {"poisson_rod": 0.0}, "energy_model": {"sano_zeta": width**2 / (60.0**0.5 * h)},
            "geometry": {"h": h}, "simulation": {"total_time": 5.5},
        }  # fmt: skip
        found = der.shifted(der.Energy("sano", "sano", changes))
        ours = der.followed(der.energies()[1], found, 20)
        apart.append(float(np.abs(found.heights(ours.shifts) - ours.heights)[0, -1]))
    assert 3.0 < apart[0] / apart[1] < 6.0, apart


def test_the_tables_are_kept_part_by_part(tmp_path):
    ours, theirs = Run("p = 10", 5e-4, 0.002), Run("45 elements", 9e-4, 2.0)
    further.keep(tmp_path, {"pyelastica": {"a rod": {"ribbon.solve": ours, elastica.NAME: theirs}}})
    further.keep(tmp_path, {"der": {"a strip": {der.NAME: theirs, der.OURS: ours}}})
    found = further.kept(tmp_path)
    assert found["pyelastica"] == {"a rod": {"ribbon.solve": ours, elastica.NAME: theirs}}
    text = "\n".join(further.parts(tmp_path))
    assert text.count("| 1e+03 |") == 2
    assert "Not measured" not in text
