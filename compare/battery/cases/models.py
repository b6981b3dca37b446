"""Every model of the registry, on the scenes that choose it and on every planar one: a later model joins by itself."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from scipy.integrate import simpson

from compare.battery import planar
from compare.battery.case import Case, Check, Rung, ends_as, holds, near
from compare.models import registry, solve
from compare.models.base import State
from compare.scene import load, shipped
from compare.scene.scene import Scene

STATICS = 2e-5
"""Bound of forces and moments over the largest of them, of a model that is exact between its elements."""

LOOSE = {"curve_angle": 2e-3, "tape": 2e-4}
"""The same of models whose weight is lumped, or whose line is exact to their elements only."""

FIRST = {"elastica": "daisy_5g", "curve_angle": "ring_twisted", "antman": "bend_45", "ribbon": "curl_4_3"}
"""Scenes of the quick part."""

SHARED = "cantilever"
"""A planar scene that every model of lines reads: all have to agree on it."""


def scenes_of(model: str) -> tuple[str, ...]:
    """Shipped scenes that choose this model."""
    found = []
    for name in shipped():
        if registry.name_for(load(name).model.energy) == model:
            found.append(name)
    return tuple(found)


@functools.cache
def solved(name: str, model: str | None = None) -> State:
    """The state of a shipped scene."""
    return solve(load(name), model)


def statics(scene: Scene, state: State, bound: float) -> Iterator[Check]:
    """Forces and moments about the origin of everything that acts on the strip: supports, weight, tip."""
    if state.shape is None:
        return
    supports = state.supports
    weight = np.zeros(3) if scene.up is None else -scene.gamma * np.asarray(scene.up)
    s = np.linspace(0.0, 1.0, 2001)
    if scene.gravity is not None and scene.gravity.exact:
        v = np.linspace(-0.5, 0.5, 41) * scene.width
        centre = simpson(simpson(state.shape.points(s, v), x=v, axis=1), x=s, axis=0) / scene.width
    else:
        centre = simpson(state.shape.centreline(s), x=s, axis=0)
    forces, moments = [weight], [np.cross(centre, weight)]
    for at, support in ((0.0, supports.start), (1.0, supports.end)):
        if support is not None:
            place = state.shape.centreline(np.array([at]))[0]
            forces.append(np.asarray(support.force))
            moments += [np.asarray(support.moment), np.cross(place, support.force)]
    forces += [np.asarray(wall["force"]) for wall in supports.walls]
    if scene.tip is not None:
        place = state.shape.centreline(np.array([1.0]))[0]
        force = np.asarray(scene.tip_force, dtype=float)
        if scene.tip.tension is not None:
            return  # it follows the strip: part of the solver's own supports
        forces.append(force)
        moments.append(np.cross(place, force))
        moments.append(np.asarray(scene.tip_moment, dtype=float))
    scale = max(1.0, *(float(np.linalg.norm(f)) for f in forces))
    yield Check("forces (over the largest)", float(np.linalg.norm(np.sum(forces, axis=0))) / scale, bound)
    if supports.walls:
        return  # a wall's forces are listed without where they act
    scale = max(1.0, *(float(np.linalg.norm(m)) for m in moments))
    yield Check("moments (over the largest)", float(np.linalg.norm(np.sum(moments, axis=0))) / scale, bound)


def plain(state: State) -> Iterator[Check]:
    """No NaN in what is written."""
    data = [state.residual, state.lowest_eigenvalue]
    if state.energy is not None:
        data += list(state.energy.to_dict().values())
    for support in (state.supports.start, state.supports.end):
        if support is not None:
            data += [*np.ravel(support.force), *np.ravel(support.moment)]
    if state.shape is not None:
        for s in (0.0, 0.5, 1.0):
            pose = state.shape.pose(s)
            data += [*np.ravel(pose.position), *np.ravel(pose.frame)]
            frame = np.asarray(pose.frame)
            yield Check(f"frame at {s:g} l orthonormal", float(np.abs(frame.T @ frame - np.eye(3)).max()), 1e-9)
    bad = [x for x in data if x is not None and not math.isfinite(x)]
    yield holds("no NaN", not bad, f"{len(bad)} numbers")


def same(what: str, a: State, b: State, bound: float) -> Iterator[Check]:
    """Two states' energies and centrelines."""
    assert a.shape is not None
    assert b.shape is not None
    assert a.energy is not None
    assert b.energy is not None
    s = np.linspace(0.0, 1.0, 101)
    off = float(np.abs(a.shape.centreline(s) - b.shape.centreline(s)).max())
    yield Check(f"{what}: centreline (l)", off, bound)
    if a.energy.total is not None and b.energy.total is not None:
        yield near(f"{what}: energy (relative)", b.energy.total, a.energy.total, bound)


