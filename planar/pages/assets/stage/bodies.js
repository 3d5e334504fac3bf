"use strict";
/* What each link looks like in its own axes (m), as Python has it, and what of that depends on the motion: how far slides
   go, and the lengths of cylinders. Vectors are [x, y]. */

const Plane = {
  plus: (a, b) => [a[0] + b[0], a[1] + b[1]],
  minus: (a, b) => [a[0] - b[0], a[1] - b[1]],
  times: (a, by) => [a[0] * by, a[1] * by],
  on: (a, way, far) => [a[0] + way[0] * far, a[1] + way[1] * far],
  dot: (a, b) => a[0] * b[0] + a[1] * b[1],
  cross: (a, b) => a[0] * b[1] - a[1] * b[0],
  length: (a) => Math.hypot(a[0], a[1]),
  apart: (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]),
  unit: (a) => { const far = Math.hypot(a[0], a[1]); return far > 0 ? [a[0] / far, a[1] / far] : [1, 0]; },
  offLine: (p, through, way) => Math.abs(way[0] * (p[1] - through[1]) - way[1] * (p[0] - through[0])),
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

const Bodies = (() => {
  const { minus, times, dot, offLine, carry, local } = Plane;
  const NEAR = 1e-6;                  // of the size of the mechanism: a point lies on a line

  /** What the pairs say of how they are drawn, with the numbers that the dimensions have now. */
  function marks(page) {
    const told = (value) => {
      if (Array.isArray(value)) {
        return value.length === 2 && value.every((each) => typeof each === "number") ? value.map((at) => page.size(at)) : value.map(told);
      }
      if (value === null || typeof value !== "object") return value;
      if (!("kind" in value)) return page.size(value.at);
      return Object.fromEntries(Object.entries(value).map(([name, part]) => [name, told(part)]));
    };
    return page.data.marks.map(told);
  }

  /** The points of every link in its own axes: {link: [{name, at}]}. */
  function carried(page) {
    const found = Object.fromEntries(page.data.links.map((link) => [link, []]));
    for (const [name, { links, at }] of Object.entries(page.data.points)) {
      links.forEach((link, k) => found[link].push({ name, at: at[k].map((place) => page.size(place)) }));
    }
    return found;
  }

  /** What each link looks like: the numbers of Python's bodies for the dimensions that there are now. */
  function bodies(page) {
    const place = (at) => at.map((each) => page.size(each)), places = (list) => list.map(place);
    const found = Object.create(null); // a link may have any name
    for (const [link, { sides, plate, tracers, joints, dots, guides }] of Object.entries(page.data.bodies)) {
      found[link] = {
        sides: sides.map(places), plate: places(plate), tracers: tracers.map(places), joints: places(joints), dots: places(dots),
        guides: guides.map(({ name, foot, direction }) => ({ name, foot: place(foot), way: place(direction) })),
      };
    }
    return found;
  }

  /** The link whose point runs along the line of a mark, and the point in its axes: [link, at]. */
  function rider(mark, all) {
    if (mark.kind === "SlotMark") return [mark.pin_link, mark.pin_position];
    if (mark.kind === "PitchLineMark") return [mark.wheel.link, mark.wheel.centre];
    const block = all.find((each) => each.kind === "SliderMark" && each.name === mark.name);
    return block ? [block.link, block.position] : [mark.link, mark.through];
  }

  /** From where to where that point goes along the line, from a foot on it, in all of some positions (m). */
  function range(mark, all, poses, foot) {
    const [link, at] = rider(mark, all);
    let low = Infinity, high = -Infinity;
    for (const frames of poses) {
      const far = dot(minus(local(frames[mark.link], carry(frames[link], at)), foot), mark.direction);
      [low, high] = [Math.min(low, far), Math.max(high, far)];
    }
    return [low, high];
  }

  /** Slides that look like cylinders with piston and rod: driven ones between moving links, and those with a rod. */
  function tubes(page, look, all, poses, near, over) {
    const driven = page.data.inputs.map((given) => given.pair), found = Object.create(null);
    for (const mark of all) {
      if (mark.kind !== "SliderMark" || mark.link === page.data.frame || mark.guide_link === page.data.frame) continue;
      const guide = look[mark.guide_link], rod = look[mark.link];
      const line = guide.guides.find((each) => each.name === mark.name);
      const pinned = guide.joints.filter((p) => offLine(p, line.foot, line.way) <= near);
      const lying = [...rod.joints, ...rod.dots].filter((p) => offLine(p, mark.position, mark.direction) <= near);
      if (pinned.length !== 1 || guide.joints.length !== 1 || (!driven.includes(mark.name) && lying.length < 2)) continue;
      const [low, high] = range(all.find((each) => each.kind === "GuideMark" && each.name === mark.name), all, poses, line.foot);
      const sense = low + high < 0 ? -1 : 1;
      const [short, long] = [sense * low, sense * high].sort((a, b) => a - b), stroke = long - short;
      const along = lying.map((p) => sense * dot(minus(p, mark.position), mark.direction));
      const covers = guide.dots.map((p) => sense * dot(minus(p, line.foot), line.way));
      let rear = Math.min(...along), mouth = Math.min(Math.max(CYLINDER_RATIOS[0] * short, 1.15 * stroke), CYLINDER_RATIOS[1] * short);
      const front = Math.max(...along);
      if (rear === front) rear = (mouth - stroke) / 2 - short; // the piston as far from either end of its way
      else mouth = Math.max(long + rear + over, 0);
      found[mark.name] = {
        guide: mark.guide_link, rod: mark.link, foot: line.foot, way: times(line.way, sense),
        base: Math.min(0, ...covers), mouth: Math.max(mouth, ...covers),
        at: mark.position, along: times(mark.direction, sense), rear, front,
      };
    }
    return found;
  }

  /** All that is drawn of the links: {marks, points, near, look: {link: body}, size}. */
  function shapes(page) {
    const { size } = page.data;
    return { marks: marks(page), points: carried(page), near: NEAR * size, look: bodies(page), size };
  }

  return { shapes, range, rider, tubes };
})();
