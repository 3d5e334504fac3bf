"use strict";
/* What each moving link looks like in its own axes (m): the lines between its joints, its plate, its further points,
   its cylinders; as Python's planar.drawing.scheme.link_bodies and scene have it. Vectors are [x, y]. */

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
  const { minus, times, on, dot, cross, apart, unit, offLine, carry, local } = Plane;
  const NEAR = 1e-6;                  // of the size of the mechanism: points coincide, or lie on a line
  const REACH = 0.62, LONGEST = 0.95; // of a cylinder with its rod when shortest: how long the cylinder is drawn

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

  function distinct(points, near) {
    const kept = [];
    for (const point of points) if (kept.every((other) => apart(point, other) > near)) kept.push(point);
    return kept;
  }

  /** The two ends of points on one line, the first given first. */
  function ends(points) {
    if (points.length < 2) return null;
    const far = cheapest(points, (p) => -apart(p, points[0]));
    return [cheapest(points, (p) => -apart(p, far)), far];
  }

  /** The corners of the convex hull, anticlockwise (Andrew's monotone chain); none where all lie on one line. */
  function hull(points, near) {
    const line = ends(points);
    if (line === null) return [];
    const way = unit(minus(line[1], line[0]));
    if (Math.max(...points.map((p) => offLine(p, line[0], way))) <= near) return [];
    const ordered = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
    const half = (row) => {
      const kept = [];
      for (const p of row) {
        const bends = () => {
          const [a, b] = kept.slice(-2);
          return cross(minus(b, a), minus(p, a)) <= near * apart(a, p);
        };
        while (kept.length > 1 && bends()) kept.pop();
        kept.push(p);
      }
      return kept.slice(0, -1);
    };
    return [...half(ordered), ...half(ordered.reverse())];
  }

  const around = (plate) => plate.map((corner, k) => [corner, plate[(k + 1) % plate.length]]);
  const inside = (p, plate, near) => around(plate).every(([a, b]) => cross(minus(b, a), minus(p, a)) >= -near * apart(a, b));

  /** Lines to a point from the ends of the edge of a plate that is nearest to it. */
  function fromEdge(p, plate) {
    const edge = cheapest(around(plate), ([a, b]) => apart(a, p) + apart(b, p));
    return edge.map((corner) => [corner, p]);
  }

  /** Where other links meet a link in a point. */
  function joints(link, all) {
    const found = [];
    for (const mark of all) {
      if (mark.kind === "Pin") mark.links.forEach((each, k) => { if (each === link) found.push(mark.at[k]); });
      else if ((mark.kind === "Block" && mark.link === link) || (mark.kind === "Opening" && mark.pin === link)) found.push(mark.at);
      else if (mark.kind === "Wheel" && mark.link === link) found.push(mark.centre);
    }
    return found;
  }

  /** The lines of a link, each with the joint on it, else the foot of the perpendicular from the nearest joint. */
  function guides(link, all, met, near) {
    const lines = all.filter((mark) => ["Guide", "Opening", "PitchLine"].includes(mark.kind) && mark.link === link);
    return lines.map((mark) => {
      const { through, way } = mark;
      const over = met.filter((p) => offLine(p, through, way) <= near);
      if (over.length) return { name: mark.name, foot: cheapest(over, (p) => Math.abs(dot(minus(p, through), way))), way };
      if (met.length) {
        const nearest = cheapest(met, (p) => offLine(p, through, way));
        return { name: mark.name, foot: on(through, way, dot(minus(nearest, through), way)), way };
      }
      const other = lines.find((each) => each !== mark && Math.abs(cross(way, each.way)) > NEAR);
      const far = other ? cross(minus(other.through, through), other.way) / cross(way, other.way) : 0;
      return { name: mark.name, foot: on(through, way, far), way };
    });
  }

  function body(link, points, all, near) {
    const met = distinct(joints(link, all), near);
    let pinned = met, others = distinct([...met, ...points], near).slice(met.length);
    const lines = guides(link, all, met, near);
    const feet = [];
    for (const { foot } of lines) {
      const nearest = cheapest(met, (p) => apart(p, foot));
      if (nearest && apart(nearest, foot) > near) feet.push([nearest, foot]);
    }
    if (!met.length && !lines.length) [pinned, others] = [others.slice(0, 1), others.slice(1)];
    const dots = [...others];
    let base = pinned;
    if (pinned.length <= 1 && others.length) base = [...pinned, others.shift()];
    if (lines.length && pinned.length < 2) { // the guide is its body; points on it lengthen it
      const over = dots.filter((p) => lines.some((line) => offLine(p, line.foot, line.way) <= near));
      base = [...pinned, ...over];
      others = dots.filter((p) => !over.includes(p));
    }
    const made = { link, sides: feet, plate: [], tracers: [], joints: pinned, dots, guides: lines };
    const plate = hull(base, near);
    if (plate.length) {
      const tracers = others.filter((p) => !inside(p, plate, near)).flatMap((p) => fromEdge(p, plate));
      return { ...made, sides: [...around(plate), ...feet], plate, tracers };
    }
    let line = ends(base);
    if (line === null) return { ...made, tracers: pinned.length ? others.map((p) => [pinned[0], p]) : [] };
    const way = unit(minus(line[1], line[0])), start = line[0];
    const over = others.filter((p) => offLine(p, start, way) <= near);
    line = ends([...line, ...over]) || line;
    const held = pinned.length > 1 ? line : pinned.length ? pinned : line.slice(0, 1); // about one joint: a star
    const tracers = others.filter((p) => !over.includes(p)).flatMap((p) => held.map((end) => [end, p]));
    return { ...made, sides: [line, ...feet], tracers };
  }

  /** The greatest distance (m) that two points of one link span in x or y; 1 where no link has two points. */
  function size(points) {
    let most = 0;
    for (const each of Object.values(points)) {
      for (const axis of [0, 1]) {
        const values = each.map((point) => point.at[axis]);
        if (values.length) most = Math.max(most, Math.max(...values) - Math.min(...values));
      }
    }
    return most || 1;
  }

  /** The link whose point runs along the line of a mark, and the point in its axes: [link, at]. */
  function rider(mark, all) {
    if (mark.kind === "Opening") return [mark.pin, mark.at];
    if (mark.kind === "PitchLine") return [mark.wheel.link, mark.wheel.centre];
    const block = all.find((each) => each.kind === "Block" && each.name === mark.name);
    return block ? [block.link, block.at] : [mark.link, mark.through];
  }

  /** From where to where that point goes along the line, from a foot on it, in all of some positions (m). */
  function range(mark, all, poses, foot) {
    const [link, at] = rider(mark, all);
    let low = Infinity, high = -Infinity;
    for (const frames of poses) {
      const far = dot(minus(local(frames[mark.link], carry(frames[link], at)), foot), mark.way);
      [low, high] = [Math.min(low, far), Math.max(high, far)];
    }
    return [low, high];
  }

  /** Slides that look like cylinders with piston and rod: driven ones between moving links, and those with a rod. */
  function tubes(page, look, all, poses, near, over) {
    const driven = page.data.inputs.map((given) => given.pair), found = Object.create(null);
    for (const mark of all) {
      if (mark.kind !== "Block" || mark.link === page.data.frame || mark.on === page.data.frame) continue;
      const guide = look[mark.on], rod = look[mark.link];
      const line = guide.guides.find((each) => each.name === mark.name);
      const pinned = guide.joints.filter((p) => offLine(p, line.foot, line.way) <= near);
      const lying = [...rod.joints, ...rod.dots].filter((p) => offLine(p, mark.at, mark.way) <= near);
      if (pinned.length !== 1 || guide.joints.length !== 1 || (!driven.includes(mark.name) && lying.length < 2)) continue;
      const [low, high] = range(all.find((each) => each.kind === "Guide" && each.name === mark.name), all, poses, line.foot);
      const sense = low + high < 0 ? -1 : 1;
      const [short, long] = [sense * low, sense * high].sort((a, b) => a - b), stroke = long - short;
      const along = lying.map((p) => sense * dot(minus(p, mark.at), mark.way));
      const covers = guide.dots.map((p) => sense * dot(minus(p, line.foot), line.way));
      let rear = Math.min(...along), mouth = Math.min(Math.max(REACH * short, 1.15 * stroke), LONGEST * short);
      const front = Math.max(...along);
      if (rear === front) rear = (mouth - stroke) / 2 - short; // the piston as far from either end of its way
      else mouth = Math.max(long + rear + over, 0);
      found[mark.name] = {
        guide: mark.on, rod: mark.link, foot: line.foot, way: times(line.way, sense),
        base: Math.min(0, ...covers), mouth: Math.max(mouth, ...covers),
        at: mark.at, along: times(mark.way, sense), rear, front,
      };
    }
    return found;
  }

  /** All that is drawn of the links: {marks, points, near, look: {link: body}, size}. */
  function shapes(page) {
    const all = marks(page), points = carried(page), whole = size(points), near = NEAR * whole;
    const look = Object.create(null); // a link may have any name
    for (const link of page.data.links) look[link] = body(link, points[link].map((point) => point.at), all, near);
    return { marks: all, points, near, look, size: whole };
  }

  return { shapes, range, rider, tubes };
})();
