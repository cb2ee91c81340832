/** Stop the robot, whatever the rest of the page does.
 *
 * For whoever places the button: `#stop-button`, and anything with `data-stop`, presses; `#stop-answer`
 * tells what came of it. Both are looked for at each press, so they may be drawn anew at any time.
 * The root element carries `data-stop-state` (see `standing`) while a demand lasts. Hand what control
 * tells to `saw`, so that the page knows sooner; without it the stop door's answers do.
 * Keys: Ctrl and full stop, or Escape twice. This file imports nothing but its own logic.
 */

import * as logic from "./stop_logic.js";

const MOST_UNDER_WAY = 3;
const ANSWER_LIMIT_MS = 8_000;
const CLICK_AFTER_POINTER_MS = 1_000;
const REASON = JSON.stringify({ reason: "pressed on the page" });

const REQUESTS = {
  page: { body: REASON, headers: { "Content-Type": "application/json" }, credentials: "same-origin" },
  // No header of its own: a browser asks no permission before it sends this.
  door: { mode: "cors", credentials: "omit" },
};

const underWay = { page: 0, door: 0 };
let demand = null;
let timer = 0;
let lastEscape_ms = -Infinity;
let lastPointer_ms = -Infinity;

/** Demand the stop by both doors, and go on until control says that it has stopped. */
export function press() {
  const now_ms = performance.now();
  if (!demand || !logic.shallGoOn(demand, now_ms)) demand = logic.demanded(now_ms);
  send();
  clearInterval(timer);
  timer = setInterval(again, logic.AGAIN_MS);
}

/** Take note of what control tells of itself: a `control_status` as it comes. */
export function saw(control) {
  if (!demand) return;
  const now_ms = performance.now();
  if (logic.isOver(demand, control, now_ms)) forget();
  else change(logic.heard(demand, control, now_ms));
}

function again() {
  if (logic.shallGoOn(demand, performance.now())) return send();
  clearInterval(timer);
  show();
}

function send() {
  const door = document.querySelector('meta[name="stop-door"]')?.content;
  for (const [name, url] of Object.entries(logic.addresses(document.baseURI, door))) {
    if (underWay[name] < MOST_UNDER_WAY) ask(name, url);
  }
  change(logic.sentAgain(demand));
}

async function ask(name, url) {
  const asked = demand.since_ms;
  underWay[name] += 1;
  const answer = await answerOf(name, url);
  underWay[name] -= 1;
  if (demand?.since_ms === asked) change(logic.answered(demand, name, answer, performance.now()));
}

async function answerOf(name, url) {
  const signal = AbortSignal.timeout(ANSWER_LIMIT_MS);
  const always = { method: "POST", keepalive: true, cache: "no-store", signal };
  try {
    const response = await fetch(url, { ...always, ...REQUESTS[name] });
    const told = await response.json();
    return { ok: response.ok && told.pressed === true, why: told.error?.what, control: told.control };
  } catch (error) {
    return { ok: false, why: error.message };
  }
}

function change(next) {
  demand = next;
  if (demand.stopped_ms !== null) clearInterval(timer);
  show();
}

function forget() {
  demand = null;
  show();
}

function show() {
  const now_ms = performance.now();
  const state = demand ? logic.standing(demand, now_ms) : "";
  document.documentElement.dataset.stopState = state;
  const button = document.getElementById("stop-button");
  button?.setAttribute("aria-busy", String(state === "asking" || state === "pressed"));
  const place = document.getElementById("stop-answer");
  const words = demand ? logic.sentence(demand, now_ms) : "";
  if (place && place.textContent !== words) place.textContent = words; // said aloud on change alone
}

function isButton(event) {
  return event.target instanceof Element && event.target.closest("#stop-button, [data-stop]");
}

function pointed(event) {
  if (event.button !== 0 || !isButton(event)) return;
  lastPointer_ms = performance.now();
  press();
}

function clicked(event) {
  if (!isButton(event) || performance.now() - lastPointer_ms < CLICK_AFTER_POINTER_MS) return;
  press(); // by keyboard, or by what reads the page aloud
}

function typed(event) {
  const now_ms = performance.now();
  if (logic.isStopKey(event, lastEscape_ms, now_ms)) {
    event.preventDefault();
    press();
  }
  if (event.key === "Escape") lastEscape_ms = now_ms;
}

// Before any other listener of the page, which could keep them from coming.
addEventListener("pointerdown", pointed, { capture: true });
addEventListener("click", clicked, { capture: true });
addEventListener("keydown", typed, { capture: true });
