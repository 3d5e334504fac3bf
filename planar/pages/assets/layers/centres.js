"use strict";
/* Instantaneous centres of every two links, from the links' rates: where both have one velocity. Their letters are those
   of `planar centres`; a centre picked shows the lines of Kennedy's theorem on which it lies, and its chord in the
   circle diagram beside. */

/** The motion of every link as [ux, uy, w], velocity (ux − w y, uy + w x) at (x, y); null where not determined. */
function motionsOf(frames, data) {
  const found = {};
  for (const link of data.links) {
    const f = frames[link];
    if (!f.v) return null;
    const [vx, vy, w] = f.v;
    found[link] = [vx + w * f.y, vy - w * f.x, w];
  }
  return found;
}

/** Where two motions are one: homogeneous [x, y, w], w = 0 at infinity; null where both are one altogether. */
function poleOf(a, b, size, greatest) {
  const [x, y, w] = b.map((each, k) => each - a[k]), slide = Math.hypot(x, y);
  if (Math.max(slide / size, Math.abs(w)) <= AS_ONE_RATIO * greatest) return null;
  return Math.abs(w) * size <= INFINITY_RATIO * slide ? [-y, x, 0] : [-y, x, w];
}

/** The greatest motion of a link: how fast it turns, or would turn at the size's distance. */
function greatestOf(motions, size) {
  return Math.max(...Object.values(motions).map(([x, y, w]) => Math.max(Math.hypot(x, y) / size, Math.abs(w))));
}

/** All centres that the page carries, each with where it is (`at`); null where motions are not determined. */
function centresOf(page, frames) {
  const { data } = page, motions = motionsOf(frames, data);
  if (motions === null) return null;
  const greatest = greatestOf(motions, data.size);
  return data.centres.all.map((each) => {
    const at = poleOf(...each.links.map((link) => motions[link]), data.size, greatest);
    // links that move as one just now turn about the point that both have, where a pair shows it
    return { ...each, at: at ?? (each.shown && each.point !== null ? [...page.point(each.point).position, 1] : null) };
  });
}

/** Of the lines of centres on which a centre lies the first two that cross: [[centre, centre], ...]. */
function kennedyLines(all, centre, { size }) {
  const found = [];
  // unit vectors of the projective plane in the mechanism's size: centres that coincide give no line
  const unit = (vector) => { const length = Math.hypot(...vector); return [vector.map((each) => each / length), length]; };
  const cross = ([a, b, c], [x, y, z]) => [b * z - c * y, c * x - a * z, a * y - b * x];
  for (const two of centre.lines.map((line) => line.map((k) => all[k]))) {
    if (found.length === 2 || two.some((each) => each.at === null)) continue;
    const [line, sine] = unit(cross(...two.map(({ at: [x, y, w] }) => unit([x, y, w * size])[0])));
    if (sine > LEAST_SINES.apart && found.every((each) => Math.hypot(...cross(each.line, line)) > LEAST_SINES.crossing)) found.push({ two, line });
  }
  return found;
}

