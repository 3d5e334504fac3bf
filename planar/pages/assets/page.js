"use strict";
/* The page's one state: where the mechanism is. What shows it listens; what changes it calls `moveTo`, `changeTo`,
   `take`. Events: "move" (another position), "size" (other dimensions, or another assembly: all that was remembered of
   the motion is void), "said" (a sentence for the reader). */

class Page {
  constructor(data, program) {
    this.data = data;
    this.linkage = new Linkage(data, program);
    this.listeners = { move: [], size: [], said: [] };
    this.running = 0; // which input is moved
    this.update();
  }

  on(event, act) { this.listeners[event].push(act); }
  emit(event, ...more) { for (const act of this.listeners[event]) act(...more); }
  say(sentence) { this.emit("said", sentence); }

  /** Solve where everything is, with the rates of the inputs as the file has them. */
  update() {
    const { inputs, column, frame } = this.data;
    this.state = this.linkage.state(inputs.map((each) => each.velocity), inputs.map((each) => each.acceleration));
    const { w, w1, w2 } = this.state;
    this.frames = { [frame]: { x: 0, y: 0, angle: 0, cos: 1, sin: 0, v: [0, 0, 0], a: [0, 0, 0] } };
    for (const link of this.data.links) {
      if (link === frame) continue;
      const at = column[link], [x, y, angle] = at.map((k) => w[k]);
      this.frames[link] = {
        x, y, angle, cos: Math.cos(angle), sin: Math.sin(angle),
        v: w1 && at.map((k) => w1[k]), a: w2 && at.map((k) => w2[k]),
      };
    }
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

  /** Take another assembly, the inputs where they are: its unknowns. */
  take(z) {
    this.linkage.z = Float64Array.from(z);
    this.update();
    this.emit("size", { reached: 1, open: 0 });
    this.emit("move");
  }

  /** A number that depends on the dimensions. */
  size(at) { return this.linkage.sizes[at]; }

  /** Where a place of a link lies in the world (m), given by the places of its x and y. */
  place(link, [x, y]) {
    const f = this.frames[link], a = this.size(x), b = this.size(y);
    return [f.x + f.cos * a - f.sin * b, f.y + f.sin * a + f.cos * b];
  }

  /** Position, velocity and acceleration of a named point, each [x, y] (SI); rates null where not determined. */
  point(name) {
    const { links, at } = this.data.points[name], f = this.frames[links[0]];
    const p = this.place(links[0], at[0]), dx = p[0] - f.x, dy = p[1] - f.y;
    if (!f.v || !f.a) return { position: p, velocity: null, acceleration: null };
    const [vx, vy, w] = f.v, [ax, ay, e] = f.a;
    return {
      position: p,
      velocity: [vx - w * dy, vy + w * dx],
      acceleration: [ax - e * dy - w * w * dx, ay + e * dx - w * w * dy],
    };
  }
}
