"use strict";
/* The free dimensions that bring a mechanism nearest to what is wanted of it, from where it is: Gauss and Newton's
   method with Levenberg and Marquardt's damping, within bounds. Each wanted entry has a linkage of its own, which stands
   where the mechanism comes nearest to it; where the input is not given there, it is eliminated: what is left counts
   across the path alone. */

const FIT_DAMPING = [1e-9, 1e-3, 1e8]; // the least, that at first, and that at which it is given up
const FIT_ENOUGH = 1e-5;               // of the sum of squares: a step that wins less is the last
const FIT_STEPS = 120;                 // at the most, until something is moved again
const EXACT_MISS = 1e-11;              // sizes: none
const AT_FOOT = 1e-3;                  // of a miss: as near an entry comes to where the path is nearest
const LONGEST_TURN = 0.35;             // rad, sizes: of the input of an entry in one step
const LONGEST_CHANGE = 0.1;            // sizes: of a dimension in one step
const STILL_RESULT = 1e-9;                  // sizes: a result that moves less with the input does not move

/** The results of a mechanism that are wanted, in units in which a miss of one counts alike: lengths in `size`. */
const WantedResults = {
  path: {
    values(item, page, { frames, sizes }) {
      const { links, at } = page.data.points[item.of];
      return page.place(links[0], at[0], frames, sizes).map((each) => each / item.size);
    },
    rates(item, page, { frames }) { return page.point(item.of, frames).velocity?.map((each) => each / item.size) ?? null; },
    wanted(item, i) { return item.places[i].map((each) => each / item.size); },
  },
  poses: {
    values(item, page, { frames }) { const f = frames[item.of]; return [f.x / item.size, f.y / item.size, f.angle]; },
    rates(item, page, { frames }) { const { v } = frames[item.of]; return v && [v[0] / item.size, v[1] / item.size, v[2]]; },
    wanted(item, i) { return [...item.places[i].map((each) => each / item.size), item.angles[i]]; },
  },
  function: {
    values(item, page, { state, d }) { return [page.linkage.program.reported(state.w, state.w, state.w, d, [])[item.number] / item.scale]; },
    rates(item, page, { state, d }) {
      return state.w1 && [page.linkage.program.reported(state.w, state.w1, state.w1, d, [])[item.number + 1] / item.scale];
    },
    wanted(item, i) { return [item.values[i] / item.scale]; },
  },
};

class WantedFit {
  constructor(page, wanted) {
    Object.assign(this, { page, wanted, entries: [], slopes: new DesignSlopes(page) });
    this.free = wanted.free;
    [, this.damping] = FIT_DAMPING;
  }

  get ready() { return this.entries.length > 0; }

  /** The dimensions that it has come to (m). */
  get d() { return this.entries[0].made.d; }

  /** Put every entry where the motion comes nearest to it. */
  assign(course) {
    const { page, wanted } = this;
    this.entries = wanted.items.flatMap((item, k) => {
      const rows = this.rows(item, course), chosen = item.inputs === null ? item.weights.map((_, i) => this.nearest(item, i, rows)) : this.timed(item, rows, course);
      return item.weights.map((weight, i) => this.entry(k, i, Math.sqrt(weight), course.rows[chosen[i].row], chosen[i].at));
    });
    for (const each of this.entries) this.settle(each);
    this.restart();
  }

  /** What a result is in every row of the motion. */
  rows(item, course) {
    const { page } = this, { sizes, d } = page.linkage;
    return course.rows.map(({ frames, state }) => WantedResults[item.kind].values(item, page, { frames, sizes, state, d }));
  }

  nearest(item, i, rows) {
    const wanted = WantedResults[item.kind].wanted(item, i);
    let best = 0, least = Infinity;
    rows.forEach((values, row) => {
      const far = missOf(item, values, wanted).reduce((sum, each) => sum + each * each, 0);
      if (far < least) [best, least] = [row, far];
    });
    return { row: best, at: null };
  }

  /** Entries whose inputs are given: the zero of these, where it is free, is where they fit the motion best. */
  timed(item, rows, course) {
    const { inputs } = course, last = inputs.length - 1, [low, high] = [inputs[0], inputs[last]];
    const zeros = item.is_absolute ? [0] : Array.from(inputs, (each) => each - item.inputs[0]);
    let best = null, least = Infinity;
    for (const zero of zeros) {
      const chosen = item.inputs.map((each) => {
        const at = course.within(each + zero), row = Math.round(((at - low) / (high - low)) * last);
        return { row: Math.max(0, Math.min(last, row)), at, beyond: row < 0 || row > last };
      });
      const misses = chosen.map(({ row }, i) => missOf(item, rows[row], WantedResults[item.kind].wanted(item, i)));
      const shift = item.value_is_free ? misses.reduce((sum, each) => sum + each[0], 0) / misses.length : 0;
      const far = misses.reduce((sum, each, i) => sum + item.weights[i] * each.reduce((all, one) => all + (one - shift) ** 2, 0), 0);
      const beyond = chosen.filter((each) => each.beyond).length;
      if (far + beyond < least) { best = chosen; least = far + beyond; item.zero = shift; }
    }
    return best;
  }

