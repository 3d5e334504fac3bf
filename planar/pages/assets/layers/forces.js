"use strict";
/* The layer of forces: arrows in the pairs, of loads, weights and springs, and curved ones of couples and of the torques
   of inputs, with what they are found by on the page. */

const FORCES_SLICE = 8;  // ms of work at a time
const MOSTLY = 0.9;      // of the motion: what is greater in the rest, as at a change point, has a scale of its own

/** The forces of now and over the course. */
class PageForces {
  constructor(page) {
    this.page = page;
    this.waits = null; // to tell that what acts is other
    this.solver = new Forces(page.data, page.linkage.program);
    const renew = () => { this.wound = this.solver.wound(page.state.w); this.state = null; };
    // nothing is told of inputs where links are held more than once
    this.inputs = this.solver.square ? page.data.forces.inputs : [];
    page.on("size", renew);
    page.on("acting", () => {
      renew();
      page.course?.kept.delete("forces");
      this.waits ??= requestAnimationFrame(() => { this.waits = null; if (page.course) page.emit("course"); });
    });
    renew();
  }

  /** What `Forces.at` says of where the mechanism is. */
  now() {
    const { page } = this;
    if (this.state !== page.state) {
      this.state = page.state;
      this.found = this.solver.at(page.loadedState(page.linkage, page.state), page.data.inputs.map((_, k) => page.input(k)), page.linkage.d, this.wound, page.acting?.values);
    }
    return this.found;
  }

  /** What an input supplies now; NaN where that is not told. */
  effort(name) {
    const found = this.now();
    return found.efforts ? this.clean(found, found.inputs.find((each) => each.pair === name)) : NaN;
  }

  /** An input's effort; what is rounding beside the forces is none. */
  clean(found, { effort, slides }) {
    const [force, couple] = this.least(found);
    return Math.abs(effort) <= (slides ? force : couple) ? 0 : effort;
  }

  /** The force and the couple below which there is rounding alone. */
  least(found) {
    const { size } = this.page.data, couple = Math.max(torqueOf(found), greatestForce(found) * size);
    return [(FORCE_ROUND_OFF * couple) / size, FORCE_ROUND_OFF * couple];
  }

  /** Over the course: of every input its efforts, and at each row the greatest force (N); null until that is known, which
      is told as the course is. */
  over(course) {
    const known = course.keep("forces", () => ({
      efforts: Object.fromEntries(this.inputs.map(({ pair }) => [pair, new Float64Array(course.count).fill(NaN)])),
      most: new Float64Array(course.count), done: 0, waiting: false,
    }));
    if (!known.waiting) this.work(course, known);
    return known.done === course.count ? known : null;
  }

  /** A slice of it, the rest a little later. */
  work(course, known) {
    const { page, solver } = this, inputs = page.data.inputs.map((_, k) => page.input(k)), until = performance.now() + FORCES_SLICE;
    for (; known.done < course.count && performance.now() < until; known.done++) {
      const row = course.rows[known.done], there = inputs.map((each, k) => (k === course.input ? row.at : each));
      const found = solver.at(row.loaded, there, page.linkage.d, this.wound, page.acting?.values);
      if (!found.efforts) continue;
      for (const each of found.inputs) known.efforts[each.pair][known.done] = this.clean(found, each);
      known.most[known.done] = greatestForce(found);
    }
    known.waiting = known.done < course.count;
    if (!known.waiting) return;
    setTimeout(() => {
      if (page.course !== course || course.kept.get("forces") !== known) return;
      this.work(course, known);
      if (!known.waiting) page.emit("course");
    });
  }
}

/** The greatest force (N) of a position. */
function greatestForce({ pairs, acting, inputs }) {
  const of = ({ force: [x, y] }) => (Number.isFinite(x + y) ? Math.hypot(x, y) : 0);
  return Math.max(0, ...[...pairs, ...acting, ...inputs].map(of));
}

