const WALL_OPACITY = 0.18;
const ARROWS = ["push", "friction"]; // kinds of surfaces that mark where a strip touches

// One surface: its fine mesh and, where it has them, its states along a path (frames) on a coarser one
class Sheet {
  constructor(entry, data) {
    Object.assign(this, { label: entry.label, kind: entry.kind, colour: entry.colour, shown: entry.shown, ratio: entry.ratio });
    this.partner = null; // the surface it may be compared with, point by point
    this.apart = 0; // largest distance between the two, along an axis
    this.fine = this.mesh(entry, data);
    this.fine.normals = Float32Array.from(numbers(entry.normals, Int16Array), (x) => x / 32767);
    this.now = this.fine;
    this.frames = [];
    if (!entry.frames) return;
    const places = unpacked(entry.frames.places, data.low, data.span), count = 3 * entry.frames.grid[0] * entry.frames.grid[1];
    const shape = this.mesh({ grid: entry.frames.grid, seam: entry.seam, fields: {} }, null);
    const known = Object.entries(entry.frames.fields).map(([name, f]) => [name, f, values(f)]);
    entry.frames.labels.forEach((label, k) => {
      const part = (all, each) => all.slice(k * each, (k + 1) * each);
      const fields = Object.fromEntries(known.map(([name, f, all]) => [name, { ...f, known: part(all, count / 3) }]));
      this.frames.push({ ...shape, label, fields, places: part(places, count), normals: null });
    });
  }

  mesh(entry, data) {
    const { grid, seam } = entry;
    return {
      triangles: grid ? gridTriangles(grid[0], grid[1]) : numbers(entry.triangles, Uint16Array),
      outline: grid ? gridOutline(grid[0], grid[1], seam) : [],
      joined: grid ? gridSeam(grid[0], grid[1], seam) : [],
      first: grid ? Array.from({ length: grid[1] }, (_, i) => i) : [],
      places: data ? unpacked(entry.places, data.low, data.span) : null,
      fields: Object.fromEntries(Object.entries(entry.fields).map(([name, f]) => [name, { ...f, known: values(f) }])),
    };
  }

  compareWith(other) {
    this.partner = other;
    this.apart = this.fine.places.reduce((most, x, i) => Math.max(most, Math.abs(x - other.fine.places[i])), 0);
  }

  // The mesh to be drawn: a state of the path, or the surface `factor` times as far from its partner as it is
  shape(frame, factor) {
    const state = this.frames.length && frame < this.frames.length - 1 ? this.frames[frame] : null;
    if (state && !state.normals) state.normals = normalsOf(state.places, state.triangles, state.joined);
    this.now = state || this.fine;
    if (!state && factor !== 1 && this.partner) {
      const { places } = this.fine, from = this.partner.fine.places;
      const far = places.map((x, i) => from[i] + factor * (x - from[i]));
      this.now = { ...this.fine, places: far, normals: normalsOf(far, this.fine.triangles, this.fine.joined) };
    }
    if (this.now.bands && this.now.bands.of === this.now.places) return;
    const { places, outline, first } = this.now;
    this.now.bands = { of: places, outline: bandsOf(places, outline), first: bandsOf(places, first) };
  }
}

class View {
  constructor(figure, data) {
    this.figure = figure;
    this.stage = figure.querySelector(".stage");
    this.data = data;
    this.field = data.field;
    this.gl = null;
    this.canvas = null;
    this.pointers = new Map();
    this.inside = false;
    this.waiting = false;
    this.opacity = 1;
    this.factor = 1;
    this.surfaces = data.surfaces.map((s) => new Sheet(s, data));
    data.surfaces.forEach((s, i) => { if (s.partner !== null) this.surfaces[i].compareWith(this.surfaces[s.partner]); });
    this.frame = Math.max(0, ...this.surfaces.map((s) => s.frames.length - 1));
    this.home();
    this.shape();
    this.controls();
  }

  home() {
    Object.assign(this, { azimuth: this.data.azimuth, elevation: this.data.elevation, zoom: 1, target: this.data.centre });
  }

  shape() {
    for (const s of this.surfaces) s.shape(this.frame, this.factor);
  }

