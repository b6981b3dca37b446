"""Strips that are no plane at rest: MacNeal's strip, the slit annular plate, K(s) as a table, natural twist."""

from __future__ import annotations

import dataclasses
import math
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from compare.models.antman.problem import problem_of
from compare.models.elastica.start import elastica_problem
from compare.models.shell_build import shell_problem
from compare.scene.scene import Scene, load, loads
from ribbon.find.solve import solve as ribbon_solve
from shellref import ShellOptions, ShellProblem
from shellref.elastica.solve import solve as elastica_solve
from shellref.fenics import dolfinx_api
from shellref.path.arc import Point
from shellref.path.begin import begun
from shellref.path.buckling import Buckling, buckling
from shellref.path.solver import Solver
from shellref.path.walk import Walk, Walker
from shellref.rod.solve import solve as rod_solve
from shellref.shell.midsurface import Ruled
from shellref.shell.result import ShellResult
from shellref.shell.strip import build_strip
from tests.reference import sze2004, warping_cantilever
from tests.validation import page
from tests.validation.number import Number

FloatArray = NDArray[np.float64]

#: MacNeal's strip: thickness -> (load, tip displacement along the load in the plane of the loaded end and out of it).
#: 0.32: Zupan & Saje's beam (D. Zupan, M. Saje 2003, doi:10.1016/j.cma.2003.07.008); 0.0032: Belytschko et al. 1989.
MACNEAL = {0.32: (1.0, 0.005424534868469, 0.001753248285256), 0.0032: (1e-6, 0.005256, 0.001294)}
YOUNG = 29e6
MACNEAL_MESHES = ((12, 2), (24, 4), (48, 8))
SLIT_MESHES = ((12, 2), (20, 3), (40, 5))
#: Unloaded twist of a strip, w / h of those whose reference is flat, and Poisson's ratio.
TWIST, FLAT, POISSON = 1.0, (5.0, 10.0, 20.0, 40.0), 0.3
TABLE = ((0.0, 0.0), (0.5, 0.0), (0.6, 12.0), (1.0, 12.0))
TABLE_MESHES = ((20, 2), (40, 2), (80, 2))
#: The strip on edge: length, thickness, width, Y, nu and the beams' critical forces.
EDGE = (30.0, 0.5, 4.0, 1e6, 0.3)
EDGE_KNOWN = (221.82, 567.43)
EDGE_MESHES = ((16, 4), (32, 8), (48, 12))


def walked(problem: ShellProblem) -> ShellResult:
    """The shell by its own path, on its own mesh."""
    result = begun(problem, ShellOptions(), lambda event: None).result
    if result.status != "converged":
        raise AssertionError(f"{result.status}: {result.message}")
    return result


def order(values: tuple[float, float, float]) -> float:
    """Observed order of what is measured on three meshes, each of elements half as long."""
    return math.log2(abs((values[1] - values[0]) / (values[2] - values[1])))


# -- MacNeal ----------------------------------------------------------------------------------------------------------


def twisted(thickness: float, direction: int) -> Scene:
    """The strip of this thickness with its load along e_y (in the plane of the end) or e_x."""
    base = load("pretwisted_macneal").replace({"strip.thickness": thickness})
    unit = YOUNG * thickness**3 / 12.0 / (1.0 - base.strip.poisson**2) * base.strip.width / base.strip.length**2
    force = [0.0, 0.0, 0.0]
    force[1 - direction] = MACNEAL[thickness][0] / unit
    return base.replace({"tip.force": force})


@cache
def twisted_shell(thickness: float, direction: int, mesh: tuple[int, int]) -> float:
    """Displacement of the loaded end along the load, in the unit of length, by the shell."""
    scene = twisted(thickness, direction)
    result = walked(shell_problem(scene, scene.strip.width / thickness, mesh))
    return scene.strip.length * float(result.surface.centreline(np.array(1.0))[1 - direction])


def twisted_rod(thickness: float, direction: int, elements: int = 40) -> float:
    """The same by the shearable rod."""
    scene = twisted(thickness, direction)
    return scene.strip.length * float(rod_solve(problem_of(scene), elements).state.r[-1, 1 - direction])


