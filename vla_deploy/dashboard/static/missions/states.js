/** Say how missions and their parts stand, in words, with tone and icon. */

import { clock, duration } from "../format.js";

/** How a mission stands. */
export const MISSION_STATES = {
  planning: { text: "Waits", tone: "info", icon: "clock" },
  executing: { text: "Running", tone: "info", icon: "play" },
  paused: { text: "Paused", tone: "warn", icon: "pause" },
  completed: { text: "Done", tone: "ok", icon: "check" },
  failed: { text: "Failed", tone: "bad", icon: "alert" },
  cancelled: { text: "Cancelled", tone: "quiet", icon: "cross" },
};

/** How an objective or a subtask stands: as a step of a plan, and in words. */
export const PART_STATES = {
  pending: ["pending", "waits"],
  executing: ["active", "goes on"],
  checking: ["active", "is checked"],
  completed: ["succeeded", "done"],
  failed: ["aborted", "failed"],
  cancelled: ["cancelled", "cancelled"],
};

/** Tell whether something of a mission is still to come. */
export function isOpen({ state }) {
  return ["planning", "executing", "paused"].includes(state);
}

/** Return when a mission begins, where that is not at once. */
export function whenWords({ mission: { schedule }, state, due_unix_s, cycles }) {
  const { when, every_s, times } = schedule;
  const told = [
    when && `as soon as ${when}`,
    every_s && `every ${duration(every_s)}${times ? `, ${times} times` : ""}`,
    state === "planning" && due_unix_s && `begins at ${clock(due_unix_s)}`,
    every_s && cycles > 0 && `begun ${cycles === 1 ? "once" : `${cycles} times`}`,
  ];
  return told.filter(Boolean).join(" · ");
}

/** Return the parts of a mission that its list shows: objectives, and subtasks where there are several. */
export function rowsOf({ mission, objectives, subtasks }) {
  const unbegun = { state: "pending", error: "", note: "", begin_s: null, end_s: null };
  return mission.objectives.map(({ id, words, subtasks: own }) => {
    const row = (name, text, run) => ({ name, words: text || name, ...unbegun, ...run });
    const parts = own.map((one) => row(`${id}.${one.id}`, one.words || skillsOf(one), subtasks[`${id}.${one.id}`]));
    const title = words || (parts.length === 1 ? parts[0].words : "");
    return { ...row(id, title, objectives[id]), parts };
  });
}

function skillsOf({ actions }) {
  return actions.map(({ skill }) => skill.replaceAll("_", " ")).join(", ");
}
