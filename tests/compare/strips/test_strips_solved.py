"""`ribbonbench solve` and `export` of several strips: numbers of result.json, statics by other means, files."""

import json
import shutil
import tomllib

import numpy as np
import pytest
from scipy.integrate import trapezoid

from compare import cli
from compare.measure.friction import missed
from compare.models.strips.solve import solved
from compare.models.strips.touches import touches
from compare.pages.export.vtu import read_vtu
from compare.pages.strips.page import write
from compare.scene.inputs.source import shipped_strips
from compare.scene.strips.read import build, leg, loads
from ribbonbench.errors import BadInput
from tests.compare.scene.test_strips import document

BALANCED = 1e-6


def shipped(name, **keys):
    return loads(shipped_strips()[name].read_text(encoding="utf-8"), f"{name}.toml", keys)


def run(tmp_path, *words):
    return cli.main([*words, "--out", str(tmp_path / "out"), "--quiet"])


def test_a_bigon_is_solved_drawn_and_written(tmp_path):
    assert run(tmp_path, "solve", "bigon", "--set", "model.energy=kirchhoff", "--set", "model.elements=10") == 0
    out = tmp_path / "out"
    found = json.loads((out / "result.json").read_text())
    assert found["status"] == "converged"
    assert found["stable"] is True
    assert found["unstable_modes"] == 0
    left, right = (found["strips"][name] for name in ("left", "right"))
    assert left["energy"]["elastic"] == pytest.approx(right["energy"]["elastic"], rel=1e-8)
    assert left["energy"]["elastic"] + right["energy"]["elastic"] == pytest.approx(found["energy"]["total"], rel=1e-9)
    assert max(left["unbalanced"], right["unbalanced"]) < BALANCED
    assert left["end"]["position"] == pytest.approx(right["end"]["position"], abs=1e-9)
    one, other = (np.array(strip["start"]["frame"]) for strip in (left, right))
    turned = one.T @ other
    assert turned[[0, 2], [0, 2]] == pytest.approx([np.cos(np.radians(40.0))] * 2, abs=1e-9)
    assert 0.0 < found["discretisation_error"] < 1e-4
    assert found["units"]["length_m"] == 0.3
    assert {"strips.png", "left.vtu", "right.vtu", "page.json", "result.json"} <= {path.name for path in out.iterdir()}
    assert cli.main(["export", str(out), "--format", "gltf,csv", "--out", str(tmp_path / "files"), "--quiet"]) == 0
    assert (tmp_path / "files" / "surfaces.glb").stat().st_size > 10_000


def test_a_scene_is_exported_solved_first(tmp_path):
    words = ("export", "bigon", "--set", "model.energy=kirchhoff", "--set", "model.elements=6", "--format", "obj")
    assert run(tmp_path, *words) == 0
    assert {path.stem for path in (tmp_path / "out").glob("*.obj")} == {"left", "right"}


def test_the_strip_below_carries_what_lies_on_it():
    """Force of the contacts by name, equal and opposite at both clamps; the deflection of the lower one with it."""
    state = solved(shipped("crossing", **{"model.elements": 5}), error=False)
    native = state.native
    assert state.ok
    assert native.depth <= 1e-6
    assert native.touching
    assert max(state.balance) < BALANCED
    push = sum(one.force for one in native.touching)  # on the lower strip
    lower, upper = native.strips
    unit = native.problem.stiffness_over[1]
    weight, light = (strip.gamma for strip in state.scene.strips)
    assert lower.start.force == pytest.approx([-push[0], -push[1], weight - push[2]], abs=1e-6)
    assert unit * upper.start.force == pytest.approx([push[0], push[1], unit * light + push[2]], abs=1e-6)
    assert push[2] < -0.05 * unit * light
    assert [one.gap for one in native.touching] == pytest.approx(
        [native.problem.apart] * len(native.touching), abs=2e-6
    )


