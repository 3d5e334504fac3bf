"use strict";
/* What a reader adds to a page: points of links, and a path that is wanted of one. The page is made anew with them where it
   stands; they stay in its address, and go with the file that is saved or copied. Each change is a step of the page's history. */

const ADDED_NAME = /^[A-Z]\d*$/; // as they are given

class Additions {
  constructor(data, program) {
    Object.assign(this, { data, program, parts: null, tool: null, undo: new UndoHistory((there) => this.renew(there.added, there)) });
    globalThis.additions = this;
    this.put({ points: this.recall(data), wish: Wish.valid(Additions.parse("wish")) });
    this.parts = startPage(this.whole(), program, this.undo);
  }

  /** What is added: {points, wish}, never changed but taken the place of; `wish` follows besides where its places are dragged. */
  put(added) { Object.assign(this, { added, wish: added.wish }); }
  get points() { return this.added.points; }

  static parse(key) { try { return JSON.parse(memory.read(key)); } catch { return null; } }

  /** Points of an address that fit the page's mechanism. */
  recall({ links, names, frame }) {
    const kept = Additions.parse("points"), fits = ({ link, name, at }) => link !== frame && links.includes(link) && ADDED_NAME.test(name) && !names.includes(name) && Array.isArray(at) && at.length === 2 && at.every(Number.isFinite);
    return Array.isArray(kept) ? kept.map(([link, name, ...at]) => ({ link, name, at })).filter(fits) : [];
  }

  get mayWish() { return this.data.wanted === null && this.data.inputs.length > 0; }
  get units() { const { length, angle } = this.data.filed_units ?? this.data.units; return { length: length.si, angle: angle.si }; }
  get file() { return this.parts ? Files.mechanism(this.parts.page) : this.data.document.value; }
  say(text) { this.parts.page.say(text); }
  offer(name, text) { this.parts.saving.offer(name, new Blob([text], { type: "application/json" })); }

  /** The page's data with all that was added. */
  whole() {
    const { data, points } = this, names = [...data.names, ...points.map(({ name }) => name)], columns = Array.from(data.columns);
    const made = { ...data, names, columns, added: this.added, points: { ...data.points }, polygons: structuredClone(data.polygons) };
    points.forEach(({ link, name }, k) => {
      made.points[name] = { links: [link], at: [[0, 1].map((axis) => data.sizes + 2 * k + axis)] };
      made.polygons.vertices.push({ letter: name.toLowerCase(), point: name, fixed: false });
    });
    if (columns.length) columns.splice(3 * data.inputs.length + 6 * data.names.length, 0, ...points.flatMap(({ name }) => this.heads(name)));
    if (this.mayWish) made.wanted = Wish.data(this.wish, this.withPoints(data.document.value), made);
    return made;
  }

  /** The columns of a point, as those of another. */
  heads(name) {
    const { columns, inputs, names } = this.data, first = 3 * inputs.length;
    return columns.slice(first, first + 6).map(([head, ...rest]) => [`${name}${head.slice(names[0].length)}`, ...rest]);
  }

  withPoints(value) {
    const file = structuredClone(value);
    for (const { link, name } of this.points) (file.links[link].points ??= {})[name] = [0, 0];
    return file;
  }

  addPoint(link, place) {
    const { page } = this.parts, name = Pins.fresh(this.file, page.data.names);
    const points = [...this.points, { link, name, at: Plane.local(page.frames[link], place) }];
    const chosen = [...page.chosen.list, { kind: "point", name }];
    memory.write("of", JSON.stringify(chosen.map((each) => [each.kind, each.name])));
    this.change({ points }, `Point ${name} of ${link} is added.`);
  }

  remove(name) {
    this.change({ points: this.points.filter((each) => each.name !== name) }, `Point ${name} is gone.`);
  }

  takeWish(wish) {
    this.change({ wish }, wish === null ? "Nothing is wanted any more." : `${wish.places.length} ${wish.places.length > 1 ? "places are" : "place is"} wanted.`);
  }

