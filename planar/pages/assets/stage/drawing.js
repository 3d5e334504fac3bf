"use strict";
/* The mechanism drawn as in a textbook: one group per link and height, moved by a transform; what stands still below,
   pins and letters above. `page.view` says where places in the world lie on the screen. */

const HEIGHTS = ["ground", "plates", "wheels", "tubes", "bars", "springs", "sliders", "pins", "drives", "letters"];
const MARGIN = 12;     // mm about everything that moves
const FOOT = 6;        // mm below for the bar of the scale
const FINGER = 24;     // px: as wide a link can be taken hold of

const down = (way) => [way[0], -way[1]]; // as y is downwards on the screen
class Drawing {
  constructor(page, svg) {
    this.page = page;
    this.svg = svg;
    this.root = Symbols.element("g", { class: "mechanism" });
    svg.prepend(this.root);
    svg.setAttribute("aria-label", page.data.name);
    this.sense = 1; // of the input that runs, for its arrow
    this.measure();
    page.on("size", () => this.renew());
    page.on("move", () => { if (!this.stale) this.place(); });
    new ResizeObserver(() => {
      if (svg.clientWidth !== this.width || svg.clientHeight !== this.height) this.build();
    }).observe(svg);
  }

  /** Draw other dimensions at the next frame, however many are tried until then. */
  renew() {
    if (this.stale) return;
    this.stale = true;
    requestAnimationFrame(() => {
      this.stale = false;
      this.measure();
    });
  }

  /** Look where everything comes, and draw it anew. */
  measure() {
    Object.assign(this, motions(this.page), { slack: 0 });
    this.build();
  }

  /** Make all elements anew, for the sizes and the window that there are now. */
  build() {
    const { page, svg } = this, width = svg.clientWidth, height = svg.clientHeight;
    if (!width || !height) return;
    const mm = Math.max(3.2, Math.min(width / 150, height / 110, 8));
    Object.assign(this, Bodies.shapes(page), { mm, width, height });
    svg.style.setProperty("--mm", mm);
    svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    this.fit();
    this.tubes = Bodies.tubes(page, this.look, this.marks, this.poses, this.near, (GUIDE_OVERHANG * mm) / this.scale);
    this.root.replaceChildren();
    this.levels = Object.fromEntries(HEIGHTS.map((name) => [name, Symbols.element("g", { class: name })]));
    this.root.append(...HEIGHTS.map((name) => this.levels[name]));
    this.levels.letters.setAttribute("pointer-events", "none");
    this.parts = new Map();
    this.bands = [];
    this.edges = []; // [link, from, to] in px of the link's axes
    this.links();
    this.ground();
    this.lasting = this.edges.length;
    this.drive();
    this.scaleBar();
    this.named();
    page.emit("view");
    this.place(true);
  }

  /** The scale (px/m) at which all positions fit, and where the world's origin lies. */
  fit() {
    const { mm, width, height, poses } = this, low = [Infinity, Infinity], high = [-Infinity, -Infinity];
    const take = (at, r = 0) => {
      for (const k of [0, 1]) { low[k] = Math.min(low[k], at[k] - r); high[k] = Math.max(high[k], at[k] + r); }
    };
    for (const frames of poses) {
      for (const [link, places] of Object.entries(this.corners())) for (const at of places) take(Plane.carry(frames[link], at));
      for (const mark of this.marks) if (mark.kind === "WheelMark") take(Plane.carry(frames[mark.link], mark.centre), Math.abs(mark.radius));
    }
    for (const k of [0, 1]) { low[k] -= this.slack; high[k] += this.slack; }
    const span = [high[0] - low[0], high[1] - low[1]], room = [width - 2 * MARGIN * mm, height - (2 * MARGIN + FOOT) * mm];
    const scale = Math.min(room[0] / Math.max(span[0], 1e-9), room[1] / Math.max(span[1], 1e-9));
    this.scale = Math.min(scale, (0.6 * Math.min(...room)) / (0.02 * this.size)); // a single spot is not blown up
    const origin = [
      width / 2 - ((low[0] + high[0]) / 2) * this.scale,
      (height - FOOT * mm) / 2 + ((low[1] + high[1]) / 2) * this.scale,
    ];
    this.origin = origin;
    this.page.view = {
      scale: this.scale, mm, width, height,
      toScreen: ([x, y]) => [origin[0] + x * this.scale, origin[1] - y * this.scale],
      toWorld: ([x, y]) => [(x - origin[0]) / this.scale, (origin[1] - y) / this.scale],
    };
  }

