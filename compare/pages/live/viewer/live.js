// A strip in the hand: sliders, the newest of whose values is solved (one request at a time), and what is told of the
// strip. All words from outside go into the page as text. The viewer of the reports stands before this file.
const $ = (id) => document.getElementById(id);
const STEPS = 1000, REST = 250; // places of a slider; milliseconds without a move after which the verdict is asked for
const MOST_POINTS = 4000; // of a curve
const KEY = `ribbonbench-live:${location.pathname}`;
const hand = {
  tab: "", sliders: [], values: {}, own: {}, gesture: 0, wanted: null, busy: false, judging: 0, timer: null, view: null,
  strip: null, handle: null, active: "", curves: new Map(), shown: 0, numbers: {}, length: 1, lost: false, stands: {}, walls: [],
};

// -- asking -----------------------------------------------------------------------------------------------------------
async function ask(what, body) {
  try {
    const answer = await fetch(what, {
      method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify({ tab: hand.tab, ...body }),
    });
    if (!answer.ok) throw new Error(`${answer.status}`);
    const found = await answer.json();
    if (found.gone) throw new Error(found.gone);
    hand.lost = false;
    return found;
  } catch (error) {
    lost();
    return null;
  }
}

// Nobody answers: what was set stays, and is told in words that a scene takes
function lost() {
  if (hand.lost) return;
  hand.lost = true;
  const set = Object.entries(hand.values).filter(([name, value]) => value !== hand.own[name]);
  const words = set.map(([name, value]) => `${name} = ${value}`).join(", ");
  say(`The server no longer answers. Start ribbonbench live again; what is kept is in its files${words ? `, and here stood ${words}` : ""}.`);
  document.body.dataset.lost = "1";
}

function say(text) {
  $("said").textContent = text;
  $("said").hidden = !text;
}

async function begin(values) {
  const kind = performance.getEntriesByType("navigation")[0];
  if (!values && kind && kind.type === "reload") hand.tab = sessionStorage.getItem(KEY) || "";
  const answer = await ask("begin", values ? { values } : {});
  if (!answer) return;
  if (answer.refused) { say(answer.refused); verdict("There is no strip to begin with.", "poor"); return; }
  hand.tab = answer.tab;
  sessionStorage.setItem(KEY, hand.tab);
  hand.length = answer.length;
  hand.sliders = answer.sliders;
  hand.own = Object.fromEntries(answer.sliders.map((s) => [s.name, s.value]));
  if (!hand.view) {
    stage(answer.view);
    build();
    $("notes").replaceChildren(...answer.notes.map((text) => made("li", null, { textContent: text })));
  }
  shown(answer, true);
  rest();
}

// -- moving -----------------------------------------------------------------------------------------------------------
function want(values) {
  Object.assign(hand.values, values);
  hand.wanted = { ...hand.values };
  window.clearTimeout(hand.timer);
  pump();
}

async function pump() {
  if (hand.busy || !hand.wanted) return;
  hand.busy = true;
  const values = hand.wanted;
  hand.wanted = null;
  const answer = await ask("move", { values, gesture: hand.gesture });
  hand.busy = false;
  if (answer && answer.unknown) { await begin(values); return; }
  if (answer && !answer.dropped) shown(answer, false);
  if (hand.wanted) pump();
  else if (answer) rest();
}

function rest() {
  window.clearTimeout(hand.timer);
  hand.timer = window.setTimeout(judge, REST);
}

async function judge() {
  const mine = ++hand.judging;
  set(hand.stands); // what was refused, and how far a way was not gone
  const answer = await ask("judge", {});
  if (!answer || mine !== hand.judging || hand.wanted || hand.busy) return;
  if (answer.dropped || answer.refused) { if (answer.dropped) rest(); return; }
  verdict(answer.verdict, answer.grade);
  $("estimate").textContent = answer.estimate;
  $("doubt").textContent = answer.doubt;
  $("doubt").classList.toggle("doubtful", Boolean(answer.doubt));
  document.body.dataset.judged = hand.shown;
}

function verdict(text, grade) {
  $("verdict").textContent = text;
  $("verdict").className = `answer ${grade}`;
}

