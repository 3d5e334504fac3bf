"use strict";
/* Springs and dampers of the drawing, which lengthen and turn with what they hang on, and centres of mass on their links. */

class Springs {
  constructor(drawing) {
    this.drawing = drawing;
    this.all = drawing.marks.filter(({ kind }) => kind === "Coil" || kind === "Spiral").map((mark) => {
      const path = Symbols.element("path", { class: "spring" }), group = Symbols.element("g");
      group.append(Symbols.element("title", {}, mark.name), path);
      drawing.levels.springs.append(group);
      return { mark, path };
    });
    this.coils = this.all.map(({ mark }) => mark).filter(({ kind }) => kind === "Coil");
    this.room = 8 * this.coils.length; // numbers that `avoided` fills in
  }

  /** Where the two ends of a spring are on the screen. */
  ends(mark) {
    const { drawing } = this;
    return mark.links.map((link, k) => drawing.screen(link, drawing.px(mark.at[k])));
  }

  /** Draw all of them where the mechanism is. */
  place() {
    const { page, mm } = this.drawing;
    for (const { mark, path } of this.all) {
      if (mark.kind === "Coil") {
        const ends = this.ends(mark);
        path.setAttribute("d", Plane.apart(...ends) > 0.01 ? Symbols.coil(...ends, page.data.coils[mark.symbol], mm) : "");
        continue;
      }
      const [first, second] = mark.links.map((link, k) => {
        const f = page.frames[link], [x, y] = mark.ways[k];
        return Math.atan2(f.sin * x + f.cos * y, f.cos * x - f.sin * y);
      });
      const [a, b] = mark.links.map((link) => page.frames[link].angle), wound = Symbols.wrapped(b - a - mark.free);
      const at = this.drawing.screen(mark.pin, this.drawing.px(mark.at));
      path.setAttribute("d", Symbols.spiral(at, first, second, wound, mark.symbol, mm));
    }
  }

  /** Fill in both sides of every spring, which letters keep off: [x, y, x, y, ...] from a place on. */
  avoided(strokes, from) {
    this.coils.forEach((mark, k) => {
      const ends = this.ends(mark), way = Plane.unit(Plane.minus(...ends));
      const off = Plane.times(Symbols.quarter(way), Symbols.WIDE * this.drawing.mm);
      strokes.set([1, -1].flatMap((side) => ends.flatMap((end) => Plane.on(end, off, side))), from + 8 * k);
    });
  }
}

/** The marks of the centres of mass, on their links. */
function massCentres(drawing) {
  for (const { kind, link, at } of drawing.marks) {
    if (kind !== "Centre") continue;
    const spot = drawing.px(at);
    drawing.part("sliders", link, ...Symbols.massCentre(spot, drawing.mm));
    drawing.round(link, spot, Symbols.MASS * drawing.mm, 8);
  }
}
