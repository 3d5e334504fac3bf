"use strict";
/* What is told beside the drawing of a path drawn by hand: of which point it is wanted, whether it closes, in what order;
   and the task's file. `host` has the wish, the file and its units, and takes another wish. */

class WishForm {
  /** `host`: {wish, file, units, say(text), takeWish(wish or null), offer(name, text)}. */
  constructor(host) {
    const { element } = Forms;
    this.host = host;
    this.point = element("select", { "aria-label": "Point that is to trace it" });
    this.point.addEventListener("change", () => this.change({ of: this.point.value }));
    this.hint = element("p", { class: "hint" });
    this.closed = this.tick("a closed curve", (closed) => this.change({ closed }));
    this.ordered = this.tick("in this order", (ordered) => this.change({ ordered }));
    this.save = this.button("Task (JSON)", () => host.offer("task.json", `${JSON.stringify(this.task(), null, 2)}\n`));
    this.away = this.button("Erase wanted path", () => host.takeWish(null));
    this.about = element("p", { class: "row" }, element("label", { class: "choice" }, "Traced by ", this.point), this.closed.label, this.ordered.label, this.save, this.away);
    this.box = element("details", { class: "wish" }, element("summary", {}, "Wanted path"), this.hint, this.about);
  }

  button(text, act) {
    const made = Forms.element("button", { type: "button" }, text);
    made.addEventListener("click", act);
    return made;
  }

  tick(text, act) {
    const box = Forms.element("input", { type: "checkbox" });
    box.addEventListener("change", () => act(box.checked));
    return { box, label: Forms.element("label", { class: "choice" }, box, ` ${text}`) };
  }

  task() { return Wish.task(this.host.wish, this.host.file, this.host.units); }
  change(told) { this.host.takeWish({ ...this.host.wish, ...told }); }

  show(drawing) {
    const { wish, file } = this.host, count = wish?.places.length ?? 0;
    if (count || drawing) this.box.open = true;
    this.about.hidden = !count;
    this.hint.textContent = count ? `${count} ${count > 1 ? "places" : "place"}; each can be dragged in the drawing.` : "Draw it freehand on the paper, or click place after place; a click on the first closes it.";
    if (!count) return;
    const points = Wish.points(file);
    this.point.replaceChildren(...points.map((each) => Forms.element("option", { value: each }, each)));
    this.point.value = Wish.point(wish, file);
    this.closed.box.checked = Wish.isClosed(wish);
    this.closed.box.disabled = count < WISH_LEAST_CLOSED;
    this.ordered.box.checked = wish.ordered || this.closed.box.checked;
    this.ordered.box.disabled = this.closed.box.checked;
  }
}
