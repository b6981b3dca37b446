// The 3-D views of a report: WebGL 1, no library, no request. Each view is a figure with a still picture, which stays
// where there is no WebGL, and a block of JSON (compare/report/surfaces.py says what is in it).
(function () {
  "use strict";
  const MOST_RUNNING = 6; // browsers allow about sixteen contexts in all
  const FIELD_OF_VIEW = 0.5;
  const UNKNOWN = [0.62, 0.62, 0.62];
  const OUTLINE = [0.12, 0.14, 0.17];
  const START = [0.76, 0.4, 0.18];
  const SEQUENTIAL = ["440154", "472d7b", "3b528b", "2c728e", "21918c", "28ae80", "5ec962", "addc30", "fde725"];
  const DIVERGING = ["3b4cc0", "7b9ff9", "c0d4f5", "e6e6e6", "f2cbb7", "ee8468", "b40426"];

  const VERTEX = `
    attribute vec3 place; attribute vec3 normal; attribute float value;
    uniform mat4 camera; uniform vec3 low; uniform vec3 span; uniform vec2 scale;
    varying vec3 v_place; varying vec3 v_normal; varying float v_value; varying float v_known;
    void main() {
      v_place = low + span * place; v_normal = normal;
      v_value = scale.x + scale.y * value; v_known = value > 0.99999 ? 0.0 : 1.0;
      gl_Position = camera * vec4(v_place, 1.0);
    }`;
  const FRAGMENT = `
    precision mediump float;
    uniform vec3 eye; uniform vec3 up; uniform vec3 colour; uniform float lit; uniform float mapped;
    uniform vec3 unknown; uniform sampler2D map;
    varying vec3 v_place; varying vec3 v_normal; varying float v_value; varying float v_known;
    void main() {
      vec3 base = colour;
      if (mapped > 0.5) base = v_known > 0.999 ? texture2D(map, vec2(clamp(v_value, 0.002, 0.998), 0.5)).rgb : unknown;
      if (lit < 0.5) { gl_FragColor = vec4(base, 1.0); return; }
      vec3 towards = normalize(eye - v_place);
      vec3 n = normalize(v_normal);
      float back = 1.0;
      if (dot(n, towards) < 0.0) { n = -n; back = 0.9; }
      vec3 light = normalize(towards + 0.45 * up);
      float shade = 0.6 + 0.4 * max(dot(n, light), 0.0);
      float shine = 0.12 * pow(max(dot(n, normalize(light + towards)), 0.0), 40.0);
      gl_FragColor = vec4(base * shade * back + shine, 1.0);
    }`;

  // Vectors and matrices (column by column, as WebGL takes them)
  const add = (a, b, f) => [a[0] + f * b[0], a[1] + f * b[1], a[2] + f * b[2]];
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const unit = (a) => { const n = Math.hypot(a[0], a[1], a[2]) || 1; return [a[0] / n, a[1] / n, a[2] / n]; };
  const clamp = (x, low, high) => Math.min(high, Math.max(low, x));

  function product(a, b) {
    const c = new Float32Array(16);
    for (let i = 0; i < 4; i++) for (let j = 0; j < 4; j++) for (let k = 0; k < 4; k++) c[4 * j + i] += a[4 * k + i] * b[4 * j + k];
    return c;
  }

  function perspective(aspect, near, far) {
    const f = 1 / Math.tan(FIELD_OF_VIEW / 2);
    return new Float32Array([f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, 2 * far * near / (near - far), 0]);
  }

  function numbers(text, Kind) {
    const raw = atob(text), bytes = new Uint8Array(raw.length);
    for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
    return new Kind(bytes.buffer);
  }

  function rgb(hex) {
    return [0, 2, 4].map((i) => parseInt(hex.slice(i, i + 2), 16));
  }

  // 256 colours (RGBA) between the anchors of a map
  function colourTable(anchors) {
    const table = new Uint8Array(1024), stops = anchors.map(rgb);
    for (let i = 0; i < 256; i++) {
      const x = i / 255 * (stops.length - 1), k = Math.min(Math.floor(x), stops.length - 2);
      for (let c = 0; c < 3; c++) table[4 * i + c] = Math.round(stops[k][c] + (x - k) * (stops[k + 1][c] - stops[k][c]));
      table[4 * i + 3] = 255;
    }
    return table;
  }

  function gridTriangles(along, across) {
    const found = new Uint16Array(6 * (along - 1) * (across - 1));
    let n = 0;
    for (let i = 0; i < along - 1; i++) for (let j = 0; j < across - 1; j++) {
      const c = i * across + j;
      for (const corner of [c, c + across, c + 1, c + 1, c + across, c + across + 1]) found[n++] = corner;
    }
    return found;
  }

  function gridOutline(along, across) {
    const loop = [];
    for (let i = 0; i < along; i++) loop.push(i * across);
    for (let j = 1; j < across; j++) loop.push((along - 1) * across + j);
    for (let i = along - 2; i >= 0; i--) loop.push(i * across + across - 1);
    for (let j = across - 2; j > 0; j--) loop.push(j);
    return new Uint16Array(loop);
  }

  function made(name, parent, properties) {
    const element = document.createElement(name);
    Object.assign(element, properties || {});
    if (parent) parent.appendChild(element);
    return element;
  }

  const short = (x) => (x === 0 ? "0" : Number(x.toPrecision(3)).toString());

  function compiled(gl) {
    const program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    ["place", "normal", "value"].forEach((name, i) => gl.bindAttribLocation(program, i, name));
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) throw new Error(gl.getProgramInfoLog(program));
    return program;
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
      this.surfaces = data.surfaces.map((s) => ({
        ...s,
        shown: true,
        places: numbers(s.places, Uint16Array),
        normals: numbers(s.normals, Int16Array),
        triangles: s.grid ? gridTriangles(s.grid[0], s.grid[1]) : numbers(s.triangles, Uint16Array),
        outline: s.grid ? gridOutline(s.grid[0], s.grid[1]) : new Uint16Array(0),
        first: s.grid ? Uint16Array.from({ length: s.grid[1] }, (_, i) => i) : new Uint16Array(0),
        values: Object.fromEntries(Object.entries(s.fields).map(([name, f]) => [name, numbers(f.values, Uint16Array)])),
      }));
      this.home();
      this.controls();
    }

    home() {
      Object.assign(this, { azimuth: this.data.azimuth, elevation: this.data.elevation, zoom: 1, target: this.data.centre });
    }

    // Drawing begins and ends; the still picture stands there in between
    start() {
      if (this.gl) return true;
      const canvas = made("canvas", null, { tabIndex: 0, className: "turn" });
      const gl = canvas.getContext("webgl", { antialias: true, alpha: true, preserveDrawingBuffer: true });
      if (!gl) return false;
      canvas.setAttribute("role", "application");
      canvas.setAttribute("aria-roledescription", "3-D view");
      canvas.setAttribute("aria-label", `${this.data.alt} Arrow keys turn, plus and minus zoom, 0 goes back.`);
      this.gl = gl;
      this.canvas = canvas;
      this.over = made("canvas", null, { className: "over" });
      this.over.setAttribute("aria-hidden", "true");
      this.program = compiled(gl);
      const uniforms = ["camera", "low", "span", "scale", "eye", "up", "colour", "lit", "mapped", "unknown", "map"];
      this.at = Object.fromEntries(uniforms.map((name) => [name, gl.getUniformLocation(this.program, name)]));
      const buffer = (kind, content) => {
        const made = gl.createBuffer();
        gl.bindBuffer(kind, made);
        gl.bufferData(kind, content, gl.STATIC_DRAW);
        return made;
      };
      for (const s of this.surfaces) {
        s.buffers = { places: buffer(gl.ARRAY_BUFFER, s.places), normals: buffer(gl.ARRAY_BUFFER, s.normals), values: {} };
        for (const name of Object.keys(s.values)) s.buffers.values[name] = buffer(gl.ARRAY_BUFFER, s.values[name]);
        for (const part of ["triangles", "outline", "first"]) s.buffers[part] = buffer(gl.ELEMENT_ARRAY_BUFFER, s[part]);
      }
      this.texture = gl.createTexture();
      gl.bindTexture(gl.TEXTURE_2D, this.texture);
      for (const [name, value] of [["MIN_FILTER", "LINEAR"], ["MAG_FILTER", "LINEAR"], ["WRAP_S", "CLAMP_TO_EDGE"], ["WRAP_T", "CLAMP_TO_EDGE"]])
        gl.texParameteri(gl.TEXTURE_2D, gl["TEXTURE_" + name], gl[value]);
      this.stage.append(canvas, this.over);
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
      this.canvas.remove();
      this.over.remove();
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
      });
      for (const name of ["pointerup", "pointercancel"]) c.addEventListener(name, (e) => this.pointers.delete(e.pointerId));
      c.addEventListener("pointermove", (e) => this.moved(e));
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
      else return;
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
      const radius = this.data.radius + Math.hypot(...add(this.target, this.data.centre, -1));
      const near = Math.max(distance - radius, 0.01 * distance), far = distance + radius;
      const view = new Float32Array([right[0], up[0], away[0], 0, right[1], up[1], away[1], 0, right[2], up[2], away[2], 0, -dot(right, eye), -dot(up, eye), -dot(away, eye), 1]);
      return { eye, right, up, away, distance, matrix: product(perspective(aspect, near, far), view) };
    }

    redraw() {
      if (this.waiting || !this.gl) return;
      this.waiting = true;
      requestAnimationFrame(() => { this.waiting = false; if (this.gl) this.draw(); });
    }

    // The range of the colours: of all surfaces shown that have the field
    range() {
      const found = this.surfaces.filter((s) => s.shown && s.fields[this.field]).map((s) => s.fields[this.field]);
      if (!found.length) return null;
      let low = Math.min(...found.map((f) => f.from)), high = Math.max(...found.map((f) => f.to));
      const least = Math.min(...found.map((f) => f.low)), most = Math.max(...found.map((f) => f.high));
      const diverging = low < 0 && high > 0 && Math.min(-low, high) > 0.02 * Math.max(-low, high);
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
        const name = this.data.names[this.field];
        this.strip.setAttribute("aria-label", `Colours: ${name}, from ${this.ends[0].textContent} to ${this.ends[1].textContent}`);
        const gl = this.gl;
        if (gl) {
          gl.bindTexture(gl.TEXTURE_2D, this.texture);
          gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, this.table);
        }
      }
      this.redraw();
    }

    draw() {
      const gl = this.gl, ratio = Math.min(window.devicePixelRatio || 1, 2);
      const width = Math.round(this.stage.clientWidth * ratio), height = Math.round(this.stage.clientHeight * ratio);
      if (!width || !height) return;
      for (const c of [this.canvas, this.over]) if (c.width !== width || c.height !== height) Object.assign(c, { width, height });
      const view = this.camera(), { data, at } = this;
      gl.viewport(0, 0, width, height);
      gl.clearColor(0, 0, 0, 0);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      gl.enable(gl.DEPTH_TEST);
      gl.enable(gl.POLYGON_OFFSET_FILL);
      gl.useProgram(this.program);
      gl.uniformMatrix4fv(at.camera, false, view.matrix);
      gl.uniform3fv(at.low, data.low);
      gl.uniform3fv(at.span, data.span);
      gl.uniform3fv(at.eye, view.eye);
      gl.uniform3fv(at.up, view.up);
      gl.uniform3fv(at.unknown, UNKNOWN);
      gl.uniform1i(at.map, 0);
      gl.bindTexture(gl.TEXTURE_2D, this.texture);
      this.surfaces.forEach((s, number) => {
        if (!s.shown) return;
        const field = this.scale && s.fields[this.field], span = field ? field.high - field.low : 0;
        gl.polygonOffset(1, 1 + (s.kind === "ribbon" ? 0 : 1 + number));
        [["places", 0, 3, gl.UNSIGNED_SHORT], ["normals", 1, 3, gl.SHORT]].forEach(([name, place, size, kind]) => {
          gl.bindBuffer(gl.ARRAY_BUFFER, s.buffers[name]);
          gl.enableVertexAttribArray(place);
          gl.vertexAttribPointer(place, size, kind, true, 0, 0);
        });
        gl.disableVertexAttribArray(2);
        gl.vertexAttrib1f(2, 0);
        if (field) {
          gl.bindBuffer(gl.ARRAY_BUFFER, s.buffers.values[this.field]);
          gl.enableVertexAttribArray(2);
          gl.vertexAttribPointer(2, 1, gl.UNSIGNED_SHORT, true, 0, 0);
          const all = this.scale.high - this.scale.low;
          gl.uniform2f(at.scale, (field.low - this.scale.low) / all, (65535 / 65534) * span / all);
        } else gl.uniform2f(at.scale, 0, 0);
        const part = (name, kind, lit, mapped, colour) => {
          if (!s[name].length) return;
          gl.uniform1f(at.lit, lit);
          gl.uniform1f(at.mapped, mapped);
          gl.uniform3fv(at.colour, colour);
          gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, s.buffers[name]);
          gl.drawElements(kind, s[name].length, gl.UNSIGNED_SHORT, 0);
        };
        part("triangles", gl.TRIANGLES, 1, field ? 1 : 0, s.colour);
        part("outline", gl.LINE_LOOP, 0, 0, OUTLINE);
        part("first", gl.LINE_STRIP, 0, 0, START);
      });
      this.axes(view, ratio);
      this.canvas.dataset.drawn = Number(this.canvas.dataset.drawn || 0) + 1;
    }

    // Directions of the axes, in the lower left corner, and of the weight's opposite
    axes(view, ratio) {
      const context = this.over.getContext("2d"), length = 30, x = 48, y = this.stage.clientHeight - 48;
      context.setTransform(ratio, 0, 0, ratio, 0, 0);
      context.clearRect(0, 0, this.stage.clientWidth, this.stage.clientHeight);
      context.font = "12px sans-serif";
      context.textAlign = "center";
      context.textBaseline = "middle";
      const arrows = ["x", "y", "z"].map((name, i) => [name, [0, 1, 2].map((k) => (k === i ? 1 : 0)), ["#b3392f", "#2f7d3a", "#2b5fb0"][i]]);
      const up = this.data.up;
      if (up) {
        const same = arrows.find(([, e]) => dot(e, up) > 0.9999);
        if (same) same[0] += " up";
        else arrows.push(["up", up, "#333"]);
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

    controls() {
      const box = made("div", null, { className: "controls" });
      const names = Object.keys(this.data.names);
      const label = made("label", box, { textContent: "colour " });
      const select = made("select", label);
      made("option", select, { value: "", textContent: "one for each surface" });
      for (const name of names) made("option", select, { value: name, textContent: this.data.names[name] });
      select.value = this.field;
      select.addEventListener("change", () => { this.field = select.value; this.recolour(); });
      this.bar = made("span", box, { className: "bar" });
      this.ends = [made("span", this.bar), null];
      this.strip = made("canvas", this.bar, { width: 256, height: 1 });
      this.strip.setAttribute("role", "img");
      this.strip.setAttribute("aria-label", "Colours");
      this.ends[1] = made("span", this.bar);
      const list = made("span", box, { className: "surfaces" });
      list.setAttribute("role", "group");
      list.setAttribute("aria-label", "surfaces");
      this.surfaces.forEach((s) => {
        const one = made("label", list);
        const tick = made("input", one, { type: "checkbox", checked: true });
        const swatch = made("i", one);
        swatch.style.background = `rgb(${s.colour.map((c) => Math.round(255 * c)).join(",")})`;
        one.append(s.label);
        tick.addEventListener("change", () => { s.shown = tick.checked; this.recolour(); });
      });
      const reset = made("button", box, { type: "button", textContent: "reset view" });
      reset.addEventListener("click", () => { this.home(); this.redraw(); });
      this.stage.after(box);
      this.box = box;
      this.recolour();
    }
  }

  function ready() {
    const views = [];
    const running = () => views.filter((v) => v.gl);
    const watch = new IntersectionObserver((entries) => {
      for (const entry of entries) {
        const view = views.find((v) => v.stage === entry.target);
        view.inside = entry.isIntersecting;
        if (!view.inside || view.gl) continue;
        const idle = running().filter((v) => !v.inside);
        if (running().length >= MOST_RUNNING && idle.length) idle[0].stop();
        if (running().length >= MOST_RUNNING) continue;
        if (!view.start()) {
          watch.unobserve(view.stage);
          view.box.remove();
          made("p", view.figure, { className: "note", textContent: "No WebGL here: the picture cannot be turned." });
        }
      }
    }, { rootMargin: "100px" });
    for (const figure of document.querySelectorAll("figure.view")) {
      const block = figure.querySelector('script[type="application/json"]');
      const view = new View(figure, JSON.parse(block.textContent));
      views.push(view);
      watch.observe(view.stage);
    }
    window.addEventListener("beforeprint", () => document.querySelectorAll("details").forEach((d) => { d.open = true; }));
  }

  if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", ready);
  else ready();
})();
