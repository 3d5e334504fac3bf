"use strict";
/* A whole mechanism in one word, as planar.document.texts.mechanism_link has it: `planar:` and the file, deflated, in base64url. */

const MechanismLink = {
  async write(file) {
    const bytes = await MechanismLink.through(JSON.stringify(file), new CompressionStream("deflate-raw"));
    let text = "";
    for (const each of bytes) text += String.fromCharCode(each);
    return `planar:${btoa(text).replaceAll("+", "-").replaceAll("/", "_").replace(/=+$/, "")}`;
  },

  /** The file of a link. Throws what says that it is none. */
  async read(link) {
    const packed = atob(link.trim().replace(/^planar:/, "").replaceAll("-", "+").replaceAll("_", "/"));
    const bytes = await MechanismLink.through(Uint8Array.from(packed, (each) => each.charCodeAt(0)), new DecompressionStream("deflate-raw"));
    return JSON.parse(new TextDecoder().decode(bytes));
  },

  async through(content, stream) { return new Uint8Array(await new Response(new Blob([content]).stream().pipeThrough(stream)).arrayBuffer()); },
};

/** The mechanism as it is on the page, copied as a link; and one of the same structure opened. */
class LinkSaving {
  constructor(page, section) {
    Object.assign(this, { page });
    const { element } = Forms, press = (text, act) => {
      const made = element("button", { type: "button" }, text);
      made.addEventListener("click", act);
      return made;
    };
    this.area = element("textarea", { readonly: "", rows: 2, "aria-label": "Link of this mechanism" });
    this.field = element("input", { type: "text", size: 16, autocomplete: "off", "aria-label": "Link or text of a mechanism of this structure", placeholder: "planar:…" });
    section.append(element("p", { class: "linking" }, press("Copy mechanism as a link", () => this.copy()), this.field, press("Open", () => this.open(this.field.value))));
    this.section = section;
    const asked = memory.read("link");
    if (asked) { memory.write("link", ""); this.open(asked); }
  }

  async copy() {
    const { area, page } = this;
    area.value = await MechanismLink.write(Files.mechanism(page));
    this.section.append(area);
    area.select();
    try {
      await navigator.clipboard.writeText(area.value);
      page.say("The link is copied: `planar view LINK` and `planar edit LINK` open it.");
    } catch { page.say("The link is selected: copy it with the keyboard."); }
  }

  async open(text) {
    const { page } = this;
    let file;
    try { file = text.trim().startsWith("{") ? JSON.parse(text) : await MechanismLink.read(text); } catch { page.say("This holds no whole mechanism: neither a link nor the text of a file."); return; }
    page.say(new OtherFile(page).take(file) || `${file.name} is shown with its numbers.`);
  }
}

/** The numbers of another file of a page's structure, taken over by the page. */
class OtherFile {
  static TEXTS = ["name", "about", "source", "notes", "ids", "published", "sketch", "units"]; // that make no structure

  constructor(page) { Object.assign(this, { page, own: page.data.document.value, units: page.data.filed_units ?? page.data.units }); }

  /** Take it over: "", or a sentence that says why not. */
  take(written) {
    const file = OtherFile.whole(written);
    if (file === null) return "This is no mechanism.";
    const { page, page: { data, linkage } } = this, known = this.known(), values = new Map();
    const alike = file.units === this.own.units || JSON.stringify(file.units ?? {}) === JSON.stringify(this.own.units ?? {});
    if (!alike) return "Its file has other units: open it by `planar view LINK`.";
    const [wrong] = this.differences(this.own, file, []);
    if (wrong) return `It is of another structure, or differs in what this page does not change (${wrong}): open it by \`planar view LINK\`.`;
    for (const { path, kind } of known.values()) values.set(String(path), this.read(path.reduce((each, key) => each?.[key], file), kind));
    if ([...values.values()].includes(null)) return "It has a unit that this page does not know: open it by `planar view LINK`.";
    const of = (path) => values.get(String(path)), made = linkage.copy();
    const d = data.dimensions.map((_, k) => of(data.document.dimensions[k])), u = data.inputs.map((_, k) => of(["inputs", k, "position"]) / linkage.scale[k]);
    const held = data.dimensions.find((each, k) => each.held && d[k] !== linkage.d[k]);
    if (held) return `${held.link}: ${held.what} is held on this page: open it by \`planar view LINK\`.`;
    if (made.changeTo(d).reached < 1 || made.moveTo(u).reached < 1) return "Its numbers do not go together on the way from here: open it by `planar view LINK`.";
    page.adopt(made);
    page.give(data.inputs.map((_, k) => RATE_KEYS.map((key) => of(["inputs", k, key]) ?? 0)));
    page.acting?.take((data.forces?.parameters ?? []).map(({ path }) => of(path)));
    return "";
  }

