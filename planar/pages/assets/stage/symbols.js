"use strict";
/* Strokes as SVG elements: symbols of the table SYMBOLS that Python writes into a page, placed; what is counted by its
   length. Places are [x, y] in px, y downwards; sizes are in mm of a textbook's figure, times `mm` px. */

const Symbols = (() => {
  const { plus, minus, times, on, length, unit } = Plane;
  const SVG = "http://www.w3.org/2000/svg";

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
  const penned = (pen, fill = "none") => `pen-${pen} fill-${fill}`;

  const line = (pen, ...spots) => element("polyline", { class: penned(pen), points: told(spots) });
  const area = (pen, fill, ...spots) => element("polygon", { class: penned(pen, fill), points: told(spots) });
  const circle = (pen, [x, y], r, fill) => element("circle", { class: penned(pen, fill), cx: short(x), cy: short(y), r: short(r) });

  /** Spots all round a circle. */
  function round([x, y], r, count = 24) {
    return Array.from({ length: count + 1 }, (_, k) => [x + r * Math.cos((2 * Math.PI * k) / count), y + r * Math.sin((2 * Math.PI * k) / count)]);
  }

  /** The strokes of a symbol at a place along a unit vector, as far as `stop` where it has two places: [{element, spots}].
      `left` where it may be mirrored; `radius` (px) of a wheel; `link` the pen of links, where another than usual draws. */
  function symbol(name, mm, at, way = [1, 0], { stop = at, left = quarter(way), radius = 0 } = {}) {
    const whole = minus(stop, at);
    return SYMBOLS[name].map(({ pen, fill, closed, points, radius: more, share }) => {
      if (points === undefined) {
        const r = share * radius + more * mm;
        return { pen, element: circle(pen, at, r, fill), spots: round(at, r, r > 3 * mm ? 24 : 8) };
      }
      const spots = points.map(([part, along, off]) => on(on(on(at, whole, part), way, along * mm), left, off * mm));
      return { pen, element: closed ? area(pen, fill, ...spots) : line(pen, ...spots), spots: closed ? [...spots, spots[0]] : spots };
    });
  }

  const symbolParts = (...given) => symbol(...given).map((each) => each.element);

  /** Strokes at 45 degrees from a line to the side to which the unit vector `side` points, as far apart as they are long. */
  function hatching(start, stop, side, mm) {
    const whole = minus(stop, start), far = length(whole), gap = HATCH_LENGTH * mm, way = unit(whole);
    if (!(far > 0)) return [];
    const count = Math.max(1, Math.round((far - gap / 2) / gap));
    const feet = Array.from({ length: count }, (_, k) => on(start, way, far - k * gap - 0.2 * mm));
    return feet.flatMap((foot) => symbolParts("hatch", mm, foot, way, { left: side }));
  }

  /** A line of what does not move, hatched on one side. */
  const rail = (start, stop, side, mm) => [...hatching(start, stop, side, mm), line("ground", start, stop)];

  /** A pitch circle; of an internal wheel (radius below zero) also its rim. `fixed` wheels are hatched, moving ones marked:
      a circle alone would not show that it turns. */
  function wheel(at, radius, fixed, mm) {
    const names = ["wheel", ...(radius < 0 ? [fixed ? "fixed rim" : "rim"] : [])], r = Math.abs(radius);
    const made = names.flatMap((name) => symbolParts(name, mm, at, [1, 0], { radius: r }));
    return [...made, ...(fixed ? rimHatching(at, radius, mm) : wheelMark(at, r, mm))];
  }

  const wheelMark = (at, radius, mm) => symbolParts("wheel mark", mm, at, [1, 0], { stop: [at[0] + radius, at[1]] });

  /** Hatching in three places inside the circle of a wheel, of an internal wheel outside its rim. */
  function rimHatching(at, radius, mm) {
    const inner = radius > 0, rim = inner ? radius : Math.abs(radius) + RIM_WIDTH * mm, gap = HATCH_LENGTH * mm;
    if (inner && rim < 3 * gap) return [];
    const arc = Math.min(Math.PI / 5, (12 * mm) / rim), count = Math.max(2, Math.ceil((arc * rim) / gap));
    return [90, 210, 330].flatMap((middle) => Array.from({ length: count + 1 }, (_, k) => {
      const angle = (middle * Math.PI) / 180 + arc * (k / count - 0.5), out = [Math.cos(angle), -Math.sin(angle)];
      return symbolParts("hatch", mm, on(at, out, rim), times(quarter(out), -1), { left: times(out, inner ? -1 : 1) })[0];
    }));
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
    const tail = middle - (sense * sweep) / 2, tip = middle + (sense * sweep) / 2, back = (ARROW_HEAD[0] * mm) / radius;
    const neck = spot(tip - sense * 0.75 * back), r = short(radius);
    const curve = element("path", { class: penned("input"), d: `M${told([spot(tail)])}A${r},${r},0,0,${sense > 0 ? 0 : 1},${told([neck])}` });
    return [curve, head(spot(tip - sense * back), spot(tip), mm)];
  }

  /** A straight arrow. */
  function arrow(tail, tip, mm) {
    const way = unit(minus(tip, tail));
    return [line("input", tail, on(tip, way, -0.75 * ARROW_HEAD[0] * mm)), head(on(tip, way, -ARROW_HEAD[0] * mm), tip, mm)];
  }

  function head(foot, tip, mm) {
    const across = times(quarter(unit(minus(tip, foot))), (ARROW_HEAD[1] / 2) * mm);
    return element("polygon", { class: "head", points: told([tip, plus(foot, across), minus(foot, across)]) });
  }

  /** Strokes as a path's d. */
  const drawn = (strokes) => strokes.map((spots) => `M${told(spots)}`).join("");

  /** A spring or a damper between two places, as a path's d. */
  const spring = (name, start, stop, mm) => drawn(symbol(name, mm, start, unit(minus(stop, start)), { stop }).map((each) => each.spots));

  /** An angle less whole turns, from -half a turn to half a turn. */
  function wrapped(turn) { return turn - 2 * Math.PI * Math.round(turn / (2 * Math.PI)); }

  /** A torsional symbol about a pin between the directions of two links, as a path's d; its coils are `wound`. */
  function torsionSpring(name, at, first, second, wound, mm) {
    const apart = wrapped(second - first - wound);
    return drawn(SYMBOLS[name].map(({ turned }) => turned.map(([angle, a, b, radius]) => {
      const turn = first + angle + a * wound + b * apart;
      return [at[0] + radius * mm * Math.cos(turn), at[1] - radius * mm * Math.sin(turn)];
    })));
  }

  return { element, quarter, told, line, area, symbol, symbolParts, round, rail, wheel, wheelMark, rimHatching, band, arc, arrow, spring, torsionSpring, wrapped };
})();
