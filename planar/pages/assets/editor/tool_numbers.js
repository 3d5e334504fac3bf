"use strict";
/* Numbers that stand beside the tools, for what is drawn next: {key, tool, label, value; kind: "tick", "choice" of a list
   that the page has by its key, or a number}. */

const TOOL_NUMBERS = [
  { key: "along", tool: "pin", label: "The rest goes along", kind: "tick" },
  { key: "ratio", tool: "gear", label: "Ratio of wheels", value: -2 },
  { key: "first", tool: "belt", label: "Radius of the first pulley", value: "" },
  { key: "second", tool: "belt", label: "Radius of the second pulley", value: "" },
  { key: "crossed", tool: "belt", label: "Crossed", kind: "tick" },
  { key: "lift", tool: "cam", label: "Lift, a length or an angle", value: "" },
  { key: "roller", tool: "cam", label: "Radius of the roller", value: "" },
  { key: "rises", tool: "cam", label: "Motion of the rise", kind: "choice", value: "cycloidal" },
  { key: "rise", tool: "cam", label: "Rise (deg)", value: 120 },
  { key: "dwell", tool: "cam", label: "Dwell above (deg)", value: 60 },
  { key: "return", tool: "cam", label: "Return (deg)", value: 120 },
];

class ToolNumbers {
  constructor(editing) {
    this.editing = editing;
    this.fields = Object.fromEntries(TOOL_NUMBERS.map((each) => [each.key, this.field(each)]));
    this.boxes = TOOL_NUMBERS.map(({ key, label, tool }) => Forms.element("label", { class: "choice", "data-tool": tool }, `${label} `, this.fields[key]));
  }

  field({ key, kind, value }) {
    if (kind === "tick") return Forms.element("input", { type: "checkbox" });
    if (kind !== "choice") return Forms.element("input", { type: "number", step: "any", value });
    const made = Forms.element("select", {}, ...this.editing[key].map((each) => Forms.element("option", { value: each }, each)));
    made.value = value;
    return made;
  }

  /** What is typed, chosen or ticked; null where nothing is. */
  read(key) {
    const { tagName, type, checked, value } = this.fields[key];
    if (tagName === "SELECT") return value;
    return type === "checkbox" ? checked : Forms.typed(value);
  }

  /** A number in the file's unit of length, in m. */
  length(key) { return this.scaled(key, "length"); }

  scaled(key, kind) {
    const given = this.read(key);
    return given === null ? null : given * this.editing.units[kind];
  }

  /** A lift, in m or rad as its follower moves. */
  lift() { return { length: this.scaled("lift", "length"), angle: this.scaled("lift", "angle") }; }

  /** The law of a cam: its motion, and the angles of rise, dwell and return (deg). */
  law() { return { motion: this.read("rises"), angles: ["rise", "dwell", "return"].map((key) => this.read(key)) }; }

  show(tool) { for (const each of this.boxes) each.hidden = each.dataset.tool !== tool; }
}
