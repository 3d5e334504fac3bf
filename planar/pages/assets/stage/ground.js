"use strict";
/* What stands still, as symbols: supports, fixed guides, racks and wheels, turned so that they are clear of the links
   over their whole motion; as Python's planar.drawing.scheme.ground has it. Places in px from the world's origin, y downwards. */

const LEANING = 2.5; // what a support costs that does not stand upright: half a bar that is always in its way

/** Points of strokes, from which the freest side for a symbol is told; each weighs by how often something is there. */
class Clearance {
  constructor(apart) {
    this.apart = apart; // px between points
    this.points = [];
  }

  /** A stroke; `weight` is the part of the time for which it is there. */
  add(a, b, weight = 1) {
    const far = Plane.apart(a, b), count = 1 + Math.ceil(far / this.apart);
    for (let k = 0; k <= count; k++) {
      this.points.push([a[0] + ((b[0] - a[0]) * k) / count, a[1] + ((b[1] - a[1]) * k) / count, weight]);
    }
  }

  /** What lies in a box: from `low` to `high` along a unit vector and to its left. */
  crowd(at, way, low, high) {
    const left = Symbols.quarter(way);
    let sum = 0;
    for (const [x, y, weight] of this.points) {
      const dx = x - at[0], dy = y - at[1], along = dx * way[0] + dy * way[1], aside = dx * left[0] + dy * left[1];
      if (along > low[0] && along < high[0] && aside > low[1] && aside < high[1]) sum += weight;
    }
    return sum;
  }

  middle() {
    const xs = this.points.map((p) => p[0]), ys = this.points.map((p) => p[1]);
    const mean = (list) => (list.length ? (list.reduce((a, b) => Math.min(a, b)) + list.reduce((a, b) => Math.max(a, b))) / 2 : 0);
    return [mean(xs), mean(ys)];
  }

  /** Which way a support stands best: downwards, unless strokes are there. */
  support(at, mm) {
    const across = (Symbols.BASE / 2 + 0.5) * mm, deep = (Symbols.STAND + Symbols.HATCH + 0.8) * mm, half = Math.SQRT1_2;
    const ways = [[0, 1], [-1, 0], [1, 0], [0, -1], [-half, half], [half, half], [-half, -half], [half, -half]];
    const near = this.points.filter(([x, y]) => Math.abs(x - at[0]) < deep + across && Math.abs(y - at[1]) < deep + across);
    const price = (down) => {
      const left = Symbols.quarter(down), rank = ways.indexOf(down);
      let sum = 0;
      for (const [x, y, weight] of near) {
        const dx = x - at[0], dy = y - at[1], along = dx * down[0] + dy * down[1];
        const aside = Math.abs(dx * left[0] + dy * left[1]);
        if (along > 1.4 * mm && along < deep && aside < Math.min(mm + 0.7 * along, across)) sum += weight;
      }
      return sum + (rank > 0 ? LEANING : 0) + (rank > 3 ? LEANING : 0);
    };
    return cheapest(ways, price);
  }

  /** On which side of a line, and how far off, its hatching is clearest; else below, else away from the middle. */
  side(at, way, low, high, half, middle, mm) {
    const left = Symbols.quarter(way), choices = [];
    for (const sign of [1, -1]) for (const off of [half, half + 0.8 * mm]) choices.push([sign, off]);
    const price = ([sign, off]) => {
      const [near, far] = [sign * (off - 0.25 * mm), sign * (off + (Symbols.HATCH + 1) * mm)].sort((a, b) => a - b);
      const side = Plane.times(left, sign), down = Math.abs(side[1]) > 0.5 ? -side[1] : 0;
      const inward = Plane.dot(Plane.minus(middle, at), side);
      return this.crowd(at, way, [low, near], [high, far]) + (off > half ? 1 : 0) + 1e-3 * down + 1e-9 * inward;
    };
    const [sign, off] = cheapest(choices, price);
    return [Plane.times(left, sign), off];
  }
}

/** What stands still: {elements, lines: [[from, to]], sides: on which side of a fixed guide its hatching is, by pair}.
    `scene`: {marks, poses, frame, mm, scale, near, strokes: Clearance of what moves}. */
