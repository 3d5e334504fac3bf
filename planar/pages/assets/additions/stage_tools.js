"use strict";
/* Places of a page's drawing that a reader gives by the pointer, while a button is pressed: a point of a link, by a click on
   the link and one where it lies; a wanted path, freehand or place after place. */

const LINK_REACH = 14; // px

class StageTools {
  /** `host` takes what is drawn: addPoint(link, place), wish, takeWish(wish). */
  constructor({ page, svg, lens }, host) {
    Object.assign(this, { page, svg, host, tool: null, link: null, stroke: new WishStroke() });
    this.buttons = new Map([["point", lens.tool("Point", "Add a point to a link", () => this.use("point"))]]);
    if (host.mayWish) this.buttons.set("wish", lens.tool("Path", "Draw the wanted path", () => this.use("wish")));
    const own = (act) => (event) => { if (this.tool !== null && event.target.closest("#drawing")) { event.stopPropagation(); act(event); } };
    const stage = svg.parentNode;
    stage.addEventListener("pointerdown", own((event) => this.press(event)), true);
    stage.addEventListener("pointermove", own((event) => this.lead(event)), true);
    stage.addEventListener("pointerup", own((event) => this.release(event)), true);
    stage.addEventListener("click", own(() => undefined), true);
    stage.addEventListener("keydown", (event) => { if (event.key === "Escape" && this.tool !== null) this.use(null); });
    page.on("view", () => this.draw());
    this.use(null);
  }

  use(tool) {
    Object.assign(this, { tool: this.tool === tool ? null : tool, link: null });
    for (const [key, button] of this.buttons) button.setAttribute("aria-pressed", String(key === this.tool));
    const told = { point: "Click a link, then where its point is to lie.", wish: "Draw the path freehand, or click place after place; a click on the first closes it." }[this.tool];
    if (told) this.page.say(told);
    this.draw();
  }

  px({ clientX, clientY }) {
    const { left, top } = this.svg.getBoundingClientRect();
    return [clientX - left, clientY - top];
  }

  /** The link at a place of the screen: what the pointer would take hold of. */
  linkAt({ clientX, clientY }) {
    const grips = document.elementsFromPoint(clientX, clientY).filter((each) => each.classList.contains("grip"));
    return (grips.find((each) => !each.classList.contains("area")) ?? grips[0])?.closest("[data-link]").dataset.link ?? null;
  }

  press(event) {
    if (event.button !== 0) return;
    const { page } = this, at = page.view.toWorld(this.px(event));
    if (this.tool === "wish") { this.svg.setPointerCapture(event.pointerId); this.stroke.begin(at); return; }
    if (this.link === null) {
      this.link = this.linkAt(event);
      page.say(this.link === null ? "Click a link first." : `A point of ${this.link}: click where it is to lie.`);
    } else this.host.addPoint(this.link, at);
  }

  lead(event) {
    this.stroke.lead(this.page.view.toWorld(this.px(event)));
    if (this.stroke.line) this.draw();
  }

  release(event) {
    if (!this.stroke.line) return;
    const { view } = this.page, px = this.px(event), isNear = (at) => Plane.apart(view.toScreen(at), px) < LINK_REACH;
    this.host.takeWish(this.stroke.end(this.host.wish, view.toWorld(px), view.scale, isNear));
  }

  /** What is begun. */
  draw() {
    this.group?.remove();
    const { line } = this.stroke, { view } = this.page;
    if (!line || !view) return;
    this.group = svgPart("g", { class: "pencil" }, this.svg);
    svgPart("polyline", { points: line.map((at) => view.toScreen(at).join(",")).join(" "), class: "wish" }, this.group);
  }
}
