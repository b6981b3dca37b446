"""Pins: what agrees, what is disproved, what stays undecided; the command, files of pins, bad input."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from compare.check import Verdict, assert_agreement, cache_folder, check
from compare.cli import BAD_INPUT, DONE, NOT_CONVERGED, main
from compare.models.base import Seconds
from compare.models.scope import require_shell
from compare.page.pair import Times
from compare.scene.scene import load
from compare.store.store import CaseStore
from compare.studies.agreement import verdict as checking
from compare.studies.agreement.pins import Pin, is_pins, read_pins
from compare.studies.agreement.verdict import judged, up
from compare.studies.compare import Row
from ribbonbench.errors import BadInput
from tests.compare.scene import held_scenes

CHEAP = {"strip.poisson": 0.0, "shell.elements": [20, 2]}


def row(ratio=100.0, **changes):
    plain = Row(
        width_to_thickness=ratio, status="converged", stable=True, message="", hausdorff=0.02, centreline=0.02,
        ribbon_error=0.001, shell_error=0.002, claimed=True, energy=None,
        share={"bending": 0.98, "membrane": 0.015, "shear": 0.005}, shell_end=None, shell_middle=None,
        seconds=Times(0.01, 9.0), elements=(40, 4), newton_iterations=40, reused=False,
        same_state=True, same_why="", share_error=0.001, warm=True, searched=False,
    )  # fmt: skip
    return replace(plain, **changes)


@pytest.fixture
def compared(monkeypatch):
    """Makes `compare` return given rows; returns the function that sets them."""

    def give(*rows, ok=True):
        fast = SimpleNamespace(
            model="ribbon", ok=ok, message="saddle: not stable", stable=ok, lowest_eigenvalue=1.0,
            word="converged" if ok else "saddle", seconds=Seconds(0.1, (0.01,)), remedy=None,
        )  # fmt: skip

        def compare(scene, store, reporter, *, leave_saddle, bare):
            return SimpleNamespace(scene=scene, fast=fast, rows=rows)

        monkeypatch.setattr(checking, "compare", compare)

    return give


def outcome(**bounds):
    ratios = bounds.pop("width_to_thickness", [100])
    return check(Pin.of(load("curl_4_3"), width_to_thickness=ratios, **bounds), CaseStore("unused"))


@pytest.mark.parametrize(
    ("bound", "verdict"),
    [(0.0231, "agreed"), (0.0229, "undecided"), (0.0171, "undecided"), (0.0169, "disproved")],
)
def test_a_distance_is_decided_by_three_numbers(compared, bound, verdict):
    """d = 0.02, errors 0.001 and 0.002: proved from 0.023 on, disproved below 0.017."""
    compared(row())
    found = outcome(distance=bound)
    assert found.verdict is Verdict(verdict)
    assert found.agreed == (verdict == "agreed")
    claim = found.claims[0]
    assert (claim.value, claim.ribbon_error, claim.shell_error) == (0.02, 0.001, 0.002)
    assert claim.provable == pytest.approx(0.023)
    for number in ("2.00e-02", "1.0e-03", "2.0e-03", f"{bound:g}"):
        assert number in claim.says


@pytest.mark.parametrize("same", [False, None])
def test_a_shell_in_another_state_proves_and_disproves_nothing(compared, same):
    compared(row(same_state=same, same_why="it rests there"))
    for bound in ({"distance": 0.5}, {"distance": 1e-6}, {"share": 0.5}):
        found = outcome(**bound)
        assert found.verdict is Verdict.UNDECIDED
        assert "it rests there" in found.message()


def test_an_undecided_claim_says_which_mesh_to_refine(compared):
    compared(row())
    assert "shell.elements = [80, 8]" in outcome(distance=0.0225).message()
    compared(row(ribbon_error=0.003))
    message = outcome(distance=0.0225).message()
    assert "model.elements = 40" in message
    assert "prove a bound of 0.025" in message or "prove a bound of 0.026" in message


@pytest.mark.parametrize("missing", ["ribbon_error", "shell_error"])
def test_an_unknown_error_proves_nothing(compared, missing):
    compared(row(**{missing: None}))
    found = outcome(distance=1.0)
    assert found.verdict is Verdict.UNDECIDED
    assert f"the {missing.split('_')[0]}'s discretisation error is unknown" in found.message()


def test_shares_have_errors_too(compared):
    compared(row())
    assert outcome(share=0.0161).agreed
    assert outcome(share=0.0159).verdict is Verdict.UNDECIDED
    assert outcome(share=0.0139).verdict is Verdict.DISPROVED
    compared(row(share_error=None))
    assert outcome(share=0.5).verdict is Verdict.UNDECIDED


def test_a_slope_and_its_error(compared):
    """d = c (h/w)^0.6 exactly; errors of one per cent move the slope between 50 and 200 by 0.02 / ln 4."""
    distances = {ratio: ratio**-0.6 for ratio in (50.0, 200.0)}
    compared(*(row(r, hausdorff=d, ribbon_error=0.004 * d, shell_error=0.006 * d) for r, d in distances.items()))
    found = outcome(slope=[0.55, 0.65], width_to_thickness=[50, 200])
    assert found.claims[0].value == pytest.approx(0.6)
    assert found.claims[0].error == pytest.approx(0.02 / np.log(4.0))
    assert found.agreed
    assert outcome(slope=[0.59, 0.65], width_to_thickness=[50, 200]).verdict is Verdict.UNDECIDED
    assert outcome(slope=[0.65, 0.7], width_to_thickness=[50, 200]).verdict is Verdict.DISPROVED


def test_no_stable_equilibrium_is_no_agreement(compared):
    compared(row(), ok=False)
    found = outcome(distance=1.0)
    assert found.verdict is Verdict.UNSOLVED
    assert "the ribbon is saddle" in found.message()
    compared(row(status="limit_point", message="gravity stopped", hausdorff=None))
    found = outcome(distance=1.0, share=0.9)
    assert found.verdict is Verdict.UNSOLVED
    assert found.message().count("the shell is limit_point: gravity stopped") == 2


def test_every_thickness_counts(compared):
    compared(row(20.0, hausdorff=0.08), row(100.0))
    found = outcome(distance=0.03, width_to_thickness=[20, 100])
    assert [claim.verdict for claim in found.claims] == [Verdict.DISPROVED, Verdict.AGREED]
    assert found.verdict is Verdict.DISPROVED


def test_the_line_for_a_test_suite(compared, tmp_path):
    compared(row())
    assert_agreement("curl_4_3", distance=0.025, width_to_thickness=100, cache=tmp_path)
    with pytest.raises(AssertionError, match=r"distance 2\.00e-02 l, ribbon error 1\.0e-03, shell error 2\.0e-03"):
        assert_agreement("curl_4_3", distance=0.01, width_to_thickness=100, cache=tmp_path)
    assert_agreement(load("curl_4_3"), share=0.02, cache=tmp_path)


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({}, "nothing is claimed"),
        ({"distance": 0.0}, r"distance = 0\.0: is not in"),
        ({"distance": float("nan")}, "is not a number"),
        ({"distance": "0.1"}, "is not a number"),
        ({"share": 2.0}, "is not in"),
        ({"slope": [0.5]}, "lowest, highest"),
        ({"slope": [0.7, 0.5], "width_to_thickness": [20, 50]}, "not below"),
        ({"slope": [0.5, 0.7], "width_to_thickness": 50}, "two w/h"),
        ({"distance": 0.1, "keys": {"strip.gama": 1.0}}, "strip.gama"),
        ({"distance": 0.1, "width_to_thickness": -5}, "width_to_thickness"),
        ({"distance": 0.1, "width_to_thickness": 5, "keys": {"shell.width_to_thickness": [5]}}, "too"),
    ],
)
def test_what_cannot_be_claimed(compared, keywords, message, tmp_path):
    compared(row())
    with pytest.raises(BadInput, match=message):
        assert_agreement("curl_4_3", cache=tmp_path, **keywords)


def test_a_scene_without_a_shell_is_refused(tmp_path):
    path = tmp_path / "circle.toml"
    path.write_text(held_scenes.CIRCLE)
    with pytest.raises(BadInput, match="width_to_thickness"):
        assert_agreement(path, distance=0.1, cache=tmp_path)
    path.write_text(held_scenes.TWO_CLAMPS)
    with pytest.raises(BadInput, match="width_to_thickness"):
        assert_agreement(str(path), distance=0.1, cache=tmp_path)


def test_judged_and_rounded():
    assert judged(1.0, 0.0, 1.0) is Verdict.AGREED
    assert judged(1.0, 0.0, 0.999) is Verdict.DISPROVED
    assert [up(v) for v in (0.0251, 0.025, 3.01e-6, 0.999, 12.1, 0.0)] == [0.026, 0.025, 3.1e-6, 1.0, 13.0, 0.0]


def test_where_shell_runs_are_kept(monkeypatch, tmp_path):
    monkeypatch.setenv("RIBBONBENCH_CACHE", str(tmp_path / "all"))
    monkeypatch.delenv("RIBBONBENCH_CHECK", raising=False)
    assert cache_folder() == tmp_path / "all"  # the store of all commands
    monkeypatch.setenv("RIBBONBENCH_CHECK", str(tmp_path / "own"))
    assert cache_folder() == tmp_path / "own"
    assert cache_folder(tmp_path / "given") == tmp_path / "given"
    (tmp_path / "file").write_text("")
    with pytest.raises(BadInput):
        cache_folder(tmp_path / "file")


# -- files of pins ----------------------------------------------------------------------------------------------------


def pins_file(tmp_path, text):
    path = tmp_path / "agreements.toml"
    path.write_text(text)
    return path


def test_a_file_of_pins_finds_scenes_beside_it(tmp_path):
    (tmp_path / "mine.toml").write_text(load("curl_4_3").to_toml())
    path = pins_file(
        tmp_path,
        '[[agreement]]\nscene = "mine.toml"\ndistance = 0.1\nwidth_to_thickness = 50\nset.strip.gamma = 50.0\n'
        '[[agreement]]\nscene = "cantilever"\nslope = [0.3, 0.8]\nset = {"shell.elements" = [20, 2]}\n',
    )
    first, second = read_pins(path)
    assert first.scene.gamma == 50.0
    assert require_shell(first.scene) == (50.0,)
    assert second.slope == (0.3, 0.8)
    assert second.scene.shell.elements == (20, 2)
    assert is_pins(path)
    assert not is_pins(tmp_path / "mine.toml")
    assert not is_pins("curl_4_3")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "has no pin"),
        ("[agreement]\nscene = 'cantilever'\n", "has no pin"),
        ("title = 'x'\n[[agreement]]\n", "title"),
        ("[[agreement]]\ndistance = 0.1\n", r"agreement\.0\.scene"),
        ("[[agreement]]\nscene = 'cantilever'\ndistanse = 0.1\n", "did you mean distance"),
        ("[[agreement]]\nscene = 'cantilever'\ndistance = 'x'\n", r"agreement\.0\.distance"),
        ("[[agreement]]\nscene = 'cantilever'\ndistance = 0.1\nset = 3\n", "not a table"),
        ("[[agreement]]\nscene = 'cantilever'\ndistance = 0.1\nvalidate = 1\n", "not true or false"),
        ("[[agreement]]\nscene = 'none.toml'\ndistance = 0.1\n", r"none\.toml"),
        ("[[agreement", "not valid TOML"),
    ],
)
def test_bad_files_of_pins(tmp_path, text, message):
    with pytest.raises(BadInput, match=message):
        read_pins(pins_file(tmp_path, text))


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(BadInput, match="cannot be read"):
        read_pins(tmp_path / "none.toml")


# -- the command ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("bound", "code"), [("0.03", DONE), ("0.021", NOT_CONVERGED), ("0.01", NOT_CONVERGED)])
def test_the_command(compared, tmp_path, capsys, bound, code):
    compared(row())
    arguments = ["check", "curl_4_3", "--distance", bound, "--width-to-thickness", "100", "--out", str(tmp_path)]
    assert main(arguments) == code
    said = " ".join(capsys.readouterr().out.split())
    assert ("not agreed" in said) == (code != DONE)
    result = json.loads((tmp_path / "result.json").read_text())
    assert result["status"] == {"0.03": "agreed", "0.021": "undecided", "0.01": "disproved"}[bound]
    assert result["pins"][0]["claims"][0]["value"] == 0.02
    assert str(tmp_path) not in (tmp_path / "page.json").read_text()


def test_pinning_a_scene_of_ones_own(compared, tmp_path, capsys):
    """The pin is written beside the scene and agrees when it is checked."""
    compared(row())
    mine = tmp_path / "mine.toml"
    mine.write_text(load("curl_4_3").to_toml())
    out = tmp_path / "out"
    assert main(["check", str(mine), "--pin", "--width-to-thickness", "100", "--set", "strip.gamma=99.5",
                 "--out", str(out)]) == DONE  # fmt: skip
    assert "agreements.toml" in capsys.readouterr().out
    pin = read_pins(out / "agreements.toml")[0]
    assert pin.distance == pytest.approx(0.026)  # 0.02 + 2 (0.001 + 0.002)
    assert pin.share == pytest.approx(0.017)
    assert pin.scene.gamma == 99.5
    assert main(["check", str(out / "agreements.toml"), "--out", str(out), "--quiet"]) == DONE


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["curl_4_3"], "nothing is claimed"),
        (["no_such_scene", "--distance", "0.1"], "no_such_scene"),
        (["moebius_table_edge", "--distance", "0.1"], "shell.width_to_thickness"),
        (["curl_4_3", "--distance", "-1"], "--distance"),
        (["curl_4_3", "--pin", "--distance", "0.1"], "--pin"),
        (["--distance", "0.1"], "--distance"),
        (["--pin"], "--pin"),
        (["--set", "strip.gamma=1"], "--set"),
    ],
)
def test_bad_input_of_the_command(arguments, message, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(checking, "compare", None)
    assert main(["check", *arguments, "--out", str(tmp_path)]) == BAD_INPUT
    error = capsys.readouterr().err
    assert message in error
    assert len(error.strip().splitlines()) <= 2


@pytest.mark.shell
def test_a_real_pair_and_its_cache(tmp_path, monkeypatch):
    """No Poisson effect: 1e-3 is proved even on 20 x 2 elements, 1e-9 is not; the second check starts no process."""
    pytest.importorskip("dolfinx")
    assert_agreement("cantilever", distance=1e-3, share=1e-3, width_to_thickness=100, keys=CHEAP, cache=tmp_path)

    def refused(*arguments, **keywords):
        raise AssertionError("a process was started")

    monkeypatch.setattr(subprocess, "Popen", refused)
    with pytest.raises(AssertionError, match=r"undecided|disproved"):
        assert_agreement("cantilever", distance=1e-9, width_to_thickness=100, keys=CHEAP, cache=tmp_path)
    monkeypatch.undo()
    again = subprocess.run([sys.executable, "-c", AGAIN, str(tmp_path)], capture_output=True, text=True, check=False)
    assert again.returncode == 0, again.stderr


#: A check whose shells are found, in a process of its own: it solves the ribbon once on each of three sizes, looks for
#: rivals three times, starts no process of the shell's, and loads nothing but what that takes.
AGAIN = f"""
import subprocess, sys
import compare.check
from compare.check import assert_agreement
started, solved = [], []
class Popen(subprocess.Popen):
    def __init__(self, words, *rest, **more):
        started.append([str(word) for word in words])
        super().__init__(words, *rest, **more)
subprocess.Popen = Popen
import ribbon.find.solving.search as find
whole = find.once
def counted(*rest, **more):
    solved.append(1)
    return whole(*rest, **more)
find.once = counted
import ribbon.solvers.newton as newton
exact, roughly = newton.minimise, []
def told(*rest, rough=False, **more):
    roughly.extend([1] * rough)
    return exact(*rest, rough=rough, **more)
newton.minimise = told
assert_agreement("cantilever", distance=1e-3, share=1e-3, width_to_thickness=100, keys={CHEAP!r}, cache=sys.argv[1])
assert not [words for words in started if any("shellref" in word for word in words)], started
assert len(solved) == 3, solved  # on three sizes
assert len(roughly) >= 3, roughly  # the probe for rivals, led back
heavy = ("vtkmodules", "vtk", "pyvista", "matplotlib", "skfem", "dolfinx")
assert not [name for name in sys.modules if name in heavy]
"""
