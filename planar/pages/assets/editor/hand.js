"use strict";
/* The hand that holds the pencil: mouse, finger and keys as presses at places, which snap to pins, to what lies in line
   with them, to the sides of links, and to the grid. A press begins; a release somewhere else, or a second press, ends. */

const REACH = 13;        // px about a pin, or a link
const ALIGNED = 5;       // px: as near to the height or the breadth of a pin a place is taken there
const SIDE_PARTS = 10;   // of the grid's step, at which a place comes to lie along the side of a link
const APART = 8;         // px: a release that is farther from its press ends what was begun
const TURN_STEP = Math.PI / 12; // with Shift

/** The tools: {name, key, told: what it does, places: from how many to how many}. */
const TOOLS = {
  hand: { name: "Move", told: "Moves the mechanism, as on any page." },
  pin: { name: "Pins", told: "Drag a pin: lengths follow. A click on a pin or a link shows its numbers." },
  bar: { name: "Bar", told: "From one place to another; pins that are there are joined." },
  plate: { name: "Plate", told: "A click for each pin; one on the last again ends." },
  point: { name: "Point", told: "A click on a link, then where its new point lies." },
  ground: { name: "Ground", told: "A pin is fixed to the frame, or made free again." },
  slide: { name: "Slide", told: "From a pin along its line; where that ends on a link, on that link." },
  slot: { name: "Slot", told: "From a pin along the slot in which it runs; where that ends on a link, in a slot of that link." },
  input: { name: "Input", told: "A pin or slide is driven, or no longer." },
  gear: { name: "Wheels", told: "A click on each of two links that turn as wheels do, on empty paper for the frame; their ratio stands beside." },
  rack: { name: "Rack", told: "From a link that rolls, near the pin about which it turns, to the bar on which it rolls." },
  belt: { name: "Belt", told: "A click on each of two pulleys; their radii stand beside, left empty they are chosen." },
  cam: { name: "Cam", told: "From a link that is the cam to the pin of its follower, which slides or swings; lift, roller and law stand beside; lift and roller left empty are chosen." },
  spring: { name: "Spring", told: "From one pin to another." },
  load: { name: "Force", told: "From a pin in the force's direction." },
  opposed: { name: "Opposed forces", told: "From one pin to another: a force on each along the line that joins them, equal and opposite." },
  mass: { name: "Mass", told: "A click on a link." },
  wish: { name: "Wanted path", told: "Where a point is to come: drawn freehand, or place after place; a click on the first closes it." },
  picture: { name: "Picture", told: "Two places of the picture underneath, whose distance is then typed beside the drawing." },
  erase: { name: "Erase", told: "A pin or a link goes." },
};

class Hand {
  constructor(editing) {
    Object.assign(this, { editing, pending: [], cursor: null, spot: null, dragged: null, from: null, isPressing: false, waiting: [] });
    this.watchPresses();
  }

  /** Know whether a button of the pointer is down anywhere: a control that is replaced meanwhile would not hear of its click. */
  watchPresses() {
    const end = () => {
      if (!this.isPressing) return;
      this.isPressing = false;
      this.rested();
    };
    document.addEventListener("pointerdown", () => { this.isPressing = true; }, true);
    for (const name of ["pointerup", "pointercancel"]) document.addEventListener(name, () => setTimeout(end), true); // after the click
    document.addEventListener("pointermove", ({ buttons }) => { if (!buttons) end(); }, true); // released out of the window
  }

