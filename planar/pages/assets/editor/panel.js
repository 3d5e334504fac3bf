"use strict";
/* The tools above the drawing, and beside it what is said of what is drawn, the numbers of what is chosen, and its file. */

/** What a drawing that is no mechanism yet wants next. */
const NEXT_STEPS = {
  empty: "Draw the first bar: press on the paper, and drag to its other end. Then fix pins with Ground, and drive one with Input.",
  drawn: "Nothing is fixed yet: take Ground, and click the pins that stand still.",
};

class PencilPanel {
  constructor(editing) {
    this.editing = editing;
    this.tools();
    const { element } = Forms, section = (this.section = element("section", { id: "pencil", "aria-label": "Drawing" }));
    this.mobility = element("p", { class: "mobility" });
    this.problem = element("p", { class: "why" });
    this.remedies = element("ul", { class: "remedies" });
    this.chosen = element("div", { class: "chosen" });
    const told = element("div", { role: "status" }, this.mobility, this.problem, this.remedies);
    section.append(element("h2", {}, "Drawing"), told, this.chosen, this.files(), editing.wishing.form.box, editing.underlay.form.box, this.text());
  }

  button(text, act, more = {}) {
    const made = Forms.element("button", { type: "button", ...more }, text);
    made.addEventListener("click", act);
    return made;
  }

  tools() {
    const { editing } = this;
    this.bar = Forms.element("div", { class: "pencils", role: "toolbar", "aria-label": "Pencil" });
    this.buttons = Object.entries(TOOLS).map(([key, { name, told }]) => {
      const made = this.button(name, () => editing.use(key), { title: told, "aria-pressed": "false" });
      this.bar.append(made);
      return [key, made];
    });
    this.numbers = new ToolNumbers(editing);
    this.undo = this.button("Undo", () => editing.parts.undo.undo(), { "aria-keyshortcuts": "Control+Z" });
    this.redo = this.button("Redo", () => editing.parts.undo.redo(), { "aria-keyshortcuts": "Control+Shift+Z Control+Y" });
    this.bar.append(...this.numbers.boxes, this.undo, this.redo);
    this.hint = Forms.element("p", { class: "hint", id: "pencil-hint", role: "status" });
    // one stop for the tab key, arrows from tool to tool
    this.bar.addEventListener("keydown", (event) => {
      const list = [...this.bar.querySelectorAll("button:enabled")], at = list.indexOf(document.activeElement);
      const to = { ArrowRight: at + 1, ArrowLeft: at - 1, Home: 0, End: list.length - 1 }[event.key];
      if (at < 0 || to === undefined) return;
      event.preventDefault();
      list[(to + list.length) % list.length].focus();
    });
  }

  files() {
    const { editing } = this, { element } = Forms;
    this.name = element("input", { type: "text", size: 18, "aria-label": "Name of the file", placeholder: "name.json" });
    this.saved = element("span", { class: "hint" });
    const box = element("p", { class: "files" }, this.button("Save", () => editing.filing.save(null)), this.name,
      this.button("Save as", () => editing.filing.save(this.name.value)), this.button("Copy link", () => editing.filing.copyLink()), this.saved);
    this.link = element("textarea", { readonly: "", rows: 2, "aria-label": "Link of the mechanism", hidden: "" });
    return element("div", {}, box, this.link);
  }

  text() {
    const { element } = Forms;
    this.area = element("textarea", { rows: 14, spellcheck: "false", "aria-label": "Text of the file" });
    this.whole = element("details", {}, element("summary", {}, "Text of the file"), this.area, this.button("Take this text", () => this.editing.filing.take(this.area.value)));
    this.whole.addEventListener("toggle", () => this.show());
    return this.whole;
  }

