"""scipy's solve_bvp with analytic derivatives and continuation in the weight (tests/reference/strong_form.py)."""

from __future__ import annotations

import itertools
import time

import numpy as np
import scipy

from tests.peers.cases import BRANCH, TARGET, Case, Run
from tests.reference.strong_form import continued

#: Searched: nodes per |K|, tolerance on the way, (first step, growth of steps).
SEARCH = tuple(itertools.product((1.5, 2.0), (1e-1, 1e-2), ((0.5, 1.3), (0.2, 1.3), (0.05, 1.2))))
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6)
Settings = tuple[float, float, tuple[float, float], float]


def absent() -> str | None:
    """It comes with scipy."""
    return None


def version() -> str:
    """Of scipy."""
    return f"scipy {scipy.__version__}"


def run(found: Case, settings: Settings) -> Run:
    """CPU time of the continuation, the free end's place not included."""
    per_turn, loose, (first, growth), tolerance = settings
    nodes = int(max(per_turn * abs(found.curvature), 15))
    begun = time.process_time()
    solution = continued(found.strong, tolerance, nodes, first=first, loose=loose, growth=growth)
    seconds = time.process_time() - begun
    error = found.error(solution.tip()) if solution.converged else np.inf
    words = f"{per_turn:g} abs(K) nodes, {loose:g} on the way, steps {first:g} x {growth:g}, tol {tolerance:g}"
    return Run(words, error, seconds)


def best(found: Case) -> Settings:
    """The fastest way to the branch, then the loosest tolerance within the target."""
    ways = []
    for per_turn, loose, steps in SEARCH:
        tried = run(found, (per_turn, loose, steps, 1e-3))
        if tried.error < BRANCH:
            ways.append((tried.seconds, (per_turn, loose, steps)))
    for _, path in sorted(ways):
        for tolerance in TOLERANCES:
            if run(found, (*path, tolerance)).error <= TARGET:
                return (*path, tolerance)
    raise AssertionError(f"{found.name}: solve_bvp does not reach {TARGET:g}")
