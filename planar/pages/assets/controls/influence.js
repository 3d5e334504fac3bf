"use strict";
/* What each dimension does to the points and links chosen, where the mechanism is: a table beside the dimensions, and the
   tolerances from which a band is drawn round paths. */

class Influence {
  constructor(page, section) {
    this.page = page;
    const { dimensions } = page.data;
    if (!dimensions.length) return;
    this.slopes = new DesignSlopes(page);
    this.box = htmlPart("details", { class: "influence" }, section);
    htmlPart("summary", {}, this.box, "Influence of each dimension");
    this.box.open = dimensions.length <= Dimensions.MANY;
    this.told = htmlPart("p", { class: "hint" }, this.box);
    this.place = htmlPart("div", { class: "scroll tables", tabindex: "0", role: "group", "aria-label": "Influence of each dimension" }, this.box);
    new Tolerances(page, this.box);
    this.box.addEventListener("toggle", () => this.table());
    for (const event of ["chosen", "tolerance"]) page.on(event, () => this.table());
    for (const event of ["move", "size"]) page.on(event, () => this.later());
    this.table();
  }

  /** Numbers follow with the next frame: a motion tells of more positions than are seen. */
  later() {
    if (!this.box.open || this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => { this.waiting = false; this.fill(); });
  }

  columns() {
    const { page } = this, found = [];
    for (const name of page.chosen.points()) found.push({ name, of: DesignSlopes.ofPoint, heads: ["x", "y"], kind: "length" });
    for (const name of page.chosen.links()) found.push({ name, of: DesignSlopes.ofLink, heads: ["angle"], kind: "angle" });
    return found;
  }

  /** The table anew, for other points and links. */
  table() {
    this.place.replaceChildren();
    this.cells = null;
    if (!this.box.open) return;
    const { page } = this, { dimensions } = page.data, columns = this.columns();
    if (!columns.length) { this.told.textContent = "Choose a point or a link to see what each dimension does to it."; return; }
    const table = htmlPart("table", {}, this.place), head = htmlPart("tr", {}, htmlPart("thead", {}, table));
    htmlPart("th", { scope: "col" }, head, "dimension");
    for (const { name, heads } of columns) for (const each of heads) htmlPart("th", { scope: "col" }, head, `${each} of ${name}`);
    const body = htmlPart("tbody", {}, table);
    const row = (title) => {
      const line = htmlPart("tr", {}, body);
      htmlPart("th", { scope: "row" }, line, title);
      return columns.flatMap(({ heads }) => heads.map(() => htmlPart("td", {}, line)));
    };
    this.cells = dimensions.map(({ link, what }) => row(`${link}: ${what}`));
    this.worst = page.tolerances.some(([low, high]) => low || high) ? row(`worst case, ${[...new Set(columns.map(({ kind }) => unitOf(page, kind)[1]))].join(", ")}`) : null;
    this.fill();
  }

  /** The derivatives of now; the greatest of each column stands out. */
  fill() {
    if (!this.cells) return;
    const { page, slopes } = this, { linkage, data } = page, columns = this.columns();
    slopes.made.d = Array.from(linkage.d);
    const sides = slopes.sides(linkage.z, linkage.u), length = data.units.length, [turn, angle] = unitOf(page, "angle");
    const known = sides.some((each) => each !== null);
    const links = columns.some(({ kind }) => kind === "angle") ? `, of angles ${angle} per ${length.name}` : "";
    this.told.textContent = known
      ? `Derivatives ${data.inputs.length ? `at ${Forms.inputs(page)}` : "here"}, ${length.name} per ${length.name}${links}. A dash: it cannot change alone.`
      : `${page.undetermined ? `${page.undetermined[0].toUpperCase()}${page.undetermined.slice(1)}, and` : "Here"} no influence of one dimension alone.`;
    let c = 0;
    for (const { name, of, heads, kind } of columns) {
      const each = of(page, sides, name);
      for (let part = 0; part < heads.length; part++, c++) {
        const by = kind === "angle" ? turn * length.si : 1;
        this.column(c, each.map((own) => (own === null ? null : own[part])), by, kind);
      }
    }
  }

  column(c, values, by, kind) {
    const { page } = this, most = Math.max(0, ...values.map((each) => Math.abs(each ?? 0)));
    values.forEach((value, k) => {
      const cell = this.cells[k][c];
      if (value === null || Number.isNaN(value)) { cell.textContent = "–"; delete cell.dataset.si; return; }
      const none = Math.abs(value) <= 1e-8 * Math.max(most, kind === "angle" ? 1 / page.data.size : 1);
      cell.textContent = none ? "0" : (value * by).toFixed(4).replace("-", "−");
      cell.dataset.si = String(none ? 0 : value);
      cell.classList.toggle("most", most > 0 && Math.abs(value) >= most * (1 - 1e-9));
    });
    if (this.worst === null) return;
    const ends = Tolerances.limits(page.tolerances, values), [unit] = unitOf(page, kind);
    const [low, high] = ends.map((each) => short(Number((Math.abs(each) * unit).toPrecision(3))));
    this.worst[c].textContent = low === high ? `±${high}` : `−${low} +${high}`;
    this.worst[c].dataset.si = JSON.stringify(ends);
  }
}

/** By how much the dimensions may be off: as in the file, or all of them by the same. `page.tolerances` has of each [lower,
    upper] (m). */
class Tolerances {
  constructor(page, box) {
    const { length } = page.data.units, line = htmlPart("p", { class: "all-tolerances" }, box);
    const label = htmlPart("label", {}, line, "Every dimension may be off by ± ");
    const field = htmlPart("input", { type: "number", min: "0", step: "any" }, label);
    label.append(` ${length.name}`);
    const file = page.data.dimensions.some(({ tolerance }) => tolerance);
    if (file) field.setAttribute("placeholder", "as in file");
    htmlPart("span", { class: "hint" }, line, file ? "Left empty: as in the file. The layer “Tolerance bands” draws it." : "The layer “Tolerance bands” draws it.");
    field.addEventListener("input", () => {
      const wanted = Number(field.value);
      if (field.value !== "" && !(Number.isFinite(wanted) && wanted >= 0)) return;
      const most = wanted * length.si;
      page.tolerances = field.value === "" ? Tolerances.ofFile(page) : page.data.dimensions.map(({ held }) => (held ? [0, 0] : [-most, most]));
      page.emit("tolerance");
    });
  }

  static ofFile(page) { return page.data.dimensions.map(({ tolerance, held }) => (tolerance && !held ? tolerance : [0, 0])); }

  /** The least and the greatest deviation of what has such slopes. */
  static limits(tolerances, slopes) {
    let low = 0, high = 0;
    tolerances.forEach(([less, more], k) => {
      const ends = [less, more].map((each) => each * (slopes[k] ?? 0));
      low += Math.min(...ends);
      high += Math.max(...ends);
    });
    return [low, high];
  }
}
