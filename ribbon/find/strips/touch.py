"""Strips kept from each other: contact between them, by an exchange of places (`ribbon.find.apart`)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ribbon.find.strips.assemble import Member
from ribbon.problems.strips.problem import StripsProblem
from ribbon.solvers.problem import Minimum

FloatArray = NDArray[np.float64]

#: Furthest (l_0) that an equilibrium's strips are nearer to each other than they may be.
TOLERANCE = 1e-6


def check_start(problem: StripsProblem, x: FloatArray, members: Sequence[Member]) -> None:
    """Refuses strips that begin nearer to each other than they are kept."""


def kept(problem: StripsProblem, point: Minimum) -> tuple[StripsProblem, Minimum, float | None]:
    """The equilibrium with the places held apart that it needs, and how far strips are too near."""
    return problem, point, None
