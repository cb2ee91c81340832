/** Show the gravest alarms that nobody has acknowledged. */

import { AlarmRow } from "../events/alarm_row.js";
import { useAlarms } from "../events/alarms.js";
import { Card, Empty, More } from "../parts.js";
import { html } from "../ui.js";

const SHOWN = 4;

export function AlarmsCard() {
  const { open, stale, known } = useAlarms();
  const shown = open.slice(0, SHOWN);
  const more = open.length - shown.length;
  return html`
    <${Card} title="Alarms" note=${open.length ? `${open.length} open` : ""} stale=${stale ? true : undefined} actions=${html`<${More} href="#/events/alarms">All<//>`}>
      ${!known && html`<${Empty} icon="question">Nobody tells of alarms.<//>`}
      ${known && shown.length === 0 && html`<${Empty} icon="check">No open alarm.<//>`}
      <ul class="alarms">${shown.map((alarm) => html`<${AlarmRow} key=${alarm.id} alarm=${alarm} isShort=${true} />`)}</ul>
      ${more > 0 && html`<p class="quiet small">and ${more} more</p>`}
    <//>
  `;
}
