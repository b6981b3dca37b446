"""docs/gallery.md: every shipped scene solved and drawn, with the command and the headline number."""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from compare.models import solve as solve_scene
from compare.models.base import Options, State
from compare.models.choice import chosen
from compare.models.scope import beyond_the_ribbon, has_shell, require_shell
from compare.pages.pictures import ribbon as profile
from compare.scene.scene import Scene, load, shipped
from compare.store.provenance import versions
from compare.store.store import atomic_write_bytes, atomic_write_text
from tests.validation.number import Number
from tests.validation.record import Pages
from tests.validation.workbench.gallery_headlines import HEADLINES

FloatArray = NDArray[np.float64]
#: Size of the pictures (pixels), colours in their palette, and the most that a file may have (bytes).
PIXELS, COLOURS, LARGEST = 440, 96, 60_000
_FACE, _BACK, _CLAMP, _WALL = "#4a86c8", "#e0b050", "#c2662d", "#9a9a9a"


def _plane(corners: FloatArray) -> Any:
    import pyvista

    return pyvista.PolyData(np.ascontiguousarray(corners, dtype=float), np.array([4, 0, 1, 2, 3]))


def _clamp_sign(position: FloatArray, frame: FloatArray, width: float, size: float) -> FloatArray:
    """A rectangle (4, 3) across the held edge, a little wider than the strip."""
    side, height = 0.5 * width + 0.03 * size, 0.05 * size
    x, y = frame[:, 0], frame[:, 1]
    return np.array([position + a * side * x + b * height * y for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))])


def _view(cloud: FloatArray, up: FloatArray) -> FloatArray:
    """Where the camera stands: mostly across the shape's horizontal main direction, from a little above."""
    flat = cloud - cloud.mean(axis=0)
    flat = flat - np.outer(flat @ up, up)
    _, _, directions = np.linalg.svd(flat, full_matrices=False)
    first = directions[0] - (directions[0] @ up) * up
    first /= np.linalg.norm(first)
    first *= np.sign(first[np.argmax(np.abs(first))])
    return 0.8 * np.cross(first, up) + 0.5 * first + 0.35 * up


