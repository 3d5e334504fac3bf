"use strict";
/* The drawing as dots: one picture (PNG), or the motion of the input that runs, as GIF or video. */

const FILM = {
  frames: 72,          // of a turn, or forth and back
  seconds: 4,          // that it takes
  gif: 640, video: 1280, png: 2000, // px: the longer side at least of a picture, at the most of a film
  samples: 6,          // frames of which a palette is made
  types: ["video/webm;codecs=vp9", "video/webm;codecs=vp8", "video/webm", "video/mp4"],
};

class Films {
  constructor(page, saving, drawing, before) {
    Object.assign(this, { page, saving, drawing, before });
    saving.button(saving.section, "Picture (PNG)", () => this.act(() => this.picture()));
    if (!page.data.inputs.length) return;
    saving.button(saving.section, "Motion (GIF)", () => this.act(() => this.gif()));
    this.type = typeof MediaRecorder === "undefined" ? undefined : FILM.types.find((each) => MediaRecorder.isTypeSupported(each));
    if (this.type) saving.button(saving.section, "Motion (video)", () => this.act(() => this.video()));
  }

  /** One at a time, what plays stops; what goes wrong is told. */
  async act(make) {
    if (this.busy) { this.page.say("Another picture or film is being made."); return; }
    this.busy = true;
    this.before();
    try { await make(); } catch (problem) { this.page.say(`It could not be made: ${problem.message}`); } finally { this.busy = false; }
  }

  /** A canvas that a picture (SVG) of the drawing is put on, so large. */
  canvas(longest, smaller = true) {
    const { width, height } = this.drawing.getBoundingClientRect(), by = longest / Math.max(width, height), zoom = smaller ? Math.min(by, 2) : Math.max(by, 2);
    const even = (value) => 2 * Math.round((value * zoom) / 2); // as films want it
    return Object.assign(document.createElement("canvas"), { width: even(width), height: even(height) });
  }

  async put(canvas, text) {
    const image = new Image(), url = URL.createObjectURL(new Blob([text], { type: "image/svg+xml" }));
    try {
      image.src = url;
      await image.decode();
      canvas.getContext("2d", { willReadFrequently: true }).drawImage(image, 0, 0, canvas.width, canvas.height);
    } finally { URL.revokeObjectURL(url); }
  }

  async picture() {
    const canvas = this.canvas(FILM.png, false);
    await this.put(canvas, Files.picture(this.page, this.drawing));
    this.saving.offer("png", await new Promise((go) => canvas.toBlob(go, "image/png")));
  }

  /** The drawing (SVG) at every frame of the motion; the mechanism stands where it stood afterwards. */
  async frames() {
    const { page, drawing } = this, { course } = page, stood = page.snapshot(), found = [];
    if (!course) throw new Error("the motion is still being found");
    const { inputs, count, whole } = course, low = inputs[0], high = inputs[count - 1], here = page.input();
    // a turn begins where it stands; what goes to and fro goes evenly at its ends
    const at = (part) => (whole ? here + 2 * Math.PI * part : low + (high - low) * (0.5 - 0.5 * Math.cos(2 * Math.PI * part)));
    page.recording = true;
    try {
      if (!whole) page.moveTo(low);
      for (let k = 0; k < FILM.frames; k++) {
        page.moveTo(at(k / FILM.frames));
        found.push(Files.picture(page, drawing));
        page.say(`Frame ${k + 1} of ${FILM.frames}`);
        await new Promise((go) => setTimeout(go)); // a browser stays alive
      }
    } finally {
      page.restore(stood);
      page.recording = false;
    }
    return found;
  }

  async gif() {
    const canvas = this.canvas(FILM.gif), ink = canvas.getContext("2d", { willReadFrequently: true }), frames = await this.frames();
    const shot = async (text) => { await this.put(canvas, text); return ink.getImageData(0, 0, canvas.width, canvas.height); };
    const samples = [];
    for (let k = 0; k < FILM.samples; k++) samples.push(await shot(frames[Math.floor((k * frames.length) / FILM.samples)]));
    const film = new Gif.Film(canvas.width, canvas.height, samples, Math.round((100 * FILM.seconds) / FILM.frames));
    for (const frame of frames) film.add(await shot(frame));
    this.saving.offer("gif", new Blob([film.bytes()], { type: "image/gif" }));
  }

  /** A browser records a video as long as it takes. */
  async video() {
    const canvas = this.canvas(FILM.video), frames = await this.frames(), parts = [];
    await this.put(canvas, frames[0]);
    const recorder = new MediaRecorder(canvas.captureStream(), { mimeType: this.type, videoBitsPerSecond: 5e6 });
    recorder.addEventListener("dataavailable", ({ data }) => parts.push(data));
    const ended = new Promise((go) => recorder.addEventListener("stop", go));
    recorder.start();
    const began = performance.now();
    for (let k = 0; k < frames.length; k++) {
      await this.put(canvas, frames[k]);
      const wait = began + (1000 * FILM.seconds * (k + 1)) / FILM.frames - performance.now();
      await new Promise((go) => setTimeout(go, Math.max(0, wait)));
    }
    recorder.stop();
    await ended;
    this.saving.offer(this.type.includes("mp4") ? "mp4" : "webm", new Blob(parts, { type: this.type }));
  }
}
