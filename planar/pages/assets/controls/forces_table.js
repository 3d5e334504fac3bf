"use strict";
/* The forces as tables, while their layer is shown: what inputs supply, mechanical advantages, what holds wheels of the
   frame, and what pairs do to the links chosen, or else to their second links. Each cell carries its exact SI value as `data-si`. */

class ForceTables {
  constructor(page) {
    this.page = page;
    this.place = htmlPart("div", { class: "tables forces" }, document.getElementById("numbers"));
    for (const event of ["move", "size", "chosen", "shown"]) page.on(event, () => this.fill());
    this.fill();
  }

  fill() {
    const { page, place } = this, shown = page.layers.on.has(forceArrows.key);
    place.hidden = !shown;
    if (!shown) return;
    const found = page.forces.now(), at = page.data.inputs.map((each, k) => `${each.pair} = ${inputTold(page, page.input(k), k)}`).join(", ");
    this.told ??= htmlPart("p", { class: "hint" }, place);
    this.told.textContent = found.efforts ? forceNotes(page, found).join("; ") : `Forces: ${found.why}`;
    this.told.hidden = this.told.textContent === "";
    if (!found.efforts) { for (const key of ["inputs", "advantages", "wheels", "pairs"]) this.rows(key, "", [], []); return; }
    const [force, couple] = page.forces.least(found);
    const number = (value, least, by) => [value, Math.abs(value) <= least ? "0" : Number.isFinite(value) ? figures(value * by) : ""];
    const [degree, angle] = unitOf(page, "angle"), rates = page.given;
    const [[byForce, forceUnit], [byTorque, torqueUnit], [byPower, powerUnit]] = ["force", "torque", "power"].map((kind) => unitOf(page, kind));
    this.rows("inputs", `What inputs supply at ${at}`, [["input"], ["torque or force"], ["unit"], ["power", powerUnit]], found.inputs.map((each, k) => {
      const rate = rates[k][0], [least, by, unit] = each.slides ? [force, byForce, forceUnit] : [couple, byTorque, torqueUnit];
      return [each.pair, number(each.effort, least, by), unit, number(each.effort * rate, least * Math.abs(rate), byPower)];
    }));
    this.rows("advantages", `Mechanical advantage at ${at}, without friction`, [["output"], ["along"], ["for the input"], ["by power"], ["unit"]], found.advantages.map((each) => {
      const [over, overUnit] = each.length ? [byForce, forceUnit] : [byTorque, torqueUnit];
      const [under, underUnit] = each.slides ? [byForce, forceUnit] : [byTorque, torqueUnit];
      const along = { path: "its path", line: "their line" }[each.along] ?? each.along;
      return [each.output, along, each.input, number(each.ratio, 0, over / under), overUnit === underUnit ? "" : `${overUnit} per ${underUnit}`];
    }));
    this.rows("wheels", `Holding torque on wheels of ${page.data.forces.wheels[0]?.frame}, anticlockwise, at ${at}`, [["about"], ["pair"], ["holding torque", torqueUnit]],
      found.wheels.filter((each) => Number.isFinite(each.torque)).map((each) => [each.about, each.pairs.join(", "), number(each.torque, couple, byTorque)]));
    const head = [["pair"], ["on"], ["by"], ["force", forceUnit], ["at", angle], ["along x", forceUnit], ["along y", forceUnit], ["couple", torqueUnit]];
    this.rows("pairs", `Reactions in the pairs at ${at}`, head, pairForces(found, page.chosen.links()).filter((each) => Number.isFinite(each.couple)).map(({ pair, link, by, force: [x, y], couple: turned }) => {
      const size = Math.hypot(x, y), way = Math.atan2(y, x);
      const at = size > force ? [way, figures(way * degree)] : [NaN, ""];
      return [pair, link, by ?? "", number(size, force, byForce), at, number(x, force, byForce), number(y, force, byForce), number(turned, couple, byTorque)];
    }));
  }

  /** One table; its cells are made anew only where there are others. */
  rows(key, title, head, rows) {
    const shape = JSON.stringify(rows.map((row) => row.filter((each) => typeof each === "string")));
    this.tables ??= new Map();
    let table = this.tables.get(key);
    if (table?.shape !== shape) {
      const scroll = htmlPart("div", { class: "scroll", tabindex: "0", role: "group" });
      if (table) table.scroll.replaceWith(scroll); else this.place.append(scroll);
      const body = htmlPart("table", {}, scroll), caption = htmlPart("caption", {}, body);
      const top = htmlPart("tr", {}, htmlPart("thead", {}, body)), rest = htmlPart("tbody", {}, body);
      for (const [name, unit] of head) {
        const cell = htmlPart("th", { scope: "col" }, top, name);
        if (unit) htmlPart("span", { class: "unit" }, cell, ` ${unit}`);
      }
      const cells = rows.map((row) => {
        const line = htmlPart("tr", {}, rest);
        return row.map((_, k) => htmlPart(k ? "td" : "th", k ? {} : { scope: "row" }, line));
      });
      this.tables.set(key, table = { shape, scroll, caption, cells });
    }
    table.scroll.hidden = !rows.length;
    table.scroll.setAttribute("aria-label", title || key);
    table.caption.textContent = title;
    rows.forEach((row, r) => row.forEach((each, c) => {
      const cell = table.cells[r][c], [value, text] = typeof each === "string" ? [undefined, each] : each;
      if (cell.textContent !== text) cell.textContent = text;
      if (Number.isFinite(value)) cell.dataset.si = String(value); else delete cell.dataset.si;
    }));
  }
}
