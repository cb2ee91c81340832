/** One chart with its legend, which is also its text: newest values, limits, what is missing. */

import { useColours } from "../colours.js";
import { clock } from "../format.js";
import { Card, Empty } from "../parts.js";
import { html, useEffect, useMemo, useRef, useState } from "../ui.js";
import { makeChart, written } from "./chart.js";
import { limitOf, missingReason, perSecond } from "./charts.js";

const COLOURS = {
  muted: "--text-2",
  line: "--line",
  limit: "--bad",
  ...Object.fromEntries([1, 2, 3, 4, 5, 6, 7, 8].map((at) => [`series${at}`, `--series-${at}`])),
};
const SERIES = 8;

/** Show a chart; `history`, `budget` and `board` are null until they have come. */
export function ChartCard({ chart, span_s, history, budget, board }) {
  const [only, showOnly] = useState(null);
  const [pointed, point] = useState(null);
  const curves = useMemo(() => curvesOf(chart, history), [chart, history]);
  const known = curves.some((curve) => curve.values.some((value) => value !== null));
  const reason = missingReason(chart, board);
  return html`
    <${Card} title=${chart.title} note=${pointed ? clock(pointed.time_s) : ""}>
      ${known
        ? html`
            <${Plot} chart=${chart} curves=${shown(curves, only)} span_s=${span_s} end_s=${history.end_s} budget=${budget} point=${point} />
            <${Legend} chart=${chart} curves=${curves} only=${only} showOnly=${showOnly} pointed=${pointed} budget=${budget} />
          `
        : html`<${Empty} icon="question">${emptyWords(history, reason)}<//>`}
      ${known && reason && html`<p class="small quiet">Missing now: ${reason}</p>`}
    <//>
  `;
}

function Plot({ chart, curves, span_s, end_s, budget, point }) {
  const place = useRef(null);
  const plot = useRef(null);
  const colours = useColours(COLOURS);
  const limits = curves.map((curve) => (curves.length === 1 ? limitOf(chart, curve.label, budget) : undefined));
  const made = JSON.stringify([curves.map((curve) => [curve.label, curve.colour]), limits]);
  useEffect(() => {
    const drawn = curves.map((curve, at) => ({ name: curve.label, colour: colours[`series${curve.colour}`], limit: limits[at] }));
    plot.current = makeChart(place.current, { unit: chart.unit, digits: chart.digits, curves: drawn, colours, describe: point });
    const resized = new ResizeObserver(() => plot.current?.resize());
    resized.observe(place.current);
    return () => {
      resized.disconnect();
      plot.current.destroy();
      plot.current = null;
    };
  }, [chart, colours, made]);
  useEffect(() => {
    const times_s = curves[0]?.times_s ?? [];
    plot.current.show(times_s, curves.map((curve) => curve.values), [end_s - span_s, end_s]);
  }, [curves, span_s, end_s, colours, made]);
  return html`<div ref=${place} class="chart-place" aria-hidden="true"></div>`;
}

function Legend({ chart, curves, only, showOnly, pointed, budget }) {
  const visible = shown(curves, only);
  return html`
    <ul class="chart-legend" aria-label=${`${chart.title}: newest values`}>
      ${curves.map((curve) => {
        const at = visible.indexOf(curve);
        const value = pointed && at >= 0 ? pointed.values[at] : written(newest(curve.values), chart.unit, chart.digits);
        const limit = limitOf(chart, curve.label, budget);
        const words = html`
          <span class="key" data-series=${curve.colour} aria-hidden="true"></span>${curve.label}
          <b>${value}</b>${limit !== undefined && html`<span class="quiet">of ${written(limit, chart.unit, 0)}</span>`}
        `;
        if (curves.length === 1) return html`<li key=${curve.label}>${words}</li>`;
        return html`
          <li key=${curve.label}>
            <button type="button" class="curve" aria-pressed=${only === curve.label ? "true" : "false"} data-faint=${at < 0 ? "yes" : null} title="Show this one alone, with its limit" onClick=${() => showOnly(only === curve.label ? null : curve.label)}>
              ${words}
            </button>
          </li>
        `;
      })}
    </ul>
  `;
}

function curvesOf(chart, history) {
  const told = history?.series.get(chart.metric) ?? [];
  return told.map(({ label, times_s, values }, at) => {
    const plain = chart.rate ? perSecond(times_s, values) : values;
    const scaled = chart.scale ? plain.map((value) => (value === null ? null : value * chart.scale)) : plain;
    return { label, times_s, values: scaled, colour: (at % SERIES) + 1 };
  });
}

function shown(curves, only) {
  const chosen = curves.filter((curve) => curve.label === only);
  return chosen.length ? chosen : curves;
}

function newest(values) {
  return values.at(-1) ?? null;
}

function emptyWords(history, reason) {
  if (reason) return `Missing: ${reason}`;
  return history ? "Missing: nothing was kept of it in this span." : "Asking for what was kept …";
}
