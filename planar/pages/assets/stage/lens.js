"use strict";
/* How the drawing is looked at: nearer by the wheel, two fingers, buttons or keys, moved along by its paper, or over the
   whole screen. What is looked at stays in the address. */

const ZOOMS = [0.25, 40];  // of the scale at which everything fits
const ZOOM_STEP = 1.25;    // a press
const WHEEL = 0.0015;      // of a logarithm for a px of the wheel
const WHEEL_LINE = 16;     // px
const PAN_STEP = 40;       // px, a key
const WIDE = "(min-width: 1000px)"; // where the drawing stays beside the panels, which alone scroll

class Lens {
  constructor(page, svg, drawing, dragging) {
    Object.assign(this, { page, svg, drawing, dragging, fingers: new Map(), base: null }); // base: a scale about which it is, in place of the fitting one
    this.left = svg.closest(".left");
    this.buttons();
    svg.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    svg.addEventListener("keydown", (event) => this.key(event));
    svg.addEventListener("pointerdown", (event) => this.press(event));
    svg.addEventListener("pointermove", (event) => this.lead(event));
    for (const end of ["pointerup", "pointercancel"]) svg.addEventListener(end, (event) => this.lift(event));
    const { signal } = page.lifetime;
    addEventListener("keydown", ({ key }) => { if (key === "Escape" && this.isFull) this.fill(false); }, { signal });
    document.addEventListener("fullscreenchange", () => { if (!document.fullscreenElement && this.isFull) this.fill(false); }, { signal });
    const keys = svg.getAttribute("aria-keyshortcuts") ?? "";
    svg.setAttribute("aria-keyshortcuts", `${keys} + - 0 F Control+ArrowRight Control+ArrowLeft Control+ArrowUp Control+ArrowDown`.trim());
    this.recall();
  }

  buttons() {
    const box = Forms.element("div", { class: "lens", role: "group", "aria-label": "View of the drawing" });
    this.tools = Forms.element("div", { class: "lens tools", role: "group", "aria-label": "Tools of the drawing" });
    this.box = box;
    this.button("+", "Zoom in (+)", () => this.zoom(ZOOM_STEP));
    this.button("−", "Zoom out (−)", () => this.zoom(1 / ZOOM_STEP));
    this.whole = this.button("Fit", "Fit everything (0)", () => this.fit());
    this.screen = this.button("Full screen", "Full screen (F)", () => this.fill(!this.isFull));
    this.svg.parentNode.append(box, this.tools);
    const { drawing, tools } = this;
    drawing.buttons = { head: () => box.offsetTop + box.offsetHeight, foot: () => (tools.offsetHeight ? drawing.height - tools.offsetTop : 0) };
    this.show();
  }

  button(text, name, act, box = this.box) {
    const made = Forms.element("button", { type: "button", "aria-label": name, title: name }, text);
    made.addEventListener("click", act);
    box.append(made);
    return made;
  }

  /** A button that takes another tool in hand. */
  tool(text, name, act) { return this.button(text, name, act, this.tools); }

  get isFull() { return this.left.classList.contains("full"); }
  get middle() { return [this.drawing.width / 2, this.drawing.height / 2]; }

  /** Nearer by a factor; the place at `at` (px) stays where it is. */
  zoom(by, at = this.middle) {
    const { page: { view } } = this, fitted = this.base ?? this.drawing.fitted, scale = Math.max(ZOOMS[0] * fitted, Math.min(ZOOMS[1] * fitted, view.scale * by));
    const place = view.toWorld(at), [x, y] = this.middle;
    this.look({ scale, at: [place[0] - (at[0] - x) / scale, place[1] + (at[1] - y) / scale] });
  }

  /** Along by as many px. */
  pan(dx, dy) {
    const { page: { view }, middle: [x, y] } = this;
    this.look({ scale: view.scale, at: view.toWorld([x - dx, y - dy]) });
  }

  fit() { this.look(null); }

