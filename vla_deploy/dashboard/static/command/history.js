/** List the commands of this run, the newest first. */

import { clock } from "../format.js";
import { Icon } from "../icons.js";
import { Badge, Card, Empty } from "../parts.js";
import { html } from "../ui.js";
import { standingOf, usePaused } from "./pause.js";
import { sourceWords } from "./words.js";

export function History({ commands, chosen, onChoose }) {
  const isPaused = usePaused();
  return html`
    <${Card} title="History" note=${commands.length ? `${commands.length}` : ""}>
      ${commands.length === 0 && html`<${Empty} icon="speech">No command in this run yet.<//>`}
      <ul class="history">
        ${commands.map(
          (command) => html`<${Row} key=${command.command_id} command=${command} isChosen=${command.command_id === chosen} isPaused=${isPaused} onChoose=${onChoose} />`,
        )}
      </ul>
    <//>
  `;
}

function Row({ command, isChosen, isPaused, onChoose }) {
  const { text, tone, icon } = standingOf(command.story, isPaused);
  return html`
    <li>
      <button type="button" class="history-row" aria-pressed=${isChosen ? "true" : "false"} onClick=${() => onChoose(command.command_id)}>
        <span class="history-words">${command.text || command.story.plan?.goal || "A plan as JSON"}</span>
        <${Badge} tone=${tone} icon=${icon}>${text}<//>
        <span class="quiet small history-note">${clock(command.given_s)} · ${sourceWords(command.source)}</span>
        <${Icon} name="chevron" />
      </button>
    </li>
  `;
}
