"""A session in a notebook, with sliders for what can be moved: a widget by anywidget, whose numbers are solved here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ribbon import law
from ribbon.errors import RibbonInputError
from ribbon.shown import FILM_CELLS, PAINT, label, upright

Session = Any
"""A `ribbon.Session`, which shows itself by this module."""

#: How far a clamp goes from where it is (l), a curvature at least (1/l), a weight and a force at the end at least.
REACH, CURL, WEIGHT, PULL = 0.3, 8.0, 10.0, 5.0
STEPS = 400
_AXES = "xyz"


@dataclass(frozen=True)
class Slider:
    """A number that can be moved: its name, its place now and between which two it goes, and its unit."""

    name: str
    value: float
    low: float
    high: float
    unit: str

    def to_dict(self) -> dict[str, Any]:
        """For the page."""
        return {**vars(self), "step": (self.high - self.low) / STEPS}


def sliders(session: Session) -> list[Slider]:
    """What of a session can be moved: weight, natural curvature, the place of the end clamp, the force at the end."""
    problem: Any = session.state.problem
    length, found = problem.strip.length, []
    if problem.gravity is not None:
        gamma = float(problem.strip.gamma)
        found.append(Slider("gamma", gamma, 0.0, max(WEIGHT, 3.0 * gamma), ""))
    natural = problem.strip.natural_curvature
    if not law.is_table(natural) and natural[0] == natural[1]:
        most = max(CURL / length, 2.0 * abs(natural[0]))
        found.append(Slider("natural curvature", float(natural[0]), -most, most, "1/length"))
    end = problem.end
    if end is not None and end.position is not None:
        for axis, at in zip(_AXES, np.asarray(end.position, dtype=float), strict=True):
            found.append(Slider(f"end {axis}", float(at), at - REACH * length, at + REACH * length, "length"))
    if problem.tip is not None:
        for axis, pull in zip(_AXES, np.asarray(problem.tip, dtype=float), strict=True):
            most = max(PULL, 3.0 * abs(pull))
            found.append(Slider(f"force {axis}", float(pull), -most, most, "D w / l^2"))
    return found


def move(session: Session, values: dict[str, float]) -> str:
    """Takes a session to these values of its sliders; what is to say of the move, "" where it arrived.

    Raises `RibbonInputError` for values that cannot be.
    """
    here = {one.name: one.value for one in sliders(session)}
    moved = {name: float(value) for name, value in values.items() if name in here and float(value) != here[name]}
    if not moved:
        return ""
    if not all(np.isfinite(list(moved.values()))):
        raise RibbonInputError("values", values, "are no numbers")
    new = {**here, **moved}
    keywords: dict[str, Any] = {}
    if "gamma" in moved:
        keywords["gamma"] = new["gamma"]
    if "natural curvature" in moved:
        keywords["natural_curvature"] = new["natural curvature"]
    if any(f"end {axis}" in moved for axis in _AXES):
        end: Any = session.state.problem.end
        keywords["end"] = replace(end, position=tuple(new[f"end {axis}"] for axis in _AXES))
    if any(f"force {axis}" in moved for axis in _AXES):
        keywords["tip"] = [new[f"force {axis}"] for axis in _AXES]
    way = session.move(**keywords, leap=True)
    return "" if way.ok else way.message


def places(session: Session) -> tuple[list[int], bytes]:
    """Numbers of points along and across, and their places (float32, one by one) in l, the weight along -z, about the
    middle of the state."""
    points = session.state.surface(*FILM_CELLS).grid @ upright(session.state)
    middle = 0.5 * (points.reshape(-1, 3).min(axis=0) + points.reshape(-1, 3).max(axis=0))
    return list(points.shape[:2]), np.ascontiguousarray(points - middle, "<f4").tobytes()


def told(session: Session) -> str:
    """The state in a line, with what holds the end."""
    state = session.state
    held = session.forces["end"] or session.forces["start"]
    stable = "stable" if state.stable else "not stable" if state.stable is False else "of unknown stability"
    force = "" if held is None else f", held with {np.linalg.norm(held.force):.4g} D w / l^2"
    return f"{label(state)}, {stable}{force}"


_SCRIPT = (
    PAINT
    + """
