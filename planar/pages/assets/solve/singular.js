"use strict";
/* Where the equations of a linkage are singular: how near a position is to a dead or change point, by the same measure
   as Python's planar.solving.freedom, and the exact dead point at which a way of the inputs or dimensions ends. */

const SINGULAR_RATES = 1e-5; // a group's least singular value below this part of its links' reach: no rates are determined
const SWEEPS = 30;           // of Jacobi's method at the most; some seven do
const SEARCHES = 20;         // steps of the secant method to a dead point at the most; some five do
const TRIAL = 1e-4;          // rad, sizes: the first of them
const TURNED = 1e-13;        // the part of the inputs in a unit step along the curve that is none
const ALMOST = 3e-5;         // rad, sizes: so near to it the third order of a step is rounding
const APPROACH = 0.8;        // of the way to it, where it cannot be stood on
const TURNING = 1e-3;        // the same so near to a dead point; its square upon one
const BESIDE = 1e-3;         // rad, sizes: how far the inputs, or the square of the unknowns, may still have to go

/** The singular values of a matrix given by its columns, by one-sided Jacobi rotations (Golub and Van Loan, 8.6). */
function singularValues(columns) {
  const all = columns.map((each) => Float64Array.from(each)), dot = (a, b) => a.reduce((sum, each, i) => sum + each * b[i], 0);
  for (let sweep = 0, turned = true; turned && sweep < SWEEPS; sweep++) {
    turned = false;
    for (let i = 0; i < all.length; i++) {
      for (let j = i + 1; j < all.length; j++) {
        const [a, b] = [all[i], all[j]], [p, q, r] = [dot(a, a), dot(b, b), dot(a, b)];
        if (!(Math.abs(r) > 1e-15 * Math.sqrt(p * q))) continue;
        turned = true;
        const way = (q - p) / (2 * r), t = (way < 0 ? -1 : 1) / (Math.abs(way) + Math.hypot(1, way));
        const c = 1 / Math.hypot(1, t), s = c * t;
        for (let k = 0; k < a.length; k++) [a[k], b[k]] = [c * a[k] - s * b[k], s * a[k] + c * b[k]];
      }
    }
  }
  return all.map((each) => Math.sqrt(dot(each, each)));
}

/** How a slope is scaled: {by: what every row is divided by, least: what the column of every unknown could be at best},
    from the reach of the links of each group with the dimensions that there are. */
function slopeScales({ data, sizes }) {
  const far = new Map(data.links.map((link) => [link, [Infinity, Infinity, -Infinity, -Infinity]]));
  for (const { links, at } of Object.values(data.points)) {
    links.forEach((link, k) => {
      const [x, y] = at[k].map((place) => sizes[place]), [x0, y0, x1, y1] = far.get(link);
      far.set(link, [Math.min(x0, x), Math.min(y0, y), Math.max(x1, x), Math.max(y1, y)]);
    });
  }
  const reach = new Map([...far].map(([link, [x0, y0, x1, y1]]) => [link, x1 >= x0 ? Math.hypot(x1 - x0, y1 - y0) / data.size : 0]));
  const by = new Float64Array(data.counts.F).fill(1), least = new Float64Array(data.counts.z).fill(1);
  for (const { z, F, links, beside } of data.stages) {
    const own = Math.max(0, ...links.map((link) => reach.get(link)));
    const others = beside.map((link) => reach.get(link)).filter((each) => each > 0);
    const stage = own || (others.length ? Math.min(...others) : 1);
    for (let i = F[0]; i < F[1]; i++) if (data.row_lengths[i]) by[i] = stage;
    for (let j = z[0]; j < z[1]; j++) least[j] = data.unknown_angles[j] ? (reach.get(data.owners[j]) ?? stage) / stage || 1 : 1 / stage;
  }
  return { by, least };
}

/** Why no rates are determined by a slope (rows by unknowns and inputs, column by column): "dead point",
    "change point"; "" where they are. */
function singularity(linkage, slope) {
  const { data } = linkage, { z: n, F: rows, u: m } = data.counts, { by, least } = (linkage.scales ??= slopeScales(linkage));
  const part = (j, from, to) => Float64Array.from({ length: to - from }, (_, i) => slope[j * rows + from + i] / by[from + i]);
  const sizes = new Float64Array(n + m).fill(1);
  let weak = false;
  for (const { z: [a, b], F: [c, d] } of data.stages) {
    const columns = [];
    for (let j = a; j < b; j++) {
      const column = part(j, c, d);
      sizes[j] = Math.max(Math.hypot(...column), least[j]);
      columns.push(column.map((each) => each / sizes[j]));
    }
    const values = singularValues(columns);
    if (b > a && (d - c < b - a || !(Math.min(...values) >= SINGULAR_RATES * Math.max(1, ...values)))) weak = true;
  }
  if (!weak) return "";
  for (let j = n; j < n + m; j++) sizes[j] = Math.max(1, Math.hypot(...slope.subarray(j * rows, (j + 1) * rows)));
  const all = singularValues(Array.from({ length: n + m }, (_, j) => part(j, 0, rows).map((each) => each / sizes[j])));
  const rank = all.filter((each) => each > SINGULAR_RATES * Math.max(1, ...all)).length;
  return rank >= n ? "dead point" : "change point";
}

