"""Slope, limit, extrapolation as h/w falls: against scipy and statistics on synthetic rows; the command on shells."""

from __future__ import annotations

import functools
import json

import numpy as np
import pytest
import scipy.optimize
import scipy.stats

from compare.cli import main
from compare.models import model, solve
from compare.models.base import Energy, Options
from compare.models.choice import settled
from compare.models.scope import require_shell
from compare.page.page import read_page
from compare.page.pair import Times
from compare.pages import converge as convergence_write
from compare.scene.scene import load
from compare.studies import converge_run as convergence_run
from compare.studies.compare import Row, one_energy
from compare.studies.converge import Points, limit, line, line_band, richardson, scalars, slope
from ribbonbench.errors import BadInput
from tests.compare.models.test_chosen_by_default import strip as curled
from tests.compare.studies.outside import Arc, registered

X = 1.0 / np.array([10.0, 20.0, 50.0, 100.0, 200.0])


def rows(distance, ribbon=0.0, shell=0.0, x=X) -> Points:
    return Points.of(x, distance, ribbon, shell)


# -- statistics -------------------------------------------------------------------------------------------------------


def test_slope_and_its_scatter_are_scipys():
    rng = np.random.default_rng(1)
    d = 0.3 * X**0.6 * np.exp(rng.normal(0.0, 0.05, X.size))
    found = slope(rows(d))
    fit = scipy.stats.linregress(np.log(X), np.log(d))
    half = scipy.stats.t.ppf(0.975, X.size - 2) * fit.stderr
    assert found.value == pytest.approx(fit.slope, rel=1e-12)
    assert found.scatter == pytest.approx((fit.slope - half, fit.slope + half), rel=1e-10)
    assert found.errors == pytest.approx((fit.slope, fit.slope))
    # without errors both together are the scatter's alone, up to sampling
    assert found.both == pytest.approx(found.scatter, abs=0.1 * half)


def test_a_pure_power_is_found_exactly_and_errors_widen_it():
    exact = slope(rows(0.3 * X**0.6))
    assert exact.value == pytest.approx(0.6, abs=1e-12)
    assert exact.scatter == pytest.approx((0.6, 0.6), abs=1e-10)
    widened = slope(rows(0.3 * X**0.6, ribbon=1e-3, shell=1e-3))
    assert widened.errors[0] < 0.6 < widened.errors[1]
    assert widened.errors[1] - widened.errors[0] > 0.01


def test_the_ribbons_error_is_one_amount_for_all_rows():
    """Corners of the box of errors bound the samples; a common shift tilts the line less than independent ones do."""
    d = 0.3 * X**0.6
    alone = slope(rows(d, ribbon=2e-3)).errors
    corners = [np.polyfit(np.log(X), np.log(d + sign * 2e-3), 1)[0] for sign in (1.0, -1.0)]
    assert corners[0] <= alone[0] < alone[1] <= corners[1]
    assert alone[1] - alone[0] > 0.9 * (corners[1] - corners[0])
    points = rows(d, ribbon=2e-3)
    moved = points.moved(np.random.default_rng(0), 50) - points.distance
    assert moved.shape == (50, X.size)
    assert np.ptp(moved, axis=1) == pytest.approx(np.zeros(50), abs=1e-15)
    assert np.ptp(rows(d, shell=2e-3).moved(np.random.default_rng(0), 50)[:, 0]) > 2e-3


def test_intervals_of_scatter_cover_the_true_slope_as_often_as_they_say():
    rng = np.random.default_rng(7)
    tries, covered = 2000, 0
    y = np.log(0.3) + 0.6 * np.log(X) + rng.normal(0.0, 0.08, (tries, X.size))
    _, b, spread = line(np.log(X), y)
    half = scipy.stats.t.ppf(0.975, X.size - 2) * spread
    covered = np.mean(np.abs(b - 0.6) <= half)
    assert b.shape == (tries,)
    assert covered == pytest.approx(0.95, abs=0.015)  # three standard errors of the count


def test_intervals_together_cover_within_errors_and_scatter():
    rng = np.random.default_rng(8)
    hits = []
    for _ in range(150):
        true = 0.3 * X**0.6
        d = true * np.exp(rng.normal(0.0, 0.03, X.size)) + rng.uniform(-1, 1) * 1e-3 + rng.uniform(-1, 1, X.size) * 1e-3
        low, high = slope(rows(d, ribbon=1e-3, shell=1e-3)).both
        hits.append(low <= 0.6 <= high)
    assert np.mean(hits) > 0.9


def test_rows_below_their_errors_take_no_part():
    d = 0.3 * X**0.6
    spoilt = d.copy()
    spoilt[-1] = 0.5
    found = rows(spoilt, shell=[0.0, 0.0, 0.0, 0.0, 0.6])
    assert len(found) == X.size - 1
    assert slope(found).value == pytest.approx(0.6)
    assert slope(rows(d, ribbon=1.0)) is None
    assert len(rows(d, ribbon=1.0)) == 0


