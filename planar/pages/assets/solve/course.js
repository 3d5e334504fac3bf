"use strict";
/* The whole motion of the input that runs, the others where they are: one turn, or from limit to limit. It is found on
   a linkage of its own in idle moments, so that the page stays quick, and found anew whenever it is no longer true.
   `page.course` is null until it is known; the event "course" tells of both. */

const PARTS = 360;           // of the range
const CHUNK = Math.PI / 36;  // rad, sizes: how far the march to a limit goes at a time
const FREE_SLIDE = 2;        // sizes: as far is gone each way where a slide has no limit
const SLICE = 8;             // ms of work at a time
const CHORD = 2e-4;          // sizes: how far a path may be from the chord between two of its positions
const MAX_HALVINGS = 8;      // of the range between two rows
const DEAD_POINT_PART = 0.25; // of the range beside a dead point: there paths go as the root of the input
const OUTGROWN = 2;          // times the middle rate: beside a dead point rates outgrow every scale

/** The motion over a range of the input: rows of positions and rates, in SI. */
class Course {
  constructor(page, k, rows, whole, dead, between = new Map()) {
    this.page = page;
    this.between = between;                 // frames of positions after a row, by its number, where paths bend
    this.input = k;
    this.rows = rows;
    this.inputs = Float64Array.from(rows, (row) => row.at);
    this.whole = whole;                     // a whole turn; else it ends at limits
    this.limits = whole ? null : [this.inputs[0], this.inputs[rows.length - 1]];
    this.dead = dead;                       // whether the lower and the upper limit are dead points
    this.kept = new Map();
    const [first, last] = [rows[0].z, rows[rows.length - 1].z], angles = page.data.unknown_angles;
    // where links count turns a turn of the input does not bring everything back
    this.periodic = whole && first.every((each, i) => {
      const gap = last[i] - each;
      return Math.abs(angles[i] ? Math.sin(gap / 2) : gap) < 1e-6;
    });
  }

  get count() { return this.rows.length; }

  /** A link over the motion: x, y, angle and their rates, each a Float64Array, NaN where rates are not determined. */
  link(name) { return this.keep(`link ${name}`, () => this.columns((frames) => linkNumbers(frames[name]))); }

  /** A point over the motion: x, y, vx, vy, ax, ay. */
  point(name) { return this.keep(`point ${name}`, () => this.columns((frames) => pointNumbers(this.page, name, frames))); }

  /** The path of a point, [[x, y], ...]: the rows, and more positions between them where it bends. */
  path(name) {
    return this.keep(`path ${name}`, () => this.rows.flatMap(({ frames }, i) => (
      [frames, ...(this.between.get(i) ?? [])].map((links) => this.page.point(name, links).position))));
  }

  /** The place of an input's position in the range, brought there by whole turns where that changes nothing. */
  within(position) {
    if (!this.periodic) return position;
    const turn = 2 * Math.PI, low = this.inputs[0];
    return position - turn * Math.floor((position - low) / turn);
  }

  /** Rows that a scale of a rate is to fit, by names of its parts: all, but for those beside dead points. */
  calm(parts) {
    return this.keep(`calm ${parts}`, () => {
      const all = Object.keys(this.page.data.points).map((name) => this.point(name)), rates = [];
      for (let i = 0; i < this.count; i++) {
        if (this.rows[i].frames[this.page.data.frame].v) {
          rates.push([i, Math.max(0, ...all.map((each) => Math.hypot(...parts.map((part) => each[part][i]))))]);
        }
      }
      const middle = rates.map(([, rate]) => rate).sort((a, b) => a - b)[rates.length >> 1];
      return rates.filter(([, rate]) => !(this.dead[0] || this.dead[1]) || rate <= OUTGROWN * middle).map(([i]) => i);
    });
  }

  /** The greatest size of each kind of quantity over the motion (SI), as the size of the mechanism and its speeds let it be. */
  get scales() {
    return this.keep("scales", () => {
      const { page } = this, { size } = page.data;
      const greatest = (list, key) => list.reduce((most, columns) => columns[key].reduce((a, b) => Math.max(a, Math.abs(b) || 0), most), 0);
      const links = page.data.links.map((name) => this.link(name)), points = Object.keys(page.data.points).map((name) => this.point(name));
      const turning = greatest(links, "w"), turningUp = Math.max(greatest(links, "e"), turning ** 2);
      return {
        length: size, angle: Math.PI, "angular velocity": turning, "angular acceleration": turningUp,
        velocity: Math.max(turning * size, greatest(points, "vx"), greatest(points, "vy")),
        acceleration: Math.max(turningUp * size, greatest(points, "ax"), greatest(points, "ay")),
      };
    });
  }

