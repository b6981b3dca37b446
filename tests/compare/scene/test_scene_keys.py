"""Every declared key: its example is read, what is of another kind or outside its range is refused by name, `--set`
reaches it, and the tables of docs/scenes.md are those that the declarations make."""

from __future__ import annotations

import ast
import dataclasses
import math
import tomllib
from collections import Counter
from pathlib import Path

import pytest

from compare.pages.keys import MARKS, in_page, tables
from compare.scene import spec as declarations
from compare.scene.change import NO_BEARING, given_keys
from compare.scene.declare import Key, Kind, Range, collected
from compare.scene.keys import KEYS, SPECS, contract_name, within
from compare.scene.scene import Scene, load, loads, parse_assignment, shipped
from compare.scene.spec import USUAL_ACCURACY
from compare.scene.table import MAX_ELEMENTS
from ribbon.energies.names import FREE
from ribbonbench.errors import BadInput
from tests.compare.scene.scene_texts import text
from tests.docs_blocks import DOCS, blocks

LEVEL = {"clamp.start.normal": "[0.0, 1.0, 0.0]", "gravity.up": "[0.0, 1.0, 0.0]"}
END = {"clamp.end.tangent": "[0.0, 0.0, 1.0]", "clamp.end.normal": "[0.0, 1.0, 0.0]"}
PLANAR = {"model.energy": '"elastica"'}
SI = {"strip.gamma": None, "strip.young": "1.8e9", "strip.density": "1000.0", "strip.thickness": "3e-4"}
ROD = PLANAR | {"strip.gamma": None, "strip.young": "1e7", "strip.second_moment": "1e-11"}
FREE_START = {"clamp.start.tangent": None, "clamp.start.normal": None}
WALL = {"point": "[0.0, 0.0, 0.0]", "normal": "[0.0, 1.0, 0.0]"}
BAR = {"kind": '"cylinder"', "point": "[0.0, -0.3, 0.5]", "radius": "0.1", "axis": "[1.0, 0.0, 0.0]"}
EDGE = {"kind": '"edge"', "point": "[0.0, -0.3, 0.5]", "axis": "[1.0, 0.0, 0.0]", "normal": "[0.0, 1.0, 0.0]"}
BOX = {**EDGE, "kind": '"box"', "size": "[0.4, 0.2, 0.1]"}
BODIES = {"normal": EDGE, "angle": EDGE, "rounding": EDGE, "size": BOX}
ROOM = {"point": "[0.0, 0.0, 0.0]", "radius": "10.0"}

HOMES: dict[str, dict[str, str | None]] = {
    "strip.young": SI,
    "strip.density": SI,
    "strip.second_moment": ROD,
    "tip.mass": ROD,
    "tip.load": PLANAR,
    "clamp.start.frame": FREE_START,
    "clamp.end": END,
    "clamp.end.frame": {"clamp.end.position": "[0.0, 0.0, 0.5]"},
    "clamp.end.slide": END | {"clamp.end.position": "[0.0, 0.0, 0.5]"},
    "closure": {"closure.kind": '"circle"'},
    "closure.half_turns": {"closure.kind": '"moebius"'},
    "model.arc_length": PLANAR,
    "uncertainty.thickness": {"strip.thickness": "3e-4"},
    "uncertainty.young": SI,
    "uncertainty.density": SI,
    "contact": {"strip.thickness": "3e-4"},
    "contact.joints": {"contact.itself": "true", "contact.distance": "1e-3", "contact.section": '"round"'},
    "shell.corner": {"shell.clamp": '"corners"'},
}
"""What a scene says beside a level clamped strip with weight, for a key, or the keys of a section, to be right."""


def home(key: str) -> dict[str, str | None]:
    return LEVEL | HOMES.get(key, HOMES.get(key.rpartition(".")[0], {}))


