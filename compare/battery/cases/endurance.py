"""Thousands of solves in one process."""

from __future__ import annotations

import gc
import os
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from compare.battery.case import Case, Check, Rung, holds

#: Shipped scenes, one after another: chained and mixed, one end and both, closed; few elements.
SCENES = ("coil_10_100", "curl_4_3", "two_clamps_5_3_2", "moebius_6_1", "cantilever")
#: kB of memory by which a solve may grow the process, on and on: a kept problem of six elements would be some 20 kB.
GROWTH = 2.0
#: The same where so few solves are counted that one page of the allocator is seen.
GROWTH_OF_FEW = 50.0
FEW = 500


def _resident() -> float:
    """Memory of this process that is in use, kB."""
    gc.collect()
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1024.0


def _descriptors() -> int:
    return len(os.listdir("/proc/self/fd"))


def _grown(count: int, do: Callable[[int], object], before: int) -> Iterator[Check]:
    """Memory and descriptors while `do` is called so often, after `before` calls that load and compile."""
    for number in range(before):
        do(number)
    opened = _descriptors()
    at, sizes = [0], [_resident()]
    for number in range(count):
        do(number)
        if (number + 1) % max(1, count // 20) == 0:
            at.append(number + 1)
            sizes.append(_resident())
    slope = float(np.polyfit(at[len(at) // 4 :], sizes[len(at) // 4 :], 1)[0])
    text = f"{sizes[0] / 1024:.0f} MB at first, {sizes[-1] / 1024:.0f} MB at last"
    yield Check("growth by a call (kB)", slope, GROWTH if count >= FEW else GROWTH_OF_FEW, said=text)
    yield Check("descriptors left open", float(_descriptors() - opened), 0.0)


def solves(rung: Rung) -> Iterator[Check]:
    """Ribbons, one after another."""
    from compare.models.base import Options
    from compare.models.choice import chosen
    from compare.scene.scene import load

    scenes = [load(name).replace({"model.elements": 6, "path": None}) for name in SCENES]
    ends: dict[str, set[str]] = {}

    def do(number: int) -> None:
        scene = scenes[number % len(scenes)]
        state = chosen(scene).solve(scene, options=Options())
        ends.setdefault(scene.name, set()).add(f"{state.status.code} {state.energy and state.energy.total:.9g}")

    yield from _grown(int(rung), do, 2 * len(scenes))
    many = {name: sorted(found) for name, found in ends.items() if len(found) > 1}
    yield holds("every solve of a scene ends as its first", not many, str(many)[:500])


def workers(rung: Rung) -> Iterator[Check]:
    """Shells in processes of their own, one after another."""
    from compare.models.shell_process import run_shell, shell_problem
    from compare.scene.scene import load
    from compare.store.store import CaseStore

    scene = load("cantilever").replace({"shell.elements": [8, 1], "shell.width_to_thickness": [10.0]})
    with tempfile.TemporaryDirectory() as folder:
        store = CaseStore(folder)
        ends: list[str] = []

        def do(number: int) -> None:
            changed = scene.replace({"strip.gamma": 1.0 + 0.01 * len(ends)})
            ends.append(run_shell(shell_problem(changed, 10.0), store).status)

        yield from _grown(int(rung), do, 1)
        yield holds("all converged", set(ends) == {"converged"}, str(sorted(set(ends))))


CASES: tuple[Case, ...] = (
    Case(
        "endurance/solves",
        "so many ribbons in one process: chained, mixed, held at both ends, closed",
        "flat memory and descriptors, and the same state each time: nothing of a solve is kept",
        "solves",
        solves,
        (60,),
        (2000,),
    ),
    Case(
        "endurance/workers",
        "so many shells in processes of their own, one soon after another",
        "flat memory and descriptors of the process that asks for them",
        "shells",
        workers,
        (),
        (20,),
    ),
)
