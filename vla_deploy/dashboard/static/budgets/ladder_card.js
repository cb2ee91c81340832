/** The degrade ladder: which measures are in force, which were, and why. */

import { useTopic } from "../following.js";
import { age, duration, sentence } from "../format.js";
import { Badge, Card, Empty, Notice } from "../parts.js";
import { html } from "../ui.js";
import { stepWords } from "./lines.js";

/** Show the ladder's state in words. */
export function LadderCard() {
  const { data, stale, age_s } = useTopic("budget");
  const ladder = data?.ladder;
  const calm = ladder && ladder.taken.length === 0;
  const label = calm ? html`<${Badge} tone="ok" icon="check">nothing is held back<//>` : null;
  return html`
    <${Card} title="Ladder" stale=${stale} age_s=${age_s} label=${label}>
      ${data?.stop?.stop && html`<${Notice} tone="bad" icon="alert">${data.stop.reason}<//>`}
      ${ladder ? html`<${Steps} ladder=${ladder} />` : html`<${Empty} icon="gauge">The supervisor has told no ladder yet.<//>`}
    <//>
  `;
}

function Steps({ ladder }) {
  return html`
    ${ladder.taken.length === 0
      ? html`<p>Every process works as its profile says. When a budget is broken for long enough, one measure after the other is taken here.</p>`
      : html`
          <ol class="steps">
            ${ladder.taken.map(
              (step) => html`
                <li>
                  <strong>${sentence(stepWords(step))}</strong>
                  <span class="quiet">for ${duration(step.since_s)}, because ${step.why}</span>
                </li>
              `,
            )}
          </ol>
        `}
    ${ladder.history.length > 0 && html`<${Past} changes=${ladder.history} />`}
  `;
}

function Past({ changes }) {
  return html`
    <h3>Latest changes</h3>
    <ul class="past">
      ${changes.toReversed().slice(0, 8).map(
        (one) => html`
          <li>
            <span class="quiet">${age(one.ago_s)}</span>
            <${Badge} tone=${one.taken ? "warn" : "ok"}>${one.taken ? "taken" : "undone"}<//>
            <span>${stepWords(one)}<span class="quiet"> ${one.why}</span></span>
          </li>
        `,
      )}
    </ul>
  `;
}