def written(key: str, value: str) -> str:
    """A scene with `key = value`, raw TOML, in which nothing else is wrong."""
    section, _, name = key.rpartition(".")
    if section == "wall":
        lines = [f"{entry} = {raw}" for entry, raw in {**WALL, name: value}.items()]
        return text(LEVEL, extra="\n".join(["[[wall]]", *lines]))
    if section == "obstacle":
        bodies = {'"box"': BOX, '"edge"': EDGE} if name == "kind" else {}
        entries = {**bodies.get(value, BODIES.get(name, BAR)), **(ROOM if name == "inside" else {}), name: value}
        lines = [f"{key} = {raw}" for key, raw in entries.items() if key != "axis" or entries["kind"] != '"sphere"']
        return text(LEVEL, extra="\n".join(["[[obstacle]]", *lines]))
    if section == "path":
        return text(LEVEL, extra=f'[[path]]\n"strip.gamma" = 1.0\n[[path]]\n"strip.gamma" = 2.0\nsteps = {value}\n')
    if not section:
        return f"{name} = {value}\n" + text(LEVEL)
    return text(home(key), {key: value})


def shown(key: str) -> str:
    """How an error names the key in `written`."""
    return key.replace("wall.", "wall.0.").replace("obstacle.", "obstacle.0.").replace("path.", "path[1].")


def field_of(scene: Scene, key: str) -> object:
    section, _, name = key.rpartition(".")
    listed = {"wall": scene.walls, "obstacle": scene.obstacles, "path": scene.path}
    if section in listed:
        return getattr(listed[section][-1], name)
    return getattr(getattr(scene, section.replace(".", "_")) if section else scene, name)


def expected(about: Key, raw: str) -> object:
    """The value of the field for a raw TOML value that is right."""
    value = tomllib.loads(f"value = {raw}")["value"]
    if isinstance(value, str) and about.words:
        return about.words[value][1]
    if about.kind in (Kind.LINEAR, Kind.LAW, Kind.PIECEWISE) and not isinstance(value, list):
        return (value, value)
    if about.kind is Kind.NUMBERS and not isinstance(value, list):
        return (value,)
    if about.kind is Kind.POINTS:
        return tuple(map(tuple, value))
    return tuple(value) if isinstance(value, list) else value


def has_field(key: str) -> bool:
    return key.rpartition(".")[2] in {item.name for item in dataclasses.fields(SPECS[key.rpartition(".")[0]])}


# -- a value that is right --------------------------------------------------------------------------


@pytest.mark.parametrize("key", KEYS)
def test_the_example_is_read(key):
    scene = loads(written(key, KEYS[key].example))
    if has_field(key):
        assert field_of(scene, key) == expected(KEYS[key], KEYS[key].example)
    assert scene.given() >= {"path" if key == "path.steps" else key} - NO_BEARING
    assert loads(scene.to_toml(), scene.source) == scene


@pytest.mark.parametrize("key", KEYS)
def test_set_reaches_every_key(key):
    """From a scene without the key, where it may be without."""
    if key == "path.steps":
        name, value = parse_assignment('path=[{"strip.gamma" = 1.0}, {"strip.gamma" = 2.0, steps = 4}]')
        assert loads(text()).replace({name: value}).path[-1].steps == 4
        return
    raw = KEYS[key].example
    if key.startswith("wall."):
        assigned, scene = key.replace("wall.", "wall.0."), loads(written("wall.point", WALL["point"]))
    elif key.startswith("obstacle."):
        assigned, scene = key.replace("obstacle.", "obstacle.0."), loads(written("obstacle.radius", BAR["radius"]))
        scene = loads(written("obstacle.inside", "true")) if key == "obstacle.inside" else scene
        body = BODIES.get(key.removeprefix("obstacle."))
        scene = loads(written("obstacle.normal", body["normal"])) if body is EDGE else scene
        scene = loads(written("obstacle.size", body["size"])) if body is BOX else scene
    else:
        assigned, scene = key, loads(text(home(key)))
    name, value = parse_assignment(f"{assigned} = {raw}")
    assert contract_name(name) == key
    if has_field(key):
        assert field_of(scene.replace({name: value}), key) == expected(KEYS[key], raw)
    assert loads(text(home(key))).given() | {key} - NO_BEARING >= scene.replace({name: value}).given() - within(
        "wall", "obstacle"
    )


