"use strict";
/* Other assemblies by a choice: those at the file's inputs and dimensions, in the order of `planar modes`. */

class Assemblies {
  static NEAR = 1e-6; // sizes, rad: unknowns of one assembly agree within this

  constructor(page, section) {
    this.page = page;
    const { list, more } = page.data.assemblies;
    if (list.length < 2) { section.remove(); return; }
    this.count = `${list.length}${more ? " and more" : ""}`;
    this.select = Forms.element("select", { id: "assembly" });
    this.unlisted = Forms.element("option", { value: "" }, "none of those listed");
    list.forEach((each, k) => {
      const option = Forms.element("option", { value: k }, this.told(each, k));
      option.disabled = each.beyond_stop; // no motion brings the linkage there, or starts there
      this.select.append(option);
    });
    this.now = Forms.element("p", { class: "note" });
    section.append(
      Forms.element("h2", {}, "Assemblies"),
      Forms.element("label", { for: "assembly" }, `Assembly, of ${this.count}`), this.select, this.now,
    );
    this.select.addEventListener("change", () => { if (this.select.value !== "") this.take(Number(this.select.value)); });
    page.on("move", () => this.show());
    this.show();
  }

  told({ circuit, branch, beyond_stop }, k) {
    if (beyond_stop) return `${k + 1}: beyond a stop`;
    const on = circuit && `circuit ${circuit[0]} of ${circuit[1]}, branch ${branch[0]} of ${branch[1]}`;
    return on ? `${k + 1}: ${on}` : `${k + 1}`;
  }

  /** Whether inputs and dimensions are as in the file. */
  asFiled() {
    const { data, linkage } = this.page;
    return linkage.d.every((each, k) => each === data.dimensions[k].value)
      && data.inputs.every((each, k) => Math.abs(each.position / linkage.scale[k] - linkage.u[k]) < Assemblies.NEAR);
  }

  take(k) {
    const { page } = this, { data } = page, moved = !this.asFiled();
    this.page.assembly = k;
    page.take(data.assemblies.list[k].z);
    const where = data.inputs.length ? Forms.inputs(page) : "the file's dimensions";
    page.say(`Assembly ${k + 1} of ${this.count}${moved ? `, back at ${where} with the file's dimensions` : ""}.`);
  }

  /** Which assembly it is: told where inputs and dimensions are the file's, else the one that it was moved from. */
  show() {
    const { page: { data, linkage } } = this, filed = this.asFiled();
    if (filed) {
      const gap = (a, b, i) => Math.abs(data.unknown_angles[i] ? 2 * Math.sin((a - b) / 2) : a - b);
      const apart = data.assemblies.list.map(({ z }) => z.reduce((most, each, i) => Math.max(most, gap(each, linkage.z[i], i)), 0));
      const found = apart.findIndex((each) => each === Math.min(...apart));
      this.page.assembly = apart[found] < Assemblies.NEAR ? found : null;
    }
    if (this.page.assembly === null) this.select.append(this.unlisted);
    else this.unlisted.remove();
    this.select.value = this.page.assembly ?? "";
    if (this.filed === filed) return;
    this.filed = filed;
    this.now.textContent = filed
      ? "As listed: inputs and dimensions are the file's."
      : "Moved on from this assembly; to choose another goes back to the file's inputs and dimensions.";
  }
}
