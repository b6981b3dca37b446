"""CalculiX as a third opinion: a ring between planes, a fold whose sides meet, the slit annular plate and a clamped
Moebius band, beside our shell, and the elastica where there is one."""

from __future__ import annotations

import json
import math
import tempfile
from functools import cache, partial
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np

from shellref import ShellOptions, ShellProblem
from shellref.path.begin import begun
from tests.reference import calculix, sze2004
from tests.reference.calculix_band import Band, moebius
from tests.reference.calculix_fold import Folded, fold
from tests.reference.calculix_surfaces import Ring, ring, slit_annulus
from tests.reference.squeezed_ring import squeezed
from tests.reference.touching_fold import Fold, folds
from tests.validation import page
from tests.validation.number import Number
from tests.validation.pieces import Pieces

#: Gaps over l of the ring (its contact spreads from 0.2285 on); elements around, two across.
GAPS = {0.28: (20, 40, 80), 0.24: (20, 40, 80), 0.2: (12, 20, 40)}
#: The mesh of the probes; elements around of our own ring, as its page has them.
PROBED, OURS = 12, (20, 40, 80)
#: Clamps of the fold and how far its sides are kept apart, l; elements along half of it, two across.
CLAMPS, APART, HALVES = (0.15, 0.12), (0.02, 0.0), (10, 20)
PLATES = ((12, 2), (20, 3), (30, 4))
#: The band's w/l, w/h, nu and meshes; of the shell that is beside it.
WIDTH, RATIO, POISSON = 0.1, 25.0, 0.3
BANDS, SHELLS = ((12, 2), (20, 2), (40, 4)), ((40, 4), (80, 8), (160, 12))
#: Ours, of the same benchmarks, as their pages have it.
READS = ("data/shell_walls.json", "data/shell_contact.json", "data/rest_shapes.json")
#: Places are written with six digits; another processor may change the last.
DIGITS = 1e-4


def absent() -> str | None:
    """Why the page cannot be made here."""
    return None if calculix.available() else "CalculiX (Debian: calculix-ccx)"


class Ours(NamedTuple):
    """A clamped band of our shell: elastic energy, D w / l; distance from the clamp to the point opposite, l."""

    energy: float
    across: float


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


def band_there(mesh: tuple[int, int]) -> Band:
    """CalculiX's band."""
    with tempfile.TemporaryDirectory() as folder:
        return moebius(WIDTH, WIDTH / RATIO, POISSON, mesh, Path(folder))


