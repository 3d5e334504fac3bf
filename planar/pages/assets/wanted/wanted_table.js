"use strict";
/* What is wanted in numbers: every place with by how much it is missed, which can be typed, too; and whether the design
   follows. */

class WantedTable {
  constructor(page, section) {
    Object.assign(this, { page, wanted: page.wanted });
    const { wanted } = this;
    htmlPart("h2", {}, section, "Wanted");
    this.told = htmlPart("p", { role: "status" }, section);
    const line = htmlPart("p", { class: "choosing" }, section), label = htmlPart("label", {}, line);
    this.tick = htmlPart("input", { type: "checkbox" }, label);
    label.append(" The dimensions follow");
    this.tick.checked = wanted.follows;
    this.tick.addEventListener("change", () => { wanted.follows = this.tick.checked; if (wanted.follows) wanted.changed(); });
    const better = htmlPart("button", { type: "button" }, line, "Improve");
    better.addEventListener("click", () => { wanted.changed(); wanted.follow(); });
    this.back = htmlPart("button", { type: "button" }, line, "As in the task");
    this.back.addEventListener("click", () => { wanted.take(wanted.own); wanted.changed(); });
    htmlPart("p", { class: "hint" }, section, this.hint());
    const place = htmlPart("div", { class: "scroll tables", tabindex: "0", role: "group", "aria-label": "What is wanted" }, section);
    this.tables = wanted.items.map((item) => this.table(item, place));
    page.on("wanted", () => this.later());
    this.fill();
  }

  hint() {
    const { page, wanted: { free, unmoved } } = this, names = free.map(({ k }) => page.data.dimensions[k].name);
    const which = names.length ? `Sought from where they are: ${names.join(", ")}.` : "No dimension is free, so that nothing follows.";
    const rest = unmoved.length ? ` A page does not change ${unmoved.join(", ")}.` : "";
    return `Drag what is wanted in the drawing, or take it by Tab and move it by arrow keys. ${which}${rest}`;
  }

  table(item, place) {
    const { units } = this.page.data, length = units.length.name, angle = units.angle.name;
    const heads = { path: [`x, ${length}`, `y, ${length}`, `miss, ${length}`], poses: [`x, ${length}`, `y, ${length}`, `angle, ${angle}`, `miss, ${length}`, `miss, ${angle}`] };
    const unit = item.slides ? length : angle, table = htmlPart("table", {}, place);
    const ordered = item.in_order ? ", in order" : "", what = { path: `Path of ${item.of}`, poses: `Poses of ${item.of}`, function: `${item.of} over ${item.from}` }[item.kind];
    htmlPart("caption", {}, table, `${what}${ordered}`);
    const head = htmlPart("tr", {}, htmlPart("thead", {}, table));
    for (const each of ["no.", ...(heads[item.kind] ?? [`wanted, ${unit}`, `miss, ${unit}`])]) htmlPart("th", { scope: "col" }, head, each);
    const body = htmlPart("tbody", {}, table);
    return item.weights.map((_, i) => {
      const row = htmlPart("tr", {}, body);
      htmlPart("th", { scope: "row" }, row, String(i + 1));
      const fields = item.kind === "function" ? [] : [...[0, 1].map((axis) => this.field(row, item, i, axis)), ...(item.angles ? [this.field(row, item, i, 2)] : [])];
      if (item.kind === "function") htmlPart("td", {}, row, short(item.values[i] / (item.slides ? units.length.si : units.angle.si)));
      return { row, fields, misses: Array.from({ length: item.kind === "poses" ? 2 : 1 }, () => htmlPart("td", {}, row)) };
    });
  }

  /** A number that can be typed: x, y or the angle. */
  field(row, item, i, part) {
    const { units } = this.page.data, { si, name } = part === 2 ? units.angle : units.length;
    const field = htmlPart("input", { type: "number", step: "any", "aria-label": `${["x", "y", "angle"][part]} of ${i + 1}, ${name}` }, htmlPart("td", { class: "typed" }, row));
    field.addEventListener("change", () => {
      const value = Number(field.value);
      if (field.value === "" || !Number.isFinite(value)) { this.fill(); return; }
      if (part === 2) item.angles[i] = value * si; else item.places[i][part] = value * si;
      this.wanted.changed();
    });
    const read = () => {
      const value = part === 2 ? item.angles[i] : item.places[i][part];
      return Math.abs(value) < 1e-12 * (part === 2 ? 1 : item.size) ? 0 : value / si;
    };
    return { field, read };
  }

  later() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => { this.waiting = false; this.fill(); });
  }

  fill() {
    const { page: { data: { units } }, wanted } = this, { length, angle } = units, misses = wanted.misses();
    for (const rows of this.tables) for (const { fields } of rows) {
      for (const { field, read } of fields) if (field !== document.activeElement || !field.matches(":focus-visible")) field.value = Forms.shown(read());
    }
    for (const { item, i, miss, turned, over } of misses) {
      const { row, misses: cells } = this.tables[wanted.items.indexOf(item)][i], by = item.kind === "function" && !item.slides ? angle.si : length.si;
      row.classList.toggle("over", over);
      const told = [[miss, by, item.kind === "function" && !item.slides ? 1 : item.size], [turned, angle.si, 1]];
      cells.forEach((cell, k) => {
        const [value, unit, size] = told[k];
        cell.textContent = rounded(value, unit, size);
        cell.dataset.si = String(value);
      });
    }
    this.tell(misses.filter(({ item }) => item.kind !== "function"), length);
  }

  tell(misses, { si, name }) {
    const { wanted } = this, far = misses.map(({ miss }) => miss);
    const over = misses.filter((each) => each.over).length, most = Math.max(0, ...far);
    const shown = (value) => `${rounded(value, si, wanted.items[0].size)} ${name}`;
    const bad = over ? `; ${over} beyond the tolerance` : "";
    const text = far.length
      ? `Misses: root mean square ${shown(Math.sqrt(far.reduce((sum, each) => sum + each * each, 0) / far.length))}, greatest ${shown(most)}${bad}.`
      : wanted.fit.ready && !wanted.stale ? "" : "Misses: the motion is being solved.";
    if (this.told.textContent !== text) this.told.textContent = text;
    this.back.disabled = wanted.numbers().every((each, k) => each === wanted.own[k]);
  }
}

/** A miss (SI) in a unit, in three digits; what is rounding beside a size is none. */
const rounded = (value, unit, size) => (Math.abs(value) < 1e-9 * size ? "0" : short(Number((value / unit).toPrecision(3))));
