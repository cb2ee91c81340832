/** Draw one alarm: which part, why, which value against which limit, since when, seen by whom. */

import { useAct } from "../asking.js";
import { clock, duration, sentence, significant, words } from "../format.js";
import { Icon } from "../icons.js";
import { Badge, Button } from "../parts.js";
import { html } from "../ui.js";
import { acknowledge } from "./alarms.js";

const TONES = { critical: "bad", error: "bad", warning: "warn", info: "info" };

export function AlarmRow({ alarm, isShort }) {
  const [see, isBusy] = useAct(() => acknowledge(alarm.id));
  const tone = alarm.ended_s ? "quiet" : (TONES[alarm.severity] ?? "bad");
  return html`
    <li class="alarm" data-tone=${tone}>
      <${Icon} name="alert" />
      <div class="grow">
        <p class="alarm-head">
          <strong>${sentence(alarm.text)}</strong>
          <${Badge} tone=${tone}>${alarm.severity}<//>
          ${alarm.ended_s && html`<${Badge}>over since ${clock(alarm.ended_s)}<//>`}
          ${alarm.count > 1 && html`<span class="quiet small">${alarm.count} times</span>`}
        </p>
        <p class="quiet small"><${Facts} alarm=${alarm} /></p>
        ${alarm.advice && !isShort && html`<p class="small">${sentence(alarm.advice)}</p>`}
        ${alarm.acknowledged_by && html`<p class="quiet small">Seen by ${alarm.acknowledged_by}${alarm.acknowledged_s ? ` at ${clock(alarm.acknowledged_s)}` : ""}</p>`}
      </div>
      ${!alarm.acknowledged_by && html`<${Button} needs="operator" icon="check" busy=${isBusy} onClick=${see} aria-label="Acknowledge: ${alarm.text}">${isShort ? "" : "Acknowledge"}<//>`}
    </li>
  `;
}

function Facts({ alarm }) {
  const unit = alarm.unit ?? "";
  const number = (name, value) => (Number.isFinite(value) ? `${name} ${significant(value)} ${unit}`.trim() : null);
  return [
    alarm.process && words(alarm.process),
    alarm.subject && words(alarm.subject),
    number("measured", alarm.measured),
    number("limit", alarm.limit),
    Number.isFinite(alarm.age_s) && `age ${duration(alarm.age_s)}`,
    `since ${clock(alarm.since_s)}`,
  ]
    .filter(Boolean)
    .join(" · ");
}