def twisted_beam(thickness: float, direction: int) -> float:
    """The same by the linear Timoshenko beam of straight axis whose section turns, in closed form."""
    scene = twisted(thickness, direction)
    length, width, nu = scene.strip.length, scene.strip.width, scene.strip.poisson
    soft, stiff = width * thickness**3 / 12.0, thickness * width**3 / 12.0
    twist = float(scene.twist[1])  # type: ignore[arg-type]
    # int_0^1 (1 - x)^2 cos^2(a x) dx
    a = twist
    cosine = 1.0 / 6.0 + 1.0 / (4.0 * a**2) - math.sin(2.0 * a) / (8.0 * a**3)
    share = cosine if direction == 0 else 1.0 / 3.0 - cosine
    bending = length**3 / YOUNG * (share / soft + (1.0 / 3.0 - share) / stiff)
    shear = length / (5.0 / 6.0 * YOUNG / (2.0 * (1.0 + nu)) * width * thickness)
    return MACNEAL[thickness][0] * (bending + shear)


def macneal(numbers: dict[str, Number]) -> list[str]:
    """Shell and rod beside the beams."""
    rows = []
    for thickness, (_, *known) in MACNEAL.items():
        for direction, reference in enumerate(known):
            name = f"{'plane' if direction == 0 else 'out'}_{'thick' if thickness > 0.1 else 'thin'}"
            first, second, third = (twisted_shell(thickness, direction, mesh) for mesh in MACNEAL_MESHES)
            values = (first, second, third)
            rod, beam = twisted_rod(thickness, direction), twisted_beam(thickness, direction)
            numbers[f"shell_{name}"] = Number(third, abs(third - second), "", ".7f")
            numbers[f"shell_{name}_off"] = Number(third / reference - 1.0, abs(third - second) / third, "", "+.2%")
            numbers[f"rod_{name}"] = Number(rod, abs(twisted_rod(thickness, direction, 20) - rod), "", ".9f")
            numbers[f"rod_{name}_beam"] = Number(rod / beam - 1.0, 1e-6, "", ".0e")
            numbers[f"rod_{name}_off"] = Number(rod / reference - 1.0, 1e-6, "", "+.2%")
            rows.append([
                f"{thickness:g}", "in the plane of the end" if direction == 0 else "out of it", f"{reference:.10g}",
                *(f"{value:.7f}" for value in values), f"{order(values):.1f}", f"{third / reference - 1.0:+.2%}",
                f"{rod:.9f}", f"{rod / beam - 1.0:+.0e}", f"{rod / reference - 1.0:+.2%}",
            ])  # fmt: skip
    return [
        "## MacNeal's pre-twisted strip",
        "Length 12, width 1.1, a quarter of a turn, Y = 29e6, nu = 0.22 (scene `pretwisted_macneal`: "
        "`strip.natural_twist`); a force of 1 (thickness 0.32) or 1e-6 (0.0032) at the free end; displacement there "
        "along it. Reference: Zupan and Saje's beam, thin: Belytschko et al. 1989. Beam: closed form of a Timoshenko "
        "beam whose section turns.",
        page.table(
            ["thickness", "load", "reference", *(f"shell {a} x {b}" for a, b in MACNEAL_MESHES), "order",
             "off the reference", "rod (Antman)", "off the beam", "off the reference"],
            rows,
        ),
    ]  # fmt: skip


# -- the slit annulus -------------------------------------------------------------------------------------------------


@cache
def slit(mesh: tuple[int, int]) -> tuple[float, float]:
    """Deflections of the inner and the outer corner of the free edge at the full load."""
    scene = load("slit_annulus")
    result = walked(shell_problem(scene, scene.strip.width / scene.strip.thickness, mesh))
    half = 0.5 * scene.width
    points = result.surface.evaluate(np.array([1.0, 1.0]), np.array([half, -half]))
    return float(points[0, 1]) * scene.strip.length, float(points[1, 1]) * scene.strip.length