def test_all_of_it_in_the_units_of_either_strip():
    """The same strips in the other order: forces in N and the energy in J are those of before."""
    scene = shipped("bigon", **{"model.elements": 8, "strip.right.width": 0.02, "strip.right.thickness": 3e-4,
                                "model.energy": "kirchhoff"})  # fmt: skip
    turned = dict(scene.document)
    turned["strip"] = turned["strip"][::-1]
    one, other = solved(scene), solved(build(turned))
    assert one.ok
    assert other.ok
    for state in (one, other):
        assert state.balance == pytest.approx([0.0, 0.0], abs=BALANCED)
    units = [state.scene.first.units for state in (one, other)]
    energies = [state.native.energy.total * unit.energy for state, unit in zip((one, other), units, strict=True)]
    assert energies[0] == pytest.approx(energies[1], rel=1e-7)
    moments = [
        float(np.linalg.norm(state.native.joints[0].moment)) * unit.energy
        for state, unit in zip((one, other), units, strict=True)
    ]
    assert moments[0] == pytest.approx(moments[1], rel=1e-5)


def test_the_shipped_ring_of_bigons_is_folded_and_opens_from_another_seed():
    """Half great circles of one sphere, pi^2 / 2 of each of twelve strips, in J too; a turn of curvature: open."""
    scene = shipped("bigon_ring")
    folded = solved(scene, error=False)
    assert folded.ok
    assert folded.native.energy.total == pytest.approx(6 * np.pi**2, rel=1e-9)
    stiffness = 4.0e9 * 1e-9 / (12 * (1 - 0.4**2))
    assert folded.native.energy.total * scene.first.units.energy == pytest.approx(
        6 * np.pi**2 * stiffness * 0.02 / 0.2, rel=1e-9
    )
    seeds = {f"strip.{name}.seed.curvature": -2.0 * np.pi / 1.2 for name in scene.names}
    opened = solved(shipped("bigon_ring", **seeds), error=False)
    assert opened.ok
    assert opened.native.energy.total < folded.native.energy.total - 1.0
    assert max(*folded.balance, *opened.balance) < BALANCED