  entry(k, i, weight, row, at) {
    const made = this.page.linkage.copy(), { input } = this.wanted, own = row.at / made.scale[input];
    Object.assign(made, { z: Float64Array.from(row.z), last: null, stop: null });
    made.u[input] = own;
    if (at !== null) made.moveTo(made.u.map((each, j) => (j === input ? at / made.scale[input] : each)));
    return { item: this.wanted.items[k], i, weight, made };
  }

  /** What an entry shows: its values, and by how much they are off. */
  look(entry, rates = false) {
    const { page, wanted: { input } } = this, { item, i, made } = entry, { inputs } = page.data;
    const state = rates ? made.state(inputs.map((_, j) => (j === input ? made.scale[input] : 0)), inputs.map(() => 0)) : made.state();
    const shown = { frames: page.framesOf(state), sizes: made.sizes, state, d: made.d }, of = WantedResults[item.kind];
    const miss = missOf(item, of.values(item, page, shown), of.wanted(item, i)).map((each) => each - (item.zero ?? 0));
    const rate = rates ? of.rates(item, page, shown) : null;
    return { miss, rate: rate !== null && rate.some((each) => Math.abs(each) > STILL_RESULT) ? rate : null };
  }

  /** The input of an entry that is not given one goes to where it comes nearest. */
  settle(entry) {
    if (entry.item.inputs !== null) return;
    const { made } = entry;
    for (let round = 0; round < 4; round++) {
      const { miss, rate } = this.look(entry, true);
      if (rate === null) return;
      const by = clamp(-dotted(rate, miss) / dotted(rate, rate), LONGEST_TURN), before = stood(made), far = dotted(miss, miss);
      if (Math.abs(by) * Math.sqrt(squared(rate)) < Math.max(EXACT_MISS, AT_FOOT * Math.sqrt(far))) return;
      this.turn(made, by);
      if (squared(this.look(entry).miss) <= far) continue;
      takeBack(made, before);
      return;
    }
  }

  turn(made, by) {
    const { input } = this.wanted;
    return made.moveTo(made.u.map((each, j) => (j === input ? each + by : each))).reached;
  }

  /** The weighed sum of squares. */
  cost() { return this.entries.reduce((sum, each) => sum + each.weight ** 2 * squared(this.look(each).miss), 0); }

  /** Begin anew, as something else is wanted. */
  restart() {
    [, this.damping] = FIT_DAMPING;
    this.done = !this.ready || !this.free.length;
    this.known = null;
    this.steps = 0;
    for (const each of this.entries) this.settle(each);
    this.least = this.ready ? this.cost() : Infinity;
  }

  /** Improve for some time (ms); whether the dimensions have changed. */
  improve(time) {
    const until = performance.now() + time;
    let changed = false;
    while (!this.done && performance.now() < until) changed = this.step() || changed;
    return changed;
  }

  /** One step of Levenberg's; whether it was one for the better. */
  step() {
    const { page: { data: { size } }, free, entries } = this, known = (this.known ??= this.linear());
    const move = this.solved(known), before = entries.map(({ made }) => stood(made));
    if (move !== null) {
      const d = Array.from(this.d), zeros = this.wanted.items.map((each) => each.zero);
      free.forEach(({ k, low, high }, j) => { d[k] = Math.max(low, Math.min(high, d[k] + size * move[j])); });
      const went = entries.every((each, n) => this.go(each, d, known.entries[n], move));
      known.zeros.forEach(({ item, kind }, j) => { if (kind === "value") item.zero += move[free.length + j]; });
      const cost = went ? this.cost() : Infinity;
      if (cost < this.least) {
        this.done = this.least - cost < FIT_ENOUGH * this.least || cost < this.entries.length * EXACT_MISS ** 2 || ++this.steps >= FIT_STEPS;
        this.least = cost;
        this.damping = Math.max(FIT_DAMPING[0], this.damping / 4);
        this.known = null;
        return true;
      }
      this.wanted.items.forEach((each, k) => { each.zero = zeros[k]; });
    }
    entries.forEach(({ made }, n) => takeBack(made, before[n]));
    this.damping *= 6;
    if (this.damping > FIT_DAMPING[2]) this.done = true;
    return false;
  }

  /** An entry's linkage with other dimensions, its input where it then comes nearest. */
  go(entry, d, { rate, miss, rows }, move) {
    const { made, item } = entry;
    if (made.changeTo(d).reached < 1) return false;
    if (item.inputs !== null) {
      const by = item.is_absolute ? 0 : move[this.known.column.get(item)];
      return by === 0 || this.turn(made, clamp(by, LONGEST_TURN)) === 1;
    }
    if (rate !== null) {
      const foretold = miss.map((each, p) => each + rows[p].reduce((sum, slope, j) => sum + slope * move[j], 0));
      this.turn(made, clamp(-dotted(rate, foretold) / dotted(rate, rate), LONGEST_TURN));
    }
    this.settle(entry);
    return true;
  }

