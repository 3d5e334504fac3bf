"use strict";
/* Play, scrub and step the inputs: buttons, a slider and a number for each input, keys. */

const PERIOD = 4;                         // s for a turn, or to and fro, at speed 1
const SPEEDS = [-4, 3];                   // powers of 2 by which that is changed
const PART = 0.01;                        // of the range of a slide: a step by key; of an angle it is a degree

class Controls {
  constructor(page, section, svg, drawing, dragging) {
    Object.assign(this, { page, drawing, svg });
    this.playing = false;
    this.sense = 1;
    this.speed = 1;
    this.typed = null; // the number that is being typed
    this.known = new Map(); // the range of each input as last found
    this.make(section);
    dragging.taken = () => this.pause();
    svg.addEventListener("keydown", (event) => this.key(event));
    page.on("move", () => this.show());
    for (const event of ["course", "view"]) page.on(event, () => this.range());
    page.on("size", () => { this.known.clear(); this.told(); });
    this.range();
    this.said();
  }

  make(section) {
    const { inputs } = this.page.data;
    this.bar = control("div", { class: "buttons" });
    section.append(this.bar);
    if (!inputs.length) return;
    const { bar } = this;
    this.button = control("button", { type: "button", class: "main" }, "Play");
    this.button.addEventListener("click", () => (this.playing ? this.pause() : this.play()));
    this.turn = control("button", { type: "button" });
    this.turn.addEventListener("click", () => this.reverse());
    const home = control("button", { type: "button", title: "To the position in the file (Home)" }, "Start");
    home.addEventListener("click", () => this.home());
    bar.append(this.button, this.turn, home, this.speeds());
    this.rows = inputs.map((given, k) => this.row(given, k, inputs.length > 1));
    this.unitRate = control("p", { class: "hint", id: "unit-rate" });
    section.append(...this.rows.map((row) => row.row), this.unitRate);
    if (this.page.data.fixed) { // the heading says that nothing moves, and why
      for (const part of section.querySelectorAll("button, input")) part.disabled = true;
      return;
    }
    section.append(control("p", { class: "hint", id: "keys" }, "Take hold of any link and move it. Arrow keys step, space plays, Home goes back to the start."));
    this.svg.setAttribute("aria-describedby", "keys");
    this.svg.setAttribute("aria-keyshortcuts", "ArrowRight ArrowLeft Shift+ArrowRight Shift+ArrowLeft Space Home");
  }

  speeds() {
    const label = control("label", { class: "speed" }, "Speed "), told = control("output");
    const slider = control("input", { type: "range", min: SPEEDS[0], max: SPEEDS[1], step: 0.5, value: 0 });
    slider.setAttribute("aria-label", "Speed");
    slider.addEventListener("input", () => { this.speed = 2 ** slider.valueAsNumber; this.told(); });
    label.append(slider, told);
    this.pace = { slider, told };
    return label;
  }

  /** One input: which runs, its slider with marks at its ends, its number. */
  row(given, k, many) {
    const row = control("div", { class: "input" }), unit = inputUnit(this.page, k);
    const name = control(many ? "label" : "span", { class: "name" });
    const slider = control("input", { type: "range", step: "any" });
    slider.setAttribute("aria-label", given.pair);
    const number = control("input", { type: "text", inputmode: "decimal", size: 8, autocomplete: "off" });
    number.setAttribute("aria-label", `${given.pair} (${unit.name})`);
    const ends = control("div", { class: "ends" }), low = control("span"), high = control("span");
    let chosen = null;
    if (many) {
      chosen = control("input", { type: "radio", name: "running" });
      chosen.setAttribute("aria-label", `Play ${given.pair}`);
      chosen.addEventListener("change", () => this.run(k));
      name.append(chosen);
    }
    name.append(document.createTextNode(given.pair));
    slider.addEventListener("input", () => this.to(this.near(k, slider.valueAsNumber * unit.si), k));
    slider.addEventListener("keydown", (event) => this.key(event, k));
    number.addEventListener("input", () => { this.typed = number; });
    number.addEventListener("keydown", ({ key }) => { if (key === "Enter") this.typed = null; });
    number.addEventListener("blur", () => { this.typed = null; this.show(); });
    number.addEventListener("change", () => {
      this.typed = null;
      const value = Number(number.value.trim().replace(",", "."));
      if (number.value.trim() && Number.isFinite(value)) this.to(value * unit.si, k);
      else this.page.say(`${given.pair}: a number in ${unit.name} is wanted.`);
      this.show();
    });
    ends.append(low, high);
    const line = control("div", { class: "line" });
    line.append(slider, ends);
    const field = control("span", { class: "field" });
    field.append(number, document.createTextNode(` ${unit.name}`));
    row.append(name, line, field);
    return { row, slider, number, low, high, chosen };
  }

