"""CalculiX (`ccx`, Debian package calculix-ccx) on a case: the strip as a surface of S8R shells.

Elements are as long as each other along the strip and narrower towards its free edges, where the twist's shear turns
around within about h. The load grows by increments of its own choice. Its own tolerance (5e-3 of a force) is tightened
where that converges, which a thin strip's forces do not to as many digits (docs/findings.md, 9). The clamp holds whole
lines of nodes with their rotations.
"""

from __future__ import annotations

import functools
import os
import re
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator, Sequence
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from compare.suite.answers import Absent, Answer, Answers, BrokeDown, NotRepresentable
from compare.suite.case import Ask, Case, first_scene
from compare.suite.peers.call import Reply, answers_of, of_points, scenes
from compare.suite.peers.plate import Plate, knots, plate_of

FloatArray = NDArray[np.float64]
PROGRAM = "ccx"
#: Lattice steps (along, across) of an element's eight nodes from its first corner; an element spans two.
_FACE = ((0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1))
#: Relative residuals and corrections tried in turn, the last its own; iterations before a growing residual ends
#: an increment, before a slow one does, at most, and halvings of an increment (of a thin shell the residual grows at
#: first: it stretches before it turns); first, least and greatest increment of the load, and how many.
TOLERANCES = (1e-5, 1e-3, 5e-3)
PATIENT = "*CONTROLS, PARAMETERS=TIME INCREMENTATION\n20, 30, 9, 60, 20, 4, , 20"
INCREMENTS, MOST = "0.02, 1., 1e-7, 0.1", 2000
#: Elements along of both meshes, across a tenth of them.
SIZES, ACROSS = (20, 40), 0.1
#: Elements across over those along where the plate twists; parts of the weight, and of the first estimate of the
#: critical one, about which it is linearised.
ACROSS_TWIST, FIRST, NEAR = 0.3, 0.1, 0.97


def _shown(x: float) -> str:
    """A number of at most the 20 characters that the program reads."""
    return f"{x + 0.0:.12g}" if abs(x) > 1e-15 else "0."


def _set(name: str, nodes: list[int]) -> str:
    return "\n".join([f"*NSET, NSET={name}", *(f"{n}," for n in nodes)])


def lattice(size: int, across: float = ACROSS) -> tuple[int, int]:
    """Elements along and across, these an even number: a line of nodes is at the middle."""
    return size, max(2, 2 * round(0.5 * across * size))


def deck(plate: Plate, size: int, tolerance: float = TOLERANCES[0]) -> str:
    """The program's input for a plate of `size` elements along; the set MIDDLE is its centreline, node by node."""
    return "\n".join([*_mesh(plate, *lattice(size)), *_loaded(plate, *lattice(size), tolerance)]) + "\n"


def _controls(tolerance: float) -> str:
    """Of a step: residuals of forces and moments with the corrections beside them, and its patience."""
    told = f"{tolerance:g}, {max(tolerance, 1e-5):g}"
    return f"*CONTROLS, PARAMETERS=FIELD\n{told}, , , {told}\n{PATIENT}"


def buckling_deck(plate: Plate, size: int, before: float, step: float) -> str:
    """The input for the lowest factor of `step` of the weight that makes a plate buckle that carries `before` of it.
    Elements are shorter towards the clamp, which restrains the section from warping within about its width."""
    first = (
        f"*STEP, NLGEOM, INC={MOST}\n{_controls(TOLERANCES[0])}\n*STATIC\n1., 1.\n{_weight(plate, before)}\n*END STEP"
    )
    second = f"*STEP, PERTURBATION\n*BUCKLE\n1, 1e-4\n{_weight(plate, step)}\n*END STEP"
    return "\n".join([*_mesh(plate, *lattice(size, ACROSS_TWIST), layered=True), first, second]) + "\n"


def _weight(plate: Plate, part: float = 1.0) -> str:
    """A part of the weight, as a load."""
    weight = np.array(plate.weight)
    size = float(np.linalg.norm(weight))
    return f"*DLOAD, OP=NEW\nSTRIP, GRAV, {_shown(part * size)}, " + ", ".join(map(_shown, weight / size))


