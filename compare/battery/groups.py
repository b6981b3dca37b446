"""The groups of cases, each a module of `compare.battery.cases` with a tuple CASES, in the order of the table."""

from __future__ import annotations

import fnmatch
import importlib

from compare.battery.case import Case
from ribbonbench.errors import BadInput

#: Group -> what it is about.
GROUPS = {
    "functions": "the functions of energies and series against mpmath, over their whole range",
    "frames": "units, stiffnesses, rigid motions, mirror and reversal change no dimensionless number",
    "degenerate": "what is undetermined or lies on the edge: straight, unsupported, critical, taut",
    "bounds": "rulings that nearly cross, events, the widest bands",
    "size": "few and many elements, strong grading, strong curl, great weight",
    "seeds": "random starts and random clamps: what comes back, and whether the tool says so",
    "contact": "walls from touching to crushing",
    "touching": "strips that touch themselves, each other, edges and corners, and that rub",
    "infeasible": "scenes that cannot be, and how soon the tool says so",
    "shell": "the shell: thin, coiled, incompressible, snapping, coarse",
    "bands": "shells that nothing holds: bands joined after half turns, strips on a table",
    "elastica": "the planar elastica: great weight, S-shapes, branches",
    "branches": "branches of equilibria: near forks, loops, corners, the end of reach, kills",
    "models": "every model of the registry",
    "own": "scenes as people write them, through the commands: what the terminal and the files say",
    "process": "killed, interrupted, without room, with damaged or foreign files",
    "inputs": "whatever a scene file may say",
    "endurance": "thousands of solves in one process",
}


def cases_of(group: str) -> tuple[Case, ...]:
    """The cases of one group."""
    found: tuple[Case, ...] = importlib.import_module(f"compare.battery.cases.{group}").CASES
    for case in found:
        if case.group != group:
            raise ValueError(f"{case.name!r} stands in the group {group!r}")
    return found


def chosen(pattern: str | None = None) -> tuple[Case, ...]:
    """The cases whose name the pattern fits ("contact", "contact/*", "*twist*"), in order; `BadInput` for none."""
    groups = [g for g in GROUPS if pattern is None or g == pattern] or list(GROUPS)
    found = tuple(case for group in groups for case in cases_of(group))
    if pattern is None or pattern in GROUPS:
        return found
    kept = tuple(c for c in found if fnmatch.fnmatchcase(c.name, pattern) or pattern in c.name)
    if not kept:
        raise BadInput("PATTERN", pattern, "fits no case", f"a group ({', '.join(GROUPS)}) or part of a case's name")
    return kept
