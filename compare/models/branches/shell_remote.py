"""The shell's equations in the process that has them (`shellref.follow.server`), as a system that a branch is followed
of. The rule: a shell and a ribbon are never solved in one process (docs/design.md)."""

from __future__ import annotations

import contextlib
import dataclasses
import os
import subprocess
import sys
import tempfile
import weakref
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from compare.continuation.system import Unbounded, rate_by_differences
from ribbonbench import system
from ribbonbench.errors import BadInput, Missing
from ribbonbench.messages import receive, send
from ribbonbench.start import THREADS
from shellref.shell.options import ShellOptions
from shellref.shell.problem import ShellProblem
from shellref.shell.surface import ShellSurface

FloatArray = NDArray[np.float64]
#: t, without unit -> the problem there; ValueError where there is none.
ProblemAt = Callable[[float], ShellProblem]

SERVER = "shellref.follow.server"
#: Residual, over what rounding leaves (`shellref.follow.equations.Equations.noise`), that has norm 1.
_NOISE = 3e10
#: Bytes that wait in a pipe (Linux; elsewhere the system's own).
_PIPE = 1 << 20
#: Problems kept.
_KEPT = 16


class Refused(ArithmeticError):
    """The shell has no answer there."""


class ShellServer:
    """A process with shells in it; ended with this object. BadInput, Missing."""

    def __init__(self, options: ShellOptions) -> None:
        self.options = options
        environment = {THREADS[0]: "1", **os.environ}
        root = str(Path(__file__).resolve().parents[3])
        environment["PYTHONPATH"] = os.pathsep.join(p for p in (root, os.environ.get("PYTHONPATH", "")) if p)
        self._errors: IO[str] = tempfile.TemporaryFile("w+")  # noqa: SIM115  it lives as long as the process
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "ribbonbench.start", str(os.getpid()), SERVER],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._errors, env=environment,
            start_new_session=True, pipesize=_PIPE,
        )  # fmt: skip
        self._end = weakref.finalize(self, _ended, self._process)
        self._told: dict[int, ShellProblem] = {}
        #: The factored tangent that it has: of which system, z and problem; None: none.
        self.factored: object = None

    def ask(self, head: dict[str, Any], *arrays: FloatArray) -> tuple[dict[str, Any], list[FloatArray]]:
        """Its answer. Refused where it has none; BadInput for what cannot be; Missing without dolfinx."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        try:
            send(self._process.stdin, head, *arrays)
            told, found = receive(self._process.stdout)
        except (EOFError, BrokenPipeError):
            self._process.wait()
            self._errors.seek(0)
            last = [text.strip() for text in self._errors.read().splitlines() if text.strip()][-1:]
            raise ChildProcessError(f"the shell's process ended: {last[0] if last else 'no message'}") from None
        if told["ok"]:
            return told, found
        if told["word"] == "missing":
            raise Missing.of(told["text"])
        if told["word"] == "request":
            raise BadInput("--model", "shell", told["text"], "follow another model")
        raise Refused(told["text"])

    def ask_at(
        self, system_number: int, problem: ShellProblem, do: str, *arrays: FloatArray, **more: Any
    ) -> tuple[dict[str, Any], list[FloatArray]]:
        """As `ask`, of a system with a problem, which is told where it is another one."""
        known = self._told.get(system_number) == problem
        head = {"do": do, "system": system_number, "problem": None if known else problem.to_dict(), **more}
        if not known:
            self._told.pop(system_number, None)
        found = self.ask(head, *arrays)
        self._told[system_number] = problem
        return found


def _ended(process: subprocess.Popen[bytes]) -> None:
    for pipe in (process.stdin, process.stdout):
        if pipe is not None:
            with contextlib.suppress(OSError):
                pipe.close()
    try:
        process.wait(timeout=1.0)
    except subprocess.TimeoutExpired:
        system.end_tree(process)
        process.wait()


@dataclass(frozen=True)
class Factored:
    """The tangent at (z, t), factored where the shell is; made again where another one has been since."""

    of: ShellEquations
    z: FloatArray
    t: float
    unstable: int

    def _solved(self, b: FloatArray, transposed: bool) -> FloatArray:
        server = self.of.server
        if server.factored is not self:
            server.ask_at(self.of.number, self.of.problem(self.t), "factor", self.z)
            server.factored = self
        right = b[None] if b.ndim == 1 else np.ascontiguousarray(b.T)
        try:
            _, (x,) = server.ask({"do": "solve", "system": self.of.number, "transposed": transposed}, right)
        except Refused:
            return np.full_like(b, np.nan)
        return x[0] if b.ndim == 1 else x.T

    def solve(self, b: FloatArray) -> FloatArray:
        """K^-1 b."""
        return self._solved(b, False)

    def solve_transposed(self, b: FloatArray) -> FloatArray:
        """K^-T b."""
        return self._solved(b, True)


@dataclass(frozen=True, eq=False)
class ShellEquations(Unbounded):
    """problem_at: t -> the shell there, on one mesh of which every element is cut in `refine` (each way);
    constant_at: t -> what its energies leave out.

    z: positions and directors at the nodes of the grid (rows, columns, 6), then stresses (shellref.follow.equations).
    """

    problem_at: ProblemAt
    server: ShellServer = field(repr=False)
    constant_at: Callable[[float], float] = field(default=lambda t: 0.0, repr=False)
    refine: int = 1

    @cached_property
    def _opened(self) -> tuple[dict[str, Any], list[FloatArray]]:
        return self.server.ask({
            "do": "open", "problem": self.problem_at(0.0).to_dict(), "options": self.server.options.to_dict(),
            "refine": [self.refine, self.refine],
        })  # fmt: skip

    @cached_property
    def _problems(self) -> dict[float, ShellProblem]:
        return {}

    def problem(self, t: float) -> ShellProblem:
        """At t. ValueError where there is none."""
        kept = self._problems
        if t not in kept:
            while len(kept) >= _KEPT:
                del kept[next(iter(kept))]
            kept[t] = self.problem_at(t)
        return kept[t]

    @property
    def number(self) -> int:
        """Of the system, in its process."""
        return int(self._opened[0]["number"])

    @property
    def size(self) -> int:
        """Numbers of nodes and Gauss points."""
        return int(self._opened[0]["size"])

    @property
    def _shape(self) -> tuple[int, int, int]:
        rows, columns = self._opened[0]["nodes"]
        return int(rows), int(columns), 6

    def _nodal(self, z: FloatArray) -> FloatArray:
        """(rows, columns, 6)."""
        return z[: int(np.prod(self._shape))].reshape(self._shape)

    def residual(self, z: FloatArray, t: float) -> FloatArray:
        """What vanishes (n,); nan where the scene cannot be."""
        try:
            _, (found,) = self.server.ask_at(self.number, self.problem(t), "residual", z)
        except (ValueError, BadInput, Refused):
            return np.full(self.size, np.nan)
        return found

    def norm(self, residual: FloatArray) -> float:
        """The largest of what is out of balance, 3e-11 being what rounding leaves, of what clamps miss (l, rad), and of
        the membrane strain by which stresses miss."""
        nodal, stress = np.split(residual, [int(np.prod(self._shape))])
        held = self._opened[1][3].ravel()
        noise = float(self._opened[0]["noise"])
        missed = self.problem_at(0.0).thickness ** 2 / 12.0 * float(np.abs(stress).max())
        size = max(
            float(np.linalg.norm((1.0 - held) * nodal)) / (_NOISE * noise), missed, float(np.abs(held * nodal).max())
        )
        return size if np.all(np.isfinite(residual)) else np.inf

    def rate(self, z: FloatArray, t: float) -> FloatArray:
        """dG/dt by differences."""
        return rate_by_differences(self.residual, z, t)

    def factor(self, z: FloatArray, t: float) -> Factored | None:
        """The tangent, factored."""
        try:
            told, _ = self.server.ask_at(self.number, self.problem(t), "factor", z)
        except (ValueError, BadInput, Refused):
            self.server.factored = None
            return None
        made = Factored(self, z, t, int(told["unstable"]))
        self.server.factored = made
        return made

    def mass(self, v: FloatArray) -> FloatArray:
        """Mean over the surface of products of positions; what clamps hold does not count."""
        return np.asarray(self._opened[1][2] * v)

    def stepped(self, z: FloatArray, dz: FloatArray) -> FloatArray:
        """z + dz, directors of unit length."""
        moved = z + dz
        directors = self._nodal(moved)[..., 3:]
        directors /= np.linalg.norm(directors, axis=-1, keepdims=True)
        return moved

    @cached_property
    def _half(self) -> ShellEquations:
        return ShellEquations(self.problem_at, self.server, self.constant_at, 2 * self.refine)

    def finer(self, z: FloatArray, t: float, directions: FloatArray) -> tuple[ShellEquations, FloatArray, FloatArray]:
        """Every element cut in two each way: the same surface, and no stress, as the membrane's of an interpolated thin
        shell would be wrong by far."""
        new = self._half
        s, v = new._opened[1][:2]

        def carried(w: FloatArray) -> FloatArray:
            u = self._nodal(w)
            rows, columns = self._opened[1][:2]
            whole = ShellSurface(rows, columns, u[..., :3], u[..., 3:], int(self._opened[0]["degree"]))
            turned = dataclasses.replace(whole, points=whole.directors)
            return np.concatenate([whole.grid(s, v), turned.grid(s, v)], axis=-1)

        place = carried(z)
        place[..., 3:] /= np.linalg.norm(place[..., 3:], axis=-1, keepdims=True)
        begun = new.begun(place, t, own=False)
        many = np.zeros((begun.size, directions.shape[1]))
        for k in range(directions.shape[1]):
            many[: place.size, k] = carried(directions[:, k]).ravel()
        return new, begun, many

    def begun(self, place: FloatArray, t: float, own: bool = True) -> FloatArray:
        """z of positions and directors (rows, columns, 6), with the stress that belongs to them or without."""
        _, (z,) = self.server.ask_at(self.number, self.problem(t), "begin", place, own=own)
        return z

    def surface(self, z: FloatArray) -> ShellSurface:
        """The deformed surface."""
        s, v = self._opened[1][:2]
        u = self._nodal(z)
        directors = u[..., 3:] / np.linalg.norm(u[..., 3:], axis=-1, keepdims=True)
        return ShellSurface(s, v, u[..., :3].copy(), directors, int(self._opened[0]["degree"]))

    def energy(self, z: FloatArray, t: float) -> float:
        """Total energy less that of the natural curvature, D w / l."""
        told, _ = self.server.ask_at(self.number, self.problem(t), "energy", z)
        return float(told["energy"]) - self.constant_at(t)
