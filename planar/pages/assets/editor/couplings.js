"use strict";
/* Pairs that tie one link's turning to another's motion, as the pencil draws them: wheels, belts, racks, cams, and pins in
   slots. They are drawn as links stand: what they roll on, and about which pins, follows from the drawing. */

const USUAL_SHARES = { pulleys: [6, 3], roller: 6, lift: 4, swing: 12 }; // of a distance, or a turn, so many parts where nothing is typed
const ROUND_FIGURES = 2;

const Couplings = {
  /** The link on which two others turn, both pinned to it: the frame before others. */
  carrier(file, [a, b]) {
    const holds = (link, other) => Couplings.pins(file, link).some((pin) => Pins.carriers(file, pin).includes(other));
    const found = [file.frame, ...Object.keys(file.links)].find((link) => link !== a && link !== b && holds(a, link) && holds(b, link));
    if (found === undefined && (a === file.frame || b === file.frame)) throw new Error("no link carries both: draw an arm that is pinned to both of them");
    return found ?? file.frame;
  },

  /** The points of a link that turning pairs hold. */
  pins(file, link) { return Pins.ofLink(file.links[link]).filter((point) => file.pairs.some((pair) => pair.turning === point)); },

  /** The pin about which a link turns on another. */
  centre(file, link, carrier) { return Couplings.pins(file, link).find((pin) => Pins.carriers(file, pin).includes(carrier)) ?? null; },

  /** The angles at which two links now meet, against their carrier. */
  mesh(draft, links, carrier) {
    const placed = new Placed(draft.file, draft.at, draft.units), [a, b, c] = [...links, carrier].map((link) => placed.direction(link));
    if ([a, b, c].includes(null)) throw new Error("nothing tells how these links lie");
    return Object.fromEntries([a, b].map((angle, k) => [links[k], Written.write(Symbols.wrapped(angle - c), "angle", draft.units, 0)]));
  },

  /** Two wheels on their carrier, with what tells their sizes. */
  wheels(draft, kind, links, sizes) {
    const { file } = draft;
    if (links[0] === links[1]) throw new Error("wheels are two links");
    const carrier = Couplings.carrier(file, links), mesh = Couplings.mesh(draft, links, carrier);
    const pair = { [kind]: Draw.freshLink(file, `${links.join("-")} ${kind === "belt" ? "belt" : "wheels"}`), links, ...sizes(carrier), mesh };
    if (carrier !== file.frame) pair.carrier = carrier;
    file.pairs.push(pair);
    return `${links.join(" and ")} on ${carrier}`;
  },

  /** Two links turn as wheels in mesh do. */
  gear(draft, links, ratio) {
    if (ratio === null || ratio === 0) throw new Error("the ratio of wheels is a number, and not 0");
    return `Wheels of ${Couplings.wheels(draft, "gear", links, () => ({ ratio }))}, ratio ${ratio}`;
  },

  /** A belt round two pulleys; `radii` (m), each null where nothing is typed. */
  belt(draft, links, radii, crossed) {
    return `Belt round ${Couplings.wheels(draft, "belt", links, (carrier) => {
      const centres = links.map((link) => draft.at.get(Couplings.centre(draft.file, link, carrier)));
      if (centres.includes(undefined) || !Plane.apart(...centres)) throw new Error("a belt runs round two links, each pinned to what carries it");
      const sizes = radii.map((each, k) => each ?? Couplings.rounded(Plane.apart(...centres) / USUAL_SHARES.pulleys[k], draft.units.length));
      if (!sizes.every((each) => each > 0)) throw new Error("pulleys have radii above zero");
      return { radii: sizes.map((each) => Draw.length(draft, each)), ...(crossed ? { crossed } : {}) };
    })}`;
  },

  rounded(value, unit) { return Number((value / unit).toPrecision(ROUND_FIGURES)) * unit; },

  /** A link rolls on another, about its pin nearest to where it was taken hold of. */
  rack(draft, pinion, rack, near) {
    const { file, at, units } = draft, placed = new Placed(file, at, units);
    if (pinion === rack || rack === null) throw new Error("a pinion rolls on another link: end on that");
    const [start, stop] = Pins.ofLink(file.links[rack]), point = cheapest(Couplings.pins(file, pinion), (pin) => Plane.apart(at.get(pin), near));
    if (stop === undefined) throw new Error(`${rack} has one point: a rack is a bar`);
    if (point === undefined) throw new Error(`${pinion} is pinned to nothing about which it could turn`);
    const pair = { rack: Draw.freshLink(file, `${rack}-${pinion} rack`), links: [rack, pinion], line: { through: start, to: stop }, point };
    const lie = Coupled.rolling(pair, placed);
    if (lie === null) throw new Error("nothing tells how these links lie");
    const { along, left, angle } = lie;
    if (Math.abs(left) < ON_LINE * Math.max(Math.abs(along), 1e-3)) throw new Error(`${point} lies on ${rack}: a pinion has its centre beside it`);
    Object.assign(pair, { radius: Draw.length(draft, left), mesh: { displacement: Draw.length(draft, along), angle: Written.write(angle, "angle", units, 0) } });
    file.pairs.push(pair);
    return `${pinion} rolls on ${rack} about ${point}`;
  },

  /** A pin of a link stays in a slot of another. */
  slot(draft, { pin }, guide, to) {
    const { file } = draft, own = Pins.carriers(file, pin).filter((link) => link !== guide).sort((a, b) => Number(a === file.frame) - Number(b === file.frame))[0];
    if (own === undefined) throw new Error(`a link is wanted at ${pin} whose pin runs in the slot`);
    if (guide !== file.frame && Pins.ofLink(file.links[guide]).includes(pin)) throw new Error(`${pin} is a point of ${guide}: it cannot run in its slot`);
    file.pairs = file.pairs ?? [];
    file.pairs.push({ slot: Draw.freshLink(file, `${pin} slot`), links: [guide, own], line: Draw.guideLine(draft, pin, guide, to), point: pin });
    return `${pin} runs in a slot of ${guide}`;
  },

  /** The pieces of a lift that rises, dwells, returns, and dwells for what is left of a turn: [motion, sense, deg], none of 0 deg. */
  camLaw({ motion, angles: [rise, dwell, back] }) {
    const rest = 360 - rise - dwell - back;
    if (!(rise > 0 && back > 0 && dwell >= 0 && rest >= 0)) throw new Error("rise and return are above 0 deg, and with the dwell a turn of 360 deg at the most");
    return [[motion, 1, rise], ["dwell", 0, dwell], [motion, -1, back], ["dwell", 0, rest]].filter(([, , angle]) => angle > 0);
  },

  /** A follower with a roller at its pin on a cam, which stands where its lift begins; `lift` {length, angle} of which it has one; null: chosen. */
  cam(draft, cam, pin, { lift, roller, law }) {
    const { file, at, units } = draft, links = pin === null ? [] : Pins.carriers(file, pin).filter((link) => link !== cam && link !== file.frame), [follower] = links;
    if (follower === undefined) throw new Error("a cam ends at the pin of its follower that touches it");
    const carrier = Couplings.carrier(file, [cam, cam]), centre = Couplings.centre(file, cam, carrier);
    if (centre === null) throw new Error(`${cam} is pinned to nothing about which it could turn`);
    const placed = new Placed(file, at, units), axes = placed.axes(carrier), O = at.get(centre), P = at.get(pin), far = Plane.apart(O, P);
    const pivot = Couplings.centre(file, follower, carrier), slide = file.pairs.find(({ sliding, links: [on, link] = [] }) => sliding !== undefined && on === carrier && link === follower);
    if (pivot === null && slide === undefined) throw new Error(`${follower} follows a cam where it is pinned to ${carrier}, or slides on it by two of its pins`);
    const size = roller ?? Couplings.rounded(far / USUAL_SHARES.roller, units.length), base = far - size;
    if (!(size > 0 && base > 0)) throw new Error("the roller is larger than what is between its pin and the cam's");
    const swings = pivot !== null && pivot !== pin, rises = lift[swings ? "angle" : "length"] ?? (swings ? (2 * Math.PI) / USUAL_SHARES.swing / 2 : Couplings.rounded(far / USUAL_SHARES.lift, units.length));
    const turn = (angle) => (file.units?.angle === "deg" ? angle : `${angle} deg`), by = (sense) => Written.write(sense * rises, swings ? "angle" : "length", units, 0);
    const pair = { cam: Draw.freshLink(file, `${cam} cam`), links: [cam, follower], ...(carrier === file.frame ? {} : { carrier }), point: pin, centre };
    if (swings) {
      const R = at.get(pivot), way = Plane.minus(O, R), arm = Plane.minus(P, R);
      Object.assign(pair, { pivot, side: way[0] * arm[1] - way[1] * arm[0] > 0 ? "left" : "right" });
    } else pair.line = Couplings.camLine(draft, placed.line(slide), axes, centre, O, P);
    Object.assign(pair, { base_radius: Draw.length(draft, base), roller_radius: Draw.length(draft, size), start: Object.values(Couplings.mesh(draft, [cam, cam], carrier))[0] });
    pair.law = Couplings.camLaw(law).map(([motion, sense, angle]) => (sense ? { motion, by: by(sense), in: turn(angle) } : { motion, in: turn(angle) }));
    file.pairs.push(pair);
    return `${follower} follows the cam ${cam}`;
  },

  /** The line of a sliding follower, away from the cam: through its centre, or beside it. */
  camLine(draft, { start, way }, axes, centre, O, P) {
    const foot = Plane.on(start, way, Plane.dot(Plane.minus(O, start), way)), out = Plane.dot(Plane.minus(P, foot), way) < 0 ? Plane.times(way, -1) : way;
    const through = Plane.apart(foot, O) <= ON_LINE * Plane.apart(O, P) ? centre : Draw.spot(draft, Plane.local(axes, foot));
    return { through, angle: Written.write(Symbols.wrapped(Math.atan2(out[1], out[0]) - axes.angle), "angle", draft.units, 0) };
  },
};
