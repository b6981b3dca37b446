"""Thesis 7.1: the weight at which a strip on edge falls over, of every model and the shell; where it then hangs."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

matplotlib.use("Agg")
from matplotlib import pyplot as plt

from compare.measure.mesh_limit import settled
from compare.store.store import atomic_write_text
from tests.validation import page
from tests.validation.number import Number, of_settled
from tests.validation.pieces import Pieces
from tests.validation.workbench import on_edge_linear as linear
from tests.validation.workbench.on_edge_models import (
    MODELS,
    POISSON,
    THICKNESS,
    FloatArray,
    Model,
    by_eigenvalue,
    by_shape,
    cells,
    fallen,
    sideways,
)

#: It takes no times that its page rests on.
ALONE = False

WIDTHS = (0.005, 0.02, 0.05, 0.1)
#: Widths at which elements are solved (a developable strip's search for its worst ruling takes long).
SOLVED = (0.02, 0.1)
#: Mesh of the shell (biquadratic); a finer one moves it by at most 1.5e-4 from w/l = 0.02 on (`shell_lateral`).
MESH = (40, 8)
#: Cells on which Wunderlich's free strip is measured to second order.
CELLS = (40, 80, 160)
#: CalculiX 2.20 (S8R shells 120 x 16, C3D20R solids 120 x 12 x 2) at w/l, an opinion from outside.
CALCULIX = {0.02: (13.797, 13.759), 0.05: (14.193, 14.186), 0.1: (14.830, 14.824)}
#: Sadowsky's strip with a free ruling (Audoly and Neukirch 2021).
SADOWSKY = 21.49
#: Figure 7.2: w, and rho h g / D; lengths.
PITCHFORK_WIDTH, LOAD = 0.02, 40.0
LENGTHS = (0.01, 0.3, 0.5, 0.6, 0.66, 0.69, 0.7, 0.71, 0.73, 0.77, 0.8, 0.81, 0.82, 0.83, 0.84, 0.87, 0.9, 0.95, 0.99)
PITCHFORKS = ("wunderlich, free", "finite, straight")
#: What must hold: `finite` with a straight ruling and the shell from w/l = 0.02 on; a solver's frontiers and the linear
#: one (elements: the discretisation error is in it).
NEAR_SHELL, NEAR_LINEAR = 0.01, 0.02
COLOURS = {
    "sadowsky": "tab:orange", "wunderlich": "tab:red", "kirchhoff": "tab:green", "sano": "tab:olive",
    "extensible": "tab:cyan", "finite": "tab:blue",
}  # fmt: skip

Values = dict[str, dict[float, float]]


def published(width: float) -> float:
    """18.2 (1 - nu) sqrt(1 + nu) + 14.5 w / l (thesis 7.1)."""
    return float(18.2 * (1 - POISSON) * np.sqrt(1 + POISSON) + 14.5 * width)


def linearised(model: Model, width: float, count: int = 160) -> float:
    """Gamma_c of the model's straight strip to second order (`on_edge_linear`)."""
    if model.developable:
        return linear.developable(width, model.energy == "wunderlich", model.ruling == "straight", count).gamma
    plate = 1 - POISSON**2
    bending, twist = plate, 2 * (1 - POISSON)
    keywords = dict(model.keywords)
    if model.energy == "sano":
        return linear.smooth(bending, twist)
    if model.energy == "kirchhoff":
        bending = plate if keywords.get("stiffness") == "plate" else 1.0
        twist *= linear.torsion(width / THICKNESS)
        return linear.smooth(bending, twist) * in_plane(bending, twist, width)
    a = np.sqrt(10) * width / (2 * THICKNESS)
    twist *= 1 - np.tanh(a) / a
    if model.energy == "extensible":
        return linear.smooth(bending, twist)
    gamma = linear.smooth(bending, twist, warping=width**2 / 12, held=model.ruling == "straight", first=0.01)
    return gamma * (in_plane(bending, twist, width) if keywords.get("in_plane") else 1.0)


def in_plane(bending: float, twist: float, width: float) -> float:
    """What bending in the strip's own plane before it falls adds to Gamma_c, as a factor (narrow beams: Timoshenko)."""
    across = (1 - POISSON**2) * (width / THICKNESS) ** 2
    return float(1 / np.sqrt((1 - bending / across) * (1 - twist / across)))


