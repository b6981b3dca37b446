const MOST_RUNNING = 6; // browsers allow about sixteen contexts in all
const DARK = window.matchMedia("(prefers-color-scheme: dark)");
const LEAST_EXAGGERATION = 1.5; // a difference that may not be drawn larger than this shows as it is

function range(parent, words, properties, told) {
  const label = made("label", parent, { textContent: `${words} ` });
  const slider = made("input", label, { type: "range", ...properties });
  const output = made("output", label);
  const tell = () => { output.textContent = told(Number(slider.value)); };
  tell();
  return { slider, tell, listen: (action) => slider.addEventListener("input", () => { tell(); action(Number(slider.value)); }) };
}

Object.assign(View.prototype, {
  controls() {
    const box = this.box = made("div", null, { className: "controls" });
    this.chooser(made("div", box, { className: "row" }));
    this.list(made("div", box, { className: "row" }));
    this.sliders(made("div", box, { className: "row" }));
    this.buttons(made("div", box, { className: "row" }));
    for (const row of [...box.children]) if (!row.children.length) row.remove();
    this.stage.after(box);
    this.recolour();
  },

  chooser(row) {
    const select = made("select", made("label", row, { textContent: "colour " }));
    made("option", select, { value: "", textContent: "one for each surface" });
    for (const [name, words] of Object.entries(this.data.names)) made("option", select, { value: name, textContent: words });
    select.value = this.field;
    select.addEventListener("change", () => { this.field = select.value; this.recolour(); });
    this.bar = made("span", row, { className: "bar" });
    this.ends = [made("span", this.bar), null];
    this.strip = made("canvas", this.bar, { width: 256, height: 1 });
    this.strip.setAttribute("role", "img");
    this.strip.setAttribute("aria-label", "Colours");
    this.ends[1] = made("span", this.bar);
    this.beyond = made("small", this.bar, { textContent: this.data.clipped });
  },

  list(row) {
    const list = made("span", row, { className: "surfaces" });
    list.setAttribute("role", "group");
    list.setAttribute("aria-label", "surfaces");
    for (const s of this.surfaces) {
      const one = made("label", list);
      s.tick = made("input", one, { type: "checkbox", checked: s.shown });
      made("i", one).style.background = `rgb(${s.colour.map((c) => Math.round(255 * c)).join(",")})`;
      one.append(s.label);
      s.tick.addEventListener("change", () => { s.shown = s.tick.checked; this.seen(); });
    }
  },

  sliders(row) {
    const shells = this.surfaces.filter((s) => s.kind === "shell"), mixed = this.surfaces.some((s) => s.kind === "ribbon");
    const ladder = shells.filter((s) => s.ratio).sort((a, b) => a.ratio - b.ratio);
    if (ladder.length > 1 && new Set(ladder.map((s) => s.ratio)).size === ladder.length) {
      const at = Math.max(0, ladder.findIndex((s) => s.shown));
      range(row, "shell", { min: 0, max: ladder.length - 1, step: 1, value: at, className: "ladder" }, (k) => `w/h = ${ladder[k].ratio}`).listen((k) => {
        ladder.forEach((s, i) => { s.shown = s.tick.checked = i === k; });
        this.seen();
      });
    }
    if (this.surfaces.some((s) => this.most(s) > LEAST_EXAGGERATION)) {
      this.difference = range(row, "difference", { min: 0, max: 40, step: 1, value: 0, className: "difference" }, (k) => `× ${this.exaggerated(k)}`);
      this.difference.listen(() => this.seen());
    }
    if (mixed && shells.length)
      range(row, "opacity of shells", { min: 10, max: 100, step: 5, value: 100, className: "opacity" }, (k) => `${k} %`).listen((k) => {
        this.opacity = k / 100;
        this.redraw();
      });
    const moving = this.surfaces.find((s) => s.frames.length > 1);
    if (moving) this.film(row, moving.frames);
  },

  // How many times as large the difference of a surface may be drawn: about a third of the view
  most(s) {
    return s.apart > 0 ? clamp(0.35 * this.data.radius / s.apart, 1, 1000) : 1;
  },

  // The factor at a place of the slider, for what is shown
  exaggerated(k) {
    const shown = this.surfaces.filter((s) => s.shown && s.apart > 0).map((s) => this.most(s));
    return k === 0 || !shown.length ? 1 : Number(Math.pow(Math.min(...shown), k / 40).toPrecision(2));
  },

  // Something else is shown: the difference keeps its place on the slider
  seen() {
    if (this.difference) {
      this.difference.tell();
      this.factor = this.exaggerated(Number(this.difference.slider.value));
      this.shape();
    }
    this.recolour();
  },

  // A slider along the states of a path, and a button that goes along them
  film(row, frames) {
    const last = frames.length - 1;
    const { slider, listen } = range(row, "path", { min: 0, max: last, step: 1, value: last, className: "path" }, (k) => frames[k].label);
    const show = (k) => { this.frame = k; this.shape(); this.recolour(); };
    const play = made("button", row, { type: "button", textContent: "play", className: "play" });
    let timer = null;
    const halt = () => { window.clearInterval(timer); timer = null; play.textContent = "play"; };
    listen((k) => { if (timer && k !== this.frame) halt(); show(k); });
    play.addEventListener("click", () => {
      if (timer) { halt(); return; }
      play.textContent = "stop";
      let k = this.frame === last ? -1 : this.frame;
      timer = window.setInterval(() => {
        k += 1;
        this.frame = k;
        slider.value = k;
        slider.dispatchEvent(new Event("input"));
        if (k >= last) halt();
      }, 4000 / Math.max(last, 20));
    });
  },

  buttons(row) {
    const button = (text, action) => made("button", row, { type: "button", textContent: text }).addEventListener("click", action);
    button("reset view", () => { this.home(); this.redraw(); });
    if (document.fullscreenEnabled) button("full screen", () => {
      if (document.fullscreenElement) document.exitFullscreen();
      else this.figure.requestFullscreen().catch(() => {});
    });
    button("save picture", () => this.save());
  },

  // The view as it stands, with its axes, on the stage's own ground
  save() {
    if (!this.gl) return;
    this.draw();
    const picture = made("canvas", null, { width: this.canvas.width, height: this.canvas.height }), context = picture.getContext("2d");
    context.fillStyle = window.getComputedStyle(this.stage).backgroundColor;
    context.fillRect(0, 0, picture.width, picture.height);
    context.drawImage(this.canvas, 0, 0);
    context.drawImage(this.over, 0, 0);
    const link = made("a", null, { href: picture.toDataURL("image/png"), download: this.data.file });
    this.figure.dataset.saved = link.href.length;
    link.click();
  },
});

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
    if (!block) continue; // a page that makes its view itself
    const view = new View(figure, JSON.parse(block.textContent));
    views.push(view);
    watch.observe(view.stage);
  }
  DARK.addEventListener("change", () => views.forEach((v) => v.redraw()));
  window.addEventListener("beforeprint", () => document.querySelectorAll("details").forEach((d) => { d.open = true; }));
}

if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", ready);
else ready();
