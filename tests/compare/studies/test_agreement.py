"""Three solvers that share no numerics agree where theory says they must, and differ as it says where they may."""

from __future__ import annotations

import json

import pytest

from compare.cli import main
from compare.scene.scene import load
from compare.store.progress import Reporter
from compare.store.store import CaseStore
from compare.studies.compare import compare

pytestmark = pytest.mark.shell


@pytest.fixture(scope="module")
def store(kept):
    return CaseStore(kept / "cases")


def test_without_poisson_effect_the_flat_cantilever_is_one_curve_for_all_three(store):
    """nu = 0: no anticlastic curvature, the inextensible strip, the elastica and a thin shell are the same beam."""
    keys = {"strip.poisson": 0.0, "shell.width_to_thickness": [100], "shell.elements": [40, 4]}
    found = compare(load("cantilever").replace(keys), store, Reporter(quiet=True))
    assert found.ok
    assert found.elastica_distance < 1e-6
    row = found.rows[0]
    assert row.hausdorff < 5e-6
    assert row.elastica < 5e-6
    assert row.energy.elastic == pytest.approx(found.elastica.native.energy.bending, rel=2e-5)
    assert found.fast.native.energy.total == pytest.approx(found.elastica.native.energy.total, rel=1e-6)


def test_poisson_effect_separates_the_shell_from_the_inextensible_models(store):
    """nu = 0.3: the shell alone changes, as edge layers of width sqrt(h / kappa) would make it."""
    keys = {"strip.poisson": 0.3, "shell.width_to_thickness": [50, 200], "shell.elements": [40, 4]}
    found = compare(load("cantilever").replace(keys), store, Reporter(quiet=True))
    assert found.ok
    assert found.elastica_distance < 1e-6
    assert all(row.claimed for row in found.rows)
    assert found.falls
    # a layer of width sqrt(h / kappa) makes a distance that falls with the root of h/w
    assert 0.35 < found.slope.value < 0.7
    assert found.rows[0].hausdorff > 1e-2


@pytest.mark.parametrize("name", ["curl_4_3", pytest.param("curl_4_3_down", marks=pytest.mark.validate)])
def test_the_shells_of_4_3_tend_to_the_ribbon(store, name):
    keys = {"shell.width_to_thickness": [20, 100], "shell.elements": [50, 4]}
    found = compare(load(name).replace(keys), store, Reporter(quiet=True))
    assert found.ok
    assert found.falls
    assert all(row.claimed for row in found.rows)
    assert 0.02 < found.rows[1].hausdorff < 0.04
    assert found.rows[1].hausdorff < 0.6 * found.rows[0].hausdorff
    assert found.fast.error < 5e-4
    shell, ribbon = found.rows[1].energy, found.fast.native.energy
    assert shell.total < ribbon.total  # the shell may do more
    assert shell.total == pytest.approx(ribbon.total, rel=0.01)
    assert sum(found.rows[1].share.values()) == pytest.approx(1.0)
    assert all(row.ratio > 0 for row in found.rows)


def test_compare_from_the_command_line_keeps_and_reuses_finished_cases(tmp_path, capsys):
    arguments = ["compare", "curl_4_3", "--out", str(tmp_path), "--set", "shell.width_to_thickness=20",
                 "--set", "shell.elements=[20, 2]"]  # fmt: skip
    assert main(arguments) == 0
    out = capsys.readouterr().out
    assert "Report:" in out
    first = json.loads((tmp_path / "result.json").read_text())
    assert first["rows"][0]["reused"] is False
    assert main([*arguments, "--quiet"]) == 0
    again = json.loads((tmp_path / "result.json").read_text())["rows"][0]
    assert again["reused"] is True
    assert again["hausdorff"] == first["rows"][0]["hausdorff"]
    # another scene is another case
    assert main([*arguments, "--quiet", "--set", "strip.gamma=90"]) == 0
    assert json.loads((tmp_path / "result.json").read_text())["rows"][0]["reused"] is False


def test_a_shell_that_fails_is_a_status_and_exit_code_1(tmp_path, capsys):
    """A very heavy, very thin shell on six elements stops on the way: the row says so, nothing is raised.

    Where and why it stops (steps too small, or a limit point) is rounding's, and so another on another processor.
    """
    code = main(["compare", "curl_4_3", "--out", str(tmp_path), "--set", "shell.width_to_thickness=20000",
                 "--set", "shell.elements=[6, 1]", "--set", "strip.gamma=30000"])  # fmt: skip
    row = json.loads((tmp_path / "result.json").read_text())["rows"][0]
    assert code == 1
    assert row["status"] in ("not_converged", "limit_point")
    assert row["hausdorff"] is row["centreline"] is row["shell_error"] is row["ratio"] is None
    assert row["claimed"] is False
    assert row["stable"] is not True
    assert "gravity" in row["message"]  # on which stage of the path
    said = " ".join(capsys.readouterr().out.split())
    assert " ".join(row["message"].split())[:40] in said
    assert "Traceback" not in said
    assert (tmp_path / "report.md").exists()