def shell(width: float) -> float:
    """The shell's Gamma_c by inertia (`shell_lateral`)."""
    from shellref.path.buckling import buckling
    from tests.validation.shell.shell_lateral import problem

    found = buckling(problem(width, THICKNESS, MESH, 2, 0.5 * THICKNESS))
    if found.critical is None or found.difference is None or found.difference > 1e-3:
        raise AssertionError(f"shell, w = {width:g}: {found.message}")
    return float(found.critical)


def pitchfork(model: Model, length: float) -> dict[str, Any]:
    """Figure 7.2 at one length: how far sideways the end hangs; a strip wider than half its length is no ribbon."""
    width, gamma, thickness = PITCHFORK_WIDTH / length, LOAD * length**3, THICKNESS / length
    if width >= 0.5:
        return {"sideways": 0.0, "status": ""}
    down = fallen(model, width, gamma, elements(model, width), thickness)
    return {"sideways": sideways(down) * length, "status": down.status.code}


def slug(model: Model) -> str:
    return model.name.replace(", ", "_")


def elements(model: Model, width: float) -> FloatArray:
    """Lengths of the elements, growing from w/10 at the clamp."""
    return cells(width, 20 if model.developable else 24)


def measured(kept: Pieces, models: tuple[Model, ...] = MODELS) -> tuple[Values, Values, Values]:
    """Gamma_c by linearisation, by the solver's eigenvalue, by the shape: model -> width -> value."""
    first: Values = {model.name: {} for model in models}
    second: Values = {model.name: {} for model in models}
    third: Values = {model.name: {} for model in models}
    for model in models:
        for width in WIDTHS:
            name = f"{slug(model)}_{width:g}"
            near = first[model.name][width] = kept.get(f"linear_{name}", lambda m=model, w=width: linearised(m, w))
            if width not in SOLVED:
                continue
            lengths = elements(model, width)
            second[model.name][width] = kept.get(
                f"eigenvalue_{name}", lambda m=model, w=width, c=lengths, g=near: by_eigenvalue(m, w, c, g)
            )
            third[model.name][width] = kept.get(
                f"shape_{name}", lambda m=model, w=width, c=lengths, g=near: by_shape(m, w, c, g)
            )
    return first, second, third


def shells(kept: Pieces) -> dict[float, float]:
    """Gamma_c of the shell: width -> value."""
    return {
        width: float(
            kept.get(f"shell_{width:g}_{MESH[0]}x{MESH[1]}", lambda w=width: {"critical": shell(w)})["critical"]
        )
        for width in WIDTHS
    }


#: Models whose weights to second order are computed again by `make test`; width -> its name.
PROBED = {"finite, straight": "finite", "finite, straight, in-plane": "finite_in_plane", "extensible": "extensible"}
NAMED = {0.02: "002", 0.05: "005", 0.1: "01"}
#: Part of the shell's critical weight that a finer mesh changes (`shell_lateral`).
SHELL_ERROR = 1.5e-4


def straight(name: str, width: float) -> float:
    """Gamma_c to second order of a model by its name."""
    return linearised(next(m for m in MODELS if m.name == name), width)


PROBES = {f"{word}_{NAMED[SOLVED[0]]}": lambda name=name: straight(name, SOLVED[0]) for name, word in PROBED.items()}


def numbers(values: tuple[Values, Values, Values], best: Mapping[float, float], cellwise: Any) -> dict[str, Number]:
    """Critical weights to second order, with the distance to the solver's eigenvalue (where elements were solved, else
    the largest of those), of the shell, and of Wunderlich's strip on cells doubled."""
    line, solved, _ = values
    named = {model.name: model for model in MODELS}
    found = {}
    for name in line:
        word = PROBED.get(name, slug(named[name]).replace("-", "_").replace(" ", ""))
        apart = {width: abs(line[name][width] - solved[name][width]) for width in SOLVED}
        for width, number in NAMED.items():
            error = apart.get(width, max(apart.values()))
            found[f"{word}_{number}"] = Number(line[name][width], error, "D w / l^2", ".3f")
    for width, number in NAMED.items():
        found[f"shell_{number}"] = Number(best[width], SHELL_ERROR * best[width], "D w / l^2", ".3f")
        for name in ("finite, straight", "finite, straight, in-plane"):
            gap = 100 * (line[name][width] / best[width] - 1)
            found[f"{PROBED[name]}_to_shell_{number}"] = Number(gap, 100 * SHELL_ERROR, "%", "+.2f")
    for width, by in cellwise.items():
        limit = settled([by[count] for count in CELLS])
        found[f"limit_{NAMED[width]}"] = of_settled(limit.record("D w / l^2"))
        for count in CELLS:
            left = abs(limit.value - by[count]) + limit.error if limit.settles else limit.error
            found[f"cells_{NAMED[width]}_{count}"] = Number(by[count], left, "D w / l^2", ".4f")
    return found


