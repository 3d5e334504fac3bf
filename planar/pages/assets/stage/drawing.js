"use strict";
/* The mechanism drawn as in a textbook: one group per link and height, moved by a transform; what stands still below,
   pins and letters above. `page.view` says where places in the world lie on the screen. */

const HEIGHTS = ["ground", "plates", "wheels", "tubes", "bars", "springs", "sliders", "pins", "drives", "letters"];
const LARGEST_MM = { page: 8, projected: 14 }; // px
const MARGIN = 12;     // mm about everything that moves
const EDGE = 1;        // mm about all strokes
const REFITS = 5;      // times at the most that room is made for strokes, of which some keep their size on paper
const OVERHANG = 2;    // mm: as far a block may go beyond what its guide is drawn for
const FOOT = 6;        // mm below for the bar of the scale
const MARK = 4;        // px: half of what a layer marks a place by
const FINGER = 24;     // px: as wide a link can be taken hold of

class Drawing {
  constructor(page, svg) {
    this.page = page;
    this.svg = svg;
    this.root = Symbols.element("g", { class: "mechanism" });
    svg.prepend(this.root);
    svg.setAttribute("aria-label", page.data.name);
    this.sense = 1; // of the input that runs, for its arrow
    this.lens = null; // {scale (px/m), at}: how near, and the place in the middle (m); null where everything is to be seen
    this.buttons = { head: () => 0, foot: () => 0 }; // px at the upper and the lower edge that buttons hide
    this.measure();
    page.on("size", () => this.renew());
    page.on("move", () => { if (!this.stale) this.place(); });
    page.on("shown", () => this.place(true));
    new ResizeObserver(() => this.fitWindow()).observe(svg);
  }

  /** Draw anew where the element has another size than what is drawn, so that `page.view` is that of the present layout. */
  fitWindow() {
    const { svg } = this;
    if (svg.clientWidth !== this.width || svg.clientHeight !== this.height) this.build();
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
    // what is held keeps its scale: where everything comes is looked at once it is let go
    if (!this.held || !this.poses) Object.assign(this, motions(this.page), { slack: 0 });
    this.build();
  }

  /** Keep scale and place while something is dragged, or fit what there is now. */
  hold(held) {
    this.held = held ? { scale: this.scale, origin: this.origin } : null;
    if (!held) this.renew();
  }

  /** Make all elements anew, for the sizes and the window that there are now. */
  build() {
    const { page, svg } = this, width = svg.clientWidth, height = svg.clientHeight;
    if (!width || !height) return;
    const largest = LARGEST_MM[document.documentElement.classList.contains("projected") ? "projected" : "page"];
    const mm = Math.max(3.2, Math.min(width / 150, height / 110, largest));
    Object.assign(this, { mm, width, height, strokes: new Strokes(page.data.scheme) });
    svg.style.setProperty("--mm", mm);
    svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    this.fit();
    this.compose();
    for (let k = 0; k < REFITS && this.refit(); k++) this.compose();
    this.scaleBar();
    this.named();
    page.emit("view");
    this.place(true);
  }

  /** All strokes for the scale that there is. */
  compose() {
    this.strokes.measure(this.page, this.poses, this.scale, this.mm);
    this.root.replaceChildren();
    this.levels = Object.fromEntries(HEIGHTS.map((name) => [name, Symbols.element("g", { class: name })]));
    this.root.append(...HEIGHTS.map((name) => this.levels[name]));
    this.levels.letters.setAttribute("pointer-events", "none");
    this.parts = new Map();
    this.edges = []; // [link, from, to] in px of the link's axes
    this.draw();
    this.lasting = this.edges.length;
    this.drive();
  }

