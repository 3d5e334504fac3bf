"use strict";
/* The centrodes of two links over the motion: the paths of their instantaneous centre in each. The moving one is
   carried along with its link and rolls on the fixed one. */

const centrodes = {
  key: "centrodes",
  label: "Centrodes",
  beside(layers, part) {
    const { page } = layers, { data } = page, links = data.centres.links.map(({ link, label }) => [link, label]);
    htmlPart("h2", {}, part, "Centrodes");
    const [link, other] = ["Of link", "against"].map((label) => chooser(part, label, links));
    if (data.rolling !== null) [link.value, other.value] = data.rolling;
    for (const each of [link, other]) each.addEventListener("change", () => layers.draw());
    this.state = { link, other };
    return { draw: () => "" };
  },
  draw(ink, layers) {
    const { page } = layers, link = this.state.link.value, other = this.state.other.value, { course } = page;
    if (link === other) return "centrodes are of two links";
    if (course === null) return "the motion is being solved";
    const found = course.keep(`centrodes ${JSON.stringify([link, other])}`, () => polePaths(page, course, link, other));
    if (found.reason) return found.reason;
    for (const [kind, where, arcs] of [["fixed", other, found.fixed], ["moving", link, found.moving]]) {
      const f = page.frames[where];
      for (const arc of arcs) {
        const places = arc.map(([x, y]) => layers.at([f.x + f.cos * x - f.sin * y, f.y + f.sin * x + f.cos * y]));
        if (places.length > 1) ink.line(places, `centrode ${kind}`);
        else ink.dot(places[0], DOT_RADIUS, `centrode ${kind}`);
      }
    }
    const motions = motionsOf(standardFrames(page), page.data);
    const pole = motions && poleOf(motions[other], motions[link], page.data.size, 0);
    if (pole && pole[2] !== 0) ink.dot(layers.at([pole[0] / pole[2], pole[1] / pole[2]]), CENTRE_RADII.shown, "centre shown");
    return `full: fixed to ${other}; dashed: moving with ${link}, rolling on it`;
  },
};

/** The pole in the axes of both links over the motion, in arcs that end where it passes through infinity. */
function polePaths(page, course, link, other) {
  const { data } = page, size = data.size, fixed = [], moving = [];
  let open = false, before = null, beforeSign = 0, turns = 0, known = 0;
  const local = (f, [x, y]) => [f.cos * (x - f.x) + f.sin * (y - f.y), f.cos * (y - f.y) - f.sin * (x - f.x)];
  for (const { alone: frames } of course.rows) {
    const motions = motionsOf(frames, data);
    const pole = motions && poleOf(motions[other], motions[link], size, greatestOf(motions, size));
    if (motions !== null) known++;
    if (!pole || pole[2] === 0) { open = false; before = null; continue; }
    turns++;
    const at = [pole[0] / pole[2], pole[1] / pole[2]], here = local(frames[other], at), own = local(frames[link], at);
    const sign = Math.sign(pole[2]), far = Math.hypot(...here) > CENTRODE.farthest * size;
    const leapt = before !== null && sign !== beforeSign && Math.hypot(here[0] - before[0], here[1] - before[1]) > CENTRODE.leap * size;
    if (far || leapt) open = false;
    [before, beforeSign] = [here, sign];
    if (far) continue;
    if (!open) { fixed.push([]); moving.push([]); open = true; }
    fixed[fixed.length - 1].push(here);
    moving[moving.length - 1].push(own);
  }
  const span = (arcs) => {
    const all = arcs.flat(), xs = all.map(([x]) => x), ys = all.map(([, y]) => y);
    const [x0, y0, x1, y1] = boxOf(xs, ys);
    return Math.hypot(x1 - x0, y1 - y0);
  };
  if (!turns) return { reason: known ? `${link} and ${other} only slide on each other, or move as one` : "the motion is not determined" };
  if (!fixed.length) return { reason: "their pole is far outside the picture all the way" };
  if (span(fixed) < CENTRODE.still * size) return { reason: `${link} and ${other} turn about one point` };
  return { fixed, moving, reason: "" };
}
