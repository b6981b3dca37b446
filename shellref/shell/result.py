"""What a shell solve returns."""

from __future__ import annotations

import dataclasses
import json
import os
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import numpy as np

from shellref.shell import archive
from shellref.shell.options import ShellOptions
from shellref.shell.problem import ShellProblem
from shellref.shell.surface import ShellSurface


class ShellStatus(StrEnum):
    """How a solve ended; the message of the result names what to try."""

    CONVERGED = "converged"  # equilibrium at the full load; stable, unless `stable` is None: not known, or at a fold
    NOT_CONVERGED = "not_converged"  # steps fell under the minimum: the last good state and its load factor
    LIMIT_POINT = "limit_point"  # the load cannot be carried: the path turned back, and was followed as far as allowed
    STRETCHED = "stretched"  # membrane strain over `max_strain`: the clamps pull the strip beyond its length
    UNSTABLE = "unstable"  # equilibrium at the full load whose tangent has negative eigenvalues
    INVALID = "invalid"  # numerically converged but not a shell: folded over, or the director far from the normal


#: Fields of a `ShellResult` that lie on the surface, in shell.npz; all others are in shell.json.
ON_SURFACE = ("surface", "cell_midpoints", "energy_density")
#: Fields of a `ShellResult` that have another name in shell.json.
_KEYS = {"unknowns": "dofs"}


@runtime_checkable
class Stored(Protocol):
    """What says itself how it stands in shell.json."""

    def to_dict(self) -> dict[str, Any]: ...


def _plain(value: Any) -> Any:
    """A field as plain values."""
    if isinstance(value, Stored):
        return value.to_dict()
    if isinstance(value, StrEnum):
        return value.value
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, dict):
        return {name: _plain(one) for name, one in value.items()}
    return [_plain(one) for one in value] if isinstance(value, tuple | list) else value


@dataclass(frozen=True)
class LoadStep:
    """One attempted load step.

    stage: its name ("natural", "gravity", "clamps", a waypoint's); load: the fraction of the stage aimed at; method:
    "start", "load", "arc", "locate" (bisection on a bifurcation), "switch" (first point of a branch) or "relax"
    (leaving an unstable state). correction: largest component of the last Newton correction; negative: negative
    eigenvalues (None: not checked). factorisations, seconds: spent since the step before. values: what was observed of
    an accepted state (for a strip: `middle` and `end` of its centreline, units l).
    """

    stage: str
    load: float
    accepted: bool
    iterations: int
    correction: float
    negative: int | None
    note: str
    method: str
    factorisations: int
    seconds: float
    values: dict[str, Any]

    def to_dict(self) -> dict[str, Any]:
        """As plain values (a non-finite correction becomes null)."""
        data = dict(self.__dict__)
        data["correction"] = self.correction if np.isfinite(self.correction) else None
        return data


