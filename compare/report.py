"""The report of a comparison: one Markdown page beside its pictures, tables and surfaces."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from compare import export, figures, profile, results, tables
from compare.comparison import Comparison
from compare.store import atomic_write_json, atomic_write_text

REPORT = "report.md"


def write(out: Path, comparison: Comparison) -> Path:
    """Writes everything of a comparison into the folder `out`, each file atomically, and returns the report's path.

    report.md, result.json, table.csv, table.md, convergence.png, shapes.png, ribbon.png, centreline.csv, ribbon.vtu and
    shell_wNNNN.vtu (NNNN: w/h).
    """
    atomic_write_json(out / "result.json", results.comparison_result(comparison))
    atomic_write_text(out / "table.csv", tables.as_csv(comparison))
    atomic_write_text(out / "table.md", tables.as_markdown(comparison))
    equilibrium = comparison.ribbon.equilibrium
    export.write_ribbon(out / "ribbon.vtu", equilibrium, comparison.grid)
    atomic_write_text(out / "centreline.csv", export.centreline_csv(equilibrium))
    surfaces = ["ribbon.vtu"]
    for row, case in zip(comparison.rows, comparison.shells, strict=True):
        if case.ok:
            name = f"shell_w{row.width_to_thickness:g}.vtu"
            export.write_shell(out / name, case, comparison.grid)
            surfaces.append(name)
    figures.convergence(out / "convergence.png", comparison)
    figures.shapes(out / "shapes.png", comparison)
    profile.ribbon_profile(out / "ribbon.png", equilibrium, comparison.scene.title)
    return atomic_write_text(out / REPORT, _page(comparison, surfaces))


def _page(comparison: Comparison, surfaces: list[str]) -> str:
    scene = comparison.scene
    made = results.provenance(scene)
    packages = made["packages"]
    run = [case.data["provenance"] for case in comparison.shells if case.data.get("provenance")]
    shell: dict[str, Any] = run[0].get("versions", {}) if run else {}
    named = [name for name in ("ribbonbench", "numpy", "numba", "cyipopt") if name in packages]
    known = ", ".join(f"{name} {packages[name]}" for name in named)
    lines = [
        f"# {scene.title}",
        "",
        *(f"- {sentence}" for sentence in tables.verdict(comparison)),
        "",
        "## Ribbon against shell",
        "",
        tables.as_markdown(comparison),
        tables.LEGEND,
        "",
        "![Distance between the models, and the discretisation errors, against h/w](convergence.png)",
        "",
        "![The ribbon's shape on top of the shells', three views](shapes.png)",
        "",
        "## The ribbon",
        "",
        "![Normal curvature and ruling along the ribbon, and its side view](ribbon.png)",
        "",
        f"Surfaces for ParaView: {', '.join(f'`{name}`' for name in surfaces)}. Numbers: `result.json`, `table.csv`, "
        "`centreline.csv`.",
        "",
        "## How it was made",
        "",
        f"- `ribbonbench compare` on scene `{scene.name}` (hash {made['scene_hash'][:12]}), {made['time']}",
        f"- {known}; dolfinx {shell.get('dolfinx', 'not run')}, PETSc {shell.get('petsc', 'not run')}",
        f"- {made['cpu']}, {made['cores']} cores",
        "",
        "```toml",
        scene.to_toml().rstrip(),
        "```",
        "",
    ]
    return "\n".join(lines)
