"use strict";
/* The strokes of a mechanism: where Python's rules say that they lie on the links, for the dimensions, the motion and
   the scale that there are now. Places are in px of the links' axes, y downwards. */

const down = (way) => [way[0], -way[1]]; // as y is downwards on the screen

/** Strokes of links by the numbers that they refer to. */
class Strokes {
  constructor(scheme) {
    this.scheme = scheme;
    this.values = new Float64Array(scheme.count);
    this.travel = new Float64Array(2 * scheme.measures.length);
  }

  /** Work out all numbers: from where to where displacements go in some positions, and at a scale (px/m). */
  measure(page, poses, scale, mm) {
    Object.assign(this, { scale, mm });
    const renew = () => page.drawn(this.travel, mm / scale, this.values);
    renew(); // of the lines that the travel is measured along
    this.scheme.measures.forEach((measure, k) => {
      let low = Infinity, high = -Infinity;
      for (const frames of poses) {
        const far = this.displacement(measure, frames);
        [low, high] = [Math.min(low, far), Math.max(high, far)];
      }
      this.travel.set([low, high], 2 * k);
    });
    renew();
  }

  /** How far along a line of a link a point of another is in a pose (m). */
  displacement({ link, foot, direction, rider, at }, frames) {
    const [start, way, place] = [foot, direction, at].map((each) => this.place(each));
    return Plane.dot(Plane.minus(Plane.local(frames[link], Plane.carry(frames[rider], place)), start), way);
  }

  /** Whether no displacement of a pose goes farther by `over` (mm) than those that the strokes are for. */
  cover(frames, over) {
    const off = (over * this.mm) / this.scale;
    return this.scheme.measures.every((measure, k) => {
      const far = this.displacement(measure, frames);
      return far >= this.travel[2 * k] - off && far <= this.travel[2 * k + 1] + off;
    });
  }

  /** A place or a direction in the axes of its link (m). */
  place([x, y]) { return [this.values[x], this.values[y]]; }

  px(at) { const [x, y] = this.place(at); return [x * this.scale, -y * this.scale]; }

  /** What a stroke of one link is made of: [{pen, element, spots}]. */
  made({ symbol, pen, points, closed, fill, at, direction, stop, side, radius }) {
    if (points) return [Symbols.stroke(pen, points.map((each) => this.px(each)), closed, fill)];
    const [start, end] = [at, stop ?? at].map((each) => this.px(each)), way = direction ? down(this.place(direction)) : [1, 0];
    if (Plane.dot(Plane.minus(end, start), way) < 0) return []; // nothing is left of it
    const r = radius === undefined ? 0 : this.values[radius] * this.scale;
    return Symbols.symbol(symbol, this.mm, start, way, { pen, side, stop: end, radius: r });
  }
}

/** Springs and dampers of a drawing, which lengthen and turn with what they hang on. */
class Springs {
  constructor(drawing, strokes) {
    this.drawing = drawing;
    this.all = strokes.map((stroke) => {
      const path = Symbols.element("path", { class: "pen-pin" }), group = Symbols.element("g");
      group.append(Symbols.element("title", {}, stroke.about), path);
      drawing.levels.springs.append(group);
      return { stroke, path };
    });
    this.coils = strokes.filter(({ places }) => places);
    this.room = 4 * this.coils.length; // numbers that `avoided` fills in
  }

  /** Where the two ends of a spring are on the screen. */
  ends({ links, places }) {
    const { drawing } = this;
    return links.map((link, k) => drawing.screen(link, drawing.strokes.px(places[k])));
  }

  /** Draw all of them where the mechanism is. */
  place() {
    const { page, mm, strokes } = this.drawing;
    for (const { stroke, path } of this.all) {
      const { symbol, links, places, pin, at, directions, free } = stroke;
      if (places) {
        const ends = this.ends(stroke);
        path.setAttribute("d", Plane.apart(...ends) > 0.01 ? Symbols.spring(symbol, ...ends, mm) : "");
        continue;
      }
      const [first, second] = links.map((link, k) => {
        const f = page.frames[link], [x, y] = strokes.place(directions[k]);
        return Math.atan2(f.sin * x + f.cos * y, f.cos * x - f.sin * y);
      });
      const [a, b] = links.map((link) => page.frames[link].angle), wound = Symbols.wrapped(b - a - strokes.values[free]);
      path.setAttribute("d", Symbols.torsionSpring(symbol, this.drawing.screen(pin, strokes.px(at)), first, second, wound, mm));
    }
  }

  /** Fill in the line of every spring, which letters keep off: [x, y, x, y, ...] from a place on. */
  avoided(strokes, from) {
    this.coils.forEach((stroke, k) => strokes.set(this.ends(stroke).flat(), from + 4 * k));
  }
}
