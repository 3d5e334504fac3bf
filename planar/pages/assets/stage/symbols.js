"use strict";
/* Strokes as SVG elements: lines, areas, and symbols of the table SYMBOLS that Python writes into a page. Places are [x, y] in px, y downwards; sizes are in mm of a textbook's figure, times `mm` px. */

const Symbols = (() => {
  const { minus, times, on, length, unit } = Plane;
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

  /** The strokes of a symbol at a place along a unit vector, as far as `stop` where it has two places: [{pen, element, spots}].
      `side` -1 mirrors it; `radius` (px) is a wheel's; `pen` is that of links, where another than usual draws. */
  function symbol(name, mm, at, way = [1, 0], { stop = at, side = 1, radius = 0, pen: own = "link" } = {}) {
    const whole = minus(stop, at), left = times(quarter(way), side);
    return SYMBOLS[name].flatMap(({ pen: usual, fill, closed, points, radius: more, share, length: step, end }) => {
      if (step !== undefined) return hatching(at, way, length(whole), mm, step, end, side);
      const pen = usual === "link" ? own : usual;
      if (points === undefined) {
        const r = share * radius + more * mm;
        return [{ pen, element: circle(pen, at, r, fill), spots: round(at, r, r > 3 * mm ? 24 : 8) }];
      }
      return [stroke(pen, points.map(([part, along, off]) => on(on(on(at, whole, part), way, along * mm), left, off * mm)), closed, fill)];
    });
  }

  /** The symbol "hatch" along a line, the last one `end` mm before where it stops, one every `step` mm. */
  function hatching(start, way, far, mm, step, end, side) {
    const count = far > 0 ? Math.max(1, Math.round(far / (step * mm) - 0.5)) : 0;
    return Array.from({ length: count }, (_, k) => symbol("hatch", mm, on(start, way, far - (k * step + end) * mm), way, { side })).flat();
  }

  /** A line through places, or an area. */
  function stroke(pen, spots, closed, fill) {
    return { pen, element: closed ? area(pen, fill, ...spots) : line(pen, ...spots), spots: closed ? [...spots, spots[0]] : spots };
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

  return { element, told, line, symbol, stroke, spring, torsionSpring, wrapped };
})();
