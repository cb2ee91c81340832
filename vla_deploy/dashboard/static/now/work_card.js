/** Say what the robot does now: the command, its action, what the hands hold. */

import { PauseAct, standingOf, usePaused } from "../command/pause.js";
import { given, openCommand, useCommands } from "../command/store.js";
import { Timeline } from "../command/timeline.js";
import { words } from "../format.js";
import { useTopic } from "../following.js";
import { Objectives } from "../missions/objectives.js";
import { Badge, Card, Empty, More } from "../parts.js";
import { html } from "../ui.js";

export function WorkCard() {
  const { data, stale, age_s } = useTopic("executor_status");
  const commands = useCommands();
  const command = openCommand(commands) ?? given(commands)[0];
  const more = html`<${PauseAct} /><${More} href="#/command">Command<//>`;
  return html`
    <${Card} title="Work" note=${data && !stale ? workWords(data) : ""} stale=${stale} age_s=${age_s} actions=${more}>
      <div class="stack">
        ${command ? html`<${Work} command=${command} />` : html`<${Empty} icon="speech">No command in this run yet.<//>`}
        ${data && html`<${Hands} holding=${data.holding} />`}
      </div>
    <//>
  `;
}

function workWords({ state, skill }) {
  return [state === "paused" && "paused", skill && words(skill)].filter(Boolean).join(": ") || words(state);
}

function Work({ command }) {
  const { story } = command;
  const { text, tone, icon } = standingOf(story, usePaused());
  return html`
    <p class="row">
      <span class="said-words grow">${command.text || story.plan?.goal || "A plan as JSON"}</span>
      <${Badge} tone=${tone} icon=${icon}>${text}<//>
    </p>
    ${story.asked && html`<p><strong>${story.asked.question}</strong> <${More} href="#/command">Answer<//></p>`}
    ${story.why && story.state !== "done" && html`<p class="step-why">${story.why}</p>`}
    ${story.objectives.length > 0 && html`<${Objectives} rows=${story.objectives} />`}
    <${Timeline} actions=${story.actions} />
  `;
}

function Hands({ holding }) {
  const held = Object.entries(holding ?? {});
  if (!held.length) return null;
  return html`
    <dl class="pairs">
      ${held.map(([hand, what]) => html`<div key=${hand}><dt>${words(hand)}</dt><dd>${what ? `holds ${words(what)}` : "empty"}</dd></div>`)}
    </dl>
  `;
}
