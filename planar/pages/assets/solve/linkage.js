"use strict";
/* A linkage solved as Python solves it: group after group by Newton's method on the functions printed beside this file.
   `data` is what Python's planar.pages.carried says of the mechanism, `program` its functions. Lengths in z, u, w are
   divided by data.size; everything that the class gives back is in SI. */

const CLOSED = 1e-13;      // sizes, rad: Newton's method stops here
const STEPS = 25;          // of Newton's method
const FARTHEST = 0.06;     // rad, sizes: the longest step of an input from one position to the next
const SHORTEST = 1e-6;     // a step that has to be shorter ends at a dead point
const FAR = 0.3;           // rad, sizes: unknowns that would move farther are followed by shorter steps
const JUMP = 0.5;          // how far from what was foretold unknowns may be, in parts of that
const NEAR = 0.02;         // rad, sizes: as far from it they may always be
const SMOOTH = 0.1;       // in the same parts, where a determinant changes its sign: at a change point, not at a dead point
const RUNUP = 8;          // the farthest a step is foretold from the last one, in lengths of that
const LEAVING = 1e-4;      // rad, sizes: the first step off an exact dead point; shorter ones say nothing of the way
const NUDGES = [0.003, 0.01, 0.03, 0.1]; // rad, sizes: how far the unknowns may move in that step
const SINGULAR = 1e-5;     // of the greatest slope: a stop by steps that shorten lies a hundred times as far off a dead point
const WEAK = 1e-9;         // a pivot below this part of the greatest: no rates are determined

function solve(matrix, right, n) {
  // Gauss with the greatest pivot of the column; matrix column by column (n by n), both are used up: the sign of the
  // determinant, 0 where there is no solution
  let greatest = 0, sign = 1;
  for (let i = 0; i < n * n; i++) greatest = Math.max(greatest, Math.abs(matrix[i]));
  for (let k = 0; k < n; k++) {
    let best = k;
    for (let i = k + 1; i < n; i++) if (Math.abs(matrix[k * n + i]) > Math.abs(matrix[k * n + best])) best = i;
    if (!(Math.abs(matrix[k * n + best]) > WEAK * greatest)) return 0;
    if (matrix[k * n + best] < 0) sign = -sign;
    if (best !== k) {
      sign = -sign;
      for (let j = 0; j < n; j++) {
        const kept = matrix[j * n + k];
        matrix[j * n + k] = matrix[j * n + best];
        matrix[j * n + best] = kept;
      }
      const kept = right[k];
      right[k] = right[best];
      right[best] = kept;
    }
    for (let i = k + 1; i < n; i++) {
      const by = matrix[k * n + i] / matrix[k * n + k];
      if (by === 0) continue;
      for (let j = k; j < n; j++) matrix[j * n + i] -= by * matrix[j * n + k];
      right[i] -= by * right[k];
    }
  }
  for (let k = n - 1; k >= 0; k--) {
    for (let j = k + 1; j < n; j++) right[k] -= matrix[j * n + k] * right[j];
    right[k] /= matrix[k * n + k];
  }
  return sign;
}

function leastSquares(matrix, left, rows, n, damping) {
  // a step that lessens what is open where rows and unknowns differ, or the slope is weak: Levenberg's
  const square = new Float64Array(n * n), right = new Float64Array(n);
  for (let i = 0; i < n; i++) {
    for (let j = 0; j < n; j++) {
      let sum = 0;
      for (let k = 0; k < rows; k++) sum += matrix[i * rows + k] * matrix[j * rows + k];
      square[j * n + i] = sum + (i === j ? damping : 0);
    }
    for (let k = 0; k < rows; k++) right[i] += matrix[i * rows + k] * left[k];
  }
  return solve(square, right, n) ? right : null;
}

