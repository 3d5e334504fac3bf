"use strict";
/* The velocity and the acceleration polygon beside the drawing, one general rule for every mechanism: from the pole an
   arrow to the image of each joint of a link that has a point at rest, or that slides on the frame; between the images
   of a link's joints the relative vectors, of accelerations with their centripetal and tangential parts; the image of
   a whole link dashed; below what slides the guide's own point (B′), with the relative velocity along it. */

const SHEET = [400, 330];     // px
const BORDER = 34;             // px round a polygon, for its letters
const SMALL = 0.4;            // of the sheet: a polygon smaller than that gets a scale of its own
const MANY = 6;               // of more letters at one place only the first are shown

function polygon(rate) {
  const { word } = RATES[rate];
  return {
    key: `${rate}-polygon`,
    label: `${word[0].toUpperCase()}${word.slice(1)} polygon`,
    beside(layers, part) {
      const { page } = layers;
      htmlPart("h2", {}, part, `${word[0].toUpperCase()}${word.slice(1)} polygon`);
      const svg = svgPart("svg", { viewBox: `0 0 ${SHEET[0]} ${SHEET[1]}`, role: "img", "aria-label": `${word} polygon` }, part);
      const which = chooser(part, "Scale for", [["now", "this position"], ["all", "the whole motion"]]);
      which.addEventListener("change", () => layers.draw());
      const state = { stood: new Map(), which, fit: null };
      return { draw: () => drawPolygon(page, svg, rate, state) };
    },
  };
}

function drawPolygon(page, svg, rate, state) {
  svg.replaceChildren();
  const found = images(page, rate);
  if (found === null) return page.undetermined;
  const fit = polygonFit(page, svg, rate, found, state);
  if (fit === null) return "everything is at rest at the inputs' rates";
  const ink = new Ink(svg, 1), spot = ([x, y]) => [fit.pole[0] + x * fit.px, fit.pole[1] - y * fit.px];
  let ends = false;
  const drawn = new Set(), name = (a, b) => [a, b].map((v) => v.map((part) => Math.round(part * fit.px * 4)).join()).sort().join("|");
  // each stroke once, whichever links have it
  const once = (a, b) => { const key = name(a, b); if (drawn.has(key)) return false; drawn.add(key); return true; };
  for (const { from, to, absolute, normal, parts } of found.vectors) {
    if (!once(from, to)) continue;
    if (normal !== null) {
      const [tail, bend, tip] = [from, normal, to].map(spot), long = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]) > 2;
      if (long(tail, bend) && long(bend, tip)) {
        ink.arrow(tail, bend, `arrow part ${rate}`);
        ink.arrow(bend, tip, `arrow part ${rate}`);
        ink.letter(bend, [parts], "letter");
        ends = true;
      }
    }
    ink.arrow(spot(from), spot(to), `arrow ${absolute ? "" : "relative"} ${rate}`);
  }
  for (const [a, b] of found.sides) {
    if (!once(a, b)) continue;
    ink.line([spot(a), spot(b)], "image");
    ink.keepOff(spot(a), spot(b));
  }
  ink.dot(fit.pole, 3, `pole ${rate}`);
  const places = new Map();
  for (const { letter, at } of found.letters) {
    const there = spot(at), key = [...places.keys()].find((each) => Math.hypot(each[0] - there[0], each[1] - there[1]) < 2) ?? there;
    places.set(key, [...(places.get(key) ?? []), letter]);
  }
  const pole = [...places.keys()].find((each) => Math.hypot(each[0] - fit.pole[0], each[1] - fit.pole[1]) < 2);
  if (pole === undefined) places.set(fit.pole, ["o"]);
  for (const [at, letters] of places) {
    if (at !== pole) ink.dot(at, 1.6, `place ${rate}`);
    ink.keepClear(at, 3);
    const few = letters.length > MANY ? letters.slice(0, MANY - 1) : letters, index = rate === "acceleration" ? "1" : "";
    const text = few.map((letter, k) => [k ? `, ${letter}` : letter, index]);
    if (few.length < letters.length) text.push([", …", ""]);
    const away = at === fit.pole ? null : [at[0] - fit.pole[0], at[1] - fit.pole[1]];
    ink.letter(at, text, "letter", { away, key: letters[0] });
  }
  ink.set(state.stood, [0, 0, ...SHEET]);
  return [fit.told, ...explained(page.data.legends, rate, ends)].join("; ");
}

/** What letters stand for that are of no point in the drawing; `ends` says whether ends of parts are lettered. */
function explained(legends, rate, ends) {
  const [index, ...below] = rate === "acceleration" ? legends[rate] : [null, ...legends[rate]];
  return [...(index === null ? [] : [index]), ...(ends ? [legends.parts] : []), ...below];
}

