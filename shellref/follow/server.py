"""A shell's equations in a process of their own:  python -m shellref.follow.server

Reads messages (`ribbonbench.messages`) on the standard input and answers each on the standard output, until that ends:

    open       problem, options, refine -> number (of the system), size, nodes, degree, noise, unknowns; arrays s_nodes,
               v_nodes, weights (size,), held (rows, columns, 6)
    begin      system, problem, own, u (rows, columns, 6) -> z with the stress of u, or (own false) without any
    residual   system, problem, z (size,) -> what vanishes (size,)
    factor     system, problem, z (size,) -> unstable; what is solved from then on is of this tangent
    solve      system, transposed, b (k, size) -> x (k, size)
    stepped    system, z, dz -> z
    energy     system, problem, z -> energy

problem: fields of ShellProblem; null: that of the last message. Answers: {"ok": true, ...}, or {"ok": false, "word",
"text"}: "request" for what cannot be, "none" for what has no finite answer, "missing" without dolfinx.
"""

from __future__ import annotations

import os
import sys
from typing import IO, Any

import numpy as np

from ribbonbench.messages import receive, send
from shellref.inputs import ShellInputError
from shellref.shell.options import ShellOptions
from shellref.shell.problem import ShellProblem

Answer = tuple[dict[str, Any], tuple[np.ndarray, ...]]


class Server:
    """The systems that were opened."""

    def __init__(self) -> None:
        from shellref.follow.equations import Equations

        self._make = Equations
        self.systems: list[Equations] = []

    def answer(self, head: dict[str, Any], arrays: list[np.ndarray]) -> Answer:
        """The answer to one message. ShellInputError, ArithmeticError."""
        if head["do"] == "open":
            refine = (int(head["refine"][0]), int(head["refine"][1]))
            made = self._make(ShellProblem.from_dict(head["problem"]), ShellOptions.from_dict(head["options"]), refine)
            self.systems.append(made)
            told = {"number": len(self.systems) - 1, **made.described()}
            return told, (made.grid.s_nodes, made.grid.v_nodes, made.weights(), made.held_rows())
        one = self.systems[int(head["system"])]
        if head.get("problem") is not None:
            one.set_problem(ShellProblem.from_dict(head["problem"]))
        if head["do"] == "begin":
            z = one.at_rest(arrays[0])
            return {}, (one.own(z) if head["own"] else z,)
        if head["do"] == "residual":
            return {}, (one.residual(arrays[0]),)
        if head["do"] == "factor":
            return {"unstable": one.factor(arrays[0])}, ()
        if head["do"] == "solve":
            solve = one.solve_transposed if head["transposed"] else one.solve
            return {}, (np.array([solve(b) for b in arrays[0]]),)
        if head["do"] == "stepped":
            return {}, (one.stepped(arrays[0], arrays[1]),)
        if head["do"] == "energy":
            return {"energy": one.energy(arrays[0])}, ()
        raise ShellInputError("do", head["do"], "is nothing that a shell can be asked")


def serve(incoming: IO[bytes], outgoing: IO[bytes]) -> None:
    """Answers until nothing more comes."""
    server: Server | None = None
    while True:
        try:
            head, arrays = receive(incoming)
        except EOFError:
            return
        try:
            server = Server() if server is None else server
            told, found = server.answer(head, arrays)
            send(outgoing, {"ok": True, **told}, *found)
        except ShellInputError as error:
            send(outgoing, {"ok": False, "word": "request", "key": error.key, "text": str(error)})
        except ImportError as error:
            send(outgoing, {"ok": False, "word": "missing", "text": str(error)})
        except (ArithmeticError, np.linalg.LinAlgError) as error:
            send(outgoing, {"ok": False, "word": "none", "text": str(error)})


def main() -> int:
    """Entry point: what libraries print goes to the standard error."""
    outgoing = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    serve(sys.stdin.buffer, outgoing)
    return 0


if __name__ == "__main__":
    sys.exit(main())
