"""Peers that solve other problems than the coils: rods at rest (PyElastica), a strip shifted sideways (DER-JAX)."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from types import ModuleType

import numpy as np

from compare.store.store import atomic_write_text
from tests.peers import der, elastica
from tests.peers.cases import Run
from tests.validation import one_core, page

#: Word of the command -> what is run.
PARTS: dict[str, ModuleType] = {"pyelastica": elastica, "der": der}
TITLES = {
    "pyelastica": "Rods at rest",
    "der": "A strip shifted sideways",
}
WORDS = {
    "pyelastica": "PyElastica's rod is dynamic: released in its natural shape under its weight and damped, stretching "
    "and shear as soft as the error allows, the longest stable step, the first moment after which the free end stays "
    "within the error. Ours: `ribbon.solve`, energy kirchhoff, warm, with its stability check. 1e-6 l was not asked of "
    "it: from 1e-3 to 1e-4 its time grows 17 to 20 times.",
    "der": "The example of DER-JAX as it is (w/l = 1/12, h = l/100; 2.5 s to bring the clamps together, 5 s forth, 5 s "
    "back), its configuration changed only so that its energy is one of ours. Error, of the rod: largest difference of "
    "the middle's height to its own limit (edges half as long, second order), over the length of what is free, at "
    "shifts no nearer than 0.03 to where the arch gives way or comes to lie flat; the other energies' own limits are "
    "not computed. Ours: `ribbon.follow` forth and back between the same clamps, unstable states left, as few segments "
    "as are within the rod's error of their own limit (p = 160); `wide steps`: a third of these shifts. "
    "Compiling is not counted. The two codes' limits differ by the example's stretching and, of Sano's strip, its "
    "bending in the plane: as h^2 (`tests/peers/test_further.py`). Left out are its Sadowsky, which has no value where "
    "the arch's curvature passes zero and its twist does not (its nodes step over that place; with an integral that "
    "does not, ours is infinite), and its Wunderlich: its stepper calls that energy without the ruling's slope, which "
    "leaves it without torsion.",
}
HEADS = ["part", "case", "peer", "settings", "error", "cpu_s"]

Found = dict[str, dict[str, dict[str, Run]]]
"""Part -> case -> peer -> its run."""


def measure(words: list[str], out: Path) -> None:
    """The parts named, or all, and of a part the names among the words, or all; kept in `out`/peers_further.csv beside
    those that are not new."""
    for part, peer in PARTS.items():
        if words and part not in words:
            continue
        if (why := peer.absent()) is not None:
            print(f"  {part} stays as it is: {why}", flush=True)
            continue
        for name in [name for name in peer.names() if name in words] or peer.names():
            before = kept(out).get(part, {})
            keep(out, {part: before | one_core.call(peer.measured, name, before)})


def kept(out: Path) -> Found:
    """What `out`/peers_further.csv holds."""
    path, found = out / "peers_further.csv", Found()
    if path.exists():
        with path.open(newline="") as lines:
            for part, case, name, settings, error, seconds in list(csv.reader(lines))[1:]:
                run = Run(settings, float(error), float(seconds))
                found.setdefault(part, {}).setdefault(case, {})[name] = run
    return found


def keep(out: Path, new: Found) -> None:
    """`new` in place of those parts."""
    found, text = kept(out) | new, io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(HEADS)
    for part in PARTS:
        for case, runs in found.get(part, {}).items():
            for name, run in runs.items():
                writer.writerow([part, case, name, run.settings, f"{run.error:.3e}", f"{run.seconds:.4g}"])
    atomic_write_text(out / "peers_further.csv", text.getvalue())


def table(runs: dict[str, dict[str, Run]], peer: str) -> str:
    """Case by case the peer, ours, and how many times ours is faster."""
    rows = []
    for case, by_name in runs.items():
        ours = next((run for name, run in by_name.items() if name != peer), None)
        for name, run in by_name.items():
            error = f"{run.error:.1e}" if np.isfinite(run.error) else "-"
            ratio = "" if ours is None or run is ours else f"{run.seconds / ours.seconds:.2g}"
            rows.append([case, name, run.settings, error, f"{run.seconds:.3g}", ratio])
    return page.table(["case", "solver", "settings", "error / l", "CPU s", "over ours"], rows)


def parts(out: Path) -> list[str]:
    """Sections of the page, in the order of `PARTS`."""
    found, lines = kept(out), []
    for part, peer in PARTS.items():
        why = peer.absent()
        state = peer.version() if why is None else f"{peer.NAME} was not here when this page was written: {why}"
        remade = f"Alone: `python -m tests.peers {part}`. {state}."
        lines += [f"## {TITLES[part]}", WORDS[part], remade]
        lines.append(table(found[part], peer.NAME) if part in found else "Not measured yet.")
    return lines