def annulus(numbers: dict[str, Number]) -> list[str]:
    """Beside the published table."""
    known = sze2004.SLIT_ANNULUS.table[-1, 1:]
    rows = []
    for mesh in SLIT_MESHES:
        found = slit(mesh)
        rows.append([f"{mesh[0]} x {mesh[1]}", *(f"{a:.3f}" for a in found),
                     *(f"{100.0 * (a / b - 1.0):+.2f}" for a, b in zip(found, known, strict=True))])  # fmt: skip
    last, before = slit(SLIT_MESHES[-1]), slit(SLIT_MESHES[-2])
    for k, name in enumerate(("inner", "outer")):
        error = abs(last[k] - before[k])
        numbers[f"slit_{name}"] = Number(last[k], error, "", ".3f")
        numbers[f"slit_{name}_off"] = Number(last[k] / float(known[k]) - 1.0, error / last[k], "", "+.2%")
    return [
        "## The slit annular plate",
        f"Sze, Liu and Lo 2004 (sze.md) from the scene language: `slit_annulus`, a strip 16 pi long and 4 wide with "
        f"`natural_geodesic_curvature` = 1/8, lifted by 0.8 per length of its free edge. Table: W_A = {known[0]:.3f} "
        f"(inner corner), W_B = {known[1]:.3f} (outer).",
        page.table(["mesh, even", "W_A", "W_B", "W_A %", "W_B %"], rows),
    ]


# -- K as a table -----------------------------------------------------------------------------------------------------


def curled(elements: int) -> Scene:
    """A strip whose further half is curled, planar, nu = 0."""
    return loads(
        'title = "curled"\n[strip]\nlength = 1.0\nwidth = 0.03\nthickness = 3e-4\npoisson = 0.0\ngamma = 20.0\n'
        f"natural_curvature = {[list(point) for point in TABLE]}\n[gravity]\nup = [0.0, 1.0, 0.0]\n"
        "[clamp.start]\nposition = [0.0, 0.0, 0.0]\ntangent = [0.0, 0.0, 1.0]\nnormal = [0.0, 1.0, 0.0]\n"
        f'[model]\nenergy = "wunderlich"\nelements = {elements}\n[shell]\ngrading = [1.0, 1.0]\n'
    )


@cache
def curled_elastica(elements: int, degree: int = 3) -> FloatArray:
    """(z, y) of the end by the elastica."""
    result = elastica_solve(elastica_problem(curled(10)), elements, degree, estimate_error=False)
    return np.array([result.x[-1], -result.y[-1]])


@cache
def curled_ribbon(elements: int) -> FloatArray:
    """The same by the ribbon."""
    from compare.models.ribbon.build import ribbon_arguments

    state = ribbon_solve(**ribbon_arguments(curled(elements)))
    return np.array([state.end.position[2], state.end.position[1]])


@cache
def curled_shell(mesh: tuple[int, int]) -> FloatArray:
    """The same by the shell of w/h = 100."""
    end = walked(shell_problem(curled(10), 100.0, mesh)).surface.centreline(np.array(1.0))
    return np.array([end[2], end[1]])


def tables(numbers: dict[str, Number]) -> list[str]:
    """Three solvers and their orders."""
    exact = curled_elastica(160)
    rows = []
    for name, of, sizes in (
        ("elastica, degree 3", curled_elastica, (5, 10, 20)),
        ("ribbon", curled_ribbon, (10, 20, 40)),
        ("shell, w/h = 100", curled_shell, TABLE_MESHES),
    ):
        far = [float(np.linalg.norm(of(size) - exact)) for size in sizes]  # type: ignore[arg-type]
        rows.append([name, ", ".join(str(s) if isinstance(s, int) else f"{s[0]} x {s[1]}" for s in sizes),
                     *(f"{x:.1e}" for x in far), f"{math.log2(far[0] / far[1]):.1f}"])  # fmt: skip
        numbers[f"table_{name.split(',')[0]}"] = Number(far[-1], 0.5 * far[-1], "l", ".0e")
    return [
        "## K(s) as a table",
        f"K l = {', '.join(f'{k:g} at {s:g}' for s, k in TABLE)}, straight between; nu = 0, Gamma = 20, planar: "
        "distance of the end to the elastica on 160 elements. Segments and elements end at the points.",
        page.table(["model", "sizes", "first", "second", "third", "order"], rows),
    ]


# -- natural twist ----------------------------------------------------------------------------------------------------


def free_twist(ratio: float, mesh: tuple[int, int] = (32, 8)) -> ShellProblem:
    """A free strip of w / l = 0.1 with natural twist."""
    return ShellProblem(
        0.1, 0.1 / ratio, POISSON, clamp="free", natural_twist=(TWIST, TWIST), elements=mesh, grading=(1.0, 1.0)
    )