def run(out: Path) -> dict[str, Number]:
    kept = Pieces("on_edge")
    best = shells(kept)
    values = measured(kept)
    free = next(m for m in MODELS if m.name == "wunderlich, free")
    cellwise = {
        width: {
            count: kept.get(f"cells_{width:g}_{count}", lambda w=width, c=count: linearised(free, w, c))
            for count in CELLS
        }
        for width in (0.02, 0.1)
    }
    forks = {
        name: {
            length: kept.get(
                f"pitchfork_{name.replace(', ', '_')}_{length:g}",
                lambda n=name, x=length: pitchfork(next(m for m in MODELS if m.name == n), x),
            )
            for length in LENGTHS
        }
        for name in PITCHFORKS
    }
    check(values, best)
    folder = out / "on_edge"
    folder.mkdir(parents=True, exist_ok=True)
    atomic_write_text(folder / "frontier.csv", as_csv(values, best))
    frontier_figure(folder / "frontier.png", values, best)
    pitchfork_figure(folder / "pitchfork.png", forks)
    write(folder / "README.md", values, best, cellwise, forks)
    return numbers(values, best, cellwise)


def check(values: tuple[Values, Values, Values], best: Mapping[float, float]) -> None:
    """What the page says must hold, or it is not written."""
    by_line, by_value, by_form = values
    for name, line in by_line.items():
        for width in by_value[name]:
            gamma = line[width]
            for other in (by_value[name][width], by_form[name][width]):
                if abs(other / gamma - 1) > NEAR_LINEAR:
                    raise AssertionError(f"{name}, w = {width:g}: {other:.4f}, to second order {gamma:.4f}")
    for width in (0.02, 0.05, 0.1):
        gamma = by_value["finite, straight"].get(width, by_line["finite, straight"][width])
        if abs(gamma / best[width] - 1) > NEAR_SHELL:
            raise AssertionError(f"finite, w = {width:g}: {gamma:.4f}, shell {best[width]:.4f}")


def _digits(value: float | None, count: int = 3) -> str:
    return "" if value is None else f"{value:.{count}f}"


