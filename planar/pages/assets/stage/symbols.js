"use strict";
/* Symbols of kinematic schemes as SVG elements: supports, rails, blocks, slots, cylinders, wheels, racks, bands.
   Places are [x, y] in px, y downwards; sizes are in mm of a textbook's figure, times `mm` px. */

const Symbols = (() => {
  const { plus, minus, times, on, length, unit } = Plane;
  const SVG = "http://www.w3.org/2000/svg";
  const PIN = 1.2, DOT = 0.75;           // radii
  const BLOCK = [7, 4];                  // length and height of a sliding block
  const STAND = 4.2, BASE = 7;           // from a fixed pin to its base line; the length of that
  const HATCH = 1.7;                     // the length of a stroke of hatching; as far they stand apart
  const RIM = 1.8;                       // from the pitch circle of an internal wheel to its rim
  const BAR = 2.4;                       // the height of a rack behind its pitch line
  const BORE = 4.4;                      // the width of a cylinder
  const MASS = 1.9;                      // the radius of a centre of mass
  const WIDE = 1.9;                      // half the width of a spring
  const SPIRAL = [1.9, 4.6], ROUNDS = 2; // least and greatest radius of a torsional spring, and its turns
  const VANE = [5.4, 7.8, 1.9];          // radii of a torsional damper, and how far it reaches round (rad)
  const SLOT = 3.6;                      // the width of a slot

  /** An SVG element; attributes and texts are set as such, never parsed. */
  function element(name, attributes = {}, text = null) {
    const made = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    if (text !== null) made.textContent = text;
    return made;
  }

  const quarter = (way) => [way[1], -way[0]]; // anticlockwise, as y is downwards
  const short = (value) => Math.round(value * 100) / 100;
  const told = (spots) => spots.map(([x, y]) => `${short(x)},${short(y)}`).join(" ");

  const line = (pen, ...spots) => element("polyline", { class: pen, points: told(spots) });
  const area = (pen, ...spots) => element("polygon", { class: pen, points: told(spots) });
  const circle = (pen, [x, y], r) => element("circle", { class: pen, cx: short(x), cy: short(y), r: short(r) });

  /** Strokes at 45 degrees from a line to the side to which the unit vector `side` points. */
  function hatching(start, stop, side, mm) {
    const whole = minus(stop, start), far = length(whole), gap = HATCH * mm;
    if (!(far > 0)) return [];
    const way = times(whole, 1 / far), step = times(minus(side, way), gap / Math.SQRT2);
    const count = Math.max(1, Math.round((far - gap / 2) / gap)), first = far - (count - 1) * gap;
    const strokes = [];
    for (let k = 0; k < count; k++) {
      const foot = on(start, way, first + gap * k - 0.2 * mm), end = plus(foot, step);
      strokes.push(`M${told([foot])}L${told([end])}`);
    }
    return [element("path", { class: "hatch", d: strokes.join("") })];
  }

  /** A line of what does not move, hatched on one side. */
  const rail = (start, stop, side, mm) => [...hatching(start, stop, side, mm), line("ground", start, stop)];

  /** A fixed pin's stand: a triangle from the pin towards `down`, on a hatched base line. */
  function support(at, down, mm) {
    const across = quarter(down), foot = on(at, down, STAND * mm);
    return [
      area("ground", on(foot, across, -2.4 * mm), at, on(foot, across, 2.4 * mm)),
      ...rail(on(foot, across, (-BASE / 2) * mm), on(foot, across, (BASE / 2) * mm), down, mm),
    ];
  }

  const pin = (at, mm) => circle("pin", at, PIN * mm);
  const dot = (at, mm) => circle("dot", at, DOT * mm);

  /** A sliding block along a unit vector. */
  function block(at, way, mm) {
    const along = times(way, (BLOCK[0] / 2) * mm), up = times(quarter(way), (BLOCK[1] / 2) * mm);
    return area("block", minus(minus(at, along), up), minus(plus(at, along), up), plus(plus(at, along), up), plus(minus(at, along), up));
  }

  /** A slot from one place of its pin to another, its ends round. */
  function opening(start, stop, way, mm) {
    const across = times(quarter(way), (SLOT / 2) * mm), r = short((SLOT / 2) * mm);
    const [a, b, c, d] = [minus(start, across), minus(stop, across), plus(stop, across), plus(start, across)].map((p) => told([p]));
    return element("path", { class: "slot", d: `M${a}L${b}A${r},${r},0,0,0,${c}L${d}A${r},${r},0,0,0,${a}Z` });
  }

  /** A cylinder from its base to its mouth. */
  function cylinder(base, mouth, way, mm) {
    const across = times(quarter(way), (BORE / 2) * mm);
    return area("cylinder", minus(base, across), minus(mouth, across), plus(mouth, across), plus(base, across));
  }

  /** A piston across its cylinder with its rod to the end. */
  function piston(at, end, way, mm) {
    const across = times(quarter(way), (BORE / 2 - 0.7) * mm);
    return [line("bar", minus(at, across), plus(at, across)), line("bar", at, end)];
  }

  /** A bar on one side of a pitch line, and the pitch line a little longer than it. */
  function rack(start, stop, back, mm) {
    const behind = times(back, BAR * mm), over = times(unit(minus(stop, start)), 2 * mm);
    return [area("rack", start, stop, plus(stop, behind), plus(start, behind)), line("pitch", minus(start, over), plus(stop, over))];
  }

  /** A pitch circle; of an internal wheel (radius below zero) also its rim. `fixed` wheels are hatched. */
  function wheel(at, radius, fixed, mm) {
    const made = [circle("pitch", at, Math.abs(radius))];
    if (radius < 0) made.push(circle(fixed ? "ground" : "rim", at, Math.abs(radius) + RIM * mm));
    // a moving circle alone would not show that it turns
    if (!fixed) made.push(line("pitch tick", on(at, [1, 0], 0.8 * Math.abs(radius)), on(at, [1, 0], Math.abs(radius))));
    return fixed ? [...made, ...rimHatching(at, radius, mm)] : made;
  }

  /** Hatching in three places inside the circle of a wheel, of an internal wheel outside its rim. */
  function rimHatching(at, radius, mm) {
    const inner = radius > 0, rim = inner ? radius : Math.abs(radius) + RIM * mm, gap = HATCH * mm;
    if (inner && rim < 3 * gap) return [];
    const arc = Math.min(Math.PI / 5, (12 * mm) / rim), count = Math.max(2, Math.ceil((arc * rim) / gap)), strokes = [];
    for (const middle of [90, 210, 330]) {
      for (let k = 0; k <= count; k++) {
        const angle = (middle * Math.PI) / 180 + arc * (k / count - 0.5), out = [Math.cos(angle), -Math.sin(angle)];
        const foot = on(at, out, rim), step = plus(times(out, inner ? -1 : 1), quarter(out));
        strokes.push(`M${told([foot])}L${told([on(foot, step, gap / Math.SQRT2)])}`);
      }
    }
    return [element("path", { class: "hatch", d: strokes.join("") })];
  }

  /** A loop round two wheels, the first at the origin, the second at [far, 0]: their circles and common tangents. */
  function band(far, r, s, crossed) {
    const made = [circle("band", [0, 0], r), circle("band", [far, 0], s)], other = crossed ? -s : s;
    if (far <= 0 || Math.abs(r - other) > far) return made;
    const lean = Math.acos((r - other) / far);
    for (const sign of [1, -1]) {
      const out = [Math.cos(lean), -sign * Math.sin(lean)];
      made.push(line("band", times(out, r), on([far, 0], out, other)));
    }
    return made;
  }

  /** An arc with an arrow head about a place; `sense` 1: anticlockwise. Angles as drawn on paper (y upwards). */
  function arc(at, radius, middle, sweep, sense, mm) {
    const spot = (angle) => [at[0] + radius * Math.cos(angle), at[1] - radius * Math.sin(angle)];
    const tail = middle - (sense * sweep) / 2, tip = middle + (sense * sweep) / 2, back = (2.7 * mm) / radius;
    const neck = spot(tip - sense * 0.75 * back), r = short(radius);
    const curve = element("path", { class: "drive", d: `M${told([spot(tail)])}A${r},${r},0,0,${sense > 0 ? 0 : 1},${told([neck])}` });
    return [curve, head(spot(tip - sense * back), spot(tip), mm)];
  }

  /** A straight arrow. */
  function arrow(tail, tip, mm) {
    const way = unit(minus(tip, tail));
    return [line("drive", tail, on(tip, way, -2 * mm)), head(on(tip, way, -2.7 * mm), tip, mm)];
  }

  function head(foot, tip, mm) {
    const across = times(quarter(unit(minus(tip, foot))), 0.6 * mm);
    return area("drive-head", tip, plus(foot, across), minus(foot, across));
  }

  /** A spring or a damper between two places, of its paths [[part of the length, mm off the line], ...], as a path's d. */
  function coil(start, stop, paths, mm) {
    const whole = minus(stop, start), left = quarter(unit(whole));
    return paths.map((path) => `M${told(path.map(([part, off]) => on(on(start, whole, part), left, off * mm)))}`).join("");
  }

  /** An angle less whole turns, from -half a turn to half a turn. */
  function wrapped(turn) { return turn - 2 * Math.PI * Math.round(turn / (2 * Math.PI)); }

  /** A torsional spring, or damper, about a pin between the directions of two links, as planar.drawing.scheme.symbols has it. */
  function spiral(at, first, second, wound, symbol, mm) {
    const spot = (turn, radius) => [at[0] + radius * mm * Math.cos(turn), at[1] - radius * mm * Math.sin(turn)], paths = [];
    if (symbol !== "damper") {
      const [low, high] = SPIRAL, far = 2 * Math.PI * ROUNDS + wrapped(second - first - wound) + wound;
      paths.push(Array.from({ length: 61 }, (_, k) => spot(first + (far * k) / 60, high + ((low - high) * k) / 60)));
    }
    if (symbol !== "spring") {
      const [low, high, sweep] = VANE, turns = Array.from({ length: 13 }, (_, k) => first - sweep / 2 + (sweep * k) / 12);
      const vane = first + (wound * sweep) / (2.5 * Math.PI);
      paths.push([...turns.map((turn) => spot(turn, low)), ...turns.reverse().map((turn) => spot(turn, high))]);
      paths.push([spot(vane, PIN), spot(vane, high - 0.5)]);
    }
    return paths.map((path) => `M${told(path)}`).join("");
  }

  /** A centre of mass: a circle of which two opposite quarters are black. */
  function massCentre(at, mm) {
    const r = short(MASS * mm), [x, y] = at.map(short);
    const quarters = `M${x},${y}L${short(x + r)},${y}A${r},${r},0,0,0,${x},${short(y - r)}ZM${x},${y}L${short(x - r)},${y}A${r},${r},0,0,0,${x},${short(y + r)}Z`;
    return [circle("mass", at, MASS * mm), element("path", { class: "quarters", d: quarters })];
  }

  return {
    coil, spiral, wrapped, massCentre, MASS, WIDE,
    element, quarter, told, line, area, rail, support, pin, dot, block, opening, cylinder, piston, rack, wheel, rimHatching,
    band, arc, arrow, PIN, BLOCK, STAND, BASE, HATCH, SLOT, BAR,
  };
})();