@cache
def helicoid(ratio: float) -> tuple[float, float]:
    """Energy (D w / l) of the free shell whose reference is the helicoid, and distance to it over l."""
    result = walked(free_twist(ratio))
    s, v = (x.ravel() for x in np.meshgrid(result.surface.s_nodes, result.surface.v_nodes, indexing="ij"))
    exact = Ruled(twist=(TWIST, TWIST), origin=0.5).place(s, v)[0]
    return abs(result.energy["elastic"]), float(np.abs(result.surface.points.reshape(-1, 3) - exact).max())


@cache
def form_only(ratio: float, mesh: tuple[int, int] = (32, 8)) -> float:
    """Twist over the natural one of a free strip whose reference is flat and whose rest form is kappa_12 = twist."""
    problem = dataclasses.replace(free_twist(ratio, mesh), natural_twist=(0.0, 0.0), natural_curvature=(0.0, 1e-12))
    strip = build_strip(problem, ShellOptions())

    def law(s: FloatArray, v: FloatArray) -> FloatArray:
        return np.stack([0.0 * s, 0.0 * s, 2.0 * TWIST + 0.0 * s], axis=1)

    body = dataclasses.replace(strip.body, natural=law, natural_start=lambda s, v: 0.0 * law(s, v))
    found = Solver(
        dataclasses.replace(strip, body=body), ShellOptions(), dolfinx_api.communicator("self"), lambda event: None
    ).run()
    across = found.surface.frames(np.array([0.3, 0.7]))[:, :, 0]
    return math.acos(float(across[0] @ across[1])) / 0.4 / TWIST


def expected(ratio: float) -> float:
    """The same of a section that stretches: (1 - nu) (t - t_0)^2 + zeta^2 t^4 / 2 made least (10.17)."""
    width = 0.1
    zeta = (1.0 - POISSON**2) * width**2 * ratio**2 / 60.0
    return float(brentq(lambda t: (1.0 - POISSON) * (t - TWIST) + zeta * t**3, 0.0, TWIST, xtol=1e-14)) / TWIST


def twists(numbers: dict[str, Number]) -> list[str]:
    """The helicoid as the reference, and as a form on a plane."""
    rows = []
    for ratio in FLAT:
        (energy, far), form = helicoid(ratio), form_only(ratio)
        rows.append([f"{ratio:g}", f"{0.1 * ratio * TWIST:g}", f"{energy:.0e}", f"{far:.0e}", f"{form:.4f}",
                     f"{expected(ratio):.4f}"])  # fmt: skip
        numbers[f"form_{ratio:g}"] = Number(form, abs(form - form_only(ratio, (16, 4))) + 1e-6, "", ".4f")
    worst = max(helicoid(ratio)[1] for ratio in FLAT)
    numbers["helicoid_far"] = Number(worst, 1e-12, "l", ".0e")
    return [
        "## Natural twist: a curved reference, not a form on a plane",
        f"A free strip, w/l = 0.1, nu = {POISSON}, twist l = {TWIST:g}. With the helicoid as reference it rests "
        "on the rod's helicoid, without energy, whatever its thickness. The same twist as a natural curvature form "
        "k_12 on a flat reference leaves its edges too short: it twists less the larger w^2 t / h is. Last column: the "
        "section that stretches, (1 - nu)(t - t_0)^2 + zeta^2 t^4 / 2 made least.",
        page.table(
            ["w/h", "w^2 t / h", "energy, D w / l", "distance to the helicoid, l", "twist by the form / natural",
             "expected"],
            rows,
        ),
    ]  # fmt: skip


# -- the strip on edge ------------------------------------------------------------------------------------------------


def on_edge(mesh: tuple[int, int], force: float) -> ShellProblem:
    """Clamped, its width upright, with this force (in the units of EDGE) at its end along the width."""
    length, thickness, width, young, nu = EDGE
    unit = young * thickness**3 / 12.0 / (1.0 - nu**2) * width / length**2
    return ShellProblem(
        width / length, thickness / length, nu, elements=mesh, grading=(1.0, 1.0), tip=(force / unit, 0.0, 0.0)
    )


