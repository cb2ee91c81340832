/** Read the `budget` document: what each process uses of what it may. Pure. */

// How a metric is named and written; `digits` behind the point.
export const METRICS = {
  cpu_ratio: { words: "CPU", unit: "cores", digits: 2 },
  memory_mb: { words: "Memory", unit: "MB", digits: 0 },
  gpu_memory_mb: { words: "GPU memory", unit: "MB", digits: 0 },
  gpu_ratio: { words: "GPU", unit: "of 1", digits: 2 },
  power_w: { words: "Power", unit: "W", digits: 1 },
  temperature_c: { words: "Temperature", unit: "°C", digits: 0 },
  disk_free_mb: { words: "Disk free", unit: "MB", digits: 0 },
};

const NEAR_RATIO = 0.85;

/** Return `[{process, lines: {metric: line}}]` in the document's order; the total has no process. */
export function byProcess(budget) {
  const found = new Map();
  for (const row of budget.rows) {
    if (!found.has(row.process)) found.set(row.process, { process: row.process, lines: {} });
    found.get(row.process).lines[row.metric] = row;
  }
  return [...found.values()];
}

/** Return the share of its limit that a line has used; of a lower limit, the limit over the value. */
export function usedRatio(line) {
  if (line.measured === null || !line.limit) return null;
  return line.at_least ? line.limit / Math.max(line.measured, 1e-9) : line.measured / line.limit;
}

/** Return how a line stands: "bad" beyond its limit, "warn" near it, "ok", or "quiet" if missing. */
export function toneOf(line) {
  if (line.measured === null) return "quiet";
  if (line.over) return "bad";
  return usedRatio(line) >= NEAR_RATIO ? "warn" : "ok";
}

/** Return a line in words: "84 of 250 MB", or why there is no value. */
export function written(line) {
  const { unit, digits } = METRICS[line.metric] ?? { unit: "", digits: 2 };
  const limit = `${line.at_least ? "at least " : ""}${number(line.limit, digits)} ${unit}`.trim();
  if (line.measured === null) return `missing: ${line.reason || "no reason told"}; limit ${limit}`;
  return `${number(line.measured, digits)} ${line.at_least ? `${unit}, ` : "of "}${limit}`;
}

/** Return what a step of the ladder does, in words. */
export function stepWords({ action, process, ratio }) {
  const who = process ?? "the robot";
  const acts = {
    slow: `${who} works at ${Math.round(100 * ratio)} % of its rate`,
    smaller_model: `${who} takes a smaller model`,
    suspend: `${who} is suspended`,
    restart: `${who} is restarted`,
    protective_stop: "the robot stops and waits",
  };
  return acts[action] ?? `${action} ${who}`;
}

function number(value, digits) {
  return value.toLocaleString("en-GB", { minimumFractionDigits: digits, maximumFractionDigits: digits });
}
