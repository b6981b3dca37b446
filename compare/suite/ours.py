"""The runner `ours`: every model of this workbench that has the case's theory, each on two meshes.

A case of the theory "elastica" is answered by whatever reduces to it; one of "body", a strip of finite thickness or a
measured one, by all, and how far each is off is the point of it. The shell answers where the budget allows it.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from compare.suite.answers import BROKE_DOWN, NOT_REPRESENTABLE, Answer, Answers, BrokeDown, NotRepresentable
from compare.suite.case import Ask, Case, Value
from compare.suite.reading import read_off
from ribbonbench.errors import BadInput, Missing

if TYPE_CHECKING:
    from compare.models.base import State
    from compare.scene.scene import Scene

#: Points along the centreline among which a greatest coordinate is looked for.
_POINTS = 2001
#: Steps of a search for a critical value, the part of the question's interval to which it is found, and where in the
#: bracket a step is tried.
_TRIES, _CLOSE, _SHARES = 60, 0.1, (0.5, 0.2, 0.8)


@dataclass(frozen=True)
class Way:
    """A model: its name in the registry, its energy, elements of the coarser mesh (the finer one has twice as many),
    theories that it answers beside "body", seconds below which it is not begun; degree of the elements of a model whose
    elements no key says; how its elements are graded where an edge is clamped; the finest mesh on which it judges
    stability, where it judges finer ones by that, else 0."""

    name: str
    model: str
    energy: str
    elements: int
    theories: frozenset[str]
    least: float = 0.0
    degree: int | None = None
    grading: str = ""
    judged: int = 0


_PLANE = frozenset({"elastica"})
_STRIP = frozenset({"elastica", "developable"})
WAYS = (
    Way("elastica", "elastica", "elastica", 10, _PLANE, degree=4),
    Way("curve_angle", "curve_angle", "curve_angle", 80, frozenset({"rod", "elastica"}), judged=80),
    Way("antman", "antman", "antman", 40, frozenset({"rod"})),
    Way("kirchhoff", "ribbon", "kirchhoff", 40, frozenset({"rod", "elastica"})),
    Way("sadowsky", "ribbon", "sadowsky", 80, frozenset({"sadowsky", "elastica"})),
    Way("wunderlich", "ribbon", "wunderlich", 80, _STRIP),
    Way("finite", "ribbon", "finite", 80, frozenset(), grading="clamp"),
    Way("tape", "tape", "tape", 400, frozenset({"tape"}), least=30.0),
    Way("shell", "shell", "auto", 40, frozenset(), least=30.0),
)
#: Questions of stability, for which a saddle is not left.
_JUDGED = ("stable", "critical")
#: The shell's elements across over those along.
_ACROSS = 0.1


def run(case: Case, budget: float) -> tuple[Answers, ...]:
    """What every model answers; those without the theory say so."""
    found = []
    for way in WAYS:
        begun = time.perf_counter()
        said = answered_by(case, way, budget)
        seconds = time.perf_counter() - begun
        found.append(replace(said, way=way.name, version=_version(), seconds=seconds))
    return tuple(found)


def _version() -> str:
    from compare import __version__

    return f"ribbonbench {__version__}"


def answered_by(case: Case, way: Way, budget: float) -> Answers:
    """What one model answers, on both of its meshes, within a budget (s)."""
    if case.theory != "body" and case.theory not in way.theories:
        return Answers(ended=NOT_REPRESENTABLE, why=f'its theory is not that of the case, "{case.theory}"')
    if way.least > budget:
        return Answers(ended=BROKE_DOWN, why=f"not begun: the budget of {budget:g} s is below its {way.least:g} s")
    answers: dict[str, Answer] = {}
    states: dict[str, str] = {}
    solves = _Solves(case, way, time.perf_counter() + budget)
    try:
        for ask in case.asks:
            coarse, _ = _asked(ask, solves, 0)
            fine, states[ask.name] = _asked(ask, solves, 1)
            same = way.degree is not None and ask.of in _JUDGED
            answers[ask.name] = Answer(fine, None if same else _apart(coarse, fine))
    except (BadInput, Missing, NotRepresentable) as why:
        return Answers(ended=NOT_REPRESENTABLE, why=str(why))
    except BrokeDown as why:
        return Answers(ended=BROKE_DOWN, why=str(why))
    return Answers(answers=answers, states=states, settings=f"elements: {way.elements}, {2 * way.elements}")


def _apart(coarse: Value, fine: Value) -> float:
    return float(np.max(np.abs(np.subtract(np.asarray(fine, dtype=float), np.asarray(coarse, dtype=float)))))


def scene_of(case: Case, way: Way, elements: int) -> Scene:
    """The case as this model's scene on so many elements; of the shell, as many along, a tenth of them across."""
    if way.model != "shell":
        graded = {"grading": way.grading} if way.grading and "clamp" in case.physics else {}
        return case.scene({"energy": way.energy, "elements": elements, **graded})
    if "thickness" not in case.physics["strip"]:
        raise NotRepresentable("the case has no thickness, which a shell needs")
    return case.scene(shell={"elements": [elements, max(1, round(_ACROSS * elements))]})


