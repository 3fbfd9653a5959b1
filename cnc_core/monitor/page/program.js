// The NC program: the line that is driven, how far the PLC sees, marked lines.

import { byId, element, setText } from "./format.js";

const [S, LINE, COUNT, EPOCH] = [3, 4, 5, 6];

export class ProgramView {
  constructor() {
    this.list = byId("program-lines");
    this.points = [];
    this.shown = { now: 0, seen: 0 };
  }

  /** The program as it was read. */
  set(name, lines, marked, points, problem) {
    setText(byId("program-name"), name);
    setText(byId("program-problem"), problem);
    this.points = points;
    this.shown = { now: 0, seen: 0 };
    this.reached = 0;
    this.key = "";
    const isMarked = new Set(marked);
    const rows = lines.map((text, i) => {
      const row = element("li");
      row.append(element("span", String(i + 1), { class: "number" }), text);
      if (isMarked.has(i + 1)) row.classList.add("marked");
      return row;
    });
    this.list.replaceChildren(...rows);
  }

  /** The line of a counted block; 0 where it is not known. */
  lineOf(motion) {
    const found = this.points.find((p) => p[COUNT] === motion.count);
    return found ? found[LINE] : 0;
  }

  /** How many distance resets lie ahead of the block that is driven. */
  epochOf(motion) {
    const found = this.points.find((p) => p[COUNT] >= motion.count);
    return found ? found[EPOCH] : 0;
  }

  /** The line of a path distance, mm. */
  lineAt(distance, epoch) {
    let last = 0;
    for (const point of this.points) {
      if (point[EPOCH] !== epoch) continue;
      last = point[LINE];
      if (point[S] >= distance - 1e-6) break;
    }
    return last;
  }

  take(motion, prepared) {
    if (!motion || !this.points.length) return;
    this.reach(prepared && prepared.line ? prepared.line : 0);
    const key = `${motion.count} ${motion.known}`;
    if (key === this.key) return;
    this.key = key;
    this.mark(this.lineOf(motion), this.lineAt(motion.known, motion.epoch));
  }

  /** The line that the preparation has read last. */
  reach(line) {
    if (line === this.reached) return;
    const rows = this.list.children;
    rows[(this.reached || 0) - 1]?.classList.remove("reached");
    rows[line - 1]?.classList.add("reached");
    this.reached = line;
  }

  /** Mark the line that is driven and the last one that the PLC sees. */
  mark(now, seen) {
    const { list, shown } = this;
    const isSeen = (line, range) => Boolean(range.now) && line >= range.now && line <= range.seen;
    const wanted = { now, seen };
    // only the lines that change: a program may be long
    const from = Math.min(now || Infinity, shown.now || Infinity);
    for (let line = from; line <= Math.max(seen, shown.seen); line++) {
      if (isSeen(line, wanted) !== isSeen(line, shown)) list.children[line - 1]?.classList.toggle("seen");
    }
    if (now !== shown.now) {
      const old = list.children[shown.now - 1];
      if (old) { old.classList.remove("now"); old.removeAttribute("aria-current"); }
      const row = list.children[now - 1];
      if (row) {
        row.classList.add("now");
        row.setAttribute("aria-current", "step");
        list.scrollTop = row.offsetTop - list.offsetTop - list.clientHeight / 3;
      }
    }
    this.shown = wanted;
  }
}
