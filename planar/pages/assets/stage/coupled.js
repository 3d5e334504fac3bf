"use strict";
/* The numbers of wheels, racks and cams after pins have moved. `before` and `after` are the file's places (`Placed`). */

const Coupled = {
  /** What rolls on one another meets as it did, of the size that its places give. */
  follow(pair, before, after) {
    if (pair.gear !== undefined || pair.belt !== undefined || pair.chain !== undefined) Coupled.meshed(pair, before, after);
    else if (pair.sliding !== undefined && pair.links) Coupled.turned(pair, before, after);
    else if (pair.rack !== undefined) Coupled.rolled(pair, before, after);
    else if (pair.cam !== undefined && pair.base_radius !== undefined) Coupled.followed(pair, before, after);
  },

  /** What slides as a whole keeps its angle to the line, as it is drawn. */
  turned(pair, before, after) {
    const { units } = before, [way, now] = [before, after].map((each) => each.line(pair)?.way), angle = ([x, y]) => Math.atan2(y, x);
    const [was, is] = [before, after].map((each) => each.direction(pair.links[1]));
    if (!way || !now || was === null || is === null) return;
    const by = Symbols.wrapped(is - was - angle(now) + angle(way));
    if (Math.abs(by) > 1e-12) Written.put(pair, "turn", (Written.read(pair.turn ?? 0, "angle", units) ?? 0) + by, "angle", units);
  },

  /** Wheels meet as they did, each turned with its link; their radii follow the distance of their centres. */
  meshed(pair, before, after) {
    const { units, file } = before, carrier = pair.carrier ?? file.frame, gone = (link) => (after.direction(link) ?? 0) - (before.direction(link) ?? 0);
    const turned = pair.links.map((link) => [link, Symbols.wrapped(gone(link) - gone(carrier))]);
    const apart = [before, after].map((each) => Coupled.centres(pair, carrier, each));
    if (pair.gear !== undefined && pair.radii && apart[0] && Math.abs(apart[1] / apart[0] - 1) > SAME_NUMBER) {
      pair.radii.forEach((each, k) => Written.put(pair.radii, k, (Written.read(each, "length", units) * apart[1]) / apart[0], "length", units));
    }
    if (turned.every(([, by]) => Math.abs(by) < 1e-12)) return;
    pair.mesh ??= Object.fromEntries(pair.links.map((link) => [link, 0]));
    for (const [link, by] of turned) Written.put(pair.mesh, link, (Written.read(pair.mesh[link] ?? 0, "angle", units) ?? 0) + by, "angle", units);
  },

  /** How far the pins are apart about which two wheels turn on their carrier; null where they are pinned to it nowhere. */
  centres(pair, carrier, { pins, at }) {
    const found = pair.links.map((link) => [...pins].find(([, members]) => [link, carrier].every((one) => members.some(([each]) => each === one)))?.[0]);
    const [p, q] = found.map((pin) => at.get(pin));
    return p && q ? Plane.apart(p, q) : null;
  },

  /** Where a pinion stands on its rack: how far along its line and to the left of it, and the angle between both; null: not seen. */
  rolling(pair, placed) {
    const line = placed.line(pair), at = placed.place(pair.links[1], pair.point), [a, b] = pair.links.map((link) => placed.direction(link));
    if (!line || !at || a === null || b === null) return null;
    const off = Plane.minus(at, line.start), { way } = line;
    return { along: Plane.dot(off, way), left: way[0] * off[1] - way[1] * off[0], angle: Symbols.wrapped(b - a) };
  },

  /** A pinion has rolled as far as it had; its radius is how far its centre is from the line. */
  rolled(pair, placed, after) {
    const { units } = placed, [before, now] = [placed, after].map((each) => Coupled.rolling(pair, each)), read = (value, kind) => Written.read(value ?? 0, kind, units) ?? 0;
    if (!before || !now || ["along", "left", "angle"].every((key) => Math.abs(before[key] - now[key]) < 1e-12)) return;
    const turned = (before.along - read(pair.mesh?.displacement, "length")) / read(pair.radius, "length");
    pair.mesh ??= { displacement: 0, angle: 0 };
    Written.put(pair.mesh, "angle", read(pair.mesh.angle, "angle") + Symbols.wrapped(now.angle - before.angle), "angle", units);
    Written.put(pair, "radius", now.left, "length", units);
    Written.put(pair.mesh, "displacement", now.along - turned * now.left, "length", units);
  },

  /** A cam lifts its follower as it did: its base circle follows from where the follower would rest. */
  followed(pair, placed, after) {
    const { units } = placed, base = Written.read(pair.base_radius, "length", units), roller = Written.read(pair.roller_radius ?? 0, "length", units);
    const carrier = pair.carrier ?? placed.file.frame, [before, now] = [placed, after].map((each) => {
      const [O, P, R] = [each.place(pair.links[0], pair.centre), each.place(pair.links[1], pair.point), pair.pivot && each.place(carrier, pair.pivot)];
      const line = pair.line && each.line(pair);
      return O && P && (R || line) ? { O, P, R, line } : null;
    });
    if (!before || !now || pair.flat !== undefined || ["O", "P", "R"].every((key) => !before[key] || Plane.apart(before[key], now[key]) < 1e-12)) return;
    const rest = pair.pivot ? restingArm(before, now, base + roller, pair.side === "right" ? -1 : 1) : restingSlide(before, now, base + roller);
    if (rest - roller > 0) Written.put(pair, "base_radius", rest - roller, "length", units);
  },
};

/** How far from a cam a sliding follower now rests, which rested so far from it, and is lifted as it was. */
function restingSlide({ O, P, line }, now, far) {
  // the line lies aside of the cam's centre, and the follower is lifted along it
  const split = ({ O: o, P: p, line: { start, way } }) => { const to = Plane.minus(o, start); return [Plane.dot(Plane.minus(p, o), way), way[0] * to[1] - way[1] * to[0]]; };
  const [along, aside] = split({ O, P, line }), [along2, aside2] = split(now), lift = along - Math.sqrt(Math.max(0, far * far - aside * aside));
  return Math.hypot(along2 - lift, aside2);
}

/** The same of one that swings about R; `side` 1: it lies to the left of the way from there to the cam. */
function restingArm({ O, P, R }, now, far, side) {
  const angle = (from, to) => Math.atan2(to[1] - from[1], to[0] - from[0]), between = (one) => side * Symbols.wrapped(angle(one.R, one.P) - angle(one.R, one.O));
  const triangle = (a, b, c) => Math.acos(Math.max(-1, Math.min(1, (a * a + b * b - c * c) / (2 * a * b))));
  const lift = between({ O, P, R }) - triangle(Plane.apart(R, O), Plane.apart(R, P), far), open = between(now) - lift, [a, b] = [Plane.apart(now.R, now.O), Plane.apart(now.R, now.P)];
  return Math.sqrt(Math.max(0, a * a + b * b - 2 * a * b * Math.cos(open)));
}
