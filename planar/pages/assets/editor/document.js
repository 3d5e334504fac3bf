"use strict";
/* What the pencil does to a mechanism's file. Each takes a draft {file, at, units}, changes its own copy, and gives it back;
   what cannot be done is an Error with a sentence. */

const Draw = {
  freshLink(file, wanted) {
    const taken = new Set([...Object.keys(file.links), ...(file.pairs ?? []).map(Pins.pairName)]);
    let name = wanted, count = 2;
    while (taken.has(name)) name = `${wanted} ${count++}`;
    return name;
  },

  /** A pin at a place that is there, or a new one. */
  pin(draft, spot) {
    if (spot.pin !== null) {
      if (spot.pin.includes(".")) throw new Error(`several points are called ${spot.pin.split(".")[1]}; give this one a name of its own first`);
      return spot.pin;
    }
    const name = Pins.fresh(draft.file, draft.at.keys());
    draft.at.set(name, spot.at);
    return name;
  },

  /** Links that carry a pin are joined there. */
  join(file, pin) {
    file.pairs ??= [];
    const entry = file.pairs.find((pair) => pair.turning === pin), links = Pins.carriers(file, pin);
    if (file.pairs.some((pair) => pair.block === pin)) return;
    if (entry?.points) throw new Error(`links carry ${pin} under other names; join them in the text`);
    if (entry?.links) entry.links.push(...links.filter((link) => !entry.links.includes(link)));
    else if (!entry && links.length > 1) file.pairs.push({ turning: pin });
  },

  length(draft, value, before = 0) { return Written.write(value, "length", draft.units, before); },
  spot(draft, at) { return at.map((each) => Draw.length(draft, each)); },

  /** A link through places: a bar through two, a plate through more. */
  link(draft, spots) {
    const pins = spots.map((spot) => Draw.pin(draft, spot));
    if (new Set(pins).size < Math.max(2, pins.length)) throw new Error("a bar goes from one pin to another");
    const { file, at } = draft, [a, b] = pins, name = Draw.freshLink(file, pins.join(""));
    file.links[name] = { ends: [a, b], length: Draw.length(draft, Plane.apart(at.get(a), at.get(b))) };
    if (pins.length > 2) {
      const [x, y] = at.get(a), angle = Math.atan2(at.get(b)[1] - y, at.get(b)[0] - x), axes = { x, y, cos: Math.cos(angle), sin: Math.sin(angle) };
      file.links[name].points = Object.fromEntries(pins.slice(2).map((pin) => [pin, Draw.spot(draft, Plane.local(axes, at.get(pin)))]));
    }
    for (const pin of pins) Draw.join(file, pin);
    return `${pins.length > 2 ? "Plate" : "Bar"} ${name}`;
  },

  /** A point more on a link, as of a coupler. */
  point(draft, link, spot) {
    const { file } = draft, axes = new Placed(file, draft.at, draft.units).axes(link);
    if (!axes) throw new Error(`nothing tells how ${link} lies`);
    const pin = Draw.pin(draft, spot);
    if (Pins.ofLink(file.links[link]).includes(pin)) throw new Error(`${link} has ${pin} already`);
    (file.links[link].points ??= {})[pin] = Draw.spot(draft, Plane.local(axes, draft.at.get(pin)));
    Draw.join(file, pin);
    return `Point ${pin} of ${link}`;
  },

  /** A pin is fixed to the frame, or no longer. */
  ground(draft, spot) {
    const { file } = draft, pin = Draw.pin(draft, spot), points = (file.links[file.frame].points ??= {});
    if (Object.hasOwn(points, pin)) {
      delete points[pin];
      Draw.clean(draft);
      return `${pin} is fixed no longer`;
    }
    points[pin] = Draw.spot(draft, draft.at.get(pin));
    if (file.sketch) delete file.sketch[pin];
    Draw.join(file, pin);
    return `${pin} is fixed to the frame`;
  },

  /** A pin slides along a line of a link: through it in a direction, or along two points of the link. */
  slide(draft, spot, guide, to) {
    const { file } = draft, pin = Draw.pin(draft, spot);
    if (guide !== file.frame && Pins.ofLink(file.links[guide]).includes(pin)) throw new Error(`${pin} is a point of ${guide}: it cannot slide on it`);
    if (!Pins.carriers(file, pin).length) throw new Error(`a bar is wanted at ${pin} that slides`);
    const line = Draw.guideLine(draft, pin, guide, to);
    file.pairs = (file.pairs ?? []).filter((pair) => pair.turning !== pin);
    const made = { sliding: Draw.freshLink(file, `${pin} slide`), on: guide, block: pin, line };
    file.pairs.push(made);
    return Draw.slideWhole(draft, made) ?? `${pin} slides on ${guide}`;
  },

  /** A link of which two pins slide along one line slides as a whole: one pair in place of two. */
  slideWhole({ file, at, units }, made) {
    const placed = new Placed(file, at, units), links = Pins.carriers(file, made.block), [link] = links, line = placed.line(made);
    const alone = ({ on, block }) => on === made.on && block !== undefined && block !== made.block && links.length === 1 && String(Pins.carriers(file, block)) === link;
    const other = file.pairs.find(alone), before = other && placed.line(other), turned = link && placed.direction(link);
    if (!before || !line || turned === null) return null;
    const far = Plane.minus(at.get(made.block), before.start), across = (a, b) => Math.abs(a[0] * b[1] - a[1] * b[0]);
    if (across(before.way, line.way) > ON_LINE || across(before.way, far) > ON_LINE * Math.max(Plane.length(far), 1e-3)) return null;
    file.pairs.splice(file.pairs.indexOf(made), 1);
    const turn = Written.write(Symbols.wrapped(turned - Math.atan2(before.way[1], before.way[0])), "angle", units, 0);
    file.pairs[file.pairs.indexOf(other)] = { sliding: other.sliding, links: [other.on, link], line: other.line, point: other.block, turn };
    return `${link} slides on ${other.on} as a whole`;
  },

  /** The line of a link on which a pin slides: through two points of the link, to which the pin comes, or through the pin. */
  guideLine(draft, pin, guide, to) {
    const { file, at } = draft, axes = new Placed(file, at, draft.units).axes(guide), points = Pins.ofLink(file.links[guide]);
    if (guide !== file.frame && points.length > 1) {
      const line = { through: points[0], to: points[1] };
      at.set(pin, Draw.foot(draft, guide, line, at.get(pin)));
      return line;
    }
    if (!axes) throw new Error(`nothing tells how ${guide} lies`);
    const [p, q] = [at.get(pin), to].map((each) => Plane.local(axes, each)), angle = Math.atan2(q[1] - p[1], q[0] - p[0]);
    return { through: Draw.spot(draft, p), angle: Written.write(angle, "angle", draft.units, 0) };
  },

  foot(draft, guide, { through, to }, at) {
    const [a, b] = [through, to].map((point) => draft.at.get(Pins.of(Pins.all(draft.file), guide, point))), way = Plane.unit(Plane.minus(b, a));
    return Plane.on(a, way, Plane.dot(Plane.minus(at, a), way));
  },

  /** The pair at a pin is driven, or no longer. */
  input(draft, pin) {
    const { file, units } = draft, driven = file.inputs ?? [], placed = new Placed(file, draft.at, units);
    const pair = file.pairs.find((each) => each.turning === pin) ?? file.pairs.find((each) => each.sliding !== undefined && placed.sliderPin(each) === pin);
    if (!pair) throw new Error(`no two links are joined at ${pin}`);
    const slides = pair.sliding !== undefined, many = slides ? 2 : Pins.carriers(file, pin).length;
    const name = slides ? pair.sliding : many > 2 ? `${pin}:${Draw.ofTwo(file, pin).join(",")}` : pin;
    if (driven.some((each) => each.pair === name)) {
      file.inputs = driven.filter((each) => each.pair !== name);
      return `${name} is driven no longer`;
    }
    const at = placed.motion(name);
    if (at === null) throw new Error(`nothing tells how far ${name} has gone`);
    const position = Written.write(slides ? at : -Symbols.wrapped(-at), slides ? "length" : "angle", units, 0);
    file.inputs = [...driven, { pair: name, position, velocity: slides ? `${Number((0.1 / units.length).toPrecision(1))} ${file.units?.length ?? "m"}/s` : "10 rad/s" }];
    return `${name} is driven`;
  },

  /** Of a pin of several links the two that an input turns: the frame, or the first, and the next. */
  ofTwo(file, pin) {
    const links = Pins.carriers(file, pin).sort((a, b) => Number(b === file.frame) - Number(a === file.frame));
    return links.slice(0, 2);
  },

  /** A number and a unit, before somebody says how much it is. */
  usual(draft, kind) {
    if (!draft.usual) throw new Error("fix a pin to the frame first");
    return draft.usual[kind];
  },

  /** The two pins between which a part acts. */
  pinPair(spots, part) {
    const pins = spots.map((spot) => spot.pin);
    if (pins.includes(null) || pins[0] === pins[1]) throw new Error(`${part} from one pin to another`);
    return pins;
  },

  spring(draft, spots) {
    const { file } = draft, pins = Draw.pinPair(spots, "a spring goes");
    const far = Plane.apart(...pins.map((pin) => draft.at.get(pin)));
    (file.springs ??= []).push({ points: pins, stiffness: Draw.usual(draft, "stiffness").join(" "), free_length: Draw.length(draft, far) });
    return `Spring between ${pins.join(" and ")}, ${draft.usual.stiffness.join(" ")}`;
  },

  /** A force on a pin in a direction. */
  load(draft, pin, to) {
    if (pin === null) throw new Error("a force acts on a pin");
    const [most, unit] = Draw.usual(draft, "force"), way = Plane.unit(Plane.minus(to, draft.at.get(pin)));
    const force = way.map((each) => `${Number((most * each).toPrecision(6)) || 0} ${unit}`);
    (draft.file.loads ??= []).push({ point: pin, force });
    return `Force on ${pin}, ${most} ${unit}`;
  },

  /** Equal and opposite forces on two pins, which push these apart. */
  opposedForces(draft, spots) {
    const pins = Draw.pinPair(spots, "opposed forces act"), force = Draw.usual(draft, "force").join(" ");
    (draft.file.loads ??= []).push({ points: pins, force });
    return `Opposed forces on ${pins.join(" and ")}, ${force}`;
  },

  /** A mass of a link, in the middle of its points. */
  mass(draft, link) {
    const { file, at, units } = draft, placed = new Placed(file, at, units), axes = placed.axes(link), points = Pins.ofLink(file.links[link]);
    if (link === file.frame) throw new Error("the frame stands still: its mass is nothing to the motion");
    if (!axes) throw new Error(`nothing tells how ${link} lies`);
    const places = points.map((point) => placed.place(link, point)), middle = [0, 1].map((k) => places.reduce((sum, each) => sum + each[k], 0) / places.length);
    (file.masses ??= []).push({ link, mass: Draw.usual(draft, "mass").join(" "), at: Draw.spot(draft, Plane.local(axes, middle)) });
    return `Mass of ${link}, ${draft.usual.mass.join(" ")}`;
  },

  /** A link of the same form with pins of its own, so far aside. */
  copyLink(draft, link, aside) {
    return Draw.link(draft, Draw.spots(draft, link).map(({ at: [x, y] }) => ({ pin: null, at: [x + aside, y - aside] })));
  },

  /** Its mirror image, left for right, about its own pin farthest to the right, where both are joined. */
  mirrorLink(draft, link) {
    const spots = Draw.spots(draft, link), axis = cheapest(spots, ({ at }) => -at[0]);
    return Draw.link(draft, spots.map((each) => (each === axis ? each : { pin: null, at: [2 * axis.at[0] - each.at[0], each.at[1]] })));
  },

  /** The pins of a link with their places. */
  spots(draft, link) {
    const pins = Pins.all(draft.file), spots = Pins.ofLink(draft.file.links[link]).map((point) => Pins.of(pins, link, point)).map((pin) => ({ pin, at: draft.at.get(pin) }));
    if (link === draft.file.frame) throw new Error("there is one frame");
    if (spots.length < 2 || spots.some(({ at }) => !at)) throw new Error(`${link} has too few pins to be drawn again`);
    return spots;
  },

  removeLink(draft, link) {
    if (link === draft.file.frame) throw new Error("the frame stays; its pins are made free by the tool Ground");
    delete draft.file.links[link];
    Draw.clean(draft);
    return `${link} is gone`;
  },

  /** A pin goes, with what has no two points without it. */
  removePin(draft, pin) {
    const { file } = draft, members = Pins.all(file).get(pin) ?? [];
    for (const [name, point] of members) {
      const link = file.links[name];
      if (link.points) delete link.points[point];
      const leans = JSON.stringify(link.points ?? {}).includes(JSON.stringify(point));
      if (name !== file.frame && (link.ends?.includes(point) || leans)) delete file.links[name];
    }
    Draw.clean(draft);
    return `${pin} is gone`;
  },

  /** Whether all links and points of a pair are there. */
  holds(file, pair) {
    const has = (link) => link === undefined || Object.hasOwn(file.links, link), carries = (link, point) => point === undefined || (Object.hasOwn(file.links, link) && Pins.ofLink(file.links[link]).includes(point));
    if (pair.turning !== undefined) return pair.points ? pair.links.every((link, k) => carries(link, pair.points[k])) : (pair.links ?? Pins.carriers(file, pair.turning)).length > 1;
    if (![...(pair.links ?? []), pair.on, pair.carrier].every(has)) return false;
    if (pair.block !== undefined && !Pins.carriers(file, pair.block).length) return false;
    const [first, second] = pair.links ?? [], guide = Placed.guide(file, pair);
    return carries(second, pair.point) && carries(first, pair.centre) && carries(second, pair.pivot)
      && [pair.line?.through, pair.line?.to].every((point) => typeof point !== "string" || carries(guide, point));
  },

  /** What refers to nothing any more goes, too. */
  clean(draft) {
    const { file, at } = draft, has = (link) => Object.hasOwn(file.links, link), carries = (link, point) => has(link) && Pins.ofLink(file.links[link]).includes(point);
    for (const pair of file.pairs ?? []) if (pair.turning !== undefined && pair.links && !pair.points) pair.links = pair.links.filter((link) => carries(link, pair.turning));
    file.pairs = (file.pairs ?? []).filter((pair) => Draw.holds(file, pair));
    // what is not joined by a slide any more is joined by a pin
    const pins = Pins.all(file), names = new Set(file.pairs.map(Pins.pairName));
    const keep = (key, holds) => { if (file[key]) { file[key] = file[key].filter(holds); if (!file[key].length) delete file[key]; } };
    keep("inputs", (each) => { const [entry, two] = each.pair.split(":"); return names.has(entry) && (two?.split(",") ?? []).every((link) => carries(link, entry)); });
    keep("loads", (each) => [each.point, ...(each.points ?? [])].every((point) => point === undefined || pins.has(point)) && (each.link === undefined || has(each.link)) && (each.pair === undefined || names.has(each.pair)));
    keep("springs", (each) => (each.points ?? []).every((point) => pins.has(point)) && (each.links ?? []).every(has));
    keep("masses", (each) => has(each.link) && (Array.isArray(each.at) || carries(each.link, each.at)));
    for (const pin of Object.keys(file.sketch ?? {})) if (!pins.has(pin) || carries(file.frame, pin)) delete file.sketch[pin];
    if (file.sketch && !Object.keys(file.sketch).length) delete file.sketch;
    for (const pin of [...at.keys()]) if (!pins.has(pin)) at.delete(pin);
  },

  /** Another name for a pin. */
  renamePin(draft, from, to) {
    const { file, at } = draft, name = to.trim();
    if (!name || /[.:,]/.test(name)) throw new Error("a name has letters, and no . : or ,");
    if (Pins.all(file).has(name) || file.pairs.some((pair) => pair.turning === undefined && Pins.pairName(pair) === name)) throw new Error(`there is a ${name} already`);
    const members = Pins.all(file).get(from), swap = (each, old) => (each === old ? name : each);
    const keyed = (object, old) => Object.fromEntries(Object.entries(object).map(([key, value]) => [swap(key, old), value]));
    for (const [linkName, point] of members) {
      const link = file.links[linkName];
      for (const key of ["ends", "axis"]) if (link[key]) link[key] = link[key].map((each) => swap(each, point));
      if (link.points) link.points = keyed(link.points, point);
      for (const where of Object.values(link.points ?? {})) {
        for (const key of ["along", "left_of", "right_of"]) if (where[key]) where[key] = where[key].map((each) => swap(each, point));
        if (where.distances) where.distances = keyed(where.distances, point);
      }
      for (const mass of file.masses ?? []) if (mass.link === linkName && mass.at === point) mass.at = name;
      for (const pair of file.pairs) {
        if (pair.points) pair.points = pair.points.map((each, k) => (pair.links[k] === linkName ? swap(each, point) : each));
        if (Placed.guide(file, pair) === linkName && pair.line) for (const key of ["through", "to"]) if (pair.line[key] === point) pair.line[key] = name;
        if (pair.links?.[1] === linkName) for (const key of ["point", "pivot"]) if (pair[key] === point) pair[key] = name;
        if (pair.links?.[0] === linkName && pair.centre === point) pair.centre = name;
        if (pair.block === point) pair.block = name;
        if (pair.turning === point && from === point) pair.turning = name;
      }
    }
    for (const each of file.inputs ?? []) { const [entry, two] = each.pair.split(":"); if (entry === from) each.pair = two === undefined ? name : `${name}:${two}`; }
    for (const each of file.loads ?? []) each.point === from && (each.point = name);
    for (const each of [...(file.loads ?? []), ...(file.springs ?? [])]) if (each.points) each.points = each.points.map((point) => swap(point, from));
    if (file.sketch) file.sketch = keyed(file.sketch, from);
    at.set(name, at.get(from));
    at.delete(from);
    return `${from} is called ${name}`;
  },
};