const centres = {
  key: "centres",
  label: "Instantaneous centres",
  beside(layers, part) {
    const { page } = layers, { data } = page;
    htmlPart("h2", {}, part, "Circle diagram");
    const svg = svgPart("svg", { viewBox: `0 0 ${CIRCLE_SHEET.size.join(" ")}`, role: "img", "aria-label": "circle diagram" }, part);
    const which = chooser(part, "Centres", [["all", "all"], ...data.centres.links.map(({ link, label }) => [link, `of ${label}`])]);
    which.value = data.centres.all.length > MAX_CENTRES ? data.frame : "all";
    const pick = chooser(part, "Lines of Kennedy's theorem for", []);
    for (const each of [which, pick]) each.addEventListener("change", () => layers.draw());
    this.state = { which, pick, svg, all: null, picked: null, lines: [], places: [], drawn: "", told: "" };
    return { draw: () => drawCircle(page, this.state) };
  },
  places() { return this.state.places; },
  pick(name, layers) {
    const { pick } = this.state;
    pick.value = pick.value === name ? "" : name;
    layers.draw();
    layers.page.say(pick.value ? `lines of centre I${name} shown` : "no lines of centres shown");
  },
  draw(ink, layers) {
    const { page } = layers, state = this.state, all = centresOf(page, standardFrames(page));
    Object.assign(state, { all, places: [] });
    if (all === null) return page.undetermined || "the motions are not determined";
    const shown = all.filter(({ links }) => state.which.value === "all" || links.includes(state.which.value));
    offer(state.pick, [["", "none"], ...shown.filter(({ at }) => at !== null).map(({ name }) => [name, `I${name}`])]);
    const picked = all.find(({ name, at }) => name === state.pick.value && at !== null) ?? null;
    state.picked = picked;
    state.lines = picked ? kennedyLines(all, picked, page.data) : [];
    const room = layers.bounds(), drawn = new Map();
    for (const { two } of state.lines) drawLine(ink, layers, room, [...two, picked]);
    const one = new Set([...shown, ...state.lines.flatMap(({ two }) => two), ...(picked ? [picked] : [])]);
    for (const each of one) if (each.at !== null) {
      const place = drawCentre(ink, layers, room, each, drawn, each === picked);
      state.places.push([each.name, place]);
    }
    for (const { place, names, outside, away } of drawn.values()) {
      ink.letter(place, fewNames(names, CENTRE_NAMES).map((name, k) => [`${k ? ", " : ""}${name === "…" ? name : "I"}`, name === "…" ? "" : name]), "letter centre", { told: outside, away });
    }
    if (picked === null) return "";
    const lines = state.lines.map(({ two }) => two.map(({ name }) => `I${name}`).join(" "));
    return `I${picked.name}${picked.shown ? ", shown by a pair," : ""} lies on ${lines.join(" and on ") || "no line of other centres"}`;
  },
};

/** The links' motions with the file's rates, or if nothing moves at those with the running input at unit speed. */
function standardFrames(page) {
  const { inputs } = page.data;
  if (!inputs.length || page.inputRates().some(([velocity]) => velocity !== 0)) return page.frames;
  const still = inputs.map(() => 0);
  return page.framesOf(page.linkage.state(still.map((_, k) => (k === page.running ? 1 : 0)), still));
}

/** A centre as a dot where a pair shows it, else a ring; one beyond the picture as an arrow at its edge. Where that is. */
function drawCentre(ink, layers, room, { name, at, shown }, drawn, picked) {
  const [x, y, w] = at, middle = [(room[0] + room[2]) / 2, (room[1] + room[3]) / 2], edge = CENTRE_ARROW.margin * ink.mm;
  const there = w === 0 ? null : layers.at([x / w, y / w]);
  const radius = CENTRE_RADII[shown ? "shown" : "found"], inside = there !== null && [0, 1].every((k) => there[k] - radius * ink.mm > room[k] && there[k] + radius * ink.mm < room[k + 2]);
  const add = (key, place, outside, away) => {
    if (drawn.has(key)) { drawn.get(key).names.push(name); return false; }
    drawn.set(key, { place, names: [name], outside, away });
    return true;
  };
  if (inside) {
    const key = there.map((each) => Math.round(each / 2)).join();
    if (add(key, there, "", null)) {
      ink.dot(there, radius, `centre ${shown ? "shown" : "found"}${picked ? " picked" : ""}`);
      ink.keepClear(there, 5);
    }
    return there;
  }
  const start = w === 0 ? layers.at([0, 0]) : middle, along = (there ?? layers.at([x, y])).map((each, k) => each - start[k]);
  const length = Math.hypot(...along), [dx, dy] = along.map((each) => each / length);
  const reach = Math.min(...[[dx, 0], [dy, 1]].map(([d, k]) => (d ? (room[k + 2] - room[k] - 2 * edge) / 2 / Math.abs(d) : Infinity)));
  const tip = [middle[0] + dx * reach, middle[1] + dy * reach], tail = [dx, dy].map((each, k) => tip[k] - CENTRE_ARROW.length * ink.mm * each);
  const far = w === 0 ? " at ∞" : ` ${formatPlace(layers.page, [x / w, y / w])}`;
  const key = `${tip.map((each) => Math.round(each / 6)).join()}${far}`;
  if (add(key, tail, far, [-dx, -dy])) ink.arrow(tail, tip, `arrow centre${picked ? " picked" : ""}`);
  return tip;
}