  /** All entries to the first order in the free dimensions (sizes) and in the zeros of scales that are sought. */
  linear() {
    const { page, free, wanted, slopes } = this, { size } = page.data, zeros = [], column = new Map();
    for (const item of wanted.items) {
      if (item.inputs !== null && !item.is_absolute) { column.set(item, free.length + zeros.length); zeros.push({ item, kind: "input" }); }
      if (item.value_is_free) zeros.push({ item, kind: "value" });
    }
    const n = free.length + zeros.length, square = new Float64Array(n * n), right = new Float64Array(n);
    const entries = this.entries.map((entry) => {
      const { item, weight, made } = entry, { miss, rate } = this.look(entry, true), of = WantedResults[item.kind];
      slopes.made.d = Array.from(made.d);
      const sides = slopes.sides(made.z, made.u, free.map(({ k }) => k));
      const rows = miss.map(() => new Float64Array(n));
      free.forEach(({ k }, j) => {
        const own = DesignSlopes.derivative(page, sides[k], (side) => of.values(item, page, side));
        own?.forEach((slope, p) => { rows[p][j] = slope * size; });
      });
      zeros.forEach((zero, j) => {
        if (zero.item !== item) return;
        if (zero.kind === "value") rows[0][free.length + j] = -1;
        else rate?.forEach((each, p) => { rows[p][free.length + j] = each; });
      });
      // where the input is not given, only what is across the path counts
      const way = item.inputs === null && rate !== null ? rate.map((each) => each / Math.sqrt(dotted(rate, rate))) : null;
      const gone = (values) => (way === null ? values : values.map((each, p) => each - way[p] * dotted(way, values)));
      const columns = Array.from({ length: n }, (_, j) => gone(rows.map((row) => row[j]))), left = gone(miss);
      for (let i = 0; i < n; i++) {
        for (let j = 0; j < n; j++) square[j * n + i] += weight ** 2 * dotted(columns[i], columns[j]);
        right[i] -= weight ** 2 * dotted(columns[i], left);
      }
      return { rate, miss, rows };
    });
    return { n, square, right, entries, zeros, column };
  }

  /** The step: free dimensions (sizes), then zeros; those that would leave their bounds stay on them. */
  solved({ n, square, right }) {
    const { page: { data: { size } }, free } = this, held = new Map();
    let most = 0;
    for (let i = 0; i < n; i++) most = Math.max(most, square[i * n + i]);
    if (!(most > 0)) { this.done = true; return null; }
    for (let round = 0; round <= free.length; round++) {
      const open = Array.from({ length: n }, (_, i) => i).filter((i) => !held.has(i)), m = open.length;
      const a = new Float64Array(m * m), b = new Float64Array(m);
      open.forEach((i, p) => {
        b[p] = right[i];
        for (const [j, by] of held) b[p] -= square[j * n + i] * by;
        open.forEach((j, q) => { a[q * m + p] = square[j * n + i]; });
        a[p * m + p] += this.damping * Math.max(square[i * n + i], 1e-3 * most);
      });
      if (m > 0 && !solve(a, b, m)) return null;
      const move = new Float64Array(n);
      for (const [j, by] of held) move[j] = by;
      open.forEach((i, p) => { move[i] = b[p]; });
      const far = Math.max(0, ...free.map((_, j) => Math.abs(move[j]))), by = far > LONGEST_CHANGE ? LONGEST_CHANGE / far : 1;
      for (let i = 0; i < n; i++) move[i] *= by;
      let beyond = false;
      free.forEach(({ k, low, high }, j) => {
        const now = this.d[k], to = now + size * move[j];
        if (held.has(j) || (to >= low && to <= high)) return;
        held.set(j, (Math.max(low, Math.min(high, to)) - now) / size);
        beyond = true;
      });
      if (!beyond) return move;
    }
    return null;
  }
}

const dotted = (a, b) => a.reduce((sum, each, k) => sum + each * b[k], 0);
const squared = (a) => dotted(a, a);
const clamp = (value, most) => Math.max(-most, Math.min(most, value));

/** By how much values are off; angles by less than half a turn. */
function missOf(item, values, wanted) {
  return values.map((each, p) => {
    const off = each - wanted[p];
    return item.angular[p] ? off - 2 * Math.PI * Math.round(off / (2 * Math.PI)) : off;
  });
}

/** Where a linkage stands, and back to there. */
const stood = ({ d, z, u, last, stop }) => ({ d: Array.from(d), z, u: Array.from(u), last, stop });
function takeBack(made, before) {
  Object.assign(made, before, { u: Array.from(before.u), d: Array.from(before.d) });
  made.measure();
}
