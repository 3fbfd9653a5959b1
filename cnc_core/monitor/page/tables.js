// Contour table, functions, tasks, counters, events.

import { byId, fillRows, fixed, setText } from "./format.js";

const DEGREES = 180 / Math.PI;
const EVENTS = 300;

export function showContour(contour) {
  if (!contour) return;
  if (contour.problem && !contour.mode) {
    setText(byId("contour-asked"), contour.problem);
    fillRows(byId("contour-rows"), []);
    return;
  }
  const asked = !contour.mode ? "nothing was asked yet"
    : contour.mode === 1 ? `mode 1, the marked log from entry ${fixed(contour.start, 0)}`
      : `mode 2, ${fixed(contour.length, 3)} mm from ${fixed(contour.start, 3)} mm`;
  const log = contour.log === undefined ? "" // a recording does not tell
    : `; ${contour.log} entries in the log${contour.logging ? ", which is on" : ""}`;
  const problem = contour.problem ? `; ${contour.problem}` : "";
  setText(byId("contour-asked"), `${asked}: ${contour.elements.length} elements${log}${problem}`);
  fillRows(byId("contour-rows"), contour.elements.map((one) => [
    one.type, `=${one.n}`, `=${fixed(one.start, 3)}`, `=${fixed(one.length, 3)}`,
    `=${one.radius ? fixed(one.radius, 3) : "-"}`, `=${one.angle ? fixed(one.angle * DEGREES, 2) : "-"}`,
    `=${fixed(one.turn * DEGREES, 2)}`,
  ]));
}

const stateOf = (one) => (one.offered ? "offered to the PLC" : one.acknowledged ? "acknowledged" : "fetched");

export function showFunctions(functions) {
  if (!functions) return;
  const rows = functions.length
    ? functions.map((one) => [`${one.kind}${one.number}`, one.unit, `=${one.line || "-"}`, stateOf(one)])
    : [["none so far"]];
  fillRows(byId("function-rows"), rows);
}

export function showTasks(plc, counters, age) {
  const tasks = Object.entries((plc && plc.tasks) || {});
  fillRows(byId("task-rows"), tasks.length
    ? tasks.map(([name, one]) => [name, `=${one.scans}`, `=${fixed(one.mean_us, 1)}`, `=${fixed(one.max_us, 0)}`,
      `=${fixed(one.jitter_us, 0)}`, `=${one.overruns}`])
    : [["the PLC tells nothing"]]);
  if (!counters) return;
  fillRows(byId("counter-rows"), [
    ["overruns of the CNC", `=${counters.overruns}`],
    ["requests by index (mode 1)", `=${counters.requests_mode1}`],
    ["requests by distance (mode 2)", `=${counters.requests_mode2}`],
    ["refused requests", `=${counters.requests_bad}`],
    ["commands out of range", `=${counters.bad_commands}`],
    ["late commits of the planner", `=${counters.planner_late}`],
    ["age of the PLC's numbers", age === null || age === undefined ? "=-" : `=${(age / 1000).toFixed(1)} s`],
  ]);
}

export class Events {
  constructor() { this.clear(); }

  clear() { this.kept = []; }

  take(events) {
    if (!events || !events.length) return;
    this.kept = [...events.map((one) => [
      new Date(one.wall * 1000).toLocaleTimeString(), `=${one.cell_s === null ? "-" : fixed(one.cell_s, 3)}`,
      one.kind, one.who, one.text]).reverse(), ...this.kept].slice(0, EVENTS);
    this.show();
  }

  show() { fillRows(byId("event-rows"), this.kept, this.kept.map((row) => `event-${row[2]}`)); }
}
