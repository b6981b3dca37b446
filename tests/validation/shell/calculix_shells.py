"""CalculiX (S8R) as a third opinion: a ring between planes and the slit annular plate, beside our shell."""

from __future__ import annotations

import json
import tempfile
from functools import cache
from pathlib import Path

from tests.reference import calculix, sze2004
from tests.reference.calculix_surfaces import Ring, ring, slit_annulus
from tests.reference.squeezed_ring import squeezed
from tests.validation import page
from tests.validation.number import Number
from tests.validation.pieces import Pieces

#: Gaps over l and elements around of the ring (two across); meshes of the plate.
GAPS, ALONG = (0.28, 0.24, 0.2), (20, 40)
PLATES = ((12, 2), (20, 3), (30, 4))
#: Ours, of the same benchmarks, as their pages have it: elements around of the ring, two across.
READS = ("data/shell_walls.json", "data/rest_shapes.json")
OURS = (20, 40, 80)


def absent() -> str | None:
    """Why the page cannot be made here."""
    return None if calculix.available() else "CalculiX (Debian: calculix-ccx)"


def ours(out: Path, name: str) -> dict[str, Number]:
    """The numbers of another page."""
    found = json.loads((out / "data" / f"{name}.json").read_text())["numbers"]
    return {key: Number(one["value"], one["error"], why=one.get("why", "")) for key, one in found.items()}


@cache
def ring_there(gap: float, along: int) -> Ring:
    """CalculiX's ring."""
    with tempfile.TemporaryDirectory() as folder:
        return ring(gap, (along, 2), Path(folder))


def plate_there(mesh: tuple[int, int]) -> tuple[float, float]:
    """CalculiX's plate."""
    with tempfile.TemporaryDirectory() as folder:
        return slit_annulus(mesh, Path(folder))


PROBES = {
    "force_28_20": lambda: ring_there(0.28, 20).force / squeezed(0.28).force - 1.0,
    "energy_28_20": lambda: ring_there(0.28, 20).energy / squeezed(0.28).energy - 1.0,
}


def rings(kept: Pieces, out: Path, numbers: dict[str, Number]) -> list[str]:
    """Both shells and the elastica."""
    rows, shell = [], ours(out, "shell_walls")
    for gap in GAPS:
        known, name = squeezed(gap), f"{100.0 * gap:.0f}"
        there = {
            n: Ring(**kept.get(f"ring_{name}_{n}", lambda gap=gap, n=n: ring_there(gap, n)._asdict())) for n in ALONG
        }
        off = {n: (one.force / known.force - 1.0, one.energy / known.energy - 1.0) for n, one in there.items()}
        change = [abs(a - b) for a, b in zip(off[ALONG[0]], off[ALONG[1]], strict=True)]
        mine = {n: (shell[f"force_{name}_{n}"].value, shell[f"energy_{name}_{n}"].value) for n in OURS}
        for n, (force, energy) in off.items():
            numbers[f"force_{name}_{n}"] = Number(force, change[0], "", "+.1e")
            numbers[f"energy_{name}_{n}"] = Number(energy, change[1], "", "+.1e")
            one = there[n]
            rows.append([f"{gap:g}", f"CalculiX {n} x 2", f"{one.force:.4f}", f"{force:+.1e}", f"{one.energy:.4f}",
                         f"{energy:+.1e}", f"{one.flat:.4f}", f"{one.pull:.0e}"])  # fmt: skip
        for n, (force, energy) in mine.items():
            rows.append([f"{gap:g}", f"ours {n} x 2", f"{known.force * (1.0 + force):.4f}", f"{force:+.1e}",
                         f"{known.energy * (1.0 + energy):.4f}", f"{energy:+.1e}", "", ""])  # fmt: skip
        rows.append([f"{gap:g}", "elastica", f"{known.force:.4f}", "", f"{known.energy:.4f}", "",
                     f"{known.flat:.4f}", ""])  # fmt: skip
        for k, of in enumerate(("force", "energy")):
            apart = off[ALONG[-1]][k] - mine[OURS[-1]][k]
            numbers[f"apart_{of}_{name}"] = Number(apart, change[k], "", "+.1e")
    return [
        "## A ring between two planes",
        "nu = 0, w/l = 0.1, h/l = 5e-4; ours from [walls](shell_walls.md). CalculiX's circle is without stress: 2 pi^2 "
        "is added to its energy, the work of the planes. Contact there by prescribed heights: the lines of "
        "the middle surface that are on a plane, symmetric about the lowest and the highest, as few as keep all nodes "
        "between the planes (an active set by hand). off: of the elastica by shooting "
        "(tests/reference/squeezed_ring.py). a: half length on a plane. pull: largest force of a line that pulls, over "
        "the whole.",
        page.table(["H", "shell", "force", "off", "energy", "off", "a", "pull"], rows),
        CONTACT,
    ]  # fmt: skip


