"""Scenes of several strips: read strictly, every fault one line with its remedy, written and read again."""

import copy
import tomllib

import pytest

from compare.scene.inputs.source import shipped, shipped_strips
from compare.scene.scene import load
from compare.scene.strips.read import build, loads
from compare.scene.strips.scene import is_several
from compare.scene.strips.spec import KEYS
from ribbonbench.errors import BadInput
from tests.docs_blocks import DOCS, blocks

CLAMP = {"position": [0.0, 0.0, 0.0], "tangent": [0.0, 0.0, 1.0], "normal": [0.0, 1.0, 0.0]}
STRIP = {"length": 1.0, "width": 0.05, "poisson": 0.3}


def document(**more):
    """Two strips, one behind the other, the first one clamped."""
    found = {
        "strip": [{"name": "left", **STRIP, "clamp": {"start": dict(CLAMP)}}, {"name": "right", **STRIP}],
        "joint": [{"a": "left.end", "b": "right.start"}],
    }
    return {**copy.deepcopy(found), **more}


def changed(path, value):
    """The document with one value changed, or (None) left out; path: words and numbers."""
    found = document()
    *way, last = path
    at = found
    for word in way:
        at = at.setdefault(word, {}) if isinstance(at, dict) else at[word]
    if value is None:
        del at[last]
    elif isinstance(at, list):
        at.append(value)
    else:
        at[last] = value
    return found


def fault(given):
    with pytest.raises(BadInput) as caught:
        build(given)
    assert "\n" not in str(caught.value)
    assert caught.value.remedy
    return caught.value


