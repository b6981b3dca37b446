"""Two claims about the problem's form, tried: end rows (5.2) against (5.3) (thesis, 5.1), and units (3.5.2, 4.1)."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from compare.models.ribbon.build import ribbon_clamp, ribbon_gravity
from compare.scene.scene import Scene, load
from ribbon import Clamp, Strip
from ribbon.element.quaternion import matrix
from ribbon.find.solve import build
from ribbon.problems.chained import ChainedProblem, segment_lengths
from ribbon.problems.held import Rows
from ribbon.problems.mixed import MixedProblem
from ribbon.solvers import budget
from ribbon.solvers.ipopt import minimise
from ribbon.thesis.descent import Limits, newton_shifted
from tests.validation import one_core

# -- 5.1: rows (5.2), scalar products of like axes less 1, against rows (5.3) ------------------------------------------


@dataclass(frozen=True)
class LikeAxes:
    """``<G_c, H_c> - 1 = 0``, c = x, y, z, for the quaternion at `columns` (4,) and the frame H (3, 3): the thesis's
    (5.2), whose gradients vanish where they hold. G_c = R(q) e_c, quadratic in q."""

    columns: np.ndarray
    frame: np.ndarray
    count: int = 3
    lower: float = 0.0
    upper: float = 0.0

    def _forms(self) -> np.ndarray:
        """F (3, 4, 4): <G_c(q), H_c> = q^T F_c q."""
        forms = np.empty((3, 4, 4))
        unit = np.eye(4)
        for c in range(3):

            def value(q: np.ndarray, c: int = c) -> float:
                # the frame of a quaternion of any length, quadratic in it
                size = float(q @ q)
                return 0.0 if size == 0.0 else size * float(matrix(q / math.sqrt(size))[:, c] @ self.frame[:, c])

            for i in range(4):
                for j in range(4):
                    forms[c, i, j] = 0.5 * (value(unit[i] + unit[j]) - value(unit[i]) - value(unit[j]))
        return forms

    def values(self, x: np.ndarray) -> np.ndarray:
        """(3,)."""
        q = x[self.columns]
        return np.einsum("kij,i,j->k", self._forms(), q, q) - 1.0

    def jacobian_structure(self) -> tuple[np.ndarray, np.ndarray]:
        """Three rows of four."""
        return np.repeat(np.arange(3), 4), np.tile(self.columns, 3)

    def jacobian(self, x: np.ndarray) -> np.ndarray:
        """2 F q."""
        return 2.0 * (self._forms() @ x[self.columns]).ravel()

    def hessian_structure(self) -> tuple[np.ndarray, np.ndarray]:
        """The lower triangle."""
        rows, columns = np.tril_indices(4)
        return self.columns[rows], self.columns[columns]

    def hessian(self, x: np.ndarray, multipliers: np.ndarray) -> np.ndarray:
        """2 F times the multipliers."""
        return np.einsum("k,kij->ij", multipliers, 2.0 * self._forms())[np.tril_indices(4)]


@dataclass(frozen=True)
class ByLikeAxes(MixedProblem):
    """A glued ribbon whose end frame is held by (5.2)."""

    def _make_blocks(self) -> dict[str, Rows]:
        held = self.end_quaternion
        assert held is not None
        rows = LikeAxes(self.layout.joint(-1).quaternion, matrix(held))
        return {**super()._make_blocks(), "end_frame": rows}


def end_rows() -> list[list[str]]:
    """Scenes with two clamps: iterations and CPU time with either kind of rows, Ipopt's defaults of the project."""
    out = []
    for name in ("arc_5_1", "two_clamps_5_3_2_level", "two_clamps_5_3_2"):
        scene = load(name).replace({"model.tolerance": None, "model.elements": 20})
        frame = scene.end_frame
        end = Clamp(scene.end_position, frame[:, 2], frame[:, 1], "free")
        strip = Strip(1.0, scene.width, scene.strip.poisson, scene.curvature, scene.gamma)
        problem = build(strip, ribbon_clamp(scene), ribbon_gravity(scene), end=end, segments=20)
        assert isinstance(problem, MixedProblem)
        like = ByLikeAxes(**{k: getattr(problem, k) for k in problem.__dataclass_fields__ if not k.startswith("_")})
        seed = np.interp(np.linspace(0, 1, 21), np.linspace(0, 1, len(scene.seed_curvature)), scene.seed_curvature)
        x = problem.state(seed, np.interp(np.linspace(0, 1, 21), [0, 1], [1e-3, 1.1e-3]))
        minimise(problem, x)  # loads the kernels
        first, seconds = one_core.timed(partial(minimise, problem, x), budget=2.0)
        clock = time.process_time()
        with budget.within(300.0):
            second = minimise(like, x, {"max_iter": 20000})
        spent = time.process_time() - clock
        for what, found, took in (("(5.3)", first, seconds), ("(5.2)", second, spent)):
            out.append([
                name, what, str(found.iterations), f"{1e3 * took:.3g}", f"{took / seconds:.2g}",
                f"{problem.value(found.x):.6f}", f"{np.abs(problem.constraints(found.x)).max():.0e}",
                "yes" if found.finished else "acceptable only" if "acceptable" in found.message else "given up",
            ])  # fmt: skip
        print("  end rows", out[-2][1:], out[-1][1:], flush=True)
    return out