def test_set_takes_a_text_as_it_stands():
    assert parse_assignment("title=Two clamps, level") == ("title", "Two clamps, level")
    assert parse_assignment('title="Two clamps"') == ("title", "Two clamps")
    assert parse_assignment("wall.0.name=roof_2") == ("wall.0.name", "roof_2")
    with pytest.raises(BadInput) as caught:
        parse_assignment("wall.roof.stiffness=10 N/m")
    assert caught.value.key == "wall.roof.stiffness"
    assert KEYS["wall.stiffness"].example in caught.value.remedy


def test_an_absent_key_is_read_as_its_default():
    scenes = [loads(text(LEVEL)), loads(text(LEVEL, END)), loads(text(LEVEL, {"closure.kind": '"circle"'}))]
    scenes += [loads(written("wall.point", WALL["point"])), loads(text(LEVEL, PLANAR, {"tip.load": "1.0"}))]
    scenes += [loads(written("obstacle.radius", BAR["radius"])), loads(written("obstacle.kind", '"sphere"'))]
    scenes += [loads(written("obstacle.normal", EDGE["normal"]))]
    scenes += [loads(text(LEVEL, {"rod.torsion": "1.0"})), loads(text(LEVEL, {"rod.stretch": "1.0"}))]
    scenes += [loads(text(LEVEL, {"contact.distance": "1e-3"}))]
    scenes += [loads(text(LEVEL, {"contact.itself": "true", "strip.thickness": "3e-4"}))]
    seen = set()
    for scene in scenes:
        for key in set(KEYS) - scene.given() - {"title", "path.steps"}:
            section, _, _ = key.rpartition(".")
            listed = {"wall": scene.walls, "obstacle": scene.obstacles}
            present = listed[section] if section in listed else getattr(scene, section.replace(".", "_"))
            if present and has_field(key):
                placed = key != "model.tolerance" or scene.model.can_place
                chosen = key == "model.accuracy" and scene.strip.thickness is not None
                default = USUAL_ACCURACY if chosen else KEYS[key].default
                assert field_of(scene, key) == (default if placed else None), key
                seen.add(key)
    frames = {f"clamp.{end}.{axis}" for end in ("start", "end") for axis in ("tangent", "normal")}
    said_by_all = {"strip.gamma", "strip.natural_curvature", "clamp.start.position", "tip.load", *frames}
    optional = {key for key, about in KEYS.items() if not about.required and has_field(key)}
    assert optional - seen == {"title", "path.steps"} | said_by_all


def test_an_absent_position_is_the_origin_at_the_start_and_free_at_the_end():
    start = loads(text(LEVEL, {"clamp.start.position": None}))
    assert start.clamp_start.position == KEYS["clamp.start.position"].default == (0.0, 0.0, 0.0)
    assert KEYS["clamp.end.position"].default is None


# -- a value that is not ----------------------------------------------------------------------------

