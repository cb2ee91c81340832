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

/** Return what an action measured: where the base stands, what it found or took. */
export function dataWords(data) {
  const { x_m, y_m, yaw_rad, thing_id, position_m, arm, class: kind, ...others } = data ?? {};
  const metres = (values) => `${values.map((one) => one.toFixed(2)).join(", ")} m`;
  const told = [
    Number.isFinite(x_m) && `the base is at ${metres([x_m, y_m])}`,
    Number.isFinite(yaw_rad) && `turned ${Math.round((180 / Math.PI) * yaw_rad)}°`,
    thing_id && words(thing_id),
    position_m && `at ${metres(position_m)}`,
    kind && words(kind),
    arm && `${words(arm)} arm`,
    ...Object.entries(others).map(([name, value]) => `${words(name)} ${valueWords(value)}`),
  ];
  return told.filter(Boolean).join(", ");
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
