"use strict";
/* The page's own server, which alone it asks; where that is gone its answers are a sentence. */

const ALIVE_PAUSE = 45000; // ms between two signs to the server that the page is open

const EditServer = {
  page: crypto.randomUUID(), // a newer drawing of a page takes the place of its older ones

  /** Ask: the answer, or {problem} in place of one; {gone} where nobody answers. */
  async post(what, asked) {
    try {
      const response = await fetch(what, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify({ page: EditServer.page, ...asked }) });
      const isJson = response.headers.get("Content-Type") === "application/json";
      return isJson ? await response.json() : { problem: await response.text() };
    } catch {
      return { gone: true, problem: "The server of this page does not answer: start `planar edit` again with the link that “Copy link” gives. What is drawn stays here." };
    }
  },

  /** It hears that the page is open, and when it goes. */
  present() {
    const { page } = EditServer, open = () => { EditServer.post("open", {}); };
    open();
    setInterval(open, ALIVE_PAUSE);
    addEventListener("pagehide", () => navigator.sendBeacon("gone", JSON.stringify({ page })));
    addEventListener("pageshow", ({ persisted }) => { if (persisted) open(); });
  },
};
