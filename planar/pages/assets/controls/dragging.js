"use strict";
/* Take hold of a link with mouse or finger: the inputs go where they bring the place held nearest to the pointer. */

const NUDGE = 0.25;      // rad, sizes: the longest step of the inputs between two looks
const LOOKS = 12;        // at where the place held has come to, in one frame
const CLICK = 3;         // px: what moves less is a click

class Dragging {
  constructor(page, svg) {
    this.page = page;
    this.svg = svg;
    this.held = null;
    this.taken = () => undefined; // what is to be done when a link is taken hold of
    svg.addEventListener("pointerdown", (event) => this.take(event));
    svg.addEventListener("pointermove", (event) => this.lead(event));
    for (const end of ["pointerup", "pointercancel"]) svg.addEventListener(end, () => this.drop());
  }

  where(event) {
    const box = this.svg.getBoundingClientRect();
    return this.page.view.toWorld([event.clientX - box.left, event.clientY - box.top]);
  }

  take(event) {
    if (event.button !== 0 || !this.page.data.inputs.length) return;
    // layers may lie above the links
    const grips = document.elementsFromPoint(event.clientX, event.clientY).filter((each) => each.classList.contains("grip"));
    const grip = grips.find((each) => !each.classList.contains("area")) ?? grips[0]; // a plate may lie above other links
    if (!grip) return;
    const link = grip.closest("[data-link]").dataset.link, at = this.where(event);
    this.held = { link, local: Plane.local(this.page.frames[link], at), target: at, from: [event.clientX, event.clientY], said: false, moved: false };
  }

  lead(event) {
    const { held, svg } = this;
    if (held === null) return;
    if (!held.moved && Math.hypot(event.clientX - held.from[0], event.clientY - held.from[1]) < CLICK) return;
    if (!held.moved) {
      held.moved = true;
      svg.setPointerCapture(event.pointerId);
      svg.classList.add("held");
      this.taken();
    }
    held.target = this.where(event);
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      if (this.held !== null) this.pull();
    });
  }

  drop() {
    if (this.held?.moved) this.pull();
    this.held = null;
    this.svg.classList.remove("held");
  }

  /** Bring the place held as near to the pointer as it comes. */
  pull() {
    const { page, held } = this, { linkage } = page, start = Array.from(linkage.u);
    let stuck = null;
    for (let look = 0; look < LOOKS && stuck === null; look++) {
      const step = this.step();
      if (step === null) break;
      const far = Math.hypot(...step), by = Math.min(1, NUDGE / far);
      if (far < 1e-7) break;
      const { reached } = linkage.moveTo(Array.from(linkage.u, (each, k) => each + by * step[k]));
      if (reached < 1) stuck = cheapest(step.map((_, k) => k), (k) => -Math.abs(step[k]));
    }
    const gone = Array.from(linkage.u, (each, k) => Math.abs(each - start[k]) > 1e-9);
    if (gone.filter(Boolean).length === 1) page.running = gone.indexOf(true);
    page.update();
    page.emit("move");
    if (stuck === null) {
      if (held.said && gone.some(Boolean)) {
        held.said = false;
        page.say("");
      }
    } else if (!held.said) {
      held.said = true;
      page.say(deadPoint(page, stuck));
    }
  }

  /** How the inputs have to move (scaled) for the place held to come nearer; null where it need not or cannot. */
  step() {
    const { page, held } = this, { linkage, data, view } = page, m = data.inputs.length;
    const slope = [];
    let bend = 0, open = null;
    for (let k = 0; k < m; k++) {
      const unit = data.inputs.map((_, i) => (i === k ? linkage.scale[k] : 0));
      const f = page.framesOf(linkage.state(unit, unit.map(() => 0)));
      const p = Plane.carry(f[held.link], held.local), { velocity, acceleration } = page.rates(held.link, p, f);
      if (velocity === null) return this.feel();
      open = Plane.minus(held.target, p);
      slope.push(velocity);
      bend = Math.max(bend, Plane.length(acceleration));
    }
    if (Plane.length(open) * view.scale < 0.2) return null;
    // Levenberg's step; the damping foresees how far the place held leaves its tangent
    const square = new Float64Array(m * m), right = new Float64Array(m), damping = bend * Plane.length(open);
    for (let i = 0; i < m; i++) {
      for (let j = 0; j < m; j++) square[j * m + i] = Plane.dot(slope[i], slope[j]) + (i === j ? damping : 0);
      right[i] = Plane.dot(slope[i], open);
    }
    return solve(square, right, m) ? Array.from(right) : null;
  }

  /** At a dead point no rates are determined: a little to and fro tells which way leads nearer. */
  feel() {
    const { page, held } = this, { linkage } = page, [z, u] = [linkage.z, linkage.u];
    const far = () => Plane.apart(held.target, Plane.carry(page.framesOf(linkage.state())[held.link], held.local));
    const here = far();
    let best = null, least = here;
    for (let k = 0; k < u.length; k++) {
      for (const by of [0.01, -0.01]) {
        const to = Array.from(u, (each, i) => each + (i === k ? by : 0));
        const { reached } = linkage.moveTo(to), there = far();
        if (reached === 1 && there < least) [best, least] = [to.map((each, i) => each - u[i]), there];
        [linkage.z, linkage.u] = [z, u];
      }
    }
    return best;
  }
}

/** The sentence for an input that goes no farther. */
function deadPoint(page, k) {
  const { met } = page.linkage;
  if (met.length) {
    const stops = met.map(({ pair, kind, at }) => `${pair} is at its stop at ${readable(at / page.data.units[kind].si)} ${page.data.units[kind].name}`);
    return `At ${page.data.inputs[k].pair} = ${amount(page, k)} ${stops.join(" and ")}: the input goes no farther this way.`;
  }
  return `Dead point at ${page.data.inputs[k].pair} = ${amount(page, k)}: the input goes no farther this way.`;
}

/** An input's position as it is printed, in the file's unit. */
function amount(page, k, value = page.input(k)) {
  const { name, si } = inputUnit(page, k);
  return `${readable(value / si).replace("-", "−")} ${name}`;
}

const inputUnit = (page, k) => page.data.units[page.data.inputs[k].slides ? "length" : "angle"];

/** A number with what a reader needs of it: four digits, or one decimal of a great one. */
const readable = (value) => String(Math.abs(value) >= 1000 ? +value.toFixed(1) : +value.toPrecision(4) || 0);
