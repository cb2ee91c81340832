/** Read from a command's events how it stands: a pure function, drawn by timeline and history. */

const FINAL = ["succeeded", "cancelled", "aborted", "rejected", "lost"];

/** How a command stands, in words, with its tone and icon. */
export const STATES = {
  given: { text: "Given", tone: "info", icon: "send" },
  queued: { text: "Waiting", tone: "info", icon: "clock" },
  planning: { text: "Planning", tone: "info", icon: "clock" },
  asked: { text: "Asks you", tone: "warn", icon: "question" },
  answered: { text: "Answer", tone: "quiet", icon: "check" },
  running: { text: "Running", tone: "info", icon: "play" },
  paused: { text: "Paused", tone: "warn", icon: "pause" },
  mending: { text: "Seeks another way", tone: "warn", icon: "clock" },
  done: { text: "Done", tone: "ok", icon: "check" },
  cancelled: { text: "Cancelled", tone: "quiet", icon: "cross" },
  failed: { text: "Failed", tone: "bad", icon: "alert" },
  lost: { text: "Lost", tone: "bad", icon: "alert" },
  refused: { text: "Refused", tone: "bad", icon: "cross" },
};

/** States in which something is still to come. */
export const OPEN_STATES = ["given", "queued", "planning", "asked", "running", "mending"];

const READERS = {
  queued: (story, { place }) => ({ ...story, state: "queued", place }),
  planning: (story, { rungs }) => ({ ...story, state: "planning", rungs }),
  asked: (story, event) => ({ ...story, state: "asked", asked: event }),
  answered: (story, { of }) => ({ ...story, state: "answered", answers: of }),
  accepted: (story) => ({ ...story, state: "running", asked: null }),
  plan: planned,
  action: acted,
  setback: (story, { error }) => ({ ...story, state: "mending", why: error }),
  objective: reached,
  said: (story, { text }) => ({ ...story, said: [...story.said, text] }),
  rejected: (story, { reason, attempts }) => ({
    ...story,
    state: "refused",
    asked: null,
    why: reason,
    attempts: attempts ?? story.attempts,
  }),
  finished,
};

/** Return `{state, actions, objectives, asked, why, said, plan, summary, ...}` of events in order. */
export function storyOf(events) {
  const begin = { state: "given", actions: [], objectives: [], said: [], attempts: [], asked: null, why: "", plan: null };
  return events.reduce((story, event) => READERS[event.event]?.(story, event) ?? story, begin);
}

/** Tell whether an action goes on or waits. */
export function isOpen(action) {
  return !FINAL.includes(action.status);
}

function planned(story, event) {
  const actions = event.plan.actions.map((action) => ({
    ...action,
    status: "pending",
    execution_time_s: 0,
    error: null,
    retries: 0,
    note: null,
  }));
  const { plan, rung, confidence, origin } = event;
  const attempts = event.attempts ?? story.attempts;
  // After a setback another plan goes on: what was done, and what failed, stays to be seen.
  const before = story.actions.filter((action) => !isOpen(action) && action.status !== "cancelled");
  const all = [...before, ...actions];
  return { ...story, state: "running", asked: null, why: "", actions: all, plan, rung, confidence, origin, attempts };
}

function acted(story, { event, command_id, action_id, ...told }) {
  return { ...story, actions: merged(story.actions, [{ id: action_id, ...told }]) };
}

/** A mission goes on, or begins again: then nothing of it is done yet. */
function reached(story, { part, words, state, error, note }) {
  const before = OPEN_STATES.includes(story.state) ? story.objectives : [];
  const row = { name: part, words, state, error, note };
  const isNew = !before.some((one) => one.name === part);
  const objectives = isNew ? [...before, row] : before.map((one) => (one.name === part ? row : one));
  return { ...story, state: "running", why: "", objectives };
}

function finished(story, { success, error, summary, actions }) {
  const all = merged(story.actions, actions ?? []);
  return { ...story, state: ending(success, error, all), why: error ?? "", summary, actions: all, asked: null };
}

function ending(success, error, actions) {
  if (success) return "done";
  if (String(error).startsWith("lost")) return "lost";
  if (/(cancelled|stopped) on request$/.test(error)) return "cancelled";
  const ends = actions.map((action) => action.status);
  return ends.includes("cancelled") && !ends.includes("aborted") ? "cancelled" : "failed";
}

function merged(actions, told) {
  const news = new Map(told.map((action) => [action.id, action]));
  const known = actions.map((action) => ({ ...action, ...news.get(action.id) }));
  const ids = new Set(actions.map((action) => action.id));
  return [...known, ...told.filter((action) => !ids.has(action.id))];
}
