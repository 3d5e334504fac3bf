"use strict";
/* The file that is drawn: typed as a text, saved by the server, copied as a link. */

class Filing {
  constructor(editing) { this.editing = editing; }

  take(text) {
    const { editing } = this;
    let file;
    try { file = JSON.parse(text); } catch (problem) { editing.say(`This is no JSON: ${problem.message}`); return; }
    if (typeof file !== "object" || file === null || typeof file.links !== "object" || file.links === null || !(file.frame in file.links)) {
      editing.say("A mechanism has links, one of which is the frame.");
      return;
    }
    editing.replace(file);
  }

  async save(name, replaces = false) {
    const { editing } = this, { file } = editing.draft(), answer = await EditServer.post("save", { document: file, name, replaces, mark: editing.mark });
    if (answer.taken) {
      const why = answer.own ? `${answer.taken} was written by another window or program meanwhile` : `There is a ${answer.taken} already`;
      if (confirm(`${why}. Replace it?`)) await this.save(name, true);
      else editing.say(`${why}: nothing is saved. Save as another file keeps both.`);
      return;
    }
    if (answer.problem) { editing.say(answer.problem); return; }
    Object.assign(editing, { fileName: answer.file, changed: false, file, mark: answer.mark });
    if (editing.wish) editing.keep(); else Editing.forget(); // the file has no place for a wanted path
    editing.panel.show();
    editing.say(`Saved to ${answer.file}.`);
  }

  async copyLink() {
    const { editing } = this, { link } = editing.panel;
    link.value = await MechanismLink.write(editing.draft().file);
    link.hidden = false;
    try {
      await navigator.clipboard.writeText(link.value);
      editing.say("The link is copied: `planar view LINK` and `planar edit LINK` open it.");
    } catch {
      link.select();
      editing.say("The link is selected: copy it with the keyboard.");
    }
  }
}
