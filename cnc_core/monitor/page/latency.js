// The handshake's times as a histogram, beside the raw exchange of the same machine.

import { byId, fixed, setText, styleColor } from "./format.js";

export class Latency {
  /** `measure`: gives the quantiles of the raw exchange, us. */
  constructor(measure) {
    this.raw = null;
    this.found = null;
    byId("latency-raw").addEventListener("click", async () => {
      try {
        this.raw = await measure();
        this.show();
      } catch (error) {
        setText(byId("latency-text"), error.message);
      }
    });
  }

  take(handshake) {
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
    if (this.raw) parts.push(`raw exchange: p50 ${fixed(this.raw.p50, 2)}, p99 ${fixed(this.raw.p99, 2)} us`);
    setText(byId("latency-text"), parts.join("; "));
    this.draw();
  }

  draw() {
    const canvas = byId("latency-canvas");
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (!width) return;
    canvas.width = width;
    canvas.height = height;
    const context = canvas.getContext("2d");
    const { edges = [], counts = [] } = this.found || {};
    if (!edges.length) return;
    const most = Math.max(1, ...counts);
    const step = (width - 20) / counts.length;
    context.fillStyle = styleColor("--accent");
    counts.forEach((count, i) => {
      const tall = ((height - 22) * count) / most;
      context.fillRect(10 + i * step, height - 18 - tall, step - 1, tall);
    });
    context.fillStyle = styleColor("--soft");
    context.font = "11px system-ui, sans-serif";
    context.textAlign = "center";
    edges.forEach((edge, i) => {
      if (Math.abs(Math.log10(edge) - Math.round(Math.log10(edge))) < 1e-6) {
        context.fillText(`${edge >= 1 ? Math.round(edge) : fixed(edge, 1)} us`, 10 + (i + 1) * step, height - 4);
      }
    });
    if (!this.raw) return;
    const at = edges.findIndex((edge) => edge > this.raw.p50);
    context.fillStyle = "#d55e00";
    context.fillRect(10 + at * step + step / 2, 0, 2, height - 18);
    context.fillText("raw", 10 + at * step + step / 2, 10);
  }
}
