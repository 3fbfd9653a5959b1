// The HLI as a tree: every member with type, unit, description and live value.

import { byId, element, setText, shown } from "./format.js";

const LEAVES = 300; // whose values are asked for; the server says which it does not read
const FOUND = 60; // results of a search
const OF_A_CHANNEL = /^gp(VE)?Ch\[/; // one area a channel

/** Resolves symbol paths in the layout of the HLI. */
export class Layout {
  constructor(told, channels, axes) {
    this.channel = 0; // whose areas are searched
    this.structures = told.structures;
    this.roots = [];
    for (const [name, structure] of Object.entries(told.roots)) {
      const count = OF_A_CHANNEL.test(name) ? channels : 1;
      for (let i = 0; i < count; i++) this.roots.push([name.replace("[0]", `[${i}]`), structure]);
    }
    for (let i = 0; i < axes; i++) this.roots.push([`gpAx[${i}]`, told.axis]);
  }

  members(structure) {
    return (this.structures[structure] || []).map(([name, type, dims, unit, writer, meaning]) => (
      { name, type, dims, unit, writer, meaning, inner: this.structures[type] ? type : "" }));
  }

  /** The unit of a path; a control unit's members carry its unit. */
  unitOf(path) {
    const names = path.replaceAll("^", "").replace(/^(HLI_Global_Variables|hli)\./i, "").split(".");
    const begin = names[0].replace(/\[\d+\]/, "").toLowerCase();
    const root = this.roots.find(([name]) => name.replace(/\[\d+\]/, "").toLowerCase() === begin);
    let structure = root ? root[1] : "";
    let unit = "";
    for (const name of names.slice(1)) {
      const bare = name.replace(/\[.*/, "").toLowerCase();
      const member = this.members(structure).find((one) => one.name.toLowerCase() === bare);
      if (!member) return "";
      unit = member.unit || unit;
      structure = member.inner;
    }
    return unit;
  }

  /** Paths of all single values whose name or meaning holds a text. */
  search(text, most) {
    const words = text.toLowerCase().split(/\s+/).filter(Boolean);
    const found = [];
    const walk = (path, structure) => {
      for (const member of this.members(structure)) {
        if (found.length >= most) return;
        const here = `${path}.${member.name}${member.dims.map(() => "[0]").join("")}`;
        const text_ = `${here} ${member.meaning}`.toLowerCase();
        if (member.inner) walk(here, member.inner);
        else if (words.every((word) => text_.includes(word))) found.push([here, member]);
      }
    };
    const here = (name) => !OF_A_CHANNEL.test(name) || name.endsWith(`[${this.channel}]`);
    for (const [name, structure] of this.roots) if (here(name)) walk(name, structure);
    return found;
  }
}

export class Tree {
  /** `pick`: called with a path that shall be watched. */
  constructor(pick, changed) {
    this.pick = pick;
    this.changed = changed;
    this.leaves = new Map();
    byId("tree-search").addEventListener("input", () => this.build());
  }

  set(layout) {
    this.layout = layout;
    this.build();
  }

  /** The channel whose members a search finds. */
  follow(channel) {
    if (!this.layout || this.layout.channel === channel) return;
    this.layout.channel = channel;
    if (byId("tree-search").value.trim()) this.build();
  }

  build() {
    if (!this.layout) return;
    const root = byId("tree-root");
    this.leaves.clear();
    const text = byId("tree-search").value.trim();
    if (text) {
      const found = this.layout.search(text, FOUND);
      root.replaceChildren(...found.map(([path, member]) => this.leaf(path, path, member)));
      if (!found.length) root.append(element("p", "nothing is called so"));
    } else {
      root.replaceChildren(...this.layout.roots.map(([name, structure]) => this.branch(name, name, structure, "")));
    }
    this.changed();
  }

  branch(path, name, structure, meaning) {
    const node = element("details");
    const head = element("summary", name);
    head.append(" ", element("span", plain(meaning) || structure, { class: "told" }));
    node.append(head);
    node.addEventListener("toggle", () => {
      if (node.open) node.append(...this.inside(path, structure));
      else {
        while (node.childNodes.length > 1) node.lastChild.remove();
        for (const [one, leaf] of this.leaves) if (!leaf.isConnected) this.leaves.delete(one);
      }
      this.changed();
    });
    return node;
  }

  inside(path, structure) {
    const found = [];
    for (const member of this.layout.members(structure)) {
      const here = `${path}.${member.name}`;
      const size = member.dims.reduce((a, b) => a * b, 1);
      const places = member.dims.length ? Math.min(size, 128) : 1;
      for (let i = 0; i < places; i++) {
        const index = member.dims.length === 1 ? `[${i}]` : member.dims.map(() => "[0]").join("");
        const name = member.name + (member.dims.length ? index : "");
        const at = here + (member.dims.length ? index : "");
        found.push(member.inner ? this.branch(at, name, member.inner, member.meaning) : this.leaf(at, name, member));
        if (member.dims.length > 1) break;
      }
    }
    return found;
  }

  leaf(path, name, member) {
    const row = element("div", "", { class: "leaf" });
    const button = element("button", name, { "aria-label": `watch ${path}` });
    button.addEventListener("click", () => this.pick(path));
    const value = element("span", "-", { class: "number" });
    const unit = member.unit ? `, ${member.unit}` : "";
    const told = `${member.type}${unit}, by ${member.writer || writer(member.name)}: ${plain(member.meaning)}`;
    row.append(button, value, element("span", told, { class: "told" }));
    this.leaves.set(path, value);
    return row;
  }

  /** The paths whose values are shown now. */
  paths() { return [...this.leaves.keys()].slice(0, LEAVES); }

  take(frame) {
    for (const [path, node] of this.leaves) {
      if (path in frame.values) setText(node, shown(frame.values[path]));
      else if (path in frame.problems) setText(node, "not read");
      node.title = frame.problems[path] || "";
    }
  }
}

function writer(name) {
  if (name.endsWith("_rw")) return "both";
  if (name.endsWith("_r")) return "CNC";
  return name.endsWith("_w") ? "PLC" : "its holder";
}

/** A description without the marks of its source. */
const plain = (text) => text.replace(/\[([^\]]*)\]\([^)]*\)/g, "$1").replaceAll("`", "");
