/** Show one command: its words, what was asked, its plan, and why it was refused. */

import { post } from "../api.js";
import { useAct } from "../asking.js";
import { clock, percent, sentence } from "../format.js";
import { Objectives } from "../missions/objectives.js";
import { Badge, Button, Card, Notice } from "../parts.js";
import { html } from "../ui.js";
import { PauseAct, standingOf, usePaused } from "./pause.js";
import { Question } from "./question.js";
import { OPEN_STATES } from "./story.js";
import { Timeline } from "./timeline.js";
import { sourceWords } from "./words.js";

/** The card of a command that is under way, or of one chosen from the history. */
export function CommandCard({ command, title }) {
  const { story } = command;
  const { text, tone, icon } = standingOf(story, usePaused());
  const [cancel, isBusy] = useAct(() => post(`commands/${encodeURIComponent(command.command_id)}/cancel`));
  const actions = html`
    <${PauseAct} />
    <${Button} needs="operator" kind="danger" icon="cross" busy=${isBusy} onClick=${cancel}>Cancel<//>
  `;
  return html`
    <${Card}
      title=${title}
      label=${html`<${Badge} tone=${tone} icon=${icon}>${text}<//>`}
      actions=${OPEN_STATES.includes(story.state) && actions}
    >
      <div class="stack">
        <p class="said-words">${command.text || story.plan?.goal || "A plan as JSON"}</p>
        <p class="quiet small"><${Origin} command=${command} /></p>
        ${story.asked && html`<${Question} asked=${story.asked} />`}
        <${Reason} story=${story} />
        ${story.plan?.summary && html`<p class="quiet">${story.plan.summary}</p>`}
        <${Notes} notes=${story.plan?.notes} />
        ${story.objectives.length > 0 && html`<${Objectives} rows=${story.objectives} />`}
        <${Timeline} actions=${story.actions} />
        <${Summary} summary=${story.summary} />
        ${story.said.map((words) => html`<p class="robot-says">“${words}”</p>`)}
        <${Attempts} story=${story} />
      </div>
    <//>
  `;
}

function Origin({ command }) {
  const { story, source, given_s, heard } = command;
  const parts = [
    `by ${sourceWords(source)}`,
    given_s && `at ${clock(given_s)}`,
    heard && `heard with ${percent(heard.confidence)}`,
    story.rung && story.rung !== "given" && `planned by ${story.rung}${story.origin ? ` (${story.origin})` : ""}`,
    story.confidence !== undefined && story.confidence < 1 && `${percent(story.confidence)} sure`,
  ];
  return parts.filter(Boolean).join(" · ");
}

/** Say in plain words why nothing was done, or why it ended early. */
function Reason({ story }) {
  if (!story.why || story.state === "done") return null;
  const isRefused = story.state === "refused";
  return html`
    <${Notice} tone=${story.state === "cancelled" ? "quiet" : "bad"} icon="alert">
      <p><strong>${isRefused ? "Refused: nothing was done." : "It ended early."}</strong></p>
      <p>${sentence(story.why)}</p>
    <//>
  `;
}

/** Say what of a plan is not used as its author wrote it. */
function Notes({ notes }) {
  if (!notes?.length) return null;
  return html`
    <details class="attempts">
      <summary>${notes.length === 1 ? "1 note on the plan" : `${notes.length} notes on the plan`}</summary>
      <ul class="notes small">${notes.map((one) => html`<li key=${one}>${one}</li>`)}</ul>
    </details>
  `;
}

/** Count the actions of a command that has ended, those of plans that failed among them. */
function Summary({ summary }) {
  if (!summary || summary.total_actions < 2) return null;
  const { total_actions, successful_actions, failed_actions } = summary;
  const failed = failed_actions ? `, ${failed_actions} failed` : "";
  return html`<p class="quiet small">${successful_actions} of ${total_actions} actions done${failed}</p>`;
}

/** Tell which ways of planning were tried, for whoever asks. */
function Attempts({ story }) {
  if (!story.attempts?.length) return null;
  return html`
    <details class="attempts">
      <summary>How it was planned</summary>
      <table>
        <thead><tr><th>Way</th><th>Outcome</th><th class="numeric">Took</th></tr></thead>
        <tbody>
          ${story.attempts.map(
            (one) => html`
              <tr>
                <td>${one.rung}</td>
                <td>${one.outcome}${one.reason && html`<span class="quiet">: ${one.reason}</span>`}</td>
                <td class="numeric">${Math.round(1000 * one.took_s)} ms</td>
              </tr>
            `,
          )}
        </tbody>
      </table>
    </details>
  `;
}
