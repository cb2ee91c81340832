/** Type or say a command, watch its plan, answer, cancel, look back. */

import { AgentsCard } from "../command/agents_card.js";
import { CommandCard } from "../command/command_card.js";
import { Composer } from "../command/composer.js";
import { History } from "../command/history.js";
import { given, openCommand, useCommands } from "../command/store.js";
import { useTopic } from "../following.js";
import { sentence } from "../format.js";
import { MissionsCard, useMissions } from "../missions/missions_card.js";
import { More, Notice } from "../parts.js";
import { html, useState } from "../ui.js";

export function View() {
  const commands = useCommands();
  const [chosen, setChosen] = useState(null);
  const open = openCommand(commands);
  const all = given(commands);
  const shown = all.find((one) => one.command_id === chosen) ?? open ?? all[0];
  const missions = useMissions();
  const isMission = missions.missions.some((one) => one.mission_id === shown?.command_id); // has a card of its own
  return html`
    <div class="view-head"><h1>Command</h1></div>
    <${Refusal} />
    <${Prohibitions} />
    <div class="command-view">
      <div class="stack">
        <${Composer} />
        ${shown && !isMission && html`<${CommandCard} command=${shown} title=${shown === open ? "Under way" : "Command"} />`}
        <${MissionsCard} shown=${missions} commands=${commands} chosen=${shown?.command_id} />
        <${AgentsCard} />
      </div>
      <${History} commands=${all} chosen=${shown?.command_id} onChoose=${setChosen} />
    </div>
  `;
}

/** List what somebody has forbidden for good. */
function Prohibitions() {
  const standing = useTopic("planner_status").data?.prohibitions ?? [];
  if (!standing.length) return null;
  return html`
    <${Notice} icon="alert">Told not to ${standing.join("; not to ")}. “You may … again” permits it.<//>
  `;
}

/** Say why no command is taken now, before one is given. */
function Refusal() {
  const table = useTopic("process_table").data;
  const control = useTopic("control_status");
  const isUnarmed = !control.stale && control.data?.state !== "armed";
  const why = table?.refusal || (isUnarmed && "The robot is not armed.");
  if (!why) return null;
  return html`
    <${Notice} tone="warn" icon="alert" actions=${html`<${More} href="#/now">Now<//>`}>No command is carried out now. ${sentence(why)}<//>
  `;
}
