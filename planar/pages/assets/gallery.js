"use strict";
/* The index of a folder of pages: small pictures that move while they are seen. Where the links are at every step was
   found beforehand; between two steps they go on evenly. */

const ROUND = 6; // s, one way through a motion

/** What a drawing looks at, in the place of a page: a mechanism that is only played. */
class Recording {
  constructor(data, drawn) {
    this.data = data;
    this.drawn = (travel, perMm, values) => drawn([], travel, [perMm], values);
    const [first = []] = data.frames;
    this.steps = first.length / 3 - 1;
    this.poses = Array.from({ length: this.steps + 1 }, (_, k) => this.at(k));
    [this.frames] = this.poses;
    this.marks = []; // no layer marks anything
  }

  on() {}
  emit() {}

  /** Where all links are at a step, or between two. */
  at(step) {
    const { frame, links, frames } = this.data, k = Math.min(Math.floor(step), Math.max(0, this.steps - 1)), part = step - k;
    const found = Object.create(null); // a link may be named like something that every object has
    found[frame] = { x: 0, y: 0, angle: 0, cos: 1, sin: 0 };
    links.filter((link) => link !== frame).forEach((link, i) => {
      const next = this.steps ? 3 * (k + 1) : 0;
      const [x, y, angle] = [0, 1, 2].map((j) => frames[i][3 * k + j] + part * (frames[i][next + j] - frames[i][3 * k + j]));
      found[link] = { x, y, angle, cos: Math.cos(angle), sin: Math.sin(angle) };
    });
    return found;
  }

  /** Go to a time (s): round and round, else to and fro. */
  play(time) {
    const rounds = time / ROUND, whole = Math.floor(rounds), part = rounds - whole;
    const there = this.data.closed ? part : (1 - Math.cos(Math.PI * rounds)) / 2;
    this.frames = this.at(there * this.steps);
  }
}

/** The drawing of a page, without letters, arrows and scale. */
class Small extends Drawing {
  measure() {
    this.poses = this.page.poses;
    this.spans = [];
    this.slack = 0;
    this.build();
  }

  named() {
    this.spots = [];
    this.letters = { place: () => true };
  }

  drive() {}
  scaleBar() {}
  inside() { return true; }
  covers() { return true; }
}

const items = document.querySelectorAll("#gallery li");
const shownModels = JSON.parse(document.getElementById("data").textContent).map((data, k) => {
  const item = items[k], svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("class", "small");
  svg.setAttribute("aria-hidden", "true"); // its name stands below it
  item.firstElementChild.prepend(svg);
  return { data, drawn: DRAWN[k], item, svg, seen: false, recording: null, drawing: null };
});

function draw(model) {
  if (model.drawing) return;
  model.recording = new Recording(model.data, model.drawn);
  model.drawing = new Small(model.recording, model.svg);
}

const watcher = new IntersectionObserver((entries) => {
  for (const { target, isIntersecting } of entries) {
    const model = shownModels.find((each) => each.svg === target);
    model.seen = isIntersecting;
    if (isIntersecting) draw(model);
  }
}, { rootMargin: "100px" });
for (const { svg } of shownModels) watcher.observe(svg);

addEventListener("beforeprint", () => { for (const model of shownModels) draw(model); }); // also those not seen yet

const run = document.getElementById("run"), find = document.getElementById("find"), none = document.getElementById("none");
let running = !matchMedia("(prefers-reduced-motion: reduce)").matches, time = 0, last = null;

function frame(now) {
  if (last !== null) time += Math.min(now - last, 100) / 1000;
  last = now;
  for (const { seen, recording, drawing } of shownModels) {
    if (!seen || !drawing || !recording.steps) continue;
    recording.play(time);
    drawing.place();
  }
  if (running) requestAnimationFrame(frame);
}

function told() { run.textContent = running ? "Pause" : "Play"; }
run.addEventListener("click", () => {
  running = !running;
  last = null;
  told();
  if (running) requestAnimationFrame(frame);
});

/** What is looked for, as the texts are: see planar.pages.kinds. */
const COUNTED = ["zero", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve"];
function plain(text) {
  const letters = text.toLowerCase().normalize("NFKD").replace(/\p{M}/gu, "").replace(/['’]/g, "");
  const words = letters.replace(/[^\p{L}\p{N}]+/gu, " ").trim();
  const apart = (told) => told.replace(new RegExp(`\\b(${COUNTED.join("|")})(bar|link)`, "g"), "$1 $2");
  return apart(apart(words).replace(/\b(\d{1,2})(?= ?(?:bar|link))/g, (number) => COUNTED[number] ?? number));
}

/** Every word that is looked for begins a word of the text; an s at its end may be left out there. */
function found(words, text) {
  return words.every((word) => [word, word.replace(/(..)s$/, "$1")].some((each) => ` ${text}`.includes(` ${each}`)));
}

function search() {
  const words = plain(find.value).split(" ").filter(Boolean);
  let left = 0;
  for (const { data, item } of shownModels) {
    item.hidden = !found(words, data.words);
    left += !item.hidden;
  }
  for (const section of document.querySelectorAll("#gallery section")) section.hidden = !section.querySelector("li:not([hidden])");
  none.textContent = left ? "" : "No mechanism is found by these words.";
  // so that the way back from a page leads to what was looked for
  try { history.replaceState(null, "", find.value ? `#find=${encodeURIComponent(find.value)}` : "#"); } catch { /* no address */ }
}
find.addEventListener("input", search);
const asked = /^#find=(.*)$/.exec(location.hash);
if (asked) {
  try { find.value = decodeURIComponent(asked[1]); } catch { /* no text */ }
  search();
}
told();
if (running) requestAnimationFrame(frame);
