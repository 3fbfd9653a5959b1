// The start of the page: token, cell or recording, and who gets each frame.

import { byId, element, fixed, setText } from "./format.js";
import { Channels } from "./channels.js";
import { Dialog } from "./dialog.js";
import { Latency } from "./latency.js";
import { Live, Way, get, post, setToken, wantedRecording } from "./net.js";
import { Panel } from "./panel.js";
import { PathView } from "./path.js";
import { Player } from "./recording.js";
import { ProgramView } from "./program.js";
import { Scope } from "./scope.js";
import { showSummary } from "./summary.js";
import { Events, showContour, showFunctions, showTasks } from "./tables.js";
import { Layout, Tree } from "./tree.js";
import { Watch } from "./watch.js";

const OLD_MS = 200; // a number older than this is told to be old
const WORDS_MS = 100; // between two writings of words and tables
const LINKS_MS = 2000; // between two looks for recordings, while no CNC is there

function show(view) {
  document.body.dataset.view = view;
  for (const id of ["login", "cells"]) byId(id).hidden = id !== view;
  byId("machine").hidden = view !== "cell" && view !== "recording";
}

function login(problem) {
  show("login");
  setText(byId("status"), "locked");
  setText(byId("login-problem"), problem);
  byId("token").focus();
}

byId("login-form").addEventListener("submit", (event) => {
  event.preventDefault();
  setToken(byId("token").value.trim());
  start();
});

/** One cell, live. */
class Machine {
  constructor(cell) {
    this.cell = cell;
    this.layout = null;
    this.route = 0;
    this.at = 0;
    this.age = 0;
    this.way = new Way();
    this.cycleAge = 0;
    this.there = false;
    this.problems = {}; // of symbols, told when they change
    this.slow = 0;
    const unitOf = (path) => (this.layout ? this.layout.unitOf(path) : "");
    const changed = () => this.ask();
    const act = (order) => this.live.act(order, byId("who").value);
    this.channels = new Channels(() => this.changeChannel());
    const operate = (order) => act({ ...order, channel: this.channels.index });
    this.path = new PathView();
    this.program = new ProgramView();
    this.scope = new Scope(unitOf, changed);
    this.panel = new Panel(operate);
    this.dialog = new Dialog(act);
    this.watch = new Watch(unitOf, act, changed);
    this.tree = new Tree((path) => this.watch.add(path), changed);
    this.latency = new Latency((again) => post("raw", { again }));
    this.links = 0;
    this.events = new Events();
    setText(byId("title"), cell);
    document.title = `${cell} - hli-cosim`;
    show("cell");
    this.scope.build();
    this.live = new Live(cell, {
      greeted: () => { // events come again from the first on; the server may be another one
        this.events.clear();
        this.way = new Way();
      },
      frame: (frame) => this.take(frame),
      lost: () => { this.lost = true; this.tellAge(); },
      refused: (code, reason) => (code === 4401 ? login("this token is wrong") : this.refused(reason)),
    });
    setInterval(() => this.tellAge(), 100);
  }

  refused(reason) {
    document.body.classList.add("gone");
    setText(byId("status"), reason);
  }

  ask() {
    const paths = [...this.scope.paths, ...this.watch.paths, ...this.tree.paths()];
    this.live.want([...new Set(paths)], this.scope.paths, this.channels.index);
  }

  /** Views and keys are empty until the first frame of the channel. */
  changeChannel() {
    this.route = 0;
    this.slow = 0;
    this.path.clear();
    this.program.set("", [], [], [], "");
    this.panel.clear();
    this.scope.follow(this.channels.index);
    this.tree.follow(this.channels.index);
    this.know();
    this.ask();
  }

  take(frame) {
    this.at = performance.now();
    const late = this.way.late(frame.sent_ms, this.at);
    this.age = frame.cell.there ? (frame.age_ms || 0) + late : 1000 * frame.cell.gone_s;
    this.cycleAge = frame.cell.there ? (frame.cycle_age_ms || 0) + late : 0;
    this.lost = false;
    this.there = frame.cell.there;
    this.problem = frame.cell.problem || "";
    this.facts(frame.cell);
    this.events.take(frame.events);
    this.panel.hear(frame.events, this.channels.title);
    this.problems = frame.problems = frame.problems || this.problems;
    if (this.channels.set(frame.cell.channels) && this.channels.index !== frame.channel) this.changeChannel();
    if (frame.channel !== this.channels.index) return; // of the channel that was shown before
    if (frame.route && frame.route !== this.route) this.readRoute(frame.route);
    if (!frame.motion) return;
    this.readLayout(frame.cell.channels.length, frame.cell.axis_areas);
    frame.motion.epoch = this.program.epochOf(frame.motion);
    this.path.take(frame);
    this.scope.take(frame.scope, frame.samples || []);
    if (this.at - this.slow < WORDS_MS - 10) return;
    this.slow = this.at;
    this.dialog.take(frame.dialog);
    this.program.take(frame.motion, frame.prepared);
    showSummary(frame, this.program.shown.now);
    this.panel.take(frame);
    this.watch.take(frame);
    this.tree.take(frame);
    showContour(frame.contour);
    showFunctions(frame.functions);
    showTasks(frame.plc, frame.counters, frame.plc_age_ms);
    this.latency.take(frame.plc && frame.plc.handshake);
  }

  facts(cell) {
    if (!cell.there) {
      this.awaited(cell);
      return;
    }
    const plc = cell.plc ? `PLC ${cell.plc}` : "no PLC";
    setText(byId("facts"), `${cell.clock}, cycle ${fixed(cell.cycle_s * 1000, 3)} ms, ${cell.phase},`
      + ` CNC ${cell.pid}, ${plc}`);
  }

