"""`model.energy = "auto"` with `model.accuracy`: the cheapest energy that is estimated to be near enough to a shell.

From the cheapest on, each is solved and its distance (Hausdorff over l) to the shell estimated: that to the strip with
energy "finite", which costs milliseconds from the shape of the one before, and what "finite" itself leaves out
(`compare.models.ribbon.neglected`). The first within the accuracy is taken. Where not even "finite" is, the shell is
asked for: the answer is then that of "finite", and says so. Where "finite" has no stable state nothing tells of the
others: a scene that says an accuracy is then answered by it, one that says none by the energy that is exact in the
width. An energy whose state is a saddle on finer segments is passed over; where a scene may have several equilibria,
also one whose state is not known to be stable in the limit. All this is of one state: where a lower one was seen beside
it (`compare.models.ribbon.rivals`) the choice says that it is not sure.
"""

from __future__ import annotations

import functools
import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from compare.measure.grid import SAGITTA, Grid
from compare.models.base import Options, Seconds
from compare.models.capabilities import Rival
from compare.models.ribbon.build import AUTO_ENERGY
from compare.models.ribbon.free import refusal
from compare.models.ribbon.neglected import apart, beside, beyond
from compare.models.ribbon.refinement import judged
from compare.models.ribbon.rivals import is_probed, probe
from compare.models.ribbon.solving import solved as solved_as
from compare.models.ribbon.solving import solver
from compare.models.ribbon.state import own_size, state_of
from compare.scene.planar import nonplanar_reason

if TYPE_CHECKING:
    from compare.models.ribbon.stages import LoadPath
    from compare.scene.scene import Scene
    from compare.store.progress import Reporter
    from ribbon import Equilibrium

FloatArray = NDArray[np.float64]

#: Energies by what they cost; the last one tells of the others.
LADDER = ("sadowsky", "wunderlich", "finite")
REFERENCE = LADDER[-1]
#: What Sadowsky's energy is where nothing twists the strip.
PLANAR = "elastica"
SHELL = "shell"
#: What the energies without thickness leave out, among `Choice.skipped`.
THICKNESS = "thickness"
#: Why a step has no estimate.
UNKNOWN = "it has no stable state, or what it leaves out is not known"
#: The strip that tells of the others is solved to this part of the accuracy.
_FINE = 0.3
#: Part of the accuracy to which the distance of two strips is seen.
_SEEN = 2e-3
#: Twist l below which a strip stayed in its plane.
_PLANE = 1e-6


@dataclass(frozen=True)
class Step:
    """A model that was tried: its estimated distance to the shell over l (None: it has no stable state, or what was
    left out could not be told), the seconds that it and its estimate took, and of "finite" the estimate by cause.
    passed_over: why it was not taken where it is near enough."""

    model: str
    estimate: float | None
    seconds: float
    parts: Mapping[str, float] = field(default_factory=dict)
    passed_over: str = ""

    def to_dict(self) -> dict[str, Any]:
        """As in result.json."""
        parts = {"parts": dict(self.parts)} if self.parts else {}
        passed = {"passed_over": self.passed_over} if self.passed_over else {}
        why = {"estimate_why": UNKNOWN} if self.estimate is None else {}
        return {"model": self.model, "estimate": self.estimate, **why, "seconds": self.seconds, **parts, **passed}


@dataclass(frozen=True)
class Choice:
    """The energy that was chosen, the steps up to it, and whether its estimate is within the accuracy.

    model: its name among models: "elastica" where the strip stayed in its plane. skipped: what the chosen energy leaves
    out, and by how much (l) it is estimated to move the strip. rival: a lower state that was seen beside the first
    strip's (`compare.models.ribbon.rivals`); the estimate is of the distance to a shell in the same state. solved: what
    was solved as the scene says, by energy: way, equilibrium, times.
    """

    energy: str
    model: str
    accuracy: float
    steps: tuple[Step, ...]
    enough: bool
    skipped: Mapping[str, float] = field(default_factory=dict)
    solved: Mapping[str, tuple[LoadPath | None, Equilibrium, Seconds]] = field(default_factory=dict)
    rival: Rival | None = None

    @property
    def sure(self) -> bool:
        """The estimate is within the accuracy, and no lower state was seen beside the one that it is of."""
        return self.enough and self.rival is None

    def to_dict(self) -> dict[str, Any]:
        """As in result.json."""
        return {
            "accuracy": self.accuracy,
            "chosen": self.model,
            "enough": self.enough,
            "sure": self.sure,
            "rival": None if self.rival is None else self.rival.to_dict(),
            "skipped": dict(self.skipped),
            "steps": [step.to_dict() for step in self.steps],
        }