/** A line through three centres, as far as it can be seen. */
function drawLine(ink, layers, room, three) {
  const finite = three.filter(({ at }) => at[2] !== 0).map(({ at: [x, y, w] }) => layers.at([x / w, y / w]));
  const far = three.find(({ at }) => at[2] === 0), start = layers.at([0, 0]);
  if (!finite.length) return;
  const size = 4 * Math.max(room[2] - room[0], room[3] - room[1]);
  if (far !== undefined) {
    const [x, y] = layers.at([far.at[0], far.at[1]]).map((each, k) => each - start[k]), length = Math.hypot(x, y);
    finite.push(...[-1, 1].map((sign) => [finite[0][0] + (sign * size * x) / length, finite[0][1] + (sign * size * y) / length]));
  }
  const along = [0, 1].map((axis) => finite[finite.length - 1][axis] - finite[0][axis]);
  const order = finite.sort((a, b) => (a[0] - b[0]) * along[0] + (a[1] - b[1]) * along[1]);
  const ends = [order[0], order[order.length - 1]].map((each) => within(each, order, size * 50));
  const way = [0, 1].map((axis) => ends[1][axis] - ends[0][axis]), over = (LINE_OVERHANG * ink.mm) / Math.hypot(...way);
  ink.line(ends.map((end, k) => end.map((each, axis) => each + (k ? over : -over) * way[axis])), "kennedy");
}

/** A place that is not absurdly far for a screen's numbers. */
function within(place, order, most) {
  const near = order.reduce((best, each) => (Math.hypot(...each) < Math.hypot(...best) ? each : best));
  const far = Math.hypot(place[0] - near[0], place[1] - near[1]);
  return far <= most ? place : [0, 1].map((k) => near[k] + ((place[k] - near[k]) * most) / far);
}

/** The circle diagram: a place for each link, a chord for each centre. */
function drawCircle(page, state) {
  const { svg, all, picked, lines } = state;
  svg.style.display = all ? "" : "none"; // an empty circle says nothing
  if (!all) { svg.replaceChildren(); state.drawn = ""; return "no centres, as centres are where two links have one velocity"; }
  const used = new Set(lines.flatMap(({ two }) => two)), kind = (each) => (each === picked ? " picked" : used.has(each) ? " used" : "");
  // it changes only where another centre is picked, or links begin to move as one
  const known = all.filter(({ at: place }) => place !== null), drawn = known.map((each) => each.name + kind(each)).join();
  if (state.drawn === drawn) return state.told;
  state.drawn = drawn;
  svg.replaceChildren();
  const { links } = page.data.centres, { size: [width, height], radius, number } = CIRCLE_SHEET;
  const spot = ([x, y], far) => [width / 2 + far * x, height / 2 - far * y], size = LETTER.height;
  const at = new Map(links.map(({ link, place }) => [link, spot(place, radius)]));
  const ink = new Ink(svg, PANEL_MM);
  ink.dot([width / 2, height / 2], radius / PANEL_MM, "circle");
  for (const each of known) ink.line(each.links.map((link) => at.get(link)), `chord ${each.shown ? "shown" : "found"}${kind(each)}`);
  for (const { link, place, number: name } of links) {
    ink.dot(at.get(link), 2 * DOT_RADIUS, "place");
    const [x, y] = spot(place, radius + number);
    svgPart("text", { x, y: y + 0.35 * size, "text-anchor": "middle", "font-size": size, class: "letter" }, svg, name);
  }
  state.told = `${known.length} centres; full chords: shown by pairs. Links: ${links.map(({ label }) => label).join(", ")}`;
  return state.told;
}

/** A labelled choice. */
function chooser(parent, label, choices) {
  const box = htmlPart("label", { class: "choice" }, parent, `${label} `), select = htmlPart("select", {}, box);
  offer(select, choices);
  return select;
}

/** What can be chosen; what was stays if it can still be. */
function offer(select, choices) {
  const told = JSON.stringify(choices);
  if (select.dataset.choices === told) return;
  select.dataset.choices = told;
  const was = select.value;
  select.replaceChildren(...choices.map(([value, text]) => htmlPart("option", { value }, null, text)));
  if (choices.some(([value]) => value === was)) select.value = was;
}