class Linkage {
  constructor(data, program) {
    this.data = data;
    this.program = program;
    const { z, u, w, F } = data.counts;
    this.room = program.stages.map((_, k) => {
      const [a, b] = data.stages[k].z, [c, d] = data.stages[k].F;
      return new Float64Array((d - c) * (1 + b - a));
    });
    this.found = new Float64Array(w);
    this.rates = new Float64Array((F + w) * 3 + F * (z + u));
    this.d = data.dimensions.map((each) => each.value);
    this.sizes = new Float64Array(data.sizes + 2 * (data.added?.points.length ?? 0));
    this.measure();
    this.scale = data.inputs.map((each) => (each.slides ? data.size : 1));
    this.u = data.inputs.map((each, k) => each.position / this.scale[k]);
    this.z = Float64Array.from(data.z);
    this.last = null; // the step that led here
    this.stop = null; // the way by which an exact dead point was come to
    this.met = []; // the stops at which the last way ended
  }

  /** A linkage as this one, to go its own way. */
  copy() {
    const made = new Linkage(this.data, this.program), { before } = this;
    made.d = Array.from(this.d);
    made.measure();
    made.z = Float64Array.from(this.z);
    made.u = Array.from(this.u);
    made.last = before && { ...before, to: made.z };
    made.stop = this.stop && { ...this.stop, to: this.stop.to === this.z ? made.z : null };
    return made;
  }

  /** Fill in the numbers of the pairs from the dimensions. */
  measure(d = this.d) {
    this.program.sizes(d, this.sizes);
    this.data.added?.points.forEach(({ at }, k) => this.sizes.set(at, this.data.sizes + 2 * k)); // what the reader has added
    this.scales = null; // of the slope: made where they are wanted
    this.p = this.sizes.subarray(0, this.data.counts.p);
  }

  /** Newton's method from z for inputs u: {z, open, closed, signs}; of the determinants of the groups, 0: not known. */
  newton(u, z) {
    z = Float64Array.from(z);
    const signs = new Int8Array(this.data.stages.length);
    let worst = 0;
    for (let k = 0; k < this.data.stages.length; k++) {
      const [from, to] = this.data.stages[k].z, [first, last] = this.data.stages[k].F;
      const n = to - from, rows = last - first;
      let left = Infinity, polished = 0;
      for (let step = 0; step < STEPS; step++) {
        const out = this.program.stages[k](z, u, this.p, this.room[k]);
        const gap = out.subarray(0, rows), before = left; // solved in place: the next step fills them anew
        left = 0;
        for (let i = 0; i < rows; i++) left = Math.max(left, Math.abs(gap[i]));
        if (!Number.isFinite(left)) return { z, open: Infinity, closed: false, signs };
        if (n === 0 || (left <= CLOSED && (polished++ || left === 0)) || (left <= CLOSED && left >= before)) break;
        const slope = out.subarray(rows);
        let move = gap;
        if (rows === n) {
          signs[k] = solve(slope, gap, n);
          if (signs[k] === 0) break;
        } else move = leastSquares(slope, gap, rows, n, 1e-15);
        if (move === null) break;
        for (let i = 0; i < n; i++) z[from + i] -= move[i];
      }
      worst = Math.max(worst, left);
      if (!(left <= 1e3 * this.data.tolerance)) return { z, open: worst, closed: false, signs };
    }
    return { z, open: worst, closed: true, signs };
  }

  /** How the unknowns move with inputs moving at u1: (unknowns,), or null where that is not determined. */
  tangent(u, z, u1) {
    const { z: n, F: rows, u: m } = this.data.counts;
    const { slope } = this.closure(z, u);
    const right = new Float64Array(rows);
    for (let j = 0; j < m; j++) for (let i = 0; i < rows; i++) right[i] -= slope[(n + j) * rows + i] * u1[j];
    return this.inverse(slope, right);
  }

  /** What every constraint leaves open at unknowns and inputs, and the slope there: {F, slope}. */
  closure(z, u) {
    const { z: n, F: rows, u: m } = this.data.counts;
    this.program.kinematics([...z, ...u], new Float64Array(n + m), new Float64Array(n + m), this.p, this.rates);
    return { F: this.rates.subarray(0, rows), slope: this.slope() };
  }

