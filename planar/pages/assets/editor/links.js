"use strict";
/* A whole mechanism in one word, as planar.document.texts.mechanism_link has it: `planar:` and the file, deflated, in base64url. */

const MechanismLink = {
  async write(file) {
    const packed = new Blob([JSON.stringify(file)]).stream().pipeThrough(new CompressionStream("deflate-raw"));
    const bytes = new Uint8Array(await new Response(packed).arrayBuffer());
    let text = "";
    for (const each of bytes) text += String.fromCharCode(each);
    return `planar:${btoa(text).replaceAll("+", "-").replaceAll("/", "_").replace(/=+$/, "")}`;
  },
};