def test_two_rows_give_a_slope_without_scatter_and_bad_rows_an_error():
    found = slope(rows([0.1, 0.05], shell=1e-3, x=np.array([0.1, 0.05])))
    assert found.value == pytest.approx(1.0)
    assert found.scatter is None
    assert found.both == found.errors
    with pytest.raises(ValueError, match="above zero"):
        Points.of([0.1, 0.0], [1.0, 1.0], 0.0, 0.0)


@pytest.mark.parametrize(("d0", "c", "q"), [(0.0, 0.3, 0.6), (5e-3, 0.4, 1.0), (2e-3, 1.0, 1.7)])
def test_the_limit_of_exact_rows_is_found(d0, c, q):
    found = limit(rows(d0 + c * X**q))
    assert found.d0.value == pytest.approx(d0, abs=3e-6)
    assert found.power.value == pytest.approx(q, abs=2e-3)
    assert found.residual < 1e-4
    assert found.at(X) == pytest.approx(d0 + c * X**q, rel=1e-4)


def test_the_limit_is_scipys_with_relative_residuals():
    rng = np.random.default_rng(3)
    d = (4e-3 + 0.4 * X**0.9) * (1.0 + rng.normal(0.0, 0.01, X.size))
    found = limit(rows(d))
    fit, covariance = scipy.optimize.curve_fit(
        lambda x, a, c, q: a + c * x**q, X, d, p0=(1e-3, 0.4, 1.0), sigma=d, absolute_sigma=False
    )
    assert found.d0.value == pytest.approx(fit[0], rel=1e-3)
    assert found.power.value == pytest.approx(fit[2], rel=1e-3)
    half = scipy.stats.t.ppf(0.975, X.size - 3) * np.sqrt(np.diag(covariance))
    assert found.d0.scatter == pytest.approx((fit[0] - half[0], fit[0] + half[0]), rel=0.02)
    assert found.power.scatter == pytest.approx((fit[2] - half[2], fit[2] + half[2]), rel=0.02)


def test_three_rows_have_no_limit():
    assert limit(rows(0.3 * X[:3] ** 0.6, x=X[:3])) is None


def test_richardson_finds_the_value_at_zero():
    points = rows(0.3 * X**0.7)
    estimate = richardson(points, -0.3 + 0.5 * X**0.7)
    assert estimate.value == pytest.approx(-0.3, abs=1e-4)
    assert estimate.both[0] <= estimate.value <= estimate.both[1]
    rough = richardson(points, -0.3 + 0.5 * X**0.7, np.full(X.size, 1e-3))
    assert rough.errors[1] - rough.errors[0] > 5e-4
    three = richardson(rows(0.3 * X[:3] ** 0.7, x=X[:3]), -0.3 + 0.5 * X[:3] ** 0.7)
    assert three.value == pytest.approx(-0.3, abs=1e-9)
    assert richardson(rows(0.3 * X[:2] ** 0.7, x=X[:2]), X[:2]) is None
    with pytest.raises(ValueError, match="one for each"):
        richardson(points, [1.0, 2.0])


def test_inside_counts_the_ribbons_own_error():
    points = rows(0.3 * X**0.7)
    shell = {"end": list(-0.3 + 0.5 * X**0.7)}
    (near,) = scalars(points, shell, {"end": -0.31}, {}, {})
    assert near.inside is False
    (wide,) = scalars(points, shell, {"end": -0.31}, {}, {"end": 0.02})
    assert wide.inside is True
    (unknown,) = scalars(points, shell, {}, {}, {})
    assert unknown.inside is None


def test_the_band_holds_the_line_and_is_narrowest_in_the_middle():
    rng = np.random.default_rng(2)
    points = rows(0.3 * X**0.6 * np.exp(rng.normal(0.0, 0.05, X.size)), shell=1e-4)
    at = np.geomspace(X.min(), X.max(), 21)
    middle, low, high = line_band(points, at)
    assert middle.shape == low.shape == high.shape == (21,)
    assert np.all(low < middle)
    assert np.all(middle < high)
    width = np.log(high / low)
    assert width.argmin() not in (0, 20)


# -- the study --------------------------------------------------------------------------------------------------------


def row(ratio, hausdorff, shell_error=1e-5, ribbon_error=1e-5, x=-0.3, total=-54.0) -> Row:
    place = {"position": [x, 0.1, 0.0], "frame": np.eye(3).tolist()}
    claimed = hausdorff > shell_error + ribbon_error
    energy = Energy(elastic=total + 16.0, gravity=-16.0, constant=50.0)
    return Row(
        ratio, "converged", True, "fine", hausdorff, hausdorff, ribbon_error, shell_error, claimed, energy, None, place,
        place, Times(0.01, 2.0), (20, 2), 40, False, True, "", warm=True, searched=False,
    )  # fmt: skip


