"use strict";
/* Diagrams under the drawing, over the range of the input: one for each quantity, with a line for each point or link
   chosen, and a marker that runs along. A press in a diagram takes the mechanism there. */

/** Quantities over the course of points, links and inputs: {key, label, unit, kind, of(columns)}. */
const DIAGRAMS = [
  { key: "x", label: "x", unit: "length", kind: "point", of: (c, i) => c.x[i] },
  { key: "y", label: "y", unit: "length", kind: "point", of: (c, i) => c.y[i] },
  { key: "v", label: "velocity", unit: "velocity", kind: "point", of: (c, i) => Math.hypot(c.vx[i], c.vy[i]) },
  { key: "vx", label: "velocity along x", unit: "velocity", kind: "point", of: (c, i) => c.vx[i] },
  { key: "vy", label: "velocity along y", unit: "velocity", kind: "point", of: (c, i) => c.vy[i] },
  { key: "a", label: "acceleration", unit: "acceleration", kind: "point", of: (c, i) => Math.hypot(c.ax[i], c.ay[i]) },
  { key: "ax", label: "acceleration along x", unit: "acceleration", kind: "point", of: (c, i) => c.ax[i] },
  { key: "ay", label: "acceleration along y", unit: "acceleration", kind: "point", of: (c, i) => c.ay[i] },
  { key: "angle", label: "angle", unit: "angle", kind: "link", of: (c, i) => c.angle[i] - c.turns },
  { key: "w", label: "angular velocity", unit: "angular velocity", kind: "link", of: (c, i) => c.w[i] },
  { key: "e", label: "angular acceleration", unit: "angular acceleration", kind: "link", of: (c, i) => c.e[i] },
  { key: "torque", label: "input torque", unit: "torque", kind: "input", of: (c, i) => c.effort[i] },
  { key: "push", label: "input force", unit: "force", kind: "input", of: (c, i) => c.effort[i] },
];

