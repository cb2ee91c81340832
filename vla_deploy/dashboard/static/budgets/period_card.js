/** How steady control's ticks are: a histogram of the time between them. */

import { useColours } from "../colours.js";
import { useEasel } from "../easel.js";
import { Card, Choice, Empty } from "../parts.js";
import { useSampled } from "../sampled.js";
import { html, useEffect, useRef, useState } from "../ui.js";
import { drawBars } from "./histogram.js";
import { barsOf, rangeWords, since, summaryOf } from "./periods.js";

const COLOURS = { bar: "--accent", late: "--bad", text: "--text-2", line: "--line" };
const SPANS = [
  [10, "10 s"],
  [60, "1 min"],
  [0, "since start"],
];
const PERIOD_MS = 1000;

/** Show the histogram over the last seconds, or since control started. */
export function PeriodCard() {
  const [span_s, setSpan] = useState(60);
  const { data, stale, age_s } = useSampled("control_status", PERIOD_MS);
  const before = useBefore(data?.period_ratio, span_s);
  const period_s = data?.nominal_period_s ?? data?.period_s;
  const bars = data?.period_ratio ? barsOf(since(data.period_ratio, before)) : null;
  const choice = html`<${Choice} name="Span of the histogram" choices=${SPANS} value=${span_s} onChange=${setSpan} />`;
  const note = period_s ? `wanted: ${(1000 * period_s).toFixed(2)} ms` : "";
  return html`
    <${Card} title="Control period" stale=${stale} age_s=${age_s} note=${note} actions=${choice}>
      ${bars ? html`<${Histogram} bars=${bars} period_s=${period_s} />` : html`<${Empty} icon="clock">Control has told no periods yet.<//>`}
    <//>
  `;
}

function Histogram({ bars, period_s }) {
  const colours = useColours(COLOURS);
  const [canvas, request] = useEasel((context, size) => drawBars(context, size, bars, period_s, colours), 5);
  useEffect(request);
  return html`
    <canvas ref=${canvas} class="histogram" role="img" aria-label="Histogram of the time between ticks"></canvas>
    <p class="small">${summaryOf(bars)} <span class="quiet">Counts are drawn on a logarithmic scale.</span></p>
    <details>
      <summary>As a table</summary>
      <table>
        <thead><tr><th scope="col">Time between ticks</th><th scope="col" class="numeric">Ticks</th></tr></thead>
        <tbody>
          ${bars.map(
            (bar) => html`
              <tr key=${bar.from}><th scope="row">${rangeWords(bar, period_s)}</th><td class="numeric">${bar.count.toLocaleString("en-GB")}</td></tr>
            `,
          )}
        </tbody>
      </table>
    </details>
  `;
}

/** Return what was counted `span_s` ago, kept here since nobody else does; null for all of it. */
function useBefore(told, span_s) {
  const kept = useRef([]);
  if (!told) return null;
  const now_ms = performance.now();
  const newest = kept.current.at(-1);
  if (!newest || now_ms - newest.at_ms >= PERIOD_MS) kept.current.push({ at_ms: now_ms, told });
  const longest_ms = 1000 * Math.max(...SPANS.map(([seconds]) => seconds));
  while (kept.current.length > 1 && now_ms - kept.current[1].at_ms >= longest_ms) kept.current.shift();
  if (span_s === 0) return null;
  return kept.current.findLast((one) => now_ms - one.at_ms >= 1000 * span_s)?.told ?? kept.current[0].told;
}
