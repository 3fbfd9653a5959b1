// The server: what is read, what is done, and the stream of frames.

const KEY = "hli-cosim-token";
const RETRY_MS = [200, 500, 1000, 2000];

/** What stands behind # in the address: a browser keeps it for itself. */
const kept = () => new URLSearchParams(location.hash.slice(1));

/** The recording that the address names. */
export const wantedRecording = () => kept().get("recording");

/** The token of the address, which then goes from the address bar, or of this tab. */
export function token() {
  const words = kept();
  const given = words.get("token") || new URLSearchParams(location.search).get("token");
  if (given) {
    sessionStorage.setItem(KEY, given);
    words.delete("token");
    const rest = words.toString();
    history.replaceState(null, "", location.pathname + (rest ? `#${rest}` : ""));
  }
  return sessionStorage.getItem(KEY) || "";
}

export const setToken = (value) => sessionStorage.setItem(KEY, value);

async function answerOf(response) {
  const value = await response.json().catch(() => ({}));
  if (!response.ok) {
    const error = new Error(value.error || `status ${response.status}`);
    error.status = response.status;
    throw error;
  }
  return value;
}

const authority = () => ({ authorization: `Bearer ${token()}` });

/** GET of a route, as an object. */
export async function get(path, query = {}) {
  const words = new URLSearchParams(query).toString();
  return answerOf(await fetch(`/api/${path}${words ? `?${words}` : ""}`, { headers: authority() }));
}

/** POST of what somebody does. */
export async function post(path, value) {
  const headers = { ...authority(), "content-type": "application/json" };
  return answerOf(await fetch(`/api/${path}`, { method: "POST", headers, body: JSON.stringify(value) }));
}

/**
 * How long messages were on their way, beyond the quickest one so far, ms.
 * The server's clock and the page's have different zeros; the least difference
 * of both that was seen stands for a way without delay.
 */
export class Way {
  constructor() { this.least = Infinity; }

  late(sent, now = performance.now()) {
    this.least = Math.min(this.least, now - sent);
    return now - sent - this.least;
  }
}

/** The stream of one cell; it comes back by itself after a loss. */
export class Live {
  constructor(cell, { greeted, frame, lost, refused }) {
    this.cell = cell;
    this.tell = { greeted, frame, lost, refused };
    this.page = "";
    this.who = "";
    this.tries = 0;
    this.wanted = { subscribe: [], scope: [], channel: 0 };
    this.open();
  }

  open() {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    const socket = new WebSocket(`${scheme}://${location.host}/api/live?cell=${encodeURIComponent(this.cell)}`);
    this.socket = socket;
    socket.onopen = () => socket.send(JSON.stringify({ token: token() }));
    socket.onmessage = (event) => this.take(JSON.parse(event.data));
    socket.onclose = (event) => {
      this.closed = `${event.code} ${event.reason}`;
      this.page = "";
      if (event.code === 4401 || event.code === 4404) {
        this.tell.refused(event.code, event.reason);
        return;
      }
      this.tell.lost();
      const wait = RETRY_MS[Math.min(this.tries++, RETRY_MS.length - 1)];
      setTimeout(() => this.open(), wait);
    };
  }

  take(message) {
    if (message.hello) {
      this.page = message.hello.page;
      this.who = message.hello.who;
      this.tries = 0;
      this.tell.greeted();
      this.ask();
      return;
    }
    this.tell.frame(message);
  }

  /** Ask for a channel and these symbols in each frame, and for those of the scope in each sample. */
  want(subscribe, scope, channel) {
    const wanted = { subscribe, scope, channel };
    if (JSON.stringify(wanted) === JSON.stringify(this.wanted)) return;
    this.wanted = wanted;
    this.ask();
  }

  ask() {
    if (this.page && this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(this.wanted));
  }

  /** Give an order; the answer of the PLC, or an Error with its words. */
  act(order, who) {
    return post("act", { page: this.page, who, order });
  }
}
