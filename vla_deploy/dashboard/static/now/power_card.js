/** Show supply, power and heat, as far as they are known; what is not known says why. */

import { number, words } from "../format.js";
import { useTopic } from "../following.js";
import { Bar, Card, Empty, More } from "../parts.js";
import { html } from "../ui.js";

const SHOWN = ["cpu_ratio", "memory_mb", "gpu_memory_mb", "power_w", "temperature_c", "disk_free_mb"];
const NAMES = {
  cpu_ratio: ["CPU", "%", 100],
  memory_mb: ["Memory", "GB", 0.001],
  gpu_memory_mb: ["GPU memory", "GB", 0.001],
  power_w: ["Power", "W", 1],
  temperature_c: ["Temperature", "°C", 1],
  disk_free_mb: ["Free disk", "GB", 0.001],
};

export function PowerCard() {
  const { data, stale, age_s } = useTopic("budget");
  const joints = useTopic("control_status").data?.joints;
  const rows = (data?.rows ?? []).filter((row) => !row.process && SHOWN.includes(row.metric));
  return html`
    <${Card} title="Power and load" stale=${stale} age_s=${age_s} actions=${html`<${More} href="#/budgets">Budgets<//>`}>
      ${rows.length === 0 && html`<${Empty}>The supervisor tells nothing yet.<//>`}
      <div class="loads">
        <${Supply} joints=${joints} />
        ${rows.map((row) => html`<${Load} key=${row.metric} row=${row} />`)}
      </div>
      ${data?.hint && html`<p class="quiet small">${data.hint}</p>`}
    <//>
  `;
}

function Supply({ joints }) {
  const volts = (joints?.voltage_v ?? []).filter(Number.isFinite);
  const heat = (joints?.temperature_c ?? []).filter(Number.isFinite);
  if (!volts.length && !heat.length) return null;
  return html`
    ${volts.length > 0 && html`<${Reading} name="Servo supply" value="${number(Math.min(...volts), 1)} V" />`}
    ${heat.length > 0 && html`<${Reading} name="Hottest servo" value="${number(Math.max(...heat), 0)} °C" />`}
  `;
}

function Load({ row }) {
  const [name, unit, factor] = NAMES[row.metric];
  if (row.measured === null) return html`<${Reading} name=${name} value="unknown" note=${row.reason} />`;
  const shown = (value) => number(factor * value, factor * value < 10 && unit !== "%" ? 1 : 0);
  const bound = row.at_least ? "at least" : "of";
  const tone = row.over ? "bad" : row.state === "ok" ? undefined : "warn";
  return html`
    <${Reading} name=${name} value="${shown(row.measured)} ${unit}" note="${bound} ${shown(row.limit)} ${unit}" tone=${tone}>
      ${!row.at_least && html`<${Bar} name=${name} ratio=${row.measured / row.limit} tone=${tone} />`}
    <//>
  `;
}

function Reading({ name, value, note, tone, children }) {
  return html`
    <div class="load" data-tone=${tone}>
      <span class="load-name">${words(name)}</span>
      <span class="load-value">${value}</span>
      ${note && html`<span class="quiet small load-note">${note}</span>`}
      ${children}
    </div>
  `;
}