// -- showing ----------------------------------------------------------------------------------------------------------
function shown(answer, first) {
  const box = (name) => document.querySelector(`.slider[data-name="${CSS.escape(name)}"]`);
  if (answer.refused) {
    say(answer.refused);
    const name = hand.active;
    if (name && box(name)) box(name).classList.add("refused");
    document.body.dataset.refused = Number(document.body.dataset.refused || 0) + 1;
    return;
  }
  for (const one of document.querySelectorAll(".slider.refused")) one.classList.remove("refused");
  hand.numbers = answer.numbers;
  hand.stands = answer.values;
  hand.handle = answer.handle;
  drawWalls(answer.walls || []);
  draw(numbers(answer.places, Float32Array));
  $("rows").replaceChildren(...answer.rows.flatMap(([name, text]) => [made("dt", null, { textContent: name }), made("dd", null, { textContent: text })]));
  $("undo").disabled = !answer.undo;
  const stopped = answer.reached !== undefined && answer.reached < 1;
  if (stopped) say(`No equilibrium was found beyond ${(100 * answer.reached).toFixed(1)} % of the way; the strip stands there. ${answer.why}`);
  else if (answer.jumps && answer.jumps.length) say("The strip jumped to another shape on the way; undo takes it back.");
  else say(first && answer.why ? answer.why : "");
  if (first || stopped) set(answer.values);
  verdict(answer.ok ? "A stable equilibrium; its verdict follows when the hand rests." : "The strip would not stay in this state.", answer.ok ? "" : "poor");
  $("doubt").textContent = "";
  if (answer.ms !== undefined) $("time").textContent = `solved in ${answer.ms.toFixed(1)} ms`;
  if (!first && hand.active) {
    if (!hand.curves.has(hand.active)) hand.curves.set(hand.active, []);
    const curve = hand.curves.get(hand.active);
    curve.push({ x: answer.values[hand.active], numbers: answer.numbers, jump: Boolean(answer.jumps && answer.jumps.length) });
    if (curve.length > MOST_POINTS) curve.shift();
  }
  choices();
  plot();
  hand.shown += 1;
  Object.assign(document.body.dataset, { shown: hand.shown, numbers: JSON.stringify(answer.numbers), values: JSON.stringify(answer.values) });
}

// The first view, and where the strip is in it
function stage(data) {
  const figure = $("view");
  figure.classList.add("view");
  hand.view = new View(figure, data);
  const view = hand.view, before = view.draw;
  view.draw = () => { before.call(view); place(); };
  hand.strip = view.surfaces[0];
  hand.walls = view.surfaces.filter((s) => s.kind === "wall");
  if (!view.start() && !figure.querySelector(".note")) made("p", figure, { className: "note", textContent: "No WebGL here: the strip cannot be drawn, its numbers are told all the same." });
  if ($("handle")) $("handle").remove();
  const grip = made("button", figure.querySelector(".stage"), { type: "button", className: "handle", id: "handle", hidden: true });
  grip.setAttribute("aria-label", "end clamp: drag to move it in the plane of the picture");
  grip.tabIndex = -1;
  let last = null;
  grip.addEventListener("pointerdown", (e) => {
    grip.setPointerCapture(e.pointerId);
    last = [e.clientX, e.clientY];
    hand.gesture += 1;
    e.stopPropagation();
  });
  grip.addEventListener("pointermove", (e) => {
    if (!last) return;
    const { right, up } = view.camera(), size = 2 * depth(hand.handle) * Math.tan(FIELD_OF_VIEW / 2) / view.stage.clientHeight;
    const moved = add(add([0, 0, 0], right, (e.clientX - last[0]) * size), up, -(e.clientY - last[1]) * size);
    last = [e.clientX, e.clientY];
    const names = [0, 1, 2].map((k) => `clamp.end.position.${k}`), most = moved.map(Math.abs);
    hand.active = names[most.indexOf(Math.max(...most))];
    const values = Object.fromEntries(names.map((name, k) => [name, hand.values[name] + hand.length * moved[k]]));
    set(values);
    want(values);
  });
  for (const name of ["pointerup", "pointercancel"]) grip.addEventListener(name, () => { last = null; });
}