  /** No CNC is there: none yet, or no more.  A recording of it is written at its end. */
  awaited(cell) {
    this.life = cell.life;
    setText(byId("facts"), cell.life ? "" : cell.problem);
    if (!cell.life) setText(byId("story-cnc"), "is not there yet: it is just starting, or somebody has to start it");
    if (this.at - this.links < LINKS_MS) return;
    this.links = this.at;
    listRecordings();
  }

  /** How old the numbers are: told, and shown by the page's look. */
  tellAge() {
    const age = this.at ? performance.now() - this.at + this.age : Infinity;
    const gone = this.at > 0 && !this.there;
    if (gone && !this.life && !this.lost) {
      setText(byId("age"), "no values yet");
      setText(byId("status"), "waiting for the CNC");
      return;
    }
    const old = age > OLD_MS;
    document.body.classList.toggle("gone", gone || Boolean(this.lost));
    document.body.classList.toggle("stale", old);
    const seconds = Number.isFinite(age) ? `${(age / 1000).toFixed(1)} s` : "never";
    const stands = this.cycleAge > OLD_MS; // the memory is read, but nobody writes it
    const young = stands ? `no cycle of the CNC for ${(this.cycleAge / 1000).toFixed(1)} s` : "age below 0.2 s";
    setText(byId("age"), old || gone ? `values are old: ${seconds}` : young);
    if (this.lost) setText(byId("status"), "the monitor's server is gone; waiting for it");
    else if (gone) setText(byId("status"), `${this.problem}; waiting for it`);
    else setText(byId("status"), old ? "no new values" : "live");
  }

  async readRoute(number) {
    this.route = number;
    try {
      const route = await get("route", { cell: this.cell, channel: this.channels.index });
      if (this.route !== number) return; // another one is shown by now
      this.path.setRoute(route.points);
      this.program.set(route.name, route.lines, route.marked, route.points, route.problem);
    } catch (error) {
      setText(byId("program-problem"), error.message);
    }
  }

  /** The structures, once; areas as many as the cell has. */
  async readLayout(channels, axes) {
    const areas = `${channels} ${axes}`;
    if (areas === this.areas) return;
    this.areas = areas;
    const layout = new Layout(await get("layout"), channels, axes);
    if (areas !== this.areas) return;
    this.layout = layout;
    this.tree.set(this.layout);
    this.tree.follow(this.channels.index);
    this.watch.build();
    this.scope.width = 0;
    this.scope.build();
    this.know();
    this.ask();
  }

  /** Symbols that inputs propose: those of the channel that is shown. */
  know() {
    if (!this.layout) return;
    const known = this.layout.search("bahn_state", 80).concat(this.layout.search("bahn_mc_control", 80));
    byId("known-symbols").replaceChildren(...known.map(([path]) => element("option", "", { value: path })));
  }
}

async function listCells() {
  show("cells");
  setText(byId("status"), "choose a cell");
  let cells = [];
  try {
    cells = await get("cells");
  } catch (error) {
    if (error.status === 401) { login("this token is wrong"); return; }
    setText(byId("status"), error.message);
  }
  byId("cells-none").hidden = cells.length > 0;
  byId("cells-rows").replaceChildren(...cells.map((cell) => {
    const row = element("tr");
    const open = element("button", cell.name);
    open.addEventListener("click", () => { window.machine = new Machine(cell.name); });
    const first = element("td");
    first.append(open);
    const each = (name) => (cell.channels || [cell]).map((one) => one[name] || "-").join(", ");
    row.append(first, ...[each("program"), each("state"), cell.clock, cell.pid, cell.plc || "none"]
      .map((text) => element("td", String(text))));
    return row;
  }));
  setTimeout(() => { if (document.body.dataset.view === "cells") listCells(); }, 1000);
}

/** Links to the recordings that may be opened now. */
async function listRecordings() {
  const { recordings } = await get("start").catch(() => ({ recordings: [] })); // it is asked again
  if (byId("links").dataset.shown === recordings.join("\n")) return;
  byId("links").dataset.shown = recordings.join("\n");
  byId("links").replaceChildren(...recordings.map((name) => {
    const link = element("a", `recording ${name}`, { href: `#recording=${encodeURIComponent(name)}` });
    link.addEventListener("click", () => setTimeout(() => location.reload()));
    return link;
  }));
}

async function openRecording(name) {
  show("recording");
  setText(byId("title"), name);
  const found = await get("recording", { name });
  setText(byId("status"), "a recording");
  setText(byId("age"), "");
  let player;
  const unitOf = (path) => ((player ? player.found : found).units[path] || "");
  const views = { path: new PathView(), program: new ProgramView(), scope: new Scope(unitOf, () => {}) };
  const named = () => ({ name: found.name, channel: channels.names[channels.index] || "" });
  const channels = new Channels(async () => {
    const asked = named();
    const other = await get("recording", asked);
    if (asked.channel === named().channel) player.load(other, player.at);
  });
  channels.set(found.channels);
  channels.choose(Math.max(0, found.channels.indexOf(found.channel)));
  player = new Player(found, views, (time) => get("recording/contour", { ...named(), time }));
  window.player = player;
}

// the same page with a token in the address: a browser does not load it again
addEventListener("hashchange", () => { if (/[#&]token=/.test(location.hash)) location.reload(); });

async function start() {
  let begin;
  try {
    begin = await get("start");
  } catch (error) {
    login(error.status === 401 ? "a token is needed" : error.message);
    return;
  }
  const wanted = wantedRecording();
  if (wanted) await openRecording(wanted);
  else if (begin.view === "recording") await openRecording(begin.recordings[0]);
  else if (begin.cell) window.machine = new Machine(begin.cell);
  else await listCells();
}

start();
