/** Fetch what the robot has kept of its metrics, and put it in the order that charts take. */

import { get } from "../api.js";

/** Spans that the store keeps, in seconds, and how often each is asked for again. */
export const SPANS = [
  { span_s: 60, words: "1 min", again_ms: 2_000 },
  { span_s: 600, words: "10 min", again_ms: 5_000 },
  { span_s: 3600, words: "1 h", again_ms: 15_000 },
  { span_s: 86_400, words: "24 h", again_ms: 60_000 },
];

/** Return the curves of `charts` over a span: {end_s, series: Map(metric -> [{label, times_s, values}])}. */
export async function fetchHistory(charts, span_s) {
  const names = wanted(await get("history/series"), charts);
  if (names.length === 0) return { end_s: Date.now() / 1000, series: new Map() };
  return read(await get(`history?series=${encodeURIComponent(names.join(","))}&span_s=${span_s}`));
}

/** Return which of the series that are kept belong to `charts`. Pure. */
export function wanted(told, charts) {
  const metrics = new Set(charts.map((chart) => chart.metric));
  const kept = (told.series ?? told).map((one) => one.name ?? one);
  return kept.filter((name) => metrics.has(name.split("/")[0]));
}

/** Read `GET history`: series are named metric/label, each with its mean in every step. Pure. */
export function read({ start_s, step_s, series }) {
  const curves = new Map();
  let steps = 0;
  for (const [name, { mean }] of Object.entries(series)) {
    const [metric, label = ""] = name.split("/");
    const times_s = mean.map((_, at) => start_s + at * step_s);
    steps = Math.max(steps, mean.length);
    curves.set(metric, [...(curves.get(metric) ?? []), { label, times_s, values: mean }]);
  }
  return { end_s: start_s + steps * step_s, series: curves };
}
