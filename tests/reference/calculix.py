"""CalculiX (`ccx`, Debian package calculix-ccx), a code unrelated to ours, on a strip held on edge under its weight.

Decks by script: a rectangular lattice of quadratic elements, S8R shells or C3D20R solids. The strip lies along x from
its clamped end x = 0, its width along z, its thickness along y; weight pulls along -z. Lengths in l, D = Y h^3 /
(12 (1 - nu^2)) = 1 and mass density times g times h = Gamma, so that loads are Gamma as everywhere here.
The program is no dependency of the project: `available` says whether it can be run.
"""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np

PROGRAM = "ccx"
#: Where the last eigenproblem is posed, over the first estimate.
NEAR = 0.97
#: Elements whose size doubles from h / 2 on: at the clamp, at each free edge.
AT_CLAMP, AT_EDGE = 5, 2
#: Relative residual and correction of an equilibrium; its own 5e-3 and 1e-2 move the critical weight by 0.5 %.
TIGHT = "*CONTROLS, PARAMETERS=FIELD\n1e-5, 1e-5, , , 1e-5, 1e-5"
#: Lattice steps (along, thickness, across) of an element's nodes from its first corner; an element spans two steps.
_BOTTOM = ((0, 0, 0), (2, 0, 0), (2, 0, 2), (0, 0, 2))
_FACE = (*_BOTTOM, (1, 0, 0), (2, 0, 1), (1, 0, 2), (0, 0, 1))
_SHELL = _FACE
_FAR = tuple((i, 2, k) for i, _, k in _FACE)  # x cross z is -y: a solid's first face is the one at larger y
_SOLID = (*_FAR[:4], *_FACE[:4], *_FAR[4:], *_FACE[4:], *((i, 1, k) for i, _, k in _BOTTOM))
TYPES = {"S8R": _SHELL, "C3D20R": _SOLID}


def available() -> bool:
    """Whether the program is on the path."""
    return shutil.which(PROGRAM) is not None


class Failed(RuntimeError):
    """CalculiX ended without the numbers asked for."""


@dataclass(frozen=True)
class OnEdge:
    """A strip on edge: width and thickness in l, Poisson's ratio, element, elements (along, across).

    Towards the free edges and the clamp the elements shrink to h / 2: the layer in which the twist's shear turns around
    is about h wide, and a mesh without it overestimates the torsion constant, by up to 0.63 h / w of itself.
    """

    width: float
    thickness: float
    poisson: float
    element: str = "S8R"
    elements: tuple[int, int] = (80, 8)

    @property
    def name(self) -> str:
        """Element and mesh."""
        return f"{self.element} {self.elements[0]} x {self.elements[1]}"

    def _lattice(self) -> dict[tuple[int, int, int], int]:
        """Lattice place (along, thickness, across) -> node; places inside a face or an element carry none."""
        nx, nz = self.elements
        thick = 2 if self.element.startswith("C3D") else 0
        places = product(range(2 * nx + 1), range(thick + 1), range(2 * nz + 1))
        used = [p for p in places if sum(k % 2 for k in p) <= 1]
        return {place: number for number, place in enumerate(used, 1)}

    def _places(self) -> tuple[np.ndarray, np.ndarray]:
        """Lattice places along (2 nx + 1,) and across (2 nz + 1,), over l: corners and midpoints of the elements."""
        nx, nz = self.elements
        layer = self.thickness * (2.0 ** np.arange(AT_CLAMP + 1) - 1.0) / 2
        along = np.concatenate([layer[:-1], np.linspace(layer[-1], 1.0, nx - AT_CLAMP + 1)])
        edge = 0.5 * self.width - self.thickness * (2.0 ** np.arange(AT_EDGE + 1) - 1.0) / 2
        across = np.concatenate([-edge[:-1], np.linspace(-edge[-1], edge[-1], nz - 2 * AT_EDGE + 1), edge[-2::-1]])
        return _with_midpoints(along), _with_midpoints(across)

    def _mesh(self) -> Iterator[str]:
        nodes, (nx, nz), (along, across) = self._lattice(), self.elements, self._places()
        solid = self.element.startswith("C3D")
        yield "*NODE, NSET=ALL"
        for (i, j, k), number in nodes.items():
            y = (j - 1) * 0.5 * self.thickness if solid else 0.0
            yield f"{number}, {along[i]:.15g}, {y:.15g}, {across[k]:.15g}"
        yield f"*ELEMENT, TYPE={self.element}, ELSET=STRIP"
        for number, (i, k) in enumerate(product(range(nx), range(nz)), 1):
            corners = [nodes[2 * i + di, dj, 2 * k + dk] for di, dj, dk in TYPES[self.element]]
            words = [str(n) for n in (number, *corners)]
            yield ", ".join(words[:11]) + ("," if len(words) > 11 else "")
            if len(words) > 11:
                yield ", ".join(words[11:])
        yield "*NSET, NSET=HELD"
        yield from (f"{n}," for (i, _, _), n in nodes.items() if i == 0)
        yield "*NSET, NSET=TIP"
        yield f"{nodes[2 * nx, 1 if solid else 0, nz]},"
        young = 12 * (1 - self.poisson**2) / self.thickness**3
        yield "*MATERIAL, NAME=M"
        yield f"*ELASTIC\n{young:.15g}, {self.poisson:.15g}"
        yield f"*DENSITY\n{1.0 / self.thickness:.15g}"
        if solid:
            yield "*SOLID SECTION, ELSET=STRIP, MATERIAL=M"
        else:
            yield f"*SHELL SECTION, ELSET=STRIP, MATERIAL=M\n{self.thickness:.15g}"
        yield f"*BOUNDARY\nHELD, 1, {3 if solid else 6}"

    def deck(self, *steps: str) -> str:
        """The input of a run."""
        return "\n".join([*self._mesh(), *steps]) + "\n"

    def _tip_node(self) -> int:
        nx, nz = self.elements
        if nz % 2:
            raise ValueError(f"elements across must be even, for a node at the middle of the end: {nz}")
        return self._lattice()[2 * nx, 1 if self.element.startswith("C3D") else 0, nz]