  keep() {
    memory.write("points", this.points.length ? JSON.stringify(this.points.map(({ link, name, at }) => [link, name, ...at])) : "");
    const rounded = this.wish && { ...this.wish, places: this.wish.places.map((at) => at.map((each) => Number(each.toPrecision(6)))) };
    memory.write("wish", rounded ? JSON.stringify(rounded) : "");
  }

  /** Other points, or another path: one step. */
  change(other, said) {
    this.undo.add(() => this.renew({ points: this.points, wish: this.wish, ...other }));
    this.say(said);
  }

  /** The page anew with what is added, where it stands, or at a snapshot of one that had the same. */
  renew(added, there = null) {
    const { page, lens } = this.parts, stood = page.snapshot(), look = lens.drawing.lens;
    this.tool = this.tools.tool;
    this.put(added);
    page.keeping.write();
    MainPart.renew(this.parts);
    this.parts = startPage(this.whole(), this.program, this.undo);
    const { page: made } = this.parts;
    made.restore(there ?? { ...stood, wanted: made.snapshot().wanted });
    this.keep();
    if (look) this.parts.lens.look(look);
    if (this.tool) this.tools.use(this.tool);
  }

  // on the page

  attach({ page, svg, lens }) {
    this.tools = new StageTools({ page, svg, lens }, this);
    page.on("wanted", () => {
      const [item] = page.wanted?.items ?? [];
      if (!item || !this.wish || !this.mayWish || page !== globalThis.page) return; // not one that was before
      this.wish = { ...this.wish, places: item.places.map((at) => [...at]) };
      clearTimeout(this.waits);
      this.waits = setTimeout(() => this.keep(), KEEPING_PAUSE);
    });
    this.marks(page, svg);
    this.section(page, document.getElementById("added"));
  }

  /** The points that were added, where they are. */
  marks(page, svg) {
    const group = svgPart("g", { class: "added" }, svg), parts = this.points.map(({ name }) => [name, svgPart("circle", { r: 4 }, group), svgPart("text", {}, group, Letters.told(name))]);
    const place = () => {
      if (!page.view) return;
      for (const [name, dot, text] of parts) {
        const [x, y] = page.view.toScreen(page.point(name).position);
        setAll(dot, { cx: x, cy: y });
        setAll(text, { x: x + 8, y: y - 8 });
      }
    };
    for (const event of ["move", "view", "size"]) page.on(event, place);
    place();
  }

  /** The same in words and numbers: by keys points are typed. */
  section(page, section) {
    const { element } = Forms, { length } = page.data.units, form = this.mayWish ? new WishForm(this) : null, moving = page.data.links.filter((link) => link !== page.data.frame);
    if (!moving.length) return;
    const link = element("select", { "aria-label": "Link of the new point" }, ...moving.map((each) => element("option", { value: each }, each)));
    const fields = ["x", "y"].map((axis) => element("input", { type: "number", step: "any", value: 0, "aria-label": `${axis} in the link's axes, ${length.name}` }));
    const button = (text, act) => { const made = element("button", { type: "button" }, text); made.addEventListener("click", act); return made; };
    const add = button("Add point", () => this.addPoint(link.value, Plane.carry(page.frames[link.value], fields.map((each) => Number(each.value) * length.si))));
    const gone = this.points.map(({ name, link: of, at }) => element("li", {}, `${name} of ${of}, at ${at.map((each) => Forms.shown(each / length.si)).join(", ")} ${length.name} `, button(`Remove ${name}`, () => this.remove(name))));
    const box = element("details", { class: "dimensions" }, element("summary", {}, "Points of your own"), element("p", { class: "row" }, link, ...fields, element("span", { class: "unit" }, length.name), add), element("ul", {}, ...gone));
    box.open = this.points.length > 0;
    section.append(box);
    if (form) {
      form.box.classList.add("dimensions");
      section.append(form.box);
      form.show(false);
    }
  }
}
