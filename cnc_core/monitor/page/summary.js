// What happens, in sentences and numbers.

import { byId, fillRows, fixed, setText } from "./format.js";

/** N of the block, or its line where the program has no numbers. */
function placeOf(motion, line) {
  if (motion.n) return `N${motion.n}`;
  return line ? `line ${line}` : `block ${motion.count}`;
}

function cncSentence(motion, place) {
  if (motion.stops.length) return `stands at ${place}: ${motion.stops.join(", ")}`;
  if (motion.flags.includes("program_end")) return "has ended its program";
  if (Math.abs(motion.v) < 0.001) return `stands at ${place}, ${motion.mode} ${motion.state}`;
  const how = motion.flags.includes("rapid_active") ? "in rapid" : `of ${fixed(motion.feed, 1)} mm/s programmed`;
  const back = motion.v < 0 ? "backward " : "";
  return `drives ${back}${place} with ${fixed(Math.abs(motion.v), 1)} mm/s ${how}`;
}

function seesSentence(motion, contour) {
  const window = `${fixed(motion.window, 2)} mm of contour ahead of the tool`;
  if (!contour || !contour.mode) return `${window}; it has asked for nothing yet`;
  const count = contour.elements.length;
  const asked = contour.mode === 1
    ? `the marked log from entry ${fixed(contour.start, 0)}`
    : `${fixed(contour.length, 2)} mm from ${fixed(contour.start, 2)} mm`;
  return `${window}; its last request, ${asked}, gave ${count} element${count === 1 ? "" : "s"}`;
}

function didSentence(motion, units) {
  const found = [`override ${fixed(motion.override, 1)} %`];
  if (motion.override < 99.95 && motion.feed > 0) {
    found.push(`so the path drives at most ${fixed((motion.feed * motion.override) / 100, 1)} mm/s`);
  }
  if (units.feedhold) found.push("feed hold");
  if (units.single_block) found.push("single block");
  return found.join(", ");
}

/** Line or N that the preparation has reached. */
function reached(prepared) {
  if (!prepared || !prepared.line) return "-";
  const place = prepared.n ? `N${prepared.n}` : `line ${prepared.line}`;
  return prepared.read ? "the end" : place;
}

const most = { window: 1, motion: 1 };

function fill(name, value, high, text) {
  const meter = byId(`fill-${name}`);
  meter.max = high;
  meter.value = value;
  setText(byId(`fill-${name}-text`), text);
}

/** How full the buffers are; what has no bound is shown beside its most. */
function showBuffers({ motion, prepared }) {
  most.window = Math.max(most.window, motion.window);
  fill("window", motion.window, most.window, `${fixed(motion.window, 1)} mm`);
  if (!prepared || prepared.window === undefined) {
    fill("elements", 0, 1, "-");
    fill("motion", 0, 1, "-");
    return;
  }
  const inside = Math.min(prepared.elements, prepared.window);
  fill("elements", inside, prepared.window, `${inside} of ${prepared.window}`);
  // what an abort has left out was planned, too
  const stands = prepared.elements <= 1 && Math.abs(motion.v) < 0.001;
  const planned = stands ? 0 : Math.max(0, prepared.planned_s);
  most.motion = Math.max(most.motion, planned);
  fill("motion", planned, most.motion, `${fixed(planned, 2)} s`);
}

/** Sentences and tables of one frame. */
export function showSummary(frame, line) {
  const { motion } = frame;
  const place = placeOf(motion, line);
  setText(byId("story-cnc"), cncSentence(motion, place));
  setText(byId("story-sees"), seesSentence(motion, frame.contour));
  setText(byId("story-did"), didSentence(motion, motion.units));
  showBuffers(frame);
  fillRows(byId("number-rows"), [
    ["speed", `=${fixed(motion.v, 2)} mm/s`],
    ["programmed feed", `=${fixed(motion.feed, 2)} mm/s`],
    ["override", `=${fixed(motion.override, 1)} %`],
    ["driven", `=${fixed(motion.distance, 3)} mm`],
    ["the PLC sees up to", `=${fixed(motion.known, 3)} mm`],
    ["look-ahead window", `=${fixed(motion.window, 3)} mm`],
    ["to the end of the block", `=${fixed(motion.to_go, 3)} mm`],
    ["block", `=${place}`],
    ["tool", `=${motion.tool}`],
    ["mode", `=${motion.mode}, ${motion.state}`],
    ["read up to", `=${reached(frame.prepared)}`],
    ["prepared blocks", `=${(frame.prepared || {}).elements ?? "-"}`],
    ["waits for", `=${motion.stops.join(", ") || "nothing"}`],
  ]);
  fillRows(byId("axis-rows"), frame.axes.map((axis) => [
    axis.name, `=${fixed(axis.position, 4)} ${axis.unit}`, `=${fixed(axis.target, 4)} ${axis.unit}`,
  ]));
}
