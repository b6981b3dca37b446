"""What a ribbon solve returns: a frozen `Equilibrium` with a status from a short list."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ribbon import sections, shown
from ribbon import surface as _surface
from ribbon.forces import Force, PairForce, WallForce
from ribbon.notes import Note
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.protocol import Problem
from ribbon.strip import abscissae
from ribbon.surface import Surface
from ribbon.units import InSI, StripUnits

FloatArray = NDArray[np.float64]


class Status(Enum):
    """How a solve ended; the value says it in a sentence (what a scene can do about it: `compare.page.remedies`)."""

    CONVERGED = "converged: a stable equilibrium"
    SADDLE = "saddle: a stationary point with a negative eigenvalue; it is not stable"
    NOT_CONVERGED = "not converged: the residual is above the tolerance"
    FAILED = "failed: the energy could not be evaluated or the minimiser gave up"
    INFEASIBLE = (
        "infeasible: no shape found that satisfies all clamps, seams and walls at once; check that they can be met, "
        "use more segments"
    )
    FLIPPED = "flipped frame: the frames fit up to a reflection or a half turn only"
    RULINGS_CROSS = "rulings cross inside the strip (|eta'| w / 2 > 1): no such surface exists; use more segments"

    @property
    def code(self) -> str:
        """Short name for files: "converged", "saddle", ..."""
        return self.name.lower()


class Branch(Enum):
    """How a state between two clamps stands to the seed that was given (`ribbon.find.minima`)."""

    OWN = "on the side of its seed"
    SLID = "on the other side than its seed: the energy falls all the way from there, the seed's side holds no state"
    LEFT = "on the other side than its seed, and whether the seed's side has a state is open"


@dataclass(frozen=True)
class Left:
    """A saddle that was left along its unstable mode.

    above: its energy over that of the state it was left for, D w / l; mirrored: whether the other way along the mode
    leads to a state of the same energy, as the mirror image of a symmetric saddle's does; None: it leads to none.
    """

    above: float
    mirrored: bool | None

    def __str__(self) -> str:
        also = "; the other way leads to a state of the same energy" if self.mirrored else ""
        return f"left a saddle {self.above:.3g} D w / l above{also}"


@dataclass(frozen=True)
class Energy:
    """Energies in units of D w / l; `elastic` leaves out the constant of the natural curvature, 1/2 int K^2 ds."""

    bending: float
    natural: float
    gravity: float
    plates: float = 0.0
    tip: float = 0.0

    @property
    def elastic(self) -> float:
        """Bending and natural-curvature parts (thesis, eq. 4.1 or 4.2)."""
        return self.bending + self.natural

    @property
    def total(self) -> float:
        """Elastic energy, weight, the springs of pressure plates and the force at the end."""
        return self.elastic + self.gravity + self.plates + self.tip


@dataclass(frozen=True)
class Pose:
    """Position (3,) in units of l and frame (3, 3), columns t_x t_y t_z, of a point of the centreline."""

    position: FloatArray
    frame: FloatArray


@dataclass(frozen=True)
class Refinement:
    """What a state is on other segments: how many, its status and lowest eigenvalue there, the distance (Hausdorff
    over l) to the one before; None where it is not known; its `Equilibrium.numbers`, and before: those of the state on
    segments twice as long that it was begun at, None where there is none."""

    segments: int
    status: Status
    lowest_eigenvalue: float
    distance: float | None
    numbers: dict[str, FloatArray]
    before: dict[str, FloatArray] | None


@dataclass(frozen=True)
class Minima:
    """Minima that were seen where several were looked for (`ribbon.find.minima`).

    energies: of all, ascending; returned: of the returned state, D w / l, on `segments` segments; tries: solves that
    looked for others; flipped: the state has flips of the ruling that its segments place, so that most of the minima
    are copies of it that finer segments merge.
    """

    energies: tuple[float, ...]
    returned: float
    segments: int
    tries: int
    flipped: bool

    @property
    def lowest(self) -> bool:
        """Whether none that was seen has less energy than the returned one."""
        return self.above <= 1e-9 * max(1.0, abs(self.returned))

    @property
    def above(self) -> float:
        """By how much the returned one is above the lowest that was seen, D w / l."""
        return max(0.0, self.returned - self.energies[0])

    def __str__(self) -> str:
        if self.lowest:
            return f"the lowest of {len(self.energies)} minima seen"
        return f"of {len(self.energies)} minima seen another has {self.above:.3g} D w / l less energy"


@dataclass(frozen=True, repr=False)
class Equilibrium:
    """A ribbon at rest, or where the minimiser stopped; all in l and D w, abscissae too (`ribbon.strip`; SI: `si`).

    An abscissa that is not in [0, 1] raises `RibbonInputError`; `continued` goes on beyond the ends. A closed band has
    none: it goes on behind its seam.

    Attributes
    ----------
    status, message: how the solve ended; `ok` only for a converged, stable equilibrium. notes: codes of the sentences
    that the message is made of.
    stable: True, False, or None when it was not converged; lowest_eigenvalue: of the Hessian in the metric
    ``int (domega^2 + deta^2) ds``, on what no bound or constraint holds; mode: its eigenvector in the unknowns; at: the
    unknowns where it was found (another choice of rulings that move nothing; the same shape).
    residual: KKT residual, largest component (`ribbon.solvers.problem.kkt_residual`); iterations: of the minimiser;
    evaluations: of value, gradient, Hessian and series, by name.
    energy: by part; x: unknowns; multipliers: of the bounds; rows: of the constraints; active_bounds: how many rulings'
    slopes are held at 2/w. start, end_support, walls: what holds the ribbon exerts on it; seconds: {"solve",
    "stability"}; log: one entry for every step of a continuation; tolerance_error: estimated distance to the limit of
    many segments (Hausdorff / l) when a tolerance placed the segments; refinements: all that were judged on the way;
    penetration: how far (l) the strip reaches beyond a wall, anywhere; None without walls;
    minima: what was seen where several were looked for, None: nowhere; solver: which minimiser found it
    (`ribbon.solvers.problem.SOLVERS`); options: those that Ipopt was given, none of another;
    moved: how far (l) the joints went in the last doubling of the segments, where it was solved on fewer first;
    forces_why: why forces and moments are not determined, although the shape is; "" where they are. `start`,
    `end_support` and `walls` are then None, None and (), and `rows` NaN;
    branch: of a ribbon between two clamps with a given seed, whether it is the state that the seed means; None: no seed
    was given, or it means no side; left: the saddle that was left for it, None: none;
    quadrature_error: by how much of itself the elastic energy differs from its adaptive integral on the state's fields
    (`ribbon.judge.quadrature`); None where the rule is exact (energies of rulings, the rod) or nothing was judged;
    unstable_modes: negative eigenvalues of the second variation, by inertia; None: not judged, or not counted;
    nonconvex: share of the length on which the density is not convex in curvature and twist
    (`ribbon.judge.convexity`): where it is not zero, elements alone hold the state; None likewise;
    rubbed: what friction took away (D w / l) along a path so far, None: without friction; before: the state at the end
    of the increment before, on which friction depends; jointed: of a round rod on segments that follow what touches,
    these and what does (`ribbon.find.jointed.rounds.Jointed`), None: on others.
    """

    problem: Problem
    status: Status
    message: str
    x: FloatArray
    multipliers: FloatArray
    residual: float
    iterations: int
    evaluations: dict[str, int]
    energy: Energy
    stable: bool | None
    lowest_eigenvalue: float
    mode: FloatArray
    active_bounds: int
    seconds: dict[str, float]
    options: dict[str, object] = field(kw_only=True)
    rows: FloatArray = field(kw_only=True)
    at: FloatArray | None = None
    log: tuple[dict[str, Any], ...] = ()
    tolerance_error: float | None = None
    penetration: float | None = field(kw_only=True)
    refinements: tuple[Refinement, ...] = ()
    minima: Minima | None = None
    solver: str = field(kw_only=True)
    moved: float | None = None
    forces_why: str = ""
    branch: Branch | None = None
    quadrature_error: float | None = None
    nonconvex: float | None = None
    left: Left | None = None
    notes: tuple[Note, ...] = ()
    unstable_modes: int | None = None
    rubbed: float | None = None
    before: Equilibrium | None = None
    jointed: Any = None

    @property
    def ok(self) -> bool:
        """Converged and stable."""
        return self.status is Status.CONVERGED

    @cached_property
    def parameters(self) -> FloatArray:
        """(a, b, n, m) of every segment (p, 4): omega = a s + b, eta = n s + m on each; where the twist is free
        kappa_3 = n s + m, and with an in-plane curvature (a, b, n, m, c, d) (p, 6), kappa_2 = c s + d."""
        return self.problem.parameters(self.x)

    @cached_property
    def joints(self) -> tuple[FloatArray, FloatArray]:
        """Positions (p + 1, 3) and frames (p + 1, 3, 3) at the ends of the segments."""
        return self.problem.joints(self.x)

    @property
    def seam(self) -> int:
        """How the ends are joined (`ribbon.surface`): 0 not at all, 1 a circle, -1 a Moebius band."""
        return 0 if self.problem.closure is None else self.problem.closure.sign

    @property
    def has_free_twist(self) -> bool:
        """Whether the energy's twist is free of the curvature; there are then no rulings."""
        return self.problem.fields.free

    def continued(self, s: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """r (k, 3) in l, frames (k, 3, 3), omega (k,) in 1/l, eta (k,) or the free twist in 1/l, at any s (k,) in l:
        beyond an open end the strip goes on with the end's own curvature and ruling, of a band with what lies
        behind its seam. Feet of rulings (`rulings`) lie there."""
        at = np.atleast_1d(np.asarray(s, dtype=float))
        points, frames = self.joints
        return _surface.centreline(
            self.parameters, self.problem.lengths, points, frames, at, self.problem.exponent_limit, self.seam,
            self.has_free_twist,
        )  # fmt: skip

    def _along(self, s: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        return self.continued(self._on(s))

    def _on(self, s: ArrayLike) -> FloatArray:
        """Abscissae in [0, 1]; of a band, which has no ends, any number."""
        if self.seam == 0:
            return abscissae(s)
        at = np.asarray(s, dtype=float)
        abscissae(at - np.floor(at))
        return at

    def rulings(self, material: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Feet s (N,) of the rulings through the particles (S, v) of `material` (N, 2), units of l; with the positions
        (N, 3) of the particles and the frames (N, 3, 3) of the feet. A foot may lie behind the seam of a band.

        Where the twist is free there are no rulings: the foot is S, and the particles stand on the model's own section
        (`ribbon.sections`)."""
        if self.has_free_twist:
            foot = np.array(material[:, 0], dtype=float)
            s, back = np.unique(foot, return_inverse=True)  # of a grid each once
            r, frame = (found[back] for found in self.continued(s)[:2])
            return foot, r + np.einsum("kij,kj->ki", frame, sections.placed(self, material)), frame
        foot = _surface.ruling_foot(self.parameters, self.problem.lengths, material, self.seam)
        r, frame, _, eta = self.continued(foot)
        return foot, r + material[:, 1:] * (frame[:, :, 0] + eta[:, None] * frame[:, :, 2]), frame

    def normals(self, material: FloatArray) -> FloatArray:
        """Unit normals (N, 3) of the surface at the particles (S, v) of `material` (N, 2), on the side of t_y."""
        if self.has_free_twist:
            frame = self.continued(material[:, 0])[1]
            return np.asarray(np.einsum("kij,kj->ki", frame, sections.normals(self, material)))
        return np.asarray(self.rulings(material)[2][:, :, 1])

    def position(self, s: ArrayLike) -> FloatArray:
        """r (k, 3) in l at abscissae s (k,) in l, [0, 1]."""
        return self._along(s)[0]

    def frame(self, s: ArrayLike) -> FloatArray:
        """Material frames (k, 3, 3), columns t_x t_y t_z, at abscissae s (k,) in l, [0, 1]."""
        return self._along(s)[1]

    def omega(self, s: ArrayLike) -> FloatArray:
        """Normal curvature (k,) in 1/l at abscissae s (k,) in l, [0, 1]."""
        return self._curved(s)[0]

    def eta(self, s: ArrayLike) -> FloatArray:
        """Ruling direction eta = tan(theta) (k,) at abscissae s (k,) in l, [0, 1]; 0 where the twist is free: sections
        are then square to the centreline."""
        found = self._curved(s)[1]
        return np.zeros_like(found) if self.has_free_twist else found

    def tau(self, s: ArrayLike) -> FloatArray:
        """Twist kappa_3 (k,) in 1/l at abscissae s (k,) in l, [0, 1]."""
        omega, eta = self._curved(s)
        return eta if self.has_free_twist else eta * omega

    def in_plane(self, s: ArrayLike) -> FloatArray:
        """In-plane curvature kappa_2 (k,) in 1/l at abscissae s (k,) in l, [0, 1]; 0 where the energy has none."""
        i, h, sign = self._places(s)
        q = self.parameters
        return np.zeros(i.size) if q.shape[1] == 4 else np.asarray(sign * (q[i, 4] * h + q[i, 5]))

    def _curved(self, s: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """omega (k,) and eta (k,), or the free twist, as `_along` has them, without the series of the centreline."""
        i, h, sign = self._places(s)
        q = self.parameters
        eta = q[i, 2] * h + q[i, 3]
        return sign * (q[i, 0] * h + q[i, 1]), eta if self.has_free_twist else sign * eta

    def _places(self, s: ArrayLike) -> tuple[NDArray[np.int64], FloatArray, FloatArray]:
        """Segments (k,) of abscissae, how far (k,) they lie behind their starts, and the sign (k,) beyond a seam."""
        at, sign = _surface.behind_seam(np.atleast_1d(np.asarray(self._on(s), dtype=float)), self.seam)
        joints = np.concatenate([[0.0], np.cumsum(self.problem.lengths)])
        i = np.clip(np.searchsorted(joints, at, side="right") - 1, 0, self.problem.lengths.size - 1)
        return i, at - joints[i], sign

    def pose(self, s: float) -> Pose:
        """Position (l) and frame at one abscissa s in l, [0, 1]."""
        r, frame, _, _ = self._along([s])
        return Pose(r[0], frame[0])

    @property
    def end(self) -> Pose:
        """The free end, s = 1."""
        points, frames = self.joints
        return Pose(points[-1], frames[-1])

    @property
    def middle(self) -> Pose:
        """The middle, s = 1/2."""
        return self.pose(0.5)

    @property
    def max_abs_eta(self) -> float:
        """Largest |eta|; 0 where the twist is free."""
        if self.has_free_twist:
            return 0.0
        q = self.parameters
        return float(max(np.abs(q[:, 3]).max(), abs(q[-1, 2] * self.problem.lengths[-1] + q[-1, 3])))

    @property
    def max_abs_eta_prime_w_half(self) -> float:
        """Largest |eta'| w / 2; 1 means that rulings meet on an edge (a Wunderlich event)."""
        if self.has_free_twist:
            return 0.0
        return float(np.abs(self.parameters[:, 2]).max() * self.problem.half_width)

    @cached_property
    def start(self) -> Force | None:
        """What the support at s = 0 exerts on the ribbon (zero where nothing is held); None where it is not determined
        (`forces_why`), or not finite in a state that is no equilibrium."""
        return None if self.forces_why else _finite(self.problem.start_force(self.x, self.rows))

    @cached_property
    def end_support(self) -> Force | None:
        """What the clamp at s = l exerts on the ribbon; None for a free or closed end, and as `start`."""
        return None if self.forces_why else _finite(self.problem.end_force(self.x, self.rows))

    @cached_property
    def walls(self) -> tuple[WallForce, ...]:
        """What every wall exerts on the ribbon; () where it is not determined, as `start`."""
        found = () if self.forces_why else self.problem.wall_forces(self.x, self.rows)
        return found if all(np.all(np.isfinite(wall.force)) for wall in found) else ()

    @cached_property
    def pairs(self) -> tuple[PairForce, ...]:
        """Where parts of the ribbon that are kept apart touch each other, and what they exert there."""
        problem = self.problem
        return problem.pair_forces(self.x, self.rows) if isinstance(problem, MixedProblem) and problem.apart else ()

    @property
    def numbers(self) -> dict[str, FloatArray]:
        """What is told of the state, by name: "forces.start", "forces.end" and "forces.walls.0" (3,) in D w / l^2,
        "forces.itself" (3,), what its parts at larger s exert on those at smaller s where they touch,
        "lines.0.n" (2 n,), the ends of the n lines along which it touches a wall, in l, "mean_pressures.walls.0" in
        D / l^3,
        "moments.start" and "moments.end" (3,) and "energy.elastic", "energy.gravity", "energy.tip", "energy.plates",
        "energy.total" in D w / l, "lowest_eigenvalue", "max_abs_eta", "max_abs_eta_prime_w_half"; of a free twist
        "max_abs_tau" (1/l) for those. Their changes between segments are their errors."""
        absent = {"tip": self.problem.tip is None, "plates": all(wall.stiffness is None for wall in self.problem.walls)}
        told = [name for name in ("elastic", "gravity", "tip", "plates", "total") if not absent.get(name)]
        found: dict[str, Any] = {f"energy.{name}": getattr(self.energy, name) for name in told}
        for name, held in (("start", self.start), ("end", self.end_support)):
            if held is not None:
                found |= {f"forces.{name}": held.force, f"moments.{name}": held.moment}
        found |= {f"forces.walls.{k}": wall.force for k, wall in enumerate(self.walls)}
        found |= {f"friction.{k}": wall.friction for k, wall in enumerate(self.walls) if wall.friction is not None}
        found |= {f"lines.{k}.{len(wall.lines)}": wall.lines.ravel() for k, wall in enumerate(self.walls)}
        pressures = {f"mean_pressures.walls.{k}": wall.mean_pressure for k, wall in enumerate(self.walls)}
        found |= {name: value for name, value in pressures.items() if value is not None}
        if self.pairs:
            found["forces.itself"] = sum(np.sign(pair.s_other - pair.s) * pair.force for pair in self.pairs)
        found["lowest_eigenvalue"] = self.lowest_eigenvalue
        if self.has_free_twist:
            found["max_abs_tau"] = np.abs(self.problem.joint_values(self.x)[1]).max()
        else:
            found |= {"max_abs_eta": self.max_abs_eta, "max_abs_eta_prime_w_half": self.max_abs_eta_prime_w_half}
        return {name: np.asarray(value, dtype=float) for name, value in found.items()}

    def surface(self, along: int = 400, across: int = 8) -> Surface:
        """Triangulation with `along` x `across` cells in material coordinates (S, v), units of l."""
        material = _surface.grid_material(self.problem.strip.relative_width, along, across)
        shape = along + 1, across + 1
        return Surface(self.rulings(material)[1], material, _surface.grid_triangles(*shape), shape)

    @property
    def si(self) -> InSI:
        """The result in m, N, N m, J, asked at abscissae in m; `RibbonInputError` where the strip does not know its
        stiffness, as one of `Strip.from_material` does."""
        return InSI(self, StripUnits.of(self.problem.strip))

    def __repr__(self) -> str:
        return shown.line(self)

    def _repr_html_(self) -> str:
        return shown.table(self)

    def plot(self, axes: Any = None) -> Any:
        """Draws the surface in space with matplotlib, on new 3-D axes where none are given; returns the axes."""
        return shown.plot(self, axes)

    def save(self, path: str | Path) -> Path:
        """Writes the numbers (.json), or numbers and arrays (.npz: what is in it, `ribbon.shown.save`); returns the
        path. `RibbonInputError` for another suffix."""
        return shown.save(self, path)

    def to_pyvista(self, along: int = 400, across: int = 8) -> Any:
        """The surface as `pyvista.PolyData` with S, v, omega, eta (or tau), units of l; ImportError without PyVista."""
        return shown.to_pyvista(self, along, across)


def _finite(found: Force | None) -> Force | None:
    """A force that is a number; None otherwise."""
    if found is None or not (np.all(np.isfinite(found.force)) and np.all(np.isfinite(found.moment))):
        return None
    return found
