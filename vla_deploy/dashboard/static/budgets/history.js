/** Fetch what the robot has kept of its metrics, and put it in the order that charts take. */

import { get } from "../api.js";

/** Spans that the store keeps, in seconds, and how often each is asked for again. */
export const SPANS = [
  { span_s: 60, words: "1 min", again_ms: 2_000 },
  { span_s: 600, words: "10 min", again_ms: 5_000 },
  { span_s: 3600, words: "1 h", again_ms: 15_000 },
  { span_s: 86_400, words: "24 h", again_ms: 60_000 },
];

/** Return the curves of `charts` over a span, as `read` does. */
export async function fetchHistory(charts, span_s) {
  const names = charts.map((chart) => chart.metric).join(",");
  return read(await get(`history?series=${encodeURIComponent(names)}&span_s=${span_s}`), charts);
}

/** Return {end_s, series: Map(metric -> [{label, times_s, values}]), missing} of `GET history`. Pure. */
export function read(told, charts) {
  const curvesOf = ({ metric, by }) =>
    told.series
      .filter((one) => one.name === metric)
      .map((one) => ({ label: one.labels?.[by] ?? "", times_s: told.times_s, values: one.values }));
  const series = new Map(charts.map((chart) => [chart.metric, curvesOf(chart)]));
  return { end_s: told.end_s, series, missing: told.missing ?? {} };
}
