"use strict";
/* What layers are drawn with: SVG elements, arrows, dots, letters that keep clear of one another, round scales. */

const SVG = "http://www.w3.org/2000/svg";
const CM = 96 / 2.54;        // px of a screen's centimetre
const LETTER = 13;           // px
const WIDTH_OF_LETTER = 0.6; // of its height, on the average
const DIGITS = [1, 2, 5, 10]; // first ones of steps that are read easily
const FINE = [1, 1.25, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10]; // first ones of a scale
const HEAD = 9;              // px: an arrow's head
const REACH = [9, 15, 23, 33]; // px: how far from its place a letter may stand
const TURNS = 16;            // directions in which a letter may stand from its place

/** An element of SVG, or of HTML (`html`), with attributes, in a parent; a text is shown as text. */
function svgPart(tag, attributes = {}, parent = null, text = null) {
  const node = document.createElementNS(SVG, tag);
  return partFinished(node, attributes, parent, text);
}

function htmlPart(tag, attributes = {}, parent = null, text = null) {
  return partFinished(document.createElement(tag), attributes, parent, text);
}

function partFinished(node, attributes, parent, text) {
  for (const [name, value] of Object.entries(attributes)) if (value !== null) node.setAttribute(name, value);
  if (text !== null) node.textContent = text;
  if (parent !== null) parent.append(node);
  return node;
}

/** The first of some digits (1, 2, 5, 10) times a power of ten that is not less. */
function roundUp(least, firsts = DIGITS) {
  if (!(least > 0) || !Number.isFinite(least)) return 1;
  const power = 10 ** Math.floor(Math.log10(least));
  return firsts.find((first) => first * power >= least * (1 - 1e-9)) * power;
}

/** A scale at which `most` (SI) takes no more than `room` px, of a unit [by, name] (see `unitOf`): {px per SI unit,
    told: "1 cm = 0.2 m/s"}. */
function roundScale(most, room, [by, name]) {
  const perCm = roundUp((most * by * CM) / room, FINE);
  return { px: (CM / perCm) * by, told: `1 cm = ${short(perCm)} ${name}` };
}

/** A number as people write it, six figures at the most. */
function short(value) {
  if (!Number.isFinite(value)) return "–";
  const text = String(Number(value.toPrecision(6)));
  return text.replace("e+", "e").replace("-", "−");
}

/** Where strokes and letters go on an SVG whose user unit may be any number of px; y points down. */
class Ink {
  constructor(group, unit) {
    this.group = group;
    this.unit = unit;  // of user units to a px
    this.zoom = 1;     // of letters: where a page's text is large they are
    this.letters = [];
    this.taken = [];   // boxes [x, y, x, y] that letters keep clear of
  }

  line(points, kind, closed = false) {
    const d = points.map(([x, y], k) => `${k ? "L" : "M"}${x.toFixed(3)} ${y.toFixed(3)}`).join("");
    return svgPart("path", { d: d + (closed ? "Z" : ""), class: kind }, this.group);
  }

  /** Letters keep clear of a stroke. */
  keepOff(a, b) {
    const parts = Math.min(60, Math.ceil(Math.hypot(b[0] - a[0], b[1] - a[1]) / (8 * this.unit)));
    for (let k = 1; k < parts; k++) this.keepClear([0, 1].map((axis) => a[axis] + ((b[axis] - a[axis]) * k) / parts), 2.5);
  }

  /** An arrow that letters keep off; one shorter than its head is all head, one of no length is nothing. */
  arrow(tail, tip, kind) {
    const [dx, dy] = [tip[0] - tail[0], tip[1] - tail[1]], length = Math.hypot(dx, dy);
    if (!(length > 0.5 * this.unit)) return;
    this.keepOff(tail, tip);
    const head = Math.min(HEAD * this.unit, length), [ex, ey] = [dx / length, dy / length];
    const neck = [tip[0] - head * ex, tip[1] - head * ey], half = 0.33 * head;
    if (length > head) this.line([tail, neck], kind);
    this.line([tip, [neck[0] - half * ey, neck[1] + half * ex], [neck[0] + half * ey, neck[1] - half * ex]], `${kind} head`, true);
  }

  /** A curved arrow about a place, anticlockwise as seen for `sense` 1: where its letter stands, and which way off. */
  turn([x, y], radius, sense, kind) {
    const parts = 24, gap = 1.1, spot = (angle) => [x + radius * Math.cos(angle), y - radius * Math.sin(angle)];
    const from = -Math.PI / 2 + sense * gap, sweep = sense * (2 * Math.PI - 2 * gap), back = 1 - (HEAD * this.unit) / (radius * Math.abs(sweep));
    const places = Array.from({ length: parts + 1 }, (_, k) => spot(from + (back * sweep * k) / parts));
    this.line(places, kind);
    this.arrow(places[parts], spot(from + sweep), kind);
    for (const place of places) this.keepClear(place, 3);
    return { at: spot(Math.PI / 2), away: [0, -1] };
  }

