"""Random starts and random clamps: what comes back, and whether the tool says so."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.battery.case import Case, Check, Rung
from compare.battery.judge.ribbon import judged
from compare.models.base import State
from compare.scene import Scene, load
from compare.scene.scene import loads

FloatArray = NDArray[np.float64]

#: Shipped scenes whose starts are random, a quick one first.
SCENES = (
    "start_5_3_3_1", "cantilever", "two_clamps_5_3_2", "two_clamps_5_3_2_twist", "two_clamps_5_3_2_level",
    "start_5_3_3_4", "hanging_5_3_1", "curl_4_3", "coil_10_100", "arc_5_1",
)  # fmt: skip
#: Random starts of a scene, of a quick one; scenes with random clamps in a rung, further random starts of each.
STARTS, FEW, CLAMPED, BESIDE = 20, 1, 20, 4
#: Energies are the same up to this difference, relative (at least 1).
SAME = 1e-6


@dataclass
class Tally:
    """How many answers were what: by the solver's word; those whose status the judge denies, and where; those above
    the lowest energy that was found, and how many of these the tool had told of."""

    words: dict[str, int] = field(default_factory=dict)
    wrong: list[str] = field(default_factory=list)
    above: int = 0
    told: int = 0
    claimed: int = 0
    solves: int = 0

    def add(self, state: State, name: str) -> None:
        """Counts an answer and has it judged; name: of the start, to be found again."""
        self.solves += 1
        self.words[state.word] = self.words.get(state.word, 0) + 1
        if state.native is None:
            return
        bad = [check for check in judged(state.native) if not check.ok]
        self.wrong += [f"{name} ({state.word}): {check.what} {check.value:.2g}, {check.said}" for check in bad]

    def ranked(self, state: State, lowest: float) -> None:
        """Counts whether a stable answer is above the lowest that was found, and what the tool had said of it."""
        minima = state.native.minima
        if not state.ok or energy(state) <= lowest + SAME * max(1.0, abs(lowest)):
            return
        self.above += 1
        self.told += minima is not None and not minima.lowest
        self.claimed += minima is not None and minima.lowest

    @property
    def said(self) -> str:
        """The shares in words."""
        words = ", ".join(f"{count} {word}" for word, count in sorted(self.words.items()))
        return f"of {self.solves}: {words}; {self.above} above the lowest found, {self.told} of them told so"

    def checks(self, lost: float) -> Iterator[Check]:
        """The checks of a rung; lost: share of answers that may be no equilibrium."""
        said = self.said
        yield Check(
            "answers whose status or numbers the judge denies", len(self.wrong), 0.0, said="; ".join(self.wrong)
        )
        equilibria = sum(self.words.get(word, 0) for word in ("converged", "saddle"))
        yield Check("share without an equilibrium", 1.0 - equilibria / max(1, self.solves), lost, said=said)


def energy(state: State) -> float:
    """Total energy of an equilibrium, D w / l."""
    total = None if state.energy is None else state.energy.total
    return np.inf if total is None else total


def answer(scene: Scene) -> State:
    """The ribbon's answer, on its own segments."""
    from compare.models import solve

    return solve(scene, "ribbon")


def shaken(scene: Scene, rng: np.random.Generator, turned: bool = True) -> Scene:
    """The scene from a random start: curvature of 0.1 to 6 / l, rulings up to 45 degrees, as a curve through four
    points."""
    size = 10.0 ** rng.uniform(-1.0, 0.8) / scene.strip.length
    bent = size * rng.standard_normal(4)
    eta = np.clip(0.4 * rng.standard_normal(4), -1.0, 1.0) if turned else np.zeros(4)
    steep = 0.2 / max(scene.width, 1e-3)  # of what the rulings may turn between two of the points
    eta = np.clip(eta, -steep, steep)
    return scene.replace({"seed.curvature": bent.tolist(), "seed.ruling": eta.tolist()})


