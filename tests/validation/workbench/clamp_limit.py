"""Which ribbon the shell with a clamped edge tends to as h/w falls: free or straight ruling, Sadowsky or Wunderlich."""

from __future__ import annotations

from pathlib import Path

from compare.measure.distance import grid_hausdorff
from compare.measure.grid import Grid
from compare.models import solve as solve_scene
from compare.models.shell import ShellShape
from compare.models.shell_process import run_shell, shell_problem
from compare.scene.scene import load
from compare.store.store import CaseStore
from tests.validation import page

RATIOS = (50.0, 200.0, 1000.0, 4000.0)
MESHES = ((150, 6), (300, 8))


def run(out: Path) -> None:
    store = CaseStore(out.parent / "out" / "validate" / "clamp_limit" / "cases")
    scene = load("curl_4_3")
    grid = Grid.for_shape(scene, 15.0)
    ribbons = {}
    for ruling in ("straight", "free"):
        for energy in ("wunderlich", "sadowsky"):
            keys = {"clamp.start.ruling": ruling, "model.energy": energy, "model.elements": 48}
            ribbons[ruling, energy] = grid.of(solve_scene(scene.replace(keys), "ribbon").shape)
    rows = []
    last: dict[tuple[str, str], float] = {}
    for ratio in RATIOS:
        coarse, fine = (run_shell(shell_problem(scene, ratio, mesh), store) for mesh in MESHES)
        points = grid.of(ShellShape(fine))
        last = {key: grid_hausdorff(points, ribbon) for key, ribbon in ribbons.items()}
        rows.append([
            f"{ratio:g}", f"{grid_hausdorff(points, grid.of(ShellShape(coarse))):.1e}",
            *(f"{d:.2e}" for d in last.values()),
            f"{100 * fine.data['share']['membrane']:.3f}",
        ])  # fmt: skip
    page.write(
        out / "clamp_limit.md", "What the clamped shell tends to", "python -m tests.validation clamp_limit",
        "Scene curl_4_3, shells on 300 x 8 graded elements, the whole edge held; shell error: distance to 150 x 6. "
        "Other columns: Hausdorff distance in l to ribbons on 48 graded segments. A ruling that is free at the clamp "
        "is another model: its distance stops falling; that to the straight ruling with Wunderlich's energy goes on.",
        page.table(["w/h", "shell error", *(f"{r}, {e}" for r, e in ribbons), "membrane %"], rows),
    )  # fmt: skip
    if min(last, key=lambda key: last[key]) != ("straight", "wunderlich"):
        raise AssertionError(
            f"at w/h = {RATIOS[-1]:g} the nearest ribbon is not the straight one with Wunderlich: {last}"
        )
