/** List the alarms: those that nobody has seen, then the others. */

import { useAct } from "../asking.js";
import { Button, Card, Empty } from "../parts.js";
import { html } from "../ui.js";
import { AlarmRow } from "./alarm_row.js";
import { acknowledge, gravestFirst, useAlarms } from "./alarms.js";

export function AlarmsPanel() {
  const { all, open, stale, known } = useAlarms();
  const seen = all.filter((alarm) => alarm.acknowledged_by);
  const [seeAll, isBusy] = useAct(() => Promise.all(open.map(({ id }) => acknowledge(id))));
  const actions = open.length > 1 && html`<${Button} needs="operator" icon="check" busy=${isBusy} onClick=${seeAll}>Acknowledge all<//>`;
  return html`
    <div class="stack">
      <${Card} title="Open" note=${`${open.length}`} stale=${stale ? true : undefined} actions=${actions}>
        <${List} alarms=${gravestFirst(open)} none=${known ? "No open alarm." : "Nobody tells of alarms."} />
      <//>
      <${Card} title="Seen" note=${`${seen.length}`}>
        <${List} alarms=${seen.toSorted((a, b) => b.since_s - a.since_s)} none="Nothing yet." />
      <//>
    </div>
  `;
}

function List({ alarms, none }) {
  if (!alarms.length) return html`<${Empty}>${none}<//>`;
  return html`<ul class="alarms">${alarms.map((alarm) => html`<${AlarmRow} key=${alarm.id} alarm=${alarm} />`)}</ul>`;
}