@pytest.mark.parametrize(
    ("path", "value", "key", "said"),
    [
        (("joint", 0, "a"), "left.start", "joint.0.a", "clamp already"),
        (("joint", 0, "a"), "left.middle", "joint.0.a", "no end of a strip"),
        (("joint", 0, "b"), "other.start", "joint.0.b", "no end of a strip"),
        (("joint", 0, "b"), None, "joint.0.b", "missing"),
        (("joint", 0, "b"), "left.end", "joint.0.b", "joined to left.end already"),
        (("joint", 0, "kind"), "glue", "joint.0.kind", ""),
        (("joint", 0, "angle"), 200.0, "joint.0.angle", ""),
        (("joint", 0, "axis"), "t_x", "joint.0.axis", ""),
        (("joint", 0, "colour"), "red", "joint.0.colour", "known key"),
        (("joint", 1), {"a": "right.start", "b": "left.end"}, "joint.1.b", "already"),
        (("strip", 1, "name"), "left", "strip.1.name", "earlier strip"),
        (("strip", 1, "name"), "1st", "strip.1.name", "not a name"),
        (("strip", 1, "name"), None, "strip.name", "missing"),
        (("strip", 1, "width"), -1.0, "strip.right.width", ""),
        (("strip", 1, "width"), 2.0, "strip.right.width", "not smaller"),
        (("strip", 1, "thickness"), 1e-3, "strip.left.thickness", "missing"),
        (("strip", 1, "second_moment"), 1e-9, "strip.right.second_moment", "not a known key"),
        (("strip", 0, "clamp", "start", "tangent"), [0.0, 0.0, 2.0], "strip.left.clamp.start.tangent", ""),
        (("strip", 0, "clamp", "start", "slide"), [0.0, 0.0, 1.0], "strip.left.clamp.start.slide", "several strips"),
        (("strip", 0, "clamp", "side"), dict(CLAMP), "strip.left.clamp.side", "no end"),
        (("strip", 0, "clamp"), None, "strip.left.clamp", "clamp"),
        (("strip", 1, "clamp"), {"end": {**CLAMP, "position": [0.0, 0.0, 2.5]}}, "strip.right.clamp.end.position",
         "2 long"),
        (("strip", 1, "seed"), {"curvature": "round"}, "strip.right.seed.curvature", ""),
        (("strip", 1, "tip"), {"moment": [0.0, 1.0]}, "strip.right.tip.moment", ""),
        (("strip",), [{"name": "one", **STRIP, "clamp": {"end": dict(CLAMP)}, "tip": {"moment": [0.0, 0.0, 1.0]}}],
         "strip.one.tip.moment", "holds"),
        (("strip",), [{"name": "one", **STRIP, "tip": {"moment": [0.0, 0.0, 1.0]}}],
         "strip.one.clamp", "pulls it away"),
        (("strip", 1, "tip"), {"tension": 1.0}, "strip.right.tip.tension", "no direction"),
        (("strip", 1, "tip"), {}, "strip.right.tip.force", "missing"),
        (("strip", 1, "tip"), {"load": 1.0}, "gravity.up", "[tip] hangs"),
        (("strip",), [{"name": "one", **STRIP, "clamp": {"end": dict(CLAMP)}, "tip": {"force": [0.0, 0.0, 1.0]}}],
         "strip.one.tip", "holds"),
        (("strip",), [{"name": "one", **STRIP, "tip": {"force": [0.0, 0.0, 1.0]}}], "strip.one.clamp", "pulls it away"),
        (("tip",), {"force": [0.0, 1.0, 0.0]}, "tip", "behind its [[strip]]"),
        (("joint",), [], "strip.right.clamp", "held by no clamp"),
        (("strip",), [], "strip", "array of tables"),
        (("closure",), {"kind": "circle"}, "closure", "several strips"),
        (("path",), [{"strip.width": 0.1}], "path[0].strip.width", "several strips"),
        (("path",), [{"joint.0.angle": 10.0}], "path[0].joint.0.angle", "several strips"),
        (("path",), [{}], "path[0]", "changes no key"),
        (("path",), [{"strip.middle.clamp.start.position": [0, 0, 0]}], "path[0].strip.middle.clamp.start.position",
         "names no strip"),
        (("path",), [{"steps": 3, "gravity.up": [0.0, 1.0, 0.0]}], "path[0].steps", "first"),
        (("path",), [{"strip.left.clamp.start.tangent": [0.0, 0.0, 3.0]}],
         "path[0].strip.left.clamp.start.tangent", ""),
        (("path",), {"gravity.up": [0.0, 1.0, 0.0]}, "path", "array of tables"),
        (("wall",), [{"point": [0.0, -1.0, 0.0], "normal": [0.0, 1.0, 0.0], "stiffness": 3.0}], "wall.stiffness",
         "several strips"),
        (("wall",), [{"point": [0.0, 1.0, 0.0], "normal": [0.0, 1.0, 0.0]}], "strip.left.clamp.start.position",
         "wrong side"),
        (("obstacle",), [{"kind": "sphere", "point": [0.0, 0.0, 0.0], "radius": 0.5}],
         "strip.left.clamp.start.position", ""),
        (("obstacle",), [{"kind": "cube", "point": [0.0, 0.0, 0.0]}], "obstacle.0.kind", ""),
        (("wall",), {"point": [0.0, 1.0, 0.0]}, "wall", "array of tables"),
        (("clamp",), {"start": dict(CLAMP)}, "clamp", "several strips"),
        (("model",), {"tolerance": 1e-3}, "model.tolerance", "several strips"),
        (("model",), {"energi": "sadowsky"}, "model.energi", "known key"),
        (("contact",), {"section": "round"}, "contact.section", "several strips"),
        (("contact",), {}, "contact.distance", "missing"),
        (("contact",), {"distance": 1e-9}, "contact.distance", "1e-4"),
        (("gravity",), {"up": [0.0, 0.0, 2.0]}, "gravity.up", ""),
        (("colour",), "red", "colour", "known key"),
    ],
)  # fmt: skip
def test_every_fault_names_its_key_and_a_remedy(path, value, key, said):
    given = changed(path, value)
    if path == ("strip", 0, "clamp"):
        given["gravity"] = {"up": [0.0, 0.0, 1.0]}
        given["strip"] = [{**strip, "gamma": 1.0} for strip in given["strip"]]
    if path == ("strip",) and value:
        given["joint"] = []
    found = fault(given)
    assert found.key == key
    assert said in str(found)


@pytest.mark.parametrize(
    ("joint", "key"),
    [
        ({"kind": "seamless", "angle": 10.0}, "joint.0.angle"),
        ({"kind": "pin", "angle": 10.0}, "joint.0.angle"),
        ({"kind": "seamless", "b": "right.end"}, "joint.0.kind"),
        ({"kind": "seamless", "ruling": "free"}, "joint.0.ruling"),
    ],
)
def test_a_joint_that_means_nothing_is_refused(joint, key):
    given = document()
    given["joint"][0] |= joint
    assert fault(given).key == key


def test_strips_that_go_on_are_alike():
    given = document()
    given["joint"][0]["kind"] = "seamless"
    assert build(given).joints[0].spec.kind == "seamless"
    given["strip"][1]["width"] = 0.06
    assert "width 0.05 and 0.06" in str(fault(given))


