"""One tab's strip: its scene, its state and where it has been; what is told of it, kept, and taken back.

Nothing here knows of a server: a desk is asked by one thread at a time and answers with dictionaries for JSON.
"""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.models import in_words
from compare.models.base import Model, Options, State
from compare.models.capabilities import Estimates, Follows, Surrounds
from compare.models.choice import chosen, settled
from compare.page.page import SHELL, WALL
from compare.page.remedies import message
from compare.page.wording import energies, length, place
from compare.pages.live import sliders
from compare.pages.live.drawn import ACROSS, ALONG, Drawn, first_view, packed
from compare.pages.live.film import Seen
from compare.pages.live.shells import ShellRun
from compare.pages.solve import answer
from compare.scene.scene import Scene
from compare.scene.units import Units
from compare.store.store import atomic_write_bytes, atomic_write_text
from compare.studies.limits import Thresholds, estimated, require_limits
from ribbonbench.errors import BadInput, RibbonbenchError

FloatArray = NDArray[np.float64]

#: Equal elements of a strip whose scene leaves them to a tolerance.
ELEMENTS = 40
#: Time (s) that a move may take of a model that solves each anew.
PATIENCE = 10.0
#: Steps back that are remembered.
MOST = 500
#: Distance of two centrelines (l), and of two energies (of their size, at least 1), up to which it is one state.
SAME = 1e-5
SAME_ENERGY = 1e-7


@dataclass(frozen=True)
class Stand:
    """Where a strip stands: its scene, its sliders where they are not the scene's own, its state."""

    scene: Scene
    values: Mapping[str, float]
    state: State

    @cached_property
    def surface(self) -> FloatArray:
        """Its surface (k, m, 3) in l."""
        assert self.state.shape is not None  # what has none is not stood at
        s, v = np.linspace(0.0, 1.0, ALONG), self.scene.width * np.linspace(-0.5, 0.5, ACROSS)
        return self.state.shape.points(s, v)

    @cached_property
    def walls(self) -> tuple[tuple[str, FloatArray], ...]:
        """What it cannot cross, by name, around it: grids (k, m, 3) in l; none where its model does not tell."""
        model = chosen(self.scene)
        if not self.scene.barriers or not isinstance(model, Surrounds):
            return ()
        nets = model.barriers(self.scene, self.state, self.surface.reshape(-1, 3))
        return tuple(zip(self.scene.barrier_names, nets, strict=False))


@dataclass(frozen=True)
class Beginning:
    """What all tabs begin with: the scene as it was given, the same as it is held here, its model, sliders and state,
    and what is said of that."""

    given: Scene
    scene: Scene
    model: Model
    units: Units
    sliders: tuple[sliders.Slider, ...]
    state: State
    notes: tuple[str, ...]

    @classmethod
    def of(cls, given: Scene, units: Units) -> Beginning:
        """Solves the scene; `BadInput` where it has no equilibrium to begin with."""
        from compare.models.base import check_keys

        model = chosen(given)
        check_keys(model, given)
        notes: list[str] = []
        scene = given
        if given.model.accuracy is not None:
            scene = settled(given)
            notes.append(
                f"{in_words(scene.model.energy)} is chosen, and stays (model.accuracy = {given.model.accuracy:g})"
            )
        if isinstance(model, Follows):
            scene, more = _held(scene)
            notes += more
        state = model.solve(scene)
        if scene.path:
            scene = scene.replace({"path": None})
            notes.append("the [[path]] was gone once; from its end on there is no path")
        if state.shape is None or not state.is_equilibrium:
            raise BadInput("SCENE", given.name, f"has no equilibrium to begin with: {message(state)}", "try solve")
        return cls(given, scene, model, units, sliders.sliders(scene, model), state, tuple(notes))


def _held(scene: Scene) -> tuple[Scene, list[str]]:
    """The ribbon's scene on elements that stay, with unknowns that go on warm; and what that changes."""
    keys: dict[str, Any] = {}
    notes = []
    if scene.model.tolerance is not None:
        keys["model.elements"] = ELEMENTS
        notes.append(f"{ELEMENTS} equal elements in place of those that a tolerance places")
    if scene.model.formulation == "auto":
        keys["model.formulation"] = "mixed"
    return (scene.replace(keys) if keys else scene), notes


