"""Where a shell's solve begins: a given surface, the path on a coarse mesh, or the path on the mesh itself.

An equilibrium satisfies the shell's own equations wherever Newton's iteration began; the beginning only selects which
one is found where there are several. What is believed of a given surface, `ShellOptions.begin`:

    "given"    the state near it is the one asked for; if need be by way of thicker strips
    "stable"   it is a mere beginning, and is refused where it does not settle, without a kick, in a stable state
    "checked"  the same, and is refused where the path on a coarse mesh leads to another state

`ShellOptions.coarse`: where no given surface serves, the path is walked on a coarse mesh and its end is interpolated to
the mesh (position and director); that end is believed as little as a given surface is.

Same state on two meshes, without a tolerance between meshes: the fine state, interpolated to the coarse mesh, must
settle there, at the full load, in the very state where the coarse path ended (to `SAME`). A coarse path that left an
unstable state took one of several branches, or its mesh is too coarse: it is not believed, nor is one that ends further
than `FAR` from the fine state. The next finer coarse mesh is tried; where none is left, the path is walked on the mesh
itself.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from shellref.band.turns import half_turns
from shellref.inputs import ShellInputError
from shellref.shell.options import ShellOptions
from shellref.shell.problem import ShellProblem
from shellref.shell.result import ShellResult, ShellStatus
from shellref.shell.surface import ShellSurface

#: Factor on the thickness when a start is too far for the strip's own (membrane and shear strains of a start that is no
#: equilibrium cost h^-2 of the bending energy), and the most solves on the way down.
THICKER = 2.0
MOST_SOLVES = 24

#: Coarse meshes: cells along and across over these, at least so many of them, and LEAST; at most a part of the cells.
COARSER = (8, 4, 2)
FEWEST = (20, 2)
MOST_CELLS = 0.25
LEAST = (25, 2)
#: Largest distance (over l) of two settled states on one mesh that are one state.
SAME = 1e-6
#: Largest distance (over l) of a coarse state from the fine one that is believed to be a discretisation error.
FAR = 0.05

#: Half turns beyond which no band is stable that may pass through itself (docs/decisions.md, half turns).
MOST_STABLE = 3

#: How a path is called where a start was given: by whether the state near it is the one asked for.
PATH_AGAIN = {True: "path (none near the start)", False: "path (the start is refused)"}

Say = Callable[[dict[str, Any]], None]


@dataclass(frozen=True)
class Begun:
    """A solve and how it began.

    how: "path", "coarse path", "given", "given, as the coarse path", "given, by way of thicker strips", "path (none
    near the start)" or "path (the start is refused)". notes: the coarse mesh with its distance to the result, and why a
    beginning was refused, where there is one (shell.json's `begun`).
    """

    result: ShellResult
    how: str
    notes: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Coarse:
    """The end of a path on a coarse mesh."""

    problem: ShellProblem
    result: ShellResult


def coarse_meshes(elements: tuple[int, int]) -> list[tuple[int, int]]:
    """Meshes (along, across) on which a path may be walked for this one, coarse ones first; none for a small mesh."""
    along, across = elements
    found = [(along // k, max(FEWEST[1], across // k)) for k in COARSER if along // k >= FEWEST[0]]
    if along * across * MOST_CELLS >= math.prod(LEAST):
        found.insert(0, LEAST)
    return sorted({mesh for mesh in found if math.prod(mesh) <= MOST_CELLS * along * across}, key=math.prod)


def _after(coarse: ShellResult, result: ShellResult) -> ShellResult:
    """The result with the way to it: the steps of the coarse path, each with its mesh, and what they took."""
    mesh = "on " + " x ".join(map(str, coarse.elements))
    steps = [dataclasses.replace(s, note=f"{mesh}; {s.note}" if s.note else mesh) for s in coarse.steps]
    return dataclasses.replace(
        result,
        steps=(*steps, *result.steps),
        newton_iterations=coarse.newton_iterations + result.newton_iterations,
        factorisations=coarse.factorisations + result.factorisations,
    )


class Beginning:
    """Finds the state of a problem from the places where it may begin; counts the seconds of all attempts."""

    def __init__(
        self, problem: ShellProblem, options: ShellOptions, say: Say, folder: Path | None, processes: str
    ) -> None:
        self.problem, self.options, self.say, self.folder, self.processes = problem, options, say, folder, processes
        self.spent = {"import": 0.0, "compile": 0.0, "total": 0.0}
        self.notes: dict[str, Any] = {}
        self.solves = 0
        # what an unstable band is left for passes through itself: it stays
        self.kick = options.kick and abs(problem.half_turns or 0) <= MOST_STABLE
        self.meshes = [] if options.switch else coarse_meshes(problem.elements)

    def solve(
        self,
        start: ShellSurface | None = None,
        folder: Path | None = None,
        problem: ShellProblem | None = None,
        **changes: Any,
    ) -> ShellResult:
        """A solve of the problem, or another one, with changed options."""
        from shellref.path.solve import solve

        chosen = dataclasses.replace(self.options, **{"kick": self.kick, **changes})
        result = solve(problem or self.problem, chosen, self.say, start=start, processes=self.processes, folder=folder)
        for name in self.spent:
            self.spent[name] += result.seconds[name]
        self.solves += 1
        return result

    def find(self, start: ShellSurface | None) -> Begun:
        """The state: from the given start, from a coarse path, by the path."""
        begin, first = self.options.begin, None
        released = self.problem.partly_held
        if abs(self.problem.half_turns or 0) > 1:  # half turns say which of several states is asked for, stable or not
            begin = "given"
        if (self.problem.half_turns or released) and begin == "checked":  # its own beginning selects no state
            begin = "stable"
        if begin == "checked" and not self.meshes:  # nothing to check by: the mesh is coarse enough for its own path
            start = None
        none = "path" if start is None else PATH_AGAIN[begin == "given"]
        if self.folder is not None and (self.folder / "checkpoint.npz").exists():  # an interrupted walk goes on
            return self.walk(none)
        if start is not None and begin == "given":
            result, how = self.given(start)
            if result is not None and self.is_turned(result):
                return Begun(result, how, self.notes)
        elif start is not None and begin == "stable":
            first = self.settled(start)
            if first is not None:
                return Begun(first, "given", self.notes)
        checked = start is not None and begin == "checked"
        while (self.options.coarse or checked) and not (self.problem.half_turns or released):
            coarse = self.next_coarse()
            if coarse is None:
                break
            if checked and first is None:  # only now: without a coarse path there is nothing to check by
                first = self.settled(start)
                checked = first is not None
            if first is not None and self.agrees(first, coarse):
                return Begun(first, "given, as the coarse path", self.notes)
            if self.options.coarse:
                result = self.settled(coarse.result.surface)
                if result is not None and self.agrees(result, coarse):
                    return Begun(_after(coarse.result, result), "coarse path", self.notes)
        return self.walk(none)

    def walk(self, how: str) -> Begun:
        """The path on the mesh itself; of a band with half turns from where it is closed."""
        if self.solves:
            self.say({"event": "path"})
        if self.problem.partly_held:
            return self.released(how)
        if self.problem.half_turns:
            return self.turned(how)
        return Begun(self.solve(folder=self.folder), how, self.notes)

    def released(self, how: str) -> Begun:
        """The strip near the one whose ends are held as a whole, see shellref.band.held."""
        from shellref.band.held import swung, whole

        first = self.problem
        held = whole(first)
        if held is None:  # it is held well enough for its own path
            return Begun(self.solve(folder=self.folder), how, self.notes)
        self.problem = held
        try:
            clamped = self.turned(how).result if held.half_turns else self.solve(accuracy=None, stability=False)
        finally:
            self.problem = first
        start = swung(first, clamped.surface)
        found, _ = self.given(start)
        if found is None:
            found = self.solve(start)
        return Begun(_after(clamped, found), how, self.notes)

    def turned(self, how: str) -> Begun:
        """The band near the open strip whose end was turned, or near the twisted circle, see shellref.band.start."""
        from shellref.band.start import laid, opened, twisted

        found: ShellResult | None = None
        several = abs(self.problem.half_turns or 0)
        if several > 1:
            start = laid(self.problem, twisted(self.problem))
            found, _ = self.given(start)
            if several > MOST_STABLE:
                found = self.solve(start, accuracy=None) if found is None else found
        if found is None:
            problem = opened(self.problem)
            self.say({"event": "coarse", "elements": list(problem.elements)})
            open_strip = self.solve(problem=problem, accuracy=None, stability=False)
            start = laid(self.problem, open_strip.surface)
            found, _ = self.given(start)
            if found is None:
                found = self.solve(start)
            found = _after(open_strip, found)
        return Begun(found, how, self.notes)

    def is_turned(self, result: ShellResult) -> bool:
        """Whether a band has the half turns that it is joined after; any other strip."""
        asked = self.problem.half_turns
        if asked is None or abs(asked) <= 1:
            return True
        found = half_turns(result.surface, self.problem.width, asked)
        if round(abs(found)) != abs(asked):
            self.refuse(f"it has {abs(found):.0f} half turns")
            return False
        return True

    def settled(self, start: ShellSurface | None) -> ShellResult | None:
        """The stable state where Newton's iteration from a surface settles without a kick; None: there is none."""
        result = self.solve(start, kick=False, accuracy=None)
        if result.status is not ShellStatus.CONVERGED or not self.stands(result):
            self.refuse(f"{result.status.value}: {result.message}")
            return None
        if self.options.accuracy is not None:
            result = self.solve(result.surface)
        return dataclasses.replace(result, options=self.options)

    def stands(self, result: ShellResult) -> bool:
        """Whether a state is stable; of a strip under a moment, whose stability is not asked, whether it may be."""
        return result.stable is True or (self.problem.twisted and result.stable is None)

    def next_coarse(self) -> Coarse | None:
        """The end of the path on the next coarse mesh where there is one to believe; None: no mesh is left."""
        while self.meshes:
            problem = dataclasses.replace(self.problem, elements=self.meshes.pop(0))
            self.say({"event": "coarse", "elements": list(problem.elements)})
            try:
                result = self.solve(problem=problem, accuracy=None)
            except ShellInputError as error:  # e.g. corners of a size that the coarse mesh cannot have
                self.refuse(str(error))
                continue
            if any(step.method == "relax" for step in result.steps):
                self.refuse(f"coarse path {problem.elements}: it left an unstable state")
            elif result.status is not ShellStatus.CONVERGED or not self.stands(result):
                self.refuse(f"coarse path {problem.elements}: {result.status.value}: {result.message}")
            else:
                return Coarse(problem, result)
        return None

    def agrees(self, result: ShellResult, coarse: Coarse) -> bool:
        """Whether the state, interpolated to the coarse mesh, settles in the very state of the coarse path."""
        from shellref.path.adaptive import gap

        far = gap(result.surface, coarse.result.surface)
        back = self.solve(result.surface, problem=coarse.problem, stability=False, accuracy=None)
        same = back.status is ShellStatus.CONVERGED and gap(back.surface, coarse.result.surface) <= SAME
        if not same or far > FAR:
            self.refuse(f"{far:.2g} l from the coarse path's state {coarse.problem.elements}")
            return False
        self.notes.update(coarse=list(coarse.problem.elements), gap=far)
        return True

    def refuse(self, why: str) -> None:
        """Note why a beginning is not believed."""
        self.notes.setdefault("refused", []).append(why)

    def given(self, start: ShellSurface) -> tuple[ShellResult | None, str]:
        """The state near a start, by way of thicker strips where it is too far for this one; None: there is none."""
        problem = self.problem

        def settled(thickness: float, near: ShellSurface) -> ShellResult:
            if thickness == problem.thickness:
                return self.solve(near)
            return self.solve(near, problem=dataclasses.replace(problem, thickness=thickness), accuracy=None)

        result = settled(problem.thickness, start)
        count, thickness, how = 1, problem.thickness, "given"
        while result.status is ShellStatus.NOT_CONVERGED and count < MOST_SOLVES:
            how = "given, by way of thicker strips"
            thickness *= THICKER
            if thickness >= 0.5 * problem.width:
                break
            self.say({"event": "thicker", "width_to_thickness": problem.width / thickness})
            result = settled(thickness, start)
            count += 1
        factor = THICKER
        while result.status is not ShellStatus.NOT_CONVERGED and thickness > problem.thickness and count < MOST_SOLVES:
            near, thinner = result.surface, max(problem.thickness, thickness / factor)
            self.say({"event": "thinner", "width_to_thickness": problem.width / thinner})
            attempt = settled(thinner, near)
            count += 1
            if attempt.status is ShellStatus.NOT_CONVERGED:
                factor = math.sqrt(factor)
            else:
                result, thickness = attempt, thinner
        if thickness == problem.thickness and result.status is not ShellStatus.NOT_CONVERGED:
            return result, how
        return None, how


def begun(
    problem: ShellProblem,
    options: ShellOptions,
    say: Say,
    start: ShellSurface | None = None,
    folder: Path | None = None,
    processes: str = "self",
) -> Begun:
    """The state of a problem, and how it was begun; the seconds of the result are those of all attempts.

    `folder`: for the checkpoints of the path on the mesh itself; a walk that was interrupted there goes on.
    """
    beginning = Beginning(problem, options, say, folder, processes)
    found = beginning.find(start)
    result = found.result.with_seconds({**found.result.seconds, **beginning.spent})
    if options.kick and not beginning.kick and result.status is ShellStatus.UNSTABLE:
        text = f"unstable equilibrium, {result.negative_eigenvalues or 'some'} negative eigenvalue(s), kept"
        result = dataclasses.replace(result, message=text)
    return Begun(result, found.how, found.notes)
