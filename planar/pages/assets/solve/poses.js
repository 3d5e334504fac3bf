"use strict";
/* Positions over the range of every input, a few: for these a drawing leaves room. */

const POSES = 24; // over the range of an input
const FREE = 0.3; // of the mechanism's size: how far a slide without limits is shown

/** Go through the motion of every input, the others where they are: {poses: the links' axes, spans: of every input from
    where to where it went, {low, high, whole, dead}}. */
function motions(page) {
  const { data, linkage } = page, poses = [page.frames];
  const spans = data.inputs.map((given, k) => {
    const far = given.slides ? 1 : 2 * Math.PI, scale = linkage.scale[k];
    const span = { low: 0, high: 2 * Math.PI, whole: true, dead: [false, false] };
    let made;
    for (const sign of [1, -1]) {
      made = linkage.copy();
      for (let i = 1; i <= POSES; i++) {
        const u = Array.from(linkage.u);
        u[k] += (sign * far * i) / POSES;
        const { reached } = made.moveTo(u);
        // room for a slide without limits is made as it goes
        if (!given.slides || i <= FREE * POSES || reached < 1) poses.push(page.framesOf(made.state()));
        if (reached < 1) {
          span.dead[sign > 0 ? 1 : 0] = true;
          break;
        }
        if (i === POSES && !given.slides) return span; // a whole turn: nothing is left for the other way
      }
      span.whole = false;
      span[sign > 0 ? "high" : "low"] = made.u[k] * scale;
    }
    return span;
  });
  return { poses, spans };
}