@dataclass(frozen=True)
class ShellResult:
    """A shell state with everything known about it.

    Energies in D w / l, forces in D w / l^2, moments in D w / l (about the clamp's position), lengths in l.
    elements: of the mesh that was used (refined when `accuracy` asked for it); discretisation: the estimated error.
    stable: None when it was not checked or is not known, or the lowest eigenvalue is zero to rounding (at a fold).
    load_factor, natural_factor: fractions of weight (without one: of the end's force) and natural curvature at
    this state; path_factor: of the stages.
    clamps: {"start": {"force", "moment"}, "end": ...} that each clamp exerts on the strip.
    walls: what each wall, then each obstacle, exerts on the strip: force (3,), moment (3,) about the origin, gap (l) of
    the nearest place (node), height (l) of a plate above its place at rest (None: rigid), places that it pushes:
    contacts (k, 2), their S and v, lines (m, 2), first and last S of what touches in one piece, points (k, 3), pushes
    (k,), force at each along the normal, pressure (k,), that over the place's area, in D / l^3 (of a line across larger
    on finer meshes), greatest_pressure of these, mean_pressure, the force over the width times the length of the lines,
    None where that is 0.
    contact: how well the conditions of contact hold (shellref.contact.report).
    pairs: where parts of the strip push each other: s, v of the node, s_other, v_other of its foot on the other part,
    force (3,) on the node, gap (l) between the middle surfaces.
    residual: `absolute` 2-norm of dE/du on the free unknowns (5 per node), `relative` the same over the 2-norm of the
    nodal weight and clamp reactions (at least 1); of a band that slides along itself `sliding`, the force in D w / l^2
    with which the mesh, and nothing else, resists that.
    energy: bending, membrane, shear, stabilisation (`NaghdiModel.energies`), their sum elastic, gravity, tip, total;
    share: bending, membrane, shear over the sum of these three.
    cell_midpoints (cells, 2), energy_density (cells, 3): bending, membrane, shear energy per area (D / l^2).
    """

    problem: ShellProblem
    options: ShellOptions
    status: ShellStatus
    message: str
    surface: ShellSurface
    elements: tuple[int, int]
    load_factor: float
    natural_factor: float
    path_factor: float
    stable: bool | None
    negative_eigenvalues: int | None
    lowest_eigenvalue: float | None
    residual: dict[str, float]
    newton_iterations: int
    factorisations: int
    steps: tuple[LoadStep, ...]
    energy: dict[str, float]
    share: dict[str, float]
    stabilisation: dict[str, float]
    clamps: dict[str, dict[str, np.ndarray]]
    cell_midpoints: np.ndarray
    energy_density: np.ndarray
    unknowns: int
    seconds: dict[str, float]
    memory_mb: float
    provenance: dict[str, Any]
    walls: tuple[dict[str, Any], ...]
    contact: dict[str, Any] | None
    pairs: tuple[dict[str, Any], ...]
    discretisation: dict[str, Any] | None = None

    @property
    def clamp_force(self) -> np.ndarray:
        """Force (3,) of the clamp at S = 0 on the strip, D w / l^2."""
        return self.clamps["start"]["force"]

    @property
    def clamp_moment(self) -> np.ndarray:
        """Its moment (3,) about the clamp's position, D w / l."""
        return self.clamps["start"]["moment"]

    def with_seconds(self, seconds: dict[str, float]) -> ShellResult:
        """The same result with other times."""
        return dataclasses.replace(self, seconds=seconds)

    def section(self, s: float) -> dict[str, Any]:
        """{position (3,), frame 3x3 with columns t_x t_y t_z} of the centreline at S = s, as lists."""
        place, frame = self.surface.centreline(np.array(s)), self.surface.frames(np.array(s))
        return {"position": place.tolist(), "frame": frame.tolist()}

    def to_dict(self) -> dict[str, Any]:
        """Every field but those on the surface, as plain values (shell.json; `unknowns` as "dofs"), and the centreline
        at its end and its middle."""
        fields = [field.name for field in dataclasses.fields(self) if field.name not in ON_SURFACE]
        found = {_KEYS.get(name, name): _plain(getattr(self, name)) for name in fields}
        return {**found, "end": self.section(1.0), "middle": self.section(0.5)}

    def save(self, folder: str | os.PathLike[str], name: str = "shell", extra: dict[str, Any] | None = None) -> None:
        """Write NAME.npz and then NAME.json (both atomic) into an existing folder; `extra` adds keys to the JSON."""
        folder = Path(folder)
        arrays = {field: getattr(self, field) for field in ON_SURFACE if field != "surface"}
        self.surface.save(folder / f"{name}.npz", **arrays)
        write_json(folder / f"{name}.json", {**self.to_dict(), **(extra or {})})


def write_json(path: Path, data: dict[str, Any]) -> None:
    """Write strict JSON (no NaN) through a temporary file in the same folder."""
    archive.write(path, (json.dumps(data, indent=1, allow_nan=False) + "\n").encode())
