/** Say in one glance whether the robot may move; if not: why, who, which value, which limit. */

import { duration, sentence, significant, words } from "../format.js";
import { useTopic } from "../following.js";
import { Icon } from "../icons.js";
import { Freshness } from "../parts.js";
import { boundsWords, lastStopWords, reactionWords, safetyWords, unitOf } from "../safety_words.js";
import { html } from "../ui.js";
import { Acts } from "./acts.js";

export function SafetyCard() {
  const { data, stale, age_s } = useTopic("control_status");
  const told = safetyWords(data, stale);
  const lastStop = stale ? null : lastStopWords(data?.last_stop);
  const detail = stale ? "" : (data?.detail ?? "");
  return html`
    <section class="safety" data-tone=${told.tone} aria-label="Safety state">
      <span class="safety-sign"><${Icon} name=${told.icon} /></span>
      <div class="safety-words" role="status">
        <p class="safety-title">
          ${told.title}
          ${data?.estop_latched && html`<span class="badge" data-tone="bad"><${Icon} name="hand" />Emergency stop latched</span>`}
          <${Freshness} stale=${stale} age_s=${age_s} />
        </p>
        <p class="safety-cause">${told.cause || told.means}</p>
        ${told.cause && html`<p class="quiet">${told.means}</p>`}
        ${detail && html`<p class="safety-detail">${sentence(detail)}</p>`}
        ${lastStop && html`<p class=${lastStop.failed ? "safety-detail" : "quiet"}>${lastStop.text}</p>`}
      </div>
      <${Acts} control=${data} stale=${stale} />
      ${data?.cause && html`<${Numbers} control=${data} stale=${stale} />`}
    </section>
  `;
}

/** The numbers behind a cause; a cell without one is left out. */
function Numbers({ control, stale }) {
  const unit = unitOf(control.cause);
  const withUnit = (value) => (value === null || value === undefined ? null : `${significant(value)} ${unit}`.trim());
  const cells = [
    ["What", words(control.subject)],
    ["Measured", withUnit(control.measured)],
    ["Limit", withUnit(control.limit)],
    ["Age when judged", control.age_s ? duration(control.age_s) : null],
    ["Reaction", reactionWords(control.reaction)],
    ["Base", boundsWords(control).join("; ")],
  ].filter(([, value]) => value);
  return html`
    <dl class="safety-numbers" data-stale=${stale ? "yes" : null}>
      ${cells.map(([name, value]) => html`<div key=${name}><dt>${name}</dt><dd>${value}</dd></div>`)}
    </dl>
  `;
}