  /** The slope that `kinematics` has just found: rows by unknowns and inputs, column by column. */
  slope() { return this.rates.slice(3 * (this.data.counts.F + this.data.counts.w)); }

  /** Solve the slope in the unknowns for a right side. */
  inverse(slope, right) {
    const { z: n, F: rows } = this.data.counts;
    if (rows === n) return solve(slope.slice(0, n * n), right, n) ? right : null;
    return leastSquares(slope, right, rows, n, 0);
  }

  /** Go with the inputs to u, step by step on the branch: {reached: 0..1, open}. The state moves as far as it can. */
  moveTo(u) {
    const from = this.u.slice(), far = Math.max(...u.map((each, k) => Math.abs(each - from[k])), 0);
    return this.follow(far / FARTHEST, (part) => {
      const to = part === 1 ? u : from.map((each, k) => each + part * (u[k] - each));
      return { u: to, ready: () => undefined };
    });
  }

  /** Change the dimensions, the inputs where they are: {reached, open}. */
  changeTo(d) {
    const from = this.d.slice();
    this.last = null; // the way is another than that of the step before
    const far = Math.max(...d.map((each, k) => Math.abs(each - from[k]) / this.data.size), 0);
    const done = this.follow(far / FARTHEST, (part) => {
      const to = part === 1 ? d : from.map((each, k) => each + part * (d[k] - each));
      return { u: this.u, ready: () => this.measure(to) };
    });
    this.d = done.reached === 1 ? Array.from(d) : from.map((each, k) => each + done.reached * (d[k] - each));
    this.measure();
    return done;
  }

  /** Follow a branch along a way: `at` says for a part from 0 to 1 which inputs and numbers there are; `near` is a way that
      ends close to a dead point. */
  follow(count, at, near = false) {
    let reached = 0, step = 1 / Math.max(1, Math.ceil(count)), open = 0;
    this.met = [];
    const whole = step;
    if (count === 0) return { reached: 1, open }; // nothing moves
    while (reached < 1) {
      const next = Math.min(1, reached + step), there = at(next);
      there.ready();
      const guess = this.foretold(there.u, next - reached), found = this.newton(there.u, guess);
      if (found.closed && this.continues(found, guess)) {
        if (beyondStops(this, found.z, there.u).length) {
          reached = goToStop(this, at, reached, next);
          break;
        }
        if (next === 1 && !near && singularity(this, this.closure(found.z, there.u).slope)) {
          if (this.arrive(count, at, reached)) { reached = 1; break; }
          there.ready();
        }
        this.last = { ...this.since(there.u), to: found.z, signs: this.agreed(found.signs), step: next - reached };
        this.z = found.z;
        this.u = Array.from(there.u);
        reached = next;
        step = Math.min(whole, step * 1.5);
      } else {
        open = found.open;
        step *= 0.4;
        if (step * Math.max(count, 1) * FARTHEST >= SHORTEST) continue;
        const part = reached + Math.min(1 - reached, LEAVING / (Math.max(count, 1) * FARTHEST));
        at(reached).ready();
        if (this.leave(at(part))) {
          reached = part;
          step = Math.min(whole, part);
          continue;
        }
        const dead = deadPointAhead(this, at, reached, count * FARTHEST);
        if (this.standOn(dead, at, reached)) reached = dead.part;
        break;
      }
    }
    at(reached).ready();
    return { reached, open };
  }

  /** Go on from a part of a way to its end where that is a dead point itself, on which Newton's method does not tell the
      sides apart: close to it first. Whether it is one. */
  arrive(count, at, from) {
    const { z, u, last, stop } = this, close = Math.max(from, 1 - SHORTEST / (count * FARTHEST)), way = close - from;
    const { reached } = this.follow(count * way, (part) => at(from + part * way), true);
    if (reached === 1 && this.standOn(deadPointAhead(this, at, close, count * FARTHEST), at, close)) return true;
    Object.assign(this, { z, u, last, stop });
    return false;
  }

