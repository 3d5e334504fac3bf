"use strict";
/* Vectors [x, y], the axes of links, and the least of a list. */

const Plane = {
  minus: (a, b) => [a[0] - b[0], a[1] - b[1]],
  times: (a, by) => [a[0] * by, a[1] * by],
  on: (a, way, far) => [a[0] + way[0] * far, a[1] + way[1] * far],
  dot: (a, b) => a[0] * b[0] + a[1] * b[1],
  length: (a) => Math.hypot(a[0], a[1]),
  apart: (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]),
  unit: (a) => { const far = Math.hypot(a[0], a[1]); return far > 0 ? [a[0] / far, a[1] / far] : [1, 0]; },
  carry: (f, a) => [f.x + f.cos * a[0] - f.sin * a[1], f.y + f.sin * a[0] + f.cos * a[1]],
  local: (f, p) => {
    const x = p[0] - f.x, y = p[1] - f.y;
    return [f.cos * x + f.sin * y, f.cos * y - f.sin * x];
  },
};

/** The least of a list by what each costs (the first of equals). */
function cheapest(list, price) {
  let best, least = Infinity;
  for (const each of list) {
    const cost = price(each);
    if (cost < least) [best, least] = [each, cost];
  }
  return best;
}
