/** Name the phases of a change of profile and its endings, as the supervisor tells them. */

export const PHASES = [
  { name: "prepare", words: "every process prepares" },
  { name: "set power mode", words: "the power mode is set" },
  { name: "commit", words: "all switch over" },
  { name: "watch", words: "rates, late ticks and memory are watched" },
  { name: "validate", words: "the result is judged" },
  { name: "rollback", words: "everything goes back" },
];

export const OUTCOMES = {
  kept: { tone: "ok", icon: "check", words: "kept" },
  "would work": { tone: "ok", icon: "check", words: "would work" },
  refused: { tone: "bad", icon: "cross", words: "refused" },
  "rolled back": { tone: "warn", icon: "reset", words: "rolled back" },
};

/** Return where a phase is while `current` is under way: "done", "now", "next" or "unused". */
export function reached(name, current) {
  const at = PHASES.findIndex((phase) => phase.name === name);
  const now = PHASES.findIndex((phase) => phase.name === current);
  if (at === now) return "now";
  if (name === "rollback") return "unused";
  return at < now ? "done" : "next";
}