def solved(scene: Scene, way: Way, elements: int, stay: bool = False) -> State:
    """A scene by a model on so many elements; stay: a saddle is not left."""
    from compare.models import solve
    from compare.models.base import Options, Size

    # Where a size is asked for, such a model does not judge stability.
    sized = way.degree is not None and not stay
    size = Size(f"{way.name} {way.degree}", (elements,), way.degree) if sized else None
    return solve(scene, way.model, size=size, options=Options(leave_saddle=False if stay else None))


@dataclass
class _Solves:
    """The states of a case by one model, each solved once: questions share them. until: when the budget is out."""

    case: Case
    way: Way
    until: float
    kept: dict[tuple[int, str, str, bool], State] = field(default_factory=dict)

    def elements(self, level: int, stay: bool = False) -> int:
        """Of one of the two meshes; stay: of those on which stability is asked."""
        most = self.way.judged
        return most >> (1 - level) if stay and most else self.way.elements << level

    def scene(self, level: int, key: str = "", value: Any = None, stay: bool = False) -> Scene:
        """On one of the two meshes, with a key's value where one is given."""
        scene = scene_of(self.case, self.way, self.elements(level, stay))
        return scene.replace({key: value}) if key else scene

    def state(self, level: int, key: str = "", value: Any = None, stay: bool = False) -> State:
        """Raises `BrokeDown` where the budget has run out."""
        name = (level, key, repr(value), stay)
        if name not in self.kept:
            if time.perf_counter() > self.until:
                raise BrokeDown(f"out of budget after {len(self.kept)} solves")
            scene = self.scene(level, key, value, stay)
            self.kept[name] = solved(scene, self.way, self.elements(level, stay), stay)
        return self.kept[name]


def _asked(ask: Ask, solves: _Solves, level: int) -> tuple[Value, str]:
    if ask.of == "critical":
        found, (least, most) = _critical(ask, lambda value: solves.state(level, ask.key, value, stay=True))
        return found, f"between {least:.7g} and {most:.7g}"
    if ask.over is not None:
        key, values = ask.over
        states = [(value, _equilibrium(solves.state(level, key, value))) for value in values]
        return tuple(_told(solves.case, ask, solves.scene(level, key, value), state) for value, state in states), ""
    state = solves.state(level, stay=ask.of == "stable")
    if ask.of == "stable":
        if _equilibrium(state).stable is None:
            raise NotRepresentable("this model does not judge stability")
        return bool(state.stable), state.word
    return _told(solves.case, ask, solves.scene(level), _equilibrium(state)), state.word


def _equilibrium(state: State) -> State:
    if not state.is_equilibrium:
        raise BrokeDown(f"{state.word}: {state.message}")
    return state