  dot([x, y], radius, kind) {
    return svgPart("circle", { cx: x, cy: y, r: radius * this.unit, class: kind }, this.group);
  }

  /** Letters to be set beside a place, each with its index: [[text, index], ...]; `told` is what is said of them. `key`
      is what they are known by from picture to picture, `away` the direction in which they stand best. */
  letter(at, letters, kind, { told = "", away = null, key = letters.join() } = {}) {
    this.letters.push({ at, letters, told, kind, away, key });
  }

  /** Letters keep clear of a place. */
  keepClear([x, y], radius) {
    const r = radius * this.unit;
    this.taken.push([x - r, y - r, x + r, y + r]);
  }

  /** Set all letters where they cover least; `before` remembers where each stood, so that none jumps while things move. */
  set(before, bounds = null) {
    for (const each of this.letters) {
      const height = LETTER * this.unit * this.zoom;
      const many = each.letters.reduce((sum, [text, index]) => sum + text.length + 0.7 * index.length, 0.9 * each.told.length);
      const width = many * WIDTH_OF_LETTER * height + 2 * this.unit;
      const box = (turn, far) => {
        const angle = (turn * 2 * Math.PI) / TURNS, reach = far * this.unit;
        const x = each.at[0] + Math.cos(angle) * (reach + width / 2), y = each.at[1] + Math.sin(angle) * (reach + height / 2);
        return [x - width / 2, y - height / 2, x + width / 2, y + height / 2];
      };
      const start = before.get(each.key) ?? [turnOf(each.away), REACH[0]];
      const [X, Y] = each.at, far = (REACH[REACH.length - 1] + 2) * this.unit + width;
      const near = this.taken.filter(([x0, y0, x1, y1]) => x1 > X - far && x0 < X + far && y1 > Y - far && y0 < Y + far);
      let best = null;
      for (const far of [start[1], ...REACH]) {
        for (let k = 0; k < TURNS && best?.cover !== 0; k++) {
          const turn = start[0] + (k % 2 ? 1 : -1) * Math.ceil(k / 2), at = box(turn, far);
          const cover = covered(at, near) + outside(at, bounds) * 4;
          if (best === null || cover < best.cover - 1e-9) best = { cover, at, turn, far };
        }
      }
      before.set(each.key, [best.turn, best.far]);
      this.taken.push(best.at);
      const [x0, y0, x1, y1] = best.at;
      const node = svgPart("text", {
        x: (x0 + x1) / 2, y: (y0 + y1) / 2 + 0.35 * height, "font-size": height, "text-anchor": "middle", class: each.kind,
        "stroke-width": 3 * this.unit,
      }, this.group);
      // an index stands lower, and what follows as high as before
      let low = 0;
      const spans = each.letters.flatMap(([text, index]) => [[text, 1, 0, null], [index, 0.7, 0.25, null]]);
      for (const [text, size, drop, kind] of [...spans, [each.told, 0.9, 0, "told"]]) {
        if (!text) continue;
        svgPart("tspan", { dy: (drop - low) * height, "font-size": size * height, class: kind }, node, text);
        low = drop;
      }
    }
  }

}

/** How much of a box others cover. */
function covered([x0, y0, x1, y1], boxes) {
  let sum = 0;
  for (const [a, b, c, d] of boxes) sum += Math.max(0, Math.min(x1, c) - Math.max(x0, a)) * Math.max(0, Math.min(y1, d) - Math.max(y0, b));
  return sum;
}

function turnOf(away) {
  return away === null ? TURNS - 2 : Math.round((Math.atan2(away[1], away[0]) * TURNS) / (2 * Math.PI));
}

function outside([x0, y0, x1, y1], bounds) {
  if (bounds === null) return 0;
  const [a, b, c, d] = bounds, within = Math.max(0, Math.min(x1, c) - Math.max(x0, a)) * Math.max(0, Math.min(y1, d) - Math.max(y0, b));
  return (x1 - x0) * (y1 - y0) - within;
}

/** The outline of points: those on it, anticlockwise, by their places in the list; of points on a line its two ends. */
function outline(points) {
  const order = points.map((_, k) => k).sort((a, b) => points[a][0] - points[b][0] || points[a][1] - points[b][1]);
  const size = Math.max(...points.map(([x, y]) => Math.hypot(x - points[order[0]][0], y - points[order[0]][1])), 0);
  const way = (a, b) => [points[b][0] - points[a][0], points[b][1] - points[a][1]];
  const turn = (a, b, c) => { const [p, q] = [way(a, b), way(a, c)]; return p[0] * q[1] - p[1] * q[0]; };
  const half = (list) => {
    const found = [];
    for (const k of list) {
      while (found.length > 1 && turn(found[found.length - 2], found[found.length - 1], k) <= 1e-9 * size * size) found.pop();
      found.push(k);
    }
    return found.slice(0, -1);
  };
  return order.length < 2 ? order : [...half(order), ...half([...order].reverse())];
}
