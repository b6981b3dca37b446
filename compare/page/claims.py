"""What each command's verdict claims: the one table of checks. A verdict is good when every one of them is.

`compare.page.verdict.Verdict.of` wants a check for each claim; docs/verdicts.md is this table in words.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType


@dataclass(frozen=True)
class Claim:
    """name: of the check; what: has to hold; how: it is checked."""

    name: str
    what: str
    how: str


FINITE = Claim(
    "finite", "every number of the answer is finite", "positions, energy, residual, forces and moments are looked at"
)
RESIDUAL = Claim("residual", "the solver has converged", "status and relative residual of the solver")
_BALANCE = Claim(
    "balance", "forces and moments of clamps and walls carry the loads",
    "resultants about the centre of mass from shape and loads alone, to 1e-6 of the largest (compare.measure.balance)",
)  # fmt: skip
_QUADRATURE = Claim(
    "quadrature", "the energy is an integral, not its rule's",
    "where the twist is free, an adaptive rule on the state gives the energy again, to 1e-8",
)  # fmt: skip
_CONVEX = Claim(
    "convexity", "the energy says itself how long a passage is, not the elements",
    "where the twist is free, its Hessian in curvature and twist along the strip (ribbon.judge.convexity)",
)  # fmt: skip
_ELEMENTS = Claim(
    "elements", "the shape is that of many elements", "distance to the limit of the same state on finer elements"
)
_FORCES = Claim(
    "forces", "forces and moments are those of many elements", "their change on finer elements, with its order"
)
_STABLE = Claim(
    "stability", "the strip stays there", "lowest eigenvalue, its limit on finer elements and that limit's error"
)
_RIVALS = Claim(
    "rivals", "no other state was seen below it, or the scene's own start says which is meant",
    "a few other starts on few elements",
)  # fmt: skip
_BRANCH = Claim(
    "branch", "the state is the one that the starting shape means", "signs of curvature and side of the start kept"
)
_WALLS = Claim("walls", "the strip is not beyond a wall", "deepest point of the surface, between elements too")
_CROSSING = Claim(
    "crossing", "the strip does not pass through itself",
    "the surface against itself, between particles far from each other on the strip (compare.measure.crossing)",
)  # fmt: skip
_MODEL = Claim(
    "model", "the energy that the accuracy asks for is good enough", "its estimated distance to the shell, where asked"
)
_HERE = (
    FINITE, RESIDUAL, _BALANCE, _QUADRATURE, _CONVEX, _ELEMENTS, _FORCES, _STABLE, _RIVALS, _BRANCH, _WALLS, _CROSSING,
)  # fmt: skip
#: What is claimed of a state alone: `_HERE` where its distance to shells is a claim of its own.
_STATE = (*_HERE, _MODEL)
_SAME = Claim("same", "both models are in one state", "the shell accepts the ribbon's surface as its beginning")
#: The claim about every shell of a comparison.
SHELLS = "shell"
_SHELL = Claim(SHELLS, "the shell is in a stable equilibrium, and its error is known", "status; a coarser mesh")
_DISTANCE = Claim("distance", "the models are near each other", "Hausdorff distance beside both errors")

_CLAIMS: dict[str, tuple[Claim, ...]] = {
    "solve": _STATE,
    "shell": (FINITE, RESIDUAL, _BALANCE, _ELEMENTS, _FORCES, _STABLE, _WALLS, _CROSSING),
    "compare": (*_HERE, _SHELL, _SAME, _DISTANCE),
    "limits --quick": (
        *_HERE,
        Claim(
            "distance", "the estimated distance to the shell is small",
            "estimate from the ribbon alone, the worse one where the thin strip has a state on either side of it",
        ),
        Claim(
            "share", "the estimated stretching is small",
            "the same, with what passages of zero curvature and crowded clamps may add",
        ),
    ),
    "limits": (
        *_HERE, _SHELL, _SAME, _DISTANCE,
        Claim("share", "the shell hardly stretches where the model does not", "membrane and shear of its energy"),
    ),
    "explain": (
        *_STATE,
        Claim(
            "effects", "how far each effect would move the strip is known, and in which state it then is",
            "first order and its error, whole solves beside it",
        ),
    ),
    "converge": (
        *_HERE, _SHELL, _SAME,
        Claim("limit", "the model is what the shells tend to", "distance at h/w = 0 by extrapolation, its interval"),
    ),
    "cost": (
        Claim("reached", "the error was reached by a run", "discretisation error of each size against the reference"),
        Claim("read", "every model in the answer reads the whole scene", "keys that are set, against those it reads"),
        Claim("near", "every model in the answer is near the finest", "distance to the finest state of all"),
    ),
    "identify": (
        FINITE, RESIDUAL,
        Claim("stability", "the strip stays there, on its elements", "lowest eigenvalue"),
        Claim("fit", "the strip passes the points", "root mean square distance over the length"),
    ),
    "branches": (
        RESIDUAL,
        Claim("ends", "every branch is followed to an end of its own", "how each ended: at the range, or closed"),
        Claim("settled", "folds and branch points are not the mesh's", "their places on p, 2p and 4p elements"),
        Claim("complete", "every branch that was met is followed", "how many were left"),
    ),
    "sweep": (
        Claim("finite", "every number of a case is finite", "what the table holds of each"),
        Claim("cases", "every case is a stable equilibrium", "status and stability of each"),
        Claim("branch", "neighbours lie on one branch", "each case beside its neighbours"),
        Claim("elements", "the shapes are those of many elements", "errors of each case, or of a sample"),
    ),
    "check": (
        Claim("solved", "both models are in a stable equilibrium", "status of each"),
        Claim("agreed", "every claim holds, errors included", "value, error and bound of each claim"),
    ),
    "suite": (
        Claim(
            "answers", "every question is met by one of the runners' models",
            "distance to the reference in units of its interval (docs/suite.md)",
        ),
    ),
    "battery": (
        Claim("cases", "every hard case holds", "its own checks, by judges that share no code with the solvers"),
    ),
}  # fmt: skip
CLAIMS: Mapping[str, tuple[Claim, ...]] = MappingProxyType(_CLAIMS)
"""Command -> what its verdict claims."""


def declare(command: str, *claims: Claim) -> None:
    """What the verdict of a command claims, said by its page (docs/extend.md, "A study"). ValueError: it claims
    something else already."""
    if _CLAIMS.setdefault(command, claims) != claims:
        raise ValueError(f"the claims of {command!r} are declared already")