  // Drawing begins and ends; the still picture stands there in between
  start() {
    if (this.gl) return true;
    const canvas = made("canvas", null, { tabIndex: 0, className: "turn" });
    const gl = canvas.getContext("webgl", { antialias: true, alpha: true, preserveDrawingBuffer: true });
    if (!gl) return false;
    canvas.setAttribute("role", "application");
    canvas.setAttribute("aria-roledescription", "3-D view");
    canvas.setAttribute("aria-label", `${this.data.alt} Arrow keys turn, plus and minus zoom, 0 goes back, i tells the values in the middle.`);
    this.gl = gl;
    this.canvas = canvas;
    this.over = made("canvas", null, { className: "over" });
    this.over.setAttribute("aria-hidden", "true");
    this.tip = made("div", null, { className: "tip", hidden: true });
    this.tip.setAttribute("aria-live", "polite");
    this.painter = new Painter(gl);
    this.stage.append(canvas, this.over, this.tip);
    this.stage.classList.add("live");
    this.listen();
    this.recolour();
    return true;
  }

  stop() {
    if (!this.gl) return;
    const lose = this.gl.getExtension("WEBGL_lose_context");
    this.gl = null;
    this.resizing.disconnect();
    this.stage.classList.remove("live");
    for (const part of [this.canvas, this.over, this.tip]) part.remove();
    this.pointers.clear();
    if (lose) lose.loseContext();
  }

  listen() {
    const c = this.canvas;
    this.resizing = new ResizeObserver(() => this.redraw());
    this.resizing.observe(this.stage);
    c.addEventListener("webglcontextlost", () => { if (this.canvas === c) this.stop(); });
    c.addEventListener("contextmenu", (e) => e.preventDefault());
    c.addEventListener("pointerdown", (e) => {
      c.focus({ preventScroll: true });
      c.setPointerCapture(e.pointerId);
      this.pointers.set(e.pointerId, [e.clientX, e.clientY]);
      if (e.pointerType === "touch") this.tell(e.clientX, e.clientY);
    });
    for (const name of ["pointerup", "pointercancel"]) c.addEventListener(name, (e) => this.pointers.delete(e.pointerId));
    c.addEventListener("pointermove", (e) => {
      if (this.pointers.size) this.moved(e);
      else this.tell(e.clientX, e.clientY);
    });
    c.addEventListener("pointerleave", () => { this.tip.hidden = true; });
    c.addEventListener("wheel", (e) => {
      if (document.activeElement !== c && !e.ctrlKey) return; // an unfocused view lets the page scroll
      e.preventDefault();
      this.zoomed(Math.exp(-0.0015 * e.deltaY));
    }, { passive: false });
    c.addEventListener("keydown", (e) => this.key(e));
  }

  moved(e) {
    const before = this.pointers.get(e.pointerId);
    if (!before) return;
    const now = [e.clientX, e.clientY], dx = now[0] - before[0], dy = now[1] - before[1];
    if (Math.hypot(dx, dy) > 2) this.tip.hidden = true;
    if (this.pointers.size === 2) {
      const [other] = [...this.pointers].filter(([id]) => id !== e.pointerId).map(([, p]) => p);
      const gap = (p) => Math.hypot(p[0] - other[0], p[1] - other[1]);
      this.zoomed(gap(now) / Math.max(gap(before), 1));
      this.shift(dx / 2, dy / 2);
    } else if (e.shiftKey || e.buttons === 2) this.shift(dx, dy);
    else this.turn(-0.008 * dx, 0.008 * dy);
    this.pointers.set(e.pointerId, now);
  }

