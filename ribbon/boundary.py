"""What holds the ribbon: clamps at its ends and the closure of a band (thesis, 5.1, 5.2 and 6.1).

Rows: docs/theory.md, eq. (5.1), (5.2); which way a frame turns: docs/theory.md, eq. (1.2).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ribbon.errors import RibbonInputError
from ribbonbench.statics import cross

ORTHONORMAL_TOLERANCE = 1e-9


def unit_vector(key: str, value: ArrayLike) -> NDArray[np.float64]:
    """`value` as a unit vector (3,); RibbonInputError when it is none to 1e-9."""
    try:
        vector = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise RibbonInputError(key, value, "three numbers are needed") from None
    if vector.shape != (3,) or not np.all(np.isfinite(vector)):
        raise RibbonInputError(key, value, "three finite numbers are needed")
    norm = float(np.linalg.norm(vector))
    if abs(norm - 1.0) > ORTHONORMAL_TOLERANCE:
        hint = f"use {(vector / norm).tolist()}" if norm > 0 else "the zero vector has no direction"
        raise RibbonInputError(key, value, f"a unit vector is needed; {hint}")
    return vector / norm


@dataclass(frozen=True)
class Clamp:
    """What is held at an end: position, material frame, the ruling; each of them may be left free.

    Parameters
    ----------
    position:
        r, (3,), in the strip's unit of length; None: free to move.
    tangent, normal:
        t_z and t_y, unit and orthogonal, (3,) each; t_x = t_y x t_z completes the right-handed frame. Both None: the
        frame is free to turn (a pinned end).
    ruling:
        "straight": eta = 0, as a physical clamp that holds the whole edge (thesis, 7.1), or "free", as in the thesis's
        models of chapters 3 and 5. None: straight where the frame is held, free where it is free to turn.
    """

    position: ArrayLike | None = (0.0, 0.0, 0.0)
    tangent: ArrayLike | None = (0.0, 0.0, 1.0)
    normal: ArrayLike | None = (0.0, 1.0, 0.0)
    ruling: str | None = None
    _frame: NDArray[np.float64] | None = field(init=False, repr=False, compare=False)
    ruling_given: bool = field(init=False, repr=False, compare=False, default=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "ruling_given", self.ruling is not None)
        if self.ruling is None:
            object.__setattr__(self, "ruling", "free" if self.tangent is None and self.normal is None else "straight")
        if self.ruling not in ("free", "straight"):
            raise RibbonInputError("ruling", self.ruling, 'use "free" or "straight"')
        if self.position is not None:
            position = np.asarray(self.position, dtype=float)
            if position.shape != (3,) or not np.all(np.isfinite(position)):
                raise RibbonInputError("position", self.position, "three finite numbers are needed")
            object.__setattr__(self, "position", tuple(position.tolist()))
        if (self.tangent is None) != (self.normal is None):
            missing = "tangent" if self.tangent is None else "normal"
            raise RibbonInputError(missing, None, "give tangent and normal, or neither (the frame is then free)")
        if self.tangent is None or self.normal is None:
            object.__setattr__(self, "_frame", None)
            return
        tangent = unit_vector("tangent", self.tangent)
        normal = unit_vector("normal", self.normal)
        if abs(float(tangent @ normal)) > ORTHONORMAL_TOLERANCE:
            raise RibbonInputError("normal", self.normal, "the normal must be orthogonal to the tangent")
        across = cross(normal, tangent)
        across /= np.linalg.norm(across)
        normal = cross(tangent, across)
        object.__setattr__(self, "_frame", np.column_stack([across, normal, tangent]))

    @property
    def holds_frame(self) -> bool:
        """Whether the material frame is held."""
        return self._frame is not None

    @property
    def is_whole(self) -> bool:
        """Whether position and frame are both held."""
        return self._frame is not None and self.position is not None

    @property
    def frame(self) -> NDArray[np.float64]:
        """The frame held, (3, 3) with columns t_x t_y t_z; `RibbonInputError` where it is free."""
        if self._frame is None:
            raise RibbonInputError("frame", None, "this clamp leaves the frame free")
        return self._frame


@dataclass(frozen=True)
class Closure:
    """A band closed on itself: the end is glued to the start (thesis, 6.1).

    Parameters
    ----------
    kind:
        "circle": r, frame, omega and eta of the end are those of the start; "moebius": t_x and t_y are reversed at the
        seam, so that eta(l) = -eta(0) (thesis, eq. 6.1 with delta = -1) and omega(l) = -omega(0).
    ruling:
        "free", or "straight": eta = 0 at the seam, the thesis's alternative; it pins a Wunderlich event to the seam.
    turns:
        turns of the starting shape of a circle.
    half_turns:
        half turns of the end about its tangent before it is joined, 2 or more: the search begins at the band that is
        alike about as many axes (`ribbon.find.bands.folds`). None: what the kind has, or what the seed leads to.
    """

    kind: str
    ruling: str = "free"
    turns: int = 1
    half_turns: int | None = None

    def __post_init__(self) -> None:
        if self.kind not in ("circle", "moebius"):
            raise RibbonInputError("kind", self.kind, 'use "circle" or "moebius"')
        if self.ruling not in ("free", "straight"):
            raise RibbonInputError("ruling", self.ruling, 'use "free" or "straight"')
        if isinstance(self.turns, bool) or not isinstance(self.turns, int) or self.turns < 1:
            raise RibbonInputError("turns", self.turns, "a whole number of turns, at least one, is needed")
        given = self.half_turns
        if given is None:
            return
        odd = self.kind == "moebius"
        if isinstance(given, bool) or not isinstance(given, int) or given < 0 or given % 2 != odd:
            raise RibbonInputError("half_turns", given, f"an {'odd' if odd else 'even'} number joins a {self.kind}")
        if given and self.turns > 1:
            raise RibbonInputError("half_turns", given, "a circle of several turns has none; leave one of both out")

    @property
    def folded(self) -> bool:
        """Whether it has so many half turns that its search begins at a band of as many folds."""
        return self.half_turns is not None and self.half_turns > 1

    @property
    def sign(self) -> int:
        """delta: +1 for a circle, -1 for a Moebius band."""
        return 1 if self.kind == "circle" else -1