  /** Stand on a dead point, if there is one, and keep the side from which it came: it leads back on its own branch. */
  standOn(dead, at, reached) {
    if (dead === null) return false;
    at(reached).ready();
    const { came, before, z, u } = this, signs = came ? came.signs : this.newton(u, z).signs;
    if (dead.z.some((each, k) => each !== z[k])) this.stop = { u, z, to: dead.z, signs };
    else this.stop = came && { ...came, to: dead.z };
    this.last = before && { ...before, to: dead.z };
    [this.z, this.u] = [dead.z, Array.from(at(dead.part).u)];
    return true;
  }

  /** Off an exact dead point, where no step leads: the unknowns go back as they came, group by group on the same side
      of it; where that is not known along what the slope leaves free. Whether it came to another position. */
  leave(there) {
    const { came } = this, stop = this.stop?.to === this.z ? this.stop : null;
    const free = stop ? this.towards(stop.z) : this.free();
    if (free === null) return false;
    const back = came ? free.reduce((sum, each, i) => sum + each * (came.z[i] - this.z[i]), 0) : 1;
    there.ready();
    for (const side of back < 0 ? [-1, 1] : [1, -1]) {
      for (const nudge of NUDGES) {
        const found = this.newton(there.u, this.z.map((each, i) => each + side * nudge * free[i]));
        const gone = found.z.reduce((most, each, i) => Math.max(most, Math.abs(each - this.z[i])), 0);
        if (!found.closed || gone > 3 * nudge || found.signs.includes(0)) continue;
        if (stop && found.signs.some((each, k) => each * stop.signs[k] < 0)) continue;
        [this.z, this.u] = [found.z, Array.from(there.u)];
        return true;
      }
    }
    return false;
  }

  /** The way from here to other unknowns, the greatest by 1. */
  towards(z) {
    const far = z.reduce((most, each, i) => Math.max(most, Math.abs(each - this.z[i])), 0);
    return Float64Array.from(z, (each, i) => (each - this.z[i]) / far);
  }

  /** How the unknowns can move by themselves where their slope is singular, the greatest by 1; null where it is not. */
  free() {
    const { z: n, F: rows } = this.data.counts;
    if (rows !== n || n === 0) return null;
    const { slope } = this.closure(this.z, this.u), square = new Float64Array(n * n);
    let most = 0;
    for (let i = 0; i < n; i++) {
      for (let j = 0; j < n; j++) for (let k = 0; k < n; k++) square[j * n + i] += slope[i * n + k] * slope[j * n + k];
      most = Math.max(most, square[i * n + i]);
    }
    for (let i = 0; i < n; i++) square[i * n + i] += 10 * WEAK * most;
    let way = new Float64Array(n).fill(1);
    for (let round = 0; round < 4; round++) { // inverse iteration
      const next = way.slice();
      if (!solve(square.slice(), next, n)) return null;
      const far = next.reduce((greatest, each) => Math.max(greatest, Math.abs(each)), 0);
      way = next.map((each) => each / far);
    }
    let left = 0;
    for (let k = 0; k < n; k++) left = Math.max(left, Math.abs(way.reduce((sum, each, i) => sum + slope[i * n + k] * each, 0)));
    return left <= SINGULAR * Math.sqrt(most) ? way : null;
  }

  /** What is known of the step that led here; nothing where somebody else has put z. */
  get before() { return this.last && this.last.to === this.z ? this.last : null; }

  /** From where it came here: to an exact dead point by a way of the inputs or of the dimensions, else by the last step. */
  get came() { return this.stop && this.stop.to === this.z ? this.stop : this.before; }

  /** From where a step to inputs u is remembered: from here, but from one before where it is so short that it says
      nothing of the way. */
  since(u) {
    const { before } = this, far = Math.max(0, ...Array.from(u, (each, k) => Math.abs(each - this.u[k])));
    const here = before === null || far === 0 || far >= LEAVING || before.u.every((each, k) => each === this.u[k]);
    return here ? { u: this.u, z: this.z } : { u: before.u, z: before.z };
  }

