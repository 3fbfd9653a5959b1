// The operator's panel: each key is an order to the PLC.

import { byId, element, fixed, setText } from "./format.js";

const LEVELS = [
  ["override", "override", "%"],
  ["rapid_override", "rapid override", "%"],
];
const SWITCHES = [["feedhold", "feed hold"], ["single_block", "single block"]];
const COMMANDS = [
  ["start", "start"], ["stop", "stop"], ["resume", "resume"], ["continue", "continue"],
  ["abort", "abort"], ["reset", "reset"],
];
const PROBLEM_MS = 4000; // how long a refusal is shown at least
const NAME = "hli-cosim-who";

export class Panel {
  /** `act`: gives an order and answers with what the PLC says. */
  constructor(act) {
    this.act = act;
    this.acted = 0;
    this.said = ""; // by the CNC, of the last command
    this.now = this.last = null;
    this.channel = {}; // another object for each that is shown
    this.levels = {};
    this.switches = {};
    byId("who").value = localStorage.getItem(NAME) || "";
    byId("who").addEventListener("change", (event) => localStorage.setItem(NAME, event.target.value));
    const holder = byId("panel-levels");
    for (const level of LEVELS) holder.append(this.level(...level));
    const row = element("div", "", { class: "switches" });
    for (const [what, text] of SWITCHES) row.append(this.switch(what, text));
    holder.append(row);
    for (const [what, text] of COMMANDS) {
      const button = element("button", text, { id: `do-${what}` });
      button.addEventListener("click", () => this.operate(what, what === "start" ? this.chosen() : null));
      byId("panel-commands").append(button);
    }
    byId("mdi-form").addEventListener("submit", (event) => {
      event.preventDefault();
      this.operate("mdi", byId("mdi").value);
    });
  }

  /** Another channel is shown: its keys act as soon as its values are there. */
  clear() {
    this.channel = {};
    this.acted = 0;
    this.said = "";
    this.now = this.last = null;
    byId("start-program").value = "";
    this.able(false);
    setText(byId("panel-state"), "");
  }

  able(on) {
    for (const button of byId("panel").querySelectorAll("button, input[type=range]")) button.disabled = !on;
  }

  /** The program to start; behind MDI none is selected, so the last one is named. */
  chosen() {
    return byId("start-program").value.trim() || (this.now === this.last ? null : this.last);
  }

  level(what, text, unit) {
    const row = element("div");
    const slider = element("input", "", { type: "range", min: 0, max: 200, step: 1, id: `set-${what}` });
    const output = element("output", `- ${unit}`, { class: "number", id: `state-${what}` });
    const release = element("button", "release", { id: `release-${what}`, "aria-label": `release ${text}` });
    slider.addEventListener("input", () => setText(output, `${slider.value} ${unit} ..`));
    slider.addEventListener("change", () => this.operate(what, Number(slider.value)));
    release.addEventListener("click", () => this.operate(what, null));
    row.append(element("label", text, { for: slider.id }), slider, output, release);
    this.levels[what] = { slider, output, release };
    return row;
  }

  switch(what, text) {
    const button = element("button", text, { "aria-pressed": "false", id: `set-${what}` });
    const release = element("button", "release", { id: `release-${what}`, "aria-label": `release ${text}` });
    button.addEventListener("click", () => this.operate(what, button.getAttribute("aria-pressed") !== "true"));
    release.addEventListener("click", () => this.operate(what, null));
    this.switches[what] = { button, release };
    const both = element("span", "", { class: "switch" });
    both.append(button, release);
    return both;
  }

  async operate(what, value) {
    this.acted = Infinity;
    this.said = "";
    setText(byId("panel-state"), `${what} ..`);
    const { channel } = this;
    try {
      const answer = await this.act({ do: "operate", what, value });
      if (channel !== this.channel) return; // another one is shown by now
      this.show(answer.panel);
      this.acted = performance.now();
    } catch (error) {
      if (channel !== this.channel) return; // it stands in the events
      setText(byId("panel-state"), error.message);
      this.acted = performance.now() + PROBLEM_MS;
    }
  }

  /** Events: what the CNC has to say against a command stands beside it. */
  hear(events, title) {
    for (const { kind, who, text } of events || []) {
      const told = who === "CNC" && (kind === "warning" || kind === "error");
      if (told && text.startsWith(title)) this.said = text.slice(title.length);
    }
  }

  show(panel) {
    if (!panel) return;
    const held = Object.entries(panel.held || {}).map(([name, value]) => `${name} ${value}`);
    const command = panel.command ? `${panel.command}: ${panel.state}` : "";
    const why = panel.error_id ? ` (error ${panel.error_id}: ${panel.error})` : "";
    const said = command && this.said ? `the CNC: ${this.said}` : "";
    setText(byId("panel-state"), [command + why, said, held.length ? `held here: ${held.join(", ")}` : ""]
      .filter(Boolean).join("; "));
  }

  /** One frame: what the CNC uses. */
  take(frame) {
    const there = Boolean(frame.cell.plc);
    this.able(there);
    if (!there) { setText(byId("panel-state"), "no PLC is there to take orders"); return; }
    const { units, mode, program } = frame.motion;
    this.now = mode === "automatic" ? program : "";
    if (this.now) this.last = this.now;
    const panel = (frame.plc.panels || [])[frame.channel];
    const held = (panel || {}).held || {};
    for (const [what, { slider, output, release }] of Object.entries(this.levels)) {
      if (document.activeElement !== slider || held[what] === undefined) slider.value = units[what];
      setText(output, `${fixed(units[what], 1)} %`);
      release.disabled = held[what] === undefined;
    }
    for (const [what, { button, release }] of Object.entries(this.switches)) {
      button.setAttribute("aria-pressed", String(units[what]));
      release.disabled = held[what] === undefined;
    }
    // what the PLC told ahead of the last order is older than its answer
    if (performance.now() - (frame.plc_age_ms || 0) <= this.acted) return;
    if (panel && (panel.command || panel.state === "idle")) this.show(panel);
  }
}
