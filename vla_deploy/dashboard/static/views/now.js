/** Show in one glance whether the robot may move, and if not, why. */

import { useTopic } from "../following.js";
import { Card } from "../parts.js";
import { safetyWords } from "../safety_words.js";
import { html } from "../ui.js";

export function View() {
  const { data, stale, age_s } = useTopic("control_status");
  const told = safetyWords(data, stale);
  return html`
    <div class="view-head"><h1>Now</h1></div>
    <${Card} title=${told.title} stale=${stale} age_s=${age_s}>${told.cause || told.means}<//>
  `;
}
