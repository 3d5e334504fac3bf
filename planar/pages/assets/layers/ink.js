"use strict";
/* What layers are drawn with: SVG elements, arrows, dots, letters that keep clear of one another, round scales. */

const SVG = "http://www.w3.org/2000/svg";
const MM = 96 / 25.4; // px of a screen's millimetre

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

/** The first of some rising values that is not less. */
function roundUp(least, values = STEP_VALUES) {
  return least > 0 ? values.find((each) => each >= least * (1 - ROUND_SLACK)) ?? least : 1;
}

/** A scale at which `most` (SI) takes no more than `room` px, of a unit [by, name] (see `unitOf`): {px per SI unit,
    told: "1 cm = 0.2 m/s"}, by the page's length on paper: a centimetre, or an inch. */
function roundScale(page, most, room, [by, name]) {
  const { paper } = page.data, length = paper.mm * MM, per = roundUp((most * by * length) / room, SCALE_VALUES);
  return { px: (length / per) * by, told: `1 ${paper.name} = ${short(per)} ${name}` };
}

/** A number as people write it, six figures at the most. */
function short(value) {
  if (!Number.isFinite(value)) return "–";
  const text = String(Number(value.toPrecision(6)));
  return text.replace("e+", "e").replace("-", "−");
}

/** Where strokes and letters go on an SVG, in px; y points down. A millimetre of paper has `mm` px. */
class Ink {
  constructor(group, mm) {
    this.group = group;
    this.mm = mm;
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
    const parts = Math.min(60, Math.ceil(Math.hypot(b[0] - a[0], b[1] - a[1]) / 8));
    for (let k = 1; k < parts; k++) this.keepClear([0, 1].map((axis) => a[axis] + ((b[axis] - a[axis]) * k) / parts), 2.5);
  }

  /** An arrow that letters keep off; one of no length is nothing. */
  arrow(tail, tip, kind) {
    const away = [tip[0] - tail[0], tip[1] - tail[1]], length = Math.hypot(...away);
    if (!(length > 0.5)) return;
    this.keepOff(tail, tip);
    this.head([tail], tip, away.map((each) => each / length), headLength([length], [this.mm], [])[0], kind);
  }

  /** A line whose end goes on into a head so long, which comes to its tip in a direction. */
  head(places, tip, way, length, kind) {
    const [x, y, a, b, c, d, u, v, widest] = headOfLength(tip, way, [length], []);
    this.line([...places, [u, v]], kind).style.setProperty("--widest", `${widest}px`);
    this.line([[x, y], [a, b], [c, d]], `${kind} head`, true);
  }

  /** A curved arrow about a place, anticlockwise as seen for `sense` 1, outside as many others: where its letter stands,
      and which way off. */
  turn([x, y], others, sense, kind) {
    const { radii, sweep } = COUPLE_ARC, radius = radii[Math.min(others, radii.length - 1)] * this.mm, parts = 24;
    const spot = (angle) => [x + radius * Math.cos(angle), y - radius * Math.sin(angle)];
    const from = Math.PI / 2 - (sense * sweep) / 2, to = from + sense * sweep, length = headLength([radius * sweep], [this.mm], [])[0];
    const back = (sense * length) / radius, end = to - LINE_END_IN_HEAD * back, foot = spot(to - back), tip = spot(to);
    const places = Array.from({ length: parts + 1 }, (_, k) => spot(from + ((end - from) * k) / parts));
    const away = [tip[0] - foot[0], tip[1] - foot[1]], far = Math.hypot(...away);
    this.head(places, tip, away.map((each) => each / far), length, kind);
    for (const place of places) this.keepClear(place, 3);
    return { at: spot(Math.PI / 2), away: [0, -1] };
  }

  /** A whole circle about a place, of a radius in mm. */
  dot([x, y], radius, kind) {
    return svgPart("circle", { cx: x, cy: y, r: radius * this.mm, class: kind }, this.group);
  }

  /** Letters to be set beside a place, each with its index: [[text, index], ...]; `told` is what is said of them. `key`
      is what they are known by from picture to picture, `away` the direction in which they stand best. */
  letter(at, letters, kind, { told = "", away = null, key = letters.join() } = {}) {
    this.letters.push({ at, letters, told, kind, away, key });
  }

  /** Letters keep clear of a place. */
  keepClear([x, y], r) {
    this.taken.push([x - r, y - r, x + r, y + r]);
  }

  /** Set all letters where they cover least; `before` remembers where each stood, so that none jumps while things move. */
  set(before, bounds = null) {
    for (const each of this.letters) {
      const height = LETTER.height * this.zoom, { reach, turns, index_size, told_size, drop } = LETTER;
      const many = each.letters.reduce((sum, [text, index]) => sum + text.length + index_size * index.length, told_size * each.told.length);
      const width = many * LETTER.width * height + 2;
      const box = (turn, far) => {
        const angle = (turn * 2 * Math.PI) / turns, x = each.at[0] + Math.cos(angle) * (far + width / 2), y = each.at[1] + Math.sin(angle) * (far + height / 2);
        return [x - width / 2, y - height / 2, x + width / 2, y + height / 2];
      };
      const start = before.get(each.key) ?? [turnOf(each.away), reach[0]];
      const [X, Y] = each.at, far = reach[reach.length - 1] + 2 + width;
      const near = this.taken.filter(([x0, y0, x1, y1]) => x1 > X - far && x0 < X + far && y1 > Y - far && y0 < Y + far);
      let best = null;
      for (const far of [start[1], ...reach]) {
        for (let k = 0; k < turns && best?.cover !== 0; k++) {
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
        "stroke-width": 3,
      }, this.group);
      // an index stands lower, and what follows as high as before
      let low = 0;
      const spans = each.letters.flatMap(([text, index]) => [[text, 1, 0, null], [index, index_size, drop, null]]);
      for (const [text, size, down, kind] of [...spans, [each.told, told_size, 0, "told"]]) {
        if (!text) continue;
        svgPart("tspan", { dy: (down - low) * height, "font-size": size * height, class: kind }, node, text);
        low = down;
      }
    }
  }

}

/** Names, of very many the first few and the last. */
function fewNames(names, { most, few }) { return names.length > most ? [...names.slice(0, few), "…", names[names.length - 1]] : names; }

/** How much of a box others cover. */
function covered([x0, y0, x1, y1], boxes) {
  let sum = 0;
  for (const [a, b, c, d] of boxes) sum += Math.max(0, Math.min(x1, c) - Math.max(x0, a)) * Math.max(0, Math.min(y1, d) - Math.max(y0, b));
  return sum;
}

function turnOf(away, turns = LETTER.turns) {
  return away === null ? turns - 2 : Math.round((Math.atan2(away[1], away[0]) * turns) / (2 * Math.PI));
}

function outside([x0, y0, x1, y1], bounds) {
  if (bounds === null) return 0;
  const [a, b, c, d] = bounds, within = Math.max(0, Math.min(x1, c) - Math.max(x0, a)) * Math.max(0, Math.min(y1, d) - Math.max(y0, b));
  return (x1 - x0) * (y1 - y0) - within;
}
