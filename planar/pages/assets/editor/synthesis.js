"use strict";
/* The wanted path of a drawing, and the linkages that the page's server finds for it: how far the search is, stopped on
   demand, its designs with what they miss, each taken over into the drawing in one step. The window keeps the search's number,
   by which a page that is loaded again finds it, running or over. */

const SEARCH_PAUSE = 300; // ms between two looks at how far a search is

class DrawnWish {
  constructor(editing) {
    const { element } = Forms;
    Object.assign(this, { editing, stroke: new WishStroke(), running: null, told: null });
    const form = (this.form = new WishForm({
      get wish() { return editing.wish; },
      get file() { return editing.draft().file; },
      get units() { return editing.units; },
      takeWish: (wish) => this.take(wish),
      offer: (name, text) => DrawnWish.offer(name, text),
    }));
    this.begin = form.button("Synthesise", () => this.search());
    this.end = form.button("Stop", () => this.stop());
    this.status = element("p", { role: "status" });
    this.remarks = element("ul", { class: "remarks" });
    this.designs = element("ol", { class: "designs" });
    this.more = element("div", {}, element("p", { class: "row" }, this.begin, this.end), this.status, this.designs, this.remarks);
    form.box.append(this.more);
  }

  static offer(name, text) {
    const link = Forms.element("a", { download: name, href: URL.createObjectURL(new Blob([text], { type: "application/json" })) });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  }

  // drawn

  isNear(at) {
    const { view } = this.editing, px = view.toScreen(at);
    return (other) => Plane.apart(view.toScreen(other), px) < REACH;
  }

  press({ free }) { this.stroke.begin(free); }
  lead({ free }) { this.stroke.lead(free); this.editing.sketch.draw(); }
  release({ at }) { if (this.stroke.line) this.take(this.stroke.end(this.editing.wish, at, this.editing.view.scale, this.isNear(at))); }

  /** By keys. */
  place({ at }) { this.take(WishStroke.more({ ordered: true, closed: false, places: [], ...this.editing.wish }, at, this.isNear(at))); }

  take(wish) {
    const { editing } = this;
    editing.absorb();
    const drawn = editing.draft();
    editing.commit({ file: editing.file, at: drawn.at, wish });
    editing.say(wish === null ? "Nothing is wanted any more." : `${wish.places.length} places are wanted.`);
  }

  /** On another page: what is wanted is followed, where it is dragged. */
  attach(page) {
    page.on("wanted", () => {
      const [item] = page.wanted?.items ?? [], { editing } = this;
      if (!item || !editing.wish || page !== globalThis.page) return; // not one that was before
      editing.wish = { ...editing.wish, places: item.places.map((at) => [...at]) };
      editing.keep();
    });
  }

  // searched

  async search() {
    const { editing, form } = this;
    Object.assign(this, { told: null });
    const answer = await EditServer.post("synthesise", { task: form.task() });
    if (answer.gone) {
      DrawnWish.offer("task.json", `${JSON.stringify(form.task(), null, 2)}\n`);
      editing.say("The server of this page does not answer; the task is offered as a file for `planar synthesise`.");
      return;
    }
    await this.follow(answer);
  }

  static recall() { try { return JSON.parse(sessionStorage.getItem("search")); } catch { return null; } }
  static keep(search) { try { sessionStorage.setItem("search", JSON.stringify(search)); } catch { /* no store: it lasts as long as the page */ } }

  /** The search that this window has begun before it was loaded again, or its answer. */
  async resume() {
    const search = DrawnWish.recall();
    if (search !== null) await this.follow(await EditServer.post("search", { search }));
  }

  async follow(answer) {
    this.running = answer.search ?? null;
    if (!answer.gone) DrawnWish.keep(this.running);
    this.form.box.open = true;
    for (this.told = answer; this.running !== null && !this.told.is_over;) {
      this.show();
      await new Promise((go) => setTimeout(go, SEARCH_PAUSE));
      this.told = await EditServer.post("search", { search: this.running });
      if (this.told.gone) break;
    }
    this.running = null;
    this.show();
  }

  stop() { EditServer.post("search", { search: this.running, stops: true }); }

  /** A design in place of the drawing: one step. */
  adopt(document, words) {
    const { editing } = this;
    editing.replace(document, true);
    editing.say(`The design that ${words.split(",")[0]} is taken over.`);
  }

  show() {
    const { editing, form, told, running } = this, { element } = Forms;
    form.show(editing.tool === "wish");
    this.more.hidden = !editing.wish?.places.length && !told;
    this.begin.disabled = running !== null || !editing.wish?.places.length;
    this.end.disabled = running === null;
    const found = told?.designs ?? [], over = told?.is_over && !told.problem;
    this.status.textContent = told === null ? "" : told.problem || (over ? `${found.length || "No"} ${found.length === 1 ? "design" : "designs"}.` : `Searching: ${told.progress}`);
    this.remarks.replaceChildren(...(told?.remarks ?? []).map((each) => element("li", {}, each)));
    this.designs.replaceChildren(...found.map(({ words, document }, k) => {
      const take = form.button("Take", () => this.adopt(document, words));
      take.setAttribute("aria-label", `Take design ${k + 1}`);
      return element("li", {}, `${words} `, take);
    }));
  }
}
