/** How far a change of profile is, and how the last one ended. */

import { useConnection } from "../following.js";
import { duration } from "../format.js";
import { Badge, Card, Notice } from "../parts.js";
import { html } from "../ui.js";
import { OUTCOMES, PHASES, reached } from "./phases.js";

/** Show the change under way, else how the last one ended; nothing where there was none. */
export function ProgressCard({ current, request }) {
  useConnection();
  const last = current?.last?.outcome ? current.last : null;
  const waits = request && last?.request_id !== request.request_id && !current?.phase;
  if (!current?.phase && !last && !waits) return null;
  return html`
    <${Card} title="Change of profile">
      <div role="status" aria-live="polite">
        ${current?.phase
          ? html`<${Phases} current=${current} />`
          : waits
            ? html`<p>Asked the supervisor for ${request.name} …</p>`
            : html`<${Ending} last=${last} />`}
      </div>
    <//>
  `;
}

function Phases({ current }) {
  return html`
    <p>To <strong>${current.target}</strong></p>
    <ol class="phases">
      ${PHASES.map(({ name, words }) => {
        const where = reached(name, current.phase);
        return html`<li key=${name} data-where=${where} aria-current=${where === "now" ? "step" : null}>${words}</li>`;
      })}
    </ol>
  `;
}

function Ending({ last }) {
  const { tone, icon, words } = OUTCOMES[last.outcome] ?? { tone: "info", icon: "question", words: last.outcome };
  return html`
    <${Notice} tone=${tone} icon=${icon}>
      <p><strong>${last.profile}</strong> <${Badge} tone=${tone}>${words}<//>${last.took_s ? html` <span class="quiet small">in ${duration(last.took_s)}</span>` : null}</p>
      ${last.reason && html`<p class="small">${last.reason}</p>`}
    <//>
  `;
}