/** The exact dead point at which a way ends, from a linkage just before it: {z, part}, null where there is none.

    `at` says for a part which inputs there are, and makes the dimensions ready, as in `Linkage.follow`; the whole way is
    `far` long (rad, sizes). The curve of positions is followed by its own length, on which a dead point is like any other
    point, to where the way's part turns back. */
function deadPointAhead(linkage, at, reached, far) {
  const { z: n, F: rows } = linkage.data.counts;
  if (!(far > 0) || n === 0) return null;
  const open = (y) => {
    const there = at(y[n] / far);
    there.ready();
    const { F, slope } = linkage.closure(y.subarray(0, n), there.u);
    return { F: F.slice(), slope };
  };
  const bordered = (y, way, right) => { // the slope in the unknowns and the part, and below it the way
    const here = open(y), h = 1e-5, beside = [1, -1].map((sign) => { const moved = y.slice(); moved[n] += sign * h; return open(moved).F; });
    const matrix = new Float64Array((n + 1) * (rows + 1));
    for (let j = 0; j <= n; j++) {
      for (let i = 0; i < rows; i++) matrix[j * (rows + 1) + i] = j < n ? here.slope[j * rows + i] : (beside[0][i] - beside[1][i]) / (2 * h);
      matrix[j * (rows + 1) + rows] = way[j];
    }
    const wanted = Float64Array.from([...(right ?? here.F), right ? 1 : 0]);
    if (rows !== n) return leastSquares(matrix, wanted, rows + 1, n + 1, 0);
    return solve(matrix, wanted, n + 1) ? wanted : null;
  };
  const tangent = (y, way) => {
    const found = bordered(y, way, new Float64Array(rows)), long = found && Math.hypot(...found);
    return found && Number.isFinite(long) ? found.map((each) => each / long) : null;
  };
  const corrected = (y, way) => {
    for (let round = 0; round < 8; round++) {
      const move = bordered(y, way, null);
      if (move === null || !move.every(Number.isFinite)) return null;
      y = y.map((each, k) => each - move[k]);
      if (move.every((each) => Math.abs(each) < 1e-15)) break;
    }
    return y;
  };
  const start = Float64Array.from([...linkage.z, reached * far]), first = tangent(start, start.map((_, k) => Number(k === n)));
  if (first === null) return null;
  /* By the secant method: step by step onto it, or, where several groups turn back at once and the curve crosses others
     there, only near to it, and there by what the steps before foretell. */
  const search = (onto) => {
    let [y, way, step, last] = [start, first, TRIAL, null];
    for (let round = 0; round < SEARCHES && Math.abs(way[n]) > TURNED; round++) {
      if (last !== null) step *= -way[n] / (way[n] - last.way[n]);
      if (!(Math.abs(step) < NUDGES[NUDGES.length - 1])) return null;
      if (!onto && last !== null && Math.abs(step) < ALMOST) return Math.abs(way[n]) > TURNING ? null : y.map((each, k) => each + step * (way[k] + (0.5 * step * (way[k] - last.way[k])) / last.step));
      if (!onto && last !== null) step *= APPROACH;
      last = { way, step };
      y = corrected(y.map((each, k) => each + step * way[k]), way);
      way = y && tangent(y, way);
      if (way === null) return null;
      if (Math.abs(step) < 1e-12 || way[n] === last.way[n]) break;
    }
    return Math.abs(way[n]) > TURNING ** 2 ? null : y; // at a change point the way may go on
  };
  const accepted = (y) => {
    if (y === null) return null;
    const ahead = y[n] - start[n], gone = Math.max(...y.subarray(0, n).map((each, k) => Math.abs(each - start[k])));
    const worst = open(y).F.reduce((most, each) => Math.max(most, Math.abs(each)), 0), { slope } = linkage.closure(y.subarray(0, n), at(y[n] / far).u);
    if (!(ahead > -TURNED && ahead < BESIDE && gone ** 2 < BESIDE && worst <= 1e3 * linkage.data.tolerance)) return null;
    return singularity(linkage, slope) ? { z: y.slice(0, n), part: Math.min(1, Math.max(reached, y[n] / far)) } : null;
  };
  return accepted(search(true)) ?? accepted(search(false));
}
