// Which channel of a cell the page shows and acts on.

import { byId, element, setText } from "./format.js";

export class Channels {
  /** `chosen`: called with the index of the channel that somebody has chosen. */
  constructor(chosen) {
    this.names = [];
    this.index = 0;
    byId("channel").addEventListener("change", (event) => {
      this.choose(Number(event.target.value));
      chosen(this.index);
    });
  }

  /** The channels that there are; true: others than before. */
  set(names) {
    if (!names.length || names.join("\n") === this.names.join("\n")) return false;
    this.names = names;
    byId("channel").replaceChildren(...names.map((name, i) => element("option", name, { value: i })));
    this.choose(Math.min(this.index, names.length - 1));
    return true;
  }

  choose(index) {
    this.index = index;
    byId("channel-choice").hidden = !this.several;
    byId("channel").value = index;
    for (const place of document.querySelectorAll(".of-channel")) {
      setText(place, this.several ? ` (${this.names[index]})` : "");
    }
  }

  get several() { return this.names.length > 1; }

  /** What the CNC puts ahead of texts of the channel. */
  get title() { return this.several ? `channel ${this.names[this.index]}: ` : ""; }
}