def rod_picture(run: State) -> bytes:
    """PNG of a planar rod from the side: clamp orange, load at the tip ochre."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    line = run.shape.centreline(np.linspace(0.0, 1.0, 401)) - run.shape.position
    side, up = run.shape.frame[:, 1], run.shape.frame[:, 2]
    figure = Figure(figsize=(6.0, 6.0), dpi=2 * PIXELS / 6.0)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.plot(line @ side, line @ up, color=_FACE, lw=9, solid_capstyle="butt")
    axes.plot([-0.12, 0.12], [0.0, 0.0], color=_CLAMP, lw=9)
    axes.plot(line[-1] @ side, line[-1] @ up, "o", ms=34, color=_BACK)
    axes.set_aspect("equal")
    axes.set_axis_off()
    FigureCanvasAgg(figure).draw()
    image: NDArray[np.uint8] = np.asarray(figure.canvas.buffer_rgba())[:, :, :3].copy()  # type: ignore[attr-defined]
    return _small(image)


def picture(scene: Scene, run: State) -> bytes:
    """PNG of the ribbon in space: blue on the side of t_y, ochre on the other; clamps orange, walls grey."""
    e = run.native
    along = int(min(4000, 400 + 40 * np.abs(e.omega(np.linspace(0.0, 1.0, 400))).max()))
    clamps = [(position, frame) for position, frame, _ in profile.held(e)]
    return strip_picture(scene, e.surface(along, 12).grid, clamps, profile.walls(e))


def model_picture(scene: Scene, run: State) -> bytes:
    """The same of a strip of any model, as its shape has it."""
    shape = run.shape
    assert shape is not None
    half = 0.5 * scene.width
    grid = shape.points(np.linspace(0.0, 1.0, int(400 + 40 * min(shape.bend, 90.0))), np.linspace(-half, half, 13))
    ends = ((0.0, scene.start_position, scene.start_frame), (1.0, scene.end_position, scene.end_frame))
    # where a clamp has slid to is where its end is
    clamps = [(shape.pose(s).position, frame) for s, held, frame in ends if held is not None and frame is not None]
    return strip_picture(scene, grid, clamps, ())


def strip_picture(scene: Scene, grid: FloatArray, clamps: Any, walls: Any) -> bytes:
    """PNG of a surface (k, m, 3) with its clamps (position, frame) and walls (point, normal)."""
    if not os.environ.get("DISPLAY"):
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    import pyvista

    cloud = grid.reshape(-1, 3)
    size = float(np.ptp(cloud, axis=0).max())
    vertical = np.array([0.0, 0.0, 1.0]) if scene.up is None else np.asarray(scene.up, dtype=float)
    plotter: Any = pyvista.Plotter(off_screen=True, window_size=[3 * PIXELS, 3 * PIXELS])
    try:
        plotter.set_background("white")
        mesh = pyvista.StructuredGrid(*(np.ascontiguousarray(grid[:, :, k])[:, :, None] for k in range(3)))
        surface = mesh.extract_surface(algorithm=None).compute_normals(
            auto_orient_normals=False, consistent_normals=False, split_vertices=False, cell_normals=False
        )
        sides: dict[str, Any] = {"color": _FACE}
        if scene.closure is None:  # a Moebius band has one side
            sides["backface_params"] = {"color": _BACK, "ambient": 0.35}
        plotter.add_mesh(surface, smooth_shading=True, ambient=0.35, **sides)
        for position, frame in clamps:
            plotter.add_mesh(_plane(_clamp_sign(position, frame, scene.width, size)), color=_CLAMP, ambient=0.5)
        low, high = cloud.min(axis=0) - 0.06 * size, cloud.max(axis=0) + 0.06 * size
        for point, normal in walls:
            corners = profile.clipped(point - 2e-3 * size * normal, normal, low, high)
            plotter.add_mesh(_plane(corners), color=_WALL, opacity=0.35, ambient=0.6)
        centre = cloud.mean(axis=0)
        plotter.camera_position = [tuple(centre + 4.0 * _view(cloud, vertical)), tuple(centre), tuple(vertical)]
        plotter.reset_camera()
        image = plotter.screenshot(return_img=True)
    finally:
        plotter.close()
    return _small(image)


def _small(image: NDArray[np.uint8]) -> bytes:
    """The drawn part on a white square of PIXELS, with a palette."""
    rows, columns = (np.nonzero((image < 250).any(axis=2).any(axis=axis))[0] for axis in (1, 0))
    drawn = Image.fromarray(image[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1])
    inner = PIXELS - 24
    factor = min(inner / drawn.width, inner / drawn.height)
    drawn = drawn.resize(
        (max(1, round(drawn.width * factor)), max(1, round(drawn.height * factor))), Image.Resampling.LANCZOS
    )
    page = Image.new("RGB", (PIXELS, min(PIXELS, drawn.height + 24)), "white")
    page.paste(drawn, ((page.width - drawn.width) // 2, (page.height - drawn.height) // 2))
    buffer = io.BytesIO()
    page.quantize(COLOURS).save(buffer, "PNG", optimize=True)
    return buffer.getvalue()


def entry(scene: Scene, run: State) -> str:
    """The scene's section of the page."""
    e, headline = run.native, HEADLINES[scene.name]
    size = f"{len(e.problem.lengths)} segments, {e.problem.formulation}"
    shells = ", ".join(f"{ratio:g}" for ratio in require_shell(scene)) if has_shell(scene) else ""
    beside = f"; `ribbonbench compare {scene.name}` sets shells of w/h = {shells} beside it" if shells else ""
    stages = f" along {len(scene.path) + 1} stages" if scene.path else ""
    return "\n\n".join(
        [
            f"## {scene.name}",
            f"![{scene.title}: the ribbon at rest]({picture_name(scene)})",
            f"{scene.title}. `ribbonbench solve {scene.name}`{beside}.",
            f"**{headline.quantity}: {headline.text(e)}**. Beside it: {headline.beside(Pages())}.",
            f"{e.status.value.capitalize()}; {e.problem.energy}, {size}"
            f"{stages}; residual {e.residual:.0e}; {run.seconds.warm * 1e3:.3g} ms warm, the stability check included.",
        ]
    )


def rod_entry(scene: Scene, run: State) -> str:
    """The same of a scene that only the planar elastica knows."""
    r, headline = run.native, HEADLINES[scene.name]
    return "\n\n".join(
        [
            f"## {scene.name}",
            f"![{scene.title}: the rod at rest]({picture_name(scene)})",
            f"{scene.title}. `ribbonbench solve {scene.name}`.",
            f"**{headline.quantity}: {headline.text(run)}**. Beside it: {headline.beside(Pages())}.",
            f"{r.status.value.capitalize()}; elastica, {len(r.nodes) - 1} elements of degree {r.degree}; residual "
            f"{r.residual:.0e}; {run.seconds.warm * 1e3:.3g} ms warm, the stability check included.",
        ]
    )


