/** Show who did what, and when: for admins. */

import { useAnswer } from "../asking.js";
import { clock, words } from "../format.js";
import { Badge, Card, Empty, Failure } from "../parts.js";
import { html } from "../ui.js";

const LOOK_MS = 5_000;

export function AuditPanel() {
  const { data, error } = useAnswer("audit", LOOK_MS);
  const entries = data?.entries ?? [];
  return html`
    <${Card} title="Audit" note="every act, the newest first">
      ${error && html`<${Failure} error=${error} />`}
      ${data && entries.length === 0 && html`<${Empty}>No act yet.<//>`}
      ${entries.length > 0 && html`<${Entries} entries=${entries} />`}
    <//>
  `;
}

function Entries({ entries }) {
  return html`
    <div class="scroll-x" tabindex="0" role="region" aria-label="Audit entries">
      <table>
        <thead><tr><th>When</th><th>Who</th><th>From</th><th>Act</th><th>Outcome</th></tr></thead>
        <tbody>${entries.map((entry) => html`<${Entry} key=${`${entry.time}${entry.act}`} entry=${entry} />`)}</tbody>
      </table>
    </div>
  `;
}

function Entry({ entry }) {
  const details = Object.entries(entry.details ?? {}).map(([name, value]) => `${words(name)} ${value}`);
  return html`
    <tr>
      <td>${clock(Date.parse(entry.time) / 1000)}</td>
      <td>${entry.user} <span class="quiet">${entry.role}</span></td>
      <td class="mono">${entry.address}</td>
      <td>${words(entry.act)} <span class="quiet">${details.join(", ")}</span></td>
      <td>
        <${Badge} tone=${entry.outcome === "done" ? "ok" : "bad"}>${entry.outcome}<//>
        ${entry.code && html`<span class="quiet"> ${words(entry.code)}</span>`}
        ${entry.repeated && html`<span class="quiet"> and ${entry.repeated} more</span>`}
      </td>
    </tr>
  `;
}
