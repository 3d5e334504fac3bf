"use strict";
/* A slider and a number field for each number of what acts: loads, springs, masses. Forces follow at once; the
   motion that is shown stays, as the inputs drive it. New ones need equations, which Python makes: a page without a pencil
   says where. */

class Acting {
  /** `hasPencil`: new ones are drawn on the page itself. */
  constructor(page, section, hasPencil) {
    this.page = page;
    const list = page.data.forces?.parameters ?? [];
    this.values = list.map((each) => each.value);
    for (const [name, value] of page.keptActions ?? []) {
      const k = list.findIndex((each) => each.name === name);
      if (k >= 0 && this.possible(value, k)) this.values[k] = value;
    }
    this.rows = list.map((each, k) => this.row(each, k));
    if (!list.length && hasPencil) {
      if (!section.childElementCount) section.remove();
      return;
    }
    const box = Forms.element("details", { class: "dimensions" }, Forms.element("summary", {}, "Loads, springs and masses"));
    section.append(box);
    if (list.length) this.fill(box);
    if (!hasPencil) box.append(Acting.elsewhere());
  }

  /** Where new ones are drawn. */
  static elsewhere() {
    const { element } = Forms;
    return element("p", { class: "hint" }, "A new load, spring or mass needs its equations from the server of ", element("code", {}, "planar edit"),
      ": copy the mechanism as a link, under Save, and start ", element("code", {}, "planar edit LINK"), ".");
  }

  /** The numbers of those that there are. */
  fill(box) {
    const { list } = this;
    this.all = Forms.element("button", { type: "button" }, "Reset all of these");
    this.all.addEventListener("click", () => this.take(list.map((each) => each.value)));
    box.append(...this.rows.map((row) => row.box), this.all);
    box.open = list.length <= Dimensions.MANY;
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
