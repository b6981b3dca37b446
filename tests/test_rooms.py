"""The rooms of the house: arrows go downward only, no circle, who may know a solver, how full a room is."""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest

from compare import registry
from compare.commands import ORDER
from ribbonbench.sources import Sources
from tests.test_setup import ROOT

#: The rooms of the packages, top to bottom: a module imports from its own room and from those below. Rooms of one
#: tuple stand side by side and do not import each other. A module beside the rooms is a room.
LEVELS = (
    ("ribbon",),
    ("ribbon.session",),
    ("ribbon.find", "ribbon.sensitivity"),
    ("ribbon.judge", "ribbon.rods", "ribbon.tape", "ribbon.thesis", "ribbon.archive"),
    ("ribbon.result", "ribbon.solvers"),
    ("ribbon.analysis", "ribbon.problems"),
    ("ribbon.surface",),
    ("ribbon.element", "ribbon.sections", "ribbon.solid"),
    ("ribbon.energies", "ribbon.contact", "ribbon.loads", "ribbon.units"),
    ("ribbon.obstacle",),
    ("ribbon.strip", "ribbon.boundary", "ribbon.shown"),
    ("ribbon.law",),
    ("ribbon.errors", "ribbon.forces", "ribbon.notes"),
    ("shellref.worker", "shellref.follow"),
    ("shellref", "shellref.path"),
    ("shellref.band",),
    ("shellref.shell",),
    ("shellref.seam", "shellref.holds", "shellref.contact"),
    ("shellref.kernels",),
    ("shellref.elastica", "shellref.rod"),
    ("shellref.fenics", "shellref.inputs", "shellref.law"),
    ("compare.cli",),
    ("compare.commands",),
    ("compare.pages",),
    ("compare.battery", "compare.suite"),
    ("compare.sweep", "compare.check"),
    ("compare.studies",),
    ("compare.page",),
    ("compare.models",),
    ("compare.record",),
    ("compare.measure", "compare.continuation"),
    ("compare.scene",),
    ("compare.store",),
    ("compare.registry",),
    ("compare",),
)
#: Most arrows between the rooms of `compare`, a room with all that stands below it, of 153 that could be.
ARROWS = 60
#: Who in `compare` may import a solver.
KNOW_SOLVERS = (
    "compare.models",
    "compare.pages.export.ribbon",
    "compare.pages.pictures.ribbon",
    "compare.battery.cases",
)
SOLVERS = ("ribbon", "shellref")
PACKAGES = (*SOLVERS, "compare")
#: Most modules of a room, its __init__ not counted; a command is a module, and there are as many as there are commands.
FULL = 16
UNCOUNTED = {f"compare/commands/{name}.py" for name in ORDER}

Graph = Mapping[str, set[str]]


SOURCES = Sources(ROOT)


def graph() -> dict[str, set[str]]:
    """Every module of the three packages with the modules of theirs that it imports, wherever in it."""
    known = SOURCES.every(*PACKAGES)
    return {name: SOURCES.imports(name) & known.keys() for name in known}


def circles(edges: Graph) -> list[set[str]]:
    """Strongly connected components of more than one module (Tarjan)."""
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found: list[set[str]] = []

    def visit(node: str) -> None:
        index[node] = low[node] = len(index)
        stack.append(node)
        for target in edges.get(node, ()):
            if target not in index:
                visit(target)
                low[node] = min(low[node], low[target])
            elif target in stack:
                low[node] = min(low[node], index[target])
        if low[node] == index[node]:
            component: set[str] = set()
            while node not in component:
                component.add(stack.pop())
            if len(component) > 1:
                found.append(component)

    for node in edges:
        if node not in index:
            visit(node)
    return found


def level(name: str) -> int:
    """The place of a module's room in `LEVELS`."""
    fits = [
        (len(room), place)
        for place, rooms in enumerate(LEVELS)
        for room in rooms
        if name == room or name.startswith(room + ".")
    ]
    return max(fits)[1]


def room(name: str) -> str:
    """The room of a module: two words of its name, of what stands beside the rooms its own; the package's for its
    `__init__`."""
    return ".".join(name.split(".")[:2])


def upward(edges: Graph) -> Iterator[str]:
    """Imports within a package that do not go downward."""
    for name, targets in edges.items():
        for target in sorted(targets):
            if name.split(".")[0] != target.split(".")[0]:
                continue
            if room(name) != room(target) and level(name) >= level(target):
                yield f"{name} imports {target}"


def between_rooms(edges: Graph) -> dict[str, set[str]]:
    """The rooms, with those of the same package that they import from."""
    found: dict[str, set[str]] = defaultdict(set)
    for name, targets in edges.items():
        there = {room(target) for target in targets if target.split(".")[0] == name.split(".")[0]}
        found[room(name)] |= there - {room(name)}
    return found


def strangers(edges: Graph) -> Iterator[str]:
    """Modules that import a solver and may not."""
    for name, targets in edges.items():
        if not name.startswith("compare") or name.startswith(KNOW_SOLVERS):
            continue
        yield from (f"{name} imports {target}" for target in sorted(targets) if target.split(".")[0] in SOLVERS)


def test_no_circle():
    assert circles(graph()) == []


def test_no_circle_of_rooms():
    assert circles(between_rooms(graph())) == []


def test_arrows_go_downward_only():
    assert list(upward(graph())) == []


