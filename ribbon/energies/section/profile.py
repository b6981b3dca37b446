"""Shape of a cross-section of an energy of free twist, and what its energy per area consists of."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Profile:
    """A kind of cross-section."""

    kind: str


RELAXED = Profile("relaxed")
DEVELOPABLE = Profile("developable")
ROD = Profile("rod")
