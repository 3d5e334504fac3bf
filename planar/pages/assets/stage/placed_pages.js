"use strict";
/* A page that follows the file of its mechanism while pins are led. */

const FOLLOWED = 1e-6; // sizes: as near to where a pin is led a page's own solution has to come

/** A page's file, or the same as its author wrote it, with the numbers that the page has now. */
function fileNow(page, file, units) {
  const { data, linkage } = page, made = structuredClone(file);
  data.dimensions.forEach((each, k) => {
    const path = data.document.dimensions[k], key = path[path.length - 1], holder = path.slice(0, -1).reduce((one, part) => one?.[part], made);
    if (linkage.d[k] !== each.value && holder && key in holder) Written.put(holder, key, linkage.d[k], "length", units);
  });
  data.inputs.forEach((given, k) => {
    if (made.inputs?.[k]) Written.put(made.inputs[k], "position", page.input(k), given.slides ? "length" : "angle", units);
  });
  return made;
}

/** The dimensions (m) and inputs (scaled) of a page with the numbers of a file that was made of what is placed. {d, u, why}:
    why the page does not take them, or "". */
function numbersOf(page, { placed, made: { file } }, units) {
  const { data, linkage } = page, value = (from, path) => path.reduce((each, key) => each?.[key], from) ?? null;
  // what is written alike stays as exact as it was
  const now = (path, kind, own) => {
    const [was, is] = [placed.file, file].map((each) => Written.read(value(each, path), kind, units));
    return is === null || is === was ? own : is;
  };
  const d = data.document.dimensions.map((path, k) => now(path, "length", linkage.d[k]));
  const wrong = data.dimensions.find((each, k) => d[k] !== linkage.d[k] && (each.held || d[k] < (each.bounds[0] ?? -Infinity) || d[k] > (each.bounds[1] ?? Infinity)));
  const u = data.inputs.map((given, k) => now(["inputs", k, "position"], given.slides ? "length" : "angle", page.input(k)) / linkage.scale[k]);
  return { d, u, why: wrong ? `${wrong.link}: ${wrong.what} is held${wrong.held ? `: ${wrong.held}` : ""}` : "" };
}

/** Bring a page to the numbers of a pin that is led, {pin, placed, made}, from where it is: "", or why not. */
function solvePlaced(page, held, units) {
  const { data, linkage } = page, { pin, made: { at } } = held, { d, u, why } = numbersOf(page, held, units);
  if (why) return why;
  const made = linkage.copy();
  made.d = d;
  made.measure();
  const { z, closed } = made.newton(u, linkage.z);
  if (!closed) return "it does not go together";
  if (beyondStops(made, z, u).length) return "a stop is in the way";
  made.z = z;
  made.u = u;
  const [link] = data.points[pin].links, there = page.place(link, data.points[pin].at[0], page.framesOf(made.state()), made.sizes);
  if (!(Plane.apart(there, at.get(pin)) <= FOLLOWED * data.size)) return "its lengths alone do not lead it there";
  page.adopt({ d, u, z });
  return "";
}

/** The same where the rest goes along, step by step on its branch: {pin, placed, made: {file, at, owner}}. */
function solveAlong(page, held, units) {
  const { data, linkage } = page, { pin, placed, made: { at, owner } } = held, { d, u, why } = numbersOf(page, held, units);
  if (why) return why;
  const made = linkage.copy();
  if (made.moveTo(u).reached < 1 || made.changeTo(d).reached < 1) return "what goes along does not reach that far";
  const frames = page.framesOf(made.state()), where = (name) => { const { links, at: [own] } = data.points[name]; return page.place(links[0], own, frames, made.sizes); };
  const others = [...placed.pins].filter(([name, members]) => name !== pin && data.points[name] && members.some(([link]) => link === owner));
  const stays = others.every(([name]) => Math.abs(Plane.apart(where(name), where(pin)) - Plane.apart(at.get(name), at.get(pin))) <= FOLLOWED * data.size);
  if (!stays) return "its lengths alone do not lead it there";
  page.adopt(made);
  return "";
}
