"""What came of an answer: met, off by so many intervals, another equilibrium, or why there is none.

Kinds of outcome after the findings page of cosseratbench and the protocol of A. Jacobson's mesh-elasticity-solver-
benchmark: a divergence at a limit point is an end of its own and no defect, and what an adapter gets wrong is not laid
at the door of the program behind it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from compare.suite.answers import ANSWERED, MISTAKE, Answers
from compare.suite.case import Ask, Case, Value

MET, OFF, ELSEWHERE = "met", "off", "another equilibrium"


@dataclass(frozen=True)
class Score:
    """One question of one case, answered by one way of a runner.

    outcome: `MET`, `OFF`, `ELSEWHERE`, or how the attempt ended without an answer; off: distance to the reference in
    intervals, None without an answer; mesh: the runner's own discretisation error in intervals, None where it does not
    know it.
    """

    case: str
    ask: str
    runner: str
    way: str
    outcome: str
    value: Value | None
    reference: Value
    interval: tuple[float, ...]
    off: float | None
    mesh: float | None
    unit: str
    why: str
    seconds: float | None
    version: str

    @property
    def told(self) -> str:
        """The outcome in words."""
        if self.outcome != OFF or self.off is None:
            return self.outcome
        if self.off == float("inf"):
            return "off: the other answer"
        by = f"off by {self.off:.2g} intervals"
        return f"{by}, its mesh by {self.mesh:.2g}" if self.mesh is not None and self.mesh > 0.25 * self.off else by


def scored(case: Case, runner: str, said: Answers) -> Iterator[Score]:
    """A score for every question of the case."""
    for ask in case.asks:
        outcome, why = said.ended, said.why
        value, off, mesh = None, None, None
        if said.ended == ANSWERED:
            answer = said.answers.get(ask.name)
            if answer is None:
                outcome, why = MISTAKE, "does not answer this question, and does not say why"
            else:
                value = answer.value
                outcome, off, mesh, why = _judged(ask, answer.value, answer.error, said.states.get(ask.name, ""))
        yield Score(
            case.name, ask.name, runner, said.way, outcome, value, ask.reference, ask.interval, off, mesh, ask.unit,
            why, said.seconds, said.version,
        )  # fmt: skip


def _judged(ask: Ask, value: Value, error: float | None, state: str) -> tuple[str, float | None, float | None, str]:
    try:
        off = ask.distance(value)
    except (TypeError, ValueError) as fault:
        return MISTAKE, None, None, str(fault)
    mesh = None if error is None else abs(error) / min(ask.interval)
    if off <= 1.0:
        return MET, off, mesh, state
    if not isinstance(value, (bool, tuple)):
        for other in ask.elsewhere:
            if abs(value - other) <= max(ask.interval[0], 0.01 * abs(other - float(ask.reference))):  # type: ignore[arg-type]
                return ELSEWHERE, off, mesh, f"it is {other:.6g} in another equilibrium" + (state and f"; {state}")
    return OFF, off, mesh, state


def counted(scores: Iterable[Score]) -> Mapping[str, int]:
    """How many scores have each outcome, in the order of the outcomes' first appearance."""
    found: dict[str, int] = {}
    for score in scores:
        found[score.outcome] = found.get(score.outcome, 0) + 1
    return found
