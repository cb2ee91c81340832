/** Draw a plan as a line of actions, each with how it went. */

import { duration } from "../format.js";
import { Icon } from "../icons.js";
import { html } from "../ui.js";
import { actionWords, dataWords, statusWords } from "./words.js";

const SIGNS = {
  pending: ["quiet", "clock"],
  active: ["info", "play"],
  succeeded: ["ok", "check"],
  cancelled: ["quiet", "cross"],
  aborted: ["bad", "cross"],
  rejected: ["bad", "cross"],
  lost: ["bad", "question"],
};

/** Return the tone of a step that stands so. */
export function toneOf(status) {
  return (SIGNS[status] ?? SIGNS.pending)[0];
}

/** One step with its sign, whose colour says nothing that its words do not. */
export function StepSign({ status, children }) {
  const [tone, icon] = SIGNS[status] ?? SIGNS.pending;
  return html`
    <li class="step" data-tone=${tone} data-status=${status} aria-current=${status === "active" ? "step" : null}>
      <span class="step-sign"><${Icon} name=${icon} /></span>
      <div class="step-body">${children}</div>
    </li>
  `;
}

/** The actions of a story, in the order of the plan. */
export function Timeline({ actions }) {
  if (!actions.length) return null;
  return html`
    <ol class="timeline" aria-label="Plan">
      ${actions.map((action) => html`<${Step} key=${action.id} action=${action} />`)}
    </ol>
  `;
}

function Step({ action }) {
  const data = dataWords(action.data);
  return html`
    <${StepSign} status=${action.status}>
      <p class="step-head">
        <span class="step-words">${actionWords(action)}</span>
        <span class="step-status">${statusWords(action.status)}</span>
        ${action.retries > 0 && html`<span class="badge" data-tone="warn">${retries(action.retries)}</span>`}
        ${action.execution_time_s > 0 && html`<span class="step-time quiet">${duration(action.execution_time_s)}</span>`}
      </p>
      ${action.error && html`<p class="step-why">${action.error}</p>`}
      ${action.note && html`<p class="quiet small">${action.note}</p>`}
      ${data && html`<p class="quiet small">${data}</p>`}
      ${earlier(action).length > 1 && html`<p class="quiet small">after ${earlier(action).join(", ")}</p>`}
    <//>
  `;
}

function earlier(action) {
  return [...(action.depends_on ?? []), ...(action.after ?? [])];
}

function retries(count) {
  return count === 1 ? "1 retry" : `${count} retries`;
}
