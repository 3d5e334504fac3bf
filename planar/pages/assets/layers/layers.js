"use strict";
/* The layers that can be laid over the mechanism or shown beside it: a checkbox for each, remembered in the address.
   A layer is {key, label, still: whether it stays as it is while the mechanism moves, under: whether it lies below the others, draw(ink, layers): what is drawn
   over the mechanism, and a sentence on it; places(), pick(name, layers): what can be picked in the drawing by a click, in
   px; beside(layers, part): fills a part of the page, {draw(): a sentence}}. */

const CLOSE = 14;   // px: a click as near as that picks a point
const LARGE = 60;   // px
const STILL = 4;    // px: a pointer that went farther has dragged

/** Part of the address after #, shared by all who remember something there. */
const memory = {
  read(key) { return new URLSearchParams(location.hash.slice(1)).get(key); },
  write(key, value) {
    const all = new URLSearchParams(location.hash.slice(1));
    if (value === "") all.delete(key); else all.set(key, value);
    // a page inside another one may have no address to write to
    try { history.replaceState(null, "", `#${all}`); } catch { /* what is chosen is forgotten then */ }
  },
};

/** The points and links that are looked at, in the order in which they were chosen. */
class Chosen {
  constructor(page) {
    this.page = page;
    const told = memory.read("of");
    this.list = told === null ? this.usual() : this.parse(told);
  }

  has(kind, name) { return this.list.some((each) => each.kind === kind && each.name === name); }
  points() { return this.list.filter((each) => each.kind === "point").map((each) => each.name); }
  links() { return this.list.filter((each) => each.kind === "link").map((each) => each.name); }

  toggle(kind, name) {
    const had = this.has(kind, name);
    this.list = had ? this.list.filter((each) => each.kind !== kind || each.name !== name) : [...this.list, { kind, name }];
    memory.write("of", JSON.stringify(this.list.map((each) => [each.kind, each.name])));
    this.page.emit("chosen");
    this.page.say(`${kind} ${name} ${had ? "no longer shown" : "shown"}`);
  }

  parse(told) {
    const { points, links } = this.page.data;
    let list = [];
    try { list = JSON.parse(told); } catch { return this.usual(); }
    return (Array.isArray(list) ? list : [])
      .map(([kind, name]) => ({ kind, name }))
      .filter(({ kind, name }) => (kind === "point" ? Object.keys(points).includes(name) : kind === "link" && links.includes(name)));
  }

  /** Points that trace a curve of their own first, then joints that move; a few, and none of outlines. */
  usual() {
    const { page } = this, { points, frame } = page.data;
    const moving = Object.keys(points).filter((name) => !points[name].links.includes(frame) && !points[name].is_outline);
    const alone = moving.filter((name) => points[name].links.length === 1);
    return [...alone, ...moving.filter((name) => !alone.includes(name))].slice(0, 3).map((name) => ({ kind: "point", name }));
  }
}

class Layers {
  constructor(page, layers) {
    this.page = page;
    this.svg = document.getElementById("drawing");
    this.section = document.getElementById("layers");
    this.all = layers;
    this.below = [...layers].sort((a, b) => Number(b.under ?? false) - Number(a.under ?? false)); // in the order in which they are drawn
    const told = memory.read("layers");
    this.on = new Set(told === null ? page.data.layers : told.split(",").filter((key) => layers.some((each) => each.key === key)));
    this.kept = new Map();  // what was drawn by layers that stay as they are
    this.stood = new Map(); // where letters stood, by layer
    this.group = svgPart("g", { class: "layers" });
    this.panel();
    for (const event of ["move", "size", "course", "chosen", "view", "tolerance"]) page.on(event, () => this.draw());
    new ResizeObserver(() => this.draw()).observe(this.svg);
    this.picking();
    this.draw();
  }

  /** The checkboxes, with what each layer has beside it or to choose. */
  panel() {
    const box = htmlPart("fieldset", { class: "choices" }, this.section);
    htmlPart("legend", {}, box, "Layers");
    this.notes = htmlPart("div", { class: "hint notes" }, this.section);
    this.places = htmlPart("div", { class: "beside" }, this.section);
    this.parts = new Map();
    for (const layer of this.all) {
      const label = htmlPart("label", {}, box), tick = htmlPart("input", { type: "checkbox", name: layer.key }, label);
      label.append(layer.label);
      tick.checked = this.on.has(layer.key);
      tick.addEventListener("change", () => {
        if (tick.checked) this.on.add(layer.key); else this.on.delete(layer.key);
        memory.write("layers", this.all.map((each) => each.key).filter((key) => this.on.has(key)).join(",") || "none");
        this.draw();
        page.emit("shown");
        this.draw(); // beside letters that make room
      });
      const part = htmlPart(layer.beside ? "figure" : "p", { hidden: "" }, layer.beside ? this.places : this.notes);
      const beside = layer.beside?.(this, part) ?? null, told = layer.beside ? htmlPart("figcaption", {}, part) : part;
      this.parts.set(layer.key, { part, beside, told });
    }
  }

