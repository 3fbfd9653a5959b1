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

/** Sentences and tables of one frame. */
export function showSummary(frame, line) {
  const { motion } = frame;
  const place = placeOf(motion, line);
  setText(byId("story-cnc"), cncSentence(motion, place));
  setText(byId("story-sees"), seesSentence(motion, frame.contour));
  setText(byId("story-did"), didSentence(motion, motion.units));
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
    ["waits for", `=${motion.stops.join(", ") || "nothing"}`],
  ]);
  fillRows(byId("axis-rows"), frame.axes.map((axis) => [
    axis.name, `=${fixed(axis.position, 4)} ${axis.unit}`, `=${fixed(axis.target, 4)} ${axis.unit}`,
  ]));
}
