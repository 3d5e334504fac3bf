"use strict";
/* The hand that draws a path: a line freehand is a new one, a click is one place more. */

const STROKE_APART = 12; // px: what goes no farther is a click

class WishStroke {
  constructor() { this.line = null; }

  begin(at) { this.line = [at]; }
  lead(at) { this.line?.push(at); }

  /** The path after the hand is let go: that before with one more place, or a new one. `scale`: px to a metre. */
  end(wish, at, scale, isNear) {
    const { line } = this, { places = [], ...told } = wish ?? {};
    this.line = null;
    if (line.length > 2 && line.some((each) => Plane.apart(each, line[0]) * scale > STROKE_APART)) return { ...told, ...Wish.ofStroke(line) };
    return WishStroke.more({ ordered: true, closed: false, ...told, places }, at, isNear);
  }

  /** One more place; the first again closes. */
  static more(wish, at, isNear) {
    const { places } = wish;
    if (places.length >= WISH_LEAST_CLOSED && isNear(places[0])) return { ...wish, closed: true };
    return places.some(isNear) ? wish : { ...wish, places: [...places, at] };
  }
}