function depth(point) {
  const { eye, away } = hand.view.camera();
  return -dot(add(point, eye, -1), away);
}

// The handle of the end clamp goes with the picture
function place() {
  const grip = $("handle"), view = hand.view;
  if (!grip) return;
  grip.hidden = !(hand.handle && view.gl && "clamp.end.position.0" in hand.own);
  if (grip.hidden) return;
  const { eye, right, up, aspect } = view.camera(), from = add(hand.handle, eye, -1), far = depth(hand.handle) * Math.tan(FIELD_OF_VIEW / 2);
  grip.style.left = `${50 * (1 + dot(from, right) / (far * aspect))}%`;
  grip.style.top = `${50 * (1 - dot(from, up) / far)}%`;
}

// Where walls are drawn goes with them and with the strip
function drawWalls(nets) {
  hand.walls.forEach((wall, k) => {
    if (!nets[k]) return;
    const places = numbers(nets[k], Float32Array);
    wall.fine = { ...wall.fine, places, normals: normalsOf(places, wall.fine.triangles, []) };
    wall.shape(0, 1);
  });
}

function draw(places) {
  const { strip, view } = hand;
  strip.fine = { ...strip.fine, places, normals: normalsOf(places, strip.fine.triangles, strip.fine.joined) };
  strip.shape(0, 1);
  const { right, up, away, distance, aspect } = view.camera(), tangent = Math.tan(FIELD_OF_VIEW / 2);
  let far = 0, needed = 0;
  for (let i = 0; i < places.length; i += 3) {
    const point = [places[i], places[i + 1], places[i + 2]], there = add(point, view.target, -1);
    far = Math.max(far, Math.hypot(...add(point, view.data.centre, -1)));
    needed = Math.max(needed, dot(there, away) + 1.12 * Math.max(Math.abs(dot(there, up)), Math.abs(dot(there, right)) / aspect) / tangent);
  }
  view.data.radius = Math.max(view.data.radius, far); // nothing is cut off, and nothing leaves a view that is not zoomed
  if (view.zoom === 1 && needed > distance) for (const name of ["high", "wide"]) view.data[name] *= needed / distance;
  view.recolour();
}

// -- sliders ----------------------------------------------------------------------------------------------------------
const at = (s, value) => clamp(STEPS * (s.log ? Math.log(value / s.low) / Math.log(s.high / s.low) : (value - s.low) / (s.high - s.low)), 0, STEPS);
const from = (s, k) => Number((s.log ? s.low * (s.high / s.low) ** (k / STEPS) : s.low + (s.high - s.low) * k / STEPS).toPrecision(6));

function build() {
  $("sliders").replaceChildren();
  for (const s of hand.sliders) {
    const row = made("div", $("sliders"), { className: "slider", title: s.about });
    row.dataset.name = s.name;
    const name = made("span", row, { textContent: s.label });
    if (s.unit) made("small", name, { textContent: ` ${s.unit}` });
    const slide = made("input", row, { type: "range", min: 0, max: STEPS, step: 1 });
    const typed = made("input", row, { type: "text", inputMode: "decimal", autocomplete: "off" });
    slide.setAttribute("aria-label", `${s.name}: ${s.label}`);
    typed.setAttribute("aria-label", `${s.name} as a number`);
    const start = () => { hand.gesture += 1; hand.active = s.name; };
    slide.addEventListener("pointerdown", start);
    slide.addEventListener("keydown", (e) => { if (!e.repeat) start(); });
    slide.addEventListener("input", () => {
      if (hand.active !== s.name) start();
      const value = from(s, Number(slide.value));
      typed.value = value;
      want({ [s.name]: value });
    });
    slide.addEventListener("pointerup", () => { if (!hand.wanted && !hand.busy) set(hand.values); });
    typed.addEventListener("change", () => {
      start();
      const value = typed.value.trim() === "" ? NaN : Number(typed.value); // what is no number goes as null, and is refused
      if (Number.isFinite(value)) slide.value = at(s, value);
      const before = hand.values[s.name];
      want({ [s.name]: value });
      if (!Number.isFinite(value)) hand.values[s.name] = before;
    });
  }
}

