/** See what the robot uses of its computer and its buses, now and over time. */

import { BusCard } from "../budgets/bus_card.js";
import { HistoryCards } from "../budgets/history_cards.js";
import { LadderCard } from "../budgets/ladder_card.js";
import { PeriodCard } from "../budgets/period_card.js";
import { TopicsCard } from "../budgets/topics_card.js";
import { ProcessCard, TotalCard } from "../budgets/usage_card.js";
import { html } from "../ui.js";

export function View() {
  return html`
    <div class="view-head"><h1>Budgets</h1></div>
    <div class="budgets-view">
      <${TotalCard} />
      <${LadderCard} />
      <${ProcessCard} />
    </div>
    <${HistoryCards} />
    <div class="budgets-view">
      <${PeriodCard} />
      <${BusCard} />
      <${TopicsCard} />
    </div>
  `;
}
