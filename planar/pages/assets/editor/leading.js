"use strict";
/* A pin of a drawing that is led: its links' lengths follow at once, solved by the page itself, and Python is asked once it
   is let go; the rest stays where it is, or keeps its lengths and goes along. */

class PinLeading {
  constructor(editing) { this.editing = editing; }

  /** Hold a pin: what it is moved from, and whether the rest goes along. */
  take(pin) {
    const { editing } = this, { parts: { page, drawing, controls }, solved, panel, linkBefore } = editing;
    controls.pause();
    editing.absorb();
    editing.nearest = {}; // what is led is drawn from pin to pin
    const { file, at, units } = editing.draft(), inputs = solved ? page.data.inputs.map((_, k) => page.input(k)) : null;
    drawing.hold(true);
    return { pin, placed: new Placed(file, at, units), inputs, made: null, solved, along: solved && panel.numbers.read("along"), link: linkBefore };
  }

  /** Lead it: at the next frame, however often it is asked for. */
  lead(held, to) {
    held.to = to;
    if (held.waits) return;
    held.waits = true;
    requestAnimationFrame(() => {
      held.waits = false;
      if (this.editing.hand.dragged === held) this.pull(held);
    });
  }

  pull(held) {
    if (held.along) { this.pullAlong(held); return; }
    const { editing } = this, { parts: { page }, units } = editing;
    held.made = held.placed.moved(held.pin, held.to, held.inputs);
    editing.at = held.made.at;
    const shown = held.solved && solvePlaced(page, held, units) === "";
    if (shown !== editing.solved) { editing.solved = shown; document.body.classList.toggle("unsolved", !shown); }
    editing.sketch.draw();
  }

  /** As far as the rest goes along. */
  pullAlong(held) {
    const { editing } = this, { parts: { page }, units } = editing;
    held.made = held.placed.along(held.pin, held.to, held.inputs, held.link);
    const why = solveAlong(page, held, units);
    if (why === "") held.reached = held.made.file;
    editing.say(why ? `${held.pin} stays: ${why}.` : "");
    editing.at = new Map([...editing.at].map(([name, at]) => [name, page.data.points[name] ? page.point(name).position : at]));
    editing.sketch.draw();
  }

  /** Let it go at a place: one step. */
  drop(held, to) {
    const { editing } = this;
    held.to = to;
    editing.parts.drawing.hold(false);
    if (held.along) this.pullAlong(held); else this.pull(held);
    if (held.along && !held.reached) return;
    const { solved } = editing;
    const at = new Map(editing.at), made = held.along ? { file: new Placed(held.reached, at, editing.units).sketched(), at } : held.placed.moved(held.pin, to, held.inputs);
    editing.at = held.placed.at; // to come back to
    editing.commit(made);
    editing.led = solved ? editing.file : null;
    editing.say(`${held.pin} moved${held.along ? ", and what hangs on it" : ""}.`);
  }

  /** To a place that is typed. */
  move(pin, to) { this.drop(this.take(pin), to); }

  /** As it was. */
  revert() {
    const { editing } = this;
    editing.parts.drawing.hold(false);
    editing.take(editing.drawn, editing.changed);
  }
}
