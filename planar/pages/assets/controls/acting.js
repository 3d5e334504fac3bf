"use strict";
/* A slider and a number field for each number of what acts: loads, springs, masses. Forces follow at once; the
   motion that is shown stays, as the inputs drive it. */

class Acting {
  constructor(page, section) {
    this.page = page;
    const list = page.data.forces?.parameters ?? [];
    this.values = list.map((each) => each.value);
    for (const [name, value] of page.keptActions ?? []) {
      const k = list.findIndex((each) => each.name === name);
      if (k >= 0 && this.possible(value, k)) this.values[k] = value;
    }
    if (!list.length) {
      if (!section.childElementCount) section.remove();
      this.rows = [];
      return;
    }
    this.rows = list.map((each, k) => this.row(each, k));
    const box = Forms.element("details", { class: "dimensions" }, Forms.element("summary", {}, "Loads, springs and masses"));
    this.all = Forms.element("button", { type: "button" }, "Reset all of these");
    this.all.addEventListener("click", () => this.take(list.map((each) => each.value)));
    box.append(...this.rows.map((row) => row.box), this.all);
    box.open = list.length <= Dimensions.MANY;
    section.append(box);
    this.show();
  }

  /** [name, value] of those that are not the file's. */
  changes() { return this.list.flatMap((each, k) => (each.value === this.values[k] ? [] : [[each.name, this.values[k]]])); }

  get list() { return this.page.data.forces?.parameters ?? []; }

  possible(value, k) { return Number.isFinite(value) && (value >= 0 || !this.list[k].positive); }

  row({ name, label, kind, value, most }, k) {
    const { page } = this, [by, unit] = unitOf(page, kind), told = `${label}, ${unit}`, own = value * by;
    const low = this.list[k].positive ? 0 : -most * by, high = most * by, step = Forms.roundStep(high - low);
    const slider = Forms.element("input", { type: "range", id: `acting-${k}`, min: low, max: high, step: "any", "aria-label": told });
    const field = Forms.element("input", { type: "number", step: "any", "aria-label": `${label}, number, ${unit}` });
    const reset = Forms.element("button", { type: "button", "aria-label": `Reset ${label} to ${Forms.shown(own)} ${unit}` }, "Reset");
    slider.addEventListener("input", () => {
      const at = Number(slider.value), round = Math.round(at / step) * step;
      this.put(k, Math.abs(at - own) <= step / 2 ? value : round / by);
    });
    field.addEventListener("change", () => {
      const wanted = Number(field.value) / by;
      if (field.value === "") this.show();
      else if (this.possible(wanted, k)) this.put(k, wanted);
      else { page.say(`${label} cannot be ${field.value} ${unit}.`); this.show(); }
    });
    reset.addEventListener("click", () => this.put(k, value));
    const box = Forms.element("div", { class: "dimension" }, Forms.element("label", { for: slider.id, title: name }, label), slider, field,
      Forms.element("span", { class: "unit" }, unit), reset);
    return { box, slider, field, reset };
  }

  put(k, value) {
    const values = Array.from(this.values);
    values[k] = value;
    this.take(values);
  }

  /** Other numbers: all that was found of forces is void. */
  take(values) {
    this.values = values;
    this.show();
    this.page.emit("acting");
    this.page.emit("move");
  }

  show() {
    this.rows.forEach(({ slider, field, reset }, k) => {
      const { kind, value } = this.list[k], [by, unit] = unitOf(this.page, kind), now = this.values[k] * by;
      slider.value = now;
      slider.setAttribute("aria-valuetext", `${Forms.shown(now)} ${unit}`);
      field.value = Forms.shown(now);
      reset.disabled = this.values[k] === value;
    });
    if (this.all) this.all.disabled = this.rows.every(({ reset }) => reset.disabled);
  }
}
