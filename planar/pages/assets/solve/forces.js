"use strict";
/* The forces of a position, found as planar.dynamics.reactions finds them: all that acts and the links' inertia, balanced
   by the multipliers of the constraints and the efforts of the inputs. What equilibrium does not tell has no numbers.
   Everything is in SI; a force on a link acts in the world's axes. */

const OPEN_FORCES = 1e-8;  // of the greatest: links that stay out of balance by more are not held
const NO_COUPLE = 1e-13;   // of a pair's force at an arm of the mechanism's size: a couple below is none
const STANDING_RATE = 1e-12;     // of the input's rate, or that times or over the size: an output that moves less is at rest
const ILL = 1e9;           // of the norms of a matrix and its inverse: beyond it is one of a dead point

/** A square matrix (column by column) taken apart once, to be solved for many right sides; null where it is singular. */
class Factors {
  static of(matrix, n) {
    const lu = Float64Array.from(matrix), order = Array.from({ length: n }, (_, k) => k);
    for (let k = 0; k < n; k++) {
      let best = k;
      for (let i = k + 1; i < n; i++) if (Math.abs(lu[k * n + i]) > Math.abs(lu[k * n + best])) best = i;
      if (!(Math.abs(lu[k * n + best]) > 0)) return null;
      if (best !== k) {
        for (let j = 0; j < n; j++) {
          const kept = lu[j * n + k];
          lu[j * n + k] = lu[j * n + best];
          lu[j * n + best] = kept;
        }
        [order[k], order[best]] = [order[best], order[k]];
      }
      for (let i = k + 1; i < n; i++) {
        const by = (lu[k * n + i] /= lu[k * n + k]);
        if (by !== 0) for (let j = k + 1; j < n; j++) lu[j * n + i] -= by * lu[j * n + k];
      }
    }
    const found = Object.assign(new Factors(), { matrix, lu, order, n });
    return found.firm() ? found : null;
  }

  /** Whether no singular value is weak, by the norms of the matrix and of its inverse. */
  firm() {
    const { n, matrix } = this, unit = new Float64Array(n);
    let own = 0, inverse = 0;
    for (const each of matrix) own += each * each;
    for (let k = 0; k < n; k++) {
      unit.fill(0)[k] = 1;
      for (const each of this.once(unit)) inverse += each * each;
    }
    return Math.sqrt(own * inverse) < ILL;
  }

  once(right) {
    const { lu, order, n } = this, found = Float64Array.from(order, (k) => right[k]);
    for (let k = 0; k < n; k++) if (found[k] !== 0) for (let i = k + 1; i < n; i++) found[i] -= lu[k * n + i] * found[k];
    for (let k = n - 1; k >= 0; k--) {
      found[k] /= lu[k * n + k];
      for (let i = 0; i < k; i++) found[i] -= lu[k * n + i] * found[k];
    }
    return found;
  }

  /** What of a right side stays open. */
  open(right, found) {
    const { matrix, n } = this, left = Float64Array.from(right);
    for (let j = 0; j < n; j++) for (let i = 0; i < n; i++) left[i] -= matrix[j * n + i] * found[j];
    return left;
  }

  /** The solution, improved once; null where it does not balance. */
  solve(right) {
    const found = this.once(right), better = this.once(this.open(right, found));
    for (let k = 0; k < found.length; k++) found[k] += better[k];
    const most = (list) => list.reduce((greatest, each) => Math.max(greatest, Math.abs(each)), 0);
    return most(this.open(right, found)) <= OPEN_FORCES * Math.max(most(right), most(found)) ? found : null;
  }
}