#: What was seen of the program's own contact.
CONTACT = (
    "CalculiX's own contact (*CONTACT PAIR of the outer face with two stiff plates, linear pressure-overclosure) did "
    "not arrive on 40 x 1 elements at H = 0.28, tried by hand and not remade by this command: SURFACE TO SURFACE with "
    "1e8 D / l^4 came to 0.675 of the way and ended with '*ERROR: too many cutbacks', with 1e6 by the same words; NODE "
    "TO SURFACE with 1e6 and 1e7 ended with '*ERROR: increment size smaller than minimum'."
)


def plates(kept: Pieces, out: Path, numbers: dict[str, Number]) -> list[str]:
    """Both shells and the published table."""
    known, shell = sze2004.SLIT_ANNULUS.table[-1, 1:], ours(out, "rest_shapes")
    there = [kept.get(f"plate_{m[0]}x{m[1]}", lambda m=m: plate_there(m)) for m in PLATES]
    mine = [shell["slit_inner"], shell["slit_outer"]]
    rows = [
        [f"CalculiX {m[0]} x {m[1]}", *(f"{a:.3f}" for a in found),
         *(f"{100.0 * (a / b - 1.0):+.2f}" for a, b in zip(found, known, strict=True)),
         *(f"{100.0 * (a / b.value - 1.0):+.2f}" for a, b in zip(found, mine, strict=True))]
        for m, found in zip(PLATES, there, strict=True)
    ]  # fmt: skip
    rows.append(["ours, finest", *(f"{x.value:.3f}" for x in mine),
                 *(f"{100.0 * (x.value / b - 1.0):+.2f}" for x, b in zip(mine, known, strict=True)), "",
                 ""])  # fmt: skip
    for k, corner in enumerate(("inner", "outer")):
        last, error = there[-1][k], abs(there[-1][k] - there[-2][k])
        numbers[f"plate_{corner}"] = Number(last, error, "", ".3f")
        both = (error + (mine[k].error or 0.0)) / mine[k].value
        numbers[f"plate_{corner}_apart"] = Number(last / mine[k].value - 1.0, both, "", "+.2%")
    return [
        "## The slit annular plate",
        f"Sze, Liu and Lo 2004, ours from [rest shapes](rest_shapes.md): W_A = {known[0]:.3f} (inner corner), W_B = "
        f"{known[1]:.3f} (outer), by Abaqus S4R. From mesh to mesh CalculiX's last two are "
        f"{numbers['plate_inner'].error:.3f} and {numbers['plate_outer'].error:.3f} apart; ours "
        f"{mine[0].error:.3f} and {mine[1].error:.3f}.",
        page.table(["shell", "W_A", "W_B", "over Abaqus %", "%", "over ours %", "%"], rows),
    ]


def run(out: Path) -> dict[str, Number]:
    """results/calculix_shells.md."""
    numbers: dict[str, Number] = {}
    kept = Pieces("calculix_shells")
    parts = [*rings(kept, out, numbers), *plates(kept, out, numbers)]
    page.write(
        out / "calculix_shells.md", "CalculiX beside our shell", "python -m tests.validation calculix_shells",
        "CalculiX 2.20 (Debian: calculix-ccx; optional), S8R shells, which it expands to C3D20R solids, nonlinear "
        "static steps to a residual of 1e-5; decks by tests/reference/calculix_surfaces.py. Ours: Q2. Forces in D w / "
        "l^2, energies in D w / l, lengths in l; of the plate in the units of the benchmark.",
        *parts,
    )  # fmt: skip
    return numbers
