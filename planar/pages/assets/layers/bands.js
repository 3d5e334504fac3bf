"use strict";
/* The layer of what tolerances do: round the path of each point chosen where it may be, in the worst case and within three
   standard deviations, by derivatives in the dimensions. */

const BAND_DIRECTIONS = 32;  // corners of the area in which a point may be
const BAND_EVERY = 3;        // rows of the motion
const BAND_WIDTH = 5;        // mm on the screen that the greatest deviation of a band has at least
const SIGMAS = 3;            // standard deviations from the middle to each end of a tolerance

/** The corners of a convex area round points, anticlockwise (A. M. Andrew, Information Processing Letters 9, 1979). */
function convexHull(points) {
  const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const chain = (list) => {
    const found = [];
    for (const p of list) {
      while (found.length > 1) {
        const [a, b] = found.slice(-2);
        if ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) > 0) break;
        found.pop();
      }
      found.push(p);
    }
    found.pop();
    return found;
  };
  return [...chain(sorted), ...chain(sorted.reverse())];
}

/** Where a point may be off by slopes in the dimensions: corners [x, y] (m) of the worst case and of three standard
    deviations, and the greatest deviation. */
function deviations(slopes, tolerances) {
  const worst = [], likely = [];
  let middle = [0, 0], xx = 0, xy = 0, yy = 0, most = 0;
  slopes.forEach(([x, y], k) => {
    const [low, high] = tolerances[k], centre = (low + high) / 2, deviation = (high - low) / 2 / SIGMAS;
    middle = [middle[0] + centre * x, middle[1] + centre * y];
    xx += (deviation * x) ** 2;
    xy += deviation ** 2 * x * y;
    yy += (deviation * y) ** 2;
  });
  for (let j = 0; j < BAND_DIRECTIONS; j++) {
    const angle = (2 * Math.PI * j) / BAND_DIRECTIONS, n = [Math.cos(angle), Math.sin(angle)], corner = [0, 0];
    slopes.forEach(([x, y], k) => {
      const end = tolerances[k][x * n[0] + y * n[1] > 0 ? 1 : 0];
      corner[0] += end * x;
      corner[1] += end * y;
    });
    most = Math.max(most, Math.hypot(...corner));
    worst.push(corner);
    const along = [xx * n[0] + xy * n[1], xy * n[0] + yy * n[1]], height = Math.sqrt(Math.max(along[0] * n[0] + along[1] * n[1], 0));
    const out = height > 0 ? SIGMAS / height : 0;
    likely.push([middle[0] + out * along[0], middle[1] + out * along[1]]);
  }
  return { worst, likely, most };
}

const bands = {
  key: "bands",
  still: true,
  under: true,
  label: "Tolerance bands",
  draw(ink, layers) {
    const { page } = layers, { course, tolerances, linkage } = page, names = page.chosen.points();
    if (!tolerances.some(([low, high]) => low || high)) return "Tolerance bands: say below the dimensions by how much they may be off";
    if (!names.length) return "Tolerance bands: choose points to see them";
    if (course === null) return "Tolerance bands: the motion is being solved";
    const slopes = new DesignSlopes(page), rows = [];
    for (let i = 0; i < course.count; i += BAND_EVERY) {
      const row = course.rows[i], u = linkage.u.map((each, k) => (k === course.input ? row.at / linkage.scale[k] : each));
      const sides = slopes.sides(row.z, u);
      rows.push(names.map((name) => {
        const own = DesignSlopes.ofPoint(page, sides, name);
        return { at: page.place(page.data.points[name].links[0], page.data.points[name].at[0], row.frames), ...deviations(own.map((each) => each ?? [0, 0]), tolerances), known: own.some((each) => each !== null) };
      }));
    }
    const most = names.map((_, p) => Math.max(0, ...rows.filter((row) => row[p].known).map((row) => row[p].most)));
    const greatest = Math.max(...most), perMm = greatest * Math.abs(layers.at([1, 0])[0] - layers.at([0, 0])[0]) / ink.mm;
    if (!(greatest > 1e-12 * page.data.size)) return "Tolerance bands: no tolerance moves these points";
    const factor = perMm >= BAND_WIDTH ? 1 : roundUp(BAND_WIDTH / perMm, SCALE_VALUES);
    for (const kind of ["worst", "likely"]) names.forEach((_, p) => this.area(ink, layers, rows.map((row) => row[p]), kind, factor));
    const [by, unit] = unitOf(page, "length"), amount = (value) => `${short(Number((value * by).toPrecision(3)))} ${unit}`;
    const each = names.map((name, p) => `${name} ${amount(most[p])}`).join(", ");
    const times = factor === 1 ? "" : `, drawn ${short(factor)} times as wide`;
    const without = page.data.other_tolerances.length ? `; without those of ${page.data.other_tolerances.join(", ")}` : "";
    return `Tolerance bands: worst case (light: at most ${each}) and three standard deviations (dark)${times}${without}`;
  },

  /** One area of a point over the motion: hulls of neighbours, all the same way round, in one stroke. */
  area(ink, layers, rows, kind, factor) {
    let d = "";
    for (let i = 0; i + 1 < rows.length; i++) {
      if (!rows[i].known || !rows[i + 1].known) continue;
      const both = [rows[i], rows[i + 1]].flatMap(({ at, [kind]: corners }) => corners.map(([x, y]) => layers.at([at[0] + factor * x, at[1] + factor * y])));
      d += `${convexHull(both).map(([x, y], k) => `${k ? "L" : "M"}${x.toFixed(2)} ${y.toFixed(2)}`).join("")}Z`;
    }
    svgPart("path", { d, class: `band ${kind}` }, ink.group);
  },
};