def scene_case(model: str) -> Callable[[Rung], Iterator[Check]]:
    """What holds of every scene of a model."""

    def run(rung: Rung) -> Iterator[Check]:
        scene = load(str(rung))
        state = solved(str(rung))
        yield ends_as(state, "converged")
        yield from plain(state)
        yield from statics(scene, state, LOOSE.get(model, STATICS))
        yield from same("solved again", state, solve(scene), 1e-9)
        if state.ok and not state.motions:
            yield from same("begun at itself", state, solve(scene, near=state.shape), 2e-5)

    return run


def moved(scene: Scene, motion: np.ndarray, shift: np.ndarray, unit: float) -> Scene:
    """The scene without its path, turned or mirrored by `motion` (3, 3), shifted (in l), its lengths times `unit`."""
    keys: dict[str, Any] = {}
    plain = scene.replace({"path": None}) if scene.path else scene
    for end in ("start", "end"):
        clamp = getattr(plain, f"clamp_{end}")
        if clamp is None:
            continue
        place = plain.position if end == "start" else plain.end_position
        frame = plain.frame if end == "start" else plain.end_frame
        if place is not None:
            keys[f"clamp.{end}.position"] = (scene.strip.length * unit * (motion @ place + shift)).tolist()
        if frame is not None:
            keys[f"clamp.{end}.tangent"] = (motion @ frame[:, 2]).tolist()
            keys[f"clamp.{end}.normal"] = (motion @ frame[:, 1]).tolist()
    if plain.up is not None:
        keys["gravity.up"] = (motion @ plain.up).tolist()
    if plain.tip is not None and plain.tip.force is not None:
        keys["tip.force"] = (motion @ np.asarray(plain.tip.force)).tolist()
    mirrored = float(np.linalg.det(motion)) < 0.0
    if plain.rod is not None and np.any(plain.rod.natural_in_plane):
        sign = -1.0 if mirrored else 1.0
        keys["rod.natural_in_plane"] = (sign * np.asarray(plain.rod.natural_in_plane) / unit).tolist()
    if unit != 1.0:
        keys |= {"strip.length": scene.strip.length * unit, "strip.width": scene.strip.width * unit}
        if scene.strip.thickness is not None:
            keys["strip.thickness"] = scene.strip.thickness * unit
        natural = scene.strip.natural_curvature
        keys["strip.natural_curvature"] = (np.asarray(natural) / unit).tolist()
        if scene.seed.curvature is not None and not isinstance(scene.seed.curvature, str):
            keys["seed.curvature"] = (np.asarray(scene.seed.curvature) / unit).tolist()
    return plain.replace(keys)


def _motion(mirror: bool) -> np.ndarray:
    """A rotation about no axis of the scenes', with a mirror before it."""
    a, b = 0.7, 2.1
    turn = np.array([[math.cos(a), -math.sin(a), 0.0], [math.sin(a), math.cos(a), 0.0], [0.0, 0.0, 1.0]])
    tilt = np.array([[1.0, 0.0, 0.0], [0.0, math.cos(b), -math.sin(b)], [0.0, math.sin(b), math.cos(b)]])
    return turn @ tilt @ np.diag([-1.0 if mirror else 1.0, 1.0, 1.0])


