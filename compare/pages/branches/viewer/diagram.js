// A bifurcation diagram to click on: its points are the states of the viewer's slider, which stands before this file.
const $ = (id) => document.getElementById(id);
const SVG = "http://www.w3.org/2000/svg";
const chart = { data: JSON.parse($("data").textContent), chosen: 0, what: "", x: null, y: null };

const COMPONENT = { x: 0, y: 1, z: 2 };
function height(point, what) {
  const [name, axis] = what.split(" ");
  return axis ? point[name][COMPONENT[axis]] : point[name];
}

function drawn(name, attributes, parent) {
  const found = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) found.setAttribute(key, value);
  parent.append(found);
  return found;
}

// Round numbers between two ends, about five of them
function ticks(low, high) {
  const rough = (high - low) / 5, power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((k) => k * power).find((k) => k >= rough), found = [];
  for (let k = Math.ceil(low / step); k * step <= high + 1e-9 * step; k++) found.push(Number((k * step).toPrecision(12)));
  return found;
}

function extent(values) {
  const low = Math.min(...values), high = Math.max(...values);
  const wide = high - low > 1e-9 * Math.max(Math.abs(low), Math.abs(high)) ? 0.04 * (high - low) : 0.5;
  return [low - wide, high + wide];
}

// Runs of one stability of a branch, each joined to the point before it
function runs(points) {
  const found = [];
  let begin = 0;
  for (let k = 1; k <= points.length; k++) {
    const same = k < points.length && (points[k].unstable === 0) === (points[begin].unstable === 0);
    if (same || (k < points.length && ["fold", "branch_point", "ruling"].includes(points[k].kind))) continue;
    found.push([points.slice(Math.max(begin - 1, 0), k), points[begin].unstable === 0]);
    begin = k;
  }
  return found;
}

function mark(point, x, y, colour, parent) {
  const style = { stroke: colour, fill: colour, class: `mark ${point.kind}${point.settles === false ? " open" : ""}` };
  if (point.error !== null) {
    const [from, to] = [-1, 1].map((side) => chart.x(point.place + side * point.error));
    drawn("path", { d: `M${from} ${y}H${to}M${from} ${y - 4}v8M${to} ${y - 4}v8`, class: "bar", stroke: colour, fill: "none" }, parent);
  }
  const shape = {
    fold: () => drawn("rect", { ...style, x: x - 4, y: y - 4, width: 8, height: 8 }, parent),
    branch_point: () => drawn("circle", { ...style, cx: x, cy: y, r: 4.5 }, parent),
    ruling: () => drawn("path", { ...style, d: `M${x - 5} ${y}l5 -5l5 5l-5 5z` }, parent),
    event: () => drawn("path", { ...style, d: `M${x} ${y - 6}v12` }, parent),
  }[point.kind]();
  drawn("title", {}, shape).textContent = point.what || point.kind_text;
}

function plot() {
  const svg = $("plot"), { points, branches, key, unit } = chart.data;
  const [width, tall] = [svg.clientWidth, svg.clientHeight];
  if (!width || !tall) return;
  svg.replaceChildren();
  svg.setAttribute("viewBox", `0 0 ${width} ${tall}`);
  const [x0, x1] = extent(points.map((p) => p.parameter)), [y0, y1] = extent(points.map((p) => height(p, chart.what)));
  const left = 72, right = width - 14, top = 14, bottom = tall - 44;
  chart.x = (x) => left + (right - left) * (x - x0) / (x1 - x0);
  chart.y = (y) => bottom - (bottom - top) * (y - y0) / (y1 - y0);
  for (const x of ticks(x0, x1)) {
    drawn("path", { class: "grid", d: `M${chart.x(x)} ${top}V${bottom}` }, svg);
    drawn("text", { x: chart.x(x), y: bottom + 16, "text-anchor": "middle" }, svg).textContent = x;
  }
  for (const y of ticks(y0, y1)) {
    drawn("path", { class: "grid", d: `M${left} ${chart.y(y)}H${right}` }, svg);
    drawn("text", { x: left - 6, y: chart.y(y) + 4, "text-anchor": "end" }, svg).textContent = y;
  }
  drawn("text", { x: (left + right) / 2, y: tall - 8, "text-anchor": "middle" }, svg).textContent = `${key}${unit ? `, ${unit}` : ""}`;
  const upright = drawn("text", { transform: `translate(14 ${(top + bottom) / 2}) rotate(-90)`, "text-anchor": "middle" }, svg);
  upright.textContent = chart.what === "energy" ? "energy / (D w / l)" : `${chart.what} / l`;
  for (const branch of branches) {
    const own = points.slice(branch.first, branch.first + branch.count);
    const place = (p) => `${chart.x(p.parameter).toFixed(2)},${chart.y(height(p, chart.what)).toFixed(2)}`;
    for (const [run, stable] of runs(own))
      drawn("polyline", { points: run.map(place).join(" "), class: `run ${stable ? "stable" : "unstable"}`, stroke: branch.colour }, svg);
    for (const p of own) if (p.kind !== "regular") mark(p, chart.x(p.parameter), chart.y(height(p, chart.what)), branch.colour, svg);
  }
  names(svg, left + 8, top + 16);
  drawn("circle", { class: "chosen", r: 8 }, svg);
  point();
}