  /** Hear of a stage before anything on it does. */
  attach(stage) {
    const own = (act) => (event) => {
      if (this.editing.tool === "hand" || !event.target.closest("#drawing")) return;
      act(event);
    };
    stage.addEventListener("pointerdown", own((event) => {
      if (event.button !== 0) return;
      event.stopPropagation();
      this.editing.svg.setPointerCapture(event.pointerId);
      this.cursor = null;
      this.from = [event.clientX, event.clientY];
      this.press(this.at(event));
    }), true);
    stage.addEventListener("pointermove", own((event) => {
      event.stopPropagation();
      this.lead(this.at(event));
    }), true);
    stage.addEventListener("pointerup", own((event) => {
      event.stopPropagation();
      if (this.from === null) return;
      const far = Math.hypot(event.clientX - this.from[0], event.clientY - this.from[1]) > APART;
      this.from = null;
      this.release(this.at(event), far);
      this.rested();
    }), true);
    stage.addEventListener("pointercancel", own(() => this.cancel()), true);
    stage.addEventListener("click", own((event) => event.stopPropagation()), true);
    stage.addEventListener("keydown", own((event) => this.key(event)), true);
  }

  /** Once nothing is held. */
  async rest() { while (this.from !== null || this.dragged !== null || this.isPressing) await new Promise((go) => { this.waiting.push(go); }); }
  rested() { for (const go of this.waiting.splice(0)) go(); }

  /** The place of an event: {pin, link, at}, and the same not drawn to anything, `free`. */
  at(event) {
    const { left, top } = this.editing.svg.getBoundingClientRect();
    const px = [event.clientX - left, event.clientY - top];
    return { ...this.snapped(px, event), free: this.editing.view.toWorld(px) };
  }

  snapped(px, { altKey = false, shiftKey = false } = {}) {
    const { editing } = this, { view } = editing, to = view.toScreen, held = this.dragged?.pin ?? null;
    const pins = [...editing.at].filter(([name]) => name !== held);
    const [pin, near] = cheapest(pins, ([, at]) => Plane.apart(to(at), px)) ?? [];
    if (near && Plane.apart(to(near), px) <= REACH) return { pin, link: this.linkAt(px), at: near };
    let at = view.toWorld(px);
    if (!altKey) {
      const { step } = editing.sketch;
      const line = (axis) => cheapest(pins.filter(([, each]) => Math.abs(to(each)[axis] - px[axis]) <= ALIGNED), ([, each]) => Math.abs(to(each)[axis] - px[axis]))?.[1][axis];
      at = at.map((each, axis) => line(axis) ?? Math.round(each / step) * step);
      const side = this.sidePlace(px, held);
      if (side && Plane.apart(to(side), px) < Plane.apart(to(at), px)) at = side;
    }
    const start = this.pending[this.pending.length - 1]?.at;
    if (shiftKey && start) {
      const off = Plane.minus(view.toWorld(px), start), turn = Math.round(Math.atan2(off[1], off[0]) / TURN_STEP) * TURN_STEP;
      at = Plane.on(start, [Math.cos(turn), Math.sin(turn)], Plane.length(off) * Math.cos(Math.atan2(off[1], off[0]) - turn));
    }
    return { pin: null, link: this.linkAt(px), at };
  }

  /** The link that lies at a place (px), the frame left aside. */
  linkAt(px) {
    const { editing } = this, { file, view } = editing;
    const far = (link) => {
      const spots = editing.sketch.spots(link).map(view.toScreen);
      return this.sides(link).reduce((least, side) => Math.min(least, Hand.toPiece(px, ...side.map(view.toScreen))), spots.length === 1 ? Plane.apart(px, spots[0]) : Infinity);
    };
    const links = Object.keys(file.links).filter((each) => each !== file.frame), best = cheapest(links, far);
    return best !== undefined && far(best) <= REACH ? best : null;
  }

  /** The sides of a link: [[place, place], ...]. */
  sides(link) {
    const spots = this.editing.sketch.spots(link), closed = spots.length > 2 ? [...spots, spots[0]] : spots;
    return closed.slice(1).map((b, k) => [closed[k], b]);
  }

