"use strict";
/* How many figures tables tell, and in which units, as the address remembers them. */

const Figures = {
  count: 6,

  /** Before anything is made of a page's data: `data.units` are those that were chosen, `data.filed_units` the file's. */
  recall(data) {
    const count = Number(memory.read("figures"));
    if (Number.isInteger(count) && count > 0 && count <= 15) Figures.count = count;
    const { unit_choices: choices } = data, name = memory.read("units"), k = Math.max(0, choices.findIndex((each) => each.name === name));
    data.filed_units = data.units;
    data.unit_choice = k;
    if (k) for (const key of ["units", "paces", "paper"]) data[key] = choices[k][key];
    return data;
  },
};
