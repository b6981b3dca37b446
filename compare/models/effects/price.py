"""What a shell will take before it is begun: time and memory by its cells, from measured sizes.

Seconds of one Newton iteration and peak memory of meshes of degree 2 are those that results/shell_size.md had on one
machine (one thread), between them and beyond by straight lines in log-log; degree 3 counts as 9/4 of the cells, which
is its number of nodes. The page as it stands, perhaps of another machine, agrees to a factor of 2 in time from mesh to
mesh, once the speed of its machine (up to 8 times more or less) is taken out, and to 15 % in memory
(tests/compare/models/test_shell_price.py).
A shell takes ten iterations or more, also from a start close by, and meshes of its own for its error and its path: what
is said is the least.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ribbonbench.accepted import YES, accepted
from ribbonbench.errors import BadInput

if TYPE_CHECKING:
    from compare.scene.scene import Scene

#: Cells, seconds of a solve, its iterations, peak memory (GB): rows of results/shell_size.md, measured on one machine.
MEASURED = ((400, 0.24, 4, 0.23), (2000, 1.27, 4, 0.29), (10000, 6.28, 4, 0.62), (40000, 36.82, 4, 2.05))
#: Memory (GB) of a process before it has a mesh.
_BARE = 0.2
ITERATIONS = 10
#: Least price that is said before a solve (s, GB), and most that is paid without being asked for.
SAID = (60.0, 2.0)
MOST = (1800.0, 8.0)


@dataclass(frozen=True)
class Price:
    """What a shell takes at least: cells of degree 2, seconds on one thread, memory in GB."""

    cells: float
    seconds: float
    gigabytes: float

    @property
    def text(self) -> str:
        """E.g. "about 18 h and 3.3 TB at least"."""
        return f"about {_time(self.seconds)} and {_memory(self.gigabytes)} at least"

    @property
    def said(self) -> bool:
        """Whether it is worth a word before the solve."""
        return self.seconds > SAID[0] or self.gigabytes > SAID[1]

    @property
    def dear(self) -> bool:
        """Whether it is paid only when asked for."""
        return self.seconds > MOST[0] or self.gigabytes > MOST[1]


def price(elements: tuple[int, int], degree: int = 2) -> Price:
    """The price of a mesh (elements along, across)."""
    cells = math.prod(elements) * (degree / 2.0) ** 2
    table = np.array(MEASURED)
    x = np.log(table[:, 0])
    seconds = _line(math.log(cells), x, np.log(table[:, 1] / table[:, 2]))
    memory = _line(math.log(cells), x, np.log(table[:, 3] - _BARE))
    return Price(cells, ITERATIONS * math.exp(seconds), _BARE + math.exp(memory))


def check_price(scene: Scene, elements: tuple[int, int] | None = None, degree: int = 2, yes: bool = False) -> Price:
    """The price of the scene's shell (elements None: its own); `BadInput` where it is dear and nobody has said `yes`,
    nor is it `accepted`."""
    from compare.models.shell_build import shell_elements  # and with it what shells are made of

    mesh = shell_elements(scene) if elements is None else elements
    found = price(mesh, degree)
    if found.dear and not (yes or accepted()):
        raise BadInput(
            "shell.elements", list(mesh), f"would take {found.text}",
            f"take fewer, or say --yes (in Python Options(yes=True), or {YES}=1 around it)",
        )  # fmt: skip
    return found


def _line(at: float, x: np.ndarray, y: np.ndarray) -> float:
    """y at `at` on straight lines between (x, y) (k,), the outer ones prolonged."""
    k = int(np.clip(np.searchsorted(x, at) - 1, 0, len(x) - 2))
    return float(y[k] + (y[k + 1] - y[k]) / (x[k + 1] - x[k]) * (at - x[k]))


def _time(seconds: float) -> str:
    for size, name in ((86400.0, "days"), (3600.0, "h"), (60.0, "min")):
        if seconds >= 2.0 * size:
            return f"{seconds / size:.2g} {name}"
    return f"{seconds:.2g} s"


def _memory(gigabytes: float) -> str:
    return f"{gigabytes / 1000.0:.2g} TB" if gigabytes >= 1000.0 else f"{gigabytes:.2g} GB"