  key(e) {
    const step = 0.12, far = 24;
    const moves = {
      ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1],
    };
    if (e.ctrlKey || e.metaKey || e.altKey) return;
    if (moves[e.key] && e.shiftKey) this.shift(-far * moves[e.key][0], -far * moves[e.key][1]);
    else if (moves[e.key]) this.turn(step * moves[e.key][0], -step * moves[e.key][1]);
    else if (e.key === "+" || e.key === "=") this.zoomed(1.15);
    else if (e.key === "-") this.zoomed(1 / 1.15);
    else if (e.key === "0") { this.home(); this.redraw(); }
    else if (e.key === "i") {
      const box = this.canvas.getBoundingClientRect();
      this.tell(box.x + box.width / 2, box.y + box.height / 2);
    } else return;
    e.preventDefault();
  }

  turn(azimuth, elevation) {
    this.azimuth += azimuth;
    this.elevation = clamp(this.elevation + elevation, -1.5, 1.5);
    this.redraw();
  }

  zoomed(factor) {
    this.zoom = clamp(this.zoom * factor, 0.2, 200);
    this.redraw();
  }

  shift(dx, dy) {
    const { right, up, distance } = this.camera();
    const size = 2 * distance * Math.tan(FIELD_OF_VIEW / 2) / this.stage.clientHeight;
    this.target = add(add(this.target, right, -dx * size), up, dy * size);
    this.redraw();
  }

  camera() {
    const { along, upwards } = this.data, aspect = this.stage.clientWidth / this.stage.clientHeight;
    const side = cross(upwards, along), c = Math.cos(this.elevation);
    const away = add(add(add([0, 0, 0], along, c * Math.cos(this.azimuth)), side, c * Math.sin(this.azimuth)), upwards, Math.sin(this.elevation));
    const distance = Math.max(this.data.high, this.data.wide / aspect) / this.zoom;
    const eye = add(this.target, away, distance), right = unit(cross(upwards, away)), up = cross(away, right);
    const radius = 1.5 * this.data.radius + Math.hypot(...add(this.target, this.data.centre, -1));
    const near = Math.max(distance - radius, 0.01 * distance), far = distance + radius;
    const view = new Float32Array([right[0], up[0], away[0], 0, right[1], up[1], away[1], 0, right[2], up[2], away[2], 0, -dot(right, eye), -dot(up, eye), -dot(away, eye), 1]);
    return { eye, right, up, away, distance, aspect, matrix: product(perspective(aspect, near, far), view) };
  }

  redraw() {
    if (this.waiting || !this.gl) return;
    this.waiting = true;
    requestAnimationFrame(() => { this.waiting = false; if (this.gl) this.draw(); });
  }

  // The range of the colours: one for all surfaces shown that have the field
  range() {
    const found = this.surfaces.filter((s) => s.shown && !ARROWS.includes(s.kind) && s.now.fields[this.field]).map((s) => s.now.fields[this.field]);
    if (!found.length) return null;
    let low = Math.min(...found.map((f) => f.from)), high = Math.max(...found.map((f) => f.to));
    const least = Math.min(...found.map((f) => f.low)), most = Math.max(...found.map((f) => f.high));
    const diverging = low < 0 && high > 0 && Math.min(-low, high) > 0.25 * Math.max(-low, high);
    if (diverging) { high = Math.max(-low, high); low = -high; }
    if (!(high > low)) { low -= 0.5; high += 0.5; }
    return { low, high, diverging, below: least < low, above: most > high };
  }

  recolour() {
    const range = this.scale = this.field ? this.range() : null;
    this.bar.hidden = !range;
    if (range) {
      this.table = colourTable(range.diverging ? DIVERGING : SEQUENTIAL);
      const context = this.strip.getContext("2d"), row = context.createImageData(256, 1);
      row.data.set(this.table);
      context.putImageData(row, 0, 0);
      this.ends[0].textContent = (range.below ? "≤ " : "") + short(range.low);
      this.ends[1].textContent = (range.above ? "≥ " : "") + short(range.high);
      this.beyond.hidden = !(range.below || range.above);
      const name = this.data.names[this.field];
      this.strip.setAttribute("aria-label", `Colours: ${name}, from ${this.ends[0].textContent} to ${this.ends[1].textContent}`);
      if (this.gl) this.painter.colours(this.table);
    }
    for (const s of this.surfaces) {
      const field = range && !ARROWS.includes(s.kind) && s.now.fields[this.field];
      s.values = !field ? null : field.known.map((x) => (Number.isNaN(x) ? -1 : clamp((x - range.low) / (range.high - range.low), 0, 1)));
    }
    this.redraw();
  }

  // How much nearer than it is the ribbon is drawn: enough to lie before shells that nearly coincide with it
  front() {
    const apart = this.surfaces.filter((s) => s.shown && s.apart > 0).map((s) => s.apart);
    return this.factor > 1 || !apart.length ? 0.004 * this.data.radius : clamp(2 * Math.max(...apart), 0.004 * this.data.radius, 0.06 * this.data.radius);
  }

  draw() {
    const ratio = Math.min(window.devicePixelRatio || 1, 2), { painter, data } = this;
    const width = Math.round(this.stage.clientWidth * ratio), height = Math.round(this.stage.clientHeight * ratio);
    if (!width || !height) return;
    for (const c of [this.canvas, this.over]) if (c.width !== width || c.height !== height) Object.assign(c, { width, height });
    const view = this.camera(), dark = DARK.matches, edge = dark ? [0.72, 0.75, 0.8] : [0.1, 0.12, 0.15];
    painter.begin(width, height);
    const order = this.surfaces.map((s, i) => [s, i]).filter(([s]) => s.shown);
    const rank = (s) => ["ribbon", "shell", "wall"].indexOf(s.kind); // the ribbon first: shells may let it through, walls do
    order.sort(([a], [b]) => rank(a) - rank(b));
    order.forEach(([s, number]) => {
      const marks = ARROWS.includes(s.kind);
      const front = s.kind === "ribbon" ? this.front() : marks ? 1.5 * this.front() : 0, opacity = { ribbon: 1, push: 1, friction: 1, wall: WALL_OPACITY }[s.kind] || this.opacity;
      const how = { colour: s.colour, opacity, nearer: front - 2e-4 * number * data.radius };
      painter.sheet(`s${number}`, { ...s.now, values: s.values }, view, how);
      if (marks) return;
      const line = { colour: edge, opacity: Math.max(opacity, 0.35), nearer: front + 0.002 * data.radius, width: 1.5 * ratio };
      painter.line(`o${number}`, s.now.bands.outline, view, line);
      if (s.kind === "wall") return;
      painter.line(`f${number}`, s.now.bands.first, view, { ...line, colour: START, width: 3 * ratio, nearer: line.nearer + 0.001 * data.radius });
    });
    this.axes(view, ratio, dark);
    this.canvas.dataset.drawn = Number(this.canvas.dataset.drawn || 0) + 1;
  }

  // What the surface under a place of the window is, where on it that is, and its value
  under(x, y) {
    const box = this.canvas.getBoundingClientRect(), view = this.camera(), tangent = Math.tan(FIELD_OF_VIEW / 2);
    const across = (2 * (x - box.x) / box.width - 1) * tangent * view.aspect, upwards = (1 - 2 * (y - box.y) / box.height) * tangent;
    const ray = unit(add(add(add([0, 0, 0], view.away, -1), view.right, across), view.up, upwards));
    let best = null;
    for (const s of this.surfaces) {
      if (!s.shown || s.kind === "wall" || ARROWS.includes(s.kind)) continue;
      const found = hit(view.eye, ray, s.now.places, s.now.triangles);
      const depth = found && found[0] - (s.kind === "ribbon" ? this.front() : 0);
      if (found && (!best || depth < best.depth)) best = { s, found, depth };
    }
    if (!best) return null;
    const { s, found: [, t, weights] } = best;
    const value = (name) => {
      const field = s.now.fields[name];
      return field ? [0, 1, 2].reduce((sum, k) => sum + weights[k] * field.known[s.now.triangles[t + k]], 0) : NaN;
    };
    return { label: s.label, value };
  }

  tell(x, y) {
    if (this.telling) return;
    this.telling = true;
    requestAnimationFrame(() => {
      this.telling = false;
      if (!this.gl) return;
      const found = this.under(x, y);
      this.tip.hidden = !found;
      if (!found) return;
      const names = [...new Set(["S", "v", this.field])].filter((name) => name && !Number.isNaN(found.value(name)));
      this.tip.textContent = [found.label, ...names.map((name) => `${this.data.names[name]}: ${short(found.value(name))}`)].join("\n");
      const box = this.stage.getBoundingClientRect(), left = x - box.x, top = y - box.y;
      const room = [this.stage.clientWidth - this.tip.offsetWidth - 4, this.stage.clientHeight - this.tip.offsetHeight - 4];
      this.tip.style.left = `${clamp(left + 14, 4, Math.max(room[0], 4))}px`;
      this.tip.style.top = `${clamp(top + 14, 4, Math.max(room[1], 4))}px`;
    });
  }

  // Directions of the axes, in the lower left corner, and of the weight's opposite
  axes(view, ratio, dark) {
    const context = this.over.getContext("2d"), length = 30, x = 48, y = this.stage.clientHeight - 48;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, this.stage.clientWidth, this.stage.clientHeight);
    context.font = "12px sans-serif";
    context.textAlign = "center";
    context.textBaseline = "middle";
    const shades = dark ? ["#ff8a7a", "#7fd08a", "#8fb8ff", "#dddddd"] : ["#b3392f", "#2f7d3a", "#2b5fb0", "#333333"];
    const arrows = ["x", "y", "z"].map((name, i) => [name, [0, 1, 2].map((k) => (k === i ? 1 : 0)), shades[i]]);
    const up = this.data.up;
    if (up) {
      const same = arrows.find(([, e]) => dot(e, up) > 0.9999);
      if (same) same[0] += " up";
      else arrows.push(["up", up, shades[3]]);
    }
    arrows.sort((a, b) => dot(a[1], view.away) - dot(b[1], view.away));
    for (const [name, e, colour] of arrows) {
      const across = dot(e, view.right), down = -dot(e, view.up);
      context.strokeStyle = context.fillStyle = colour;
      context.lineWidth = 1.6;
      context.setLineDash(name === "up" ? [4, 3] : []);
      context.beginPath();
      context.moveTo(x, y);
      context.lineTo(x + length * across, y + length * down);
      context.stroke();
      const gap = length + (name.length > 1 ? 16 : 9);
      context.fillText(name, x + gap * across, y + gap * down);
    }
  }
}