def model_entry(scene: Scene, run: State) -> str:
    """The same of a scene of another model."""
    headline = HEADLINES[scene.name]
    beside = f"; `ribbonbench compare {scene.name}` sets a shell beside it" if has_shell(scene) else ""
    return "\n\n".join(
        [
            f"## {scene.name}",
            f"![{scene.title}: the strip at rest]({picture_name(scene)})",
            f"{scene.title}. `ribbonbench solve {scene.name}`{beside}.",
            f"**{headline.quantity}: {headline.text(run)}**. Beside it: {headline.beside(Pages())}.",
            f"{run.status.value.capitalize()}; {run.size.ladder}, {run.size.label} elements; residual "
            f"{run.residual:.0e}; {run.seconds.warm * 1e3:.3g} ms warm, the stability check included.",
        ]
    )


def picture_name(scene: Scene) -> str:
    """File of the picture, seen from docs/."""
    return f"gallery/{scene.name}.png"


#: Scenes whose headlines `make test` computes again; all have the ribbon's own state.
PROBED = ("curl_4_3", "coil_10_100")


def headline(name: str, finer: int = 1) -> float:
    """The number that stands for a scene of the ribbon, on `finer` times the scene's segments."""
    scene = load(name)
    scene = scene.replace({"model.elements": finer * scene.model.elements})
    return float(HEADLINES[name].value(solve_scene(scene, "ribbon").native))


PROBES = {name: lambda name=name: headline(name) for name in PROBED}


def number(name: str, value: float) -> Number:
    """A scene's headline, with its change on twice as many segments where that is measured."""
    error = abs(headline(name, 2) - value) if name in PROBED else None
    why = "" if error is not None else "of the scene's segments; the page says what it stands beside"
    return Number(value, error, "", HEADLINES[name].form, why)


def run(out: Path) -> dict[str, Number]:
    """Solves and draws all scenes; `out` is results/, the page goes to docs/ beside it."""
    docs = out.parent / "docs"
    (docs / "gallery").mkdir(exist_ok=True)
    entries, names = [], sorted(shipped())
    if set(names) != set(HEADLINES):
        raise AssertionError(f"headlines and scenes differ: {set(names) ^ set(HEADLINES)}")
    numbers: dict[str, Number] = {}
    for name in names:
        scene = load(name)
        if chosen(scene).name not in ("ribbon", "elastica"):
            found = solve_scene(scene, options=Options(repeats=None))
            if not found.ok:
                raise AssertionError(f"{name}: {found.message}")
            atomic_write_bytes(docs / picture_name(scene), model_picture(scene, found))
            entries.append(model_entry(scene, found))
            numbers[name] = number(name, HEADLINES[name].value(found))
            print(f"  {name}: {HEADLINES[name].text(found)}", flush=True)
            continue
        if beyond_the_ribbon(scene) is not None:
            rod = solve_scene(scene, "elastica", options=Options(error=True))
            if rod.word != "converged":
                raise AssertionError(f"{name}: {rod.message}")
            atomic_write_bytes(docs / picture_name(scene), rod_picture(rod))
            entries.append(rod_entry(scene, rod))
            numbers[name] = number(name, HEADLINES[name].value(rod))
            print(f"  {name}: {HEADLINES[name].text(rod)}", flush=True)
            continue
        found = solve_scene(scene, "ribbon", options=Options(repeats=None))
        if not found.ok:
            raise AssertionError(f"{name}: {found.message}")
        data = picture(scene, found)
        if len(data) > LARGEST:
            raise AssertionError(f"{name}: the picture has {len(data)} bytes")
        atomic_write_bytes(docs / picture_name(scene), data)
        entries.append(entry(scene, found))
        numbers[name] = number(name, HEADLINES[name].value(found.native))
        print(f"  {name}: {HEADLINES[name].text(found.native)}, {len(data)} bytes", flush=True)
    made = versions()
    packages = made["packages"]
    named = ", ".join(f"{key} {packages[key]}" for key in ("numpy", "numba", "cyipopt") if key in packages)
    head = (
        "Every scene that comes with the package, solved by the ribbon alone from its own seed or along its path (the "
        "daisies by the planar elastica, rods by the model that the scene names). "
        "Blue is the side of t_y, ochre the other (a Moebius band has one side); clamps are orange, walls grey. "
        "Lengths are in l, energies in D w / l. The numbers are those of the segments that the scene asks for; "
        "what stands beside them says how far that is from finer ones, from a shell or from a closed form. Times "
        "are medians of repeated solves in one process, kernels loaded, one core; a path is walked from its first "
        "stage each time."
    )
    listed = " | ".join(f"[{name}](#{name})" for name in names)
    cores = f"{made['cpu']}, {made['cores']} cores, one used"
    foot = f"Made {made['time'][:10]} with Python {made['python']}, {named}; {cores}."
    parts = [
        "# Gallery",
        "Remake: `OMP_NUM_THREADS=1 python -m tests.validation gallery`",
        head,
        listed,
        *entries,
        foot,
    ]
    atomic_write_text(docs / "gallery.md", "\n\n".join(parts) + "\n")
    return numbers
