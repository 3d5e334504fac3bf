"use strict";
/* What is drawn above the mechanism while it is drawn by hand: pins to take hold of, what is begun, the grid, and, where
   there is no position to show, the links as they lie on the paper. */

const HANDLE = 6;         // px: the radius of a pin's handle
const GRID_ROOM = 24;     // px between lines of the grid, at least
const FEWEST_GRID = 4000; // places: more are no grid any more

class Sketch {
  constructor(editing) { this.editing = editing; }

  /** The step of the grid (m): round in the unit of the file. */
  get step() {
    const { view, units } = this.editing;
    return roundUp(GRID_ROOM / view.scale / units.length) * units.length;
  }

  draw() {
    const { editing } = this, { svg, view } = editing;
    if (!view) return;
    this.group?.remove();
    this.group = svgPart("g", { class: "pencil" }, svg);
    const px = (at) => view.toScreen(at);
    if (editing.tool !== "hand") this.grid(px);
    if (!editing.solved) this.links(px);
    this.wish(px);
    if (editing.tool === "hand") return;
    for (const [pin, at] of editing.at) {
      const [cx, cy] = px(at), { chosen } = editing;
      svgPart("circle", { cx, cy, r: HANDLE, class: chosen?.kind === "pin" && chosen.name === pin ? "handle chosen" : "handle" }, this.group);
    }
    if (editing.tool === "picture" && editing.underlay.marks) this.marks(editing.underlay.marks.map(px));
    if (editing.chosen?.kind === "link") this.outline(editing.chosen.name, "outline", px);
    this.begun(px);
  }

  grid(px) {
    const { view } = this.editing, { step } = this, [low, high] = [view.toWorld([0, view.height]), view.toWorld([view.width, 0])];
    const from = low.map((each) => Math.ceil(each / step)), to = high.map((each) => Math.floor(each / step));
    if ((to[0] - from[0]) * (to[1] - from[1]) > FEWEST_GRID) return;
    let d = "";
    for (let i = from[0]; i <= to[0]; i++) for (let j = from[1]; j <= to[1]; j++) d += `M${px([i * step, j * step]).map((each) => each.toFixed(1)).join(" ")}h0`;
    svgPart("path", { d, class: "grid" }, this.group);
  }

  /** The places of a link's pins. */
  spots(link) {
    const { editing } = this, { pins, file } = editing.placed, own = editing.nearest[link] ?? {};
    return Pins.ofLink(file.links[link]).map((point) => own[point] ?? editing.at.get(Pins.of(pins, link, point))).filter(Boolean);
  }

  outline(link, kind, px) {
    const spots = this.spots(link).map((each) => px(each).join(",")).join(" ");
    return svgPart(this.spots(link).length > 2 ? "polygon" : "polyline", { points: spots, class: kind }, this.group);
  }

  links(px) {
    const { editing } = this, { file } = editing, loose = editing.answer?.loose ?? [];
    for (const link of Object.keys(file.links)) if (link !== file.frame) this.outline(link, loose.includes(link) ? "link loose" : "link", px);
    for (const pair of file.pairs ?? []) {
      const line = Placed.slides(pair) ? editing.placed.line(pair) : null, at = line && editing.placed.slider(pair);
      if (!at) continue;
      const ends = [-40, 40].map((far) => { const [x, y] = px(at); return `${x + far * line.way[0]},${y - far * line.way[1]}`; });
      svgPart("polyline", { points: ends.join(" "), class: "guide" }, this.group);
    }
    for (const [a, b] of this.gaps()) {
      const [cx, cy] = px(b);
      svgPart("polyline", { points: [a, b].map((each) => px(each).join(",")).join(" "), class: "gap" }, this.group);
      svgPart("circle", { cx, cy, r: 4, class: "pin" }, this.group);
    }
    for (const point of Pins.ofLink(file.links[file.frame])) {
      const at = editing.at.get(Pins.of(editing.placed.pins, file.frame, point));
      if (!at) continue;
      const [x, y] = px(at);
      svgPart("path", { d: `M${x} ${y}l-9 16h18z`, class: "ground" }, this.group);
    }
    for (const [pin, at] of editing.at) {
      const [x, y] = px(at);
      svgPart("circle", { cx: x, cy: y, r: 4, class: "pin" }, this.group);
      svgPart("text", { x: x + 9, y: y - 9, class: "name" }, this.group, Letters.told(pin));
    }
  }

  /** From where to where pins stay open: [[place, place], ...]. */
  gaps() {
    const { editing: { nearest, placed } } = this;
    return [...placed.pins.values()].flatMap((members) => {
      const [first, ...others] = members.flatMap(([link, point]) => (nearest[link]?.[point] ? [nearest[link][point]] : []));
      return others.filter((each) => Plane.apart(first, each) > ON_LINE * Math.max(Plane.length(first), 1e-3)).map((each) => [first, each]);
    });
  }

  /** The path that is wanted, as it is drawn, or where the page has no mechanism to show it of. */
  wish(px) {
    const { wish, wishing: { stroke }, parts: { page } } = this.editing, points = (places) => places.map((at) => px(at).join(",")).join(" ");
    if (stroke.line) svgPart("polyline", { points: points(stroke.line), class: "wish" }, this.group);
    if (!wish?.places.length || (this.editing.solved && page.wanted !== null)) return;
    svgPart(Wish.isClosed(wish) ? "polygon" : "polyline", { points: points(wish.places), class: "wish" }, this.group);
    for (const at of wish.places) { const [x, y] = px(at); svgPart("path", { d: `M${x - 5} ${y - 5}l10 10M${x - 5} ${y + 5}l10 -10`, class: "wish" }, this.group); }
  }

  /** The places by which the picture is laid. */
  marks(places) {
    svgPart("polyline", { points: places.map((each) => each.join(",")).join(" "), class: "begun" }, this.group);
    for (const [x, y] of places) svgPart("path", { d: `M${x - 9} ${y}h18M${x} ${y - 9}v18`, class: "guide" }, this.group);
  }

  /** What is begun, and where the keys are. */
  begun(px) {
    const { hand } = this.editing, { pending, cursor, spot } = hand;
    const places = pending.map((each) => each.at);
    if (places.length && (spot ?? cursor)) places.push((spot ?? { at: cursor }).at);
    if (places.length > 1) svgPart("polyline", { points: places.map((each) => px(each).join(",")).join(" "), class: "begun" }, this.group);
    for (const each of pending) { const [cx, cy] = px(each.at); svgPart("circle", { cx, cy, r: HANDLE, class: "handle begun" }, this.group); }
    if (cursor) {
      const [x, y] = px(cursor);
      svgPart("path", { d: `M${x - 14} ${y}h28M${x} ${y - 14}v28`, class: "cursor" }, this.group);
    }
  }
}
