/** List the alarms: those that last, those that have ended unseen, those that somebody has seen. */

import { useAct } from "../asking.js";
import { Button, Card, Empty } from "../parts.js";
import { html } from "../ui.js";
import { AlarmRow } from "./alarm_row.js";
import { acknowledge, useAlarms } from "./alarms.js";

export function AlarmsPanel() {
  const { open, over, seen, stale, known } = useAlarms();
  return html`
    <div class="stack">
      <${Group} title="Open" alarms=${open} stale=${stale ? true : undefined} none=${known ? "No open alarm." : "Nobody tells of alarms."} />
      ${over.length > 0 && html`<${Group} title="Over, and seen by nobody" alarms=${over} />`}
      ${seen.length > 0 && html`<${Group} title="Seen" alarms=${seen} />`}
    </div>
  `;
}

function Group({ title, alarms, stale, none }) {
  const unseen = alarms.filter((alarm) => !alarm.acknowledged_by);
  const [seeAll, isBusy] = useAct(() => Promise.all(unseen.map(({ id }) => acknowledge(id))));
  const actions = unseen.length > 1 && html`<${Button} needs="operator" icon="check" busy=${isBusy} onClick=${seeAll}>Acknowledge all<//>`;
  return html`
    <${Card} title=${title} note=${`${alarms.length}`} stale=${stale} actions=${actions}>
      ${alarms.length === 0 && html`<${Empty}>${none}<//>`}
      <ul class="alarms">${alarms.map((alarm) => html`<${AlarmRow} key=${alarm.id} alarm=${alarm} />`)}</ul>
    <//>
  `;
}
