/** Follow the alarms, and acknowledge them. */

import { post } from "../api.js";
import { useTopic } from "../following.js";

const GRAVITY = ["critical", "error", "warning", "info"];

/** Return `{open, over, seen, stale, known}`: what lasts, what has ended, each unseen; what was seen. */
export function useAlarms() {
  const { data, stale } = useTopic("alarms");
  const all = data?.alarms ?? [];
  const unseen = all.filter((alarm) => !alarm.acknowledged_by);
  return {
    open: gravestFirst(unseen.filter((alarm) => !alarm.ended_s)),
    over: unseen.filter((alarm) => alarm.ended_s),
    seen: all.filter((alarm) => alarm.acknowledged_by),
    stale,
    known: data !== null,
  };
}

/** Say that somebody has seen an alarm. */
export function acknowledge(id) {
  return post(`alarms/${encodeURIComponent(id)}/acknowledge`);
}

function gravestFirst(alarms) {
  const rank = ({ severity }) => GRAVITY.indexOf(severity);
  return alarms.toSorted((a, b) => rank(a) - rank(b) || b.since_s - a.since_s);
}