  /** A file with what its author may leave out; null where it is none. */
  static whole(written) {
    const file = structuredClone(written), { links, pairs, inputs, frame } = file ?? {};
    if (typeof links !== "object" || links === null || !Array.isArray(pairs)) return null;
    for (const pair of pairs) if (pair.turning !== undefined) pair.links ??= Pins.carriers(file, pair.turning).sort((a, b) => Number(b === frame) - Number(a === frame));
    for (const given of inputs ?? []) for (const key of RATE_KEYS) given[key] ??= 0;
    return file;
  }

  /** What a page changes, by its path: {path, kind}. */
  known() {
    const { data } = this.page, found = new Map(), add = (path, kind) => found.set(String(path), { path, kind });
    for (const path of data.document.dimensions) add(path, "length");
    data.inputs.forEach((given, k) => {
      add(["inputs", k, "position"], given.slides ? "length" : "angle");
      RATE_KEYS.forEach((key, order) => { if (this.own.inputs[k][key] !== undefined) add(["inputs", k, key], InputRates.kind(given, order)); });
    });
    for (const { path, kind } of data.forces?.parameters ?? []) add(path, kind);
    return found;
  }

  /** A number of a file in SI; null where its unit is not known. */
  read(number, kind) {
    if (kind === "length" || kind === "angle") return Written.read(number, kind, { length: this.units.length.si, angle: this.units.angle.si });
    const [, value, unit] = /^\s*([-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*(\S.*?)?\s*$/.exec(String(number)) ?? [], { name, si } = this.units[kind];
    if (value === undefined) return null;
    if (unit === undefined) return Number(value) === 0 || typeof number === "number" ? Number(value) : null;
    const by = unit === name ? si : this.factor(unit, kind);
    return by === undefined ? null : Number(value) * by;
  }

  /** By what a number in a unit comes into SI: one that pages show of its kind, a length or an angle by the second or its
   * square, or the pace of an input; undefined for others. */
  factor(unit, kind) {
    const { data } = this.page, base = unit.replace(/\/s(\^2|\u00b2)?$/, "");
    const known = [data, ...data.unit_choices].flatMap(({ units, paces }) => (
      base === unit ? [units?.[kind], ...Object.values(paces ?? {})] : [units?.length, units?.angle]));
    return known.find((each) => each?.name === base)?.si;
  }

  /** Where two files differ in what is no number of the page. */
  *differences(own, other, path) {
    if (this.known().has(String(path))) { if (other === undefined) yield path.join("."); return; }
    const both = [own, other], objects = both.every((each) => typeof each === "object" && each !== null);
    const [lacks, has] = own === undefined ? [own, other] : [other, own];
    if (lacks === undefined && (has === 0 || has === false)) return; // as where it is left out
    if (!objects) { if (own !== other) yield path.join(".") || "the file"; return; }
    if (Array.isArray(own) !== Array.isArray(other)) { yield path.join("."); return; }
    for (const key of new Set(both.flatMap(Object.keys))) {
      if (path.length === 0 && OtherFile.TEXTS.includes(key)) continue;
      yield* this.differences(own[key], other[key], [...path, Array.isArray(own) ? Number(key) : key]);
    }
  }
}
