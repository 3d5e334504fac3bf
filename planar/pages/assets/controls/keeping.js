"use strict";
/* Where the mechanism stands, kept in the address: a page that is loaded again, or whose address is passed on, shows it
   there. What does not fit the page's mechanism any more is left aside. */

const KEEPING_PAUSE = 400; // ms between two looks
const KEPT_NEAR = 1e-6;    // sizes, rad: kept unknowns have to solve the equations as nearly

class Keeping {
  constructor(page) {
    this.page = page;
    this.waits = null;
    for (const event of ["move", "size"]) page.on(event, () => { this.waits ??= setTimeout(() => this.write(), KEEPING_PAUSE); });
  }

  write() {
    clearTimeout(this.waits);
    this.waits = null;
    const { page } = this;
    if (page.recording) return;
    const { data, linkage, running } = page, kept = { u: Array.from(linkage.u), z: Array.from(linkage.z) };
    const moved = data.inputs.some((each, k) => each.position / linkage.scale[k] !== linkage.u[k]) || linkage.z.some((each, k) => each !== data.z[k]);
    const changed = data.dimensions.flatMap((each, k) => (each.value === linkage.d[k] ? [] : [[each.name, linkage.d[k]]]));
    const acting = page.acting?.changes() ?? [], given = page.given.flat();
    if (changed.length) kept.d = changed;
    if (acting.length) kept.f = acting;
    if (running !== data.running) kept.run = running;
    const rated = data.inputs.some((each, k) => each.velocity !== given[2 * k] || each.acceleration !== given[2 * k + 1]);
    if (rated) kept.v = given;
    memory.write("at", moved || changed.length || acting.length || running !== data.running || rated ? JSON.stringify(kept) : "");
  }

  /** What the address keeps, if it is of this mechanism: the page stands there from the first; the numbers of what acts. */
  static recall(page) {
    let kept = null;
    try { kept = JSON.parse(memory.read("at")); } catch { /* somebody else's address */ }
    const { data, linkage } = page, numbers = (list, count) => Array.isArray(list) && list.length === count && list.every(Number.isFinite);
    if (kept === null || typeof kept !== "object" || !numbers(kept.u, data.inputs.length) || !numbers(kept.z, data.counts.z)) return;
    const values = new Map(Array.isArray(kept.d) ? kept.d : []);
    const d = data.dimensions.map((each) => values.get(each.name) ?? each.value);
    if (!numbers(d, d.length)) return;
    const made = linkage.copy();
    made.d = d;
    made.measure();
    const { z, closed } = made.newton(kept.u, kept.z);
    if (!closed || z.some((each, k) => !(Math.abs(each - kept.z[k]) <= KEPT_NEAR)) || beyondStops(made, z, kept.u).length) return;
    if (numbers(kept.v, 2 * data.inputs.length)) page.given = data.inputs.map((_, k) => [kept.v[2 * k], kept.v[2 * k + 1]]);
    page.keptActions = Array.isArray(kept.f) ? kept.f : [];
    if (Number.isInteger(kept.run) && data.inputs[kept.run]) page.running = kept.run;
    Object.assign(linkage, { d, u: kept.u, z: Float64Array.from(z) });
    linkage.measure();
    page.update();
  }
}
