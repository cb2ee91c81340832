/** The buses to servos and wheels: how quick they answer, and what went wrong on them. */

import { useSampled } from "../sampled.js";
import { words } from "../format.js";
import { Badge, Card, Empty, Notice } from "../parts.js";
import { html } from "../ui.js";

const PERIOD_MS = 1000;

// Counters that grow in good health; every other one counts something that went wrong.
const TRAFFIC = new Set(["cycles", "sent", "received", "returns", "stuffed"]);
const BUDGET_TONES = { ok: "ok", degraded: "warn", lost: "bad" };

/** Show a part for each bus of `control_status`. */
export function BusCard() {
  const { data, stale, age_s } = useSampled("control_status", PERIOD_MS);
  const buses = Object.entries(data?.buses ?? {});
  return html`
    <${Card} title="Buses" stale=${stale} age_s=${age_s} note="counted since control started">
      ${buses.length === 0 && html`<${Empty} icon="plug">Control has told of no bus yet.<//>`}
      ${buses.map(([name, bus]) => html`<${Bus} key=${name} name=${name} bus=${bus} />`)}
    <//>
  `;
}

function Bus({ name, bus }) {
  const numbers = Object.entries(bus).filter(([, value]) => typeof value === "number");
  const { bus: standing, degraded = [], lost = [] } = bus.budget ?? {};
  return html`
    <section class="bus">
      <h3>
        ${words(name)}
        ${standing && html`<${Badge} tone=${BUDGET_TONES[standing] ?? "quiet"}>${standing}<//>`}
      </h3>
      ${bus.latency && html`<${Latency} latency=${bus.latency} />`}
      ${lost.length > 0 && html`<${Notice} tone="bad" icon="plug">lost: ${lost.map(words).join(", ")}<//>`}
      ${degraded.length > 0 && html`<p class="small quiet">${told(degraded)} answered late or not at all of late.</p>`}
      ${(bus.faults ?? []).map((fault) => html`<${Notice} tone="warn" icon="alert">${typeof fault === "string" ? fault : JSON.stringify(fault)}<//>`)}
      <dl class="counters">
        ${numbers.map(
          ([key, value]) => html`
            <div key=${key} data-tone=${value > 0 && !TRAFFIC.has(key) ? "warn" : null}>
              <dt>${words(key)}</dt>
              <dd>${value.toLocaleString("en-GB")}</dd>
            </div>
          `,
        )}
      </dl>
    </section>
  `;
}

function Latency({ latency }) {
  const shown = [
    ["half within", latency.p50_s],
    ["99 % within", latency.p99_s],
    ["slowest", latency.max_s],
  ];
  return html`
    <dl class="counters" aria-label="Answer times">
      ${shown.map(([name, value]) => html`<div><dt>${name}</dt><dd>${milliseconds(value)}</dd></div>`)}
    </dl>
  `;
}

function milliseconds(seconds) {
  return Number.isFinite(seconds) ? `${(1000 * seconds).toFixed(2)} ms` : "–";
}

function told(names) {
  return names.length > 4 ? `${names.length} servos` : names.map(words).join(", ");
}
