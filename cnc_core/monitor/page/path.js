// The path in space on a canvas: program, trail by speed, look-ahead, tool.

import { byId, fixed, setText, styleColor } from "./format.js";

const TRAIL = 20000;
const BINS = 12;
const FILLED = 0.82; // of the canvas, by what fits it
const LOOKED_S = 0.3; // between two samples of a cell that runs
// dark blue to yellow, of even steps for the colour-blind (viridis)
const SCALE = ["#440154", "#482374", "#404387", "#345e8d", "#29788e", "#20908c", "#22a784", "#44be70",
  "#79d151", "#bdde26", "#e5e419", "#fde724"];
const PLANES = { xy: [0, Math.PI / 2], zx: [0, 0], yz: [Math.PI / 2, 0], space: [-0.6, 0.6] };
const [X, Y, Z, S, EPOCH] = [0, 1, 2, 3, 6];

export class PathView {
  constructor() {
    this.canvas = byId("path-canvas");
    this.context = this.canvas.getContext("2d");
    this.route = [];
    this.trail = [];
    this.motion = null;
    this.elements = [];
    this.vMax = 1;
    this.looked = LOOKED_S;
    this.center = [0, 0, 0];
    this.scale = 1;
    this.pan = [0, 0];
    this.dirty = true;
    this.fitted = false;
    // what stays as long as the view does: the program, and the trail so far
    this.layers = { route: document.createElement("canvas"), trail: document.createElement("canvas") };
    this.drawn = 0;
    this.plane("space");
    this.listen();
    const draw = () => {
      if (this.dirty && this.canvas.clientWidth) this.draw();
      requestAnimationFrame(draw);
    };
    requestAnimationFrame(draw);
  }

  /** Nothing is known yet. */
  clear() {
    this.route = [];
    this.trail = [];
    this.elements = [];
    this.motion = null;
    this.vMax = 1;
    this.fitted = false;
    this.view = "";
    this.dirty = true;
  }

  /** The points of the program. */
  setRoute(points) {
    this.route = points;
    this.view = "";
    this.fit();
  }

  /** One frame: new samples [t, x, y, z, v, s], the tool, what the PLC sees. */
  take(frame) {
    if (frame.trail_new) {
      this.trail = [];
      this.view = "";
    }
    for (const sample of frame.trail || []) this.trail.push(sample);
    if (this.trail.length > 1.2 * TRAIL) {
      this.trail = this.trail.slice(-TRAIL);
      this.view = "";
    }
    for (const sample of frame.trail || []) this.vMax = Math.max(this.vMax, Math.abs(sample[4]));
    this.motion = frame.motion || null;
    this.mark(frame.contour);
    if (!this.fitted && this.trail.length > 1) this.fit();
    this.dirty = true;
  }

  /** The elements of a request. */
  mark(contour) {
    this.elements = contour && contour.mode === 2 ? contour.elements : [];
    this.dirty = true;
  }

  // -- view
  plane(name) {
    if (name === "fit") { this.fit(); return; }
    [this.yaw, this.pitch] = PLANES[name];
    this.fit();
  }

  /** All of it inside the canvas, as it is seen now; again when the canvas gets another size. */
  fit() {
    const points = this.route.length ? this.route : this.trail.map((p) => p.slice(1));
    if (!points.length) return;
    this.center = middle(points).slice(0, 3);
    [this.origin, this.scale] = [[0, 0], 1];
    const seen = points.map((p) => this.project(p[X], p[Y], p[Z]));
    const [cx, cy, width, height] = middle(seen);
    const room = [this.canvas.clientWidth || 300, this.canvas.clientHeight || 300];
    this.scale = Math.min(FILLED * room[0] / (width || 1e-3), FILLED * room[1] / (height || 1e-3), 1e4);
    this.pan = [-cx * this.scale, -cy * this.scale];
    this.fitted = points.length > 1;
    this.fits = true;
    this.dirty = true;
  }

  zoom(factor) {
    this.fits = false;
    this.scale = Math.min(1e6, Math.max(1e-6, this.scale * factor));
    this.pan = this.pan.map((value) => value * factor);
    this.dirty = true;
  }

  turn(yaw, pitch) {
    this.fits = false;
    this.yaw += yaw;
    this.pitch = Math.min(Math.PI / 2, Math.max(-Math.PI / 2, this.pitch + pitch));
    this.dirty = true;
  }

  move(x, y) {
    this.fits = false;
    this.pan = [this.pan[0] + x, this.pan[1] + y];
    this.dirty = true;
  }