  /** The places of every link (m, in its axes) that have to be seen. */
  corners() {
    const found = Object.create(null);
    for (const [link, body] of Object.entries(this.look)) {
      found[link] = [...this.points[link].map((point) => point.at), ...body.sides.flat(), ...body.tracers.flat(), ...body.joints, ...body.dots, ...body.guides.map((each) => each.foot)];
    }
    for (const mark of this.marks) {
      if (mark.kind === "SliderMark") found[mark.link].push(mark.position);
      if (mark.kind === "MassCentreMark") found[mark.link].push(mark.at);
    }
    return found;
  }

  px(a) { return [a[0] * this.scale, -a[1] * this.scale]; }

  /** Put elements into the group of a link at a height. */
  part(height, link, ...elements) {
    const key = `${height} ${link}`;
    if (!this.parts.has(key)) {
      const group = Symbols.element("g", { "data-link": link });
      group.append(Symbols.element("title", {}, link));
      this.levels[height].append(group);
      this.parts.set(key, { group, link });
    }
    this.parts.get(key).group.append(...elements);
  }

  /** A stroke of a link that letters keep off and by which it can be taken. */
  bar(link, pen, a, b) {
    const ends = [this.px(a), this.px(b)];
    this.part("bars", link, Symbols.line(pen, ...ends));
    this.avoid(link, ...ends);
    this.grip(link, ...ends);
  }

  /** A symbol of a link at a place of its axes (px), along a unit vector there; letters keep off it. */
  symbol(height, link, name, at, way, more) {
    const strokes = Symbols.symbol(name, this.mm, at, way, more);
    this.part(height, link, ...strokes.map((each) => each.element));
    for (const { pen, spots } of strokes) if (pen !== "hatch") this.avoid(link, ...spots);
  }

  grip(link, a, b) {
    this.part("bars", link, Symbols.element("polyline", { class: "grip", points: Symbols.told([a, b]), "stroke-width": FINGER }));
  }

  /** A stroke that letters keep off: all round through places (px of the link's axes). */
  avoid(link, ...spots) {
    for (let k = 1; k < spots.length; k++) this.edges.push([link, spots[k - 1], spots[k]]);
  }

  /** Whether a side lies on the centre line of a cylinder, which is drawn in its place. */
  onTube(link, side) {
    return Object.values(this.tubes).some((tube) => {
      const [at, way] = link === tube.guide ? [tube.foot, tube.way] : [tube.at, tube.along];
      return (link === tube.guide || link === tube.rod) && side.every((p) => Plane.offLine(p, at, way) <= 2 * this.near);
    });
  }

