"""Which ribbon the shell with a clamped edge tends to as h/w falls: free or straight ruling, Sadowsky or Wunderlich."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from compare.measure.distance import grid_hausdorff
from compare.measure.grid import Grid
from compare.models import solve as solve_scene
from compare.models.shell import ShellShape
from compare.models.shell_process import run_shell, shell_problem
from compare.scene.scene import load
from compare.store.store import CaseStore
from tests.validation import page
from tests.validation.number import Number

RATIOS = (50.0, 200.0, 1000.0, 4000.0)
MESHES = ((150, 6), (300, 8))


SCENE = load("curl_4_3")
GRID = Grid.for_shape(SCENE, 15.0)


def ribbon(ruling: str, energy: str, elements: int = 48) -> Any:
    """Points (of `GRID`) of the ribbon with this ruling at the clamp, on graded segments."""
    keys = {"clamp.start.ruling": ruling, "model.energy": energy, "model.elements": elements}
    return GRID.of(solve_scene(SCENE.replace(keys), "ribbon").shape)


def rulings_apart(elements: int = 48) -> float:
    """Distance (in l) of the ribbons with a straight and a free ruling, Wunderlich's energy."""
    return grid_hausdorff(ribbon("straight", "wunderlich", elements), ribbon("free", "wunderlich", elements))


def energies_apart(elements: int = 48) -> float:
    """Distance (in l) of the ribbons by Wunderlich's and by Sadowsky's energy, straight ruling."""
    return grid_hausdorff(ribbon("straight", "wunderlich", elements), ribbon("straight", "sadowsky", elements))


PROBES = {"rulings_apart": rulings_apart, "energies_apart": energies_apart}


def run(out: Path) -> dict[str, Number]:
    store = CaseStore(out.parent / "out" / "validate" / "clamp_limit" / "cases")
    ribbons = {(r, e): ribbon(r, e) for r in ("straight", "free") for e in ("wunderlich", "sadowsky")}
    apart = {
        "rulings_apart": Number(rulings_apart(), abs(rulings_apart() - rulings_apart(24)), "l", ".2e"),
        "energies_apart": Number(energies_apart(), abs(energies_apart() - energies_apart(24)), "l", ".2e"),
    }
    numbers = dict(apart)
    rows = []
    last: dict[tuple[str, str], float] = {}
    for ratio in RATIOS:
        coarse, fine = (run_shell(shell_problem(SCENE, ratio, mesh), store) for mesh in MESHES)
        points = GRID.of(ShellShape(fine))
        error = grid_hausdorff(points, GRID.of(ShellShape(coarse)))
        last = {key: grid_hausdorff(points, ribbon) for key, ribbon in ribbons.items()}
        rows.append([
            f"{ratio:g}", f"{error:.1e}",
            *(f"{d:.2e}" for d in last.values()),
            f"{100 * fine.data['share']['membrane']:.3f}",
        ])  # fmt: skip
        for (ruling, energy), distance in last.items():
            numbers[f"{ruling}_{energy}_{ratio:g}"] = Number(distance, error, "l", ".2e")
        numbers[f"shell_error_{ratio:g}"] = Number(error, error, "l", ".1e")
    page.write(
        out / "clamp_limit.md", "What the clamped shell tends to", "python -m tests.validation clamp_limit",
        "Scene curl_4_3, shells on 300 x 8 graded elements, the whole edge held; shell error: distance to 150 x 6. "
        "Other columns: Hausdorff distance in l to ribbons on 48 graded segments. A ruling that is free at the clamp "
        "is another model: its distance stops falling; that to the straight ruling with Wunderlich's energy goes on. "
        f"Among the ribbons: straight to free ruling (Wunderlich) {apart['rulings_apart']} l, Wunderlich to Sadowsky "
        f"(straight) {apart['energies_apart']} l.",
        page.table(["w/h", "shell error", *(f"{r}, {e}" for r, e in ribbons), "membrane %"], rows),
    )  # fmt: skip
    if min(last, key=lambda key: last[key]) != ("straight", "wunderlich"):
        raise AssertionError(
            f"at w/h = {RATIOS[-1]:g} the nearest ribbon is not the straight one with Wunderlich: {last}"
        )
    return numbers
