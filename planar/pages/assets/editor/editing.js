"use strict";
/* A mechanism that is drawn: its file, what was done to it, and what Python says of it. Whatever changes the structure is
   answered by the server of the page; a pin that is dragged is solved by the page itself. What is drawn stays in the
   window's own store until it is saved, also where the server is gone. */

const EXPLAIN_PAUSE = 500;  // ms without a change, after which it is looked for what mends it
const BLANK_WIDTH = 0.3;    // m that are seen of empty paper

class Editing {
  constructor(data, program) {
    const { value, name, answer, mark, note } = data.edited;
    Object.assign(this, { file: value, fileName: name, answer, units: answer.units ?? { length: 1e-3, angle: Math.PI / 180 }, usual: answer.usual, rises: answer.rises, wish: null, mark });
    Object.assign(this, { at: new Map(), done: [], undone: [], tool: "hand", chosen: null, linkBefore: null, changed: false, asked: 0, settled: true, nearest: {}, led: null });
    this.sketch = new Sketch(this);
    this.leading = new PinLeading(this);
    this.hand = new Hand(this);
    this.filing = new Filing(this);
    this.underlay = new Underlay(this);
    this.wishing = new DrawnWish(this);
    this.panel = new PencilPanel(this);
    addEventListener("beforeunload", (event) => { if (this.changed) event.preventDefault(); });
    document.body.classList.add("sketching");
    EditServer.present();
    const kept = Editing.recall();
    this.begin(data, program, !answer.problem);
    if (!this.solved) this.guess();
    if (answer.conflicts) this.explain();
    const isCurrent = (kept?.mark ?? mark) === mark, keeps = kept?.changed || isCurrent; // a newer file replaces what is saved
    this.fits = answer.is_pending;
    if (kept?.file) {
      this.mark = keeps ? kept.mark ?? mark : mark; // of the file from which it was drawn on
      this.take({ file: keeps ? kept.file : value, at: new Map(keeps ? kept.at : this.at), wish: Wish.valid(kept.wish) }, kept.changed);
    } else if (answer.is_pending) this.ask();
    else if (!this.placed.pins.size) this.use("bar");
    this.wishing.resume();
    if (kept?.changed && !isCurrent) this.say(`${name} was written by another window or program. This page shows what you have drawn since; Save asks before it replaces the file.`);
    else if (note) this.say(note);
  }

  // what is kept in the window until it is saved; without a store it lasts as long as the page

  static recall() { try { return JSON.parse(sessionStorage.getItem("drawing")); } catch { return null; } }
  keep() { try { sessionStorage.setItem("drawing", JSON.stringify({ ...this.drawn, at: [...this.at], mark: this.mark })); } catch { /* no store */ } }
  static forget() { try { sessionStorage.removeItem("drawing"); } catch { /* no store */ } }

  // the page

  /** Make the page anew of data; where nothing is solved they are those of an empty one, and the sketch stands there. */
  begin(data, program, solved) {
    const view = this.view ?? null, focused = document.activeElement;
    if (this.parts) {
      MainPart.renew(this.parts);
      for (const key of ["at", "view"]) memory.write(key, "");
      document.querySelector("h1").textContent = data.name;
      document.title = data.name;
    }
    this.parts = startPage({ ...data, wanted: solved ? Wish.data(this.wish, this.file, data) : null }, program, new UndoHistory(null, this));
    this.solved = solved;
    this.parts.page.besides = () => (this.solved ? [] : [...this.at.values(), ...(this.wish?.places ?? [])]);
    const { page, svg, lens } = this.parts, stage = document.getElementById("stage");
    document.querySelector(".left").prepend(this.panel.bar, this.panel.hint);
    document.querySelector(".right").prepend(this.panel.section);
    this.hand.attach(stage);
    this.underlay.attach(svg, page);
    this.wishing.attach(page);
    page.on("view", () => { if (!this.hand.dragged) this.sketch.draw(); });
    for (const event of ["move", "size"]) page.on(event, () => this.follow());
    const width = page.view?.width ?? 600;
    lens.base = view?.scale ?? (solved ? page.view?.scale : width / BLANK_WIDTH);
    if (view && !(solved && this.fits)) lens.look(Editing.lensOf(view));
    else if (!solved && page.view) lens.look({ scale: width / BLANK_WIDTH, at: [0.35 * BLANK_WIDTH, 0.2 * BLANK_WIDTH] });
    this.fits = this.fits && !solved;
    svg.setAttribute("aria-describedby", "pencil-hint");
    this.show();
    (focused?.isConnected ? focused : document.getElementById(focused?.id))?.focus({ preventScroll: true });
  }