@cache
def critical(mesh: tuple[int, int]) -> tuple[float, float]:
    """Forces at which the unbent strip loses its first and its second direction, by the inertia of its tangent."""
    most = 1.4 * EDGE_KNOWN[1]
    first: Buckling = buckling(on_edge(mesh, 1.2 * EDGE_KNOWN[0]))
    assert first.inertia is not None
    options = ShellOptions(kick=False, switch=False, arc_length="never")
    strip = build_strip(on_edge(mesh, most), options)
    solver = Solver(strip, options, dolfinx_api.communicator("self"), lambda event: None)
    walker = Walker(solver.equilibrium, strip.stages, options, solver.report, solver.observe)
    start = strip.initial_state(solver.model.nodes)
    walker.start(Walk(Point(0.0, start, None)))  # type: ignore[arg-type]
    stage = strip.stages[-1]

    def lost(share: float) -> int:
        attempt = walker.equilibrium.solve(start, solver.model.stress(start), stage, share)
        assert attempt.converged
        return int(walker.equilibrium.negative_eigenvalues(attempt.state, stage, share) or 0)

    low, high = 1.3 * EDGE_KNOWN[0] / most, 1.0
    assert (lost(low), lost(high)) == (1, 2)
    while high - low > 1e-5:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if lost(middle) < 2 else (low, middle)
    return 1.2 * EDGE_KNOWN[0] * first.inertia, most * 0.5 * (low + high)


def edge(numbers: dict[str, Number]) -> list[str]:
    """First and second critical force."""
    rows = []
    length, thickness, width, young, nu = EDGE
    held = warping_cantilever.critical(length, thickness, width, young, nu)
    for k, known in enumerate(EDGE_KNOWN):
        values = [critical(mesh)[k] for mesh in EDGE_MESHES]
        numbers[f"edge_{k + 1}"] = Number(values[-1], abs(values[-1] - values[-2]), "", ".2f")
        numbers[f"edge_{k + 1}_off"] = Number(
            values[-1] / known - 1.0, abs(values[-1] - values[-2]) / values[-1], "", "+.2%"
        )
        numbers[f"edge_{k + 1}_warping"] = Number(
            values[-1] / held[k] - 1.0, abs(values[-1] - values[-2]) / values[-1], "", "+.2%"
        )
        rows.append([
            f"{known:g}", *(f"{value:.2f}" for value in values), f"{values[-1] / known - 1.0:+.2%}", f"{held[k]:.2f}",
            f"{values[-1] / held[k] - 1.0:+.2%}",
        ])  # fmt: skip
    return [
        "## A strip on edge with a force at its end",
        "l = 30, b = 0.5, h = 4, Y = 1e6, nu = 0.3, clamped over its whole edge; a dead force along the width, spread "
        "over the end edge. Critical forces of the unbent path, by the inertia of the shell's tangent, beside the "
        "beams'. The shell is the stiffer as its clamp holds the warping of the section and as it bends in its plane "
        "before it buckles: a beam that knows both (Vlasov's, tests/reference/warping_cantilever.py) is beside it.",
        page.table(
            ["beams", *(f"shell {a} x {b}" for a, b in EDGE_MESHES), "off the beams", "beam, warping held", "off it"],
            rows,
        ),
    ]


PROBES = {
    "shell_plane_thick_12x2": lambda: twisted_shell(0.32, 0, MACNEAL_MESHES[0]),
    "rod_out_thick": lambda: twisted_rod(0.32, 1),
    "form_10_16x4": lambda: form_only(10.0, (16, 4)),
}


def run(out: Path) -> dict[str, Number]:
    """results/rest_shapes.md."""
    numbers: dict[str, Number] = {}
    first, second, _ = (twisted_shell(0.32, 0, mesh) for mesh in MACNEAL_MESHES)
    numbers["shell_plane_thick_12x2"] = Number(first, abs(first - second), "", ".7f")
    numbers["form_10_16x4"] = Number(form_only(10.0, (16, 4)), 1e-4, "", ".4f")
    parts = []
    for part in (macneal, annulus, tables, twists, edge):
        parts += part(numbers)
        print(f"  {part.__name__}", flush=True)
    page.write(
        out / "rest_shapes.md", "Strips that are no plane at rest", "python -m tests.validation rest_shapes",
        "Shells on even meshes of degree 2, by their own path; lengths in the unit of the benchmark.", *parts,
    )  # fmt: skip
    return numbers