@dataclass
class Desk:
    """The strip of one tab. out: the folder of what is kept; again: the command line that solves a kept scene."""

    begun: Beginning
    out: Path
    again: Callable[[Path], str]
    past: list[Stand] = field(default_factory=list)
    gesture: int = 0
    seen: Seen = field(default_factory=Seen)
    shell: ShellRun | None = None

    def __post_init__(self) -> None:
        self.now = Stand(self.begun.scene, {}, self.begun.state)
        self.seen.add(self.now.surface)

    # -- moves -------------------------------------------------------------------------------------------------------

    def moved(self, values: Mapping[str, Any], gesture: int) -> dict[str, Any]:
        """The strip with its sliders at these values, warm from where it is; a gesture is one step to take back.

        `BadInput` for nonsense: the strip then stays where it is.
        """
        begun = self.begun
        scene = sliders.changed(begun.scene, begun.model, values)
        clock = time.perf_counter()
        text, reached = "", 1.0
        jumps: tuple[float, ...] = ()
        if isinstance(begun.model, Follows):
            found = begun.model.followed(self.now.scene, scene, self.now.state)
            state, text, jumps, reached = found.state, found.text, found.jumps, found.reached
            scene = found.scene
        else:
            budget = min(PATIENCE, scene.model.budget)
            state = begun.model.solve(scene.replace({"model.budget": budget}))
            if state.shape is None or not state.is_equilibrium:
                scene, state, text, reached = self.now.scene, self.now.state, message(state), 0.0
        seconds = time.perf_counter() - clock
        if reached >= 1.0:
            there = {name: float(value) for name, value in values.items()}
        else:
            there = self._between(values, reached)
        if gesture != self.gesture or not self.past:
            self.past.append(self.now)
            del self.past[:-MOST]
            self.gesture = gesture
        self.now = Stand(scene, there, state)
        self.seen.add(self.now.surface)
        return {**self.told(), "jumps": list(jumps), "reached": reached, "why": text, "ms": 1e3 * seconds}

    def _between(self, values: Mapping[str, Any], reached: float) -> dict[str, float]:
        """The sliders' values where the way to `values` stopped."""
        own = {one.name: one.value for one in self.begun.sliders}
        here = {**own, **self.now.values}
        there = {**own, **values}
        return {name: (1.0 - reached) * here[name] + reached * float(there[name]) for name in own}

    def back(self) -> dict[str, Any]:
        """Where the strip was before the last gesture; `BadInput` where there was none."""
        if not self.past:
            raise BadInput("undo", None, "there is nothing to take back", "move a slider first")
        self.now = self.past.pop()
        self.gesture = -1
        self.seen.add(self.now.surface)
        return self.told()

    # -- what is told ------------------------------------------------------------------------------------------------

    def told(self) -> dict[str, Any]:
        """All that is known at once: numbers, words, the surface."""
        stand, units = self.now, self.begun.units
        state = stand.state
        own = {one.name: one.value for one in self.begun.sliders}
        return {
            "values": {**own, **stand.values},
            "numbers": numbers(state),
            "rows": rows(state, units),
            "ok": state.ok,
            "places": packed(self.now.surface),
            "walls": [packed(net) for _, net in self.now.walls],
            "handle": None if stand.scene.end_position is None else stand.scene.end_position.tolist(),
            "undo": len(self.past),
        }

    def once(self) -> dict[str, Any]:
        """What a tab needs once: its sliders, the first view, what is said of the beginning, l in the scene's unit."""
        return {
            "sliders": [one.to_dict() for one in self.begun.sliders],
            "view": self._view(),
            "notes": list(self.begun.notes),
            "length": self.begun.scene.strip.length,
        }

    def _view(self, *more: Drawn) -> dict[str, Any]:
        """The data of the viewer: the strip as it stands, and more surfaces."""
        up = None if self.now.scene.up is None else self.now.scene.up.tolist()
        walls = (Drawn(net, name, WALL) for name, net in self.now.walls)
        surfaces = [Drawn(self.now.surface, "strip"), *walls, *more]
        return first_view(surfaces, up, f"The strip of {self.now.scene.title}.")

    def judged(self) -> Iterator[dict[str, Any]]:
        """What takes longer, piece by piece: the verdict, the estimate to the shell, whether a fresh solve of the scene
        comes to the same state."""
        stand, model = self.now, self.begun.model
        try:
            if isinstance(model, Follows):
                state = model.judged(stand.scene, stand.state)
            else:
                state = model.solve(stand.scene, options=Options(error=True))
            verdict = answer(stand.scene, state, self.begun.units)
            yield {"verdict": verdict.line, "grade": verdict.grade}
        except RibbonbenchError as error:
            yield {"verdict": str(error), "grade": "unknown"}
            state = stand.state
        yield self._estimate(stand.scene, state)
        yield {"doubt": self._doubt(stand)}

    def _estimate(self, scene: Scene, state: State) -> dict[str, Any]:
        """How far the thinnest shell of the scene would be, from the ribbon alone."""
        try:
            require_limits(scene)
            assert isinstance(self.begun.model, Estimates)  # require_limits
            ratio = max(scene.shell.width_to_thickness or (scene.strip.width / (scene.strip.thickness or math.inf),))
            found = estimated(scene, state, ratio, Thresholds(), {})
        except RibbonbenchError as error:
            return {"estimate": f"No estimate to a shell: {error}", "level": "unknown"}
        return {"estimate": found.sentence, "level": found.level or "unknown", "ratio": ratio}

    def _doubt(self, stand: Stand) -> str:
        """What a fresh solve of the scene comes to, where that is another state; "": the same, or none."""
        try:
            fresh = self.begun.model.solve(stand.scene)
        except RibbonbenchError as error:
            return f"A fresh solve of this scene fails ({error}); keep writes one that leads here."
        if same(fresh, stand.state):
            return ""
        if not fresh.ok:
            return f"A fresh solve of this scene finds no stable state ({message(fresh)}); keep writes one that does."
        energy = [one.energy.total if one.energy is not None else None for one in (stand.state, fresh)]
        if None in energy:
            return "A fresh solve of this scene comes to another state."
        here, there = (self.begun.units.text(float(x or 0.0), "D w / l", 4) for x in energy)
        return f"Another state is near: a fresh solve comes to one with the energy {there}; here it is {here}."

    # -- what is kept ------------------------------------------------------------------------------------------------

    def kept(self) -> dict[str, Any]:
        """Writes the scene of where the strip stands, and says by which command it is solved again."""
        found, fresh = self._leading(self.now)
        path = self._free(".toml")
        atomic_write_text(path, found.to_toml())
        return {
            "file": str(path), "command": self.again(path), "same": fresh is not None,
            "numbers": numbers(self.now.state if fresh is None else fresh),
        }  # fmt: skip

    def filmed(self) -> dict[str, Any]:
        """Writes all that was seen as an animated glTF, in m where the scene says what its unit is, else in l."""
        scene = self.now.scene
        length = scene.units.length or 1.0
        up = None if scene.up is None else scene.up.tolist()
        path = self._free(".glb")
        atomic_write_bytes(path, self.seen.film(scene.width, length, up, scene.title))
        return {"file": str(path), "surfaces": len(self.seen)}

    # -- the shell beside it -----------------------------------------------------------------------------------------

    def shell_begun(self) -> dict[str, Any]:
        """Begins a shell of where the strip stands, in the background; `BadInput` where one runs, or none can be."""
        if self.shell is not None:
            raise BadInput("the shell", None, "one is being solved already", "wait for it")
        scene, fresh = self._leading(self.now)
        if fresh is None:
            raise BadInput("the shell", None, "cannot begin here: a fresh solve of this scene comes to another state")
        self.shell = ShellRun(scene, self._free("_shell"))
        return {"running": True, "ratio": self.shell.ratio}

    def shell_now(self) -> dict[str, Any]:
        """How the shell is doing; once it is there, what is said of it and a view with it. `BadInput` where it was
        not solved."""
        run = self.shell
        if run is None:
            return {"running": False}
        if run.running:
            return {"running": True, "said": run.said, "ratio": run.ratio}
        self.shell = None
        run.end()
        found = run.shell()
        more = (
            [] if found.points is None else [Drawn(found.points, f"shell, w/h = {found.ratio:g}", SHELL, found.ratio)]
        )
        answer = {"running": False, "text": found.text, "grade": found.grade, "folder": str(run.folder / "compare")}
        return {**answer, "view": self._view(*more)} if more else answer

    def end(self) -> None:
        """Ends what runs for it."""
        if self.shell is not None:
            self.shell.end()
            self.shell = None

    def _leading(self, stand: Stand) -> tuple[Scene, State | None]:
        """A scene whose solve comes to where the strip stands, and that state; of three the first that does: the scene
        alone, with its shape as a seed, as the end of a path from the scene that this began with. None: none does."""
        for scene in self._ways(stand):
            try:
                fresh = self.begun.model.solve(scene)
            except RibbonbenchError:
                continue
            if same(fresh, stand.state):
                return scene, fresh
        return stand.scene, None

    def _ways(self, stand: Stand) -> Iterator[Scene]:
        yield stand.scene
        if isinstance(self.begun.model, Follows):
            with contextlib.suppress(BadInput):
                yield self.begun.model.seeded(stand.scene, stand.state)
        base = {one.name: one.value for one in self.begun.sliders}
        moved = sliders.keys_of(self.begun.scene, {n: x for n, x in stand.values.items() if x != base[n]})
        moved.pop("shell.width_to_thickness", None)
        if moved:
            back = {key: sliders.value_of(self.begun.scene, key) for key in moved}
            with contextlib.suppress(BadInput):
                yield stand.scene.replace({"path": [back]})

    def _free(self, ending: str) -> Path:
        """The next file of this ending that is not there yet."""
        number = 1
        while (path := self.out / f"{self.begun.given.name}_{number}{ending}").exists():
            number += 1
        return path


