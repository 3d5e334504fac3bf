"use strict";
/* The page's one state: where the mechanism is. What shows it listens; what changes it calls `moveTo`, `changeTo`,
   `take`. Events: "move" (another position), "size" (other dimensions, or another assembly: all that was remembered of
   the motion is void), "said" (a sentence for the reader), "course" (the whole motion is known, or void), "chosen" (other
   points and links are looked at), "shown" (other layers are), "view" (the drawing lies elsewhere on the screen, or is of another size),
   "tolerance" (dimensions may be off by more or less), "wanted" (what is wanted of the mechanism is elsewhere, or is missed
   by more or less), "acting" (loads, springs, masses are others). */

class Page {
  constructor(data, program) {
    this.data = data;
    this.linkage = new Linkage(data, program);
    this.listeners = { move: [], size: [], said: [], course: [], chosen: [], shown: [], view: [], tolerance: [], wanted: [], acting: [] };
    this.lifetime = new AbortController(); // ended where another page takes its place: of what it hears beside its own parts
    this.running = data.running ?? 0; // which input is moved
    this.given = data.inputs.map(({ velocity, acceleration }) => [velocity, acceleration]); // rates of the inputs, as they are written
    this.acting = null; // the numbers of what acts
    this.recording = false; // whether the motion is gone through for a film: nobody is to remember that
    this.besides = () => []; // places that the drawing is to show, too
    this.marks = []; // places (px) that layers mark, of which the drawing's letters keep clear
    this.wanted = null; // what is wanted of the mechanism, if anything is
    this.assembly = null; // the number of the assembly that it was moved from, if it is one of those listed
    this.update();
  }

  on(event, act) { this.listeners[event].push(act); }
  emit(event, ...more) { for (const act of this.listeners[event]) act(...more); }
  say(sentence) { this.emit("said", sentence); }

  /** Solve where everything is, at the rates of the inputs. */
  update() {
    this.state = this.stateOf(this.linkage, this.inputRates());
    this.frames = this.framesOf(this.state);
  }

  /** The state of a linkage at rates of its inputs, [[velocity, acceleration], ...]. */
  stateOf(linkage, rates) { return linkage.state(rates.map(([velocity]) => velocity), rates.map(([, acceleration]) => acceleration)); }

  /** Why there is no velocity and no acceleration here, as a sentence; "" where there are. */
  get undetermined() {
    const { length } = this.data.inputs, many = length > 1 ? "inputs" : "input";
    if (this.state.why && !length) return "the links could also move here: no velocity is determined";
    const told = { "dead point": `dead point of the ${many}: no velocity`, "change point": "change point: no velocity is determined" };
    return told[this.state.why] ?? "";
  }

  /** What the end of an input's range is called where no stop is met. */
  get endName() { return this.data.fixed ? "fixed at" : "dead point"; }

  /** Velocity and acceleration of every input, SI: as written, or the unit rate of the input that runs; 0 where nothing moves. */
  inputRates() {
    if (this.data.fixed) return this.given.map(() => [0, 0]);
    const { unitRate } = this;
    return unitRate === null ? this.given : this.given.map((_, k) => [k === this.running ? unitRate.velocity : 0, 0]);
  }

  /** The unit rate that is used while no input has a rate, {velocity, note}; null where one has, or moves by a law. */
  get unitRate() {
    const { unit_rates: unitRates } = this.data;
    return unitRates?.length && this.given.flat().every((rate) => rate === 0) ? unitRates[this.running] : null;
  }

  /** The state of a linkage by which forces are found: at rest while the unit rate is used, for which no force is given. */
  loadedState(linkage, state) { return this.unitRate === null ? state : this.stateOf(linkage, this.given); }

  /** Let another input run. */
  run(k) {
    this.running = k;
    if (this.unitRate !== null) this.update();
    this.emit("move");
  }

  /** Give the inputs other rates: all that was remembered of the motion is void. */
  give(rates) {
    this.given = rates.map((each) => [...each]);
    this.update();
    this.emit("size", { reached: 1, open: 0 });
    this.emit("move");
  }

  /** The links' own axes in a state: {x, y, angle, cos, sin, v: [vx, vy, w], a} by name. */
  framesOf({ w, w1, w2 }) {
    const { column, frame, links } = this.data;
    const found = Object.create(null); // a link may be named like something that every object has
    found[frame] = { x: 0, y: 0, angle: 0, cos: 1, sin: 0, v: w1 && [0, 0, 0], a: w2 && [0, 0, 0] };
    for (const link of links) {
      if (link === frame) continue;
      const at = column[link], [x, y, angle] = at.map((k) => w[k]);
      found[link] = {
        x, y, angle, cos: Math.cos(angle), sin: Math.sin(angle),
        v: w1 && at.map((k) => w1[k]), a: w2 && at.map((k) => w2[k]),
      };
    }
    return found;
  }

