"use strict";
/* The stops of pairs: where a linkage on its way meets them. */

const AT_STOP = 1e-9;     // rad, sizes: so near to its stop, or beyond it, a pair is at its stop
const HALVINGS = 40;      // of a step that passes a stop

/** Where the pairs that have stops are, of a linkage at unknowns and inputs (rad, m). */
function stopPositions({ data, program, p, d, found }, z, u) {
  const w = program.positions(z, u, p, found).slice(0, data.counts.w);
  return program.stopping(w.map((each, k) => each * (data.lengths[k] ? data.size : 1)), d, new Float64Array(data.stops.length));
}

/** The stops beyond which pairs would be, going from where a linkage is to unknowns and inputs: [{pair, kind, at}]. */
function beyondStops(linkage, z, u) {
  const { stops } = linkage.data;
  if (!stops.length) return [];
  const here = stopPositions(linkage, linkage.z, linkage.u), there = stopPositions(linkage, z, u), turn = 2 * Math.PI, found = [];
  stops.forEach(({ pair, kind, low, high, periodic, size }, k) => {
    const room = AT_STOP * size;
    // the turns by which the pair is between its stops now
    const at = there[k] - (periodic ? turn * Math.ceil((here[k] - high - room) / turn) : 0);
    if (low !== null && at < low - room) found.push({ pair, kind, at: low });
    if (high !== null && at > high + room) found.push({ pair, kind, at: high });
  });
  return found;
}

/** Go with a linkage from one part of a way towards another, which lies beyond a stop, as far as that: the part. */
function goToStop(linkage, at, from, to) {
  for (let i = 0; i < HALVINGS; i++) {
    const middle = (from + to) / 2, there = at(middle);
    there.ready();
    const found = linkage.newton(there.u, linkage.foretold(there.u, middle - from));
    const past = found.closed ? beyondStops(linkage, found.z, there.u) : [];
    if (past.length) linkage.met = past;
    if (!found.closed || past.length) {
      to = middle;
      continue;
    }
    linkage.last = { ...linkage.since(there.u), to: found.z, signs: linkage.agreed(found.signs), step: middle - from };
    linkage.z = found.z;
    linkage.u = Array.from(there.u);
    from = middle;
  }
  return from;
}
