"use strict";
/* What is wanted, drawn under the mechanism: crosses, numbered where their order counts, a closed curve, links in their
   poses; and lines to where the mechanism comes nearest. It is moved by mouse, finger or arrow keys. */

const WANTED_CROSS = 0.9;   // mm: half of a cross
const WANTED_REACH = [5, 15]; // px: as near a place can be taken hold of, the less the closer places are together
const WANTED_STEP = 2;      // px: a step by key, ten times that with Shift
const WANTED_TURN = Math.PI / 180; // a step by key of a pose's angle
const WANTED_ARM = 9;       // mm: how far from a pose's origin its angle is taken hold of
const MOST_NUMBERED = 60;   // places of one item that have numbers
const NUMBER_ROOM = 24;     // px from one number to the next

class WantedDrawing {
  constructor(page, svg, drawing) {
    Object.assign(this, { page, svg, drawing, wanted: page.wanted, held: null });
    svg.setAttribute("role", "group"); // what is in it takes the focus
    this.group = svgPart("g", { class: "wanted" });
    this.grips = svgPart("g", { class: "wanted handles" });
    this.group.addEventListener("pointerdown", (event) => this.take(event));
    this.grips.addEventListener("pointerdown", (event) => this.take(event));
    this.grips.addEventListener("keydown", (event) => this.key(event));
    svg.addEventListener("pointermove", (event) => this.lead(event));
    for (const end of ["pointerup", "pointercancel"]) svg.addEventListener(end, () => this.drop());
    // whoever has dragged does not pick
    svg.addEventListener("click", (event) => { if (this.dragged) event.stopImmediatePropagation(); this.dragged = false; }, true);
    this.parts = this.wanted.items.map((item, k) => this.made(item, k));
    svg.append(this.grips); // beside the mechanism, which is drawn anew with every size, so that the focus stays
    page.on("view", () => this.build());
    page.on("wanted", () => this.place());
    page.on("size", () => this.place());
    this.build();
  }

  /** What is seen goes below a mechanism that was drawn anew. */
  build() {
    const { group, drawing } = this;
    if (!drawing.levels) return;
    drawing.root.prepend(group);
    this.place();
  }

  made(item, k) {
    const { group, grips } = this;
    if (item.kind === "function") return null;
    const own = svgPart("g", { "data-of": item.of }, group);
    svgPart("title", {}, own, `wanted of ${item.of}`);
    const whole = item.is_closed ? { curve: svgPart("path", { class: "curve" }, own), grip: svgPart("path", { class: "handle", "data-wanted": `${k}`, ...named(`the wanted curve of ${item.of}`) }, grips) } : null;
    const numbered = item.in_order && item.weights.length <= MOST_NUMBERED;
    const places = item.weights.map((_, i) => {
      const miss = svgPart("path", { class: "miss" }, own);
      const ghost = item.kind === "poses" ? svgPart("path", { class: "ghost" }, own) : null;
      const cross = svgPart("path", { class: "cross" }, own);
      const number = numbered ? svgPart("text", {}, own, String(i + 1)) : null;
      const what = item.kind === "poses" ? "pose" : "place";
      const grip = svgPart("circle", { class: "handle", "data-wanted": `${k} ${i}`, ...named(`${what} ${i + 1} wanted of ${item.of}`) }, grips);
      const arm = ghost && { line: svgPart("path", { class: "arm" }, own), end: svgPart("circle", { class: "end" }, own) };
      const turn = ghost && svgPart("circle", { class: "handle", "data-wanted": `${k} ${i} turn`, ...named(`angle of pose ${i + 1} wanted of ${item.of}`) }, grips);
      return { miss, ghost, cross, number, grip, arm, turn };
    });
    return { whole, places };
  }

  /** Put everything where it is wanted. */
  place() {
    const { page } = this, { view } = page;
    if (!view) return;
    const reached = new Map(this.wanted.reached().map(({ item, i, at }) => [`${this.wanted.items.indexOf(item)} ${i}`, at]));
    this.wanted.items.forEach((item, k) => {
      if (this.parts[k] === null) return;
      const { whole, places } = this.parts[k], spots = item.places.map((at) => view.toScreen(at)), apart = leastApart(spots);
      const reach = Math.max(WANTED_REACH[0], Math.min(WANTED_REACH[1], apart / (whole ? 4 : 2))), half = Math.min(WANTED_CROSS * view.mm, Math.max(1.5, apart / 3));
      if (whole) for (const each of Object.values(whole)) each.setAttribute("d", `${lineOf(spots)}Z`);
      places.forEach(({ miss, ghost, cross, number, grip, arm, turn }, i) => {
        const [x, y] = spots[i], there = reached.get(`${k} ${i}`);
        cross.setAttribute("d", `M${x - half} ${y - half}L${x + half} ${y + half}M${x - half} ${y + half}L${x + half} ${y - half}`);
        miss.setAttribute("d", there ? lineOf([[x, y], view.toScreen(there)]) : "");
        setAll(grip, { cx: x, cy: y, r: reach });
        number?.setAttribute("visibility", i % Math.max(1, Math.ceil(NUMBER_ROOM / apart)) ? "hidden" : "visible");
        if (number) setAll(number, { "font-size": Math.max(11, 2.8 * view.mm), x: x + 1.6 * half, y: y - 0.8 * half });
        if (!ghost) return;
        const f = { x: item.places[i][0], y: item.places[i][1], cos: Math.cos(item.angles[i]), sin: Math.sin(item.angles[i]) };
        const corners = convexHull(this.corners(item.of)).map((at) => view.toScreen(Plane.carry(f, at)));
        ghost.setAttribute("d", corners.length > 1 ? `${lineOf(corners)}Z` : "");
        const far = WANTED_ARM * view.mm, end = [x + far * f.cos, y - far * f.sin];
        arm.line.setAttribute("d", lineOf([[x, y], end]));
        setAll(arm.end, { cx: end[0], cy: end[1], r: 0.7 * view.mm });
        setAll(turn, { cx: end[0], cy: end[1], r: WANTED_REACH[1] });
      });
    });
  }

