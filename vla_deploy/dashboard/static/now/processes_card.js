/** Show which processes run, and say of one that does not: which, and why. */

import { percent, words } from "../format.js";
import { useTopic } from "../following.js";
import { Badge, Card, Empty } from "../parts.js";
import { html } from "../ui.js";

const TONES = { ready: "ok", off: "quiet", starting: "info", waiting: "info", "given up": "bad", "back-off": "bad", aborting: "bad" };

export function ProcessesCard() {
  const { data, stale, age_s } = useTopic("process_table");
  const rows = data?.processes ?? [];
  const ready = rows.filter((row) => row.state === "ready").length;
  return html`
    <${Card} title="Processes" note=${data && `${ready} of ${rows.length} ready`} stale=${stale} age_s=${age_s}>
      ${data ? html`<ul class="processes">${rows.map((row) => html`<${Row} key=${row.name} row=${row} />`)}</ul>` : html`<${Empty}>The supervisor is silent.<//>`}
    <//>
  `;
}

function Row({ row }) {
  const says = [row.reason, ...row.alarms].filter(Boolean);
  return html`
    <li>
      <span class="process-name">${words(row.name)}</span>
      <${Badge} tone=${row.alarms.length ? "warn" : (TONES[row.state] ?? "quiet")}>${row.state}<//>
      ${row.restarts > 0 && html`<span class="quiet small">restarted ${row.restarts}×</span>`}
      <span class="grow"></span>
      <span class="quiet small">${row.cpu_ratio === null ? "" : percent(row.cpu_ratio)}</span>
      ${says.map((line) => html`<p class="process-why small">${line}</p>`)}
    </li>
  `;
}
