/** One chart with its legend, which is also its text: newest values, limits, what is missing. */

import { useColours } from "../colours.js";
import { clock, significant } from "../format.js";
import { Card } from "../parts.js";
import { html, useEffect, useRef, useState } from "../ui.js";
import { makeChart, written } from "./chart.js";
import { limitOf, missingReason } from "./charts.js";

const COLOURS = {
  muted: "--text-2",
  line: "--line",
  limit: "--bad",
  ...Object.fromEntries([1, 2, 3, 4, 5, 6, 7, 8].map((at) => [`series${at}`, `--series-${at}`])),
};

/** Show a chart of `curves`, which `curvesOf` gives; what has none is told by `MissingCard`. */
export function ChartCard({ chart, curves, span_s, end_s, budget, board }) {
  const [only, showOnly] = useState(null);
  const [pointed, point] = useState(null);
  const reason = missingReason(chart, board);
  return html`
    <${Card} title=${chart.title} note=${pointed ? clock(pointed.time_s) : ""}>
      <${Plot} chart=${chart} curves=${shown(curves, only)} span_s=${span_s} end_s=${end_s} budget=${budget} point=${point} />
      <${Legend} chart=${chart} curves=${curves} only=${only} showOnly=${showOnly} pointed=${pointed} budget=${budget} />
      ${reason && html`<p class="small quiet">Now missing, ${reason}</p>`}
    <//>
  `;
}

/** List what this computer does not measure, each with the reason. */
export function MissingCard({ charts, board, history }) {
  return html`
    <${Card} title="Not measured" note="missing is never shown as zero">
      <dl class="missing">
        ${charts.map((chart) => html`<dt>${chart.title}</dt><dd>${missingReason(chart, board, history) || "nothing was kept of it in this span"}</dd>`)}
      </dl>
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
          <b>${value}</b>${limit !== undefined && html`<span class="quiet">of ${significant(limit)} ${chart.unit}</span>`}
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

function shown(curves, only) {
  const chosen = curves.filter((curve) => curve.label === only);
  return chosen.length ? chosen : curves;
}

function newest(values) {
  return values.at(-1) ?? null;
}