def same(one: State, other: State) -> bool:
    """Whether two states of a scene are one: both equilibria, energies and centrelines alike (motions that nothing
    resists left out: then the energies decide)."""
    if not (one.is_equilibrium and other.is_equilibrium) or one.shape is None or other.shape is None:
        return False
    if one.energy is None or other.energy is None or one.energy.total is None or other.energy.total is None:
        return False
    a, b = one.energy.total, other.energy.total
    if abs(a - b) > SAME_ENERGY * max(1.0, abs(a), abs(b)):
        return False
    if one.motions is not None:
        return True
    s = np.linspace(0.0, 1.0, 41)
    return float(np.abs(one.shape.centreline(s) - other.shape.centreline(s)).max()) <= SAME


def numbers(state: State) -> dict[str, float | None]:
    """The numbers of a state by their keys in result.json, dimensionless; None: not known."""
    energy = {} if state.energy is None else state.energy.to_dict()
    found: dict[str, float | None] = {f"energy.{name}": energy.get(name) for name in ("elastic", "gravity", "total")}
    found["lowest_eigenvalue"] = state.lowest_eigenvalue
    for name, pose in (("end", state.end), ("middle", state.middle)):
        if pose is not None:
            found |= {f"{name}.{axis}": float(x) for axis, x in zip("xyz", pose.position, strict=True)}
    for name, held in (("start", state.supports.start), ("end", state.supports.end)):
        if held is not None:
            found |= {f"force.{name}.{axis}": float(x) for axis, x in zip("xyz", held.force, strict=True)}
            found |= {f"moment.{name}.{axis}": float(x) for axis, x in zip("xyz", held.moment, strict=True)}
    for wall in state.supports.walls:
        force = np.asarray(wall["force"], dtype=float)
        found |= {f"force.wall {wall['name']}.{axis}": float(x) for axis, x in zip("xyz", force, strict=True)}
    return {name: None if x is None or not math.isfinite(x) else float(x) for name, x in found.items()}