function groundOf(scene) {
  const { marks, poses, frame, mm, scale, strokes } = scene, { plus, minus, times, on, dot, cross } = Plane;
  const px = (a) => [a[0] * scale, -a[1] * scale], pxWay = (way) => [way[0], -way[1]];
  const made = [], lines = [], sides = Object.create(null), seen = new Set(), middle = strokes.middle();
  const pinned = marks.filter((mark) => mark.kind === "Pin" && mark.links.includes(frame));
  const fixed = pinned.map((mark) => px(mark.at[mark.links.indexOf(frame)]));
  for (const { kind, name, links, at } of marks) { // where springs hang on the frame, but at its pins
    if (kind === "Coil") links.forEach((link, k) => {
      const spot = px(at[k]);
      if (link !== frame || fixed.some((other) => Plane.apart(other, spot) < 0.05 * mm)) return;
      pinned.push({ name: `${name} ${k}` });
      fixed.push(spot);
    });
  }
  for (const at of fixed) strokes.add(on(at, [1, 0], -Symbols.PIN * mm), on(at, [1, 0], Symbols.PIN * mm));
  const banded = new Set(marks.filter((mark) => mark.kind === "Band").map((mark) => mark.name));

  /** From where to where a fixed line is drawn, from its foot: a little beyond what runs along it (px). */
  const stretch = (mark, foot, over) => {
    const [low, high] = Bodies.range(mark, marks, poses, foot);
    return [low * scale - over, high * scale + over];
  };

  for (const mark of marks) {
    if (mark.kind === "Wheel" && mark.link === frame) {
      const key = [...mark.centre, mark.radius].map((value) => Math.round(value / scene.near)).join();
      if (seen.has(key)) continue;
      seen.add(key);
      const at = px(mark.centre), radius = mark.radius * scale;
      made.push(...(banded.has(mark.name) ? Symbols.rimHatching(at, radius, mm) : Symbols.wheel(at, radius, true, mm)));
    } else if (mark.kind === "PitchLine" && mark.link === frame) {
      const way = pxWay(mark.way), [low, high] = stretch(mark, mark.through, Math.max(10 * mm, 1.2 * Math.abs(mark.wheel.radius) * scale));
      const back = times(Symbols.quarter(way), -backOf(mark, marks, poses)), at = px(mark.through);
      made.push(...Symbols.rail(on(at, way, low), on(at, way, high), back, mm));
      lines.push([on(at, way, low), on(at, way, high)]);
    }
  }

  /** A rail along a line from a place on it (px), with gaps for the supports of fixed pins that lie on its way. */
  const pieces = (at, way, low, high) => {
    const room = (Symbols.BASE / 2 + 1) * mm;
    let cut = [[low, high]];
    for (const pin of fixed) {
      const off = minus(pin, at), here = dot(off, way);
      if (Math.abs(cross(way, off)) >= (Symbols.STAND + Symbols.HATCH) * mm) continue;
      cut = cut.flatMap(([start, stop]) => [[start, Math.min(stop, here - room)], [Math.max(start, here + room), stop]]);
      cut = cut.filter(([start, stop]) => stop - start > Symbols.HATCH * mm);
    }
    return cut.length ? cut : [[low, high]];
  };

  for (const mark of marks) {
    if (mark.link !== frame || !["Guide", "Opening", "Block"].includes(mark.kind)) continue;
    let half = (Symbols.BLOCK[1] / 2) * mm, low, high, at, way;
    if (mark.kind === "Block") { // a fixed block, through which a link slides
      [at, way] = [px(mark.at), pxWay(mark.way)];
      [low, high] = [-(Symbols.BLOCK[0] / 2 + 1) * mm, (Symbols.BLOCK[0] / 2 + 1) * mm];
    } else {
      const [link, place] = Bodies.rider(mark, marks), here = Plane.carry(poses[0][link], place);
      const foot = on(mark.through, mark.way, dot(minus(here, mark.through), mark.way));
      [at, way] = [px(here), pxWay(mark.way)];
      [low, high] = stretch(mark, foot, (Symbols.BLOCK[0] / 2 + 2) * mm);
      if (mark.kind === "Opening") {
        half = (Symbols.SLOT / 2) * mm;
        for (const sign of [half, -half]) {
          const side = on(at, Symbols.quarter(way), sign);
          made.push(Symbols.line("ground", on(side, way, low), on(side, way, high)));
        }
      }
    }
    const [side, off] = strokes.side(at, way, low, high, half, middle, mm), beside = on(at, side, off);
    sides[mark.name] = side;
    for (const [start, stop] of pieces(at, way, low, high)) {
      const ends = [on(beside, way, start), on(beside, way, stop)];
      made.push(...Symbols.rail(...ends, side, mm));
      strokes.add(...ends);
      lines.push(ends, ends.map((end) => on(end, side, Symbols.HATCH * mm)));
    }
  }

  const drawn = new Set();
  pinned.forEach((mark, k) => {
    if (drawn.has(mark.name)) return;
    drawn.add(mark.name);
    const down = strokes.support(fixed[k], mm), foot = on(fixed[k], down, Symbols.STAND * mm);
    made.push(...Symbols.support(fixed[k], down, mm));
    const across = Symbols.quarter(down), half = (Symbols.BASE / 2) * mm, under = on(foot, down, 0.8 * Symbols.HATCH * mm);
    for (const ends of [[fixed[k], foot], [on(foot, across, -half), on(foot, across, half)], [on(under, across, -half), on(under, across, half)]]) {
      strokes.add(...ends);
      lines.push(ends);
    }
    for (const sign of [1, -1]) lines.push([fixed[k], on(foot, across, sign * 2.4 * mm)]);
  });
  return { elements: made, lines, sides };
}

/** On which side of a rack's pitch line its wheel is: 1 to the left of its way, -1 to the right. */
function backOf(mark, marks, poses) {
  const f = poses[0][mark.link], centre = Plane.local(f, Plane.carry(poses[0][mark.wheel.link], mark.wheel.centre));
  return Plane.cross(mark.way, Plane.minus(centre, mark.through)) > 0 ? 1 : -1;
}