function names(svg, x, y) {
  const models = new Map(chart.data.branches.map((branch) => [branch.model, branch.colour]));
  [...models].forEach(([model, colour], k) => {
    drawn("path", { d: `M${x} ${y + 16 * k - 4}h22`, class: "run", stroke: colour }, svg);
    drawn("text", { x: x + 28, y: y + 16 * k }, svg).textContent = model;
  });
}

// Where the chosen point is in the diagram, and its numbers
// What finer elements say of a number: its error, or that it does not settle
function bar(p, name) {
  if (p[name] === null) return "";
  return p.numbers_settle ? ` ± ${p[name].toPrecision(1)}` : ` (not settled, ${p[name].toPrecision(1)})`;
}

function point() {
  const p = chart.data.points[chart.chosen], { key } = chart.data, ring = document.querySelector("#plot .chosen");
  if (ring) {
    ring.setAttribute("cx", chart.x(p.parameter));
    ring.setAttribute("cy", chart.y(height(p, chart.what)));
  }
  const about = chart.data.branches.find((branch) => branch.number === p.branch && branch.model === p.model);
  const told = (place) => place.map((x) => Number(x.toFixed(6))).join(", ");
  const rows = [
    ["branch", `${p.branch} of ${p.model}${about.image_of === null ? "" : `, image of ${about.image_of} by ${about.image_by}`}`],
    ["kind", p.what ? `${p.kind_text}: ${p.what}` : p.kind_text],
    [key, `${Number(p.place.toPrecision(p.kind === "regular" ? 8 : 10))}${p.error ? ` ± ${p.error.toPrecision(1)}` : ""}${p.settles === false ? " (not settled)" : ""}`],
    ["unstable modes", `${p.unstable}${p.unstable ? "" : " (stable)"}`],
    ["energy", `${Number(p.energy.toPrecision(8))}${bar(p, "energy_error")} D w / l`],
    ["middle", `${told(p.middle)} l`],
    ["end", `${told(p.end)} l`],
    ...(p.shape_error === null ? [] : [["centreline", `${bar(p, "shape_error")} l`]]),
  ];
  $("numbers").replaceChildren(...rows.flatMap(([name, text]) => [made("dt", null, { textContent: name }), made("dd", null, { textContent: text })]));
  document.body.dataset.chosen = chart.chosen;
}

// The slider of the viewer goes along the points; with one point there is none
function choose(k) {
  const slider = document.querySelector("#view input.path");
  if (slider) {
    slider.value = k;
    slider.dispatchEvent(new Event("input"));
  } else {
    chart.chosen = k;
    point();
  }
}

function nearest(event) {
  const box = $("plot").getBoundingClientRect(), [x, y] = [event.clientX - box.x, event.clientY - box.y];
  const far = chart.data.points.map((p) => Math.hypot(chart.x(p.parameter) - x, chart.y(height(p, chart.what)) - y));
  return far.indexOf(Math.min(...far));
}

function begin() {
  const { data } = chart, select = $("upright");
  for (const what of [...["end", "middle"].flatMap((name) => ["x", "y", "z"].map((axis) => `${name} ${axis}`)), "energy"])
    made("option", select, { value: what, textContent: what });
  select.value = chart.what = data.ordinate;
  select.addEventListener("change", () => { chart.what = select.value; plot(); });
  const view = new View($("view"), data.view), slider = document.querySelector("#view input.path");
  if (!view.start()) made("p", $("view"), { className: "note", textContent: "No WebGL here: the strip cannot be drawn, its numbers are told all the same." });
  if (slider) slider.addEventListener("input", () => { chart.chosen = Number(slider.value); point(); });
  let pressed = false;
  $("plot").addEventListener("pointerdown", (e) => { pressed = true; $("plot").setPointerCapture(e.pointerId); choose(nearest(e)); });
  $("plot").addEventListener("pointermove", (e) => { if (pressed) choose(nearest(e)); });
  for (const name of ["pointerup", "pointercancel"]) $("plot").addEventListener(name, () => { pressed = false; });
  DARK.addEventListener("change", () => view.redraw());
  new ResizeObserver(plot).observe($("plot"));
  plot();
  choose(0);
}

begin();
