/** How often each topic comes and how old its newest value is, against what is declared. */

import { duration, number, words } from "../format.js";
import { Badge, Card, Empty } from "../parts.js";
import { useSampled } from "../sampled.js";
import { html, useState } from "../ui.js";
import { rowsOf, standingOf } from "./topic_rows.js";

/** Show every topic; those in trouble first. */
export function TopicsCard() {
  const [all, showAll] = useState(true);
  const { data, stale, age_s } = useSampled("topics", 1000);
  const rows = data ? rowsOf(data) : [];
  const shown = all ? rows : rows.filter((row) => standingOf(row).tone !== "ok");
  const late = rows.filter((row) => standingOf(row).tone === "bad").length;
  const action = html`
    <label class="switch"><input type="checkbox" checked=${!all} onChange=${(event) => showAll(!event.target.checked)} />Only what is not in time</label>
  `;
  const note = rows.length ? `${rows.length} topics, ${late ? `${late} late` : "none late"}` : "";
  return html`
    <${Card} title="Topics" span="all" stale=${stale} age_s=${age_s} note=${note} actions=${action}>
      ${rows.length === 0 ? html`<${Empty} icon="clock">No rates have been measured yet.<//>` : html`<${Table} rows=${shown} />`}
    <//>
  `;
}

function Table({ rows }) {
  return html`
    <div class="scroll-x" tabindex="0" role="region" aria-label="Topics, scrollable">
      <table class="topics">
        <thead>
          <tr>
            <th scope="col">Topic</th>
            <th scope="col">Written by</th>
            <th scope="col" class="numeric">Rate</th>
            <th scope="col" class="numeric">Declared</th>
            <th scope="col" class="numeric">Age</th>
            <th scope="col" class="numeric">Deadline</th>
            <th scope="col" class="numeric">Lost</th>
            <th scope="col">Stands</th>
          </tr>
        </thead>
        <tbody>${rows.map((row) => html`<${Row} key=${row.topic} row=${row} />`)}</tbody>
      </table>
    </div>
  `;
}

function Row({ row }) {
  const standing = standingOf(row);
  return html`
    <tr>
      <th scope="row">${words(row.topic)}</th>
      <td class="quiet">${row.owner ?? "–"}</td>
      <td class="numeric">${row.rate_hz === null ? html`<span class="quiet">–</span>` : `${number(row.rate_hz, 1)} Hz`}</td>
      <td class="numeric quiet">${row.declared_hz ? `${row.declared_hz} Hz` : "on change"}</td>
      <td class="numeric">${row.age_s === null ? html`<span class="quiet">never</span>` : duration(row.age_s)}</td>
      <td class="numeric quiet">${row.deadline_s ? duration(row.deadline_s) : "none"}</td>
      <td class="numeric">${row.lost ?? 0}</td>
      <td><${Badge} tone=${standing.tone}>${standing.words}<//></td>
    </tr>
  `;
}
