"use strict";
/* A page made of its data and functions; a name of its own for each part that others ask for. */

/** Begin in the document as it came: all parts of a page, in the order in which they hear of what happens; `undo` goes on from a page before. */
function startPage(data, program, undo = new UndoHistory()) {
  document.documentElement.classList.toggle("compact", memory.read("compact") !== null);
  const page = new Page(Figures.recall(data), program), hasPencil = Boolean(data.edited || globalThis.editing);
  globalThis.page = page;
  Keeping.recall(page);
  page.wanted = Wanted.of(page);
  const svg = document.getElementById("drawing"), drawing = new Drawing(page, svg), dragging = new Dragging(page, svg);
  const controls = new Controls(page, document.getElementById("controls"), svg, drawing, dragging);
  new Courses(page);
  const lens = new Lens(page, svg, drawing, dragging);
  new InputRates(page, document.getElementById("acting"));
  page.acting = new Acting(page, document.getElementById("acting"), hasPencil);
  new Dimensions(page, document.getElementById("dimensions"));
  new Assemblies(page, document.getElementById("assemblies"));
  if (!hasPencil) new PinDragging(page, svg, lens, () => controls.pause());
  undo.attach(page, controls.bar, () => controls.pause());
  const saving = new Saving(page, document.getElementById("saving"), svg, hasPencil);
  new Films(page, saving, svg, () => controls.pause());
  page.tolerances = Tolerances.ofFile(page);
  startLayers(page);
  new Influence(page, document.getElementById("dimensions"));
  if (page.wanted !== null) {
    new WantedDrawing(page, svg, drawing);
    new WantedTable(page, document.getElementById("wanted"));
  }
  page.keeping = new Keeping(page);
  globalThis.additions?.attach({ page, svg, lens });
  drawing.settle();
  new Panels(page, document.querySelector(".right"));
  document.getElementById("still")?.remove(); // what moves stands in its place
  Object.assign(globalThis, { svg, drawing, dragging, controls, lens });
  return { page, svg, drawing, dragging, controls, lens, undo, saving };
}

/** The main part of the document as it came, for pages that take the place of others. */
const MainPart = {
  keep() {
    this.blank = document.querySelector("main").cloneNode(true);
    this.blank.querySelector("#still")?.remove();
  },

  /** Blank again, and the page that was there at its end. */
  renew({ controls, page }) {
    controls.pause();
    page.lifetime.abort();
    document.querySelector("main").replaceWith(this.blank.cloneNode(true));
  },
};

/** Begin, with the pencil where the page is one to draw on. */
function beginPage(data, program) {
  MainPart.keep();
  if (data.edited) globalThis.editing = new Editing(data, program);
  else globalThis.additions = new Additions(data, program);
}