class Forces {
  constructor(data, program) {
    Object.assign(this, { data: data.forces, size: data.size, program });
    const { links, coordinates, rows, told, pairs, inputs } = this.data;
    this.many = 3 * links.length;
    this.first = new Map(links.map((link, k) => [link, 3 * k]));
    this.table = new Float64Array(rows * coordinates);
    this.told = new Float64Array(told);
    this.factors = new Float64Array(this.data.acting.filter((each) => each.kind === "load").length);
    this.counts = pairs.map(({ rows: [a, b], own: [c, d] }) => b - a - (d - c));
    this.square = this.counts.reduce((a, b) => a + b, inputs.length) === this.many;
    this.arms = Float64Array.from({ length: this.many }, (_, k) => (k % 3 === 2 ? 1 / this.size : 1));
  }

  /** How many whole turns (rad) links stand apart whose springs do not count them, as planar.dynamics.work has it. */
  wound(w) {
    return Float64Array.from(this.data.springs, (spring) => {
      if (spring === null) return 0;
      const [first, second] = spring.angles.map((k) => (k === null ? 0 : w[k]));
      return 2 * Math.PI * Math.round((second - first - (Math.abs(spring.free) <= Math.PI ? spring.free : 0)) / (2 * Math.PI));
    });
  }

  /** The forces of a state (`Linkage.state`) with the inputs and dimensions there: {why, efforts, inputs, pairs, acting,
      advantages}.
      What is not told is NaN; where nothing is, `why` says so and there is nothing else. */
  at({ w, w1, w2, why }, inputs, d, wound, values = this.data.parameters.map((each) => each.value)) {
    const { data } = this;
    if (!this.square) return { why: data.untold.join("; ") || "the links are held more than once" };
    if (w1 === null || w2 === null) return { why: `not determined at a ${why}` };
    this.w = w;
    data.acting.forEach(({ course }, k) => { if (k < this.factors.length) this.factors[k] = course ? factorOf(course, inputs) : 1; });
    this.program.balance(w, w1, w2, this.factors, wound, [...d, ...values], this.told);
    const wide = data.coordinates;
    this.table.fill(0);
    data.row.forEach((row, k) => { this.table[row * wide + data.column[k]] = this.told[k]; });
    this.eliminate();
    const [pushes, drives] = [data.acting, data.inputs].map((each) => each.map(({ row }) => this.links(row)));
    const asked = this.links(data.inertia).map((each, k) => pushes.reduce((sum, push) => sum - push[k], each));
    // a force of one, or a couple of one at the mechanism's size, in each row
    const rows = [...this.held.flat(), ...drives], { many, arms } = this;
    const matrix = new Float64Array(many * many), norms = new Float64Array(many);
    rows.forEach((row, j) => {
      let square = 0;
      for (let i = 0; i < many; i++) square += (row[i] * arms[i]) ** 2;
      norms[j] = Math.max(Math.sqrt(square), 1e-300);
      for (let i = 0; i < many; i++) matrix[j * many + i] = (row[i] * arms[i]) / norms[j];
    });
    const factors = matrix.every(Number.isFinite) && asked.every(Number.isFinite) ? Factors.of(matrix, many) : null;
    const solved = (right) => factors?.solve(right.map((each, k) => each * arms[k]))?.map((each, k) => each / norms[k]) ?? null;
    let found = solved(asked);
    const pushedOff = data.pairs.map(() => null);
    const friction = found !== null && data.contacts.length ? solveFriction(this, (k) => this.links(k), w1.slice(0, many), asked, solved) : null;
    if (friction?.why) return { why: friction.why };
    if (friction) {
      const left = Float64Array.from(asked);
      for (const { pair, on } of friction.contacts) {
        pushedOff[pair] ??= new Float64Array(many);
        on.forEach((each, i) => { left[i] -= each; pushedOff[pair][i] += each; });
      }
      found = solved(left);
    } else if (found !== null && data.pairs.some(({ contact }) => contact)) {
      const left = Float64Array.from(asked);
      let at = 0;
      data.pairs.forEach(({ contact }, k) => {
        if (contact) {
          const by = contact.slope * Math.abs(found[at]);
          pushedOff[k] = this.links(contact.apart).map((each) => each * by);
          pushedOff[k].forEach((each, i) => { left[i] -= each; });
        }
        at += this.counts[k];
      });
      found = solved(left);
    }
    if (found === null) return { why: "no forces in the pairs balance the links here, or a dead point is too near to tell" };
    return { ...this.tell(found, drives, pushes, pushedOff), advantages: this.advantages(solved) };
  }

