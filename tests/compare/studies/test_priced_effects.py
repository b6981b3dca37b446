"""`ribbonbench explain`: what every effect, on or off, is worth; moves against whole solves, costs by a clock."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy.integrate import trapezoid

from compare.cli import DONE, main
from compare.models import solve
from compare.models.capabilities import NotDifferentiable
from compare.models.choice import chosen
from compare.models.effects import moved
from compare.page.page import read_page
from compare.scene.scene import load, loads
from compare.store.progress import Reporter
from compare.studies.effects import explain
from compare.studies.effects_measured import solves
from compare.studies.priced import effects as effects_priced
from tests.compare.scene import held_scenes

QUIET = Reporter(quiet=True)
CURL = load("curl_4_3").replace(
    {"model.elements": 10, "model.grading": None, "shell.width_to_thickness": [100], "strip.natural_curvature": 4.0}
)
OWN = """
[strip]
length = 0.2
width = 0.02
thickness = 1e-4
poisson = 0.35
natural_curvature = 15.0
young = 3e9
density = 1400.0
[gravity]
up = [0.0, 0.0, 1.0]
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, -0.6, 0.8]
[model]
energy = "{energy}"
elements = 12
"""


def prices(scene):
    return {one.effect: one for one in chosen(scene).prices(scene, solve(scene))}


def edges(state):
    s = np.linspace(0.0, 1.0, 121)
    across = 0.5 * state.width * state.shape.frames(s)[:, :, 0]
    line = state.shape.centreline(s)
    return np.stack([line - across, line, line + across])


@pytest.mark.parametrize(
    ("scene", "effect"),
    [
        (CURL, moved.FINITE_WIDTH),
        (CURL, moved.SURFACE),
        (CURL.replace({"model.energy": "sadowsky"}), moved.FINITE_WIDTH),
        (CURL.replace({"model.energy": "finite", "shell.width_to_thickness": [20]}), moved.IN_PLANE),
        (loads(OWN.format(energy="wunderlich")).replace({"model.elements": 80}), moved.THICKNESS),
        (loads(OWN.format(energy="sadowsky")), moved.NATURAL),
    ],
)  # fmt: skip
def test_first_order_moves_are_those_of_whole_solves_within_what_they_say(scene, effect):
    """Where it says that it is worth nothing (no error), nothing is promised: here it always says more."""
    own = solve(scene)
    one = next(p for p in chosen(scene).prices(scene, own) if p.effect == effect)
    pair = one.pair
    if pair is None:
        pair = next(e.changes for e in explain(scene).effects if e.key == effect), {}
    other = solve(scene.replace(dict(pair[0] if one.on else pair[1])))
    true = float(np.linalg.norm(edges(other) - edges(own), axis=-1).max())
    if one.moves_error is None:
        assert effect == moved.NATURAL  # the whole of a curl is beyond first order, and it says so
        assert one.moves > 0.1
        return
    assert true > 1e-7
    assert abs(one.moves - true) <= one.moves_error + 1e-3 * true


def test_every_effect_has_a_price_or_a_reason():
    found = prices(loads(OWN.format(energy="wunderlich")))
    off = {moved.THICKNESS, moved.IN_PLANE, moved.STRETCHING, moved.SHEAR, moved.SURFACE, moved.CURLING}
    off |= set(moved._TERMS.values())
    assert off | {moved.GRAVITY, moved.NATURAL, moved.FINITE_WIDTH, moved.CROWDING, moved.ITSELF} <= set(found)
    for name in off:
        assert not found[name].on
        assert found[name].moves > 0.0
    assert all(one.why for one in found.values())
    thin = prices(loads(held_scenes.FLOOR.partition("[[wall]]")[0]).replace({"model.energy": "sadowsky"}))
    assert thin[moved.THICKNESS].moves is None
    assert "no thickness" in thin[moved.THICKNESS].why
    assert thin[moved.FINITE_WIDTH].moves is not None


def test_what_weight_holds_is_its_work_and_its_force_is_all_of_it():
    one = prices(loads(OWN.format(energy="sadowsky")))[moved.GRAVITY]
    assert one.force_share == pytest.approx(1.0, rel=1e-6)
    assert one.energy > 0.0


def test_a_straight_strip_between_clamps_is_refused_by_name():
    """Its tension is not determined: no tangent, and the command says so in the place of numbers."""
    taut = loads(held_scenes.TWO_CLAMPS).replace(
        {"clamp.end.position": [1.0, 0.0, 0.0], "gravity": None, "strip.natural_curvature": None}
    )
    state = solve(taut)
    assert state.is_equilibrium
    with pytest.raises(NotDifferentiable, match="no derivative"):
        chosen(taut).prices(taut, state)
    found = effects_priced.priced(taut, explain(taut), solves(taut, explain(taut), QUIET, always=False), QUIET)
    assert "no derivative" in found.refused
    assert all(row.priced.moves is None for row in found.rows)


def test_costs_are_differences_in_turns_never_above_all_of_it(monkeypatch):
    """By a clock of its own: with weight 5 ms, at times 9, without 2; the first pair, which loads, is left out."""
    given = []

    def spent(scene, each):
        given.append(scene.gravity is not None)
        if len(given) <= 2:
            return 1.0
        return 0.002 if scene.gravity is None else (0.009 if len(given) % 5 == 0 else 0.005)

    monkeypatch.setattr(effects_priced, "_spent", spent)
    cost = effects_priced.cost_of(load("cantilever"), ({"gravity": None}, {}))
    assert given[:4] == [False, True, True, False]
    assert cost.pairs == effects_priced.PAIRS
    assert cost.seconds == pytest.approx(0.003)
    assert cost.share == pytest.approx(0.6)
    assert 0.0 <= cost.spread < 0.003


def test_what_an_effect_takes_away_is_no_share_above_one(monkeypatch):
    monkeypatch.setattr(effects_priced, "_spent", lambda scene, each: 0.001 if scene.gravity is None else 1.0)
    assert effects_priced.cost_of(load("cantilever"), ({"gravity": None}, {})).share < 1.0
    monkeypatch.setattr(effects_priced, "_spent", lambda scene, each: None)
    assert effects_priced.cost_of(load("cantilever"), ({"gravity": None}, {})) is None


def test_a_solve_that_compiles_is_not_counted(monkeypatch):
    import contextlib

    counts = iter([1, 0, 0, 0, 0, 0, 0, 0])

    @contextlib.contextmanager
    def compiled():
        number = next(counts)
        yield lambda: number

    monkeypatch.setattr(effects_priced, "compiled", compiled)
    monkeypatch.setattr(effects_priced, "SPENT", 0.0)
    cost = effects_priced.cost_of(load("cantilever"), ({"gravity": None}, {}))
    assert cost.pairs == effects_priced.FEWEST
    assert next(counts) == 0  # one more round than without


def test_the_command_orders_draws_and_keeps_them(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(effects_priced, "SPENT", 0.0)
    path = tmp_path / "own.toml"
    path.write_text(OWN.format(energy="wunderlich").replace("elements = 12", "elements = 5"))
    assert main(["explain", str(path), "--out", str(tmp_path / "o")]) == DONE
    said = " ".join(capsys.readouterr().out.split())
    assert "of what is left out" in said
    result = json.loads((tmp_path / "o" / "result.json").read_text())
    rows = result["prices"]
    most = [-1.0 if row["moves"] is None else row["moves"] for row in rows]
    assert most == sorted(most, reverse=True)
    assert {row["effect"] for row in rows} >= {effect["name"] for effect in result["explanation"]["effects"]}
    assert all(row["seconds_share"] is None or row["seconds_share"] <= 1.0 for row in rows)
    page = read_page(tmp_path / "o")
    table = page.tables[0]
    assert "worth" in table.title
    first = {record["effect"]: record for record in table.records()}
    assert first[moved.THICKNESS]["moves_mm"] == pytest.approx(200.0 * first[moved.THICKNESS]["moves"])
    assert (tmp_path / "o" / page.pictures[0].file).stat().st_size > 5000


def test_a_straight_strip_has_no_share_of_its_energy():
    """Hung from its clamp: its elastic energy is rounding, of which a natural curvature's work was 7e28 parts; the work
    itself is what it was, and moves are told."""
    hung = load("cantilever").replace(
        {"clamp.start.tangent": [0.0, -1.0, 0.0], "clamp.start.normal": [0.0, 0.0, 1.0], "seed": None}
    )
    found = prices(hung.replace({"model.elements": 8}))
    assert abs(solve(hung).energy.elastic) < 1e-9 * hung.gamma
    assert all(one.energy is None for one in found.values())
    assert found["natural curvature"].moves > 0.0


def test_what_is_worth_more_than_the_whole_elastic_energy_is_no_share_of_it():
    """A strip near its rest shape has next to no elastic energy: its curl's share was a number above one."""
    scene = loads(OWN.replace("{energy}", "wunderlich")).replace({"model.elements": 4, "strip.natural_curvature": 60.0})
    state = solve(scene)
    curl = next(one for one in chosen(scene).prices(scene, state) if one.effect == "natural curvature")
    flat = float(trapezoid(0.5 * state.native.omega(np.linspace(0.0, 1.0, 401)) ** 2, dx=1.0 / 400))
    whole = state.energy.elastic + 0.5 * scene.curvature[0] ** 2
    assert flat > 10.0 * whole
    assert curl.energy is None
    assert "times the elastic energy" in curl.why
    weight = next(one for one in chosen(scene).prices(scene, state) if one.effect == "gravity")
    assert weight.energy is not None


FOLDED = """
[strip]
length = 0.5
width = 0.025
thickness = 0.002
poisson = 0.3
young = 4e9
density = 1400.0
[gravity]
up = [0.0, 0.0, 1.0]
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [0.0, 0.0, 1.0]
normal = [0.0, 1.0, 0.0]
[clamp.end]
position = [0.0, 0.0, 0.3]
tangent = [0.0, 0.0, 1.0]
normal = [0.0, 1.0, 0.0]
[seed]
curvature = [6.0, -6.0, 6.0]
[model]
energy = "sadowsky"
elements = 30
"""


def test_what_moves_a_planar_fold_by_nothing_is_known():
    """No twist, no width: the energies differ by rounding alone, and so does the step that would follow."""
    found = prices(loads(FOLDED))
    nothing = (moved.FINITE_WIDTH, moved.SURFACE, moved.IN_PLANE, "odd curling of a twisted section")
    for name in (*nothing, moved.NATURAL):  # the clamps give the angle that a rest curvature would turn
        assert found[name].moves < 1e-12
        assert found[name].moves_error is not None
        assert not found[name].doubtful
    assert found[moved.THICKNESS].moves > 1e-5