class Charts {
  constructor(page) {
    this.page = page;
    const section = document.getElementById("numbers"), told = memory.read("diagrams");
    this.on = new Set(told === null ? ["v", "w", "e", "torque", "push"] : told.split(","));
    // of inputs there are those whose efforts are such, where anything acts
    this.diagrams = DIAGRAMS.filter((each) => each.kind !== "input" || this.names(each).length);
    this.charts = [];
    if (!page.data.inputs.length) return;
    const box = htmlPart("fieldset", { class: "choices" }, section);
    htmlPart("legend", {}, box, "Diagrams");
    for (const { key, label, kind } of this.diagrams) {
      const holder = htmlPart("label", {}, box), tick = htmlPart("input", { type: "checkbox", name: `diagram-${key}` }, holder);
      holder.append(kind === "input" ? label : `${label} of ${kind}s`);
      tick.checked = this.on.has(key);
      tick.addEventListener("change", () => {
        if (tick.checked) this.on.add(key); else this.on.delete(key);
        memory.write("diagrams", this.diagrams.filter((each) => this.on.has(each.key)).map((each) => each.key).join(",") || "none");
        this.build();
      });
    }
    this.place = htmlPart("div", { class: "charts" }, section);
    this.hint = htmlPart("p", { class: "hint", hidden: "" }, section);
    page.on("chosen", () => this.build());
    page.on("course", () => this.build());
    page.on("move", () => this.mark());
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.build(), { signal: page.lifetime.signal });
    new ResizeObserver(() => this.fit()).observe(this.place);
    for (const [event, printed] of [["beforeprint", true], ["afterprint", false]]) {
      addEventListener(event, () => { document.documentElement.classList.toggle("printed", this.printed = printed); this.build(); }, { signal: page.lifetime.signal });
    }
    this.build();
  }

  /** All diagrams anew; while the motion is being solved again the old ones stay, faint. */
  build() {
    const { page, place } = this, { course } = page;
    place.setAttribute("aria-busy", String(course === null));
    if (course === null) return;
    for (const { plot } of this.charts) plot.destroy();
    this.charts = [];
    place.replaceChildren();
    for (const each of this.diagrams) {
      const names = this.names(each);
      if (this.on.has(each.key) && names.length) this.charts.push(this.chart(each, names, course));
    }
    this.hint.hidden = this.charts.length > 0;
    this.hint.textContent = this.on.size && !this.on.has("none") ? "Choose a point or a link to see its diagrams." : "";
    this.fit();
    this.mark();
  }

  /** Of what a diagram has lines. */
  names({ kind, unit }) {
    const { page } = this;
    if (kind === "input") return (page.forces?.inputs ?? []).filter((each) => each.slides === (unit === "force")).map((each) => each.pair);
    return kind === "point" ? page.chosen.points() : page.chosen.links();
  }

  /** All values of it over the course, or the one of now in a list. */
  columns(kind, name, course) {
    const { page } = this;
    if (kind === "input") return { effort: course ? page.forces.over(course)?.efforts[name] ?? new Float64Array(course.count).fill(NaN) : [page.forces.effort(name)] };
    const list = (one) => Object.fromEntries(Object.entries(one).map(([key, each]) => [key, [each]]));
    if (kind === "point") return course ? course.point(name) : list(pointNumbers(page, name, page.frames));
    const columns = course ? course.link(name) : list(linkNumbers(page.frames[name]));
    return { ...columns, turns: turnsOf(page, page.course, name) };
  }

  chart({ label, unit, kind, of }, names, course) {
    const { page, place } = this, [by, unitName] = unitOf(page, unit), k = course.input, { pair, slides } = page.data.inputs[k];
    const [byInput, inputUnit] = unitOf(page, slides ? "length" : "angle");
    const xs = Array.from(course.inputs, (each) => each * byInput);
    const solved = names.map((name) => {
      const columns = this.columns(kind, name, course);
      return Array.from(course.inputs, (_, i) => { const value = of(columns, i) * by; return Number.isFinite(value) ? value : null; });
    });
    // values that are zero to round-off, beside the greatest of their kind, are drawn as zero
    const scale = Math.max((course.scales[unit] ?? 0) * by, ...solved.flat().map(Math.abs));
    const roundOff = solved.map((line) => (Math.max(...line.map(Math.abs)) <= AXIS.flat * scale ? AXIS.flat : NOTHING) * scale);
    const withoutRoundOff = (value, k) => (value !== null && Math.abs(value) <= roundOff[k] ? 0 : value);
    const lines = solved.map((line, k) => line.map((value) => withoutRoundOff(value, k)));
    const now = (name, k) => withoutRoundOff(by * of(this.columns(kind, name, null), 0), k);
    const made = { by: byInput, tell: () => undefined, now: () => names.map(now), range: (here) => rangeOf([...lines, here], scale) };
    made.limits = made.range(made.now());
    const style = getComputedStyle(document.documentElement), colour = (name) => style.getPropertyValue(name).trim();
    const [from, to] = [course.inputs[0], course.inputs[course.count - 1]].map((each) => inputTold(page, each, k));
    const figure = htmlPart("figure", { "aria-label": `${label} of ${names.join(", ")} over ${pair}, from ${from} to ${to}` }, place);
    const em = parseFloat(getComputedStyle(document.body).fontSize) / 16, { font: size, head, axes: [below, beside], line: wide, dash } = CHART;
    const font = `${size * em}px system-ui, sans-serif`;
    const line = { stroke: colour("--line"), width: 1 };
    const values = (_, splits) => splits.map((each) => (each === null ? "" : short(each)));
    const axis = { font, labelFont: `600 ${font}`, labelSize: head * em, stroke: colour("--ink"), grid: line, ticks: line, values };
    const plot = new uPlot({
      width: this.width(), height: CHART.height,
      scales: { x: { time: false, range: [xs[0], xs[xs.length - 1]] }, y: { range: () => made.limits } },
      axes: [
        { ...axis, size: below * em, label: `${pair}, ${inputUnit}`, incrs: inputUnit === "deg" ? DEGREE_VALUES : STEP_VALUES },
        { ...axis, size: beside * em, label: `${label}, ${unitName}`, incrs: STEP_VALUES },
      ],
      series: [{}, ...names.map((_, i) => ({
        stroke: colour(`--series${i % SERIES}`), width: wide, dash: i < SERIES ? undefined : dash, points: { show: false },
      }))],
      legend: { show: false },
      cursor: { drag: { x: false, y: false }, sync: { key: "motion" } },
      hooks: { setCursor: [() => this.tell(made)], ready: [() => this.mark()] }, // a plot has its scales a little later
    }, [xs, ...lines], figure);
    const caption = htmlPart("figcaption", {}, figure), where = htmlPart("span", {}, caption);
    const told = names.map((name, i) => {
      const each = htmlPart("span", { class: "value" }, caption);
      htmlPart("span", { class: `swatch series${i % SERIES}${i < SERIES ? "" : " dashed"}`, "aria-hidden": "true" }, each);
      each.append(`${name} `);
      return htmlPart("span", {}, each);
    });
    Object.assign(made, { tell: (idx) => {
      where.textContent = `${pair} = ${idx === null ? inputTold(page, page.input(), k) : `${short(xs[idx])} ${inputUnit}`}:`;
      told.forEach((each, i) => {
        each.textContent = `${short(idx === null ? now(names[i], i) : lines[i][idx] ?? NaN)} ${unitName}`;
      });
    } });
    plot.root.setAttribute("aria-hidden", "true"); // the table above says its numbers
    const marker = htmlPart("div", { class: "marker" }, plot.over);
    plot.over.addEventListener("click", () => { if (plot.cursor.left >= 0) this.goTo(plot.posToVal(plot.cursor.left, "x") / byInput); });
    return Object.assign(made, { plot, marker });
  }

  /** Take the mechanism to a place of the range, the short way round where it turns. */
  goTo(position) {
    const { page } = this, { course } = page, here = page.input();
    const shift = course?.periodic ? here - course.within(here) : 0;
    page.moveTo(position + shift);
  }

  /** Of a diagram, px. */
  width() { return this.printed ? CHART.printed : Math.max(CHART.narrowest, Math.floor(this.place.clientWidth)); }

  fit() {
    const width = this.width();
    for (const { plot } of this.charts) if (this.place.clientWidth && plot.width !== width) plot.setSize({ width, height: CHART.height });
    this.mark();
  }

  /** The markers where the mechanism is. */
  mark() {
    const { page } = this, { course } = page;
    if (course === null) return;
    const at = course.within(page.input());
    for (const each of this.charts) {
      // beside a dead point, between two rows of the course, a rate may be greater than all of them
      const limits = each.range(each.now());
      if (limits.some((end, k) => end !== each.limits[k])) {
        each.limits = limits;
        each.plot.setScale("y", { min: limits[0], max: limits[1] });
      }
      each.marker.style.transform = `translateX(${each.plot.valToPos(at * each.by, "x")}px)`;
      this.tell(each);
    }
  }

  /** A legend's numbers: of where the pointer is in the diagrams, else of where the mechanism is. */
  tell({ plot, tell }) {
    const over = plot !== undefined && plot.cursor.left >= 0 && plot.cursor.idx !== null && plot.cursor.idx !== undefined;
    tell(over ? plot.cursor.idx : null);
  }
}

/** The whole turns by which a link's angle is lessened, so that it starts between −π and π; none where turns count. */
function turnsOf(page, course, name) {
  const { angle } = course.link(name);
  return angle[0] - wrapped(angle[0], page.data.counting.includes(name));
}

/** The range of an axis that holds all lines: the course, and the values of now; `scale` is the greatest of their kind. */
function rangeOf(lines, scale) {
  let low = Infinity, high = -Infinity;
  for (const line of lines) for (const each of line) if (Number.isFinite(each)) [low, high] = [Math.min(low, each), Math.max(high, each)];
  if (!(high >= low)) return [0, 1];
  // what does not change is a straight line in the middle
  const { flat, half, room: part, near_zero: near } = AXIS, room = part * (high - low);
  if (high - low <= flat * Math.max(Math.abs(low), Math.abs(high), scale)) {
    const wide = half * (Math.abs(low) || 1);
    return [low - wide, high + wide];
  }
  return [low >= 0 && low < near * high ? 0 : low - room, high <= 0 && high > near * low ? 0 : high + room];
}