@functools.cache
def ribbon_beside():
    """The ribbon's own state, with its errors."""
    return solve(load("curl_4_3"), options=Options(error=True))


class Compared:
    """What the study takes of a comparison: rows, the ribbon's end and energies."""

    def __init__(self, found):
        from types import SimpleNamespace as Bag

        self.scene = load("curl_4_3")
        state = ribbon_beside()
        self.rows, self.ok = tuple(found), True
        end = Bag(position=np.array([-0.3, 0.1, 0.0]), frame=np.eye(3))
        own = {"end": end, "middle": end, "energy": Energy(elastic=-38.0, gravity=-16.0), "error": 1e-5}
        self.fast = Bag(**vars(state) | own, ok=True, is_equilibrium=True)


def made(distance, **changes):
    found = [row(1.0 / x, d, x=-0.3 + 0.5 * x**0.6, **changes) for x, d in zip(X, distance, strict=True)]
    return convergence_run.fitted("straight", Compared(found))


def test_a_ribbon_that_is_the_limit_is_said_to_be():
    one = made(0.3 * X**0.6)
    assert one.slope.value == pytest.approx(0.6)
    assert one.inside
    text = " ".join(convergence_write.sentences([one]))
    assert "5 of 5 rows" in text
    assert "Slope of the distance against h/w in log-log: 0.600" in text
    assert "The ribbon is the limit" in text
    total = next(s for s in one.scalars if s.name == "total energy")
    assert (total.value.value, total.ribbon) == (pytest.approx(-54.0), -54.0)  # without the constant
    end = next(s for s in one.scalars if s.name == "end x / l")
    assert end.value.value == pytest.approx(-0.3, abs=1e-3)
    assert end.inside
    assert not any(s.name.startswith("end z") for s in one.scalars)  # nothing out of the plane


def test_a_ribbon_that_is_not_the_limit_is_said_not_to_be():
    one = made(2e-2 + 0.3 * X**0.9)
    assert one.limit.d0.value == pytest.approx(2e-2, rel=1e-2)
    assert one.inside is False
    assert "is not the limit" in " ".join(convergence_write.sentences([one]))


def test_rows_not_above_their_errors_are_shown_and_excluded():
    one = made(0.3 * X**0.6, shell_error=0.05)
    assert 0 < len(one.points) < X.size
    table = convergence_write.row_table(one, False)
    assert len(table.rows) == X.size
    assert table.values("claimed").count(False) == X.size - len(one.points)
    assert table.values("shell_error") == (0.05,) * X.size
    assert "take no part" in " ".join(convergence_write.sentences([one]))


def test_nothing_claimed_says_so():
    one = made(0.3 * X**0.6, shell_error=1.0)
    assert one.slope is None
    assert one.limit is None
    assert one.scalars == ()
    text = " ".join(convergence_write.sentences([one]))
    assert "No slope" in text
    assert "No limit" in text


@pytest.mark.parametrize(("far", "told"), [(5e-2, "straight ruling is nearer"), (1.2e-2, "do not allow to say")])
def test_the_nearer_ruling_is_named_only_above_the_errors(far, told):
    near = convergence_run.Study("straight", Compared([row(100, 1.1e-2, 1e-3, 1e-4)]), rows(X), None, None, ())
    other = convergence_run.Study("free", Compared([row(100, far, 1e-3, 1e-4)]), rows(X), None, None, ())
    assert told in convergence_write.sentences([other, near])[-1]


def test_ratios_come_from_the_option_the_scene_or_the_default():
    scene = load("curl_4_3")
    assert convergence_run.prepared(scene).shell.width_to_thickness == scene.shell.width_to_thickness
    assert convergence_run.prepared(scene, [50, 20], (20, 2)).shell.width_to_thickness == (20, 50)
    one = scene.replace({"shell.width_to_thickness": 30})
    assert convergence_run.prepared(one).shell.width_to_thickness == convergence_run.RATIOS
    none = scene.replace({"shell.width_to_thickness": None})
    assert require_shell(convergence_run.prepared(none)) == convergence_run.RATIOS
    with pytest.raises(BadInput, match="two values at least"):
        convergence_run.prepared(scene, [50])
    assert require_shell(convergence_run.prepared(load("roman_6_2"))) == convergence_run.RATIOS  # walls are no obstacle


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--width-to-thickness", "50"], "--width-to-thickness"),
        (["--width-to-thickness", "0.5", "20"], "above 1"),
        (["--elements", "0", "2"], "--elements"),
        (["--ruling", "loose"], "free, straight, both"),
        (["--set", "strip.width=-1"], "strip.width"),
    ],
)
def test_bad_input_is_one_line_before_anything_is_made(arguments, said, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["converge", "curl_4_3", "--out", str(out), *arguments]) == 2
    error = capsys.readouterr().err.strip().splitlines()
    assert said in error[-1]
    assert not out.exists()


