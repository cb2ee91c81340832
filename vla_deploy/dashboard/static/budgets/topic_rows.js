/** Read the live topic `topics`. Pure. */

const TROUBLE = { bad: 0, quiet: 1, ok: 2 };

/** Return the rows, those in trouble first, else by name. */
export function rowsOf(told) {
  const rows = Array.isArray(told) ? told : (told.topics ?? Object.entries(told).map(([topic, row]) => ({ topic, ...row })));
  const plain = rows.map((row) => ({
    rate_hz: null,
    age_s: null,
    deadline_s: 0,
    ...row,
    topic: row.topic ?? row.name,
    declared_hz: row.declared_hz ?? row.declared_rate_hz ?? 0,
  }));
  const grave = (row) => TROUBLE[standingOf(row).tone];
  return plain.sort((one, other) => grave(one) - grave(other) || one.topic.localeCompare(other.topic));
}

/** Return how a topic stands against its deadline: {tone, words}. */
export function standingOf({ age_s, deadline_s }) {
  if (age_s === null) return { tone: "quiet", words: "never written" };
  if (!deadline_s) return { tone: "ok", words: "on change" };
  return age_s > deadline_s ? { tone: "bad", words: "late" } : { tone: "ok", words: "in time" };
}
