// A recording in the same views: a slider stands for the time.

import { byId, fillRows, fixed, setText } from "./format.js";
import { showContour } from "./tables.js";

const SLICE = 4000; // samples of the trail

/** Index of the last row at or ahead of a time. */
function rowAt(t, time) {
  let [low, high] = [0, t.length - 1];
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (t[middle] <= time) low = middle; else high = middle - 1;
  }
  return low;
}

export class Player {
  /** `ask`: gives the last request of the look-ahead at a time, s. */
  constructor(found, views, ask) {
    this.views = views;
    this.ask = ask;
    views.path.looked = Infinity; // its samples are as far apart as they are
    this.playing = null;
    byId("player").hidden = false;
    const slider = byId("moment");
    slider.addEventListener("input", () => this.show(Number(slider.value)));
    byId("play").addEventListener("click", () => this.play(!this.playing));
    this.load(found, found.columns.t[0] || 0);
  }

  /** A recording, or another channel of it, at a time, s. */
  load(found, time) {
    const { views } = this;
    this.found = found;
    this.columns = found.columns;
    this.contour = null;
    setText(byId("recording-name"), `${found.name}${found.complete ? "" : ", not complete"}`);
    const { t } = this.columns;
    byId("moment").min = t[0] || 0;
    byId("moment").max = t[t.length - 1] || 0;
    const places = ["X", "Y", "Z"].map((name) => (found.axes.includes(name) ? name : ""));
    const known = places.some(Boolean) ? places : [0, 1, 2].map((i) => found.axes[i] || "");
    this.places = known.map((name) => this.columns[name] || null);
    this.way = this.columns.dist_prog_start || this.columns.s || t;
    views.path.setRoute(t.map((_, i) => [...this.place(i), this.way[i], this.column("line", i), this.column("count", i), 0]));
    views.program.set(found.program, found.lines, [], [], "");
    this.functions();
    this.events();
    views.scope.paths = ["v", "override", ...Object.keys(found.symbols)].slice(0, 6);
    this.fillScope();
    this.show(time);
  }

  /** The contour of the moment; one question at a time, the last one counts. */
  async askContour(time) {
    this.wanted = time;
    if (this.asking) return;
    this.asking = true;
    while (this.wanted !== null) {
      const [at, { found }] = [this.wanted, this];
      this.wanted = null;
      const contour = await this.ask(at).catch((error) => ({ elements: [], problem: error.message }));
      if (found !== this.found) continue; // another channel is shown by now
      this.contour = contour;
      showContour(contour);
      this.views.path.mark(contour);
    }
    this.asking = false;
  }

  column(name, i) { return (this.columns[name] || [])[i] || 0; }

  place(i) { return this.places.map((list) => (list ? list[i] : 0)); }

  sample(i) { return [this.columns.t[i], ...this.place(i), this.column("v", i), this.way[i]]; }

  fillScope() {
    const { scope } = this.views;
    scope.clear();
    scope.width = 0;
    scope.build();
    scope.t = this.columns.t;
    scope.values = scope.paths.map((path) => this.columns[path] || this.found.symbols[path] || []);
    scope.paused = true;
    scope.dirty = true;
  }

  play(on) {
    byId("play").setAttribute("aria-pressed", on);
    setText(byId("play"), on ? "pause" : "play");
    clearInterval(this.playing);
    this.playing = null;
    if (!on) return;
    const { t } = this.columns;
    let before = performance.now();
    if (this.at >= t[t.length - 1]) this.at = t[0];
    this.playing = setInterval(() => {
      const now = performance.now();
      const next = this.at + (now - before) / 1000;
      before = now;
      this.show(Math.min(next, t[t.length - 1]));
      if (next >= t[t.length - 1]) this.play(false);
    }, 40);
  }

  /** The moment, s. */
  show(time) {
    const { t } = this.columns;
    if (!t.length) { setText(byId("story-cnc"), "the recording holds no cycle"); return; }
    this.at = time;
    const i = rowAt(t, time);
    byId("moment").value = time;
    byId("moment").setAttribute("aria-valuetext", `${fixed(t[i], 3)} s`);
    setText(byId("moment-shown"), `${fixed(t[i], 3)} s`);
    this.story(i);
    const { path, program, scope } = this.views;
    const step = Math.max(1, Math.ceil(i / SLICE));
    const trail = [];
    for (let k = 0; k <= i; k += step) trail.push(this.sample(k));
    trail.push(this.sample(i));
    const known = this.column("max_dist_prog_start", i);
    path.take({ trail, trail_new: true, motion: { distance: this.way[i], known, epoch: 0 }, contour: this.contour });
    this.askContour(t[i]);
    program.mark(this.column("line", i), this.column("line", i));
    scope.moment(t[i]);
  }

  story(i) {
    const value = (name, places) => fixed(this.column(name, i), places);
    const [n, line] = [this.column("n", i), this.column("line", i)];
    const moves = Math.abs(this.column("v", i)) > 0.001;
    const place = `${moves ? "drives" : "stands at"} ${n ? `N${n}` : `line ${line}`}`;
    const known = Math.max(0, this.column("max_dist_prog_start", i) - this.column("dist_prog_start", i));
    setText(byId("story-cnc"), `${place} with ${value("v", 1)} mm/s`);
    setText(byId("story-sees"), `${fixed(known, 2)} mm of contour ahead of the tool`);
    setText(byId("story-did"), `override ${value("override", 1)} %`);
    const rows = Object.keys(this.columns).map((name) => [
      name, `=${value(name, 3)} ${name.endsWith("prog_start") ? "mm" : this.found.units[name] || ""}`]);
    fillRows(byId("number-rows"), rows);
    const { axes, units } = this.found;
    fillRows(byId("axis-rows"), axes.map((name) => [name, `=${fixed(this.columns[name][i], 4)} ${units[name]}`, "=-"]));
  }

  functions() {
    fillRows(byId("function-rows"), this.found.functions.map((one) => [
      `${one.kind}${one.code}`, `t ${fixed(one.t, 3)} s`, `=${one.line || "-"}`,
      one.acknowledged ? "acknowledged" : "not acknowledged"]));
  }

  events() {
    fillRows(byId("event-rows"), this.found.events.map((one) => [
      "", `=${fixed(one.t, 3)}`, one.kind, "", one.text || (one.code ? `error ${one.code}` : "")]));
  }
}