// Sliders and numbers as the strip has them
function set(values) {
  Object.assign(hand.values, values);
  for (const row of document.querySelectorAll(".slider")) {
    const s = hand.sliders.find((one) => one.name === row.dataset.name), value = hand.values[s.name];
    if (value === undefined) continue;
    const [slide, typed] = row.querySelectorAll("input");
    slide.value = at(s, value);
    if (document.activeElement !== typed) typed.value = Number(value.toPrecision(8));
  }
}

// -- a shell beside it ------------------------------------------------------------------------------------------------
async function watch() {
  const answer = await ask("laid", {});
  if (answer && answer.running) {
    $("beside").textContent = `The shell of w/h = ${answer.ratio} is being solved. ${answer.said || ""}`;
    window.setTimeout(watch, 500);
    return;
  }
  $("shell").disabled = false;
  if (!answer) return;
  $("beside").textContent = answer.refused || (answer.text ? `The shell, where it was asked for: ${answer.text} (${answer.folder}).` : "");
  document.body.dataset.shell = answer.refused ? "refused" : "there";
  if (!answer.view) return;
  const turned = (({ azimuth, elevation }) => ({ azimuth, elevation }))(hand.view);
  hand.view.stop();
  hand.view.box.remove();
  stage(answer.view);
  for (const s of hand.view.surfaces) s.shown = s.tick.checked = true;
  Object.assign(hand.view, turned);
  hand.view.recolour();
}

// -- the curve --------------------------------------------------------------------------------------------------------
const SIZES = { "force at s = l": "force.end", "force at s = 0": "force.start", "moment at s = l": "moment.end", "moment at s = 0": "moment.start" };

function value(found, what) {
  const size = SIZES[what];
  if (!size) return found[what];
  const parts = ["x", "y", "z"].map((axis) => found[`${size}.${axis}`]);
  return parts.some((x) => x === undefined || x === null) ? undefined : Math.hypot(...parts);
}

const unitOf = (what) => (/^force/.test(what) ? "D w / l²" : /^(moment|energy)/.test(what) ? "D w / l" : /^(end|middle)/.test(what) ? "l" : "");

function choices() {
  const select = $("against");
  const names = [...Object.keys(SIZES), ...Object.keys(hand.numbers)].filter((name) => typeof value(hand.numbers, name) === "number");
  const known = [...select.options].map((o) => o.value);
  if (known.slice(1).join() === names.join()) return;
  const chosen = select.value;
  select.replaceChildren(made("option", null, { value: "", textContent: "what works on it" }), ...names.map((name) => made("option", null, { value: name, textContent: name })));
  select.value = names.includes(chosen) ? chosen : "";
}

// What a slider works against: the force of a place, the moment of a turn, of others the energy
function partner(name) {
  const found = /^clamp\.(start|end)\.(position|turn)\.(\d)$/.exec(name);
  const what = found ? `${found[2] === "turn" ? "moment" : "force"}.${found[1]}.${"xyz"[found[3]]}` : "energy.total";
  return what in hand.numbers ? what : "energy.total";
}

const neat = (x, span) => (Math.abs(x) < 1e-6 * span ? "0" : String(Number(x.toPrecision(4))));