def _mesh(plate: Plate, n: int, m: int, layered: bool = False) -> Iterator[str]:
    ends = np.linspace(0.0, 1.0, n + 1)
    corners = 1.0 - np.cos(0.5 * np.pi * ends) if layered else ends
    along = np.interp(0.5 * np.arange(2 * n + 1), np.arange(n + 1), corners)
    across = np.interp(0.5 * np.arange(2 * m + 1), np.arange(m + 1), knots(plate.width, m))
    points, nodes = plate.points(along, across), _nodes(n, m)
    yield "*NODE, NSET=ALL"
    yield from (f"{number}, " + ", ".join(map(_shown, points[place])) for place, number in nodes.items())
    yield "*ELEMENT, TYPE=S8R, ELSET=STRIP"
    for number, (i, k) in enumerate(product(range(n), range(m)), 1):
        yield ", ".join(str(x) for x in (number, *(nodes[2 * i + a, 2 * k + b] for a, b in _FACE)))
    yield _set("HELD", [number for (i, _), number in nodes.items() if i == 0])
    yield _set("MIDDLE", [nodes[i, m] for i in range(2 * n + 1)])
    young = 12.0 * (1.0 - plate.poisson**2) / plate.thickness**3
    yield f"*MATERIAL, NAME=M\n*ELASTIC\n{_shown(young)}, {_shown(plate.poisson)}"
    yield f"*DENSITY\n{_shown(1.0 / plate.thickness)}"
    yield f"*SHELL SECTION, ELSET=STRIP, MATERIAL=M\n{_shown(plate.thickness)}"
    yield "*BOUNDARY\nHELD, 1, 6"


def _nodes(n: int, m: int) -> dict[tuple[int, int], int]:
    """Lattice place (along, across) -> node; the middle of an element carries none."""
    places = (p for p in product(range(2 * n + 1), range(2 * m + 1)) if p[0] % 2 + p[1] % 2 <= 1)
    return {place: number for number, place in enumerate(places, 1)}


def _loaded(plate: Plate, n: int, m: int, tolerance: float) -> Iterator[str]:
    yield f"*STEP, NLGEOM, INC={MOST}\n{_controls(tolerance)}\n*STATIC\n{INCREMENTS}"
    force, nodes, at = np.array(plate.force), _nodes(n, m), knots(plate.width, m)
    if any(plate.weight):
        yield _weight(plate)
    if force.any():
        share = np.zeros(2 * m + 1)
        for k in range(m):
            share[2 * k : 2 * k + 3] += np.array([1.0, 4.0, 1.0]) / 6.0 * (at[k + 1] - at[k])
        yield "*CLOAD"
        for k, axis in product(range(2 * m + 1), range(3)):
            if force[axis]:
                yield f"{nodes[2 * n, k]}, {axis + 1}, {_shown(force[axis] * share[k])}"
    yield f"*NODE PRINT, NSET=MIDDLE, FREQUENCY={MOST}\nU\n*END STEP"


@functools.cache
def version() -> str:
    """Of the program. Raises `Absent`."""
    if shutil.which(PROGRAM) is None:
        raise Absent(f"{PROGRAM} is not on the path; CalculiX is Debian's package calculix-ccx")
    said = subprocess.run([PROGRAM, "-v"], capture_output=True, text=True, check=False).stdout
    found = re.search(r"[Vv]ersion\s+([\d.]+)", said)
    return f"CalculiX {found[1] if found else 'of an unknown version'}"


def solved(plate: Plate, size: int, left: float, tolerances: Sequence[float] = TOLERANCES) -> Reply:
    """The centreline (2 size + 1, 3) under the load, to the first of the tolerances to which it converges. Raises
    `BrokeDown` with the part of the load that it came to with the last."""
    used, until = _children(), time.perf_counter() + left
    for tolerance in tolerances:
        try:
            moved = _last(_run(deck(plate, size, tolerance), until - time.perf_counter()))
            break
        except BrokeDown:
            if tolerance == tolerances[-1] or time.perf_counter() > until:
                raise
    if moved is None or len(moved) != 2 * size + 1:
        raise BrokeDown("it prints no displacements")
    line = plate.points(np.linspace(0.0, 1.0, 2 * size + 1), np.zeros(1))[:, 0]
    n, m = lattice(size)
    return Reply((line + moved,), _children() - used, f"S8R {n} x {m}, tolerance {tolerance:g}")