  show() {
    const { editing } = this, { answer, tool, file } = editing;
    for (const [key, button] of this.buttons) {
      button.setAttribute("aria-pressed", String(key === tool));
      button.tabIndex = key === tool ? 0 : -1;
    }
    this.numbers.show(tool);
    this.hint.textContent = tool === "hand" ? "" : `${TOOLS[tool].told} Keys: arrows lead the cross, Enter presses, N goes to the next pin, Esc leaves off.`;
    this.hint.hidden = tool === "hand";
    editing.parts.undo.show();
    this.mobility.textContent = answer?.mobility ?? "";
    // an answer is of the file that it was asked of, which may have changed since
    if (answer) answer.isUnfixed ??= answer.place === `$.links.${file.frame}` && !Pins.ofLink(file.links[file.frame]).length;
    const nextStep = !answer?.isUnfixed ? "" : Object.keys(file.links).length > 1 ? NEXT_STEPS.drawn : NEXT_STEPS.empty;
    this.problem.textContent = nextStep || (answer?.problem ? `${answer.place ? `${answer.place}: ` : ""}${answer.problem}` : "");
    this.problem.hidden = !answer?.problem;
    this.problem.className = nextStep ? "hint" : "why";
    this.remedies.replaceChildren(...(answer?.remedies ?? []).map((each) => Forms.element("li", {}, each)));
    this.saved.textContent = editing.fileName ? `${editing.fileName}${editing.changed ? ", not saved yet" : ""}` : "no file yet";
    if (this.whole.open && document.activeElement !== this.area) this.area.value = JSON.stringify(file, null, 2);
    editing.underlay.form.show();
    editing.wishing.show();
    this.fields();
  }

  /** The numbers of what is chosen, where they are typed. */
  fields() {
    const { editing, chosen } = this, { chosen: one, units } = editing, { unit } = editing, kept = document.activeElement;
    if (chosen.contains(kept) && kept.tagName === "INPUT" && this.shown === JSON.stringify(one)) return;
    this.shown = JSON.stringify(one);
    chosen.replaceChildren();
    const field = (label, value, act) => {
      const input = Forms.element("input", { type: "text", size: 9, autocomplete: "off" });
      input.value = value;
      input.addEventListener("change", () => act(input.value));
      chosen.append(Forms.element("label", { class: "choice" }, `${label} `, input));
    };
    const number = (label, value, act) => field(`${label} (${unit})`, Forms.shown(value / units.length), (text) => {
      const given = Forms.typed(text);
      if (given !== null) act(given * units.length);
      else editing.say(`${label}: a number in ${unit} is wanted.`);
    });
    if (one?.kind === "pin" && editing.at.has(one.name)) {
      const at = editing.at.get(one.name);
      field("Pin", one.name, (text) => editing.rename(one.name, text));
      at.forEach((each, k) => number("xy"[k], each, (value) => editing.leading.move(one.name, at.map((own, i) => (i === k ? value : own)))));
    } else if (one?.kind === "link" && editing.file.links[one.name]) {
      chosen.append(Forms.element("strong", {}, one.name), " ");
      const { ends } = editing.file.links[one.name], places = ends?.map((point) => editing.placed.place(one.name, point));
      if (places?.every(Boolean)) {
        const [a, b] = places, pin = Pins.of(editing.placed.pins, one.name, ends[1]);
        number(`length ${ends.join("")}`, Plane.apart(a, b), (value) => editing.leading.move(pin, Plane.on(a, Plane.unit(Plane.minus(b, a)), value)));
      }
      const draw = (make) => editing.perform((draft) => make(draft, one.name, 2 * editing.sketch.step));
      chosen.append(this.button("Copy", () => draw(Draw.copyLink), { "aria-label": `Copy ${one.name}` }));
      chosen.append(this.button("Mirror", () => draw(Draw.mirrorLink), { "aria-label": `Mirror ${one.name}` }));
    } else return;
    chosen.append(this.button("Erase", () => editing.erase(), { "aria-label": `Erase ${one.name}` }));
  }
}
