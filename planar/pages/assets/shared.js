"use strict";
/* Scripts that several pages of one notebook share: one of them carries them, packed, and leaves them with the page
   around all of them; the others take them there, or wait until they come. */

const SHELF = "planarPages";  // where in the page around
const PATIENCE = 3000;        // ms, after which it is said what is waited for

/** Run `start` once the scripts and styles of a version are there: `packed` here (zlib, base64), or with another page. */
function shareScripts(key, packed, start) {
  let outer = null;
  try { if (parent !== window && parent.document) outer = parent; } catch { /* another site's, or shut in */ }
  const begin = ({ styles, scripts }) => {
    const style = document.createElement("style"), script = document.createElement("script");
    [style.textContent, script.textContent] = [styles, scripts];
    document.head.append(style);
    document.body.append(script);
    start();
  };
  const unpacked = async () => {
    const bytes = Uint8Array.from(atob(packed), (each) => each.charCodeAt(0));
    const text = await new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"))).text();
    return JSON.parse(text);
  };
  const there = () => outer?.[SHELF]?.[key];
  if (there()) { begin(there()); return; }
  if (packed !== null) {
    unpacked().then((library) => {
      if (outer !== null) {
        (outer[SHELF] ??= {})[key] = library;
        outer.dispatchEvent(new Event(SHELF));
      }
      begin(library);
    });
    return;
  }
  setTimeout(() => {
    const place = document.getElementById("waiting");
    if (place) place.textContent = "A still picture: what moves it is in another output of this notebook. Run this cell again to have it here.";
  }, PATIENCE);
  if (outer === null) return;
  const hear = () => {
    if (!there()) return;
    outer.removeEventListener(SHELF, hear);
    begin(there());
  };
  outer.addEventListener(SHELF, hear);
}