def _with_midpoints(knots: np.ndarray) -> np.ndarray:
    return np.interp(np.arange(2 * knots.size - 1) / 2, np.arange(knots.size), knots)


def _weight(gamma: float) -> str:
    return f"*DLOAD, OP=NEW\nSTRIP, GRAV, {gamma:.15g}, 0., 0., -1."


def run(deck: str, folder: Path, name: str, minutes: float = 30.0) -> str:
    """The .dat of a run of the deck in `folder`. Raises `Failed` with the program's last words."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{name}.inp").write_text(deck)
    done = subprocess.run([PROGRAM, "-i", name], cwd=folder, capture_output=True, text=True, timeout=60 * minutes)
    result = folder / f"{name}.dat"
    if done.returncode != 0 or "*ERROR" in done.stdout or not result.exists():
        raise Failed(f"{name}: " + " | ".join(done.stdout.strip().splitlines()[-6:]))
    return result.read_text()


def critical(strip: OnEdge, folder: Path) -> float:
    """The critical Gamma: linearised about the unloaded strip, then about the nonlinear equilibrium at NEAR of that."""
    first = _linearised(strip, 1.0, 10.0, folder)
    return _linearised(strip, NEAR * first, (1.0 - NEAR) * first, folder)


def _linearised(strip: OnEdge, preload: float, step: float, folder: Path) -> float:
    """preload + lambda step, lambda the lowest eigenvalue.

    The program looks for eigenvalues about 1 and misses those well below it: `step` is of the size of what is left.
    """
    text = run(
        strip.deck(
            f"*STEP, NLGEOM\n{TIGHT}\n*STATIC\n1., 1.\n{_weight(preload)}\n*END STEP",
            f"*STEP, PERTURBATION\n*BUCKLE\n1, 1e-4\n{_weight(step)}\n*END STEP",
        ),
        folder, "critical",
    )  # fmt: skip
    found = re.search(r"B U C K L I N G\s+F A C T O R.*?\n\s*1\s+([-+.\dEe]+)", text, re.S)
    if found is None:
        raise Failed(f"{strip.name}: no buckling factor in the output")
    return preload + step * float(found[1])


def deflection(strip: OnEdge, gamma: float, folder: Path, push: float) -> np.ndarray:
    """Displacement (3,) in l of the middle of the free end at Gamma, on the branch that bends towards +y.

    push: lateral force at the end on the way, in D / l (so over w: in D w / l^2 times w), gone at the end.
    """
    strip._tip_node()
    printed = "*NODE PRINT, NSET=TIP, FREQUENCY=9999\nU"
    text = run(
        strip.deck(
            f"*STEP, NLGEOM, INC=300\n*STATIC\n0.05, 1., 1e-6, 0.1\n{_weight(gamma)}\n"
            f"*CLOAD, OP=NEW\nTIP, 2, {push:.15g}\n*END STEP",
            f"*STEP, NLGEOM, INC=300\n*STATIC\n0.2, 1., 1e-6, 0.5\n{_weight(gamma)}\n"
            "*CLOAD, OP=NEW\nTIP, 2, 0.\n*END STEP",
            f"*STEP, NLGEOM\n{TIGHT}\n*STATIC\n1., 1.\n{_weight(gamma)}\n{printed}\n*END STEP",
        ),
        folder, "deflection",
    )  # fmt: skip
    rows = re.findall(r"^\s+\d+((?:\s+[-+]?\d+\.\d+E[-+]\d+){3})\s*$", text, re.M)
    if not rows:
        raise Failed(f"{strip.name}: no displacement in the output")
    return np.array([float(x) for x in rows[-1].split()])