  /** What an ideal mechanism exerts at each output for a unit of each input: [{output, along, length, input, slides, ratio}].
      An output's rate is the power of a unit load there, which the inputs take up: the ratio is its inverse. */
  advantages(solved) {
    const { data: { advantages, inputs }, size } = this;
    return advantages.flatMap(({ rows: [first, last], ...output }) => {
      const taken = Array.from({ length: last - first }, (_, k) => solved(this.links(first + k).map((each) => -each)));
      return inputs.map(({ pair, slides }, k) => {
        const rates = taken.map((found) => (found === null ? NaN : -found[found.length - inputs.length + k]));
        const rate = rates.length > 1 ? Math.hypot(...rates) : rates[0];
        const none = STANDING_RATE * (output.length ? size : 1) / (slides ? size : 1);
        return { ...output, input: pair, slides, ratio: Math.abs(rate) <= none ? NaN : 1 / rate };
      });
    });
  }

  row(k) { return this.table.subarray(k * this.data.coordinates, (k + 1) * this.data.coordinates); }
  place(k) { const at = this.data.row.length + 2 * k; return [this.told[at], this.told[at + 1]]; }

  /** A row on the coordinates of the links alone. */
  links(k) { return this.row(k).slice(0, this.many); }

  /** Fills in the rows that hold the links, square to what the pairs' own coordinates do. */
  eliminate() {
    const { many } = this;
    this.held = this.data.pairs.map(({ rows: [from, to], own: [first, last], contact }) => {
      if (contact) return [this.links(contact.along)];
      const rows = Array.from({ length: to - from }, (_, k) => this.row(from + k)), count = last - first;
      if (!count) return rows.map((row) => row.slice(0, many));
      // directions along what the own coordinates do, and then those square to them
      const units = rows.map((_, k) => rows.map((__, i) => Number(i === k)));
      const own = Array.from({ length: count }, (_, c) => rows.map((row) => row[first + c])), basis = [];
      for (const way of [...own, ...units]) {
        let left = way;
        for (let again = 0; again < 2; again++) { // twice is enough (Kahan, Parlett)
          for (const each of basis) {
            const by = each.reduce((sum, part, i) => sum + part * left[i], 0);
            left = left.map((part, i) => part - by * each[i]);
          }
        }
        const rest = Math.hypot(...left);
        if (basis.length === rows.length || (basis.length >= count && rest < 0.5 / Math.sqrt(rows.length))) continue;
        basis.push(left.map((part) => part / rest));
      }
      return basis.slice(count).map((way) => {
        const sum = new Float64Array(many);
        way.forEach((by, k) => { for (let i = 0; i < many; i++) sum[i] += by * rows[k][i]; });
        return sum;
      });
    });
  }

  /** What is on a link, of what is on the coordinates of all: {force, couple about a place of the world}. */
  wrench(on, link, [x, y]) {
    const k = this.first.get(link), [fx, fy, moment] = on.subarray(k, k + 3);
    const [dx, dy] = [x - this.w[k], y - this.w[k + 1]];
    return { force: [fx, fy], couple: moment - (dx * fy - dy * fx) };
  }

  /** The same on any of some links, of which the frame has what adds up to nothing. */
  onBody(on, link, bodies, at) {
    if (this.first.has(link)) return this.wrench(on, link, at);
    const others = bodies.filter((each) => this.first.has(each)).map((each) => this.wrench(on, each, at));
    const sum = (of) => others.reduce((total, each) => total - of(each), 0);
    return { force: [sum((each) => each.force[0]), sum((each) => each.force[1])], couple: sum((each) => each.couple) };
  }