def _started(rung: Rung) -> Iterator[Check]:
    """One shipped scene from random starts."""
    scene = load(str(rung))
    rng = np.random.default_rng(6)
    tally, found = Tally(), [answer(scene)]
    for number in range(FEW if rung == SCENES[0] else STARTS):
        found.append(answer(shaken(scene, rng)))
        tally.add(found[-1], f"start {number}")
    lowest = min((energy(one) for one in found if one.ok), default=np.inf)
    for one in found[1:]:
        tally.ranked(one, lowest)
    own = Tally()
    own.add(found[0], "its own start")
    own.ranked(found[0], lowest)
    yield from tally.checks(0.1)
    yield from own.checks(0.0)


def random_clamps(number: int) -> Scene:
    """A strip between two clamps: 0.05 to 0.95 l apart, turned by up to two turns, hanging or weightless."""
    rng = np.random.default_rng([16, number])
    apart = rng.uniform(0.05, 0.95)
    turn = rng.uniform(-1.0, 1.0) * 2.0 * np.pi * rng.choice([0.0, 0.25, 1.0])
    lean = 0.5 * rng.standard_normal(2) * rng.choice([0.0, 1.0])
    tangent = np.array([1.0, *lean])
    tangent /= np.linalg.norm(tangent)
    normal = np.array([0.0, -np.sin(turn), np.cos(turn)])
    normal -= (normal @ tangent) * tangent
    normal /= np.linalg.norm(normal)
    width, gamma = 10.0 ** rng.uniform(-2.0, -0.7), rng.choice([0.0, 1.0, 20.0, 200.0])
    curl = rng.choice([0.0, 0.0, 5.0]) * rng.uniform(0.2, 1.0)
    weight = "[gravity]\nup = [0.0, 0.0, 1.0]\n" if gamma else ""
    return loads(
        f"""
[strip]
length = 1.0
width = {width!r}
poisson = 0.4
natural_curvature = {curl!r}
gamma = {gamma!r}
{weight}
[clamp.start]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
[clamp.end]
position = [{apart!r}, 0.0, 0.0]
tangent = {tangent.tolist()}
normal = {normal.tolist()}
[model]
elements = 24
budget = 20.0
""",
        f"clamps {number}",
    )


def clamped(number: int, tally: Tally) -> dict[str, Any]:
    """One strip between random clamps: its own start, judged, beside random ones; what was found, as data."""
    scene = random_clamps(number)
    own = answer(scene)
    tally.add(own, f"clamps {number}")
    rng = np.random.default_rng([17, number])
    others = [answer(shaken(scene, rng)) for _ in range(BESIDE)]
    lowest = min((energy(one) for one in (own, *others) if one.ok), default=np.inf)
    tally.ranked(own, lowest)
    return {"number": number, "word": own.word, "energy": energy(own), "lowest": lowest}


def _clamped(rung: Rung) -> Iterator[Check]:
    """A score of strips between random clamps."""
    tally = Tally()
    for number in range(CLAMPED * int(rung), CLAMPED * int(rung) + CLAMPED):
        clamped(number, tally)
    yield from tally.checks(0.1)
    said = tally.said
    yield Check("share of stable answers above the lowest found", tally.above / CLAMPED, 0.25, said=said)


CASES: tuple[Case, ...] = (
    Case(
        name="seeds/starts",
        hard="20 random starts of each of ten scenes: coiled, turned, far from what is held",
        expected="every status and number is the independent judge's; at most a tenth ends in no equilibrium, the "
        "scene's own start in one",
        parameter="scene",
        run=_started,
        rungs=SCENES[:1],
        long=SCENES[1:],
    ),
    Case(
        name="seeds/clamps",
        hard="strips between random clamps, near and far, turned, leaning, curled, hanging: many states",
        expected="every status and number is the independent judge's; at most a tenth ends in no equilibrium, at most "
        "a quarter above the lowest state that four random starts find beside the built-in ones",
        parameter="score of scenes",
        run=_clamped,
        rungs=(),
        long=tuple(range(10)),
    ),
)
