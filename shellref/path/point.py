"""A point of a shell's path, the walk that led there, and what the parts of a walk ask of whoever walks it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from shellref.path.newton import Attempt, Equilibrium
from shellref.shell.body import Stage
from shellref.shell.naghdi import NaghdiModel, Stress
from shellref.shell.options import ShellOptions
from shellref.shell.result import LoadStep, ShellStatus


@dataclass
class Point:
    """An equilibrium: load of its stage, nodal values (nodes, 6), stress, negative eigenvalues of its tangent; rate: of
    nodal values and stress by the load of the present stage, None where it is not known."""

    load: float
    state: np.ndarray
    stress: Stress
    negative: int | None = None
    rate: tuple[np.ndarray, Stress] | None = None


@dataclass
class Walk:
    """The walk so far: the last good point and the one before it, where it is, every attempt, what went wrong.

    stage: number of the stage, len(stages) at the end. step: of the load; arc: this stage is followed by arc length.
    kicks: unstable states left; left: the last attempt to leave one succeeded.
    """

    point: Point
    older: Point | None = None
    stage: int = 0
    step: float | None = None
    arc: bool = False
    steps: list[LoadStep] = field(default_factory=list)
    status: ShellStatus | None = None
    message: str = ""
    kicks: int = 0
    left: bool = True

    def stop(self, status: ShellStatus, message: str) -> None:
        """End the walk here."""
        self.status, self.message = status, message


class Journal(Protocol):
    """Where a walk is written down while it goes on."""

    def step(self, step: LoadStep) -> None:
        """One attempt."""
        ...

    def point(self, walk: Walk) -> None:
        """An accepted point."""
        ...


class Walker(Protocol):
    """Who walks (`shellref.path.walk.Walker`), as arc length sees it: the discrete equations, the stages, the log."""

    equilibrium: Equilibrium
    model: NaghdiModel
    stages: tuple[Stage, ...]
    options: ShellOptions
    journal: Journal

    def log(self, walk: Walk, method: str, load: float, attempt: Attempt, accepted: bool, note: str = "") -> None:
        """Write one attempt down."""
        ...

    def accept(self, walk: Walk, method: str, attempt: Attempt, note: str = "", settle: bool = True) -> None:
        """Take a converged attempt as the walk's new point; look at its stability when it should settle."""
        ...
