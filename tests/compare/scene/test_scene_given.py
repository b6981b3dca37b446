"""Which keys a scene sets: read from a file, changed by keys, and of the stages of its path."""

from __future__ import annotations

from compare.scene.scene import load, loads, shipped
from tests.compare.scene.scene_texts import BASE, SI, text

WALLS = (
    '[[wall]]\npoint = [-0.5, 0.0, 0.0]\nnormal = [1.0, 0.0, 0.0]\nname = "floor"\n'
    "[[wall]]\npoint = [0.5, 0.0, 0.0]\nnormal = [-1.0, 0.0, 0.0]\n"
)


def test_a_file_gives_what_it_says_and_no_default():
    assert loads(text({"title": '"A"'})).given() == set(BASE)
    across = {"clamp.start.across": "[0.70710678118654757, 0.70710678118654757, 0.0]"}
    assert loads(text(across)).given() == set(BASE), "what is only checked gives nothing"
    said = loads(text({"model.elements": "20", "shell.clamp": '"edge"', "gravity.exact": "false"}))
    assert said.given() == {*BASE, "model.elements", "shell.clamp", "gravity.exact"}, "the default said is said"
    assert loads(text(extra="[shell]\n[seed]\n")).given() == set(BASE), "an empty section gives nothing"


def test_keys_of_walls_have_neither_number_nor_name():
    wall = {"wall.point", "wall.normal", "wall.name"}
    scene = loads(text(extra=WALLS))
    assert scene.given() == {*BASE, *wall}
    assert scene.replace({"wall.floor.stiffness": 3.0}).given() == {*BASE, *wall, "wall.stiffness"}
    assert scene.replace({"wall.1.stiffness": 3.0}).given() == {*BASE, *wall, "wall.stiffness"}
    assert scene.replace({"wall.floor": None}).given() == {*BASE, "wall.point", "wall.normal"}
    assert scene.replace({"wall": None}).given() == set(BASE)


def test_changed_keys_are_given_and_removed_ones_are_not():
    scene = loads(text({"model.tolerance": "1e-3", "shell.clamp": '"corners"', "shell.corner": "0.01"}))
    assert scene.replace({"strip.gamma": 1.0}).given() == scene.given()
    assert scene.replace({"seed.ruling": 0.0}).given() - scene.given() == {"seed.ruling"}
    assert scene.replace({"seed.ruling": None}).given() == scene.given()
    assert scene.given() - scene.replace({"gravity": False}).given() == {"gravity.up"}
    assert scene.given() ^ scene.replace({"model.elements": 20}).given() == {"model.tolerance", "model.elements"}
    assert scene.given() - scene.replace({"shell.clamp": "edge"}).given() == {"shell.corner"}
    closed = scene.replace({"closure": {"kind": "circle", "turns": 1}})
    assert closed.given() - scene.given() == {"closure.kind", "closure.turns"}
    assert loads(text(SI)).replace({"strip.gamma": 7.0}).given() == {*BASE, "strip.thickness"}


def test_a_path_gives_itself_and_the_keys_of_its_stages():
    path = '[[path]]\n"wall.floor.point" = [-0.9, 0.0, 0.0]\ngravity = false\n'
    path += "[[path]]\nseed = {ruling = 0.5}\nsteps = 3\n"
    scene = loads(text(extra=WALLS + path))
    wall = {"wall.point", "wall.normal", "wall.name"}
    assert scene.given() == {*BASE, *wall, "path", "seed.ruling"}
    first, second, last = scene.stages()
    assert first.given() == {*BASE, *wall} - {"gravity.up"}
    assert second.given() == {*first.given(), "seed.ruling"}
    assert last.given() == {*BASE, *wall}
    assert scene.replace({"path": None}).given() == last.given()
    assert last.replace({"path": [{"strip.width": 0.02}]}).given() == {*BASE, *wall, "path"}


def test_what_is_given_has_no_part_in_equality():
    plain, said = loads(text(), "a.toml"), loads(text({"model.tolerance": "1e-3"}), "a.toml")
    assert (plain, hash(plain), plain.canonical()) == (said, hash(said), said.canonical())
    assert plain.given() != said.given()


def test_what_is_given_comes_back_from_toml():
    texts = [
        text({"model.held_by": '"elimination"', "gravity.acceleration": "9.81", "seed.curvature": '"natural"'}),
        text({f"clamp.start.{name}": None for name in ("position", "tangent", "normal")}, extra="[clamp.start]\n"),
        text(extra=WALLS + '[[path]]\nmodel.arc_length = "auto"\n'),
    ]
    for content in texts:
        scene = loads(content)
        assert loads(scene.to_toml()).given() == scene.given()
    for name in shipped():
        scene = load(name)
        assert loads(scene.to_toml(), scene.source) == scene
        assert loads(scene.to_toml()).given() == scene.given()
