"use strict";
/* How a position changes by each dimension, the inputs where they are: dz/dd = -(dF/dz)^-1 dF/dd with dF/dd by central
   differences, and what follows from the unknowns by central differences along that. */

const DESIGN_STEP = 1e-5; // sizes
const TIED = 1e-6;        // sizes: constraints that a change opens by more than this part of it do not go with it

class DesignSlopes {
  constructor(page) {
    this.page = page;
    this.made = page.linkage.copy();
  }

  /** Of each dimension, or of those with the numbers `chosen`, at unknowns z and inputs u: {plus, minus}, each
      {frames, sizes, state, d} a step aside; null where the dimension cannot change alone, or where nothing is determined. */
  sides(z, u, chosen = null) {
    const { page: { data }, made } = this, { d } = made;
    Object.assign(made, { z: Float64Array.from(z), u: Array.from(u) });
    made.measure();
    const slope = Float64Array.from(made.closure(z, u).slope), why = singularity(made, slope);
    const left = (k) => chosen !== null && !chosen.includes(k);
    return data.dimensions.map((each, k) => (why || each.held || left(k) ? null : this.aside(k, z, u, d, slope)));
  }

  aside(k, z, u, d, slope) {
    const { page: { data: { size } }, made } = this, { F: rows, z: n } = made.data.counts, step = DESIGN_STEP * size;
    const beside = (side) => {
      const there = Array.from(d);
      there[k] += side * step;
      made.measure(there);
      return there;
    };
    const opened = (side) => { beside(side); return Float64Array.from(made.closure(z, u).F); };
    const above = opened(1), below = opened(-1), change = above.map((each, i) => (below[i] - each) / 2);
    const move = n ? made.inverse(slope, Float64Array.from(change)) : new Float64Array(0);
    if (move === null) return null;
    for (let i = 0; i < rows; i++) {
      let left = -change[i];
      for (let j = 0; j < n; j++) left += slope[j * rows + i] * move[j];
      if (!(Math.abs(left) <= TIED * DESIGN_STEP)) return null;
    }
    const side = (sign) => {
      const there = beside(sign);
      made.z = Float64Array.from(z, (each, i) => each + sign * move[i]);
      const state = made.state();
      return { frames: this.page.framesOf(state), sizes: Float64Array.from(made.sizes), state, d: there };
    };
    const found = { plus: side(1), minus: side(-1) };
    made.z = Float64Array.from(z);
    return found;
  }

  /** The derivative by a dimension of what `of` makes, a list of numbers, of {frames, sizes}; null where there is none. */
  static derivative(page, sides, of) {
    if (sides === null) return null;
    const [above, below] = [of(sides.plus), of(sides.minus)], width = 2 * DESIGN_STEP * page.data.size;
    return above.map((each, i) => (each - below[i]) / width);
  }

  /** The derivatives of a point's place (m/m) by each dimension: [dx, dy], null where there are none. */
  static ofPoint(page, sides, name) {
    const { links, at } = page.data.points[name];
    const place = ({ frames, sizes }) => page.place(links[0], at[0], frames, sizes);
    return sides.map((each) => DesignSlopes.derivative(page, each, place));
  }

  /** The same of a link's angle (rad/m): [slope]. */
  static ofLink(page, sides, name) {
    return sides.map((each) => DesignSlopes.derivative(page, each, ({ frames }) => [frames[name].angle]));
  }
}
