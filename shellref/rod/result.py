"""What a solve of the rod came to."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from shellref.rod.elements import Elements, State
from shellref.rod.problem import RodProblem
from shellref.rod.quaternion import Array, rotation
from shellref.rod.walk import Step


class RodStatus(Enum):
    """How a solve ended."""

    CONVERGED = "converged"
    UNSTABLE = "unstable"
    LIMIT_POINT = "limit_point"
    NOT_CONVERGED = "not_converged"


@dataclass(frozen=True)
class RodEnergy:
    """Energies in D w / l: by kind of strain, of the weight and of the force at the tip (against the origin)."""

    bending: float
    torsion: float
    shear: float
    stretch: float
    gravity: float
    force: float

    @property
    def elastic(self) -> float:
        """Stored."""
        return self.bending + self.torsion + self.shear + self.stretch


@dataclass(frozen=True)
class Reaction:
    """Force and moment (3,) that a support exerts on the rod, the moment about the end itself."""

    force: Array
    moment: Array


@dataclass(frozen=True)
class RodResult:
    """State of the rod and how it was found; `reached`: the share of the last stage; error: of the shape, over l,
    against elements half as long."""

    problem: RodProblem
    elements: Elements
    state: State
    status: RodStatus
    stable: bool | None
    message: str
    energy: RodEnergy
    start: Reaction
    end: Reaction
    residual: float
    iterations: int
    lowest_eigenvalue: float | None
    flutter: bool
    unknowns: int
    log: tuple[Step, ...]
    snaps: int
    reached: float
    error: float | None = None
    seconds: float = field(default=float("nan"))

    @property
    def degree(self) -> int:
        """Of the elements."""
        return self.elements.degree

    @property
    def steps(self) -> int:
        """How many were taken."""
        return len(self.log)

    def position(self, s: Array) -> Array:
        """(k, 3) at s (k,)."""
        return self.elements.at(self.state, np.asarray(s, dtype=float))[0]

    def frames(self, s: Array) -> Array:
        """(k, 3, 3) at s (k,)."""
        return rotation(self.elements.at(self.state, np.asarray(s, dtype=float))[1])

    def strains(self, s: Array) -> Array:
        """(k, 6) at s (k,): Gamma, kappa, by the polynomials through the Gauss points, where they are best."""
        return self._from_gauss(self.elements.strains(self.state), s)

    def excess(self, s: Array) -> Array:
        """The strains (k, 6) less those at rest."""
        found = self.elements.strains(self.state) - self.elements.rest(self.problem)
        return self._from_gauss(found, s)

    def section_forces(self, s: Array) -> Array:
        """Force and moment (k, 6) of the section in its own frame at s (k,)."""
        return np.asarray(self.problem.section.stiffness * self.excess(s))

    def _from_gauss(self, values: Array, s: Array) -> Array:
        s = np.asarray(s, dtype=float)
        element, x = self.elements.local(s)
        points = np.polynomial.legendre.leggauss(self.degree)[0]
        weights = np.linalg.solve(np.vander(points, increasing=True).T, (x[:, None] ** np.arange(self.degree)).T).T
        return np.asarray(np.einsum("kg,kgi->ki", weights, values[element]))


def energy_of(elements: Elements, state: State, problem: RodProblem) -> RodEnergy:
    """The energies of a state."""
    parts = elements.energy(state, problem)
    shares = np.zeros(len(elements.s))
    np.add.at(shares, elements.connect, np.einsum("eg,ga->ea", elements.weights, elements.values))
    return RodEnergy(
        bending=float(parts[3] + parts[4]),
        torsion=float(parts[5]),
        shear=float(parts[0] + parts[1]),
        stretch=float(parts[2]),
        gravity=0.0 - float(shares @ (state.r @ problem.weight)),
        force=0.0 - float(state.r[-1] @ problem.force),
    )


def reactions(elements: Elements, state: State, problem: RodProblem) -> tuple[Reaction, Reaction]:
    """What the supports exert on both ends: what the balance of their nodes lacks."""
    out = elements.residual(state, problem)
    found = []
    for index, held in ((0, problem.start), (-1, problem.end)):
        force = out[index, :3] if held.position is not None else np.zeros(3)
        if held.slide is not None and held.position is not None:
            along = held.slide / np.linalg.norm(held.slide)
            force = force - (force @ along) * along
        moment = rotation(state.q[index]) @ out[index, 3:] if held.frame is not None else np.zeros(3)
        found.append(Reaction(force, moment))
    return found[0], found[1]
