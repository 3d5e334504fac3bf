"use strict";
/* Letters of points: upright, beside what they name, clear of strokes and of each other while everything moves. A letter
   stays on its side as long as nothing is in its way there, and then slides round to a freer one. */

const CLEAR = 2; // px: as far letters keep off the middle of a stroke at least
const LONGEST_NAME = 24; // letters: of a longer name its beginning is shown

class Letters {
  /** `items`: {name, away}, `away` px kept from the spot; `size` px of the letters. */
  constructor(group, items, size) {
    this.items = items.map(({ name, away }) => {
      const text = Symbols.element("text", { class: "letter", "font-size": Math.round(size * 10) / 10 }, Letters.told(name));
      group.append(text);
      return { name, away, text, at: [0, 0], side: null, x: 0, y: 0 };
    });
    // one look at all texts, so that the browser lays them out once
    for (const each of this.items) {
      each.half = [each.text.getComputedTextLength() / 2 + 1, size * 0.42];
      each.base = size * 0.35;
      each.sides = Letters.sides(each.half, each.away, size);
    }
    this.still = matchMedia("(prefers-reduced-motion: reduce)").matches;
  }

  /** A name, or its beginning. */
  static told(name) {
    const all = Array.from(name);
    return all.length > LONGEST_NAME ? `${all.slice(0, LONGEST_NAME - 1).join("")}…` : name;
  }

  /** Where the middle of a box can stand beside a spot: [x, y, what it costs by itself]. */
  static sides([w, h], away, size) {
    const found = [];
    for (const [ring, price] of [[away, 0], [away + 0.7 * size, 3], [away + 1.6 * size, 6]]) {
      for (let k = 0; k < 16; k++) {
        const angle = Math.PI / 4 + (k * Math.PI) / 8, c = Math.cos(angle), s = -Math.sin(angle);
        const far = 1 / Math.max(Math.abs(c), Math.abs(s)); // round a square, as boxes stand
        const edge = (part, half) => Math.max(-1, Math.min(1, part * far)) * half + part * ring;
        found.push([edge(c, w), edge(s, h), price + 0.8 * (1 - Math.cos(k * Math.PI / 8))]);
      }
    }
    return found;
  }

  /** Put the letters beside their spots (px), clear of strokes [x, y, x, y, ...]; whether all stand where they should. */
  place(spots, strokes, room, jump) {
    let settled = true;
    this.items.forEach((each, k) => { each.at = spots[k]; });
    for (const each of this.items) {
      const near = Letters.around(each, strokes);
      let best = each.side, least = best === null ? Infinity : this.price(each, best, near, room) - 2.5;
      if (least > 0) {
        for (const side of each.sides) {
          if (side[2] >= least) continue;
          const cost = this.price(each, side, near, room);
          if (cost < least) [best, least] = [side, cost];
        }
      }
      if (each.side === null || jump || this.still) [each.x, each.y] = best;
      each.side = best;
      each.x += 0.25 * (best[0] - each.x);
      each.y += 0.25 * (best[1] - each.y);
      if (Math.hypot(best[0] - each.x, best[1] - each.y) > 0.3) settled = false;
      else [each.x, each.y] = best;
      // by a transform, as a text that has another x is laid out anew
      each.text.setAttribute("transform", `translate(${(each.at[0] + each.x).toFixed(1)},${(each.at[1] + each.y + each.base).toFixed(1)})`);
    }
    return settled;
  }

  /** The strokes that a letter can have to do with. */
  static around({ at: [x, y], half: [w, h], away }, strokes) {
    const far = 2 * (w + h) + 2 * away + 20, near = [];
    for (let k = 0; k < strokes.length; k += 4) {
      const [ax, ay, bx, by] = [strokes[k], strokes[k + 1], strokes[k + 2], strokes[k + 3]];
      if (Math.max(ax, bx) > x - far && Math.min(ax, bx) < x + far && Math.max(ay, by) > y - far && Math.min(ay, by) < y + far) near.push(ax, ay, bx, by);
    }
    return near;
  }

  /** What is hidden by, or hides, a letter there. */
  price(each, side, strokes, room) {
    const [w, h] = each.half, x = each.at[0] + side[0], y = each.at[1] + side[1];
    let cost = side[2];
    if (x - w < 0 || y - h < 0 || x + w > room[0] || y + h > room[1]) cost += 30;
    for (let k = 0; k < strokes.length; k += 4) {
      if (Letters.cuts(strokes[k], strokes[k + 1], strokes[k + 2], strokes[k + 3], x, y, w + CLEAR, h + CLEAR)) cost += 8;
    }
    for (const other of this.items) {
      if (other === each) continue;
      if (other.side !== null) {
        const dx = Math.abs(other.at[0] + other.side[0] - x), dy = Math.abs(other.at[1] + other.side[1] - y);
        if (dx < w + other.half[0] + 1 && dy < h + other.half[1]) cost += 25;
      }
      if (Math.abs(other.at[0] - x) < w && Math.abs(other.at[1] - y) < h) cost += 6; // its spot
    }
    return cost;
  }

  /** Whether a piece cuts a box (Liang and Barsky, 1984). */
  static cuts(ax, ay, bx, by, x, y, w, h) {
    if ((ax < x - w && bx < x - w) || (ax > x + w && bx > x + w) || (ay < y - h && by < y - h) || (ay > y + h && by > y + h)) return false;
    let enter = 0, leave = 1;
    const dx = bx - ax || 1e-9, dy = by - ay || 1e-9;
    for (const [start, way, low, high] of [[ax, dx, x - w, x + w], [ay, dy, y - h, y + h]]) {
      const one = (low - start) / way, other = (high - start) / way;
      enter = Math.max(enter, Math.min(one, other));
      leave = Math.min(leave, Math.max(one, other));
    }
    return enter <= leave;
  }
}