  /** Where the unknowns would be for inputs u if they went on as in the last step, or along the tangent. */
  foretold(u, step) {
    const guess = Float64Array.from(this.z), { before } = this;
    const way = Array.from(u, (each, k) => each - this.u[k]);
    if (before !== null) {
      const past = Array.from(this.u, (each, k) => each - before.u[k]);
      const square = past.reduce((sum, each) => sum + each * each, 0);
      // where the inputs rest the dimensions change, step by step of the same way
      const by = square > 0 ? way.reduce((sum, each, k) => sum + each * past[k], 0) / square : step / before.step;
      const aside = Math.hypot(...way.map((each, k) => each - by * past[k])), far = Math.hypot(...way);
      if (Math.abs(by) <= RUNUP && aside <= 1e-6 * far && (square > 0) === (far > 0)) {
        for (let i = 0; i < guess.length; i++) guess[i] += by * (this.z[i] - before.z[i]);
        return guess;
      }
    }
    const tangent = way.some((each) => each !== 0) ? this.tangent(this.u, this.z, way) : null;
    // beside a dead point a tangent leads anywhere
    if (tangent !== null && tangent.every((each) => Math.abs(each) < FAR)) for (let i = 0; i < guess.length; i++) guess[i] += tangent[i];
    return guess;
  }

  /** Whether a position is on the same branch as this one: near to what was foretold, and on the same side of every
      dead point, unless the way leads smoothly across a change point. */
  continues(found, guess) {
    let moved = 0, ahead = 0, gone = 0;
    for (let i = 0; i < guess.length; i++) {
      gone = Math.max(gone, Math.abs(found.z[i] - this.z[i]));
      moved = Math.max(moved, Math.abs(found.z[i] - guess[i]));
      ahead = Math.max(ahead, Math.abs(guess[i] - this.z[i]));
    }
    if (!(gone < FAR) || moved > NEAR + JUMP * ahead) return false;
    const signs = this.came ? this.came.signs : this.newton(this.u, this.z).signs;
    return moved <= SMOOTH * ahead || found.signs.every((each, k) => each * signs[k] >= 0);
  }

  /** The signs of determinants at a new position; where one is not known there, that before. */
  agreed(signs) {
    const { came } = this;
    return came ? signs.map((each, k) => each || came.signs[k]) : signs;
  }

  /** Where everything is, in SI: w, and with rates of the inputs u1, u2 also w1, w2; null at dead and change points, of
      which `why` tells which it is. */
  state(u1 = null, u2 = null) {
    const { z: n, F: rows, w: many, u: m } = this.data.counts;
    const by = this.data.lengths.map((each) => (each ? this.data.size : 1));
    const scaled = (part) => Float64Array.from(part, (each, k) => each * by[k]);
    if (u1 === null) return { w: scaled(this.program.positions(this.z, this.u, this.p, this.found).slice(0, many)), w1: null, w2: null, why: "" };
    const y = [...this.z, ...this.u], none = new Float64Array(n);
    const rates = (y1, y2) => this.program.kinematics(y, y1, y2, this.p, this.rates);
    const size = rows + many, column = (k) => this.rates.slice(k * size, (k + 1) * size);
    const v = u1.map((each, k) => each / this.scale[k]), a = u2.map((each, k) => each / this.scale[k]);
    rates([...none, ...v], [...none, ...a]);
    const slope = this.slope();
    const still = column(0).slice(rows);
    const why = singularity(this, slope);
    const z1 = why ? null : this.inverse(slope, column(1).slice(0, rows).map((each) => -each));
    if (z1 === null) return { w: scaled(still), w1: null, w2: null, why: this.stop?.to === this.z ? "dead point" : why || "change point" };
    rates([...z1, ...v], [...none, ...a]);
    const z2 = this.inverse(slope, column(2).slice(0, rows).map((each) => -each));
    rates([...z1, ...v], [...z2, ...a]);
    return { w: scaled(still), w1: scaled(column(1).slice(rows)), w2: scaled(column(2).slice(rows)), why };
  }
}