  listen() {
    const { canvas } = this;
    for (const button of document.querySelectorAll("[data-plane]")) {
      button.addEventListener("click", () => this.plane(button.dataset.plane));
    }
    byId("path-trail").addEventListener("change", () => { this.dirty = true; });
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(event.deltaY > 0 ? 0.85 : 1.18);
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => this.key(event));
    new ResizeObserver(() => {
      if (this.fits) this.fit();
      this.dirty = true;
    }).observe(canvas);
    this.listenToFingers();
  }

  listenToFingers() {
    const fingers = new Map();
    const gone = (event) => fingers.delete(event.pointerId);
    this.canvas.addEventListener("pointerdown", (event) => {
      this.canvas.setPointerCapture(event.pointerId);
      fingers.set(event.pointerId, [event.clientX, event.clientY]);
    });
    this.canvas.addEventListener("pointerup", gone);
    this.canvas.addEventListener("pointercancel", gone);
    this.canvas.addEventListener("pointermove", (event) => {
      const before = fingers.get(event.pointerId);
      if (!before) return;
      const now = [event.clientX, event.clientY];
      const [dx, dy] = [now[0] - before[0], now[1] - before[1]];
      const other = [...fingers].find(([id]) => id !== event.pointerId);
      if (other) {
        const apart = (p) => Math.hypot(p[0] - other[1][0], p[1] - other[1][1]) || 1;
        this.zoom(apart(now) / apart(before));
        this.move(dx / 2, dy / 2);
      } else if (event.shiftKey || event.buttons & 6) this.move(dx, dy);
      else this.turn(-dx * 0.008, dy * 0.008);
      fingers.set(event.pointerId, now);
    });
    this.canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  }

  key(event) {
    const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    const arrow = arrows[event.key];
    if (arrow && event.shiftKey) this.move(20 * arrow[0], 20 * arrow[1]);
    else if (arrow) this.turn(-0.1 * arrow[0], -0.1 * arrow[1]);
    else if (event.key === "+") this.zoom(1.2);
    else if (event.key === "-") this.zoom(1 / 1.2);
    else if (event.key === "f") this.fit();
    else return;
    event.preventDefault();
  }

  // -- drawing
  project(x, y, z) {
    const [dx, dy, dz] = [x - this.center[0], y - this.center[1], z - this.center[2]];
    const right = dx * Math.cos(this.yaw) + dy * Math.sin(this.yaw);
    const depth = -dx * Math.sin(this.yaw) + dy * Math.cos(this.yaw);
    const up = depth * Math.sin(this.pitch) + dz * Math.cos(this.pitch);
    return [this.origin[0] + right * this.scale, this.origin[1] - up * this.scale];
  }

  draw() {
    this.dirty = false;
    const { canvas, context } = this;
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    const size = [Math.round(width * ratio), Math.round(height * ratio)];
    if (canvas.width !== size[0] || canvas.height !== size[1]) [canvas.width, canvas.height] = size;
    this.origin = [width / 2 + this.pan[0], height / 2 + this.pan[1]];
    this.drawLayers(size, ratio);
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, ...size);
    context.drawImage(this.layers.route, 0, 0);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.drawAhead();
    context.setTransform(1, 0, 0, 1, 0, 0);
    if (byId("path-trail").checked) context.drawImage(this.layers.trail, 0, 0);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.drawElements();
    this.drawTool();
    this.drawAxes(height);
    setText(byId("path-speed"), `0 to ${fixed(this.vMax, 0)} mm/s`);
  }

  /** The layers: whole for a new view, else what the trail has got since. */
  drawLayers(size, ratio) {
    const { route, trail } = this.layers;
    const view = [...size, ...this.origin, ...this.center, this.scale, this.yaw, this.pitch, this.vMax,
      styleColor("--route")].join();
    if (view !== this.view) {
      this.view = view;
      this.drawn = 0;
      for (const layer of [route, trail]) {
        [layer.width, layer.height] = size; // empties it, too
        layer.getContext("2d").setTransform(ratio, 0, 0, ratio, 0, 0);
      }
      this.line(this.route, styleColor("--route"), 1.5, route.getContext("2d"));
    }
    if (this.drawn < this.trail.length) {
      this.drawTrail(trail.getContext("2d"), this.trail.slice(Math.max(0, this.drawn - 1)));
      this.drawn = this.trail.length;
    }
  }

  line(points, color, width, context = this.context) {
    if (points.length < 2) return;
    context.strokeStyle = color;
    context.lineWidth = width;
    context.beginPath();
    points.forEach((p, i) => context[i ? "lineTo" : "moveTo"](...this.project(p[X], p[Y], p[Z])));
    context.stroke();
  }

  drawTrail(context, samples) {
    const paths = Array.from({ length: BINS }, () => new Path2D());
    let before = null;
    let last = 0;
    for (const [t, x, y, z, v] of samples) {
      const here = this.project(x, y, z);
      // where nobody looked for long there is no trail: a line would lie
      const seen = t - last < this.looked;
      last = t;
      if (before && seen) {
        const bin = Math.min(BINS - 1, Math.floor((Math.abs(v) / this.vMax) * BINS));
        paths[bin].moveTo(...before);
        paths[bin].lineTo(...here);
      }
      before = here;
    }
    context.lineWidth = 2.5;
    paths.forEach((path, i) => {
      context.strokeStyle = SCALE[i];
      context.stroke(path);
    });
  }

  /** The part of the program between two path distances, mm. */
  between(from, to) {
    const epoch = this.motion ? this.motion.epoch : 0;
    const found = [];
    let before = null;
    for (const point of this.route) {
      if (point[EPOCH] !== epoch) continue;
      if (before && point[S] >= from && before[S] <= to) {
        if (!found.length) found.push(mixed(before, point, from));
        found.push(point[S] > to ? mixed(before, point, to) : point);
      }
      if (point[S] > to) break;
      before = point;
    }
    return found;
  }

  drawAhead() {
    const { motion, context } = this;
    if (!motion) return;
    context.globalAlpha = 0.45;
    this.line(this.between(motion.distance, motion.known), "#0072b2", 6);
    context.globalAlpha = 1;
  }

  drawElements() {
    const { motion, context } = this;
    if (!motion) return;
    const end = Math.max(motion.known, motion.distance);
    for (const one of this.elements) {
      if (one.start + one.length < motion.distance || one.start > end) continue;
      const points = this.between(Math.max(one.start, motion.distance), one.start + one.length);
      this.line(points, "#e69f00", 2);
      const first = points[0];
      if (!first) continue;
      const [x, y] = this.project(first[X], first[Y], first[Z]);
      context.fillStyle = "#d55e00";
      context.fillRect(x - 2.5, y - 2.5, 5, 5);
    }
  }

  drawTool() {
    const last = this.tool || this.trail[this.trail.length - 1];
    if (!last) return;
    const { context } = this;
    const [x, y] = this.project(last[1], last[2], last[3]);
    context.fillStyle = styleColor("--ink");
    context.strokeStyle = styleColor("--ground");
    context.lineWidth = 2;
    context.beginPath();
    context.arc(x, y, 6, 0, 2 * Math.PI);
    context.fill();
    context.stroke();
  }

  drawAxes(height) {
    const { context } = this;
    const origin = [34, height - 34];
    const [zx, zy] = this.project(...this.center);
    context.font = "12px system-ui, sans-serif";
    context.lineWidth = 1.5;
    context.strokeStyle = context.fillStyle = styleColor("--soft");
    [["X", [1, 0, 0]], ["Y", [0, 1, 0]], ["Z", [0, 0, 1]]].forEach(([name, d]) => {
      const [px, py] = this.project(...this.center.map((value, i) => value + d[i]));
      const [dx, dy] = [((px - zx) / this.scale) * 24, ((py - zy) / this.scale) * 24];
      if (Math.hypot(dx, dy) < 4) return;
      context.beginPath();
      context.moveTo(...origin);
      context.lineTo(origin[0] + dx, origin[1] + dy);
      context.stroke();
      context.fillText(name, origin[0] + 1.25 * dx - 4, origin[1] + 1.25 * dy + 4);
    });
  }
}

/** Middle and extent of points of two or three numbers: x, y, width, height; x, y, z. */
function middle(points) {
  const size = points[0].length < 3 ? 2 : 3;
  const low = Array(size).fill(Infinity);
  const high = Array(size).fill(-Infinity);
  for (const point of points) {
    for (let i = 0; i < size; i++) {
      low[i] = Math.min(low[i], point[i]);
      high[i] = Math.max(high[i], point[i]);
    }
  }
  return [...low.map((value, i) => (value + high[i]) / 2), ...low.map((value, i) => high[i] - value)];
}

function mixed(a, b, s) {
  const share = b[S] > a[S] ? Math.min(1, Math.max(0, (s - a[S]) / (b[S] - a[S]))) : 0;
  return [X, Y, Z].map((i) => a[i] + share * (b[i] - a[i]));
}