MOTIONS = {
    "turned": (False, 0.0, 1.0), "far": (False, 1e4, 1.0), "mirrored": (True, 0.0, 1.0), "in um": (False, 0.0, 1e6),
    "in km": (False, 0.0, 1e-3),
}  # fmt: skip
"""Ways to say a scene otherwise: mirrored before it is turned, shifted by so many l, unit of length."""

#: Models whose invariance is tried here, and a scene of each; the ribbon's is the group `frames`.
FRAMED = {
    "elastica": ("cantilever", "elastica"),
    "antman": ("bend_45", "antman"),
    "curve_angle": ("cantilever", "curve_angle"),
}


def framed(rung: Rung) -> Iterator[Check]:
    """One model's scene, said otherwise."""
    model, _, path = str(rung).partition(" ")
    name, energy = FRAMED[model]
    scene = load(name)
    if scene.model.energy != energy:
        scene = scene.replace({"model.energy": energy, "strip.thickness": 5e-4})
    mirror, far, unit = MOTIONS[path]
    motion, shift = _motion(mirror), far * np.array([0.6, -0.48, 0.64])
    a, b = solve(moved(scene, np.eye(3), np.zeros(3), 1.0)), solve(moved(scene, motion, shift, unit))
    assert a.shape is not None
    assert b.shape is not None
    assert a.energy is not None
    assert b.energy is not None
    yield holds("the same status", a.status is b.status, f"{a.status.code}, {b.status.code}")
    s = np.linspace(0.0, 1.0, 101)
    rounding = 1e-14 * far
    if a.motions:
        lines = [shape.centreline(s) for shape in (a.shape, b.shape)]
        lengths = [np.linalg.norm(line[:, None] - line[None], axis=2) for line in lines]
        yield Check("distances within the line (l)", float(np.abs(lengths[0] - lengths[1]).max()), 1e-9 + rounding)
    else:
        off = np.abs(a.shape.centreline(s) @ motion.T + shift - b.shape.centreline(s)).max()
        yield Check("centreline moved with the scene (l)", float(off), 1e-9 + rounding)
    assert a.energy.elastic is not None
    assert b.energy.elastic is not None
    yield near("elastic energy (relative)", b.energy.elastic, a.energy.elastic, 1e-9 + rounding)
    if a.lowest_eigenvalue is not None and b.lowest_eigenvalue is not None:
        yield near("lowest eigenvalue (relative)", b.lowest_eigenvalue, a.lowest_eigenvalue, 1e-6 + rounding)


def _planar_twin(scene: Scene, state: State, bound: float) -> Iterator[Check]:
    """The collocation of `compare.battery.planar` beside a planar cantilever's state."""
    from shellref.elastica.problem import ElasticaProblem

    assert state.shape is not None
    assert state.energy is not None
    assert scene.up is not None
    frame = scene.frame
    up = np.asarray(scene.up)
    problem = ElasticaProblem(
        gamma=scene.gamma, up=(float(up @ frame[:, 2]), float(-up @ frame[:, 1])), curvature=scene.curvature
    )
    s = np.linspace(0.0, 1.0, 401)
    line = state.shape.centreline(s) - scene.position
    plane = np.stack([line @ frame[:, 2], -line @ frame[:, 1]], axis=1)
    tangents = state.shape.frames(s)[:, :, 2]
    theta = np.unwrap(np.arctan2(-tangents @ frame[:, 1], tangents @ frame[:, 2]))
    at = planar.collocated(problem, s, theta, plane, np.zeros(2), 1e-8)
    own = np.stack([np.interp(s, at.s, at.points[:, k]) for k in (0, 1)], axis=1)
    yield Check("distance from the elastica's collocation (l)", float(np.linalg.norm(own - plane, axis=1).max()), bound)
    total = at.bending + at.gravity + scene.gamma * float(up @ scene.position)
    assert state.energy.total is not None
    yield near("energy against the collocation's (relative)", state.energy.total, total, max(bound, 1e-5))


