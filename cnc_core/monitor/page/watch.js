// Watch list and forces.

import { byId, element, setText, shown } from "./format.js";

const KEY = "hli-cosim-watch";
const OLD_MS = 200; // what the PLC told earlier is told to be old

export class Watch {
  constructor(unitOf, act, changed) {
    this.unitOf = unitOf;
    this.act = act;
    this.changed = changed;
    this.paths = JSON.parse(sessionStorage.getItem(KEY) || "[]");
    this.rows = new Map();
    byId("watch-form").addEventListener("submit", (event) => {
      event.preventDefault();
      this.add(byId("watch-add").value.trim());
    });
    this.build();
  }

  add(path) {
    if (!path || this.paths.includes(path)) return;
    this.paths.push(path);
    this.keep();
  }

  remove(path) {
    this.paths = this.paths.filter((one) => one !== path);
    this.keep();
  }

  keep() {
    sessionStorage.setItem(KEY, JSON.stringify(this.paths));
    this.build();
    this.changed();
  }

  build() {
    this.rows.clear();
    byId("watch-rows").replaceChildren(...this.paths.map((path) => this.row(path)));
  }

  row(path) {
    const row = element("tr");
    const value = element("td", "-", { class: "n" });
    const act = element("td");
    const wanted = element("input", "", { size: 6, "aria-label": `value to force ${path} to` });
    const force = element("button", "force", { "aria-label": `force ${path}` });
    const free = element("button", "unforce", { "aria-label": `unforce ${path}` });
    const remove = element("button", "remove", { "aria-label": `watch ${path} no more` });
    const send = () => this.order({ do: "force", symbols: [`${path}=${wanted.value}`] });
    force.addEventListener("click", send);
    wanted.addEventListener("keydown", (event) => { if (event.key === "Enter") send(); });
    free.addEventListener("click", () => this.order({ do: "unforce", symbols: [path] }));
    remove.addEventListener("click", () => this.remove(path));
    act.append(wanted, force, free, remove);
    row.append(element("td", path), value, element("td", this.unitOf(path)), act);
    this.rows.set(path, value);
    return row;
  }

  async order(order) {
    try {
      const answer = await this.act(order);
      this.showForced(answer.forced);
      setText(byId("watch-problem"), (answer.warnings || []).join("; "));
    } catch (error) {
      setText(byId("watch-problem"), error.message);
    }
  }

  showForced(forced) {
    const lines = Object.entries(forced || {}).map(([path, value]) => `${path} = ${shown(value)}`);
    const list = byId("forced-rows");
    if (list.dataset.shown === lines.join("\n")) return;
    list.dataset.shown = lines.join("\n");
    list.replaceChildren(...(lines.length ? lines : ["nothing"]).map((text) => element("li", text)));
  }

  take(frame) {
    for (const [path, node] of this.rows) {
      const problem = frame.problems[path];
      const late = frame.asked_age_ms > OLD_MS && frame.asked.includes(path);
      const age = late ? `, ${(frame.asked_age_ms / 1000).toFixed(1)} s old` : "";
      setText(node, problem || shown(frame.values[path]) + age);
      node.classList.toggle("problem", Boolean(problem));
    }
    this.showForced(frame.plc && frame.plc.forced);
  }
}