  /** The place upon the side of a link at which the pointer is, to a tenth of the grid's step from where the side begins;
      null where it is at none. Links that go with the pin held are none to come to. */
  sidePlace(px, held) {
    const { editing } = this, { file, view, sketch } = editing, step = sketch.step / SIDE_PARTS;
    const own = held === null ? [] : Pins.carriers(file, held), links = Object.keys(file.links).filter((each) => each !== file.frame && !own.includes(each));
    const [start, stop] = cheapest(links.flatMap((link) => this.sides(link)), (side) => Hand.toPiece(px, ...side.map(view.toScreen))) ?? [];
    if (!start || Hand.toPiece(px, ...[start, stop].map(view.toScreen)) > ALIGNED) return null;
    const way = Plane.unit(Plane.minus(stop, start)), far = Plane.dot(Plane.minus(view.toWorld(px), start), way);
    return Plane.on(start, way, Math.max(0, Math.min(Plane.apart(start, stop), Math.round(far / step) * step)));
  }

  /** How far a place is from a piece of a line. */
  static toPiece(p, a, b) {
    const way = Plane.minus(b, a), square = Plane.dot(way, way), part = square ? Math.max(0, Math.min(1, Plane.dot(Plane.minus(p, a), way) / square)) : 0;
    return Plane.apart(p, Plane.on(a, way, part));
  }

  press(spot) {
    const { editing } = this, { tool } = editing;
    this.spot = spot;
    if (tool === "pin") {
      editing.linkBefore = editing.chosen?.kind === "link" ? editing.chosen.name : null;
      editing.choose(spot.pin !== null ? { kind: "pin", name: spot.pin } : spot.link !== null ? { kind: "link", name: spot.link } : null);
      if (spot.pin !== null) this.dragged = editing.leading.take(spot.pin);
      return;
    }
    if (["bar", "spring", "load", "opposed", "slide", "slot", "point", "gear", "belt", "rack", "cam", "picture"].includes(tool)) {
      if (this.pending.length) this.finish(spot);
      else this.begin(spot);
    } else if (tool === "plate") this.corner(spot);
    else if (tool === "wish") { if (this.cursor === null) editing.wishing.press(spot); else editing.wishing.place(spot); }
    else this.once(spot);
  }

  lead(spot) {
    this.spot = spot;
    if (this.dragged !== null) { if (this.from !== null || this.cursor !== null) this.editing.leading.lead(this.dragged, spot.at); return; }
    if (this.pending.length) this.editing.sketch.draw();
    else if (this.editing.tool === "wish" && this.from !== null) this.editing.wishing.lead(spot);
  }

  release(spot, far) {
    if (this.editing.tool === "wish") { this.editing.wishing.release(spot); return; }
    if (this.dragged !== null) {
      const held = this.dragged;
      this.dragged = null;
      if (far) this.editing.leading.drop(held, spot.at);
      else this.editing.sketch.draw();
    } else if (far && this.pending.length === 1 && this.editing.tool !== "plate") this.finish(spot);
  }

  begin(spot) {
    const { tool } = this.editing, wanted = { spring: ["pin", "a spring begins at a pin"], load: ["pin", "a force acts on a pin"], opposed: ["pin", "a force acts on a pin"], point: ["link", "click a link first"], rack: ["link", "a pinion is a link"], cam: ["link", "a cam is a link"], slot: ["pin", "a pin runs in a slot: begin at one"] }[tool];
    if (wanted && spot[wanted[0]] === null) { this.editing.say(`${wanted[1]}.`); return; }
    this.pending = [spot];
    this.editing.sketch.draw();
  }

  finish(spot) {
    const { editing, pending: [first] } = this, { file, panel: { numbers } } = editing, wheels = [first, spot].map(({ link }) => link ?? file.frame);
    const acts = {
      bar: (draft) => Draw.link(draft, [first, spot]),
      spring: (draft) => Draw.spring(draft, [first, spot]),
      load: (draft) => Draw.load(draft, first.pin, spot.at),
      opposed: (draft) => Draw.opposedForces(draft, [first, spot]),
      slide: (draft) => Draw.slide(draft, first, this.guide(first, spot) ?? file.frame, spot.at),
      point: (draft) => Draw.point(draft, first.link, spot),
      slot: (draft) => Couplings.slot(draft, first, this.guide(first, spot) ?? file.frame, spot.at),
      gear: (draft) => Couplings.gear(draft, wheels, numbers.read("ratio")),
      belt: (draft) => Couplings.belt(draft, wheels, ["first", "second"].map((key) => numbers.length(key)), numbers.read("crossed")),
      rack: (draft) => Couplings.rack(draft, first.link, spot.link, first.at),
      cam: (draft) => Couplings.cam(draft, first.link, spot.pin, { lift: numbers.lift(), roller: numbers.length("roller"), law: numbers.law() }),
    };
    this.pending = [];
    if (editing.tool === "picture") editing.underlay.mark([first, spot].map((each) => each.free ?? each.at));
    else editing.perform(acts[editing.tool]);
  }

