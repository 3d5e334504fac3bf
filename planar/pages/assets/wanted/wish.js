"use strict";
/* A path that is drawn by hand and wanted of a point: {of: its name, places: [[x, y], ...] (m), closed, ordered}. */

const WISH_PLACES = { open: 16, closed: 24 }; // of a line drawn freehand
const WISH_CLOSED = 0.12;     // of its length: as near to one another its ends make it a closed curve
const WISH_LEAST_CLOSED = 5;  // places
const WISH_LEAST_LENGTH = 1e-3; // sizes: a length that follows gets no shorter
const WISH_FARTHEST = 1e3;    // sizes: as far go dimensions without bounds
const WISH_FIGURES = 7;       // of a place in a task

const Wish = {
  /** Of a line drawn freehand the places that are wanted, evenly apart, and whether they close. */
  ofStroke(stroke) {
    const far = [0];
    stroke.slice(1).forEach((at, k) => far.push(far[k] + Plane.apart(at, stroke[k])));
    const length = far[far.length - 1], closed = Plane.apart(stroke[0], stroke[stroke.length - 1]) <= WISH_CLOSED * length;
    const line = closed ? [...stroke, stroke[0]] : stroke, whole = closed ? length + Plane.apart(stroke[0], stroke[stroke.length - 1]) : length;
    if (closed) far.push(whole);
    const count = closed ? WISH_PLACES.closed : WISH_PLACES.open, places = [];
    for (let i = 0, k = 0; i < count; i++) {
      const to = (whole * i) / (closed ? count : count - 1);
      while (k < far.length - 2 && far[k + 1] < to) k++;
      const part = far[k + 1] > far[k] ? Math.min(1, (to - far[k]) / (far[k + 1] - far[k])) : 0;
      places.push([0, 1].map((axis) => line[k][axis] + part * (line[k + 1][axis] - line[k][axis])));
    }
    return { places, closed, ordered: true };
  },

  /** One that an address or the window has kept; null where that is none. */
  valid(kept) {
    const numbers = (at) => Array.isArray(at) && at.length === 2 && at.every(Number.isFinite);
    return Array.isArray(kept?.places) && kept.places.every(numbers) ? { of: String(kept.of ?? ""), places: kept.places, closed: Boolean(kept.closed), ordered: Boolean(kept.ordered) } : null;
  },

  /** The points of a mechanism that may be wanted somewhere: those that move, the points of couplers first. */
  points(file) {
    const moving = [...Pins.all(file)].filter(([, members]) => members.every(([link]) => link !== file.frame));
    const onFrame = new Set(Pins.ofLink(file.links[file.frame])), isCoupler = (link) => !Pins.ofLink(file.links[link]).some((each) => onFrame.has(each));
    const rank = ([, members]) => (members.length === 1 ? 0 : 2) + (isCoupler(members[0][0]) ? 0 : 1);
    return moving.sort((a, b) => rank(a) - rank(b)).map(([name]) => name);
  },

  /** The point of which it is wanted: its own, or else the likeliest; null where nothing moves. */
  point(wish, file) {
    const points = Wish.points(file);
    return points.includes(wish.of) ? wish.of : points[0] ?? null;
  },

  isClosed({ closed, places }) { return closed && places.length >= WISH_LEAST_CLOSED; },

  /** What a page shows as wanted, as Python's planar.pages.data.wanted_data has it; null where the page lacks the point. */
  data(wish, file, { points, dimensions, size: own }) {
    const of = wish && Wish.point(wish, file), { places } = wish ?? {};
    if (!places?.length || !points[of]) return null;
    const size = Math.max(...[0, 1].map((k) => Math.max(...places.map((at) => at[k])) - Math.min(...places.map((at) => at[k])))) || own;
    const item = {
      kind: "path", of, size, scale: 1, slides: false, places, angles: null, values: null, inputs: null, weights: places.map(() => 1), is_absolute: false,
      in_order: Boolean(wish.ordered) || Wish.isClosed(wish), is_closed: Wish.isClosed(wish), value_is_free: false, tolerance: null, angular: [false, false],
    };
    const free = dimensions.map(({ positive, bounds: [low, high] }, k) => ({
      k, low: Math.max((positive ? WISH_LEAST_LENGTH : -WISH_FARTHEST) * own, low ?? -Infinity), high: Math.min(WISH_FARTHEST * own, high ?? Infinity),
    }));
    return { items: [item], free, input: 0, unmoved: [] };
  },

  /** The task's file that `planar synthesise` takes: the mechanism to start from, and the path. */
  task(wish, file, units) {
    const through = wish.places.map((at) => at.map((each) => Number((each / units.length).toPrecision(WISH_FIGURES))));
    const wanted = { point: Wish.point(wish, file), through };
    if (Wish.isClosed(wish)) wanted.closed = true; else if (wish.ordered) wanted.in_order = true;
    return { planar: 1, name: file.name ?? "Mechanism", units: { length: file.units?.length ?? "m", angle: file.units?.angle ?? "rad" }, start: file, wanted: [wanted] };
  },
};
