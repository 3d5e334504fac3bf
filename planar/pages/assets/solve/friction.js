"use strict";
/* Friction of a position in the sense of its motion, as planar.dynamics.friction finds it: contacts y are as great as
   parts h - H y of what their pairs carry. Told only where these change so little that there is just one solution. */

const NO_RATE = 1e-11;      // of the greatest, at an arm of the mechanism's size: a relative rate below is none
const ONE_SOLUTION = 0.999; // a bound of the spectral radius of what contacts change each other by: below there is one
const MAX_ROUNDS = 60000;

/** What each contact puts on the links (pair, row), with {why} where that is not told; null where nothing rubs.
    `solved` tells the forces that balance what is asked of the links; `own` is what a pair's forces put on them. */
function solveFriction({ data, held, size, counts }, links, rates, asked, solved) {
  const contacts = contactsOf(data, links, rates, size);
  if (contacts === null || contacts.why) return contacts;
  const shared = data.pairs.filter((pair) => pair.unshared).map((pair) => pair.name);
  if (shared.length && contacts.some(({ pair }) => !data.pairs[pair].unshared)) {
    return { why: `not determined: friction follows what ${shared.join(", ")} puts on pairs, which is not known` };
  }
  const starts = counts.map((_, k) => counts.slice(0, k).reduce((sum, each) => sum + each, 0));
  // a part of a pair's force, of all forces of one
  const value = (part, pair, forces) => held[pair].reduce((sum, row, k) => sum + forces[starts[pair] + k] * dot(part, row), 0);
  const base = solved(asked), answers = contacts.map(({ action }) => solved(action));
  if (base === null || answers.includes(null)) return { why: "no forces in the pairs balance the links here, or a dead point is too near to tell" };
  const loads = contacts.map(({ parts, pair }) => parts.map((part) => value(part, pair, base)));
  const slopes = contacts.map(({ parts, pair }) => parts.map((part) => answers.map((answer) => value(part, pair, answer))));
  if (!(radiusBound(contacts, slopes) < ONE_SOLUTION)) {
    return { why: "with so much friction there may be several solutions or none here, which planar forces tells" };
  }
  let y = contacts.map(() => 0);
  for (let round = 0; round < MAX_ROUNDS; round++) {
    const next = contacts.map(({ law }, j) => sizeOf(law, loads[j].map((load, k) => slopes[j][k].reduce((sum, by, i) => sum - by * y[i], load))));
    const moved = Math.max(...next.map((each, k) => Math.abs(each - y[k])));
    y = next;
    if (moved <= 1e-16 * Math.max(...y.map(Math.abs))) break;
  }
  return { contacts: contacts.map(({ pair, action }, k) => ({ pair, on: action.map((each) => each * y[k]) })) };
}

/** The contacts with the senses of the motion; null where nothing rubs. */
function contactsOf(data, links, rates, size) {
  const most = rates.reduce((greatest, each, k) => Math.max(greatest, Math.abs(each) * (k % 3 === 2 ? size : 1)), 0);
  const found = [];
  let turning = 0;
  for (const { pair, action, rate, length, sense, law, parts } of data.contacts) {
    const speed = dot(links(rate), rates), moves = Math.abs(speed) > (NO_RATE * most) / (length ? 1 : size);
    if (!moves) { turning++; continue; }
    const by = -Math.sign(speed) * sense;
    found.push({ pair, law, action: links(action).map((each) => each * by), parts: parts[speed > 0 ? 0 : 1].map(links) });
  }
  if (!found.length) return null;
  if (turning) return { why: "a pair that rubs turns back just here, where friction jumps" };
  data.pairs.forEach(({ contact }, pair) => {
    if (!contact) return;
    const along = links(contact.along), square = dot(along, along), part = along.map((each) => (contact.slope * each) / square);
    found.push({ pair, law: "greatest", action: links(contact.apart), parts: [part, part.map((each) => -each)] });
  });
  return found;
}

function dot(a, b) { return a.reduce((sum, each, k) => sum + each * b[k], 0); }

function sizeOf(law, parts) {
  return law === "resultant" ? Math.hypot(...parts) : law === "signed" ? parts[0] : Math.max(...parts);
}

/** An upper bound of the spectral radius of what contacts can change each other by (L. Collatz, Math. Z. 48, 1942). */
function radiusBound(contacts, slopes) {
  const bounds = contacts.map(({ law }, j) => contacts.map((_, i) => {
    const column = slopes[j].map((part) => Math.abs(part[i]));
    return law === "resultant" ? Math.hypot(...column) : Math.max(...column);
  }));
  let way = contacts.map(() => 1), bound = Infinity;
  const most = Math.max(...bounds.flat());
  for (let round = 0; round < 200; round++) {
    const next = bounds.map((row) => dot(row, way));
    bound = Math.min(bound, Math.max(...next.map((each, k) => each / way[k])));
    const scale = Math.max(...next) + most * 1e-6 || 1;
    way = next.map((each, k) => (each + (most * 1e-6 + 1e-300) * way[k]) / scale);
  }
  return bound;
}

if (typeof module !== "undefined") module.exports = { solveFriction };