def arrows(edges: Graph, package: str) -> list[str]:
    """The imports between two rooms of a package."""
    rooms = between_rooms({name: targets for name, targets in edges.items() if name.split(".")[0] == package})
    return [f"{one} imports {other}" for one in sorted(rooms) for other in sorted(rooms[one])]


def test_rooms_of_the_workbench_import_from_few():
    found = arrows(graph(), "compare")
    assert len(found) <= ARROWS, found


def test_only_the_models_know_a_solver():
    assert list(strangers(graph())) == []


def test_every_room_has_a_level():
    listed = [one for rooms in LEVELS for one in rooms]
    assert {room(name) for name in graph()} == set(listed)
    assert len(listed) == len(set(listed)), "a room stands twice"


def test_rooms_are_not_full():
    held: dict[Path, int] = defaultdict(int)
    for path in SOURCES.every(*PACKAGES).values():
        held[path.parent] += path.name != "__init__.py" and str(path.relative_to(ROOT)) not in UNCOUNTED
    assert {str(folder.relative_to(ROOT)): count for folder, count in held.items() if count > FULL} == {}


@pytest.mark.parametrize(
    ("name", "target", "rule"),
    [
        ("compare.scene.read", "compare.models.base", upward),
        ("ribbon.energies.sadowsky", "ribbon.solvers.problem", upward),
        ("shellref.kernels.fronts", "shellref.shell.grid", upward),
        ("compare.models.base", "compare.pages.solve", upward),
        ("compare.page.page", "compare.pages.export.vtu", upward),
        ("compare.studies.limits", "ribbon", strangers),
        ("compare.commands.solve", "shellref.shell.options", strangers),
    ],
)
def test_the_rules_can_fail(name, target, rule):
    edges = {name: {target}, target: set()}
    assert len(list(rule(edges))) == 1


def test_a_circle_of_rooms_is_found():
    edges = {"ribbon.find.a": {"ribbon.judge.b"}, "ribbon.judge.b": set(), "ribbon.judge.c": {"ribbon.find.d"}}
    assert circles(edges) == []
    assert circles(between_rooms(edges)) == [{"ribbon.find", "ribbon.judge"}]


def test_an_arrow_counts_once_for_two_rooms():
    edges = {"compare.page.a": {"compare.scene.b"}, "compare.page.c.d": {"compare.scene.e"}, "compare.scene.b": set()}
    assert arrows(edges, "compare") == ["compare.page imports compare.scene"]


def test_a_circle_is_found():
    assert circles({"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a"}}) == [{"a", "b", "c"}]


def test_the_picture_and_the_page_are_the_import_graph():
    from docs import rooms

    assert rooms.PLACE.read_text(encoding="utf-8") == rooms.drawing(between_rooms(graph()))
    assert rooms.PAGE.read_text(encoding="utf-8").endswith(rooms.HEADS + rooms.table())


#: Where a model may be named: its own room, the registry, the hard cases, which are scenes of one model each, and the
#: suite: a theory is called as the model that is named after it.
NAMES_MODELS = (
    "compare/models/",
    "compare/registry.py",
    "compare/battery/cases/",
    "compare/suite/ours.py",
    "compare/suite/section.py",
)
#: Most names of models elsewhere. What is left are a section and keys that are called like a model
#: (`[shell]`, a row's `elastica`, provenance.shell), commands, groups of hard cases and kinds of surfaces.
NAMED = 15
#: Who asks other people's libraries for what only some of their versions have, and the command line's own arguments,
#: of which not every command has each.
OTHERS = (
    *("ribbonbench." + name for name in ("kernel_files", "kernel_late", "sources", "system", "threads")),
    "compare.commands",
)  # fmt: skip


def literals(text: str) -> Iterator[str]:
    """The texts that stand in a source by themselves, docstrings among them."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value


def calls(text: str, name: str) -> list[ast.Call]:
    """The calls of a function of this name."""
    found = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Call)]
    return [call for call in found if isinstance(call.func, ast.Name) and call.func.id == name]


def test_models_are_named_in_few_places():
    known = {entry.name for entry in registry.BUILT_IN}.union(
        *(entry.energies for entry in registry.BUILT_IN if entry.name != registry.USUAL)
    )
    held = {
        place: sum(text in known for text in literals(path.read_text(encoding="utf-8")))
        for path in SOURCES.every("compare").values()
        if not (place := path.relative_to(ROOT).as_posix()).startswith(NAMES_MODELS)
    }
    assert sum(held.values()) <= NAMED, {place: count for place, count in held.items() if count}


def test_no_object_is_asked_for_an_attribute_to_learn_what_it_is():
    """What a model, a problem or a value can do is declared; a class, a Protocol or `ribbonbench.numbers` says it."""
    for name, path in SOURCES.every("ribbonbench", *PACKAGES).items():
        if not name.startswith(OTHERS):
            text = path.read_text(encoding="utf-8")
            assert not calls(text, "hasattr"), name
            assert not [call for call in calls(text, "getattr") if isinstance(call.args[1], ast.Constant)], name


def test_a_name_and_a_question_by_attribute_are_found():
    text = 'x = "shell"\nif hasattr(x, "estimate"):\n    y = getattr(x, "estimate")'
    assert "shell" in set(literals(text))
    assert len(calls(text, "hasattr")) == len(calls(text, "getattr")) == 1
