"use strict";
/* Layers of the points chosen: their paths with marks at equal parts of the input's range, and arrows of their velocity
   or acceleration. */

const BEYOND = 2; // times the usual: beside a dead point the scale is that of now

const RATES = {
  velocity: { word: "velocity", unit: "velocity", parts: ["vx", "vy"] },
  acceleration: { word: "acceleration", unit: "acceleration", parts: ["ax", "ay"] },
};

const paths = {
  key: "paths",
  still: true,
  label: "Paths of points",
  draw(ink, layers) {
    // while the dimensions follow what is dragged, the path of just before
    const { page } = layers, course = page.course ?? (page.wanted?.waits ? page.former : null), names = page.chosen.points();
    if (course === null) return page.data.inputs.length ? "Paths: the motion is being solved" : "Paths: no input runs";
    const { inputs, count } = course, [by] = unitOf(page, page.data.inputs[course.input].slides ? "length" : "angle");
    const range = inputs[count - 1] - inputs[0], step = course.whole ? range / PATH_MARKS : roundUp((range * by) / PATH_MARKS) / by;
    names.forEach((name, k) => {
      const { x, y } = course.point(name), place = (i) => layers.at([x[i], y[i]]);
      ink.line(course.path(name).map((place) => layers.at(place)), `path series${k % SERIES}`);
      for (let m = Math.ceil(inputs[0] / step - 1e-9); m * step <= inputs[count - 1] + 1e-9; m++) {
        const row = Math.max(0, Math.min(count - 1, ((m * step - inputs[0]) / range) * (count - 1)));
        const i = Math.min(count - 2, Math.floor(row));
        const [a, b] = [place(i), place(i + 1)];
        ink.dot([0, 1].map((axis) => a[axis] + (row - i) * (b[axis] - a[axis])), DOT_RADIUS, `mark series${k % SERIES}`);
      }
    });
    if (!names.length) return "Paths: choose points to see them";
    const { pair } = page.data.inputs[course.input];
    return `Paths: marks at equal times of a steady input, every ${inputTold(page, step, course.input)} of ${pair}`;
  },
};

function arrows(rate) {
  const { word, unit, parts } = RATES[rate], Word = `${word[0].toUpperCase()}${word.slice(1)}`;
  return {
    key: rate,
    label: `${Word} arrows`,
    draw(ink, layers) {
      const { page } = layers, names = page.chosen.points();
      const now = names.map((name) => page.point(name));
      if (!names.length) return `${Word}: choose points to see it`;
      if (now[0][rate] === null) return `${Word}: ${page.undetermined}`;
      const usual = greatest(page, names, parts), most = Math.max(...now.map((point) => Math.hypot(...point[rate])));
      if (!(usual > 0)) return `${Word}: none of these points has one at the inputs' rates`;
      const { px, told } = roundScale(page, most > BEYOND * usual ? most : usual, MAX_ARROW_LENGTH, unitOf(page, unit));
      now.forEach((point) => {
        const tail = layers.at(point.position), [x, y] = point[rate];
        ink.arrow(tail, [tail[0] + x * px, tail[1] - y * px], `arrow ${rate}`);
      });
      return `${Word}: ${told}`;
    },
  };
}

/** The greatest rate of points over the whole motion, but for what is beside dead points; else that of now. */
function greatest(page, names, parts) {
  const { course } = page;
  let most = 0;
  for (const name of names) {
    if (course !== null && course.calm(parts).length) {
      const columns = course.point(name);
      for (const i of course.calm(parts)) most = Math.max(most, Math.hypot(...parts.map((part) => columns[part][i])));
    } else {
      const { velocity, acceleration } = page.point(name);
      most = Math.max(most, Math.hypot(...(parts[0] === "vx" ? velocity : acceleration) ?? [0, 0]));
    }
  }
  // what is zero to round-off is none
  const scale = (course?.scales ?? greatestNumbers(page))[parts[0] === "vx" ? "velocity" : "acceleration"];
  return most > AXIS.flat * scale ? most : 0;
}