  static lensOf({ scale, width, height, toWorld }) { return { scale, at: toWorld([width / 2, height / 2]) }; }

  get svg() { return this.parts.svg; }
  get view() { return this.parts?.page.view; }
  get placed() { return new Placed(this.file, this.at, this.units); }
  get unit() { return this.file.units?.length ?? "m"; }

  /** Where all pins are, once the page has moved. */
  follow() {
    const { page } = this.parts;
    if (this.hand.dragged) return; // who leads it draws
    if (this.solved) for (const name of Pins.all(this.file).keys()) if (page.data.points[name]) this.at.set(name, page.point(name).position);
    if (!this.solved || this.tool !== "hand") this.sketch.draw();
  }

  /** Of a file that does not go together: where coordinates and the sketch put its pins. */
  guess() {
    const { file, units } = this, local = (spot) => spot.map((each) => Written.read(each, "length", units) ?? 0);
    for (const [point, where] of Object.entries(file.links?.[file.frame]?.points ?? {})) if (Array.isArray(where)) this.at.set(Pins.of(Pins.all(file), file.frame, point), local(where));
    for (const [pin, where] of Object.entries(file.sketch ?? {})) if (Array.isArray(where)) this.at.set(pin, local(where));
    this.sketch.draw();
  }

  /** Draw links where they are nearest to going together: {link: {point: place}}. */
  approach(nearest) {
    this.nearest = nearest;
    for (const [pin, members] of this.placed.pins) {
      const [own] = members.flatMap(([link, point]) => nearest[link]?.[point] ? [nearest[link][point]] : []);
      if (own) this.at.set(pin, own);
    }
    this.sketch.draw();
  }

  show() {
    document.body.classList.toggle("unsolved", !this.solved);
    document.body.classList.toggle("drawn", this.tool !== "hand");
    if (this.tool !== "hand") this.svg.style.touchAction = "none";
    this.follow();
    this.panel.show();
    this.parts.drawing.fitWindow(); // the numbers of a tool and its hint take room from the drawing
    this.sketch.draw();
  }

  say(sentence) { this.parts.page.say(sentence); }

  /** Where the keys' cross is, for those who do not see it. */
  tell({ pin, link, at }) {
    const told = at.map((each) => Forms.shown(each / this.units.length)).join(", ");
    this.say(pin !== null ? `Pin ${pin} at ${told} ${this.unit}` : `${told} ${this.unit}${link === null ? "" : `, on ${link}`}`);
  }

  use(tool) {
    this.parts.controls.pause();
    Object.assign(this.hand, { pending: [], dragged: null });
    this.hand.rested();
    this.tool = tool;
    this.chosen = tool === "pin" ? this.chosen : null;
    this.parts.lens.show();
    this.show();
    // the hint above the drawing says what a tool does, where there is room for it
    this.say(tool === "hand" || this.panel.hint.offsetParent !== null ? "" : TOOLS[tool].told);
  }

  choose(one) {
    this.chosen = one;
    this.panel.show();
    this.sketch.draw();
  }

  // what is done

  /** What there is, to come back to. */
  get drawn() { return { file: this.file, at: new Map(this.at), wish: this.wish, changed: this.changed }; }

  /** A copy to draw on, with the numbers that the page has been given by hand. */
  draft() {
    const { file, units, parts: { page } } = this;
    return { file: this.solved ? fileNow(page, file, units) : structuredClone(file), at: new Map(this.at), units, usual: this.usual };
  }

  /** What was done on the page since the last step of the drawing becomes one: the file takes its numbers. */
  absorb() {
    const { undo } = this.parts;
    if (!this.solved || !undo.done.length) return;
    this.remember(this.drawn);
    Object.assign(this, { file: this.draft().file, changed: true });
    undo.forget();
  }