  draw() {
    const { view } = this.page;
    this.ready = view !== undefined && view !== null;
    // letters stand above all layers; a drawing made anew has new ones
    const letters = this.ready ? this.svg.querySelector(".mechanism > .letters") : null;
    if (letters !== null && letters.previousElementSibling !== this.group) letters.before(this.group);
    const shapes = [];
    if (this.ready) this.group.replaceChildren();
    const { course, chosen, view: now, tolerances } = this.page;
    for (const layer of this.below) {
      const { part, beside, told } = this.parts.get(layer.key), shown = this.on.has(layer.key);
      if (!shown) { part.hidden = true; continue; }
      let text = "";
      if (layer.draw && this.ready) {
        const kept = layer.still ? this.kept.get(layer.key) : undefined;
        if (kept !== undefined && kept.of.every((each, k) => each === [course, chosen.list, now, tolerances][k])) {
          this.group.append(kept.ink.group);
          ({ text } = kept);
        } else {
          const ink = new Ink(svgPart("g", { class: layer.key }, this.group), now.mm);
          text = layer.draw(ink, this) ?? "";
          shapes.push([layer.key, ink]);
          if (layer.still) this.kept.set(layer.key, { of: [course, chosen.list, now, tolerances], ink, text });
        }
      }
      part.hidden = beside === null && text === "";
      if (beside !== null) text = [beside.draw(), text].filter(Boolean).join("; ");
      if (told.textContent !== text) told.textContent = text;
    }
    // what the drawing's own letters keep clear of
    this.page.marks = this.below.flatMap((layer) => (layer.places && this.ready && this.on.has(layer.key) ? layer.places().map(([, place]) => place) : []));
    const lettered = shapes.filter(([, ink]) => ink.letters.length);
    if (!lettered.length) return;
    const zoom = parseFloat(getComputedStyle(document.body).fontSize) / 16;
    // letters of all layers keep clear of one another, of all arrows, and of what is lettered already
    const taken = [...this.lettered(), ...shapes.flatMap(([, ink]) => ink.taken)], bounds = this.bounds();
    for (const [key, ink] of lettered) {
      Object.assign(ink, { taken, zoom });
      if (!this.stood.has(key)) this.stood.set(key, new Map());
      ink.set(this.stood.get(key), bounds);
    }
  }

  /** The boxes of letters that the drawing has already, and of its points, in px. */
  lettered() {
    const { left, top } = this.svg.getBoundingClientRect(), found = [];
    for (const each of this.svg.querySelectorAll("text, .ground :not(g), .drives :not(g)")) {
      const box = each.getBoundingClientRect();
      // of what is large the outline alone is drawn, and there is room inside
      if (!box.width || (box.width > LARGE && box.height > LARGE)) continue;
      found.push([box.left - left, box.top - top, box.right - left, box.bottom - top]);
    }
    const { data } = this.page, ink = new Ink(this.group, this.page.view.mm);
    ink.taken = found;
    const places = new Map(Object.keys(data.points).map((name) => [name, this.at(this.page.point(name).position)]));
    for (const place of places.values()) ink.keepClear(place, 8);
    // along the sides of links, which are strong strokes
    const { vertices, strokes } = data.polygons;
    for (const { kind, from, to } of strokes) if (kind === "image") ink.keepOff(places.get(vertices[from].point), places.get(vertices[to].point));
    return found;
  }

  /** What can be seen, in px: [x, y, x, y]. */
  bounds() {
    const { width, height, head, foot } = this.page.view;
    return [0, head, width, height - foot];
  }

  at(position) { return this.page.view.toScreen(position); }

  /** A click near a point, what a layer has to pick, or on a link chooses it or no longer; whoever drags does not pick. */
  picking() {
    let from = null;
    this.svg.addEventListener("pointerdown", (event) => { from = [event.clientX, event.clientY]; });
    this.svg.addEventListener("click", (event) => {
      if (!this.ready || from === null || Math.hypot(event.clientX - from[0], event.clientY - from[1]) > STILL) return;
      const { left, top } = this.svg.getBoundingClientRect();
      const near = (places) => {
        let nearest = null, least = CLOSE;
        for (const [name, [x, y]] of places) {
          const far = Math.hypot(left + x - event.clientX, top + y - event.clientY);
          if (far < least) [nearest, least] = [name, far];
        }
        return nearest;
      };
      const point = near(Object.keys(this.page.data.points).map((name) => [name, this.at(this.page.point(name).position)]));
      if (point !== null) return this.page.chosen.toggle("point", point);
      for (const layer of this.all.filter((each) => each.pick && this.on.has(each.key))) {
        const name = near(layer.places());
        if (name !== null) return layer.pick(name, this);
      }
      const under = document.elementsFromPoint(event.clientX, event.clientY).map((each) => each.closest("[data-link]"));
      const link = under.find((each) => each !== null)?.getAttribute("data-link");
      if (link !== undefined && link !== this.page.data.frame) this.page.chosen.toggle("link", link);
    });
  }
}

/** Begin, beside `page.course`: what is chosen, the layers, the numbers and diagrams. */
function startLayers(page) {
  page.chosen = new Chosen(page);
  const rates = Object.keys(RATES);
  page.forces = page.data.forces === null ? null : new PageForces(page);
  const acting = page.forces === null ? [] : [forceArrows];
  page.layers = new Layers(page, [paths, ...rates.map(arrows), ...acting, ...rates.map(polygon), centres, centrodes, ...(page.data.dimensions.length ? [bands] : [])]);
  new Numbers(page);
  if (page.forces !== null) new ForceTables(page);
  page.charts = new Charts(page);
}
