"use strict";
/* The numbers of the points and links chosen, as tables: in the units in which `planar solve`
   prints them. Each cell carries its exact SI value as `data-si`. */

const NOTHING = 1e-13;  // of the size, or of the greatest of its kind: printed as 0

/** What a table says of a point or a link: [head, kind of quantity, value in SI from the page and the name]. */
const QUANTITIES_OF = {
  point: [
    ["x", "length", (p) => p.position[0]],
    ["y", "length", (p) => p.position[1]],
    ["velocity", "velocity", (p) => size2(p.velocity)],
    ["at", "angle", (p) => direction(p.velocity)],
    ["along x", "velocity", (p) => p.velocity?.[0]],
    ["along y", "velocity", (p) => p.velocity?.[1]],
    ["acceleration", "acceleration", (p) => size2(p.acceleration)],
    ["at", "angle", (p) => direction(p.acceleration)],
    ["along x", "acceleration", (p) => p.acceleration?.[0]],
    ["along y", "acceleration", (p) => p.acceleration?.[1]],
  ],
  link: [
    ["angle", "angle", (f) => f.told],
    ["angular velocity", "angular velocity", (f) => f.v?.[2]],
    ["angular acceleration", "angular acceleration", (f) => f.a?.[2]],
  ],
};

function size2(vector) { return vector ? Math.hypot(...vector) : undefined; }

/** Of a vector, above −π up to π, with parts that are nothing but rounding left out; none of one that is nothing else. */
function direction(vector) {
  const size = vector && Math.hypot(...vector);
  if (!(size > 1e-14)) return undefined;
  const [x, y] = vector.map((part) => (Math.abs(part) > 1e-12 * size ? part : 0));
  return Math.atan2(y, x);
}

/** Between −π and π, unless the link's angle counts turns. */
function wrapped(angle, counts) {
  return counts || Math.abs(angle) <= Math.PI ? angle : Math.atan2(Math.sin(angle), Math.cos(angle));
}

/** [factor of SI, name] of the unit of a kind of quantity, or of a name of SI. */
function unitOf(page, kind) {
  const own = page.data.units[kind];
  return own === undefined ? [1, kind] : [1 / own.si, own.name];
}

function inputTold(page, value, k) {
  const [by, name] = unitOf(page, page.data.inputs[k].slides ? "length" : "angle");
  return `${short(value * by)} ${name}`;
}

/** The rates of an input at which the numbers are: ", ω = 10.5 rad/s, α = −26 rad/s²"; nothing where it rests. */
function ratesTold(page, k) {
  const { slides } = page.data.inputs[k], [velocity, acceleration] = page.inputRates()[k], letters = slides ? "va" : "ωα";
  if (!velocity && !acceleration) return "";
  const kinds = slides ? ["velocity", "acceleration"] : ["angular velocity", "angular acceleration"];
  return [velocity, acceleration].map((rate, order) => {
    const [by, name] = unitOf(page, kinds[order]);
    return `, ${letters[order]} = ${short(rate * by)} ${name}`;
  }).join("");
}

/** The coordinates of a place (m) in the unit of lengths; what is round-off beside the other one is 0. */
function formatPlace(page, place) {
  const [by, name] = unitOf(page, "length"), least = 1e-9 * Math.max(...place.map(Math.abs));
  const texts = place.map((value) => `${Number((Math.abs(value) > least ? value * by : 0).toPrecision(4))}`.replace("-", "−"));
  return `(${texts.join(", ")}) ${name}`;
}

/** As many figures as tables have. */
function figures(value) {
  if (value === 0) return "0";
  const text = value.toPrecision(Figures.count);
  return text.replace("-", "−").replace("e+", "e");
}

class Numbers {
  constructor(page) {
    this.page = page;
    const section = document.getElementById("numbers");
    const box = htmlPart("div", { class: "choosing" }, section);
    this.choosing(box);
    this.why = htmlPart("p", { class: "why", hidden: "" }, section);
    this.place = htmlPart("div", { class: "tables" }, section);
    this.tables();
    page.on("chosen", () => { this.tables(); this.listed(); });
    for (const event of ["move", "size"]) page.on(event, () => this.fill());
  }

  /** A list from which a point or a link is taken or given back, and one press that drops all. */
  choosing(box) {
    const { page } = this, { points, links, frame } = page.data;
    const label = htmlPart("label", { class: "choice" }, box, "Point or link ");
    this.select = htmlPart("select", {}, label);
    this.add = htmlPart("button", { type: "button" }, box, "Show");
    const moving = links.filter((link) => link !== frame);
    for (const [kind, title, names] of [["point", "Points", Object.keys(points)], ["link", "Links", moving]]) {
      const group = htmlPart("optgroup", { label: title }, this.select);
      for (const name of names) htmlPart("option", { value: JSON.stringify([kind, name]) }, group, `${kind} ${name}`);
    }
    this.select.addEventListener("change", () => this.listed());
    this.add.addEventListener("click", () => page.chosen.toggle(...JSON.parse(this.select.value)));
    htmlPart("span", { class: "hint" }, box, "or click it in the drawing");
    this.listed();
  }