def band_here(mesh: tuple[int, int]) -> Ours:
    """Our shell's, whose clamp is at the origin."""
    problem = ShellProblem(
        WIDTH, WIDTH / RATIO, POISSON, half_turns=1, start_curvature=-2.0 * math.pi, elements=mesh, grading=(1.0, 1.0)
    )
    result = begun(problem, ShellOptions(), lambda event: None).result
    points = result.surface.points
    opposite = points[points.shape[0] // 2, points.shape[1] // 2]
    return Ours(float(result.energy["elastic"]), float(np.linalg.norm(opposite)))


@cache
def known_folds(apart: float) -> dict[float, Fold]:
    """Folds by shooting, by the distance of their clamps."""
    return dict(zip(CLAMPS, folds(np.array(CLAMPS), apart), strict=True))


def fold_there(distance: float, apart: float, along: int) -> Folded:
    """CalculiX's fold."""
    with tempfile.TemporaryDirectory() as folder:
        return fold(distance, apart, along, Path(folder))


def off(gap: float, along: int) -> tuple[float, float]:
    """Relative errors of CalculiX's force and energy against the elastica."""
    found, known = ring_there(gap, along), squeezed(gap)
    return found.force / known.force - 1.0, found.energy / known.energy - 1.0


PROBES = {
    f"force_28_{PROBED}": lambda: off(0.28, PROBED)[0],
    f"energy_28_{PROBED}": lambda: off(0.28, PROBED)[1],
}


def rings(kept: Pieces, out: Path, numbers: dict[str, Number]) -> list[str]:
    """Both shells and the elastica."""
    rows, shell = [], ours(out, "shell_walls")
    for of, value in zip(("force", "energy"), kept.get("probed", partial(off, 0.28, PROBED)), strict=True):
        numbers[f"{of}_28_{PROBED}"] = Number(value, DIGITS, "", "+.1e")
    for gap, along in GAPS.items():
        known, name = squeezed(gap), f"{100.0 * gap:.0f}"
        there = {n: Ring(*kept.get(f"ring_{name}_{n}", partial(ring_there, gap, n))) for n in along}
        found = {n: (one.force / known.force - 1.0, one.energy / known.energy - 1.0) for n, one in there.items()}
        for n, (force, energy) in found.items():
            before = along[1] if n == along[0] else along[along.index(n) - 1]
            changes = [abs(a - b) for a, b in zip(found[n], found[before], strict=True)]
            numbers[f"force_{name}_{n}"] = Number(force, changes[0], "", "+.1e")
            numbers[f"energy_{name}_{n}"] = Number(energy, changes[1], "", "+.1e")
            one = there[n]
            rows.append([f"{gap:g}", f"CalculiX {n} x 2", f"{one.force:.4f}", f"{force:+.1e}", f"{changes[0]:.0e}",
                         f"{one.energy:.4f}", f"{energy:+.1e}", f"{changes[1]:.0e}",
                         f"{one.flat:.4f}", str(one.solves)])  # fmt: skip
        for n in OURS:
            force, energy = shell[f"force_{name}_{n}"].value, shell[f"energy_{name}_{n}"].value
            rows.append([f"{gap:g}", f"ours {n} x 2", f"{known.force * (1.0 + force):.4f}", f"{force:+.1e}", "",
                         f"{known.energy * (1.0 + energy):.4f}", f"{energy:+.1e}", "", "", ""])  # fmt: skip
        rows.append([f"{gap:g}", "elastica", f"{known.force:.4f}", "", "", f"{known.energy:.4f}", "", "",
                     f"{known.flat:.4f}", ""])  # fmt: skip
    return [
        "## A ring between two planes",
        "nu = 0, w/l = 0.1, h/l = 5e-4; ours from [walls](shell_walls.md), the elastica by shooting "
        "(tests/reference/squeezed_ring.py). CalculiX's circle is without stress: 2 pi^2 is added to its energy, the "
        "work of the planes. Contact there by prescribed heights of whole lines of the middle surface, an active "
        "set that lets go what pulls and takes in what is deepest behind a plane, until neither is left; solves: "
        "equilibria it took. off: relative, of the elastica; change: from the mesh before (of the first: to the "
        "next). a: half the length between the outermost lines that touch. CalculiX's own contact pairs did not "
        "arrive (by hand: cut back to nothing). At H = 0.2 the set of lines goes round in a circle on 80 x 2 and is "
        "refused: no number stands for that mesh.",
        page.table(["H", "shell", "force", "off", "change", "energy", "off", "change", "a", "solves"], rows),
    ]  # fmt: skip


def touching(kept: Pieces, out: Path, numbers: dict[str, Number]) -> list[str]:
    """Both shells and the shooting."""
    rows, shell = [], ours(out, "shell_contact")
    for apart, distance in product(APART, CLAMPS):
        known, name = known_folds(apart)[distance], f"{100 * distance:.0f}_{100 * apart:.0f}"
        found = {n: Folded(*kept.get(f"fold_{name}_{n}", partial(fold_there, distance, apart, n))) for n in HALVES}
        parts = {n: (one.push / known.push - 1.0, one.energy / known.energy - 1.0) for n, one in found.items()}
        errors = [abs(a - b) for a, b in zip(*parts.values(), strict=True)]
        for n, (push, energy) in parts.items():
            numbers[f"fold_push_{name}_{n}"] = Number(push, errors[0], "", "+.1e")
            numbers[f"fold_energy_{name}_{n}"] = Number(energy, errors[1], "", "+.1e")
            one = found[n]
            rows.append([f"{distance:g}", f"{apart:g}", f"CalculiX {2 * n} x 2", f"{one.push:.3f}", f"{push:+.1e}",
                         f"{one.energy:.4f}", f"{energy:+.1e}", f"{one.place:.4f}", str(one.lines),
                         str(one.solves)])  # fmt: skip
        rows.append([f"{distance:g}", f"{apart:g}", "shooting", f"{known.push:.3f}", "", f"{known.energy:.4f}", "",
                     f"{known.s:.4f}", "1", ""])  # fmt: skip
    for of, shown in (("push", ".1%"), ("energy", ".0e")):
        each = [numbers[f"fold_{of}_{100 * d:.0f}_{100 * a:.0f}_{HALVES[-1]}"] for a, d in product(APART, CLAMPS)]
        worst = max(each, key=lambda one: abs(one.value))
        numbers[f"fold_{of}_most"] = Number(abs(worst.value), worst.error, "", shown)
    return [
        "## A fold whose sides meet",
        "A flat strip between two clamps on one line, brought together: nu = 0, w/l = 0.1, h/l = 5e-4, clamps and "
        "distance kept between the sides in l, half of the strip by symmetry (tests/reference/calculix_fold.py), whole "
        "lines across put on the plane of contact by an active set as above. place: of the push, from the clamp; "
        "energy: of bending, by a spline through the nodes. By shooting: tests/reference/touching_fold.py. Only lines "
        f"of nodes touch, half an element apart: pushes are off by at most {numbers['fold_push_most']} on the finer "
        "mesh, irregularly (one is near by chance), energies by at most "
        f"{numbers['fold_energy_most']}; pushes of our own shell, whose nodes touch too, by at most "
        f"{shell['fold_worst'].value:.1%} on its finest mesh ([its page](shell_contact.md)).",
        page.table(["clamps", "apart", "by", "push", "off", "energy", "off", "place", "lines", "solves"], rows),
    ]  # fmt: skip


def plates(kept: Pieces, out: Path, numbers: dict[str, Number]) -> list[str]:
    """Both shells and the published table."""
    known, shell = sze2004.SLIT_ANNULUS.table[-1, 1:], ours(out, "rest_shapes")
    there = [kept.get(f"plate_{m[0]}x{m[1]}", partial(plate_there, m)) for m in PLATES]
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


def bands(kept: Pieces, numbers: dict[str, Number]) -> list[str]:
    """Both shells."""
    there = [Band(*kept.get(f"band_{m[0]}x{m[1]}", partial(band_there, m))) for m in BANDS]
    here = [Ours(*kept.get(f"ours_{m[0]}x{m[1]}", partial(band_here, m))) for m in SHELLS]
    theirs = [float(np.linalg.norm(one.middle)) for one in there]
    rows = []
    for mesh, one, far in zip(BANDS, there, theirs, strict=True):
        rows.append([f"CalculiX {mesh[0]} x {mesh[1]}", f"{one.energy:.3f}", f"{one.error:.0e}", f"{far:.5f}",
                     f"{one.energy / here[-1].energy - 1.0:+.2%}", f"{far / here[-1].across - 1.0:+.2%}",
                     str(one.increments)])  # fmt: skip
    for mesh, own in zip(SHELLS, here, strict=True):
        over = [f"{own.energy / here[-1].energy - 1.0:+.2%}", f"{own.across / here[-1].across - 1.0:+.2%}"]
        rows.append([f"ours {mesh[0]} x {mesh[1]}", f"{own.energy:.3f}", "", f"{own.across:.5f}", *over, ""])
    error = abs(there[-1].energy - there[-2].energy) + there[-1].error
    mine = abs(here[-1].energy - here[-2].energy)
    numbers["band_energy"] = Number(there[-1].energy, error, "D w / l", ".2f")
    numbers["band_energy_ours"] = Number(here[-1].energy, mine, "D w / l", ".3f")
    numbers["band_energy_apart"] = Number(
        there[-1].energy / here[-1].energy - 1.0, (error + mine) / here[-1].energy, "", "+.2%"
    )
    error, mine = abs(theirs[-1] - theirs[-2]), abs(here[-1].across - here[-2].across)
    numbers["band_across"] = Number(theirs[-1], error, "l", ".4f")
    numbers["band_across_ours"] = Number(here[-1].across, mine, "l", ".5f")
    numbers["band_across_apart"] = Number(
        theirs[-1] / here[-1].across - 1.0, (error + mine) / here[-1].across, "", "+.2%"
    )
    energies = [numbers[name] for name in ("band_energy", "band_energy_ours")]
    return [
        "## A clamped Moebius band",
        f"w/l = {WIDTH:g}, w/h = {RATIO:g}, nu = {POISSON:g}. CalculiX's is a flat strip of C3D20R solids, one over "
        "the thickness, whose end face is led by hand around a circle and turned over onto the other "
        "(tests/reference/calculix_band.py); its energy is the work of that end (error: of the quadrature over the "
        "increments). Ours is joined node to node and comes to the same clamp by its own path. across: from the "
        "clamp to the point opposite, l. over: our finest. "
        f"Energies by the last mesh: {energies[0]} +- {energies[0].error:.2f}, ours {energies[1]} +- "
        f"{energies[1].error:.1e}; CalculiX is {numbers['band_energy_apart']} off ours in energy and "
        f"{numbers['band_across_apart']} across.",
        page.table(["shell", "energy", "error", "across", "energy over", "across over", "increments"], rows),
    ]


def run(out: Path) -> dict[str, Number]:
    """results/calculix.md."""
    numbers: dict[str, Number] = {}
    kept = Pieces("calculix")
    parts = [*rings(kept, out, numbers), *touching(kept, out, numbers)]
    parts += [*plates(kept, out, numbers), *bands(kept, numbers)]
    page.write(
        out / "calculix.md", "CalculiX beside our shell", "python -m tests.validation calculix",
        "CalculiX 2.20 (Debian: calculix-ccx; optional, no part of `make setup`), S8R shells, which it expands to "
        "C3D20R solids, nonlinear static steps to a residual of 1e-5; decks by "
        "tests/reference/calculix_surfaces.py and calculix_fold.py. Ours: Q2. Forces in D w / l^2, energies in D w / "
        "l, lengths in l; of the plate in the units of the benchmark.",
        *parts,
    )  # fmt: skip
    return numbers