  said() {
    const place = document.getElementById("said");
    this.page.on("said", (sentence) => { place.textContent = sentence; });
  }

  /** Let another input run. */
  run(k) {
    if (this.page.running === k) return;
    this.page.run(k);
    this.range();
  }

  /** Move an input, and say where it stops. */
  to(position, k) {
    this.pause();
    this.run(k);
    const arrived = this.page.moveTo(position, k);
    if (!arrived) this.page.say(deadPoint(this.page, k));
    else if (this.stopped) this.page.say("");
    this.stopped = !arrived;
  }

  /** A position on the slider, by whole turns as near as can be to where the input is. */
  near(k, position) {
    const { whole } = this.ends(k), turn = 2 * Math.PI;
    return whole ? position + turn * Math.round((this.page.input(k) - position) / turn) : position;
  }

  /** From where to where an input goes: {low, high, whole, dead}, the last known. */
  ends(k) {
    const { page } = this, { course } = page;
    if (course && course.input === k) {
      const { inputs, count, whole, dead, names } = course, low = inputs[0], turn = 2 * Math.PI;
      // where links count turns the slider still shows one
      this.known.set(k, { low: whole ? low - turn * Math.floor(low / turn + 1e-9) : low, high: inputs[count - 1], whole, dead, names });
      if (whole) this.known.get(k).high = this.known.get(k).low + turn;
    }
    if (this.known.has(k)) return this.known.get(k);
    return this.drawing.spans[k];
  }

  /** Write the ranges of the inputs beside their sliders. */
  range() {
    this.rows?.forEach(({ slider, low, high }, k) => {
      const ends = this.ends(k), { si } = inputUnit(this.page, k);
      [slider.min, slider.max] = [ends.low / si, ends.high / si];
      [[low, ends.low, 0], [high, ends.high, 1]].forEach(([place, value, side]) => {
        place.textContent = ends.dead[side] ? `${ends.names[side]} ${amount(this.page, k, value)}` : amount(this.page, k, value);
        place.classList.toggle("dead", ends.dead[side]);
      });
    });
    this.show();
    this.told();
  }

  /** Show where the inputs are; a number that is being typed only where that is done. */
  show() {
    if (this.ran !== this.page.running) { // whoever has chosen it
      this.ran = this.page.running;
      this.sense = this.page.inputRates()[this.ran]?.[0] < 0 ? -1 : 1; // as the file has it
      this.arrow();
    }
    this.rows?.forEach(({ slider, number, chosen }, k) => {
      const { si } = inputUnit(this.page, k), position = this.page.input(k), { low, whole } = this.ends(k), turn = 2 * Math.PI;
      slider.value = (whole ? position - turn * Math.floor((position - low) / turn) : position) / si;
      // read aloud where it stops, not sixty times a second
      if (!this.playing) slider.setAttribute("aria-valuetext", `${this.page.data.inputs[k].pair} ${amount(this.page, k)}`);
      if (this.typed !== number) number.value = readable(position / si);
      if (chosen) chosen.checked = k === this.page.running;
    });
  }