def as_csv(values: tuple[Values, Values, Values], best: Mapping[float, float]) -> str:
    """One row for each model and width; the shell's by mesh."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(["model", "width", "linear", "eigenvalue", "shape"])
    for name in values[0]:
        for width in WIDTHS:
            writer.writerow([name, f"{width:g}", *(_digits(v[name].get(width), 5) for v in values)])
    for width, gamma in best.items():
        writer.writerow(["shell", f"{width:g}", "", f"{gamma:.5f}", ""])
    return stream.getvalue()


def frontier_figure(path: Path, values: tuple[Values, Values, Values], best: Mapping[float, float]) -> None:
    """Figure 7.3: every frontier, lines by linearisation, circles by the eigenvalue, crosses by the shape."""
    fig, axes = plt.subplots(1, 2, figsize=(12, 6), layout="constrained", sharex=True)
    x = np.array(WIDTHS)
    for axis in axes:
        for model in MODELS:
            colour, style = COLOURS[model.energy], "--" if model.ruling == "free" else "-." if model.keywords else "-"
            axis.plot(x, [values[0][model.name][w] for w in WIDTHS], style, color=colour, lw=1.2, label=model.name)
            for solved, mark in ((values[1][model.name], "o"), (values[2][model.name], "x")):
                axis.plot(list(solved), list(solved.values()), mark, color=colour, ms=5, mfc="none")
        axis.plot(list(best), list(best.values()), "s-", color="k", ms=4, lw=1.6, label="shell")
        axis.plot(x, [published(w) for w in WIDTHS], ":", color="0.4", label="18.2 (1 - nu) sqrt(1 + nu) + 14.5 w/l")
        axis.axhline(SADOWSKY, color="0.6", ls="-.", lw=0.9, label=f"{SADOWSKY:g}")
        axis.set(xlabel="w / l", ylabel="Gamma_c")
        axis.grid(True, lw=0.3, alpha=0.6)
    axes[1].set(ylim=(12.6, 15.4), title="from below: the models that stretch, and the shell")
    axes[0].set_title("7.1: straight below, fallen above (lines: linear; o: eigenvalue; x: shape)")
    fig.legend(*axes[0].get_legend_handles_labels(), fontsize=8, loc="outside lower center", ncols=5)
    fig.savefig(path, dpi=110, metadata={"Software": None})
    plt.close(fig)


def pitchfork_figure(path: Path, forks: Mapping[str, Mapping[float, Mapping[str, Any]]]) -> None:
    """Figure 7.2: distance sideways against the length, both branches and the straight strip."""
    fig, axis = plt.subplots(figsize=(8, 5), layout="constrained")
    for k, (name, by_length) in enumerate(forks.items()):
        x = np.array(list(by_length))
        y = np.array([v["sideways"] for v in by_length.values()])
        axis.plot(x, y, ".-", color=f"C{k}", lw=1.2, ms=4, label=name)
        axis.plot(x, -y, ".-", color=f"C{k}", lw=1.2, ms=4)
        axis.plot([onset(by_length)[1], max(x)], [0, 0], "--", color=f"C{k}", lw=0.8)
    axis.set(
        xlabel="length l", ylabel="distance sideways of the end",
        title="7.2: w = 0.02, rho h = 40, D = g = 1 (dashed: straight, unstable)",
    )  # fmt: skip
    axis.legend()
    axis.grid(True, lw=0.3, alpha=0.6)
    fig.savefig(path, dpi=110, metadata={"Software": None})
    plt.close(fig)


def onset(by_length: Mapping[float, Mapping[str, Any]]) -> tuple[float, float]:
    """Last length at which the strip comes back upright, first at which it stays fallen."""
    down = [length for length, v in by_length.items() if v["sideways"] > 1e-3]
    return max(length for length in by_length if length < min(down)), min(down)


def write(
    path: Path,
    values: tuple[Values, Values, Values],
    best: Mapping[float, float],
    cellwise: Mapping[float, Mapping[int, float]],
    forks: Mapping[str, Mapping[float, Mapping[str, Any]]],
) -> None:
    """The page."""
    line, value, form = values
    rows = [
        [name, kind, *(_digits(v[name].get(w)) for w in WIDTHS)]
        for name in line
        for kind, v in (("linear", line), ("eigenvalue", value), ("shape", form))
    ]
    rows.append([f"shell Q2 {MESH[0]} x {MESH[1]}", "inertia", *(f"{best[w]:.3f}" for w in WIDTHS)])
    rows.append(["thesis, 18.2 ... + 14.5 w/l", "law", *(f"{published(w):.3f}" for w in WIDTHS)])
    for k, kind in enumerate(("S8R", "C3D20R")):
        rows.append(["CalculiX", kind, *(f"{CALCULIX[w][k]:.3f}" if w in CALCULIX else "" for w in WIDTHS)])
    gaps = [[name, *(f"{100 * (line[name][w] / best[w] - 1):+.2f}" for w in WIDTHS)] for name in line]
    free, straight = line["wunderlich, free"], line["wunderlich, straight"]
    start = line["sadowsky, free"][min(WIDTHS)]
    wide = [w for w in WIDTHS if w >= 0.02]
    squares = ", ".join(f"{(free[w] - start) / w**2:.1f}" for w in wide)
    lines = ", ".join(f"{(free[w] - start) / w:.2f}" for w in wide)
    steep = ", ".join(f"{(straight[w] - start) / w:.1f}" for w in wide)
    plain = ", ".join(f"{(line['sadowsky, straight'][w] - start) / w:.1f}" for w in wide)
    onsets = "; ".join(
        f"{name}: between l = {onset(by)[0]:g} and {onset(by)[1]:g} (Gamma = {LOAD * onset(by)[0] ** 3:.2f} and "
        f"{LOAD * onset(by)[1] ** 3:.2f})"
        for name, by in forks.items()
    )
    told = "; ".join(f"w/l = {w:g}: {settled([by[c] for c in CELLS]).text}" for w, by in cellwise.items())
    page.write(
        path, "Strips on edge, every model (thesis 7.1)", "python -m tests.validation on_edge",
        f"Wunderlich's strip with a free ruling to second order over {', '.join(map(str, CELLS))} cells: {told}. The "
        "elements' frontiers are of one mesh each, which is no limit: how far they are from those to second order is "
        "what is known of their error.",
        f"nu = {POISSON:g}, h/l = {THICKNESS:g}, clamped with the width upright, l = 1. Gamma_c in three ways. "
        "*linear*: the straight strip to second order, a Rayleigh quotient on 160 cells (400 where the twist is free), "
        "where the strip is developable least over all rulings that do not cross (`on_edge_linear`; no curvature "
        "elements). *eigenvalue*: where the lowest eigenvalue of `ribbon.solve`'s straight state vanishes, on 24 "
        "elements (developable: 20) that grow from w/10 at the clamp. *shape*: between weights at which the strip, its "
        "clamp rolled by 0.4 and upright again in steps, comes back upright and stays fallen, to 5e-4. The shell's by "
        "the inertia of its tangent ([its page](../shell_lateral.md)). kirchhoff: its bending stiffness is D w "
        "(matched) or the plate strip's Y I, and like *in-plane* it bends in its own plane before it falls; in "
        "*linear* a factor stands for that (narrow beams). Pieces are kept in out/validate/on_edge; delete them to "
        "measure anew.",
        page.table(["model", "by", *(f"w/l = {w:g}" for w in WIDTHS)], rows),
        "![Frontiers](frontier.png)",
        "## Beside the shell",
        "Linear over the shell's Gamma_c, less 1, in %:",
        page.table(["model", *(f"w/l = {w:g}" for w in WIDTHS)], gaps),
        "The inextensible ribbon falls at half as much weight again, whatever holds its ruling. A strip that may twist "
        "without bending falls near the shell, and what grows with the width is restrained warping at a clamp that "
        "holds the twist at zero: *finite, straight*. Where the clamp leaves the twist free most of that is "
        "missing. At w/l = 0.005 the strip is five times as wide as thick: bending in its own plane counts there.",
        "## Does Wunderlich's frontier grow with the width where the ruling is free?",
        "The thesis says linearly. It does not: it grows with the square of w/l, by 0.3 % at w/l = 0.1. From the limit "
        f"{start:.4f} of Sadowsky, (Gamma_c - limit) over (w/l)^2 is {squares} for w/l = "
        f"{', '.join(f'{w:g}' for w in wide)}, over w/l it is {lines}. The worst ruling is smooth along the strip, and "
        "a slope eta' costs Wunderlich a part (w eta')^2 / 12 more than Sadowsky. With a straight ruling it has to "
        f"turn from 0 over a length of w: the growth over w/l is {steep} (Wunderlich) and {plain} (Sadowsky, whose "
        "rulings may not cross either). So the thesis's two straight frontiers are found, nearly parallel to the "
        "shell's law, and both of its free ones are flat. Wunderlich, free, on finer cells:",
        page.table(
            ["w/l", *(f"{c} cells" for c in next(iter(cellwise.values())))],
            [[f"{w:g}", *(f"{v:.4f}" for v in cellwise[w].values())] for w in cellwise],
        ),
        "## Where it hangs (figure 7.2)",
        f"w = {PITCHFORK_WIDTH:g}, rho h = {LOAD:g}, D = g = 1, h = {THICKNESS:g} (for `finite` alone), l from 0.01 to "
        f"0.99, Gamma = 40 l^3. The strip comes back upright up to, and stays fallen from: {onsets}. Below l = 0.04 "
        "the strip would be wider than half its length; it is not solved.",
        "![Pitchfork](pitchfork.png)",
    )  # fmt: skip
