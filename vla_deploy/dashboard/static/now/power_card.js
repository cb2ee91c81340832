/** Show supply, power and heat, as far as they are known; what is not known says why. */

import { number, percent, words } from "../format.js";
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
        <${Battery} />
        <${Supply} joints=${joints} />
        ${rows.map((row) => html`<${Load} key=${row.metric} row=${row} />`)}
      </div>
      ${data?.hint && html`<p class="quiet small">${data.hint}</p>`}
    <//>
  `;
}

function Battery() {
  const { data, stale } = useTopic("battery");
  if (!data) return null;
  if (stale) return html`<${Reading} name="Battery" value="unknown" note="nothing measures it now" tone="warn" />`;
  const tone = data.critical ? "bad" : data.low ? "warn" : undefined;
  const note = [
    data.is_charging && "charging",
    data.is_estimate && "estimated",
    Number.isFinite(data.voltage_v) && `${number(data.voltage_v, 1)} V`,
    Number.isFinite(data.current_a) && `${number(data.current_a, 1)} A`,
    data.charge_ratio === null && data.missing.charge_ratio,
  ].filter(Boolean);
  return html`
    <${Reading} name="Battery" value=${data.charge_ratio === null ? "unknown" : percent(data.charge_ratio)} note=${note.join(", ")} tone=${tone}>
      ${data.charge_ratio !== null && html`<${Bar} name="Battery" ratio=${data.charge_ratio} tone=${tone} />`}
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
