"""Each scene key, per model: it changes the answer, or it is refused by name, or it is declared to have no effect.

A list of exclusions fails open: a key that is parsed and then ignored is found here.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from compare import registry
from compare.models.base import check_keys
from compare.models.effects.ribbon_off import explained_problem, starting_state
from compare.models.elastica.start import circles
from compare.models.scope import require_shell
from compare.models.shell_build import shell_options, shell_problem
from compare.scene.keys import KEYS
from compare.scene.scene import Scene, loads
from ribbonbench.errors import BadInput
from tests.compare.scene import held_scenes

#: A planar cantilever in SI units, solved by every model.
PLANAR = """
[strip]
length = 0.4
width = 0.02
thickness = 2e-4
poisson = 0.3
young = 2e9
density = 900.0
natural_curvature = 2.0
[gravity]
up = [1.0, 0.0, 0.0]
[clamp.start]
position = [0.1, 0.0, 0.0]
tangent = [0.0, 0.0, 1.0]
normal = [-1.0, 0.0, 0.0]
ruling = "straight"
[model]
energy = "{energy}"
elements = 6
"""
TURN = 0.5**0.5
#: The same, held at an oblique edge: rulings turn.
OBLIQUE = {"clamp.start.normal": [-TURN, TURN, 0.0]}
GAMMA = {"strip.young": None, "strip.density": None, "strip.gamma": 20.0}
END = {
    "clamp.end.position": [0.1, 0.0, 0.3],
    "clamp.end.tangent": [0.0, 0.0, 1.0],
    "clamp.end.normal": [-1.0, 0.0, 0.0],
}
ROD = {"strip.second_moment": 1e-12, "strip.thickness": None, "strip.density": None, "gravity.acceleration": 9.81}
#: A planar ring as a band of its own: nothing but the closure holds it.
BARE = {"clamp.start": None, "gravity": None, "strip.young": None, "strip.density": None}

ANTMAN = {"model.energy": "antman"}

#: Key -> what is set first, and the two values that are told apart (None: not given).
PAIRS: dict[str, tuple[dict[str, Any], Any, Any]] = {
    "strip.length": ({}, 0.4, 0.5),
    "strip.width": (OBLIQUE, 0.02, 0.03),
    "strip.thickness": ({}, 2e-4, 3e-4),
    "strip.poisson": (OBLIQUE, 0.3, 0.4),
    "strip.natural_curvature": ({}, 2.0, 3.0),
    "strip.natural_twist": (OBLIQUE, None, 2.0),
    "strip.natural_geodesic_curvature": (OBLIQUE, None, 2.0),
    "strip.gamma": (GAMMA, 20.0, 30.0),
    "strip.young": ({}, 2e9, 3e9),
    "strip.density": ({}, 900.0, 1200.0),
    "strip.second_moment": ({**ROD, "tip.mass": 1e-4}, 1e-12, 2e-12),
    "tip.mass": (ROD, 1e-4, 2e-4),
    "tip.load": ({}, 1.0, 2.0),
    "tip.force": ({}, [1e-4, 0.0, 0.0], [2e-4, 0.0, 0.0]),
    "tip.tension": ({}, 1e-4, 2e-4),
    "gravity.up": ({}, [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]),
    "gravity.acceleration": ({}, 9.81, 5.0),
    "gravity.exact": ({**OBLIQUE, "strip.width": 0.06}, None, True),
    "clamp.start.position": ({}, [0.1, 0.0, 0.0], [0.2, 0.0, 0.0]),
    "clamp.start.tangent": ({}, [0.0, 0.0, 1.0], [-0.6, 0.0, 0.8]),
    "clamp.start.normal": ({}, [-1.0, 0.0, 0.0], [-0.8, 0.6, 0.0]),
    "clamp.start.ruling": (OBLIQUE, "straight", "free"),
    "clamp.end.position": (END, [0.1, 0.0, 0.3], [0.12, 0.0, 0.3]),
    "clamp.end.tangent": (END, [0.0, 0.0, 1.0], [0.6, 0.0, 0.8]),
    "clamp.end.normal": (END, [-1.0, 0.0, 0.0], [-0.8, 0.6, 0.0]),
    "clamp.end.ruling": ({**END, "clamp.end.normal": [-0.8, 0.6, 0.0]}, None, "free"),
    "closure.kind": (BARE, "circle", "moebius"),
    "closure.ruling": ({**BARE, "closure.kind": "moebius"}, None, "straight"),
    "closure.half_turns": ({**BARE, "closure.kind": "moebius"}, None, 3),
    "closure.turns": ({**BARE, "closure.kind": "circle"}, None, 2),
    "model.energy": (OBLIQUE, "wunderlich", "sadowsky"),
    "model.accuracy": ({**OBLIQUE, "model.energy": "auto"}, 0.09, 1e-5),
    "model.stiffness": ({"model.energy": "kirchhoff", "clamp.start.ruling": "free"}, "matched", "plate"),
    "model.in_plane": ({**OBLIQUE, "model.energy": "finite"}, None, True),
    "model.elements": ({}, 6, 9),
    "model.grading": ({}, None, "clamp"),
    "model.element_lengths": ({"model.elements": None}, [0.1, 0.1, 0.2], [0.2, 0.1, 0.1]),
    "model.tolerance": ({**OBLIQUE, "model.elements": None}, 1e-2, 1e-5),
    "model.formulation": ({}, "chained", "mixed"),
    "model.held_by": ({"model.formulation": "mixed"}, None, "constraints"),
    "model.solver": (OBLIQUE, None, "ipopt"),
    "model.budget": (OBLIQUE, None, 1e-9),
    "model.arc_length": ({"model.energy": "elastica", "strip.natural_curvature": -40.0}, None, "always"),
    "tip.moment": (ANTMAN, [1e-5, 0.0, 0.0], [2e-5, 0.0, 0.0]),
    "rod.bending": (ANTMAN, None, [1.2, 50.0]),
    "rod.torsion": ({**ANTMAN, **OBLIQUE}, None, 2.0),
    "rod.shear": (ANTMAN, None, [50.0, 50.0]),
    "rod.stretch": (ANTMAN, None, 50.0),
    "rod.natural_twist": (ANTMAN, None, 2.0),
    "rod.natural_in_plane": (ANTMAN, None, 2.0),
    "rod.twist": ({"model.energy": "curve_angle"}, None, "quasi-static"),
    "closure.twist": ({**BARE, "model.energy": "curve_angle", "closure.kind": "circle"}, None, 3.0),
    "clamp.start.slide": ({**ANTMAN, **END, "clamp.end.slide": None}, None, [0.0, 0.0, 1.0]),
    "clamp.end.slide": ({**ANTMAN, **END}, None, [0.0, 0.0, 1.0]),
    "contact.itself": ({}, None, True),
    "seed.curvature": ({**END, **GAMMA}, [-9.0, 18.0, -9.0], [9.0, -18.0, 9.0]),
    "path": ({**END, "seed.curvature": [9.0, -18.0, 9.0]}, None, [{"strip.density": 800.0}]),
    "shell.width_to_thickness": ({"strip.thickness": None, **GAMMA}, 50.0, 60.0),
    "shell.clamp": ({}, None, "corners"),
    "shell.elements": ({}, [10, 2], [12, 2]),
    "shell.corner": ({"shell.clamp": "corners"}, 0.002, 0.004),
    "shell.tolerance": ({}, None, 1e-3),
    "shell.goal": ({"shell.tolerance": 1e-3}, None, "energy"),
    "shell.grading": ({}, None, [0.5, 0.5]),
    "shell.edge_layer": ({}, None, 0.001),
    "shell.start_curvature": ({}, None, 1.0),
    "shell.start": ({}, None, "path"),
    "shell.shear_factor": ({}, None, 1.0),
}
#: Keys without a pair: they name things, check other keys, or belong to another test.
APART = {
    "title": "a name", "clamp.start.across": "checks the clamp", "clamp.end.across": "checks the clamp",
    "clamp.start.frame": "its one word says that tangent and normal are not held", "clamp.end.frame": "the same",
    "seed.ruling": "test_the_ruling_of_a_seed",
    "strip.transverse_curvature": "of tape springs", "clamp.start.section": "the same", "clamp.end.section": "the same",
    "contact.distance": "test_contact_itself",
    "contact.section": "test_contact_itself", "contact.joints": "test_drawn", "seed.curve": "test_curve",
    "path.steps": "how a path is cut (test_way)", "wall.name": "a name", "wall.point": "test_the_wall",
    "wall.normal": "test_the_wall", "wall.stiffness": "test_the_wall", "shell.contact": "test_the_wall",
    "wall.friction": "of a path (test_friction)", "obstacle.friction": "the same",
    "obstacle.name": "a name", **{f"obstacle.{key}": "test_the_obstacle" for key in (
        "kind", "point", "radius", "axis", "inside", "normal", "size", "angle", "rounding")},
    **{key: "how sure an input is (test_inputs)" for key in KEYS if key.startswith("uncertainty.")},
}  # fmt: skip


def test_every_key_has_its_pair():
    assert set(KEYS) | {"path"} == set(PAIRS) | set(APART)


def scene_with(key: str, value: Any, energy: str) -> Scene:
    changes = {**PAIRS[key][0], key: value}
    chosen = changes.pop("model.energy", energy)
    return loads(PLANAR.format(energy=chosen), "planar").replace(changes)


def answer(scene: Scene, model: str) -> list[float]:
    """What a scene leads to, as numbers: energies, places, size; of a shell what its worker is asked."""
    if model == "shell":
        requested = [shell_problem(scene, ratio).to_dict() for ratio in require_shell(scene)]
        return [json.dumps([requested, shell_options(scene).to_dict()], sort_keys=True)]  # type: ignore[list-item]
    state = registry.model(model).solve(scene)
    assert state.energy is not None
    numbers = [state.energy.total, state.energy.elastic, *state.end.position, *state.middle.frame.ravel()]
    scale = scene.gamma  # Gamma is part of the answer: lengths and forces are told in its units
    native = state.native
    how = getattr(getattr(native, "problem", None), "row_count", 0), getattr(native, "steps", 0), native.iterations
    return [*np.round(np.array([*numbers, scale], dtype=float), 9), state.unknowns, *map(float, how)]


@pytest.mark.parametrize("model", ["ribbon", "elastica", "shell", "antman", "curve_angle"])
@pytest.mark.parametrize("key", PAIRS)
def test_a_key_is_read_or_refused_or_declared_without_effect(key, model):
    found = registry.model(model)
    ones = []
    for value in PAIRS[key][1:]:
        try:
            scene = scene_with(key, value, model if model in ("elastica", "antman", "curve_angle") else "wunderlich")
            check_keys(found, scene)
            ones.append(answer(scene, model))
        except BadInput as refused:
            ones.append(refused)
    first, second = ones
    if isinstance(first, BadInput) or isinstance(second, BadInput):
        return  # refused by name: BadInput says which key
    if first != second:
        assert key in found.reads or key in found.without_effect
        return
    assert key in found.without_effect, f"{key} is read by {model} and changes nothing"


@pytest.mark.parametrize(
    ("key", "value"), [("wall.0.point", [0, 0, -0.2]), ("wall.0.normal", [0.6, 0.0, 0.8]), ("wall.0.stiffness", 50.0)]
)
def test_the_wall(key, value):
    """Walls change the ribbon and what is asked of the shell; no line model without walls takes a scene with one."""
    scene = loads(held_scenes.FLOOR, "floor")
    changed = scene.replace({key.replace("0", "floor"): value})
    assert answer(scene, "ribbon") != answer(changed, "ribbon")
    thick = {"shell.width_to_thickness": 50}
    assert answer(scene.replace(thick), "shell") != answer(changed.replace(thick), "shell")
    assert answer(scene.replace(thick), "shell") != answer(scene.replace({**thick, "shell.contact": "faces"}), "shell")
    with pytest.raises(BadInput):
        check_keys(registry.model("elastica"), changed)


BAR = {
    "wall": [],
    "obstacle": [{"kind": "cylinder", "point": [1.2, 0.0, -0.4], "radius": 0.5, "axis": [0.0, 1.0, 0.0]}],
}


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("point", [1.2, 0.0, -0.5]), ("radius", 0.45), ("axis", [0.28, 0.96, 0.0]), ("inside", True),
        ("kind", "sphere"),
    ],
)  # fmt: skip
def test_the_obstacle(key, value):
    """Obstacles change what the ribbon's unknowns are held by, a planar elastica's, and what is asked of the shell."""
    bar = loads(held_scenes.FLOOR, "floor").replace(BAR)
    more = {"kind": {"obstacle.0.axis": None}, "inside": {"obstacle.0.radius": 2.0}}
    changes = {f"obstacle.0.{key}": value, **more.get(key, {})}
    changed = bar.replace(changes)
    assert answer(bar, "ribbon") != answer(changed, "ribbon")
    thick = {"shell.width_to_thickness": 50}
    assert answer(bar.replace(thick), "shell") != answer(changed.replace(thick), "shell")
    assert bar.is_planar()
    if changed.is_planar():
        assert circles(bar) != circles(changed)


@pytest.mark.parametrize(
    ("key", "value"),
    [("normal", [-0.8, 0.0, 0.6]), ("size", [0.5, 0.6, 0.5]), ("angle", 60.0), ("rounding", 0.02), ("inside", True)],
)
def test_a_body(key, value):
    """The same of boxes and edges."""
    body: dict[str, Any] = {"point": [1.2, 0.0, -0.4], "axis": [0.0, 1.0, 0.0], "normal": [-1.0, 0.0, 0.0]}
    body |= {"kind": "box", "size": [0.4, 0.4, 0.4]} if key == "size" else {"kind": "edge"}
    bar = loads(held_scenes.FLOOR, "floor").replace({"wall": [], "obstacle": [body]})
    changes = {f"obstacle.0.{key}": value} | ({"obstacle.0.point": [-9.0, 0.0, 9.0]} if key == "inside" else {})
    assert answer(bar, "ribbon") != answer(bar.replace(changes), "ribbon")
    thick = {"shell.width_to_thickness": 50}
    assert answer(bar.replace(thick), "shell") != answer(bar.replace({**changes, **thick}), "shell")


def test_a_key_that_no_one_reads_is_refused_by_name():
    """A model that knows fewer keys: the first one beyond is named."""
    elastica = registry.model("elastica")
    scene = loads(PLANAR.format(energy="elastica"), "planar").replace({"seed.ruling": 0.1})
    check_keys(elastica, scene)

    class Less(type(elastica)):  # type: ignore[misc]
        without_effect = {k: v for k, v in elastica.without_effect.items() if k != "seed.ruling"}  # noqa: RUF012

    with pytest.raises(BadInput) as caught:
        check_keys(Less(), scene)
    assert caught.value.key == "seed.ruling"


def test_the_ruling_of_a_seed():
    """It moves the shape from which the ribbon starts; where that ends is the same for a scene with one equilibrium."""
    scene = loads(PLANAR.format(energy="wunderlich"), "planar").replace({"clamp.start.ruling": "free"})
    turned = scene.replace({"seed.ruling": 0.2})
    starts = [starting_state(one, explained_problem(one)) for one in (scene, turned)]
    assert np.abs(starts[1] - starts[0]).max() == pytest.approx(0.2)
    assert answer(turned, "ribbon")[:5] == pytest.approx(answer(scene, "ribbon")[:5], abs=1e-7)