  /** All that moves. */
  links() {
    const { frame } = this.page.data;
    const moving = Object.entries(this.look).filter(([link]) => link !== frame);
    for (const [link, body] of moving) {
      if (!body.plate.length) continue;
      const corners = body.plate.map((p) => this.px(p));
      this.part("plates", link, Symbols.area("link", "link", ...corners));
      this.part("bars", link, Symbols.element("polygon", { class: "grip area", points: Symbols.told(corners) }));
    }
    this.wheels();
    for (const tube of Object.values(this.tubes)) {
      const ends = [tube.base, tube.mouth].map((far) => this.px(Plane.on(tube.foot, tube.way, far)));
      if (tube.mouth - tube.base > this.near) {
        this.symbol("tubes", tube.guide, "cylinder", ends[0], down(tube.way), { stop: ends[1] });
        this.grip(tube.guide, ...ends);
      }
      const rod = [tube.rear, tube.front].map((far) => this.px(Plane.on(tube.at, tube.along, far)));
      this.symbol("tubes", tube.rod, "piston", rod[0], down(tube.along), { stop: rod[1] });
      this.grip(tube.rod, ...rod);
    }
    for (const [link, body] of moving) {
      for (const side of body.sides) if (!this.onTube(link, side)) this.bar(link, "link", ...side);
      for (const side of body.tracers) this.bar(link, "pin", ...side);
      this.guideLines(link, body);
    }
    this.springs = new Springs(this);
    this.sliders();
  }

  /** The lines of a link along which blocks run, from its body to beyond the block wherever it comes. */
  guideLines(link, body) {
    const { marks, poses, mm } = this, over = (GUIDE_OVERHANG * mm) / this.scale;
    const slides = marks.filter((mark) => mark.kind === "SliderMark" && mark.link === link);
    for (const { name, foot, way } of body.guides) {
      const mark = marks.find((each) => each.name === name && each.link === link && ["GuideMark", "SlotMark"].includes(each.kind));
      if (!mark || this.tubes[name]) continue;
      const [low, high] = Bodies.range(mark, marks, poses, foot);
      let [start, stop] = [Math.min(0, low - over), Math.max(0, high + over)];
      if (low > over || high < -over) [start, stop] = low > 0 ? [0, high + over] : [low - over, 0]; // to one side only
      if (body.joints.length === 1 && slides.some(({ position }) => Plane.apart(position, foot) <= this.near)) {
        const behind = over + ((BLOCK_SIZE[1] / 2) * mm) / this.scale; // a yoke shows on both sides of its own block
        [start, stop] = [Math.min(start, -behind), Math.max(stop, behind)];
      }
      this.bar(link, "link", Plane.on(foot, way, start), Plane.on(foot, way, stop));
    }
  }

  wheels() {
    const { frame } = this.page.data, { marks, mm, scale } = this, seen = new Set();
    const bands = new Set(marks.filter((mark) => mark.kind === "BeltMark").map((mark) => mark.name));
    for (const mark of marks) {
      if (mark.kind === "WheelMark" && mark.link !== frame) {
        const key = [mark.link, ...[...mark.centre, mark.radius].map((value) => Math.round(value / this.near))].join();
        if (seen.has(key)) continue;
        seen.add(key);
        const at = this.px(mark.centre), banded = bands.has(mark.name); // the band is its circle
        this.part("wheels", mark.link, ...(banded ? Symbols.wheelMark(at, mark.radius * scale, mm) : Symbols.wheel(at, mark.radius * scale, false, mm)));
        this.round(mark.link, at, Math.abs(mark.radius) * scale);
        this.part("bars", mark.link, Symbols.element("circle", { class: "grip", cx: at[0], cy: at[1], r: Math.abs(mark.radius) * scale, "stroke-width": FINGER }));
      } else if (mark.kind === "BeltMark") {
        const { first, second } = mark, group = Symbols.element("g"), [f] = this.poses;
        const far = Plane.apart(...[first, second].map((wheel) => Plane.carry(f[wheel.link], wheel.centre)));
        group.append(...Symbols.band(far * scale, ...[first, second].map((wheel) => Math.abs(wheel.radius) * scale), mark.crossed));
        this.levels.wheels.append(group);
        this.bands.push({ first, second, group });
      } else if (mark.kind === "PitchLineMark" && mark.link !== frame) {
        const { foot } = this.look[mark.link].guides.find((each) => each.name === mark.name);
        const [low, high] = Bodies.range(mark, marks, this.poses, foot);
        const half = Math.max((10 * mm) / scale, 1.2 * Math.abs(mark.wheel.radius)), side = backOf(mark, marks, this.poses);
        const ends = [Math.min(0, low - half), Math.max(0, high + half)].map((at) => this.px(Plane.on(foot, mark.direction, at)));
        const way = down(mark.direction), left = Plane.times(Symbols.quarter(way), -side);
        this.symbol("wheels", mark.link, "rack bar", ends[0], way, { stop: ends[1], left });
        this.grip(mark.link, ...ends);
      }
    }
  }