def critical(plate: Plate, size: int, until: float) -> float:
    """The part of the weight at which the plate buckles: linearised about the unloaded plate, then about the one that
    carries `NEAR` of that. until: of `time.perf_counter`. Raises `BrokeDown`."""
    found = 0.0
    for _ in range(2):
        before, step = (NEAR * found, (1.0 - NEAR) * found) if found else (FIRST, 1.0)
        text = _run(buckling_deck(plate, size, before, step), until - time.perf_counter())
        factor = re.search(r"B U C K L I N G\s+F A C T O R.*?\n\s*1\s+([-+.\dEe]+)", text, re.S)
        if factor is None:
            raise BrokeDown("it finds no buckling factor")
        found = before + step * float(factor[1])
    return found


def _run(text: str, left: float) -> str:
    """The .dat of a run of an input within `left` seconds. Raises `BrokeDown`."""
    if left <= 0.0:
        raise BrokeDown("out of budget: nothing is left of it for the next mesh")
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "CCX_NPROC_RESULTS": "1", "OPENBLAS_NUM_THREADS": "1"}
    with tempfile.TemporaryDirectory(prefix="suite-ccx-") as name:
        folder = Path(name)
        (folder / "strip.inp").write_text(text, encoding="ascii")
        try:
            done = subprocess.run(
                [PROGRAM, "-i", "strip"], cwd=folder, capture_output=True, text=True, timeout=left, env=environment,
                check=False,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            raise BrokeDown(f"out of budget: at {_reached(folder):.3g} of the load") from None
        result = folder / "strip.dat"
        if done.returncode or "*ERROR" in done.stdout or not result.exists():
            raise BrokeDown(f"its increments ended at {_reached(folder):.3g} of the load: {_word(done.stdout)}")
        return result.read_text(encoding="ascii")


def _children() -> float:
    """Processor time (s) of the processes that this one has waited for."""
    used = os.times()
    return used.children_user + used.children_system


def _last(text: str) -> FloatArray | None:
    """Displacements (k, 3) of the last table of a .dat; None where there is none."""
    table = text.rsplit("displacements", 1)
    rows = re.findall(r"^\s*\d+((?:\s+[-+]?\d+\.\d+E[-+]\d+){3})\s*$", table[-1], re.M) if len(table) > 1 else []
    return np.array([[float(x) for x in row.split()] for row in rows]) if rows else None


def _reached(folder: Path) -> float:
    """The part of the load of the last increment that converged, by the program's own list."""
    place = folder / "strip.sta"
    if not place.exists():
        return 0.0
    rows = re.findall(r"^\s*\d+\s+\d+\s+\d+\s+\d+\s+(\S+)\s+\S+\s+\S+\s*$", place.read_text(), re.M)
    return max(map(float, rows), default=0.0)


def _word(said: str) -> str:
    """The program's own reason."""
    lines = [line.strip(" *") for line in said.splitlines() if "ERROR" in line or "diverg" in line]
    return lines[-1] if lines else "it says no reason"


def calculix(case: Case, budget: float) -> Answers:
    """CalculiX's S8R shell and its static solver, or its linear buckling, on two meshes."""
    known = version()
    until = time.perf_counter() + budget
    if all(ask.of == "critical" and ask.key == "strip.gamma" for ask in case.asks):
        return _critical(case, until, known)
    of_points(case)
    plates = {ask.name: [plate_of(scene, case.theory) for scene in scenes(case, ask)] for ask in case.asks}

    def reply(ask: Ask, size: int) -> Reply:
        found = [solved(plate, size, until - time.perf_counter()) for plate in plates[ask.name]]
        return Reply(
            tuple(one.points[0] for one in found), sum(one.seconds or 0.0 for one in found), found[-1].settings
        )

    return answers_of(case, SIZES, reply, known)


def _critical(case: Case, until: float, known: str) -> Answers:
    """Critical weights, about the plate of the case's own weight."""
    begun, answers = time.perf_counter(), {}
    scene = first_scene(case)
    plate = plate_of(scene, case.theory)
    if not any(plate.weight) or any(plate.rest) or any(plate.force):
        raise NotRepresentable("this adapter makes straight strips alone buckle, and under their weight alone")
    gamma, meshes = float(scene.gamma), tuple(2 * size for size in SIZES)
    for ask in case.asks:
        coarse, fine = (gamma * critical(plate, size, until) for size in meshes)
        answers[ask.name] = Answer(fine, abs(fine - coarse))
    settings = f"elements: {meshes[0]}, {meshes[1]}; S8R, linearised about {NEAR} of the critical weight"
    return Answers(answers=answers, version=known, settings=settings, seconds=time.perf_counter() - begun)