OTHER_KINDS = {
    Kind.NUMBER: ('"xyz"', "true", "[0.5]", "{a = 1.0}"),
    Kind.NUMBERS: ('"xyz"', "true", "[]", '["xyz"]', "[true]", "{a = 1.0}"),
    Kind.LINEAR: ('"xyz"', "true", "[]", '["xyz"]', "[1.0, 2.0, 3.0]"),
    Kind.LAW: (
        '"xyz"',
        "true",
        "[]",
        '["xyz"]',
        "[1.0, 2.0, 3.0]",
        "[[0.0, 1.0]]",
        "[[0.0, 1.0], [2.0]]",
        "[[0.0, 1.0], 1.0]",
        "[[0.0, 1.0], [0.5, true]]",
        "[[1.0, 1.0], [0.0, 2.0]]",
        "[[0.0, 1.0], [0.0, 1.0], [1.0, 2.0]]",
        "[[0.0, 1.0], [0.5, 2.0]]",
        "[[0.1, 1.0], [0.5, 2.0], [1.0, 1.0]]",
    ),
    Kind.PIECEWISE: ('"xyz"', "true", "[]", '["xyz", 1.0]', "[[1.0]]"),
    Kind.LIST: ("1.0", '"xyz"', "[]", '["xyz"]'),
    Kind.PAIR: ("0.5", "[0.5]", "[0.5, 0.5, 0.5]", '["xyz", 0.5]'),
    Kind.VECTOR: ("1.0", "[1.0, 0.0]", '["xyz", 0.0, 0.0]', '"xyz"', "[true, 0.0, 0.0]"),
    Kind.POINTS: ("1.0", "[1.0]", "[[0.0, 0.0]]", "[[0.0, 0.0, true]]"),
    Kind.DIRECTION: ("1.0", "[1.0, 0.0]", '["xyz", 0.0, 0.0]', '"xyz"', "[2.0, 0.0, 0.0]", "[0.0, 0.0, 0.0]"),
    Kind.COUNT: ("1.5", "2.0", '"xyz"', "true", "[2]"),
    Kind.COUNTS: ("3", "[3]", "[3, 4, 5]", "[3, 4.0]", "[3, true]"),
    Kind.TRUTH: ("1", '"true"', "[true]"),
    Kind.TEXT: ("3", "true", '["xyz"]'),
    Kind.CHOICE: ('"xyz"', '""', "3", "true", '["xyz"]'),
}
ENDLESS = ("nan", "inf", "-inf")
SHAPES = {
    Kind.NUMBER: ("{}",),
    Kind.NUMBERS: ("{}", "[2.0, {}]"),
    Kind.LINEAR: ("{}", "[1.0, {}]"),
    Kind.LAW: ("{}", "[1.0, {}]", "[[0.0, 1.0], [1.0, {}]]"),
    Kind.PIECEWISE: ("{}", "[1.0, 1.0, {}]"),
    Kind.LIST: ("[{}]", "[0.5, {}]"),
    Kind.PAIR: ("[0.5, {}]", "[{}, 0.5]"),
    Kind.VECTOR: ("[0.0, 0.0, {}]", "[{}, 0.0, 0.0]"),
    Kind.POINTS: ("[[0.0, 0.0, {}]]",),
    Kind.DIRECTION: ("[0.0, 1.0, {}]", "[{}, 1.0, 0.0]"),
    Kind.COUNT: ("{}",),
    Kind.COUNTS: ("[3, {}]", "[{}, 3]"),
}
"""How a number stands in a value of the kind."""


def beyond(about: Key) -> list[str]:
    """Numbers outside the key's range, at both ends where it has two."""
    within_ = about.range
    if within_ is None:
        return []
    if about.kind in (Kind.COUNT, Kind.COUNTS):
        return [str(int(within_.low) - 1), "-3", str(MAX_ELEMENTS + 1)]
    found = [
        within_.low - 1.0,
        math.nextafter(within_.low, -math.inf),
        *([] if within_.includes_low else [within_.low]),
    ]
    if within_.high is not None:
        found += [within_.high + 1.0, math.nextafter(within_.high, math.inf)]
        found += [] if within_.includes_high else [within_.high]
    elif " < " in within_.text:  # the upper end is another key
        found.append(1000.0)
    return [repr(value) for value in found]


def wrong(about: Key) -> list[str]:
    numbers = [*beyond(about), *ENDLESS]
    shapes = SHAPES.get(about.kind, ())
    return [*OTHER_KINDS[about.kind], *(shape.format(number) for shape in shapes for number in numbers)]


@pytest.mark.parametrize(("key", "value"), [(key, value) for key, about in KEYS.items() for value in wrong(about)])
def test_a_value_that_is_not_right_is_refused_by_name(key, value):
    with pytest.raises(BadInput) as caught:
        loads(written(key, value))
    assert caught.value.key == shown(key)
    assert caught.value.exit_code == 2
    assert caught.value.remedy


@pytest.mark.parametrize("key", [key for key, about in KEYS.items() if about.range is not None])
def test_the_ends_that_a_range_includes_are_right(key):
    about = KEYS[key]
    ends = [about.range.low] if about.range.includes_low else []
    ends += [about.range.high] if about.range.includes_high else []
    for end in ends:
        number = str(int(end)) if about.kind in (Kind.COUNT, Kind.COUNTS) else repr(end)
        for shape in SHAPES[about.kind]:
            loads(written(key, shape.format(number)))


