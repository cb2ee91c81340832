/** Follow the alarms, and acknowledge them. */

import { post } from "../api.js";
import { useTopic } from "../following.js";

const GRAVITY = ["critical", "error", "warning", "info"];

/** Return `{all, open, stale, known}`; open is what nobody has acknowledged. */
export function useAlarms() {
  const { data, stale } = useTopic("alarms");
  const all = data?.alarms ?? [];
  return { all, open: all.filter((alarm) => !alarm.acknowledged_by), stale, known: data !== null };
}

/** Return alarms by gravity, the newest first among equals. */
export function gravestFirst(alarms) {
  const rank = ({ severity }) => GRAVITY.indexOf(severity);
  return alarms.toSorted((a, b) => rank(a) - rank(b) || b.since_s - a.since_s);
}

/** Say that somebody has seen an alarm. */
export function acknowledge(id) {
  return post(`alarms/${encodeURIComponent(id)}/acknowledge`);
}