def _told(case: Case, ask: Ask, scene: Scene, state: State) -> float:
    """One number of a state, in the case's units."""
    if ask.of in ("force", "moment"):
        return ask.sign * _support(ask, scene, state)
    if ask.of == "energy":
        if state.energy is None or state.energy.elastic is None:
            raise NotRepresentable("this model does not tell its energy")
        known = scene.units.energy if case.units == "si" else 1.0
        return float((state.energy.elastic + state.energy.constant) * (known or 1.0))
    if state.shape is None:
        raise BrokeDown("it has no shape")
    if ask.of == "extent":
        return read_off(ask, state.shape.centreline(np.linspace(0.0, 1.0, _POINTS)) * case.length)
    return read_off(replace(ask, at=0.0), state.shape.centreline(np.array([ask.at])) * case.length)


def _support(ask: Ask, scene: Scene, state: State) -> float:
    """What an end or a wall exerts on the strip."""
    supports = state.supports
    unit = (scene.units.force if ask.of == "force" else scene.units.energy) or 1.0
    axis = "xyz".index(ask.axis)
    if ask.on in ("start", "end"):
        found = supports.start if ask.on == "start" else supports.end
        if found is None:
            raise NotRepresentable(f"this model does not tell what its {ask.on} exerts")
        return float((found.force if ask.of == "force" else found.moment)[axis] * unit)
    for wall in supports.walls:
        if wall.get("name") == ask.on and ask.of == "force":
            return float(wall["force"][axis] * unit)
    raise NotRepresentable(f"this model does not tell what {ask.on} exerts")


def _critical(ask: Ask, at: Callable[[float], State]) -> tuple[float, tuple[float, float]]:
    """Where the state at the first of two values loses its stability, and the bracket that is left: a part of the
    question's interval. Close to a bifurcation some solves do not converge; where none within the bracket does and it
    is wider than the interval, see `_vanishes`."""
    ends = list(ask.between)
    states = [at(value) for value in ends]
    signs = [_sign(state) for state in states]
    if None in signs:
        raise NotRepresentable("this model does not judge stability at the ends of the range")
    if (signs[0] or 0.0) * (signs[1] or 0.0) > 0.0:
        raise BrokeDown(f"it is {'stable' if (signs[0] or 0.0) > 0.0 else 'unstable'} at both ends of the range")
    lost = [
        (value, state.lowest_eigenvalue) for value, state, sign in zip(ends, states, signs, strict=True) if sign == -1.0
    ]
    for _ in range(_TRIES):
        if abs(ends[1] - ends[0]) <= _CLOSE * ask.interval[0]:
            break
        for share in _SHARES:
            middle = ends[0] + share * (ends[1] - ends[0])
            tried = at(middle)
            sign = _sign(tried)
            if sign is not None:
                ends[0 if sign == signs[0] else 1] = middle
                lost += [(middle, tried.lowest_eigenvalue)] if sign == -1.0 else []
                break
        else:
            break
    bracket = (min(ends), max(ends))
    wide = bracket[1] - bracket[0] > ask.interval[0]
    return (_vanishes(lost, bracket) if wide else None) or 0.5 * (ends[0] + ends[1]), bracket


def _vanishes(lost: list[tuple[float, float | None]], bracket: tuple[float, float]) -> float | None:
    """Where in the bracket the lowest eigenvalue is zero, by a parabola through its last three values on the unstable
    side (on the other a free motion's zero may lie below it); None where it is not in there or not known."""
    known = [(value, eigenvalue) for value, eigenvalue in lost[-3:] if eigenvalue is not None]
    if len(known) < 3:
        return None
    values, eigenvalues = np.array(known).T
    found = float(np.polyval(np.polyfit(eigenvalues / eigenvalues[0], values, 2), 0.0))
    return found if bracket[0] < found < bracket[1] else None


def _sign(state: State) -> float | None:
    """1: stable, -1: not; None: no equilibrium, or one that is not judged."""
    return None if not state.is_equilibrium or state.stable is None else 1.0 if state.stable else -1.0