@pytest.mark.parametrize("key", [key for key, about in KEYS.items() if about.choices])
def test_every_choice_is_read(key):
    energies = {"sadowsky", "wunderlich", "auto", "elastica", "antman", "curve_angle", "tape", "tape_plain", *FREE}
    for choice in KEYS[key].choices:
        scene = loads(written(key, f'"{choice}"'))
        assert not has_field(key) or field_of(scene, key) == choice
        assert key != "model.energy" or choice in energies
    for later in KEYS[key].later:
        with pytest.raises(BadInput, match="not available"):
            loads(written(key, f'"{later}"'))


# -- the declarations themselves --------------------------------------------------------------------


def test_every_field_of_a_section_is_a_declared_key():
    fields = {f"{section}.{item.name}" for section, spec in SPECS.items() for item in dataclasses.fields(spec)}
    assert fields - {f".{key}" if "." not in key else key for key in KEYS} == {"path.changes", "model.smallest"}


def test_a_key_declared_twice_is_an_error():
    one = {"strip.length": KEYS["strip.length"]}
    assert collected([one, {"strip.width": KEYS["strip.width"]}]).keys() == {"strip.length", "strip.width"}
    with pytest.raises(ValueError, match=r"strip\.length is declared twice"):
        collected([one, one])
    for node in ast.parse(Path(declarations.__file__).read_text()).body:  # the second would replace the first, unseen
        if isinstance(node, ast.ClassDef):
            names = Counter(entry.target.id for entry in node.body if isinstance(entry, ast.AnnAssign))
            assert set(names.values()) == {1}, node.name


@pytest.mark.parametrize(
    ("said", "inside", "outside"),
    [
        ("> 0", (5e-324, 1e300), (0.0, -1.0)),
        (">= 0", (0.0, 3.0), (-5e-324,)),
        ("each > 1", (1.1,), (1.0,)),
        ("-1 < nu <= 0.5", (-0.99, 0.5), (-1.0, 0.51)),
        ("0 < w < length", (1e-9, 1e9), (0.0,)),
        ("0 < corner < width / 2", (1e-9, 1e9), (0.0, -1.0)),
    ],
)
def test_a_range_is_what_it_says(said, inside, outside):
    found = Range.of(said)
    assert all(found.holds(value) for value in inside)
    assert not any(found.holds(value) for value in outside)


@pytest.mark.parametrize("said", ["", "positive", "0 .. 1", "< 3", "a < b"])
def test_what_says_no_range_is_an_error(said):
    with pytest.raises(ValueError):
        Range.of(said)


def test_the_keys_that_a_model_reads_are_named_by_section_or_key():
    assert within("clamp.start") | within("clamp.end") == within("clamp")
    assert within("strip.gamma", "seed") == {"strip.gamma", "seed.curvature", "seed.ruling", "seed.curve"}
    assert within("path") == {"path"}
    with pytest.raises(ValueError, match="widht"):
        within("strip.widht")
    all_of_it = within(*(key.partition(".")[0] for key in KEYS))
    for name in shipped():
        assert load(name).given() <= all_of_it


# -- docs/scenes.md ---------------------------------------------------------------------------------


def test_the_tables_of_the_page_are_those_of_the_declarations():
    page = (DOCS / "scenes.md").read_text(encoding="utf-8")
    assert in_page(page) == page, "python -m compare.pages.keys docs/scenes.md"
    rows = [line for line in tables().splitlines() if line.startswith("| `")]
    assert len(rows) == len([key for key in KEYS if not key.startswith("clamp.end.")])
    with pytest.raises(ValueError, match="keys"):
        in_page(page.replace(MARKS[1], ""))


def test_the_example_of_the_page_has_known_keys_only():
    first = next(block for block in blocks((DOCS / "scenes.md").read_text()) if block.info == "toml")
    document = tomllib.loads(first.text)
    given = given_keys(document).union(*(given_keys(stage) for stage in document["path"]))
    assert given <= set(KEYS)
    assert {key.partition(".")[0] for key in given} >= {"strip", "gravity", "clamp", "wall", "seed", "model", "shell"}