def test_surfaces_are_in_the_units_of_the_first_strip(tmp_path):
    """Two strips of other lengths and thickness: curvature, and the integral of the energy over each; metres."""
    scene = shipped("bigon", **{"model.elements": 8, "model.energy": "kirchhoff"})
    given = dict(scene.document)
    given["strip"] = [dict(strip) for strip in given["strip"]]
    given["strip"][1] |= {"length": 0.33, "thickness": 3e-4}
    state = solved(build(given), error=False)
    assert state.ok
    write(tmp_path, state, "")
    first = state.native.problem
    for k, name in enumerate(("left", "right")):
        sheet = read_vtu(tmp_path / f"{name}.vtu")
        s, v = (sheet.fields[key].reshape(sheet.shape) for key in ("S", "v"))
        assert s.max() == pytest.approx(first.lengths_over[k])
        density = sheet.fields["energy_density"].reshape(s.shape)
        total = trapezoid(trapezoid(density, v, axis=1), s[:, 0]) / state.scene.first.width
        unit = first.stiffness_over[k]
        assert total == pytest.approx(unit * state.native.strips[k].energy.elastic, rel=1e-3)
        bent = state.native.strips[k].omega([0.5])[0] / first.lengths_over[k]
        middle = sheet.fields["omega"].reshape(s.shape)[s.shape[0] // 2, s.shape[1] // 2]
        assert middle == pytest.approx(bent, rel=1e-6)
    out = tmp_path / "files"
    assert cli.main(["export", str(tmp_path), "--format", "csv", "--out", str(out), "--quiet"]) == 0
    assert json.loads((out / "result.json").read_text())["scale"]["unit"] == "m"


def test_strips_that_find_no_equilibrium_say_so(tmp_path):
    assert run(tmp_path, "solve", "bigon", "--set", "model.budget=1e-9") == 1
    found = json.loads((tmp_path / "out" / "result.json").read_text())
    assert found["status"] == "not_converged"
    assert found["discretisation_error"] is None
    assert found["discretisation_error_why"]
    assert (
        found["energy"]
        is found["joints"]
        is found["strips"]["left"]["end"]
        is found["strips"]["left"]["forces"]
        is None
    )
    assert {path.suffix for path in (tmp_path / "out").iterdir() if path.is_file()} == {".json"}


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("solve", "bigon", "--all"), "--all"),
        (("solve", "bigon", "--time"), "--time"),
        (("solve", "bigon", "--set", "strip.left.width=-1"), "strip.left.width"),
        (("solve", "bigon", "--set", "strip.right.young=4.0"), "strip.right.young"),
        (("solve", "bigon", "--set", "model.energy=elastica"), "model.energy"),
        (("solve", "bigon", "--set", "model.energy=kirchhoff", "--set", "strip.width=1"), "strip.width"),
        (("compare", "bigon"), "solve and export alone"),
        (("limits", "bigon", "--quick"), "solve and export alone"),
        (("explain", "bigon"), "solve and export alone"),
        (("branches", "bigon", "--along", "strip.width", "--from", "1", "--to", "2"), "solve and export alone"),
        (("cost", "bigon"), "solve and export alone"),
    ],
)
def test_what_is_not_known_is_refused_in_one_line(words, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(list(words)) == 2
    heard = capsys.readouterr().err.strip()
    assert said in heard
    assert heard.count("\n") == 0
    assert not list(tmp_path.iterdir()) or not list((tmp_path / "out").rglob("result.json"))
    shutil.rmtree(tmp_path / "out", ignore_errors=True)


def test_an_energy_that_needs_a_thickness_asks_for_it():
    scene = build(document(model={"energy": "finite"}))
    with pytest.raises(BadInput, match=r"strip\.left\.thickness"):
        solved(scene)


def test_strips_that_begin_through_each_other_are_refused_with_the_place():
    scene = shipped("crossing", **{"strip.upper.clamp.start.position": [0.0, -0.15, 0.001]})
    with pytest.raises(BadInput, match=r"lower at s = .* upper at s = "):
        solved(scene)


TABLE = """
title = "A strip cut in two on a table"
[[strip]]
name = "a"
length = 0.15
width = 0.010
thickness = 2e-4
poisson = 0.4
young = 4.0e9
density = 1400.0
[strip.clamp.start]
position = [0.0, 0.0, 0.02]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
[[strip]]
name = "b"
length = 0.2
width = 0.010
thickness = 2e-4
poisson = 0.4
young = 4.0e9
density = 1400.0
[[joint]]
a = "a.end"
b = "b.start"
kind = "seamless"
[[wall]]
name = "table"
point = [0.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
[gravity]
up = [0.0, 0.0, 1.0]
[model]
energy = "kirchhoff"
elements = 10
"""


def test_a_table_carries_what_the_clamp_does_not(tmp_path):
    """Forces of walls by name and strip, balanced; the moment of the table is that of its pushes."""
    (tmp_path / "table.toml").write_text(TABLE)
    assert run(tmp_path, "solve", str(tmp_path / "table.toml")) == 0
    found = json.loads((tmp_path / "out" / "result.json").read_text())
    scene = loads(TABLE)
    weight = sum(strip.gamma * over**-2 for strip, over in zip(scene.strips, (1.0, 4.0 / 3.0), strict=True))
    (table,) = found["walls"]
    assert table["name"] == "table"
    assert set(table["strips"]) == {"b"}
    own = table["strips"]["b"]
    assert np.array(found["strips"]["a"]["forces"]["start"]) + table["force"] == pytest.approx(
        [0.0, 0.0, weight], abs=1e-6
    )
    assert sum(own["pushes"]) == pytest.approx(table["force"][2], abs=1e-6)
    assert table["moment"][1] == pytest.approx(
        -sum(push * point[0] for push, point in zip(own["pushes"], own["points"], strict=True)), abs=1e-6
    )
    assert table["force"][2] > 0.3 * weight
    assert found["penetration"] <= 1e-6
    assert max(strip["unbalanced"] for strip in found["strips"].values()) < BALANCED


def test_a_path_of_strips_leads_where_the_scene_itself_is():
    """Begun 0.18 above the table and turned on the way: the same state, by increments that jump nowhere."""
    way = """
[[path]]
"strip.a.clamp.start.position" = [0.0, 0.0, 0.2]
[[path]]
"strip.a.clamp.start.tangent" = [0.8, 0.0, 0.6]
"strip.a.clamp.start.normal" = [-0.6, 0.0, 0.8]
"wall.table.point" = [0.0, 0.0, -0.01]
steps = 3
"""
    few = {"model.elements": 6}
    scene, straight = loads(TABLE + way, "way", few), solved(loads(TABLE, "table", few), error=False)
    assert [stage.strips[0].clamp_start.position[2] for stage in scene.stages] == [0.2, 0.2]
    assert scene.steps == (None, 3, None)
    half = leg(scene, 0)(0.5)
    assert half.first.wall_points[0][2] * 0.15 == pytest.approx(-0.005)
    assert half.strips[0].start_frame[:, 2] == pytest.approx([np.cos(0.5 * np.arctan(0.75)), 0.0,
                                                              np.sin(0.5 * np.arctan(0.75))])  # fmt: skip
    state = solved(scene, error=False)
    assert state.ok
    assert [one.t for one in state.went] == [1.0, 1.0]
    assert state.went[0].increments == 3
    assert not any(one.jumps for one in state.went)
    assert state.native.energy.total == pytest.approx(straight.native.energy.total, rel=1e-7)
    assert state.native.strips[1].walls[0].force == pytest.approx(straight.native.strips[1].walls[0].force, abs=1e-5)


def test_loads_of_a_scene_are_in_its_units_and_come_up_along_its_path(tmp_path):
    """A weight of 2 g with a moment and a force in N at two ends: the clamp carries both and what the strips weigh."""
    hung = {name: value for name, value in tomllib.loads(TABLE).items() if name != "wall"}
    hung["strip"][0]["tip"] = {"force": [0.0, 1e-3, 2e-3]}
    hung["strip"][1]["tip"] = {"mass": 2e-3}
    hung["strip"][1]["tip"]["moment"] = [1e-5, 2e-5, 0.0]
    hung |= {"path": [{"strip.a.tip.force": [0.0, 0.0, 0.0]}], "model": {"energy": "kirchhoff", "elements": 6}}
    scene = build(hung)
    assert scene.stages[0].strips[0].tip_force == pytest.approx([0.0, 0.0, 0.0])
    state = solved(scene, error=False)
    assert state.ok
    assert max(state.balance) < BALANCED
    newton = scene.stiffness[0] * scene.first.strip.width / scene.first.strip.length**2
    sizes = [strip.strip.length * strip.strip.width * strip.strip.thickness for strip in scene.strips]
    weight = 9.81 * (2e-3 + 1400.0 * sum(sizes))
    force = newton * state.native.strips[0].start.force
    assert force == pytest.approx([0.0, -1e-3, weight - 2e-3], rel=1e-6, abs=1e-10)
    write(tmp_path, state, "again")
    found = json.loads((tmp_path / "result.json").read_text())
    mass = newton * np.array(found["strips"]["b"]["tip_force"])
    assert mass == pytest.approx([0.0, 0.0, -9.81 * 2e-3], rel=1e-9, abs=1e-12)
    moment = newton * scene.first.strip.length * np.array(found["strips"]["b"]["tip_moment"])
    assert moment == pytest.approx([1e-5, 2e-5, 0.0], rel=1e-9, abs=1e-15)
    assert found["energy"]["tip"] + found["energy"]["elastic"] + found["energy"]["gravity"] == pytest.approx(
        found["energy"]["total"], rel=1e-9
    )


#: Both strips light and aslant, so that one end touches: the clamp comes down, and the end slides outwards.
LIGHT = {f"strip.{name}.density": 140.0 for name in "ab"} | {"model.elements": 4}
ASLANT = {
    "strip.a.clamp.start.tangent": [0.8, 0.0, -0.6],
    "strip.a.clamp.start.normal": [0.6, 0.0, 0.8],
    "strip.a.clamp.start.position": [0.0, 0.0, 0.14],
    "path": [{"strip.a.clamp.start.position": [0.0, 0.0, 0.16]},
             {"strip.a.clamp.start.position": [0.0, 0.0, 0.14], "steps": 2}],
}  # fmt: skip


def test_a_table_that_rubs_takes_what_coulomb_says(tmp_path):
    """Lowered on a table with friction: balance with it, the law by code of its own, and what it took away."""
    scene = loads(TABLE, "rubs", {**LIGHT, **ASLANT, "wall.table.friction": 0.25})
    state = solved(scene, error=False)
    assert state.ok
    assert [one.increments for one in state.went] == [2]  # the last stage is the scene: no way is left
    assert max(state.balance) < BALANCED
    write(tmp_path, state, "again")
    found = json.loads((tmp_path / "result.json").read_text())
    (table,) = found["walls"]
    rubs = table["strips"]["b"]["rubs"]
    assert missed(rubs, 0.25, np.tile([0.0, 0.0, 1.0], (len(rubs), 1))).most < 1e-6
    assert table["friction"] == pytest.approx(np.sum([rub["friction"] for rub in rubs], axis=0), abs=1e-9)
    assert {rub["state"] for rub in rubs} == {"slips"}
    assert table["friction"][0] == pytest.approx(-0.25 * table["force"][2], rel=1e-6)
    clamp = np.array(found["strips"]["a"]["forces"]["start"])
    assert clamp[0] + table["friction"][0] == pytest.approx(0.0, abs=1e-6)
    work = -np.sum([np.array(rub["friction"]) @ rub["slip"] for rub in rubs])  # of the last of two increments
    assert 0.0 < work < found["friction_lost"]


#: Two cantilevers that face each other, 0.05 apart, the tip of the heavy one drawn along the light one.
RUBS = """
[[strip]]
name = "low"
length = 1.0
width = 0.05
thickness = 0.01
poisson = 0.3
gamma = 0.0
[strip.clamp.start]
position = [-0.85, 0.0, 0.0]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]

[[strip]]
name = "high"
length = 1.0
width = 0.05
thickness = 0.01
poisson = 0.3
gamma = 3.0
[strip.clamp.start]
position = [0.88, 0.0, 0.055]
tangent = [-1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]

[gravity]
up = [0.0, 0.0, 1.0]
[contact]
distance = 0.05
friction = 0.2
[model]
energy = "kirchhoff"
elements = 8

[[path]]
"strip.high.clamp.start.position" = [0.85, 0.0, 0.055]
[[path]]
steps = 3
"strip.high.clamp.start.position" = [0.88, 0.0, 0.055]
"""


def test_strips_rub_on_each_other_along_a_path(tmp_path):
    """Each balances with friction at its point, what slides has mu N, and something was taken away."""
    scene = loads(RUBS, "rubs")
    state = solved(scene, error=False)
    assert state.ok
    assert max(state.balance) < BALANCED
    write(tmp_path, state, "again")
    found = json.loads((tmp_path / "result.json").read_text())
    rubs = found["contact"]["rubs"]
    assert {rub["state"] for rub in rubs} == {"slips"}
    for rub in rubs:
        assert np.linalg.norm(rub["friction"]) == pytest.approx(0.2 * rub["push"], rel=1e-6)
    assert found["friction_lost"] > 1e-3
    with pytest.raises(BadInput, match=r"contact.friction = 0.2: needs a \[\[path\]\]"):
        solved(loads(RUBS[: RUBS.index("[[path]]")], "rubs"))
    with pytest.raises(BadInput, match=r"contact.friction = -0.2"):
        loads(RUBS, "rubs", {"contact.friction": -0.2})


#: A strip folded between two clamps until its sides lie on each other, one clamp then moved along them.
FOLD = """
[[strip]]
name = "fold"
length = 1.0
width = 0.05
thickness = 0.02
poisson = 0.3
[strip.clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [0.0, 0.0, 1.0]
normal = [0.0, 1.0, 0.0]
[strip.clamp.end]
position = [0.0, 0.02, 0.19]
tangent = [0.0, 0.0, 1.0]
normal = [0.0, 1.0, 0.0]
[strip.seed]
curvature = [3.0, -3.0, 3.0]
[contact]
itself = true
distance = 0.05
friction = 0.2
[model]
energy = "kirchhoff"
elements = 10

[[path]]
"strip.fold.clamp.end.position" = [0.0, 0.0, 0.6]
[[path]]
steps = 4
"strip.fold.clamp.end.position" = [0.0, 0.0, 0.19]
[[path]]
steps = 2
"strip.fold.clamp.end.position" = [0.0, 0.02, 0.19]
"""


@pytest.mark.validate  # 10 s
def test_a_strip_rubs_on_itself_along_a_path(tmp_path):
    """Coulomb's law by code of its own, forces on both places in the files, and what a path has to lead to."""
    scene = loads(FOLD, "fold")
    assert loads(scene.to_toml(), "fold").itself
    state = solved(scene, error=False)
    assert state.ok
    write(tmp_path, state, "again")
    found = json.loads((tmp_path / "result.json").read_text())
    contact = found["contact"]
    assert contact["too_near"] <= 1e-6
    assert {(one["a"], one["b"]) for one in contact["places"]} == {("fold", "fold")}
    assert {rub["state"] for rub in contact["rubs"]} == {"slips"}
    apart = np.array([np.subtract(one["position"], one["position_b"]) for one in contact["places"]])
    middle = np.array([np.add(one["position"], one["position_b"]) for one in contact["places"]]) / 2.0
    which = [int(np.argmin(np.linalg.norm(middle - rub["point"], axis=1))) for rub in contact["rubs"]]
    assert sorted(which) == [0, 1]
    normals = apart[which] / np.linalg.norm(apart[which], axis=1)[:, None]
    assert missed(contact["rubs"], 0.2, normals).most < 1e-6
    assert found["friction_lost"] > 1e-2
    touching = touches(state)
    assert len(touching) == 8  # each place and each spot, from both sides
    assert np.abs(touching.push.sum(axis=0)).max() < 1e-9
    assert np.linalg.norm(touching.friction, axis=1).max() == pytest.approx(
        0.2 * max(rub["push"] for rub in contact["rubs"]), rel=1e-6
    )
    with pytest.raises(BadInput, match=r"contact.friction = 0.2: needs a \[\[path\]\]"):
        solved(loads(FOLD[: FOLD.index("[[path]]")], "fold"))
    alone = loads(FOLD, "fold", {"contact.itself": False})
    assert "itself" in scene.canonical()
    assert "itself" not in alone.canonical()


def test_friction_that_no_way_leads_to_is_refused():
    with pytest.raises(BadInput, match=r"wall.table.friction = 0.25: needs a \[\[path\]\]"):
        solved(loads(TABLE, "table", {"wall.table.friction": 0.25}))
    there = {"path": [{"strip.a.clamp.start.position": [0.0, 0.0, 0.02]}]}  # its only stage is the scene
    with pytest.raises(BadInput, match=r"wall.table.friction = 0.25: needs a \[\[path\]\].*from elsewhere"):
        solved(loads(TABLE, "table", {**there, "wall.table.friction": 0.25}))


def test_friction_of_a_wall_and_contact_that_nothing_makes():
    """Strips that are kept apart and are far from each other rub on the table as if nothing kept them."""
    one, other = (
        solved(loads(TABLE, "rubs", {**LIGHT, **ASLANT, "wall.table.friction": 0.25, **contact}), error=False).native
        for contact in ({}, {"contact.distance": 1e-3})
    )
    assert one.ok
    assert other.ok
    assert other.rubbed == pytest.approx(one.rubbed, rel=1e-6)
    assert np.abs(other.x - one.x).max() < 1e-7


def test_stages_that_cannot_vary_step_by_step_are_refused():
    document_of = loads(TABLE).document
    jumps = {**document_of, "path": [{"strip.a.clamp.start.tangent": [-1.0, 0.0, 0.0]}]}
    with pytest.raises(BadInput, match="half turn"):
        build(jumps)