  /** The rate at which the running input is moved (rad/s, m/s). */
  rate() {
    const { low, high } = this.ends(this.page.running);
    return (this.speed * (high - low)) / (this.ends(this.page.running).whole ? PERIOD : PERIOD / 2);
  }

  /** Write speed and sense. */
  told() {
    const { page, pace } = this, given = page.data.inputs[page.running];
    if (!given) return;
    const [own] = page.inputRates()[page.running], rate = this.rate(), { name, si } = page.data.paces[given.slides ? "length" : "angle"];
    let text = page.data.fixed ? "" : `${readable(+(rate / si).toPrecision(2))} ${name}`;
    if (own) text += `, ${+(rate / Math.abs(own)).toPrecision(2)} times ${page.unitRate ? "the unit rate" : "the input's"}`;
    this.unitRate.textContent = page.unitRate?.note ?? "";
    this.unitRate.hidden = page.unitRate === null;
    pace.told.textContent = text;
    pace.slider.setAttribute("aria-valuetext", text);
    const [forth, back] = given.slides ? ["→ forwards", "← backwards"] : ["↺ anticlockwise", "↻ clockwise"];
    this.turn.textContent = this.sense > 0 ? forth : back;
    this.turn.setAttribute("aria-label", `Direction: ${this.turn.textContent.slice(2)}`);
  }

  reverse() {
    this.sense = -this.sense;
    this.arrow();
  }

  arrow() {
    this.drawing.turnArrow(this.sense);
    this.told();
  }

  play() {
    this.playing = true;
    this.button.textContent = "Pause";
    let before = null, turned = false;
    const frame = (now) => {
      if (!this.playing) return;
      const gone = before === null ? 0 : Math.min(0.1, (now - before) / 1000), { page } = this;
      before = now;
      if (gone > 0) {
        const { low, high, whole } = this.ends(page.running), from = page.input();
        let to = from + this.sense * this.rate() * gone;
        // a slide without a dead point turns round at the ends of what is shown
        if (!whole) to = Math.min(Math.max(to, Math.min(low, from)), Math.max(high, from));
        const arrived = page.moveTo(to) && to !== from;
        if (!arrived) {
          this.reverse();
          if (turned && Math.abs(page.input() - from) < 1e-9) {
            this.pause();
            page.say(deadPoint(page, page.running));
            return;
          }
        }
        turned = !arrived;
      }
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }

  pause() {
    if (!this.playing) return;
    this.playing = false;
    this.button.textContent = "Play";
    this.show();
  }

  /** All inputs to where the file has them. */
  home() {
    this.pause();
    const stopped = this.page.data.inputs.map((given, k) => !this.page.moveTo(given.position, k)).indexOf(true);
    this.stopped = stopped >= 0;
    this.page.say(this.stopped ? deadPoint(this.page, stopped) : "");
  }

  /** Arrows step, with shift ten times as far; space plays; Home goes back to the file's position. */
  key(event, k = this.page.running) {
    if (!this.rows || this.page.data.fixed || event.ctrlKey || event.metaKey || event.altKey) return;
    const ways = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1, PageUp: 10, PageDown: -10 };
    if (event.key in ways) {
      const { low, high } = this.ends(k), one = this.page.data.inputs[k].slides ? PART * (high - low) : Math.PI / 180;
      this.to(this.page.input(k) + ways[event.key] * (event.shiftKey ? 10 : 1) * one, k);
    } else if (event.key === " ") {
      if (this.playing) this.pause();
      else this.play();
    } else if (event.key === "Home") this.home();
    else return;
    event.preventDefault();
  }
}

/** An element; attributes and texts are set as such, never parsed. */
function control(name, attributes = {}, text = null) {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (text !== null) element.textContent = text;
  return element;
}
