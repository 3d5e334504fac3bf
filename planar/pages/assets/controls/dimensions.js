"use strict";
/* A slider and a number field for each dimension. The page solves the changed linkage at once; where it would come
   apart the dimension stays at the last value that goes together, and it is said how far that is. */

/** What the forms of a page have in common. */
const Forms = {
  DIGITS: 6,           // of a number that is shown
  SMALL: 1e-4,         // what is less is shown by a power of ten, as its zeros would take all the room
  STEPS: 200,          // at least, that a slider's range is divided into

  /** A number as it is shown: six digits, no zeros behind. */
  shown(value) {
    const round = Number(value.toPrecision(Forms.DIGITS));
    return round !== 0 && Math.abs(round) < Forms.SMALL ? round.toExponential() : String(round);
  },

  /** A number that was typed, with a comma or a minus of any kind; null where it is none. */
  typed(text) {
    const given = Number(text.trim().replace(",", ".").replace("−", "-"));
    return text.trim() && Number.isFinite(given) ? given : null;
  },

  /** The round step (1, 2 or 5 of a power of ten) that divides a range finely enough. */
  roundStep(range) {
    const most = range / Forms.STEPS, power = 10 ** Math.floor(Math.log10(most));
    return [5, 2, 1].map((each) => each * power).find((each) => each <= most * (1 + 1e-9));
  },

  /** An element with attributes (a text is only ever a text) and what it holds. */
  element(name, attributes = {}, ...children) {
    const made = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    made.append(...children);
    return made;
  },

  /** Where the inputs are, with units: O = 60 deg. */
  inputs(page) {
    return page.data.inputs.map((each, k) => {
      const unit = each.slides ? page.data.units.length : page.data.units.angle;
      return `${each.pair} = ${Forms.shown(page.input(k) / unit.si)} ${unit.name}`;
    }).join(", ");
  },
};

class Dimensions {
  static MANY = 16; // dimensions: with more of them those of a link are folded away

  constructor(page, section) {
    this.page = page;
    this.unit = page.data.units.length;
    this.asked = null; // dimensions that wait for the next frame, and which of them was moved
    this.rows = page.data.dimensions.map((each, k) => this.row(each, k));
    if (!this.rows.length) { section.remove(); return; }
    this.all = Forms.element("button", { type: "button" }, "Reset all dimensions");
    this.all.addEventListener("click", () => this.reset());
    section.append(Forms.element("h2", {}, "Dimensions"), ...this.groups(), this.all);
    page.on("size", () => { this.quiet(); this.show(); });
    this.show();
  }

  groups() {
    const { dimensions, frame, links } = this.page.data, open = dimensions.length <= Dimensions.MANY;
    return links.map((link) => {
      const rows = this.rows.filter((_, k) => dimensions[k].link === link);
      if (!rows.length) return "";
      const title = link === frame && link !== "frame" ? `${link} (frame)` : link;
      const group = Forms.element("details", { class: "dimensions" }, Forms.element("summary", {}, title), ...rows.map((row) => row.box));
      group.open = open && dimensions.some((each) => each.link === link && each.value !== 0); // zeros are seldom played with
      return group;
    });
  }