def agreeing(rung: Rung) -> Iterator[Check]:
    """One energy on the planar scene that all read."""
    from ribbonbench.errors import BadInput

    try:
        scene = load(SHARED).replace({"model.energy": str(rung), "strip.thickness": 5e-4, "strip.poisson": 0.0})
        scene = scene.replace({"clamp.start.ruling": "free"})
        if registry.name_for(str(rung)) != "ribbon" or str(rung) in FREE_SIZE:
            scene = scene.replace({"model.elements": 80})
        state = solve(scene)
    except BadInput as error:
        yield holds("refused in one line that names key and remedy", bool(error.key and error.remedy), str(error))
        return
    yield ends_as(state, "converged")
    yield from statics(scene, state, LOOSE.get(state.model, STATICS))
    yield from _planar_twin(scene, state, AGREE.get(str(rung), 2e-4))


FREE_SIZE = ("curve_angle", "antman")
AGREE = {"curve_angle": 1e-3}
"""Distance from the elastica (l) where it is of second order in the edges."""


def slender(rung: Rung) -> Iterator[Check]:
    """The rod whose shear and stretch are stiffer than its bending by (1/h)^2: the elastica as h goes to 0."""
    h = float(rung)
    rod = {"rod.bending": [1.0, 1.0], "rod.torsion": 1.0, "rod.shear": [1.0 / h**2] * 2, "rod.stretch": 1.0 / h**2}
    scene = load(SHARED).replace({"model.energy": "antman", **rod})
    state = solve(scene)
    yield ends_as(state, "converged")
    yield from statics(scene, state, STATICS)
    yield from _planar_twin(scene, state, 2e-5 + 3.0 * scene.gamma * h**2)


def many_edges(rung: Rung) -> Iterator[Check]:
    """Curve-angle edges: of second order until rounding, which grows with the square of their number."""
    edges = int(rung)
    scene = load(SHARED).replace({"model.energy": "curve_angle", "model.elements": edges, "strip.thickness": 5e-4})
    state = solve(scene)
    yield ends_as(state, "converged")
    yield from _planar_twin(scene, state, max(4.0 / edges**2, 2e-6))


STANDING = {"gravity.up": [0.0, 0.0, 1.0], "strip.gamma": 20.0, "strip.thickness": 5e-4}
"""A strip that stands on its clamp, above the weight under which it buckles."""

CURLED = {"gravity.up": [0.0, 0.0, -1.0], "strip.gamma": 1000.0, "strip.natural_curvature": 10.0}
"""A curl pulled back over its clamp: its path has limit points."""

#: (model.energy and the word it ends with) -> the scene's keys, and what its remedy says, done: keys, --leave-saddle.
FOLLOWED: dict[str, tuple[dict[str, Any], dict[str, Any], bool]] = {
    "wunderlich saddle, --leave-saddle": (STANDING, {}, True),
    "wunderlich saddle, a bent [seed]": (STANDING, {"seed.curvature": 0.5}, False),
    "antman unstable, --leave-saddle": (STANDING, {}, True),
    "curve_angle saddle, --leave-saddle": (STANDING, {}, True),
    "curve_angle saddle, a bent [seed]": (STANDING, {"seed.curvature": 0.5}, False),
    "elastica unstable, a bent [seed]": (STANDING, {"seed.curvature": 0.5}, False),
    "elastica limit_point, arc length": (
        {**CURLED, "model.arc_length": "never"}, {"model.arc_length": "always"}, False,
    ),
}  # fmt: skip


