"""fedoo on a case: the strip as a surface of shells that turn with their elements (`with_fedoo.py`)."""

from __future__ import annotations

import time

import numpy as np

from compare.suite.answers import Answers
from compare.suite.case import Ask, Case
from compare.suite.peers.call import Reply, answers_of, interpreter, of_points, points_of, scenes
from compare.suite.peers.plate import Plate, knots, plate_of

#: Elements along of both meshes, and across the coarser one.
ALONG, ACROSS = (40, 80), 4
LIBRARY = "fedoo"


def surface(plate: Plate, n: int, m: int) -> dict[str, object]:
    """Nodes ((n + 1) (m + 1), 3) of the rest shape, those across fastest, what each carries of weight and end force
    ((n + 1) (m + 1), 3), the clamp's nodes and the centreline's, Young's modulus, Poisson's ratio and thickness."""
    along, across = np.linspace(0.0, 1.0, n + 1), knots(plate.width, m)
    nodes = plate.points(along, across).reshape(-1, 3)
    shares = [np.convolve(np.diff(at), [0.5, 0.5]) for at in (along, across)]
    ends = np.zeros((n + 1, m + 1))
    ends[-1] = shares[1]
    loads = np.outer(np.outer(*shares), plate.weight) + np.outer(ends, plate.force)
    return {
        "nodes": nodes.tolist(), "loads": loads.tolist(), "elements": [n, m],
        "young": 12.0 * (1.0 - plate.poisson**2) / plate.thickness**3, "poisson": plate.poisson,
        "thickness": plate.thickness,
    }  # fmt: skip


def fedoo(case: Case, budget: float) -> Answers:
    """fedoo's corotational shells of four nodes with mixed shear, on two meshes."""
    python, version = interpreter(LIBRARY)
    until = time.perf_counter() + budget
    of_points(case)
    plates = {ask.name: [plate_of(scene, case.theory) for scene in scenes(case, ask)] for ask in case.asks}

    def reply(ask: Ask, n: int) -> Reply:
        m = ACROSS * n // ALONG[0]
        asked = {"plates": [surface(plate, n, m) for plate in plates[ask.name]]}
        return points_of(python, "with_fedoo.py", asked, until - time.perf_counter())

    return answers_of(case, ALONG, reply, f"{LIBRARY} {version}")