  row(dimension, k) {
    const { unit } = this, id = `dimension-${k}`, name = `${dimension.link}: ${dimension.what}`;
    const own = dimension.value / unit.si, [low, high] = [dimension.low / unit.si, dimension.high / unit.si];
    const slider = Forms.element("input", {
      type: "range", id, min: low, max: high, step: "any", "aria-label": `${name}, ${unit.name}`, list: `${id}-own`,
    });
    const field = Forms.element("input", { type: "number", step: "any", "aria-label": `${name}, number, ${unit.name}` });
    const mark = Forms.element("datalist", { id: `${id}-own` }, Forms.element("option", { value: own }));
    const reset = Forms.element("button", {
      type: "button", "aria-label": `Reset ${name} to ${Forms.shown(own)} ${unit.name}`, title: `the file's ${Forms.shown(own)} ${unit.name}`,
    }, "Reset");
    const note = Forms.element("p", { class: "note", id: `${id}-note` });
    slider.setAttribute("aria-describedby", note.id);
    const step = Forms.roundStep(high - low);
    slider.addEventListener("input", () => {
      const at = Number(slider.value), round = Math.round(at / step) * step;
      // the file's own value lies on no round number as a rule: the thumb takes it when it is as near
      this.askOne(k, Math.abs(at - own) <= step / 2 ? dimension.value : round * unit.si);
    });
    field.addEventListener("change", () => {
      const wanted = Number(field.value);
      if (field.value === "" || !Number.isFinite(wanted)) this.show();
      else this.askOne(k, wanted * unit.ratio[0] / unit.ratio[1]);
    });
    reset.addEventListener("click", () => this.askOne(k, dimension.value));
    if (dimension.held) {
      slider.disabled = field.disabled = true;
      note.textContent = `Held: ${dimension.held}.`;
    }
    const label = Forms.element("label", { for: id }, dimension.what);
    const box = Forms.element("div", { class: "dimension" }, label, slider, mark, field,
      Forms.element("span", { class: "unit" }, unit.name), reset, note);
    return { box, slider, field, reset, note };
  }

  askOne(k, value) {
    const d = Array.from(this.asked ? this.asked.d : this.page.linkage.d);
    d[k] = value;
    this.ask(d, k);
  }

  /** All dimensions as in the file; where the inputs are now they may not go together, then also the inputs. */
  reset() {
    const { page } = this, { data } = page, own = data.dimensions.map((each) => each.value), at = Forms.inputs(page);
    this.asked = null;
    this.quiet();
    if (page.changeTo(own).reached === 1) return;
    page.take(data.z);
    page.say(`With ${at} the file's dimensions do not go together: back at ${Forms.inputs(page)}.`);
  }

  /** Take back what was said beside the dimensions. */
  quiet() {
    this.rows.forEach((row, i) => { if (!this.page.data.dimensions[i].held) row.note.textContent = ""; });
  }

  /** Change the dimensions with the next frame: a slider tells of more values than are drawn. */
  ask(d, k) {
    const waits = this.asked !== null;
    this.asked = { d, k };
    if (!waits) requestAnimationFrame(() => { if (this.asked !== null) this.change(); });
  }

  change() {
    const { page, asked: { d, k }, unit } = this, { data, linkage } = this.page;
    this.asked = null;
    const before = Array.from(linkage.d);
    this.quiet();
    const possible = this.possible(d[k], k);
    const { reached } = possible ? page.changeTo(d) : { reached: 0 };
    if (reached === 1) return;
    const said = data.dimensions.map((each, i) => {
      if (d[i] === before[i]) return "";
      const way = d[i] > before[i] ? "up" : "down", at = Forms.shown(linkage.d[i] / unit.si);
      const where = data.inputs.length ? `With ${Forms.inputs(page)} it` : "It";
      return possible
        ? `${where} goes together ${way} to ${each.link}: ${each.what} = ${at} ${unit.name}; asked for ${Forms.shown(d[i] / unit.si)} ${unit.name}.`
        : `${each.link}: ${each.what} cannot be ${Forms.shown(d[i] / unit.si)} ${unit.name}.`;
    });
    said.forEach((sentence, i) => { if (sentence) this.rows[i].note.textContent = sentence; });
    page.say(said.filter((each) => each).join(" "));
    this.show();
  }

  /** Whether a dimension may have a value: a length stays one, and no pair may have anything against it. */
  possible(value, k) {
    const { positive, bounds: [low, high] } = this.page.data.dimensions[k];
    return (value > 0 || !positive) && value >= (low ?? -Infinity) && value <= (high ?? Infinity);
  }

  show() {
    const { page: { data, linkage }, rows, unit } = this;
    rows.forEach(({ slider, field, reset }, k) => {
      const { value } = data.dimensions[k], now = linkage.d[k] / unit.si;
      slider.value = now;
      slider.setAttribute("aria-valuetext", `${Forms.shown(now)} ${unit.name}`);
      field.value = Forms.shown(now);
      reset.disabled = linkage.d[k] === value;
    });
    this.all.disabled = rows.every(({ reset }) => reset.disabled);
  }
}