  /** The points of a link in its own axes. */
  corners(link) {
    const { data, linkage: { sizes } } = this.page;
    return Object.values(data.points).flatMap(({ links, at }) => links.flatMap((each, k) => (each === link ? [at[k].map((n) => sizes[n])] : [])));
  }

  where(event) {
    const box = this.svg.getBoundingClientRect();
    return this.page.view.toWorld([event.clientX - box.left, event.clientY - box.top]);
  }

  take(event) {
    const grip = event.target.closest("[data-wanted]");
    if (event.button !== 0 || grip === null) return;
    event.stopPropagation(); // the link below is not meant
    event.preventDefault();
    grip.focus({ preventScroll: true });
    const [k, i, turn] = grip.dataset.wanted.split(" "), item = this.wanted.items[k];
    this.held = { item, i: i === undefined ? null : Number(i), turn: turn !== undefined, at: this.where(event), moved: false };
    this.svg.setPointerCapture(event.pointerId);
  }

  lead(event) {
    const { held } = this;
    if (held === null) return;
    const to = this.where(event), by = Plane.minus(to, held.at);
    if (!held.moved) {
      if (Plane.length(by) * this.page.view.scale < CLICK) return;
      held.moved = this.dragged = true;
      this.drawing.hold(true);
      this.svg.classList.add("held");
    }
    if (held.turn) {
      const [dx, dy] = Plane.minus(to, held.item.places[held.i]);
      held.item.angles[held.i] += halfTurn(Math.atan2(dy, dx) - held.item.angles[held.i]);
    } else this.move(held.item, held.i, by);
    held.at = to;
    this.wanted.changed();
  }

  drop() {
    if (this.held === null) return;
    if (this.held.moved) { this.drawing.hold(false); this.said(this.held); }
    this.held = null;
    this.svg.classList.remove("held");
  }

  /** Move a place, or all of an item. */
  move(item, i, [dx, dy]) {
    for (const at of i === null ? item.places : [item.places[i]]) { at[0] += dx; at[1] += dy; }
  }

  /** Arrow keys move what has the focus, or turn it. */
  key(event) {
    const way = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    const grip = event.target.closest("[data-wanted]");
    if (!way || grip === null || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    event.stopPropagation();
    const [k, i, turn] = grip.dataset.wanted.split(" "), item = this.wanted.items[k], by = event.shiftKey ? 10 : 1;
    const held = { item, i: i === undefined ? null : Number(i), turn: turn !== undefined };
    if (held.turn) item.angles[held.i] += by * WANTED_TURN * (way[0] + way[1]);
    else this.move(item, held.i, Plane.times(way, (by * WANTED_STEP) / this.page.view.scale));
    this.wanted.changed();
    this.said(held);
  }

  /** Where what was moved is now. */
  said({ item, i, turn }) {
    const { page } = this, { length, angle } = page.data.units;
    if (i === null) return page.say(`The wanted curve of ${item.of} was moved.`);
    if (turn) return page.say(`Pose ${i + 1} of ${item.of}: ${readable(item.angles[i] / angle.si)} ${angle.name}.`);
    const [x, y] = item.places[i].map((each) => readable(each / length.si));
    page.say(`${item.kind === "poses" ? "Pose" : "Place"} ${i + 1} of ${item.of}: ${x}, ${y} ${length.name}.`);
  }
}

const named = (text) => ({ tabindex: "0", role: "button", "aria-label": `${text}; arrow keys move it` });
const lineOf = (spots) => spots.map(([x, y], k) => `${k ? "L" : "M"}${x.toFixed(2)} ${y.toFixed(2)}`).join("");
const halfTurn = (angle) => angle - 2 * Math.PI * Math.round(angle / (2 * Math.PI));
const setAll = (element, attributes) => { for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value); };

/** How near places that follow one another are (px). */
function leastApart(spots) {
  let least = Infinity;
  for (let k = 1; k < spots.length; k++) least = Math.min(least, Plane.apart(spots[k - 1], spots[k]));
  return least;
}