function plot() {
  const canvas = $("plot"), ratio = Math.min(window.devicePixelRatio || 1, 2), name = hand.active;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  Object.assign(canvas, { width: Math.round(width * ratio), height: Math.round(height * ratio) });
  const context = canvas.getContext("2d"), style = window.getComputedStyle(document.body);
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.font = "12px sans-serif";
  context.fillStyle = style.color;
  const what = $("against").value || partner(name);
  const points = (hand.curves.get(name) || []).map((p) => [p.x, value(p.numbers, what), p.jump]).filter(([, y]) => typeof y === "number");
  canvas.dataset.points = points.length;
  canvas.dataset.what = what;
  if (points.length < 2) {
    context.fillText("Move a slider: here what works on it is drawn against it.", 12, 24);
    return;
  }
  const range = (k) => {
    const all = points.map((p) => p[k]);
    let low = Math.min(...all), high = Math.max(...all);
    if (!(high - low > 1e-9 * Math.max(Math.abs(low), Math.abs(high), 1e-12))) { low -= 0.5; high += 0.5; }
    return [low, high];
  };
  const [x0, x1] = range(0), [y0, y1] = range(1), left = 70, bottom = height - 34, right = width - 16, top = 26;
  const X = (x) => left + (right - left) * (x - x0) / (x1 - x0), Y = (y) => bottom - (bottom - top) * (y - y0) / (y1 - y0);
  context.strokeStyle = style.color;
  context.lineWidth = 1;
  context.strokeRect(left, top, right - left, bottom - top);
  for (const y of [y0, (y0 + y1) / 2, y1]) { context.textAlign = "right"; context.fillText(neat(y, y1 - y0), left - 6, Y(y) + 4); }
  for (const x of [x0, (x0 + x1) / 2, x1]) { context.textAlign = x === x0 ? "left" : x === x1 ? "right" : "center"; context.fillText(neat(x, x1 - x0), X(x), bottom + 14); }
  context.textAlign = "center";
  const s = hand.sliders.find((one) => one.name === name);
  context.fillText(`${name}${s && s.unit ? `, ${s.unit}` : ""}`, (left + right) / 2, height - 6);
  context.textAlign = "left";
  context.fillText(`${what}${unitOf(what) ? `, ${unitOf(what)}` : ""}`, left, top - 8);
  context.lineWidth = 2;
  points.forEach(([x, y, jump], k) => {
    if (k === 0) return;
    context.beginPath();
    context.strokeStyle = jump ? "#d55e00" : "#1f5fa8";
    context.setLineDash(jump ? [4, 4] : []);
    context.moveTo(X(points[k - 1][0]), Y(points[k - 1][1]));
    context.lineTo(X(x), Y(y));
    context.stroke();
  });
  context.setLineDash([]);
  const [x, y] = points[points.length - 1];
  context.beginPath();
  context.fillStyle = "#d55e00";
  context.arc(X(x), Y(y), 4, 0, 7);
  context.fill();
}

// -- buttons ----------------------------------------------------------------------------------------------------------
function buttons() {
  DARK.addEventListener("change", () => { if (hand.view) hand.view.redraw(); });
  $("undo").addEventListener("click", async () => {
    hand.gesture += 1;
    const answer = await ask("back", {});
    if (!answer) return;
    if (answer.refused) { say(answer.refused); return; }
    shown(answer, true);
    rest();
  });
  $("reset").addEventListener("click", () => { hand.gesture += 1; set(hand.own); want(hand.own); });
  $("keep").addEventListener("click", async () => {
    const answer = await ask("keep", {});
    if (!answer) return;
    if (answer.refused) { say(answer.refused); return; }
    made("pre", $("kept"), { textContent: answer.command });
    made("p", $("kept"), { className: "note", textContent: answer.same ? `Kept as ${answer.file}; solved again it comes back to this state.` : `Kept as ${answer.file}, but a fresh solve of it does not come back to this state.` });
    document.body.dataset.kept = answer.file;
  });
  $("film").addEventListener("click", async () => {
    const answer = await ask("film", {});
    if (!answer) return;
    if (answer.refused) { say(answer.refused); return; }
    made("p", $("kept"), { className: "note", textContent: `Film of ${answer.surfaces} surfaces: ${answer.file} (glTF, for Blender and browsers).` });
    document.body.dataset.film = answer.file;
  });
  $("shell").addEventListener("click", async () => {
    $("shell").disabled = true;
    const answer = await ask("lay", {});
    if (answer && !answer.refused) watch();
    else { $("shell").disabled = false; if (answer) say(answer.refused); }
  });
  $("clear").addEventListener("click", () => { hand.curves.delete(hand.active); plot(); });
  $("against").addEventListener("change", plot);
  new ResizeObserver(plot).observe($("plot"));
}

buttons();
begin(null);