def test_rulings_are_for_models_that_have_them(tmp_path, capsys):
    out = tmp_path / "out"
    with registered(tmp_path / "site", Straight):
        arguments = ["converge", "cantilever", "--set", "model.energy=straight", "--ruling", "both", "--out", str(out)]
        assert main(arguments) == 2
        assert "--ruling" in capsys.readouterr().err
        convergence_run.check_rulings(load("cantilever"), ("free",))  # of the ribbon
    assert not out.exists()


class Straight(Arc):
    """An arc that reads nothing of its clamp but where it is."""

    name = "straight"
    reads = frozenset({"title", "strip.*", "gravity.*", "clamp.start.position", "model.*", "seed.*", "shell.*"})


@pytest.mark.shell
@pytest.mark.validate
def test_a_model_from_outside_is_converged(tmp_path):
    """The scene's energy chooses it; its distances, end and energy are those of its own state."""
    pytest.importorskip("dolfinx")
    out = tmp_path / "out"
    with registered(tmp_path / "site", Arc):
        arguments = ["converge", "cantilever", "--set", "model.energy=arc", "--set", "strip.natural_curvature=3.0",
                     "--elements", "20", "2", "--width-to-thickness", "10", "20", "50", "--out", str(out)]  # fmt: skip
        assert main(arguments) == 0
        scene = load("cantilever").replace({"model.energy": "arc", "strip.natural_curvature": 3.0})
        state = solve(scene)
    result = json.loads((out / "result.json").read_text())
    assert state.model == "arc"
    assert result["end"]["position"] == pytest.approx(state.end.position.tolist())
    assert [r["ribbon_error"] for r in result["rows"]] == [8.0**-2] * 3
    # it has no weight; and it cannot say where it would rest from the shell's shape, so that nothing is claimed of both
    assert all(r["hausdorff"] > 0.1 and r["same_state"] is None and not r["claimed"] for r in result["rows"])
    assert result["energy"]["elastic"] == pytest.approx(state.energy.elastic)
    assert result["convergence"]["limit"] is None  # it takes four rows
    assert (out / "arc.vtu").exists()
    assert not (out / "ribbon.vtu").exists()


@pytest.mark.shell
def test_converge_from_the_command_line(tmp_path, capsys):
    pytest.importorskip("dolfinx")
    arguments = ["converge", "curl_4_3", "--elements", "20", "2", "--width-to-thickness", "5", "10", "20",
                 "--ruling", "both", "--out", str(tmp_path)]  # fmt: skip
    assert main(arguments) == 0
    said = capsys.readouterr().out
    assert "Slope of the distance" in said
    result = json.loads((tmp_path / "result.json").read_text())
    assert [r["width_to_thickness"] for r in result["rows"]] == [5, 10, 20]
    assert {"hausdorff", "ribbon_error", "shell_error", "claimed"} <= result["rows"][0].keys()
    assert [one["ruling"] for one in result["rulings"]] == ["straight", "free"]
    low, high = result["convergence"]["slope"]["both"]
    assert low < result["convergence"]["slope"]["value"] < high
    # the same shells beside both ribbons, another distance
    first, other = (one["rows"] for one in result["rulings"])
    assert [r["shell_error"] for r in first] == [r["shell_error"] for r in other]
    assert first[0]["hausdorff"] != other[0]["hausdorff"]
    page = read_page(tmp_path)
    assert page.command == "converge"
    for picture in page.pictures:
        assert picture.alt
        assert (tmp_path / picture.file).stat().st_size > 20_000
    for surface in page.surfaces:
        assert (tmp_path / surface.file).exists()
    assert str(tmp_path) not in (tmp_path / "page.json").read_text() + (tmp_path / "result.json").read_text()


def test_rows_of_several_thicknesses_have_one_energy():
    """Left open, a thick strip asks for the energy with thickness, a thin one for none: distances of both on one line
    had the slope of no model. All rows have that of the thickest."""
    scene = curled(2e-3).replace({"shell.width_to_thickness": [25.0, 1000.0]})
    own = model("ribbon").variants(scene)
    assert [settled(one.scene).model.energy for one in own] == ["finite", "sadowsky"]
    assert [one.scene.model.energy for one in one_energy(own)] == ["finite", "finite"]
    assert [one.keys for one in one_energy(own)] == [one.keys for one in own]
    named = model("ribbon").variants(scene.replace({"model.energy": "finite"}))
    assert one_energy(named) == named
