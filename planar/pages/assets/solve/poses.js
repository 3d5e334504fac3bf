"use strict";
/* Positions over the range of every input, a few: for these a drawing leaves room. */

const POSES = 24; // over the range of an input
const SLIDE_SEARCH = 3; // times its size: how far the limits of a slide are looked for
const FREE = 0.3; // of the mechanism's size: how far a slide without limits is shown
const AHEAD = { parts: 4, turn: Math.PI / 2 }; // of a way on from where it is

/** Go through the motion of every input, the others where they are: {poses: the links' axes, spans: of every input from
    where to where it went, {low, high, whole, dead, names}}. */
function motions(page) {
  const { data, linkage } = page, poses = [page.frames];
  const spans = data.inputs.map((given, k) => {
    const far = given.slides ? 1 : 2 * Math.PI, scale = linkage.scale[k], steps = given.slides ? SLIDE_SEARCH * POSES : POSES;
    const span = { low: 0, high: 2 * Math.PI, whole: true, dead: [false, false], names: [page.endName, page.endName] };
    for (const sign of [1, -1]) {
      const made = linkage.copy(), side = sign > 0 ? 1 : 0, seen = [];
      let end = made.u[k];
      for (let i = 1; i <= steps && !span.dead[side]; i++) {
        const u = Array.from(linkage.u);
        u[k] += (sign * far * i) / POSES;
        span.dead[side] = made.moveTo(u).reached < 1;
        if (made.met.length) span.names[side] = "stop";
        seen.push(page.framesOf(made.state()));
        if (i <= POSES || span.dead[side]) end = made.u[k];
      }
      if (!given.slides && !span.dead[side]) return poses.push(...seen), span; // a whole turn: nothing is left for the other way
      // room for a slide without limits is made as it goes
      poses.push(...(span.dead[side] ? seen : seen.slice(0, FREE * POSES)));
      span.whole = false;
      span[sign > 0 ? "high" : "low"] = end * scale;
    }
    return span;
  });
  return { poses, spans };
}

/** The pose of a page, and those a little farther every way that its inputs go. */
function motionsAhead(page) {
  const { data, linkage } = page, poses = [page.frames];
  data.inputs.forEach(({ slides }, k) => {
    for (const way of [1, -1]) {
      const made = linkage.copy();
      for (let part = 1; part <= AHEAD.parts; part++) {
        const u = Array.from(linkage.u);
        u[k] += (way * part * (slides ? FREE : AHEAD.turn)) / AHEAD.parts;
        const { reached } = made.moveTo(u);
        poses.push(page.framesOf(made.state()));
        if (reached < 1) break;
      }
    }
  });
  return poses;
}
