"use strict";
/* The pins of a mechanism, of the frame too, dragged on any page: the lengths of their links follow, and all other pins stay
   where they are. By keys: N chooses the next pin, arrows move it. */

const PIN_REACH = 14;  // px
const PIN_STEP = 0.002; // sizes: as far an arrow moves a pin, ten times as far with Shift

class PinDragging {
  constructor(page, svg, lens, before) {
    Object.assign(this, { page, svg, before, on: false, along: false, held: null, chosen: null });
    if (!page.data.dimensions.length) return; // its numbers are no page's to change
    this.button = lens.tool("Pins", "Pins: drag them, and lengths follow", () => this.turn(!this.on));
    this.rest = lens.tool("Rest along", "Rest along: it keeps its lengths and goes with a pin", () => this.goAlong(!this.along));
    this.goAlong(false);
    this.turn(false);
    const { filed_units: { length, angle } } = page.data, stage = svg.parentNode;
    this.units = { length: length.si, angle: angle.si };
    const own = (act) => (event) => { if (this.on && event.target.closest("#drawing")) act(event); };
    stage.addEventListener("pointerdown", own((event) => this.press(event)), true);
    stage.addEventListener("pointermove", own((event) => this.lead(event)), true);
    for (const end of ["pointerup", "pointercancel"]) stage.addEventListener(end, own((event) => this.drop(event)), true);
    stage.addEventListener("keydown", own((event) => this.key(event)), true);
    for (const event of ["move", "view"]) page.on(event, () => this.draw());
  }

  turn(on) {
    Object.assign(this, { on, chosen: null });
    this.button.setAttribute("aria-pressed", String(on));
    this.rest.hidden = !on;
    if (on) {
      this.before();
      this.page.say("Drag a pin, and the lengths of its links follow. Keys: N chooses the next pin, arrows move it.");
    }
    this.draw();
  }

  /** Whether the rest keeps its lengths and goes along, or stays where it is. */
  goAlong(along) {
    this.along = along;
    this.rest.setAttribute("aria-pressed", String(along));
  }

  draw() {
    this.group?.remove();
    if (!this.on || !this.page.view) return;
    this.group = svgPart("g", { class: "pencil" }, this.svg);
    for (const name of this.page.data.names) {
      const [cx, cy] = this.page.view.toScreen(this.page.point(name).position);
      svgPart("circle", { cx, cy, r: 6, class: name === this.chosen ? "handle chosen" : "handle" }, this.group);
    }
  }

  place(event) {
    const { left, top } = this.svg.getBoundingClientRect();
    return [event.clientX - left, event.clientY - top];
  }

  /** What a pin is moved from. */
  take(pin) {
    const { page, units } = this, file = fileNow(page, page.data.document.value, units);
    const at = new Map(page.data.names.map((name) => [name, page.point(name).position]));
    this.before();
    return { pin, placed: new Placed(file, at, units), inputs: page.data.inputs.map((_, k) => page.input(k)), made: null };
  }

  press(event) {
    const { page } = this, px = this.place(event), far = (name) => Plane.apart(page.view.toScreen(page.point(name).position), px);
    const pin = cheapest(page.data.names, far);
    if (event.button !== 0 || pin === undefined || far(pin) > PIN_REACH) return; // links are dragged as ever
    event.stopPropagation();
    event.preventDefault();
    this.svg.focus({ preventScroll: true });
    this.svg.setPointerCapture(event.pointerId);
    this.chosen = pin;
    this.held = this.take(pin);
    drawing.hold(true);
    this.draw();
  }

  lead(event) {
    if (this.held === null) return;
    event.stopPropagation();
    this.held.to = this.page.view.toWorld(this.place(event));
    if (this.held.waits) return;
    this.held.waits = true;
    requestAnimationFrame(() => { if (this.held) this.pull(this.held); });
  }

  drop(event) {
    if (this.held === null) return;
    event.stopPropagation();
    const { held } = this;
    if (held.to) this.pull(held);
    this.held = null;
    drawing.hold(false);
  }

  /** As far as it goes together. */
  pull(held) {
    held.waits = false;
    const { pin, to, inputs, placed } = held;
    held.made = this.along ? placed.along(pin, to, inputs, null) : placed.moved(pin, to, inputs);
    const why = (this.along ? solveAlong : solvePlaced)(this.page, held, this.units);
    this.page.say(why ? `${held.pin} stays: ${why}.` : "");
  }

  key(event) {
    const ways = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }, way = ways[event.key], { page } = this;
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key.toLowerCase() === "n") {
      const { names } = page.data, step = event.shiftKey ? names.length - 1 : 1;
      this.chosen = names[(names.indexOf(this.chosen) + step) % names.length] ?? names[0];
      this.draw();
      this.tell();
    } else if (way && this.chosen !== null) {
      const by = PIN_STEP * page.data.size * (event.shiftKey ? 10 : 1), held = this.take(this.chosen);
      held.to = page.point(this.chosen).position.map((each, k) => each + by * way[k]);
      this.pull(held);
      this.tell();
    } else if (event.key === "Escape") this.turn(false);
    else return;
    event.preventDefault();
    event.stopPropagation();
  }

  tell() {
    const { page, chosen } = this, { length } = page.data.units;
    page.say(`Pin ${chosen} at ${page.point(chosen).position.map((each) => Forms.shown(each / length.si)).join(", ")} ${length.name}.`);
  }
}
