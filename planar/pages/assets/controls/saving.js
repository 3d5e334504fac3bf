"use strict";
/* What the page shows, taken away: the mechanism as a file of planar (JSON), the picture (SVG), the motion (CSV). */

/** What is saved, as texts. */
const Files = (() => {
  const SAME = 1e-9; // sizes, rad: what rounding leaves of an assembly on the way there and back

  /** The shortest number in a unit (`ratio` of the SI unit) that planar reads back as exactly `value`, else an SI text. */
  function shortest(value, ratio, si) {
    const near = (value * ratio[1]) / ratio[0];
    for (let digits = 1; digits < 18; digits++) {
      const tried = Number(near.toPrecision(digits));
      if ((tried * ratio[0]) / ratio[1] === value) return tried;
    }
    return `${value} ${si}`;
  }

  /** The mechanism as it is on the page, as the JSON value of a file; as it came where nothing is changed. */
  function mechanism(page) {
    const { data, linkage } = page, file = JSON.parse(JSON.stringify(data.document.value)), units = data.filed_units ?? data.units;
    const length = (value) => shortest(value, units.length.ratio, "m");
    const put = (path, value) => {
      let at = file;
      for (const key of path.slice(0, -1)) at = at[key];
      at[path[path.length - 1]] = value;
    };
    let changed = linkage.z.some((each, k) => !(Math.abs(each - data.z[k]) < SAME));
    linkage.d.forEach((each, k) => {
      if (each === data.dimensions[k].value) return;
      changed = true;
      put(data.document.dimensions[k], length(each));
    });
    data.document.inputs.forEach((places, k) => {
      const given = data.inputs[k], start = given.position / linkage.scale[k];
      if (linkage.u[k] === start) return;
      changed = true;
      for (const { path, at } of places) {
        const now = page.input(k) + (at - given.position);
        put(path, given.slides ? length(now) : shortest(now, units.angle.ratio, "rad"));
      }
    });
    data.forces?.parameters.forEach(({ path, value, kind }, k) => {
      const now = page.acting?.values[k] ?? value;
      if (now === value) return;
      changed = true;
      const { ratio, name } = units[kind];
      put(path, kind === "length" ? length(now) : `${Number(((now * ratio[1]) / ratio[0]).toPrecision(15))} ${name}`);
    });
    page.given.forEach((rates, k) => rates.forEach((now, order) => {
      const given = data.inputs[k], kind = InputRates.kind(given, order), { ratio, name } = units[kind];
      if (now !== (order ? given.acceleration : given.velocity)) file.inputs[k][RATE_KEYS[order]] = `${Number(((now * ratio[1]) / ratio[0]).toPrecision(15))} ${name}`;
    }));
    for (const { link, name, at } of data.added?.points ?? []) (file.links[link].points ??= {})[name] = at.map(length);
    if (!changed) return file;
    // `ids` and what was published are of the file's own position and dimensions
    delete file.ids;
    delete file.published;
    const places = data.names.map((name) => [name, page.point(name).position.map(length)]);
    file.sketch = Object.fromEntries(places);
    return file;
  }

  /** The drawing by itself: what styles it is written into it, and it brings its paper. */
  function picture(page, drawing) {
    const inherited = ["fill", "fill-opacity", "stroke", "stroke-width", "stroke-dasharray", "stroke-linecap", "stroke-linejoin",
      "stroke-opacity", "font-family", "font-size", "font-style", "font-weight", "text-anchor", "dominant-baseline"];
    const kept = [...inherited, "opacity", "vector-effect"];
    const copy = drawing.cloneNode(true), pairs = [[drawing, copy]];
    while (pairs.length) {
      const [shownOne, made] = pairs.pop(), style = getComputedStyle(shownOne);
      const unseen = style.display === "none" || (style.visibility === "hidden" && !shownOne.children.length); // grips
      if (unseen && shownOne.getBBox) { made.remove(); continue; }
      Array.from(shownOne.children).forEach((child, k) => pairs.push([child, made.children[k]]));
      const above = shownOne === drawing ? null : getComputedStyle(shownOne.parentNode);
      for (const name of kept) {
        const value = style.getPropertyValue(name), same = above !== null && above.getPropertyValue(name) === value;
        if (same && inherited.includes(name)) made.removeAttribute(name); // as the part that it is in
        else if (value) made.setAttribute(name, value);
      }
      if (shownOne.style.transform) made.setAttribute("transform", style.transform);
      for (const name of ["class", "style", "tabindex"]) made.removeAttribute(name);
    }
    // few programs know paint-order: what keeps letters off strokes is a text of its own below them
    for (const text of copy.querySelectorAll("text[stroke]:not([stroke=none])")) {
      text.before(text.cloneNode(true));
      for (const each of [text, ...text.children]) each.setAttribute("stroke", "none");
    }
    const box = drawing.viewBox.baseVal, { width, height } = drawing.getBoundingClientRect();
    const [x, y, w, h] = box && box.width ? [box.x, box.y, box.width, box.height] : [0, 0, width, height];
    copy.setAttribute("xmlns", "http://www.w3.org/2000/svg");
    copy.setAttribute("viewBox", `${x} ${y} ${w} ${h}`);
    copy.setAttribute("width", width);
    copy.setAttribute("height", height);
    const paper = document.createElementNS("http://www.w3.org/2000/svg", "rect");
    const colour = getComputedStyle(document.body).backgroundColor;
    for (const [key, value] of Object.entries({ x, y, width: w, height: h, fill: colour })) paper.setAttribute(key, value);
    copy.prepend(paper);
    return new XMLSerializer().serializeToString(copy);
  }

  /** A text as a cell: an apostrophe before what a spreadsheet would take for a formula, in quotes where it holds what
   ends a cell (RFC 4180). */
  const cell = (text) => {
    const safe = /^[=+\-@']/.test(text) ? `'${text}` : text;
    return /[",\n\r]/.test(safe) ? `"${safe.replaceAll('"', '""')}"` : safe;
  };

  /** The motion of the input that runs, with the heads of `planar cycle -o motion.csv`; the other inputs stand still. */
  function motion(page) {
    const { data, linkage, course, running } = page, { columns, column, counting } = data, units = data.filed_units ?? data.units;
    const own = new Page(data, linkage.program); // another one, so that what is looked at stays where it is
    own.linkage.d = Array.from(linkage.d);
    own.linkage.measure();
    own.linkage.u = Array.from(linkage.u);
    const rates = page.inputRates().map((each, k) => (k === running ? each : [0, 0]));
    const links = data.links.filter((link) => link !== data.frame), first = new Map();
    const told = new Float64Array(columns.length);
    const rows = course.rows.map(({ z, at }) => {
      own.linkage.z = Float64Array.from(z);
      own.linkage.u[running] = at / linkage.scale[running];
      own.state = own.linkage.state(rates.map((each) => each[0]), rates.map((each) => each[1]));
      own.frames = own.framesOf(own.state);
      const { w, w1, w2 } = own.state, none = new Float64Array(w.length).fill(NaN), lost = [NaN, NaN];
      const values = rates.flatMap(([velocity, acceleration], k) => [own.input(k), velocity, acceleration]);
      for (const name of data.names) {
        const { position, velocity, acceleration } = own.point(name);
        values.push(...position, ...(velocity ?? lost), ...(acceleration ?? lost));
      }
      for (const link of links) {
        const k = column[link][2];
        // an angle starts within half a turn either way, unless its turns are counted
        if (!first.has(link)) first.set(link, counting.includes(link) ? 0 : 2 * Math.PI * Math.round(w[k] / (2 * Math.PI)));
        values.push(w[k] - first.get(link), (w1 ?? none)[k], (w2 ?? none)[k]);
      }
      const reported = linkage.program.reported(w, w1 ?? none, w2 ?? none, linkage.d, told).slice(0, columns.length - values.length);
      for (const [k, input] of data.starting) {
        // and so does one between links; an input's starts where the input is
        if (!first.has(k)) first.set(k, 2 * Math.PI * Math.round((reported[k] - (input < 0 ? 0 : own.input(input))) / (2 * Math.PI)));
        reported[k] -= first.get(k);
      }
      values.push(...reported);
      return columns.map(([, , kind], k) => {
        const value = kind in units ? (values[k] * units[kind].ratio[1]) / units[kind].ratio[0] : values[k];
        return Number.isFinite(value) ? String(value) : "";
      }).join(",");
    });
    const heads = columns.map(([name, unit]) => cell(`${name} [${unit}]`)).join(",");
    return [heads, ...rows].join("\n") + "\n";
  }

  return { mechanism, picture, motion, shortest };
})();

class Saving {
  /** Where the mechanism is drawn by hand its file is saved beside the drawing, and the rest is exported. */
  constructor(page, section, drawing, hasPencil) {
    Object.assign(this, { page, section, heading: hasPencil ? "Export" : "Save" });
    this.waits = false;
    section.setAttribute("aria-label", this.heading);
    section.append(Forms.element("h2", {}, this.heading));
    if (!hasPencil) {
      this.button(section, "Mechanism (JSON)", () => this.save("json", "application/json", `${JSON.stringify(Files.mechanism(page), null, 2)}\n`));
      this.link = new LinkSaving(page, section);
    }
    this.button(section, "Picture (SVG)", () => this.save("svg", "image/svg+xml", Files.picture(page, drawing)));
    this.button(section, "Motion (CSV)", () => this.motion());
    page.on("course", () => { if (this.waits && page.course) this.motion(); });
  }

  button(section, text, act) {
    const made = Forms.element("button", { type: "button", "aria-label": `${this.heading}: ${text}` }, text);
    made.addEventListener("click", act);
    section.append(made);
  }

  motion() {
    const { page } = this;
    this.waits = !page.course && page.data.inputs.length > 0;
    if (this.waits) page.say("The motion is being found; its table comes in a moment.");
    else if (page.course) this.save("csv", "text/csv", Files.motion(page));
    else page.say("There is no motion to save: nothing is driven.");
  }

  /** Inside another page, which may let no download through, the text stands there to be copied. */
  copy(name, text) {
    const area = Forms.element("textarea", { readonly: "", rows: 6, spellcheck: "false" }, text);
    const press = Forms.element("button", { type: "button" }, "Copy");
    press.addEventListener("click", async () => {
      area.select();
      try {
        await navigator.clipboard.writeText(text);
        this.page.say(`The text of ${name} is copied.`);
      } catch {
        this.page.say(`The text of ${name} is selected: copy it with the keyboard.`);
      }
    });
    this.copied?.remove();
    const label = Forms.element("label", {}, `If no download comes, as within some notebooks, copy the text of ${name}:`, area);
    this.copied = Forms.element("div", { class: "copied" }, label, press);
    this.section.append(this.copied);
    this.page.say(`${name} is offered for download; its text to copy stands below the buttons.`);
  }

  save(suffix, type, text) {
    const name = this.offer(suffix, new Blob([text], { type }));
    if (window !== window.top) this.copy(name, text);
  }

  /** Offer what was made for download, under the mechanism's name: the file's. */
  offer(suffix, made) {
    const name = this.page.data.name.replace(/[^\p{L}\p{N}._-]+/gu, "-").replace(/^[-.]+|[-.]+$/g, "").slice(0, 80) || "mechanism";
    const link = Forms.element("a", { download: `${name}.${suffix}`, href: URL.createObjectURL(made) });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
    // nothing tells whether a download came about; in a frame it may be forbidden
    this.page.say(`${link.download} is offered for download.`);
    return link.download;
  }
}
