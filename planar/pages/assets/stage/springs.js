"use strict";
/* Springs and dampers of the drawing, which lengthen and turn with what they hang on. */

class Springs {
  constructor(drawing) {
    this.drawing = drawing;
    this.all = drawing.marks.filter(({ kind }) => kind === "Coil" || kind === "Spiral").map((mark) => {
      const path = Symbols.element("path", { class: "pen-pin" }), group = Symbols.element("g");
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
        path.setAttribute("d", Plane.apart(...ends) > 0.01 ? Symbols.spring(mark.symbol, ...ends, mm) : "");
        continue;
      }
      const [first, second] = mark.links.map((link, k) => {
        const f = page.frames[link], [x, y] = mark.ways[k];
        return Math.atan2(f.sin * x + f.cos * y, f.cos * x - f.sin * y);
      });
      const [a, b] = mark.links.map((link) => page.frames[link].angle), wound = Symbols.wrapped(b - a - mark.free);
      const at = this.drawing.screen(mark.pin, this.drawing.px(mark.at));
      path.setAttribute("d", Symbols.torsionSpring(`torsion ${mark.symbol}`, at, first, second, wound, mm));
    }
  }

  /** Fill in both sides of every spring, which letters keep off: [x, y, x, y, ...] from a place on. */
  avoided(strokes, from) {
    this.coils.forEach((mark, k) => {
      const ends = this.ends(mark), way = Plane.unit(Plane.minus(...ends));
      const off = Plane.times(Symbols.quarter(way), SPRING_HALF_WIDTH * this.drawing.mm);
      strokes.set([1, -1].flatMap((side) => ends.flatMap((end) => Plane.on(end, off, side))), from + 8 * k);
    });
  }
}
