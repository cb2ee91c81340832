/** What another profile would change, and the switch to it. */

import { post } from "../api.js";
import { useAct, useAnswer } from "../asking.js";
import { confirmed } from "../dialog.js";
import { Button, Card, Empty, Failure, Notice } from "../parts.js";
import { html, useState } from "../ui.js";
import { partsOf } from "./difference.js";

const MARKS = { more: "↑", less: "↓", changed: "" };
const KIND_WORDS = { more: "more than now", less: "less than now", changed: "changed" };

/** Show the difference to the wanted profile; `onAsked` gets the id of a request. */
export function DifferenceCard({ wanted, current, onAsked }) {
  if (!wanted) {
    return html`<${Card} title="What would change"><${Empty} icon="sliders">Choose a profile to see what it would change. Nothing is changed by looking.<//><//>`;
  }
  return html`<${Difference} key=${`${wanted} ${current?.profile}`} wanted=${wanted} current=${current} onAsked=${onAsked} />`;
}

function Difference({ wanted, current, onAsked }) {
  const { data, error } = useAnswer(`profile/${encodeURIComponent(wanted)}/difference`);
  const parts = data ? partsOf(data.keys) : [];
  const count = parts.reduce((sum, part) => sum + part.rows.length, 0);
  const note = data ? `${count} values differ from ${data.current}` : "";
  return html`
    <${Card} title=${`What ${wanted} would change`} note=${note}>
      ${error && html`<${Failure} error=${error} />`}
      ${data && count === 0 && html`<${Empty} icon="check">Nothing: ${wanted} is in force.<//>`}
      ${count > 0 && html`<${Table} parts=${parts} data=${data} />`}
      ${data && html`<${Acts} wanted=${wanted} count=${count} current=${current} onAsked=${onAsked} />`}
    <//>
  `;
}

function Table({ parts, data }) {
  return html`
    <div class="scroll-x" tabindex="0" role="region" aria-label="Differences, scrollable">
      <table class="difference">
        <thead>
          <tr>
            <th scope="col">Setting</th>
            <th scope="col">${data.current}</th>
            <th scope="col" aria-hidden="true"></th>
            <th scope="col">${data.name}</th>
          </tr>
        </thead>
        ${parts.map(
          ({ part, rows }) => html`
            <tbody key=${part}>
              <tr class="part"><th scope="rowgroup" colspan="4">${part}</th></tr>
              ${rows.map(
                (row) => html`
                  <tr key=${row.key}>
                    <th scope="row"><code>${row.key}</code></th>
                    <td class="old">${row.old}</td>
                    <td aria-hidden="true" class="arrow">→</td>
                    <td class="wanted">${row.wanted} <span class="quiet" title=${KIND_WORDS[row.kind]}>${MARKS[row.kind]}</span></td>
                  </tr>
                `,
              )}
            </tbody>
          `,
        )}
      </table>
    </div>
  `;
}

function Acts({ wanted, count, current, onAsked }) {
  const [may_restart, permit] = useState(false);
  const [act, busy] = useAct(async (dry_run) => {
    if (!dry_run && !(await agreed(wanted, count, may_restart))) return;
    const { request_id } = await post("profile", { name: wanted, may_restart, dry_run });
    onAsked({ request_id, name: wanted, dry_run });
  });
  const changing = Boolean(current?.phase);
  return html`
    ${changing && html`<${Notice} tone="info" icon="clock">A change to ${current.target} is under way.<//>`}
    <div class="row acts">
      <label class="switch">
        <input type="checkbox" checked=${may_restart} onChange=${(event) => permit(event.target.checked)} />
        Processes may be restarted where they cannot change while they run
      </label>
      <${Button} needs="admin" busy=${busy} disabled=${changing} onClick=${() => act(true)}>Try without changing<//>
      <${Button} kind="main" needs="admin" busy=${busy} disabled=${changing || count === 0} onClick=${() => act(false)}>Switch to it<//>
    </div>
  `;
}

function agreed(wanted, count, may_restart) {
  const text = html`
    <p>${count} settings change while the robot runs${may_restart ? ", and processes may be restarted for it" : ""}.</p>
    <p class="quiet">When a process cannot take it over, all of them go back to what is in force now. Every later start takes the new profile.</p>
  `;
  return confirmed({ title: `Switch to ${wanted}?`, text, act: "Switch" });
}
