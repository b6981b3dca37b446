"""What the message of a state may say: every sentence once, under the code by which programs ask for it.

A note's value is its text, with the names of the numbers that stand in it. `Equilibrium.notes` has the codes of those
that a message is made of, so that nobody looks for words in it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum


class Note(Enum):
    """A sentence of a message; the name is its code, the value its text."""

    STOPPED = "{status} ({why})"
    SLACK_LOST = "held ends that leave a slack of {slack:.2g} l are lost in rounding: give more slack, or none at all"
    NO_FREEDOM = "what holds the strip leaves these segments no freedom: nothing can be unstable there"
    BY_IPOPT = "found by Ipopt"
    BEHIND = "not converged: the strip reaches {depth:.2g} l beyond a wall between its joints; use more segments"
    BEHIND_ON_PATH = "on its way the strip reaches {depth:.2g} l beyond a wall between its joints"
    TOO_NEAR = (
        "not converged: parts of the strip, at s = {s:.3g} and s = {other:.3g}, are {depth:.2g} l nearer to each other "
        "than they are kept; begin where they are apart and come here in smaller steps, or use more segments"
    )
    PASSES = (
        "not converged: on the way from the state before, parts at s = {s:.3g} and s = {other:.3g} would pass through "
        "each other; use smaller steps"
    )
    QUADRATURE = (
        "not converged: the elastic energy hangs on its quadrature, an adaptive integral differs by {error:.2g} of it; "
        "use more segments"
    )
    NOT_JUDGED = "stability could not be judged"
    WAYS_DOWN = "its second variation has {count} negative eigenvalue(s)"
    INDIFFERENT = "indifferent to at least one mode (eigenvalue zero to rounding)"
    FREE_BAND = (
        "nothing holds the band: where it begins in space (its seam at the origin, tangent e_z, normal e_y) chooses "
        "among its states, and another may have less energy"
    )
    PUSHED_ALONG = (
        "its segments push it along itself with {push:.2g} D w / l^2: make them mirror images about the middle of the "
        "first"
    )
    ANOTHER_STATE = "not converged: on {segments} segments it ended above the state it began at, in another one"
    TOLERANCE_MISSED = "the tolerance {tolerance:g} was not reached: {why}"
    TOLERANCE_ROUNDS = "the tolerance {tolerance:g} was not reached in {rounds} rounds; reached {reached:.2g}"
    TOLERANCE_SEGMENTS = "the tolerance {tolerance:g} needs more than {most} segments; reached {reached:.2g}"
    PATH_STOPPED = "the way stopped at t = {t:.6g}: the next step ended with: {why}"
    RUBS_UNSETTLED = (
        "not converged: friction and pushes still change by {change:.2g} after {rounds} rounds; use smaller steps"
    )
    SOFTENED = "the minimum of the energy of a strip of thickness {thickness:.3g} l; stability was not judged"
    UNDETERMINED = "with its ends exactly one length apart a strip that does not stretch is straight under any tension"
    NO_TENSION = "no freedom is left to be unstable; its tension is undetermined: {why}"

    def text(self, **numbers: object) -> str:
        """The sentence with its numbers."""
        return self.value.format(**numbers)


@dataclass
class Message:
    """A message while it is made: what it begins with, and the notes behind it."""

    head: str
    notes: list[Note] = field(default_factory=list)
    _texts: list[str] = field(default_factory=list)

    @classmethod
    def of(cls, note: Note, **numbers: object) -> Message:
        """A message that begins with a note."""
        return cls(note.text(**numbers), [note])

    def add(self, note: Note, **numbers: object) -> None:
        """One sentence more."""
        self.notes.append(note)
        self._texts.append(note.text(**numbers))

    def __str__(self) -> str:
        return "; ".join([self.head, *self._texts])