  /** Slots, blocks, pins and points, in the order in which they hide one another. */
  sliders() {
    const { marks, poses, mm } = this, { frame } = this.page.data, pinned = new Set();
    for (const mark of marks.filter((each) => each.kind === "SlotMark" && each.link !== frame)) {
      const ends = Bodies.range(mark, marks, poses, mark.through).map((far) => this.px(Plane.on(mark.through, mark.direction, far)));
      this.symbol("sliders", mark.link, "slot opening", ends[0], down(mark.direction), { stop: ends[1] });
    }
    for (const mark of marks.filter((each) => each.kind === "SliderMark" && !this.tubes[each.name])) {
      const at = this.px(mark.position), way = down(mark.direction), far = (BLOCK_SIZE[0] / 2) * mm;
      this.symbol("sliders", mark.link, "block", at, way);
      if (mark.link !== frame) this.grip(mark.link, Plane.on(at, way, far), Plane.on(at, way, -far));
    }
    for (const { kind, link, at } of marks) if (kind === "MassCentreMark") this.symbol("sliders", link, "mass centre", this.px(at));
    for (const mark of marks) {
      const at = { PinMark: [mark.links?.[0], mark.positions?.[0]], SlotMark: [mark.pin_link, mark.pin_position] }[mark.kind];
      if (!at) continue;
      const name = mark.kind === "PinMark" ? mark.name : this.page.data.running[mark.name] ?? mark.name;
      if (pinned.has(name)) continue;
      pinned.add(name);
      this.symbol("pins", at[0], "pin", this.px(at[1]));
    }
    this.pinned = pinned;
    for (const [link, body] of Object.entries(this.look)) {
      for (const at of body.dots) this.part("pins", link, ...Symbols.symbolParts(link === frame ? "fixed dot" : "dot", mm, this.px(at)));
    }
  }

  /** A circle that letters keep off, as a polygon. */
  round(link, at, r) { this.avoid(link, ...Symbols.round(at, r)); }

  /** What stands still, clear of the links over their motion. */
  ground() {
    const { marks, poses, mm, scale, near } = this, { frame } = this.page.data, strokes = new Clearance(mm);
    const some = poses.filter((_, k) => k % Math.max(1, Math.ceil(poses.length / 8)) === 0);
    for (const frames of some) {
      for (const [link, a, b] of this.edges) {
        const f = frames[link], ends = [a, b].map(([x, y]) => [f.x * scale + f.cos * x + f.sin * y, -f.y * scale - f.sin * x + f.cos * y]);
        strokes.add(...ends, 1 / some.length);
      }
    }
    const { elements, lines, sides } = groundOf({ marks, poses, frame, mm, scale, near, strokes });
    this.part("ground", frame, ...elements);
    for (const ends of lines) this.avoid(frame, ...ends);
    for (const mark of marks) if (mark.kind === "WheelMark" && mark.link === frame) this.round(frame, this.px(mark.centre), Math.abs(mark.radius) * scale);
    this.sides = sides;
  }