  /** The scale (px/m) at which all positions fit, and where the world's origin lies. */
  fit() {
    const { mm, width, height, poses } = this, low = [Infinity, Infinity], high = [-Infinity, -Infinity];
    this.strokes.measure(this.page, poses, 1, mm); // of the links: what depends on the scale is not seen
    const places = this.page.data.scheme.extent.map(({ link, at, radius }) => [link, this.strokes.place(at), this.strokes.values[radius]]);
    places.push(...(this.page.data.added?.points ?? []).map(({ link, at }) => [link, at, 0]));
    for (const frames of poses) {
      for (const [link, place, r] of places) {
        const at = Plane.carry(frames[link], place);
        for (const k of [0, 1]) { low[k] = Math.min(low[k], at[k] - r); high[k] = Math.max(high[k], at[k] + r); }
      }
    }
    for (const at of [...(this.page.wanted?.spots() ?? []), ...(this.page.besides?.() ?? [])]) {
      for (const k of [0, 1]) { low[k] = Math.min(low[k], at[k]); high[k] = Math.max(high[k], at[k]); }
    }
    for (const k of [0, 1]) { low[k] -= this.slack; high[k] += this.slack; }
    const span = [high[0] - low[0], high[1] - low[1]], { head, foot, margin } = this.margins();
    const top = Math.max(margin, head + EDGE * mm), bottom = foot + margin, room = [width - 2 * margin, height - top - bottom];
    const scale = Math.min(room[0] / Math.max(span[0], 1e-9), room[1] / Math.max(span[1], 1e-9));
    this.scale = Math.min(scale, (0.6 * Math.min(...room)) / (0.02 * this.page.data.size)); // a single spot is not blown up
    this.fitted = this.scale;
    if (this.lens) ({ scale: this.scale } = this.lens);
    if (this.held) ({ scale: this.scale } = this.held); // what is dragged is not drawn away from the pointer
    const whole = [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2 + (0.5 * (top - bottom)) / this.scale];
    const [x, y] = this.lens?.at ?? whole;
    this.corners = [low, high];
    this.look(this.held?.origin ?? [width / 2 - x * this.scale, height / 2 + y * this.scale]);
  }

  /** Room for strokes that go farther than what they join, as racks do, in all positions; whether there was none. */
  refit() {
    if (this.lens || this.held) return false;
    const { mm, width, height, scale, origin, corners: [[left, bottom], [right, top]] } = this, edge = EDGE * mm, { head, foot, margin } = this.margins();
    const room = [width, height - foot], [low, high] = this.inked();
    const from = [Math.min(low[0] - edge, left * scale - margin), Math.min(Math.min(low[1], -top * scale) - edge - head, -top * scale - margin)];
    const to = [Math.max(high[0] + edge, right * scale + margin), Math.max(high[1] + edge, -bottom * scale + margin)];
    if ([0, 1].every((k) => from[k] + origin[k] >= -0.5 && to[k] + origin[k] <= room[k] + 0.5)) return false;
    const by = Math.min(1, ...[0, 1].map((k) => room[k] / (to[k] - from[k])));
    this.scale = this.fitted = by * scale;
    this.look([0, 1].map((k) => room[k] / 2 - (by * (from[k] + to[k])) / 2));
    return true;
  }

  /** px: what buttons and the bar of the scale take above and below, and what is left free about all places. */
  margins() {
    const { mm, height, buttons } = this, most = 0.2 * height;
    return { head: Math.min(buttons.head(), most), foot: Math.min(Math.max(FOOT * mm, buttons.foot()), most), margin: MARGIN * mm };
  }

  /** Make room beside buttons that have come. */
  settle() {
    const { head, foot } = this.margins(), { view } = this.page;
    if (view && (view.head !== head || view.foot !== foot)) this.build();
  }

  /** The corners of all strokes in all positions, in px from the world's origin. */
  inked() {
    const { edges, poses, scale } = this, low = [Infinity, Infinity], high = [-Infinity, -Infinity];
    for (const frames of poses) {
      for (const [link, ...ends] of edges) {
        const f = frames[link];
        for (const [x, y] of ends) {
          const at = [f.x * scale + f.cos * x + f.sin * y, -f.y * scale - f.sin * x + f.cos * y];
          for (const k of [0, 1]) { low[k] = Math.min(low[k], at[k]); high[k] = Math.max(high[k], at[k]); }
        }
      }
    }
    return [low, high];
  }

  /** Take a place of the world's origin on the screen. */
  look(origin) {
    const { mm, width, height } = this, { head, foot } = this.margins();
    this.origin = origin;
    this.page.view = {
      scale: this.scale, mm, width, height, head, foot, // head, foot: px that are not free above and below
      toScreen: ([x, y]) => [origin[0] + x * this.scale, origin[1] - y * this.scale],
      toWorld: ([x, y]) => [(x - origin[0]) / this.scale, (origin[1] - y) / this.scale],
    };
  }

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

