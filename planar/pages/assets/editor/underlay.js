"use strict";
/* A picture under the paper: a photograph, a scanned figure. It is laid by two of its places, whose distance and direction
   are typed. Whatever is done to it is a step of what is drawn. The window keeps it over a reload; the file has no place for
   it. It comes from a file of the reader's own, made into a text of the page: nothing is ever loaded from anywhere else. */

const MOST_SIDE = 1600;       // px: a larger picture is kept smaller
const MOST_LETTERS = 2500000; // of a kept picture; a longer one is kept as JPEG
const JPEG_QUALITY = 0.85;
const FIRST_SHARE = 0.7;      // of the paper's breadth that a picture takes at first
const FIRST_OPACITY = 0.5;

class Underlay {
  constructor(editing) {
    Object.assign(this, { editing, marks: null, picture: Underlay.recall(), form: new UnderlayForm(this) });
    document.addEventListener("dragover", (event) => { if (Underlay.isOver(event)) event.preventDefault(); });
    document.addEventListener("drop", (event) => {
      if (!Underlay.isOver(event)) return;
      event.preventDefault(); // nobody leaves the page for what is dropped
      const file = [...event.dataTransfer.files].find(({ type }) => type.startsWith("image/"));
      if (file) this.read(file);
      else editing.say("Drop the file of a picture; what lies on another site is not loaded.");
    });
  }

  static isOver({ target, dataTransfer }) { return dataTransfer !== null && !target.closest?.("input, textarea"); }

  static recall() { try { return JSON.parse(sessionStorage.getItem("picture")); } catch { return null; } }

  /** What lies there, to come back to: {picture, marks}, of which nothing is ever changed. */
  get laid() { return { picture: this.picture, marks: this.marks }; }

  /** Another picture, or the same laid otherwise; kept for a reload, as far as the window has room for it. */
  take(laid) {
    Object.assign(this, laid);
    try {
      if (this.picture) sessionStorage.setItem("picture", JSON.stringify(this.picture)); else sessionStorage.removeItem("picture");
    } catch { this.editing.say("The picture is too large to be kept over a reload."); }
    this.draw();
    this.editing.panel.show();
    this.editing.sketch.draw();
  }

  /** The same as a step of its own. */
  change(laid) {
    this.editing.remember({ underlay: this.laid });
    this.take({ ...this.laid, ...laid });
  }

  /** Take a file: as large as most of the paper, in its middle. */
  async read(file) {
    const { editing } = this, { view } = editing;
    try {
      const { url, size } = await Underlay.copy(file), scale = (FIRST_SHARE * view.width) / view.scale / size[0];
      const at = view.toWorld([view.width / 2, view.height / 2]);
      this.change({ picture: { url, size, scale, angle: 0, opacity: FIRST_OPACITY, at }, marks: null });
      editing.use("picture");
    } catch { editing.say(`${file.name} is no picture that this browser can read.`); }
  }

  /** A picture's points as a text of the page, whatever else its file holds: {url, size: px}. */
  static async copy(file) {
    const source = URL.createObjectURL(file), image = new Image();
    try {
      image.src = source;
      await image.decode();
      const own = [image.naturalWidth || MOST_SIDE, image.naturalHeight || MOST_SIDE], by = Math.min(1, MOST_SIDE / Math.max(...own));
      const size = own.map((each) => Math.max(1, Math.round(by * each))), canvas = Object.assign(document.createElement("canvas"), { width: size[0], height: size[1] });
      const ink = canvas.getContext("2d"), made = (...how) => { ink.drawImage(image, 0, 0, ...size); return canvas.toDataURL(...how); };
      const whole = file.type === "image/jpeg" ? null : made("image/png");
      if (whole !== null && whole.length <= MOST_LETTERS) return { url: whole, size };
      ink.fillStyle = "#fff"; // under what is seen through
      ink.fillRect(0, 0, ...size);
      return { url: made("image/jpeg", JPEG_QUALITY), size };
    } finally { URL.revokeObjectURL(source); }
  }

  /** On another page's drawing, below all. */
  attach(svg, page) {
    this.group = svgPart("g", { class: "underlay", "aria-hidden": "true" }, svg);
    svg.prepend(this.group);
    page.on("view", () => this.place());
    this.draw();
  }

  draw() {
    const { picture, group } = this;
    group.replaceChildren();
    if (picture === null) return;
    const [width, height] = picture.size;
    this.image = svgPart("image", { href: picture.url, x: -width / 2, y: -height / 2, width, height, preserveAspectRatio: "none" }, group);
    this.place();
  }

