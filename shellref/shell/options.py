"""How the shell is solved: tolerances, steps, what happens at instabilities, validated before dolfinx is touched."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

from shellref.inputs import ShellInputError, build, choice, integer, number, plain, positive

NATURAL_PATHS = ("exact", "stepped")
ITERATIONS = ("mixed", "plain")
ARC_LENGTH = ("auto", "always", "never")
ENGINES = ("kernels", "forms")
GOALS = ("surface", "end", "middle", "energy")
BEGIN = ("given", "stable", "checked")


@dataclass(frozen=True)
class ShellOptions:
    """How the shell is solved; every default is justified by a measurement in docs/shell.md.

    tolerance: largest component of the last Newton correction (positions in l, director in radians).
    max_newton: iterations allowed in one load step. first_step, min_step, max_step: fractions of a stage's load.
    growth: factor on the step after an easy solve; cut: factor after a failed one. max_steps: attempts in one stage.
    stabilisation: c in alpha = c (h / h_e)^2, the fraction of membrane and shear energy taken on the full rule.
    natural_path: "exact" starts from the natural planar curve, "stepped" rolls the flat strip up.
    iteration: "mixed" (geometric stiffness from the stress linearised at the previous iterate) or "plain" Newton.
    predict: extrapolate the last two states to start the next step.
    stability: check the inertia of the tangent at every converged step. kick: leave unstable states (else the path
    stays on its branch and the status is `unstable`). switch: at a bifurcation of a stable path go over to the
    bifurcated branch by arc length along the critical mode, instead of kicking beyond it.
    arc_length: "auto" (when load steps fail), "always" or "never". arc_step, max_arc: first and largest arc-length
    step, as root mean square displacement over the size of the surface. event_tolerance: limit points and bifurcations
    are located to this fraction of the stage's load.
    max_strain: a path stops where the membrane strain exceeds it (the shell's law is for small strains).
    accuracy: refine the mesh until the estimated error of the surface is below this (over l); None: the mesh as given.
    goal: what `accuracy` is asked of: "surface" (all columns, all rows are cut), or by dual-weighted estimates, which
    cut where they come from (shellref.path.graded), the position of the centreline's "end" or "middle", over l, or the
    total "energy", over the elastic one. max_cells: limit of that refinement.
    engine: "kernels" (elements in compiled loops, factored along the mesh; bodies that they do not know, and several
    processes, take forms all the same) or "forms" (dolfinx's and MUMPS, the definition that judges the kernels).
    begin: "given", "stable" or "checked", what is believed of a given start; coarse: walk the path on a coarse mesh and
    begin there, where no given start serves (both: shellref.path.begin; they are the worker's, not `solve`'s).
    """

    tolerance: float = 1e-8
    max_newton: int = 15
    first_step: float = 0.1
    min_step: float = 1e-4
    max_step: float = 0.25
    growth: float = 1.5
    cut: float = 0.4
    max_steps: int = 400
    stabilisation: float = 0.01
    natural_path: str = "exact"
    iteration: str = "mixed"
    predict: bool = True
    stability: bool = True
    kick: bool = True
    switch: bool = False
    arc_length: str = "auto"
    arc_step: float = 0.01
    max_arc: float = 0.05
    event_tolerance: float = 1e-3
    max_strain: float = 0.05
    accuracy: float | None = None
    goal: str = "surface"
    max_cells: int = 20000
    engine: str = "kernels"
    begin: str = "given"
    coarse: bool = False

    def __post_init__(self) -> None:
        def put(name: str, value: object) -> None:
            object.__setattr__(self, name, value)

        for name in ("tolerance", "first_step", "min_step", "max_step", "arc_step", "max_arc", "event_tolerance"):
            put(name, positive(name, getattr(self, name)))
        for name in ("max_newton", "max_steps"):
            put(name, integer(name, getattr(self, name), 1))
        for name in ("first_step", "min_step", "max_step"):
            if getattr(self, name) > 1:
                raise ShellInputError(name, getattr(self, name), "is a fraction of the full load: at most 1")
        put("growth", number("growth", self.growth))
        if self.growth < 1:
            raise ShellInputError("growth", self.growth, "must be 1 or more")
        put("cut", number("cut", self.cut))
        if not 0 < self.cut < 1:
            raise ShellInputError("cut", self.cut, "must lie between 0 and 1")
        put("stabilisation", number("stabilisation", self.stabilisation))
        if self.stabilisation < 0:
            raise ShellInputError("stabilisation", self.stabilisation, "must not be negative")
        put("natural_path", choice("natural_path", self.natural_path, NATURAL_PATHS))
        put("iteration", choice("iteration", self.iteration, ITERATIONS))
        put("arc_length", choice("arc_length", self.arc_length, ARC_LENGTH))
        put("engine", choice("engine", self.engine, ENGINES))
        put("begin", choice("begin", self.begin, BEGIN))
        put("max_strain", positive("max_strain", self.max_strain))
        if self.accuracy is not None:
            put("accuracy", positive("accuracy", self.accuracy))
        put("goal", choice("goal", self.goal, GOALS))
        put("max_cells", integer("max_cells", self.max_cells, 1))
        for name in ("predict", "stability", "kick", "switch", "coarse"):
            if not isinstance(getattr(self, name), bool):
                raise ShellInputError(name, getattr(self, name), "must be true or false")

    def to_dict(self) -> dict[str, Any]:
        """The options as plain numbers and strings (for JSON)."""
        return plain({f.name: getattr(self, f.name) for f in fields(self)})

    @classmethod
    def from_dict(cls, data: Any) -> ShellOptions:
        """Options from a mapping; an unknown key is an error."""
        return build(cls, "options", data)