  look(lens) {
    this.drawing.lens = lens;
    this.drawing.build();
    this.show();
    memory.write("view", lens === null ? "" : [lens.scale, ...lens.at].map((each) => Number(each.toPrecision(5))).join(","));
  }

  show() {
    const { lens } = this.drawing;
    this.whole.disabled = !lens;
    // a finger moves the paper where there is more of it than is seen, else it scrolls the page
    this.svg.style.touchAction = lens || this.isFull ? "none" : "pan-y";
  }

  recall() {
    const [scale, x, y] = (memory.read("view") ?? "").split(",").map(Number), by = scale / this.drawing.fitted;
    if ([scale, x, y].every(Number.isFinite) && by >= ZOOMS[0] / 2 && by <= ZOOMS[1] * 2) this.look({ scale, at: [x, y] });
  }

  /** Over the whole screen, letters large, with the controls alone; back by Escape. */
  fill(full) {
    document.documentElement.classList.toggle("projected", full);
    this.left.classList.toggle("full", full);
    for (const each of document.querySelectorAll(".page > header, .right")) each.inert = full;
    this.screen.setAttribute("aria-pressed", String(full));
    if (full) this.former = this.drawing.lens;
    this.drawing.lens = full ? null : this.former; // all of it, at first
    this.show();
    // a frame may forbid it: the page itself is filled then
    if (full) document.documentElement.requestFullscreen?.().catch(() => undefined);
    else if (document.fullscreenElement) document.exitFullscreen();
    this.drawing.build();
  }

  place(event) {
    const { left, top } = this.svg.getBoundingClientRect();
    return [event.clientX - left, event.clientY - top];
  }

  wheel(event) {
    if (!(event.ctrlKey || event.metaKey || this.isFull || matchMedia(WIDE).matches)) return; // it scrolls the page
    event.preventDefault();
    this.zoom(Math.exp(-event.deltaY * (event.deltaMode ? WHEEL_LINE : 1) * WHEEL), this.place(event));
  }

  key(event) {
    const ways = { ArrowRight: [-1, 0], ArrowLeft: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }, way = ways[event.key];
    if ((event.ctrlKey || event.metaKey) && way) this.pan(way[0] * PAN_STEP, way[1] * PAN_STEP);
    else if (event.ctrlKey || event.metaKey || event.altKey) return;
    else if (event.key === "+" || event.key === "=") this.zoom(ZOOM_STEP);
    else if (event.key === "-") this.zoom(1 / ZOOM_STEP);
    else if (event.key === "0") this.fit();
    else if (event.key.toLowerCase() === "f") this.fill(!this.isFull);
    else return;
    event.preventDefault();
  }

  press(event) {
    if (event.button !== 0) return;
    const free = this.dragging.held === null && !event.target.closest("[tabindex]:not(#drawing)");
    const moves = free && (event.pointerType === "mouse" || this.drawing.lens !== null || this.isFull);
    this.fingers.set(event.pointerId, { at: this.place(event), from: this.place(event), moves });
    if (this.fingers.size === 2) this.dragging.drop(); // two fingers look nearer
  }

  lead(event) {
    const finger = this.fingers.get(event.pointerId);
    if (finger === undefined) return;
    const before = finger.at, now = this.place(event);
    if (this.fingers.size === 2) {
      const other = [...this.fingers.values()].find((each) => each !== finger).at;
      finger.at = now;
      const apart = Plane.apart(before, other);
      if (apart > 1) this.zoom(Plane.apart(now, other) / apart, [(now[0] + other[0]) / 2, (now[1] + other[1]) / 2]);
      return;
    }
    if (!finger.moves || this.dragging.held !== null || Plane.apart(now, finger.from) < CLICK) return;
    finger.at = now;
    if (!this.svg.hasPointerCapture(event.pointerId)) this.svg.setPointerCapture(event.pointerId);
    this.svg.classList.add("held");
    this.pan(now[0] - before[0], now[1] - before[1]);
  }

  lift(event) {
    this.fingers.delete(event.pointerId);
    this.svg.classList.remove("held");
  }
}
