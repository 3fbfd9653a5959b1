// The handshake's times as a histogram, beside the raw exchange of the same machine.

import { byId, fixed, setText, styleColor } from "./format.js";

export class Latency {
  /** `measure`: gives the raw exchange of this machine, us; true: measured again. */
  constructor(measure) {
    this.raw = null;
    this.found = null;
    this.measure = measure;
    byId("latency-raw").addEventListener("click", () => this.ask(true));
    new ResizeObserver(() => this.draw()).observe(byId("latency-canvas"));
  }

  async ask(again) {
    this.asked = true;
    try {
      this.raw = await this.measure(again);
      this.show();
    } catch (error) {
      setText(byId("latency-text"), error.message);
    }
  }

  take(handshake) {
    if (!this.asked) this.ask(false);
    if (!handshake || (this.found && handshake.n === this.found.n)) return;
    this.found = handshake;
    this.show();
  }

  show() {
    const found = this.found;
    const parts = [];
    if (found && found.n) {
      parts.push(`${found.n} requests, over a scan: p50 ${fixed(found.p50, 1)}, p99 ${fixed(found.p99, 1)},`
        + ` max ${fixed(found.max, 1)} us`);
    } else parts.push("no request so far");
    if (this.raw) {
      const one = this.raw.two_cores ? "" : ", on one processor";
      parts.push(`raw exchange${one}: p50 ${fixed(this.raw.p50, 2)}, p99 ${fixed(this.raw.p99, 2)} us`);
    }
    setText(byId("latency-text"), parts.join("; "));
    this.draw();
  }

  draw() {
    const canvas = byId("latency-canvas");
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (!width) return;
    [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
    const context = canvas.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    const { edges = [], counts = [] } = (this.found && this.found.edges ? this.found : this.raw) || {};
    if (!edges.length) return;
    const step = (width - 20) / counts.length;
    if (this.found && this.found.counts) this.bars(context, this.found.counts, step, height, styleColor("--accent"), 0);
    if (this.raw) this.bars(context, this.raw.counts, step, height, "#d55e00", 0.5);
    this.scale(context, edges, step, height);
  }

  /** Counts as bars of half a step, each kind by its own most. */
  bars(context, counts, step, height, color, share) {
    const most = Math.max(1, ...counts);
    context.fillStyle = color;
    counts.forEach((count, i) => {
      const tall = ((height - 22) * count) / most;
      context.fillRect(10 + (i + share) * step, height - 18 - tall, step / 2 - 0.5, tall);
    });
  }

  /** Each factor of ten, us. */
  scale(context, edges, step, height) {
    context.fillStyle = styleColor("--soft");
    context.font = "11px system-ui, sans-serif";
    context.textAlign = "center";
    edges.forEach((edge, i) => {
      const power = Math.log10(edge);
      if (Math.abs(power - Math.round(power)) > 1e-6) return;
      context.fillText(timeText(edge), 10 + (i + 1) * step, height - 4);
    });
  }
}

/** A time of so many us in few characters. */
function timeText(us) {
  if (us < 1) return `${fixed(us, 1)} us`;
  return us < 1000 ? `${Math.round(us)} us` : `${Math.round(us / 1000)} ms`;
}