/** What pairs do to the links chosen, or else to their second links: [{pair, link, by, at, force, couple}, ...]. */
function pairForces({ pairs }, chosen) {
  return pairs.flatMap(({ name, links: [first, second], at, force, couple, couples }) => {
    const wanted = (list) => list.filter((link) => chosen.includes(link));
    if (at === null) {
      const on = Object.keys(couples), told = chosen.length ? wanted(on) : on;
      return told.map((link) => ({ pair: name, link, by: null, at, force, couple: couples[link] }));
    }
    return (chosen.length ? wanted([second, first]) : [second]).map((link) => {
      const sense = link === second ? 1 : -1;
      return { pair: name, link, by: link === second ? first : second, at, force: force.map((each) => sense * each), couple: sense * couple };
    });
  });
}

const forceArrows = {
  key: "forces",
  label: "Forces",
  draw(ink, layers) {
    const { page } = layers, { data } = page, found = page.forces.now(), chosen = page.chosen.links();
    if (!found.efforts) return `Forces: ${found.why}`;
    const most = greatestForce(found), usual = usualForce(page, most), [nothing, still] = page.forces.least(found);
    const [byTorque, torqueUnit] = unitOf(page, "torque");
    const pushes = [
      ...pairForces(found, chosen).filter((each) => each.at !== null).map((each) => ({ ...each, kind: "reaction", name: each.pair, of: "reaction" })),
      ...[...found.acting, ...found.inputs].map((each) => ({ ...each, of: `load ${each.kind}` })),
    ];
    const { px, told } = roundScale(page, most > BEYOND * usual ? most : usual, MAX_ARROW_LENGTH, unitOf(page, "force")), turned = [];
    for (const { at, force, couple, of, kind, name, link } of pushes) {
      const tail = layers.at(at), length = Math.hypot(...force), [symbol, turning] = data.forces.symbols[kind][name][link];
      const key = `${of} ${symbol} ${link}`;
      if (length > nothing) {
        const tip = [tail[0] + force[0] * px, tail[1] - force[1] * px];
        ink.arrow(tail, tip, `arrow ${of}`);
        // an arrow too short to be seen is in the table
        if (length * px > 2) ink.letter(tip, [symbol], `letter ${of}`, { away: [force[0], -force[1]], key });
      }
      if (Math.abs(couple) > still) {
        const there = turned.filter((each) => Math.hypot(each[0] - tail[0], each[1] - tail[1]) < 1).length;
        turned.push(tail);
        const { at: place, away } = ink.turn(tail, there, Math.sign(couple), `arrow ${of}`);
        ink.letter(place, [turning], `letter ${of}`, { away, key: `${key} turned`, told: ` = ${figures3(Math.abs(couple) * byTorque)} ${torqueUnit}` });
      }
    }
    const on = chosen.length ? `of the pairs on ${chosen.join(", ")}` : "of every pair on its second link";
    return [`Forces: ${most > 0 ? told : "none"}, ${on}${data.forces.massive ? ", with the links' inertia" : ""}`, ...forceNotes(page, found)].join("; ");
  },
};

/** What else there is to say of forces. */
function forceNotes(page, found) {
  const { timed, choices } = page.data.forces;
  return [found.why, timed ? "loads that vary with time are those at 0 s" : "", ...choices].filter(Boolean);
}

/** The greatest couple (N m) of a position. */
function torqueOf({ pairs, acting, inputs }) {
  return Math.max(0, ...[...pairs, ...acting, ...inputs].map(({ couple }) => (Number.isFinite(couple) ? Math.abs(couple) : 0)));
}

/** What the greatest force is in most of the motion, away from dead points; else that of now. */
function usualForce(page, now) {
  const { course } = page, calm = course?.calm(RATES.acceleration.parts) ?? [];
  if (!calm.length) return now;
  const over = page.forces.over(course);
  if (over === null) return now;
  const told = calm.map((i) => over.most[i]).sort((a, b) => a - b);
  return told[Math.floor(MOSTLY * (told.length - 1))] || now;
}

/** Three figures. */
function figures3(value) { return String(Number(value.toPrecision(3))); }