# -- 3.5.2, 4.1: does it matter in which units the unknowns are? -------------------------------------------------------


@dataclass(frozen=True)
class InUnits:
    """A problem in units of its own: unknowns x / scale, energy times unit."""

    problem: ChainedProblem
    scale: np.ndarray
    unit: float

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.problem.size

    @property
    def rows(self) -> None:
        """It has none."""

    @property
    def slack(self) -> None:
        """Its end is free."""

    @property
    def strip(self) -> None:
        """None: what is small is asked for in the units of these unknowns, not of the strip's forces."""

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Of x / scale."""
        lower, upper = self.problem.bounds()
        return lower / self.scale, upper / self.scale

    def value(self, x: np.ndarray) -> float:
        """In units of the energy."""
        return self.unit * self.problem.value(x * self.scale)

    def gradient(self, x: np.ndarray) -> np.ndarray:
        """(n,)."""
        return self.unit * self.scale * self.problem.gradient(x * self.scale)

    def hessian(self, x: np.ndarray) -> np.ndarray:
        """(n, n)."""
        return self.unit * np.outer(self.scale, self.scale) * self.problem.hessian(x * self.scale)


def _unit_cases(scene: Scene) -> list[tuple[str, float, float]]:
    """Name, length (m) and energy unit D w / l (J) of the strip of 4.1: paper, 1 cm wide, 0.1 mm thick."""
    stiffness = 4e9 * 1e-12 / (12 * (1 - scene.strip.poisson**2)) * 0.01
    return [("dimensionless", 1.0, 1.0), *((f"SI, l = {l:g} m", l, stiffness / l) for l in (1.0, 0.3, 0.05))]


def units() -> list[list[str]]:
    """Three coils, minimised in SI units by Ipopt without and with its scaling, and by NEWTONR (shift at 1e-8)."""
    out = []
    for name in ("coil_10_100", "coil_40_1200", "coil_100_7500"):
        scene = load(name)
        strip = Strip(1.0, 1e-3, scene.strip.poisson, tuple(-k for k in scene.curvature), scene.gamma)
        lengths = segment_lengths(scene.model.elements)
        problem = ChainedProblem(strip, ribbon_clamp(scene), ribbon_gravity(scene), "sadowsky", lengths)
        x = problem.natural_state()
        base: dict[str, float] = {}
        for words, length, unit in _unit_cases(scene):
            scale = np.ones(problem.size)
            layout = problem.layout
            scale[layout.omega] = length  # b in 1/m
            scale[layout.omega_slope] = length**2  # a in 1/m^2
            scale[layout.eta_slope] = length  # n in 1/m
            within = InUnits(problem, scale, unit)
            # met where the dimensionless gradient is: 1e-8
            stop = 1e-8 * unit * float(scale.min())
            methods: dict[str, Callable[[], object]] = {
                "IPOPT-HESS, unscaled": partial(minimise, within, x / scale, {"tol": stop}),
                "IPOPT-HESS, its own scaling": partial(
                    minimise, within, x / scale, {"tol": stop, "nlp_scaling_method": "gradient-based"}
                ),
                "NEWTONR": partial(newton_shifted, within, x / scale, Limits(stop, 500)),
            }
            for method, once in methods.items():
                if not base:
                    once()  # loads the kernels
                found, seconds = one_core.timed(once, budget=1.0)
                end = np.asarray(found.x) * scale
                slope = float(np.abs(problem.gradient(end)).max())
                base.setdefault(method, seconds)
                good = bool(found.finished) and slope < 1e-5
                out.append([
                    f"{scene.curvature[0]:g}", words, method, str(found.iterations), f"{1e3 * seconds:.3g}",
                    f"{seconds / base[method]:.2g}", f"{problem.value(end):.5f}", f"{slope:.0e}",
                    "yes" if good else "no",
                ])  # fmt: skip
        print("  units", name, flush=True)
    return out