  /** All strokes of the links, level by level. */
  draw() {
    const { levels } = this.page.data.scheme;
    for (const [level, strokes] of Object.entries(levels)) {
      if (level !== "springs") for (const stroke of strokes) this.stroke(level, stroke);
    }
    this.springs = new Springs(this, levels.springs);
  }

  /** A stroke of a link; letters keep off it, and by what moves the link can be taken. */
  stroke(level, stroke) {
    const { link } = stroke, held = link !== this.page.data.frame && !["pins", "drives"].includes(level);
    for (const { pen, element, spots } of this.strokes.made(stroke)) {
      this.part(level, link, element);
      for (let k = 1; k < spots.length; k++) this.edges.push([link, spots[k - 1], spots[k]]);
      if (!held || pen === "band") continue;
      const [tag, kind] = level === "plates" ? ["polygon", "grip area"] : ["polyline", "grip"];
      this.part("bars", link, Symbols.element(tag, { class: kind, points: Symbols.told(spots), "stroke-width": FINGER }));
    }
  }

  /** The arrow of the input that runs, on the link that it drives. */
  drive() {
    this.levels.drives.replaceChildren();
    for (const key of [...this.parts.keys()]) if (key.startsWith("drives ")) this.parts.delete(key);
    this.edges.length = this.lasting;
    const arrow = this.page.data.scheme.arrows[this.page.running]?.[this.sense > 0 ? 0 : 1];
    if (arrow && !this.page.data.fixed) this.stroke("drives", arrow);
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
    const { mm } = this, { letters } = this.page.data.scheme;
    const items = letters.map(({ text, clearance }) => ({ name: text, away: clearance * mm }));
    this.spots = letters.map(({ link, at }) => [link, this.strokes.px(at)]);
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
    this.springs.place();
    this.avoid();
    if (!this.growing && !this.held && (!this.covers() || (!this.lens && !this.inside()))) return this.grow();
    const settled = this.letters.place(this.spots.map(([link, at]) => this.screen(link, at)), this.avoided, [this.width, this.height], jump);
    if (!settled && !this.settling) {
      this.settling = true;
      requestAnimationFrame(() => { this.settling = false; this.place(); });
    }
  }

  /** Where all strokes and what layers mark are on the screen, [x, y, x, y, ...]; sixty times a second, so nothing is made anew. */
  avoid() {
    const { page, scale, origin, edges } = this, { marks } = page, strokes = 4 * edges.length + this.springs.room;
    const many = strokes + 4 * marks.length;
    if (this.avoided?.length !== many) this.avoided = new Float64Array(many);
    for (let k = 0; k < edges.length; k++) {
      const f = page.frames[edges[k][0]], x = origin[0] + f.x * scale, y = origin[1] - f.y * scale;
      for (let end = 0; end < 2; end++) {
        const at = edges[k][end + 1];
        this.avoided[4 * k + 2 * end] = x + f.cos * at[0] + f.sin * at[1];
        this.avoided[4 * k + 2 * end + 1] = y - f.sin * at[0] + f.cos * at[1];
      }
    }
    this.springs.avoided(this.avoided, 4 * edges.length);
    marks.forEach(([x, y], k) => this.avoided.set([x - MARK, y, x + MARK, y], strokes + 4 * k));
  }

  /** Whether everything is on the picture; several inputs together may leave what each alone covers. */
  inside() {
    const { avoided, width, height, page: { marks } } = this, strokes = avoided.length - 4 * marks.length;
    for (let k = 0; k < strokes; k += 2) {
      if (avoided[k] < 0 || avoided[k] > width || avoided[k + 1] < 0 || avoided[k + 1] > height) return false;
    }
    return true;
  }

  /** Whether guides and racks are long enough for where the mechanism is. */
  covers() { return this.strokes.cover(this.page.frames, OVERHANG); }

  /** Room for where the mechanism is, and a little more, so that it is not made at every step anew. */
  grow() {
    this.growing = true;
    if (this.covers()) {
      this.poses.push(this.page.frames);
      this.slack += 0.05 * this.page.data.size;
    } else this.poses.push(...motionsAhead(this.page));
    this.build();
    this.growing = false;
  }
}