def rows(state: State, units: Units) -> list[list[str]]:
    """What is told of a state beside it: name and text."""
    stable = {True: "stable", False: "not stable", None: "stability not known"}[state.stable]
    lowest = "" if state.lowest_eigenvalue is None else f", lowest eigenvalue {state.lowest_eigenvalue:.4g}"
    found = [["state", f"{stable}{lowest}"]]
    found.append(["energy", energies({} if state.energy is None else state.energy.to_dict(), units)])
    for name, pose in (("middle", state.middle), ("end", state.end)):
        if pose is not None:
            found.append([name, place(np.asarray(pose.position), units)])
    held = [("at s = 0", state.supports.start), ("at s = l", state.supports.end)]
    for name, force in held:
        if force is not None:
            found.append([f"force {name}", _vector(force.force, "D w / l^2", units)])
            found.append([f"moment {name}", _vector(force.moment, "moment", units)])
    for number, wall in enumerate(state.supports.walls):
        name = wall.get("name") or str(number)
        found.append([f"force of wall {name}", _vector(np.asarray(wall["force"], dtype=float), "D w / l^2", units)])
    if state.error is not None:
        found.append(["computed to", length(units, state.error)])
    return found


def _vector(values: FloatArray, unit: str, units: Units) -> str:
    """The size of a vector and its components."""
    size = float(np.linalg.norm(values))
    factor, name = units.reading(size, unit) or (1.0, "D w / l" if unit == "moment" else unit)
    parts = ", ".join(f"{factor * x:.3g}" for x in values)
    return f"{factor * size:.4g} {name} ({parts})"