export default { render({ model, el }) {
  const [canvas, line, box] = ["canvas", "p", "div"].map((name) => document.createElement(name));
  canvas.style.cssText = "width:100%;height:22rem;background:#edf0f3;cursor:grab;touch-action:none";
  canvas.setAttribute("aria-label", "The strip: drag to turn");
  line.setAttribute("role", "status");
  const view = { azimuth: -1, elevation: 0.35 }, inputs = {};
  const draw = () => {
    const bytes = model.get("places"), [along, across] = model.get("grid");
    const found = new Float32Array(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength));
    paint(canvas, along, across, (i) => [found[3 * i], found[3 * i + 1], found[3 * i + 2]], view);
    line.textContent = model.get("text");
  };
  for (const one of model.get("sliders")) {
    const [row, input, output] = ["label", "input", "output"].map((name) => document.createElement(name));
    row.style.cssText = "display:flex;gap:.6rem;align-items:center";
    Object.assign(input, { type: "range", min: one.low, max: one.high, step: one.step, value: one.value });
    input.style.flex = "1";
    const tell = () => { output.textContent = `${Number(input.value).toPrecision(4)} ${one.unit}`; };
    input.addEventListener("input", () => {
      tell();
      model.set("values", { ...model.get("values"), [one.name]: Number(input.value) });
      model.save_changes();
    });
    row.append(one.name, input, output);
    box.append(row);
    inputs[one.name] = { input, tell };
    tell();
  }
  model.on("change:places", draw);
  model.on("change:text", draw);
  model.on("change:reached", () => {
    for (const [name, value] of Object.entries(model.get("reached"))) {
      const { input, tell } = inputs[name];
      if (document.activeElement !== input) { input.value = value; tell(); }
    }
  });
  turning(canvas, view, draw);
  el.append(canvas, line, box);
  requestAnimationFrame(draw);
} };
"""
)


def hand(session: Session) -> Any:
    """A widget with a slider for each number of `sliders`; the session goes with them. ImportError, which says what to
    install, without anywidget."""
    try:
        import anywidget
        import traitlets
    except ImportError as error:
        raise ImportError("show(live=True) needs anywidget: pip install 'ribbonbench[notebook]'") from error
    return _widget(anywidget.AnyWidget, traitlets)(session)


def _widget(base: type, traitlets: Any) -> Callable[[Session], Any]:
    """The widget's class; the libraries are those that `hand` has found."""

    class Hand(base):  # type: ignore[misc]
        """values: what the sliders ask for; reached: where the strip is; places, grid, text: what is drawn and said."""

        _esm = _SCRIPT
        sliders = traitlets.List().tag(sync=True)
        values = traitlets.Dict().tag(sync=True)
        reached = traitlets.Dict().tag(sync=True)
        grid = traitlets.List().tag(sync=True)
        places = traitlets.Bytes().tag(sync=True)
        text = traitlets.Unicode().tag(sync=True)

        def __init__(self, session: Session) -> None:
            self.session = session
            own = sliders(session)
            grid, drawn = places(session)
            values = {one.name: one.value for one in own}
            super().__init__(
                sliders=[one.to_dict() for one in own], values=values, reached=values, grid=grid, places=drawn,
                text=told(session),
            )  # fmt: skip
            self.observe(self._asked, names="values")

        def _asked(self, change: Any) -> None:
            try:
                said = move(self.session, change["new"])
            except RibbonInputError as error:
                said = str(error)
            self.grid, self.places = places(self.session)
            self.reached = {one.name: one.value for one in sliders(self.session)}
            self.text = told(self.session) + (f"; {said}" if said else "")

    return Hand