  keep(key, make) {
    if (!this.kept.has(key)) this.kept.set(key, make());
    return this.kept.get(key);
  }

  columns(of) {
    const found = {};
    this.rows.forEach((row, i) => {
      for (const [name, value] of Object.entries(of(row.frames))) {
        if (!found[name]) found[name] = new Float64Array(this.count).fill(NaN);
        found[name][i] = value;
      }
    });
    return found;
  }
}

function linkNumbers(f) {
  const [vx, vy, w] = f.v ?? [NaN, NaN, NaN], [ax, ay, e] = f.a ?? [NaN, NaN, NaN];
  return { x: f.x, y: f.y, angle: f.angle, vx, vy, w, ax, ay, e };
}

function pointNumbers(page, name, frames) {
  const { position: [x, y], velocity, acceleration } = page.point(name, frames);
  const [vx, vy] = velocity ?? [NaN, NaN], [ax, ay] = acceleration ?? [NaN, NaN];
  return { x, y, vx, vy, ax, ay };
}

/** Keeps `page.course` true. */
class Courses {
  constructor(page) {
    this.page = page;
    page.course = null;
    page.former = null; // the last that was known
    this.work = null;
    page.on("size", () => this.renew());
    page.on("move", () => { if (!this.fits()) this.renew(); });
    this.renew();
  }

  /** Whether what is known, or being found, is the motion from where the page is now. */
  fits() {
    const { linkage, running, course } = this.page;
    if (running !== this.running || linkage.u.some((each, k) => k !== running && each !== this.others[k])) return false;
    if (course === null || course.periodic) return true;
    // where links count turns, or a slide goes on, there is more beyond; not beyond a dead point
    const at = this.page.input(), { inputs, count, dead } = course;
    return (dead[0] || at >= inputs[0] - 1e-9) && (dead[1] || at <= inputs[count - 1] + 1e-9);
  }

  renew() {
    const { page } = this;
    this.running = page.running;
    this.others = Array.from(page.linkage.u);
    const known = page.course !== null;
    [page.former, page.course] = [page.course ?? page.former, null];
    if (known) page.emit("course");
    this.work = page.data.inputs.length ? this.find() : null;
    this.later();
  }

  later() {
    if (this.waiting || this.work === null) return;
    this.waiting = true;
    const go = () => { this.waiting = false; this.slice(); };
    if (typeof requestIdleCallback === "function") requestIdleCallback(go, { timeout: 200 });
    else setTimeout(go, 10);
  }

  slice() {
    const { work } = this, until = performance.now() + SLICE;
    while (work !== null && performance.now() < until) {
      const { done, value } = work.next();
      if (!done) continue;
      this.work = null;
      this.page.course = value;
      this.page.emit("course");
      return;
    }
    this.later();
  }

  /** The work, a little at a time. */
  *find() {
    const { page } = this, k = this.running, { linkage, data } = page;
    const start = linkage.copy(), scale = linkage.scale[k];
    const slides = data.inputs[k].slides, here = start.u[k];
    const turn = 2 * Math.PI, base = turn * Math.floor(here / turn + 1e-9);
    // a turn is gone from 0 to 360 deg; half of it up from here, half of it down
    const own = data.window?.running === k ? data.window : null; // the range of a motion that is shown
    const far = own ? [own.low / scale, own.high / scale] : slides ? [here - FREE_SLIDE, here + FREE_SLIDE] : [base, base + turn];
    const ends = [null, null];
    for (const [side, sign] of [[1, 1], [0, -1]]) {
      ends[side] = yield* this.march(start.copy(), k, far[side], sign);
    }
    const turns = !slides && !own && !ends[0].stopped && !ends[1].stopped;
    if (!slides && !own && !turns) {
      // an end beyond the turn's seam: a rocking crank's range is not cut there
      for (const [side, sign] of [[1, 1], [0, -1]]) {
        if (!ends[side].stopped) ends[side] = yield* this.march(ends[side].made, k, ends[side].at + sign * turn, sign);
      }
    }
    const low = ends[0].at, high = ends[1].at, rows = new Array(PARTS + 1);
    const grid = Array.from({ length: PARTS + 1 }, (_, i) => low + ((high - low) * i) / PARTS);
    for (const [side, sign] of [[1, 1], [0, -1]]) {
      const last = side ? PARTS : 0;
      let made = start.copy();
      const above = grid.findIndex((each) => each >= here), first = sign > 0 ? above : (above < 0 ? PARTS : above - 1);
      for (let i = first; i >= 0 && i <= PARTS; i += sign) {
        if (i === last) ({ made } = ends[side]);
        else made.moveTo(made.u.map((each, j) => (j === k ? grid[i] : each)));
        rows[i] = this.row(made, made.u[k] * scale);
        yield;
      }
    }
    const dead = [ends[0].stopped, ends[1].stopped], between = yield* this.refine(start, k, rows, dead);
    const made = new Course(page, k, rows, turns, dead, between);
    made.names = ends.map((each) => (each.met ? "stop" : page.endName));
    return made;
  }

