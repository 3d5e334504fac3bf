"use strict";
/* A field for the velocity and the acceleration of each input; one that runs by a law of its own has none. */

const RATE_KEYS = ["velocity", "acceleration"];

class InputRates {
  static kind({ slides }, order) { return `${slides ? "" : "angular "}${RATE_KEYS[order]}`; }

  constructor(page, section) {
    this.page = page;
    this.rows = page.data.inputs.flatMap((given, k) => (page.data.document.value.inputs[k].law ? [] : RATE_KEYS.map((key, order) => this.row(given, k, key, order))));
    if (!this.rows.length) return;
    const box = Forms.element("details", { class: "dimensions" }, Forms.element("summary", {}, "Speeds of inputs"), ...this.rows.map((row) => row.box));
    section.append(box);
    for (const event of ["size", "acting"]) page.on(event, () => this.show());
    this.show();
  }

  row(given, k, key, order) {
    const { page } = this, [by, unit] = unitOf(page, InputRates.kind(given, order)), own = order ? given.acceleration : given.velocity, label = `${key} of ${given.pair}`;
    const field = Forms.element("input", { type: "number", step: "any", "aria-label": `${label}, ${unit}` }), told = Forms.shown(own * by);
    const reset = Forms.element("button", { type: "button", "aria-label": `Reset ${label} to ${told} ${unit}` }, "Reset");
    field.addEventListener("change", () => { if (field.value === "") this.show(); else this.put(k, order, Number(field.value) / by); });
    reset.addEventListener("click", () => this.put(k, order, own));
    return { box: Forms.element("div", { class: "dimension rate" }, Forms.element("span", {}, label), field, Forms.element("span", { class: "unit" }, unit), reset), field, reset, k, order, by, own };
  }

  put(k, order, value) {
    const rates = this.page.given.map((each) => [...each]);
    rates[k][order] = value;
    this.page.give(rates);
  }

  show() {
    for (const { field, reset, k, order, by, own } of this.rows) {
      const now = this.page.given[k][order];
      field.value = Forms.shown(now * by);
      reset.disabled = now === own;
    }
  }
}
