"""What `ribbonbench solve` says, draws and writes of the shearable rod beyond what every state has."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from compare.measure.grid import Grid
from compare.models.base import BESIDE, State
from compare.models.quantities import Answered
from compare.models.quantities.antman import along
from compare.page import wording
from compare.page.drawing import pictured
from compare.page.page import Picture
from compare.page.remedies import message
from compare.page.si import array_with_si
from compare.pages.export.formats import array_csv
from compare.pages.presenter import Presenter
from compare.pages.result import spent
from compare.pages.written import Written, write_any
from compare.scene.scene import Scene
from compare.scene.units import Units
from compare.store.store import atomic_write_bytes

FloatArray = NDArray[np.float64]

PICTURE, ALONG = "antman.png", "rod.csv"

#: Columns of rod.csv, with their units: strains, and what the section carries, in its own frame.
COLUMNS = {
    "s": "l", "shear_x": "", "shear_y": "", "stretch": "", "kappa_1": "1/l", "kappa_2": "1/l", "kappa_3": "1/l",
    "force_x": "D w / l^2", "force_y": "D w / l^2", "force_z": "D w / l^2", "moment_x": "moment",
    "moment_y": "moment", "moment_z": "moment",
}  # fmt: skip

BEGAN = {
    "natural": "the rest shape, the loads raised",
    "seed": "a rod bent like the seed",
    "path": "the rest shape or the seed, then the stages of the path",
    BESIDE: "another model's shape",
}
"""Where a rod began, in words."""


def write(out: Path, scene: Scene, state: State, grid: Grid) -> Written:
    """antman.vtu, centreline.csv, rod.csv (strains and section forces), antman.png."""
    written = write_any(out, scene, state, grid)
    of = {name: unit for name, unit in COLUMNS.items() if unit}
    atomic_write_bytes(
        out / ALONG, array_csv(*array_with_si(list(COLUMNS), along(Answered(scene, state)), of, scene.units))
    )

    def draw() -> None:
        from compare.pages.pictures.rod import rod_picture

        rod_picture(out / PICTURE, scene, state, along(Answered(scene, state)))

    drawn = pictured(draw)
    end = state.end
    assert end is not None
    alt = (
        "The rod in space, its curvatures and the moments of its section along it; the end stands at "
        f"({', '.join(f'{c + 0.0:.3f}' for c in end.position)}) l."
    )
    caption = "The rod in space; curvatures (dashed at rest) and what the section carries, along it."
    files = {**written.files, ALONG: "strains, force and moment of the section along the rod"}
    return replace(written, files=files, pictures=(Picture(PICTURE, alt, caption),) if drawn else ())


def sentences(scene: Scene, state: State) -> list[str]:
    """The state in a sentence, and how much it shears and stretches."""
    error = "unknown" if state.error is None else f"{state.error:.1e} l"
    strain = np.abs(along(Answered(scene, state))[:, 1:4]).max(axis=0)
    found = [
        f"Shearable rod: {message(state)}; discretisation error {error}, {state.seconds.warm * 1e3:.3g} ms.",
        f"It shears by at most {max(strain[0], strain[1]):.1e} and stretches by at most {strain[2]:.1e}.",
    ]
    if not state.native.problem.conservative:
        found.append(
            "The moment at its tip keeps its direction: in space it has no potential, and stability is judged by all "
            "eigenvalues of an unsymmetric tangent."
        )
    return found


def rows(scene: Scene, state: State, units: Units | None = None) -> Sequence[tuple[str, str]]:
    """What `ribbonbench solve` prints: name and text. units: in which forces stand first; None: the scene's."""
    units = units or scene.units
    energy, end = state.energy, state.end
    assert energy is not None
    assert end is not None
    place = [
        ("energy", wording.energies(energy.to_dict(), units, state.errors.get("energy", {}))),
        ("s = l", wording.place(end.position, units)),
        *wording.supports(state, units),
    ]
    loads = []
    if np.any(scene.tip_force):
        loads.append(("force at the tip", wording.force(scene.tip_force, units)))
    if np.any(scene.tip_moment):
        loads.append(("moment at the tip", wording.moment(scene.tip_moment, units)))
    return [
        ("status", message(state)),
        *(place if state.is_equilibrium else []),
        *loads,
        ("residual", f"{state.residual:.1e} after {state.iterations} iterations"),
        ("began at", BEGAN[state.start]),
        ("model", f"antman, {state.size.label} elements of degree {state.size.degree}"),
        ("discretisation error", "unknown" if state.error is None else wording.length(units, state.error)),
        ("time", spent(state.seconds)),
    ]


PRESENTER = Presenter(rows=rows, sentences=sentences, write=write)