  place() {
    const { picture, editing: { view } } = this;
    if (picture === null || !view) return;
    const [x, y] = view.toScreen(picture.at);
    this.image.setAttribute("transform", `translate(${x} ${y}) rotate(${(-180 * picture.angle) / Math.PI}) scale(${picture.scale * view.scale})`);
    this.image.setAttribute("opacity", picture.opacity);
  }

  /** Two places of the world, by which it is laid. */
  mark(marks) {
    if (this.picture === null) { this.editing.say("Choose a picture first, beside the drawing, or drop one on the paper."); return; }
    if (!(Plane.apart(...marks) > 0)) return;
    this.change({ marks });
    this.editing.say("Type how far these places are apart, beside the drawing.");
  }

  /** How the marks lie: {at, distance, angle} (SI). */
  get lie() {
    const [p, q] = this.marks, [dx, dy] = Plane.minus(q, p);
    return { at: p, distance: Math.hypot(dx, dy), angle: Math.atan2(dy, dx) };
  }

  /** Lay the picture so that the marks lie as told: scaled, turned and moved with them. */
  lay(told) {
    const { picture, lie } = this, { at, distance, angle } = { ...lie, ...told }, by = distance / lie.distance, turn = angle - lie.angle;
    const carried = Plane.carry({ x: at[0], y: at[1], cos: by * Math.cos(turn), sin: by * Math.sin(turn) }, Plane.minus(picture.at, lie.at));
    this.change({
      picture: { ...picture, at: carried, scale: by * picture.scale, angle: picture.angle + turn },
      marks: [at, Plane.on(at, [Math.cos(angle), Math.sin(angle)], distance)],
    });
  }

  /** As it looks while its opacity is being chosen. */
  show(opacity) { this.image.setAttribute("opacity", opacity); }
  fade(opacity) { this.change({ picture: { ...this.picture, opacity } }); }

  remove() {
    this.change({ picture: null, marks: null });
    this.editing.say("The picture is gone.");
  }
}

/** What beside the drawing chooses the picture, and lays it. */
class UnderlayForm {
  constructor(underlay) {
    const { element } = Forms;
    this.underlay = underlay;
    this.file = element("input", { type: "file", accept: "image/*" });
    this.file.addEventListener("change", () => { if (this.file.files[0]) underlay.read(this.file.files[0]); this.file.value = ""; });
    this.opacity = element("input", { type: "range", min: 0.05, max: 1, step: 0.05 });
    this.opacity.addEventListener("input", () => underlay.show(this.opacity.value));
    this.opacity.addEventListener("change", () => underlay.fade(Number(this.opacity.value)));
    const remove = element("button", { type: "button" }, "Remove picture");
    remove.addEventListener("click", () => underlay.remove());
    this.laid = element("p", { class: "row" }, element("label", { class: "choice" }, "Opacity ", this.opacity), remove);
    this.fields = element("p", { class: "row" });
    this.hint = element("p", { class: "hint" });
    this.box = element("details", { class: "underlay" }, element("summary", {}, "Picture underneath"),
      element("p", {}, element("label", {}, "Picture ", this.file)), this.laid, this.fields, this.hint);
  }

  show() {
    const { underlay: { picture, marks, editing }, laid, fields, hint } = this;
    if (picture !== null || editing.tool === "picture") this.box.open = true;
    laid.hidden = picture === null;
    if (picture !== null) this.opacity.value = picture.opacity;
    fields.hidden = marks === null;
    hint.textContent = picture === null ? "Or drop it on the paper. It is shown here alone: the file does not have it." : "With the tool Picture click two of its places; then type how far they are apart.";
    if (marks !== null) this.fill();
  }

  /** The numbers of the two places, where they are typed. */
  fill() {
    const { underlay, fields } = this, { lie, editing } = underlay, { units, unit } = editing, turn = editing.file.units?.angle ?? "rad";
    const number = (label, si, value, act) => {
      const input = Forms.element("input", { type: "text", size: 7, autocomplete: "off" });
      input.value = Forms.shown(value / si);
      input.addEventListener("change", () => {
        const given = Forms.typed(input.value);
        if (given !== null && act(given * si)) return;
        editing.say(`${label}: another number is wanted.`);
        this.show();
      });
      return Forms.element("label", { class: "choice" }, `${label} `, input);
    };
    const lay = (told) => { underlay.lay(told); return true; };
    fields.replaceChildren(
      number(`Distance (${unit})`, units.length, lie.distance, (distance) => distance > 0 && lay({ distance })),
      number(`Direction (${turn})`, units.angle, lie.angle, (angle) => lay({ angle })),
      number(`First at x (${unit})`, units.length, lie.at[0], (x) => lay({ at: [x, lie.at[1]] })),
      number(`First at y (${unit})`, units.length, lie.at[1], (y) => lay({ at: [lie.at[0], y] })));
  }
}
