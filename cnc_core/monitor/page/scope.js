// The scope: symbols over the cell's time, with pause, cursor, trigger and CSV.

import { COLORS, byId, element, fixed, setText, shown, styleColor } from "./format.js";

const KEPT = 24000; // samples of a symbol
const PLOTS = 8;
const FIRST = (channel) => ["active_feed_r", "override_r"].map((name) => `gpCh[${channel}].bahn_state.${name}`);

export class Scope {
  /** `unitOf`: unit of a symbol; `changed`: called when symbols come or go. */
  constructor(unitOf, changed) {
    this.unitOf = unitOf;
    this.changed = changed;
    this.channel = 0;
    this.paths = FIRST(0);
    this.clear();
    this.plots = [];
    this.paused = false;
    this.armed = null;
    this.cursor = null;
    this.dirty = true;
    this.range = [0, 1];
    this.listen();
    setInterval(() => this.draw(), 100);
  }

  clear() {
    this.t = [];
    this.values = this.paths.map(() => []);
    this.before = null;
    this.dirty = true;
  }

  listen() {
    byId("scope-plus").addEventListener("click", () => this.add(byId("scope-add").value.trim()));
    byId("scope-add").addEventListener("keydown", (event) => {
      if (event.key === "Enter") this.add(event.target.value.trim());
    });
    byId("scope-pause").addEventListener("click", () => this.pause(!this.paused));
    byId("scope-span").addEventListener("change", () => { this.dirty = true; });
    byId("scope-csv").addEventListener("click", () => this.save());
    byId("trigger-arm").addEventListener("click", () => this.arm(!this.armed));
    new ResizeObserver(() => { this.build(); }).observe(byId("scope-plots"));
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { this.width = 0; this.build(); });
  }

  add(path) {
    if (!path || this.paths.includes(path)) return;
    if (this.paths.length >= PLOTS) {
      setText(byId("scope-readout"), `the scope has ${PLOTS} symbols: remove one first`);
      return;
    }
    this.paths.push(path);
    this.clear();
    this.width = 0;
    this.build();
    this.changed();
  }

  /** The symbols that are there at first are those of this channel from now on. */
  follow(channel) {
    const [before, now] = [FIRST(this.channel), FIRST(channel)];
    this.channel = channel;
    const paths = this.paths.map((path) => (before.includes(path) ? now[before.indexOf(path)] : path));
    if (paths.join() === this.paths.join()) return;
    this.paths = [...new Set(paths)];
    this.clear();
    this.width = 0;
    this.build();
  }

  remove(path) {
    this.paths = this.paths.filter((one) => one !== path);
    this.clear();
    this.width = 0;
    this.build();
    this.changed();
  }

  pause(on) {
    this.paused = on;
    const button = byId("scope-pause");
    button.setAttribute("aria-pressed", on);
    setText(button, on ? "go on" : "pause");
  }

  arm(on) {
    const path = byId("trigger-symbol").value;
    this.armed = on && path ? { path, edge: byId("trigger-edge").value, level: Number(byId("trigger-level").value) } : null;
    this.fired = null;
    const list = this.values[this.paths.indexOf(path)] || [];
    this.before = list.length ? Number(list[list.length - 1]) : null;
    if (this.armed) this.pause(false);
    byId("trigger-arm").setAttribute("aria-pressed", Boolean(this.armed));
    setText(byId("trigger-arm"), this.armed ? "armed" : "arm");
  }

  /** Samples [t, value, ...] of the symbols `paths`. */
  take(paths, samples) {
    if (this.paused || paths.join() !== this.paths.join()) return;
    for (const [t, ...values] of samples) {
      if (this.t.length && t < this.t[this.t.length - 1]) this.clear(); // another CNC
      if (t === this.t[this.t.length - 1]) continue;
      this.t.push(t);
      values.forEach((value, i) => this.values[i].push(typeof value === "boolean" ? Number(value) : value));
      this.look(t, values);
    }
    if (this.t.length > 1.2 * KEPT) {
      this.t = this.t.slice(-KEPT);
      this.values = this.values.map((list) => list.slice(-KEPT));
    }
    this.dirty = true;
  }

  /** The trigger: half the span behind its edge the scope stops. */
  look(t, values) {
    const { armed } = this;
    if (this.fired !== null && this.fired !== undefined && t >= this.fired + this.span() / 2) {
      this.arm(false);
      this.pause(true);
      return;
    }
    if (!armed || this.fired) return;
    const now = Number(values[this.paths.indexOf(armed.path)]);
    const { before } = this;
    this.before = now;
    if (before === null || before === undefined) return;
    const up = before <= armed.level && now > armed.level;
    const down = before >= armed.level && now < armed.level;
    if (armed.edge === "up" ? up : down) {
      this.fired = t;
      this.edgeAt = t;
    }
  }

  span() { return Number(byId("scope-span").value); }

  // -- drawing
  build() {
    const holder = byId("scope-plots");
    if (holder.clientWidth === this.width || !window.uPlot) return;
    this.width = holder.clientWidth;
    for (const plot of this.plots) plot.destroy();
    holder.replaceChildren();
    this.plots = this.paths.map((path, i) => this.plot(holder, path, i));
    const choice = byId("trigger-symbol");
    const chosen = choice.value;
    choice.replaceChildren(element("option", "none", { value: "" }),
      ...this.paths.map((path) => element("option", path, { value: path })));
    choice.value = this.paths.includes(chosen) ? chosen : "";
    this.dirty = true;
  }

  plot(holder, path, i) {
    const unit = this.unitOf(path);
    const head = element("div", "", { class: "row" });
    const remove = element("button", "remove", { "aria-label": `remove ${path} from the scope` });
    remove.addEventListener("click", () => this.remove(path));
    head.append(element("span", unit ? `${path}, ${unit}` : path, { class: "scope-name" }), remove);
    holder.append(head);
    const color = styleColor("--soft");
    const grid = { stroke: styleColor("--line"), width: 1 };
    const axis = { stroke: color, grid, ticks: grid };
    return new window.uPlot({
      width: Math.max(200, this.width - 4),
      height: 120,
      legend: { show: false },
      cursor: { sync: { key: "scope" }, drag: { x: true, y: false } },
      scales: { x: { time: false, range: () => this.range } },
      axes: [{ ...axis, size: 28 }, { ...axis, size: 62 }],
      series: [{}, { stroke: COLORS[i % COLORS.length], width: 1.5, spanGaps: false }],
      hooks: { setCursor: [(plot) => this.read(plot)] },
    }, [[], []], holder);
  }

  /** Of a recording: the values up to this time, s. */
  moment(time) {
    this.end = time;
    this.dirty = true;
  }

  draw() {
    if (!this.dirty || !this.plots.length) return;
    this.dirty = false;
    const newest = this.t.length ? this.t[this.t.length - 1] : 0;
    const end = this.end === undefined ? newest : Math.max(this.end, this.t[0] + this.span());
    const begin = Math.max(0, end - this.span());
    let first = this.t.length;
    while (first > 0 && this.t[first - 1] >= begin) first -= 1;
    const t = this.t.slice(first);
    this.range = [begin, Math.max(end, begin + this.span())];
    this.plots.forEach((plot, i) => plot.setData([t, this.values[i].slice(first)]));
    if (!this.t.length) setText(byId("scope-readout"), "no values yet");
    else if (this.cursor === null) this.tell(this.newest());
  }

  /** The row that is shown without a cursor. */
  newest() {
    if (this.end === undefined) return this.t.length - 1;
    const found = this.t.findIndex((t) => t > this.end);
    return found < 0 ? this.t.length - 1 : Math.max(0, found - 1);
  }

  read(plot) {
    const index = plot.cursor.idx;
    this.cursor = index === null || index === undefined ? null : index;
    if (this.cursor === null || !plot.data[0].length) return;
    this.tell(this.t.length - plot.data[0].length + index);
  }

  tell(index) {
    const parts = this.paths.map((path, i) => {
      const unit = this.unitOf(path);
      return `${path.split(".").pop()} ${shown(this.values[i][index])}${unit ? ` [${unit}]` : ""}`;
    });
    const edge = this.edgeAt === undefined ? "" : `, ${fixed(this.t[index] - this.edgeAt, 3)} s behind the edge`;
    setText(byId("scope-readout"), `t ${fixed(this.t[index], 3)} s${edge}: ${parts.join(", ")}`);
  }

  save() {
    const rows = [["t", ...this.paths].join(",")];
    this.t.forEach((t, i) => rows.push([t, ...this.values.map((list) => list[i])].join(",")));
    const link = element("a", "", { download: "scope.csv" });
    link.href = URL.createObjectURL(new Blob([`${rows.join("\n")}\n`], { type: "text/csv" }));
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }
}
