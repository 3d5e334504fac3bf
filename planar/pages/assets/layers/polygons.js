"use strict";
/* The velocity and the acceleration polygon beside the drawing: the points and strokes that the page carries, evaluated
   and drawn to a round scale. */

const SMALL = 0.4; // of the sheet: a polygon smaller than that gets a scale of its own

function polygon(rate) {
  const { word } = RATES[rate], title = `${word[0].toUpperCase()}${word.slice(1)} polygon`;
  return {
    key: `${rate}-polygon`,
    label: title,
    beside(layers, part) {
      const { page } = layers, [width, height] = POLYGON_SHEET.size;
      htmlPart("h2", {}, part, title);
      const svg = svgPart("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": `${word} polygon` }, part);
      const none = htmlPart("p", { class: "none", hidden: "", style: `aspect-ratio: ${width} / ${height}` }, part);
      const which = chooser(part, "Scale for", [["now", "this position"], ["all", "the whole motion"]]);
      which.addEventListener("change", () => layers.draw());
      const state = { stood: new Map(), which, fit: null };
      return { draw: () => {
        svg.style.display = ""; // what is not shown has no size
        const { told, why } = drawPolygon(page, svg, rate, state);
        if (why) svg.style.display = "none";
        none.hidden = !why;
        none.textContent = `None: ${why}`;
        return told;
      } };
    },
  };
}

/** Draw it: {told: a sentence on it, why: why there is none}. */
function drawPolygon(page, svg, rate, state) {
  svg.replaceChildren();
  const values = polygonPoints(page, rate), { vertices, strokes, legends } = page.data.polygons;
  if (values === null) return { told: "", why: page.undetermined || "no rates are determined" };
  const fit = polygonFit(page, svg, rate, values, state);
  if (fit === null) return { told: "", why: "everything is at rest at the inputs' rates" };
  const ink = new Ink(svg, PANEL_MM), spot = ([x, y]) => [fit.pole[0] + x * fit.px, fit.pole[1] - y * fit.px];
  const apart = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]) > 2, drawn = new Set();
  let ends = false;
  for (const stroke of strokes) {
    const [from, to] = [stroke.from, stroke.to].map((k) => spot(values[k]));
    // each stroke once, whichever links have it
    const name = [from, to].map((each) => each.map((part) => Math.round(part * 4)).join()).sort().join("|");
    if (drawn.has(name)) continue;
    drawn.add(name);
    if (stroke.kind === "image") {
      ink.line([from, to], "image");
      ink.keepOff(from, to);
      continue;
    }
    const bend = rate === "acceleration" && stroke.end ? spot(centripetalEnd(page, stroke, values)) : to;
    if (apart(from, bend) && apart(bend, to)) {
      ink.arrow(from, bend, `arrow ${rate} part`);
      ink.arrow(bend, to, `arrow ${rate} part`);
      ink.letter(bend, [stroke.end], "letter");
      ends = true;
    }
    ink.arrow(from, to, `arrow ${stroke.kind} ${rate}`);
  }
  ink.dot(fit.pole, POLE_RADIUS, `pole ${rate}`);
  const places = [];
  values.forEach((value, k) => {
    const at = spot(value), there = places.find((each) => !apart(each.at, at));
    if (there) there.letters.push(vertices[k].letter);
    else places.push({ at, letters: [vertices[k].letter].filter(Boolean) });
  });
  const index = rate === "acceleration" ? "1" : "";
  for (const place of places) {
    const { at, letters } = place, pole = place === places[0];
    if (!pole) ink.dot(at, DOT_RADIUS, `place ${rate}`);
    ink.keepClear(at, 3);
    const text = fewNames(letters, POLYGON_LETTERS).map((letter, k) => [k ? `, ${letter}` : letter, letter === "…" ? "" : index]);
    ink.letter(at, text, "letter", { away: pole ? [1, 0] : [at[0] - fit.pole[0], at[1] - fit.pole[1]], key: letters[0] });
  }
  ink.set(state.stood, [0, 0, ...POLYGON_SHEET.size]);
  return { told: [fit.told, ...legends[rate][Number(ends)]].join("; "), why: "" };
}

/** Where the points of a polygon are, in m/s or m/s²; null where rates are not determined. */
function polygonPoints(page, rate) {
  const found = page.data.polygons.vertices.map(({ fixed, point, link, over }) => {
    if (fixed) return [0, 0];
    return (link === undefined ? page.point(point) : page.rates(link, page.point(over).position))[rate];
  });
  return found.includes(null) ? null : found;
}

/** Where the centripetal part of a relative acceleration ends: what it would be if its link turned steadily. */
function centripetalEnd(page, { link, from, to }, values) {
  const { x, y, angle, cos, sin, v, a } = page.frames[link], steady = { [link]: { x, y, angle, cos, sin, v, a: [a[0], a[1], 0] } };
  const [one, other] = [from, to].map((k) => {
    const { point, over } = page.data.polygons.vertices[k];
    return page.rates(link, page.point(point ?? over).position, steady).acceleration;
  });
  return values[from].map((each, axis) => each + other[axis] - one[axis]);
}

/** The scale and the pole's place: for the whole motion, or those of the position before while the polygon is in the
    picture and not small; beside a dead point, where rates outgrow the motion's scale, always those of the position. */
function polygonFit(page, svg, rate, values, state) {
  const { course } = page, { unit, parts } = RATES[rate], { size: [width, height], border } = POLYGON_SHEET;
  const room = ([x0, y0, x1, y1]) => Math.max((x1 - x0) / (width - 2 * border), (y1 - y0) / (height - 2 * border));
  const now = boxOf(values.map(([x]) => x), values.map(([, y]) => y));
  if (!(room(now) * width > AXIS.flat * greatestNumbers(page)[unit])) return null; // zero to round-off
  // a centimetre is one of the screen's, however wide the sheet is shown
  const zoom = svg.getScreenCTM()?.a || 1;
  if (state.zoom !== zoom) Object.assign(state, { zoom, fit: null });
  const fitted = (box) => {
    const { px: onScreen, told } = roundScale(page, room(box) / zoom, 1, unitOf(page, unit)), px = onScreen / zoom;
    return { px, told, pole: [width / 2 - ((box[0] + box[2]) / 2) * px, height / 2 + ((box[1] + box[3]) / 2) * px] };
  };
  const fits = ({ px, pole }) => values.every(([x, y]) => {
    const [X, Y] = [pole[0] + x * px, pole[1] - y * px], edge = border / 2;
    return X > edge && X < width - edge && Y > edge && Y < height - edge;
  });
  if (state.which.value === "all" && course !== null && course.calm(parts).length) {
    const whole = course.keep(`${rate} polygon ${zoom}`, () => {
      const xs = [0], ys = [0];
      for (const name of Object.keys(page.data.points)) {
        const columns = course.point(name);
        for (const i of course.calm(parts)) { xs.push(columns[parts[0]][i]); ys.push(columns[parts[1]][i]); }
      }
      return fitted(boxOf(xs, ys));
    });
    if (fits(whole)) return whole;
  }
  if (state.fit === null || !fits(state.fit) || room(now) * state.fit.px < SMALL) state.fit = fitted(now);
  return state.fit;
}

function boxOf(xs, ys) {
  const least = (list) => list.reduce((a, b) => Math.min(a, b)), most = (list) => list.reduce((a, b) => Math.max(a, b));
  return [least(xs), least(ys), most(xs), most(ys)];
}
