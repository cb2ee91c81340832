/** Receive what the robot tells, over one WebSocket for the whole page.
 *
 * Values carry their age: what the server said plus the time since it came, by a clock that does
 * not jump. A value whose age cannot be trusted, since the connection is gone, is stale.
 */

import { deadlineOf } from "./deadlines.js";
import { readFrame } from "./live_frames.js";
import { Store } from "./store.js";

const FIRST_DELAY_MS = 300;
const LONGEST_DELAY_MS = 8_000;
const SILENCE_LIMIT_MS = 6_000;
const WATCH_PERIOD_MS = 1_000;

/** State of the connection: "closed", "connecting" or "open", and when it was last heard (ms). */
export const connection = new Store({ state: "closed", heard_ms: null });

const samples = new Map();
const listeners = new Map();
let socket = null;
let delay_ms = FIRST_DELAY_MS;
let timer = null;
let wanted = false;
let isTelling = false;

/** Open the connection and keep it open. */
export function connect() {
  wanted = true;
  if (!socket && !timer) open();
}

/** Close the connection for good, e.g. at logout. */
export function disconnect() {
  wanted = false;
  clearTimeout(timer);
  timer = null;
  socket?.close();
}

/** Call `listener(sample)` for what comes on a topic; return what ends that. */
export function subscribe(topic, listener) {
  const known = listeners.has(topic);
  if (!known) listeners.set(topic, new Set());
  listeners.get(topic).add(listener);
  if (!known) tellTopics();
  return () => unsubscribe(topic, listener);
}

/** Return the newest sample of a topic: `{topic, data, stamp_s, age_s, came_ms}`, or undefined. */
export function latest(topic) {
  return samples.get(topic);
}

/** Return how old a sample is now, in seconds. */
export function ageOf(sample) {
  return sample.age_s + (performance.now() - sample.came_ms) / 1000;
}

/** Tell whether a sample is too old to be shown as live. */
export function isStale(sample) {
  if (!sample || connection.value.state !== "open") return true;
  return ageOf(sample) > deadlineOf(sample.topic);
}

function unsubscribe(topic, listener) {
  const set = listeners.get(topic);
  if (!set?.delete(listener) || set.size > 0) return;
  listeners.delete(topic);
  tellTopics();
}

function open() {
  timer = null;
  const url = new URL("api/v1/live", document.baseURI);
  url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
  connection.set({ ...connection.value, state: "connecting" });
  socket = new WebSocket(url);
  socket.binaryType = "arraybuffer";
  socket.addEventListener("open", opened);
  socket.addEventListener("message", received);
  socket.addEventListener("close", closed);
}

function opened() {
  connection.set({ state: "open", heard_ms: performance.now() });
  tellTopics();
}

function closed() {
  socket = null;
  connection.set({ ...connection.value, state: "closed" });
  if (!wanted) return;
  timer = setTimeout(open, delay_ms * (0.75 + Math.random() / 2)); // not all pages at once
  delay_ms = Math.min(2 * delay_ms, LONGEST_DELAY_MS);
}

/** Say once what is wanted, after a view has said all that it wants. */
function tellTopics() {
  if (isTelling) return;
  isTelling = true;
  queueMicrotask(() => {
    isTelling = false;
    if (socket?.readyState !== WebSocket.OPEN) return;
    socket.send(JSON.stringify({ subscribe: [...listeners.keys()] }));
  });
}

function received(event) {
  delay_ms = FIRST_DELAY_MS;
  const came_ms = performance.now();
  connection.value.heard_ms = came_ms;
  const message = typeof event.data === "string" ? JSON.parse(event.data) : readFrame(event.data);
  if (!message) return;
  const sample = { ...message, came_ms, age_s: message.age_s ?? 0 };
  samples.set(sample.topic, sample);
  for (const listener of [...(listeners.get(sample.topic) ?? [])]) listener(sample);
}

function watch() {
  const { state, heard_ms } = connection.value;
  // A connection whose other end has vanished stays "open" for minutes; silence tells it sooner.
  const silent = listeners.size > 0 && performance.now() - heard_ms > SILENCE_LIMIT_MS;
  if (state === "open" && silent) {
    socket.removeEventListener("close", closed);
    socket.close();
    closed();
  }
}

setInterval(watch, WATCH_PERIOD_MS);