def test_stiffness_follows_from_what_the_strips_say():
    given = document()
    assert len(set(build(given).stiffness)) == 1
    for strip, h, nu in zip(given["strip"], (1e-3, 2e-3), (0.3, 0.3), strict=True):
        strip |= {"thickness": h, "poisson": nu}
    one, other = build(given).stiffness
    assert other / one == pytest.approx(8.0)
    for strip, young in zip(given["strip"], (1e9, 3e9), strict=True):
        strip |= {"young": young, "density": 1000.0}
    one, other = build(given).stiffness
    assert other / one == pytest.approx(24.0)
    assert one == pytest.approx(1e9 * 1e-9 / (12 * (1 - 0.09)))


def test_a_free_bigon_stands_by_itself_and_falls_under_weight():
    given = document()
    del given["strip"][0]["clamp"]
    given["joint"] = [{"a": "left.start", "b": "right.start", "angle": 30.0},
                      {"a": "left.end", "b": "right.end", "angle": -30.0}]  # fmt: skip
    assert build(given).joints[1].other == (1, -1)
    given["gravity"] = {"up": [0.0, 0.0, 1.0]}
    assert fault(given).key == "strip.left.gamma"
    given["strip"] = [{**strip, "gamma": 0.0} for strip in given["strip"]]
    assert build(given).up is not None
    given["strip"][1]["gamma"] = 1.0
    assert "falls" in str(fault(given))


def test_only_strips_that_begin_straight_are_told_to_begin_through_a_body():
    """A chain with a free end does, and its remedy is a key; where a clamp at its end closes a loop strips are begun
    bent."""
    ball = {"name": "ball", "kind": "sphere", "point": [0.0, 0.02, 0.5], "radius": 0.1}
    chain = document(obstacle=[ball])
    (note,) = build(chain).notes()
    assert note.startswith("left: the straight strip begins through obstacle ball, from s = 0.403 on")
    assert "give strip.left.seed.curvature or" in note
    assert not loads(build(chain).to_toml(), "chain", {"strip.left.seed.curvature": 2.0}).notes()
    chain["strip"][1]["clamp"] = {"end": {**CLAMP, "position": [0.0, 0.0, 1.5]}}
    loop = build(chain)
    assert loop.has_loop
    assert not loop.notes()


@pytest.mark.parametrize("name", sorted(shipped_strips()))
def test_a_shipped_scene_is_read_written_and_read_again(name):
    text = shipped_strips()[name].read_text(encoding="utf-8")
    assert name not in shipped()
    assert is_several(text)
    scene = loads(text, f"{name}.toml")
    again = loads(scene.to_toml(), f"{name}.toml")
    assert again.canonical() == scene.canonical()
    assert not scene.notes()
    with pytest.raises(BadInput, match="solve and export alone"):
        load(name)


def test_a_key_of_one_strip_is_changed_by_its_name_or_number():
    text = shipped_strips()["bigon"].read_text(encoding="utf-8")
    scene = loads(text, "bigon.toml", {"strip.right.width": 0.02, "joint.1.angle": -10.0, "model.elements": 7})
    assert [strip.strip.width for strip in scene.strips] == [0.012, 0.02]
    assert [joint.spec.angle for joint in scene.joints] == [40.0, -10.0]
    assert {strip.model.elements for strip in scene.strips} == {7}
    with pytest.raises(BadInput, match="left, right"):
        loads(text, "bigon.toml", {"strip.middle.width": 0.02})
    with pytest.raises(BadInput, match="say which"):
        loads(text, "bigon.toml", {"strip.width": 0.02})


def test_the_example_of_the_page_is_a_scene():
    text = next(
        block.text for block in blocks((DOCS / "scenes.md").read_text(encoding="utf-8")) if "[[strip]]" in block.text
    )
    scene = loads(text, "page.toml")
    assert scene.names == ("back", "tongue")
    assert scene.joints[0].spec.axis == "across"


def test_a_single_strip_is_no_list():
    assert not is_several("[strip]\nlength = 1.0\n")
    assert not is_several("no toml")
    assert is_several('[[strip]]\nname = "a"\n')
    assert {name.split(".")[0] for name in KEYS} == {
        "title", "strip", "joint", "gravity", "contact", "wall", "obstacle", "path", "model",
    }  # fmt: skip
    assert tomllib.loads(build(document()).to_toml()) == document()