  /** The arrow of the input that runs, on the link that it drives. */
  drive() {
    const { page, mm, marks } = this, given = page.data.inputs[page.running];
    this.levels.drives.replaceChildren();
    for (const key of [...this.parts.keys()]) if (key.startsWith("drives ")) this.parts.delete(key);
    this.edges.length = this.lasting;
    if (!given) return;
    const unit = page.data.inputs.map((_, k) => (k === page.running ? this.sense : 0));
    const moved = page.framesOf(page.linkage.state(unit, unit.map(() => 0)));
    const turn = (link) => (moved[link].v ? moved[link].v[2] : 0);
    const pin = marks.find((mark) => mark.kind === "PinMark" && (mark.name === given.pair || given.pair.startsWith(`${mark.name}:`)));
    if (pin && !given.slides) {
      const k = cheapest(pin.links.map((_, i) => i), (i) => -Math.abs(turn(pin.links[i]))), link = pin.links[k];
      if (!turn(link)) return;
      const at = pin.positions[k], ends = [...this.look[link].joints, ...this.look[link].dots];
      const far = cheapest(ends, (p) => -Plane.apart(p, at)) ?? at, lies = Math.atan2(far[1] - at[1], far[0] - at[0]);
      const sense = Math.sign(turn(link));
      const [radius, sweep] = [INPUT_ARC[0] * mm, INPUT_ARC[1]], start = lies + sense * 0.25;
      this.part("drives", link, ...Symbols.arc(this.px(at), radius, start + (sense * sweep) / 2, sweep, sense, mm));
      const spot = (part) => [radius * Math.cos(start + sense * sweep * part), -radius * Math.sin(start + sense * sweep * part)];
      this.avoid(link, ...[0, 0.25, 0.5, 0.75, 1].map((part) => Plane.plus(this.px(at), spot(part))));
    }
    const guide = marks.find((mark) => mark.kind === "GuideMark" && mark.name === given.pair);
    const block = guide && marks.find((mark) => mark.kind === "SliderMark" && mark.name === given.pair);
    if (block) {
      const [link, at, way] = block.link === page.data.frame ? [guide.link, guide.through, guide.direction] : [block.link, block.position, block.direction];
      // which way the driven link goes, seen from the other
      const sense = this.sense * (link === block.link ? 1 : -1), along = [sense * way[0], -sense * way[1]];
      const up = Symbols.quarter(along), hatched = this.sides[given.pair]; // beside the hatching there is no room
      const other = hatched ? -Math.sign(Plane.dot(up, hatched)) : up[1] < 0 ? 1 : -1;
      const side = Plane.times(up, other * INPUT_ARROW[0] * mm), middle = Plane.plus(this.px(at), side);
      const ends = [-0.5, 0.5].map((part) => Plane.on(middle, along, part * INPUT_ARROW[1] * mm));
      this.part("drives", link, ...Symbols.arrow(...ends, mm));
      this.avoid(link, ...ends);
    }
  }

  /** Show the input's arrow for another input, or the other sense. */
  turnArrow(sense) {
    this.sense = sense;
    if (!this.levels) return;
    this.drive();
    this.place();
  }

  scaleBar() {
    const { mm, width, height, scale } = this, { name, si } = this.page.data.units.length;
    const most = Math.min(0.3 * width, 40 * mm) / scale / si, round = STEP_VALUES.findLast((each) => each <= most);
    if (round === undefined) return; // no room
    const far = round * si * scale, x = 3 * mm, y = height - 3 * mm;
    const bar = Symbols.element("g", { class: "scale" });
    bar.append(
      Symbols.line("ground", [x, y - mm], [x, y + mm]), Symbols.line("ground", [x + far, y - mm], [x + far, y + mm]), Symbols.line("ground", [x, y], [x + far, y]),
      Symbols.element("text", { x: x + far + 2 * mm, y: y + 1.1 * mm, class: "measure", "font-size": Math.max(12, 3 * mm) }, `${+round.toPrecision(6)} ${name}`),
    );
    this.levels.ground.append(bar);
  }