  /** The position of an input (rad or m). */
  input(k = this.running) { return this.linkage.u[k] * this.linkage.scale[k]; }

  /** Move an input to a position (rad or m), as far as it goes; whether it came there. */
  moveTo(position, k = this.running) {
    const u = Array.from(this.linkage.u);
    u[k] = position / this.linkage.scale[k];
    const { reached } = this.linkage.moveTo(u);
    this.update();
    this.emit("move");
    return reached === 1;
  }

  /** Change the dimensions (m), as far as the linkage goes together: {reached, open}. */
  changeTo(d) {
    const done = this.linkage.changeTo(d);
    this.update();
    this.emit("size", done);
    this.emit("move");
    return done;
  }

  /** Take an assembly of the file's dimensions and inputs: its unknowns. */
  take(z) {
    const { linkage, data } = this;
    linkage.d = data.dimensions.map((each) => each.value);
    linkage.measure();
    linkage.u = data.inputs.map((each, k) => each.position / linkage.scale[k]);
    linkage.z = Float64Array.from(z);
    this.update();
    this.emit("size", { reached: 1, open: 0 });
    this.emit("move");
  }

  /** Stand where another linkage of the same mechanism stands, with its dimensions. */
  adopt({ d, u, z }) {
    const { linkage } = this;
    Object.assign(linkage, { d: Array.from(d), u: Array.from(u), z: Float64Array.from(z), last: null, stop: null });
    linkage.measure();
    this.update();
    this.emit("size", { reached: 1, open: 0 });
    this.emit("move");
  }

  /** Where the mechanism is, and what is wanted of it, to come back to. */
  snapshot() {
    const { linkage: { d, u, z, last, stop }, running, assembly, given } = this;
    const wanted = this.wanted?.numbers() ?? [], acting = this.acting?.values ?? [];
    return { d: Array.from(d), u: Array.from(u), z: Float64Array.from(z), last, stop, of: z, running, assembly, wanted, acting, given, added: this.data.added };
  }

  /** Take the mechanism back to a snapshot, which has the same added. */
  restore({ d, u, z, last, stop, of, running, assembly, wanted, acting, given }) {
    const { linkage } = this;
    Object.assign(linkage, { d: Array.from(d), u: Array.from(u), z: Float64Array.from(z) });
    linkage.measure();
    // what is known of the way there holds for the very same unknowns
    linkage.last = last && last.to === of ? { ...last, to: linkage.z } : null;
    linkage.stop = stop && stop.to === of ? { ...stop, to: linkage.z } : null;
    Object.assign(this, { running, assembly, given });
    this.wanted?.take(wanted);
    this.acting?.take(acting);
    this.update();
    this.emit("size", { reached: 1, open: 0 });
    this.emit("move");
  }

  /** Fill in the numbers of the drawing: by how far displacements go, and the metres of a millimetre. */
  drawn(travel, perMm, values) { return this.linkage.program.drawn(this.linkage.d, travel, [perMm], values); }

  /** A number that depends on the dimensions. */
  size(at) { return this.linkage.sizes[at]; }

  /** Where a place of a link lies in the world (m), given by the places of its x and y. */
  place(link, [x, y], frames = this.frames, sizes = this.linkage.sizes) {
    const f = frames[link], a = sizes[x], b = sizes[y];
    return [f.x + f.cos * a - f.sin * b, f.y + f.sin * a + f.cos * b];
  }

  /** Position, velocity and acceleration of a named point, each [x, y] (SI); rates null where not determined. */
  point(name, frames = this.frames) {
    const { links, at } = this.data.points[name];
    return this.rates(links[0], this.place(links[0], at[0], frames), frames);
  }

  /** The same of the place of a link that lies at p in the world. */
  rates(link, p, frames = this.frames) {
    const f = frames[link], dx = p[0] - f.x, dy = p[1] - f.y;
    if (!f.v || !f.a) return { position: p, velocity: null, acceleration: null };
    const [vx, vy, w] = f.v, [ax, ay, e] = f.a;
    return {
      position: p,
      velocity: [vx - w * dy, vy + w * dx],
      acceleration: [ax - e * dy - w * w * dx, ay + e * dx - w * w * dy],
    };
  }
}