  tell(found, drives, pushes, pushedOff) {
    const { data, many } = this, shared = data.pairs.filter((pair) => pair.unshared).map((pair) => pair.name);
    let at = 0;
    const pairs = data.pairs.map((pair, k) => {
      const on = pushedOff[k] ?? new Float64Array(many);
      for (const row of this.held[k]) { for (let i = 0; i < many; i++) on[i] += found[at] * row[i]; at++; }
      const { name, links, bodies } = pair;
      if (shared.length) return { name, links, at: pair.at === null ? null : this.place(pair.at), force: [NaN, NaN], couple: NaN, couples: {} };
      if (pair.at === null) {
        const couples = Object.fromEntries(bodies.map((link) => [link, this.onBody(on, link, bodies, [0, 0]).couple]));
        return { name, links, at: null, force: [NaN, NaN], couple: couples[links[1]], couples };
      }
      const place = this.place(pair.at), { force, couple } = this.onBody(on, links[1], bodies, place);
      const none = Math.abs(couple) <= NO_COUPLE * this.size * Math.hypot(...force);
      return { name, links, at: place, force, couple: none ? 0 : couple, couples: {} };
    });
    const efforts = found.slice(at);
    const inputs = data.inputs.map((given, k) => {
      const place = this.place(given.at), on = drives[k].map((each) => each * efforts[k]);
      const link = this.first.has(given.on) ? given.on : given.against;
      return { ...given, kind: "input", name: given.pair, link, at: place, effort: efforts[k], ...this.wrench(on, link, place) };
    });
    const acting = data.acting.flatMap((each, k) => each.on.filter(([link]) => this.first.has(link)).map(([link, spot]) => {
      const place = this.place(spot);
      return { kind: each.kind, name: each.name, link, at: place, ...this.wrench(pushes[k], link, place) };
    }));
    const why = shared.length ? `not determined in the pairs: what ${shared.join(", ")} ${shared.length > 1 ? "put" : "puts"} on them is not known` : "";
    return { why, efforts, inputs, pairs, acting, wheels: this.wheels(pairs) };
  }

  /** The torque that holds each wheel of the frame, anticlockwise, about its centre: [{about, pairs, torque}]. */
  wheels(pairs) {
    const held = new Map();
    for (const { frame, centre, at, pair: name } of this.data.wheels) {
      const { links, at: place, force: [fx, fy], couple, couples } = pairs.find((each) => each.name === name);
      if (place !== null && at === null) continue;
      const [x, y] = at === null ? [0, 0] : this.place(at);
      const onSecond = place === null ? 0 : (place[0] - x) * fy - (place[1] - y) * fx + couple;
      const moment = place === null ? couples[frame] : links[1] === frame ? onSecond : -onSecond;
      const wheel = held.get(centre ?? name) ?? { about: centre ?? "-", pairs: [], torque: 0 };
      held.set(centre ?? name, { ...wheel, pairs: [...wheel.pairs, name], torque: wheel.torque - moment });
    }
    return [...held.values()];
  }
}

/** How much of a load there is, with the inputs at their positions: straight between the places that are given. */
function factorOf({ input, turns, at, factors }, inputs) {
  const last = at.length - 1, span = at[last] - at[0];
  let x = input === null ? 0 : inputs[input];
  if (turns && Math.abs(span - 2 * Math.PI) < 1e-9) x -= 2 * Math.PI * Math.floor((x - at[0]) / (2 * Math.PI));
  if (!(x > at[0])) return factors[0];
  if (x >= at[last]) return factors[last];
  const k = at.findIndex((each) => each > x);
  return factors[k - 1] + ((factors[k] - factors[k - 1]) * (x - at[k - 1])) / (at[k] - at[k - 1]);
}

if (typeof module !== "undefined") module.exports = { Forces, factorOf };