/** The scale and the pole's place: for the whole motion, or those of the position before while the polygon is in the
    picture and not small; beside a dead point, where rates outgrow the motion's scale, always those of the position. */
function polygonFit(page, svg, rate, found, state) {
  const { course } = page, { unit, parts } = RATES[rate], at = [[0, 0], ...found.letters.map((each) => each.at)];
  const room = ([x0, y0, x1, y1]) => Math.max((x1 - x0) / (SHEET[0] - 2 * BORDER), (y1 - y0) / (SHEET[1] - 2 * BORDER));
  const now = boxOf(at.map(([x]) => x), at.map(([, y]) => y));
  if (!(room(now) * SHEET[0] > 1e-12 * page.data.size)) return null;
  // a centimetre is one of the screen's, however wide the sheet is shown
  const zoom = svg.getScreenCTM()?.a || 1;
  if (state.zoom !== zoom) Object.assign(state, { zoom, fit: null });
  const fitted = (box) => {
    const { px: onScreen, told } = roundScale(room(box) / zoom, 1, unitOf(page, unit)), px = onScreen / zoom;
    return { px, told, pole: [SHEET[0] / 2 - ((box[0] + box[2]) / 2) * px, SHEET[1] / 2 + ((box[1] + box[3]) / 2) * px] };
  };
  const fits = ({ px, pole }) => at.every(([x, y]) => {
    const [X, Y] = [pole[0] + x * px, pole[1] - y * px], edge = BORDER / 2;
    return X > edge && X < SHEET[0] - edge && Y > edge && Y < SHEET[1] - edge;
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

/** What a polygon is made of, in m/s or m/s²: {letters, vectors, sides}; null where rates are not determined. */
function images(page, rate) {
  const { data } = page, { points, frame, rides, letters: letter } = data;
  const letters = [], vectors = [], sides = [];
  const value = {};
  for (const name of Object.keys(points)) {
    const known = page.point(name)[rate];
    if (known === null) return null;
    value[name] = points[name].links.includes(frame) ? [0, 0] : known;
    letters.push({ letter: letter[name], at: value[name] });
  }
  const members = new Map(data.links.map((link) => [link, []]));
  for (const [name, { links, at }] of Object.entries(points)) {
    links.forEach((link, k) => members.get(link).push({
      letter: letter[name], value: value[name], place: at[k].map((each) => page.size(each)),
      joint: links.length > 1, fixed: links.includes(frame),
    }));
  }
  // the guide's own point below each point that slides
  for (const [name, guide, own] of rides) {
    if (guide === frame) {
      vectors.push({ from: [0, 0], to: value[name], absolute: true, normal: null });
      continue;
    }
    const { position } = page.point(name), below = page.rates(guide, position)[rate], f = page.frames[guide];
    const [dx, dy] = [position[0] - f.x, position[1] - f.y];
    const place = [f.cos * dx + f.sin * dy, f.cos * dy - f.sin * dx];
    members.get(guide).push({ letter: own, value: below, place, joint: true, fixed: false });
    letters.push({ letter: own, at: below });
    vectors.push({ from: below, to: value[name], absolute: false, normal: null });
  }
  for (const link of data.links) {
    if (link === frame) continue;
    const all = members.get(link), joints = all.filter((each) => each.joint), f = page.frames[link];
    const turned = ([x, y]) => [f.cos * x - f.sin * y, f.sin * x + f.cos * y];
    const round = (list, use) => {
      const at = outline(list.map((each) => each.place));
      const last = at.length > 2 ? at.length : at.length - 1;
      for (let k = 0; k < last; k++) use(list[at[k]], list[at[(k + 1) % at.length]]);
    };
    round(joints.length > 1 ? joints : all, (a, b) => {
      const [from, to] = b.fixed ? [b, a] : [a, b];
      const normal = rate === "acceleration" ? normalEnd(from, to, turned, f.v[2]) : null;
      vectors.push({ from: from.value, to: to.value, absolute: from.fixed, parts: [to.letter, from.letter], normal });
    });
    round(all, (a, b) => sides.push([a.value, b.value]));
  }
  return { letters, vectors, sides };
}

/** Where the centripetal part of a relative acceleration ends: −ω² r, from the first point on. */
function normalEnd(from, to, turned, w) {
  const [dx, dy] = turned([to.place[0] - from.place[0], to.place[1] - from.place[1]]);
  return [from.value[0] - w * w * dx, from.value[1] - w * w * dy];
}
