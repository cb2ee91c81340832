/** Say what actions do, in words. */

import { significant, words } from "../format.js";

const SOURCES = { cli: "terminal", voice: "voice", dashboard: "page", api: "API" };

const STATUSES = {
  pending: "waits",
  active: "goes on",
  succeeded: "done",
  cancelled: "cancelled",
  aborted: "failed",
  rejected: "refused",
  lost: "lost",
};

/** Return an action in words: "pick up red cup", "place in box". */
export function actionWords({ skill, parameters }) {
  const { destination, ...others } = parameters ?? {};
  const values = destination === undefined ? others : { ...others, destination };
  return [words(skill), ...Object.values(values).map(valueWords)].join(" ");
}

/** Return what an action's status means. */
export function statusWords(status) {
  return STATUSES[status] ?? words(status);
}

/** Return where a command came from: "voice-812-3" of source "voice" is "voice". */
export function sourceWords(source) {
  const [kind] = String(source ?? "").split(":");
  return SOURCES[kind] ?? words(kind);
}

function valueWords(value) {
  if (typeof value === "number") return significant(value);
  return typeof value === "object" ? JSON.stringify(value) : words(value);
}
