"use strict";
/* Undo and redo of what was done to the mechanism: its dimensions, its inputs, its assembly, what acts on it, what a reader has
   added to it. All that changes between the beginning of one act of the reader (a press, a key, a number entered) and the next is one step. */

const MOST_STEPS = 200;

class UndoHistory {
  /** `renew(there)` makes the page anew where a snapshot has other additions than the page. `drawing` is what is drawn by
      hand, whose steps come before all of the page: {done, undone, undo(), redo(), panel: {undo, redo}}, the last two buttons. */
  constructor(renew = null, drawing = null) {
    Object.assign(this, { renew, drawing, done: [], undone: [], open: false, changed: new WeakSet() });
  }

  /** On a page, which may take the place of one before; its buttons stand in `bar`, or are those of the drawing; `before` is
      done before a step is. */
  attach(page, bar, before) {
    Object.assign(this, { page, before, stood: page.snapshot() });
    this.undoButton = this.drawing?.panel.undo ?? this.button(bar, "Undo", "Control+Z", () => this.undo());
    this.redoButton = this.drawing?.panel.redo ?? this.button(bar, "Redo", "Control+Shift+Z Control+Y", () => this.redo());
    // what plays on while a button of these is pressed belongs to the step that it takes back
    const { signal } = page.lifetime, capture = { capture: true, signal };
    const own = ({ target }) => target === this.undoButton || target === this.redoButton;
    // the click that ends a drag parts it not from what still follows it
    const follows = ({ type }) => type === "click" && page.wanted?.waits;
    for (const name of ["pointerdown", "click", "change"]) document.addEventListener(name, (event) => { if (!own(event) && !follows(event)) this.begin(); }, capture);
    document.addEventListener("keydown", (event) => {
      if (!event.repeat && !own(event)) this.begin();
      if (event.key === "Enter") this.changed.delete(event.target);
    }, capture);
    document.addEventListener("keydown", (event) => this.key(event), { signal });
    // a number that is being typed is the browser's to undo, until it is entered
    document.addEventListener("input", ({ target }) => this.changed.add(target), capture);
    for (const event of ["change", "focusout"]) document.addEventListener(event, ({ target }) => this.changed.delete(target), capture);
    for (const event of ["move", "size", "wanted", "acting"]) page.on(event, () => { if (page === this.page) this.note(); }); // not of one that was before
    this.show();
  }

  button(bar, text, keys, act) {
    const made = htmlPart("button", { type: "button", "aria-keyshortcuts": keys }, bar, text);
    bar.querySelector(".speed")?.before(made);
    made.addEventListener("click", act);
    return made;
  }

  /** A new act of the reader: what changes from here on is a step of its own. */
  begin() { this.open = false; }

  /** Something has changed. */
  note() {
    if (this.restoring || this.page.recording) return;
    const now = this.page.snapshot();
    if (!this.open && !samePosition(this.stood, now)) {
      this.remember();
      this.open = true;
    }
    this.stood = now;
  }

  remember() {
    this.done.push(this.stood);
    if (this.done.length > MOST_STEPS) this.done.shift();
    this.undone = [];
    this.show();
  }

  /** Make the page anew with other additions: one step. */
  add(make) {
    this.begin();
    this.remember();
    this.quietly(make);
  }

  /** What changes meanwhile is no step. */
  quietly(act) {
    this.restoring = true;
    try { act(); } finally { this.restoring = false; }
    this.stood = this.page.snapshot();
    this.show();
  }

  undo() { if (this.done.length || !this.drawing) this.go(this.done, this.undone, "Undone"); else this.drawing.undo(); }
  redo() { if (this.undone.length || !this.drawing) this.go(this.undone, this.done, "Redone"); else this.drawing.redo(); }

  /** What was done on the page has become part of a step of the drawing. */
  forget() {
    [this.done, this.undone] = [[], []];
    this.begin();
    this.show();
  }

  go(from, to, said) {
    this.before(); // what plays stops
    const there = from.pop();
    this.begin();
    if (there === undefined) { this.page.say(`Nothing is left to be ${said.toLowerCase()}.`); return; }
    to.push(this.stood);
    const held = ["undoButton", "redoButton"].find((each) => this[each] === document.activeElement);
    this.quietly(() => (there.added === this.page.data.added ? this.page.restore(there) : this.renew(there)));
    if (held) this[held].focus({ preventScroll: true });
    const at = Forms.inputs(this.page);
    this.page.say(`${said}${at ? `: ${at}` : ""}.`);
  }

  key(event) {
    if (!(event.ctrlKey || event.metaKey) || event.altKey) return;
    const letter = event.key.toLowerCase(), back = letter === "z" && !event.shiftKey, on = letter === "y" || (letter === "z" && event.shiftKey);
    if ((!back && !on) || this.changed.has(event.target)) return;
    event.preventDefault();
    if (back) this.undo(); else this.redo();
  }

  show() {
    this.undoButton.disabled = !this.done.length && !this.drawing?.done.length;
    this.redoButton.disabled = !this.undone.length && !this.drawing?.undone.length;
  }
}

/** Whether two snapshots are of one position of one mechanism, of which the same is wanted; what is added changes by steps of its own. */
function samePosition(a, b) {
  const alike = (one, other) => one.every((each, k) => each === other[k]);
  return alike(a.d, b.d) && alike(a.u, b.u) && alike(a.z, b.z) && alike(a.wanted, b.wanted) && alike(a.acting, b.acting) && alike(a.given.flat(), b.given.flat());
}