  /** The link on which a slide ends, if it is not one that carries the pin. */
  guide(first, spot) {
    const { file } = this.editing, own = first.pin === null ? [] : Pins.carriers(file, first.pin);
    return spot.link !== null && !own.includes(spot.link) ? spot.link : null;
  }

  corner(spot) {
    const same = (each) => (each.pin !== null && each.pin === spot.pin) || Plane.apart(...[each, spot].map(({ at }) => this.editing.view.toScreen(at))) < REACH;
    if (this.pending.length > 2 && (same(this.pending[this.pending.length - 1]) || same(this.pending[0]))) {
      const spots = this.pending;
      this.pending = [];
      this.editing.perform((draft) => Draw.link(draft, spots));
    } else if (!this.pending.some(same)) {
      this.pending.push(spot);
      this.editing.sketch.draw();
    }
  }

  once({ pin, link, at }) {
    const { editing } = this, { tool } = editing;
    if (tool === "ground") editing.perform((draft) => Draw.ground(draft, { pin, at }));
    else if (tool === "input") { if (pin !== null) editing.perform((draft) => Draw.input(draft, pin)); else editing.say("A pin is driven: click one."); }
    else if (tool === "mass") { if (link !== null) editing.perform((draft) => Draw.mass(draft, link)); else editing.say("A link has a mass: click one."); }
    else if (pin !== null) editing.perform((draft) => Draw.removePin(draft, pin));
    else if (link !== null) editing.perform((draft) => Draw.removeLink(draft, link));
  }

  cancel() {
    this.pending = [];
    this.dragged = null;
    this.from = null;
    this.rested();
    this.editing.leading.revert();
  }

  /** Arrows lead the cross by the grid, Shift ten times as far; N to the next pin; Enter presses, Escape leaves off. */
  key(event) {
    const { editing } = this, ways = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }, way = ways[event.key];
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const { view, sketch } = editing, show = () => {
      const spot = this.snapped(view.toScreen(this.cursor), { altKey: true });
      this.lead(spot);
      sketch.draw();
      editing.tell(spot);
    };
    if (way) {
      const { step } = sketch, start = this.cursor ?? view.toWorld([view.width / 2, view.height / 2]).map((each) => Math.round(each / step) * step);
      this.cursor = this.cursor === null ? start : start.map((each, k) => (Math.round(each / step) + way[k] * (event.shiftKey ? 10 : 1)) * step);
      show();
    } else if (event.key.toLowerCase() === "n" && editing.at.size) {
      const pins = [...editing.at], now = pins.findIndex(([, at]) => this.cursor && Plane.apart(at, this.cursor) < 1e-9);
      [, this.cursor] = pins[(now + (event.shiftKey ? pins.length - 1 : 1)) % pins.length];
      show();
    } else if (event.key === "Enter" && this.cursor) {
      const spot = this.snapped(view.toScreen(this.cursor), { altKey: true });
      if (this.dragged !== null) { this.release(spot, true); this.rested(); }
      else this.press(spot);
      sketch.draw();
    } else if (event.key === "Escape") this.cancel();
    else if (event.key === "Delete" && editing.chosen) editing.erase();
    else if (event.key === " " || event.key === "Home") event.preventDefault();
    else return;
    event.preventDefault();
    event.stopPropagation();
  }
}