  /** Go with a linkage one way as far as it goes, to a place of the input at the most: {at, made, stopped}. */
  *march(made, k, to, sign) {
    let stopped = false;
    while (!stopped && sign * (to - made.u[k]) > 0) {
      const next = sign > 0 ? Math.min(to, made.u[k] + CHUNK) : Math.max(to, made.u[k] - CHUNK);
      stopped = made.moveTo(made.u.map((each, j) => (j === k ? next : each))).reached < 1;
      yield;
    }
    return { at: made.u[k], made, stopped, met: stopped && made.met.length > 0 };
  }

  /** Positions between rows, so that no chord of a path is far from it: frames by the number of the row before them. */
  *refine(start, k, rows, dead) {
    const { page } = this, names = Object.keys(page.data.points), last = rows.length - 1, between = new Map();
    const places = (frames) => names.map((name) => page.point(name, frames).position);
    const positions = rows.map(({ at, z, frames }) => ({ at, z, frames, places: places(frames) }));
    const bend = (a, b, c) => Math.max(0, ...names.map((_, j) => chordDistance(a.places[j], b.places[j], c.places[j])));
    const isDead = ({ at }) => (dead[0] && at === rows[0].at) || (dead[1] && at === rows[last].at);
    /** The positions between two, the first of which is no dead point. */
    const inner = function* (from, to, halvings) {
      const linkage = start.copy(), part = isDead(to) ? 1 - DEAD_POINT_PART : 0.5, at = from.at + part * (to.at - from.at);
      Object.assign(linkage, { z: Float64Array.from(from.z), last: null, stop: null });
      linkage.u[k] = from.at / linkage.scale[k];
      yield;
      if (linkage.moveTo(linkage.u.map((position, j) => (j === k ? at / linkage.scale[k] : position))).reached < 1) return [];
      const frames = page.framesOf(linkage.state()), middle = { at, z: linkage.z, frames, places: places(frames) };
      if (bend(from, middle, to) <= CHORD * page.data.size) return [];
      if (halvings === MAX_HALVINGS) return [frames];
      return [...yield* inner(from, middle, halvings + 1), frames, ...yield* inner(middle, to, halvings + 1)];
    };
    for (let i = 0; i < last; i++) {
      // a chord of two parts bends four times as far as one of its parts
      const near = [i, i + 1].filter((row) => row > 0 && row < last);
      const isFlat = near.length === 2 && near.every((row) => bend(positions[row - 1], positions[row], positions[row + 1]) <= CHORD * page.data.size);
      if (isFlat) continue;
      const [from, to] = [positions[i], positions[i + 1]];
      const frames = isDead(from) ? (yield* inner(to, from, 1)).reverse() : yield* inner(from, to, 1);
      if (frames.length) between.set(i, frames);
    }
    return between;
  }

  /** A position with the rates of the file, and with those of the running input alone, at unit speed. */
  row(made, at) {
    const { page, running } = this, { inputs } = page.data;
    const rates = page.inputRates(), still = inputs.map(() => 0);
    const state = page.stateOf(made, rates), frames = page.framesOf(state);
    const same = inputs.length === 1 && rates[0][0] !== 0;
    const alone = same ? frames : page.framesOf(made.state(still.map((_, k) => (k === running ? 1 : 0)), still));
    const loaded = page.forces ? page.loadedState(made, state) : state;
    return { at, z: Float64Array.from(made.z), state, loaded, frames, alone };
  }
}

/** How far a place is from the chord between two others. */
function chordDistance([ax, ay], [x, y], [bx, by]) {
  const [dx, dy] = [bx - ax, by - ay], square = dx * dx + dy * dy;
  const part = square > 0 ? Math.max(0, Math.min(1, ((x - ax) * dx + (y - ay) * dy) / square)) : 0;
  return Math.hypot(x - ax - part * dx, y - ay - part * dy);
}