  /** The letters of all points. */
  named() {
    const { mm, marks } = this, points = Object.entries(this.page.data.points);
    const blocks = new Set(marks.filter((mark) => mark.kind === "SliderMark" && !this.tubes[mark.name]).map((mark) => this.page.data.running[mark.name]));
    const items = points.map(([name]) => ({
      name, away: (blocks.has(name) ? BLOCK_SIZE[1] / 2 + 0.5 : this.pinned.has(name) ? PIN_RADIUS + 0.5 : 0.9) * mm,
    }));
    this.spots = points.map(([, { links, at }]) => [links[0], this.px(at[0].map((k) => this.page.size(k)))]);
    for (const { link, at, letter } of marks.filter((mark) => mark.kind === "MassCentreMark" && mark.letter)) {
      items.push({ name: letter, away: (MASS_CENTRE_RADIUS + 0.4) * mm });
      this.spots.push([link, this.px(at)]);
    }
    this.letters = new Letters(this.levels.letters, items, Math.max(13, 3.3 * mm));
  }

  /** A place of a link (px of its axes) on the screen. */
  screen(link, [x, y]) {
    const f = this.page.frames[link];
    return [this.origin[0] + f.x * this.scale + f.cos * x + f.sin * y, this.origin[1] - f.y * this.scale - f.sin * x + f.cos * y];
  }

  /** Move everything to where the mechanism is. */
  place(jump = false) {
    if (!this.levels) return;
    const { page, scale, origin } = this, matrices = Object.create(null);
    for (const [link, f] of Object.entries(page.frames)) {
      const c = f.cos.toFixed(6), s = f.sin.toFixed(6);
      matrices[link] = `matrix(${c},${(-f.sin).toFixed(6)},${s},${c},${(origin[0] + f.x * scale).toFixed(2)},${(origin[1] - f.y * scale).toFixed(2)})`;
    }
    for (const { group, link } of this.parts.values()) group.setAttribute("transform", matrices[link]);
    for (const { first, second, group } of this.bands) {
      const [p, q] = [first, second].map((wheel) => this.screen(wheel.link, this.px(wheel.centre)));
      group.setAttribute("transform", `translate(${p[0].toFixed(2)},${p[1].toFixed(2)}) rotate(${((Math.atan2(q[1] - p[1], q[0] - p[0]) * 180) / Math.PI).toFixed(3)})`);
    }
    this.springs.place();
    this.stroke();
    if (!this.inside() && !this.growing) return this.grow();
    const settled = this.letters.place(this.spots.map(([link, at]) => this.screen(link, at)), this.strokes, [this.width, this.height], jump);
    if (!settled && !this.settling) {
      this.settling = true;
      requestAnimationFrame(() => { this.settling = false; this.place(); });
    }
  }

  /** Where all strokes are on the screen, [x, y, x, y, ...]; sixty times a second, so nothing is made anew. */
  stroke() {
    const { page, scale, origin, edges } = this;
    const many = 4 * edges.length + this.springs.room;
    if (this.strokes?.length !== many) this.strokes = new Float64Array(many);
    for (let k = 0; k < edges.length; k++) {
      const f = page.frames[edges[k][0]], x = origin[0] + f.x * scale, y = origin[1] - f.y * scale;
      for (let end = 0; end < 2; end++) {
        const at = edges[k][end + 1];
        this.strokes[4 * k + 2 * end] = x + f.cos * at[0] + f.sin * at[1];
        this.strokes[4 * k + 2 * end + 1] = y - f.sin * at[0] + f.cos * at[1];
      }
    }
    this.springs.avoided(this.strokes, 4 * edges.length);
  }

  /** Whether everything is on the picture; several inputs together may leave what each alone covers. */
  inside() {
    const { strokes, width, height } = this;
    for (let k = 0; k < strokes.length; k += 2) {
      if (strokes[k] < 0 || strokes[k] > width || strokes[k + 1] < 0 || strokes[k + 1] > height) return false;
    }
    return true;
  }

  grow() {
    this.growing = true;
    this.poses.push(this.page.frames);
    this.slack += 0.05 * this.size; // not at every step anew
    this.build();
    this.growing = false;
  }
}
