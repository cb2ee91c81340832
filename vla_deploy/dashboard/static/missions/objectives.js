/** List the objectives of a mission, or what is known of them, each with how it went. */

import { StepSign, Timeline, toneOf } from "../command/timeline.js";
import { duration } from "../format.js";
import { html } from "../ui.js";
import { PART_STATES } from "./states.js";

/** `rows` are `{name, words, state, error, note, begin_s, end_s, parts}`; `actionsOf(name)` those of a subtask. */
export function Objectives({ rows, actionsOf }) {
  return html`
    <ol class="timeline" aria-label="Objectives">
      ${rows.map((row) => html`<${Row} key=${row.name} row=${row} actionsOf=${actionsOf} />`)}
    </ol>
  `;
}

function Row({ row, actionsOf }) {
  const [status, words] = PART_STATES[row.state] ?? PART_STATES.pending;
  const parts = row.parts ?? [];
  return html`
    <${StepSign} status=${status}>
      <${Head} row=${row} words=${words} />
      ${parts.length > 1
        ? parts.map((part) => html`<${Subtask} key=${part.name} part=${part} actionsOf=${actionsOf} />`)
        : html`<${Actions} status=${status} actions=${actionsOf?.(parts[0]?.name ?? row.name)} />`}
    <//>
  `;
}

function Subtask({ part, actionsOf }) {
  const [status, words] = PART_STATES[part.state] ?? PART_STATES.pending;
  return html`
    <div class="subtask" data-tone=${toneOf(status)} data-status=${status}>
      <${Head} row=${part} words=${words} />
      <${Actions} status=${status} actions=${actionsOf?.(part.name)} />
    </div>
  `;
}

function Head({ row, words }) {
  const took_s = row.begin_s && row.end_s ? row.end_s - row.begin_s : 0;
  return html`
    <p class="step-head">
      <span class="step-words">${row.words}</span>
      <span class="step-status">${words}</span>
      ${took_s > 0 && html`<span class="step-time quiet">${duration(took_s)}</span>`}
    </p>
    ${row.error && html`<p class=${row.state === "failed" ? "step-why" : "quiet small"}>${row.error}</p>`}
    ${row.note && html`<p class="quiet small">${row.note}</p>`}
  `;
}

/** The actions of what goes on; those of what has ended are out of the way until they are asked for. */
function Actions({ status, actions }) {
  if (!actions?.length) return null;
  if (status === "active") return html`<${Timeline} actions=${actions} />`;
  return html`
    <details class="attempts">
      <summary>${actions.length === 1 ? "1 action" : `${actions.length} actions`}</summary>
      <${Timeline} actions=${actions} />
    </details>
  `;
}