  listed() {
    if (!this.select.value) return;
    this.add.textContent = this.page.chosen.has(...JSON.parse(this.select.value)) ? "Hide" : "Show";
  }

  /** The tables anew, for other points and links. */
  tables() {
    const { page } = this;
    this.place.replaceChildren();
    this.cells = [];
    this.captions = [];
    for (const [kind, title, names] of [["point", "Points", page.chosen.points()], ["link", "Links", page.chosen.links()]]) {
      if (!names.length) continue;
      const quantities = QUANTITIES_OF[kind], label = `${title}: numbers`;
      const scroll = htmlPart("div", { class: "scroll", tabindex: "0", role: "group", "aria-label": label }, this.place);
      const table = htmlPart("table", {}, scroll), caption = htmlPart("caption", {}, table);
      const head = htmlPart("tr", {}, htmlPart("thead", {}, table));
      this.captions.push([caption, title]);
      htmlPart("th", { scope: "col" }, head, kind);
      htmlPart("td", { class: "press" }, head);
      for (const [name, unit] of quantities) {
        const cell = htmlPart("th", { scope: "col" }, head, name);
        htmlPart("span", { class: "unit" }, cell, ` ${unitOf(page, unit)[1]}`);
      }
      const body = htmlPart("tbody", {}, table);
      names.forEach((name, k) => {
        const row = htmlPart("tr", {}, body), first = htmlPart("th", { scope: "row" }, row);
        htmlPart("span", { class: `swatch series${k % SERIES}`, "aria-hidden": "true" }, first);
        first.append(name);
        const hide = { type: "button", class: "drop", "aria-label": `Hide ${kind} ${name}` };
        const drop = htmlPart("button", hide, htmlPart("td", { class: "press" }, row), "×");
        const cells = quantities.map(() => htmlPart("td", {}, row));
        drop.addEventListener("click", () => { page.chosen.toggle(kind, name); this.select.focus(); });
        this.cells.push({ kind, name, cells });
      });
    }
    if (!this.cells.length) htmlPart("p", { class: "hint" }, this.place, "No point or link is chosen.");
    this.fill();
  }

  /** The numbers of now. */
  fill() {
    const { page } = this, { data } = page, rows = this.cells.map(({ kind, name }) => valuesOf(page, kind, name));
    const greatest = greatestNumbers(page), why = page.undetermined;
    this.why.textContent = why && `${why[0].toUpperCase()}${why.slice(1)}.`;
    this.why.hidden = why === "";
    const at = data.inputs.map((each, k) => `${each.pair} = ${inputTold(page, page.input(k), k)}${ratesTold(page, k)}`).join(", ");
    for (const [caption, title] of this.captions) caption.textContent = at ? `${title} at ${at}` : title;
    this.cells.forEach(({ kind, cells }, r) => cells.forEach((cell, c) => {
      const value = rows[r][c], [, unit] = QUANTITIES_OF[kind][c], [by] = unitOf(page, unit);
      if (value === undefined || Number.isNaN(value)) {
        cell.textContent = unit === "angle" ? "" : "–";
        delete cell.dataset.si;
        return;
      }
      cell.textContent = figures(Math.abs(value) <= NOTHING * greatest[unit] ? 0 : value * by);
      cell.dataset.si = String(value);
    }));
  }
}

/** The greatest size of each kind of number: what is rounding beside it is none. */
function greatestNumbers(page) {
  const { data } = page, found = { length: data.size, angle: Math.PI };
  for (const [kind, names] of [["point", Object.keys(data.points)], ["link", data.links]]) {
    for (const name of names) {
      valuesOf(page, kind, name).forEach((value, k) => {
        const [, unit] = QUANTITIES_OF[kind][k];
        found[unit] = Math.max(found[unit] ?? 0, Math.abs(value ?? 0));
      });
    }
  }
  // what would balance out, or be as fast, at the mechanism's size
  const turning = found["angular velocity"] ?? 0;
  found["angular acceleration"] = Math.max(found["angular acceleration"] ?? 0, turning ** 2);
  found["velocity"] = Math.max(found["velocity"] ?? 0, turning * data.size);
  found["acceleration"] = Math.max(found["acceleration"] ?? 0, turning ** 2 * data.size);
  return found;
}

/** The numbers of a point or link in SI, in the order of its table; undefined where there is none. */
function valuesOf(page, kind, name, frames = page.frames) {
  const f = frames[name], counts = page.data.counting.includes(name);
  const of = kind === "point" ? page.point(name, frames) : { ...f, told: wrapped(f.angle, counts) };
  return QUANTITIES_OF[kind].map(([, , value]) => value(of));
}