  perform(make) {
    this.parts.controls.pause();
    this.absorb();
    const draft = this.draft();
    try {
      const said = make(draft);
      this.commit({ file: new Placed(draft.file, draft.at, draft.units).sketched(), at: draft.at });
      this.say(`${said}.`);
    } catch (problem) {
      this.say(`It was not drawn: ${problem.message}.`);
      this.panel.shown = null; // what is typed is not so
      this.panel.show();
      this.sketch.draw();
    }
  }

  /** What there was before a step: the drawing, or the picture under it, {underlay}. */
  remember(before) {
    this.done.push(before);
    this.undone = [];
  }

  commit(made) {
    this.parts.undo.forget();
    this.remember(this.drawn);
    this.take(made, this.changed || made.file !== this.file);
  }

  undo() { this.step(this.done, this.undone, "Undone"); }
  redo() { this.step(this.undone, this.done, "Redone"); }

  step(from, to, said) {
    const there = from.pop();
    if (there === undefined) { this.say(`Nothing is left to be ${said.toLowerCase()}.`); return; }
    this.hand.pending = [];
    if (there.underlay) {
      to.push({ underlay: this.underlay.laid });
      this.underlay.take(there.underlay);
    } else {
      to.push(this.drawn);
      this.take(there, there.changed);
    }
    this.say(`${said}.`);
  }

  /** Another file: drawn at once, told of once Python has answered. */
  take({ file, at, wish = this.wish }, changed) {
    Object.assign(this, { file, at: new Map(at), wish, changed, nearest: {} });
    if (this.chosen && !(this.chosen.kind === "pin" ? this.at.has(this.chosen.name) : file.links[this.chosen.name])) this.chosen = null;
    this.keep();
    this.solved = false;
    this.show();
    return this.ask();
  }

  /** Ask for the server's answer to what is drawn, at once: it stops computing the answer to the drawing before. */
  async ask() {
    const number = ++this.asked;
    this.settled = false;
    let answer;
    do answer = await EditServer.post("answer", { document: this.file });
    while (answer.is_superseded && number === this.asked); // requests may arrive in another order
    await this.hand.rest(); // nothing is taken from under a hand that draws or presses a button
    if (number !== this.asked) return;
    this.hear(answer);
    this.settled = true;
  }

  hear(answer) {
    this.answer = answer;
    if (answer.gone) this.solved = this.led === this.file; // the page itself has come there
    if (answer.units) Object.assign(this, { units: answer.units, usual: answer.usual });
    if (answer.data) {
      const script = document.createElement("script"); // functions are run as those of any page are
      script.textContent = `globalThis.answered = (() => { ${answer.functions}\nreturn program; })();`;
      document.body.append(script);
      script.remove();
      const said = document.getElementById("said").textContent;
      this.begin(answer.data, globalThis.answered, true);
      this.say(said);
    } else this.show();
    if (answer.conflicts) this.explain();
  }

  rename(pin, name) {
    this.perform((draft) => {
      const said = Draw.renamePin(draft, pin, name);
      this.chosen = { kind: "pin", name: name.trim() };
      return said;
    });
  }

  erase() {
    const { kind, name } = this.chosen;
    this.chosen = null;
    this.perform((draft) => (kind === "pin" ? Draw.removePin(draft, name) : Draw.removeLink(draft, name)));
  }

  /** Another file in place of this one: one step. `fits`: all of it is to be seen. */
  replace(file, fits = false) {
    this.fits = fits;
    this.absorb();
    this.commit({ file, at: new Map() });
    this.guess();
  }

  /** Why it does not go together, by how far, and what mends it: found by a search, once the hand rests. */
  async explain() {
    const number = this.asked;
    await new Promise((go) => setTimeout(go, EXPLAIN_PAUSE));
    if (number !== this.asked) return;
    const answer = await EditServer.post("conflict", { document: this.file });
    await this.hand.rest();
    if (number !== this.asked || answer.is_superseded) return;
    Object.assign(this.answer, { problem: answer.problem || this.answer.problem, remedies: answer.remedies ?? [] });
    this.approach(answer.nearest ?? {});
    this.panel.show();
  }
}
