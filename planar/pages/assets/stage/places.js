"use strict";
/* The numbers of a mechanism's file, as they follow from where its pins lie. Places are in the world (m), by the names that
   results have; a file is a JSON value as its author wrote it, with `units` {length, angle} in m and rad. */

const SAME_NUMBER = 1e-11; // of the greatest: a number that is as near stays as it is written
const FILE_FIGURES = 12;   // of a number that is written
const ON_LINE = 1e-9;      // of a distance: a point as near to a line lies on it
const KNOWN_UNITS = {
  length: { m: 1, mm: 1e-3, cm: 1e-2, dm: 0.1, um: 1e-6, in: 0.0254, ft: 0.3048 },
  angle: { deg: Math.PI / 180, "°": Math.PI / 180, rad: 1 },
};

/** Numbers as files have them: bare ones in the file's unit, or texts with a unit of their own. */
const Written = {
  /** In SI; null where it is neither. */
  read(number, kind, units) {
    if (typeof number === "number") return number * units[kind];
    const [, value, unit] = /^\s*([-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*(\S*)\s*$/.exec(String(number)) ?? [];
    const by = unit === "" ? units[kind] : KNOWN_UNITS[kind][unit];
    return value === undefined || by === undefined ? null : Number(value) * by;
  },

  /** A value as a number of the file, in the unit that stood there. */
  write(value, kind, units, before) {
    const [, unit] = typeof before === "string" ? /[\d.\s]([^\d.\s]+)\s*$/.exec(before) ?? [] : [], own = KNOWN_UNITS[kind][unit];
    const number = Number((value / (own ?? units[kind])).toPrecision(FILE_FIGURES)) || 0;
    return own === undefined ? number : `${number} ${unit}`;
  },

  /** Put a value into a holder, unless what stands there is the same. */
  put(holder, key, value, kind, units) {
    const before = Written.read(holder[key] ?? null, kind, units);
    if (before !== null && Math.abs(before - value) <= SAME_NUMBER * Math.max(Math.abs(value), kind === "length" ? 1e-3 : 1)) return;
    holder[key] = Written.write(value, kind, units, holder[key]);
  },
};

const LETTERS = "ABCDEFGHIJKLMNPQRSTUVWXYZ";
const PAIR_KINDS = ["turning", "sliding", "slot", "gear", "rack", "belt", "chain", "cam", "geneva"];

/** Who carries the pins of a file. */
const Pins = {
  /** The name of a pair, which stands at its kind. */
  pairName(pair) { return pair[PAIR_KINDS.find((kind) => pair[kind] !== undefined)]; },

  /** The names of a link's points. */
  ofLink(link) { return [...new Set([...(link.ends ?? []), ...Object.keys(link.points ?? {})])]; },

  /** The links that carry a point of a name. */
  carriers(file, point) { return Object.keys(file.links).filter((link) => Pins.ofLink(file.links[link]).includes(point)); },

  /** Every pin: name → [[link, point], ...]. What pairs keep together stands once, by the pair's name. */
  all(file) {
    const together = new Map(), key = (link, point) => `${link}.${point}`;
    for (const pair of file.pairs ?? []) {
      if (pair.block !== undefined) for (const link of Pins.carriers(file, pair.block)) together.set(key(link, pair.block), pair.block);
      if (pair.turning === undefined) continue;
      const links = pair.links ?? Pins.carriers(file, pair.turning);
      links.forEach((link, k) => together.set(key(link, pair.points?.[k] ?? pair.turning), pair.turning));
    }
    const every = Object.entries(file.links).flatMap(([link, each]) => Pins.ofLink(each).map((point) => [link, point]));
    const names = new Set(together.values()), count = new Map();
    for (const [link, point] of every) if (!together.has(key(link, point))) count.set(point, (count.get(point) ?? 0) + 1);
    const found = new Map();
    for (const [link, point] of every) {
      const own = count.get(point) === 1 && !names.has(point) ? point : key(link, point), name = together.get(key(link, point)) ?? own;
      if (!found.has(name)) found.set(name, []);
      found.get(name).push([link, point]);
    }
    return found;
  },

  /** A name that no point, link or pair has yet; `more` are taken, too. */
  fresh(file, more = []) {
    const taken = new Set([...Pins.all(file).keys(), ...Object.values(file.links).flatMap(Pins.ofLink), ...Object.keys(file.links), ...more]);
    for (let round = 0; ; round++) for (const letter of LETTERS) if (!taken.has(`${letter}${round || ""}`)) return `${letter}${round || ""}`;
  },

  /** The pin of a point of a link. */
  of(pins, link, point) {
    for (const [name, members] of pins) if (members.some((each) => each[0] === link && each[1] === point)) return name;
    return null;
  },
};

/** A file with the places of its pins: where its links' axes lie, and all its numbers after a pin has moved. */
class Placed {
  constructor(file, at, units) {
    Object.assign(this, { file, at, units, pins: Pins.all(file) });
  }

  place(link, point) { return this.at.get(Pins.of(this.pins, link, point)); }
  local([x, y]) { return [x, y].map((each) => Written.read(each, "length", this.units)); }

  /** The axes of a link in which its file has coordinates, {x, y, angle, cos, sin}; null where nothing tells. */
  axes(name) {
    const { file } = this, link = file.links[name];
    const made = (x, y, angle) => ({ x, y, angle, cos: Math.cos(angle), sin: Math.sin(angle) });
    if (name === file.frame) return made(0, 0, 0);
    if (link.ends) {
      const [a, b] = link.ends.map((point) => this.place(name, point));
      return a && b ? made(...a, Math.atan2(b[1] - a[1], b[0] - a[0])) : null;
    }
    const known = Object.entries(link.points ?? {}).filter(([point, where]) => Array.isArray(where) && this.place(name, point));
    if (known.length < 2) return null;
    // turned so that two points, far from one another, lie as they do
    const spots = known.map(([point, where]) => [this.local(where), this.place(name, point)]), [p, P] = spots[0];
    const [q, Q] = cheapest(spots.slice(1), ([each]) => -Plane.apart(each, p));
    const angle = Math.atan2(Q[1] - P[1], Q[0] - P[0]) - Math.atan2(q[1] - p[1], q[0] - p[0]), c = Math.cos(angle), s = Math.sin(angle);
    return made(P[0] - c * p[0] + s * p[1], P[1] - s * p[0] - c * p[1], angle);
  }

  /** The direction of a link's own x-axis, by which inputs count; null where it has none that can be seen. */
  direction(name) {
    const { file } = this, link = file.links[name], ends = link?.ends ?? link?.axis;
    if (name === file.frame) return 0;
    if (!ends) return this.axes(name)?.angle ?? null;
    const [a, b] = ends.map((point) => this.place(name, point));
    return a && b ? Math.atan2(b[1] - a[1], b[0] - a[0]) : null;
  }

  /** The link in which the line of a pair lies. */
  static guide(file, pair) { return pair.cam !== undefined ? pair.carrier ?? file.frame : pair.on ?? pair.links?.[0]; }

  /** Whether a point of one link stays on a line of another. */
  static slides(pair) { return pair.sliding !== undefined || pair.slot !== undefined; }

  /** The line of a pair: {start, way} in the world; null where it cannot be seen. */
  line(pair) {
    const on = Placed.guide(this.file, pair), axes = this.axes(on), { through, to, angle } = pair.line ?? {};
    const spot = (where) => (Array.isArray(where) ? axes && Plane.carry(axes, this.local(where)) : this.place(on, where));
    const start = through === undefined ? null : spot(through), end = to === undefined ? null : spot(to);
    if (!start || (to !== undefined && !end) || (to === undefined && !axes)) return null;
    if (end) return { on, axes, start, way: Plane.unit(Plane.minus(end, start)) };
    const turned = axes.angle + (Written.read(angle ?? 0, "angle", this.units) ?? 0);
    return { on, axes, start, way: [Math.cos(turned), Math.sin(turned)] };
  }

  /** The place of what slides in a pair. */
  slider(pair) { return pair.block !== undefined ? this.at.get(pair.block) : this.place(pair.links?.[1], pair.point); }

  /** How far the relative motion of a pair has gone, but for a constant; null where it cannot be seen. */
  motion(name) {
    const [entry, two] = name.split(":"), pair = this.file.pairs.find((each) => [each.turning, each.sliding, each.slot].includes(entry));
    if (pair && Placed.slides(pair)) {
      const line = this.line(pair), at = line && this.slider(pair);
      return at ? Plane.dot(Plane.minus(at, line.start), line.way) : null;
    }
    if (pair === undefined) return null;
    const members = two?.split(",") ?? pair.links ?? Pins.carriers(this.file, entry); // against the frame, whichever is written first
    const [first, second] = members.slice().sort((a, b) => Number(b === this.file.frame) - Number(a === this.file.frame)).map((link) => this.direction(link));
    return first === null || second === null || first === undefined || second === undefined ? null : second - first;
  }

  /** Where a pin may go that is led to a place: on its line, where points lead that. */
  allowed(pin, to) {
    for (const pair of this.file.pairs) {
      if (!Placed.slides(pair) || Array.isArray(pair.line?.through) || this.sliderPin(pair) !== pin) continue;
      const line = this.line(pair);
      if (line) return Plane.on(line.start, line.way, Plane.dot(Plane.minus(to, line.start), line.way));
    }
    return to;
  }

  sliderPin(pair) { return pair.block ?? Pins.of(this.pins, pair.links?.[1], pair.point); }

  /** The file and places with a pin elsewhere, all others where they are, but for what slides on a line that moves with
      the pin; `inputs` are the positions that there are. */
  moved(pin, to, inputs) {
    const at = new Map(this.at).set(pin, this.allowed(pin, to));
    for (const pair of this.file.pairs ?? []) if (Placed.slides(pair) && !Array.isArray(pair.line?.through)) this.slid(pair, pin, at);
    return this.changed(at, inputs);
  }

  /** What slides in a pair comes to its line where that lies elsewhere now; a link that slides as a whole with all pins that it alone has. */
  slid(pair, pin, at) {
    const slider = this.sliderPin(pair), from = at.get(slider), line = new Placed(this.file, at, this.units).line(pair);
    if (slider === pin || !from || !line) return;
    const by = Plane.minus(Plane.on(line.start, line.way, Plane.dot(Plane.minus(from, line.start), line.way)), from);
    if (Plane.length(by) <= ON_LINE * Math.max(Plane.apart(from, line.start), 1e-3)) return;
    const own = [...this.pins].filter(([name, members]) => name !== pin && members.length === 1 && members[0][0] === pair.links?.[1]).map(([name]) => name);
    for (const name of new Set([slider, ...own])) if (at.has(name)) at.set(name, Plane.on(at.get(name), by, 1));
  }

  /** The file with its pins at other places. */
  changed(at, inputs) {
    const file = structuredClone(this.file), after = new Placed(file, at, this.units), { units } = this;
    const gone = (pin) => { const a = this.at.get(pin), b = at.get(pin); return !a || !b || a[0] !== b[0] || a[1] !== b[1]; };
    for (const [name, link] of Object.entries(file.links)) {
      if (!Pins.ofLink(link).some((point) => gone(Pins.of(this.pins, name, point)))) continue;
      const axes = link.ends ? after.axes(name) : this.axes(name);
      if (link.ends && axes) Written.put(link, "length", Plane.apart(...link.ends.map((point) => after.place(name, point))), "length", units);
      for (const [point, where] of Object.entries(link.points ?? {})) {
        const there = after.place(name, point);
        if (there && axes) after.describe(name, link, point, where, there, axes);
      }
    }
    for (const pair of file.pairs ?? []) after.lead(pair);
    for (const pair of file.pairs ?? []) Coupled.follow(pair, this, after);
    (file.inputs ?? []).forEach((given, k) => this.driven(given, inputs?.[k], after));
    return { file: after.sketched(), at };
  }

  /** The position of an input goes on by as far as its pair has moved; `start` (SI) is where it is, left out that in the file. */
  driven(given, start, after) {
    const [a, b] = [this.motion(given.pair), after.motion(given.pair)], slides = this.file.pairs.some((pair) => Placed.slides(pair) && Pins.pairName(pair) === given.pair);
    const kind = slides ? "length" : "angle", from = start ?? Written.read(given.position, kind, this.units);
    if (a === null || b === null || from === null) return;
    Written.put(given, "position", from + (slides ? b - a : Symbols.wrapped(b - a)), kind, this.units);
  }

  /** The link whose number follows where all else keeps its lengths: one that is chosen, the frame, one that is driven from
      there, or the first. */
  owner(pin, chosen) {
    const { frame } = this.file, links = this.pins.get(pin).map(([link]) => link), driven = (this.file.inputs ?? []).flatMap((given) => (this.isOf(given, pin) ? [] : this.members(given.pair)));
    return links.find((link) => link === chosen) ?? links.find((link) => link === frame) ?? links.find((link) => driven.includes(link) && driven.includes(frame)) ?? links[0];
  }

  /** The links of a turning pair between which its motion is. */
  members(name) {
    const [entry, two] = name.split(":"), pair = this.file.pairs.find((each) => each.turning === entry);
    return pair ? two?.split(",") ?? pair.links ?? Pins.carriers(this.file, entry) : [];
  }

  isOf({ pair }, pin) { return pair.split(":")[0] === pin; }

  /** The file with one number of a pin that is led to a place, and the inputs that turn its link from the frame or slide
      it: all else keeps its lengths, and goes along. */
  along(pin, to, inputs, chosen) {
    const { units } = this, file = structuredClone(this.file), owner = this.owner(pin, chosen), after = new Placed(file, new Map(this.at).set(pin, to), units);
    const [, point] = this.pins.get(pin).find(([link]) => link === owner), link = file.links[owner], where = link.points?.[point], axes = this.axes(owner);
    if (where === undefined) Written.put(link, "length", Plane.apart(...link.ends.map((each) => after.place(owner, each))), "length", units);
    else if (axes) after.describe(owner, link, point, where, to, axes);
    (file.inputs ?? []).forEach((given, k) => {
      const members = this.members(given.pair), pair = file.pairs.find((each) => Pins.pairName(each) === given.pair);
      const turns = where === undefined && members.includes(owner) && members.includes(file.frame), slides = pair && Placed.slides(pair) && this.sliderPin(pair) === pin;
      if (turns || slides) this.driven(given, inputs?.[k], after);
    });
    return { file, at: after.at, owner };
  }

  /** The numbers by which a link describes a point. */
  describe(name, link, point, where, there, axes) {
    const { units } = this, own = Plane.local(axes, there), put = (holder, key, value, kind = "length") => Written.put(holder, key, value, kind, units);
    if (Array.isArray(where)) own.forEach((each, k) => put(where, k, each));
    else if (where.along) {
      const [start, stop] = where.along.map((each) => this.place(name, each)), way = Plane.unit(Plane.minus(stop, start)), off = Plane.minus(there, start);
      const far = Plane.dot(off, way), aside = way[0] * off[1] - way[1] * off[0];
      if (where.angle === undefined && Math.abs(aside) <= ON_LINE * Math.max(Plane.length(off), 1e-6)) put(where, "distance", far);
      else {
        const before = Written.read(where.distance, "length", units), sense = before < 0 ? -1 : 1;
        put(where, "distance", sense * Plane.length(off));
        put(where, "angle", Math.atan2(sense * aside, sense * far), "angle");
      }
    } else if (where.distances) {
      for (const each of Object.keys(where.distances)) put(where.distances, each, Plane.apart(there, this.place(name, each)));
      const side = ["left_of", "right_of"].find((each) => where[each]), [start, stop] = where[side].map((each) => this.place(name, each));
      const left = (stop[0] - start[0]) * (there[1] - start[1]) - (stop[1] - start[1]) * (there[0] - start[0]) > 0;
      if (left === (side === "left_of")) return;
      where[side === "left_of" ? "right_of" : "left_of"] = where[side];
      delete where[side];
    }
  }

  /** A line that is told by coordinates goes through what slides along it. */
  lead(pair) {
    if (!Placed.slides(pair) || !Array.isArray(pair.line?.through)) return;
    const line = this.line(pair), at = line && this.slider(pair);
    if (!at) return;
    const normal = [-line.way[1], line.way[0]], off = Plane.dot(Plane.minus(at, line.start), normal);
    if (Math.abs(off) <= ON_LINE * Math.max(Plane.apart(at, line.start), 1e-3)) return;
    Plane.local(line.axes, Plane.on(line.start, normal, off)).forEach((each, k) => Written.put(pair.line.through, k, each, "length", this.units));
  }

  /** The file with a sketch of all pins that move. */
  sketched() {
    const { file, units } = this, frame = file.links[file.frame];
    for (const [pin, members] of this.pins) {
      const at = this.at.get(pin);
      if (!at || members.some(([link]) => link === file.frame) || !frame) continue;
      file.sketch ??= {};
      const spot = (file.sketch[pin] = [...(file.sketch[pin] ?? [0, 0])]);
      at.forEach((each, k) => Written.put(spot, k, each, "length", units));
    }
    return file;
  }
}
