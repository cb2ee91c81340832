/** Show the newest missions: how far each is, what each part of the robot did for it, and its end. */

import { post } from "../api.js";
import { useAct } from "../asking.js";
import { PauseAct } from "../command/pause.js";
import { sourceWords } from "../command/words.js";
import { clock, sentence } from "../format.js";
import { useTopic } from "../following.js";
import { Badge, Button, Card, Notice } from "../parts.js";
import { html, useEffect, useState } from "../ui.js";
import { LaneChart } from "./lane_chart.js";
import { newestMoment } from "./lanes.js";
import { Objectives } from "./objectives.js";
import { MISSION_STATES, isOpen, rowsOf, whenWords } from "./states.js";

/** Return the newest missions, the newest first, and the robot's time. */
export function useMissions() {
  const { data, age_s } = useTopic("missions");
  const missions = data?.missions ?? [];
  return { missions, trouble: data?.trouble ?? "", now_s: newestMoment(missions) + (age_s ?? 0) };
}

/** The card of all missions; `chosen` is the one that was chosen in the history. */
export function MissionsCard({ shown, commands, chosen }) {
  const planner = useTopic("planner_status");
  const { missions, trouble, now_s } = shown;
  if (!missions.length) return null;
  const open = missions.filter(isOpen).length;
  return html`
    <${Card} title="Missions" note=${open ? `${open} open` : ""} stale=${planner.stale} age_s=${planner.age_s}>
      <div class="missions">
        ${trouble && html`<${Notice} tone="warn" icon="alert">They do not outlive a restart: ${trouble}<//>`}
        ${missions.map(
          (mission) => html`<${Mission} key=${mission.mission_id} mission=${mission} commands=${commands} now_s=${now_s} isChosen=${mission.mission_id === chosen} />`,
        )}
      </div>
    <//>
  `;
}

function Mission({ mission, commands, now_s, isChosen }) {
  const [isShown, setShown] = useState(isOpen(mission));
  useEffect(() => {
    if (isChosen) setShown(true);
  }, [isChosen]);
  const { text, tone, icon } = MISSION_STATES[mission.state] ?? MISSION_STATES.planning;
  const rows = rowsOf(mission);
  const done = rows.filter((row) => row.state === "completed").length;
  return html`
    <details class="mission" open=${isShown} onToggle=${(event) => setShown(event.currentTarget.open)}>
      <summary>
        <span class="said-words grow">${mission.mission.goal}</span>
        <span class="quiet small">${done} of ${rows.length} done</span>
        <${Badge} tone=${tone} icon=${icon}>${text}<//>
      </summary>
      ${isShown && html`<${Body} mission=${mission} rows=${rows} commands=${commands} now_s=${now_s} />`}
    </details>
  `;
}

function Body({ mission, rows, commands, now_s }) {
  const goesOn = ["executing", "paused"].includes(mission.state);
  const actionsOf = (name) => newestOf(commands, mission.mission_id, name)?.story.actions;
  const names = new Map(rows.flatMap((row) => row.parts.map((part) => [part.name, row.parts.length > 1 ? part.words : row.words])));
  const facts = [mission.source && `by ${sourceWords(mission.source)}`, `given at ${clock(mission.given_unix_s)}`, whenWords(mission)];
  const isToldBelow = rows.some((row) => row.error);
  const said = commands.find((one) => one.command_id === mission.mission_id)?.story.said ?? [];
  return html`
    <div class="stack">
      <div class="row">
        <p class="quiet small mission-facts">${facts.filter(Boolean).join(" · ")}</p>
        <div class="mission-acts">
          ${goesOn && html`<${PauseAct} />`}
          ${isOpen(mission) && html`<${Cancel} mission=${mission} />`}
        </div>
      </div>
      ${mission.error && !isToldBelow && html`<p class="quiet">${sentence(mission.error)}</p>`}
      <${Objectives} rows=${rows} actionsOf=${actionsOf} />
      ${said.map((text, place) => html`<p key=${place} class="robot-says">“${text}”</p>`)}
      <${LaneChart} mission=${mission} now_s=${now_s} goesOn=${goesOn} nameOf=${(name) => names.get(name) ?? name} />
    </div>
  `;
}

function Cancel({ mission }) {
  const [cancel, isBusy] = useAct(() => post(`missions/${encodeURIComponent(mission.mission_id)}/cancel`));
  return html`
    <${Button} needs="operator" kind="danger" icon="cross" busy=${isBusy} onClick=${cancel} aria-label="Cancel the mission ${mission.mission.goal}">Cancel<//>
  `;
}

/** Return the newest command of a part: it may have been tried more than once. */
function newestOf(commands, mission, part) {
  return commands.find((one) => one.mission === mission && one.part === part);
}
