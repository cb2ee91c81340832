/** Show in one glance whether the robot may move, if not why, and what it does. */

import { AlarmsCard } from "../now/alarms_card.js";
import { PlaceCard, SensesCard } from "../now/place_card.js";
import { PowerCard } from "../now/power_card.js";
import { ProcessesCard } from "../now/processes_card.js";
import { SafetyCard } from "../now/safety_card.js";
import { WorkCard } from "../now/work_card.js";
import { html } from "../ui.js";

export function View() {
  return html`
    <h1 class="out-of-sight">Now</h1>
    <div class="now">
      <${SafetyCard} />
      <div class="now-columns">
        <div class="stack"><${WorkCard} /><${SensesCard} /></div>
        <div class="stack"><${AlarmsCard} /><${PlaceCard} /></div>
        <div class="stack"><${PowerCard} /></div>
        <div class="stack"><${ProcessesCard} /></div>
      </div>
    </div>
  `;
}
