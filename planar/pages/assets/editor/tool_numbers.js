"use strict";
/* Numbers that stand beside the tools, for what is drawn next: {key, tool, label, value; kind: "tick", or a number}. */

const TOOL_NUMBERS = [
  { key: "along", tool: "pin", label: "The rest goes along", kind: "tick" },
  { key: "ratio", tool: "gear", label: "Ratio of wheels", value: -2 },
  { key: "first", tool: "belt", label: "Radius of the first pulley", value: "" },
  { key: "second", tool: "belt", label: "Radius of the second pulley", value: "" },
  { key: "crossed", tool: "belt", label: "Crossed", kind: "tick" },
  { key: "lift", tool: "cam", label: "Lift, a length or an angle", value: "" },
  { key: "roller", tool: "cam", label: "Radius of the roller", value: "" },
];

class ToolNumbers {
  constructor(editing) {
    this.editing = editing;
    this.fields = Object.fromEntries(TOOL_NUMBERS.map(({ key, kind, value }) => [key, Forms.element("input", kind === "tick" ? { type: "checkbox" } : { type: "number", step: "any", value })]));
    this.boxes = TOOL_NUMBERS.map(({ key, label, tool }) => Forms.element("label", { class: "choice", "data-tool": tool }, `${label} `, this.fields[key]));
  }

  /** What is typed or ticked; null where nothing is. */
  read(key) {
    const { type, checked, value } = this.fields[key];
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

  show(tool) { for (const each of this.boxes) each.hidden = each.dataset.tool !== tool; }
}
