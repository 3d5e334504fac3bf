"use strict";
/* Quick ways to the panels beside the drawing, and in which figures and units they tell their numbers. */

const PANELS = [["layers", "Layers"], ["wanted", "Wanted"], ["numbers", "Numbers"], ["acting", "Loads"], ["dimensions", "Dimensions"], ["saving", "Save"]];

class Panels {
  constructor(page, right) {
    const bar = Forms.element("nav", { class: "panels", "aria-label": "Panels" });
    for (const [id, text] of PANELS) {
      const section = document.getElementById(id);
      if (!section?.firstElementChild) continue;
      const heading = id === "saving" ? section.getAttribute("aria-label") : text;
      const told = id === "acting" && !page.acting.list.length && section.querySelector(".rate") ? "Speeds" : heading;
      const press = Forms.element("button", { type: "button" }, told);
      press.addEventListener("click", () => {
        section.scrollIntoView({ block: "start" });
        if (!section.hasAttribute("tabindex")) section.tabIndex = -1;
        section.focus({ preventScroll: true });
      });
      bar.append(press);
    }
    right.prepend(bar);
    this.figures(page);
  }

  /** Choices of the figures and units of tables. */
  figures(page) {
    const box = Forms.element("div", { class: "choosing" });
    const choice = (text, list, chosen, act) => {
      const select = Forms.element("select", {}, ...list.map(([value, told]) => Forms.element("option", { value }, told)));
      select.value = chosen;
      select.addEventListener("change", () => act(select.value));
      box.append(Forms.element("label", { class: "choice" }, text, select));
    };
    choice("Figures ", [3, 4, 5, 6, 8, 10, 12].map((each) => [each, each]), Figures.count, (value) => {
      Figures.count = Number(value);
      memory.write("figures", value === "6" ? "" : value);
      page.emit("chosen");
    });
    if (location.protocol !== "about:") { // an output of a notebook has no address to be loaded again from
      choice("Units ", page.data.unit_choices.map(({ name }, k) => [k, name]), page.data.unit_choice, (value) => {
        memory.write("units", value === "0" ? "" : page.data.unit_choices[value].name);
        page.keeping.write();
        location.reload();
      });
    }
    document.getElementById("numbers").prepend(box);
  }
}
