"use strict";
/* Pictures as an animated GIF (version 89a): one palette of the commonest colours of all, LZW codes of varying width. */

const Gif = (() => {
  const COLOURS = 256, LONGEST = 4096; // colours of a palette; codes of LZW

  /** Five bits of red, green and blue. */
  const key = (data, i) => ((data[i] >> 3) << 10) | ((data[i + 1] >> 3) << 5) | (data[i + 2] >> 3);

  /** A palette for pictures {data} of RGBA bytes: {colours: [[r, g, b], ...], index: of every five-bit colour}. */
  function palette(pictures) {
    const count = new Uint32Array(32768), sums = new Float64Array(3 * 32768);
    for (const { data } of pictures) {
      for (let i = 0; i < data.length; i += 4) {
        const k = key(data, i);
        count[k]++;
        for (let c = 0; c < 3; c++) sums[3 * k + c] += data[i + c];
      }
    }
    const used = Array.from(count.keys()).filter((k) => count[k]).sort((a, b) => count[b] - count[a]).slice(0, COLOURS);
    const colours = used.map((k) => [0, 1, 2].map((c) => Math.round(sums[3 * k + c] / count[k])));
    const index = new Int16Array(32768).fill(-1);
    used.forEach((k, at) => { index[k] = at; });
    return { colours, index };
  }

  /** The place of a colour in a palette: its own, else the nearest, which is then remembered. */
  function place({ colours, index }, k) {
    if (index[k] >= 0) return index[k];
    const [r, g, b] = [(k >> 10) << 3, ((k >> 5) & 31) << 3, (k & 31) << 3];
    let best = 0, least = Infinity;
    colours.forEach(([x, y, z], at) => {
      const far = (x - r - 4) ** 2 + (y - g - 4) ** 2 + (z - b - 4) ** 2;
      if (far < least) [best, least] = [at, far];
    });
    return (index[k] = best);
  }

  /** Bytes as they come, growing. */
  class Bytes {
    constructor() { this.list = new Uint8Array(1 << 16); this.size = 0; }
    add(...bytes) {
      if (this.size + bytes.length > this.list.length) {
        const more = new Uint8Array(2 * this.list.length);
        more.set(this.list);
        this.list = more;
      }
      for (const each of bytes) this.list[this.size++] = each;
    }
    short(value) { this.add(value & 255, value >> 8); }
    text(text) { this.add(...Array.from(text, (each) => each.charCodeAt(0))); }
  }

  /** The codes of a picture's places in the palette, in blocks of up to 255 bytes. */
  function encode(out, pixels) {
    const clear = COLOURS, end = COLOURS + 1;
    let width = 9, next = end + 1, kept = 0, bits = 0, block = [], known = new Map();
    const flush = () => { if (block.length) out.add(block.length, ...block); block = []; };
    const code = (value) => {
      kept |= value << bits;
      for (bits += width; bits >= 8; bits -= 8) {
        block.push(kept & 255);
        kept >>>= 8;
        if (block.length === 255) flush();
      }
    };
    out.add(8);
    code(clear);
    let before = pixels[0];
    for (let i = 1; i < pixels.length; i++) {
      const pair = before * 256 + pixels[i], longer = known.get(pair);
      if (longer !== undefined) { before = longer; continue; }
      code(before);
      if (next === LONGEST) {
        code(clear);
        [width, next, known] = [9, end + 1, new Map()];
      } else {
        if (next >= 1 << width) width++;
        known.set(pair, next++);
      }
      before = pixels[i];
    }
    code(before);
    if (next >= 1 << width && next < LONGEST) width++;
    code(end);
    if (bits > 0) { block.push(kept & 255); if (block.length === 255) flush(); }
    flush();
    out.add(0);
  }

  /** A film that begins with what its palette is made of: add pictures {data, width, height}, then take the bytes. */
  class Film {
    constructor(width, height, samples, hundredths) {
      Object.assign(this, { width, height, hundredths, palette: palette(samples), out: new Bytes() });
      const { out, palette: { colours } } = this;
      out.text("GIF89a");
      out.short(width);
      out.short(height);
      out.add(0xf7, 0, 0);
      for (let k = 0; k < COLOURS; k++) out.add(...(colours[k] ?? [0, 0, 0]));
      out.add(0x21, 0xff, 11);
      out.text("NETSCAPE2.0"); // again and again
      out.add(3, 1, 0, 0, 0);
    }

    add({ data }) {
      const { out, width, height } = this, pixels = new Uint8Array(width * height);
      for (let i = 0; i < pixels.length; i++) pixels[i] = place(this.palette, key(data, 4 * i));
      out.add(0x21, 0xf9, 4, 0);
      out.short(this.hundredths);
      out.add(0, 0, 0x2c);
      for (const each of [0, 0, width, height]) out.short(each);
      out.add(0);
      encode(out, pixels);
    }

    bytes() {
      this.out.add(0x3b);
      return this.out.list.slice(0, this.out.size);
    }
  }

  return { Film };
})();

if (typeof module !== "undefined") module.exports = { Gif };