def followed(rung: Rung) -> Iterator[Check]:
    """A scene that ends in a status, and its remedy (`compare.page.remedies`) done literally."""
    from compare.models.base import Options
    from compare.page.remedies import message
    from compare.page.remedies import remedy as remedy_of

    begin, _, _ = str(rung).partition(",")
    energy, word = begin.split(" ")
    keys, remedy, leave = FOLLOWED[str(rung)]
    scene = load(SHARED).replace({**keys, "model.energy": energy})
    first = solve(scene, options=Options(leave_saddle=False))
    yield holds(f"ends as {word}", first.word == word, f"{first.word}: {first.message}")
    said = remedy_of(registry.name_for(energy), word)
    yield holds("its remedy is said", bool(said) and message(first).endswith(said), message(first))
    if leave:
        yield holds("--leave-saddle is what it says", "--leave-saddle" in said, said)
    elif "seed.curvature" in remedy:
        yield holds("a bent [seed] is what it says", "curvature = 0.5" in said, said)
    then = solve(scene.replace(remedy) if remedy else scene, options=Options(leave_saddle=leave))
    yield ends_as(then, "converged")
    yield holds("stable", then.stable is True, then.message)
    if keys is STANDING:
        assert then.energy is not None
        assert first.energy is not None
        assert then.energy.total is not None
        assert first.energy.total is not None
        yield Check("energy above that of the saddle (D w / l)", then.energy.total - first.energy.total, -1.0)
    if registry.name_for(energy) != "curve_angle":
        yield from _planar_twin(scene, then, 2e-4)


def _cases() -> tuple[Case, ...]:
    found = []
    for name in registry.names():
        scenes = scenes_of(name)
        if not scenes:
            continue
        first = tuple(s for s in (FIRST.get(name),) if s in scenes)
        found.append(Case(
            f"models/{name}", "every shipped scene that chooses it: rods, bands, walls, paths, tip loads",
            "ends as stated; no NaN; supports, weight and tip in balance; solved again, and begun at itself, the same",
            "scene", scene_case(name), first, tuple(s for s in scenes if s not in first),
        ))  # fmt: skip
    ways = tuple(f"{model} {path}" for model in FRAMED for path in MOTIONS)
    energies = tuple(registry.energies())
    found += [
        Case(
            "models/said otherwise", "turned, 1e4 l away, mirrored, in other units",
            "the state goes with the scene to 1e-9; its energy and lowest eigenvalue stay", "model and way", framed,
            ("antman mirrored",), tuple(path for path in ways if path != "antman mirrored"),
        ),
        Case(
            "models/one plane", "a planar cantilever, which every energy of the registry reads or refuses",
            "the elastica of the collocation, or a refusal that names key and remedy", "model.energy", agreeing,
            ("wunderlich", "antman"), tuple(e for e in energies if e not in ("wunderlich", "antman")),
        ),
        Case(
            "models/slender rod", "shear and stretch of the Antman rod are 1/h^2 stiffer than its bending",
            "no locking and no loss: the elastica to 2e-5 l and the rod's own h^2", "h / l", slender, (1e-3,),
            (1e-1, 1e-2, 1e-4, 1e-5, 1e-6),
        ),
        Case(
            "models/remedy followed", "scenes that end in a status which is no stable equilibrium",
            "the remedy that the tool says, done literally, leads to a stable equilibrium, the elastica's",
            "model, its word, remedy", followed, ("curve_angle saddle, --leave-saddle",),
            tuple(name for name in FOLLOWED if name != "curve_angle saddle, --leave-saddle"),
        ),
        Case(
            "models/many edges", "bending stiffness of the curve-angle rod grows with the cube of the number of edges",
            "of second order", "edges", many_edges, (100,), (300, 1000, 2000, 4000),
        ),
    ]  # fmt: skip
    return tuple(found)


CASES: tuple[Case, ...] = _cases()
