"use strict";
/* What is wanted of the mechanism: places of points, poses of links, positions of pairs; and the design that follows when
   these are moved. */

const WANTED_SLICE = 10; // ms of a frame that are spent on following
const WANTED_PAUSE = 300; // ms at the most in which the motion of a design that is shown is found before the next

class Wanted {
  /** Of a page that has any. */
  static of(page) { return page.data.wanted === null ? null : new Wanted(page, page.data.wanted); }

  constructor(page, { items, free, input, unmoved }) {
    Object.assign(this, { page, input, unmoved, follows: true, waits: false, shown: 0 });
    this.items = items.map((each) => ({ ...each, places: each.places?.map((at) => [...at]) ?? null, angles: each.angles && [...each.angles] }));
    this.own = this.numbers();
    const { dimensions } = page.data;
    this.free = free.filter(({ k }) => !dimensions[k].held);
    this.fit = new WantedFit(page, this);
    this.stale = true; // whether entries stand where the motion is no more
    page.on("size", () => { if (!this.leading) Object.assign(this, { stale: true, waits: false }); });
    page.on("course", () => this.look());
  }

  /** All numbers that can be moved, in one row. */
  numbers() { return this.items.flatMap(({ places, angles }) => [...(places ?? []).flat(), ...(angles ?? [])]); }

  /** Take such a row. */
  take(numbers) {
    let at = 0;
    for (const item of this.items) {
      for (const place of item.places ?? []) for (const k of [0, 1]) place[k] = numbers[at++];
      if (item.angles) for (let i = 0; i < item.angles.length; i++) item.angles[i] = numbers[at++];
    }
    this.waits = false;
    this.fit.restart();
    this.page.emit("wanted");
  }

  /** All places that the drawing is to show (m). */
  spots() { return this.items.flatMap(({ places }) => places ?? []); }

  /** Once the motion is known: where it comes nearest to what is wanted. */
  look() {
    const { page: { course }, fit } = this;
    if (course === null || course.input !== this.input) return;
    const others = fit.ready && fit.entries[0].made.u.some((each, k) => k !== this.input && each !== this.page.linkage.u[k]);
    if (!this.stale && !others) return;
    this.stale = false;
    fit.assign(course);
    this.page.emit("wanted");
    if (this.waits) this.follow();
  }

  /** Something wanted has been moved. */
  changed() {
    this.waits = true;
    if (this.fit.ready && !this.stale) this.fit.restart();
    this.page.emit("wanted");
    if (this.follows) this.follow();
  }

  /** Improve the design frame by frame until it gets no better. */
  follow() {
    if (this.working || this.stale || !this.fit.ready) return; // a motion that is being found is waited for
    this.working = true;
    requestAnimationFrame(() => { this.working = false; this.improve(); });
  }

  improve() {
    const { page, fit } = this;
    if (this.stale || !this.waits) return;
    if (page.course === null && performance.now() - this.shown < WANTED_PAUSE) { this.follow(); return; }
    if (fit.improve(WANTED_SLICE)) {
      this.lead();
      this.shown = performance.now();
    }
    if (fit.done) this.waits = false; else this.follow();
    page.emit("wanted");
  }

  /** The mechanism takes the dimensions that were found; where it stands it may not go together with them. */
  lead() {
    const { page, fit } = this, { linkage } = page, before = { ...stood(linkage), z: linkage.z };
    this.leading = true;
    const { reached } = page.changeTo(fit.d);
    if (reached < 1) {
      takeBack(linkage, before);
      page.adopt(fit.entries[0].made);
    }
    this.leading = false;
  }

  /** By how much every entry is missed: {item, i, miss: m, rad or SI of a function, turned: rad, over}. */
  misses() {
    return this.fit.ready && !this.stale ? this.fit.entries.map((entry) => {
      const { item, i } = entry, { miss } = this.fit.look(entry);
      if (item.kind === "function") return { item, i, miss: miss[0] * item.scale, over: this.over(item, Math.abs(miss[0]) * item.scale) };
      const far = Math.hypot(miss[0], miss[1]) * item.size;
      return { item, i, miss: far, turned: miss[2], over: this.over(item, far) };
    }) : [];
  }

  over({ tolerance }, far) { return tolerance !== null && far > tolerance * (1 + 1e-9); }

  /** Where the point, or the link's origin, is at each entry (m), by item and number. */
  reached() {
    return this.fit.ready && !this.stale ? this.fit.entries.flatMap(({ item, i, made }) => {
      if (item.kind === "function") return [];
      const frames = this.page.framesOf(made.state());
      if (item.kind === "poses") return [{ item, i, at: [frames[item.of].x, frames[item.of].y] }];
      const { links, at } = this.page.data.points[item.of];
      return [{ item, i, at: this.page.place(links[0], at[0], frames, made.sizes) }];
    }) : [];
  }
}
