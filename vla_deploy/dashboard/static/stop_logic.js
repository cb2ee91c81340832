/** Follow one demand to stop: pure functions from what was, and what happened, to what is.
 *
 * A demand is `{since_ms, sent, answers: {door: {ok, after_ms, why}}, stopped_ms}`, frozen.
 */

/** The two ways to the robot's stop button, and how they are called. */
export const DOORS = { page: "the dashboard", door: "the stop door" };
/** Press again so often, until control says that it has stopped. */
export const AGAIN_MS = 250;
/** After that without an answer, or without control's word, a person is told to go to the robot. */
export const PATIENCE_MS = 1_500;
/** After that the page presses no more by itself. */
export const LONGEST_MS = 60_000;
/** Two presses of Escape that close together count as one demand; held down it repeats itself. */
export const TWICE_MS = 800;
const SETTLED_MS = 1_000;

const BUTTON = "Press the emergency stop button on the robot.";

/** Return a demand that begins now. */
export function demanded(now_ms) {
  return Object.freeze({ since_ms: now_ms, sent: 0, answers: {}, stopped_ms: null });
}

/** Return the demand after one more round of presses. */
export function sentAgain(demand) {
  return Object.freeze({ ...demand, sent: demand.sent + 1 });
}

/** Return the demand after a door's answer: `{ok, control?, why?}`; what has once worked stays. */
export function answered(demand, door, answer, now_ms) {
  const before = demand.answers[door];
  const told = before?.ok ? before : { ok: answer.ok, why: answer.why ?? "", after_ms: now_ms - demand.since_ms };
  const next = Object.freeze({ ...demand, answers: { ...demand.answers, [door]: told } });
  return heard(next, answer.control ?? null, now_ms);
}

/** Return the demand after a word of control, which may come by any way. */
export function heard(demand, control, now_ms) {
  if (demand.stopped_ms !== null || !isStopped(control)) return demand;
  return Object.freeze({ ...demand, stopped_ms: now_ms });
}

/** Tell whether control says that the emergency stop is in force. */
export function isStopped(control) {
  return control?.estop_latched === true;
}

/** Tell whether a robot that had stopped was reset; what was under way before it stopped is no word of that. */
export function isOver(demand, control, now_ms) {
  return demand.stopped_ms !== null && now_ms - demand.stopped_ms > SETTLED_MS && control?.estop_latched === false;
}

/** Return how a demand stands: "asking", "pressed", "stopped", "unheard" or "unconfirmed". */
export function standing(demand, now_ms) {
  if (demand.stopped_ms !== null) return "stopped";
  const isLate = now_ms - demand.since_ms >= PATIENCE_MS;
  if (!Object.values(demand.answers).some((answer) => answer.ok)) return isLate ? "unheard" : "asking";
  return isLate ? "unconfirmed" : "pressed";
}

/** Tell whether the page shall press again by itself. */
export function shallGoOn(demand, now_ms) {
  return demand.stopped_ms === null && now_ms - demand.since_ms < LONGEST_MS;
}

/** Say how a demand stands. */
export function sentence(demand, now_ms) {
  const goesOn = shallGoOn(demand, now_ms) ? " The page keeps pressing." : "";
  const words = {
    asking: "Stopping …",
    pressed: `Pressed: ${whoAnswered(demand)}.`,
    stopped: `Stopped. Pressed: ${whoAnswered(demand) || "by another way"}.`,
    unheard: `Nobody answers. ${BUTTON}${goesOn}`,
    unconfirmed: `Pressed, but control does not say that it stopped. ${BUTTON}${goesOn}`,
  };
  return words[standing(demand, now_ms)];
}

/** Tell whether a key demands the stop: Ctrl and full stop, or Escape twice. */
export function isStopKey(event, lastEscape_ms, now_ms) {
  if (event.key === "." && (event.ctrlKey || event.metaKey)) return true;
  return event.key === "Escape" && now_ms - lastEscape_ms < TWICE_MS;
}

/** Return where each door takes a press; one that nobody has named is left out. */
export function addresses(base, door) {
  const page = new URL("api/v1/stop", base).href;
  return door ? { page, door: new URL("/stop", door).href } : { page };
}

function whoAnswered(demand) {
  return Object.entries(DOORS)
    .filter(([door]) => demand.answers[door]?.ok)
    .map(([door, name]) => `${name} after ${Math.round(demand.answers[door].after_ms)} ms`)
    .join(", ");
}
