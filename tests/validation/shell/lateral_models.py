"""The published strip on edge by our ribbon models: the whole branch, and Koiter's slope at its beginning."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.models import solve as solve_scene
from compare.scene.scene import Scene, load
from ribbon.energies.names import FREE, NAMES
from tests.reference import lateral_torsional as published

FloatArray = NDArray[np.float64]
Row = dict[str, Any]

#: Models in the order of their richness; those that know an edge held have it held, the others a free ruling.
MODELS = ("kirchhoff", "sadowsky_kt", "sadowsky", "wunderlich", "sano", "extensible", "finite")
HELD = ("wunderlich", "finite")
#: l / Leg of the experiments, of three more states, and of those where the models leave the axis.
LENGTHS = tuple(sorted([*published.points("experiment")[:, 0].tolist(), 2.6, 2.9, 3.5]))
ALONG = tuple(sorted([*LENGTHS, 2.45, 2.48, 2.5, 2.52, 2.54, 2.95, 2.97, 3.0, 4.7]))
#: The inextensible ones stand straight up to Sadowsky's critical length, 2.947.
LATE, LATE_FROM = ("sadowsky_kt", "sadowsky", "wunderlich"), 2.9
#: gamma over the critical one, less 1, of the states on which Koiter's slope is fitted.
BEYOND = (0.005, 0.01, 0.02, 0.03, 0.04)
assert set(MODELS) <= {*NAMES, *FREE}


class NoAnswer(AssertionError):
    """A solve that did not converge."""


def scene_of(length: float, width: float = published.WIDTH, **changes: Any) -> Scene:
    """The shipped scene with another length (in Leg) and width (mm)."""
    l, nu = published.LEG * length, published.POISSON
    values = {
        "strip.length": l, "strip.width": width, "strip.thickness": published.THICKNESS,
        "strip.gamma": (1 - nu**2) * length**3, "shell.edge_layer": 0.5 * published.THICKNESS,
    }  # fmt: skip
    return load("edge_published").replace(values | changes)


def of_model(scene: Scene, energy: str) -> Scene:
    """The scene with that energy, its edge held or its ruling free; the rod bends with Y I, as the paper's."""
    ruling = {} if energy in HELD else {"clamp.start.ruling": "free"}
    rod = {"model.stiffness": "plate"} if energy == "kirchhoff" else {}
    return scene.replace({"model.energy": energy} | ruling | rod)


def side(scene: Scene) -> tuple[float, bool | None]:
    """d / l, and whether the state is stable."""
    found = solve_scene(scene)
    if not found.ok and found.word != "unstable":
        raise NoAnswer(f"{scene.model.energy}, l = {scene.strip.length}: {found.message}")
    return abs(float(found.shape.centreline(np.array([1.0]))[0, 1])), found.stable


def along(energy: str) -> tuple[float, ...]:
    """l / Leg of the states of a model."""
    return tuple(x for x in ALONG if energy not in LATE or x >= LATE_FROM)


def row(energy: str, length: float, **changes: Any) -> Row:
    """One state of a ribbon model, its deflection nan where there is no answer; changes: keys of the scene."""
    try:
        d, stable = side(of_model(scene_of(length, **changes), energy))
    except NoAnswer as error:
        print(f"  {error}", flush=True)
        d, stable = np.nan, None
    return {"model": energy, "l_over_Leg": length, "d_over_Leg": length * d, "stable": stable}


def edge(length: float) -> tuple[float, float]:
    """What is left where `sadowsky_kt` gives no answer, the clamp rolled to one side: the free end's curvature over the
    largest, and the total energy over that of `sadowsky`, less 1; length in Leg."""
    rolled = scene_of(length).stages()[0]
    here, ruled = (solve_scene(of_model(rolled, name)) for name in ("sadowsky_kt", "sadowsky"))
    bend = np.abs(here.native.omega(np.linspace(0.0, 1.0, 401)))
    return float(bend[-1] / bend.max()), here.energy.total / ruled.energy.total - 1.0


def curve(rows: list[Row], model: str) -> FloatArray:
    """(n, 2): l / Leg, d / Leg of a model; nan where it gave no answer."""
    return np.array([[r["l_over_Leg"], r["d_over_Leg"]] for r in rows if r["model"] == model]).reshape(-1, 2)


def leaves(rows: list[Row], model: str) -> float:
    """l / Leg where the model leaves the axis: the square of d / l over gamma, through its first states beyond."""
    table = curve(rows, model)
    first = table[table[:, 1] > 1e-3][:3]
    gamma, squared = first[:, 0] ** 3, (first[:, 1] / first[:, 0]) ** 2
    return float(np.polynomial.Polynomial.fit(squared, gamma, 2)(0.0) ** (1 / 3))


def koiter(width: float, thickness: float) -> dict[str, float]:
    """The extensible ribbon's pitchfork at w / l, h / l: gamma_c, the k of Koiter's slope, and k as published.

    (d / l)^2 = (2 / k) (gamma / gamma_c - 1) just above gamma_c.
    """
    nu = published.POISSON
    strip = {"strip.length": 1.0, "strip.width": width, "strip.thickness": thickness, "shell.edge_layer": thickness}
    expected = (1 - nu**2) * published.gamma_rod(nu)
    gammas = expected * (1 + np.array(BEYOND))
    squares = [side(of_model(load("edge_published").replace(strip | {"strip.gamma": g}), "extensible"))[0] ** 2
               for g in gammas.tolist()]  # fmt: skip
    law = np.polynomial.Polynomial.fit(squares, gammas, 3).convert()  # gamma as a function of (d / l)^2
    critical, rise = law.coef[:2]
    lk = published.l_kappa_star(1.0, width, thickness, nu)
    return {
        "lk": lk, "gamma_c": critical / (1 - nu**2), "k": 2 * rise / critical, "published": published.koiter(lk, nu),
    }  # fmt: skip