def choose(scene: Scene, options: Options | None = None, say: Reporter | None = None) -> Choice:
    """The choice for a scene with `model.accuracy`; its thickness is known."""
    accuracy = scene.model.accuracy
    assert accuracy is not None, "asked only of scenes that want it"
    options = replace(options or Options(), repeats=0)
    steps: list[Step] = []
    solved: dict[str, tuple[LoadPath | None, Equilibrium, Seconds]] = {}
    named = functools.cache(functools.partial(with_energy, scene))
    clock = time.perf_counter()
    first = LADDER[0]
    if say is not None:
        say.step(f"auto: {first}")
    solved[first] = solved_as(named(first), options, say)
    _, there, _ = solved[first]
    spent = time.perf_counter() - clock
    clock = time.perf_counter()
    if say is not None:
        say.step(f"auto: {REFERENCE}, the measure of the others")
    best = _told_by(scene, there, accuracy)
    rival = probe(named(first), there)
    if best is None or not best.ok:
        steps.append(Step(_name(scene, first, there), None, spent))
        steps.append(Step(REFERENCE, None, time.perf_counter() - clock))
        energy = REFERENCE if _asked(scene) else AUTO_ENERGY
        return Choice(energy, energy, accuracy, tuple(steps), False, rival=rival)
    bent = float(np.abs(best.omega(np.linspace(0.0, 1.0, 2001))).max())
    grid = Grid.for_shape(scene, bent, max(_SEEN * accuracy, SAGITTA))
    left_out = beyond(scene, best)
    own = Step(REFERENCE, _known(left_out.distance), time.perf_counter() - clock, left_out.parts)
    for energy in LADDER[:-1]:
        clock = time.perf_counter()
        if energy not in solved:
            if left_out.distance > accuracy:
                break
            if say is not None:
                say.step(f"auto: {energy}")
            solved[energy] = solved_as(named(energy), options, say)
        _, found, _ = solved[energy]
        moved = apart(found, best, grid) if found.ok else float("inf")
        estimate = _known(left_out.behind(moved))
        near = estimate is not None and estimate <= accuracy
        why = _open(named(energy), solved[energy], options, say) if near else ""
        spent += time.perf_counter() - clock
        steps.append(Step(_name(scene, energy, found), estimate, spent, passed_over=why))
        if near and not why:
            skipped = {THICKNESS: moved, **left_out.parts}
            return Choice(energy, steps[-1].model, accuracy, tuple(steps), True, skipped, solved, rival)
        spent = 0.0
    steps.append(own)
    enough = left_out.distance <= accuracy
    return Choice(REFERENCE, REFERENCE, accuracy, tuple(steps), enough, left_out.parts, rival=rival)


def chosen(scene: Scene, accuracy: float) -> tuple[str, list[dict[str, Any]]]:
    """The model that a scene of one thickness would get at this accuracy ("shell" where none of the ladder is near
    enough), and the steps to it."""
    choice = choose(scene.replace({"model.energy": "auto", "model.accuracy": accuracy}))
    return choice.model if choice.enough else SHELL, [step.to_dict() for step in choice.steps]


def with_energy(scene: Scene, energy: str) -> Scene:
    """The scene with this energy, and nothing left to choose."""
    return scene.replace({"model.energy": energy, "model.accuracy": None})


def _open(
    scene: Scene,
    solved: tuple[LoadPath | None, Equilibrium, Seconds],
    options: Options,
    say: Reporter | None,
) -> str:
    """Why an energy is passed over for what its state is on ever finer segments: it is not stable there; or that is
    open, where no lower state is looked for (`is_probed`). "" where it is not."""
    path, found, seconds = solved
    state = judged(state_of(scene, found, own_size(found), seconds, path), say, options.grid, scene)
    if not state.ok:
        return "it is not stable on finer segments"
    return "" if state.stable or is_probed(scene) else "whether it is stable is open"


def _asked(scene: Scene) -> bool:
    """Whether the scene says its accuracy itself."""
    return "model.accuracy" in scene.own_keys


def _told_by(scene: Scene, start: Equilibrium, accuracy: float) -> Equilibrium | None:
    """`reference`; None for a scene that says no accuracy, and is none for that energy."""
    if _asked(scene):
        return reference(scene, start, accuracy)
    if refusal(with_energy(scene, REFERENCE)) is not None:
        return None
    from ribbon import RibbonInputError

    try:
        return reference(scene, start, accuracy)
    except RibbonInputError:
        return None


def reference(scene: Scene, start: Equilibrium, accuracy: float) -> Equilibrium:
    """The strip with energy "finite" from the shape of another energy's equilibrium, its segments placed for a part of
    the accuracy; from the scene's own seed where that one is none."""
    from ribbon.find.adaptive import refine_to_tolerance

    found = beside(scene, start) if start.ok else None
    if found is None:
        return solver(with_energy(scene, REFERENCE), leave_saddle=True)()
    if not found.ok:
        return found
    return refine_to_tolerance(found, _FINE * accuracy, leave_saddle=True, strict=False)


def _name(scene: Scene, energy: str, equilibrium: Equilibrium) -> str:
    """ "elastica" for Sadowsky's strip that stays in the plane of a planar scene."""
    if energy != LADDER[0] or nonplanar_reason(scene) is not None:
        return energy
    return PLANAR if float(np.abs(equilibrium.tau(np.linspace(0.0, 1.0, 201))).max()) < _PLANE else energy


def _known(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
